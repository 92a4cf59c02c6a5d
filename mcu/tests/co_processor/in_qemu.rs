//! The firmware on emulated boards against the pipeline on this machine: `cargo xtask firmware test`.
//!
//! The boards' programs come in `MONORANGE_MPS2_AN500`, `MONORANGE_MPS2_AN386` and `MONORANGE_MPS2_AN385`; without them these tests
//! are skipped aloud, unless `MONORANGE_QEMU=required` or `CI` is set.

use crate::drive::*;
use crate::emulator::{Board, boards, every_processor};
use monorange_mcu::text;
use monorange_protocol::{
    client::{Answer, Client},
    message::{DeviceMessage, Hello, HostMessage, Range, SaveState, Spot, Stages, State, Text},
};
use std::{
    cell::RefCell,
    io::{self, Read, Write},
    os::unix::net::UnixStream,
    rc::Rc,
    time::Duration,
};

const PATIENCE: Duration = Duration::from_secs(60);

/// Bytes of the stack that a run may use.
const MOST_STACK: u32 = 40 * 1024;

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

    /// Checks the means against what they may be at most, and the stack.
    fn check(&self, most: [u64; 7]) {
        let means = self.sum.map(|sum| sum / self.frames.max(1));
        let all = means.iter().sum();
        for (mean, most) in means.into_iter().chain([all]).zip(most) {
            assert!(mean <= most, "{mean} instructions are more than {most}");
        }
        let (used, size) = (self.stack, self.stack_size);
        assert!(
            used <= MOST_STACK && used < size,
            "{used} bytes of stack, {MOST_STACK} of {size} may be used"
        );
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

/// Runs `check` on all of `boards` at once.
fn on_each(boards: &[Board], check: impl Fn(&Board) + Sync) {
    std::thread::scope(|scope| {
        let running: Vec<_> = boards.iter().map(|board| scope.spawn(|| check(board))).collect();
        for thread in running {
            thread.join().expect("a board's check failed, see above");
        }
    });
}

/// Instructions a frame that each stage may take on average: interrupt, receive, rows, corners, filter, answer; and all together.
/// A ratchet: a change for the better lowers them. The interrupt's and the answer's shares depend on how many bytes QEMU takes
/// each time, and so on the load of this machine; what all stages take together has no such room.
fn most(board: &Board) -> [u64; 7] {
    match board.name {
        "mps2-an500" => [1_600_000, 1_750_000, 4_400_000, 2_400_000, 450_000, 250_000, 10_450_000],
        "mps2-an386" => [1_600_000, 1_750_000, 4_450_000, 2_700_000, 600_000, 300_000, 10_950_000],
        _ => [1_700_000, 1_800_000, 10_000_000, 30_000_000, 3_700_000, 400_000, 47_100_000],
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
    let state =
        [&monorange_protocol::conversion::fingerprint(&config).to_le_bytes(), &state[..length]].concat();
    on_each(&every_processor(), |board| {
        let emulator = board.start("corridor");
        let mut client = Client::new(emulator.connect(), 1, PATIENCE).unwrap();
        let reset_count = configure(&mut client, &config);
        give_state(&mut client, &state);
        let mut pipeline = before.clone();
        let mut costs = Costs::default();
        for frame in ahead..simulation.len() {
            let step = step(&simulation, frame);
            let report = host_step(&mut pipeline, &step);
            let answer = patient_step(&mut client, frame as u32, &step).unwrap();
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
    on_each(&boards(), |board| {
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

/// A line that keeps what came.
struct Recorded {
    stream: UnixStream,
    heard: Rc<RefCell<Vec<u8>>>,
}

impl Read for Recorded {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let count = self.stream.read(bytes)?;
        self.heard.borrow_mut().extend(&bytes[..count]);
        Ok(count)
    }
}

impl Write for Recorded {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.write(bytes)
    }
    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// The lines of text among what came, from `word` on.
fn lines_of(heard: &[u8], word: &str) -> Vec<String> {
    let pieces = heard.split(|byte| *byte == 0).filter_map(|piece| std::str::from_utf8(piece).ok());
    pieces.flat_map(str::lines).filter(|line| line.starts_with(word)).map(str::to_owned).collect()
}

#[test]
fn a_board_tells_pictures_and_ranges_in_lines_of_text() {
    let simulation = corridor(3);
    let config = config_for(&simulation);
    on_each(&boards(), |board| {
        let emulator = board.start("text");
        let heard = Rc::new(RefCell::new(vec![]));
        let recorded = Recorded { stream: emulator.connect(), heard: Rc::clone(&heard) };
        let mut client = Client::new(recorded, 1, PATIENCE).unwrap();
        configure(&mut client, &config);
        client.send(&HostMessage::Text(Text::Both), &mut |_| ()).unwrap();
        let mut wanted = vec![];
        for frame in 0..simulation.len() {
            let answer = device_step(&mut client, frame as u32, &step(&simulation, frame)).unwrap();
            let (pose, corners) = (answer.pose.unwrap(), answer.observations);
            let nearest = text::nearest(corners.iter().copied());
            assert!(nearest.is_some(), "the comparison is of something");
            let mut write = |line: &[u8]| wanted.push(String::from_utf8_lossy(line).trim_end().to_owned());
            text::picture(&pose, corners.len(), nearest.as_ref(), &mut write);
        }
        assert_eq!(lines_of(&heard.borrow(), "pose "), wanted, "{}", board.name);
        // From here on without frames.
        client.send(&HostMessage::Text(Text::Lines), &mut |_| ()).unwrap();
        let spots = [Spot::Pixel([160.0, 200.0]), Spot::Pixel([160.0, 1.0])].into_iter().collect();
        client.send(&HostMessage::Range(Range { request: 5, std_px: 0.5, spots }), &mut |_| ()).unwrap();
        while lines_of(&heard.borrow(), "range request=5 number=1 sight=above_horizon").is_empty() {
            client.listen(&mut |_| ()).unwrap();
        }
        // The greeting of this form is the last one; no frame follows it.
        let text = heard.borrow().iter().copied().rev().take_while(|byte| *byte != 0).collect::<Vec<_>>();
        assert!(String::from_utf8(text.into_iter().rev().collect()).unwrap().starts_with("info board=mps2-"));
        let ranges = lines_of(&heard.borrow(), "range ");
        assert!(ranges[0].starts_with("range request=5 number=0 sight=floor range="), "{ranges:?}");
        assert_eq!(ranges[1], "range request=5 number=1 sight=above_horizon");
        client.send(&HostMessage::Hello(Hello { nonce: 77 }), &mut |_| ()).unwrap();
        let mut back =
            |message: &DeviceMessage<'_>| matches!(message, DeviceMessage::Info(info) if info.nonce == 77);
        client.wait_for(&mut back).unwrap();
    });
}
