//! A whole sequence in a worker: files as the browser gives them, a video, or a camera go through the pipeline here.
//!
//! ```text
//! const session = await Session.open(files, fresh, readers)     text files read, pictures ordered, the first one decoded
//! session.info()                                                what there is, for the page
//! await session.run(number, rig, listener)                      every picture: decode, move, look, correct
//! session.cancel()                                              ends the run at the next picture
//! await session.picture(frame)                                  one picture for the screen, decoded anew
//! session.record()                                              the run, for the module that writes results
//! ```
//!
//! The browser decodes what it can (`createImageBitmap`, `OffscreenCanvas`); plain grey maps are read here, and rare
//! kinds by the module that has them, through [`readers::Readers`]. A picture is decoded when it is wanted and
//! forgotten when it was looked at, so that a long sequence takes no memory.
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

pub mod decode;
pub mod object;
pub mod readers;
pub mod run;
pub mod source;
pub mod stepper;

use crate::decode::{Picture, read_pixels};
use crate::readers::{JsInfo, JsRig, Layout, Listener, Readers, Shown, Source};
use crate::source::{Frame, Kept};
use crate::stepper::{Motion, Stepper};
use js_sys::{Array, Float32Array, Float64Array, Uint8Array};
use monorange_wasm_record::Record;
use std::cell::{Cell, RefCell};
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::ImageData;

/// Above this the motion is not looked for in the pictures: a browser has no room for their keypoints.
const MOST_PIXELS_FOR_MOTION: usize = 2_500_000;
/// Pictures of a camera that are kept; a minute or two.
const MOST_KEPT: usize = 3000;
/// No run.
const NONE: u32 = u32::MAX;

/// A picture's width and height.
type Size = (usize, usize);

/// A sequence, open.
#[wasm_bindgen]
pub struct Session {
    frames: RefCell<Vec<Frame>>,
    times: RefCell<Vec<f64>>,
    size: Cell<Size>,
    readers: Readers,
    /// What the files beside the pictures say; none for a camera.
    layout: Option<Layout>,
    name: String,
    notes: Vec<String>,
    /// Focal length of the first photograph and its standard deviation, pixels, where no rig says more.
    focal: Option<Vec<f64>>,
    /// The number of the run that may go on.
    running: Cell<u32>,
    record: RefCell<Record>,
    /// Looks at single pictures, beside the run.
    viewer: RefCell<Option<Stepper>>,
    live: RefCell<Option<Stepper>>,
}

#[wasm_bindgen]
impl Session {
    /// The sequence in these files, of which the first `fresh` have just been given and the rest were there before.
    ///
    /// # Errors
    /// A sentence, where they hold neither pictures nor a rig, or where one of them is wrong.
    pub async fn open(files: Vec<Source>, fresh: usize, readers: Readers) -> Result<Session, JsValue> {
        let layout = source::read_beside(&files, fresh, None, 0.0, &readers).await?;
        let frames = layout.frames().into_iter().filter_map(|index| files.get(index as usize));
        let frames: Vec<_> = frames.cloned().map(Frame::File).collect();
        let mut session = Self::new(frames, layout, readers);
        if !session.frames.borrow().is_empty() {
            session.size.set(session.first_size().await?);
            session.focal = session.first_focal().await;
        }
        session.check_size()?;
        if session.frames.borrow().len() > 1 && session.motion() == "none" {
            session.notes.push(
                "There is no odometry, and the pictures are too large to find the motion in them: the robot stands \
                 still. Make them smaller, or add odometry.csv."
                    .into(),
            );
        }
        Ok(session)
    }

    /// The sequence of a video, whose pictures only the page can decode: `fetch` gives one, by its number.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    #[allow(clippy::too_many_arguments)]
    #[wasm_bindgen(js_name = openVideo)]
    pub async fn open_video(
        name: String,
        count: usize,
        interval: f64,
        width: usize,
        height: usize,
        fetch: js_sys::Function,
        files: Vec<Source>,
        readers: Readers,
    ) -> Result<Session, JsValue> {
        let fresh = files.len();
        let layout = source::read_beside(&files, fresh, Some(count), interval, &readers).await?;
        let frame = |number| Frame::Video { name: name.clone(), number, fetch: fetch.clone() };
        let mut session = Self::new((0..count).map(frame).collect(), layout, readers);
        (session.name, session.size) = (name.clone(), Cell::new((width, height)));
        session.check_size()?;
        Ok(session)
    }

