//! Camera and poses in closed form, where the search begins.
use super::{BoardPoint, BoardPose, UNDETERMINED};
use crate::Result;
use crate::geometry::{Camera, Distortion};
use crate::homography::{Match, direct_linear_transform};
use alloc::vec::Vec;
use nalgebra::{Matrix2, Matrix3, Vector2};

/// The camera without distortion, and the boards' poses.
pub(super) fn start(
    width: usize,
    height: usize,
    views: &[&[BoardPoint]],
) -> Result<(Camera<f64>, Vec<BoardPose>)> {
    let centre = Vector2::new(width as f64 - 1.0, height as f64 - 1.0) / 2.0;
    let homographies: Vec<_> = views
        .iter()
        .map(|view| homography(view.iter().map(|point| (point.on_board, point.pixel - centre))))
        .collect();
    let focal = focal_of(homographies.iter().flatten()).filter(|focal| {
        let sound = |focal: f64| (0.2..20.0).contains(&(focal / width as f64));
        sound(focal.x) && sound(focal.y)
    });
    // Boards that all face the camera tell no focal length; the search then ends in large standard deviations.
    let focal = focal.unwrap_or(Vector2::from_element(width as f64));
    let camera = Camera::new(width, height, focal.into(), centre.into(), 0.0, Distortion::default())?;
    let poses = views.iter().map(|view| pose(&camera, view)).collect::<Option<Vec<_>>>();
    poses.map(|poses| (camera, poses)).ok_or(UNDETERMINED)
}

/// Where the camera sees the board, by the homography from board to rays.
pub(super) fn pose(camera: &Camera<f64>, points: &[BoardPoint]) -> Option<BoardPose> {
    let seen = points.iter().filter_map(|point| Some((point.on_board, camera.ray_from_pixel(point.pixel)?)));
    let matrix = homography(seen)?;
    let columns = matrix.fixed_columns::<2>(0);
    let scale = 2.0 / (columns.column(0).norm() + columns.column(1).norm());
    let scale = if matrix.m33 < 0.0 { -scale } else { scale };
    let [first, second] = [columns.column(0) * scale, columns.column(1) * scale];
    let nearly = Matrix3::from_columns(&[first, second, first.cross(&second)]);
    let parts = nearly.svd(true, true);
    let rotation = parts.u? * parts.v_t?;
    Some(BoardPose { rotation, translation: matrix.column(2) * scale }).filter(|pose| {
        pose.rotation.determinant() > 0.5 && pose.translation.iter().all(|entry| entry.is_finite())
    })
}

fn homography(pairs: impl Iterator<Item = (Vector2<f64>, Vector2<f64>)>) -> Option<Matrix3<f64>> {
    let matches: Vec<_> = pairs.map(|(from, to)| Match::new(from, to, 1.0, 1.0)).collect();
    direct_linear_transform(&matches).ok()
}

/// f_u and f_v from two equations a view in 1/f_u² and 1/f_v², by least squares; pixels are counted from the principal point.
fn focal_of<'a>(homographies: impl Iterator<Item = &'a Matrix3<f64>>) -> Option<Vector2<f64>> {
    let (mut matrix, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for homography in homographies {
        // Columns of like size: each view weighs alike, and the third row is not lost beside pixels.
        let scale = homography.fixed_columns::<2>(0).norm();
        let [a, b] = [homography.column(0) / scale, homography.column(1) / scale];
        let mut add = |row: Vector2<f64>, value: f64| {
            matrix += row * row.transpose();
            right += row * value;
        };
        add(Vector2::new(a.x * b.x, a.y * b.y), -a.z * b.z);
        add(Vector2::new(a.x * a.x - b.x * b.x, a.y * a.y - b.y * b.y), b.z * b.z - a.z * a.z);
    }
    let squares = matrix.try_inverse()? * right;
    (squares.x > 0.0 && squares.y > 0.0).then(|| squares.map(|square| 1.0 / libm::sqrt(square)))
}
