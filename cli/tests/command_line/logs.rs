//! Logs as people have them: gaps, lines twice, names that are missing, clocks in nanoseconds, truth that starts late.
use crate::command::{Folder, column};
use serde_json::Value;

/// A straight drive at 1 m/s past two landmarks, with names.
fn drive() -> Folder {
    let folder = Folder::new();
    let (mut odometry, mut truth, mut measured) =
        (String::from("t,v,omega\n"), String::from("t,x,y,heading\n"), String::from("t,range,bearing,id\n"));
    for tick in 0..=60 {
        let t = f64::from(tick) / 10.0;
        odometry += &format!("{t},1,0\n");
        truth += &format!("{t},{t},0,0\n");
        for (id, [x, y]) in [[4.0, 2.0], [8.0, -2.0]].iter().enumerate() {
            measured += &format!("{t},{},{},{id}\n", (x - t).hypot(*y), y.atan2(x - t));
        }
    }
    folder.write("o.csv", odometry).write("t.csv", truth).write("m.csv", measured);
    folder
}

const RUN: &str = "slam-log --odometry o.csv --measurements m.csv --truth t.csv --out out";

fn report(folder: &Folder, run: &str) -> (Value, String) {
    let outcome = folder.run(run);
    assert_eq!(outcome.status, 0, "{}", outcome.stderr);
    (serde_json::from_str(&folder.read("out/report.json")).unwrap(), outcome.stderr)
}

#[test]
fn warnings_are_lines_on_standard_error_and_in_the_report() {
    let folder = drive();
    let (sound, said) = report(&folder, RUN);
    assert!(said.is_empty() && sound.get("warnings").is_none(), "{said}");
    let twice = folder.read("o.csv").replace("\n3,1,0\n", "\n3,1,0\n3,1,0\n");
    folder.write("o.csv", twice);
    let (again, said) = report(&folder, RUN);
    assert_eq!(again["errors"], sound["errors"], "a line that is there twice changes nothing");
    let line = said.strip_prefix("warning: ").unwrap().trim_end();
    assert!(line.starts_with("o.csv, line 33: ") && !line.contains('\n'), "{said}");
    assert_eq!(again["warnings"], serde_json::json!([line]));
}

#[test]
fn a_measurement_without_a_name_is_left_out_and_counted() {
    let folder = drive();
    let unnamed = folder.read("m.csv").replacen(",1\n", ",\n", 1);
    folder.write("m.csv", unnamed);
    let (report, said) = report(&folder, RUN);
    assert_eq!((&report["settings"]["association"], &report["landmarks"]), (&"known".into(), &2.into()));
    assert_eq!(report["left_out"], serde_json::json!(["1 of 122 measurements have no `id`"]));
    assert!(said.contains("warning: m.csv: 1 of 122"), "{said}");
}

#[test]
fn a_gap_of_the_wheels_makes_no_way_and_no_certainty() {
    let folder = drive();
    let standing: String = folder
        .read("o.csv")
        .lines()
        .map(|line| match line.split(',').next().unwrap().parse::<f64>() {
            Ok(t) if t > 3.0 => format!("{},1,0\n", t + 60.0),
            _ => format!("{line}\n"),
        })
        .collect();
    folder.write("o.csv", standing).write("m.csv", "t,range,bearing,id\n0.5,4,0.5,0\n1,3.5,0.5,0\n");
    let run = "slam-log --odometry o.csv --measurements m.csv --out out";
    let (report, said) = report(&folder, run);
    assert!(said.contains("says nothing for 60.100 s from 3 s on"), "{said}");
    assert!(report["path"].as_f64().unwrap() < 7.0, "{report:#}");
    assert!(report["end_std"][0].as_f64().unwrap() > 20.0, "{report:#}");
}

