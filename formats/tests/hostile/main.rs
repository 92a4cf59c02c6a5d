//! What nobody means to do: damaged files, and calls in any order.
mod calls;
mod chance;
mod files;
mod maps;
mod work;
