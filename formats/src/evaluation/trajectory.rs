use super::{Align, Alignment, Pair};
use crate::plausibility;
use monorange_core::geometry::{Pose, wrap_angle};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use serde::Serialize;

/// A set of errors in few numbers, in metres or radians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Root of the mean square.
    pub rms: f64,
    /// Mean of the absolute values.
    pub mean: f64,
    /// Median of the absolute values.
    pub median: f64,
    /// Largest absolute value.
    pub max: f64,
}

impl Spread {
    /// The spread of errors; all 0 without any.
    pub fn of(errors: impl IntoIterator<Item = f64>) -> Self {
        let mut sizes: Vec<_> = errors.into_iter().map(f64::abs).collect();
        sizes.sort_by(f64::total_cmp);
        let (Some(&max), Some(&median)) = (sizes.last(), sizes.get(sizes.len() / 2)) else {
            return Self::default();
        };
        let count = sizes.len() as f64;
        let rms = (sizes.iter().map(|size| size * size).sum::<f64>() / count).sqrt();
        Self { rms, mean: sizes.iter().sum::<f64>() / count, median, max }
    }
}

/// Errors of a trajectory.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrajectoryErrors {
    /// Poses compared with the truth.
    pub poses: usize,
    /// Time of the last of them, s: the truth may end before the estimate does.
    pub last_time: f64,
    /// Length of the true path between the first and the last of them, m.
    pub path: f64,
    /// What was fitted before.
    pub align: Align,
    /// The fit.
    pub alignment: Alignment,
    /// Absolute trajectory error.
    pub absolute: Absolute,
    /// Relative error over stretches of the path, where the path is long enough.
    pub relative: Option<Relative>,
    /// Consistency, where the estimate has covariances and nothing was aligned.
    pub nees: Option<Nees>,
}

/// Errors of poses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Absolute {
    /// Of the position, m.
    pub position: Spread,
    /// Of the heading, rad.
    pub heading: Spread,
    /// Of the last position, m.
    pub end_position: f64,
    /// Of the last position, in percent of the path.
    pub end_position_percent: f64,
    /// Of the last heading, rad.
    pub end_heading: f64,
}

/// Errors of the motion over stretches of the path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Relative {
    /// Length of a stretch, m.
    pub delta: f64,
    /// Stretches compared; they overlap, one begins at every pose.
    pub stretches: usize,
    /// Of the translation over a stretch, m.
    pub translation: Spread,
    /// Its root mean square in percent of the stretch.
    pub translation_percent: f64,
    /// Of the rotation over a stretch, rad.
    pub rotation: Spread,
}

/// How honest the covariances are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Nees {
    /// Poses with an invertible covariance.
    pub poses: usize,
    /// Mean; 3 is right, more is over-confident.
    pub mean: f64,
    /// Mean over 3 degrees of freedom; 1 is right.
    pub mean_per_dof: f64,
    /// Of the last pose, over 3.
    pub end_per_dof: f64,
    /// Share of poses whose x, y and heading errors are all inside ±3σ; one whose covariance is none is outside.
    pub inside_3_sigma: f64,
}

/// The errors of a trajectory whose poses were paired with the truth.
pub fn trajectory_errors(pairs: &[Pair], align: Align, delta: f64) -> TrajectoryErrors {
    let points: Vec<_> =
        pairs.iter().map(|pair| (pair.estimate.pose.position(), pair.truth.position())).collect();
    let alignment = Alignment::fit(align, &points);
    if align != Align::Sim2 {
        plausibility::check_scale("path", &points);
    }
    let aligned: Vec<_> =
        pairs.iter().map(|pair| (alignment.pose(&pair.estimate.pose), pair.truth)).collect();
    let travelled = travelled(&aligned);
    let path = travelled.last().copied().unwrap_or_default();
    TrajectoryErrors {
        poses: pairs.len(),
        last_time: pairs.last().map_or(0.0, |pair| pair.estimate.time),
        path,
        align,
        alignment,
        absolute: absolute(&aligned, path),
        relative: relative(&aligned, &travelled, delta),
        nees: if align == Align::None { consistency(pairs) } else { None },
    }
}

type Aligned = (Pose<f64>, Pose<f64>);

/// The way along the true path up to every pose.
fn travelled(poses: &[Aligned]) -> Vec<f64> {
    let steps = poses.windows(2).map(|pair| match pair {
        [(_, a), (_, b)] => (b.position() - a.position()).norm(),
        _ => 0.0,
    });
    let mut way = 0.0;
    let mut travelled = vec![0.0];
    travelled.extend(steps.map(|step| {
        way += step;
        way
    }));
    travelled
}

