//! How the camera sits on the robot.
//!
//! ```text
//! robot_from_cam = R_z(yaw) · R_y(tilt) · R_x(roll) · R₀,      R₀ = [ 0  0  1
//!                                                                    −1  0  0
//!                                                                     0 −1  0 ]
//! ```
//!
//! R₀ turns the optical frame (x right, y down, z forward) into the robot's (x forward, y left, z up, REP-103).
//! Tilt is positive downwards (a right-handed turn about y), yaw positive to the left, roll positive when the
//! camera's left side is up. Height is the lens centre's above the floor, forward and left its lever arm.
use crate::{Error, Real, Result};
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2, Vector3};

/// The pose of the camera on the robot; the floor is the plane z = 0 of the robot's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount<T> {
    height: T,
    tilt: T,
    roll: T,
    yaw: T,
    lever_arm: Vector2<T>,
}

/// The mount's parameters in the order of [`Mount::parameters`] and of every Jacobian w.r.t. the mount.
pub const MOUNT_PARAMETERS: [&str; 6] = ["height", "tilt", "roll", "yaw", "forward", "left"];

/// Standard deviations of a mount that was measured by hand, with a tape and a spirit level: 1 cm and 1° (judgement; the mount's
/// own calibration replaces them). They stand where nothing else is known: in a new configuration, in a rig file that gives
/// none, on the page.
pub const MOUNT_STD_BY_HAND: [f64; 6] = [0.01, DEGREE, DEGREE, DEGREE, 0.01, 0.01];
const DEGREE: f64 = core::f64::consts::PI / 180.0;

impl<T: Real> Mount<T> {
    /// A mount from height (m), tilt, roll, yaw (rad) and lever arm forward, left (m).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when height is not above 0, tilt is beyond ±90°, or a number is not finite.
    pub fn new(parameters: [T; 6]) -> Result<Self> {
        const NAMES: [&str; 6] =
            ["mount.height", "mount.tilt", "mount.roll", "mount.yaw", "mount.forward", "mount.left"];
        for (name, value) in NAMES.into_iter().zip(parameters) {
            if !value.is_finite() {
                return Err(Error::OutOfRange { name, value: value.to_f64(), expected: "a finite number" });
            }
        }
        let [height, tilt, roll, yaw, forward, left] = parameters;
        if height <= T::zero() {
            let value = height.to_f64();
            return Err(Error::OutOfRange { name: "mount.height", value, expected: "above 0 (metres)" });
        }
        if tilt.abs() >= T::frac_pi_2() {
            let value = tilt.to_f64();
            return Err(Error::OutOfRange {
                name: "mount.tilt", value, expected: "between −90° and 90°"
            });
        }
        Ok(Self { height, tilt, roll, yaw, lever_arm: Vector2::new(forward, left) })
    }

    /// Height, tilt, roll, yaw, forward, left: m and rad.
    pub fn parameters(&self) -> [T; 6] {
        [self.height, self.tilt, self.roll, self.yaw, self.lever_arm.x, self.lever_arm.y]
    }

    /// Height of the lens centre above the floor in metres.
    pub fn height(&self) -> T {
        self.height
    }

    /// The same mount over a plane that is so much higher than the floor; below the plane its height is negative.
    pub(super) fn over(mut self, plane: T) -> Self {
        self.height -= plane;
        self
    }

    /// Tilt downwards in radians.
    pub fn tilt(&self) -> T {
        self.tilt
    }

    /// (forward, left) of the lens centre in the robot's frame in metres.
    pub fn lever_arm(&self) -> Vector2<T> {
        self.lever_arm
    }

    /// The rotation that takes a direction of the optical frame to the robot's.
    pub fn robot_from_cam(&self) -> Matrix3<T> {
        let (sr, cr) = self.roll.sin_cos();
        let [[sy, cy], [st, ct]] = [self.yaw, self.tilt].map(|angle| {
            let (sin, cos) = angle.sin_cos();
            [sin, cos]
        });
        let (zero, one) = (T::zero(), T::one());
        let yaw = Matrix3::new(cy, -sy, zero, sy, cy, zero, zero, zero, one);
        let tilt = Matrix3::new(ct, zero, st, zero, one, zero, -st, zero, ct);
        let roll = Matrix3::new(one, zero, zero, zero, cr, -sr, zero, sr, cr);
        let optical = Matrix3::new(zero, zero, one, -one, zero, zero, zero, -one, zero);
        yaw * tilt * roll * optical
    }

    /// ∂(X, Y)/∂(height, tilt, roll, yaw, forward, left) of the floor point seen along `direction` (robot frame,
    /// pointing below the horizon).
    pub(super) fn floor_by_mount(&self, direction: &Vector3<T>) -> SMatrix<T, 2, 6> {
        let (sy, cy) = self.yaw.sin_cos();
        let (st, ct) = self.tilt.sin_cos();
        // A turn by dα about a unit axis moves the direction by axis × direction · dα.
        let tilt_axis = Vector3::new(-sy, cy, T::zero());
        let roll_axis = Vector3::new(cy * ct, sy * ct, -st);
        let by_direction = self.floor_by_direction(direction);
        let by_height = direction.xy() / -direction.z;
        let by_tilt = by_direction * tilt_axis.cross(direction);
        let by_roll = by_direction * roll_axis.cross(direction);
        let by_yaw = by_direction * Vector3::z().cross(direction);
        let lever = Matrix2::identity();
        SMatrix::<T, 2, 6>::from_columns(&[
            by_height,
            by_tilt,
            by_roll,
            by_yaw,
            lever.column(0).into_owned(),
            lever.column(1).into_owned(),
        ])
    }

    /// ∂(X, Y)/∂direction.
    pub(super) fn floor_by_direction(&self, direction: &Vector3<T>) -> SMatrix<T, 2, 3> {
        let down = -direction.z;
        let (scale, slope) = (self.height / down, direction.xy() * (self.height / (down * down)));
        SMatrix::<T, 2, 3>::new(scale, T::zero(), slope.x, T::zero(), scale, slope.y)
    }
}
