//! A device on a bench: a fake engine that remembers what it was given, and a line to talk over.
pub(crate) mod faults;
pub(crate) mod wire;

use monorange_core::{
    Error,
    geometry::{Camera, Mount, RangeFinder},
    pipeline::Config,
};
use monorange_mcu::{Board, Device, Engine, Ring, WINDOW, Wish, engine::*, meter::Stage};
use monorange_protocol::{
    conversion::message_from_config,
    frame::{Deframer, LinkCounts, MAX_ENCODED},
    message::{
        Answers, Attitude, Cause, Configure, Corners, CostUnit, Credit, Decision, DeviceMessage, FrameBegin,
        FrameEnd, Hello, HostMessage, Landmark, Motion, Observation, Odometry, Pose, Ranged, Restarts, Rows,
        Sight, Spot, Statistics,
    },
};

/// Remembers motion as sums, and of the last picture a checksum and its rows.
#[derive(Debug, Default)]
pub(crate) struct Fake {
    configured: bool,
    pub(crate) moved: f32,
    pub(crate) leans: Vec<f32>,
    pub(crate) pictures: Vec<(u32, u32)>,
    pub(crate) abandoned: u32,
    picture: Option<(FrameBegin, Vec<u8>)>,
    staging: [u8; 16],
}

impl Engine for Fake {
    const LIMITS: Limits = Limits { width: 320, height: 240, landmarks: 32, corners: 32, state_bytes: 16 };

    fn configure(&mut self, configuration: &Configure) -> Result<(), Error> {
        if configuration.camera.width > 320 {
            return Err(Error::Size { name: "camera.width", got: 321, expected: 320 });
        }
        *self = Self { configured: true, ..Self::default() };
        Ok(())
    }
    fn is_configured(&self) -> bool {
        self.configured
    }
    fn reset(&mut self) {
        *self = Self { configured: self.configured, ..Self::default() };
    }
    fn odometry(&mut self, odometry: &Odometry) -> Result<(), Error> {
        let Motion::Velocity { speed, .. } = odometry.motion else { return Ok(()) };
        if !speed.is_finite() {
            return Err(Error::OutOfRange { name: "speed", value: speed.into(), expected: "finite" });
        }
        self.moved += odometry.duration * speed;
        Ok(())
    }
    fn attitude(&mut self, attitude: &Attitude) -> Result<(), Error> {
        if !attitude.pitch.is_finite() {
            return Err(Error::OutOfRange {
                name: "pitch",
                value: attitude.pitch.into(),
                expected: "finite",
            });
        }
        self.leans.push(attitude.pitch);
        Ok(())
    }
    fn begin(&mut self, picture: &FrameBegin) -> Result<(), Error> {
        assert!(self.picture.is_none(), "a picture begins within another");
        if picture.width > 320 || picture.height > 240 {
            return Err(Error::Size { name: "picture", got: usize::from(picture.width), expected: 320 });
        }
        self.picture = Some((*picture, vec![]));
        Ok(())
    }
    fn row(&mut self, pixels: &[u8]) {
        let (begin, rows) = self.picture.as_mut().expect("rows come within a picture");
        assert_eq!(pixels.len(), usize::from(begin.width));
        rows.extend(pixels);
    }
    fn end(&mut self, mut lap: impl FnMut(Stage)) {
        let (begin, rows) = self.picture.take().expect("an end follows a beginning");
        assert_eq!(rows.len(), usize::from(begin.width) * usize::from(begin.height), "every row came");
        self.pictures.push((begin.frame, monorange_protocol::frame::checksum(&rows)));
        lap(Stage::Corners);
    }
    fn abandon(&mut self) {
        self.picture = None;
        self.abandoned += 1;
    }
    fn corners(&mut self, corners: &Corners) {
        self.pictures.push((corners.frame, corners.corners.len() as u32));
    }
    fn estimate(&self) -> Estimate {
        Estimate { position: [self.moved, 0.0], ..Estimate::default() }
    }
    fn observations(&self) -> impl ExactSizeIterator<Item = Observation> {
        (0..30_u16).map(|number| Observation {
            pixel: [f32::from(number), 0.0],
            range: 1.0,
            bearing: 0.0,
            covariance: [0.0; 3],
            landmark: Some(u32::from(number)),
            decision: Decision::Update,
            nis: None,
        })
    }
    fn landmarks(&self) -> impl ExactSizeIterator<Item = Landmark> {
        (0..32_u16).map(|id| Landmark {
            id: u32::from(id),
            confirmed: true,
            position: [0.0; 2],
            covariance: [0.0; 3],
            seen: 1,
            first_us: 0,
            last_us: 0,
        })
    }
    fn save(&mut self) -> &[u8] {
        self.staging[..4].copy_from_slice(&self.moved.to_le_bytes());
        &self.staging[..4]
    }
    fn staging(&mut self) -> &mut [u8] {
        &mut self.staging
    }
    fn restore(&mut self, length: usize) -> Result<(), NotTaken> {
        let bytes = self.staging.first_chunk().filter(|_| length == 4).ok_or(NotTaken::NoState)?;
        self.moved = f32::from_le_bytes(*bytes);
        Ok(())
    }
    fn range(&self, spot: &Spot, std_px: f32) -> Option<Ranged> {
        let pixel = spot.foot();
        let ranged = Ranged {
            pixel,
            sight: Sight::Floor,
            range: pixel[1],
            bearing: pixel[0],
            covariance: [std_px; 3],
        };
        self.configured.then_some(ranged)
    }
}

