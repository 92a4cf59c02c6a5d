//! Recorded drives of ROS 2: MCAP files and rosbag2's SQLite files, read and written.
//!
//! | module | what |
//! |---|---|
//! | [`Bag`] | the files of a recording, and their messages |
//! | [`Reading`] | a recording that is read a stretch at a time |
//! | [`Recording`] | pictures, odometry, camera and mount that were chosen among its topics |
//! | [`Recorder`] | a run as an MCAP file, for Foxglove, rerun and `ros2 bag` |
//!
//! Everything is Rust: chunks are unpacked by ruzstd and lz4_flex, SQLite's pages are read by [`sqlite`](self), so that no
//! C compiler is needed. Pictures stay in the file and are read one at a time. Messages are CDR (XCDR version 1, either
//! byte order); their layouts are those of ROS 2's `common_interfaces` and `tf2_msgs`.
mod bag;
mod choice;
mod mcap_file;
mod messages;
mod mount;
mod picture;
mod reading;
mod recorder;
mod recording;
mod schemas;
mod sqlite;

pub use bag::{Bag, Topic};
pub use choice::Choice;
pub use messages::seconds;
pub use reading::Reading;
pub use recorder::{MAP_EVERY, Recorder};
pub use recording::{Frame, Recording};
