use crate::{errors::value, pictures::grey, range_finder::RangeFinder};
use monorange_formats::files::Rig;
use monorange_protocol::{
    client::Client,
    conversion,
    message::{Answers, Attitude, Cause, DeviceMessage, FrameBegin, HostMessage, Motion, Odometry},
};
use numpy::PyReadonlyArray2;
use pyo3::{
    exceptions::{PyConnectionError, PyTimeoutError},
    prelude::*,
    types::{PyBytes, PyDict, PyList},
};
use std::{
    io::{self, Read, Write},
    time::Duration,
};

/// How long a read waits for bytes, s.
const READ_TIMEOUT: f64 = 0.005;

/// A line to the device that Python opened: a socket, a serial port, or anything with `read` and `write`.
struct Stream {
    object: Py<PyAny>,
    is_socket: bool,
}

impl Read for Stream {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        Python::attach(|py| {
            py.check_signals()?;
            let name = if self.is_socket { "recv" } else { "read" };
            let got = match self.object.bind(py).call_method1(name, (into.len(),)) {
                Ok(got) if got.is_none() => return Err(io::ErrorKind::WouldBlock.into()),
                Ok(got) => got,
                Err(error) if error.is_instance_of::<PyTimeoutError>(py) => {
                    return Err(io::ErrorKind::TimedOut.into());
                }
                Err(error) => return Err(io::Error::from(error)),
            };
            let bytes = got.cast::<PyBytes>().map_err(PyErr::from)?.as_bytes();
            match (bytes.len(), into.get_mut(..bytes.len())) {
                (0, _) if self.is_socket => Err(io::ErrorKind::UnexpectedEof.into()),
                // A serial port that has nothing within its time-out gives nothing.
                (0, _) => Err(io::ErrorKind::TimedOut.into()),
                (_, Some(slot)) => {
                    slot.copy_from_slice(bytes);
                    Ok(bytes.len())
                }
                _ => Err(io::Error::other("read gave more bytes than were asked for")),
            }
        })
    }
}

impl Write for Stream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        Python::attach(|py| {
            let name = if self.is_socket { "sendall" } else { "write" };
            self.object.bind(py).call_method1(name, (PyBytes::new(py, bytes),))?;
            Ok(bytes.len())
        })
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A co-processor on a serial line, by the protocol of `protocol/SPEC.md`.
#[pyclass(module = "monorange")]
pub(crate) struct Device {
    client: Client<Stream>,
    rig: Rig,
    frame: u32,
    motion: Vec<Odometry>,
    lean: Option<Attitude>,
}

#[pymethods]
impl Device {
    #[new]
    #[pyo3(signature = (stream, finder, *, patience = 10.0, nonce = 0))]
    fn new(
        py: Python<'_>,
        stream: Py<PyAny>,
        finder: &RangeFinder,
        patience: f64,
        nonce: u32,
    ) -> PyResult<Self> {
        if !(patience > 0.0 && patience < 1e6) {
            return Err(value("patience must be above 0 (s)"));
        }
        // Reads give up after a few milliseconds, so that the client can write again.
        let is_socket = stream.bind(py).hasattr("recv")?;
        if is_socket {
            stream.bind(py).call_method1("settimeout", (READ_TIMEOUT,))?;
        } else if stream.bind(py).hasattr("timeout")? {
            stream.bind(py).setattr("timeout", READ_TIMEOUT)?;
        }
        let stream = Stream { object: stream, is_socket };
        let rig = finder.rig.clone();
        let nonce = if nonce == 0 { std::process::id() | 1 << 31 } else { nonce };
        let configuration = conversion::message_from_config(
            &rig.on_a_device(),
            Answers { observations: true, map_every: 0, statistics_every: 0 },
        );
        let client = py.detach(|| -> io::Result<_> {
            let mut client = Client::new(stream, nonce, Duration::from_secs_f64(patience))?;
            client.wait_for(
                &mut |message| matches!(message, DeviceMessage::Info(info) if info.nonce == nonce),
            )?;
            client.send(&HostMessage::Configure(configuration), &mut |_| ())?;
            let mut refused = false;
            client.wait_for(&mut |message| {
                refused |=
                    matches!(message, DeviceMessage::Fault(fault) if fault.cause == Cause::Configuration);
                refused || matches!(message, DeviceMessage::Info(info) if info.configured)
            })?;
            match refused {
                true => {
                    Err(io::Error::new(io::ErrorKind::InvalidInput, "the device refuses the rig's settings"))
                }
                false => Ok(client),
            }
        });
        Ok(Self { client: client.map_err(lost)?, rig, frame: 0, motion: Vec::new(), lean: None })
    }

