//! The installed command: what it prints, what it writes, what it refuses.
mod bad_input;
mod calibrate_mount;
mod command;
mod evaluate;
mod help;
mod keypoints;
mod landmarks;
mod matching;
mod range;
mod simulate;
mod slam;
mod slam_log;
