//! `feed` against `slam`, byte by byte: `cargo xtask firmware test`.
//!
//! Two hundred pictures of the simulated corridor go to the emulated boards, whole, 320×240, with odometry; association is in the
//! map, and the map has room for 32 landmarks at both ends. `MONORANGE_FRAMES` is another number of pictures.
#[allow(dead_code, reason = "the tests of the co-processor use the rest")]
#[path = "../../../mcu/tests/co_processor/emulator.rs"]
mod emulator;

use emulator::{Board, boards};
use std::{
    fs,
    io::{BufRead, BufReader},
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

/// The lines of a table as numbers, without its header; what is none is NaN.
fn table(path: &Path) -> Vec<Vec<f64>> {
    let numbers = |line: &str| line.split(',').map(|field| field.parse().unwrap_or(f64::NAN)).collect();
    fs::read_to_string(path).unwrap().lines().skip(1).map(numbers).collect()
}

#[test]
fn pymavlink_reads_where_the_robot_is_and_what_stands_before_it() {
    let Some(board) = boards().into_iter().next() else { return };
    let Some(python) = std::env::var_os("MONORANGE_PYTHON") else {
        assert!(std::env::var_os("CI").is_none(), "no Python given: run `cargo xtask firmware test`");
        eprintln!("skipped: no Python with pymavlink is given; `cargo xtask firmware test` has one");
        return;
    };
    const FRAMES: usize = 6;
    let folder = prepared(FRAMES);
    let emulator = board.start("mavlink");
    emulator.connect();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/feed/mavlink.py");
    let mut listener = Command::new(python)
        .args([script, &FRAMES.to_string()])
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let mut told = BufReader::new(listener.stdout.take().unwrap()).lines().map(|line| line.unwrap());
    let address = format!("udp:127.0.0.1:{}", told.next().expect("a port"));
    let line = emulator.line().to_str().unwrap().to_owned();
    let feed = [&["feed"], &INPUTS[..], &["--unix", &line, "--mavlink", &address, "--out", "feed"]].concat();
    monorange(folder.path(), &feed);
    let messages: Vec<serde_json::Value> = told.map(|line| serde_json::from_str(&line).unwrap()).collect();
    assert!(listener.wait().unwrap().success());
    let of =
        |kind: &str| messages.iter().filter(|message| message["mavpackettype"] == kind).collect::<Vec<_>>();
    assert!(!of("HEARTBEAT").is_empty());
    let near = |told: &serde_json::Value, expected: f64, most: f64, what: &str| {
        let told = told.as_f64().unwrap_or(f64::NAN);
        assert!((told - expected).abs() <= most, "{what}: {told}, not {expected}");
    };

    // Where the robot is: `trajectory.csv`, with y and the heading to the right.
    let (poses, path) = (of("ODOMETRY"), table(&folder.path().join("feed/trajectory.csv")));
    assert_eq!((poses.len(), path.len()), (FRAMES, FRAMES));
    for (pose, row) in poses.iter().zip(&path) {
        assert_eq!((&pose["system"], &pose["component"]), (&1.into(), &197.into()));
        // LOCAL_FRD and BODY_FRD, the only ones that ArduPilot takes.
        assert_eq!((&pose["frame_id"], &pose["child_frame_id"]), (&20.into(), &12.into()));
        let [t, x, y, heading, xx, xy, xh, yy, yh, hh] = row[..] else { panic!("{row:?}") };
        near(&pose["time_usec"], (t - path[0][0]) * 1e6, 1.0, "time");
        near(&pose["x"], x, 1e-6, "x");
        near(&pose["y"], -y, 1e-6, "y");
        near(&pose["q"][0], (0.5 * heading).cos(), 1e-6, "q");
        near(&pose["q"][3], (-0.5 * heading).sin(), 1e-6, "q");
        for (place, value) in [(0, xx), (1, -xy), (5, -xh), (6, yy), (10, yh), (20, hh), (11, 0.0)] {
            near(&pose["pose_covariance"][place], value, 1e-6 * value.abs(), "covariance");
        }
    }
    assert!(poses.iter().skip(1).all(|pose| pose["vx"].as_f64().is_some_and(|speed| speed > 0.05)));

    // What stands before it: `monorange scan` with as many beams.
    let scan = [&["scan"], &INPUTS[..], &["--beams", "72", "--out", "scan.csv"]].concat();
    monorange(folder.path(), &scan);
    let scan = table(&folder.path().join("scan.csv"));
    let obstacles = of("OBSTACLE_DISTANCE");
    assert_eq!((obstacles.len(), scan.len()), (FRAMES, FRAMES * 72));
    let kinds = fs::read_to_string(folder.path().join("scan.csv")).unwrap();
    let kinds: Vec<_> = kinds.lines().skip(1).map(|line| line.rsplit(',').next().unwrap()).collect();
    let mut walls = 0;
    for (frame, sent) in obstacles.iter().enumerate() {
        // The other way round: beams go from right to left.
        for (place, at) in (frame * 72..(frame + 1) * 72).rev().enumerate() {
            let bearing =
                sent["angle_offset"].as_f64().unwrap() + place as f64 * sent["increment_f"].as_f64().unwrap();
            assert!((bearing + scan[at][1].to_degrees()).abs() < 1e-3, "{bearing}° is not beam {at}");
            let expected = match kinds[at] {
                "unknown" => f64::from(u16::MAX),
                "beyond" => sent["max_distance"].as_f64().unwrap() + 1.0,
                _ => (scan[at][3] * 100.0).round(),
            };
            walls += usize::from(expected < 60_000.0);
            near(&sent["distances"][place], expected, 1.0, "distance");
        }
    }
    assert!(walls > 72, "{walls}");
    let ahead = of("DISTANCE_SENSOR");
    assert!(
        ahead
            .iter()
            .all(|sent| sent["orientation"] == 0 && sent["max_distance"] == obstacles[0]["max_distance"])
    );
}
