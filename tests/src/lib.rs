//! Cross-crate tests of monorange live in the files beside this one.
