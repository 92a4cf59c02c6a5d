//! `range` against exact geometry, and its files.
use crate::command::{Folder, RIG, column};

const FLAT: &str = "[camera]\nwidth = 320\nheight = 240\nfocal = [365.0, 365.0]\nprincipal = [160.0, 120.0]\npixel_std = [0.5, 0.5]\n\n[mount]\nheight = 0.4\ntilt_deg = 12.0\nheight_std = 0.01\ntilt_std_deg = 0\nroll_std_deg = 0\nyaw_std_deg = 0\nforward_std = 0\nleft_std = 0\n";

#[test]
fn range_and_bearing_are_those_of_ray_and_plane() {
    let folder = Folder::new();
    folder.write("rig.toml", FLAT).write("pixels.csv", "u,v\n160,120\n60,200\n300,90\n");
    let csv = folder.run("range --rig rig.toml pixels.csv").success();
    assert_eq!(
        csv.lines().next().unwrap(),
        "u,v,range,bearing,var_range,cov_range_bearing,var_bearing,x,y,status"
    );
    let tilt = 12_f64.to_radians();
    for ((u, v), (range, bearing)) in [(160.0, 120.0), (60.0, 200.0), (300.0, 90.0)]
        .into_iter()
        .zip(column(&csv, "range").into_iter().zip(column(&csv, "bearing")))
    {
        let (x, y) = ((u - 160.0) / 365.0, (v - 120.0) / 365.0);
        let down = tilt.sin() + y * tilt.cos();
        let (forward, left) = (0.4 * (tilt.cos() - y * tilt.sin()) / down, -0.4 * x / down);
        assert!((range.parse::<f64>().unwrap() - forward.hypot(left)).abs() < 1e-12);
        assert!((bearing.parse::<f64>().unwrap() - left.atan2(forward)).abs() < 1e-12);
    }
}

#[test]
fn the_variance_is_the_slope_of_the_range_squared() {
    let folder = Folder::new();
    folder.write("rig.toml", FLAT);
    let shifted = "u,v\n160,119.999\n160,120.001\n160,120\n";
    let csv = folder.run_with_input("range --rig rig.toml", shifted).success();
    let ranges: Vec<f64> = column(&csv, "range").iter().map(|cell| cell.parse().unwrap()).collect();
    let slope = (ranges[1] - ranges[0]) / 0.002;
    let variance: f64 = column(&csv, "var_range")[2].parse().unwrap();
    assert!((variance / (0.25 * slope * slope) - 1.0).abs() < 1e-6);

    let total = folder.run_with_input("range --rig rig.toml --mount-uncertainty", shifted).success();
    let total: f64 = column(&total, "var_range")[2].parse().unwrap();
    let height_share = ranges[2] / 0.4 * 0.01; // range grows in proportion to height
    assert!((total - variance - height_share * height_share).abs() < 1e-12);
}

#[test]
fn a_box_stands_where_its_lower_edge_is_and_keeps_its_label() {
    let folder = Folder::new();
    folder.write("rig.toml", FLAT);
    let boxes = "label,u0,v0,u1,v1,score\nchair,100,60,220,200,0.9\n\"box, red\",10,20,40,5,0.8\ntable,0,100,300,239,0.7\n";
    let csv = folder.run_with_input("range --rig rig.toml", boxes).success();
    assert_eq!(
        csv.lines().next().unwrap(),
        "u,v,range,bearing,var_range,cov_range_bearing,var_bearing,x,y,status,label,score"
    );
    assert_eq!(column(&csv, "status"), ["ok", "above_horizon", "outside_image"]);
    assert!(csv.lines().nth(2).unwrap().ends_with(",above_horizon,\"box, red\",0.8"), "{csv}");
    // The same as the foot's pixel with the box's deviations: 2 px along the rows, a sixth of the width across.
    let plain =
        folder.run_with_input("range --rig rig.toml", "u,v\n160,200\n160,200.001\n161,200\n").success();
    let number = |csv: &str, name: &str, row: usize| column(csv, name)[row].parse::<f64>().unwrap();
    assert_eq!(number(&csv, "range", 0), number(&plain, "range", 0));
    let by_v = (number(&plain, "range", 1) - number(&plain, "range", 0)) / 0.001;
    assert!((number(&csv, "var_range", 0).sqrt() / (2.0 * by_v.abs()) - 1.0).abs() < 1e-3, "{csv}");
    let by_u = number(&plain, "bearing", 2) - number(&plain, "bearing", 0);
    assert!((number(&csv, "var_bearing", 0).sqrt() / (20.0 * by_u.abs()) - 1.0).abs() < 1e-2, "{csv}");
    folder.fails("range --rig rig.toml --box-std 0 boxes.csv", &["boxes.csv"]);
    folder
        .write("boxes.csv", boxes)
        .fails("range --rig rig.toml --box-std 0 boxes.csv", &["--box-std is 0", "help:"]);
}

