//! Checks that span crates, in one program: what they share is compiled once, and they use all cores together.
//! `cargo test -p monorange-tests scan::` runs those of one file.
mod board;
mod corridor;
mod dynamic_corridor;
mod features;
mod floor_corner_accuracy;
mod ground_motion;
mod homography;
mod homography_chance;
mod mount_calibration;
mod pipeline;
mod relocation;
mod reproduce;
mod scan;
mod slam_consistency;
mod slam_dense;
mod slam_limits;
mod slam_logs;
mod slam_map;
mod trouble;
mod virtual_range_finder;
mod visual_odometry;
