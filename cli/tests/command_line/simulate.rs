//! `simulate` and what reads its folder.
use crate::command::{Folder, column};

#[test]
fn a_simulation_is_whole_repeatable_and_readable() {
    let folder = Folder::new();
    let said =
        folder.run("simulate --scene corridor --frames 5 --walkers 1 --seed 3 --out made/one").success();
    assert!(said.contains("5 frames of a corridor"), "{said}");
    let json =
        folder.run("simulate --scene corridor --frames 5 --walkers 1 --seed 3 --out two --json").success();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["frames"], 5);
    for name in ["rig.toml", "times.txt", "odometry.csv", "truth.tum", "landmarks.csv", "laser.csv"] {
        assert_eq!(folder.read(&format!("made/one/{name}")), folder.read(&format!("two/{name}")), "{name}");
    }
    let frame = |run: &str| std::fs::read(folder.path(&format!("{run}/frames/000004.png"))).unwrap();
    assert_eq!(frame("made/one"), frame("two"));
    assert_eq!(folder.read("two/times.txt").lines().count(), 5);
    assert!(folder.read("two/truth.tum").starts_with("0 0 0 0 0 0 0 1\n"), "the world is the first pose");
    assert_eq!(column(&folder.read("two/odometry.csv"), "v").len(), 5);
    assert!(column(&folder.read("two/landmarks.csv"), "x").len() > 50);
    assert_eq!(folder.names(), ["made", "two"]);

    let truth =
        "--truth two/truth.tum --estimate two/truth.tum --true-map two/landmarks.csv --map two/landmarks.csv";
    let evaluation: serde_json::Value =
        serde_json::from_str(&folder.run(&format!("evaluate {truth}")).success()).unwrap();
    assert_eq!(evaluation["map"]["spurious"], 0);
}

#[test]
fn an_occupied_folder_is_left_alone() {
    let folder = Folder::new();
    folder.write("out/notes.txt", "mine");
    folder.fails("simulate --scene corridor --frames 2 --out out", &["out: is there already", "help:"]);
    assert_eq!(folder.read("out/notes.txt"), "mine");
    folder.write("file", "");
    folder.fails("simulate --scene corridor --frames 2 --out file", &["file: is there already"]);
    for arguments in
        ["--scene castle --frames 2 --out x", "--scene corridor --frames 0 --out x", "--scene corridor"]
    {
        assert_eq!(folder.run(&format!("simulate {arguments}")).status, 2, "{arguments}");
    }
}

#[test]
fn table_2_is_five_frames_with_its_points_at_their_range() {
    let folder = Folder::new();
    folder.run("simulate --scene table2 --out lab").success();
    assert_eq!(folder.read("lab/times.txt").lines().count(), 5);
    let landmarks = folder.read("lab/landmarks.csv");
    let number = |name: &str| column(&landmarks, name)[0].parse::<f64>().unwrap();
    assert!(
        (number("x").hypot(number("y")) - 1.29).abs() < 1e-9,
        "the first frame sees the table's first point"
    );
}