fn absolute(poses: &[Aligned], path: f64) -> Absolute {
    let position = |(estimate, truth): &Aligned| (estimate.position() - truth.position()).norm();
    let heading = |(estimate, truth): &Aligned| wrap_angle(estimate.heading - truth.heading);
    let end_position = poses.last().map_or(0.0, position);
    Absolute {
        position: Spread::of(poses.iter().map(position)),
        heading: Spread::of(poses.iter().map(heading)),
        end_position,
        end_position_percent: if path > 0.0 { 100.0 * end_position / path } else { 0.0 },
        end_heading: poses.last().map_or(0.0, heading),
    }
}

fn relative(poses: &[Aligned], travelled: &[f64], delta: f64) -> Option<Relative> {
    let (mut translations, mut rotations, mut shares) = (Vec::new(), Vec::new(), Vec::new());
    for ((estimate, truth), start) in poses.iter().zip(travelled) {
        let end = travelled.partition_point(|way| *way < start + delta);
        let (Some((later_estimate, later_truth)), Some(way)) = (poses.get(end), travelled.get(end)) else {
            break;
        };
        let true_motion = truth.inverse().compose(later_truth);
        let motion = estimate.inverse().compose(later_estimate);
        let error = true_motion.inverse().compose(&motion);
        translations.push(error.position().norm());
        rotations.push(error.heading);
        shares.push(error.position().norm() / (way - start));
    }
    if translations.is_empty() {
        return None;
    }
    Some(Relative {
        delta,
        stretches: translations.len(),
        translation: Spread::of(translations),
        translation_percent: 100.0 * Spread::of(shares).rms,
        rotation: Spread::of(rotations),
    })
}

fn consistency(pairs: &[Pair]) -> Option<Nees> {
    let with_covariance = pairs.iter().filter_map(|pair| Some((pair, pair.estimate.covariance?)));
    let values: Vec<_> = with_covariance
        .filter_map(|(pair, covariance)| {
            let estimate = &pair.estimate.pose;
            let deviations = covariance.diagonal().map(|variance| variance.max(0.0).sqrt());
            let offset = estimate.position() - pair.truth.position();
            let errors = offset.push(wrap_angle(estimate.heading - pair.truth.heading));
            let inside =
                errors.iter().zip(&deviations).all(|(error, deviation)| error.abs() <= 3.0 * deviation);
            Some((nees(estimate, &pair.truth, &covariance)?, inside))
        })
        .collect();
    let count = values.len() as f64;
    let broken = pairs.iter().filter_map(|pair| pair.estimate.covariance).filter(is_none).count();
    let (end, _) = values.last()?;
    let mean = values.iter().map(|(nees, _)| nees).sum::<f64>() / count;
    Some(Nees {
        poses: values.len(),
        mean,
        mean_per_dof: mean / 3.0,
        end_per_dof: end / 3.0,
        inside_3_sigma: values.iter().filter(|(_, inside)| *inside).count() as f64 / (count + broken as f64),
    })
}

/// Whether a matrix is not even a singular covariance: a variance below 0, correlations that contradict each other, or no number.
fn is_none(covariance: &Matrix3<f64>) -> bool {
    let scale =
        covariance.diagonal().map(|variance| if variance > 0.0 { 1.0 / variance.sqrt() } else { 0.0 });
    let scale = Matrix3::from_diagonal(&scale);
    let correlation = scale * covariance * scale;
    !covariance.iter().all(|value| value.is_finite())
        || covariance.diagonal().iter().any(|variance| *variance < 0.0)
        || correlation.symmetric_eigenvalues().min() < -1e-3
}

/// Least eigenvalue of a correlation matrix that `f32` can tell from 0.
const LEAST_CORRELATION: f64 = 1e-5;

