//! The robot's place in a map that was saved: it drives on a map of its own until it recognises where on the other it is.
//!
//! [`register`] lays the own map over the saved one. What tells the pose then is the picture at hand: the robot is put to its place
//! with a covariance that says next to nothing, and the picture's corners, which have the saved landmarks' names now, correct it as
//! they always do. So the pose's errors are tied to the map's as if it had been driven here in it.
use super::{Model, Pipeline, Report, Storage};
use crate::Result;
use crate::geometry::Pose;
use crate::slam::{Feature, Form, Hint, Landmark, Measurement, Outcome, Place, SavedMap, Status, register};
use alloc::vec::Vec;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// Own landmarks that are laid over the map, those seen last.
const MOST_OWN: usize = 24;
/// Corners of the picture at hand that must be the saved map's.
const LEAST_SEEN: usize = 3;
/// What a registration's standard deviations are enlarged by: its pairs are for finding the place, and count a ninth of what they would.
const ENLARGED: f32 = 3.0;
/// And what is added, m and rad.
const ADDED: [f32; 3] = [0.1, 0.1, 0.05];

/// The robot has been found in a saved map.
#[derive(Clone, Debug)]
pub struct Located {
    /// What was its world before, in the saved map's.
    pub map_from_own: Pose<f32>,
    /// Landmarks by their own numbers, and by the saved map's.
    pub names: Vec<(u32, u32)>,
}

fn is_point(landmark: &Landmark<f32>) -> bool {
    landmark.status == Status::Confirmed && landmark.form == Form::Point
}

fn place(landmark: &Landmark<f32>, position: Vector2<f32>) -> Place {
    Place { position, looks: landmark.descriptor }
}

impl<S: Storage> Pipeline<S> {
    /// Numbers the landmarks of its own map above the saved one's.
    pub fn number_from(&mut self, id: u32) {
        self.map.number_from(id);
    }

    /// Looks for the robot in a saved map, after a picture that gave `report`. Where it is found, the pipeline goes on in that map in
    /// place of its own, whose clock began `later` seconds after the saved one's. With `fixed` that map stays as it is from then on:
    /// it gives poses, and takes nothing.
    ///
    /// Until then the pipeline goes on with a map of its own from where it began.
    ///
    /// # Errors
    /// As [`Map::adopt`](crate::slam::Map::adopt).
    pub fn locate(
        &mut self,
        saved: &SavedMap<'_>,
        later: f64,
        fixed: bool,
        report: &Report,
    ) -> Result<Option<Located>> {
        let seen = |corner: &&super::CornerReport| corner.outcome.decision.is_update();
        if report.corners.iter().filter(seen).count() < LEAST_SEEN {
            return Ok(None);
        }
        let filter = self.filter();
        let before = filter.pose();
        let mut own: Vec<_> = filter.landmarks().iter().copied().filter(is_point).collect();
        // The robot is where it sees, not where it was long ago.
        own.sort_by(|one, other| other.last_time.total_cmp(&one.last_time));
        own.truncate(MOST_OWN);
        let landmarks: Vec<_> = saved.landmarks().collect();
        let position = |landmark: &Landmark<f32>| filter.position(landmark).unwrap_or_default();
        let seen: Vec<_> =
            own.iter().map(|one| place(one, before.inverse_transform(position(one)))).collect();
        let known: Vec<_> = landmarks.iter().map(|one| place(one, saved.position(one))).collect();
        let turn = before.rotation();
        let own_covariance = |one: usize, other: usize| match (own.get(one), own.get(other)) {
            (Some(one), Some(other)) => turn.tr_mul(&filter.covariance_between(one, other)) * turn,
            _ => Matrix2::zeros(),
        };
        let map_covariance = |one: usize, other: usize| match (landmarks.get(one), landmarks.get(other)) {
            (Some(one), Some(other)) => saved.covariance(one, other),
            _ => Matrix2::zeros(),
        };
        let found = register(&seen, own_covariance, &known, map_covariance);
        let Some(found) = found else { return Ok(None) };
        let name = |(one, other): &(usize, usize)| Some((own.get(*one)?.id, landmarks.get(*other)?.id));
        let names: Vec<_> = found.pairs.iter().filter_map(name).collect();
        let features = self.named(report, &names);
        if features.len() < LEAST_SEEN {
            return Ok(None);
        }
        let wide = found.covariance * (ENLARGED * ENLARGED)
            + Matrix3::from_diagonal(&Vector3::from(ADDED.map(|std| std * std)));
        self.map.adopt(saved, later, &found.pose, &wide)?;
        self.map.fix(fixed);
        let mut outcomes = alloc::vec![Outcome::default(); features.len()];
        self.map.observe(&features, |_, _| true, &mut outcomes)?;
        #[cfg(feature = "sift")]
        self.rename_carried(&names);
        let map_from_own = self.filter().pose().compose(&before.inverse());
        Ok(Some(Located { map_from_own, names }))
    }

    /// The picture's corners that have a name in the saved map, with it.
    fn named(&self, report: &Report, names: &[(u32, u32)]) -> Vec<Feature<f32>> {
        let finder = self.finder();
        let feature = |corner: &super::CornerReport| {
            let own = corner.outcome.landmark.filter(|_| corner.outcome.decision.is_update())?;
            let (_, name) = names.iter().find(|(known, _)| *known == own)?;
            let (pixel, covariance) = (self.steady(&finder, corner.pixel), corner.pixel_covariance);
            let measurement = match self.config.model {
                Model::Pixel => Measurement::Pixel { pixel, covariance },
                Model::RangeBearing => Measurement::from_floor_pixel(&finder, pixel, &covariance)?,
            };
            Some(Feature { hint: Hint::Landmark(*name), pixel: Some(pixel), ..Feature::new(measurement) })
        };
        report.corners.iter().filter_map(feature).collect()
    }
}