    /// A camera: its pictures come one by one, by [`live`](Self::live).
    ///
    /// # Errors
    /// A sentence that names the entry of the rig at fault.
    #[wasm_bindgen(js_name = openCamera)]
    pub fn open_camera(rig: &JsRig, readers: Readers) -> Result<Session, JsValue> {
        let size = Cell::new((rig.width() as usize, rig.height() as usize));
        let live = Stepper::new(rig, &readers, 0.0, Motion::Pictures)?.with_scan(rig, &readers);
        let record = Record { title: "camera".into(), unmeasured: Some(0), ..Record::default() };
        Ok(Session {
            frames: RefCell::default(),
            times: RefCell::default(),
            size,
            readers,
            layout: None,
            name: "Camera".into(),
            notes: Vec::new(),
            focal: None,
            running: Cell::new(NONE),
            record: RefCell::new(record),
            viewer: RefCell::default(),
            live: RefCell::new(Some(live)),
        })
    }

    /// What was opened.
    pub fn info(&self) -> JsInfo {
        let info = js_sys::Object::new();
        let (width, height) = self.size.get();
        let frames = self.frames.borrow();
        let names: Array = frames.iter().map(|frame| JsValue::from(frame.name())).collect();
        let layout = |get: fn(&Layout) -> JsValue| self.layout.as_ref().map_or(JsValue::NULL, get);
        let notes: Array = self.notes.iter().map(JsValue::from).collect();
        for note in self.layout.iter().flat_map(Layout::notes) {
            notes.push(&note.into());
        }
        let warnings: Array = self.layout.iter().flat_map(Layout::warnings).map(JsValue::from).collect();
        object::fill(
            &info,
            [
                ("name", self.name.as_str().into()),
                ("frames", names.into()),
                ("times", Float64Array::from(self.times.borrow().as_slice()).into()),
                ("width", (width as f64).into()),
                ("height", (height as f64).into()),
                ("rig", layout(Layout::rig)),
                (
                    "focal",
                    self.focal.as_deref().map_or(JsValue::NULL, |focal| Float64Array::from(focal).into()),
                ),
                ("truth", layout(Layout::truth)),
                ("laser", layout(Layout::laser)),
                ("motion", self.motion().into()),
                ("used", self.layout.as_ref().is_none_or(Layout::used).into()),
                ("brought", self.layout.as_ref().map(Layout::brought).unwrap_or_default().into()),
                ("notes", notes.into()),
                ("warnings", warnings.into()),
            ],
        );
        info.unchecked_into()
    }

    /// Sends every picture through the pipeline; whether the run came to its end. Results are handed over several
    /// times a second, with the newest picture. `number` tells runs apart: a later one ends this one.
    ///
    /// # Errors
    /// A sentence that names the entry of the rig at fault.
    pub async fn run(&self, number: u32, rig: JsRig, listener: Listener) -> Result<bool, JsValue> {
        self.running.set(number);
        let viewer = Stepper::new(&rig, &self.readers, 0.0, Motion::Nothing)?;
        *self.viewer.borrow_mut() = Some(viewer);
        run::run(self, number, &rig, &listener).await
    }

    /// Ends the run at its next picture.
    pub fn cancel(&self) {
        self.running.set(NONE);
    }

    /// The picture of a frame, for the screen, and the edge points in it.
    ///
    /// # Errors
    /// Why there is none, as the end of a sentence about the picture.
    pub async fn picture(&self, frame: usize) -> Result<Shown, JsValue> {
        let picture = self.decoded(frame).await?;
        let edges = self.viewer.borrow_mut().as_mut().and_then(|viewer| viewer.look(&picture));
        run::shown(&picture, edges).await
    }

    /// The grey pixels of a frame.
    ///
    /// # Errors
    /// As [`picture`](Self::picture).
    pub async fn grey(&self, frame: usize) -> Result<Uint8Array, JsValue> {
        Ok(Uint8Array::from(&*self.decoded(frame).await?.grey()))
    }

