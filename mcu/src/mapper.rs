//! The pipeline as the device's engine, in static memory.
//!
//! | memory, 320 × 240 and 32 landmarks | bytes |
//! |---|---|
//! | line buffers, masks, edge points | [`Arrays`]' `words`, `masks`, `points` |
//! | state, covariance, landmarks' records | `numbers`, `landmarks` |
//!
//! A state on its way in or out is put together in the memory of the line buffers.
//!
//! A region of interest smaller than the picture is continued by its border rows and columns, where there are no edges
//! then, so that the extractor sees the camera that it was configured for.
use crate::{
    Device, Engine,
    engine::{Estimate, Limits, NotTaken},
    meter::Stage,
};
use core::mem::MaybeUninit;
use monorange_core::{
    Error,
    lines::{self, EdgePoint, Extraction, mask_words, point_count, row_words},
    pipeline::{self, Config, Lent, Memory, Pipeline, Report, state_len},
    slam::{self, packed_len, states_for, storage_len},
};
use monorange_protocol::{conversion, message::*};
use nalgebra::{Matrix2, Vector2};

const WIDTH: usize = 320;
const HEIGHT: usize = 240;
const LANDMARKS: usize = 32;
const STATES: usize = states_for(LANDMARKS, true);
/// A configuration's fingerprint, before the state that was saved under it.
const FINGERPRINT: usize = 4;
const STATE_BYTES: usize = FINGERPRINT + state_len(STATES, LANDMARKS);
const _: () = assert!(STATE_BYTES <= 2 * row_words(WIDTH, HEIGHT));

/// All that depends on the size of picture and map: a board keeps one in a static.
#[derive(Debug)]
pub struct Arrays {
    words: [u16; row_words(WIDTH, HEIGHT)],
    masks: [u32; mask_words(WIDTH)],
    points: heapless::Vec<EdgePoint, { point_count(WIDTH, HEIGHT) }>,
    extraction: Extraction,
    numbers: [f32; storage_len(STATES)],
    landmarks: heapless::Vec<slam::Landmark<f32>, LANDMARKS>,
}

impl Default for Arrays {
    fn default() -> Self {
        Self::new()
    }
}

impl Arrays {
    /// All zero, so that it takes no room in flash.
    pub const fn new() -> Self {
        Self {
            words: [0; row_words(WIDTH, HEIGHT)],
            masks: [0; mask_words(WIDTH)],
            points: heapless::Vec::new(),
            extraction: Extraction::zero(),
            numbers: [0.0; storage_len(STATES)],
            landmarks: heapless::Vec::new(),
        }
    }
}

/// The engine: a [`Pipeline`], once it is configured.
pub struct Mapper {
    pipeline: Option<Pipeline<Lent>>,
    /// The pipeline's memory before the first configuration.
    memory: Option<Memory<Lent>>,
    /// Without corners after a picture that was given up.
    report: Report,
    binning: u8,
    fingerprint: u32,
    picture: Option<FrameBegin>,
    rows: usize,
    /// A row of a region of interest, made as wide as the picture.
    line: [u8; WIDTH],
}

impl Device<Mapper> {
    /// A device that was just started, in memory for good. Not inlined, so that its way through the stack ends before the main
    /// loop begins.
    #[inline(never)]
    pub fn in_place(place: &'static mut MaybeUninit<Self>, arrays: &'static mut Arrays) -> &'static mut Self {
        place.write(Self::new(Mapper::new(arrays)))
    }
}

impl Mapper {
    /// An engine without a configuration.
    pub fn new(arrays: &'static mut Arrays) -> Self {
        let Arrays { words, masks, points, extraction, numbers, landmarks } = arrays;
        // Neither fails: the lengths are the capacities.
        let _ = points.resize(points.capacity(), EdgePoint::default());
        let _ = landmarks.resize(landmarks.capacity(), slam::Landmark::default());
        let (points, landmarks) = (points.as_mut_slice(), landmarks.as_mut_slice());
        let memory = Memory {
            words: words.as_mut_slice(),
            masks: masks.as_mut_slice(),
            points,
            extraction,
            numbers: numbers.as_mut_slice(),
            landmarks,
        };
        Self {
            pipeline: None,
            memory: Some(memory),
            report: Report::default(),
            binning: 1,
            fingerprint: 0,
            picture: None,
            rows: 0,
            line: [0; WIDTH],
        }
    }

    /// The pipeline, once it is configured.
    pub fn pipeline(&self) -> Option<&Pipeline<Lent>> {
        self.pipeline.as_ref()
    }

    /// A fresh pipeline in the memory of the old one. Each step is a function of its own, so that its copies of a pipeline are
    /// not on the stack together.
    fn build(&mut self, config: &Config) -> Result<(), Error> {
        self.report.corners.clear();
        self.picture = None;
        self.reclaim();
        self.construct(config)
    }

