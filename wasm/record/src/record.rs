//! A run from its first frame to its last, as one module tells it to another.
use crate::{Landmark, Verdict};
use serde::{Deserialize, Serialize};

/// What the wheels said over some time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reading {
    /// Speed (m/s) and turn rate (rad/s) for so many seconds.
    Velocity {
        /// Seconds.
        seconds: f64,
        /// m/s.
        v: f32,
        /// rad/s.
        omega: f32,
    },
    /// A step in the robot's own frame.
    Increment {
        /// Seconds.
        seconds: f64,
        /// Metres ahead.
        forward: f32,
        /// Metres to the left.
        left: f32,
        /// Radians.
        turn: f32,
    },
}

/// A frame that was used.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Its place in the sequence.
    pub index: usize,
    /// Seconds, on the sequence's clock.
    pub time: f64,
    /// x, y, heading of the robot in the world.
    pub pose: [f32; 3],
    /// var_x, cov_xy, cov_xh, var_y, cov_yh, var_h.
    pub covariance: [f32; 6],
    /// The robot's motion since the frame before, as a scan takes it: forward, left, turn; nothing where it is not known.
    pub moved: Option<[f32; 3]>,
    /// Rows of [`crate::Corner`].
    pub corners: Vec<f32>,
    /// Milliseconds of decoding, edges, lines, motion, map.
    pub stages_ms: [f32; 5],
}

/// A landmark of the finished map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapPoint {
    /// Its number.
    pub id: u64,
    /// x, y in metres.
    pub position: [f32; 2],
    /// var_x, cov_xy, var_y in m².
    pub covariance: [f32; 3],
    /// How often it was seen.
    pub seen: u64,
    /// When it was seen first and last, seconds since the first frame.
    pub times: [f64; 2],
}

/// Seconds of a run from a map that is kept to the next.
pub const MAP_EVERY: f64 = 1.0;

/// The map as it was after a frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapThen {
    /// The frame's time, seconds.
    pub time: f64,
    /// Rows of [`crate::Landmark`], of the confirmed ones.
    pub landmarks: Vec<f32>,
}

/// A run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// What was run through, as the command line would name it.
    pub title: String,
    /// Frames of the sequence.
    pub frames: usize,
    /// The first frame's time in seconds.
    pub start: f64,
    /// The frames that were used, in order.
    pub used: Vec<Frame>,
    /// Why the other ones were not, a sentence each.
    pub left_out: Vec<String>,
    /// The confirmed landmarks.
    pub map: Vec<MapPoint>,
    /// Those of before, every [`MAP_EVERY`] seconds.
    pub maps: Vec<MapThen>,
    /// Corners that had no range worth the name.
    pub without_range: u32,
    /// Landmarks for which there was no room.
    pub no_room: u32,
    /// Where the motion came from the pictures: steps that they could not tell.
    pub unmeasured: Option<usize>,
    /// Where a homography was to carry corners: pictures in which the floor's, the free one, or none did.
    pub carried: Option<[usize; 3]>,
    /// When the camera seems to have been knocked, seconds.
    pub knocked: Vec<f64>,
    /// The filter's verdict on itself.
    pub verdict: Verdict,
    /// What speaks against the filter, in words; empty where nothing does.
    pub reason: String,
    /// Mean normalised innovation squared a degree of freedom.
    pub mean_nis: f32,
    /// What looked wrong and was used all the same.
    pub warnings: Vec<String>,
}

impl Record {
    /// Keeps the landmarks of a frame (rows of [`crate::Landmark`]) where a map is due.
    pub fn keep_map(&mut self, time: f64, landmarks: &[f32]) {
        if self.maps.last().is_none_or(|last| time >= last.time + MAP_EVERY) {
            let rows = landmarks.chunks_exact(Landmark::WIDTH);
            let confirmed = rows.filter(|row| Landmark::of(row).is_some_and(|row| row.confirmed > 0.0));
            self.maps.push(MapThen { time, landmarks: confirmed.flatten().copied().collect() });
        }
    }

    /// In bytes, for another module.
    ///
    /// # Errors
    /// Without memory.
    pub fn to_bytes(&self) -> Result<Vec<u8>, postcard::Error> {
        postcard::to_allocvec(self)
    }

    /// From the bytes of [`to_bytes`](Self::to_bytes).
    ///
    /// # Errors
    /// Where they are of another build.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, postcard::Error> {
        postcard::from_bytes(bytes)
    }
}

/// Readings in bytes, for another module.
///
/// # Errors
/// Without memory.
pub fn readings_to_bytes(readings: &[Reading]) -> Result<Vec<u8>, postcard::Error> {
    postcard::to_allocvec(readings)
}

/// Readings from the bytes of [`readings_to_bytes`].
///
/// # Errors
/// Where they are of another build.
pub fn readings_from_bytes(bytes: &[u8]) -> Result<Vec<Reading>, postcard::Error> {
    postcard::from_bytes(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_is_kept_every_second_of_confirmed_landmarks() {
        let row = |id, confirmed| Landmark {
            id,
            x: 1.0,
            y: 2.0,
            var_x: 0.1,
            cov_xy: 0.0,
            var_y: 0.1,
            seen: 3.0,
            confirmed,
        };
        let mut rows = Vec::new();
        row(4.0, 1.0).push(&mut rows);
        row(5.0, 0.0).push(&mut rows);
        let mut record = Record::default();
        for time in [10.0, 10.5, 11.0, 11.9, 12.5] {
            record.keep_map(time, &rows);
        }
        assert_eq!(record.maps.iter().map(|map| map.time).collect::<Vec<_>>(), [10.0, 11.0, 12.5]);
        assert_eq!(record.maps[0].landmarks, rows[..Landmark::WIDTH]);
    }
}
