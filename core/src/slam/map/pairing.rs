//! Pairing and update of a frame: which of the candidates are right, and what they do to the state.
use super::frame::{Candidates, Frame, Paired, Round, Sighted, Standing};
use super::stacked::{Pair, linear};
use super::{MAX_FEATURES, Map, MapConfig, MapReport, Pairing, of_dof};
use crate::Real;
use crate::association::{MAX_JOINT_CANDIDATES, MAX_PAIRS};
use crate::slam::filter::update::{Absorbed, Pending};
use crate::slam::filter::{Decision, Outcome};
use crate::slam::landmark::{Landmark, Status};

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Map<T, S, L> {
    /// Pairs the measurements of a round, and corrects the state by them.
    #[inline(never)] // so that its lists leave the stack before duplicates are looked for
    pub(super) fn correct(
        &mut self,
        frame: &Frame<'_, T>,
        round: Round,
        standings: &mut [Standing<T>],
        outcomes: &mut [Outcome<T>],
        report: &mut MapReport,
    ) {
        let mut candidates = Candidates::new();
        let mut paired = self.pair(frame, round, standings, &mut candidates);
        report.search(&paired);
        if self.seems_knocked(frame.sighted(round).count(), paired.list) {
            let before = self.witnesses(paired.list);
            let held = self.filter.let_mount_go();
            paired = self.pair(frame, round, standings, &mut candidates);
            report.knocked |= self.explains(before, paired.list);
            if report.knocked {
                report.search(&paired); // by this round's word, or by that of the one before
            } else {
                self.filter.hold_mount(held);
                // Found again: to keep the first ones would take as much of the stack once more.
                paired = self.pair(frame, round, standings, &mut candidates);
            }
        }
        self.update(frame, &paired, standings, outcomes);
    }

    /// Finds the candidates and those that are to be updated with.
    fn pair<'a>(
        &self,
        frame: &Frame<'_, T>,
        round: Round,
        standings: &mut [Standing<T>],
        candidates: &'a mut Candidates<T>,
    ) -> Paired<'a, T> {
        self.find(frame, round, standings, candidates);
        let paired = match round {
            Round::Named => candidates.nearest(),
            Round::Free => self.choose(candidates),
        };
        for pair in paired.list {
            let landmark = self.filter.landmarks().get(pair.landmark);
            if let (Some(standing), Some(landmark)) = (standings.get_mut(pair.observation), landmark) {
                *standing = Standing::Paired(landmark.id);
            }
        }
        if round == Round::Free {
            self.set_free_beside_the_taken(frame, standings);
        }
        paired
    }

    /// Keeps the candidates that are to be updated with.
    fn choose<'a>(&self, candidates: &'a mut Candidates<T>) -> Paired<'a, T> {
        let MapConfig { pairing, caution, .. } = self.config;
        let list = &mut candidates.list;
        // They come measurement by measurement.
        let measured = list.chunk_by(|pair, next| pair.observation == next.observation).count();
        let small = measured <= MAX_PAIRS && list.len() <= MAX_JOINT_CANDIDATES;
        if pairing == Pairing::Nearest || list.len() < 2 || !small {
            // Surely no new landmark, and with no others to vouch for it.
            list.retain(|pair| pair.cost < -caution && pair.nis <= self.match_nis(pair.dof));
            return Paired { truncated: pairing == Pairing::Joint && !small, ..candidates.nearest() };
        }
        let found = self.search(candidates);
        let mut index = 0..;
        candidates.list.retain(|_| index.next().is_some_and(|index| found.chosen.contains(&index)));
        Paired { ambiguous: found.ambiguous as u32, truncated: found.truncated, ..candidates.paired() }
    }

    /// A landmark is seen once in a frame: a measurement that is gated by landmarks which others of the frame are of, and
    /// that differs from those others by more than the noise of the two, is of another landmark. The pose is common
    /// to both and does not blur the difference, so that landmarks are told apart here which are within each other's gates.
    #[inline(never)] // so that its list is not on the stack of the search
    fn set_free_beside_the_taken(&self, frame: &Frame<'_, T>, standings: &mut [Standing<T>]) {
        for (index, feature) in frame.features.iter().enumerate() {
            let Some(Standing::Gated(nearest)) = standings.get(index) else { continue };
            // What others are of that are not this one seen double.
            let other = |(by, standing): (usize, &Standing<T>)| {
                let Standing::Paired(landmark) = *standing else { return None };
                let nis =
                    self.filter.difference_nis(&feature.measurement, &frame.features.get(by)?.measurement)?;
                (nis > self.config.match_nis[1]).then_some(landmark)
            };
            let taken: heapless::Vec<u32, MAX_FEATURES> =
                standings.iter().enumerate().filter_map(other).take(MAX_FEATURES).collect();
            if !taken.contains(&nearest.landmark) {
                continue;
            }
            let free = |index: usize, landmark: &Landmark<T>| {
                !taken.contains(&landmark.id) && (frame.may_be)(index, landmark)
            };
            let among_others = self.stand(frame, &Sighted { index, feature }, &free, &mut |_, _| ());
            if let Some(standing) = standings.get_mut(index) {
                *standing = among_others;
            }
        }
    }

    /// Corrects the state by the pairs, all of them linearised about the same state, which moves at the end.
    fn update(
        &mut self,
        frame: &Frame<'_, T>,
        paired: &Paired<'_, T>,
        standings: &mut [Standing<T>],
        outcomes: &mut [Outcome<T>],
    ) {
        let mut pending = Pending::default();
        for candidate in paired.list {
            let at = candidate.observation;
            let (Some(feature), Some(standing), Some(outcome)) =
                (frame.features.get(at), standings.get_mut(at), outcomes.get_mut(at))
            else {
                continue;
            };
            let kept = linear(paired.linear, candidate).cloned();
            let again = || self.linearise(frame, (at, candidate.landmark));
            let Some(Pair { innovation, noise, rows, .. }) = kept.or_else(again) else { continue };
            let absorbed = Absorbed { innovation, noise, dof: candidate.dof, rows: &rows };
            let mut done = self.filter.absorb_landmark(candidate.landmark, &absorbed, &mut pending);
            let now = self.frame;
            let record = self.filter.landmarks_mut().get_mut(candidate.landmark);
            if let Some(record) = record.filter(|_| done.decision == Decision::Update) {
                if record.status == Status::Tentative {
                    done.decision = Decision::Tentative;
                }
                record.last_frame = now;
                record.last_pixel = feature.pixel;
                record.descriptor = feature.descriptor.or(record.descriptor);
            }
            *standing = Standing::after(&done);
            if done.decision != Decision::Gated {
                *outcome = done;
            }
        }
        self.filter.finish(pending);
    }

    pub(super) fn match_nis(&self, dof: usize) -> T {
        of_dof(self.config.match_nis, dof)
    }
}

impl MapReport {
    /// Takes note of a search.
    fn search<T>(&mut self, paired: &Paired<'_, T>) {
        self.candidates_dropped += paired.dropped;
        self.ambiguous += paired.ambiguous;
        self.search_truncated |= paired.truncated;
    }
}