    #[inline(never)]
    fn reclaim(&mut self) {
        if let Some(old) = self.pipeline.take() {
            self.memory = Some(old.into_memory());
        }
    }

    #[inline(never)]
    fn construct(&mut self, config: &Config) -> Result<(), Error> {
        let memory = self.memory.take().ok_or(Error::Size { name: "memory", got: 0, expected: 1 })?;
        self.pipeline = Some(Pipeline::new(*config, memory)?);
        Ok(())
    }

    /// Width and height of the camera's pictures.
    fn size(&self) -> (usize, usize) {
        let camera = self.pipeline.as_ref().map(|pipeline| pipeline.config().finder.camera());
        camera.map_or((0, 0), |camera| (camera.width(), camera.height()))
    }

    /// Repeats the last row of a region of interest `times` times.
    fn push_line(&mut self, times: usize) {
        let (line, width) = (self.line, self.size().0);
        (0..times).for_each(|_| self.push(line.get(..width).unwrap_or_default()));
    }

    /// One row of the camera's width.
    #[inline(never)]
    fn push(&mut self, pixels: &[u8]) {
        if let Some(pipeline) = &mut self.pipeline {
            // Width and number have been checked when the picture began.
            let _ = pipeline.push_row(pixels);
        }
        self.rows += 1;
    }
}

/// Not inlined: the work is on the stack while nothing else is.
#[inline(never)]
fn restore(pipeline: &mut Pipeline<Lent>, length: usize) -> Result<(), Error> {
    pipeline.restore_from_scratch(length, &mut [0.0; packed_len(STATES)])
}

fn at_most(name: &'static str, got: usize, expected: usize) -> Result<(), Error> {
    if got <= expected { Ok(()) } else { Err(Error::Size { name, got, expected }) }
}

impl Engine for Mapper {
    const LIMITS: Limits = Limits {
        width: WIDTH as u16,
        height: HEIGHT as u16,
        landmarks: LANDMARKS as u16,
        corners: MAX_CORNERS as u16,
        state_bytes: STATE_BYTES as u32,
    };

    fn configure(&mut self, configuration: &Configure) -> Result<(), Error> {
        let binning = configuration.binning;
        if !(1..=2).contains(&binning) {
            return Err(Error::OutOfRange { name: "binning", value: binning.into(), expected: "1 or 2" });
        }
        // Everything is checked before the old pipeline gives its memory up.
        let config = conversion::config_from_message(configuration)?;
        config.validated()?;
        config.needs_no_features()?;
        let camera = config.finder.camera();
        at_most("camera.width", camera.width(), WIDTH)?;
        at_most("camera.height", camera.height(), HEIGHT)?;
        self.build(&config)?;
        self.binning = binning;
        self.fingerprint = conversion::fingerprint(&config);
        Ok(())
    }

    fn is_configured(&self) -> bool {
        self.pipeline.is_some()
    }

    fn reset(&mut self) {
        if let Some(config) = self.pipeline.as_ref().map(|pipeline| *pipeline.config()) {
            // It was good before.
            let _ = self.build(&config);
        }
    }

    fn odometry(&mut self, odometry: &Odometry) -> Result<(), Error> {
        let Some(pipeline) = &mut self.pipeline else { return Ok(()) };
        let time = conversion::seconds_from_us(odometry.until_us);
        pipeline.odometry(time, &conversion::odometry_from_message(odometry))
    }

    fn attitude(&mut self, attitude: &Attitude) -> Result<(), Error> {
        let Some(pipeline) = &mut self.pipeline else { return Ok(()) };
        pipeline.attitude(attitude.pitch, attitude.roll, attitude.std)
    }

    fn begin(&mut self, picture: &FrameBegin) -> Result<(), Error> {
        let Some(pipeline) = &mut self.pipeline else { return Ok(()) };
        let camera = pipeline.config().finder.camera();
        let FrameBegin { left, top, width, height, .. } = *picture;
        if width == 0 || height == 0 {
            return Err(Error::Size { name: "picture", got: 0, expected: 1 });
        }
        at_most("picture.width", usize::from(left) + usize::from(width), camera.width())?;
        at_most("picture.height", usize::from(top) + usize::from(height), camera.height())?;
        pipeline.begin();
        self.report.corners.clear();
        self.picture = Some(*picture);
        self.rows = 0;
        Ok(())
    }

    fn row(&mut self, pixels: &[u8]) {
        let Some(picture) = self.picture else { return };
        let (width, height) = self.size();
        if (usize::from(picture.width), usize::from(picture.height)) == (width, height) {
            return self.push(pixels);
        }
        let left = usize::from(picture.left);
        let (Some(first), Some(last)) = (pixels.first(), pixels.last()) else { return };
        self.line.fill(*last);
        if let Some(part) = self.line.get_mut(..left) {
            part.fill(*first);
        }
        if let Some(part) = self.line.get_mut(left..left + pixels.len()) {
            part.copy_from_slice(pixels);
        }
        let above = if self.rows == 0 { usize::from(picture.top) } else { 0 };
        self.push_line(above + 1);
    }

