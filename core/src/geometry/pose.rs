use crate::Real;
use nalgebra::{Matrix2, Vector2};

/// The angle wrapped to (−π, π].
///
/// ```
/// use core::f64::consts::PI;
/// assert_eq!(monorange_core::geometry::wrap_angle(-PI), PI);
/// ```
pub fn wrap_angle<T: Real>(angle: T) -> T {
    if angle > -T::pi() && angle <= T::pi() {
        return angle;
    }
    let turns = ((angle - T::pi()) / T::two_pi()).ceil();
    let wrapped = angle - turns * T::two_pi();
    // Rounding can leave the result one step outside.
    if wrapped <= -T::pi() || wrapped > T::pi() { T::pi() } else { wrapped }
}

/// The turn where it is more than its noise, else 0.
pub(crate) fn told_from_noise<T: Real>(turn: T, variance: T) -> T {
    if turn * turn > T::lit(9.0) * variance { turn } else { T::zero() }
}

/// A pose in the plane: `a_from_b` takes points of frame b to frame a. REP-103: x forward, y left.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose<T> {
    /// Position along x in metres.
    pub x: T,
    /// Position along y in metres.
    pub y: T,
    /// Heading in radians, positive to the left, in (−π, π].
    pub heading: T,
}

impl<T: Real> Pose<T> {
    /// The pose at (`x`, `y`) with the heading wrapped.
    pub fn new(x: T, y: T, heading: T) -> Self {
        Self { x, y, heading: wrap_angle(heading) }
    }

    /// The position (x, y).
    pub fn position(&self) -> Vector2<T> {
        Vector2::new(self.x, self.y)
    }

    /// The rotation matrix R(θ) of the heading.
    pub fn rotation(&self) -> Matrix2<T> {
        let (sin, cos) = self.heading.sin_cos();
        Matrix2::new(cos, -sin, sin, cos)
    }

    /// `a_from_c`, given this `a_from_b` and `b_from_c`.
    pub fn compose(&self, b_from_c: &Self) -> Self {
        let position = self.transform(b_from_c.position());
        Self::new(position.x, position.y, self.heading + b_from_c.heading)
    }

    /// `b_from_a`, given this `a_from_b`.
    pub fn inverse(&self) -> Self {
        let position = -(self.rotation().tr_mul(&self.position()));
        Self::new(position.x, position.y, -self.heading)
    }

    /// The point in frame a, given the point in frame b.
    pub fn transform(&self, point_in_b: Vector2<T>) -> Vector2<T> {
        self.rotation() * point_in_b + self.position()
    }

    /// The point in frame b, given the point in frame a.
    pub fn inverse_transform(&self, point_in_a: Vector2<T>) -> Vector2<T> {
        self.rotation().tr_mul(&(point_in_a - self.position()))
    }
}
