//! A pipeline's state as bytes, and its memory back.
use super::coverage::Intervals;
use super::steady::Moment;
use super::{Memory, Pipeline, Storage};
use crate::slam::{Landmark, MAP_BYTES, Map, SavedMap, snapshot_len};
use crate::{Error, Result};

/// Bytes that the state of a pipeline with so many states and landmarks takes, at most.
pub const fn state_len(states: usize, landmarks: usize) -> usize {
    FRAME_BYTES + MAP_BYTES + snapshot_len(states, landmarks)
}

const FRAME_BYTES: usize = 4;

impl<S: Storage> Pipeline<S> {
    /// The memory that it was lent.
    pub fn into_memory(self) -> Memory<S> {
        let (words, masks, points, extraction) = self.extractor.into_memory();
        let (numbers, landmarks) = self.map.into_filter().into_storage();
        Memory { words, masks, points, extraction, numbers, landmarks }
    }

    /// Writes pose and map to `bytes` and returns how many it took. A picture that is under way is not in them.
    ///
    /// # Errors
    /// [`Error::Size`] when `bytes` are too few; [`state_len`] of them are enough.
    pub fn save(&mut self, bytes: &mut [u8]) -> Result<usize> {
        save(&mut self.map, self.frame, bytes)
    }

    /// Writes pose and map to the memory of the rows, and returns them. A picture that is under way is forgotten.
    ///
    /// # Errors
    /// [`Error::Size`] when that is less than [`state_len`].
    pub fn save_to_scratch(&mut self) -> Result<&[u8]> {
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(self.extractor.scratch());
        let length = save(&mut self.map, self.frame, bytes)?;
        Ok(bytes.get(..length).unwrap_or_default())
    }

    /// The memory of the rows, to put a state together in. A picture that is under way is forgotten.
    pub fn scratch(&mut self) -> &mut [u8] {
        bytemuck::cast_slice_mut(self.extractor.scratch())
    }

    /// Takes the first `length` bytes of [`scratch`](Self::scratch) as [`restore`](Self::restore) does, if their covariance has no
    /// negative eigenvalue; `work` is as long as the upper triangle of a covariance of all states.
    ///
    /// # Errors
    /// As [`restore`](Self::restore), and as [`Filter::check_covariance`](crate::slam::Filter::check_covariance).
    pub fn restore_from_scratch(&mut self, length: usize, work: &mut [f32]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice_mut(self.extractor.scratch());
        let (own, rest) = split(bytes.get(..length).unwrap_or_default())?;
        self.map.filter().check_covariance(rest.get(MAP_BYTES..).unwrap_or_default(), work)?;
        self.map.restore(rest)?;
        self.frame = u32::from_le_bytes(*own);
        self.begin_anew();
        Ok(())
    }

    /// Takes pose and map written by [`save`](Self::save) in place of its own. A pipeline with the same configuration
    /// that is given the same pictures from there on gives the same reports, bit by bit; where corners are carried or
    /// pictures move the robot, the next picture is a keyframe as the first one is.
    ///
    /// # Errors
    /// [`Error::Size`] or [`Error::OutOfRange`] when it cannot be a state of this pipeline; nothing is changed then.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<()> {
        let (own, rest) = split(bytes)?;
        self.map.restore(rest)?;
        self.frame = u32::from_le_bytes(*own);
        self.begin_anew();
        Ok(())
    }

    /// Forgets what belongs to the place before.
    fn begin_anew(&mut self) {
        self.intervals = Intervals::default();
        self.moment = Moment::default();
        #[cfg(all(feature = "alloc", feature = "sift"))]
        self.forget_pictures();
    }
}

/// The map in the bytes of [`Pipeline::save`], for [`Pipeline::locate`].
///
/// # Errors
/// As [`SavedMap::read`].
pub fn saved_map(bytes: &[u8]) -> Result<SavedMap<'_>> {
    let (_, rest) = split(bytes)?;
    SavedMap::read(rest)
}

fn too_few(got: usize) -> Error {
    Error::Size { name: "pipeline.state", got, expected: FRAME_BYTES + MAP_BYTES }
}

fn save<N, L>(map: &mut Map<f32, N, L>, frame: u32, bytes: &mut [u8]) -> Result<usize>
where
    N: AsRef<[f32]> + AsMut<[f32]>,
    L: AsRef<[Landmark<f32>]> + AsMut<[Landmark<f32>]>,
{
    let got = bytes.len();
    let (own, rest) = bytes.split_first_chunk_mut::<FRAME_BYTES>().ok_or(too_few(got))?;
    let length = map.save(rest)?;
    *own = frame.to_le_bytes();
    Ok(FRAME_BYTES + length)
}

fn split(bytes: &[u8]) -> Result<(&[u8; FRAME_BYTES], &[u8])> {
    bytes.split_first_chunk().ok_or(too_few(bytes.len()))
}
