//! The camera on its mount that the paper used, and the same one mounted by hand.
use monorange_core::Result;
use monorange_core::geometry::{Camera, Distortion, Mount, RangeFinder};

/// Standard deviations of the default rig's mount, in the order of
/// [`MOUNT_PARAMETERS`](monorange_core::geometry::MOUNT_PARAMETERS): 5 mm of height, 0.3° of each angle.
pub const MOUNT_STD: [f64; 6] = [0.005, 0.3 * DEGREE, 0.3 * DEGREE, 0.3 * DEGREE, 0.0, 0.0];

/// Standard deviation of a pixel, Table 1.
pub const PIXEL_STD: [f64; 2] = [0.10083, 0.10936];

const DEGREE: f64 = core::f64::consts::PI / 180.0;

/// Table 1's camera of 320×240 pixels, 0.40 m above the floor and tilted down by 12°.
///
/// # Errors
/// None in practice: the numbers are the paper's.
pub fn default_rig() -> Result<RangeFinder<f64>> {
    let lens = Distortion { k1: -0.22776, k2: 0.36413, p1: -0.00545, p2: -0.00192, k3: 0.0 };
    let camera = Camera::new(320, 240, [365.12674, 365.02905], [145.79917, 114.50956], 0.0, lens)?;
    Ok(RangeFinder::new(camera, Mount::new([0.40, 12.0 * DEGREE, 0.0, 0.0, 0.0, 0.0])?))
}

/// The same camera as it really sits when a hand mounted it: yaw +1.2°, tilt −0.3°, roll +0.8°, 1 % higher.
///
/// # Errors
/// As [`Mount::new`].
pub fn hand_mounted(nominal: &RangeFinder<f64>) -> Result<RangeFinder<f64>> {
    let [height, tilt, roll, yaw, forward, left] = nominal.mount().parameters();
    let off = [height * 1.01, tilt - 0.3 * DEGREE, roll + 0.8 * DEGREE, yaw + 1.2 * DEGREE, forward, left];
    Ok(RangeFinder::new(*nominal.camera(), Mount::new(off)?))
}
