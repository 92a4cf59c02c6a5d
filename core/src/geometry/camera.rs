//! Pinhole camera with skew and Brown–Conrady lens distortion.
//!
//! A ray (x, y, 1) of the camera's optical frame is seen at pixel (u, v):
//!
//! ```text
//! ρ = x² + y²
//! c = 1 + k₁ρ + k₂ρ² + k₃ρ³
//! x' = c x + 2p₁xy + p₂(ρ + 2x²)         u = f_u (x' + s y') + u₀
//! y' = c y + p₁(ρ + 2y²) + 2p₂xy         v = f_v y' + v₀
//! ```
//!
//! | symbol | in code | unit |
//! |---|---|---|
//! | f_u, f_v | `focal` | px |
//! | u₀, v₀ | `principal` | px, centre of the top-left pixel is (0, 0) |
//! | s | `skew` | – (factor on y', as in Bouguet's toolbox) |
//! | k₁ k₂ p₁ p₂ k₃ | `distortion` | – |
//! | ρ_max | `max_radius2` | – |
//!
//! The inverse has no closed form: Newton's method on (x', y') with the analytic 2×2 Jacobian, quadratic and
//! started at the distorted point. The model is one to one only while the radial map r·c(r²) grows: ρ_max is
//! the first zero of its derivative 1 + 3k₁ρ + 5k₂ρ² + 7k₃ρ³. Beyond it, and where Newton's method does not
//! settle, a pixel has no ray.
//!
//! Source: D. C. Brown, "Close-range camera calibration", 1971, in OpenCV's order of coefficients.
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

/// A calibrated camera: pixel ↔ ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera<T> {
    width: usize,
    height: usize,
    focal: Vector2<T>,
    principal: Vector2<T>,
    skew: T,
    distortion: Distortion<T>,
    max_radius2: T,
}

/// Iterations after which Newton's method is given up; it needs 3 to 5 within the lens model's domain.
const MAX_ITERATIONS: usize = 20;

