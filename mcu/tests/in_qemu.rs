//! The firmware on emulated boards against the pipeline on this machine: `cargo xtask firmware test`.
//!
//! The boards' programs come in `MONORANGE_MPS2_AN500` and `MONORANGE_MPS2_AN386`; without them, or without QEMU, these tests
//! are skipped aloud, unless `MONORANGE_QEMU=required`.
mod emulator;

use emulator::{Board, boards};
use monorange_core::{
    geometry::{Camera, Distortion, Mount, RangeFinder},
    image::Grey,
    pipeline::{Config, Memory, Odometry, OnHeap, Pipeline, Report},
};
use monorange_protocol::{
    client::{Answer, Client},
    conversion::*,
    frame::MAX_ENCODED,
    message::{
        Answers, DeviceMessage, FrameBegin, HostMessage, Landmark, Observation, Pose, SaveState, Stages,
        State,
    },
};
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};
use std::{io, os::unix::net::UnixStream, time::Duration};

const PATIENCE: Duration = Duration::from_secs(60);

fn corridor(frames: usize) -> Simulation {
    let config = SimConfig { frames, ..SimConfig::default() };
    Simulation::new(Scene::corridor(&SceneConfig::default()), default_rig().unwrap(), config).unwrap()
}

fn config_for(simulation: &Simulation) -> Config {
    let (camera, mount) = (simulation.rig().camera(), simulation.rig().mount());
    let lens = camera.distortion();
    let [k1, k2, p1, p2, k3] = [lens.k1, lens.k2, lens.p1, lens.p2, lens.k3].map(|k| k as f32);
    let (focal, principal) = (camera.focal().map(|f| f as f32), camera.principal().map(|c| c as f32));
    let lens = Distortion { k1, k2, p1, p2, k3 };
    let (width, height, skew) = (camera.width(), camera.height(), camera.skew() as f32);
    let camera = Camera::new(width, height, focal.into(), principal.into(), skew, lens).unwrap();
    let mount = Mount::new(mount.parameters().map(|number| number as f32)).unwrap();
    Config::new(RangeFinder::new(camera, mount))
}

/// What comes before a picture, and the picture.
struct Step {
    time_us: u64,
    odometry: Option<Odometry>,
    pixels: Vec<u8>,
}

fn step(simulation: &Simulation, frame: usize) -> Step {
    let mut pixels = vec![0; 320 * 240];
    simulation.render(frame, &mut pixels).unwrap();
    let odometry = frame.checked_sub(1).map(|before| {
        let (twist, seconds) =
            (simulation.odometry(before), simulation.time(frame) - simulation.time(before));
        Odometry::Velocity { v: twist.speed as f32, omega: twist.turn as f32, seconds: seconds as f32 }
    });
    Step { time_us: us_from_seconds(simulation.time(frame)), odometry, pixels }
}

/// The pipeline on this machine, with a map as large as the device's.
fn host(config: Config) -> Pipeline<OnHeap> {
    Pipeline::new(config, Memory::on_heap(320, 240, 32)).unwrap()
}

fn host_step(pipeline: &mut Pipeline<OnHeap>, step: &Step) -> Report {
    let time = seconds_from_us(step.time_us);
    if let Some(odometry) = &step.odometry {
        pipeline.odometry(time, odometry).unwrap();
    }
    pipeline.step(time, Grey::new(&step.pixels, 320, 240).unwrap()).unwrap()
}

