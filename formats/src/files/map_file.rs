//! `map.bin`: a map that a later run starts in.
//!
//! | bytes | |
//! |---|---|
//! | 8 | `MONOMAP` and the version, 1 |
//! | 8 | time of the drive's first frame, s |
//! | 1 + 24 | whether the truth's world is known, and x, y, heading of it in the map |
//! | rest | the pipeline's state |
//!
//! Numbers are little-endian `f64`.
use super::read_bytes;
use crate::{Error, Result};
use monorange_core::geometry::Pose;
use monorange_core::pipeline::{Pipeline, Storage, saved_map, state_len};
use monorange_core::slam::SavedMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

const MAGIC: [u8; 8] = *b"MONOMAP\x01";

/// A map as it is written.
#[derive(Clone, Debug, PartialEq)]
pub struct MapFile {
    path: PathBuf,
    /// Time of its drive's first frame, s.
    pub start: f64,
    /// The world of that drive's truth in the map, where there was one.
    pub map_from_truth: Option<Pose<f64>>,
    state: Vec<u8>,
}

impl MapFile {
    /// The map of a drive.
    ///
    /// # Errors
    /// For a map of more landmarks than the format holds.
    pub fn of<S: Storage>(
        pipeline: &mut Pipeline<S>,
        start: f64,
        map_from_truth: Option<Pose<f64>>,
    ) -> Result<Self> {
        let filter = pipeline.filter();
        let mut state = vec![0; state_len(filter.states().0, filter.landmarks().len())];
        let length = pipeline.save(&mut state).map_err(Error::new)?;
        state.truncate(length);
        Ok(Self { path: PathBuf::new(), start, map_from_truth, state })
    }

    /// Reads a map.
    ///
    /// # Errors
    /// When the file cannot be read, or is none that a drive wrote.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = read_bytes(path)?;
        let wrong = |cause: &str| {
            Error::new(cause)
                .at(path)
                .help("give the `map.bin` that `monorange slam` wrote into its --out folder")
        };
        let file =
            Self::parse(path, &bytes).ok_or_else(|| wrong("is no map of `monorange slam`, or is cut"))?;
        let map = file.map().map_err(|error| wrong(&format!("is damaged: {error}")))?;
        match map.landmarks().count() {
            0 => Err(wrong("holds no confirmed landmark: nothing can be recognised in it")),
            _ => Ok(file),
        }
    }

    fn parse(path: &Path, bytes: &[u8]) -> Option<Self> {
        let (magic, rest) = bytes.split_first_chunk::<8>()?;
        let (start, rest) = rest.split_first_chunk::<8>()?;
        let ([known], rest) = rest.split_first_chunk::<1>()?;
        let (pose, state) = rest.split_at_checked(24)?;
        let numbers: Vec<f64> =
            pose.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
        let [x, y, heading] = numbers.try_into().ok()?;
        let start = f64::from_le_bytes(*start);
        let finite = [start, x, y, heading].iter().all(|number| number.is_finite());
        (*magic == MAGIC && *known <= 1 && finite).then(|| Self {
            path: path.to_owned(),
            start,
            map_from_truth: (*known == 1).then(|| Pose::new(x, y, heading)),
            state: state.to_vec(),
        })
    }

    /// Where it was read from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its landmarks.
    ///
    /// # Errors
    /// Where the state is damaged; [`read`](Self::read) has seen to that.
    pub fn map(&self) -> Result<SavedMap<'_>> {
        saved_map(&self.state).map_err(Error::new)
    }

    /// Writes it.
    ///
    /// # Errors
    /// When writing fails.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let Pose { x, y, heading } = self.map_from_truth.unwrap_or_default();
        out.write_all(&MAGIC)?;
        out.write_all(&self.start.to_le_bytes())?;
        out.write_all(&[u8::from(self.map_from_truth.is_some())])?;
        [x, y, heading].iter().try_for_each(|number| out.write_all(&number.to_le_bytes()))?;
        out.write_all(&self.state)
    }
}