impl<T: Real> Camera<T> {
    /// A camera of `width` × `height` pixels.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when the size or a focal length is not above 0, or a number is not finite.
    pub fn new(
        width: usize,
        height: usize,
        focal: [T; 2],
        principal: [T; 2],
        skew: T,
        distortion: Distortion<T>,
    ) -> Result<Self> {
        let check = |ok: bool, name, value: f64, expected| {
            if ok { Ok(()) } else { Err(Error::OutOfRange { name, value, expected }) }
        };
        check(width > 0, "camera.width", width as f64, "above 0")?;
        check(height > 0, "camera.height", height as f64, "above 0")?;
        for f in focal {
            let ok = f.is_finite() && f > T::zero();
            check(ok, "camera.focal", f.to_f64(), "a finite number above 0")?;
        }
        for c in principal {
            check(c.is_finite(), "camera.principal", c.to_f64(), "a finite number")?;
        }
        check(skew.is_finite(), "camera.skew", skew.to_f64(), "a finite number")?;
        let Distortion { k1, k2, p1, p2, k3 } = distortion;
        for k in [k1, k2, p1, p2, k3] {
            check(k.is_finite(), "camera.distortion", k.to_f64(), "a finite number")?;
        }
        let (focal, principal) = (Vector2::from(focal), Vector2::from(principal));
        let max_radius2 = max_radius2(&distortion);
        Ok(Self { width, height, focal, principal, skew, distortion, max_radius2 })
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// (f_u, f_v) in pixels.
    pub fn focal(&self) -> Vector2<T> {
        self.focal
    }

    /// (u₀, v₀) in pixels.
    pub fn principal(&self) -> Vector2<T> {
        self.principal
    }

    /// The factor s of y' in u.
    pub fn skew(&self) -> T {
        self.skew
    }

    /// The lens coefficients.
    pub fn distortion(&self) -> Distortion<T> {
        self.distortion
    }

    /// Whether the pixel lies in the picture, whose outermost pixels reach half a pixel beyond their centres.
    pub fn contains(&self, pixel: Vector2<T>) -> bool {
        let half = T::lit(0.5);
        let inside = |value: T, size: usize| value >= -half && value <= T::lit(size as f64) - half;
        inside(pixel.x, self.width) && inside(pixel.y, self.height)
    }

    /// The ray (x, y) of the ray (x, y, 1) in the camera's frame, or `None` where the lens model has no inverse.
    ///
    /// ```
    /// use monorange_core::geometry::{Camera, Distortion};
    /// use nalgebra::Vector2;
    /// let lens = Distortion { k1: -0.2, ..Default::default() };
    /// let camera = Camera::new(320, 240, [365.0, 365.0], [160.0, 120.0], 0.0, lens)?;
    /// let ray = camera.ray_from_pixel(Vector2::new(300.0, 200.0)).expect("inside the lens model");
    /// assert!((camera.pixel_from_ray(ray).expect("too") - Vector2::new(300.0, 200.0)).norm() < 1e-9);
    /// # Ok::<(), monorange_core::Error>(())
    /// ```
    pub fn ray_from_pixel(&self, pixel: Vector2<T>) -> Option<Vector2<T>> {
        self.undistort(self.distorted_from_pixel(pixel))
    }

    /// The pixel that sees the ray (x, y, 1), or `None` beyond the lens model's domain.
    pub fn pixel_from_ray(&self, ray: Vector2<T>) -> Option<Vector2<T>> {
        let inside = ray.norm_squared() <= self.max_radius2;
        inside.then(|| self.pixel_from_distorted(distort(&self.distortion, ray)))
    }

    /// ∂(u, v)/∂(x, y) at a ray.
    pub fn pixel_by_ray(&self, ray: Vector2<T>) -> Matrix2<T> {
        let skewed = self.focal.x * self.skew;
        Matrix2::new(self.focal.x, skewed, T::zero(), self.focal.y) * distort_by_ray(&self.distortion, ray)
    }

    /// ∂(x, y)/∂(u, v) at a ray, or `None` where the lens model folds over.
    pub fn ray_by_pixel(&self, ray: Vector2<T>) -> Option<Matrix2<T>> {
        inverse(&self.pixel_by_ray(ray))
    }

    /// The pixel that an ideal camera, without lens distortion, would see the ray at. Straight lines of the
    /// world are straight in ideal pixels.
    pub fn ideal_from_ray(&self, ray: Vector2<T>) -> Vector2<T> {
        self.pixel_from_distorted(ray)
    }

    /// The ray that an ideal camera sees at an ideal pixel.
    pub fn ray_from_ideal(&self, ideal: Vector2<T>) -> Vector2<T> {
        self.distorted_from_pixel(ideal)
    }

    fn distorted_from_pixel(&self, pixel: Vector2<T>) -> Vector2<T> {
        let y = (pixel.y - self.principal.y) / self.focal.y;
        Vector2::new((pixel.x - self.principal.x) / self.focal.x - self.skew * y, y)
    }

    fn pixel_from_distorted(&self, point: Vector2<T>) -> Vector2<T> {
        let u = self.focal.x * (point.x + self.skew * point.y) + self.principal.x;
        Vector2::new(u, self.focal.y * point.y + self.principal.y)
    }

    fn undistort(&self, distorted: Vector2<T>) -> Option<Vector2<T>> {
        if self.distortion == Distortion::default() {
            return Some(distorted);
        }
        // The best that rounding allows: a few units in the last place of the larger coordinate.
        let scale = T::one() + distorted.amax();
        let tolerance = scale * T::default_epsilon() * T::lit(2.0);
        let mut ray = distorted;
        let mut last = T::max_value()?;
        for _ in 0..MAX_ITERATIONS {
            let residual = distort(&self.distortion, ray) - distorted;
            let error = residual.amax();
            let settled = error <= tolerance;
            // Close to the answer rounding ends the progress: more iterations would only wander.
            let stalled = error <= tolerance * T::lit(8.0) && error >= last;
            if settled || stalled {
                let jacobian = distort_by_ray(&self.distortion, ray);
                let one_to_one = ray.norm_squared() <= self.max_radius2 && jacobian.determinant() > T::zero();
                return one_to_one.then_some(ray);
            }
            last = error;
            ray -= inverse(&distort_by_ray(&self.distortion, ray))? * residual;
            if !(ray.x.is_finite() && ray.y.is_finite()) {
                return None;
            }
        }
        None
    }
}

fn distort<T: Real>(lens: &Distortion<T>, ray: Vector2<T>) -> Vector2<T> {
    let two = T::lit(2.0);
    let (x, y) = (ray.x, ray.y);
    let rho = x * x + y * y;
    let radial = T::one() + rho * (lens.k1 + rho * (lens.k2 + rho * lens.k3));
    Vector2::new(
        radial * x + two * lens.p1 * x * y + lens.p2 * (rho + two * x * x),
        radial * y + lens.p1 * (rho + two * y * y) + two * lens.p2 * x * y,
    )
}

fn distort_by_ray<T: Real>(lens: &Distortion<T>, ray: Vector2<T>) -> Matrix2<T> {
    let (two, three, six) = (T::lit(2.0), T::lit(3.0), T::lit(6.0));
    let (x, y) = (ray.x, ray.y);
    let rho = x * x + y * y;
    let radial = T::one() + rho * (lens.k1 + rho * (lens.k2 + rho * lens.k3));
    let slope = two * (lens.k1 + rho * (two * lens.k2 + three * rho * lens.k3)); // (∂c/∂x)/x
    let cross = slope * x * y + two * (lens.p1 * x + lens.p2 * y);
    Matrix2::new(
        radial + slope * x * x + two * lens.p1 * y + six * lens.p2 * x,
        cross,
        cross,
        radial + slope * y * y + six * lens.p1 * y + two * lens.p2 * x,
    )
}

/// The smallest ρ > 0 at which 1 + 3k₁ρ + 5k₂ρ² + 7k₃ρ³ is zero, or the largest number without one.
fn max_radius2<T: Real>(lens: &Distortion<T>) -> T {
    let [a, b, c] = [T::lit(3.0) * lens.k1, T::lit(5.0) * lens.k2, T::lit(7.0) * lens.k3];
    let unlimited = T::max_value().unwrap_or(T::lit(1e30));
    let derivative = |rho: T| T::one() + rho * (a + rho * (b + rho * c));
    // March out to a ray of 85° off the axis, then bisect: a cubic changes sign at most three times.
    let (steps, limit) = (256, T::lit(130.0));
    let mut inside = T::zero();
    for step in 1..=steps {
        let fraction = T::lit(f64::from(step) / f64::from(steps));
        let mut outside = limit * fraction * fraction;
        if derivative(outside) > T::zero() {
            inside = outside;
            continue;
        }
        for _ in 0..60 {
            let middle = (inside + outside) * T::lit(0.5);
            if derivative(middle) > T::zero() {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        return inside;
    }
    unlimited
}

fn inverse<T: Real>(m: &Matrix2<T>) -> Option<Matrix2<T>> {
    let determinant = m.m11 * m.m22 - m.m12 * m.m21;
    if !determinant.is_finite() || determinant == T::zero() {
        return None;
    }
    Some(Matrix2::new(m.m22, -m.m12, -m.m21, m.m11) / determinant)
}
