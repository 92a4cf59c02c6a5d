use crate::Real;
use crate::features::Keypoint;
use crate::geometry::Camera;
use nalgebra::{Matrix2, Matrix3, Vector2};

/// Variance, px², by which a lens that bends, relief and blur move a point from where a homography has it: the variance of a
/// small blob, 0.01 px² and less, knows of none of them. Chosen on simulated corridors.
pub const UNEVEN_VAR_PX2: f32 = 0.1;

/// A point of one picture and its match in another, each with the covariance of its position.
///
/// The coordinates are pixels, or rays (x, y) where a function says so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match<T> {
    /// In the first picture.
    pub from: Vector2<T>,
    /// In the second picture.
    pub to: Vector2<T>,
    /// Covariance of `from`.
    pub from_cov: Matrix2<T>,
    /// Covariance of `to`.
    pub to_cov: Matrix2<T>,
}

impl<T: Real> Match<T> {
    /// The match of `from` with `to`, each coordinate with its own variance, equal in all directions.
    pub fn new(from: Vector2<T>, to: Vector2<T>, var_from: T, var_to: T) -> Self {
        let from_cov = Matrix2::from_diagonal_element(var_from);
        Self { from, to, from_cov, to_cov: Matrix2::from_diagonal_element(var_to) }
    }

    /// The match of two keypoints, each with its own variance.
    pub fn of_keypoints(from: &Keypoint, to: &Keypoint) -> Self {
        let wide = |value: f32| T::lit(f64::from(value));
        Self::new(from.pixel.map(wide), to.pixel.map(wide), wide(from.var_px2), wide(to.var_px2))
    }

    /// As [`of_keypoints`](Self::of_keypoints), each end with a variance of [`UNEVEN_VAR_PX2`] at least: between pictures of anything,
    /// by a camera that is not known.
    pub fn of_uneven_keypoints(from: &Keypoint, to: &Keypoint) -> Self {
        let uneven = |end: &Keypoint| Keypoint { var_px2: end.var_px2.max(UNEVEN_VAR_PX2), ..*end };
        Self::of_keypoints(&uneven(from), &uneven(to))
    }

    /// This match of pixels as one of rays (x, y), its covariances carried along; `None` outside the lens model.
    pub fn as_rays(&self, camera: &Camera<T>) -> Option<Self> {
        let ray = |pixel: Vector2<T>, covariance: &Matrix2<T>| {
            let ray = camera.ray_from_pixel(pixel)?;
            let jacobian = camera.ray_by_pixel(ray)?;
            Some((ray, jacobian * covariance * jacobian.transpose()))
        };
        if !self.is_finite() {
            return None;
        }
        let (from, from_cov) = ray(self.from, &self.from_cov)?;
        let (to, to_cov) = ray(self.to, &self.to_cov)?;
        Some(Self { from, to, from_cov, to_cov })
    }

    /// The two variances, averaged over the directions.
    pub(super) fn variances(&self) -> (T, T) {
        let half = T::lit(0.5);
        (self.from_cov.trace() * half, self.to_cov.trace() * half)
    }

    pub(super) fn is_finite(&self) -> bool {
        let variances = self.variances();
        let finite = |p: Vector2<T>| p.x.is_finite() && p.y.is_finite();
        finite(self.from)
            && finite(self.to)
            && variances.0.is_finite()
            && variances.1.is_finite()
            && variances.1 > T::zero()
            && variances.0 >= T::zero()
    }
}

/// Hartley's normalisation p̃ = s (p − c): centroid to the origin, mean square of a coordinate to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Normalisation<T> {
    pub(super) centre: Vector2<T>,
    pub(super) scale: T,
}

impl<T: Real> Normalisation<T> {
    /// The normalisation of some points, or `None` when they coincide or are not finite.
    pub(super) fn of(points: impl Iterator<Item = Vector2<T>> + Clone) -> Option<Self> {
        let (mut count, mut sum) = (T::zero(), Vector2::zeros());
        for point in points.clone() {
            count += T::one();
            sum += point;
        }
        let centre = sum / count;
        let square = points.fold(T::zero(), |square, point| square + (point - centre).norm_squared());
        let scale = (count * T::lit(2.0) / square).sqrt();
        (scale.is_finite() && scale > T::zero()).then_some(Self { centre, scale })
    }

    pub(super) fn apply(&self, point: Vector2<T>) -> Vector2<T> {
        (point - self.centre) * self.scale
    }

    /// p̃ = matrix · p.
    pub(super) fn matrix(&self) -> Matrix3<T> {
        let (s, c, zero) = (self.scale, self.centre, T::zero());
        Matrix3::new(s, zero, -s * c.x, zero, s, -s * c.y, zero, zero, T::one())
    }

    /// p = inverse · p̃.
    pub(super) fn inverse(&self) -> Matrix3<T> {
        let (s, c, zero) = (T::one() / self.scale, self.centre, T::zero());
        Matrix3::new(s, zero, c.x, zero, s, c.y, zero, zero, T::one())
    }
}
