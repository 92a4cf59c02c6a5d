use crate::{errors::value, pictures::grey, range_finder::RangeFinder, results::make, scanner::Scanner};
use monorange_core::{
    geometry::Pose,
    image::Grey,
    pipeline::{Memory, Odometry, OnHeap, Pipeline},
    scan::ScanConfig,
};
use monorange_formats::{
    files::{Control, Rig, confirmed_map},
    report::Observation,
};
use nalgebra::Vector2;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;

/// Pose and map of a robot from its camera's pictures and its wheels.
///
/// Give what the wheels say up to a picture, then the picture. Settings (`[filter]`, `[association]`) come with
/// `RangeFinder.from_rig`.
///
/// Args:
///     finder: camera, mount and settings.
///     max_landmarks: that there is room for.
///     wheels: whether their readings are given; without them the pictures tell the motion.
///     scan: whether each step has a `Scan` of its picture too, put together with the pictures before by the motion between them.
#[pyclass(module = "monorange")]
pub(crate) struct Drive {
    rig: Rig,
    pipeline: Pipeline<OnHeap>,
    /// Time of the first picture or reading, at which the pipeline's clock begins.
    start: Option<f64>,
    /// Time of the last picture.
    last: Option<f64>,
    frames: usize,
    wheels: bool,
    scanner: Option<Scanner>,
    /// Pose at the last picture.
    before: Option<Pose<f32>>,
}

#[pymethods]
impl Drive {
    #[new]
    #[pyo3(signature = (finder, max_landmarks = 512, wheels = true, scan = false))]
    fn new(finder: &RangeFinder, max_landmarks: usize, wheels: bool, scan: bool) -> PyResult<Self> {
        let rig = finder.rig.clone();
        let camera = rig.finder.camera();
        let memory = Memory::on_heap(camera.width(), camera.height(), max_landmarks);
        let pipeline = Pipeline::new(rig.on_a_host(wheels), memory).map_err(value)?;
        let scanner = scan.then(|| Scanner::of_rig(rig.clone(), ScanConfig::default())).transpose()?;
        Ok(Self { rig, pipeline, start: None, last: None, frames: 0, wheels, scanner, before: None })
    }

    /// What the wheels say: forward speed (m/s) and turn rate (rad/s) from `start` to `end` (s).
    fn odometry(&mut self, start: f64, end: f64, v: f64, omega: f64) -> PyResult<()> {
        if !(end > start && start.is_finite() && end.is_finite() && v.is_finite() && omega.is_finite()) {
            return Err(value("odometry needs finite numbers and an end after its start (s)"));
        }
        let (begun, seconds) = (*self.start.get_or_insert(start), (end - start) as f32);
        let reading = Odometry::Velocity { v: v as f32, omega: omega as f32, seconds };
        self.pipeline.odometry(end - begun, &reading).map_err(value)?;
        if let Some(scanner) = &mut self.scanner {
            let velocity = Vector2::new(v, 0.0);
            let control = Control { velocity, turn_rate: omega, duration: end - start, unknown: [0.0; 2] };
            let (step, turn) = control.step();
            scanner.go(&Pose::new(step.x as f32, step.y as f32, turn as f32));
        }
        Ok(())
    }

    /// What the wheels say: a step forward and left (m) and its turn (rad), from `start` to `end` (s).
    fn increment(&mut self, start: f64, end: f64, forward: f64, left: f64, turn: f64) -> PyResult<()> {
        if !(end > start && [start, end, forward, left, turn].into_iter().all(f64::is_finite)) {
            return Err(value("odometry needs finite numbers and an end after its start (s)"));
        }
        let (begun, seconds) = (*self.start.get_or_insert(start), (end - start) as f32);
        let [forward, left, turn] = [forward, left, turn].map(|number| number as f32);
        self.pipeline
            .odometry(end - begun, &Odometry::Increment { forward, left, turn, seconds })
            .map_err(value)?;
        if let Some(scanner) = &mut self.scanner {
            scanner.go(&Pose::new(forward, left, turn));
        }
        Ok(())
    }

    /// How the robot leans when the next picture is taken, by an IMU.
    ///
    /// Args:
    ///     pitch: about its y axis, nose down is positive, rad.
    ///     roll: about its x axis, left side up is positive, rad.
    ///     std: standard deviation of each, rad.
    #[pyo3(signature = (pitch, roll, std = 0.003))]
    fn attitude(&mut self, pitch: f64, roll: f64, std: f64) -> PyResult<()> {
        self.pipeline.attitude(pitch as f32, roll as f32, std as f32).map_err(value)
    }

