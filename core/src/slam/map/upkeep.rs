//! Births, confirmation and deletion.
use super::frame::Standing;
use super::{Feature, Map, MapConfig, MapReport};
use crate::Real;
use crate::slam::filter::{Decision, Outcome};
use crate::slam::landmark::{Form, Landmark, Status};
use crate::slam::models::Measurement;

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Map<T, S, L> {
    /// Starts a landmark for each measurement that is of none, and completes the outcomes by that.
    pub(super) fn give_birth(
        &mut self,
        features: &[Feature<T>],
        standings: &[Standing<T>],
        outcomes: &mut [Outcome<T>],
        report: &mut MapReport,
    ) {
        for ((feature, standing), outcome) in features.iter().zip(standings).zip(outcomes) {
            let dof = feature.measurement.dof();
            let rejected = match standing {
                Standing::Unsound | Standing::Paired(_) => continue,
                Standing::Gated(nearest) => {
                    *outcome = nearest.outcome(Decision::Gated, dof);
                    continue;
                }
                Standing::Stranger(nearest) => nearest.outcome(Decision::Rejected, dof),
                Standing::Alone => Outcome::default(),
            };
            *outcome = match self.born(feature, report) {
                None => rejected,
                landmark => Outcome { decision: Decision::Birth, landmark, nis: None, ..rejected },
            };
        }
    }

    /// The name of a landmark started from a measurement, where it fixes one and there is room.
    fn born(&mut self, feature: &Feature<T>, report: &mut MapReport) -> Option<u32> {
        if self.filter.fixed {
            return None;
        }
        let (filter_size, capacity) = self.filter.states();
        let needed = match feature.measurement {
            Measurement::Bearing { .. } => Form::InverseDistance.len(),
            _ => Form::Point.len(),
        };
        let full = filter_size + needed > capacity || self.filter.landmarks().len() >= self.filter.room();
        if full && !self.make_room() {
            report.no_room += 1;
            return None;
        }
        let (id, time) = (self.next_id, self.filter.time());
        self.filter.birth(time, id, &feature.measurement).ok()?;
        self.next_id = self.next_id.wrapping_add(1);
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
        Some(id)
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

    pub(super) fn keep_up(&mut self, outcomes: &[Outcome<T>], report: &mut MapReport) {
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
        if self.filter.fixed {
            return;
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
            self.merge_duplicates(outcomes, report);
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
}

fn stale<T: Real>(landmark: &Landmark<T>, config: &MapConfig<T>, frame: u32) -> bool {
    match landmark.status {
        Status::Tentative => {
            landmark.expected >= config.within || frame.saturating_sub(landmark.last_frame) > config.forget
        }
        Status::Confirmed => config.delete_after > 0 && landmark.missed >= config.delete_after,
    }
}
