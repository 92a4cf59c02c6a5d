//! The filter's state in its storage; predict, update, births and what can be read are files of their own.
pub(in crate::slam) mod birth;
mod config;
mod elementwise;
mod knock;
mod outcome;
mod predict;
mod read;
mod scale;
mod sway;
pub(in crate::slam) mod update;
mod wheels;

pub use config::{Covariance, FilterConfig, Variant};
pub(crate) use config::{FILTER, FILTER_REFERENCES};
pub use outcome::{Decision, Observation, Outcome};

use crate::geometry::{Pose, RangeFinder, wrap_angle};
use crate::slam::covariance::factored;
use crate::slam::covariance::triangle::{Triangle, TriangleRef, packed_len};
use crate::slam::covariance::{Row, Rows};
use crate::slam::landmark::{Form, Landmark};
use crate::slam::models::Increment;
use crate::slam::models::Measurement;
use crate::slam::models::linearise::{Linearised, Relative, linearise};
use crate::{Error, Real, Result};
use core::marker::PhantomData;
use nalgebra::{Matrix2, Matrix3, Vector2};

/// Landmarks whose downdates share one pass over the covariance.
pub(in crate::slam) const BATCH: usize = 4;
/// Working vectors: two for every landmark of a batch, the correction, and two for the reset.
const WORK: usize = 2 * BATCH + 3;
/// Vectors beside the covariance: the state, its rounding errors, first estimates, and the working ones.
const VECTORS: usize = 3 + WORK;
/// States before the landmarks: the robot's.
pub(in crate::slam) const ROBOT: usize = 3;
/// The mount's.
const MOUNT: usize = 4;
/// The wheels'.
pub const WHEEL_STATES: usize = 3;

/// States of a robot and `landmarks` points; an inverse-distance landmark counts twice. The wheels' errors, where they are estimated,
/// take [`WHEEL_STATES`] of them, or as much more room.
pub const fn states_for(landmarks: usize, with_mount: bool) -> usize {
    ROBOT + if with_mount { MOUNT } else { 0 } + 2 * landmarks
}

/// Numbers that a filter of so many states needs to be lent.
///
/// ```
/// use monorange_core::slam::{states_for, storage_len};
/// assert_eq!(4 * storage_len(states_for(32, false)), 12_864); // bytes of f32 for 32 landmarks
/// ```
pub const fn storage_len(states: usize) -> usize {
    VECTORS * states + packed_len(states)
}

/// The filter: robot, landmarks, and their joint covariance, in storage lent by the caller.
///
/// `S` holds numbers ([`storage_len`] of them), `L` the landmarks' records: arrays on a microcontroller, `Vec`s on
/// a host. The state changes in [`predict`](Self::predict), [`update`](Self::update), the births and removals, and
/// nowhere else; a call that returns an error has changed nothing.
///
/// ```
/// use monorange_core::geometry::Pose;
/// use monorange_core::slam::*;
/// use nalgebra::{Matrix2, Matrix3, Vector2};
/// const STATES: usize = states_for(4, false);
/// let storage = [0.0_f64; storage_len(STATES)];
/// let landmarks = [Landmark::default(); 4];
/// let mut filter = Filter::new(storage, landmarks, Pose::default(), Matrix3::zeros(), FilterConfig::default())?;
/// // A landmark 2 m ahead; then a step of 1 m, uncertain by 0.1 m; then the landmark again, at 1.1 m.
/// filter.birth(0.0, 7, &Measurement::range_bearing(2.0, 0.0, 0.01, 0.01))?;
/// let noise = Matrix2::from_diagonal(&Vector2::new(0.01, 1e-4));
/// filter.predict(1.0, &Increment::from_velocity(1.0, 0.0, 1.0, &noise, Integration::Arc))?;
/// let sighting = Observation { landmark: 7, measurement: Measurement::range_bearing(1.1, 0.0, 0.01, 0.01) };
/// let mut outcome = [Outcome::default()];
/// filter.update(&[sighting], &mut outcome)?;
/// assert!((filter.pose().x - 0.9).abs() < 0.01);
/// # Ok::<(), monorange_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Filter<T, S, L> {
    pub(in crate::slam) config: FilterConfig<T>,
    storage: S,
    pub(in crate::slam) landmarks: L,
    pub(in crate::slam) count: usize,
    capacity: usize,
    pub(in crate::slam) size: usize,
    pub(in crate::slam) time: f64,
    /// The pose as predicted, where first-estimates Jacobians are taken.
    pub(in crate::slam) first_pose: [T; 3],
    /// How often the covariance failed, and the map began anew.
    pub(super) resets: u32,
    /// Whether the landmarks stay where they are: they correct the robot, and nothing corrects them.
    pub(in crate::slam) fixed: bool,
    scalar: PhantomData<T>,
}

