//! Lens models: where the ray (x, y, 1) of the optical frame is seen, in units of the focal length.
//!
//! With ρ = x² + y², r = √ρ and θ = atan r, the angle off the optical axis:
//!
//! ```text
//! Brown–Conrady    c = 1 + k₁ρ + k₂ρ² + k₃ρ³                x' = c x + 2p₁xy + p₂(ρ + 2x²)
//! rational         c = (1 + k₁ρ + k₂ρ² + k₃ρ³)              y' = c y + p₁(ρ + 2y²) + 2p₂xy
//!                    / (1 + k₄ρ + k₅ρ² + k₆ρ³)
//! equidistant      θ_d = θ (1 + k₁θ² + k₂θ⁴ + k₃θ⁶ + k₄θ⁸)  (x', y') = (θ_d / r) (x, y)
//! ```
//!
//! | model | ROS | OpenCV | Kalibr |
//! |---|---|---|---|
//! | [`Lens::BrownConrady`] | `plumb_bob` | 4 or 5 coefficients | `radtan` |
//! | [`Lens::Rational`] | `rational_polynomial` | 8 coefficients | – |
//! | [`Lens::Equidistant`] | `equidistant` | the namespace `fisheye` | `equidistant` |
//!
//! A model is one to one while the radius of the image grows with the radius of the ray: ρ_max is where that ends.
//! The inverse has no closed form. For the first two it is Newton's method on (x', y') with the analytic 2×2
//! Jacobian, from the distorted point; for the equidistant one Newton's method on θ alone, kept inside a bracket.
//! Beyond ρ_max, and where Newton's method does not settle, a pixel has no ray.
//!
//! *Limits.* A ray (x, y, 1) lies in front of the camera: an equidistant lens is used up to 89° off its axis.
//!
//! Sources: D. C. Brown, "Close-range camera calibration", 1971; J. Kannala and S. S. Brandt, "A generic camera model
//! and calibration method for conventional, wide-angle, and fish-eye lenses", 2006; OpenCV's order of coefficients.
use super::newton::{MAX_ITERATIONS, newton, newton_one};
use crate::{Error, Real, Result};
use nalgebra::{Matrix2, Vector2};

/// Brown–Conrady coefficients, in OpenCV's order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distortion<T> {
    /// Radial, of ρ.
    pub k1: T,
    /// Radial, of ρ².
    pub k2: T,
    /// Tangential, vertical.
    pub p1: T,
    /// Tangential, horizontal.
    pub p2: T,
    /// Radial, of ρ³.
    pub k3: T,
}

/// A lens model with its coefficients; no distortion by default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens<T> {
    /// A polynomial of ρ, and two tangential terms.
    BrownConrady(Distortion<T>),
    /// A ratio of two polynomials of ρ, and two tangential terms.
    Rational {
        /// The polynomial above the line, and the tangential terms.
        above: Distortion<T>,
        /// k₄ k₅ k₆, of ρ, ρ² and ρ³ below the line.
        below: [T; 3],
    },
    /// A polynomial of the angle off the axis (Kannala and Brandt): k₁ k₂ k₃ k₄.
    Equidistant([T; 4]),
}

impl<T: Real> Default for Lens<T> {
    fn default() -> Self {
        Self::BrownConrady(Distortion::default())
    }
}

impl<T> From<Distortion<T>> for Lens<T> {
    fn from(distortion: Distortion<T>) -> Self {
        Self::BrownConrady(distortion)
    }
}

/// Below this ρ the equidistant model is taken by its series: differences of nearly equal numbers would lose digits.
const NEAR_AXIS: f64 = 1e-4;
/// tan² of 89°.
const EQUIDISTANT_MAX: f64 = 3282.0;

impl<T: Real> Lens<T> {
    /// A Brown–Conrady lens from 4 or 5 coefficients (k₁ k₂ p₁ p₂ k₃) or a rational one from 8 (… k₄ k₅ k₆), in
    /// OpenCV's order; `None` for another number of them.
    pub fn from_polynomial(coefficients: &[T]) -> Option<Self> {
        let (&[k1, k2, p1, p2], more) = coefficients.split_first_chunk()?;
        let zero = T::zero();
        match *more {
            [] => Some(Distortion { k1, k2, p1, p2, k3: zero }.into()),
            [k3] => Some(Distortion { k1, k2, p1, p2, k3 }.into()),
            [k3, k4, k5, k6] if [k4, k5, k6] == [zero; 3] => Some(Distortion { k1, k2, p1, p2, k3 }.into()),
            [k3, k4, k5, k6] => {
                Some(Self::Rational { above: Distortion { k1, k2, p1, p2, k3 }, below: [k4, k5, k6] })
            }
            _ => None,
        }
    }

