//! A 2-D laser scanner at shin height.
use crate::random::{Random, Stream};
use crate::scene::Scene;
use crate::walker::{LEG_RADIUS, Walker};
use monorange_core::geometry::Pose;
use nalgebra::Vector2;

/// A laser scanner over the robot's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaserConfig {
    /// Beams of a scan, spread evenly from right to left.
    pub beams: usize,
    /// Angle from the first beam to the last, rad.
    pub span: f64,
    /// Standard deviation of a range, m.
    pub range_std: f64,
    /// Beyond this distance there is no echo, m.
    pub max_range: f64,
}

impl Default for LaserConfig {
    fn default() -> Self {
        let span = core::f64::consts::PI;
        Self { beams: 181, span, range_std: 0.01, max_range: 8.0 }
    }
}

/// One beam of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// From the robot's x axis, positive to the left, rad.
    pub bearing: f64,
    /// Metres, or `None` without an echo.
    pub range: Option<f64>,
}

impl LaserConfig {
    pub(crate) fn scan(
        &self,
        scene: &Scene,
        walkers: &[Walker],
        pose: &Pose<f64>,
        seed: u64,
        frame: usize,
    ) -> Vec<Beam> {
        let mut random = Random::new(seed, Stream::Laser(frame));
        let step = self.span / (self.beams.max(2) - 1) as f64;
        let beams = (0..self.beams).map(|beam| {
            let bearing = beam as f64 * step - self.span * 0.5;
            let noise = self.range_std * random.normal();
            let angle = pose.heading + bearing;
            let direction = Vector2::new(libm::cos(angle), libm::sin(angle));
            let range = true_range(scene, walkers, pose.position(), direction);
            Beam { bearing, range: range.map(|range| range + noise).filter(|range| *range <= self.max_range) }
        });
        beams.collect()
    }
}

/// Distance to the first wall or leg along a unit direction.
fn true_range(
    scene: &Scene,
    walkers: &[Walker],
    origin: Vector2<f64>,
    direction: Vector2<f64>,
) -> Option<f64> {
    let wall = scene.cast(origin, direction).map(|(distance, _)| distance);
    let feet = walkers.iter().flat_map(Walker::feet);
    let legs = feet.filter_map(|foot| circle_hit(foot - origin, direction, LEG_RADIUS));
    wall.into_iter().chain(legs).min_by(f64::total_cmp)
}

/// Distance along a unit direction to the near side of a circle at `centre`.
pub(crate) fn circle_hit(centre: Vector2<f64>, direction: Vector2<f64>, radius: f64) -> Option<f64> {
    let along = centre.dot(&direction);
    let half_chord2 = radius * radius - (centre.norm_squared() - along * along);
    let near = along - libm::sqrt(half_chord2.max(0.0));
    (half_chord2 >= 0.0 && near > 0.0).then_some(near)
}
