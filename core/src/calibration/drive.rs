//! From a drive: floor points must move in the picture as the wheels say.
//!
//! ```text
//! g = floor point of pixel uₐ through m,      g' = T⁻¹ g,  T = (Δx, Δy, Δθ) of the wheels
//! r = u_b − π(g'; m),       W⁻¹ = Σ_b + J_a Σ_a J_aᵀ
//! ```
//!
//! The wheels' error e ~ N(0, Q) is common to all points of a step. It is an unknown of every step and is eliminated
//! there (Schur): with A = Σ J_eᵀ W J_e + Q⁻¹, B = Σ J_eᵀ W J_m and c = Σ J_eᵀ W r,
//!
//! ```text
//! Σ J_mᵀ W J_m − Bᵀ A⁻¹ B,      Σ J_mᵀ W r − Bᵀ A⁻¹ c,      Σ rᵀ W r − cᵀ A⁻¹ c
//! ```
//!
//! Steps must not overlap, nor share a picture, or their errors would not be independent. Jacobians are central
//! differences in `f64`, which are good to nine digits here. Height is known from the length of the way, so a scale
//! error of the wheels goes into it whole.
use super::{Fitted, MountFit, Normal, solve, undetermined};
use crate::geometry::{Camera, Mount, Pose, RangeFinder};
use crate::{Error, Result};
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2, Vector3};

/// A floor point in two pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackedPoint {
    /// Where the first picture has it, px.
    pub before: Vector2<f64>,
    /// Where the second has it, px.
    pub after: Vector2<f64>,
    /// Covariance of the first, px².
    pub covariance_before: Matrix2<f64>,
    /// Covariance of the second, px².
    pub covariance_after: Matrix2<f64>,
}

/// What the wheels say between two pictures, and the points that both show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveStep<'a> {
    /// (Δx, Δy, Δθ) of the robot in its frame at the first picture: m, rad.
    pub motion: Vector3<f64>,
    /// Its covariance.
    pub covariance: Matrix3<f64>,
    /// The points.
    pub points: &'a [TrackedPoint],
}

/// 99.9 % of χ² with two degrees of freedom: beyond it, the two pictures do not show the same point.
const GATE: f64 = 13.82;
/// Of the mount before the first fit: 5 % of height, 3° each.
const PRIOR: [f64; 6] = [0.05, 0.0524, 0.0524, 0.0524, 0.05, 0.05];
const ROUNDS: usize = 3;

/// The mount with which the points move as the wheels say, and how many points were used.
///
/// # Errors
/// [`Error::OutOfRange`] where the drive does not determine what is fitted.
pub fn fit_drive(
    camera: &Camera<f64>,
    first: &Mount<f64>,
    steps: &[DriveStep<'_>],
    fitted: Fitted,
) -> Result<(MountFit, usize)> {
    let scale = [first.height(), 1.0, 1.0, 1.0, 1.0, 1.0];
    let mut spread = nalgebra::Matrix6::zeros();
    for (index, ((prior, scale), fitted)) in PRIOR.into_iter().zip(scale).zip(fitted.0).enumerate() {
        let std = if fitted { prior * scale } else { 0.0 };
        if let Some(entry) = spread.get_mut((index, index)) {
            *entry = std * std;
        }
    }
    let mut last = Err(Error::Size { name: "drive steps", got: steps.len(), expected: 1 });
    let mut guess = *first;
    for _ in 0..ROUNDS {
        let judge = RangeFinder::new(*camera, guess);
        let fits = |step: &DriveStep<'_>, point: &TrackedPoint| {
            let Some(local) = linearise(&judge, step, point) else { return false };
            let common = local.by_motion * step.covariance * local.by_motion.transpose()
                + local.by_mount * spread * local.by_mount.transpose();
            let inverse = (local.noise + common).try_inverse();
            inverse.is_some_and(|inverse| local.residual.dot(&(inverse * local.residual)) <= GATE)
        };
        let fit = solve(&guess, fitted, |mount| {
            let finder = RangeFinder::new(*camera, *mount);
            let mut normal = Normal::default();
            for step in steps {
                eliminate(&finder, step, |point| fits(step, point), &mut normal)?;
            }
            normal.cost.is_finite().then_some(normal)
        })?;
        // A mount by hand is better than that.
        if fit.std().into_iter().zip(PRIOR).zip(scale).any(|((std, prior), scale)| std > prior * scale) {
            return Err(undetermined(fit.freedom));
        }
        let used =
            steps.iter().map(|step| step.points.iter().filter(|point| fits(step, point)).count()).sum();
        (guess, spread) = (fit.mount, fit.covariance);
        last = Ok((fit, used));
    }
    last
}

/// Adds a step's sums without its wheels' error. `None` where a point that is used is not on the floor.
fn eliminate(
    finder: &RangeFinder<f64>,
    step: &DriveStep<'_>,
    fits: impl Fn(&TrackedPoint) -> bool,
    normal: &mut Normal,
) -> Option<()> {
    let mut own = step.covariance.try_inverse()?;
    let mut shared = SMatrix::<f64, 3, 6>::zeros();
    let mut pull = Vector3::zeros();
    for point in step.points.iter().filter(|point| fits(point)) {
        let local = linearise(finder, step, point)?;
        let weight = local.noise.try_inverse()?;
        let (motion, mount) = (local.by_motion.transpose() * weight, local.by_mount.transpose() * weight);
        own += motion * local.by_motion;
        shared += motion * local.by_mount;
        pull += motion * local.residual;
        normal.matrix += mount * local.by_mount;
        normal.gradient += mount * local.residual;
        normal.cost += local.residual.dot(&(weight * local.residual));
        normal.count += 2;
    }
    let inverse = own.try_inverse()?;
    normal.matrix -= shared.transpose() * inverse * shared;
    normal.gradient -= shared.transpose() * inverse * pull;
    normal.cost -= pull.dot(&(inverse * pull));
    Some(())
}

