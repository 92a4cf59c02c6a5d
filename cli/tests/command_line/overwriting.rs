//! No output is an input of its run: over all commands, all of their outputs and all of their inputs.
use crate::command::{Folder, RIG};
use std::fs;

const CAMERA: &str = "image_width: 320\nimage_height: 240\ncamera_matrix: [[365, 0, 146], [0, 365, 115], [0, 0, 1]]\n\
                      distortion_model: plumb_bob\ndistortion_coefficients: [-0.2, 0.3, 0, 0, 0]\n";
const POINTS: &str =
    "u,v,range,bearing\n60,200,0.88,0.26\n250,195,0.92,-0.30\n60,150,1.33,0.25\n240,140,1.48,-0.26\n";

/// A drive, and every other file that a command reads.
fn inputs() -> Folder {
    let folder = Folder::new();
    folder.run("simulate --scene corridor --frames 6 --walkers 0 --out sim").success();
    let rig = RIG.split("[mount]").nth(1).unwrap();
    folder
        .write("camera.yaml", CAMERA)
        .write("rig.toml", format!("camera_info = \"camera.yaml\"\n[mount]{rig}"))
        .write("pixels.csv", "u,v\n160,200\n")
        .write("points.csv", POINTS)
        .write("one.txt", "0\n")
        .write("map.csv", "id,x,y\n1,2,3\n")
        .write("measured.csv", "t,range,bearing,id\n0.6,2,0.1,1\n1.2,1.9,0.1,1\n");
    folder
}

/// Commands that write one file, `OUT`, with what they read.
const TO_A_FILE: &[(&str, &[&str])] = &[
    ("range --rig rig.toml pixels.csv --out OUT", &["rig.toml", "camera.yaml", "pixels.csv"]),
    ("landmarks --rig rig.toml sim/frames --out OUT", &["rig.toml", "camera.yaml", "sim/frames/000003.png"]),
    ("keypoints sim/frames/000000.png --features brief --out OUT", &["sim/frames/000000.png"]),
    (
        "match sim/frames/000000.png sim/frames/000001.png --out OUT",
        &["sim/frames/000000.png", "sim/frames/000001.png"],
    ),
    ("match sim/frames/000000.png sim/frames/000001.png --pairs OUT", &["sim/frames/000000.png"]),
    ("match sim/frames/000000.png sim/frames/000001.png --overlay OUT", &["sim/frames/000001.png"]),
    (
        "evaluate --truth sim/truth.tum --estimate sim/truth.tum --map map.csv --true-map sim/landmarks.csv --out OUT",
        &["sim/truth.tum", "map.csv", "sim/landmarks.csv"],
    ),
    (
        "calibrate-mount --rig rig.toml --points points.csv --fit tilt --out OUT",
        &["points.csv", "camera.yaml", "rig.toml"],
    ),
    (
        "calibrate sim/frames/000000.png sim/frames/000001.png --board 9x6 --square 0.025 --floor sim/frames/000001.png --out OUT",
        &["sim/frames/000000.png", "sim/frames/000001.png"],
    ),
    (
        "scan --rig rig.toml --frames sim/frames --odometry sim/odometry.csv --out OUT",
        &["rig.toml", "camera.yaml", "sim/times.txt", "sim/odometry.csv", "sim/frames/000003.png"],
    ),
    (
        "slam --rig rig.toml --frames sim/frames --odometry sim/odometry.csv --truth sim/truth.tum --out new --mcap OUT",
        &["rig.toml", "sim/times.txt", "sim/truth.tum", "sim/laser.csv", "sim/landmarks.csv"],
    ),
];

/// Commands that write into a folder, `OUT`, with a name that they write there and what it may replace.
const TO_A_FOLDER: &[(&str, &str, &str)] = &[
    ("landmarks --rig rig.toml sim/frames --overlay OUT", "000002.png", "sim/frames/000002.png"),
    (
        "scan --rig rig.toml --times one.txt --frames sim/frames --overlay OUT",
        "000002.png",
        "sim/frames/000002.png",
    ),
    (
        "slam --rig rig.toml --frames sim/frames --odometry sim/odometry.csv --truth IN --out OUT",
        "trajectory.tum",
        "sim/truth.tum",
    ),
    (
        "slam --rig rig.toml --frames sim/frames --odometry sim/odometry.csv --truth IN --scan --out OUT",
        "scan.csv",
        "sim/truth.tum",
    ),
    (
        "slam --rig rig.toml --frames sim/frames --odometry sim/odometry.csv --truth IN --out OUT",
        "map.bin",
        "sim/truth.tum",
    ),
    // A device that is not there: what would be written over is refused before it is asked for.
    (
        "feed --rig rig.toml --frames sim/frames --odometry sim/odometry.csv --truth IN --unix nowhere --patience 1 --out OUT",
        "trajectory.tum",
        "sim/truth.tum",
    ),
    (
        "feed --rig rig.toml --frames sim/frames --odometry IN --unix nowhere --patience 1 --out OUT",
        "map.csv",
        "sim/odometry.csv",
    ),
    ("slam-log --odometry sim/odometry.csv --measurements IN --out OUT", "observations.csv", "measured.csv"),
    (
        "slam-log --odometry sim/odometry.csv --measurements measured.csv --truth sim/truth.tum --true-map IN --out OUT",
        "map.csv",
        "map.csv",
    ),
];

