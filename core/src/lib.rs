#![doc = include_str!("../README.md")]
#![no_std]
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

#[cfg(test)]
extern crate std;

#[cfg(feature = "alloc")]
extern crate alloc;

mod error;
mod real;
pub mod setting;
mod sort;
mod vectors;

pub mod association;
pub mod calibration;
pub mod features;
pub mod geometry;
pub mod homography;
pub mod image;
pub mod lines;
pub mod pipeline;
#[cfg(feature = "proposals")]
pub mod proposals;
pub mod scan;
pub mod slam;

pub use error::{Error, Result};
/// The matrices of this interface.
pub use nalgebra;
pub use real::Real;
