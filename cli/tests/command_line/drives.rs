//! `slam` on several drives at once.
use crate::command::Folder;
use std::process::Command;

const NAMES: [&str; 3] = ["a", "b", "c"];
const FILES: [&str; 4] = ["trajectory.csv", "map.csv", "observations.csv", "trajectory.tum"];

/// Three drives of different lengths, so that they do not end in the order in which they begin.
fn drives() -> Folder {
    let folder = Folder::new();
    for (seed, name) in NAMES.iter().enumerate() {
        let frames = 14 - 4 * seed;
        folder
            .run(&format!("simulate --scene corridor --frames {frames} --seed {seed} --out drives/{name}"))
            .success();
    }
    folder
}

/// The option with the file `name` of every drive.
fn all(option: &str, name: &str) -> String {
    format!(" {option} {}", NAMES.map(|drive| format!("drives/{drive}/{name}")).join(" "))
}

#[test]
fn several_drives_are_what_each_is_alone() {
    let folder = drives();
    let each = all("--frames", "frames") + &all("--odometry", "odometry.csv") + &all("--truth", "truth.tum");
    let rig = "slam --rig drives/a/rig.toml";
    let told = folder.run(&format!("{rig}{each} --out maps")).success();
    let titles: Vec<_> = told.lines().filter(|line| line.contains("frames used")).collect();
    assert_eq!(titles.len(), 3, "{told}");
    for (title, name) in titles.iter().zip(NAMES) {
        assert!(
            title.starts_with(&format!("{name}/frames: ")),
            "in the order in which they are given: {told}"
        );
        let one = format!("--frames drives/{name}/frames --odometry drives/{name}/odometry.csv");
        folder.run(&format!("{rig} {one} --truth drives/{name}/truth.tum --out alone/{name}")).success();
        for file in FILES {
            assert_eq!(
                folder.read(&format!("maps/{name}/{file}")),
                folder.read(&format!("alone/{name}/{file}"))
            );
        }
    }
    let json = folder.run(&format!("{rig}{each} --json --out maps")).success();
    let json: Vec<serde_json::Value> = serde_json::from_str(&json).unwrap();
    assert_eq!(json.iter().map(|run| run["frames_used"].as_u64().unwrap()).collect::<Vec<_>>(), [14, 10, 6]);
}

#[test]
#[cfg(unix)]
fn a_pattern_of_the_shell_names_them() {
    let folder = drives();
    let words =
        "slam --rig drives/*/rig.toml --frames drives/*/frames --odometry drives/*/odometry.csv --out maps";
    let command = format!("{} {words}", env!("CARGO_BIN_EXE_monorange"));
    let done = Command::new("sh").args(["-c", &command]).current_dir(folder.path("")).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    for name in NAMES {
        assert!(folder.path(&format!("maps/{name}/report.html")).exists());
    }
}

#[test]
fn a_drive_that_fails_leaves_the_others_theirs() {
    let folder = drives();
    std::fs::remove_dir_all(folder.path("drives/b/frames")).unwrap();
    let words = "slam --rig drives/a/rig.toml".to_owned() + &all("--frames", "frames") + " --out maps";
    let outcome = folder.run(&words);
    assert_eq!(outcome.status, 1, "{outcome:?}");
    assert!(outcome.stderr.contains("drives/b/frames"), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("1 of 3 drives failed"), "{}", outcome.stderr);
    let there = NAMES.map(|name| folder.path(&format!("maps/{name}")).exists());
    assert_eq!(there, [true, false, true]);
}

#[test]
fn drives_that_cannot_be_told_apart_or_do_not_fit_are_refused() {
    let folder = drives();
    folder.fails(
        "slam --rig drives/a/rig.toml --frames drives/a/frames drives/a/frames --out maps",
        &["drives/a/frames: cannot be told apart"],
    );
    for (words, why) in [
        (
            all("--frames", "frames") + " --odometry drives/a/odometry.csv drives/b/odometry.csv",
            "2 times for 3",
        ),
        (" --frames drives/a/frames --truth drives/a/truth.tum drives/b/truth.tum".into(), "2 times for 1"),
        (all("--frames", "frames") + " --mcap out.mcap", "--mcap takes one drive"),
    ] {
        let outcome = folder.run(&format!("slam --rig drives/a/rig.toml{words} --out maps"));
        assert_eq!(outcome.status, 2, "{outcome:?}");
        assert!(outcome.stderr.contains(why), "{}", outcome.stderr);
    }
    let outcome =
        folder.run(&format!("feed --rig drives/a/rig.toml{} --unix none", all("--frames", "frames")));
    assert_eq!(outcome.status, 2, "{outcome:?}");
}
