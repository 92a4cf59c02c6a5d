//! What the command `monorange` is made of: its commands, its progress, its outputs. The formats are `monorange_formats`'.
//!
//! | module | what |
//! |---|---|
//! | [`sequence`] | a recorded drive: pictures, times, odometry and truth, checked against each other |
//! | [`mcap_output`] | the run as a recording of ROS 2 |
//! | [`outputs`] | files that appear whole or not at all |
//! | [`overlays`] | pictures drawn over the inputs, over nobody else's |
//! | [`warnings`] | warnings on standard error, a line each |
//! | [`interrupt`] | Ctrl-C and its like: what is unfinished goes |
//! | [`calibration`] | the mount from points, drives or vertical edges |
//! | [`reproduce`] | the paper's tables and figures |
//! | [`commands`] | one module a command, and nothing else |
//!
//! A command reads everything and checks it before it writes anything; what it writes appears whole or not at
//! all ([`outputs::Outputs`]). Every [`Error`](monorange_formats::Error) names the file, the line or field, the cause and what to do.
pub mod calibration;
pub mod commands;
pub mod interrupt;
pub mod mcap_output;
pub mod outputs;
pub mod overlays;
pub mod reproduce;
pub mod sequence;
pub mod warnings;
