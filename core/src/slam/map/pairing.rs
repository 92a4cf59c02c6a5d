//! Candidates, pairing and update of a frame: which measurement is of which landmark.
use super::stacked::{Pair, Pairs, Stacked};
use super::{Feature, Hint, MAX_FEATURES, Map, MapConfig, MapReport, Pairing};
use crate::Real;
use crate::association::{
    Candidate, MAX_CANDIDATES, MAX_JOINT_CANDIDATES, MAX_PAIRS, cholesky, exclusive_nearest,
    joint_compatibility, normalised_square, sort_for_search,
};
use crate::geometry::RangeFinder;
use crate::slam::filter::birth::Nearby;
use crate::slam::filter::update::Pending;
use crate::slam::filter::{Decision, Outcome};
use crate::slam::landmark::{Form, Landmark, Status};
use crate::slam::models::Linearised;
use crate::slam::models::Measurement;
use crate::slam::models::linearise::Relative;

/// Standard deviation of a bearing, rad, above which a turn is not linear: its cosine is off by 5 %.
const LARGEST_TURN: f64 = 0.35;

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

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Map<T, S, L> {
    pub(super) fn pair(
        &mut self,
        features: &[Feature<T>],
        may_be: &dyn Fn(usize, &Landmark<T>) -> bool,
        finder: Option<&RangeFinder<T>>,
        outcomes: &mut [Outcome<T>],
        report: &mut MapReport,
    ) {
        // Where another association names landmarks, the rest is judged by what those say of the state.
        if features.iter().any(|feature| matches!(feature.hint, Hint::Landmark(_))) {
            self.pair_those(true, features, may_be, finder, outcomes, report);
        }
        self.pair_those(false, features, may_be, finder, outcomes, report);
    }

    /// Pairs the measurements that have a name, or those that have none, and corrects the state by them.
    #[inline(never)] // so that its lists leave the stack before duplicates are looked for
    fn pair_those(
        &mut self,
        named: bool,
        features: &[Feature<T>],
        may_be: &dyn Fn(usize, &Landmark<T>) -> bool,
        finder: Option<&RangeFinder<T>>,
        outcomes: &mut [Outcome<T>],
        report: &mut MapReport,
    ) {
        let mut candidates = heapless::Vec::<Candidate<T>, MAX_CANDIDATES>::new();
        self.gather(named, features, may_be, finder, outcomes, &mut candidates, report);
        if self.seems_knocked(named, features, &candidates) {
            let (before, told) = (self.witnesses(&candidates), *report);
            let held = self.filter.let_mount_go();
            self.gather(named, features, may_be, finder, outcomes, &mut candidates, report);
            report.knocked |= self.explains(before, &candidates);
            if !report.knocked {
                self.filter.hold_mount(held);
                *report = told;
                self.gather(named, features, may_be, finder, outcomes, &mut candidates, report);
                *report = told;
            }
        }
        let mut pending = Pending::default();
        for pair in &candidates {
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

    /// Lists the pairs that are to be updated with.
    #[allow(clippy::too_many_arguments, reason = "one caller, and each is a part of the frame")]
    fn gather(
        &self,
        named: bool,
        features: &[Feature<T>],
        may_be: &dyn Fn(usize, &Landmark<T>) -> bool,
        finder: Option<&RangeFinder<T>>,
        outcomes: &mut [Outcome<T>],
        candidates: &mut heapless::Vec<Candidate<T>, MAX_CANDIDATES>,
        report: &mut MapReport,
    ) {
        candidates.clear();
        // Where all are beyond their gates, as after a slip of the wheels, they may have an error in common.
        for wide in [false, true] {
            for (index, (feature, outcome)) in features.iter().zip(outcomes.iter_mut()).enumerate() {
                let of_these = matches!(feature.hint, Hint::Landmark(_)) == named;
                if !of_these || index >= MAX_FEATURES || feature.measurement.check().is_err() {
                    continue;
                }
                // From here on it is sound; without a landmark it may start one.
                *outcome = Outcome { decision: Decision::Birth, ..Outcome::default() };
                self.candidates(index, feature, wide, may_be, finder, outcome, candidates, report);
            }
            if named || !candidates.is_empty() {
                break;
            }
        }
        if named {
            exclusive_nearest(candidates);
        } else {
            self.choose(features, candidates, finder, report);
            self.set_free_beside_the_taken(features, candidates, may_be, finder, outcomes);
        }
    }

    /// A landmark is seen once in a frame: a measurement that is gated by landmarks which others of the frame are of, and
    /// that differs from those others by more than the noise of the two, is of another landmark. The pose is common
    /// to both and does not blur the difference, so that landmarks are told apart here which are within each other's gates.
    fn set_free_beside_the_taken(
        &self,
        features: &[Feature<T>],
        candidates: &mut heapless::Vec<Candidate<T>, MAX_CANDIDATES>,
        may_be: &dyn Fn(usize, &Landmark<T>) -> bool,
        finder: Option<&RangeFinder<T>>,
        outcomes: &mut [Outcome<T>],
    ) {
        for (index, feature) in features.iter().enumerate() {
            let id = |slot: usize| self.filter.landmarks().get(slot).map(|landmark| landmark.id);
            // What others are of that are not this one seen double.
            let other = |(by, outcome): (usize, &Outcome<T>)| {
                let pair = candidates.iter().find(|pair| pair.observation == by);
                let named = outcome.landmark.filter(|_| outcome.decision.is_update());
                let of = pair.and_then(|pair| id(pair.landmark)).or(named)?;
                let nis = self.filter.difference_nis(&feature.measurement, &features.get(by)?.measurement)?;
                (nis > self.config.match_nis[1]).then_some(of)
            };
            let paired = candidates.iter().any(|pair| pair.observation == index);
            let gated = outcomes.get(index).is_some_and(|outcome| outcome.decision == Decision::Gated);
            if paired || !gated {
                continue;
            }
            let taken: heapless::Vec<u32, MAX_FEATURES> =
                outcomes.iter().enumerate().filter_map(other).take(MAX_FEATURES).collect();
            let Some(outcome) = outcomes.get_mut(index) else { continue };
            if !outcome.landmark.is_some_and(|nearest| taken.contains(&nearest)) {
                continue;
            }
            let free = |index: usize, landmark: &Landmark<T>| {
                !taken.contains(&landmark.id) && may_be(index, landmark)
            };
            let chosen = candidates.len();
            *outcome = Outcome { decision: Decision::Birth, ..Outcome::default() };
            let mut unused = MapReport::default();
            self.candidates(index, feature, false, &free, finder, outcome, candidates, &mut unused);
            candidates.truncate(chosen);
        }
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
        wide: bool,
        may_be: &dyn Fn(usize, &Landmark<T>) -> bool,
        finder: Option<&RangeFinder<T>>,
        outcome: &mut Outcome<T>,
        candidates: &mut heapless::Vec<Candidate<T>, MAX_CANDIDATES>,
        report: &mut MapReport,
    ) {
        let dof = feature.measurement.dof();
        let gate = if wide { self.config.birth_nis } else { self.match_nis(dof) };
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
            let far = |near: &Nearby<T>| {
                let point = now.point().filter(|_| landmark.form == Form::Point);
                let relative = self.filter.relative_variance(landmark);
                point.is_some_and(|point| near.excludes(&point, relative, self.config.birth_nis))
            };
            // A bearing is linear in the heading however far it turns, and the filter takes the lever in full; a pixel is not.
            let pixel = matches!(feature.measurement, Measurement::Pixel { .. });
            if !named && nearby.as_ref().is_some_and(far)
                || pixel && self.is_beyond_first_order(landmark, &now)
            {
                continue;
            }
            let Some(linear) = self.filter.linearise(landmark, heading, &feature.measurement, finder) else {
                continue;
            };
            let rows = linear.rows(landmark.offset, landmark.form, self.filter.config().mount_std.is_some());
            let total = self.filter.cross(&rows) + linear.noise;
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
            let taken = landmark.last_frame == self.frame; // by a measurement that names it
            if (nis <= gate || named) && !taken {
                let likelihood = nis + T::lit(2.0) * (l11 * l22).ln();
                let cost = likelihood + offset(&linear, landmark.form, self.config.density);
                let pair = Candidate { observation: index, landmark: slot, cost, nis, dof };
                report.candidates_dropped += u32::from(candidates.push(pair).is_err());
            }
        }
    }

    /// Whether the heading is so uncertain, and the landmark with it as the robot sees it, that no Jacobian tells where it may
    /// be: what such a pair would do to state and covariance means nothing. A landmark that was born under this heading
    /// turns with the robot and is none of them.
    fn is_beyond_first_order(&self, landmark: &Landmark<T>, now: &Relative<T>) -> bool {
        let most = T::lit(LARGEST_TURN * LARGEST_TURN);
        landmark.form == Form::Point
            && self.filter.covariance_at(2, 2) > most
            && self.filter.bearing_variance(landmark, &now.offset) > most
    }

    pub(super) fn match_nis(&self, dof: usize) -> T {
        let [one, two] = self.config.match_nis;
        if dof == 1 { one } else { two }
    }

    /// Keeps the candidates that are to be updated with.
    fn choose(
        &self,
        features: &[Feature<T>],
        candidates: &mut heapless::Vec<Candidate<T>, MAX_CANDIDATES>,
        finder: Option<&RangeFinder<T>>,
        report: &mut MapReport,
    ) {
        // They come measurement by measurement.
        let measured = candidates.chunk_by(|pair, next| pair.observation == next.observation).count();
        let small = measured <= MAX_PAIRS && candidates.len() <= MAX_JOINT_CANDIDATES;
        if self.config.pairing == Pairing::Nearest || candidates.len() < 2 || !small {
            report.search_truncated |= self.config.pairing == Pairing::Joint && !small;
            // Surely no new landmark, and with no others to vouch for it.
            candidates
                .retain(|pair| pair.cost < -self.config.caution && pair.nis <= self.match_nis(pair.dof));
            return exclusive_nearest(candidates);
        }
        sort_for_search(candidates);
        // One after the other into its place: as a whole the list is too long to be moved on a microcontroller's stack.
        let mut pairs = heapless::Vec::<_, MAX_JOINT_CANDIDATES>::new();
        for candidate in candidates.iter() {
            let Some(pair) = self.stacked(features, candidate, finder) else {
                return exclusive_nearest(candidates);
            };
            let _ = pairs.push(pair); // small: it fits
        }
        let correlated = Pairs { pairs: &pairs, filter: &self.filter };
        let MapConfig { joint_nodes, ambiguity, caution, .. } = self.config;
        let result = joint_compatibility(candidates, &correlated, joint_nodes, ambiguity, caution);
        report.ambiguous += result.ambiguous as u32;
        report.search_truncated |= result.truncated;
        let mut index = 0..;
        candidates.retain(|_| index.next().is_some_and(|index| result.chosen.contains(&index)));
    }

    /// A candidate as the joint search sees it; `None` where it cannot be linearised.
    fn stacked(
        &self,
        features: &[Feature<T>],
        candidate: &Candidate<T>,
        finder: Option<&RangeFinder<T>>,
    ) -> Option<Stacked<T>> {
        let measurement = &features.get(candidate.observation)?.measurement;
        let Landmark { offset: at, form, .. } = *self.filter.landmarks().get(candidate.landmark)?;
        let linear = self.linearise(candidate.landmark, measurement, finder)?;
        let pair = Pair {
            innovation: linear.innovation,
            noise: linear.noise,
            offset: offset(&linear, form, self.config.density),
            rows: linear.rows(at, form, self.filter.config().mount_std.is_some()),
        };
        Some(Stacked::new(&self.filter, pair))
    }
}