#[test]
fn a_target_above_the_floor_is_ranged_at_its_height() {
    let folder = Folder::new();
    folder.write("rig.toml", FLAT.replace("tilt_deg = 12.0", "tilt_deg = -12.0"));
    // The optical axis goes 12° up: it meets 1.4 m, a metre above the lens, at 1/tan 12°.
    let csv = folder
        .run_with_input("range --rig rig.toml --height-above-floor 1.4", "u,v\n160,120\n160,239\n")
        .success();
    let range: f64 = column(&csv, "range")[0].parse().unwrap();
    assert!((range - 1.0 / 12_f64.to_radians().tan()).abs() < 1e-12, "{range}");
    assert_eq!(column(&csv, "status"), ["ok", "below_horizon"]);
    folder.write("pixels.csv", "u,v\n160,120\n");
    folder.fails(
        "range --rig rig.toml --height-above-floor 0.4 pixels.csv",
        &["0.4", "height of the lens", "help:"],
    );
    folder.fails("range --rig rig.toml --height-above-floor inf pixels.csv", &["finite"]);
}

#[test]
fn every_pixel_has_a_status_and_numbers_only_when_ok() {
    let folder = Folder::new();
    folder.write("rig.toml", RIG);
    let csv =
        folder.run_with_input("range --rig rig.toml", "u,v\n160,200\n160,2\n400,100\n-0.6,100\n").success();
    assert_eq!(column(&csv, "status"), ["ok", "above_horizon", "outside_image", "outside_image"]);
    assert!(csv.lines().skip(2).all(|line| line.contains(",,,,,,,,")), "{csv}");

    let strong_lens = FLAT.replace("[mount]", "distortion = [-0.9, 0.0, 0.0, 0.0]\n[mount]");
    folder.write("strong.toml", strong_lens);
    let csv = folder.run_with_input("range --rig strong.toml", "u,v\n319,239\n").success();
    assert_eq!(column(&csv, "status"), ["outside_lens_model"]);
}

#[test]
fn out_writes_the_file_instead() {
    let folder = Folder::new();
    folder.write("rig.toml", RIG).write("pixels.csv", "# a comment\nid,u,v\n7, 160 ,200\n");
    assert_eq!(folder.run("range --rig rig.toml pixels.csv --out made/ranges.csv").success(), "");
    assert_eq!(folder.read("made/ranges.csv").lines().count(), 2);
}

