//! `--mavlink`: what a flight controller or a ground station takes of a drive, as MAVLink 2 over UDP.
//!
//! MAVLink's frames have x ahead, y to the right and z down; ours have y to the left and z up. Of the six degrees of freedom of
//! ODOMETRY the robot has three: on a floor z, roll and pitch are zero, and certainly so.
use mavlink::{
    MavHeader, Message,
    dialects::common::{
        DISTANCE_SENSOR_DATA, HEARTBEAT_DATA, MavAutopilot, MavDistanceSensor, MavEstimatorType, MavFrame,
        MavMessage, MavSensorOrientation, MavState, MavType, OBSTACLE_DISTANCE_DATA, ODOMETRY_DATA,
    },
    write_v2_msg,
};
use monorange_core::{
    geometry::Pose,
    scan::{Kind, Reading, ScanConfig, Scanner},
};
use monorange_formats::{
    Error, Result,
    extraction::scanner,
    files::{Odometry, Rig},
    pictures::Picture,
};
use monorange_protocol::message;
use std::{
    net::{ToSocketAddrs, UdpSocket},
    time::{Duration, Instant},
};

/// Directions in one OBSTACLE_DISTANCE.
const DIRECTIONS: usize = 72;
/// As part of the vehicle (MAVLink's usual first system), and there its visual odometry.
const SYSTEM: u32 = 1;
const COMPONENT: u8 = 197;
/// Between two signs of life.
const HEARTBEAT: Duration = Duration::from_secs(1);
/// Distances that say something else than a distance.
const UNKNOWN: u16 = u16::MAX;
const FARTHEST: u16 = u16::MAX - 2;

/// Where the messages go: `udp:HOST:PORT`.
#[derive(Clone, Debug)]
pub(super) struct Address(String);

impl std::str::FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let given = text.strip_prefix("udp:").filter(|place| {
            place.rsplit_once(':').is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok())
        });
        given.map(|place| Self(place.to_owned())).ok_or_else(|| {
            "give udp:HOST:PORT, such as udp:127.0.0.1:14550 for a ground station on this machine".to_owned()
        })
    }
}

/// Sends what is known after each picture.
pub(super) struct Mavlink {
    socket: UdpSocket,
    sequence: u8,
    heartbeat: Option<Instant>,
    /// The virtual scan of the same pictures, on this computer.
    scanner: Box<Scanner>,
    /// Farthest that it looks, m.
    reach: f32,
    /// Frame, time (s) and pose of what was sent last.
    last: Option<(usize, f64, Pose<f32>)>,
    silent: bool,
}

impl Mavlink {
    /// Opens a socket.
    ///
    /// # Errors
    /// When the host is not known, or the camera sees no floor.
    pub(super) fn new(address: &Address, rig: &Rig) -> Result<Self> {
        let place = format!("--mavlink udp:{}", address.0);
        let named = |error: std::io::Error| Error::new(error).at(&place);
        let to = address.0.to_socket_addrs().map_err(named)?.next();
        let to = to.ok_or_else(|| Error::new("the host has no address").at(&place))?;
        let from = if to.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
        let socket = UdpSocket::bind(from).map_err(named)?;
        socket.set_broadcast(true).map_err(named)?;
        socket.connect(to).map_err(named)?;
        let config = ScanConfig { beams: DIRECTIONS, ..ScanConfig::default() };
        Ok(Self {
            socket,
            sequence: 0,
            heartbeat: None,
            scanner: scanner(rig, config)?,
            reach: config.reach * rig.finder.mount().height() as f32,
            last: None,
            silent: false,
        })
    }

