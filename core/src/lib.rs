//! One calibrated camera on a robot as a range finder, and its picture stream as a map.
//!
//! The crate is a pipeline, and its modules are the stages in order; each depends only on the ones
//! above it:
//!
//! | module | takes | gives |
//! |---|---|---|
//! | [`geometry`] | a pixel of the floor | range and bearing with covariance |
//! | [`image`] | rows of grey pixels | smoothed rows, gradients, edge masks |
//! | [`lines`] | edge masks | straight lines and floor corners, each with its covariance |
//! | `proposals` | rows of grey pixels | more corners of the floor, each with its probability |
//! | [`features`] | a grey picture | keypoints and descriptors, matches |
//! | [`homography`] | matches | a homography with its covariance, the robot's motion over the floor |
//! | [`association`] | corners and landmarks | who is who |
//! | [`slam`] | odometry and measurements | pose, map and their joint covariance |
//! | [`pipeline`] | rows of pictures and odometry | all of it |
//! | [`calibration`] | known points, vertical edges or a drive | the camera's mount with its covariance |
//!
//! `proposals` is there with the feature of that name, which hosts turn on: it stands beside [`lines`], and [`pipeline`] does not use
//! it yet.
//!
//! Everything is `no_std`, without a heap and without `unsafe`. Elementary functions come from `libm` on
//! every target, and no multiplication is fused with an addition, so that the same input gives the same
//! bits on a Cortex-M, in a browser and on a host.
#![no_std]
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

#[cfg(test)]
extern crate std;

#[cfg(feature = "alloc")]
extern crate alloc;

mod error;
mod real;
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
pub mod slam;

pub use error::{Error, Result};
/// The matrices of this interface.
pub use nalgebra;
pub use real::Real;