#[test]
fn camera_files_of_other_programs_mean_the_same_camera() {
    let folder = Folder::new();
    folder.write("rig.toml", RIG);
    let expected = folder.run_with_input("range --rig rig.toml", "u,v\n160,200\n40,150\n300,230\n").success();
    let mount = "[camera]\ncamera_info = \"cameras/FILE\"\npixel_std = [0.10083, 0.10936]\n[mount]\nheight = 0.4\ntilt_deg = 12\n";
    let data = "365.12674, 0., 145.79917, 0., 365.02905, 114.50956, 0., 0., 1.";
    let lens = "-0.22776, 0.36413, -0.00545, -0.00192";
    let files = [
        (
            "ros.yaml",
            format!(
                "image_width: 320\nimage_height: 240\ncamera_name: left\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [{data}]\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [{lens}, 0.0]\n"
            ),
        ),
        (
            "message.yaml",
            format!(
                "header:\n  frame_id: cam\nheight: 240\nwidth: 320\ndistortion_model: plumb_bob\nD: [{lens}, 0.0]\nK: [{data}]\n"
            ),
        ),
        (
            "opencv.yml",
            format!(
                "%YAML:1.0\n---\ncalibration_time: \"Mon 01 Jan\"\nimage_width: 320\nimage_height: 240\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ {data} ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ {lens}, 0. ]\n"
            ),
        ),
        (
            "opencv.xml",
            format!(
                "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_Width>320</image_Width>\n<image_Height>240</image_Height>\n<Camera_Matrix type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt>\n<data>\n{}</data></Camera_Matrix>\n<Distortion_Coefficients type_id=\"opencv-matrix\"><rows>5</rows><cols>1</cols><dt>d</dt><data>{} 0.</data></Distortion_Coefficients>\n</opencv_storage>\n",
                data.replace(',', ""),
                lens.replace(',', "")
            ),
        ),
        (
            "camchain.yaml",
            format!(
                "cam0:\n  cam_overlaps: []\n  camera_model: pinhole\n  distortion_coeffs: [{lens}]\n  distortion_model: radtan\n  intrinsics: [365.12674, 365.02905, 145.79917, 114.50956]\n  resolution: [320, 240]\n  rostopic: /cam0\n"
            ),
        ),
    ];
    for (name, content) in files {
        folder.write(&format!("cameras/{name}"), content).write("other.toml", mount.replace("FILE", name));
        let csv =
            folder.run_with_input("range --rig other.toml", "u,v\n160,200\n40,150\n300,230\n").success();
        assert_eq!(csv, expected, "{name}");
    }
}

#[test]
fn opencvs_own_calibration_file_is_read() {
    let Some(file) = crate::command::data("opencv/left_intrinsics.yml") else { return };
    let folder = Folder::new();
    folder.write("rig.toml", format!("camera_info = {file:?}\n[mount]\nheight = 1.0\ntilt_deg = 30\n"));
    let csv = folder
        .run_with_input("range --rig rig.toml", "u,v\n342.28315473308373,235.57082909788173\n")
        .success();
    let range: f64 = column(&csv, "range")[0].parse().unwrap();
    assert!((range - 3_f64.sqrt()).abs() < 1e-12, "the principal ray goes 30° down: {range}");
}

#[cfg(unix)]
#[test]
fn a_pipe_or_a_link_is_written_to_and_not_replaced() {
    use std::{fs, os::unix::fs::FileTypeExt, process::Command};
    let folder = Folder::new();
    folder.write("rig.toml", RIG).write("pixels.csv", "u,v\n160,200\n").write("real.csv", "old");
    let plain = folder.run("range --rig rig.toml pixels.csv").success();

    assert!(Command::new("mkfifo").arg(folder.path("pipe")).status().unwrap().success());
    let pipe = folder.path("pipe");
    let reader = std::thread::spawn(move || fs::read_to_string(pipe).unwrap());
    folder.run("range --rig rig.toml pixels.csv --out pipe").success();
    assert!(fs::symlink_metadata(folder.path("pipe")).unwrap().file_type().is_fifo());
    assert_eq!(reader.join().unwrap(), plain);

    std::os::unix::fs::symlink("real.csv", folder.path("link.csv")).unwrap();
    folder.run("range --rig rig.toml pixels.csv --out link.csv").success();
    assert!(fs::symlink_metadata(folder.path("link.csv")).unwrap().is_symlink());
    assert_eq!(folder.read("real.csv"), plain);
}
