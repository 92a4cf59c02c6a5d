//! The run as a recording of ROS 2, by the command line's recorder; its bytes are handed on as they come.
use monorange_core::geometry::Pose;
use monorange_core::image::Grey;
use monorange_core::scan::{ScanConfig, Scanner};
use monorange_formats::Error;
use monorange_formats::bags::{self, Recorder};
use monorange_formats::extraction::scanner;
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
    /// Where the camera sees any floor.
    scanner: Option<Box<Scanner>>,
    pipe: Pipe,
    /// How many it has.
    pub(crate) frames: usize,
}

impl Mcap {
    pub(crate) fn new(rig: &Rig) -> Result<Self, Error> {
        let pipe = Pipe::default();
        let (recorder, scanner) =
            (Recorder::new(pipe.clone(), rig)?, scanner(rig, ScanConfig::default()).ok());
        Ok(Self { recorder, scanner, pipe, frames: 0 })
    }

    /// Adds a frame, with its scan, and the map where one is due; what is there since the call before.
    pub(crate) fn frame(
        &mut self,
        pose: &Stamped,
        moved: Option<&Pose<f32>>,
        picture: Grey<'_>,
        jpeg: &[u8],
        map: Option<&[MapPoint]>,
    ) -> Result<Vec<u8>, Error> {
        let scan = match &mut self.scanner {
            Some(scanner) => {
                scanner.follow(moved);
                scanner.scan(picture).map_err(Error::new)?
            }
            None => &[],
        };
        self.recorder.frame(pose, jpeg, scan)?;
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
