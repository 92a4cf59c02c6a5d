//! The filter's state as bytes: to survive a restart, or to go on elsewhere.
//!
//! Everything that a later step depends on is in them, bit by bit, so that a filter that was restored and one that ran
//! on give the same answers. What the configuration holds is not: it must be the same. Numbers are little-endian.
//!
//! | bytes | |
//! |---|---|
//! | 4 | format, variant, how the covariance is kept, whether the mount (1) and the wheels (2) are estimated |
//! | 4 | landmarks, states n |
//! | 8 + 12 | time, first-estimate pose |
//! | 52 a landmark | its record |
//! | 4 · (3n + n(n+1)/2) | state, its rounding errors, first estimates, upper triangle row by row |
mod bytes;
mod saved_map;
mod stored;

pub use saved_map::SavedMap;

use crate::slam::covariance::triangle::packed_len;
use crate::slam::filter::{Covariance, Filter, Variant};
use crate::slam::health::Health;
use crate::slam::landmark::Landmark;
use crate::slam::map::Map;
use crate::slam::positive::is_positive;
use crate::{Error, Result};
use bytes::{In, Out, in_16_bits, put_landmark, take_landmark};
use stored::{Stored, cut, refuse};

const FORMAT: u8 = 2;
const HEADER: usize = 28;
const RECORD: usize = 52;
/// What a map's state takes beyond its filter's.
pub const MAP_BYTES: usize = 8;

/// Bytes that the state of a filter with so many states and landmarks takes, at most.
///
/// ```
/// use monorange_core::slam::{snapshot_len, states_for};
/// assert_eq!(snapshot_len(states_for(32, true), 32), 12_768);
/// ```
pub const fn snapshot_len(states: usize, landmarks: usize) -> usize {
    HEADER + RECORD * landmarks + 4 * (3 * states + packed_len(states))
}