#[track_caller]
fn refused(folder: &Folder, command: &str, input: &str) {
    let before = fs::read(folder.path(input)).unwrap();
    let outcome = folder.run(command);
    assert_eq!(outcome.status, 1, "{command}: {outcome:?}");
    assert!(
        outcome.stderr.contains("written over") || outcome.stderr.contains("not from an earlier run"),
        "{}",
        outcome.stderr
    );
    assert!(fs::read(folder.path(input)).unwrap() == before, "{command} wrote over {input}");
    assert!(!folder.names().iter().any(|name| name.contains(".part")), "{:?}", folder.names());
}

#[test]
fn no_file_that_was_read_is_written_over() {
    let folder = inputs();
    for (command, inputs) in TO_A_FILE {
        for input in *inputs {
            let name = input.rsplit('/').next().unwrap();
            let (inside, absolute) = (input.replacen('/', "/../sim/", 1), folder.path(input));
            for path in [format!("./{input}"), inside, absolute.display().to_string()] {
                refused(&folder, &command.replace("OUT", &path), input);
            }
            #[cfg(unix)]
            {
                let link = folder.path(&format!("link-to-{name}"));
                std::os::unix::fs::symlink(folder.path(input), &link).unwrap();
                refused(&folder, &command.replace("OUT", &link.display().to_string()), input);
                // The other way round: the input is named by the link.
                if command.contains(input) && !input.contains("frames/000003") {
                    let by_link = command.replace(input, &link.display().to_string()).replace("OUT", input);
                    refused(&folder, &by_link, input);
                }
                fs::remove_file(link).unwrap();
            }
        }
    }
}

#[test]
fn no_folder_of_results_takes_an_input() {
    let folder = inputs();
    for (number, (command, name, source)) in TO_A_FOLDER.iter().enumerate() {
        let out = format!("out{number}");
        let input = format!("{out}/{name}");
        folder.write(&input, fs::read(folder.path(source)).unwrap());
        // A folder of an earlier run is written into, but not over an input.
        folder.write(&format!("{out}/report.json"), "{}");
        let command = command
            .replace("IN", &input)
            .replace("sim/frames --overlay", &format!("{out} --overlay"))
            .replace("OUT", &out);
        refused(&folder, &command, &input);
    }
}

#[test]
fn what_no_run_wrote_is_not_written_over() {
    let folder = inputs();
    let run = "slam-log --odometry sim/odometry.csv --measurements measured.csv --out d";
    folder.write("d/trajectory.csv", "precious\n");
    folder.fails(run, &["d: holds a file `trajectory.csv`", "--out"]);
    assert_eq!(folder.read("d/trajectory.csv"), "precious\n");
    fs::rename(folder.path("d/trajectory.csv"), folder.path("d/notes.csv")).unwrap();
    let said = folder.run(run);
    assert!(
        said.status == 0 && said.stderr.contains("warning: d: holds other files already (`notes.csv`)"),
        "{said:?}"
    );
    let again = folder.run(run);
    assert!(again.status == 0 && !again.stderr.contains("other files"), "{again:?}");
    // Overlays of an earlier run are drawn again, other pictures stay.
    let overlay = "landmarks --rig rig.toml sim/frames/000001.png --overlay drawn";
    folder.run(overlay).success();
    folder.run(overlay).success();
    folder.write("drawn/000001.png", fs::read(folder.path("sim/frames/000001.png")).unwrap());
    folder.fails(overlay, &["drawn/000001.png", "did not draw"]);
    folder.write("file", "x");
    folder.fails(&run.replace("--out d", "--out file"), &["file: is there and is not a folder"]);
    folder.fails(&run.replace("--out d", "--out file/deeper"), &["file: is there and is not a folder"]);
}