#[test]
fn clocks_in_nanoseconds_are_read_as_seconds() {
    let folder = drive();
    let (seconds, _) = report(&folder, RUN);
    for name in ["o.csv", "t.csv", "m.csv"] {
        let text: String = folder
            .read(name)
            .lines()
            .map(|line| match line.split_once(',') {
                Some((t, rest)) if t != "t" => format!(
                    "{}000000,{rest}\n",
                    1_403_636_579_000 + (t.parse::<f64>().unwrap() * 1000.0).round() as i64
                ),
                _ => format!("{line}\n"),
            })
            .collect();
        folder.write(name, text);
    }
    let (report, said) = report(&folder, RUN);
    assert!(
        (report["seconds"].as_f64().unwrap() - seconds["seconds"].as_f64().unwrap()).abs() < 1e-3,
        "{report:#}"
    );
    assert_eq!(
        said.lines().filter(|line| line.contains("nanoseconds since 1970")).count(),
        1,
        "one for three files: {said}"
    );
}

#[test]
fn truth_that_begins_late_or_ends_early_is_compared_where_it_is() {
    let folder = drive();
    let truth = folder.read("t.csv");
    let keep = |from: f64, to: f64| -> String {
        truth
            .lines()
            .filter(|line| {
                line.split(',').next().unwrap().parse::<f64>().map_or(true, |t| (from..=to).contains(&t))
            })
            .map(|line| format!("{line}\n"))
            .collect()
    };
    folder.write("t.csv", keep(2.0, 9.0));
    let (late, said) = report(&folder, RUN);
    assert!(
        late["errors"]["absolute"]["end_position"].as_f64().unwrap() < 0.05 && said.contains("from 2 s on"),
        "{said}"
    );
    folder.write("t.csv", keep(0.0, 0.5));
    let said = folder.run(RUN).success();
    assert!(
        said.contains("compared   6 of 62 poses")
            && said.contains("last error")
            && !said.contains("end error"),
        "{said}"
    );
}

#[test]
fn exact_sensors_and_full_maps_are_answered() {
    let folder = drive();
    for (flag, word) in [("--range-std 0", "--range-std 0"), ("--bearing-std 0", "--bearing-std 0")] {
        folder.fails(&format!("{RUN} {flag}"), &[word, "default"]);
    }
    let (report, said) = report(&folder, &format!("{RUN} --max-landmarks 1"));
    assert!(
        report["births_without_room"].as_u64().unwrap() > 0 && said.contains("no room for a landmark"),
        "{said}"
    );
}

#[test]
fn a_motionless_truth_has_no_scale() {
    let folder = drive();
    folder.write("still.csv", "t,x,y,heading\n0,1,1,0\n1,1,1,0\n2,1,1,0\n");
    folder.fails(
        "evaluate --truth still.csv --estimate t.csv --align sim2",
        &["still.csv: the truth does not move", "--align none"],
    );
    let said = folder.run("evaluate --truth still.csv --estimate t.csv --align se2");
    assert!(
        said.status == 0 && said.stderr.contains("warning: still.csv: the truth does not move"),
        "{said:?}"
    );
}

#[test]
fn the_points_of_a_calibration_are_metres() {
    let folder = Folder::new();
    folder.write("rig.toml", crate::command::RIG).write(
        "p.csv",
        "u,v,range,bearing\n60,200,88,0.26\n250,195,92,-0.30\n60,150,133,0.25\n240,140,148,-0.26\n",
    );
    folder.fails("calibrate-mount --rig rig.toml --points p.csv --fit tilt", &["p.csv", "centimetres"]);
}

#[test]
fn wrapped_increments_are_turns_of_less_than_half_a_circle() {
    let folder = drive();
    folder.write("o.csv", "t,dx,dy,dtheta\n0,0,0,0\n1,1,0,0.2\n2,1,0,-6.08318\n3,1,0,0.2\n");
    folder.write("m.csv", "t,range,bearing,id\n0.5,4,0.5,0\n1,3.5,0.5,0\n");
    let (_, said) = report(&folder, "slam-log --odometry o.csv --measurements m.csv --out out");
    assert!(said.contains("o.csv, line 4: `dtheta` is -6.08318"), "{said}");
    let trajectory = folder.read("out/trajectory.csv");
    let last: f64 = column(&trajectory, "heading").last().unwrap().parse().unwrap();
    assert!((last - 0.6).abs() < 0.05, "{trajectory}");
}
