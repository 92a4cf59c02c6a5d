use super::schemas::{full_name, layout};
use crate::{
    Error, Result,
    files::{MapPoint, Rig, Stamped},
    pictures::Picture,
};
use mcap::{WriteOptions, records::MessageHeader, write::NoSeek};
use monorange_core::geometry::{Camera, Lens};
use monorange_core::scan::{Kind, Reading, ScanConfig};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use re_cdr::{CdrWriter, LittleEndian};
use std::{collections::BTreeMap, io::Write};

type Body<'a> = CdrWriter<'a, LittleEndian>;

/// Topic and type of everything that is written, in the order of [`Topic`].
const TOPICS: [(&str, &str); 8] = [
    ("/monorange/odometry", "nav_msgs/Odometry"),
    ("/monorange/pose", "geometry_msgs/PoseWithCovarianceStamped"),
    ("/monorange/map", "sensor_msgs/PointCloud2"),
    ("/monorange/scan", "sensor_msgs/LaserScan"),
    ("/monorange/overlay/compressed", "sensor_msgs/CompressedImage"),
    ("/monorange/camera_info", "sensor_msgs/CameraInfo"),
    ("/tf", "tf2_msgs/TFMessage"),
    ("/tf_static", "tf2_msgs/TFMessage"),
];
#[derive(Clone, Copy)]
enum Topic {
    Odometry,
    Pose,
    Map,
    Scan,
    Overlay,
    CameraInfo,
    Moving,
    Fixed,
}

/// Seconds of the drive from a map to the next, where a run is recorded.
pub const MAP_EVERY: f64 = 1.0;

const WORLD: &str = "map";
const ROBOT: &str = "base_link";
/// The point of the floor under the lens.
const SCANNER: &str = "scan_origin";
const CAMERA: &str = "camera_optical_frame";

/// Writes a run as an MCAP file of ROS 2's messages.
///
/// | topic | what |
/// |---|---|
/// | `/monorange/odometry` | `nav_msgs/Odometry`: pose of `base_link` in `map`, speeds since the frame before |
/// | `/monorange/pose` | `geometry_msgs/PoseWithCovarianceStamped` |
/// | `/monorange/map` | `sensor_msgs/PointCloud2`: `x`, `y`, `z`, `id`, `sigma` (the larger standard deviation, m) |
/// | `/monorange/scan` | `sensor_msgs/LaserScan` in `scan_origin`, the point of the floor under the lens: the virtual scan, a beam a bearing; ranges by REP 117: `+inf` where the floor is free as far as is looked at, not a number where nothing is certain; `intensities` is `free`, m: the floor is seen clear up to there |
/// | `/monorange/overlay/compressed` | `sensor_msgs/CompressedImage`: JPEG with lines, corners, grid and horizon |
/// | `/monorange/camera_info`, `/tf`, `/tf_static` | the camera of the overlay's size, the robot's pose and the mount |
pub struct Recorder<W: Write> {
    writer: mcap::Writer<NoSeek<W>>,
    channels: Vec<u16>,
    camera: Camera<f64>,
    /// Its height above the floor, m.
    camera_height: f32,
    /// Its message for the overlays, after the header.
    camera_info: Vec<u8>,
    fixed: Vec<u8>,
    last: Option<Stamped>,
    sequence: u32,
}

impl<W: Write> Recorder<W> {
    /// A recording of what a rig's camera sees.
    ///
    /// # Errors
    /// When nothing can be written.
    pub fn new(out: W, rig: &Rig) -> Result<Self> {
        let options = WriteOptions::new()
            .compression(None)
            .disable_seeking(true)
            .profile("ros2")
            .library(concat!("monorange ", env!("CARGO_PKG_VERSION")));
        let mut writer = options.create(NoSeek::new(out)).map_err(unwritten)?;
        let mut channels = Vec::new();
        for (topic, kind) in TOPICS {
            let schema = writer.add_schema(&full_name(kind), "ros2msg", layout(kind).as_bytes());
            let channel = writer.add_channel(schema.map_err(unwritten)?, topic, "cdr", &BTreeMap::new());
            channels.push(channel.map_err(unwritten)?);
        }
        let turn = rig.finder.mount().robot_from_cam();
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
        let [height, _, _, _, forward, left] = rig.finder.mount().parameters();
        let mut fixed = Vec::new();
        let mut body = Body::new(&mut fixed);
        body.write_sequence_length(2);
        transform(&mut body, 0.0, ROBOT, SCANNER, [forward, left, 0.0], [0.0, 0.0, 0.0, 1.0]);
        transform(&mut body, 0.0, ROBOT, CAMERA, [forward, left, height], turn.coords.into());
        let (camera, camera_height) = (*rig.finder.camera(), height as f32);
        let (camera_info, last, sequence) = (Vec::new(), None, 0);
        Ok(Self { writer, channels, camera, camera_height, camera_info, fixed, last, sequence })
    }