/// The bytes of the host's pose, observations and map as the device would send them.
fn host_bytes(
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
    use monorange_protocol::message::{MAX_LANDMARKS, MAX_OBSERVATIONS, Map, Observations};
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

fn device_bytes(answer: &Answer) -> Vec<u8> {
    let pose = answer.pose.expect("a frame is answered by a pose");
    bytes(&pose, &answer.observations, &answer.landmarks)
}

fn device_step(client: &mut Client<UnixStream>, frame: u32, step: &Step) -> io::Result<Answer> {
    let motion: Vec<_> =
        step.odometry.iter().map(|odometry| message_from_odometry(odometry, step.time_us)).collect();
    let begin = FrameBegin { frame, time_us: step.time_us, left: 0, top: 0, width: 320, height: 240 };
    client.frame(&motion, &begin, &step.pixels)
}

/// Configures the device; returns its reset count.
fn configure(client: &mut Client<UnixStream>, config: &Config) -> u8 {
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

/// Sums and maxima of what frames cost.
#[derive(Default)]
struct Costs {
    frames: u64,
    sum: [u64; 6],
    most: [u32; 6],
    most_together: u32,
    landmarks: usize,
    stack: u32,
    stack_size: u32,
}

impl Costs {
    fn add(&mut self, answer: &Answer) {
        let Some(statistics) = answer.statistics else { return };
        let Stages { interrupt, receive, rows, corners, filter, answer: answers } = statistics.stages;
        let stages = [interrupt, receive, rows, corners, filter, answers];
        self.frames += 1;
        for ((sum, most), stage) in self.sum.iter_mut().zip(&mut self.most).zip(stages) {
            *sum += u64::from(stage);
            *most = stage.max(*most);
        }
        let together = stages.iter().fold(0_u32, |sum, stage| sum.saturating_add(*stage));
        self.most_together = self.most_together.max(together);
        self.landmarks = self.landmarks.max(answer.landmarks.len());
        self.stack = statistics.stack_used;
        self.stack_size = statistics.stack_size;
    }

    /// Checks the means against what they may be at most.
    fn check(&self, most: [u64; 7]) {
        let means = self.sum.map(|sum| sum / self.frames.max(1));
        let all = means.iter().sum();
        for (mean, most) in means.into_iter().chain([all]).zip(most) {
            assert!(mean <= most, "{mean} instructions are more than {most}");
        }
    }

    fn print(&self, board: &str) {
        let names = ["interrupt", "receive", "rows", "corners", "filter", "answer"];
        println!(
            "{board}: instructions a frame (320×240), {} frames, up to {} landmarks",
            self.frames, self.landmarks
        );
        for ((name, sum), most) in names.iter().zip(self.sum).zip(self.most) {
            println!("  {name:<10} mean {:>10}  most {most:>10}", sum / self.frames.max(1));
        }
        let mean = self.sum.iter().sum::<u64>() / self.frames.max(1);
        println!("  {:<10} mean {mean:>10}  most {:>10}", "together", self.most_together);
        println!("  stack {} of {} bytes", self.stack, self.stack_size);
    }
}

/// Runs `check` on every board at once.
fn on_every_board(check: impl Fn(&Board) + Sync) {
    let boards = boards();
    std::thread::scope(|scope| {
        let running: Vec<_> = boards.iter().map(|board| scope.spawn(|| check(board))).collect();
        for thread in running {
            thread.join().expect("a board's check failed, see above");
        }
    });
}

/// Instructions a frame that each stage may take on average: interrupt, receive, rows, corners, filter, answer; and all together.
/// A ratchet: a change for the better lowers them.
fn most(board: &Board) -> [u64; 7] {
    match board.name {
        "mps2-an500" => [1_450_000, 1_750_000, 6_000_000, 2_700_000, 200_000, 250_000, 12_000_000],
        _ => [1_450_000, 1_750_000, 6_200_000, 3_000_000, 250_000, 250_000, 12_500_000],
    }
}

/// The host drives far enough to have a map; the device takes its state over and goes on.
#[test]
fn a_device_that_takes_over_goes_on_with_the_same_bytes_and_within_its_budget() {
    let ahead = 150;
    let simulation = corridor(ahead + 12);
    let config = config_for(&simulation);
    let mut before = host(config);
    for frame in 0..ahead {
        host_step(&mut before, &step(&simulation, frame));
    }
    let mut state = vec![0; 64 * 1024];
    let length = before.save(&mut state).unwrap();
    let state = &state[..length];
    on_every_board(|board| {
        let emulator = board.start("corridor");
        let mut client = Client::new(emulator.connect(), 1, PATIENCE).unwrap();
        let reset_count = configure(&mut client, &config);
        give_state(&mut client, state);
        let mut pipeline = before.clone();
        let mut costs = Costs::default();
        for frame in ahead..simulation.len() {
            let step = step(&simulation, frame);
            let report = host_step(&mut pipeline, &step);
            let answer = device_step(&mut client, frame as u32, &step).unwrap();
            let wanted = host_bytes(&pipeline, &report, frame as u32, &step, reset_count);
            assert_eq!(answer.faults, [], "frame {frame}");
            assert!(
                device_bytes(&answer) == wanted,
                "{}: frame {frame}: {answer:#?}\n{report:#?}",
                board.name
            );
            costs.add(&answer);
        }
        costs.print(board.name);
        assert!(costs.landmarks >= 20, "the map has only {} landmarks", costs.landmarks);
        costs.check(most(board));
    });
}

fn give_state(client: &mut Client<UnixStream>, state: &[u8]) {
    let checksum = monorange_protocol::frame::checksum(state);
    for (number, bytes) in state.chunks(900).enumerate() {
        let (offset, total) = (900 * number as u32, state.len() as u32);
        let chunk = HostMessage::RestoreState(State { frame: 0, offset, total, checksum, bytes });
        client.send(&chunk, &mut |message| assert!(!matches!(message, DeviceMessage::Fault(_)))).unwrap();
    }
    client
        .wait_for(&mut |message| {
            assert!(!matches!(message, DeviceMessage::Fault(_)), "{message:?}");
            matches!(message, DeviceMessage::Info(_))
        })
        .unwrap();
}

#[test]
fn after_a_restart_the_saved_state_brings_the_map_back() {
    let simulation = corridor(8);
    let config = config_for(&simulation);
    on_every_board(|board| {
        let emulator = board.start("restart");
        let mut client = Client::new(emulator.connect(), 1, PATIENCE).unwrap();
        configure(&mut client, &config);
        let mut pipeline = host(config);
        let mut chunks: Vec<(u32, u32, u32, u32, Vec<u8>)> = vec![];
        for frame in 0..4 {
            let step = step(&simulation, frame);
            host_step(&mut pipeline, &step);
            device_step(&mut client, frame as u32, &step).unwrap();
        }
        client.send(&HostMessage::SaveState(SaveState {}), &mut |_| ()).unwrap();
        let mut collect = |message: &DeviceMessage<'_>| {
            let DeviceMessage::State(State { frame, offset, total, checksum, bytes }) = message else {
                return false;
            };
            chunks.push((*frame, *offset, *total, *checksum, bytes.to_vec()));
            offset + bytes.len() as u32 == *total
        };
        client.wait_for(&mut collect).unwrap();
        let reset = HostMessage::Reset(monorange_protocol::message::Reset::Device);
        client.send(&reset, &mut |_| ()).unwrap();
        let mut greeted =
            |message: &DeviceMessage<'_>| matches!(message, DeviceMessage::Info(info) if !info.configured);
        client.wait_for(&mut greeted).unwrap();
        let mut client = Client::new(client.into_stream(), 2, PATIENCE).unwrap();
        let reset_count = configure(&mut client, &config);
        for (frame, offset, total, checksum, bytes) in &chunks {
            let (frame, offset, total, checksum) = (*frame, *offset, *total, *checksum);
            let chunk = HostMessage::RestoreState(State { frame, offset, total, checksum, bytes });
            client.send(&chunk, &mut |message| assert!(!matches!(message, DeviceMessage::Fault(_)))).unwrap();
        }
        for frame in 4..8 {
            let step = step(&simulation, frame);
            let report = host_step(&mut pipeline, &step);
            let answer = device_step(&mut client, frame as u32, &step).unwrap();
            let wanted = host_bytes(&pipeline, &report, frame as u32, &step, reset_count);
            assert!(device_bytes(&answer) == wanted, "{}: frame {frame}", board.name);
        }
    });
}
