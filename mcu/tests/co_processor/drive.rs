//! A drive through the simulated corridor: on a device, and by the pipeline on this machine.
use monorange_core::{
    geometry::{Camera, RangeFinder},
    image::Grey,
    pipeline::{Config, Memory, Odometry, OnHeap, Pipeline, Report},
};
use monorange_protocol::{
    client::{Answer, Client},
    conversion::*,
    frame::MAX_ENCODED,
    message::{
        Answers, Attitude, DeviceMessage, FrameBegin, FrameEnd, HostMessage, Landmark, MAX_LANDMARKS,
        MAX_OBSERVATIONS, Map, Observation, Observations, Pose, Rows,
    },
};
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};
use std::io::{self, Read, Write};

pub(crate) fn corridor(frames: usize) -> Simulation {
    drive(frames, default_rig().unwrap())
}

/// As [`corridor`], with a camera of half as many pixels a row.
pub(crate) fn small_corridor(frames: usize) -> Simulation {
    let rig = default_rig().unwrap();
    let (focal, principal) = (rig.camera().focal(), rig.camera().principal());
    let [u, v] = [principal.x, principal.y].map(|at| 0.5 * at - 0.25);
    let focal = [0.5 * focal.x, 0.5 * focal.y];
    let camera = Camera::with_lens(160, 120, focal, [u, v], 0.0, *rig.camera().lens()).unwrap();
    drive(frames, RangeFinder::new(camera, *rig.mount()))
}

fn drive(frames: usize, rig: RangeFinder<f64>) -> Simulation {
    let config = SimConfig { frames, ..SimConfig::default() };
    Simulation::new(Scene::corridor(&SceneConfig::default()), rig, config).unwrap()
}

pub(crate) fn config_for(simulation: &Simulation) -> Config {
    Config::new(simulation.rig().cast().unwrap())
}

/// What comes before a picture, and the picture.
pub(crate) struct Step {
    time_us: u64,
    odometry: Option<Odometry>,
    lean: Option<Attitude>,
    /// Pixels in a row, and rows.
    size: [usize; 2],
    pixels: Vec<u8>,
}

pub(crate) fn step(simulation: &Simulation, frame: usize) -> Step {
    let size = [simulation.rig().camera().width(), simulation.rig().camera().height()];
    let mut pixels = vec![0; size[0] * size[1]];
    simulation.render(frame, &mut pixels).unwrap();
    let odometry = frame.checked_sub(1).map(|before| {
        let (twist, seconds) =
            (simulation.odometry(before), simulation.time(frame) - simulation.time(before));
        Odometry::Velocity { v: twist.speed as f32, omega: twist.turn as f32, seconds: seconds as f32 }
    });
    // An IMU that is heard now and then, and says of a robot that stands level that it hardly leans.
    let pitch = 0.001 * (frame % 7) as f32 - 0.003;
    let lean = (frame % 4 == 3).then_some(Attitude { pitch, roll: 0.001, std: 0.003 });
    Step { time_us: us_from_seconds(simulation.time(frame)), odometry, lean, size, pixels }
}

/// The pipeline on this machine, with a map as large as the device's.
pub(crate) fn host(config: Config) -> Pipeline<OnHeap> {
    Pipeline::new(config, Memory::on_heap(320, 240, 32)).unwrap()
}

pub(crate) fn host_step(pipeline: &mut Pipeline<OnHeap>, step: &Step) -> Report {
    let time = seconds_from_us(step.time_us);
    if let Some(odometry) = &step.odometry {
        pipeline.odometry(time, odometry).unwrap();
    }
    if let Some(Attitude { pitch, roll, std }) = step.lean {
        pipeline.attitude(pitch, roll, std).unwrap();
    }
    pipeline.step(time, Grey::new(&step.pixels, step.size[0], step.size[1]).unwrap()).unwrap()
}

