//! The map's upkeep: who is who, who is born, who is believed, who goes.
//!
//! A frame's measurements pass through five steps:
//!
//! 1. *Candidates*: pairs of measurement and landmark whose normalised innovation is below the match threshold.
//! 2. *Pairing*: each measurement and each landmark at most once, by joint compatibility or exclusive nearest.
//! 3. *Update* of the pairs, all together.
//! 4. *Births*: a measurement that is further than the birth threshold from every landmark starts a tentative one.
//!    Between the two thresholds it does neither, and is reported as gated: a duplicate costs more than a miss.
//! 5. *Upkeep*: a tentative landmark is confirmed at k sightings, and deleted when it was expected in m frames and
//!    seen in fewer than k. A landmark that is expected in view and stays unseen while its neighbour within
//!    `merge_distance` takes all its sightings is its duplicate: the two are made one, and the joint covariance
//!    learns that they are.
use super::birth::Nearby;
use super::filter::Filter;
use super::health::Health;
use super::landmark::{Form, Landmark, Status};
use super::measurement::Measurement;
use super::model::{Linearised, Row, Rows};
use super::packed;
use super::update::{Absorbed, Decision, Outcome, Pending};
use crate::association::{
    Candidate, Correlated, MAX_CANDIDATES, MAX_PAIRS, cholesky, exclusive_nearest, joint_compatibility,
    normalised_square, sort_for_search,
};
use crate::geometry::RangeFinder;
use crate::{Error, Real, Result};
use nalgebra::{Matrix2, Vector2};

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
    /// A pair's normalised innovation squared is at most this, for 1 and 2 degrees of freedom.
    pub match_nis: [T; 2],
    /// A birth's is above this to every landmark.
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
    /// It is no landmark of the map.
    New,
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

/// The filter with its map's upkeep: measurements without names in, decisions out.
#[derive(Clone, Copy, Debug)]
pub struct Map<T, S, L> {
    pub(super) filter: Filter<T, S, L>,
    config: MapConfig<T>,
    pub(super) health: Health<T>,
    pub(super) next_id: u32,
    pub(super) frame: u32,
}

/// A pair in its gate, linearised.
struct Pair<T> {
    linear: Linearised<T>,
    form: Form,
    rows: Rows<T>,
}

struct Pairs<'a, T, F> {
    pairs: &'a [Pair<T>],
    covariance_at: F,
    density: T,
}

/// n ln 2π + 2 ln(λ |∂l/∂z|): what the cost of a pair has beside νᵀS⁻¹ν + ln|S|.
fn offset<T: Real>(linear: &Linearised<T>, form: Form, density: T) -> T {
    let two = T::lit(2.0);
    if linear.dof == 1 || form != Form::Point {
        // One landmark a radian or a metre: of one number nothing better is known.
        return T::lit(linear.dof as f64) * T::two_pi().ln();
    }
    let by_landmark = linear.by_landmark.fixed_columns::<2>(0).determinant().abs();
    two * (T::two_pi() * density / by_landmark.max(T::default_epsilon())).ln()
}

impl<T: Real, F: Fn(usize, usize) -> T> Correlated<T> for Pairs<'_, T, F> {
    fn innovation(&self, candidate: usize) -> Vector2<T> {
        self.pairs.get(candidate).map_or_else(Vector2::zeros, |pair| pair.linear.innovation)
    }

    fn covariance(&self, left: usize, right: usize) -> Matrix2<T> {
        let (Some(a), Some(b)) = (self.pairs.get(left), self.pairs.get(right)) else {
            return Matrix2::zeros();
        };
        let from_state = packed::cross(&self.covariance_at, &a.rows, &b.rows);
        if left == right { from_state + a.linear.noise } else { from_state }
    }

    fn noise(&self, candidate: usize) -> Matrix2<T> {
        self.pairs.get(candidate).map_or_else(Matrix2::zeros, |pair| pair.linear.noise)
    }

    fn offset(&self, candidate: usize) -> T {
        self.pairs.get(candidate).map_or(T::zero(), |pair| offset(&pair.linear, pair.form, self.density))
    }
}