#[test]
fn a_command_without_inputs_writes_over_nothing_either() {
    let folder = inputs();
    let before = folder.read("sim/truth.tum");
    folder.fails("simulate --scene corridor --frames 2 --out sim", &["sim: is there already", "help:"]);
    folder.fails(
        "simulate --scene corridor --frames 2 --out rig.toml",
        &["rig.toml: is there already", "help:"],
    );
    assert_eq!(folder.read("sim/truth.tum"), before);
    folder.write("paper/table2-1.csv", "precious\n");
    folder.fails("reproduce table2 --out paper", &["paper: holds a file `table2-1.csv`", "help:"]);
    assert_eq!(folder.read("paper/table2-1.csv"), "precious\n");
    // Overlays of scan, as those of landmarks, replace no picture that is none.
    let overlay = "scan --rig rig.toml --frames sim/frames --overlay drawn --out scan.csv";
    folder.run(overlay).success();
    folder.run(overlay).success();
    folder.write("drawn/000004.png", fs::read(folder.path("sim/frames/000001.png")).unwrap());
    folder.fails(overlay, &["drawn/000004.png", "did not draw"]);
}

#[cfg(unix)]
#[test]
fn streams_and_devices_are_written_to() {
    use std::process::Command;
    let folder = inputs();
    let shell = |script: &str| {
        let script = script.replace("MR", env!("CARGO_BIN_EXE_monorange"));
        let outcome = Command::new("sh").args(["-c", &script]).current_dir(folder.path("")).output().unwrap();
        assert!(outcome.status.success(), "{script}: {outcome:?}");
        String::from_utf8(outcome.stdout).unwrap()
    };
    shell("(echo head; MR range --rig rig.toml pixels.csv --out /dev/stdout; echo tail) > all.txt");
    let all = folder.read("all.txt");
    let lines: Vec<_> = all.lines().collect();
    assert!(
        lines.len() == 4 && lines[0] == "head" && lines[1].starts_with("u,v") && lines[3] == "tail",
        "{all}"
    );
    shell("echo keep > kept.txt; MR range --rig rig.toml pixels.csv --out /dev/fd/1 >> kept.txt");
    assert!(folder.read("kept.txt").starts_with("keep\nu,v,range"));
    assert!(shell("MR range --rig rig.toml pixels.csv --out /dev/fd/3 3>&1").starts_with("u,v,range"));
    assert!(
        shell("mkfifo pipe; cat pipe & MR range --rig rig.toml pixels.csv --out pipe; wait")
            .starts_with("u,v,range")
    );
    shell("TMPDIR=$PWD/no/such MR range --rig rig.toml pixels.csv --out /dev/null");
    assert!(!folder.path("no").exists());
    let own = Command::new("sh")
        .args([
            "-c",
            &format!(
                "{} range --rig rig.toml --out pixels.csv < pixels.csv",
                env!("CARGO_BIN_EXE_monorange")
            ),
        ])
        .current_dir(folder.path(""))
        .output()
        .unwrap();
    assert!(!own.status.success() && folder.read("pixels.csv") == "u,v\n160,200\n", "{own:?}");
}

#[cfg(unix)]
#[test]
fn a_signal_leaves_nothing_and_says_so() {
    use std::process::{Command, Stdio};
    for signal in ["INT", "TERM", "HUP"] {
        let folder = Folder::new();
        // Whoever runs these tests may ignore signals (`nohup`), and the program would too: that is another test's.
        let program = ["env", "--default-signal=INT,TERM,HUP", env!("CARGO_BIN_EXE_monorange")];
        let program = &program[if cfg!(target_os = "linux") { 0 } else { 2 }..];
        let mut child = Command::new(program[0])
            .args(&program[1..])
            .args(["simulate", "--scene", "office", "--frames", "20000", "--out", "new/deep/sim"])
            .current_dir(folder.path(""))
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // Until it has begun to write.
        let begun =
            || fs::read_dir(folder.path("new/deep")).is_ok_and(|mut entries| entries.next().is_some());
        for _ in 0..600 {
            if begun() {
                break;
            }
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
        let id = child.id().to_string();
        assert!(Command::new("kill").args([&format!("-{signal}"), &id]).status().unwrap().success());
        let status = child.wait().unwrap();
        let mut said = String::new();
        std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut said).unwrap();
        assert!(status.code().is_some_and(|code| code > 128), "{signal}: {status:?}");
        assert!(said.contains(&format!("stopped by SIG{signal}")), "{said}");
        assert_eq!(folder.names(), Vec::<String>::new(), "{signal}");
    }
}
