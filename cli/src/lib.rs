//! What the command `monorange` is made of: its files, its drawings, its report and its commands.
//!
//! | module | what |
//! |---|---|
//! | [`files`] | every format that is read or written, one module each |
//! | [`pictures`] | folders of pictures, decoding to grey |
//! | [`evaluation`] | a trajectory and a map against the truth |
//! | [`calibration`] | the mount from points, drives or vertical edges |
//! | [`extraction`] | the core's extractor with memory from the heap |
//! | [`draw`] | overlays |
//! | [`report`] | what a run writes: `report.html` and the plain files |
//! | [`reproduce`] | the paper's tables and figures |
//! | [`sensor_log`] | the filter on the log of another sensor |
//! | [`commands`] | one module a command, and nothing else |
//!
//! Without the feature `command` only the formats and figures remain, and with `report` what a run writes: for the
//! page in the browser. Elementary functions are `libm`'s, here as in the core: what the page writes must not differ
//! in a last bit.
//!
//! A command reads everything and checks it before it writes anything; what it writes appears whole or not at
//! all ([`files::Outputs`]). Every [`Error`] names the file, the line or field, the cause and what to do.
#[cfg(feature = "command")]
pub mod calibration;
#[cfg(feature = "command")]
pub mod commands;
#[cfg(feature = "report")]
pub mod draw;
mod error;
pub mod evaluation;
pub mod extraction;
pub mod files;
#[cfg(feature = "command")]
pub mod pictures;
#[cfg(feature = "report")]
pub mod report;
#[cfg(feature = "command")]
pub mod reproduce;
pub mod sensor_log;

pub use error::{Error, Result, nearest};