    /// Adds the landmarks as they are at a time (s).
    ///
    /// # Errors
    /// When nothing can be written.
    pub fn map(&mut self, time: f64, points: &[MapPoint]) -> Result<()> {
        self.write(Topic::Map, time, |body| cloud(body, time, points))
    }

    /// Adds a pose, the picture with what was seen in it (JPEG), and its scan where there is one.
    ///
    /// # Errors
    /// When nothing can be written.
    pub fn frame(&mut self, pose: &Stamped, overlay: &[u8], scan: &[Reading]) -> Result<()> {
        let (time, half) = (pose.time, 0.5 * pose.pose.heading);
        let turn = [0.0, 0.0, libm::sin(half), libm::cos(half)];
        let place = [pose.pose.x, pose.pose.y, 0.0];
        if self.last.is_none() {
            let fixed = std::mem::take(&mut self.fixed);
            self.put(Topic::Fixed, time, &fixed)?;
        }
        let covariance = six_by_six(&pose.covariance.unwrap_or_default());
        self.write(Topic::Moving, time, |body| {
            body.write_sequence_length(1);
            transform(body, time, WORLD, ROBOT, place, turn);
        })?;
        let speeds = self.last.as_ref().map_or([0.0; 6], |last| speeds(last, pose));
        self.write(Topic::Odometry, time, |body| {
            header(body, time, WORLD);
            body.write_string(ROBOT);
            numbers(body, &place);
            numbers(body, &turn);
            numbers(body, &covariance);
            numbers(body, &speeds);
            numbers(body, &[0.0; 36]);
        })?;
        self.write(Topic::Pose, time, |body| {
            header(body, time, WORLD);
            numbers(body, &place);
            numbers(body, &turn);
            numbers(body, &covariance);
        })?;
        if let [first, .., last] = scan {
            let seconds = self.last.as_ref().map_or(0.0, |before| time - before.time);
            let reach = ScanConfig::default().reach * self.camera_height;
            self.write(Topic::Scan, time, |body| {
                header(body, time, SCANNER);
                laser_scan(body, [first.bearing, last.bearing], seconds as f32, reach, scan);
            })?;
        }
        self.write(Topic::Overlay, time, |body| {
            header(body, time, CAMERA);
            body.write_string("jpeg");
            body.write_bytes(overlay);
        })?;
        if self.camera_info.is_empty() {
            let width = Picture::size_of(overlay).map_or(0, |[width, _]| width);
            self.camera_info = camera_info(&self.camera, (width / self.camera.width()).max(1));
        }
        let camera_info = std::mem::take(&mut self.camera_info);
        self.write(Topic::CameraInfo, time, |body| {
            header(body, time, CAMERA);
            body.align(4);
            body.buffer_mut().extend_from_slice(&camera_info);
        })?;
        self.camera_info = camera_info;
        self.last = Some(*pose);
        Ok(())
    }

    /// Writes the file's end, and gives back what was written to.
    ///
    /// # Errors
    /// When nothing can be written.
    pub fn finish(mut self) -> Result<W> {
        self.writer.finish().map_err(unwritten)?;
        Ok(self.writer.into_inner().into_inner())
    }

    fn write(&mut self, topic: Topic, time: f64, content: impl FnOnce(&mut Body<'_>)) -> Result<()> {
        let mut data = Vec::new();
        content(&mut Body::new(&mut data));
        self.put(topic, time, &data)
    }

    /// `body` is a message without what says that it is little-endian CDR.
    fn put(&mut self, topic: Topic, time: f64, body: &[u8]) -> Result<()> {
        let channel_id = self.channels.get(topic as usize).copied().unwrap_or_default();
        let (seconds, nanoseconds) = stamp(time);
        let at = (i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds)).max(0) as u64;
        self.sequence += 1;
        let header = MessageHeader { channel_id, sequence: self.sequence, log_time: at, publish_time: at };
        let data = [&[0, 1, 0, 0], body].concat();
        self.writer.write_to_known_channel(&header, &data).map_err(unwritten)
    }
}

fn unwritten(error: mcap::McapError) -> Error {
    Error::new(format!("the recording cannot be written: {error}"))
}

