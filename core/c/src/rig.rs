use monorange_core::geometry::{self, Distortion, MOUNT_STD_BY_HAND, RangeFinder};

/// ROS' `plumb_bob`, OpenCV's default: distortion k1 k2 p1 p2 k3, then zeros.
pub const MONORANGE_PLUMB_BOB: u32 = 0;
/// OpenCV's rational model: k1 k2 p1 p2 k3 k4 k5 k6.
pub const MONORANGE_RATIONAL: u32 = 1;
/// Fisheye (Kannala and Brandt), ROS' `equidistant`: k1 k2 k3 k4, then zeros.
pub const MONORANGE_EQUIDISTANT: u32 = 2;

/// A camera's calibration.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Camera {
    /// Of its pictures, px.
    pub width: u32,
    /// Of its pictures, px.
    pub height: u32,
    /// f_u, f_v, px.
    pub focal: [f32; 2],
    /// c_u, c_v, px.
    pub principal: [f32; 2],
    /// Between the axes, px a px of the ray; 0 nearly always.
    pub skew: f32,
    /// `MONORANGE_PLUMB_BOB`, `MONORANGE_RATIONAL` or `MONORANGE_EQUIDISTANT`.
    pub lens: u32,
    /// The lens' coefficients.
    pub distortion: [f32; 8],
}

/// How a camera sits on its robot.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Mount {
    /// Of the lens above the floor, m.
    pub height: f32,
    /// Positive downwards, rad.
    pub tilt: f32,
    /// Positive where the camera's left side is up, rad.
    pub roll: f32,
    /// Positive to the left, rad.
    pub yaw: f32,
    /// The lens before the robot's origin, m.
    pub forward: f32,
    /// The lens to the left of the robot's origin, m.
    pub left: f32,
}

impl Mount {
    fn parameters(&self) -> [f32; 6] {
        let Self { height, tilt, roll, yaw, forward, left } = *self;
        [height, tilt, roll, yaw, forward, left]
    }
}

/// A calibrated camera on its mount.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Rig {
    /// The camera.
    pub camera: Camera,
    /// The mount.
    pub mount: Mount,
    /// Standard deviations of the mount; all zero: measured by hand, within 1 cm and 1°.
    pub mount_std: Mount,
}

impl Rig {
    pub(crate) fn finder(&self) -> monorange_core::Result<RangeFinder<f32>> {
        let Camera { width, height, focal, principal, skew, lens, distortion } = self.camera;
        let [k1, k2, p1, p2, k3, k4, k5, k6] = distortion;
        let polynomial = Distortion { k1, k2, p1, p2, k3 };
        let lens = match lens {
            MONORANGE_PLUMB_BOB => geometry::Lens::BrownConrady(polynomial),
            MONORANGE_RATIONAL => geometry::Lens::Rational { above: polynomial, below: [k4, k5, k6] },
            MONORANGE_EQUIDISTANT => geometry::Lens::Equidistant([k1, k2, p1, p2]),
            other => {
                let expected = "MONORANGE_PLUMB_BOB, MONORANGE_RATIONAL or MONORANGE_EQUIDISTANT";
                return Err(monorange_core::Error::OutOfRange {
                    name: "camera.lens",
                    value: other.into(),
                    expected,
                });
            }
        };
        let camera =
            geometry::Camera::with_lens(width as usize, height as usize, focal, principal, skew, lens)?;
        Ok(RangeFinder::new(camera, geometry::Mount::new(self.mount.parameters())?))
    }

    /// Standard deviations of height, tilt, roll, yaw, forward and left.
    pub(crate) fn mount_std(&self) -> [f32; 6] {
        match self.mount_std.parameters() {
            none if none == [0.0; 6] => MOUNT_STD_BY_HAND.map(|std| std as f32),
            given => given,
        }
    }
}