    /// The coefficients in the order of their model's programs: 5, 8 or 4 of them.
    pub fn coefficients(&self) -> heapless::Vec<T, 8> {
        let five = |d: &Distortion<T>| [d.k1, d.k2, d.p1, d.p2, d.k3];
        match self {
            Self::BrownConrady(d) => heapless::Vec::from_iter(five(d)),
            Self::Rational { above, below } => {
                heapless::Vec::from_iter(five(above).into_iter().chain(*below))
            }
            Self::Equidistant(k) => heapless::Vec::from_iter(*k),
        }
    }

    /// The same lens in another scalar.
    pub fn cast<U: Real>(&self) -> Lens<U> {
        let to = |value: T| U::lit(value.to_f64());
        let distortion = |d: &Distortion<T>| Distortion {
            k1: to(d.k1),
            k2: to(d.k2),
            p1: to(d.p1),
            p2: to(d.p2),
            k3: to(d.k3),
        };
        match self {
            Self::BrownConrady(d) => Lens::BrownConrady(distortion(d)),
            Self::Rational { above, below } => {
                Lens::Rational { above: distortion(above), below: below.map(to) }
            }
            Self::Equidistant(k) => Lens::Equidistant(k.map(to)),
        }
    }

    /// The lens itself if its numbers are finite.
    ///
    /// # Errors
    /// [`Error::OutOfRange`].
    pub(super) fn validated(self) -> Result<Self> {
        match self.coefficients().into_iter().find(|k| !k.is_finite()) {
            Some(k) => Err(Error::OutOfRange {
                name: "camera.distortion",
                value: k.to_f64(),
                expected: "a finite number",
            }),
            None => Ok(self),
        }
    }

    /// Where the ray (x, y, 1) is seen.
    pub(super) fn distort(&self, ray: Vector2<T>) -> Vector2<T> {
        match self {
            Self::BrownConrady(d) => d.bent(ray, d.polynomial(ray.norm_squared()).0),
            Self::Rational { above, below } => above.bent(ray, ratio(above, below, ray.norm_squared()).0),
            Self::Equidistant(k) => ray * equidistant(k, ray.norm_squared()).0,
        }
    }

    /// ∂(x', y')/∂(x, y).
    pub(super) fn distort_by_ray(&self, ray: Vector2<T>) -> Matrix2<T> {
        let rho = ray.norm_squared();
        match self {
            Self::BrownConrady(d) => d.bent_by_ray(ray, d.polynomial(rho)),
            Self::Rational { above, below } => above.bent_by_ray(ray, ratio(above, below, rho)),
            Self::Equidistant(k) => Distortion::default().bent_by_ray(ray, equidistant(k, rho)),
        }
    }

    /// The ray that is seen at (x', y'); `max_radius2` is the model's [`max_radius2`](Self::max_radius2).
    pub(super) fn undistort(&self, distorted: Vector2<T>, max_radius2: T) -> Option<Vector2<T>> {
        match self {
            Self::BrownConrady(d) if *d == Distortion::default() => Some(distorted),
            Self::Equidistant(k) => unbend(k, distorted, max_radius2),
            _ => newton_one(distorted, |ray| (self.distort(ray), self.distort_by_ray(ray)), max_radius2),
        }
    }

