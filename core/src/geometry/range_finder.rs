//! The virtual range finder: a pixel of the floor ↔ range and bearing.
//!
//! With the undistorted ray (x, y, 1) of a pixel,
//!
//! ```text
//! d = robot_from_cam · (x, y, 1)                  seen below the horizon where d_z < 0
//! (X, Y) = lever arm + d_xy · h / (−d_z)          the floor point in the robot's frame
//! r = √(X² + Y²),   φ = atan2(Y, X)               range and bearing
//! ```
//!
//! This is the vector form of the paper's equations (1)–(6); their trigonometric form, corrected, is an oracle
//! in `tests/`. Range grows like 1/(angle below the horizon), so its error grows like r²/h: at h = 0.4 m a pixel
//! of 1/365 rad costs 6 cm at 3 m. Noise of the pixel is independent from corner to corner; an error of the mount
//! is common to all of them, so the two Jacobians are kept apart.
use super::{Camera, Mount};
use crate::Real;
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2, Vector3};

/// A camera on its mount: the paper's virtual range finder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeFinder<T> {
    camera: Camera<T>,
    mount: Mount<T>,
    robot_from_cam: Matrix3<T>,
}

/// Why a pixel has no point on the floor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoFloor {
    /// The pixel looks at or above the horizon; for a plane above the lens, at or below it.
    AboveHorizon,
    /// The pixel is not in the picture, or the point is behind the camera or out of view.
    OutsideImage,
    /// The lens model is not one to one there.
    OutsideLensModel,
}

impl core::fmt::Display for NoFloor {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::AboveHorizon => "the pixel looks at or above the horizon",
            Self::OutsideImage => "the pixel is not in the picture, or the point is out of view",
            Self::OutsideLensModel => "the lens model is not one to one there",
        })
    }
}

impl core::error::Error for NoFloor {}

/// A floor point as range and bearing, with what its uncertainty follows from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting<T> {
    /// (X, Y) in the robot's frame, m.
    pub point_in_robot: Vector2<T>,
    /// Range from the robot's origin, m.
    pub range: T,
    /// Bearing from the robot's x axis, positive to the left, rad.
    pub bearing: T,
    /// ∂(range, bearing)/∂(u, v).
    pub by_pixel: Matrix2<T>,
    /// ∂(range, bearing)/∂(height, tilt, roll, yaw, forward, left).
    pub by_mount: SMatrix<T, 2, 6>,
}

/// A [`Sighting`] without what the mount's uncertainty does to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ranged<T> {
    /// (X, Y) in the robot's frame, m.
    pub point_in_robot: Vector2<T>,
    /// Range from the robot's origin, m.
    pub range: T,
    /// Bearing from the robot's x axis, positive to the left, rad.
    pub bearing: T,
    /// ∂(range, bearing)/∂(u, v).
    pub by_pixel: Matrix2<T>,
}

impl<T: Real> Ranged<T> {
    /// The covariance of (range, bearing) that follows from the pixel's, J Σ Jᵀ.
    pub fn noise(&self, pixel_covariance: &Matrix2<T>) -> Matrix2<T> {
        self.by_pixel * pixel_covariance * self.by_pixel.transpose()
    }
}

impl<T: Real> Sighting<T> {
    /// The covariance of (range, bearing) that follows from the pixel's, J Σ Jᵀ: independent noise.
    pub fn noise(&self, pixel_covariance: &Matrix2<T>) -> Matrix2<T> {
        self.by_pixel * pixel_covariance * self.by_pixel.transpose()
    }

    /// The covariance of (range, bearing) that follows from the mount's standard deviations (in the order of
    /// [`MOUNT_PARAMETERS`](super::MOUNT_PARAMETERS)): common to every corner, not independent noise.
    pub fn systematic(&self, mount_std: &[T; 6]) -> Matrix2<T> {
        let mut scaled = self.by_mount;
        for (mut column, std) in scaled.column_iter_mut().zip(mount_std) {
            column *= *std;
        }
        scaled * scaled.transpose()
    }
}

impl<T: Real> RangeFinder<T> {
    /// The range finder of a camera on a mount.
    pub fn new(camera: Camera<T>, mount: Mount<T>) -> Self {
        Self { camera, mount, robot_from_cam: mount.robot_from_cam() }
    }

