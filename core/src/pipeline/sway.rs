//! A robot that pitches and rolls: its corners are ranged with the attitude that the picture's mapped ones tell.
use super::sightings::ranged;
use super::{CornerReport, Pipeline, Report, Storage};

impl<S: Storage> Pipeline<S> {
    /// By how much tilt and roll may have changed since the last picture, rad.
    fn swayed_by(&self) -> f32 {
        self.moment.lean.map_or(self.config.sway, |lean| lean.std)
    }

    /// Lets the mount's attitude change since the last picture.
    pub(super) fn sway(&mut self) {
        let std = self.swayed_by();
        self.map.filter_mut().sway(std);
    }

    /// Ranges the corners with the attitude of their own picture, if it has one.
    pub(super) fn range_again(&self, report: &mut Report) {
        if self.swayed_by() == 0.0 {
            return;
        }
        let finder = self.finder();
        for corner in &mut report.corners {
            if let Some(again) = ranged(&finder, corner.pixel, corner.pixel_covariance) {
                *corner = CornerReport { outcome: corner.outcome, ..again };
            }
        }
    }
}
