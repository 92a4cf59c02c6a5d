//! Grey pictures by rows.
mod grey;

pub use grey::Grey;
