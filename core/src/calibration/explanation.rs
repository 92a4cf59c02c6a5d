//! What explains floor points of known place: their noise, one bad point, a lever arm that nobody measured, or none of it.
//!
//! Least squares trust every point, and one that was measured badly bends the mount for all. The simplest explanation
//! that agrees with the stated noise is taken, in this order:
//!
//! 1. **noise** alone: the fit's χ² is within its 99 % bound;
//! 2. **one point** is bad, judged by the fit to all others: with d² its squared residual there, whitened by its noise
//!    and the fit's covariance, d²/2 exceeds the 99.9 % quantile of F(2, dof), (dof/2)(0.001^(−2/dof) − 1), times the
//!    others' own s² (at least 1); and without it the others agree with the noise;
//! 3. **the lever arm**: the points were measured from another place than the one below the lens;
//! 4. **several errors**: Cauchy's loss ρ(z) = ln(1 + z²) of each range and each bearing by itself, so that a bad bearing
//!    does not cost its point's range. Iterated with weights 1/(1 + z²); the covariance grows with the square of
//!    1.4826 median |z|, where that is above 1.
//!
//! Every fit starts from the given mount and from others tilted by 5° and 10° more or less, and the best one counts: a
//! tilt by hand is easily so far off that a start from it alone ends in a local minimum.
use super::points::residual;
use super::{Fitted, KnownPoint, MountFit, Normal, PointNoise, deviations, fit_points, solve};
use crate::Result;
use crate::geometry::{Camera, Mount, RangeFinder};
use nalgebra::{Matrix2, Vector2};

/// Why the points lie where they do, beside the mount that was fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Explanation {
    /// Their stated noise.
    Noise,
    /// The point with this index is bad, and was left out.
    OnePoint(usize),
    /// The lens is not above the place that was measured from: `forward` and `left` were fitted too.
    LeverArm,
    /// None of these: several measurements contradict the rest, and count less the more they do.
    SeveralErrors,
}

/// Tilts that a fit starts from, less the given one, rad.
const STARTS: [f64; 5] = [0.0, -0.087, 0.087, -0.175, 0.175];
/// Rounds of weighting anew.
const ROUNDS: usize = 30;

/// The mount that explains the points, from a first guess, and what else had to be assumed; with `lever_arm`, a place
/// that was measured from beside the one below the lens is an explanation too.
///
/// # Errors
/// As [`fit_points`].
pub fn explain_points(
    camera: &Camera<f64>,
    first: &Mount<f64>,
    points: &[KnownPoint],
    noise: &PointNoise,
    fitted: Fitted,
    lever_arm: bool,
) -> Result<(MountFit, Explanation)> {
    let least_squares = |fitted: Fitted| {
        best(first, |start| fit_points(camera, start, points.iter(), noise, fitted), |fit| fit.cost)
    };
    let all = least_squares(fitted);
    if let Ok(fit) = &all
        && fit.is_consistent()
    {
        return Ok((*fit, Explanation::Noise));
    }
    let guess = all.as_ref().map_or(*first, |fit| fit.mount);
    if let Some((fit, index)) = one_bad(camera, [first, &guess], points, noise, fitted) {
        return Ok((fit, Explanation::OnePoint(index)));
    }
    let with_lever_arm = fitted.and_lever_arm();
    if lever_arm
        && fitted != with_lever_arm
        && let Ok(fit) = least_squares(with_lever_arm)
        && fit.freedom > 0
        && fit.is_consistent()
    {
        return Ok((fit, Explanation::LeverArm));
    }
    let robust = best(
        first,
        |start| cauchy(camera, start, points, noise, fitted),
        |fit| loss(&RangeFinder::new(*camera, fit.mount), points, noise),
    )?;
    Ok((robust, Explanation::SeveralErrors))
}

