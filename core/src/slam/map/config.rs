//! Settings of the map's upkeep, what goes in, and what is reported.
use crate::slam::models::Measurement;
use crate::{Error, Real, Result};
use nalgebra::Vector2;

/// How pairs are chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pairing {
    /// Bounded joint compatibility.
    #[default]
    Joint,
    /// Exclusive nearest.
    Nearest,
}

/// What the sensor sees, for expecting landmarks in view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View<T> {
    /// Nearest range in metres.
    pub near: T,
    /// Farthest range in metres.
    pub far: T,
    /// Largest bearing to either side in radians.
    pub half_angle: T,
}

/// Settings of the map's upkeep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapConfig<T> {
    /// How pairs are chosen.
    pub pairing: Pairing,
    /// A pair's normalised innovation squared is at most this when it stands alone, for 1 and 2 degrees of freedom.
    pub match_nis: [T; 2],
    /// A birth's is above this to every landmark. In between, a pair counts where the frame's others have the same error.
    pub birth_nis: T,
    /// Sightings that confirm a tentative landmark (k).
    pub confirm: u32,
    /// Expected sightings within which it must be confirmed (m).
    pub within: u32,
    /// Frames after which an unseen tentative landmark is deleted wherever it is.
    pub forget: u32,
    /// Confirmed landmarks are deleted after so many expected sightings in a row without one; 0 is never.
    pub delete_after: u32,
    /// Duplicates lie closer than this, in metres; 0 merges nothing.
    pub merge_distance: T,
    /// Expected sightings in a row that a duplicate has missed.
    pub merge_missed: u32,
    /// The sensor's view.
    pub view: View<T>,
    /// Nodes of the joint search.
    pub joint_nodes: usize,
    /// A pair is left out when another explanation of the frame is less than this much dearer: 2 ln of the ratio of
    /// likelihoods. At 6 it is twenty times less likely.
    pub ambiguity: T,
    /// As much cheaper than a new landmark, in the same unit, a pair or a merger must be to count without the word of others.
    /// 0 is what is likelier; more is safer where the drift until a loop closes reaches the next corner, and closes later.
    pub caution: T,
    /// Landmarks a square metre that are not in the map yet, where the robot goes: what a pair is weighed against.
    pub density: T,
}

impl<T: Real> Default for MapConfig<T> {
    fn default() -> Self {
        Self {
            pairing: Pairing::default(),
            match_nis: crate::association::CHI2_99.map(T::lit),
            birth_nis: T::lit(25.0),
            confirm: 3,
            within: 6,
            forget: 50,
            delete_after: 0,
            merge_distance: T::lit(0.3),
            merge_missed: 3,
            view: View { near: T::zero(), far: T::lit(5.0), half_angle: T::pi() },
            joint_nodes: 256,
            ambiguity: T::lit(6.0),
            caution: T::zero(),
            density: T::lit(0.01),
        }
    }
}

impl<T: Real> MapConfig<T> {
    /// Whether a map can be kept with these settings.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the name of the first value that it cannot use.
    pub fn check(&self) -> Result<()> {
        let ordered = self.match_nis.iter().all(|nis| *nis > T::zero() && *nis <= self.birth_nis);
        if !ordered {
            let (name, value) = ("map.birth_nis", self.birth_nis.to_f64());
            return Err(Error::OutOfRange {
                name,
                value,
                expected: "at least map.match_nis, which is above 0",
            });
        }
        if !(self.density > T::zero() && self.density.is_finite()) {
            let (name, value) = ("map.density", self.density.to_f64());
            return Err(Error::OutOfRange { name, value, expected: "finite and above 0" });
        }
        if self.confirm == 0 || self.within < self.confirm {
            let (name, value) = ("map.confirm", f64::from(self.confirm));
            return Err(Error::OutOfRange { name, value, expected: "from 1 to map.within" });
        }
        Ok(())
    }
}

/// What is known about a measurement's landmark beforehand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hint {
    /// Nothing.
    #[default]
    Free,
    /// It is this landmark: another association says so.
    Landmark(u32),
}

/// A measurement without a name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feature<T> {
    /// What was measured.
    pub measurement: Measurement<T>,
    /// What is known about whose it is.
    pub hint: Hint,
    /// Its pixel, kept in the landmark's record.
    pub pixel: Option<Vector2<T>>,
    /// The caller's index of its descriptor, kept in the landmark's record.
    pub descriptor: Option<u32>,
}

impl<T: Real> Feature<T> {
    /// A measurement about which nothing else is known.
    pub fn new(measurement: Measurement<T>) -> Self {
        Self { measurement, hint: Hint::Free, pixel: None, descriptor: None }
    }
}

/// What a frame did to the map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MapReport {
    /// Measurements that corrected the state, tentative landmarks' included.
    pub updates: u32,
    /// Landmarks born.
    pub births: u32,
    /// Measurements beyond the gate or between the thresholds.
    pub gated: u32,
    /// Measurements that could not be used.
    pub rejected: u32,
    /// Measurements whose noise was inflated.
    pub inflated: u32,
    /// Landmarks confirmed.
    pub confirmed: u32,
    /// Landmarks deleted.
    pub deleted: u32,
    /// Duplicates merged.
    pub merged: u32,
    /// Births that found no room.
    pub no_room: u32,
    /// Measurements left out because they could be of several landmarks.
    pub ambiguous: u32,
    /// Pairs beyond the capacity of candidates, which were not considered.
    pub candidates_dropped: u32,
    /// Whether the joint search ran out of nodes.
    pub search_truncated: bool,
}