    /// The same camera as the range finder of points that are `height` metres above the floor, a switch or a lamp: what it calls the
    /// floor is the level plane there, which may be above the lens.
    ///
    /// # Errors
    /// [`Error::OutOfRange`](crate::Error::OutOfRange) for a plane through the lens, or a height that is not finite.
    ///
    /// ```
    /// use monorange_core::geometry::{Camera, Mount, RangeFinder};
    /// use nalgebra::Vector2;
    /// let camera = Camera::new(320, 240, [365.0, 365.0], [160.0, 120.0], 0.0, Default::default())?;
    /// let finder = RangeFinder::new(camera, Mount::new([0.5, -0.2, 0.0, 0.0, 0.0, 0.0])?); // 0.2 rad up
    /// let lamp = finder.of_height(2.5)?.sight(Vector2::new(160.0, 120.0)).expect("the optical axis meets 2.5 m");
    /// assert!((lamp.range - 2.0 / 0.2_f64.tan()).abs() < 1e-12);
    /// # Ok::<(), monorange_core::Error>(())
    /// ```
    pub fn of_height(&self, height: T) -> crate::Result<Self> {
        let mount = self.mount.over(height);
        if !mount.height().is_finite() || mount.height().abs() < T::default_epsilon().sqrt() {
            return Err(crate::Error::OutOfRange {
                name: "height above the floor",
                value: height.to_f64(),
                expected: "a finite number, and not the height of the lens",
            });
        }
        Ok(Self { mount, ..*self })
    }

    /// The same range finder in another scalar.
    ///
    /// # Errors
    /// [`Error::OutOfRange`](crate::Error::OutOfRange) when a number does not fit into it.
    pub fn cast<U: Real>(&self) -> crate::Result<RangeFinder<U>> {
        let mount = Mount::new(self.mount.parameters().map(|number| U::lit(number.to_f64())))?;
        Ok(RangeFinder::new(self.camera.cast()?, mount))
    }

    /// The camera.
    pub fn camera(&self) -> &Camera<T> {
        &self.camera
    }

    /// The mount.
    pub fn mount(&self) -> &Mount<T> {
        &self.mount
    }

    /// The rotation that takes a direction of the optical frame to the robot's.
    pub fn robot_from_cam(&self) -> &Matrix3<T> {
        &self.robot_from_cam
    }

    /// The floor point (X, Y) in the robot's frame that the ray (x, y, 1) meets.
    ///
    /// # Errors
    /// [`NoFloor::AboveHorizon`].
    pub fn floor_from_ray(&self, ray: Vector2<T>) -> Result<Vector2<T>, NoFloor> {
        self.direction_from_ray(ray).map(|direction| self.floor_from_direction(&direction))
    }

    /// The floor point (X, Y) in the robot's frame that a pixel sees.
    ///
    /// # Errors
    /// [`NoFloor`], every variant.
    pub fn floor_from_pixel(&self, pixel: Vector2<T>) -> Result<Vector2<T>, NoFloor> {
        self.floor_from_ray(self.checked_ray(pixel)?)
    }

    /// Range and bearing of the floor point that a pixel sees, with Jacobians.
    ///
    /// # Errors
    /// [`NoFloor`], every variant.
    ///
    /// ```
    /// use monorange_core::geometry::{Camera, Mount, RangeFinder};
    /// use nalgebra::Vector2;
    /// let camera = Camera::new(320, 240, [365.0, 365.0], [160.0, 120.0], 0.0, Default::default())?;
    /// let mount = Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0])?; // 0.4 m up, 0.2 rad down
    /// let finder = RangeFinder::new(camera, mount);
    /// let ahead = finder.sight(Vector2::new(160.0, 120.0)).expect("the optical axis meets the floor");
    /// assert!((ahead.range - 0.4 / 0.2_f64.tan()).abs() < 1e-12);
    /// # Ok::<(), monorange_core::Error>(())
    /// ```
    pub fn sight(&self, pixel: Vector2<T>) -> Result<Sighting<T>, NoFloor> {
        let ray = self.checked_ray(pixel)?;
        let direction = self.direction_from_ray(ray)?;
        let ray_by_pixel = self.camera.ray_by_pixel(ray).ok_or(NoFloor::OutsideLensModel)?;
        let Ranged { point_in_robot, range, bearing, by_pixel } = self.ranged(&direction, &ray_by_pixel);
        let by_floor = range_bearing_by_floor(point_in_robot, range);
        let by_mount = by_floor * self.mount.floor_by_mount(&direction);
        Ok(Sighting { point_in_robot, range, bearing, by_pixel, by_mount })
    }

