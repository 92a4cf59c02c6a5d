//! The installed command: what it prints, what it writes, what it refuses.
mod bad_input;
mod calibrate_mount;
mod camera_files;
mod command;
mod damage;
mod evaluate;
mod help;
mod keypoints;
mod landmarks;
mod logs;
mod matching;
mod overwriting;
mod pictures;
mod range;
mod simulate;
mod slam;
mod slam_log;