    /// Sends what a frame says, once: frames that are played again are passed over.
    ///
    /// # Errors
    /// When the picture is none of this camera's.
    pub(super) fn frame(
        &mut self,
        frame: usize,
        time: f64,
        pose: &message::Pose,
        picture: &Picture,
        odometry: Option<&Odometry>,
    ) -> Result<()> {
        if self.last.is_some_and(|(last, ..)| frame <= last) {
            return Ok(());
        }
        if self.heartbeat.is_none_or(|last| last.elapsed() >= HEARTBEAT) {
            self.heartbeat = Some(Instant::now());
            self.send(&heartbeat());
        }
        let now = Pose::new(pose.position[0], pose.position[1], pose.heading);
        let speed = self.last.and_then(|(_, before, from)| speed(&from, &now, (time - before) as f32));
        self.send(&odometry_of(pose, speed));
        if let Some((_, before, _)) = self.last {
            self.scanner.follow(odometry.and_then(|odometry| odometry.motion(before, time)).as_ref());
        }
        self.last = Some((frame, time, now));
        let readings = self.scanner.scan(picture.grey()?).map_err(Error::new)?;
        let scan = (obstacles(readings, self.reach, pose.time_us), ahead(readings, self.reach, pose.time_us));
        self.send(&scan.0);
        if let Some(distance) = scan.1 {
            self.send(&distance);
        }
        Ok(())
    }

    /// Sends a message; that nobody listens is no fault of the drive's.
    fn send(&mut self, message: &MavMessage) {
        let header = MavHeader { system_id: SYSTEM, component_id: COMPONENT, sequence: self.sequence };
        self.sequence = self.sequence.wrapping_add(1);
        let mut packet = Vec::new();
        let written = write_v2_msg(&mut packet, header, message).is_ok();
        let sent = self.socket.send(&packet);
        let refused = sent.as_ref().is_err_and(|error| error.kind() == std::io::ErrorKind::ConnectionRefused);
        if let Err(error) = &sent
            && !refused
            && !self.silent
        {
            self.silent = true;
            Error::new(format!("--mavlink: {}: {error}", message.message_name())).warn();
        }
        debug_assert!(written, "a vector takes everything");
    }
}

fn heartbeat() -> MavMessage {
    MavMessage::HEARTBEAT(HEARTBEAT_DATA {
        mavtype: MavType::MAV_TYPE_ONBOARD_CONTROLLER,
        autopilot: MavAutopilot::MAV_AUTOPILOT_INVALID,
        system_status: MavState::MAV_STATE_ACTIVE,
        mavlink_version: 3,
        ..HEARTBEAT_DATA::DEFAULT
    })
}

/// Velocity ahead and to the left (m/s) and of the heading (rad/s) from one pose to the next, in the robot's frame half-way.
fn speed(from: &Pose<f32>, to: &Pose<f32>, dt: f32) -> Option<[f32; 3]> {
    let step = from.inverse().compose(to);
    let (sine, cosine) = libm::sincosf(0.5 * step.heading);
    let along = [step.x * cosine + step.y * sine, step.y * cosine - step.x * sine, step.heading];
    (dt > 0.0).then(|| along.map(|way| way / dt))
}

/// Where the robot is: x ahead and y to the right of where it began.
fn odometry_of(pose: &message::Pose, speed: Option<[f32; 3]>) -> MavMessage {
    let [xx, xy, xh, yy, yh, hh] = pose.covariance;
    let mut covariance = [0.0; 21];
    // Row by row of the upper triangle in x, y, z, roll, pitch, yaw; y and yaw change their signs.
    for (place, value) in [(0, xx), (1, -xy), (5, -xh), (6, yy), (10, yh), (20, hh)] {
        covariance[place] = value;
    }
    let (sine, cosine) = libm::sincosf(-0.5 * pose.heading);
    let [ahead, left, turn] = speed.unwrap_or_default();
    // The poses' difference says nothing of its own deviation.
    let mut of_speed = [0.0; 21];
    of_speed[0] = f32::NAN;
    MavMessage::ODOMETRY(ODOMETRY_DATA {
        time_usec: pose.time_us,
        x: pose.position[0],
        y: -pose.position[1],
        q: [cosine, 0.0, 0.0, sine],
        vx: ahead,
        vy: -left,
        yawspeed: -turn,
        pose_covariance: covariance,
        velocity_covariance: of_speed,
        frame_id: MavFrame::MAV_FRAME_LOCAL_FRD,
        child_frame_id: MavFrame::MAV_FRAME_BODY_FRD,
        reset_counter: pose.reset_count,
        estimator_type: MavEstimatorType::MAV_ESTIMATOR_TYPE_VISION,
        // 0 is unknown, 1 the worst.
        quality: i8::from(pose.predicted_only),
        ..ODOMETRY_DATA::DEFAULT
    })
}