    /// Takes a picture, and gives where the robot is and what was seen.
    ///
    /// Args:
    ///     time: when it was taken, s; later than the one before.
    ///     picture: (height, width) uint8, contiguous; read without a copy.
    ///
    /// Returns:
    ///     Step: pose, covariance, corners, and the scan if it was asked for; the world is the robot's first pose.
    fn picture<'py>(
        &mut self,
        py: Python<'py>,
        time: f64,
        picture: PyReadonlyArray2<'py, u8>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if !time.is_finite() {
            return Err(value("time must be a finite number (s)"));
        }
        if let Some(last) = self.last
            && time <= last
        {
            return Err(value(format!("the picture's time {time} s is not after the last one's, {last} s")));
        }
        let pixels = grey(&picture, &self.rig)?;
        let camera = self.rig.finder.camera();
        let picture = Grey::new(pixels, camera.width(), camera.height()).map_err(value)?;
        let now = time - *self.start.get_or_insert(time);
        let pipeline = &mut self.pipeline;
        let report = py.detach(|| pipeline.step(now, picture)).map_err(value)?;
        let seen: Vec<_> =
            report.corners.iter().map(|corner| Observation::of_corner(time, self.frames, corner)).collect();
        self.frames += 1;
        self.last = Some(time);
        let before = self.before.replace(report.pose);
        let scan = match &mut self.scanner {
            Some(scanner) => {
                // Without wheels the pictures have told the motion.
                if let Some(before) = before.filter(|_| !self.wheels) {
                    scanner.go(&before.inverse().compose(&report.pose));
                }
                Some(scanner.look(py, picture)?)
            }
            None => None,
        };
        let (pose, covariance) = (report.pose, report.pose_covariance);
        let pose = PyArray1::from_slice(py, &[pose.x, pose.y, pose.heading].map(f64::from));
        let rows = covariance.transpose().iter().map(|number| f64::from(*number)).collect();
        let covariance = PyArray1::from_vec(py, rows).reshape([3, 3])?;
        let pixels = seen.iter().flat_map(|corner| corner.pixel.map_or([f32::NAN; 2], |pixel| pixel.into()));
        let pixels = PyArray1::from_vec(py, pixels.map(f64::from).collect()).reshape([seen.len(), 2])?;
        let column = |of: fn(&Observation) -> Option<f32>| {
            PyArray1::from_vec(py, seen.iter().map(|corner| of(corner).map_or(f64::NAN, f64::from)).collect())
        };
        let (range, bearing) = (column(|corner| corner.range), column(|corner| corner.bearing));
        let landmark =
            PyArray1::from_vec(py, seen.iter().map(|seen| seen.landmark.map_or(-1, i64::from)).collect());
        let decision: Vec<_> = seen.iter().map(|corner| corner.decision.as_str()).collect();
        let nis = column(|corner| corner.nis);
        make(py, "Step", (time, pose, covariance, pixels, range, bearing, landmark, decision, nis, scan))
    }

    /// The confirmed landmarks.
    ///
    /// Returns:
    ///     Map: ids (N,), positions (N, 2) in the world, m, and covariances (N, 2, 2), m^2.
    fn map<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let map = confirmed_map(self.pipeline.filter(), self.start.unwrap_or_default());
        let ids = map.iter().map(|point| point.id).collect();
        let places = map.iter().flat_map(|point| [point.position.x, point.position.y]).collect();
        let covariances = map
            .iter()
            .flat_map(|point| point.covariance.map_or([f64::NAN; 4], |c| [c.m11, c.m12, c.m21, c.m22]));
        let covariances = PyArray1::from_vec(py, covariances.collect());
        let places = PyArray1::from_vec(py, places).reshape([map.len(), 2])?;
        make(py, "Map", (PyArray1::from_vec(py, ids), places, covariances.reshape([map.len(), 2, 2])?))
    }

    /// The filter's opinion of itself, in a word.
    #[getter]
    fn verdict(&self) -> &'static str {
        match self.pipeline.health().measurements {
            0 => "unchecked",
            _ => self.pipeline.health().verdict().as_str(),
        }
    }

    /// Pictures so far.
    #[getter]
    fn frames(&self) -> usize {
        self.frames
    }
}
