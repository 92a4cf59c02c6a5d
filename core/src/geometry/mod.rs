//! Pixel ↔ ray ↔ floor ↔ range and bearing, and plane poses.
mod attitude;
mod camera;
mod lens;
mod mount;
mod newton;
mod pose;
mod range_finder;
mod shutter;

#[cfg(test)]
mod jacobian_tests;

pub use camera::Camera;
pub use lens::{Distortion, Lens};
pub use mount::{MOUNT_PARAMETERS, MOUNT_STD_BY_HAND, Mount};
pub(crate) use pose::told_from_noise;
pub use pose::{Pose, wrap_angle};
pub use range_finder::{
    NoFloor, RangeFinder, Ranged, Sighting, range_bearing_by_floor, range_bearing_from_floor,
};
