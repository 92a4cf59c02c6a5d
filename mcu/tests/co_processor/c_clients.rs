//! Clients in C against the device on this machine, and against emulated boards where they are given: the example of
//! `protocol/c/posix`, and the Arduino sketch on a computer.

use crate::bench::Bench;
use crate::drive::host;
use crate::emulator::boards;
use monorange_core::{
    geometry::{Camera, Mount, RangeFinder},
    image::Grey,
    pipeline::Config,
};
use monorange_mcu::{Arrays, Device, Mapper};
use monorange_protocol::{
    conversion::{landmark_from_filter, range_of_spot},
    message::Spot,
};
use std::{
    io::{ErrorKind, Read, Write},
    os::unix::net::UnixListener,
    path::{Path, PathBuf},
    process::Command,
    time::Duration,
};

const C: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../protocol/c");

/// Compiles a program; `None` where there is no compiler, which CI has.
fn compile(compiler: &str, arguments: &[&str], name: &str) -> Option<PathBuf> {
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    if Command::new(compiler).arg("--version").output().is_err() {
        assert!(std::env::var_os("CI").is_none(), "there is no {compiler}: install gcc and g++");
        eprintln!("SKIPPED: there is no compiler `{compiler}`");
        return None;
    }
    let strict = ["-O1", "-Wall", "-Wextra", "-Werror", "-o"];
    let compiled =
        Command::new(compiler).args(strict).arg(&program).args(arguments).current_dir(C).status().unwrap();
    assert!(compiled.success(), "{name} does not compile");
    Some(program)
}

fn example() -> Option<PathBuf> {
    compile("cc", &["-std=gnu99", "posix/first_range.c"], "first_range")
}

fn sketch() -> Option<PathBuf> {
    let sketch = "-DSKETCH=\"../arduino/first_range/first_range.ino\"";
    compile("c++", &["-std=c++17", "-I.", "-Ishim", sketch, "shim/main.cpp"], "sketch")
}

/// Runs `use_it` with a socket on which a device on this machine answers one client.
fn with_device(name: &str, use_it: impl FnOnce(&Path)) {
    let path = std::env::temp_dir().join(format!("monorange-{name}-{}.sock", std::process::id()));
    let listener = UnixListener::bind(&path).unwrap();
    let served = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let mut device = Device::new(Mapper::new(Box::leak(Box::new(Arrays::new()))));
        let (board, mut bytes, mut answer) = (Bench::default(), [0; 4096], vec![]);
        device.greet(1, None, &board, &mut answer);
        loop {
            // The client may have what it wants, and be gone.
            if stream.write_all(&answer).is_err() {
                return;
            }
            answer.clear();
            match stream.read(&mut bytes) {
                Ok(0) => return,
                Ok(count) => drop(device.receive(&bytes[..count], &board, &mut answer)),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => return,
            }
        }
    });
    use_it(&path);
    served.join().unwrap();
    std::fs::remove_file(path).unwrap();
}

/// A wall's edge at u = 160 that meets the floor at v = 140.
fn picture() -> Vec<u8> {
    let pixel = |(u, v): (usize, usize)| if v > 140 { 60 } else { [120, 180][usize::from(u > 160)] };
    (0..320 * 240).map(|place| pixel((place % 320, place / 320))).collect()
}

/// What the example must print: by the pipeline on this machine, the numbers of a line after its first word.
fn wanted() -> Vec<Vec<f32>> {
    let camera = Camera::new(320, 240, [365.0; 2], [160.0, 120.0], 0.0, Default::default()).unwrap();
    let finder = RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap());
    let config = Config { mount_std: [0.01, 0.017, 0.017, 0.017], ..Config::new(finder) };
    let mut pipeline = host(config);
    let spots = [Spot::Pixel([160.0, 200.0]), Spot::Box([90.0, 40.0, 130.0, 180.0])];
    let mut lines: Vec<Vec<f32>> = spots
        .iter()
        .map(|spot| {
            let ranged = range_of_spot(&pipeline, spot, 0.5, 1);
            let [var_range, _, var_bearing] = ranged.covariance;
            vec![ranged.pixel[0], ranged.pixel[1], ranged.range, ranged.bearing, var_range, var_bearing]
        })
        .collect();
    pipeline.step(1.0, Grey::new(&picture(), 320, 240).unwrap()).unwrap();
    let landmarks = pipeline.filter().landmarks();
    assert!(!landmarks.is_empty(), "the comparison is of something");
    lines.push(vec![1.0, landmarks.len() as f32, 0.0]);
    lines.extend(landmarks.iter().map(|record| {
        let told = landmark_from_filter(pipeline.filter(), record);
        let [var_x, _, var_y] = told.covariance;
        vec![told.id as f32, told.position[0], told.position[1], var_x, var_y]
    }));
    lines
}

/// Runs the example on a line: every number that it prints is the pipeline's, bit by bit.
fn check_example(program: &Path, line: &Path) {
    let pixels = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join(format!("{}.raw", line.file_name().unwrap().to_string_lossy()));
    std::fs::write(&pixels, picture()).unwrap();
    let told = Command::new("timeout").arg("60").arg(program).args([line, &pixels]).output().unwrap();
    let text = String::from_utf8_lossy(&told.stdout);
    assert!(told.status.success(), "{text}{}", String::from_utf8_lossy(&told.stderr));
    let is_number = |letter: char| letter.is_ascii_alphanumeric() || "-+.".contains(letter);
    let numbers = |line: &str| -> Vec<f32> {
        line.split(|letter| !is_number(letter)).filter_map(|word| word.parse().ok()).collect()
    };
    let printed: Vec<_> = text.lines().skip(1).map(numbers).collect();
    assert_eq!(printed, wanted(), "{text}");
}

#[test]
fn the_example_in_c_gets_the_pipelines_numbers() {
    let Some(program) = example() else { return };
    with_device("c", |line| check_example(&program, line));
}

#[test]
fn the_arduino_sketch_prints_a_range() {
    let Some(program) = sketch() else { return };
    with_device("sketch", |line| {
        let told = Command::new(&program).arg(line).arg("1").output().unwrap();
        let text = String::from_utf8_lossy(&told.stdout);
        assert!(told.status.success() && text.contains("range 0.9060 m, bearing 0.0000 rad"), "{text}");
    });
}

#[test]
fn the_example_in_c_gets_the_same_numbers_of_emulated_boards() {
    for board in boards() {
        let Some(program) = example() else { return };
        let emulator = board.start("c");
        emulator.connect();
        check_example(&program, emulator.line());
    }
}
