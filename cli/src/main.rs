//! The `monorange` command.
fn main() {}
