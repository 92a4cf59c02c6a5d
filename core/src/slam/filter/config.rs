//! Which filter, and its settings.
use crate::association::Gate;
use crate::geometry::RangeFinder;
use crate::setting::{self, choices, settings};
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

choices!(Variant { "invariant" => Invariant, "textbook" => Textbook, "fej" => FirstEstimates });

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

choices!(Covariance { "packed" => Packed, "factored" => Factored });

/// Settings of the filter. Checked once, by [`Filter::new`](crate::slam::Filter::new).
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
    /// Standard deviation by which the mount's tilt and roll change from picture to picture, rad.
    pub sway: T,
    /// Standard deviation by which each of the mount's angles changes from picture to picture for good, rad.
    pub mount_walk: T,
    /// Standard deviations of what the wheels read wrongly all the time: shares of their travel and of their turn, and the turn
    /// that comes with each metre (rad/m). These errors become states.
    pub wheels_std: Option<[T; 3]>,
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
            sway: T::zero(),
            mount_walk: T::zero(),
            wheels_std: None,
            range_prior: (T::lit(4.0), T::lit(4.0)),
            polar_as_point: true,
            linearity: T::lit(0.1),
        }
    }
}

impl<T: Real> FilterConfig<T> {
    /// The settings themselves if a filter can run with them.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the name of the first value that it cannot use.
    pub fn validated(self) -> Result<Self> {
        let single = |number: T| number.to_f64() as f32;
        let mut rounded = FilterConfig {
            variant: self.variant,
            covariance: self.covariance,
            gate: self.gate,
            gate_nis: self.gate_nis.map(single),
            finder: None,
            mount_std: None,
            sway: 0.0,
            mount_walk: 0.0,
            wheels_std: None,
            range_prior: (single(self.range_prior.0), single(self.range_prior.1)),
            polar_as_point: self.polar_as_point,
            linearity: single(self.linearity),
        };
        setting::check(&FILTER, &mut rounded)?;
        let (mount, wheels) = (self.mount_std.into_iter().flatten(), self.wheels_std.into_iter().flatten());
        let named =
            mount.map(|std| ("filter.mount_std", std)).chain(wheels.map(|std| ("filter.wheels_std", std)));
        for (name, std) in named {
            if !(std.is_finite() && std > T::zero()) {
                return Err(Error::OutOfRange { name, value: std.to_f64(), expected: "finite and above 0" });
            }
        }
        let may_change = self.mount_std.is_some() && self.covariance == Covariance::Packed;
        for (name, change) in [("filter.sway", self.sway), ("filter.mount_walk", self.mount_walk)] {
            if !(change == T::zero() || change > T::zero() && may_change) {
                let expected = "at least 0, and 0 where the mount is exact or the covariance factored";
                return Err(Error::OutOfRange { name, value: change.to_f64(), expected });
            }
        }
        Ok(self)
    }

    /// How many states stand between the robot's and the landmarks'.
    pub(in crate::slam) fn shared(&self) -> usize {
        self.mount_std.map_or(0, |stds| stds.len()) + self.wheels_std.map_or(0, |stds| stds.len())
    }

    /// Standard deviations of the states between the robot's and the landmarks', in their order.
    pub(in crate::slam) fn shared_std(&self) -> heapless::Vec<T, 7> {
        let mut stds = heapless::Vec::new();
        // There is room for both.
        let _ = stds.extend_from_slice(self.mount_std.as_ref().map_or(&[][..], |stds| stds));
        let _ = stds.extend_from_slice(self.wheels_std.as_ref().map_or(&[][..], |stds| stds));
        stds
    }
}

settings! { FILTER, FILTER_REFERENCES, FilterConfig<f32>, "filter" {
    5 variant: Choice [variant] "Which filter: invariant is consistent on long loops, textbook is the paper's, fej takes Jacobians at first estimates.", "Consistency tests of the simulated loop (tests/slam_consistency).";
    6 covariance: Choice [covariance] "How the covariance is kept: packed is the fastest, factored stays positive for sensors finer than a millimetre.", "A million updates of landmarks seen to a millimetre (tests/slam_limits).";
    7 gate: Choice [gate] "What happens to a measurement beyond its gate: soft inflates its noise, hard drops it, none uses it as it is.", "A hard gate drops everything for good after one bad spell (theory page of core::association).";
    8 gate_nis: Pair [gate_nis] (1e-3, 1e6), "The gate: largest normalised innovation squared, for 1 and 2 degrees of freedom.", "χ² at 0.99 for 1 and 2 degrees of freedom.";
    9 range_prior: Couple [range_prior] (1e-3, 1e4, "m"), "Range, and its standard deviation, of a landmark that is first seen by its bearing alone.", "Judgement: indoor ranges.";
    10 linearity: Number [linearity] (1e-6, 10), "Linearity index below which a landmark in inverse distance becomes a point.", "Civera, Davison & Montiel 2008, who take 0.1.";
    48 polar_as_point: Switch [polar_as_point] "Whether the invariant filter takes range and bearing as a position in the robot's frame, where its errors are linear.", "Equation: the invariant error of a position is linear (theory page of core::slam).";
}}
