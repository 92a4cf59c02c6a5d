//! Where a landmark may be that has been seen by its range alone: a ring of hypotheses about the robot.
//!
//! A range says that the landmark lies on a circle; a straight drive leaves two mirror points; a turn decides. Until
//! then the landmark is not in the filter: it is a sum of Gaussians in the robot's frame, spread over the first
//! circle, each moved by the odometry and corrected by every further range, and weighted by how well it foresaw it.
//! When those that matter agree, [`RingStart::settled`] gives a point with its covariance for
//! [`Filter::birth_at`](super::Filter::birth_at). Cost: 24 updates of two states a range.
use crate::Real;
use crate::slam::models::Increment;
use nalgebra::{Matrix2, Matrix2x3, Vector2};

/// Hypotheses: 15° apart, so that a straight piece of the ring is off it by less than 1 % of the range.
const HYPOTHESES: usize = 24;
/// Innovations beyond this many standard deviations are outliers, squared.
const OUTLIER: f64 = 16.0;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Hypothesis<T> {
    point: Vector2<T>,
    covariance: Matrix2<T>,
    /// Logarithm, up to a constant.
    weight: T,
}

/// A landmark seen by its range alone, in the robot's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RingStart<T> {
    hypotheses: [Hypothesis<T>; HYPOTHESES],
    ranges: u32,
}

impl<T: Real> RingStart<T> {
    /// The ring of the first range (m) with its variance (m²).
    pub fn new(range: T, variance: T) -> Self {
        let spacing = T::two_pi() / T::lit(HYPOTHESES as f64);
        let along = range * spacing * T::lit(0.5);
        let sagitta = range * (T::one() - (spacing * T::lit(0.5)).cos());
        let hypotheses = core::array::from_fn(|index| {
            let (sin, cos) = (spacing * T::lit(index as f64)).sin_cos();
            let turn = Matrix2::new(cos, -sin, sin, cos);
            let axes = Matrix2::new(variance + sagitta * sagitta, T::zero(), T::zero(), along * along);
            let covariance = turn * axes * turn.transpose();
            Hypothesis { point: Vector2::new(range * cos, range * sin), covariance, weight: T::zero() }
        });
        Self { hypotheses, ranges: 1 }
    }

    /// Ranges taken in.
    pub fn ranges(&self) -> u32 {
        self.ranges
    }

    /// Moves the robot: d⁺ = R(−Δθ)(d − δ).
    pub fn predict(&mut self, increment: &Increment<T>) {
        let (sin, cos) = increment.delta.z.sin_cos();
        let back = Matrix2::new(cos, sin, -sin, cos);
        for hypothesis in &mut self.hypotheses {
            let point = back * (hypothesis.point - increment.delta.xy());
            let by_increment = Matrix2x3::new(-back.m11, -back.m12, point.y, -back.m21, -back.m22, -point.x);
            hypothesis.covariance = back * hypothesis.covariance * back.transpose()
                + by_increment * increment.covariance * by_increment.transpose();
            hypothesis.point = point;
        }
    }

    /// Takes in another range.
    pub fn update(&mut self, range: T, variance: T) {
        self.ranges = self.ranges.saturating_add(1);
        let half = T::lit(0.5);
        for hypothesis in &mut self.hypotheses {
            let distance = hypothesis.point.norm().max(T::lit(1e-3));
            let towards = hypothesis.point / distance;
            let gain = hypothesis.covariance * towards;
            // The circle bends away from its tangent by σ²/2r, σ along it.
            let across = Vector2::new(-towards.y, towards.x);
            let bend = across.dot(&(hypothesis.covariance * across)) / (distance + distance);
            let total = towards.dot(&gain) + variance + half * bend * bend;
            let innovation = range - distance;
            let nis = innovation * innovation / total;
            hypothesis.weight -= half * (nis.min(T::lit(OUTLIER)) + total.ln());
            if nis < T::lit(OUTLIER) {
                hypothesis.point += gain * (innovation / total);
                hypothesis.covariance -= gain * gain.transpose() / total;
            }
        }
    }

    /// The landmark in the robot's frame with its covariance, when its standard deviation in the worst direction is
    /// below `relative` times its distance.
    pub fn settled(&self, relative: T) -> Option<(Vector2<T>, Matrix2<T>)> {
        let best = self.hypotheses.iter().map(|hypothesis| hypothesis.weight).reduce(|a, b| a.max(b))?;
        let share = |hypothesis: &Hypothesis<T>| (hypothesis.weight - best).exp();
        let (mut sum, mut mean) = (T::zero(), Vector2::zeros());
        for hypothesis in &self.hypotheses {
            sum += share(hypothesis);
            mean += hypothesis.point * share(hypothesis);
        }
        mean /= sum;
        let mut covariance = Matrix2::zeros();
        for hypothesis in &self.hypotheses {
            let apart = hypothesis.point - mean;
            covariance += (hypothesis.covariance + apart * apart.transpose()) * (share(hypothesis) / sum);
        }
        let limit = relative * mean.norm();
        let settled = self.ranges > 3 && covariance.trace() < limit * limit;
        settled.then_some((mean, covariance))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use nalgebra::{Matrix3, Vector3};

    #[test]
    fn a_straight_drive_leaves_a_mirror_point_and_a_turn_decides() {
        let landmark = Vector2::new(6.0, 5.0);
        let mut robot = Pose::new(0.0, 0.0, 0.0);
        let mut ring = RingStart::new(landmark.norm(), 0.01);
        let mut drive = |turn: f64, steps: usize| {
            for _ in 0..steps {
                let delta = Vector3::new(0.2, 0.0, turn);
                robot = robot.compose(&Pose::new(0.2, 0.0, turn));
                ring.predict(&Increment { delta, covariance: Matrix3::identity() * 1e-8 });
                ring.update(robot.inverse_transform(landmark).norm(), 0.01);
            }
            (ring.settled(0.05), robot.inverse_transform(landmark))
        };
        assert!(drive(0.0, 25).0.is_none(), "a straight drive cannot tell left from right");
        let (settled, truth) = drive(0.05, 30);
        let (point, covariance) = settled.expect("a turn decides");
        assert!((point - truth).norm() < 0.1, "{point} {truth} {covariance}");
    }
}