/// The best of the fits from all starts.
fn best(
    first: &Mount<f64>,
    fit: impl Fn(&Mount<f64>) -> Result<MountFit>,
    cost: impl Fn(&MountFit) -> f64,
) -> Result<MountFit> {
    let mut best = fit(first);
    for by in STARTS.into_iter().skip(1) {
        let mut parameters = first.parameters();
        if let Some(tilt) = parameters.get_mut(1) {
            *tilt += by;
        }
        let Ok(found) = Mount::new(parameters).and_then(|start| fit(&start)) else { continue };
        if best.as_ref().is_ok_and(|best| cost(best) <= cost(&found)) {
            continue;
        }
        best = Ok(found);
    }
    best
}

/// The one point that all others contradict while they agree among themselves, and the fit to them.
fn one_bad(
    camera: &Camera<f64>,
    starts: [&Mount<f64>; 2],
    points: &[KnownPoint],
    noise: &PointNoise,
    fitted: Fitted,
) -> Option<(MountFit, usize)> {
    let mut worst: Option<(f64, usize, MountFit)> = None;
    for (index, point) in points.iter().enumerate() {
        let others = points.iter().enumerate().filter(|(other, _)| *other != index).map(|(_, point)| point);
        let fits = starts.map(|start| fit_points(camera, start, others.clone(), noise, fitted).ok());
        let fit = fits.into_iter().flatten().min_by(|a, b| a.cost.total_cmp(&b.cost));
        let Some(fit) = fit.filter(|fit| fit.freedom > 0 && fit.is_consistent()) else { continue };
        let dof = fit.freedom as f64;
        let quantile = 0.5 * dof * (libm::pow(0.001, -2.0 / dof) - 1.0);
        let finder = RangeFinder::new(*camera, fit.mount);
        let ratio = match residual(&finder, point, noise) {
            // Above the horizon of a fit that suits all others.
            None => f64::INFINITY,
            Some((residual, covariance, by_mount)) => {
                let spread = (fit.cost / dof).max(1.0);
                let predicted = covariance * spread + by_mount * fit.covariance * by_mount.transpose();
                let distance =
                    predicted.try_inverse().map_or(0.0, |inverse| residual.dot(&(inverse * residual)));
                0.5 * distance / quantile
            }
        };
        if ratio > 1.0 && worst.is_none_or(|(before, ..)| ratio > before) {
            worst = Some((ratio, index, fit));
        }
    }
    worst.map(|(_, index, fit)| (fit, index))
}

/// The fit with Cauchy's loss of every range and every bearing by itself.
fn cauchy(
    camera: &Camera<f64>,
    first: &Mount<f64>,
    points: &[KnownPoint],
    noise: &PointNoise,
    fitted: Fitted,
) -> Result<MountFit> {
    let weighed = |start: &Mount<f64>, judge: &RangeFinder<f64>| {
        solve(start, fitted, |mount| {
            let finder = RangeFinder::new(*camera, *mount);
            let mut normal = Normal::default();
            for point in points {
                let (residual, covariance, by_mount) = residual(&finder, point, noise)?;
                let trust = deviations(judge, point, noise)?.map(|z| 1.0 / (1.0 + z * z));
                let weight =
                    Matrix2::from_diagonal(&Vector2::from(trust).component_div(&covariance.diagonal()));
                normal.matrix += by_mount.transpose() * weight * by_mount;
                normal.gradient += by_mount.transpose() * weight * residual;
                normal.cost += residual.dot(&(weight * residual));
                normal.count += 2;
            }
            normal.cost.is_finite().then_some(normal)
        })
    };
    let mut fit = weighed(first, &RangeFinder::new(*camera, *first))?;
    for _ in 0..ROUNDS {
        fit = weighed(&fit.mount, &RangeFinder::new(*camera, fit.mount))?;
    }
    let scale = 1.4826 * median_deviation(&RangeFinder::new(*camera, fit.mount), points, noise);
    fit.covariance *= (scale * scale).max(1.0);
    Ok(fit)
}

/// The median of all |z|: 0.67 where the stated noise is right, and hardly moved by what is far off.
fn median_deviation(finder: &RangeFinder<f64>, points: &[KnownPoint], noise: &PointNoise) -> f64 {
    let all = || points.iter().filter_map(|point| deviations(finder, point, noise)).flatten().map(f64::abs);
    let half = all().count().div_ceil(2);
    all().filter(|one| all().filter(|other| other <= one).count() >= half).fold(f64::INFINITY, f64::min)
}

