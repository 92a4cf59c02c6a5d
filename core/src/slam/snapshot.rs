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
use crate::slam::covariance::triangle::packed_len;
use crate::slam::filter::{Covariance, Filter, Variant};
use crate::slam::health::Health;
use crate::slam::landmark::{Form, Landmark, Status};
use crate::slam::map::Map;
use crate::slam::positive::is_positive;
use crate::{Error, Result};
use nalgebra::Vector2;

const FORMAT: u8 = 2;
/// No state (m, rad, 1/m) is larger, so that squares do not overflow in what follows: a position on Earth is below 1e7 m.
const LARGEST: f32 = 1e8;
/// No variance is larger.
const MOST_VARIABLE: f32 = 1e10;
/// Above 1 by what rounding may do to the covariance of two landmarks that are known together far better than apart.
const MOST_CORRELATED: f32 = 1.01;
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
        let refuse =
            |expected| Error::OutOfRange { name: "filter.snapshot", value: bytes.len() as f64, expected };
        let cut = |expected| Error::Size { name: "filter.snapshot", got: bytes.len(), expected };
        let mut input = In(bytes);
        let kind: [u8; 4] = input.take().ok_or(cut(HEADER))?;
        if kind != self.kind() {
            return Err(refuse("the state of a filter with this configuration"));
        }
        let count = usize::from(u16::from_le_bytes(input.take().ok_or(cut(HEADER))?));
        let size = usize::from(u16::from_le_bytes(input.take().ok_or(cut(HEADER))?));
        let expected = snapshot_len(size, count);
        let fits = count <= self.landmarks.as_ref().len() && size <= self.states().1 && size >= self.start();
        if bytes.len() != expected || !fits {
            return Err(cut(expected));
        }
        let time = f64::from_le_bytes(input.take().ok_or(cut(expected))?);
        let mut first_pose = [0.0; 3];
        for value in &mut first_pose {
            *value = f32::from_le_bytes(input.take().ok_or(cut(expected))?);
        }
        let records = In(input.0);
        let mut states = self.start();
        for _ in 0..count {
            let landmark = take_landmark(&mut input).ok_or(refuse("records of landmarks"))?;
            let length = landmark.form.len();
            if landmark.offset < self.start() || landmark.offset + length > size {
                return Err(refuse("landmarks within the state"));
            }
            states += length;
        }
        if !are_apart(records, count) {
            return Err(refuse("states of its own for every landmark"));
        }
        let numbers = In(input.0);
        let sane = |value: f32| value.abs() <= LARGEST;
        let mut vectors = (0..3 * size).map_while(|_| input.take().map(f32::from_le_bytes));
        if !vectors.all(sane) || !time.is_finite() || !first_pose.into_iter().all(sane) || states != size {
            return Err(refuse("finite numbers, one set for every landmark"));
        }
        if !self.possible(size, input) {
            return Err(refuse("variances that are not negative, correlations between -1 and 1"));
        }
        self.apply(time, first_pose, count, size, records, numbers);
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

    /// Whether a triangle of `size` rows can be a covariance as this filter keeps it.
    fn possible(&self, size: usize, triangle: In<'_>) -> bool {
        let packed = self.config.covariance == Covariance::Packed;
        let diagonal = |row: usize| triangle.number(row * size - row * row.saturating_sub(1) / 2);
        let variance = |row: usize| {
            // Only the robot, its mount and its wheels may be known exactly.
            let least = if packed && row >= self.start() { f32::MIN_POSITIVE } else { 0.0 };
            diagonal(row).filter(|value| (least..=MOST_VARIABLE).contains(value))
        };
        let mut numbers = triangle;
        for row in 0..size {
            let (Some(own), Some(_)) = (variance(row), numbers.take::<4>()) else { return false };
            let mut sum = own;
            for column in row + 1..size {
                let (Some(entry), Some(other)) = (numbers.take().map(f32::from_le_bytes), variance(column))
                else {
                    return false;
                };
                let square = entry * entry;
                sum += square * other;
                let correlated = MOST_CORRELATED * MOST_CORRELATED * own * other;
                if !square.is_finite() || packed && square > correlated {
                    return false;
                }
            }
            // Of P = U D Uᵀ, whose rows hold D and U.
            if !packed && (sum.is_nan() || sum > MOST_VARIABLE) {
                return false;
            }
        }
        true
    }

    /// Nothing fails here: every length has been checked.
    fn apply(
        &mut self,
        time: f64,
        first_pose: [f32; 3],
        count: usize,
        size: usize,
        mut records: In<'_>,
        mut numbers: In<'_>,
    ) {
        self.time = time;
        self.first_pose = first_pose;
        self.count = count;
        self.size = size;
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

/// Bytes still to be written.
struct Out<'a>(&'a mut [u8]);

