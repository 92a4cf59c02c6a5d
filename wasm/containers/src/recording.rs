//! A recording of ROS 2 as the files of a folder: `000000.pgm …`, `times.txt`, `odometry.csv`, `rig.toml` with
//! `camera_info.yaml`. Read by the command line's reader, decoded by its decoders: `slam --bag` computes the same.
use crate::blob::BlobFile;
use monorange_formats::bags::{self, Choice, Reading};
use monorange_formats::files::memory;
use monorange_formats::warnings;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use wasm_bindgen::prelude::*;
use web_sys::Blob;

/// A recording, while it is read and after.
#[wasm_bindgen]
pub struct Recording {
    state: State,
    notes: Vec<String>,
    lent: Lent,
}

/// The files of a recording, lent to its reader under a folder of their own: one of the same name may be open too.
struct Lent {
    folder: String,
    paths: Vec<PathBuf>,
}

impl Lent {
    fn new(paths: Vec<String>, blobs: Vec<Blob>) -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let folder = format!("#{}/", COUNT.fetch_add(1, Ordering::Relaxed));
        let paths: Vec<_> = paths.into_iter().map(|path| PathBuf::from(format!("{folder}{path}"))).collect();
        for (path, blob) in paths.iter().zip(blobs) {
            let file = BlobFile::new(blob);
            memory::lend(path, file.length(), move |at, into| file.read(at, into));
        }
        Self { folder, paths }
    }

    /// Words about the files, by their own names.
    fn words(&self, words: &str) -> String {
        words.replace(&self.folder, "").replace("\n  help: ", ". To mend it: ").replace("\n    ", " ")
    }

    fn sentence(&self, error: &monorange_formats::Error) -> JsError {
        JsError::new(&self.words(&error.to_string()))
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        self.paths.iter().for_each(|path| memory::withdraw(path));
    }
}

enum State {
    Reading(Box<Reading>),
    Read(Box<bags::Recording>),
    Failed,
}

#[wasm_bindgen]
impl Recording {
    /// The recording at `path`: the file of that path, or the files of the folder of that path.
    ///
    /// # Errors
    /// A sentence, where they are no recording.
    #[wasm_bindgen(constructor)]
    pub fn begin(path: &str, paths: Vec<String>, blobs: Vec<Blob>) -> Result<Recording, JsError> {
        warnings::forget();
        let lent = Lent::new(paths, blobs);
        let reading = Reading::begin(Path::new(&format!("{}{path}", lent.folder)));
        let state = State::Reading(Box::new(reading.map_err(|error| lent.sentence(&error))?));
        Ok(Self { state, notes: Vec::new(), lent })
    }

    /// Reads about so many bytes more; whether there are others.
    ///
    /// # Errors
    /// A sentence, where the recording is damaged or holds no pictures.
    #[wasm_bindgen(js_name = goOn)]
    pub fn go_on(&mut self, bytes: f64) -> Result<bool, JsError> {
        let State::Reading(mut reading) = core::mem::replace(&mut self.state, State::Failed) else {
            return Ok(false);
        };
        let more = reading.go_on(bytes as u64).map_err(|error| self.lent.sentence(&error))?;
        self.state = match more {
            true => State::Reading(reading),
            false => {
                let choice = Choice { fullest: true, ..Choice::default() };
                let recording = bags::Recording::of(*reading, choice);
                State::Read(Box::new(recording.map_err(|error| self.lent.sentence(&error))?))
            }
        };
        Ok(more)
    }

    /// The part that is read, 0 to 1.
    #[wasm_bindgen(getter)]
    pub fn share(&self) -> f64 {
        match &self.state {
            State::Reading(reading) => reading.share(),
            _ => 1.0,
        }
    }

    /// Pictures.
    #[wasm_bindgen(getter)]
    pub fn frames(&self) -> usize {
        self.read().map_or(0, |recording| recording.frames.len())
    }

    /// A picture in grey, as a PGM file.
    ///
    /// # Errors
    /// The end of a sentence about the picture.
    pub fn picture(&self, frame: usize) -> Result<Vec<u8>, JsError> {
        let recording = self.read().ok_or_else(|| JsError::new("the recording was not read"))?;
        let frame = recording.frames.get(frame).ok_or_else(|| JsError::new("it is not there"))?;
        let picture = frame.read().map_err(|error| JsError::new(&sentence_of(&error, frame.name())))?;
        let mut file = format!("P5\n{} {}\n255\n", picture.width, picture.height).into_bytes();
        file.extend(picture.pixels);
        Ok(file)
    }

    /// `times.txt`.
    #[wasm_bindgen(getter)]
    pub fn times(&self) -> String {
        let times = self.read().into_iter().flat_map(|recording| &recording.times);
        times.map(|time| format!("{time:?}\n")).collect()
    }

    /// `odometry.csv`, where there is odometry.
    #[wasm_bindgen(getter)]
    pub fn wheels(&self) -> Option<String> {
        Some(self.read()?.wheels()?.to_owned())
    }

    /// `camera_info.yaml`, where there is one.
    #[wasm_bindgen(getter, js_name = cameraInfo)]
    pub fn camera_info(&self) -> Option<String> {
        Some(self.read()?.camera_info()?.to_owned())
    }

    /// `rig.toml`, where the camera and how it sits are known; a note says what is not.
    #[wasm_bindgen(getter)]
    pub fn rig(&mut self) -> Option<String> {
        let recording = self.read()?;
        let (note, rig) = match (recording.camera_info(), recording.rig_file()) {
            (Some(_), Ok(rig)) => return Some(rig),
            (None, _) => (String::from("The recording has no camera_info for its pictures."), None),
            (_, Err(error)) => {
                let said = self.lent.words(error.to_string().lines().next().unwrap_or_default());
                (format!("{said}."), None)
            }
        };
        self.notes.push(note);
        rig
    }

    /// Sentences about what was chosen and left out.
    #[wasm_bindgen(getter)]
    pub fn notes(&self) -> Vec<String> {
        let warnings = warnings::all().into_iter().map(|warning| format!("{}.", self.lent.words(&warning)));
        self.notes.iter().cloned().chain(warnings).collect()
    }
}

impl Recording {
    fn read(&self) -> Option<&bags::Recording> {
        match &self.state {
            State::Read(recording) => Some(recording),
            _ => None,
        }
    }
}

/// What an error says of a picture, without the picture's name, as the end of a sentence.
fn sentence_of(error: &monorange_formats::Error, name: &Path) -> String {
    let said = error.to_string();
    let said = said.lines().next().unwrap_or_default();
    said.strip_prefix(&format!("{}: ", name.display())).unwrap_or(said).to_owned()
}
