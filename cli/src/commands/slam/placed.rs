//! Poses of one world in another, with their covariances.
use monorange_core::geometry::Pose;
use monorange_formats::files::Stamped;
use nalgebra::{Matrix2, Matrix3, Vector2};

/// In double precision.
pub(super) fn double(pose: Pose<f32>) -> Pose<f64> {
    Pose { x: pose.x.into(), y: pose.y.into(), heading: pose.heading.into() }
}

/// ∂(R(θ) p)/∂θ.
fn lever(turn: &Pose<f64>, point: Vector2<f64>) -> Vector2<f64> {
    let turned = turn.rotation() * point;
    Vector2::new(-turned.y, turned.x)
}

/// A pose's derivatives: a rotation of its place, what the place gains by a turn, and the turn's own.
fn derivative(rotation: Matrix2<f64>, by_turn: Vector2<f64>, turn: f64) -> Matrix3<f64> {
    let mut all = Matrix3::zeros();
    all.fixed_view_mut::<2, 2>(0, 0).copy_from(&rotation);
    all.fixed_view_mut::<2, 1>(0, 2).copy_from(&by_turn);
    all.m33 = turn;
    all
}

/// Covariance of the run's own frame in the map: the pose is known in both, T = X_map X_own⁻¹. Their errors count as independent.
pub(super) fn of_the_frame(
    moved: &Pose<f64>,
    (pose, covariance): &(Pose<f64>, Matrix3<f64>),
    own: &Matrix3<f64>,
) -> Matrix3<f64> {
    let before = moved.inverse().compose(pose);
    let across = lever(moved, before.position());
    let by_map = derivative(Matrix2::identity(), -across, 1.0);
    let by_own = derivative(-moved.rotation(), across, -1.0);
    by_map * covariance * by_map.transpose() + by_own * own * by_own.transpose()
}

/// Puts a pose of the run's own frame into the map.
pub(super) fn put(stamped: &mut Stamped, moved: &Pose<f64>, uncertain: &Matrix3<f64>) {
    let by_frame = derivative(Matrix2::identity(), lever(moved, stamped.pose.position()), 1.0);
    let by_pose = derivative(moved.rotation(), Vector2::zeros(), 1.0);
    stamped.covariance = stamped
        .covariance
        .map(|own| by_frame * uncertain * by_frame.transpose() + by_pose * own * by_pose.transpose());
    stamped.pose = moved.compose(&stamped.pose);
}
