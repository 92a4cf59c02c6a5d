use crate::{Error, files::Stamped};
use monorange_core::geometry::{Pose, wrap_angle};

/// Between true poses further apart than this nothing is known, s.
pub const MAX_TRUTH_GAP: f64 = 1.0;

/// A true trajectory, asked at any time.
#[derive(Clone, Copy, Debug)]
pub struct Truth<'a> {
    poses: &'a [Stamped],
    max_gap: f64,
}

/// An estimated pose and the true one at the same time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// The estimate.
    pub estimate: Stamped,
    /// The truth at its time.
    pub truth: Pose<f64>,
}

impl<'a> Truth<'a> {
    /// The truth from poses in the order of time; between two of them it is known where they are at most
    /// `max_gap` seconds apart.
    pub fn new(poses: &'a [Stamped], max_gap: f64) -> Self {
        Self { poses, max_gap }
    }

    /// The pose at a time, interpolated between its neighbours: position and heading linearly. `None` where
    /// there is a gap, or beyond the ends by more than a microsecond (times are decimal text).
    pub fn at(&self, time: f64) -> Option<Pose<f64>> {
        const ROUNDING: f64 = 1e-6;
        let after = self.poses.partition_point(|stamped| stamped.time < time);
        let before = after.checked_sub(1).and_then(|index| self.poses.get(index));
        let exactly = |stamped: &&Stamped| (stamped.time - time).abs() <= ROUNDING;
        if let Some(stamped) = self.poses.get(after).filter(exactly).or(before.filter(exactly)) {
            return Some(stamped.pose);
        }
        let (before, after) = (before?, self.poses.get(after)?);
        let gap = after.time - before.time;
        if gap > self.max_gap {
            return None;
        }
        let part = (time - before.time) / gap;
        let position = before.pose.position().lerp(&after.pose.position(), part);
        let turn = wrap_angle(after.pose.heading - before.pose.heading);
        Some(Pose::new(position.x, position.y, before.pose.heading + part * turn))
    }

    /// The truth's world seen from a run's, which begins at the robot's place at `start`. Where the truth begins later
    /// the run's first pose that it covers is taken for right, with a warning; `None` without any.
    pub fn map_from_world(&self, start: f64, trajectory: &[Stamped]) -> Option<Pose<f64>> {
        if let Some(first) = self.at(start) {
            return Some(first.inverse());
        }
        let first = self.pairs(trajectory).into_iter().next()?;
        let cause =
            format!("the truth has no pose at the start, {start} s, but from {} s on", first.estimate.time);
        Error::new(cause).help("errors are counted from there, where the run is taken for right").warn();
        Some(first.estimate.pose.compose(&first.truth.inverse()))
    }

    /// Every estimate whose time the truth covers, with the truth.
    pub fn pairs(&self, estimates: &[Stamped]) -> Vec<Pair> {
        let pair = |&estimate: &Stamped| self.at(estimate.time).map(|truth| Pair { estimate, truth });
        estimates.iter().filter_map(pair).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn the_heading_is_interpolated_the_short_way_round() {
        let at = |time, heading| Stamped { time, pose: Pose::new(time, 0.0, heading), covariance: None };
        let poses = [at(0.0, PI - 0.1), at(1.0, -PI + 0.1), at(9.0, 0.0)];
        let truth = Truth::new(&poses, 2.0);
        let middle = truth.at(0.5).unwrap();
        assert!((middle.x - 0.5).abs() < 1e-12 && (middle.heading.abs() - PI).abs() < 1e-12);
        assert_eq!(truth.at(5.0), None, "a gap of 8 s is not bridged");
        assert_eq!(truth.at(9.1), None);
        assert_eq!(truth.at(9.0), Some(poses[2].pose));
    }
}