/// A board whose every look at the counter takes a tick, with the ring between line and main loop.
#[derive(Default)]
pub(crate) struct Bench {
    ticks: std::cell::Cell<u32>,
    pub(crate) fed: std::cell::Cell<u32>,
    ring: Ring<WINDOW>,
}

impl Board for Bench {
    const NAME: &'static str = "bench";
    const COST_UNIT: CostUnit = CostUnit::Cycles;
    fn cost(&self) -> u32 {
        self.ticks.set(self.ticks.get().wrapping_add(1));
        self.ticks.get()
    }
    fn interrupt_cost(&self) -> u32 {
        0
    }
    fn units_from_ticks(ticks: u32) -> u32 {
        ticks
    }
    fn uptime_us(&self) -> u64 {
        1_000
    }
    fn stack_used(&self) -> u32 {
        0
    }
    fn stack_size(&self) -> u32 {
        0
    }
    fn overrun(&self) -> u32 {
        self.ring.overrun()
    }
    fn alive(&self) {
        self.fed.set(self.fed.get() + 1);
    }
}

/// A host and a device, with what the device said.
pub(crate) struct Talk {
    pub(crate) device: Device<Fake>,
    pub(crate) board: Bench,
    sequence: u16,
    deframer: Deframer,
    pub(crate) heard: LinkCounts,
}

/// What the device said, without borrowing: the parts that tests look at.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Said {
    Info(u8, bool),
    Restarts(Restarts),
    Pose(Pose),
    Observations(u16, u16, usize),
    Map(u16, u16, usize),
    Statistics(Statistics),
    Credit(Credit),
    Fault(Cause, u32),
    State(Vec<u8>),
    Ranges(u32, Vec<Ranged>),
    Other(u8),
}

impl Talk {
    pub(crate) fn new() -> Self {
        Self::of_run(1)
    }

    /// A device that has just begun its so-manieth run.
    pub(crate) fn of_run(runs: u8) -> Self {
        let mut talk = Self {
            device: Device::new(Fake::default()),
            board: Bench::default(),
            sequence: 0,
            deframer: Deframer::new(),
            heard: LinkCounts::default(),
        };
        let mut said = vec![];
        talk.device.greet(runs, None, &talk.board, &mut said);
        talk
    }

    /// A device that has been configured for pictures of 320 × 240, and its engine moves at 1 m/s.
    pub(crate) fn configured() -> Self {
        let mut talk = Self::new();
        talk.say(&HostMessage::Hello(Hello { nonce: 1 }));
        talk.say(&HostMessage::Configure(configuration()));
        talk
    }

    pub(crate) fn line(&mut self, message: &HostMessage<'_>) -> Vec<u8> {
        let mut line = [0; MAX_ENCODED];
        let line = message.encode(self.sequence, &mut line).unwrap().to_vec();
        self.sequence = self.sequence.wrapping_add(1);
        line
    }

    /// Another host takes over: it counts its frames from 0.
    pub(crate) fn restart_host(&mut self) {
        self.sequence = 0;
    }

    pub(crate) fn say(&mut self, message: &HostMessage<'_>) -> Vec<Said> {
        let line = self.line(message);
        self.send(&line).0
    }

