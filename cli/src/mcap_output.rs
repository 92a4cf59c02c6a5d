//! `--mcap`: the run as a recording of ROS 2.
use monorange_core::scan::Reading;
use monorange_formats::{
    Error, Result,
    bags::{MAP_EVERY, Recorder},
    files::{MapPoint, Rig, Stamped, io_error},
};
use std::{
    fs::File,
    io::{BufWriter, Seek, SeekFrom},
};

/// A recording that grows in a file without a name, until it is whole.
pub struct McapOutput {
    recorder: Recorder<BufWriter<File>>,
    next_map: f64,
}

impl McapOutput {
    /// A recording of what a rig's camera sees.
    ///
    /// # Errors
    /// When there is no room for temporary files.
    pub fn new(rig: &Rig) -> Result<Self> {
        let file = tempfile::tempfile().map_err(|error| io_error(&error).at(std::env::temp_dir()))?;
        Ok(Self { recorder: Recorder::new(BufWriter::new(file), rig)?, next_map: f64::NEG_INFINITY })
    }

    /// Adds a pose, the picture with what was seen in it (JPEG), its scan, and now and then the map.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn frame(
        &mut self,
        pose: &Stamped,
        overlay: &[u8],
        scan: &[Reading],
        map: impl FnOnce() -> Vec<MapPoint>,
    ) -> Result<()> {
        self.recorder.frame(pose, overlay, scan)?;
        if pose.time >= self.next_map {
            self.recorder.map(pose.time, &map())?;
            self.next_map = pose.time + MAP_EVERY;
        }
        Ok(())
    }

    /// The whole recording with the last map, to be read from its beginning.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish(mut self, time: f64, map: &[MapPoint]) -> Result<File> {
        self.recorder.map(time, map)?;
        let mut file = self.recorder.finish()?.into_inner().map_err(Error::new)?;
        file.seek(SeekFrom::Start(0)).map_err(Error::new)?;
        Ok(file)
    }
}
