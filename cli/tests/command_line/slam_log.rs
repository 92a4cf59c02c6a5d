//! `slam-log` on small logs, and the logs it refuses.
use crate::command::{Folder, column};
use std::fmt::Write;

const LANDMARKS: [[f64; 2]; 4] = [[2.0, 2.0], [6.0, -2.0], [10.0, 2.5], [4.0, 5.0]];

/// A robot that drives a circle of 4 m at 1 m/s and sees four landmarks exactly, ten times a second.
fn log(named: bool) -> Folder {
    let folder = Folder::new();
    let (mut odometry, mut truth) = (String::from("t,v,omega\n"), String::from("t,x,y,heading\n"));
    let mut measured = String::from(if named { "t,range,bearing,id\n" } else { "t,range,bearing\n" });
    for tick in 0..=300 {
        let t = f64::from(tick) / 10.0;
        let heading = 0.25 * t;
        let (x, y) = (4.0 * heading.sin(), 4.0 * (1.0 - heading.cos()));
        let wrapped = heading.sin().atan2(heading.cos());
        writeln!(odometry, "{t},1,0.25").unwrap();
        writeln!(truth, "{t},{x},{y},{wrapped}").unwrap();
        for (id, [lx, ly]) in LANDMARKS.iter().enumerate() {
            let (dx, dy) = (lx - x, ly - y);
            let (range, bearing) = (dx.hypot(dy), dy.atan2(dx) - heading);
            let bearing = bearing.sin().atan2(bearing.cos());
            write!(measured, "{t},{range},{bearing}").unwrap();
            if named {
                write!(measured, ",{}", id + 10).unwrap();
            }
            measured.push('\n');
        }
    }
    let mut map = String::from("id,x,y\n");
    for (id, [x, y]) in LANDMARKS.iter().enumerate() {
        writeln!(map, "{},{x},{y}", id + 10).unwrap();
    }
    folder
        .write("odometry.csv", odometry)
        .write("measured.csv", measured)
        .write("truth.csv", truth)
        .write("map.csv", map);
    folder
}

const RUN: &str = "slam-log --odometry odometry.csv --measurements measured.csv";

#[test]
fn a_log_with_names_gives_every_file_and_the_true_map() {
    let folder = log(true);
    let said = folder.run(&format!("{RUN} --truth truth.csv --true-map map.csv --out out --json")).success();
    let report: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!((&report["landmarks"], &report["frames"]), (&4.into(), &301.into()));
    assert_eq!(report["settings"]["association"], "known");
    assert_eq!(report["verdict"], "consistent");
    assert!(report["map_errors"]["position"]["max"].as_f64().unwrap() < 1e-6, "{report:#}");
    assert!(report["errors"]["absolute"]["position"]["max"].as_f64().unwrap() < 1e-6, "{report:#}");
    let map = folder.read("out/map.csv");
    let mut ids = column(&map, "id");
    ids.sort_unstable();
    assert_eq!(ids, ["10", "11", "12", "13"]);
    let observations = folder.read("out/observations.csv");
    assert_eq!(column(&observations, "decision").iter().filter(|word| **word == "birth").count(), 4);
    assert!(column(&observations, "u").iter().all(|cell| cell.is_empty()));
    for name in ["trajectory.tum", "trajectory.csv", "map.ply", "report.json"] {
        assert!(!folder.read(&format!("out/{name}")).is_empty());
    }
    let html = folder.read("out/report.html");
    assert!(html.contains("Measurements matched") && html.contains("turn-std") && !html.contains("NaN"));
}

#[test]
fn a_verdict_against_the_filter_says_why() {
    let folder = log(true);
    // Wheels that turn the other way, and a filter that believes them.
    let folder = {
        let wheels = folder.read("odometry.csv").replace(",1,0.25", ",1,-0.25");
        folder.write("odometry.csv", wheels)
    };
    let run = format!("{RUN} --turn-std 0.01 --gate hard --out out");
    let said = folder.run(&run).success();
    let reason = "measurement after measurement lies beyond its gate";
    assert!(said.lines().next().unwrap().ends_with(&format!("lost: {reason}")), "{said}");
    let report: serde_json::Value = serde_json::from_str(&folder.read("out/report.json")).unwrap();
    assert_eq!((&report["verdict"], &report["reason"]), (&"lost".into(), &reason.into()));
    assert!(folder.read("out/report.html").contains(&format!("Lost</span>: {reason}")));
}