    /// As [`undistort`](Self::undistort) for several points, bit by bit, with the Jacobian of [`distort`](Self::distort) at each ray:
    /// their iterations are vectors' lanes.
    pub(super) fn undistort_all<const N: usize>(
        &self,
        distorted: [Vector2<T>; N],
        max_radius2: T,
    ) -> [Option<(Vector2<T>, Matrix2<T>)>; N] {
        let with_jacobian = |ray| (ray, self.distort_by_ray(ray));
        match self {
            Self::BrownConrady(d) if *d == Distortion::default() => {
                distorted.map(|ray| Some(with_jacobian(ray)))
            }
            Self::Equidistant(k) => {
                distorted.map(|distorted| unbend(k, distorted, max_radius2).map(with_jacobian))
            }
            Self::BrownConrady(d) => newton(
                distorted,
                |ray| {
                    let polynomial = d.polynomial(ray.norm_squared());
                    (d.bent(ray, polynomial.0), d.bent_by_ray(ray, polynomial))
                },
                max_radius2,
            ),
            Self::Rational { above, below } => newton(
                distorted,
                |ray| {
                    let ratio = ratio(above, below, ray.norm_squared());
                    (above.bent(ray, ratio.0), above.bent_by_ray(ray, ratio))
                },
                max_radius2,
            ),
        }
    }

    /// The smallest ρ > 0 at which the image's radius no longer grows with the ray's, or the largest number.
    pub(super) fn max_radius2(&self) -> T {
        let unlimited = match self {
            Self::Equidistant(_) => T::lit(EQUIDISTANT_MAX),
            _ => T::max_value().unwrap_or(T::lit(1e30)),
        };
        let grows = |rho: T| self.growth(rho) > T::zero();
        // March out to a ray of 85° off the axis, then bisect: the polynomials change sign a few times at most.
        let (steps, limit) = (256, T::lit(130.0));
        let mut inside = T::zero();
        for step in 1..=steps {
            let fraction = T::lit(f64::from(step) / f64::from(steps));
            let mut outside = limit * fraction * fraction;
            if grows(outside) {
                inside = outside;
                continue;
            }
            for _ in 0..60 {
                let middle = (inside + outside) * T::lit(0.5);
                if grows(middle) {
                    inside = middle;
                } else {
                    outside = middle;
                }
            }
            return inside;
        }
        unlimited
    }

    /// Has the sign of the derivative of the image's radius by the ray's, without the tangential terms; not above
    /// 0 beyond a pole.
    fn growth(&self, rho: T) -> T {
        let [two, three, five, seven, nine] = [2.0, 3.0, 5.0, 7.0, 9.0].map(T::lit);
        match self {
            Self::BrownConrady(d) => {
                T::one() + rho * (three * d.k1 + rho * (five * d.k2 + rho * (seven * d.k3)))
            }
            Self::Rational { above, below: [k4, k5, k6] } => {
                let (n, n_slope) = above.polynomial(rho); // the second is twice the derivative by ρ
                let denominator = T::one() + rho * (*k4 + rho * (*k5 + rho * *k6));
                let d_slope = two * (*k4 + rho * (two * *k5 + three * rho * *k6));
                if denominator <= T::zero() {
                    return T::zero();
                }
                n * denominator + rho * (n_slope * denominator - n * d_slope)
            }
            Self::Equidistant([k1, k2, k3, k4]) => {
                let angle = rho.sqrt().atan();
                let t = angle * angle;
                T::one() + t * (three * *k1 + t * (five * *k2 + t * (seven * *k3 + t * (nine * *k4))))
            }
        }
    }
}

impl<T: Real> Distortion<T> {
    /// c and (∂c/∂x)/x of the radial polynomial.
    #[inline]
    fn polynomial(&self, rho: T) -> (T, T) {
        let (two, three) = (T::lit(2.0), T::lit(3.0));
        let radial = T::one() + rho * (self.k1 + rho * (self.k2 + rho * self.k3));
        let slope = two * (self.k1 + rho * (two * self.k2 + three * rho * self.k3));
        (radial, slope)
    }

    /// The ray scaled by `radial`, with the tangential terms.
    #[inline]
    fn bent(&self, ray: Vector2<T>, radial: T) -> Vector2<T> {
        let two = T::lit(2.0);
        let (x, y) = (ray.x, ray.y);
        let rho = x * x + y * y;
        Vector2::new(
            radial * x + two * self.p1 * x * y + self.p2 * (rho + two * x * x),
            radial * y + self.p1 * (rho + two * y * y) + two * self.p2 * x * y,
        )
    }