#[cfg(feature = "alloc")]
impl<T: Real> Filter<T, alloc::vec::Vec<T>, alloc::vec::Vec<Landmark<T>>> {
    /// As [`new`](Self::new), in `Vec`s with room for so many landmarks.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn on_heap(
        landmarks: usize,
        pose: Pose<T>,
        covariance: Matrix3<T>,
        config: FilterConfig<T>,
    ) -> Result<Self> {
        let states =
            states_for(landmarks, config.mount_std.is_some()) + config.wheels_std.map_or(0, |_| WHEEL_STATES);
        let numbers = alloc::vec![T::zero(); storage_len(states)];
        Self::new(numbers, alloc::vec![Landmark::default(); landmarks], pose, covariance, config)
    }
}

/// The storage, cut into its parts.
pub(in crate::slam) struct Parts<'a, T> {
    /// The state.
    pub(in crate::slam) x: &'a mut [T],
    /// What rounding has taken from the state: x + rounding is the state to twice the digits.
    pub(in crate::slam) rounding: &'a mut [T],
    /// First estimates.
    pub(in crate::slam) first: &'a mut [T],
    /// Working vectors.
    pub(in crate::slam) work: &'a mut [T],
    /// P, or U and D.
    pub(in crate::slam) p: Triangle<'a, T>,
}

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Filter<T, S, L> {
    /// A filter at `pose` with an empty map.
    ///
    /// # Errors
    /// [`Error::Size`] when `storage` cannot hold a robot; [`Error::OutOfRange`] for a number that is not finite, a
    /// negative variance, or a gate that is not above 0.
    pub fn new(
        storage: S,
        landmarks: L,
        pose: Pose<T>,
        covariance: Matrix3<T>,
        config: FilterConfig<T>,
    ) -> Result<Self> {
        let length = storage.as_ref().len();
        let start = ROBOT + config.shared();
        let mut capacity = 0;
        while storage_len(capacity + 1) <= length {
            capacity += 1;
        }
        if capacity < start {
            return Err(Error::Size { name: "filter.storage", got: length, expected: storage_len(start) });
        }
        let config = config.validated()?;
        let prior = Increment { delta: [pose.x, pose.y, pose.heading].into(), covariance };
        prior.check()?;
        let first_pose = [pose.x, pose.y, pose.heading];
        let scalar = PhantomData;
        let mut filter = Self {
            config,
            storage,
            landmarks,
            count: 0,
            capacity,
            size: start,
            time: 0.0,
            first_pose,
            resets: 0,
            fixed: false,
            scalar,
        };
        filter.storage.as_mut().fill(T::zero());
        let parts = filter.parts();
        for (value, start) in parts.x.iter_mut().zip(first_pose) {
            *value = start;
        }
        let mut p = parts.p;
        for (row, entries) in covariance.row_iter().enumerate() {
            for (column, entry) in entries.iter().enumerate().skip(row) {
                p.set(row, column, *entry);
            }
        }
        for (at, std) in config.shared_std().into_iter().enumerate() {
            p.set(ROBOT + at, ROBOT + at, std * std);
        }
        if config.covariance == Covariance::Factored {
            factored::factorise(&mut p);
        }
        Ok(filter)
    }

    /// The storage and the landmarks' records that it was lent.
    pub fn into_storage(self) -> (S, L) {
        (self.storage, self.landmarks)
    }

    /// States before the landmarks'.
    pub(in crate::slam) fn start(&self) -> usize {
        ROBOT + self.config.shared()
    }

    /// The settings.
    pub fn config(&self) -> &FilterConfig<T> {
        &self.config
    }

    pub(in crate::slam) fn check_time(&self, time: f64) -> Result<()> {
        if time >= self.time && time.is_finite() {
            return Ok(());
        }
        Err(Error::TimeBackwards { time, last: self.time })
    }

    /// Cuts the storage into its parts.
    pub(in crate::slam) fn parts(&mut self) -> Parts<'_, T> {
        self.parts_and_landmarks().0
    }

    /// As [`parts`](Self::parts), with the records beside them.
    #[allow(clippy::indexing_slicing, reason = "the capacity was computed from the length")]
    pub(in crate::slam) fn parts_and_landmarks(&mut self) -> (Parts<'_, T>, &[Landmark<T>]) {
        let n = self.capacity;
        let (vectors, p) = self.storage.as_mut().split_at_mut(VECTORS * n);
        let (x, vectors) = vectors.split_at_mut(n);
        let (rounding, vectors) = vectors.split_at_mut(n);
        let (first, work) = vectors.split_at_mut(n);
        let p = Triangle::new(&mut p[..packed_len(n)], n, self.size);
        (Parts { x, rounding, first, work, p }, self.landmarks.as_ref().get(..self.count).unwrap_or_default())
    }

    #[allow(clippy::indexing_slicing, reason = "the capacity was computed from the length")]
    pub(in crate::slam) fn triangle(&self) -> TriangleRef<'_, T> {
        let n = self.capacity;
        TriangleRef::new(&self.storage.as_ref()[VECTORS * n..], n, self.size)
    }

    /// The state, rounded.
    #[allow(clippy::indexing_slicing, reason = "offsets come from the filter's own records")]
    pub(in crate::slam) fn x(&self, index: usize) -> T {
        self.storage.as_ref()[index]
    }

    /// x[i] − x[j], free of what rounding takes from either far from the origin.
    #[allow(clippy::indexing_slicing, reason = "offsets come from the filter's own records")]
    pub(in crate::slam) fn difference(&self, i: usize, j: usize) -> T {
        let (all, n) = (self.storage.as_ref(), self.capacity);
        (all[i] - all[j]) + (all[n + i] - all[n + j])
    }

    #[allow(clippy::indexing_slicing, reason = "offsets come from the filter's own records")]
    pub(in crate::slam) fn first(&self, index: usize) -> T {
        self.storage.as_ref()[2 * self.capacity + index]
    }

    /// ∂position/∂(the landmark's numbers).
    pub(in crate::slam) fn position_rows(&self, landmark: &Landmark<T>) -> Rows<T> {
        let mut rows = Rows::new();
        let _ = rows.push(Row::new(landmark.offset, Matrix2::identity()));
        if landmark.form == Form::InverseDistance {
            let at = landmark.offset + 2;
            let (angle, inverse) = (self.x(at), self.x(at + 1));
            let towards = Vector2::new(angle.cos(), angle.sin()) / inverse;
            let across = Vector2::new(-towards.y, towards.x);
            let _ = rows.push(Row::new(at, Matrix2::from_columns(&[across, towards / -inverse])));
        }
        rows
    }

    fn robot(&self) -> [T; 3] {
        [self.x(0), self.x(1), self.x(2)]
    }

    /// cos θ, sin θ.
    pub(in crate::slam) fn heading(&self) -> (T, T) {
        let (sin, cos) = self.x(2).sin_cos();
        (cos, sin)
    }

    /// The landmark as the robot sees it now; `heading` is [`heading`](Self::heading)'s.
    pub(in crate::slam) fn relative_at(&self, landmark: &Landmark<T>, heading: (T, T)) -> Relative<T> {
        let at = landmark.offset;
        let offset = Vector2::new(self.difference(at, 0), self.difference(at + 1, 1));
        let inverse = landmark.form == Form::InverseDistance;
        Relative { heading, offset, ray: inverse.then(|| (self.x(at + 2), self.x(at + 3))) }
    }

    /// The measurement of a landmark, linearised about the present state.
    pub(in crate::slam) fn linearise(
        &self,
        landmark: &Landmark<T>,
        heading: (T, T),
        measurement: &Measurement<T>,
        finder: Option<&RangeFinder<T>>,
    ) -> Option<Linearised<T>> {
        let now = self.relative_at(landmark, heading);
        let as_point = self.config.polar_as_point && self.config.variant == Variant::Invariant;
        if self.config.variant == Variant::FirstEstimates {
            return linearise(measurement, &now, &self.reference(landmark), finder, as_point);
        }
        linearise(measurement, &now, &now, finder, as_point)
    }

    /// Landmarks there is room for.
    pub fn room(&self) -> usize {
        self.landmarks.as_ref().len()
    }

    /// The landmark as seen at the first estimates.
    fn reference(&self, landmark: &Landmark<T>) -> Relative<T> {
        let [x, y, heading] = self.first_pose;
        let (sin, cos) = heading.sin_cos();
        let at = landmark.offset;
        let offset = Vector2::new(self.first(at) - x, self.first(at + 1) - y);
        let inverse = landmark.form == Form::InverseDistance;
        Relative {
            heading: (cos, sin),
            offset,
            ray: inverse.then(|| (self.first(at + 2), self.first(at + 3))),
        }
    }
}

impl<T: Real> Parts<'_, T> {
    /// x[index] += step, keeping what rounding takes.
    #[allow(clippy::indexing_slicing, reason = "index < size")]
    pub(in crate::slam) fn add(&mut self, index: usize, step: T) {
        elementwise::add_steps((&mut self.x[index..=index], &mut self.rounding[index..=index], &[step]));
    }

    #[allow(clippy::indexing_slicing, reason = "a filter has a robot")]
    pub(in crate::slam) fn wrap_heading(&mut self) {
        let wrapped = wrap_angle(self.x[2]);
        if wrapped != self.x[2] {
            self.x[2] = wrapped;
        }
    }

    #[allow(clippy::indexing_slicing, reason = "a filter has a robot")]
    pub(in crate::slam) fn robot(&self) -> [T; 3] {
        [self.x[0], self.x[1], self.x[2]]
    }
}
