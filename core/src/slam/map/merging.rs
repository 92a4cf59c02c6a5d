//! Duplicates: landmarks that were born anew when a loop closed, or where a corner was missed.
//!
//! Two points are one when they are as close as their joint covariance has it, and so surely that there is no room for
//! another landmark: they go through the same search as a frame's measurements, all pairs together. Where the drift since
//! the older ones were seen is large no pair is sure by itself, anything would have fitted; several that agree are.
use super::frame::Candidates;
use super::stacked::Pair;
use super::{Map, MapReport};
use crate::Real;
use crate::association::{Candidate, MAX_PAIRS, cholesky, forward};
use crate::slam::covariance::{Row, Rows};
use crate::slam::filter::update::{Absorbed, Pending};
use crate::slam::filter::{Decision, Outcome};
use crate::slam::landmark::{Form, Landmark, Status};
use nalgebra::Matrix2;

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Map<T, S, L> {
    /// Makes one of every landmark seen in this frame and its duplicate.
    #[inline(never)] // as the pairing of measurements, whose lists are as long
    pub(super) fn merge_duplicates(&mut self, outcomes: &[Outcome<T>], report: &mut MapReport) {
        let mut candidates = Candidates::new();
        self.near_unseen_ones(outcomes, &mut candidates);
        if candidates.list.is_empty() {
            return;
        }
        let found = self.search(&mut candidates);
        let id = |slot: usize| self.filter.landmarks().get(slot).map(|landmark| landmark.id);
        let ids: heapless::Vec<_, MAX_PAIRS> = found
            .chosen
            .iter()
            .filter_map(|index| candidates.list.get(*index))
            .filter_map(|pair| Some((id(pair.observation)?, id(pair.landmark)?)))
            .collect();
        report.merged += ids.iter().filter_map(|(seen, unseen)| self.merge(*seen, *unseen)).count() as u32;
    }

    /// Lists pairs of a landmark seen in this frame and one that should have been and was not, in each other's gate.
    fn near_unseen_ones(&self, outcomes: &[Outcome<T>], near: &mut Candidates<T>) {
        // A measurement that is nobody's may be of the landmark that it is nearest to.
        let unseen = |landmark: &Landmark<T>| {
            let gated =
                |one: &Outcome<T>| one.decision == Decision::Gated && one.landmark == Some(landmark.id);
            landmark.missed >= self.config.merge_missed && !outcomes.iter().any(gated)
        };
        let points = || self.filter.landmarks().iter().enumerate().filter(|(_, one)| one.form == Form::Point);
        let [_, gate] = self.config.match_nis;
        for (seen, _) in points().filter(|(_, landmark)| landmark.last_frame == self.frame) {
            for (unseen, _) in points().filter(|(_, landmark)| unseen(landmark)) {
                let Some(pair) = self.pair_of(seen, unseen) else { continue };
                let Some(root) = cholesky(&(self.filter.cross(&pair.rows) + pair.noise)) else { continue };
                let ([l11, _, l22], nis) = (root, forward(&root, &pair.innovation).norm_squared());
                // Those beyond what a search looks at: next time.
                if nis <= gate && !near.linear.is_full() {
                    let cost = nis + T::lit(2.0) * (l11 * l22).ln() + pair.offset;
                    near.push(Candidate { observation: seen, landmark: unseen, cost, nis, dof: 2 }, pair);
                }
            }
        }
    }

    /// The two as one landmark seen twice; `None` where they are too far apart.
    fn pair_of(&self, seen: usize, unseen: usize) -> Option<Pair<T>> {
        let landmarks = self.filter.landmarks();
        let (a, b) = (landmarks.get(seen)?, landmarks.get(unseen)?);
        let innovation = self.filter.position(b)? - self.filter.position(a)?;
        (innovation.norm() <= self.config.merge_distance).then(|| Pair {
            of: (seen, unseen),
            innovation,
            noise: self.merge_noise(),
            offset: T::lit(2.0) * (T::two_pi() * self.config.density).ln(),
            rows: difference_rows(a, b),
        })
    }

    /// How far apart a landmark may be from itself: it also makes up for what rounding takes from the covariance.
    fn merge_noise(&self) -> Matrix2<T> {
        let std = self.config.merge_distance * T::lit(0.05);
        Matrix2::identity() * (std * std)
    }

    /// Makes two landmarks one: a measurement of no distance between them, then the younger record goes.
    fn merge(&mut self, kept: u32, gone: u32) -> Option<()> {
        let (a, b) = (*self.filter.landmark(kept)?, *self.filter.landmark(gone)?);
        let (position_a, position_b) = (self.filter.position(&a)?, self.filter.position(&b)?);
        let (rows, noise) = (difference_rows(&a, &b), self.merge_noise());
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

/// H of l_a − l_b.
fn difference_rows<T: Real>(a: &Landmark<T>, b: &Landmark<T>) -> Rows<T> {
    let mut rows = Rows::new();
    let _ = rows.push(Row::new(a.offset, Matrix2::identity()));
    let _ = rows.push(Row::new(b.offset, -Matrix2::<T>::identity()));
    rows
}