    /// What the wheels say from `start` to `end` (s): forward speed (m/s), turn rate (rad/s). Goes with the next picture.
    fn odometry(&mut self, start: f64, end: f64, v: f64, omega: f64) -> PyResult<()> {
        if !(end > start && start >= 0.0) {
            return Err(value("odometry needs an end after its start, and times from 0 on (s)"));
        }
        let motion = Motion::Velocity { speed: v as f32, turn: omega as f32 };
        self.motion.push(Odometry { until_us: microseconds(end), duration: (end - start) as f32, motion });
        Ok(())
    }

    /// How the robot leans when the next picture is taken (rad; nose down and left side up are positive), and the standard deviation of each
    /// angle. Goes with that picture.
    #[pyo3(signature = (pitch, roll, std = 0.003))]
    fn attitude(&mut self, pitch: f64, roll: f64, std: f64) -> PyResult<()> {
        if !(pitch.abs() <= 0.8 && roll.abs() <= 0.8 && (0.0..=0.8).contains(&std)) {
            return Err(value("pitch, roll and std are radians, of at most 0.8"));
        }
        self.lean = Some(Attitude { pitch: pitch as f32, roll: roll as f32, std: std as f32 });
        Ok(())
    }

    /// Sends a picture, and gives what the device says of it.
    fn picture<'py>(
        &mut self,
        py: Python<'py>,
        time: f64,
        picture: PyReadonlyArray2<'py, u8>,
    ) -> PyResult<Bound<'py, PyDict>> {
        if !(time.is_finite() && time >= 0.0) {
            return Err(value("time must be a number from 0 on (s)"));
        }
        let pixels = grey(&picture, &self.rig)?;
        let camera = self.rig.finder.camera();
        let [width, height] =
            [camera.width(), camera.height()].map(|size| u16::try_from(size).unwrap_or(u16::MAX));
        let begin =
            FrameBegin { frame: self.frame, time_us: microseconds(time), left: 0, top: 0, width, height };
        let motion = std::mem::take(&mut self.motion);
        let (lean, client) = (self.lean.take(), &mut self.client);
        let answer = py.detach(|| client.frame(&motion, lean, &begin, pixels)).map_err(lost)?;
        self.frame += 1;
        let step = PyDict::new(py);
        step.set_item("time", time)?;
        if let Some(pose) = answer.pose {
            let ([x, y], [xx, xy, xh, yy, yh, hh]) = (pose.position, pose.covariance);
            step.set_item("pose", [x, y, pose.heading])?;
            step.set_item("covariance", [[xx, xy, xh], [xy, yy, yh], [xh, yh, hh]])?;
            step.set_item("predicted_only", pose.predicted_only)?;
        }
        let corners = PyList::empty(py);
        for seen in &answer.observations {
            let corner = PyDict::new(py);
            corner.set_item("pixel", seen.pixel)?;
            corner.set_item("range", seen.range)?;
            corner.set_item("bearing", seen.bearing)?;
            corner.set_item("landmark", seen.landmark)?;
            corner.set_item("decision", format!("{:?}", seen.decision).to_lowercase())?;
            corner.set_item("nis", seen.nis)?;
            corners.append(corner)?;
        }
        step.set_item("corners", corners)?;
        let faults = answer.faults.iter().map(|fault| format!("{:?}", fault.cause)).collect::<Vec<_>>();
        step.set_item("faults", faults)?;
        step.set_item("restarted", answer.restarted)?;
        Ok(step)
    }

    /// The device's map: a list of landmarks.
    fn map<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let client = &mut self.client;
        let found = py.detach(|| client.map());
        let map = PyList::empty(py);
        for landmark in found.map_err(lost)?.iter().filter(|landmark| landmark.confirmed) {
            let point = PyDict::new(py);
            let [xx, xy, yy] = landmark.covariance;
            point.set_item("id", landmark.id)?;
            point.set_item("position", landmark.position)?;
            point.set_item("covariance", [[xx, xy], [xy, yy]])?;
            point.set_item("seen", landmark.seen)?;
            map.append(point)?;
        }
        Ok(map)
    }
}

fn microseconds(time: f64) -> u64 {
    (time * 1e6).round() as u64
}

/// What went wrong on the line.
fn lost(error: io::Error) -> PyErr {
    match error.kind() {
        io::ErrorKind::TimedOut => PyTimeoutError::new_err(format!("the device does not answer: {error}")),
        io::ErrorKind::InvalidInput => value(error),
        _ => PyConnectionError::new_err(error.to_string()),
    }
}
