//! What a sensor may report about a landmark.
use crate::geometry::RangeFinder;
use crate::{Error, Real, Result};
use nalgebra::{Matrix2, Matrix2x4, Vector2};

/// A measurement of one landmark, each with its own covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measurement<T> {
    /// Range (m) and bearing (rad, positive to the left) from the robot's origin.
    RangeBearing {
        /// Metres, above 0.
        range: T,
        /// Radians.
        bearing: T,
        /// Covariance of (range, bearing).
        covariance: Matrix2<T>,
        /// ∂(range, bearing)/∂(height, tilt, roll, yaw) where a camera's mount made them, see
        /// [`Sighting::by_mount`](crate::geometry::Sighting); used when the filter estimates the mount.
        by_mount: Option<Matrix2x4<T>>,
    },
    /// A position in the robot's frame, from a sensor that measures positions.
    Point {
        /// (forward, left) in metres.
        point: Vector2<T>,
        /// m².
        covariance: Matrix2<T>,
    },
    /// A direction alone.
    Bearing {
        /// Radians.
        bearing: T,
        /// rad².
        variance: T,
        /// (range, its standard deviation) to start a landmark from, in metres: for instance the floor's. It is
        /// used at the landmark's birth and never again.
        range_prior: Option<(T, T)>,
    },
    /// A distance alone.
    Range {
        /// Metres, above 0.
        range: T,
        /// m².
        variance: T,
    },
    /// The pixel that sees a landmark on the floor; needs a [`RangeFinder`] in the filter's configuration.
    Pixel {
        /// (u, v).
        pixel: Vector2<T>,
        /// px².
        covariance: Matrix2<T>,
    },
}

impl<T: Real> Measurement<T> {
    /// Range and bearing with independent errors of the given standard deviations.
    pub fn range_bearing(range: T, bearing: T, range_std: T, bearing_std: T) -> Self {
        let zero = T::zero();
        let covariance = Matrix2::new(range_std * range_std, zero, zero, bearing_std * bearing_std);
        Self::RangeBearing { range, bearing, covariance, by_mount: None }
    }

    /// Degrees of freedom of the measurement: 2, or 1 for a bearing or a range alone.
    pub fn dof(&self) -> usize {
        match self {
            Self::RangeBearing { .. } | Self::Point { .. } | Self::Pixel { .. } => 2,
            Self::Bearing { .. } | Self::Range { .. } => 1,
        }
    }

    /// Checks every number.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when a number is not finite, a range is not above 0, or a covariance is not
    /// symmetric positive definite.
    pub fn check(&self) -> Result<()> {
        match self {
            Self::RangeBearing { range, bearing, covariance, by_mount } => {
                check_range(*range)?;
                check_finite(*bearing, "measurement.bearing")?;
                check_covariance(covariance)?;
                by_mount
                    .iter()
                    .flat_map(|jacobian| jacobian.iter())
                    .try_for_each(|value| check_finite(*value, "measurement.by_mount"))
            }
            Self::Point { point, covariance } => {
                point.iter().try_for_each(|value| check_finite(*value, "measurement.point"))?;
                check_covariance(covariance)
            }
            Self::Bearing { bearing, variance, range_prior } => {
                check_finite(*bearing, "measurement.bearing")?;
                check_variance(*variance)?;
                let Some((range, std)) = range_prior else { return Ok(()) };
                check_range(*range)?;
                check_variance(*std)
            }
            Self::Range { range, variance } => {
                check_range(*range)?;
                check_variance(*variance)
            }
            Self::Pixel { pixel, covariance } => {
                pixel.iter().try_for_each(|value| check_finite(*value, "measurement.pixel"))?;
                check_covariance(covariance)
            }
        }
    }

    /// Range and bearing of the floor point at a pixel, as the paper measures it, with the covariance J Σ Jᵀ.
    /// `None` where the pixel sees no floor.
    pub fn from_floor_pixel(
        finder: &RangeFinder<T>,
        pixel: Vector2<T>,
        covariance: &Matrix2<T>,
    ) -> Option<Self> {
        let sighting = finder.sight(pixel).ok()?;
        Some(Self::RangeBearing {
            range: sighting.range,
            bearing: sighting.bearing,
            covariance: sighting.noise(covariance),
            by_mount: Some(sighting.by_mount.fixed_columns::<4>(0).into_owned()),
        })
    }
}

fn check_finite<T: Real>(number: T, name: &'static str) -> Result<()> {
    let value = number.to_f64();
    if number.is_finite() {
        Ok(())
    } else {
        Err(Error::OutOfRange { name, value, expected: "a finite number" })
    }
}

fn check_range<T: Real>(range: T) -> Result<()> {
    let value = range.to_f64();
    let error =
        Error::OutOfRange { name: "measurement.range", value, expected: "finite and above 0 (metres)" };
    if range.is_finite() && range > T::zero() { Ok(()) } else { Err(error) }
}

fn check_variance<T: Real>(variance: T) -> Result<()> {
    let value = variance.to_f64();
    let error = Error::OutOfRange { name: "measurement.variance", value, expected: "finite and above 0" };
    if variance.is_finite() && variance > T::zero() { Ok(()) } else { Err(error) }
}

fn check_covariance<T: Real>(covariance: &Matrix2<T>) -> Result<()> {
    check_variance(covariance.m11)?;
    check_variance(covariance.m22)?;
    check_finite(covariance.m12, "measurement.covariance")?;
    let slack = T::default_epsilon() * T::lit(16.0) * (covariance.m11 * covariance.m22).sqrt();
    let symmetric = (covariance.m12 - covariance.m21).abs() <= slack;
    let determinant = covariance.m11 * covariance.m22 - covariance.m12 * covariance.m12;
    if symmetric && determinant > T::zero() {
        return Ok(());
    }
    let (name, value) = ("measurement.covariance", determinant.to_f64());
    Err(Error::OutOfRange { name, value, expected: "symmetric, with a determinant above 0" })
}
