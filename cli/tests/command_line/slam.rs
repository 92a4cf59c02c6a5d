//! `slam` from a folder of pictures to its report, and the sequences it refuses.
use crate::command::{Folder, column, data};

fn simulated(frames: usize) -> Folder {
    let folder = Folder::new();
    folder.run(&format!("simulate --scene corridor --frames {frames} --walkers 1 --out sim")).success();
    folder
}

const RUN: &str = "slam --rig sim/rig.toml --frames sim/frames --odometry sim/odometry.csv";

#[test]
fn a_drive_gives_every_file_and_they_agree() {
    let folder = simulated(40);
    let said = folder.run(&format!("{RUN} --truth sim/truth.tum --out out")).success();
    assert!(said.contains("40 of 40 frames used") && said.contains("out/report.html"), "{said}");
    let mut files: Vec<_> = std::fs::read_dir(folder.path("out"))
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    assert_eq!(
        files,
        [
            "map.bin",
            "map.csv",
            "map.ply",
            "observations.csv",
            "report.html",
            "report.json",
            "trajectory.csv",
            "trajectory.tum"
        ]
    );
    let (trajectory, observations) = (folder.read("out/trajectory.csv"), folder.read("out/observations.csv"));
    assert!(trajectory.starts_with("t,x,y,heading,var_x,cov_xy,cov_xh,var_y,cov_yh,var_h\n"));
    assert_eq!(trajectory.lines().count(), 41);
    assert_eq!(folder.read("out/trajectory.tum").lines().count(), 40);
    assert!(observations.starts_with("t,frame,u,v,range,bearing,landmark,decision,nis\n"));
    assert!(folder.read("out/map.csv").starts_with("id,x,y,var_x,cov_xy,var_y,seen,first_t,last_t\n"));
    let report: serde_json::Value = serde_json::from_str(&folder.read("out/report.json")).unwrap();
    assert_eq!(report["corners"], column(&observations, "decision").len());
    assert_eq!(report["landmarks"], column(&folder.read("out/map.csv"), "id").len());
    assert!(report["landmarks"].as_u64().unwrap() > 0, "{report:#}");
    assert!(report["decisions"]["update"].as_u64().unwrap() > 20, "{report:#}");

    let evaluated = "evaluate --truth sim/truth.tum --estimate out/trajectory.csv";
    let evaluated: serde_json::Value = serde_json::from_str(&folder.run(evaluated).success()).unwrap();
    assert_eq!(evaluated["trajectory"], report["errors"], "the report's errors are those of `evaluate`");
    assert!(
        evaluated["trajectory"]["absolute"]["end_position_percent"].as_f64().unwrap() < 3.0,
        "{evaluated:#}"
    );

    let html = folder.read("out/report.html");
    assert!(
        !html.contains("http://") && !html.contains("https://") && !html.contains("src=\"/"),
        "needs no network"
    );
    assert!(
        html.contains("data:image/jpeg;base64,") && html.contains("Pose errors") && html.contains("NEES/3")
    );
    // Encoded pictures may hold any letters.
    let words: Vec<_> = html
        .split("base64,")
        .map(|part| part.split_once('"').map_or(part, |(_, rest)| rest))
        .skip(1)
        .collect();
    assert!(words.len() == 6 && words.iter().all(|part| !part.contains("NaN")));
}

#[test]
fn scans_on_the_way_are_those_of_the_scan_and_make_a_grid() {
    let folder = simulated(12);
    folder.run(&format!("{RUN} --scan --out out")).success();
    folder
        .run("scan --rig sim/rig.toml --frames sim/frames --odometry sim/odometry.csv --out scan.csv")
        .success();
    assert_eq!(folder.read("out/scan.csv"), folder.read("scan.csv"));
    let yaml = folder.read("out/map.yaml");
    assert!(yaml.starts_with("image: map.pgm\nmode: trinary\nresolution: 0.05\norigin: ["), "{yaml}");
    let grid = image::open(folder.path("out/map.pgm")).unwrap().to_luma8();
    let of = |grey: u8| grid.pixels().filter(|pixel| pixel.0 == [grey]).count();
    let all = grid.pixels().count();
    assert_eq!(of(0) + of(205) + of(254), all);
    // A corridor 2 m wide, some 8 m of it seen, between walls.
    assert!(of(254) > 2000 && of(0) > 50 && of(205) > all / 4, "{} {} {all}", of(254), of(0));
    // Without wheels as well, by the run's own motion.
    folder.run("slam --rig sim/rig.toml --frames sim/frames --scan --out alone").success();
    assert_eq!(folder.read("alone/scan.csv").lines().count(), folder.read("scan.csv").lines().count());
}

