//! A picture's corners as the filter takes them.
use super::{CornerReport, Model, Pipeline, Storage};
use crate::geometry::RangeFinder;
use crate::lines::{Corner, MAX_CORNERS};
use crate::slam::{Feature, Landmark, Measurement, Outcome};
use nalgebra::{Matrix2, Vector2};

impl<S: Storage> Pipeline<S> {
    /// Lists the corners that have a range worth the name in `seen`, which is empty, and what is told of them in `reports`.
    pub(super) fn sight_all(
        &self,
        corners: &[Corner],
        seen: &mut Sightings,
        reports: &mut heapless::Vec<CornerReport, MAX_CORNERS>,
    ) {
        let finder = self.finder();
        reports.clear();
        for corner in corners {
            let used = self.sight(&finder, corner).and_then(|(report, feature)| {
                reports.push(report).ok()?;
                seen.found.push(corner.pixel).ok()?;
                seen.features.push(feature).ok()
            });
            seen.without_range += u32::from(used.is_none());
        }
    }

    /// A corner as the filter takes it, or `None` where it has no range worth the name.
    fn sight(&self, finder: &RangeFinder<f32>, corner: &Corner) -> Option<(CornerReport, Feature<f32>)> {
        let (pixel, floor) = (self.steady(finder, corner.pixel), self.config.corner_std_floor_px);
        let covariance = corner.covariance + Matrix2::identity() * (floor * floor);
        let report = ranged(finder, pixel, covariance)?;
        if report.range > self.config.max_range() {
            return None;
        }
        let measurement = match self.config.model {
            Model::Pixel => Measurement::Pixel { pixel, covariance },
            Model::RangeBearing => Measurement::from_floor_pixel(finder, pixel, &covariance)?,
        };
        Some((
            report,
            Feature { pixel: Some(pixel), descriptor: Some(looks(corner)), ..Feature::new(measurement) },
        ))
    }
}

/// What is told of a corner before the map has seen it, or `None` where it has no range.
#[inline(never)] // it is long, and its callers are two
pub(super) fn ranged(
    finder: &RangeFinder<f32>,
    pixel: Vector2<f32>,
    pixel_covariance: Matrix2<f32>,
) -> Option<CornerReport> {
    let sighting = finder.sight(pixel).ok()?;
    Some(CornerReport {
        pixel,
        pixel_covariance,
        range: sighting.range,
        bearing: sighting.bearing,
        covariance: sighting.noise(&pixel_covariance),
        outcome: Outcome::default(),
    })
}

/// A picture's corners as the map takes them, one to one with the reports.
#[derive(Default)]
pub(super) struct Sightings {
    pub(super) features: heapless::Vec<Feature<f32>, MAX_CORNERS>,
    /// Where they were found in the picture; features and reports have them where a level robot's global shutter would.
    found: heapless::Vec<Vector2<f32>, MAX_CORNERS>,
    pub(super) without_range: u32,
}

impl Sightings {
    /// Tells of each corner where it was found.
    pub(super) fn as_found(&self, reports: &mut [CornerReport]) {
        for (report, found) in reports.iter_mut().zip(&self.found) {
            report.pixel = *found;
        }
    }

    /// Whether a feature may be of a landmark by its looks.
    pub(super) fn looks_alike(&self, index: usize, landmark: &Landmark<f32>) -> bool {
        self.features.get(index).is_some_and(|feature| alike(feature, landmark))
    }
}

/// Whether a measurement may be of a landmark by its looks; a laser's has none.
pub(super) fn alike(feature: &Feature<f32>, landmark: &Landmark<f32>) -> bool {
    match (feature.descriptor, landmark.descriptor) {
        (Some(seen), Some(known)) => seen == known,
        _ => true,
    }
}

/// What a corner looks like from anywhere: which side of the vertical edge and of the floor's edge is brighter.
fn looks(corner: &Corner) -> u32 {
    u32::from(corner.brighter_right) | u32::from(corner.brighter_below) << 1
}
