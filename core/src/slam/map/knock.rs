//! A camera that was knocked: its mount's angles are let go where that alone explains a frame.
//!
//! A knock moves every corner of the picture alike. Their mapped landmarks are then beyond their gates, all together, while with
//! angles as uncertain as those of a mount set by hand they fit jointly: that is tried where at least [`LEAST`] measurements and
//! as many landmarks that have been seen before meet and hardly any pair comes of it. What follows is the filter's: the
//! innovations say by how much. A trial that brings fewer than [`LEAST`] pairs more leaves everything as it was.
//!
//! *Limits.* It is seen where the map is, within the frames that still see what was mapped before; the height is not let go; not with
//! [`Covariance::Factored`].
use super::Map;
use crate::Real;
use crate::association::Candidate;
use crate::slam::filter::Covariance;
use crate::slam::landmark::{Landmark, Status};
use nalgebra::{Matrix2, Vector2};

/// Pairs that a trial must bring.
const LEAST: usize = 3;
/// Sightings that make a landmark a witness.
const WITNESS: u32 = 4;

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Map<T, S, L> {
    /// Pairs with landmarks that stood in the map before, within the gate.
    pub(super) fn witnesses(&self, pairs: &[Candidate<T>]) -> usize {
        let of_known = |pair: &&Candidate<T>| {
            let landmark = self.filter.landmarks().get(pair.landmark);
            landmark.is_some_and(is_witness) && pair.nis <= self.match_nis(pair.dof)
        };
        pairs.iter().filter(of_known).count()
    }

    /// Whether a frame of so many sound measurements, with these pairs, is one that a knock might explain.
    pub(super) fn seems_knocked(&self, measured: usize, pairs: &[Candidate<T>]) -> bool {
        let config = self.filter.config();
        if config.mount_std.is_none() || config.covariance != Covariance::Packed {
            return false;
        }
        let in_view = |landmark: &&Landmark<T>| landmark.in_view && is_witness(landmark);
        let expected = self.filter.landmarks().iter().filter(in_view).count();
        let possible = measured.min(expected);
        possible >= LEAST && LEAST * self.witnesses(pairs) <= possible
    }

    /// Whether the pairs with the angles let go are worth it.
    pub(super) fn explains(&self, before: usize, pairs: &[Candidate<T>]) -> bool {
        self.witnesses(pairs) >= before + LEAST
    }

    /// Turns the mount as pictures saw it turned: by pitch and roll (rad), of this covariance.
    pub fn take_jolt(&mut self, angles: &Vector2<T>, covariance: &Matrix2<T>) {
        self.filter.turn_mount(angles, covariance);
        self.health.jolts = self.health.jolts.saturating_add(1);
    }

    /// Deletes what was born since the last frames and not seen in this one: under the mount as it was.
    pub(super) fn forget_tentative(&mut self) {
        let frame = self.frame;
        let unsure =
            |landmark: &&Landmark<T>| landmark.status == Status::Tentative && landmark.last_frame != frame;
        while let Some(id) = self.filter.landmarks().iter().find(unsure).map(|landmark| landmark.id) {
            if self.filter.remove(id).is_err() {
                return;
            }
        }
    }
}

fn is_witness<T>(landmark: &Landmark<T>) -> bool {
    landmark.status == Status::Confirmed && landmark.seen >= WITNESS
}