/// How far it is in every direction that the camera sees, clockwise.
fn obstacles(readings: &[Reading], reach: f32, time_us: u64) -> MavMessage {
    let mut distances = [UNKNOWN; DIRECTIONS];
    let leftmost_first = |a: &&Reading, b: &&Reading| b.bearing.total_cmp(&a.bearing);
    let mut beams: Vec<_> = readings.iter().take(DIRECTIONS).collect();
    beams.sort_by(leftmost_first);
    for (distance, reading) in distances.iter_mut().zip(&beams) {
        *distance = centimetres(reading, reach);
    }
    let [left, right] = [beams.first(), beams.last()].map(|beam| beam.map_or(0.0, |beam| beam.bearing));
    MavMessage::OBSTACLE_DISTANCE(OBSTACLE_DISTANCE_DATA {
        time_usec: time_us,
        distances,
        min_distance: 0,
        max_distance: whole(reach),
        sensor_type: MavDistanceSensor::MAV_DISTANCE_SENSOR_UNKNOWN,
        increment_f: ((left - right) / (beams.len().max(2) - 1) as f32).to_degrees(),
        angle_offset: -left.to_degrees(),
        frame: MavFrame::MAV_FRAME_BODY_FRD,
        ..OBSTACLE_DISTANCE_DATA::DEFAULT
    })
}

/// How far it is straight ahead, where that is known.
fn ahead(readings: &[Reading], reach: f32, time_us: u64) -> Option<MavMessage> {
    let reading = readings.iter().min_by(|a, b| a.bearing.abs().total_cmp(&b.bearing.abs()))?;
    let distance = centimetres(reading, reach);
    let variance = reading.var_range * 1e4;
    (distance != UNKNOWN).then(|| {
        MavMessage::DISTANCE_SENSOR(DISTANCE_SENSOR_DATA {
            time_boot_ms: (time_us / 1000) as u32,
            min_distance: 0,
            max_distance: whole(reach),
            current_distance: distance,
            mavtype: MavDistanceSensor::MAV_DISTANCE_SENSOR_UNKNOWN,
            orientation: MavSensorOrientation::MAV_SENSOR_ROTATION_NONE,
            // In cm²; what does not fit is unknown.
            covariance: if reading.range.is_some() && variance < 254.5 {
                libm::ceilf(variance) as u8
            } else {
                u8::MAX
            },
            ..DISTANCE_SENSOR_DATA::DEFAULT
        })
    })
}

/// What a beam ends at; one more than the farthest where nothing is.
fn centimetres(reading: &Reading, reach: f32) -> u16 {
    match (reading.kind, reading.range) {
        (Kind::Unknown, _) => UNKNOWN,
        (_, Some(range)) => whole(range),
        (_, None) => whole(reach) + 1,
    }
}

