//! The run as a recording of ROS 2, by the command line's recorder; its bytes are handed on as they come.
use monorange_formats::Error;
use monorange_formats::bags::{self, Recorder};
use monorange_formats::files::{MapPoint, Rig, Stamped};
use std::cell::RefCell;
use std::io::{self, Write};
use std::rc::Rc;

// A map is kept as often as one is written.
const _: () = assert!(monorange_wasm_record::record::MAP_EVERY == bags::MAP_EVERY);

/// Bytes on their way.
#[derive(Clone, Default)]
struct Pipe(Rc<RefCell<Vec<u8>>>);

impl Write for Pipe {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A recording that grows.
pub(crate) struct Mcap {
    recorder: Recorder<Pipe>,
    pipe: Pipe,
    /// How many it has.
    pub(crate) frames: usize,
}

impl Mcap {
    pub(crate) fn new(rig: &Rig) -> Result<Self, Error> {
        let pipe = Pipe::default();
        Ok(Self { recorder: Recorder::new(pipe.clone(), rig)?, pipe, frames: 0 })
    }

    /// Adds a frame, with the map where one is due; what is there since the call before.
    pub(crate) fn frame(
        &mut self,
        pose: &Stamped,
        jpeg: &[u8],
        map: Option<&[MapPoint]>,
    ) -> Result<Vec<u8>, Error> {
        self.recorder.frame(pose, jpeg)?;
        if let Some(map) = map {
            self.recorder.map(pose.time, map)?;
        }
        self.frames += 1;
        Ok(self.pipe.0.take())
    }

    /// Adds the last map; the rest of the file.
    pub(crate) fn end(mut self, time: f64, map: &[MapPoint]) -> Result<Vec<u8>, Error> {
        self.recorder.map(time, map)?;
        self.recorder.finish()?;
        Ok(self.pipe.0.take())
    }
}