#[test]
fn a_log_without_names_ends_with_the_same_map_under_every_filter_and_gate() {
    let folder = log(false);
    for filter in ["invariant", "textbook", "fej"] {
        for gate in ["soft", "hard", "none"] {
            let run = format!(
                "{RUN} --truth truth.csv --true-map map.csv --filter {filter} --gate {gate} --view-range 20 --json"
            );
            let report: serde_json::Value = serde_json::from_str(&folder.run(&run).success()).unwrap();
            assert_eq!(report["landmarks"], 4, "{filter} {gate}");
            assert_eq!(
                (report["settings"]["filter"].as_str(), report["settings"]["gate"].as_str()),
                (Some(filter), Some(gate))
            );
            assert!(report["map_errors"]["position"]["max"].as_f64().unwrap() < 1e-6, "{report:#}");
        }
    }
}

#[test]
fn bearings_and_ranges_alone_are_measurements_too() {
    let folder = log(true);
    let without = |dropped: usize| {
        let text = folder.read("measured.csv");
        let line = |line: &str| {
            let mut cells: Vec<_> = line.split(',').collect();
            if cells[0] != "t" {
                cells[dropped] = "";
            }
            cells.join(",") + "\n"
        };
        text.lines().map(line).collect::<String>()
    };
    for (name, dropped) in [("bearings.csv", 1), ("ranges.csv", 2)] {
        folder.write(name, without(dropped));
        let run = format!(
            "slam-log --odometry odometry.csv --measurements {name} --truth truth.csv --true-map map.csv --json"
        );
        let report: serde_json::Value = serde_json::from_str(&folder.run(&run).success()).unwrap();
        assert_eq!(report["landmarks"], 4, "{name}: {report:#}");
        assert!(report["map_errors"]["position"]["max"].as_f64().unwrap() < 0.05, "{name}: {report:#}");
    }
}

#[test]
fn logs_that_cannot_be_run_are_refused_with_the_line() {
    let folder = log(true);
    folder
        .write("backwards.csv", "t,range,bearing\n1,2,0.1\n0.5,2,0.1\n")
        .write("empty.csv", "t,range,bearing\n1,,\n")
        .write("unnamed.csv", "t,range,bearing\n1,2,0.1\n")
        .write("late.csv", "t,range,bearing,id\n1,2,0.1,3\n99,2,0.1,3\n")
        .write("nan.csv", "t,range,bearing\n1,NaN,0.1\n");
    let with = |file: &str| format!("slam-log --odometry odometry.csv --measurements {file}");
    folder.fails(&with("backwards.csv"), &["backwards.csv, line 3", "sort"]);
    folder.fails(&with("empty.csv"), &["empty.csv, line 2", "neither range nor bearing"]);
    // Each was another landmark's number once: -1 became 0, and 1.5 became 1.
    for id in ["-1", "1.5", "5e9"] {
        folder.write("ids.csv", format!("t,range,bearing,id\n0.1,1,0,0\n0.1,1,0.5,{id}\n"));
        folder.fails(&with("ids.csv"), &["ids.csv, line 3", "`id` is ", "whole number"]);
    }
    folder.fails(&with("nan.csv"), &["nan.csv, line 2", "`range`", "finite"]);
    folder.fails(&with("missing.csv"), &["missing.csv", "no such file"]);
    folder.fails(&with("late.csv"), &["odometry.csv", "99"]);
    folder.fails(&format!("{} --association known", with("unnamed.csv")), &["has no `id`"]);
    assert_eq!(folder.run(&format!("{RUN} --gate soft-ish")).status, 2);
    assert_eq!(folder.run(&format!("{RUN} --range-std=-1")).status, 2);
    assert_eq!(folder.run("slam-log --odometry odometry.csv").status, 2);
}
