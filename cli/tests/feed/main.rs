//! `feed` against `slam`, byte by byte: `cargo xtask firmware test`.
//!
//! Two hundred pictures of the simulated corridor go to the emulated boards, whole, 320×240, with odometry; association is in the
//! map, and the map has room for 32 landmarks at both ends. `MONORANGE_FRAMES` is another number of pictures.
#[path = "../../../mcu/tests/emulator/mod.rs"]
mod emulator;

use emulator::{Board, boards};
use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

const FILES: [&str; 5] = ["trajectory.tum", "trajectory.csv", "map.csv", "map.ply", "observations.csv"];

fn frames(default: usize) -> usize {
    std::env::var("MONORANGE_FRAMES").ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

fn monorange(folder: &Path, arguments: &[&str]) -> Output {
    let output =
        Command::new(env!("CARGO_BIN_EXE_monorange")).args(arguments).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

const INPUTS: [&str; 6] =
    ["--rig", "corridor/rig.toml", "--frames", "corridor/frames", "--odometry", "corridor/odometry.csv"];

/// A corridor and what `slam` makes of it.
fn prepared(frames: usize) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let frames = frames.to_string();
    monorange(folder.path(), &["simulate", "--scene", "corridor", "--frames", &frames, "--out", "corridor"]);
    // As every target finds them.
    let rig = folder.path().join("corridor/rig.toml");
    let text = fs::read_to_string(&rig).unwrap();
    fs::write(rig, text + "\n[extract]\ncorners = \"lines\"\n").unwrap();
    let slam = [&["slam"], &INPUTS[..], &["--max-landmarks", "32", "--out", "slam"]].concat();
    monorange(folder.path(), &slam);
    folder
}

fn assert_same_files(folder: &Path, out: &str, board: &Board) {
    for name in FILES {
        let [host, device] = ["slam", out].map(|run| fs::read(folder.join(run).join(name)).unwrap());
        assert!(!host.is_empty());
        assert!(host == device, "{}: {name} differs from the host's", board.name);
    }
}

#[test]
fn a_setting_that_the_device_does_not_know_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    monorange(folder.path(), &["simulate", "--scene", "corridor", "--frames", "2", "--out", "corridor"]);
    let rig = folder.path().join("corridor/rig.toml");
    let text = fs::read_to_string(&rig).unwrap();
    fs::write(rig, text + "\n[association]\ncarrier = \"floor\"\n").unwrap();
    let feed = [&["feed"], &INPUTS[..], &["--unix", "nowhere"]].concat();
    let output =
        Command::new(env!("CARGO_BIN_EXE_monorange")).args(feed).current_dir(folder.path()).output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && told.contains("rig.toml") && told.contains("carrier"), "{told}");
}

#[test]
fn a_co_processor_writes_the_very_files_of_slam() {
    let boards = boards();
    if boards.is_empty() {
        return;
    }
    let folder = prepared(frames(200));
    std::thread::scope(|scope| {
        let runs: Vec<_> = boards
            .iter()
            .map(|board| {
                let folder = folder.path();
                scope.spawn(move || {
                    let emulator = board.start("feed");
                    emulator.connect();
                    let line = emulator.line().to_str().unwrap();
                    let feed = [&["feed"], &INPUTS[..], &["--unix", line, "--out", board.name]].concat();
                    monorange(folder, &feed);
                    assert_same_files(folder, board.name, board);
                })
            })
            .collect();
        runs.into_iter().for_each(|run| run.join().expect("see above"));
    });
}

#[test]
fn a_board_that_is_replaced_in_mid_sequence_leaves_no_trace() {
    let Some(board) = boards().into_iter().next() else { return };
    let folder = prepared(24);
    let emulator = board.start("replaced");
    emulator.connect();
    let line = emulator.line().to_owned();
    let path = line.to_str().unwrap().to_owned();
    let feed = [&["feed"], &INPUTS[..], &["--unix", &path, "--save-every", "3", "--out", "resumed"]].concat();
    let mut running = Command::new(env!("CARGO_BIN_EXE_monorange"))
        .args(&feed)
        .current_dir(folder.path())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_secs(4));
    assert!(running.try_wait().unwrap().is_none(), "it should be in the middle by now");
    drop(emulator);
    let _again = board.start("replaced");
    let output = running.wait_with_output().unwrap();
    let warnings = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && warnings.contains("again from frame"), "{warnings}");
    assert_same_files(folder.path(), "resumed", &board);
}