#[test]
fn the_same_run_gives_the_same_files_and_moved_times_change_nothing_else() {
    let folder = simulated(12);
    folder.run(&format!("{RUN} --out one")).success();
    folder.run(&format!("{RUN} --out two")).success();
    for name in ["trajectory.csv", "map.csv", "observations.csv"] {
        assert_eq!(folder.read(&format!("one/{name}")), folder.read(&format!("two/{name}")));
    }
    // The same sequence on a Unix clock.
    let unix = |text: String| -> String {
        let shift = |line: &str| match line.split_once(',') {
            Some((time, rest)) => {
                time.parse::<f64>().map_or(line.to_owned(), |t| format!("{},{rest}", t + 1.7e9))
            }
            None => format!("{}", line.parse::<f64>().unwrap() + 1.7e9),
        };
        text.lines().map(|line| shift(line) + "\n").collect()
    };
    folder
        .write("late.txt", unix(folder.read("sim/times.txt")))
        .write("late.csv", unix(folder.read("sim/odometry.csv")));
    let late = "slam --rig sim/rig.toml --frames sim/frames --times late.txt --odometry late.csv --out three";
    folder.run(late).success();
    assert_eq!(
        column(&folder.read("one/trajectory.csv"), "x").len(),
        column(&folder.read("three/trajectory.csv"), "x").len()
    );
    let end =
        |run: &str| column(&folder.read(&format!("{run}/trajectory.csv")), "x")[11].parse::<f64>().unwrap();
    assert!((end("one") - end("three")).abs() < 1e-3, "{} {}", end("one"), end("three"));
}

#[test]
fn a_truncated_frame_is_named_and_the_sequence_goes_on() {
    let folder = simulated(6);
    let whole = std::fs::read(folder.path("sim/frames/000003.png")).unwrap();
    folder.write("sim/frames/000003.png", &whole[..whole.len() / 3]);
    let outcome = folder.run(&format!("{RUN} --out out --json"));
    assert!(
        outcome.stderr.contains("left out: sim/frames/000003.png: the picture is damaged"),
        "{}",
        outcome.stderr
    );
    let report: serde_json::Value = serde_json::from_str(&outcome.success()).unwrap();
    assert_eq!((&report["frames"], &report["frames_used"]), (&6.into(), &5.into()));
    assert!(report["left_out"][0].as_str().unwrap().contains("000003.png"));
}

#[test]
fn sequences_that_do_not_fit_together_are_refused() {
    let folder = simulated(4);
    let odometry = folder.read("sim/odometry.csv");
    let fails = |arguments: &str, words: &[&str]| folder.fails(&format!("{arguments} --out out"), words);

    folder.write("o.csv", odometry.lines().take(3).collect::<Vec<_>>().join("\n"));
    let with = |odometry: &str| format!("slam --rig sim/rig.toml --frames sim/frames --odometry {odometry}");
    fails(&with("o.csv"), &["o.csv: covers 0 s to 1.2 s, the frames need 0 s to 1.8 s"]);
    folder.write("o.csv", "t,v\n0,1\n1,1\n");
    fails(&with("o.csv"), &["o.csv: lacks the column `omega`"]);
    folder.write("o.csv", "t,v,omega\n0,1,0\n0,1,0\n");
    fails(&with("o.csv"), &["o.csv, line 3", "the line before", "at least 2 at different times"]);
    folder.write("o.csv", "t,v,omega\n0,1,0\n1,nan,0\n");
    fails(&with("o.csv"), &["o.csv, line 3", "`v` is `nan`"]);
    folder.write("o.csv", "t,v,omega\n0,1,0\n");
    fails(&with("o.csv"), &["o.csv: has 1 lines", "at least 2"]);

    for (times, words) in [
        ("0\n0.6\n0.5\n1.8\n", ["times.txt, line 3", "0.5 is before"]),
        ("0\n0.6\n0.6\n1.8\n", ["times.txt, line 3", "the same as"]),
        ("0\n0.6\n", ["times.txt: has 2 times for 4 pictures", "help:"]),
        ("0\nsoon\n1\n2\n", ["times.txt, line 2", "`soon` is not a finite number"]),
    ] {
        folder.write("times.txt", times);
        fails(&format!("{RUN} --times times.txt"), &words);
    }
    folder.write("elsewhen.tum", "1001 0 0 0 0 0 0 1\n1002 1 0 0 0 0 0 1\n");
    fails(
        &format!("{RUN} --truth elsewhen.tum"),
        &["elsewhen.tum: covers 1001 s to 1002 s", "no pose to compare"],
    );
    folder.write("empty/readme", "");
    fails(&RUN.replace("sim/frames", "empty"), &["empty: the folder holds no picture"]);
    fails(&RUN.replace("sim/frames", "absent"), &["absent: no such file or folder"]);
    folder.write("rig.toml", folder.read("sim/rig.toml").replace("width = 320", "width = 330"));
    fails(&RUN.replace("sim/rig.toml", "rig.toml"), &["000000.png: the picture is 320×240", "330×240"]);
    folder.write("rig.toml", folder.read("sim/rig.toml") + "[filter]\nvariant = \"inverse\"\n");
    fails(
        &RUN.replace("sim/rig.toml", "rig.toml"),
        &["`filter.variant` is \"inverse\"", "nearest one is \"invariant\""],
    );
    folder.write("rig.toml", folder.read("sim/rig.toml") + "[association]\nconfirms = 2\n");
    fails(&RUN.replace("sim/rig.toml", "rig.toml"), &["`association.confirms`", "`association.confirm`"]);
}