    /// The derivative of [`bent`](Self::bent) by the ray, given c and (∂c/∂x)/x.
    #[inline]
    fn bent_by_ray(&self, ray: Vector2<T>, (radial, slope): (T, T)) -> Matrix2<T> {
        let (two, six) = (T::lit(2.0), T::lit(6.0));
        let (x, y) = (ray.x, ray.y);
        let cross = slope * x * y + two * (self.p1 * x + self.p2 * y);
        Matrix2::new(
            radial + slope * x * x + two * self.p1 * y + six * self.p2 * x,
            cross,
            cross,
            radial + slope * y * y + six * self.p1 * y + two * self.p2 * x,
        )
    }
}

/// c and (∂c/∂x)/x of the rational model.
#[inline]
fn ratio<T: Real>(above: &Distortion<T>, &[k4, k5, k6]: &[T; 3], rho: T) -> (T, T) {
    let (two, three) = (T::lit(2.0), T::lit(3.0));
    let (numerator, slope) = above.polynomial(rho);
    let denominator = T::one() + rho * (k4 + rho * (k5 + rho * k6));
    let below = two * (k4 + rho * (two * k5 + three * rho * k6));
    let radial = numerator / denominator;
    (radial, (slope - radial * below) / denominator)
}

/// θ_d and ∂θ_d/∂θ.
fn bent_angle<T: Real>(&[k1, k2, k3, k4]: &[T; 4], angle: T) -> (T, T) {
    let [three, five, seven, nine] = [3.0, 5.0, 7.0, 9.0].map(T::lit);
    let t = angle * angle;
    let polynomial = T::one() + t * (k1 + t * (k2 + t * (k3 + t * k4)));
    let slope = T::one() + t * (three * k1 + t * (five * k2 + t * (seven * k3 + t * (nine * k4))));
    (angle * polynomial, slope)
}

/// c = θ_d / r and (∂c/∂x)/x.
fn equidistant<T: Real>(k: &[T; 4], rho: T) -> (T, T) {
    if rho < T::lit(NEAR_AXIS) {
        // θ = r − r³/3 + r⁵/5 − …
        let [first, second] = [k[0] - T::lit(1.0 / 3.0), k[1] - k[0] + T::lit(0.2)];
        let slope = T::lit(2.0) * first + T::lit(4.0) * rho * second;
        return (T::one() + rho * (first + rho * second), slope);
    }
    let radius = rho.sqrt();
    let (bent, by_angle) = bent_angle(k, radius.atan());
    let radial = bent / radius;
    (radial, (by_angle / (T::one() + rho) - radial) / rho)
}

/// The ray of an equidistant lens: θ from θ_d by Newton's method inside a bracket that shrinks.
fn unbend<T: Real>(k: &[T; 4], distorted: Vector2<T>, max_radius2: T) -> Option<Vector2<T>> {
    let wanted = distorted.norm();
    if !wanted.is_finite() {
        return None;
    }
    if wanted * wanted < T::lit(NEAR_AXIS) * T::lit(0.01) {
        let first = k[0] - T::lit(1.0 / 3.0);
        return Some(distorted * (T::one() - wanted * wanted * first));
    }
    let (mut low, mut high) = (T::zero(), max_radius2.sqrt().atan());
    if wanted > bent_angle(k, high).0 {
        return None;
    }
    let mut angle = wanted.min(high);
    for _ in 0..3 * MAX_ITERATIONS {
        let (bent, slope) = bent_angle(k, angle);
        let error = bent - wanted;
        if error > T::zero() {
            high = angle;
        } else {
            low = angle;
        }
        let newton = angle - error / slope;
        let next = if newton > low && newton < high { newton } else { (low + high) * T::lit(0.5) };
        let step = (next - angle).abs();
        if step <= angle * T::default_epsilon() {
            break;
        }
        angle = next;
    }
    Some(distorted * (angle.tan() / wanted))
}

pub(super) fn inverse<T: Real>(m: &Matrix2<T>) -> Option<Matrix2<T>> {
    let determinant = m.m11 * m.m22 - m.m12 * m.m21;
    if !determinant.is_finite() || determinant == T::zero() {
        return None;
    }
    Some(Matrix2::new(m.m22, -m.m12, -m.m21, m.m11) / determinant)
}

#[cfg(test)]
#[path = "lens_tests.rs"]
mod tests;
