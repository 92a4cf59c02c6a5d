//! `evaluate` on trajectories with known errors.
use crate::command::Folder;
use serde_json::Value;

fn evaluate(folder: &Folder, arguments: &str) -> Value {
    serde_json::from_str(&folder.run(&format!("evaluate {arguments}")).success()).unwrap()
}

fn near(value: &Value, expected: f64) -> bool {
    value.as_f64().is_some_and(|value| (value - expected).abs() < 1e-9)
}

#[test]
fn errors_are_those_that_were_put_in() {
    let folder = Folder::new();
    let truth: String = (0..=10).map(|k| format!("{k} {k} 0 0 0 0 0 1\n")).collect();
    let covariance = "0.04,0,0,0.04,0,0.0001";
    let estimate: String = (0..=10).map(|k| format!("{k},{k},0.2,0,{covariance}\n")).collect();
    folder.write("truth.tum", truth);
    folder.write(
        "estimate.csv",
        format!("t,x,y,heading,var_x,cov_xy,cov_xh,var_y,cov_yh,var_h\n{estimate}99,0,0,0,{covariance}\n"),
    );
    let raw = evaluate(&folder, "--truth truth.tum --estimate estimate.csv --delta 2");
    let trajectory = &raw["trajectory"];
    assert!(near(&trajectory["absolute"]["position"]["rms"], 0.2), "{raw:#}");
    assert!(near(&trajectory["absolute"]["end_position_percent"], 2.0));
    assert!(near(&trajectory["relative"]["translation"]["max"], 0.0));
    assert!(near(&trajectory["nees"]["mean"], 1.0) && near(&trajectory["nees"]["inside_3_sigma"], 1.0));
    assert_eq!(raw["poses_without_truth"], 1);
    let aligned = evaluate(&folder, "--truth truth.tum --estimate estimate.csv --align se2");
    assert!(
        near(&aligned["trajectory"]["absolute"]["position"]["max"], 0.0)
            && aligned["trajectory"]["nees"].is_null()
    );
}

#[test]
fn maps_are_compared_by_distance() {
    let folder = Folder::new();
    folder.write("truth.tum", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n");
    folder.write("landmarks.csv", "id,x,y\n1,0,0\n2,5,0\n3,0,5\n");
    folder.write(
        "map.csv",
        "id,x,y,var_x,cov_xy,var_y,seen,first_t,last_t\n8,5.1,0,0.01,0,0.01,4,0,1\n9,9,9,0.01,0,0.01,4,0,1\n",
    );
    let both =
        evaluate(&folder, "--truth truth.tum --estimate truth.tum --true-map landmarks.csv --map map.csv");
    let map = &both["map"];
    assert_eq!((&map["matched"], &map["spurious"], &map["truth"]), (&1.into(), &1.into(), &3.into()));
    assert!(near(&map["position"]["rms"], 0.1) && near(&map["nees_per_dof"], 0.5));
}

#[test]
fn the_road_against_itself_has_no_error() {
    let Some(truth) = crate::command::data("road_a/truth.tum") else { return };
    let folder = Folder::new();
    let truth = truth.display();
    let evaluation = evaluate(&folder, &format!("--truth {truth} --estimate {truth} --delta 10"));
    assert!(near(&evaluation["trajectory"]["absolute"]["position"]["max"], 0.0));
    assert!((evaluation["trajectory"]["path"].as_f64().unwrap() - 59.9).abs() < 0.1);
}
