//! Births, confirmation, deletion, and the merging of duplicates.
use super::{Feature, Map, MapConfig, MapReport};
use crate::Real;
use crate::association::{cholesky, forward};
use crate::slam::landmark::{Form, Landmark, Status};
use crate::slam::measurement::Measurement;
use crate::slam::model::{Row, Rows};
use crate::slam::packed;
use crate::slam::update::{Absorbed, Decision, Outcome, Pending};
use nalgebra::{Matrix2, Vector2};

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Map<T, S, L> {
    pub(super) fn give_birth(
        &mut self,
        features: &[Feature<T>],
        outcomes: &mut [Outcome<T>],
        report: &mut MapReport,
    ) {
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

    pub(super) fn keep_up(&mut self, report: &mut MapReport) {
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
                if self.are_one(&difference, &covariance) {
                    return Some((seen.id, other.id));
                }
            }
        }
        None
    }

    /// Whether two points this far apart are one: they must lie in each other's gate, and so surely that there is no room for
    /// another landmark. Where the drift since one was seen is large they are not: anything would have fitted.
    fn are_one(&self, difference: &Vector2<T>, covariance: &Matrix2<T>) -> bool {
        // Rounding can leave the difference of two well-known points without a variance; they are then as close as they
        // will ever be.
        let Some(root) = cholesky(covariance) else { return true };
        let MapConfig { match_nis: [_, threshold], ambiguity, density, .. } = self.config;
        let ([l11, _, l22], nis) = (root, forward(&root, difference).norm_squared());
        nis <= threshold && nis + T::lit(2.0) * (T::two_pi() * density * l11 * l22).ln() < -ambiguity
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
