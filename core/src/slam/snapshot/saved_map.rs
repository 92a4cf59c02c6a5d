//! A map that was saved, as a filter elsewhere takes it: its landmarks with all that is known of them together, without the robot,
//! mount and wheels that made it.
use super::MAP_BYTES;
use super::bytes::In;
use super::stored::{Stored, cut, refuse};
use crate::geometry::Pose;
use crate::slam::covariance::triangle::Triangle;
use crate::slam::filter::{Covariance, Filter, Parts, ROBOT};
use crate::slam::health::Health;
use crate::slam::landmark::{Form, Landmark, Status};
use crate::slam::map::Map;
use crate::{Error, Result};
use nalgebra::{Matrix2, Matrix3, Vector2};

/// The bytes of [`Map::save`], checked.
#[derive(Clone, Copy, Debug)]
pub struct SavedMap<'a> {
    stored: Stored<'a>,
    next_id: u32,
}

impl<'a> SavedMap<'a> {
    /// A map in bytes.
    ///
    /// # Errors
    /// [`Error::Size`] or [`Error::OutOfRange`] where they are not those of a map of this version whose covariance was kept
    /// [packed](Covariance::Packed).
    pub fn read(bytes: &'a [u8]) -> Result<Self> {
        let mut input = In(bytes);
        let too_few = || cut(bytes, MAP_BYTES);
        let next_id = input.take().map(u32::from_le_bytes).ok_or_else(too_few)?;
        let _frame: [u8; 4] = input.take().ok_or_else(too_few)?;
        let stored = Stored::read(input.0)?;
        match stored.is_packed() {
            true => Ok(Self { stored, next_id }),
            false => Err(refuse(bytes, "a map whose covariance is packed")),
        }
    }

    /// Above the number of every landmark that there has been.
    pub fn next_id(&self) -> u32 {
        self.next_id
    }

    /// The confirmed landmarks that are points.
    pub fn landmarks(&self) -> impl Iterator<Item = Landmark<f32>> {
        self.stored
            .landmarks()
            .filter(|landmark| landmark.status == Status::Confirmed && landmark.form == Form::Point)
    }

    /// A landmark's position in the map, m.
    pub fn position(&self, landmark: &Landmark<f32>) -> Vector2<f32> {
        self.stored.pair(landmark.offset)
    }

    /// Covariance of one landmark's position with another's, m².
    pub fn covariance(&self, one: &Landmark<f32>, other: &Landmark<f32>) -> Matrix2<f32> {
        Matrix2::from_fn(|row, column| self.stored.entry(one.offset + row, other.offset + column))
    }
}

impl<S, L> Filter<f32, S, L>
where
    S: AsRef<[f32]> + AsMut<[f32]>,
    L: AsRef<[Landmark<f32>]> + AsMut<[Landmark<f32>]>,
{
    /// Puts the robot into a saved map, in place of its own: at `pose` with `covariance`, which share nothing with the map's errors.
    /// What is known of mount and wheels stays. Times of the map's landmarks are moved by `later` seconds to this filter's clock.
    ///
    /// # Errors
    /// [`Error::Full`] for a map that does not fit, [`Error::Unsupported`] where the covariance is kept in factors. Nothing is changed then.
    pub fn adopt(
        &mut self,
        map: &SavedMap<'_>,
        later: f64,
        pose: &Pose<f32>,
        covariance: &Matrix3<f32>,
    ) -> Result<()> {
        if self.config.covariance != Covariance::Packed {
            let reason = "a saved map is taken where the covariance is packed";
            return Err(Error::Unsupported { name: "filter.covariance", reason });
        }
        let (start, count) = (self.start(), map.landmarks().count());
        let size = start + 2 * count;
        if count > self.landmarks.as_ref().len() || size > self.states().1 {
            return Err(Error::Full { name: "landmarks", capacity: self.landmarks.as_ref().len() });
        }
        let records = self.landmarks.as_mut();
        for (slot, (record, landmark)) in records.iter_mut().zip(map.landmarks()).enumerate() {
            let [first_time, last_time] = [landmark.first_time, landmark.last_time].map(|time| time + later);
            let offset = start + 2 * slot;
            let (in_view, missed, last_frame, last_pixel) = (false, 0, 0, None);
            *record = Landmark {
                offset,
                first_time,
                last_time,
                in_view,
                missed,
                last_frame,
                last_pixel,
                ..landmark
            };
        }
        (self.count, self.size) = (count, size);
        self.first_pose = [pose.x, pose.y, pose.heading];
        let first_pose = self.first_pose;
        let Parts { x, rounding, first, mut p, .. } = self.parts();
        x.iter_mut().zip(first_pose).for_each(|(value, start)| *value = start);
        rounding.iter_mut().take(ROBOT).for_each(|value| *value = 0.0);
        for (slot, landmark) in map.landmarks().enumerate() {
            let at = start + 2 * slot;
            for (axis, value) in map.position(&landmark).into_iter().enumerate() {
                if let (Some(place), Some(lost)) = (x.get_mut(at + axis), rounding.get_mut(at + axis)) {
                    (*place, *lost) = (*value, 0.0);
                }
            }
        }
        first.iter_mut().zip(x).for_each(|(first, value)| *first = *value);
        set_covariance(&mut p, start, covariance);
        for (slot, one) in map.landmarks().enumerate() {
            for (after, other) in map.landmarks().enumerate().skip(slot) {
                let block = map.covariance(&one, &other);
                for ((row, column), value) in [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().zip(&block) {
                    p.set(start + 2 * slot + row, start + 2 * after + column, *value);
                }
            }
        }
        Ok(())
    }
}

/// The robot's covariance, and nothing in common between it, what stands beside it before `start`, and the landmarks.
fn set_covariance(p: &mut Triangle<'_, f32>, start: usize, robot: &Matrix3<f32>) {
    for row in 0..start {
        let shared = row.max(ROBOT)..start;
        for column in (row..p.size).filter(|column| !(row >= ROBOT && shared.contains(column))) {
            p.set(row, column, robot.get((row, column)).copied().unwrap_or_default());
        }
    }
}

impl<S, L> Map<f32, S, L>
where
    S: AsRef<[f32]> + AsMut<[f32]>,
    L: AsRef<[Landmark<f32>]> + AsMut<[Landmark<f32>]>,
{
    /// As [`Filter::adopt`]; new landmarks are numbered above all of both maps, and the figures of [`health`](Self::health) begin anew.
    ///
    /// # Errors
    /// As [`Filter::adopt`].
    pub fn adopt(
        &mut self,
        map: &SavedMap<'_>,
        later: f64,
        pose: &Pose<f32>,
        covariance: &Matrix3<f32>,
    ) -> Result<()> {
        self.filter.adopt(map, later, pose, covariance)?;
        self.number_from(map.next_id);
        self.health = Health::default();
        Ok(())
    }

    /// Whether the map stays as it is from now on: it corrects the robot, and takes nothing.
    pub fn fix(&mut self, fixed: bool) {
        self.filter.fixed = fixed;
    }

    /// Numbers landmarks that are born from now on from `id` at least.
    pub fn number_from(&mut self, id: u32) {
        self.next_id = self.next_id.max(id);
    }
}
