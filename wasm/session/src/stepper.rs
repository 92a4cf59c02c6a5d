//! The pipeline with a sequence's clock; a picture that cannot be used is a result that says so.
use crate::decode::{Picture, scope};
use crate::object;
use crate::readers::{JsResult, JsRig, Layout, Pipeline, Readers, Report, Scan, Watch};
use js_sys::Float32Array;
use monorange_core::geometry::Pose;
use monorange_core::scan::motion_in_run;
use monorange_wasm_record::record::readings_from_bytes;
use monorange_wasm_record::{Frame, MapPoint, Reading, Record, Verdict};
use std::cell::Cell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;

type Answer<T> = Result<T, JsValue>;

/// Where the motion comes from.
pub(crate) enum Motion {
    Wheels(Layout),
    Pictures,
    Nothing,
}

/// One run's pipeline.
pub(crate) struct Stepper {
    pipeline: Pipeline,
    watch: Watch,
    /// The virtual scan, where there is one.
    scan: Option<Scan>,
    motion: Motion,
    start: f64,
    /// The time up to which the robot was moved.
    reached: Cell<f64>,
    pose: [f32; 3],
    covariance: [f32; 6],
}

/// What the record keeps of a frame: a frame that was used, or why it was not.
pub(crate) enum Used {
    Frame {
        frame: Box<Frame>,
        landmarks: Vec<f32>,
        held: bool,
        knocked: bool,
        carried_by: usize,
        without_range: u32,
        no_room: u32,
    },
    No(String),
}

/// Puts a frame into the record.
pub(crate) fn note(record: &mut Record, used: Used) {
    match used {
        Used::No(reason) => record.left_out.push(reason),
        Used::Frame { frame, landmarks, held, knocked, carried_by, without_range, no_room } => {
            record.knocked.extend(knocked.then_some(frame.time));
            // Nothing can be carried into the first picture.
            let carried = record.carried.as_mut().filter(|_| !record.used.is_empty());
            if let Some(count) = carried.and_then(|counts| counts.get_mut(carried_by)) {
                *count += 1;
            }
            record.keep_map(frame.time, &landmarks);
            record.used.push(*frame);
            record.without_range += without_range;
            record.no_room += no_room;
            if let Some(unmeasured) = &mut record.unmeasured {
                *unmeasured += usize::from(held);
            }
        }
    }
}

pub(crate) fn now() -> f64 {
    scope().performance().map_or(0.0, |clock| clock.now())
}

impl Stepper {
    pub(crate) fn new(rig: &JsRig, readers: &Readers, start: f64, motion: Motion) -> Answer<Self> {
        let pipeline = readers.pipeline(rig, matches!(motion, Motion::Pictures))?;
        let watch = readers.watch();
        Ok(Self {
            pipeline,
            watch,
            scan: None,
            motion,
            start,
            reached: Cell::new(start),
            pose: [0.0; 3],
            covariance: [0.0; 6],
        })
    }

    /// With the virtual scan of every picture.
    pub(crate) fn with_scan(mut self, rig: &JsRig, readers: &Readers) -> Self {
        self.scan = readers.scan(rig);
        self
    }