/// Measurements of a frame; those beyond it are rejected and counted.
pub const MAX_FEATURES: usize = 64;

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Map<T, S, L> {
    /// A map kept by `filter`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when a threshold is not above 0, or the birth threshold is below the match threshold.
    pub fn new(filter: Filter<T, S, L>, config: MapConfig<T>) -> Result<Self> {
        config.check()?;
        let next_id = filter.landmarks().iter().map(|landmark| landmark.id + 1).max().unwrap_or(0);
        Ok(Self { filter, config, health: Health::default(), next_id, frame: 0 })
    }

    /// The filter.
    pub fn filter(&self) -> &Filter<T, S, L> {
        &self.filter
    }

    /// The filter, to predict with.
    pub fn filter_mut(&mut self) -> &mut Filter<T, S, L> {
        &mut self.filter
    }

    /// The filter, without its map.
    pub fn into_filter(self) -> Filter<T, S, L> {
        self.filter
    }

    /// The settings.
    pub fn config(&self) -> &MapConfig<T> {
        &self.config
    }

    /// Figures of the updates so far, and the verdict.
    pub fn health(&self) -> &Health<T> {
        &self.health
    }

    /// Frames so far.
    pub fn frame(&self) -> u32 {
        self.frame
    }

    /// Takes in a frame's measurements, made at the filter's time; `outcomes` receives one line for each.
    ///
    /// `may_be` can forbid pairs: whether the measurement of this index may be of this landmark, by its looks or by
    /// pixels. `|_, _| true` leaves the choice to the map.
    ///
    /// # Errors
    /// [`Error::Size`] when `outcomes` is shorter than `features`. Whatever is wrong with a measurement is in its
    /// outcome.
    pub fn observe(
        &mut self,
        features: &[Feature<T>],
        may_be: impl Fn(usize, &Landmark<T>) -> bool,
        outcomes: &mut [Outcome<T>],
    ) -> Result<MapReport> {
        let Some(outcomes) = outcomes.get_mut(..features.len()) else {
            let (got, expected) = (outcomes.len(), features.len());
            return Err(Error::Size { name: "outcomes", got, expected });
        };
        outcomes.fill(Outcome::default());
        self.frame = self.frame.saturating_add(1);
        let mut report = MapReport::default();
        let finder = self.filter.finder();
        self.expect();
        self.pair(features, &may_be, finder.as_ref(), outcomes, &mut report);
        self.give_birth(features, outcomes, &mut report);
        for outcome in outcomes.iter() {
            let threshold = self.threshold(outcome.dof);
            self.health.note(outcome, threshold);
            match outcome.decision {
                Decision::Update | Decision::Tentative => report.updates += 1,
                Decision::Gated => report.gated += 1,
                Decision::Rejected => report.rejected += 1,
                Decision::Birth => {}
            }
            report.inflated += u32::from(outcome.inflation > T::one());
        }
        self.keep_up(&mut report);
        Ok(report)
    }

    fn threshold(&self, dof: usize) -> T {
        let [one, two] = self.filter.config().gate_nis;
        if dof == 1 { one } else { two }
    }

    /// Notes which landmarks are in view, as predicted.
    fn expect(&mut self) {
        let view = self.config.view;
        let heading = self.filter.heading();
        // A margin for the error of the prediction: landmarks at the rim are neither expected nor missed.
        let (near, far) = (view.near * T::lit(1.1), view.far * T::lit(0.9));
        for slot in 0..self.filter.landmarks().len() {
            let Some(landmark) = self.filter.landmarks().get(slot) else { continue };
            let in_view = self.filter.relative_at(landmark, heading).point().is_some_and(|point| {
                let (range, bearing) = (point.norm(), point.y.atan2(point.x).abs());
                range > near && range < far && bearing <= view.half_angle * T::lit(0.9)
            });
            if let Some(record) = self.filter.landmarks_mut().get_mut(slot) {
                record.in_view = in_view;
            }
        }
    }

    fn pair(
        &mut self,
        features: &[Feature<T>],
        may_be: &impl Fn(usize, &Landmark<T>) -> bool,
        finder: Option<&RangeFinder<T>>,
        outcomes: &mut [Outcome<T>],
        report: &mut MapReport,
    ) {
        let mut candidates = heapless::Vec::<Candidate<T>, MAX_CANDIDATES>::new();
        for (index, (feature, outcome)) in features.iter().zip(outcomes.iter_mut()).enumerate() {
            if index >= MAX_FEATURES || feature.measurement.check().is_err() {
                continue;
            }
            // From here on it is sound; without a landmark it may start one.
            outcome.decision = Decision::Birth;
            self.candidates(index, feature, may_be, finder, outcome, &mut candidates, report);
        }
        let chosen = self.choose(features, &mut candidates, finder, report);
        let mut pending = Pending::default();
        for pair in &chosen {
            let (Some(feature), Some(outcome)) =
                (features.get(pair.observation), outcomes.get_mut(pair.observation))
            else {
                continue;
            };
            let Some(linear) = self.linearise(pair.landmark, &feature.measurement, finder) else { continue };
            *outcome = self.filter.absorb_landmark(pair.landmark, &linear, &mut pending);
            if outcome.decision != Decision::Update {
                continue;
            }
            let frame = self.frame;
            let Some(record) = self.filter.landmarks_mut().get_mut(pair.landmark) else { continue };
            if record.status == Status::Tentative {
                outcome.decision = Decision::Tentative;
            }
            record.last_frame = frame;
            record.last_pixel = feature.pixel;
            record.descriptor = feature.descriptor.or(record.descriptor);
        }
        self.filter.finish(pending);
    }

    fn linearise(
        &self,
        slot: usize,
        measurement: &Measurement<T>,
        finder: Option<&RangeFinder<T>>,
    ) -> Option<Linearised<T>> {
        let landmark = self.filter.landmarks().get(slot)?;
        self.filter.linearise(landmark, self.filter.heading(), measurement, finder)
    }

    /// Lists the landmarks a measurement may be of; one that lies in no landmark's gate but within the birth
    /// threshold of some leaves as [`Decision::Gated`].
    #[allow(clippy::too_many_arguments, reason = "one caller, and each is a part of the frame")]
    fn candidates(
        &self,
        index: usize,
        feature: &Feature<T>,
        may_be: &impl Fn(usize, &Landmark<T>) -> bool,
        finder: Option<&RangeFinder<T>>,
        outcome: &mut Outcome<T>,
        candidates: &mut heapless::Vec<Candidate<T>, MAX_CANDIDATES>,
        report: &mut MapReport,
    ) {
        if feature.hint == Hint::New {
            return;
        }
        let dof = feature.measurement.dof();
        let [one, two] = self.config.match_nis;
        let match_nis = if dof == 1 { one } else { two };
        let heading = self.filter.heading();
        let nearby = self.filter.nearby(&feature.measurement);
        let mut nearest: Option<T> = None;
        for (slot, landmark) in self.filter.landmarks().iter().enumerate() {
            let named = feature.hint == Hint::Landmark(landmark.id);
            let excluded = matches!(feature.hint, Hint::Landmark(_)) && !named;
            if excluded || !may_be(index, landmark) {
                continue;
            }
            let now = self.filter.relative_at(landmark, heading);
            let at = landmark.offset;
            let variance = self.filter.covariance_at(at, at) + self.filter.covariance_at(at + 1, at + 1);
            let far = |near: &Nearby<T>| {
                let point = now.point().filter(|_| landmark.form == Form::Point);
                point.is_some_and(|point| near.excludes(&point, variance, self.config.birth_nis))
            };
            if !named && nearby.as_ref().is_some_and(far) {
                continue;
            }
            let Some(linear) = self.filter.linearise(landmark, heading, &feature.measurement, finder) else {
                continue;
            };
            let rows = linear.rows(landmark.offset, landmark.form, self.filter.config().mount_std.is_some());
            let at = |row, column| self.filter.covariance_at(row, column);
            let total = packed::cross(at, &rows, &rows) + linear.noise;
            let (Some(nis), Some([l11, _, l22])) =
                (normalised_square(&linear.innovation, &total), cholesky(&total))
            else {
                continue;
            };
            if nearest.is_none_or(|least| nis < least) {
                nearest = Some(nis);
                *outcome = Outcome {
                    decision: if nis <= self.config.birth_nis { Decision::Gated } else { Decision::Birth },
                    landmark: Some(landmark.id),
                    innovation: linear.innovation,
                    covariance: total,
                    nis: Some(nis),
                    dof,
                    ..Outcome::default()
                };
            }
            if nis <= match_nis || named {
                // A named pair is taken before all others.
                let preference = if named { T::lit(-1e6) } else { T::zero() };
                let likelihood = nis + T::lit(2.0) * (l11 * l22).ln();
                let cost = likelihood + offset(&linear, landmark.form, self.config.density) + preference;
                let pair = Candidate { observation: index, landmark: slot, cost, dof };
                report.candidates_dropped += u32::from(candidates.push(pair).is_err());
            }
        }
    }

    fn choose(
        &self,
        features: &[Feature<T>],
        candidates: &mut heapless::Vec<Candidate<T>, MAX_CANDIDATES>,
        finder: Option<&RangeFinder<T>>,
        report: &mut MapReport,
    ) -> heapless::Vec<Candidate<T>, MAX_CANDIDATES> {
        let mut measured = heapless::Vec::<usize, MAX_CANDIDATES>::new();
        for pair in candidates.iter() {
            if !measured.contains(&pair.observation) {
                let _ = measured.push(pair.observation);
            }
        }
        let small = measured.len() <= MAX_PAIRS && candidates.len() <= MAX_JOINT_CANDIDATES;
        let named = features.iter().any(|feature| matches!(feature.hint, Hint::Landmark(_)));
        if self.config.pairing == Pairing::Nearest || candidates.len() < 2 || !small || named {
            report.search_truncated |= self.config.pairing == Pairing::Joint && !small;
            candidates.retain(|pair| pair.cost < T::zero()); // likelier than a new landmark
            exclusive_nearest(candidates);
            return candidates.clone();
        }
        sort_for_search(candidates);
        let with_mount = self.filter.config().mount_std.is_some();
        let mut pairs = heapless::Vec::<Pair<T>, MAX_JOINT_CANDIDATES>::new();
        for candidate in candidates.iter() {
            let Some(feature) = features.get(candidate.observation) else { continue };
            let Some(linear) = self.linearise(candidate.landmark, &feature.measurement, finder) else {
                continue;
            };
            let Some(landmark) = self.filter.landmarks().get(candidate.landmark) else { continue };
            let rows = linear.rows(landmark.offset, landmark.form, with_mount);
            let _ = pairs.push(Pair { linear, form: landmark.form, rows });
        }
        if pairs.len() != candidates.len() {
            exclusive_nearest(candidates);
            return candidates.clone();
        }
        let covariance_at = |row, column| self.filter.covariance_at(row, column);
        let correlated = Pairs { pairs: &pairs, covariance_at, density: self.config.density };
        let result =
            joint_compatibility(candidates, &correlated, self.config.joint_nodes, self.config.ambiguity);
        report.ambiguous += result.ambiguous as u32;
        report.search_truncated |= result.truncated;
        result.chosen.iter().filter_map(|index| candidates.get(*index).copied()).collect()
    }

    fn give_birth(&mut self, features: &[Feature<T>], outcomes: &mut [Outcome<T>], report: &mut MapReport) {
        for (feature, outcome) in features.iter().zip(outcomes.iter_mut()) {
            if outcome.decision != Decision::Birth {
                continue;
            }
            outcome.decision = Decision::Rejected;
            let (filter_size, capacity) = self.filter.states();
            let needed = match feature.measurement {
                Measurement::Bearing { .. } => Form::InverseDistance.len(),
                _ => Form::Point.len(),
            };
            let full = filter_size + needed > capacity || self.filter.landmarks().len() >= self.filter.room();
            if full && !self.make_room() {
                report.no_room += 1;
                continue;
            }
            let (id, time) = (self.next_id, self.filter.time());
            if self.filter.birth(time, id, &feature.measurement).is_err() {
                continue;
            }
            self.next_id = self.next_id.wrapping_add(1);
            *outcome = Outcome { decision: Decision::Birth, landmark: Some(id), nis: None, ..*outcome };
            report.births += 1;
            let (frame, confirm) = (self.frame, self.config.confirm);
            if let Some(record) = self.filter.landmarks_mut().last_mut() {
                record.last_frame = frame;
                record.last_pixel = feature.pixel;
                record.descriptor = feature.descriptor;
                record.expected = 1;
                if confirm <= 1 {
                    record.status = Status::Confirmed;
                    report.confirmed += 1;
                }
            }
        }
    }

    /// Deletes the tentative landmark that has waited longest, unless all were seen in this frame.
    fn make_room(&mut self) -> bool {
        let frame = self.frame;
        let tentative = self
            .filter
            .landmarks()
            .iter()
            .filter(|landmark| landmark.status == Status::Tentative && landmark.last_frame != frame);
        let Some(oldest) = tentative.min_by_key(|landmark| landmark.last_frame).map(|landmark| landmark.id)
        else {
            return false;
        };
        self.filter.remove(oldest).is_ok()
    }

    fn keep_up(&mut self, report: &mut MapReport) {
        let (frame, config) = (self.frame, self.config);
        for landmark in self.filter.landmarks_mut() {
            if landmark.last_frame == frame {
                landmark.missed = 0;
                landmark.expected = landmark.expected.max(1) + u32::from(landmark.seen > 1);
            } else if landmark.in_view {
                landmark.missed = landmark.missed.saturating_add(1);
                landmark.expected = landmark.expected.saturating_add(1);
            }
            if landmark.status == Status::Tentative && landmark.seen >= config.confirm {
                landmark.status = Status::Confirmed;
                report.confirmed += 1;
            }
        }
        self.convert_linear(frame);
        while let Some(id) = self
            .filter
            .landmarks()
            .iter()
            .find(|landmark| stale(landmark, &config, frame))
            .map(|landmark| landmark.id)
        {
            if self.filter.remove(id).is_err() {
                break;
            }
            report.deleted += 1;
        }
        if config.merge_distance > T::zero() {
            while let Some((kept, gone)) = self.duplicate(frame) {
                if self.merge(kept, gone).is_none() {
                    break;
                }
                report.merged += 1;
            }
        }
    }

    /// Turns inverse-distance landmarks seen in this frame into points, where they are linear enough.
    fn convert_linear(&mut self, frame: u32) {
        for slot in 0..self.filter.landmarks().len() {
            let Some(landmark) = self.filter.landmarks().get(slot) else { continue };
            if landmark.form == Form::InverseDistance && landmark.last_frame == frame {
                let id = landmark.id;
                let _ = self.filter.convert(id); // not yet linear, or known: both are fine
            }
        }
    }

    /// (seen in this frame, its unseen duplicate).
    fn duplicate(&self, frame: u32) -> Option<(u32, u32)> {
        let points = || self.filter.landmarks().iter().filter(|landmark| landmark.form == Form::Point);
        for seen in points().filter(|landmark| landmark.last_frame == frame) {
            for other in points().filter(|landmark| landmark.missed >= self.config.merge_missed) {
                let (Some(a), Some(b)) = (self.filter.position(seen), self.filter.position(other)) else {
                    continue;
                };
                let difference = a - b;
                if difference.norm() > self.config.merge_distance {
                    continue;
                }
                let rows = difference_rows(seen, other);
                let covariance =
                    packed::cross(|row, column| self.filter.covariance_at(row, column), &rows, &rows);
                let [_, threshold] = self.config.match_nis;
                // Rounding can leave the difference of two well-known points without a variance; they are then
                // as close as they will ever be.
                let nis = normalised_square(&difference, &covariance).unwrap_or(T::zero());
                if nis <= threshold {
                    return Some((seen.id, other.id));
                }
            }
        }
        None
    }

    /// Makes two landmarks one: a measurement of no distance between them, then the younger record goes.
    fn merge(&mut self, kept: u32, gone: u32) -> Option<()> {
        let (a, b) = (*self.filter.landmark(kept)?, *self.filter.landmark(gone)?);
        let (position_a, position_b) = (self.filter.position(&a)?, self.filter.position(&b)?);
        let std = self.config.merge_distance * T::lit(0.05);
        let rows = difference_rows(&a, &b);
        let noise = Matrix2::identity() * (std * std);
        let absorbed = Absorbed { innovation: position_b - position_a, noise, dof: 2, rows: &rows };
        let mut pending = Pending::default();
        self.filter.absorb(&absorbed, &mut pending);
        self.filter.finish(pending);
        // The older name stays.
        let (old, young) = if a.first_time <= b.first_time { (a, b) } else { (b, a) };
        self.filter.remove(young.id).ok()?;
        let record = self.filter.landmarks_mut().iter_mut().find(|landmark| landmark.id == old.id)?;
        record.seen = a.seen.saturating_add(b.seen);
        record.expected = a.expected.saturating_add(b.expected);
        (record.missed, record.last_frame, record.last_time) = (a.missed, a.last_frame, a.last_time);
        (record.last_pixel, record.descriptor) = (a.last_pixel, a.descriptor.or(b.descriptor));
        let confirmed = a.status == Status::Confirmed || b.status == Status::Confirmed;
        record.status = if confirmed { Status::Confirmed } else { Status::Tentative };
        Some(())
    }
}

/// Candidates whose Jacobians the joint search keeps.
const MAX_JOINT_CANDIDATES: usize = 48;

fn stale<T: Real>(landmark: &Landmark<T>, config: &MapConfig<T>, frame: u32) -> bool {
    match landmark.status {
        Status::Tentative => {
            landmark.expected >= config.within || frame.saturating_sub(landmark.last_frame) > config.forget
        }
        Status::Confirmed => config.delete_after > 0 && landmark.missed >= config.delete_after,
    }
}

/// H of l_a − l_b.
fn difference_rows<T: Real>(a: &Landmark<T>, b: &Landmark<T>) -> Rows<T> {
    let mut rows = Rows::new();
    let _ = rows.push(Row::new(a.offset, Matrix2::identity()));
    let _ = rows.push(Row::new(b.offset, -Matrix2::<T>::identity()));
    rows
}
