//! Pinhole camera with skew and a lens model.
//!
//! A ray (x, y, 1) of the camera's optical frame is seen at pixel (u, v), where (x', y') is the ray as the
//! [lens](super::Lens) bends it:
//!
//! ```text
//! u = f_u (x' + s y') + u₀         v = f_v y' + v₀
//! ```
//!
//! | symbol | in code | unit |
//! |---|---|---|
//! | f_u, f_v | `focal` | px |
//! | u₀, v₀ | `principal` | px, centre of the top-left pixel is (0, 0) |
//! | s | `skew` | – (factor on y', as in Bouguet's toolbox) |
//! | x', y' | [`Lens`](super::Lens) | – |
//! | ρ_max | `max_radius2` | – |
use super::lens::{Distortion, Lens, inverse};
use crate::{Error, Real, Result};
use nalgebra::{Matrix2, Vector2};

/// A calibrated camera: pixel ↔ ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera<T> {
    width: usize,
    height: usize,
    focal: Vector2<T>,
    principal: Vector2<T>,
    skew: T,
    lens: Lens<T>,
    max_radius2: T,
}

impl<T: Real> Camera<T> {
    /// A camera of `width` × `height` pixels with a Brown–Conrady lens.
    ///
    /// # Errors
    /// As [`with_lens`](Self::with_lens).
    pub fn new(
        width: usize,
        height: usize,
        focal: [T; 2],
        principal: [T; 2],
        skew: T,
        distortion: Distortion<T>,
    ) -> Result<Self> {
        Self::with_lens(width, height, focal, principal, skew, distortion.into())
    }

    /// A camera of `width` × `height` pixels with any lens: focal lengths and principal point in pixels.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when the size or a focal length is not above 0, or a number is not finite.
    pub fn with_lens(
        width: usize,
        height: usize,
        focal: [T; 2],
        principal: [T; 2],
        skew: T,
        lens: Lens<T>,
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
        let lens = lens.validated()?;
        let (focal, principal) = (Vector2::from(focal), Vector2::from(principal));
        Ok(Self { width, height, focal, principal, skew, lens, max_radius2: lens.max_radius2() })
    }

    /// The same camera in another scalar.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when a number does not fit into it.
    pub fn cast<U: Real>(&self) -> Result<Camera<U>> {
        let pair = |v: Vector2<T>| [U::lit(v.x.to_f64()), U::lit(v.y.to_f64())];
        let (focal, principal, skew) = (pair(self.focal), pair(self.principal), U::lit(self.skew.to_f64()));
        Camera::with_lens(self.width, self.height, focal, principal, skew, self.lens.cast())
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

    /// The lens model with its coefficients.
    pub fn lens(&self) -> &Lens<T> {
        &self.lens
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
        self.lens.undistort(self.distorted_from_pixel(pixel), self.max_radius2)
    }

    /// As [`ray_from_pixel`](Self::ray_from_pixel) and [`ray_by_pixel`](Self::ray_by_pixel) for several pixels, bit by bit.
    pub(super) fn rays_from_pixels<const N: usize>(
        &self,
        pixels: [Vector2<T>; N],
    ) -> [Option<(Vector2<T>, Matrix2<T>)>; N] {
        let distorted = pixels.map(|pixel| self.distorted_from_pixel(pixel));
        let rays = self.lens.undistort_all(distorted, self.max_radius2);
        rays.map(|found| {
            let (ray, lens_by_ray) = found?;
            Some((ray, inverse(&(self.pixel_by_distorted() * lens_by_ray))?))
        })
    }

    /// The pixel that sees the ray (x, y, 1), or `None` beyond the lens model's domain.
    pub fn pixel_from_ray(&self, ray: Vector2<T>) -> Option<Vector2<T>> {
        let inside = ray.norm_squared() <= self.max_radius2;
        inside.then(|| self.pixel_from_distorted(self.lens.distort(ray)))
    }

    /// ∂(u, v)/∂(x, y) at a ray.
    pub fn pixel_by_ray(&self, ray: Vector2<T>) -> Matrix2<T> {
        self.pixel_by_distorted() * self.lens.distort_by_ray(ray)
    }

    fn pixel_by_distorted(&self) -> Matrix2<T> {
        let skewed = self.focal.x * self.skew;
        Matrix2::new(self.focal.x, skewed, T::zero(), self.focal.y)
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
}