    /// Sends a picture through the pipeline, or what is wrong with it past it.
    pub(crate) fn step(
        &mut self,
        picture: &core::result::Result<Picture, String>,
        index: usize,
        name: &str,
        time: f64,
        decode_ms: f64,
    ) -> (JsResult, Used) {
        let result: JsResult = js_sys::Object::new().unchecked_into();
        object::fill(&result, [("index", (index as f64).into()), ("name", name.into()), ("t", time.into())]);
        let outcome = match picture {
            Ok(picture) => self.process(picture, index, name, time, decode_ms),
            Err(reason) => Err(reason.clone()),
        };
        let (report, used) = match outcome {
            Ok((report, used)) => (report, used),
            Err(reason) => {
                let problem = format!("{name}: {reason}");
                object::fill(&result, [("problem", problem.as_str().into())]);
                (Seen::default(), Used::No(problem))
            }
        };
        let (held, stages) = match &used {
            Used::Frame { frame, held, .. } => (*held, frame.stages_ms),
            Used::No(_) => (false, [0.0; 5]),
        };
        let (verdict, reason) = match self.watch.froze() {
            true => (0, String::new()),
            false => (self.pipeline.verdict(), self.pipeline.reason()),
        };
        let array = |numbers: &[f32]| Float32Array::from(numbers).into();
        object::fill(
            &result,
            [
                ("pose", array(&self.pose)),
                ("covariance", array(&self.covariance)),
                ("corners", array(&report.corners)),
                ("predicted", array(&report.predicted)),
                ("lines", array(&report.lines)),
                ("landmarks", array(&report.landmarks)),
                ("beams", array(&report.beams)),
                ("nis", report.nis.into()),
                ("nisDegrees", report.nis_degrees.into()),
                ("motionHeld", held.into()),
                ("verdict", verdict.into()),
                ("reason", reason.into()),
                ("meanNis", self.pipeline.mean_nis().into()),
                ("stages", array(&stages)),
            ],
        );
        (result, used)
    }

    fn process(
        &mut self,
        picture: &Picture,
        index: usize,
        name: &str,
        time: f64,
        decode_ms: f64,
    ) -> core::result::Result<(Seen, Used), String> {
        let (width, height) = (self.pipeline.width(), self.pipeline.height());
        if (picture.width, picture.height) != (width, height) {
            return Err(format!(
                "it is {} × {}, the camera {width} × {height}",
                picture.width, picture.height
            ));
        }
        let begin = now();
        let grey = picture.grey();
        self.pipeline.load(&grey).map_err(|error| object::words(&error))?;
        let decoded = decode_ms + now() - begin;
        let before = pose_of(&self.pose);
        let (way, wheels) = match &self.motion {
            Motion::Wheels(layout) => {
                let motion = layout.motion(self.reached.get(), time);
                (layout.way(self.reached.get(), time), Some(motion.as_deref().and_then(pose_of)))
            }
            _ => (0.0, None),
        };
        self.watch.look(name, &grey, way);
        let (report, [edges, lines, motion, map]) = self
            .advance(time)
            .map_err(|error| format!("the filter refuses it: {}", object::words(&error)))?;
        let stages_ms = [decoded, edges, lines, motion, map].map(|ms| ms as f32);
        let numbers = |values: Vec<f32>| values.into_iter();
        fill_from(&mut self.pose, numbers(report.pose()));
        fill_from(&mut self.covariance, numbers(report.covariance()));
        let mut seen = Seen {
            corners: report.corners(),
            predicted: report.predicted(),
            lines: report.lines(),
            landmarks: report.landmarks(),
            beams: Vec::new(),
            nis: report.nis(),
            nis_degrees: report.nis_degrees(),
        };
        let moved = before.zip(pose_of(&self.pose));
        let moved = moved.and_then(|(before, now)| motion_in_run(wheels, report.held(), &before, &now));
        let moved = moved.map(|Pose { x, y, heading }| [x, y, heading]);
        if let Some(scan) = &self.scan {
            seen.beams = scan.look(&grey, moved.map(Vec::from)).unwrap_or_default();
        }
        let (pose, covariance, corners) = (self.pose, self.covariance, seen.corners.clone());
        let landmarks = seen.landmarks.clone();
        let used = Used::Frame {
            frame: Box::new(Frame { index, time, pose, covariance, moved, corners, stages_ms }),
            landmarks,
            held: report.held(),
            knocked: report.knocked(),
            carried_by: report.carried_by(),
            without_range: report.without_range(),
            no_room: report.no_room(),
        };
        report.free();
        Ok((seen, used))
    }