fn whole(metres: f32) -> u16 {
    (libm::roundf(metres * 100.0) as u16).min(FARTHEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn left_becomes_right_in_pose_covariance_and_speed() {
        let pose = message::Pose {
            frame: 3,
            time_us: 1_500_000,
            position: [2.0, 0.5],
            heading: 0.6,
            covariance: [1.0, 0.1, 0.2, 2.0, 0.3, 3.0],
            reset_count: 0x21,
            predicted_only: false,
            landmarks: 0,
        };
        let MavMessage::ODOMETRY(sent) = odometry_of(&pose, Some([1.0, 0.25, 0.5])) else { unreachable!() };
        assert_eq!([sent.x, sent.y, sent.z], [2.0, -0.5, 0.0]);
        assert_eq!((sent.time_usec, sent.reset_counter, sent.quality), (1_500_000, 0x21, 0));
        let yaw = 2.0 * libm::atan2f(sent.q[3], sent.q[0]);
        assert!((yaw + 0.6).abs() < 1e-6, "{yaw}");
        assert_eq!([sent.vx, sent.vy, sent.yawspeed], [1.0, -0.25, -0.5]);
        let expected = [(0, 1.0), (1, -0.1), (5, -0.2), (6, 2.0), (10, 0.3), (20, 3.0)];
        for (place, value) in sent.pose_covariance.iter().enumerate() {
            let wanted = expected.iter().find(|(at, _)| *at == place).map_or(0.0, |(_, value)| *value);
            assert_eq!(*value, wanted, "element {place}");
        }
        assert!(sent.velocity_covariance[0].is_nan());
    }

    #[test]
    fn a_turn_on_the_spot_and_an_arc_have_the_speed_of_the_wheels() {
        let from = Pose::new(1.0, 2.0, 0.3);
        // An arc of 1 m/s and 0.5 rad/s, 0.2 s long.
        let (turn, radius) = (0.1_f32, 2.0_f32);
        let step = Pose::new(radius * turn.sin(), radius * (1.0 - turn.cos()), turn);
        let [ahead, left, rate] = speed(&from, &from.compose(&step), 0.2).unwrap();
        assert!((ahead - 1.0).abs() < 1e-3 && left.abs() < 1e-4 && (rate - 0.5).abs() < 1e-5);
        assert!(speed(&from, &from, 0.0).is_none());
    }

    fn beam(bearing: f32, kind: Kind, range: Option<f32>) -> Reading {
        Reading { bearing, free: 0.5, range, var_range: 0.01, kind }
    }

    #[test]
    fn obstacles_go_clockwise_and_the_unknown_is_never_free() {
        let readings = [
            beam(-0.3, Kind::Beyond, None),
            beam(-0.1, Kind::Unknown, None),
            beam(0.1, Kind::Obstacle, Some(1.234)),
            beam(0.3, Kind::Boundary, Some(3.0)),
        ];
        let MavMessage::OBSTACLE_DISTANCE(sent) = obstacles(&readings, 8.0, 7) else { unreachable!() };
        assert_eq!(sent.distances[..5], [300, 123, u16::MAX, 801, u16::MAX]);
        assert!((sent.angle_offset + 0.3_f32.to_degrees()).abs() < 1e-4, "to the left");
        assert!((sent.increment_f - 0.2_f32.to_degrees()).abs() < 1e-4);
        assert_eq!(sent.max_distance, 800);
    }

    #[test]
    fn straight_ahead_is_sent_where_it_is_known() {
        let known = [beam(-0.2, Kind::Unknown, None), beam(0.01, Kind::Boundary, Some(2.5))];
        let Some(MavMessage::DISTANCE_SENSOR(sent)) = ahead(&known, 8.0, 2_500_000) else { unreachable!() };
        assert_eq!((sent.current_distance, sent.covariance, sent.time_boot_ms), (250, 100, 2500));
        let unknown = [beam(-0.2, Kind::Boundary, Some(1.0)), beam(0.01, Kind::Unknown, None)];
        assert!(ahead(&unknown, 8.0, 0).is_none());
        assert!(ahead(&[], 8.0, 0).is_none());
    }

    #[test]
    fn an_address_is_a_host_and_a_port() {
        assert!("udp:127.0.0.1:14550".parse::<Address>().is_ok());
        assert!("udp:[::1]:14550".parse::<Address>().is_ok());
        for wrong in
            ["127.0.0.1:14550", "udp:14550", "udp::14550", "udp:host:port", "tcp:host:1", "udp:host:99999"]
        {
            assert!(wrong.parse::<Address>().unwrap_err().contains("udp:HOST:PORT"), "{wrong}");
        }
    }
}
