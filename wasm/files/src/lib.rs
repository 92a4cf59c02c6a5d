//! The parts of the page that are not needed for the first picture, in a module that loads when they are.
//!
//! | module | in JavaScript |
//! |---|---|
//! | [`layout`] | `layout`: what the files of a drop are to one another, read by the readers of `monorange` |
//! | [`exif`] | `focalOf`: the focal length that a photograph gives itself |
//! | [`mount_fit`] | `fitMount`: the mount from floor points that someone clicked and measured |
//! | [`watch`] | `Watch`: pictures that look wrong |
//! | [`sample`] | `Sample`: the simulated sequence, as the files that `monorange simulate` would write |
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

mod drop;
pub mod exif;
pub mod kinds;
pub mod layout;
pub mod mount_fit;
pub mod sample;
pub mod watch;

pub use layout::Layout;
pub use sample::Sample;
