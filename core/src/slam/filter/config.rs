//! Which filter, and its settings.
use crate::association::Gate;
use crate::geometry::RangeFinder;
use crate::{Error, Real, Result};

/// Which extended Kalman filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Variant {
    /// Right-invariant: exponential retraction and covariance reset. Consistent on long loops.
    #[default]
    Invariant,
    /// The paper's (12), (13): over-confident on long loops.
    Textbook,
    /// Jacobians at first estimates: consistent, brittle when a first estimate is an outlier.
    FirstEstimates,
}

/// How the covariance is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Covariance {
    /// P itself, packed: the fastest. What `f32` rounds away is covered by as much noise on the landmarks that are seen,
    /// so that a million updates of landmarks that are always in view, seen to a millimetre, leave it positive.
    #[default]
    Packed,
    /// P = U D Uᵀ, packed: positive by construction, several times the work. For sensors finer than that.
    Factored,
}

/// Settings of the filter. Checked once, by [`Filter::new`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterConfig<T> {
    /// Which filter.
    pub variant: Variant,
    /// How the covariance is kept.
    pub covariance: Covariance,
    /// What is done with a measurement beyond its gate.
    pub gate: Gate,
    /// The gate for 1 and 2 degrees of freedom, a value of χ².
    pub gate_nis: [T; 2],
    /// The camera on its mount, for [`Measurement::Pixel`](super::Measurement::Pixel).
    pub finder: Option<RangeFinder<T>>,
    /// Standard deviations of the mount's height (m), tilt, roll and yaw (rad): their errors become states.
    pub mount_std: Option<[T; 4]>,
    /// (range, standard deviation) in metres of a landmark seen by its bearing alone.
    pub range_prior: (T, T),
    /// Whether the invariant filter takes range and bearing as a position in the robot's frame, where its errors are
    /// linear. The other filters take them as they are, as the paper does.
    pub polar_as_point: bool,
    /// Linearity index below which an inverse-distance landmark becomes a point.
    pub linearity: T,
}

impl<T: Real> Default for FilterConfig<T> {
    fn default() -> Self {
        Self {
            variant: Variant::default(),
            covariance: Covariance::default(),
            gate: Gate::default(),
            gate_nis: crate::association::CHI2_99.map(T::lit),
            finder: None,
            mount_std: None,
            range_prior: (T::lit(4.0), T::lit(4.0)),
            polar_as_point: true,
            linearity: T::lit(0.1),
        }
    }
}

impl<T: Real> FilterConfig<T> {
    /// Whether a filter can run with these settings.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the name of the first value that it cannot use.
    pub fn check(&self) -> Result<()> {
        let positive = |name, number: T| {
            let value = number.to_f64();
            let ok = number.is_finite() && number > T::zero();
            if ok { Ok(()) } else { Err(Error::OutOfRange { name, value, expected: "finite and above 0" }) }
        };
        self.gate_nis.into_iter().try_for_each(|gate| positive("filter.gate_nis", gate))?;
        self.mount_std.into_iter().flatten().try_for_each(|std| positive("filter.mount_std", std))?;
        positive("filter.range_prior", self.range_prior.0)?;
        positive("filter.range_prior", self.range_prior.1)?;
        positive("filter.linearity", self.linearity)
    }
}