#[test]
fn without_odometry_the_motion_comes_from_the_pictures() {
    let folder = simulated(16);
    let run = "slam --rig sim/rig.toml --frames sim/frames --truth sim/truth.tum --out out --json";
    let report: serde_json::Value = serde_json::from_str(&folder.run(run).success()).unwrap();
    let (path, truth) = (report["path"].as_f64().unwrap(), report["errors"]["path"].as_f64().unwrap());
    assert!((path / truth - 1.0).abs() < 0.05, "{path} m of {truth} m");
    assert!(folder.read("out/report.html").contains("the motion came from the pictures"));
}

#[test]
fn the_real_road_is_driven_to_its_end() {
    let Some(road) = data("road_a") else { return };
    let folder = Folder::new();
    let road = road.display();
    let run = format!(
        "slam --rig {road}/rig.toml --frames {road}/image_l --odometry {road}/odometry.csv --truth {road}/truth.tum --out out --json"
    );
    let report: serde_json::Value = serde_json::from_str(&folder.run(&run).success()).unwrap();
    assert_eq!((&report["frames_used"], &report["left_out"]), (&51.into(), &serde_json::json!([])));
    assert!((report["path"].as_f64().unwrap() - 59.9).abs() < 3.0, "{report:#}");
}

#[test]
fn a_robot_that_pitches_is_mapped_with_the_attitude_that_an_imu_tells() {
    let folder = Folder::new();
    folder.run("simulate --scene corridor --frames 60 --walkers 0 --seed 3 --pitch 1.5 --out sim").success();
    let slam =
        "slam --rig sim/rig.toml --frames sim/frames --odometry sim/odometry.csv --truth sim/truth.tum";
    folder.run(&format!("{slam} --attitude sim/attitude.csv --out told")).success();
    folder.run(&format!("{slam} --out untold")).success();
    let of = |out: &str| -> serde_json::Value {
        serde_json::from_str(&folder.read(&format!("{out}/report.json"))).unwrap()
    };
    let (told, untold) = (of("told"), of("untold"));
    assert_eq!(told["verdict"], "consistent", "{told:#}");
    assert_eq!(untold["verdict"], "doubtful", "{untold:#}");
    assert!(untold["reason"].as_str().unwrap().contains("pitches"), "{untold:#}");
    assert!(untold["warnings"].to_string().contains("sway = "), "{untold:#}");

    folder.write("degrees.csv", "t,pitch,roll\n0,1.5,0\n36,1.5,0\n");
    let refused = folder.run(&format!("{slam} --attitude degrees.csv --out no"));
    assert!(refused.stderr.contains("degrees.csv") && refused.stderr.contains("radians"), "{refused:?}");
    folder.write("later.csv", "t,pitch,roll\n900,0,0\n");
    let refused = folder.run(&format!("{slam} --attitude later.csv --out no"));
    assert!(refused.stderr.contains("later.csv") && refused.stderr.contains("900 s"), "{refused:?}");
}
