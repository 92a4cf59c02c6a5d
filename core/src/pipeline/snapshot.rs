//! A pipeline's state as bytes, and its memory back.
use super::{Memory, Pipeline, Storage};
use crate::slam::{MAP_BYTES, snapshot_len};
use crate::{Error, Result};

/// Bytes that the state of a pipeline with so many states and landmarks takes, at most.
pub const fn state_len(states: usize, landmarks: usize) -> usize {
    FRAME_BYTES + MAP_BYTES + snapshot_len(states, landmarks)
}

const FRAME_BYTES: usize = 4;

impl<S: Storage> Pipeline<S> {
    /// The memory that it was lent.
    pub fn into_memory(self) -> Memory<S> {
        let (words, masks, points) = self.extractor.into_memory();
        let (numbers, landmarks) = self.map.into_filter().into_storage();
        Memory { words, masks, points, numbers, landmarks }
    }

    /// Writes pose and map to `bytes` and returns how many it took. A picture that is under way is not in them.
    ///
    /// # Errors
    /// [`Error::Size`] when `bytes` are too few; [`state_len`] of them are enough.
    pub fn save(&mut self, bytes: &mut [u8]) -> Result<usize> {
        let (got, expected) = (bytes.len(), FRAME_BYTES + MAP_BYTES);
        let (own, rest) = bytes.split_first_chunk_mut::<FRAME_BYTES>().ok_or(Error::Size {
            name: "pipeline.state",
            got,
            expected,
        })?;
        let length = self.map.save(rest)?;
        *own = self.frame.to_le_bytes();
        Ok(FRAME_BYTES + length)
    }

    /// Takes pose and map written by [`save`](Self::save) in place of its own. A pipeline with the same configuration
    /// that is given the same pictures from there on gives the same reports, bit by bit.
    ///
    /// # Errors
    /// [`Error::Size`] or [`Error::OutOfRange`] when it cannot be a state of this pipeline; nothing is changed then.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<()> {
        let (got, expected) = (bytes.len(), FRAME_BYTES + MAP_BYTES);
        let (own, rest) = bytes.split_first_chunk::<FRAME_BYTES>().ok_or(Error::Size {
            name: "pipeline.state",
            got,
            expected,
        })?;
        self.map.restore(rest)?;
        self.frame = u32::from_le_bytes(*own);
        Ok(())
    }
}
