//! Two views from a camera that rides over a plane: rotation, translation, floor homography, epipolar form.
use super::estimate::elements;
use crate::Real;
use crate::geometry::{Pose, RangeFinder};
use nalgebra::{Matrix3, SMatrix, SVector, Vector2, Vector3};

/// Speed along x, slip along y (both times Δt, m), turn, change of the body's pitch and roll between the pictures,
/// and the body's pitch at the first one (rad): the parameters of a [`PlanarStep`], in this order.
pub(super) const STEP: usize = 6;

/// How the robot moved between two pictures.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlanarStep<T>(pub(super) SVector<T, STEP>);

impl<T: Real> PlanarStep<T> {
    pub(super) fn new(forward: T, slip: T, turn: T) -> Self {
        let mut parameters = SVector::<T, STEP>::zeros();
        parameters.fixed_rows_mut::<3>(0).copy_from(&Vector3::new(forward, slip, turn));
        Self(parameters)
    }

    /// The step that ends at a pose: the inverse of the arc.
    pub(super) fn from_pose(pose: &Pose<T>) -> Self {
        let (a, b) = arc(pose.heading);
        let (x, y) = (pose.x, pose.y);
        let determinant = a * a + b * b;
        Self::new((a * x + b * y) / determinant, (a * y - b * x) / determinant, pose.heading)
    }

    fn parts(&self) -> [T; STEP] {
        self.0.into()
    }

    /// Path and turn.
    pub(super) fn arc(&self) -> Vector2<T> {
        let [forward, _, turn, ..] = self.parts();
        Vector2::new(forward, turn)
    }

    /// old_robot_from_robot.
    pub(super) fn pose(&self) -> Pose<T> {
        let [forward, slip, turn, ..] = self.parts();
        let (a, b) = arc(turn);
        Pose::new(a * forward - b * slip, b * forward + a * slip, turn)
    }

    /// ∂(x, y, heading)/∂parameters.
    pub(super) fn pose_by_step(&self) -> SMatrix<T, 3, STEP> {
        let [forward, slip, turn, ..] = self.parts();
        let ((a, b), (da, db)) = (arc(turn), arc_by_turn(turn));
        let mut jacobian = SMatrix::<T, 3, STEP>::zeros();
        let columns = [
            Vector3::new(a, b, T::zero()),
            Vector3::new(-b, a, T::zero()),
            Vector3::new(da * forward - db * slip, db * forward + da * slip, T::one()),
        ];
        for (index, column) in columns.into_iter().enumerate() {
            jacobian.set_column(index, &column);
        }
        jacobian
    }
}

/// (sin θ/θ, (1 − cos θ)/θ): the arc's chord for a unit of path.
fn arc<T: Real>(turn: T) -> (T, T) {
    let t2 = turn * turn;
    if t2 < T::lit(SERIES_BELOW) {
        let a = T::one() - t2 / T::lit(6.0) * (T::one() - t2 / T::lit(20.0));
        return (a, turn * T::lit(0.5) * (T::one() - t2 / T::lit(12.0) * (T::one() - t2 / T::lit(30.0))));
    }
    let (sin, cos) = turn.sin_cos();
    (sin / turn, (T::one() - cos) / turn)
}

/// Derivatives of [`arc`].
fn arc_by_turn<T: Real>(turn: T) -> (T, T) {
    let t2 = turn * turn;
    if t2 < T::lit(SERIES_BELOW) {
        let a = -turn / T::lit(3.0) * (T::one() - t2 / T::lit(10.0));
        return (a, T::lit(0.5) - t2 / T::lit(8.0) * (T::one() - t2 / T::lit(18.0)));
    }
    let (sin, cos) = turn.sin_cos();
    ((turn * cos - sin) / t2, (turn * sin - T::one() + cos) / t2)
}

/// θ² below which the closed forms of the arc cancel and their series hold to 1e-9.
const SERIES_BELOW: f64 = 1e-2;

/// What of the mount the second view follows from.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlanarRig<T> {
    robot_from_cam: Matrix3<T>,
    lever: Vector3<T>,
    /// n/h of the mount at rest.
    floor: Vector3<T>,
    pub(super) height: T,
}

impl<T: Real> PlanarRig<T> {
    pub(super) fn new(finder: &RangeFinder<T>) -> Self {
        let height = finder.mount().height();
        let lever = finder.mount().lever_arm().push(T::zero());
        Self { robot_from_cam: *finder.robot_from_cam(), lever, floor: -finder.horizon() / height, height }
    }