impl<S, L> Filter<f32, S, L>
where
    S: AsRef<[f32]> + AsMut<[f32]>,
    L: AsRef<[Landmark<f32>]> + AsMut<[Landmark<f32>]>,
{
    /// Writes the state to `bytes` and returns how many it took.
    ///
    /// # Errors
    /// [`Error::Size`] when `bytes` are too few; [`Error::Full`] for a filter of more than 65,535 states, whose offsets the format
    /// cannot hold.
    pub fn save(&mut self, bytes: &mut [u8]) -> Result<usize> {
        let needed = snapshot_len(self.size, self.count);
        let got = bytes.len();
        // Offsets and the count of landmarks are below the number of states.
        let (count, size) = (in_16_bits(self.count)?, in_16_bits(self.size)?);
        let mut out = Out(bytes.get_mut(..needed).ok_or(Error::Size {
            name: "filter.snapshot",
            got,
            expected: needed,
        })?);
        out.put(self.kind());
        out.put(count.to_le_bytes());
        out.put(size.to_le_bytes());
        out.put(self.time.to_le_bytes());
        self.first_pose.iter().for_each(|value| out.put(value.to_le_bytes()));
        self.landmarks().iter().for_each(|landmark| put_landmark(&mut out, landmark));
        let n = self.size;
        let mut parts = self.parts();
        for vector in [parts.x, parts.rounding, parts.first] {
            vector.iter().take(n).for_each(|value| out.put(value.to_le_bytes()));
        }
        for row in 0..n {
            parts.p.row_mut(row).iter().for_each(|value| out.put(value.to_le_bytes()));
        }
        Ok(needed)
    }

    /// Takes a state written by [`save`](Self::save) in place of its own.
    ///
    /// # Errors
    /// [`Error::Size`] when the bytes are not as many as they say, or more than fits; [`Error::OutOfRange`] when they come
    /// from a filter of another kind or hold what cannot be: a number that is not finite or too large, a variance below 0, a
    /// correlation above 1. Nothing is changed then.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<()> {
        let kind: [u8; 4] = In(bytes).take().ok_or(cut(bytes, HEADER))?;
        if kind != self.kind() {
            return Err(refuse(bytes, "the state of a filter with this configuration"));
        }
        let stored = Stored::read(bytes)?;
        if stored.count > self.landmarks.as_ref().len() || stored.size > self.states().1 {
            return Err(cut(bytes, snapshot_len(stored.size, stored.count)));
        }
        self.apply(&stored);
        Ok(())
    }

    /// Whether the covariance in a state is one, which [`restore`](Self::restore) sees pair by pair only. `work` takes
    /// [`packed_len`](crate::slam::packed_len) numbers of its states. What `restore` refuses is passed.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a matrix with a negative eigenvalue, [`Error::Size`] when `work` is too short.
    pub fn check_covariance(&self, bytes: &[u8], work: &mut [f32]) -> Result<()> {
        let mut input = In(bytes);
        let head = input.take::<4>().zip(input.take().zip(input.take()));
        let Some((_, (count, size))) = head else { return Ok(()) };
        let [count, size] = [count, size].map(|number| usize::from(u16::from_le_bytes(number)));
        let triangle = bytes.get(HEADER + RECORD * count + 12 * size..);
        let Some(triangle) = triangle.map(In).filter(|_| self.config.covariance == Covariance::Packed) else {
            return Ok(());
        };
        if triangle.0.len() != 4 * packed_len(size) {
            return Ok(());
        }
        let short = Error::Size { name: "work", got: work.len(), expected: packed_len(size) };
        match is_positive(size, |place| triangle.number(place), work).ok_or(short)? {
            true => Ok(()),
            false => {
                let (value, expected) = (bytes.len() as f64, "a covariance without a negative eigenvalue");
                Err(Error::OutOfRange { name: "filter.snapshot", value, expected })
            }
        }
    }

    /// Nothing fails here: every length has been checked.
    fn apply(&mut self, stored: &Stored<'_>) {
        let Stored { count, size, mut records, mut numbers, .. } = *stored;
        (self.time, self.first_pose) = (stored.time, stored.first_pose);
        (self.count, self.size) = (count, size);
        for landmark in self.landmarks_mut() {
            *landmark = take_landmark(&mut records).unwrap_or_default();
        }
        let mut number = || numbers.take().map_or(0.0, f32::from_le_bytes);
        let mut parts = self.parts();
        for vector in [parts.x, parts.rounding, parts.first] {
            vector.iter_mut().take(size).for_each(|value| *value = number());
        }
        for row in 0..size {
            parts.p.row_mut(row).iter_mut().for_each(|value| *value = number());
        }
    }

    /// Format, variant, covariance, mount and wheels.
    fn kind(&self) -> [u8; 4] {
        let variant = match self.config.variant {
            Variant::Invariant => 0,
            Variant::Textbook => 1,
            Variant::FirstEstimates => 2,
        };
        let covariance = match self.config.covariance {
            Covariance::Packed => 0,
            Covariance::Factored => 1,
        };
        let [mount, wheels] =
            [self.config.mount_std.is_some(), self.config.wheels_std.is_some()].map(u8::from);
        [FORMAT, variant, covariance, mount + 2 * wheels]
    }
}

