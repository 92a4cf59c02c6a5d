//! Settings of the map's upkeep, what goes in, and what is reported.
use crate::setting::{self, choices, settings};
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

choices!(Pairing { "joint" => Joint, "nearest" => Nearest });

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
    /// Drop a match if some other assignment of the frame costs less than this much more: 2 ln of the ratio of likelihoods. At 6
    /// the other assignment is twenty times less likely.
    pub ambiguity: T,
    /// A lone match or merge is accepted only if it beats "this is a new landmark" by this margin (2 ln likelihood ratio). At 0
    /// the likelier explanation wins. A larger margin is safer where the drift until a loop closes reaches the next corner, and
    /// closes the loop later.
    pub caution: T,
    /// Landmarks a square metre, where the robot goes, that are not in the map yet: what a match is weighed against.
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
    /// The settings themselves if a map can be kept with them.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the name of the first value that it cannot use.
    pub fn validated(self) -> Result<Self> {
        let single = |number: T| number.to_f64() as f32;
        let View { near, far, half_angle } = self.view;
        let view = View { near: single(near), far: single(far), half_angle: single(half_angle) };
        let mut rounded = MapConfig {
            pairing: self.pairing,
            match_nis: self.match_nis.map(single),
            birth_nis: single(self.birth_nis),
            confirm: self.confirm,
            within: self.within,
            forget: self.forget,
            delete_after: self.delete_after,
            merge_distance: single(self.merge_distance),
            merge_missed: self.merge_missed,
            view,
            joint_nodes: self.joint_nodes,
            ambiguity: single(self.ambiguity),
            caution: single(self.caution),
            density: single(self.density),
        };
        setting::check(&MAP, &mut rounded)?;
        let refused =
            |name, value: f32, expected| Err(Error::OutOfRange { name, value: value.into(), expected });
        if rounded.match_nis.into_iter().any(|nis| nis > rounded.birth_nis) {
            return refused("association.birth_nis", rounded.birth_nis, "at least match_nis");
        }
        if self.within < self.confirm {
            return refused("association.confirm", self.confirm as f32, "at most within");
        }
        let parts = [("view.near", view.near), ("view.far", view.far), ("view.half_angle", view.half_angle)];
        match parts.into_iter().find(|(_, part)| part.is_nan() || *part < 0.0) {
            Some((name, part)) => refused(name, part, "a number of at least 0"),
            None => Ok(self),
        }
    }
}

settings! { MAP, MAP_REFERENCES, MapConfig<f32>, "association" {
    11 pairing: Choice [pairing] "How corners and landmarks are paired: jointly compatible, or each with its nearest.", "Neira & Tardós 2001; nearest is there for comparison.";
    12 match_nis: Pair [match_nis] (1e-3, 1e6), "Largest normalised innovation squared of a pair that stands alone, for 1 and 2 degrees of freedom.", "χ² at 0.99 for 1 and 2 degrees of freedom.";
    13 birth_nis: Number [birth_nis] (1e-3, 1e6), "A new landmark's normalised innovation squared to every other landmark is above this.", "Judgement: five standard deviations.";
    14 confirm: Whole [confirm] (1, 1e6, "sightings"), "Sightings that make a tentative landmark part of the map.", "Judgement.";
    15 within: Whole [within] (1, 1e6, "sightings"), "Expected sightings within which a tentative landmark must be confirmed.", "Judgement: twice confirm.";
    16 forget: Whole [forget] (0, 1e6, "frames"), "Frames after which an unseen tentative landmark is deleted.", "Judgement.";
    17 delete_after: Whole [delete_after] (0, 1e6, "sightings"), "Expected sightings in a row without one that delete a landmark; 0 is never.", "Off: a hidden corner is not a vanished one.";
    18 merge_distance: Number [merge_distance] (0, 1e3, "m"), "Landmarks closer than this may be one; 0 merges nothing.", "Judgement: less than a door's width.";
    19 merge_missed: Whole [merge_missed] (0, 1e6, "sightings"), "Expected sightings in a row that such a duplicate has missed.", "Judgement.";
    20 joint_nodes: Size [joint_nodes] (1, 1e6, "nodes"), "Nodes that the joint search visits at most.", "A bound on time; a report says where it was reached.";
    45 ambiguity: Number [ambiguity] (0, 1e6), "A match is dropped if some other assignment of the frame costs less than this much more (2 ln of the likelihood ratio).", "Judgement: at 6 the other assignment is twenty times less likely.";
    46 caution: Number [caution] (0, 1e6), "A lone match or merge is accepted only if it beats a new landmark by this margin (2 ln of the likelihood ratio).", "Twenty simulated corridors, of which four closed on the wrong door at 0; 6 is a ratio of twenty.";
    47 density: Number [density] (1e-9, 1e6, "1/m²"), "Landmarks a square metre that are not in the map yet: what a match is weighed against.", "A simulated corridor of 66 m by 2 m shows 110 corners, and each picture half of those in view.";
}}

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
    /// Whether the camera seems to have been knocked: the mount's angles were let go, or turned as pictures saw it.
    pub knocked: bool,
}