/// Seconds as ROS 2 stamps them.
fn stamp(time: f64) -> (i32, u32) {
    let whole = time.floor();
    let nanoseconds = ((time - whole) * 1e9).round() as u32;
    match nanoseconds {
        1_000_000_000.. => (whole as i32 + 1, 0),
        nanoseconds => (whole as i32, nanoseconds),
    }
}

fn header(body: &mut Body<'_>, time: f64, frame: &str) {
    let (seconds, nanoseconds) = stamp(time);
    body.write_i32(seconds);
    body.write_u32(nanoseconds);
    body.write_string(frame);
}

fn numbers(body: &mut Body<'_>, numbers: &[f64]) {
    numbers.iter().for_each(|number| body.write_f64(*number));
}

fn transform(body: &mut Body<'_>, time: f64, parent: &str, child: &str, place: [f64; 3], turn: [f64; 4]) {
    header(body, time, parent);
    body.write_string(child);
    numbers(body, &place);
    numbers(body, &turn);
}

/// The covariance of (x, y, heading) among those of (x, y, z, about x, about y, about z).
fn six_by_six(plane: &Matrix3<f64>) -> [f64; 36] {
    let mut all = [0.0; 36];
    for (row, into_row) in [0, 1, 5].into_iter().enumerate() {
        for (column, into_column) in [0, 1, 5].into_iter().enumerate() {
            if let (Some(slot), Some(value)) =
                (all.get_mut(6 * into_row + into_column), plane.get((row, column)))
            {
                *slot = *value;
            }
        }
    }
    all
}

/// Forward, left and turning speed since the pose before, among those of three axes.
fn speeds(before: &Stamped, now: &Stamped) -> [f64; 6] {
    let seconds = now.time - before.time;
    if seconds <= 0.0 {
        return [0.0; 6];
    }
    let step = before.pose.inverse().compose(&now.pose);
    [step.x / seconds, step.y / seconds, 0.0, 0.0, 0.0, step.heading / seconds]
}

/// Landmarks as points: x, y, z, id and the larger standard deviation.
fn cloud(body: &mut Body<'_>, time: f64, points: &[MapPoint]) {
    const FIELDS: [(&str, u8); 5] = [("x", 7), ("y", 7), ("z", 7), ("id", 6), ("sigma", 7)];
    let step = 4 * FIELDS.len();
    header(body, time, WORLD);
    body.write_u32(1);
    body.write_u32(points.len() as u32);
    body.write_sequence_length(FIELDS.len());
    for (offset, (name, kind)) in (0..).step_by(4).zip(FIELDS) {
        body.write_string(name);
        body.write_u32(offset);
        body.write_u8(kind);
        body.write_u32(1);
    }
    body.write_bool(false);
    body.write_u32(step as u32);
    body.write_u32((step * points.len()) as u32);
    let mut data = Vec::new();
    for point in points {
        let sigma = point.covariance.map_or(0.0, |c| c.symmetric_eigenvalues().max().max(0.0).sqrt());
        let [x, y, sigma] =
            [point.position.x, point.position.y, sigma].map(|number| (number as f32).to_le_bytes());
        data.extend([x, y, [0; 4], (point.id as u32).to_le_bytes(), sigma].concat());
    }
    body.write_bytes(&data);
    body.write_bool(true);
}

/// A scan after its header: beams between two bearings, evenly, taken `seconds` after the scan before.
fn laser_scan(body: &mut Body<'_>, ends: [f32; 2], seconds: f32, reach: f32, scan: &[Reading]) {
    let [first, last] = ends;
    let range = |reading: &Reading| match reading.kind {
        Kind::Beyond => f32::INFINITY,
        _ => reading.range.unwrap_or(f32::NAN),
    };
    // What lies beyond `range_max` is passed over by readers: nothing that was measured may.
    let farthest = scan.iter().filter_map(|reading| reading.range).fold(reach, f32::max);
    let step = (last - first) / (scan.len() - 1) as f32;
    // All beams are of one picture: no time passes from one to the next.
    for number in [first, last, step, 0.0, seconds, 0.0, farthest] {
        body.write_f32(number);
    }
    for column in [range, |reading: &Reading| reading.free] {
        body.write_sequence_length(scan.len());
        scan.iter().for_each(|reading| body.write_f32(column(reading)));
    }
}