/// The normalised estimation error squared of a pose in the filter's tangent space, or `None` where the
/// covariance has no inverse: at the start, where the pose is known by definition, and after the first step, whose
/// noise of two numbers (speed and turn) leaves one direction of three to rounding.
pub fn nees(estimate: &Pose<f64>, truth: &Pose<f64>, covariance: &Matrix3<f64>) -> Option<f64> {
    let turn = wrap_angle(estimate.heading - truth.heading);
    // V(a) = [s −c; c s], s = sin a / a, c = (1 − cos a) / a; its inverse is its transpose over s² + c².
    let (s, c) = if turn.abs() < 1e-3 {
        (1.0 - turn * turn / 6.0, turn / 2.0)
    } else {
        (libm::sin(turn) / turn, (1.0 - libm::cos(turn)) / turn)
    };
    let inverse = Matrix2::new(s, c, -c, s) / (s * s + c * c);
    let quarter_turn = Matrix2::new(0.0, -1.0, 1.0, 0.0);
    let offset: Vector2<f64> = (inverse + quarter_turn * turn) * (estimate.position() - truth.position());
    let error = Vector3::new(offset.x, offset.y, turn);
    let scale = covariance.diagonal().map(|variance| 1.0 / variance.sqrt());
    let correlation = Matrix3::from_diagonal(&scale) * covariance * Matrix3::from_diagonal(&scale);
    let singular = !scale.iter().all(|scale| scale.is_finite())
        || correlation.symmetric_eigenvalues().min() < LEAST_CORRELATION;
    if singular {
        return None;
    }
    let value = error.dot(&(covariance.cholesky()?.solve(&error)));
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::Stamped;

    fn circle(radius: f64) -> Vec<Pose<f64>> {
        let pose = |step| {
            let angle = f64::from(step) * 0.1;
            Pose::new(radius * angle.sin(), radius * (1.0 - angle.cos()), angle)
        };
        (0..=30).map(pose).collect()
    }

    fn pairs(estimates: &[Pose<f64>], truths: &[Pose<f64>]) -> Vec<Pair> {
        let stamped = |&pose| Stamped { time: 0.0, pose, covariance: Some(Matrix3::identity() * 0.04) };
        estimates.iter().map(stamped).zip(truths).map(|(estimate, &truth)| Pair { estimate, truth }).collect()
    }

    #[test]
    fn a_covariance_that_is_none_counts_as_outside_and_one_that_is_known_by_definition_does_not_count() {
        let truth = circle(5.0);
        let share = |broken: Matrix3<f64>| {
            let mut pairs = pairs(&truth, &truth);
            pairs.iter_mut().take(10).for_each(|pair| pair.estimate.covariance = Some(broken));
            trajectory_errors(&pairs, Align::None, 1.0).nees.unwrap().inside_3_sigma
        };
        let negative = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -0.02));
        assert!((share(negative) - 21.0 / 31.0).abs() < 1e-9);
        assert_eq!(share(Matrix3::zeros()), 1.0);
    }

    #[test]
    fn a_moved_frame_costs_nothing_after_alignment_and_nothing_relatively() {
        let truth = circle(5.0);
        let frame = Pose::new(3.0, -2.0, 1.0);
        let moved: Vec<_> = truth.iter().map(|pose| frame.compose(pose)).collect();
        let raw = trajectory_errors(&pairs(&moved, &truth), Align::None, 1.0);
        let aligned = trajectory_errors(&pairs(&moved, &truth), Align::Se2, 1.0);
        assert!(raw.absolute.position.rms > 1.0 && raw.relative.unwrap().translation.max < 1e-12);
        assert!(aligned.absolute.position.max < 1e-12 && aligned.absolute.heading.max < 1e-12);
        assert!(aligned.nees.is_none());
    }

    #[test]
    fn a_scale_error_is_seen_as_its_percentage() {
        let (truth, long) = (circle(5.0), circle(5.1));
        let errors = trajectory_errors(&pairs(&long, &truth), Align::None, 2.0);
        assert!((errors.relative.unwrap().translation_percent - 2.0).abs() < 0.05);
        let scaled = trajectory_errors(&pairs(&long, &truth), Align::Sim2, 2.0);
        assert!((scaled.alignment.scale - 5.0 / 5.1).abs() < 1e-12 && scaled.absolute.position.max < 1e-12);
    }

    #[test]
    fn nees_is_the_squared_error_in_units_of_the_deviation() {
        let truth = Pose::new(1.0, 2.0, 0.3);
        let estimate = Pose::new(1.2, 2.0, 0.3);
        assert!((nees(&estimate, &truth, &(Matrix3::identity() * 0.04)).unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(nees(&estimate, &truth, &Matrix3::zeros()), None);
        // Speed and turn alone: rank 2, and in `f32` a third direction of rounding.
        let by_noise = nalgebra::Matrix3x2::new(0.12, 0.0, 0.001, 0.007, 0.0, 0.12);
        let rounded = (by_noise * by_noise.transpose()).map(|entry: f64| f64::from(entry as f32));
        assert_eq!(nees(&estimate, &truth, &rounded), None);
    }
}