impl<S, L> Map<f32, S, L>
where
    S: AsRef<[f32]> + AsMut<[f32]>,
    L: AsRef<[Landmark<f32>]> + AsMut<[Landmark<f32>]>,
{
    /// Writes the map with its filter's state to `bytes` and returns how many it took: [`MAP_BYTES`] more than the filter.
    /// The figures of [`health`](Self::health) are not in them: they begin anew.
    ///
    /// # Errors
    /// As [`Filter::save`].
    pub fn save(&mut self, bytes: &mut [u8]) -> Result<usize> {
        let got = bytes.len();
        let expected = MAP_BYTES + snapshot_len(self.filter().states().0, self.filter().landmarks().len());
        let (own, rest) =
            bytes.split_first_chunk_mut().ok_or(Error::Size { name: "map.snapshot", got, expected })?;
        let length = self.filter.save(rest)?;
        let own: &mut [u8; MAP_BYTES] = own;
        let mut out = Out(own);
        out.put(self.next_id.to_le_bytes());
        out.put(self.frame.to_le_bytes());
        Ok(MAP_BYTES + length)
    }

    /// Takes a map written by [`save`](Self::save) in place of its own.
    ///
    /// # Errors
    /// As [`Filter::restore`].
    pub fn restore(&mut self, bytes: &[u8]) -> Result<()> {
        let cut = Error::Size { name: "map.snapshot", got: bytes.len(), expected: MAP_BYTES };
        let mut input = In(bytes);
        let next_id = u32::from_le_bytes(input.take().ok_or(cut)?);
        let frame = u32::from_le_bytes(input.take().ok_or(cut)?);
        self.filter.restore(input.0)?;
        (self.next_id, self.frame, self.health) = (next_id, frame, Health::default());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn more_states_than_the_format_holds_are_refused_not_cut_off() {
        assert_eq!(super::in_16_bits(65_535), Ok(65_535));
        assert!(matches!(super::in_16_bits(65_536), Err(super::Error::Full { capacity: 65_535, .. })));
    }

    extern crate std;
    use super::*;
    use crate::geometry::Pose;
    use crate::slam::*;
    use nalgebra::{Matrix2, Matrix3, Vector2};
    use std::vec::Vec;

    type Kept = Map<f32, Vec<f32>, Vec<Landmark<f32>>>;

    fn empty(landmarks: usize) -> Kept {
        let storage = std::vec![0.0; storage_len(states_for(landmarks, false))];
        let records = std::vec![Landmark::default(); landmarks];
        let filter =
            Filter::new(storage, records, Pose::default(), Matrix3::zeros(), FilterConfig::default())
                .unwrap();
        Map::new(filter, MapConfig::default()).unwrap()
    }

    /// Drives `steps` of a circle round a few landmarks.
    fn drive(map: &mut Kept, steps: core::ops::Range<u32>) {
        for step in steps {
            let noise = Matrix2::new(1e-4, 0.0, 0.0, 1e-4);
            let increment = Increment::from_velocity(0.5, 0.25, 0.1, &noise, Integration::Arc);
            map.filter_mut().predict(f64::from(step) * 0.1, &increment).unwrap();
            let wobble = f32::from((step * 7 % 11) as u8) * 1e-3;
            let features = [(2.0 + wobble, 0.3), (3.0, -0.4 - wobble), (1.5, 1.0 + wobble)]
                .map(|(range, bearing)| Feature::new(Measurement::range_bearing(range, bearing, 0.01, 0.01)));
            map.observe(&features, |_, _| true, &mut [Outcome::default(); 3]).unwrap();
        }
    }

    fn saved(map: &mut Kept) -> Vec<u8> {
        let mut bytes = std::vec![0; 20_000];
        let length = map.save(&mut bytes).unwrap();
        bytes.truncate(length);
        bytes
    }

    #[test]
    fn a_restored_map_goes_on_bit_by_bit_as_if_nothing_had_happened() {
        let mut map = empty(12);
        drive(&mut map, 0..30);
        let state = saved(&mut map);
        let mut other = empty(12);
        drive(&mut other, 0..3);
        other.restore(&state).unwrap();
        assert_eq!(saved(&mut other), state);
        drive(&mut map, 30..60);
        drive(&mut other, 30..60);
        assert_eq!(saved(&mut other), saved(&mut map));
        assert!(map.filter().landmarks().len() > 2, "the law is about something");
    }

    /// Drives `steps` of a circle of 2 m inside six landmarks, all of which are seen all the time.
    fn circle(map: &mut Kept, steps: core::ops::Range<u32>) {
        for step in steps {
            let noise = Matrix2::new(1e-4, 0.0, 0.0, 1e-4);
            let (length, turn) = if step == 0 { (0.0, 0.0) } else { (0.5, 0.25) };
            let increment = Increment::from_velocity(length, turn, 0.1, &noise, Integration::Arc);
            map.filter_mut().predict(f64::from(step) * 0.1, &increment).unwrap();
            let angle = 0.025 * step as f32;
            let pose = Pose::new(2.0 * libm::sinf(angle), 2.0 - 2.0 * libm::cosf(angle), angle);
            let wobble = (f32::from((step * 7 % 11) as u8) - 5.0) * 1e-3;
            let features: [_; 6] = core::array::from_fn(|k| {
                let (sin, cos) = libm::sincosf(k as f32);
                let seen = pose.inverse_transform(Vector2::new(4.0 * cos, 2.0 + 4.0 * sin));
                let bearing = libm::atan2f(seen.y, seen.x);
                Feature::new(Measurement::range_bearing(seen.norm() + wobble, bearing - wobble, 0.01, 0.01))
            });
            map.observe(&features, |_, _| true, &mut [Outcome::default(); 6]).unwrap();
        }
    }

    /// A landmark as the robot has it before it.
    fn relative(map: &Kept, id: u32) -> Vector2<f32> {
        let filter = map.filter();
        filter.pose().inverse_transform(filter.position(filter.landmark(id).unwrap()).unwrap())
    }

    #[test]
    fn a_map_that_is_adopted_is_the_saved_one_and_goes_on() {
        let mut map = empty(12);
        circle(&mut map, 0..31);
        let state = saved(&mut map);
        let known = SavedMap::read(&state).unwrap();
        let mut other = empty(40);
        circle(&mut other, 0..31);
        let covariance = Matrix3::from_diagonal_element(0.01);
        let pose = map.filter().pose();
        let time = other.filter().time();
        other.adopt(&known, 7.0, &pose, &covariance).unwrap();
        assert_eq!((other.filter().time(), other.filter().pose()), (time, pose));
        assert_eq!(other.filter().pose_covariance(), covariance);
        let landmarks: Vec<_> = known.landmarks().collect();
        assert!(landmarks.len() > 2 && landmarks.len() == other.filter().landmarks().len());
        for landmark in &landmarks {
            let own = *other.filter().landmark(landmark.id).unwrap();
            assert_eq!(own.first_time, landmark.first_time + 7.0);
            assert_eq!(other.filter().position(&own).unwrap(), known.position(landmark));
            for again in &landmarks {
                let also = *other.filter().landmark(again.id).unwrap();
                assert_eq!(other.filter().covariance_between(&own, &also), known.covariance(landmark, again));
            }
        }
        circle(&mut other, 31..60);
        circle(&mut map, 31..60);
        // The same drive in the same map, begun less surely.
        let near = (relative(&other, landmarks[0].id) - relative(&map, landmarks[0].id)).norm();
        assert!(near < 0.02, "{near}");
        assert!(other.next_id > landmarks.iter().map(|landmark| landmark.id).max().unwrap());
        assert!(matches!(empty(2).adopt(&known, 0.0, &pose, &covariance), Err(Error::Full { .. })));
    }

    #[test]
    fn a_fixed_map_corrects_the_robot_and_is_not_corrected() {
        let mut map = empty(12);
        circle(&mut map, 0..30);
        let state = saved(&mut map);
        let known = SavedMap::read(&state).unwrap();
        let pose = map.filter().pose();
        let mut fixed = empty(40);
        circle(&mut fixed, 0..30);
        fixed.adopt(&known, 0.0, &pose, &Matrix3::from_diagonal_element(0.01)).unwrap();
        let mut free = fixed.clone();
        fixed.fix(true);
        for one in [&mut fixed, &mut free] {
            circle(one, 30..31);
        }
        let trace = |map: &Kept| map.filter().pose_covariance().trace();
        // What is not corrected corrects less, and both far more than nothing.
        assert!(trace(&free) < trace(&fixed) && trace(&fixed) < 0.003, "{} {}", trace(&free), trace(&fixed));
        circle(&mut fixed, 31..60);
        let landmarks: Vec<_> = known.landmarks().collect();
        assert_eq!(fixed.filter().landmarks().len(), landmarks.len());
        for landmark in &landmarks {
            let own = *fixed.filter().landmark(landmark.id).unwrap();
            assert_eq!(fixed.filter().position(&own).unwrap(), known.position(landmark));
            for again in &landmarks {
                let also = *fixed.filter().landmark(again.id).unwrap();
                assert_eq!(fixed.filter().covariance_between(&own, &also), known.covariance(landmark, again));
            }
        }
        assert!(
            landmarks
                .iter()
                .any(|landmark| fixed.filter().landmark(landmark.id).unwrap().seen > landmark.seen + 20)
        );
    }

    #[test]
    fn a_state_of_another_kind_or_size_changes_nothing() {
        let mut map = empty(12);
        drive(&mut map, 0..30);
        let state = saved(&mut map);
        let count = map.filter().landmarks().len();
        assert!(empty(count - 1).restore(&state).is_err(), "{count} landmarks do not fit {}", count - 1);
        let before = saved(&mut map);
        for length in 0..state.len() {
            assert!(map.restore(&state[..length]).is_err());
        }
        for (place, value) in [(8, 9), (9, 1), (10, 1), (12, 200), (14, 99)] {
            let mut wrong = state.clone();
            wrong[place] = value;
            assert!(map.restore(&wrong).is_err(), "byte {place}");
        }
        let mut wrong = state.clone();
        let [first, second] = [0, 1].map(|slot| MAP_BYTES + HEADER + RECORD * slot + 4);
        wrong.copy_within(first..first + 2, second);
        assert!(map.restore(&wrong).is_err(), "two landmarks with the same states");
        let mut wrong = state.clone();
        let last = wrong.len() - 4;
        wrong[last..].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(map.restore(&wrong).is_err(), "a covariance that is no number");
        assert_eq!(saved(&mut map), before);
    }
}
