//! `slam --map`: a drive that begins in the map of an earlier one.
use crate::command::{Folder, column};
use std::fs;

const RIG: &str = "--rig sim/rig.toml --odometry sim/odometry.csv --truth sim/truth.tum";

/// A corridor that was driven, and the end of that drive as a drive of its own.
fn driven() -> Folder {
    let folder = Folder::new();
    folder.run("simulate --scene corridor --frames 90 --walkers 0 --seed 5 --out sim").success();
    folder.run(&format!("slam {RIG} --frames sim/frames --out first")).success();
    let times: Vec<_> = folder.read("sim/times.txt").lines().map(str::to_owned).collect();
    folder.write("again/times.txt", times[30..].join("\n"));
    fs::create_dir_all(folder.path("again/frames")).unwrap();
    for frame in 30..90 {
        let name = format!("frames/{frame:06}.png");
        fs::copy(folder.path(&format!("sim/{name}")), folder.path(&format!("again/{name}"))).unwrap();
    }
    folder
}

const AGAIN: &str = "--frames again/frames --times again/times.txt --map first/map.bin";

fn report(folder: &Folder, out: &str) -> serde_json::Value {
    serde_json::from_str(&folder.read(&format!("{out}/report.json"))).unwrap()
}

#[test]
fn a_drive_finds_its_place_in_an_earlier_map_and_its_whole_path_is_put_there() {
    let folder = driven();
    let said = folder.run(&format!("slam {RIG} {AGAIN} --scan --out second")).success();
    assert!(said.contains("map        first/map.bin: recognised by "), "{said}");
    let report = report(&folder, "second");
    assert!(report["in_map"]["recognised"].as_u64().unwrap() >= 5, "{report:#}");
    assert!(report["in_map"]["found_after_m"].as_f64().unwrap() < 7.0, "{report:#}");
    // The world is the earlier map's, from the first pose on: the truth is compared there.
    let absolute = &report["errors"]["absolute"];
    assert!(absolute["position"]["max"].as_f64().unwrap() < 0.5, "{report:#}");
    assert_eq!(report["errors"]["nees"]["inside_3_sigma"], 1.0, "{report:#}");
    let first = column(&folder.read("second/trajectory.csv"), "x")[0].parse::<f64>().unwrap();
    assert!(first > 2.0, "the second drive begins where the first one was by then: {first}");
    // Landmarks keep their names and first times, but for what is merged.
    let [before, after] = ["first", "second"].map(|run| folder.read(&format!("{run}/map.csv")));
    let rows = |map: &str| -> Vec<(u32, f64)> {
        let number = |text: &&str| text.parse::<f64>().unwrap();
        let ids = column(map, "id").into_iter().map(|id| id.parse().unwrap());
        ids.zip(column(map, "first_t").iter().map(number).collect::<Vec<_>>()).collect()
    };
    let (before, after) = (rows(&before), rows(&after));
    let kept =
        |(id, first): &&(u32, f64)| after.iter().any(|(known, t)| id == known && (t - first).abs() < 1e-9);
    assert!(
        before.len() > 15 && before.iter().filter(kept).count() + 2 >= before.len(),
        "{before:?} {after:?}"
    );
    let named = column(&folder.read("second/observations.csv"), "landmark")
        .iter()
        .filter(|id| before.iter().any(|(known, _)| known.to_string() == **id))
        .count();
    assert!(named > 20, "{named} sightings of the earlier map's landmarks");
    assert!(folder.path("second/map.yaml").exists());
}

#[test]
fn a_map_that_is_only_for_finding_the_way_stays_as_it_is() {
    let folder = driven();
    folder.run(&format!("slam {RIG} {AGAIN} --localise-only --out second")).success();
    let report = report(&folder, "second");
    assert!(report["in_map"]["found_after_s"].is_number(), "{report:#}");
    assert_eq!(report["errors"]["nees"]["inside_3_sigma"], 1.0, "{report:#}");
    let columns = ["id", "x", "y", "var_x", "cov_xy", "var_y"];
    let [before, after] = ["first", "second"].map(|run| folder.read(&format!("{run}/map.csv")));
    for name in columns {
        assert_eq!(column(&before, name), column(&after, name), "{name}");
    }
    let wrong = folder.run(&format!("slam {RIG} --frames again/frames --localise-only --out third"));
    assert_eq!(wrong.status, 2, "{wrong:?}");
    assert!(wrong.stderr.contains("--map"), "{wrong:?}");
}