    /// As [`sight`](Self::sight) for several pixels, the same bit by bit but without the mount's part: a third of the time for each.
    ///
    /// # Errors
    /// As [`sight`](Self::sight), for each.
    pub fn ranges<const N: usize>(&self, pixels: [Vector2<T>; N]) -> [Result<Ranged<T>, NoFloor>; N] {
        let mut rays = self.camera.rays_from_pixels(pixels).into_iter();
        pixels.map(|pixel| {
            let ray = rays.next().flatten();
            if !self.camera.contains(pixel) {
                return Err(NoFloor::OutsideImage);
            }
            let (ray, ray_by_pixel) = ray.ok_or(NoFloor::OutsideLensModel)?;
            let direction = self.direction_from_ray(ray)?;
            Ok(self.ranged(&direction, &ray_by_pixel))
        })
    }

    #[inline(always)]
    fn ranged(&self, direction: &Vector3<T>, ray_by_pixel: &Matrix2<T>) -> Ranged<T> {
        let point = self.floor_from_direction(direction);
        let floor_by_ray =
            self.mount.floor_by_direction(direction) * self.robot_from_cam.fixed_columns::<2>(0);
        let (range, bearing) = range_bearing_from_floor(point);
        let by_floor = range_bearing_by_floor(point, range);
        Ranged { point_in_robot: point, range, bearing, by_pixel: by_floor * floor_by_ray * ray_by_pixel }
    }

    /// The pixel that sees a floor point given in the robot's frame.
    ///
    /// # Errors
    /// [`NoFloor::OutsideImage`] behind the camera or beyond the picture's edge,
    /// [`NoFloor::OutsideLensModel`] beyond the lens model.
    pub fn pixel_from_floor(&self, point_in_robot: Vector2<T>) -> Result<Vector2<T>, NoFloor> {
        let pixel = self.pixel_from_floor_unbounded(point_in_robot)?;
        if self.camera.contains(pixel) { Ok(pixel) } else { Err(NoFloor::OutsideImage) }
    }

    /// As [`pixel_from_floor`](Self::pixel_from_floor), also beyond the picture's edge.
    ///
    /// # Errors
    /// [`NoFloor::OutsideImage`] behind the camera, [`NoFloor::OutsideLensModel`] beyond the lens model.
    pub fn pixel_from_floor_unbounded(&self, point_in_robot: Vector2<T>) -> Result<Vector2<T>, NoFloor> {
        let offset = point_in_robot - self.mount.lever_arm();
        self.pixel_from_direction(&Vector3::new(offset.x, offset.y, -self.mount.height()))
    }

    /// The pixel that sees in a direction of the robot's axes.
    pub(super) fn pixel_from_direction(&self, direction: &Vector3<T>) -> Result<Vector2<T>, NoFloor> {
        let in_cam = self.robot_from_cam.tr_mul(direction);
        if in_cam.z <= T::zero() {
            return Err(NoFloor::OutsideImage);
        }
        self.camera.pixel_from_ray(in_cam.xy() / in_cam.z).ok_or(NoFloor::OutsideLensModel)
    }

    /// The horizon as a line (a, b, c) of rays, a x + b y + c = 0, positive above it: the third row of
    /// `robot_from_cam`.
    pub fn horizon(&self) -> Vector3<T> {
        self.robot_from_cam.row(2).transpose()
    }

    fn checked_ray(&self, pixel: Vector2<T>) -> Result<Vector2<T>, NoFloor> {
        if !self.camera.contains(pixel) {
            return Err(NoFloor::OutsideImage);
        }
        self.camera.ray_from_pixel(pixel).ok_or(NoFloor::OutsideLensModel)
    }

    fn direction_from_ray(&self, ray: Vector2<T>) -> Result<Vector3<T>, NoFloor> {
        let direction = self.robot_from_cam * ray.push(T::one());
        let meets =
            if self.mount.height() > T::zero() { direction.z < T::zero() } else { direction.z > T::zero() };
        if meets { Ok(direction) } else { Err(NoFloor::AboveHorizon) }
    }

    fn floor_from_direction(&self, direction: &Vector3<T>) -> Vector2<T> {
        self.mount.lever_arm() + direction.xy() * (self.mount.height() / -direction.z)
    }
}

/// (range, bearing) of a point in the robot's frame.
pub fn range_bearing_from_floor<T: Real>(point_in_robot: Vector2<T>) -> (T, T) {
    (point_in_robot.norm(), point_in_robot.y.atan2(point_in_robot.x))
}

/// ∂(range, bearing)/∂(X, Y): rows (X, Y)/r and (−Y, X)/r².
pub fn range_bearing_by_floor<T: Real>(point_in_robot: Vector2<T>, range: T) -> Matrix2<T> {
    let unit = point_in_robot / range;
    Matrix2::new(unit.x, unit.y, -unit.y / range, unit.x / range)
}
