//! The parts of the page that are not needed for the first picture, in a module that loads when they are.
//!
//! | module | in JavaScript |
//! |---|---|
//! | [`inputs`] | `rig`, `camera`, `times`, `truth`, `Wheels`: the readers of `monorange` |
//! | [`sample`] | `Sample`: the simulated sequence, as the files that `monorange simulate` would write |
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

pub mod inputs;
pub mod sample;

pub use sample::Sample;
