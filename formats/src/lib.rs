//! The files of monorange, for programs that run on a host or in a browser.
//!
//! | module | what |
//! |---|---|
//! | [`files`] | every format that is read or written, one module each |
//! | `bags` | recordings of ROS 2: MCAP and rosbag2 (feature `bags`) |
//! | `board` | a printed chessboard in pictures: the camera, and the mount (feature `board`) |
//! | [`pictures`] | folders of pictures, decoding to grey |
//! | [`evaluation`] | a trajectory and a map against the truth |
//! | [`extraction`] | the core's extractor with memory from the heap |
//! | [`draw`] | overlays |
//! | [`grid`] | an occupancy grid of scans, for map servers |
//! | [`report`] | what a run writes: `report.html` and the plain files |
//! | [`plausibility`] | what numbers that cannot be meant look like, a file a subject |
//! | [`warnings`] | what looks wrong and is used all the same |
//! | [`sensor_log`] | the filter on the log of another sensor |
//!
//! Elementary functions are `libm`'s, here as in the core: what the page writes must not differ in a last bit from what
//! the command line writes. Every [`Error`] names the file, the line or field, the cause and what to do.
#[cfg(feature = "bags")]
pub mod bags;
#[cfg(feature = "board")]
pub mod board;
pub mod draw;
mod error;
pub mod evaluation;
pub mod extraction;
pub mod files;
pub mod grid;
pub mod pictures;
pub mod plausibility;
pub mod report;
pub mod sensor_log;
pub mod warnings;

pub use error::{Error, Result, nearest};
