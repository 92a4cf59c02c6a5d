//! The mount from a board that lies on the floor.
//!
//! ```text
//! n = ± R e_z, upwards;    h = −n · t;    n = (−sin ρ cos τ, −cos ρ cos τ, −sin τ) in the optical frame
//! ```
//!
//! with height h, tilt τ and roll ρ. The floor has no forward: yaw is told only where a side of the board is known to point along the
//! robot's x axis, and then to a quarter turn, of which the one nearest to straight ahead is taken.
use super::{BoardPose, BoardView};
use crate::Result;
use crate::geometry::Mount;
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector2, Vector3, Vector4, Vector6};

/// A mount that a board on the floor tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FloorMount {
    /// Height, tilt, roll, and yaw where it is told; the lens stands above the robot's origin.
    pub mount: Mount<f64>,
    /// Standard deviations of height (m), tilt, roll and yaw (rad); the yaw's is 0 where it is not told.
    pub std: [f64; 4],
}

/// How far a board that was laid on a floor is off its plane, m (judgement: paper on cardboard, joints between boards).
const UNEVEN: f64 = 0.5e-3;
/// How well a side of a board is laid along the robot, rad (judgement: a line of the floor, by eye).
const LAID: f64 = core::f64::consts::PI / 180.0;

/// The mount of a camera that sees a board on the floor; `corners` are the least and greatest place of its points, `along`: a side
/// of the board points along the robot's x axis.
///
/// # Errors
/// [`Error::OutOfRange`](crate::Error::OutOfRange) where no mount looks down like that: the board stands upright.
pub fn mount_on_floor(view: &BoardView, corners: [Vector2<f64>; 2], along: bool) -> Result<FloorMount> {
    let [least, greatest] = corners;
    let centre = (least + greatest) / 2.0;
    let at = |pose: &BoardPose| parameters(pose, centre, along);
    let [height, tilt, roll, yaw] = at(&view.pose);
    let mount = Mount::new([height, tilt, roll, yaw, 0.0, 0.0])?;
    let by_pose: [Vector4<f64>; 6] = core::array::from_fn(|index| {
        let moved = |step: f64| {
            let step = Vector6::from_fn(|row, _| if row == index { step } else { 0.0 });
            Vector4::from(at(&view.pose.moved(&step)))
        };
        (moved(STEP) - moved(-STEP)) / (2.0 * STEP)
    });
    let jacobian = SMatrix::<f64, 4, 6>::from_columns(&by_pose);
    let extent = (greatest - least).min();
    let covariance = view.covariance + unevenness(&view.pose, centre, extent);
    let variances = (jacobian * covariance * jacobian.transpose()).diagonal();
    let [height, tilt, roll, yaw] = variances.map(libm::sqrt).into();
    let yaw = if along { libm::hypot(yaw, LAID) } else { 0.0 };
    Ok(FloorMount { mount, std: [height, tilt, roll, yaw] })
}

/// Of central differences.
const STEP: f64 = 1e-6;

/// Height, tilt, roll, yaw.
fn parameters(pose: &BoardPose, centre: Vector2<f64>, along: bool) -> [f64; 4] {
    let place = pose.point_in_camera(centre);
    let normal: Vector3<f64> = pose.rotation.column(2).into_owned();
    let up = if normal.dot(&place) > 0.0 { -normal } else { normal };
    let tilt = libm::asin((-up.z).clamp(-1.0, 1.0));
    let roll = libm::atan2(-up.x, -up.y);
    let yaw = if along { yaw(pose, tilt, roll) } else { 0.0 };
    [-up.dot(&place), tilt, roll, yaw]
}

/// What turns a side of the board along the robot's x axis, by the least turn.
fn yaw(pose: &BoardPose, tilt: f64, roll: f64) -> f64 {
    let Ok(level) = Mount::new([1.0, tilt, roll, 0.0, 0.0, 0.0]) else { return 0.0 };
    let side = level.robot_from_cam() * pose.rotation.column(0);
    let bearing = libm::atan2(side.y, side.x);
    let quarter = core::f64::consts::FRAC_PI_2;
    libm::round(bearing / quarter) * quarter - bearing
}

/// What a board that does not lie flat adds: a turn about its centre within the floor, and a shift along the normal.
fn unevenness(pose: &BoardPose, centre: Vector2<f64>, extent: f64) -> Matrix6<f64> {
    let normal: Vector3<f64> = pose.rotation.column(2).into_owned();
    let along_normal = normal * normal.transpose();
    let turn = (Matrix3::identity() - along_normal) * (UNEVEN / (extent / 2.0)) * (UNEVEN / (extent / 2.0));
    let arm = pose.point_in_camera(centre) - pose.translation;
    // The centre stays where it is: t moves by −ω × arm = arm × ω.
    let mut by_turn = SMatrix::<f64, 6, 3>::zeros();
    by_turn.fixed_rows_mut::<3>(0).copy_from(&Matrix3::identity());
    by_turn.fixed_rows_mut::<3>(3).copy_from(&arm.cross_matrix());
    let mut sum = by_turn * turn * by_turn.transpose();
    let mut shift = sum.fixed_view_mut::<3, 3>(3, 3);
    shift += along_normal * (UNEVEN * UNEVEN);
    sum
}