    /// Takes the next picture of a camera and gives its result; the picture is kept for another run.
    ///
    /// # Errors
    /// A sentence, where the camera is off.
    pub async fn live(&self, picture: ImageData, time: f64, index: usize) -> Result<JsValue, JsValue> {
        let pixels = read_pixels(&picture);
        let name = format!("live {}", index + 1);
        let answer = {
            let mut live = self.live.borrow_mut();
            let live = live.as_mut().ok_or("The camera is off.")?;
            let (result, used) = live.step(&Ok(pixels), index, &name, time, 0.0);
            let mut record = self.record.borrow_mut();
            record.frames = index + 1;
            stepper::note(&mut record, used);
            live.end(&mut record, &self.readers);
            object::fill(&result, [("edges", Float32Array::from(live.edges().as_slice()).into())]);
            result
        };
        if index < MOST_KEPT {
            let kept = decode::keep(&picture).await?;
            self.times.borrow_mut().push(time);
            self.frames.borrow_mut().push(Frame::Kept(Kept { name, picture: kept }));
        }
        Ok(answer.into())
    }

    /// The last run as bytes, for the module that writes results.
    ///
    /// # Errors
    /// Without memory.
    pub fn record(&self) -> Result<Vec<u8>, JsError> {
        Ok(self.record.borrow().to_bytes()?)
    }

    /// The text files that a report compares the run with, as the layout has them.
    #[wasm_bindgen(getter)]
    pub fn layout(&self) -> Option<Layout> {
        self.layout.clone()
    }
}

impl Session {
    fn new(frames: Vec<Frame>, layout: Layout, readers: Readers) -> Self {
        let title = layout.title();
        Self {
            times: RefCell::new(layout.times()),
            frames: RefCell::new(frames),
            size: Cell::new((0, 0)),
            readers,
            name: layout.name(),
            notes: Vec::new(),
            focal: None,
            layout: Some(layout),
            running: Cell::new(NONE),
            record: RefCell::new(Record { title, ..Record::default() }),
            viewer: RefCell::default(),
            live: RefCell::default(),
        }
    }

    /// Where the motion comes from.
    fn motion(&self) -> &'static str {
        let (width, height) = self.size.get();
        match &self.layout {
            Some(layout) if layout.wheels() => "odometry",
            None => "pictures",
            Some(_) if self.frames.borrow().len() > 1 && width * height <= MOST_PIXELS_FOR_MOTION => {
                "pictures"
            }
            Some(_) => "none",
        }
    }

    async fn decoded(&self, frame: usize) -> Result<Picture, JsValue> {
        let wanted = self.frames.borrow().get(frame).cloned();
        let wanted = wanted.ok_or_else(|| format!("There is no frame {}.", frame + 1))?;
        wanted.begin(&self.readers)?.finish(&self.readers).await
    }

    /// The size of the first picture that can be decoded.
    async fn first_size(&self) -> Result<Size, JsValue> {
        let mut problem = None;
        let tried = self.frames.borrow().len().min(20);
        for frame in 0..tried {
            match self.decoded(frame).await {
                Ok(picture) => return Ok((picture.width, picture.height)),
                Err(error) => {
                    let name = self.frames.borrow().get(frame).map(Frame::name).unwrap_or_default();
                    problem.get_or_insert_with(|| format!("{name}: {}.", object::words(&error)));
                }
            }
        }
        Err(object::error(&format!("No picture could be read. {}", problem.unwrap_or_default())))
    }

    /// What the first photograph says of its focal length, where no rig says more.
    async fn first_focal(&self) -> Option<Vec<f64>> {
        let first = self.frames.borrow().first().cloned();
        let (Some(Frame::File(file)), None) = (first, self.layout.as_ref()?.rig_size()) else { return None };
        let (width, height) = self.size.get();
        source::focal_of(&file, width as u32, height as u32, &self.readers).await
    }

    fn check_size(&self) -> Result<(), JsValue> {
        let Some(given) = self.layout.as_ref().and_then(Layout::rig_size) else { return Ok(()) };
        let (width, height) = self.size.get();
        let first = self.frames.borrow().first().map(Frame::name);
        let (Some(first), true) = (first, given.as_slice() != [width as u32, height as u32]) else {
            return Ok(());
        };
        let [w, h] = *given else { return Ok(()) };
        let source = self.layout.as_ref().map(Layout::rig_source).unwrap_or_default();
        Err(object::error(&format!(
            "The pictures are {width} × {height} ({first}), the camera of {source} {w} × {h}. Open pictures as they \
             were calibrated, or a rig for this size."
        )))
    }
}

/// Waits for a promise of the browser.
pub(crate) async fn wait(promise: js_sys::Promise) -> Result<JsValue, JsValue> {
    JsFuture::from(promise).await
}