#[test]
fn a_drive_elsewhere_is_lost_and_says_so() {
    let folder = driven();
    folder.run("simulate --scene office --frames 20 --walkers 0 --seed 9 --out other").success();
    let drive = "--rig other/rig.toml --frames other/frames --odometry other/odometry.csv";
    let outcome = folder.run(&format!("slam {drive} --map first/map.bin --out second"));
    assert_eq!(outcome.status, 0, "{outcome:?}");
    assert!(outcome.stdout.contains("lost: the place in the saved map was not found"), "{outcome:?}");
    let report = report(&folder, "second");
    assert_eq!(report["verdict"], "lost");
    assert!(report["in_map"]["found_after_s"].is_null(), "{report:#}");
}

#[test]
fn what_is_no_map_is_refused_by_name() {
    let folder = driven();
    let sound = fs::read(folder.path("first/map.bin")).unwrap();
    let mut other_version = sound.clone();
    other_version[7] = 2;
    let mut not_finite = sound.clone();
    let last = not_finite.len() - 4;
    not_finite[last..].copy_from_slice(&f32::NAN.to_le_bytes());
    for (name, bytes) in [
        ("empty", Vec::new()),
        ("cut", sound[..sound.len() / 2].to_vec()),
        ("longer", [&sound[..], &[0]].concat()),
        ("a version to come", other_version),
        ("not finite", not_finite),
        ("a table", b"id,x,y\n1,2,3\n".to_vec()),
    ] {
        folder.write("wrong.bin", bytes);
        let outcome = folder.run(&format!("slam {RIG} --frames again/frames --map wrong.bin --out second"));
        assert_eq!(outcome.status, 1, "{name}: {outcome:?}");
        for words in ["wrong.bin", "help: ", "map.bin"] {
            assert!(outcome.stderr.contains(words), "{name}: {outcome:?}");
        }
    }
    let into_itself = folder.run(&format!("slam {RIG} {AGAIN} --out first"));
    assert_eq!(into_itself.status, 1, "{into_itself:?}");
    assert!(into_itself.stderr.contains("written over"), "{into_itself:?}");
    assert_eq!(fs::read(folder.path("first/map.bin")).unwrap(), sound);
}

#[test]
fn a_robot_that_is_carried_away_is_found_again() {
    let folder = Folder::new();
    folder.run("simulate --scene corridor --frames 130 --walkers 0 --seed 5 --out sim").success();
    folder.run(&format!("slam {RIG} --frames sim/frames --out first")).success();
    // Once more there; from the 65th picture to the 90th somebody carries it, and its wheels stand.
    let times: Vec<_> = folder.read("sim/times.txt").lines().map(str::to_owned).collect();
    let frames = || (20..65).chain(90..130);
    folder
        .write("again/times.txt", frames().map(|frame| times[frame].as_str()).collect::<Vec<_>>().join("\n"));
    fs::create_dir_all(folder.path("again/frames")).unwrap();
    for frame in frames() {
        let name = format!("frames/{frame:06}.png");
        fs::copy(folder.path(&format!("sim/{name}")), folder.path(&format!("again/{name}"))).unwrap();
    }
    let time = |text: &str| text.parse::<f64>().unwrap();
    let standing = time(&times[64])..time(&times[90]);
    let odometry = folder.read("sim/odometry.csv");
    let rows = odometry.lines().map(|row| match row.split(',').next() {
        Some(t) if t != "t" && standing.contains(&time(t)) => format!("{t},0,0"),
        _ => row.to_owned(),
    });
    folder.write("again/odometry.csv", rows.collect::<Vec<_>>().join("\n"));

    let rig = "--rig sim/rig.toml --odometry again/odometry.csv --truth sim/truth.tum";
    let outcome = folder.run(&format!("slam {rig} {AGAIN} --scan --out second"));
    assert!(outcome.stderr.contains("the robot is missed where its map has it at "), "{outcome:?}");
    assert!(folder.read("second/report.html").contains("Warning: the robot is missed"));
    let said = outcome.success();
    let report = report(&folder, "second");
    assert!(report["errors"]["absolute"]["end_position"].as_f64().unwrap() < 0.3, "{said}\n{report:#}");
    // All but the pictures before it was missed.
    assert!(report["errors"]["nees"]["inside_3_sigma"].as_f64().unwrap() > 0.9, "{said}");
    let seen: Vec<f64> =
        column(&folder.read("second/observations.csv"), "t").iter().map(|t| time(t)).collect();
    assert!(seen.is_sorted() && seen.last().is_some_and(|last| *last > time(&times[120])));
}