    /// The floor point (X, Y) in the robot's frame of a ray, or `None` at or above the horizon.
    pub(super) fn floor_from_ray(&self, ray: Vector2<T>) -> Option<Vector2<T>> {
        let ray = ray.push(T::one());
        let inverse_depth = self.floor.dot(&ray);
        let below = inverse_depth > T::zero();
        below.then(|| (self.robot_from_cam * ray).xy() / inverse_depth + self.lever.xy())
    }

    /// cam2_from_cam1 with its derivatives: c₂ = C₂ᵀ [R_z(−θ)(C₁ c₁ + l − d) − l] with C₁ = R_y(tilt) C and
    /// C₂ = R_y(tilt + pitch) R_x(roll) C, where C is the mount's robot_from_cam.
    pub(super) fn view(&self, step: &PlanarStep<T>) -> View<T> {
        let [_, _, turn, pitch, roll, tilt] = step.parts();
        let (zero, one) = (T::zero(), T::one());
        let (st, ct) = turn.sin_cos();
        let back = Matrix3::new(ct, st, zero, -st, ct, zero, zero, zero, one);
        let back_by_turn = Matrix3::new(-st, ct, zero, -ct, -st, zero, zero, zero, zero);
        let (first_pitch, first_by_tilt) = about_y(tilt);
        let (second_pitch, second_by_pitch) = about_y(tilt + pitch);
        let (second_roll, second_by_roll) = about_x(roll);
        let mount = &self.robot_from_cam;
        let robot_from_cam = first_pitch * mount;
        let cam_from_robot = (second_pitch * second_roll * mount).transpose();
        let [mut first_by, mut second_by, mut back_by] = [[Matrix3::zeros(); STEP]; 3];
        let [_, _, by_turn, _, _, _] = &mut back_by;
        *by_turn = back_by_turn;
        let [_, _, _, _, _, by_tilt] = &mut first_by;
        *by_tilt = first_by_tilt * mount;
        let [_, _, _, by_pitch, by_roll, by_tilt] = &mut second_by;
        *by_pitch = (second_by_pitch * second_roll * mount).transpose();
        *by_roll = (second_pitch * second_by_roll * mount).transpose();
        *by_tilt = *by_pitch;
        let moved = step.pose().position().push(zero);
        let offset = back * (self.lever - moved) - self.lever;
        let floor = |robot_from_cam: &Matrix3<T>| robot_from_cam.row(2).transpose() / -self.height;
        let still =
            ViewByStep { rotation: Matrix3::zeros(), translation: Vector3::zeros(), floor: Vector3::zeros() };
        let mut view = View {
            rotation: cam_from_robot * back * robot_from_cam,
            translation: cam_from_robot * offset,
            floor: floor(&robot_from_cam),
            by_step: [still; STEP],
        };
        let pose_by_step = step.pose_by_step();
        let factors = first_by.into_iter().zip(second_by).zip(back_by).zip(pose_by_step.column_iter());
        for (by, (((first_by, second_by), back_by), pose_by)) in view.by_step.iter_mut().zip(factors) {
            by.rotation = (second_by * back + cam_from_robot * back_by) * robot_from_cam
                + cam_from_robot * back * first_by;
            let moved_by = pose_by.fixed_rows::<2>(0).push(zero);
            let offset_by = back_by * (self.lever - moved) - back * moved_by;
            by.translation = second_by * offset + cam_from_robot * offset_by;
            by.floor = floor(&first_by);
        }
        view
    }
}

/// R_y(α) and its derivative.
fn about_y<T: Real>(angle: T) -> (Matrix3<T>, Matrix3<T>) {
    let ((s, c), o, i) = (angle.sin_cos(), T::zero(), T::one());
    (Matrix3::new(c, o, s, o, i, o, -s, o, c), Matrix3::new(-s, o, c, o, o, o, -c, o, -s))
}

/// R_x(α) and its derivative.
fn about_x<T: Real>(angle: T) -> (Matrix3<T>, Matrix3<T>) {
    let ((s, c), o, i) = (angle.sin_cos(), T::zero(), T::one());
    (Matrix3::new(i, o, o, o, c, -s, o, s, c), Matrix3::new(o, o, o, o, -s, -c, o, c, -s))
}

/// The second view: c₂ = R c₁ + t, the floor n/h in the first, and all with respect to the step's parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct View<T> {
    pub(super) rotation: Matrix3<T>,
    pub(super) translation: Vector3<T>,
    /// n/h: positive along rays that meet the floor, whose depth is 1/(n/h · ray).
    pub(super) floor: Vector3<T>,
    by_step: [ViewByStep<T>; STEP],
}