    fn end(&mut self, mut lap: impl FnMut(Stage)) {
        let Some(picture) = self.picture.take() else { return };
        let below = self.size().1.saturating_sub(self.rows);
        self.push_line(below);
        lap(Stage::Rows);
        let Some(pipeline) = &mut self.pipeline else { return };
        let ended = |stage| match stage {
            pipeline::Stage::Corners => lap(Stage::Corners),
            pipeline::Stage::Filter => lap(Stage::Filter),
            pipeline::Stage::Rows | pipeline::Stage::Motion => {}
        };
        let time = conversion::seconds_from_us(picture.time_us);
        if pipeline.finish_into(time, &mut self.report, ended).is_err() {
            self.report.corners.clear();
        }
    }

    fn abandon(&mut self) {
        self.picture = None;
        self.report.corners.clear();
    }

    fn corners(&mut self, corners: &Corners) {
        let Some(pipeline) = &mut self.pipeline else { return };
        let binning = self.binning;
        let area = f32::from(binning) * f32::from(binning);
        let found = corners.corners.iter().map(|corner| {
            let [u, v] = corner.pixel.map(|at| conversion::sent_from_camera(at, binning));
            let [var_u, cov_uv, var_v] = corner.covariance.map(|value| value / area);
            let covariance = Matrix2::new(var_u, cov_uv, cov_uv, var_v);
            let (pixel, [brighter_right, brighter_below]) = (Vector2::new(u, v), corner.brighter);
            lines::Corner { pixel, covariance, brighter_right, brighter_below, ..Default::default() }
        });
        let found: heapless::Vec<lines::Corner, MAX_CORNERS> = found.collect();
        let time = conversion::seconds_from_us(corners.time_us);
        if pipeline.observe_into(time, &found, &mut self.report).is_err() {
            self.report.corners.clear();
        }
    }

    fn estimate(&self) -> Estimate {
        let Some(filter) = self.pipeline.as_ref().map(Pipeline::filter) else { return Estimate::default() };
        let (pose, p) = (filter.pose(), filter.pose_covariance());
        Estimate {
            position: [pose.x, pose.y],
            heading: pose.heading,
            covariance: [p.m11, p.m12, p.m13, p.m22, p.m23, p.m33],
        }
    }

    fn observations(&self) -> impl ExactSizeIterator<Item = Observation> {
        self.report.corners.iter().map(|corner| conversion::observation_from_corner(corner, self.binning))
    }

    fn landmarks(&self) -> impl ExactSizeIterator<Item = Landmark> {
        let filter = self.pipeline.as_ref().map(Pipeline::filter);
        let records = filter.map_or(&[][..], slam::Filter::landmarks);
        let told = move |record| filter.map(|filter| conversion::landmark_from_filter(filter, record));
        records.iter().map(move |record| told(record).unwrap_or_default())
    }

    fn save(&mut self) -> &[u8] {
        let Some(pipeline) = &mut self.pipeline else { return &[] };
        let length = pipeline.save_to_scratch().map_or(0, <[u8]>::len);
        let Some(whole) = pipeline.scratch().get_mut(..length + FINGERPRINT).filter(|_| length > 0) else {
            return &[];
        };
        whole.copy_within(..length, FINGERPRINT);
        if let Some(place) = whole.first_chunk_mut() {
            *place = self.fingerprint.to_le_bytes();
        }
        whole
    }

    fn staging(&mut self) -> &mut [u8] {
        self.pipeline.as_mut().map(Pipeline::scratch).unwrap_or_default()
    }

    fn restore(&mut self, length: usize) -> Result<(), NotTaken> {
        let pipeline = self.pipeline.as_mut().ok_or(NotTaken::NoState)?;
        let whole = pipeline.scratch().get_mut(..length).ok_or(NotTaken::NoState)?;
        let fingerprint = *whole.first_chunk().ok_or(NotTaken::NoState)?;
        if u32::from_le_bytes(fingerprint) != self.fingerprint {
            return Err(NotTaken::OtherConfiguration);
        }
        whole.copy_within(FINGERPRINT.., 0);
        self.report.corners.clear();
        restore(pipeline, length - FINGERPRINT).map_err(|_| NotTaken::NoState)
    }

    fn range(&self, spot: &Spot, std_px: f32) -> Option<Ranged> {
        let pipeline = self.pipeline.as_ref()?;
        Some(conversion::range_of_spot(pipeline, spot, std_px, self.binning))
    }
}