/// A residual and what it depends on: ∂(predicted pixel)/∂m and ∂/∂(Δx, Δy, Δθ).
struct Local {
    residual: Vector2<f64>,
    noise: Matrix2<f64>,
    by_mount: SMatrix<f64, 2, 6>,
    by_motion: SMatrix<f64, 2, 3>,
}

fn linearise(finder: &RangeFinder<f64>, step: &DriveStep<'_>, point: &TrackedPoint) -> Option<Local> {
    let camera = *finder.camera();
    let parameters = finder.mount().parameters();
    let with = |parameters: [f64; 6], motion: Vector3<f64>, pixel: Vector2<f64>| {
        predict(&RangeFinder::new(camera, Mount::new(parameters).ok()?), motion, pixel)
    };
    let predicted = predict(finder, step.motion, point.before)?;
    const STEP: f64 = 1e-6;
    let slope = |plus: Vector2<f64>, minus: Vector2<f64>| (plus - minus) / (2.0 * STEP);
    let mut by_mount = SMatrix::<f64, 2, 6>::zeros();
    for (index, mut column) in by_mount.column_iter_mut().enumerate() {
        let moved = |by: f64| {
            let mut moved = parameters;
            *moved.get_mut(index)? += by;
            with(moved, step.motion, point.before)
        };
        column.copy_from(&slope(moved(STEP)?, moved(-STEP)?));
    }
    let mut by_motion = SMatrix::<f64, 2, 3>::zeros();
    for (index, mut column) in by_motion.column_iter_mut().enumerate() {
        let moved = |by: f64| {
            let mut motion = step.motion;
            *motion.get_mut(index)? += by;
            predict(finder, motion, point.before)
        };
        column.copy_from(&slope(moved(STEP)?, moved(-STEP)?));
    }
    let mut by_pixel = Matrix2::zeros();
    for (index, mut column) in by_pixel.column_iter_mut().enumerate() {
        let moved = |by: f64| {
            let mut pixel = point.before;
            *pixel.get_mut(index)? += by;
            predict(finder, step.motion, pixel)
        };
        column.copy_from(&slope(moved(STEP)?, moved(-STEP)?));
    }
    let noise = point.covariance_after + by_pixel * point.covariance_before * by_pixel.transpose();
    Some(Local { residual: point.after - predicted, noise, by_mount, by_motion })
}

/// Where the second picture has the floor point of a pixel of the first.
fn predict(finder: &RangeFinder<f64>, motion: Vector3<f64>, pixel: Vector2<f64>) -> Option<Vector2<f64>> {
    let floor = finder.floor_from_pixel(pixel).ok()?;
    let then = Pose::new(motion.x, motion.y, motion.z).inverse_transform(floor);
    finder.pixel_from_floor_unbounded(then).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const TRUE: [f64; 6] = [0.41, 0.2, 0.014, 0.02, 0.0, 0.0];

    fn camera() -> Camera<f64> {
        Camera::new(320, 240, [365.0, 365.0], [160.0, 120.0], 0.0, Default::default()).unwrap()
    }

    fn tracks(finder: &RangeFinder<f64>, motion: Vector3<f64>) -> Vec<TrackedPoint> {
        let pixels = [[60.0, 120.0], [250.0, 118.0], [150.0, 100.0], [200.0, 140.0]];
        let track = |pixel: [f64; 2]| {
            let before = Vector2::from(pixel);
            let after = predict(finder, motion, before).unwrap();
            let covariance = Matrix2::identity() * 0.01;
            TrackedPoint { before, after, covariance_before: covariance, covariance_after: covariance }
        };
        pixels.into_iter().map(track).collect()
    }

    #[test]
    fn exact_tracks_give_the_mount_back_and_a_wrong_one_is_left_out() {
        let finder = RangeFinder::new(camera(), Mount::new(TRUE).unwrap());
        let motions = [Vector3::new(0.4, 0.0, 0.0), Vector3::new(0.35, 0.05, 0.3)];
        let mut points = motions.map(|motion| tracks(&finder, motion));
        points[0][1].after.y += 60.0;
        let covariance = Matrix3::from_diagonal(&Vector3::new(1e-6, 1e-6, 1e-6));
        let steps: Vec<_> = motions
            .iter()
            .zip(&points)
            .map(|(motion, points)| DriveStep { motion: *motion, covariance, points })
            .collect();
        let by_hand = Mount::new([0.4, 0.205, 0.0, 0.0, 0.0, 0.0]).unwrap();
        let (fit, used) = fit_drive(&camera(), &by_hand, &steps, Fitted::HEIGHT_AND_ANGLES).unwrap();
        assert_eq!(used, 7);
        for (fitted, is) in fit.mount.parameters().iter().zip(TRUE) {
            assert!((fitted - is).abs() < 1e-6, "{fit:?}");
        }
    }

    #[test]
    fn standing_still_tells_nothing() {
        let mount = Mount::new(TRUE).unwrap();
        let points = tracks(&RangeFinder::new(camera(), mount), Vector3::zeros());
        let covariance = Matrix3::identity() * 1e-6;
        let step = DriveStep { motion: Vector3::zeros(), covariance, points: &points };
        assert!(fit_drive(&camera(), &mount, &[step], Fitted::HEIGHT_AND_ANGLES).is_err());
    }
}
