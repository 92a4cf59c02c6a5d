//! `calibrate-mount`: what it fits, what it writes, what it refuses.
use crate::command::{Folder, RIG};

/// Exact points for a mount 0.41 m up, 11.5° down, 0.5° rolled, 1° to the left.
fn points() -> String {
    use monorange_core::geometry::{Camera, Distortion, Mount, RangeFinder};
    use nalgebra::Vector2;
    let lens = Distortion { k1: -0.22776, k2: 0.36413, p1: -0.00545, p2: -0.00192, k3: 0.0 };
    let camera = Camera::new(320, 240, [365.12674, 365.02905], [145.79917, 114.50956], 0.0, lens).unwrap();
    let [tilt, roll, yaw] = [11.5_f64, 0.5, 1.0].map(f64::to_radians);
    let finder = RangeFinder::new(camera, Mount::new([0.41, tilt, roll, yaw, 0.0, 0.0]).unwrap());
    let mut csv = "u,v,x,y\n".to_owned();
    for [u, v] in [[40.0, 220.0], [280.0, 215.0], [60.0, 110.0], [250.0, 105.0], [150.0, 160.0]] {
        let place = finder.floor_from_pixel(Vector2::new(u, v)).unwrap();
        csv += &format!("{u},{v},{},{}\n", place.x, place.y);
    }
    csv
}

#[test]
fn exact_points_give_the_mount_and_a_rig_file_with_it() {
    let folder = Folder::new();
    folder
        .write("rig.toml", format!("# my robot\n{RIG}\n[filter]\ngate = \"hard\"\n"))
        .write("points.csv", points());
    let json =
        folder.run("calibrate-mount --rig rig.toml --points points.csv --out fitted.toml --json").success();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    for (parameter, should) in json["parameters"].as_array().unwrap().iter().zip([0.41, 11.5, 0.5, 1.0]) {
        assert!((parameter["fitted"].as_f64().unwrap() - should).abs() < 1e-6, "{parameter}");
    }
    let rig = folder.read("fitted.toml");
    assert!(
        rig.starts_with("# my robot") && rig.contains("gate = \"hard\"") && rig.contains("height = 0.41\n"),
        "{rig}"
    );
    folder.write("pixels.csv", "u,v\n150,160\n");
    folder.run("range --rig fitted.toml pixels.csv").success();
}

#[test]
fn a_point_that_contradicts_the_others_is_named() {
    let folder = Folder::new();
    let bad = points().replacen("60,110,", "60,130,", 1);
    folder.write("rig.toml", RIG).write("points.csv", bad);
    let text = folder
        .run("calibrate-mount --rig rig.toml --points points.csv --fit tilt,roll,yaw --pixel-std 0.3")
        .success();
    assert!(text.contains("point 3 contradicts all others"), "{text}");
}

#[test]
fn what_cannot_be_fitted_is_refused_with_a_remedy() {
    let folder = Folder::new();
    folder.write("rig.toml", RIG).write("one.csv", "u,v,range,bearing\n150,160,1.2,0\n");
    folder.write("sky.csv", "u,v,range,bearing\n150,10,1.2,0\n40,200,1,0.2\n200,210,1,-0.2\n");
    folder.write("negative.csv", "u,v,range,bearing\n150,160,-1.2,0\n");
    for (points, words) in [
        ("one.csv", "fit less"),
        ("sky.csv", "point 1 at pixel (150, 10) does not see the floor"),
        ("negative.csv", "negative.csv, line 2"),
    ] {
        let refused = folder.run(&format!("calibrate-mount --rig rig.toml --points {points} --out out.toml"));
        assert_eq!(refused.status, 1);
        assert!(refused.stderr.contains(words), "{}", refused.stderr);
    }
    assert!(!folder.names().contains(&"out.toml".to_owned()));
    assert_eq!(folder.run("calibrate-mount --rig rig.toml").status, 2);
}
