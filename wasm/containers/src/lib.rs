//! Files that hold many, opened in the page's worker: what is in them is given as the files of a folder would be.
//!
//! | module | in JavaScript |
//! |---|---|
//! | [`archive`] | `Archive`: the files in a ZIP archive, each unpacked when it is read |
//! | [`recording`] | `Recording`: a recording of ROS 2 as pictures, times, odometry and rig; by the command line's own reader |
//!
//! Files stay with the browser: [`blob`] reads the pieces that are asked for.
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

pub mod archive;
pub mod blob;
pub mod recording;