/// Σ ln(1 + z²) of all ranges and bearings.
fn loss(finder: &RangeFinder<f64>, points: &[KnownPoint], noise: &PointNoise) -> f64 {
    let of = |point: &KnownPoint| match deviations(finder, point, noise) {
        Some(z) => z.into_iter().map(|z| libm::log1p(z * z)).sum(),
        None => f64::INFINITY,
    };
    points.iter().map(of).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const TRUE: [f64; 6] = [0.43, 0.22, 0.02, -0.03, 0.0, 0.0];
    const PIXELS: [[f64; 2]; 8] = [
        [40.0, 230.0],
        [280.0, 225.0],
        [60.0, 120.0],
        [250.0, 110.0],
        [160.0, 170.0],
        [100.0, 90.0],
        [220.0, 95.0],
        [30.0, 150.0],
    ];

    fn camera() -> Camera<f64> {
        Camera::new(320, 240, [365.0, 365.0], [160.0, 120.0], 0.0, Default::default()).unwrap()
    }

    /// Points as the true mount sees them, from a place that is this far ahead of the one below the lens.
    fn points(lever_arm: f64) -> Vec<KnownPoint> {
        let finder = RangeFinder::new(camera(), Mount::new(TRUE).unwrap());
        let known = |pixel: [f64; 2]| {
            let pixel = Vector2::from(pixel);
            let place = finder.sight(pixel).unwrap().point_in_robot;
            KnownPoint::from_place(pixel, place - Vector2::new(lever_arm, 0.0))
        };
        PIXELS.into_iter().map(known).collect()
    }

    fn explained(points: &[KnownPoint]) -> (MountFit, Explanation) {
        let by_hand = Mount::new([0.40, 0.14, 0.0, 0.0, 0.0, 0.0]).unwrap();
        let noise = PointNoise { pixel_std_px: 0.3, ..PointNoise::default() };
        explain_points(&camera(), &by_hand, points, &noise, Fitted::HEIGHT_AND_ANGLES, true).unwrap()
    }

    fn height_is_right(fit: &MountFit) -> bool {
        (fit.mount.height() / TRUE[0] - 1.0).abs() < 0.01
    }

    #[test]
    fn good_points_are_explained_by_their_noise() {
        let (fit, explanation) = explained(&points(0.0));
        assert_eq!(explanation, Explanation::Noise);
        assert!(height_is_right(&fit));
    }

    #[test]
    fn one_bad_point_is_found_and_left_out() {
        for bad in 0..PIXELS.len() {
            let mut points = points(0.0);
            points[bad].range_bearing.x *= 1.4;
            let (fit, explanation) = explained(&points);
            assert_eq!(explanation, Explanation::OnePoint(bad), "{fit:?}");
            assert!(height_is_right(&fit));
        }
    }

    #[test]
    fn a_lever_arm_that_was_not_measured_is_fitted() {
        let (fit, explanation) = explained(&points(0.16));
        assert_eq!(explanation, Explanation::LeverArm);
        assert!((fit.mount.lever_arm().x + 0.16).abs() < 1e-3 && height_is_right(&fit), "{fit:?}");
    }

    #[test]
    fn several_bad_bearings_do_not_cost_their_ranges() {
        let mut points = points(0.0);
        for (bad, by) in [(0, 0.14), (3, -0.13), (5, 0.05)] {
            points[bad].range_bearing.y += by;
        }
        let (fit, explanation) = explained(&points);
        assert_eq!(explanation, Explanation::SeveralErrors);
        assert!(height_is_right(&fit), "{fit:?}");
        let finder = RangeFinder::new(camera(), fit.mount);
        let noise = PointNoise { pixel_std_px: 0.3, ..PointNoise::default() };
        let far_off = |point: &KnownPoint| deviations(&finder, point, &noise).unwrap()[1].abs() > 3.0;
        let named: Vec<_> = (0..points.len()).filter(|index| far_off(&points[*index])).collect();
        assert_eq!(named, [0, 3, 5]);
    }
}
