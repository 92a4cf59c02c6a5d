//! A robot that pitches and rolls: its corners are ranged with the attitude that the picture's mapped ones tell.
use super::{Pipeline, Report, Storage};

impl<S: Storage> Pipeline<S> {
    /// Ranges the corners with the attitude of their own picture.
    pub(super) fn range_again(&self, report: &mut Report) {
        if self.config.sway == 0.0 {
            return;
        }
        let finder = self.finder();
        for corner in &mut report.corners {
            if let Ok(sighting) = finder.sight(corner.pixel) {
                (corner.range, corner.bearing) = (sighting.range, sighting.bearing);
                corner.covariance = sighting.noise(&corner.pixel_covariance);
            }
        }
    }
}