    /// The report, and how long rows, lines, motion and map took, in milliseconds.
    fn advance(&self, time: f64) -> Answer<(Report, [f64; 4])> {
        self.drive(time)?;
        let begin = now();
        self.pipeline.rows()?;
        let after_rows = now();
        let (report, ends) = {
            let ends = Rc::new(Cell::new([after_rows; 3]));
            let clock = ends.clone();
            let tell = Closure::<dyn FnMut(usize)>::new(move |stage: usize| {
                let mut ends = clock.get();
                for end in ends.iter_mut().skip(stage) {
                    *end = now();
                }
                clock.set(ends);
            });
            (self.pipeline.finish(time - self.start, tell.as_ref().unchecked_ref())?, ends.get())
        };
        let [lines, motion, map] = ends;
        Ok((report, [after_rows - begin, lines - after_rows, motion - lines, map - motion]))
    }

    /// Moves the robot to the time of the picture by its wheels.
    fn drive(&self, time: f64) -> Answer<()> {
        let from = self.reached.replace(time);
        let Motion::Wheels(layout) = &self.motion else { return Ok(()) };
        let mut at = from;
        for reading in readings_from_bytes(&layout.between(from, time)).unwrap_or_default() {
            match reading {
                Reading::Velocity { seconds, v, omega } => {
                    at += seconds;
                    self.pipeline.velocity(at - self.start, v, omega, seconds as f32)?;
                }
                Reading::Increment { seconds, forward, left, turn } => {
                    at += seconds;
                    self.pipeline.increment(at - self.start, forward, left, turn, seconds as f32)?;
                }
            }
        }
        Ok(())
    }

    /// The edge points of a picture; the map does not hear of it.
    pub(crate) fn look(&mut self, picture: &Picture) -> Option<Vec<f32>> {
        if (picture.width, picture.height) != (self.pipeline.width(), self.pipeline.height()) {
            return None;
        }
        self.pipeline.load(&picture.grey()).ok()?;
        self.pipeline.rows().ok()?;
        self.pipeline.lines().ok()?;
        Some(self.pipeline.edges())
    }

    /// Those of the last picture.
    pub(crate) fn edges(&self) -> Vec<f32> {
        self.pipeline.edges()
    }

    /// The counts of what carried corners, where a homography is to.
    pub(crate) fn carried(&self) -> Option<[usize; 3]> {
        self.pipeline.carries().then_some([0; 3])
    }

    /// Puts the map as it is now, and the verdict on it, into the record.
    pub(crate) fn end(&self, record: &mut Record, readers: &Readers) {
        record.map = self.pipeline.confirmed().chunks_exact(9).filter_map(map_point).collect();
        record.mean_nis = self.pipeline.mean_nis();
        (record.verdict, record.reason) = match (self.watch.judge(), self.pipeline.verdict()) {
            (false, 1) => (Verdict::Consistent, String::new()),
            (false, 2) => (Verdict::Doubtful, self.pipeline.reason()),
            (false, 3) => (Verdict::Lost, self.pipeline.reason()),
            _ => (Verdict::Unchecked, String::new()),
        };
        record.warnings = readers.warnings();
    }
}

impl Drop for Stepper {
    fn drop(&mut self) {
        self.pipeline.free();
        self.watch.free();
        self.scan.iter().for_each(Scan::free);
    }
}

/// What a picture brought, as rows of numbers; nothing by default.
#[derive(Default)]
struct Seen {
    corners: Vec<f32>,
    predicted: Vec<f32>,
    lines: Vec<f32>,
    landmarks: Vec<f32>,
    beams: Vec<f32>,
    nis: f32,
    nis_degrees: u32,
}

fn fill_from(into: &mut [f32], values: impl Iterator<Item = f32>) {
    for (into, value) in into.iter_mut().zip(values) {
        *into = value;
    }
}

/// As it is: wrapping again could change the last bit.
fn pose_of(numbers: &[f32]) -> Option<Pose<f32>> {
    let [x, y, heading] = *numbers else { return None };
    Some(Pose { x, y, heading })
}

fn map_point(row: &[f64]) -> Option<MapPoint> {
    let [id, x, y, var_x, cov_xy, var_y, seen, first, last] = *row else { return None };
    Some(MapPoint {
        id: id as u64,
        position: [x, y].map(|number| number as f32),
        covariance: [var_x, cov_xy, var_y].map(|number| number as f32),
        seen: seen as u64,
        times: [first, last],
    })
}