/// A camera_info after its header, which ends at a multiple of four bytes here, of pictures that are enlarged by a whole factor.
fn camera_info(camera: &Camera<f64>, factor: usize) -> Vec<u8> {
    let model = match camera.lens() {
        Lens::BrownConrady(_) => "plumb_bob",
        Lens::Rational { .. } => "rational_polynomial",
        Lens::Equidistant(_) => "equidistant",
    };
    let coefficients = camera.lens().coefficients();
    let enlarged = factor as f64;
    let [fu, fv] = <[f64; 2]>::from(camera.focal()).map(|focal| focal * enlarged);
    // Of the first pixel the middle is at 0, in both sizes.
    let [u0, v0] = <[f64; 2]>::from(camera.principal()).map(|place| (place + 0.5) * enlarged - 0.5);
    let shear = camera.skew() * fu;
    let mut data = Vec::new();
    // Where the header ends decides what is filled up: it is put in front, and taken off again.
    let mut body = Body::new(&mut data);
    header(&mut body, 0.0, CAMERA);
    body.align(4);
    let head = body.position();
    body.write_u32((camera.height() * factor) as u32);
    body.write_u32((camera.width() * factor) as u32);
    body.write_string(model);
    body.write_sequence_length(coefficients.len());
    numbers(&mut body, &coefficients);
    numbers(&mut body, &[fu, shear, u0, 0.0, fv, v0, 0.0, 0.0, 1.0]);
    numbers(&mut body, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    numbers(&mut body, &[fu, shear, u0, 0.0, 0.0, fv, v0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    (0..6).for_each(|_| body.write_u32(0)); // no binning, no window
    body.write_bool(false);
    data.split_off(head)
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorange_core::geometry::Pose;
    use re_cdr::CdrReader;
    use std::path::Path;

    const RIG: &str = "[camera]\nwidth = 64\nheight = 48\nfocal = [60.0, 60.0]\nprincipal = [31.5, 23.5]\n\
        [mount]\nheight = 0.4\ntilt_deg = 12.0\n";

    #[test]
    fn a_scan_is_written_beam_by_beam_and_what_is_free_or_unknown_has_no_range() {
        let beam = |bearing, free, range, kind| Reading { bearing, free, range, var_range: 0.01, kind };
        let scan = [
            beam(-0.2, 1.0, Some(1.25), Kind::Boundary),
            beam(-0.1, 7.5, None, Kind::Beyond),
            beam(0.0, 0.5, None, Kind::Unknown),
            beam(0.1, 8.0, Some(8.25), Kind::Obstacle),
        ];
        let mut recorder =
            Recorder::new(Vec::new(), &Rig::parse(Path::new("rig.toml"), RIG).unwrap()).unwrap();
        for (time, scan) in [(5.0, &scan[..]), (5.5, &scan[..]), (6.0, &[])] {
            let pose = Stamped { time, pose: Pose::default(), covariance: None };
            recorder.frame(&pose, &[], scan).unwrap();
        }
        let file = recorder.finish().unwrap();
        let messages = mcap::MessageStream::new(&file).unwrap().map(|message| message.unwrap());
        let scans: Vec<_> = messages.filter(|message| message.channel.topic == "/monorange/scan").collect();
        assert_eq!(
            scans.iter().map(|message| message.log_time).collect::<Vec<_>>(),
            [5_000_000_000, 5_500_000_000]
        );
        for (message, scan_time) in scans.iter().zip([0.0, 0.5]) {
            assert_eq!(message.channel.schema.as_ref().unwrap().name, "sensor_msgs/msg/LaserScan");
            let mut body = CdrReader::<LittleEndian>::new(&message.data[4..]);
            let stamp = (body.read_i32().unwrap(), body.read_u32().unwrap());
            assert_eq!((stamp.0, body.read_str().unwrap()), (5, "scan_origin"));
            let mut next = |count| -> Vec<f32> { (0..count).map(|_| body.read_f32().unwrap()).collect() };
            let (ends, step, times, limits) = (next(2), next(1), next(2), next(2));
            assert_eq!((ends, times, limits), (vec![-0.2, 0.1], vec![0.0, scan_time], vec![0.0, 8.25]));
            assert!((step[0] - 0.1).abs() < 1e-6, "{step:?}");
            let mut column = || -> Vec<f32> {
                let beams = body.read_sequence_length().unwrap();
                (0..beams).map(|_| body.read_f32().unwrap()).collect()
            };
            let (ranges, free) = (column(), column());
            assert_eq!((ranges[0], ranges[1], ranges[3]), (1.25, f32::INFINITY, 8.25));
            assert!(ranges[2].is_nan());
            assert_eq!(free, [1.0, 7.5, 0.5, 8.0]);
        }
    }
}