impl Out<'_> {
    fn put<const N: usize>(&mut self, bytes: [u8; N]) {
        if let Some((place, rest)) = core::mem::take(&mut self.0).split_first_chunk_mut() {
            *place = bytes;
            self.0 = rest;
        }
    }
}

/// Bytes still to be read.
#[derive(Clone, Copy)]
struct In<'a>(&'a [u8]);

impl In<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (bytes, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*bytes)
    }

    /// The number at a place, of numbers only.
    fn number(&self, place: usize) -> Option<f32> {
        self.0.get(4 * place..)?.first_chunk().map(|bytes| f32::from_le_bytes(*bytes))
    }
}

/// Whether no two of the `count` landmarks at the start of `records` share a state.
fn are_apart(mut records: In<'_>, count: usize) -> bool {
    (1..=count).rev().all(|left| {
        let Some(one) = take_landmark(&mut records) else { return false };
        let mut others = records;
        (1..left).filter_map(|_| take_landmark(&mut others)).all(|other| {
            one.offset + one.form.len() <= other.offset || other.offset + other.form.len() <= one.offset
        })
    })
}

fn put_landmark(out: &mut Out<'_>, landmark: &Landmark<f32>) {
    // Field by field, so that a new one cannot be forgotten.
    let Landmark {
        id,
        offset,
        form,
        status,
        seen,
        expected,
        missed,
        in_view,
        first_time,
        last_time,
        last_frame,
        last_pixel,
        descriptor,
    } = *landmark;
    out.put(id.to_le_bytes());
    out.put((offset as u16).to_le_bytes());
    let flags = [
        form == Form::InverseDistance,
        status == Status::Confirmed,
        last_pixel.is_some(),
        descriptor.is_some(),
        in_view,
    ];
    let flags = flags.into_iter().rev().fold(0_u16, |bits, flag| 2 * bits + u16::from(flag));
    out.put(flags.to_le_bytes());
    [seen, expected, missed].into_iter().for_each(|count| out.put(count.to_le_bytes()));
    [first_time, last_time].into_iter().for_each(|time| out.put(time.to_le_bytes()));
    out.put(last_frame.to_le_bytes());
    let pixel = last_pixel.unwrap_or_default();
    [pixel.x, pixel.y].into_iter().for_each(|value| out.put(value.to_le_bytes()));
    out.put(descriptor.unwrap_or_default().to_le_bytes());
}

fn in_16_bits(number: usize) -> Result<u16> {
    let full = Error::Full { name: "filter.snapshot", capacity: usize::from(u16::MAX) };
    u16::try_from(number).map_err(|_| full)
}

fn take_landmark(input: &mut In<'_>) -> Option<Landmark<f32>> {
    let id = u32::from_le_bytes(input.take()?);
    let offset = usize::from(u16::from_le_bytes(input.take()?));
    let flags = u16::from_le_bytes(input.take()?);
    let has = |bit: u16| flags >> bit & 1 == 1;
    let mut count = || Some(u32::from_le_bytes(input.take()?));
    let (seen, expected, missed) = (count()?, count()?, count()?);
    let mut time = || input.take().map(f64::from_le_bytes).filter(|time| time.is_finite());
    let (first_time, last_time) = (time()?, time()?);
    let last_frame = u32::from_le_bytes(input.take()?);
    let mut number = || input.take().map(f32::from_le_bytes).filter(|number| number.is_finite());
    let pixel = Vector2::new(number()?, number()?);
    let descriptor = u32::from_le_bytes(input.take()?);
    Some(Landmark {
        id,
        offset,
        form: if has(0) { Form::InverseDistance } else { Form::Point },
        status: if has(1) { Status::Confirmed } else { Status::Tentative },
        seen,
        expected,
        missed,
        in_view: has(4),
        first_time,
        last_time,
        last_frame,
        last_pixel: has(2).then_some(pixel),
        descriptor: has(3).then_some(descriptor),
    })
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
    use nalgebra::{Matrix2, Matrix3};
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
