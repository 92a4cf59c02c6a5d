use super::edge::{FLOOR, VERTICAL};
use crate::geometry::{Camera, RangeFinder};
use nalgebra::{Vector2, Vector3};

/// Focal length that lengths are measured against: one *unit* is 1/370 of the optical axis's length, 0.155°.
pub(super) const UNIT_FOCAL: f32 = 370.0;
/// Largest deviation of a vertical point's edge from gravity, rad; what noise adds to it, and the most of that.
const VERTICAL_DEVIATION: f32 = 0.157;
const NOISE_TURN: f32 = 1.5;
const MOST_NOISE_TURN: f32 = 0.3;
/// Squared sine of the least deviation of a floor point's edge from gravity: 8°.
const FLOOR_SINE_SQUARED: f32 = 0.019_37;

/// The picture that is searched, in pixels of an ideal camera from its principal point: where is down, how far below the
/// horizon is what.
#[derive(Clone, Debug)]
pub(super) struct View {
    pub(super) finder: RangeFinder<f32>,
    pub(super) principal: Vector2<f32>,
    /// Pixels to a unit.
    pub(super) unit: f32,
    focal: Vector2<f32>,
    /// Upwards in the camera's frame.
    up: Vector3<f32>,
}

impl View {
    pub(super) fn new(finder: RangeFinder<f32>) -> Self {
        let camera = finder.camera();
        let (focal, principal) = (camera.focal(), camera.principal());
        let unit = 0.5 * (focal.x + focal.y) / UNIT_FOCAL;
        Self { finder, principal, unit, focal, up: finder.horizon() }
    }

    pub(super) fn camera(&self) -> &Camera<f32> {
        self.finder.camera()
    }

    /// The ray (x, y, 1) of a place.
    #[inline]
    pub(super) fn ray(&self, place: Vector2<f32>) -> Vector2<f32> {
        let y = place.y / self.focal.y;
        Vector2::new(place.x / self.focal.x - self.camera().skew() * y, y)
    }

    /// How a place moves when its point sinks, px.
    #[inline]
    pub(super) fn sinks(&self, place: Vector2<f32>) -> Vector2<f32> {
        let moved = self.ray(place) * self.up.z - self.up.xy();
        Vector2::new((moved.x + moved.y * self.camera().skew()) * self.focal.x, moved.y * self.focal.y)
    }

    /// The unit vector of gravity at a place.
    pub(super) fn gravity(&self, place: Vector2<f32>) -> Vector2<f32> {
        let sinks = self.sinks(place);
        let length = libm::sqrtf(sinks.norm_squared());
        if length > 0.0 { sinks / length } else { Vector2::y() }
    }

    /// Whether a place is below the horizon.
    #[inline]
    pub(super) fn is_below_horizon(&self, place: Vector2<f32>) -> bool {
        self.up.dot(&self.ray(place).push(1.0)) < 0.0
    }

    /// The tangent of the angle below the horizon.
    pub(super) fn fall(&self, place: Vector2<f32>) -> f32 {
        let direction = self.finder.robot_from_cam() * self.ray(place).push(1.0);
        -direction.z / libm::sqrtf(direction.xy().norm_squared()).max(1e-6)
    }

    /// The floor's point that is seen at a place, from below the camera, m.
    pub(super) fn floor(&self, place: Vector2<f32>) -> Option<Vector2<f32>> {
        let direction = self.finder.robot_from_cam() * self.ray(place).push(1.0);
        (direction.z < -1e-4).then(|| direction.xy() * (self.finder.mount().height() / -direction.z))
    }

    /// How high above the floor a place is whose foot is seen at `foot`, m: both are equally far, so
    /// h (1 − tan δ/tan δ_foot) with their angles δ below the horizon.
    pub(super) fn height(&self, place: Vector2<f32>, foot: Vector2<f32>) -> f32 {
        let fall = self.fall(foot);
        if fall < 1e-3 { 0.0 } else { self.finder.mount().height() * (1.0 - self.fall(place) / fall) }
    }

    /// The pixel of the picture searched at which a place is seen.
    pub(super) fn pixel(&self, place: Vector2<f32>) -> Option<Vector2<f32>> {
        self.camera().pixel_from_ray(self.ray(place))
    }

    /// What an edge along `tangent` at a place can be: [`VERTICAL`] when it points to where gravity does within 9° and
    /// what noise turns it, [`FLOOR`] when it is below the horizon and does not within 8°; both, or nothing.
    #[inline]
    pub(super) fn kinds(
        &self,
        place: Vector2<f32>,
        tangent: Vector2<f32>,
        gradient: f32,
        gradient_noise: f32,
    ) -> u8 {
        let sinks = self.sinks(place);
        let across = sinks.perp(&tangent);
        let across = across * across;
        let lengths = sinks.norm_squared() * tangent.norm_squared();
        let turn = NOISE_TURN * gradient_noise / gradient;
        let angle = VERTICAL_DEVIATION + if turn < MOST_NOISE_TURN { turn } else { MOST_NOISE_TURN };
        let sine = angle * (1.0 - angle * angle * (1.0 / 6.0));
        let vertical = across <= sine * sine * lengths;
        let floor = across >= FLOOR_SINE_SQUARED * lengths && self.is_below_horizon(place);
        (u8::from(vertical) * VERTICAL) | (u8::from(floor) * FLOOR)
    }
}