    /// Puts bytes on the line, slowly enough for the device, and returns what comes back.
    pub(crate) fn send(&mut self, line: &[u8]) -> (Vec<Said>, Wish) {
        self.send_by(61, line)
    }

    /// Puts bytes on the line all at once, while the device is busy, and returns what comes back.
    pub(crate) fn flood(&mut self, line: &[u8]) -> Vec<Said> {
        self.send_by(usize::MAX, line).0
    }

    fn send_by(&mut self, at_once: usize, line: &[u8]) -> (Vec<Said>, Wish) {
        let (mut answer, mut wish, mut bytes) = (vec![], Wish::GoOn, [0; 61]);
        for part in line.chunks(at_once) {
            let mut part = part.iter().copied();
            self.board.ring.fill(|| part.next());
            while let count @ 1.. = self.board.ring.read(&mut bytes) {
                if self.device.receive(&bytes[..count], &self.board, &mut answer) == Wish::Restart {
                    wish = Wish::Restart;
                }
            }
        }
        let mut said = vec![];
        for byte in answer {
            let Some(frame) = self.deframer.push(byte) else { continue };
            let frame = frame.expect("what the device sends is whole");
            self.heard.arrived(None, frame.sequence);
            let what = match DeviceMessage::decode(&frame).expect("and understood") {
                DeviceMessage::Info(info) => {
                    said.push(Said::Restarts(info.restarts.0));
                    Said::Info(info.reset_count, info.configured)
                }
                DeviceMessage::Pose(pose) => Said::Pose(pose),
                DeviceMessage::Observations(some) => {
                    Said::Observations(some.first, some.total, some.observations.len())
                }
                DeviceMessage::Map(some) => Said::Map(some.first, some.total, some.landmarks.len()),
                DeviceMessage::Statistics(statistics) => Said::Statistics(statistics),
                DeviceMessage::Credit(credit) => Said::Credit(credit),
                DeviceMessage::Fault(fault) => Said::Fault(fault.cause, fault.detail),
                DeviceMessage::Ranges(some) => Said::Ranges(some.request, some.ranges.to_vec()),
                DeviceMessage::State(state) => Said::State(state.bytes.to_vec()),
                other => Said::Other(other.kind()),
            };
            said.push(what);
        }
        (said, wish)
    }

    /// Says a whole picture of 4 × `rows.len()` pixels.
    pub(crate) fn picture(&mut self, frame: u32, rows: &[[u8; 4]]) -> Vec<Said> {
        let mut said = vec![];
        for message in picture(frame, rows) {
            said.extend(self.say(&message));
        }
        said
    }
}

/// The messages of a small picture: a motion of 0.1 s at 1 m/s, and then its rows one by one.
pub(crate) fn picture(frame: u32, rows: &[[u8; 4]]) -> Vec<HostMessage<'_>> {
    let time_us = u64::from(frame) * 100_000;
    let motion = motion(time_us + 100_000, 0.1, 1.0);
    let begin = FrameBegin {
        frame,
        time_us: time_us + 100_000,
        left: 0,
        top: 0,
        width: 4,
        height: rows.len() as u16,
    };
    let rows = rows.iter().zip(0..).map(|(pixels, row)| HostMessage::Rows(Rows { frame, row, pixels }));
    let messages = [HostMessage::Odometry(motion), HostMessage::FrameBegin(begin)].into_iter().chain(rows);
    messages.chain([HostMessage::FrameEnd(FrameEnd { frame })]).collect()
}

/// A motion straight on.
pub(crate) fn motion(until_us: u64, duration: f32, speed: f32) -> Odometry {
    Odometry { until_us, duration, motion: Motion::Velocity { speed, turn: 0.0 } }
}

pub(crate) fn configuration() -> Configure {
    let camera = Camera::new(320, 240, [365.0; 2], [160.0, 120.0], 0.0, Default::default()).unwrap();
    let mount = Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap();
    let answers = Answers { observations: true, map_every: 0, statistics_every: 0 };
    message_from_config(&Config::new(RangeFinder::new(camera, mount)), answers)
}

pub(crate) fn poses(said: &[Said]) -> Vec<Pose> {
    said.iter().filter_map(|said| if let Said::Pose(pose) = said { Some(*pose) } else { None }).collect()
}

pub(crate) fn faults(said: &[Said]) -> Vec<(Cause, u32)> {
    said.iter()
        .filter_map(|said| if let Said::Fault(cause, detail) = said { Some((*cause, *detail)) } else { None })
        .collect()
}
