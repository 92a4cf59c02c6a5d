//! A robot that drives circles among landmarks and sees them by range and bearing.
use crate::Noise;
use monorange_core::geometry::{Pose, wrap_angle};
use nalgebra::{Matrix2, Vector2};

/// The drive: circles of radius speed/turn, a step a second.
#[derive(Clone, Copy, Debug)]
pub struct Drive {
    /// Metres a step.
    pub speed: f64,
    /// Radians a step.
    pub turn: f64,
    /// Steps.
    pub steps: usize,
    /// Landmarks.
    pub landmarks: usize,
    /// Landmarks lie at the circle's radius ± this many metres.
    pub spread: f64,
    /// Seen between these ranges in metres.
    pub view: (f64, f64),
    /// Standard deviation of the range: metres, and a fraction of it.
    pub range_std: (f64, f64),
    /// Standard deviation of the bearing in radians.
    pub bearing_std: f64,
    /// Standard deviations of (v, ω).
    pub odometry_std: (f64, f64),
}

impl Drive {
    /// The Monte Carlo of the consistency table: 20 landmarks, 10 % in range, 10° in bearing.
    pub fn consistency() -> Self {
        let sigma = 0.05 * 0.25;
        Self {
            speed: 0.25,
            turn: 0.025,
            steps: 1500,
            landmarks: 20,
            spread: 4.0,
            view: (0.5, 5.0),
            range_std: (0.0, 0.1),
            bearing_std: 10_f64.to_radians(),
            odometry_std: (sigma / 2_f64.sqrt(), 2.0 * 2_f64.sqrt() * sigma),
        }
    }

    /// Covariance of (v, ω).
    pub fn odometry_covariance(&self) -> Matrix2<f64> {
        let (v, omega) = self.odometry_std;
        Matrix2::from_diagonal(&Vector2::new(v * v, omega * omega))
    }

    /// Standard deviation of a range.
    pub fn range_std_at(&self, range: f64) -> f64 {
        (self.range_std.0.powi(2) + (self.range_std.1 * range).powi(2)).sqrt()
    }

    /// Landmarks of a seed.
    pub fn landmarks(&self, seed: u64) -> Vec<Vector2<f64>> {
        let mut noise = Noise::new(seed);
        let radius = self.speed / self.turn;
        let centre = Vector2::new(0.0, radius);
        (0..self.landmarks)
            .map(|_| {
                let angle = noise.uniform(0.0, core::f64::consts::TAU);
                let distance = radius + noise.uniform(-self.spread, self.spread);
                centre + Vector2::new(angle.cos(), angle.sin()) * distance
            })
            .collect()
    }

    /// The steps of a seed.
    pub fn run(&self, landmarks: &[Vector2<f64>], seed: u64) -> Vec<Step> {
        let mut noise = Noise::new(seed);
        let mut truth = Pose::new(0.0, 0.0, 0.0);
        let arc = monorange_core::slam::arc_rotation(self.turn) * Vector2::new(self.speed, 0.0);
        let step = Pose::new(arc.x, arc.y, self.turn);
        (0..self.steps)
            .map(|_| {
                truth = truth.compose(&step);
                let v = self.speed + self.odometry_std.0 * noise.normal();
                let omega = self.turn + self.odometry_std.1 * noise.normal();
                let mut seen = Vec::new();
                for (id, landmark) in landmarks.iter().enumerate() {
                    let point = truth.inverse_transform(*landmark);
                    let range = point.norm();
                    if range > self.view.0 && range < self.view.1 {
                        let measured = range + self.range_std_at(range) * noise.normal();
                        let bearing = wrap_angle(point.y.atan2(point.x) + self.bearing_std * noise.normal());
                        seen.push((id as u32, measured, bearing));
                    }
                }
                Step { v, omega, truth, seen }
            })
            .collect()
    }
}

/// A step of the drive: odometry, truth, and (landmark, range, bearing) seen after it.
#[derive(Clone, Debug)]
pub struct Step {
    /// Measured speed.
    pub v: f64,
    /// Measured turn rate.
    pub omega: f64,
    /// Where the robot is.
    pub truth: Pose<f64>,
    /// What it sees.
    pub seen: Vec<(u32, f64, f64)>,
}