#[derive(Clone, Copy, Debug)]
struct ViewByStep<T> {
    rotation: Matrix3<T>,
    translation: Vector3<T>,
    floor: Vector3<T>,
}

impl<T: Real> View<T> {
    /// H = R + t nᵀ/h, of rays on the floor.
    pub(super) fn homography(&self) -> Matrix3<T> {
        self.rotation + self.translation * self.floor.transpose()
    }

    /// ∂H/∂parameters, elements row by row.
    pub(super) fn homography_by_step(&self) -> SMatrix<T, 9, STEP> {
        self.collect(|by| {
            by.rotation + by.translation * self.floor.transpose() + self.translation * by.floor.transpose()
        })
    }

    /// E = [t]× R: x₂ᵀ E x₁ = 0 for whatever stands still.
    pub(super) fn essential(&self) -> Matrix3<T> {
        self.translation.cross_matrix() * self.rotation
    }

    /// ∂E/∂parameters across E, elements row by row: the length of the translation leaves x₂ᵀ E x₁ over its
    /// standard deviation as it is.
    pub(super) fn essential_by_step(&self) -> SMatrix<T, 9, STEP> {
        let jacobian = self.collect(|by| {
            by.translation.cross_matrix() * self.rotation + self.translation.cross_matrix() * by.rotation
        });
        let along = elements(&self.essential()).normalize();
        jacobian - along * along.tr_mul(&jacobian)
    }

    fn collect(&self, derivative: impl Fn(&ViewByStep<T>) -> Matrix3<T>) -> SMatrix<T, 9, STEP> {
        let mut jacobian = SMatrix::<T, 9, STEP>::zeros();
        for (mut column, by) in jacobian.column_iter_mut().zip(&self.by_step) {
            column.copy_from(&elements(&derivative(by)));
        }
        jacobian
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Camera, Mount};
    use proptest::prelude::*;

    fn rig() -> PlanarRig<f64> {
        let camera = Camera::new(320, 240, [365.0; 2], [160.0, 120.0], 0.0, Default::default()).unwrap();
        PlanarRig::new(&RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.03, -0.1, 0.1, -0.05]).unwrap()))
    }

    proptest! {
        #[test]
        fn view_jacobians_agree_with_central_differences(
            parameters in prop::array::uniform6(-0.2..0.2_f64),
        ) {
            let step = PlanarStep(SVector::from(parameters) + SVector::<f64, STEP>::ith(0, 0.5));
            let (view, size) = (rig().view(&step), 1e-6);
            for index in 0..STEP {
                let offset = SVector::<f64, STEP>::ith(index, size);
                let (after, before) =
                    (rig().view(&PlanarStep(step.0 + offset)), rig().view(&PlanarStep(step.0 - offset)));
                let slope = elements(&((after.homography() - before.homography()) / (2.0 * size)));
                prop_assert!((view.homography_by_step().column(index) - slope).norm() < 1e-7, "H {index}");
                // The essential matrix's has no part along E.
                let slope = elements(&((after.essential() - before.essential()) / (2.0 * size)));
                let along = elements(&view.essential()).normalize();
                let across = slope - along * along.dot(&slope);
                prop_assert!((view.essential_by_step().column(index) - across).norm() < 1e-7, "E {index}");
            }
        }

        #[test]
        fn floor_homography_carries_floor_points(x in 1.0..5.0_f64, y in -1.0..1.0_f64, turn in -0.3..0.3_f64) {
            let (rig, step) = (rig(), PlanarStep::new(0.3, 0.02, turn));
            let point = Vector2::new(x, y);
            let lens = rig.lever + Vector3::z() * rig.height;
            let ray = |point: Vector2<f64>| {
                let in_cam = rig.robot_from_cam.tr_mul(&(point.push(0.0) - lens));
                in_cam.xy() / in_cam.z
            };
            let carried = rig.view(&step).homography() * ray(point).push(1.0);
            let after = ray(step.pose().inverse_transform(point));
            prop_assert!((carried.xy() / carried.z - after).norm() < 1e-12);
            prop_assert!((rig.floor_from_ray(ray(point)).unwrap() - point).norm() < 1e-9);
        }

        #[test]
        fn step_of_a_pose_ends_at_it(x in -1.0..1.0_f64, y in -1.0..1.0_f64, turn in -1.5..1.5_f64) {
            let pose = Pose::new(x, y, turn);
            let back = PlanarStep::from_pose(&pose).pose();
            prop_assert!((back.position() - pose.position()).norm() < 1e-9);
        }
    }
}