/// The bytes of the host's pose, observations and map as the device would send them.
pub(crate) fn host_bytes(
    pipeline: &Pipeline<OnHeap>,
    report: &Report,
    frame: u32,
    step: &Step,
    reset_count: u8,
) -> Vec<u8> {
    let (pose, p) = (report.pose, &report.pose_covariance);
    let landmarks: Vec<Landmark> = pipeline
        .filter()
        .landmarks()
        .iter()
        .map(|record| landmark_from_filter(pipeline.filter(), record))
        .collect();
    let pose = Pose {
        frame,
        time_us: step.time_us,
        position: [pose.x, pose.y],
        heading: pose.heading,
        covariance: [p.m11, p.m12, p.m13, p.m22, p.m23, p.m33],
        reset_count,
        predicted_only: false,
        landmarks: landmarks.len() as u16,
    };
    let observations: Vec<Observation> =
        report.corners.iter().map(|corner| observation_from_corner(corner, 1)).collect();
    bytes(&pose, &observations, &landmarks)
}

fn bytes(pose: &Pose, observations: &[Observation], landmarks: &[Landmark]) -> Vec<u8> {
    let mut messages = vec![DeviceMessage::Pose(*pose)];
    messages.extend(observations.chunks(MAX_OBSERVATIONS).map(|some| {
        let observations = some.iter().copied().collect();
        DeviceMessage::Observations(Observations { frame: 0, first: 0, total: 0, observations })
    }));
    messages.extend(landmarks.chunks(MAX_LANDMARKS).map(|some| {
        let landmarks = some.iter().copied().collect();
        DeviceMessage::Map(Map { frame: 0, first: 0, total: 0, landmarks })
    }));
    let mut line = [0; MAX_ENCODED];
    messages.iter().flat_map(|message| message.encode(0, &mut line).unwrap().to_vec()).collect()
}

pub(crate) fn device_bytes(answer: &Answer) -> Vec<u8> {
    let pose = answer.pose.expect("a frame is answered by a pose");
    bytes(&pose, &answer.observations, &answer.landmarks)
}

pub(crate) fn device_step(
    client: &mut Client<impl Read + Write>,
    frame: u32,
    step: &Step,
) -> io::Result<Answer> {
    let motion: Vec<_> =
        step.odometry.iter().map(|odometry| message_from_odometry(odometry, step.time_us)).collect();
    let begin = begin(frame, step);
    client.frame(&motion, step.lean, &begin, &step.pixels)
}

fn begin(frame: u32, step: &Step) -> FrameBegin {
    let [width, height] = step.size.map(|size| size as u16);
    FrameBegin { frame, time_us: step.time_us, left: 0, top: 0, width, height }
}

/// As [`device_step`], for a device so slow that [`Client::frame`] would take its answer for lost and ask for it again; statistics
/// are to come with every frame.
pub(crate) fn patient_step(
    client: &mut Client<impl Read + Write>,
    frame: u32,
    step: &Step,
) -> io::Result<Answer> {
    let begin = begin(frame, step);
    let at_once = 1014 / step.size[0];
    let mut answer = Answer::default();
    let rows = step.pixels.chunks(at_once * step.size[0]).zip(0..).map(|(pixels, number)| Rows {
        frame,
        row: number * at_once as u16,
        pixels,
    });
    let odometry = step.odometry.iter().map(|odometry| message_from_odometry(odometry, step.time_us));
    let messages = odometry
        .map(HostMessage::Odometry)
        .chain(step.lean.map(HostMessage::Attitude))
        .chain([HostMessage::FrameBegin(begin)])
        .chain(rows.map(HostMessage::Rows))
        .chain([HostMessage::FrameEnd(FrameEnd { frame })]);
    for message in messages {
        client.send(&message, &mut |message| answer.absorb(message))?;
    }
    // The statistics come last.
    client.wait_for(&mut |message| {
        answer.absorb(message);
        matches!(message, DeviceMessage::Statistics(_))
    })?;
    Ok(answer)
}

/// Configures the device; returns its reset count.
pub(crate) fn configure(client: &mut Client<impl Read + Write>, config: &Config) -> u8 {
    let answers = Answers { observations: true, map_every: 1, statistics_every: 1 };
    let message = HostMessage::Configure(message_from_config(config, answers));
    client.send(&message, &mut |_| ()).unwrap();
    let mut count = 0;
    let configured = &mut |message: &DeviceMessage<'_>| match message {
        DeviceMessage::Info(info) if info.configured => {
            count = info.reset_count;
            true
        }
        DeviceMessage::Fault(fault) => panic!("the configuration is refused: {fault:?}"),
        _ => false,
    };
    client.wait_for(configured).unwrap();
    count
}
