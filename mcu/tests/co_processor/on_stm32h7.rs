//! The Nucleo's own program on an emulated STM32H743, against the pipeline on this machine: `cargo xtask firmware test`.
//!
//! As many small pictures as come within [`LONGEST`], 20 at most: an emulated interrupt for each of their bytes takes its time.
//! The chip is `boards/nucleo-h743zi/emulator/stm32h7.py`. Its program comes in `MONORANGE_NUCLEO`, a Python with unicorn in
//! `MONORANGE_UNICORN`; without them this is skipped aloud.

use crate::drive::*;
use monorange_protocol::{
    client::Client,
    message::{DeviceMessage, HostMessage, SaveState, State},
};
use std::{
    io::{BufRead, BufReader, Read},
    os::unix::net::UnixStream,
    path::{Path, PathBuf},
    process::{Child, ChildStdout, Command, Stdio},
    time::{Duration, Instant},
};

/// Pictures, and how long they may take once there are a few.
const PICTURES: std::ops::RangeInclusive<usize> = 4..=20;
const LONGEST: Duration = Duration::from_secs(40);

/// The chip and the line to it; it ends when the line does.
struct Chip {
    child: Child,
    said: BufReader<ChildStdout>,
    line: PathBuf,
}

impl Chip {
    fn start(python: &Path, program: &Path) -> Self {
        let line = std::env::temp_dir().join(format!("monorange-stm32h7-{}.sock", std::process::id()));
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/boards/nucleo-h743zi/emulator/stm32h7.py");
        let mut child = Command::new("timeout")
            .arg("600")
            .args([python, Path::new("-B"), Path::new(script), program, &line])
            .stdout(Stdio::piped())
            .spawn()
            .expect("timeout and Python start");
        let said = BufReader::new(child.stdout.take().expect("it is piped"));
        Self { child, said, line }
    }

    fn connect(&self) -> UnixStream {
        let start = Instant::now();
        loop {
            match UnixStream::connect(&self.line) {
                Ok(stream) => {
                    stream.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
                    return stream;
                }
                Err(error) if start.elapsed() > Duration::from_secs(20) => panic!("no line: {error}"),
                Err(_) => std::thread::sleep(Duration::from_millis(20)),
            }
        }
    }

    /// What the program has set, as the emulator tells it once: the number after a name.
    fn set(&mut self) -> impl Fn(&str) -> u32 {
        let mut line = String::new();
        self.said.read_line(&mut line).unwrap();
        move |name| {
            let mut words = line.split_whitespace().skip_while(|word| *word != name);
            let number = words.nth(1).unwrap_or_else(|| panic!("{name} is not in {line:?}"));
            u32::from_str_radix(number.trim_start_matches("0x"), 16).unwrap()
        }
    }
}

impl Drop for Chip {
    fn drop(&mut self) {
        let _ = Command::new("kill").arg(self.child.id().to_string()).status();
        let _ = self.child.wait();
        // Why it stopped, where that was of its own accord.
        self.said.by_ref().lines().map_while(Result::ok).for_each(|line| println!("stm32h7.py: {line}"));
        let _ = std::fs::remove_file(&self.line);
    }
}

fn given() -> Option<[PathBuf; 2]> {
    let given = |name| Some(PathBuf::from(std::env::var_os(name)?));
    let both = given("MONORANGE_UNICORN").zip(given("MONORANGE_NUCLEO"));
    if both.is_none() {
        eprintln!("skipped: no program and no unicorn given; `cargo xtask firmware test` has both");
    }
    both.map(|(python, program)| [python, program])
}

#[test]
fn the_nucleos_own_program_gives_the_same_bits_with_its_caches_on() {
    let Some([python, program]) = given() else { return };
    let simulation = small_corridor(*PICTURES.end());
    let config = config_for(&simulation);
    let mut chip = Chip::start(&python, &program);
    let mut client = Client::new(chip.connect(), 1, Duration::from_secs(60)).unwrap();
    let reset_count = configure(&mut client, &config);

    let set = chip.set();
    let (instructions, data) = (1 << 17, 1 << 16);
    assert_eq!(set("caches") & (instructions | data), instructions | data, "both caches are on");
    assert_eq!(set("mpu") & 1, 1, "the stack's guard is on");
    // 120 MHz over 130.
    assert_eq!(120_000_000 / set("baud"), 923_076);

    let mut pipeline = host(config);
    let (mut frames, mut corners, mut stack, start) = (0, 0, [0; 2], Instant::now());
    while frames < *PICTURES.end() && (frames < *PICTURES.start() || start.elapsed() < LONGEST) {
        let step = step(&simulation, frames);
        let report = host_step(&mut pipeline, &step);
        let answer = patient_step(&mut client, frames as u32, &step).unwrap();
        assert_eq!(answer.faults, [], "frame {frames}");
        let wanted = host_bytes(&pipeline, &report, frames as u32, &step, reset_count);
        assert!(device_bytes(&answer) == wanted, "frame {frames}: {answer:#?}\n{report:#?}");
        frames += 1;
        corners += answer.observations.len();
        stack = answer.statistics.map(|told| [told.stack_used, told.stack_size]).unwrap();
    }
    let ([used, size], seconds) = (stack, start.elapsed().as_secs());
    println!(
        "nucleo-h743zi, emulated: {frames} pictures of 160×120, {corners} corners, {seconds} s; stack {used} of {size} bytes"
    );
    assert!(used <= 40 * 1024 && used < size);
    assert!(corners > 0, "the comparison is of something");

    // The longest frames that there are, each sent from an empty buffer: one that is longer than it would never end.
    let (mut bytes, mut whole) = (0, 0);
    client.send(&HostMessage::SaveState(SaveState {}), &mut |_| ()).unwrap();
    let mut last = |message: &DeviceMessage<'_>| {
        let DeviceMessage::State(State { total, bytes: chunk, .. }) = message else { return false };
        (bytes, whole) = (bytes + chunk.len(), *total as usize);
        bytes == whole
    };
    client.wait_for(&mut last).unwrap();
    assert!(whole > 960, "the first frame is a full one: {whole} bytes in all");
}
