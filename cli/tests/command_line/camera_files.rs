//! Camera files of every program that people calibrate with, and what is not read of them.
use crate::command::{Folder, column};

const MOUNT: &str = "[mount]\nheight = 0.4\ntilt_deg = 12\n";

/// The range of a pixel by a rig with the camera file, and what was said.
fn range(camera: &str, more: &str) -> (f64, String) {
    let folder = Folder::new();
    folder.write("camera.yaml", camera).write("rig.toml", format!("{}{MOUNT}", rig(more)));
    let arguments = if more.starts_with("--") { more } else { "" };
    let outcome = folder.run_with_input(&format!("range --rig rig.toml {arguments}"), "u,v\n320,400\n");
    assert_eq!(outcome.status, 0, "{camera}\n{}", outcome.stderr);
    (column(&outcome.stdout, "range")[0].parse().unwrap(), outcome.stderr)
}

fn rig(more: &str) -> String {
    let size = if more.starts_with("--") { "" } else { more };
    format!("camera_info = \"camera.yaml\"\n{size}")
}

fn refused(camera: &str, words: &[&str]) {
    let folder = Folder::new();
    folder
        .write("camera.yaml", camera)
        .write("rig.toml", format!("{}{MOUNT}", rig("")))
        .write("p.csv", "u,v\n320,400\n");
    folder.fails("range --rig rig.toml p.csv", words);
}

const COEFFICIENTS: &str = "-0.3, 0.1, 0.001, -0.002";
const ROS: &str = "image_width: 640\nimage_height: 480\ncamera_matrix: {rows: 3, cols: 3, data: [600, 0, 320, 0, 610, 240, 0, 0, 1]}\n\
                   distortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: [-0.3, 0.1, 0.001, -0.002, 0]}\n";

#[test]
fn the_same_camera_comes_of_every_form() {
    let (expected, said) = range(ROS, "");
    assert_eq!(said, "");
    let kalibr = format!(
        "  camera_model: pinhole\n  intrinsics: [600, 610, 320, 240]\n  distortion_model: radtan\n  distortion_coeffs: [{COEFFICIENTS}]\n  resolution: [640, 480]\n  rostopic: /cam\n"
    );
    let orb = "k1: -0.3\nCamera.k2: 0.1\nCamera.p1: 0.001\nCamera.p2: -0.002\nCamera.width: 640\nCamera.height: 480\nORBextractor.nFeatures: 1000\nCamera.fps: 20\n";
    for form in [
        // A message of `ros2 topic echo`.
        "header:\n  stamp:\n    sec: 1\n  frame_id: c\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob\nd:\n- -0.3\n- 0.1\n- 0.001\n- -0.002\n- 0.0\nk:\n- 600.0\n- 0.0\n- 320.0\n- 0.0\n- 610.0\n- 240.0\n- 0.0\n- 0.0\n- 1.0\nbinning_x: 0\nbinning_y: 0\nroi:\n  x_offset: 0\n  y_offset: 0\n  height: 0\n  width: 0\n  do_rectify: false\n---\n".to_owned(),
        // Nested lists, as OpenCV's Python examples write them.
        format!(
            "image_width: 640\nimage_height: 480\ncamera_matrix: [[600, 0, 320], [0, 610, 240], [0, 0, 1]]\ndist_coeff: [[{COEFFICIENTS}, 0]]\n"
        ),
        format!(
            "%YAML:1.0\n---\nCameraMat: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [600, 0, 320, 0, 610, 240, 0, 0, 1]\nDistCoeff: !!opencv-matrix\n   rows: 1\n   cols: 4\n   dt: d\n   data: [{COEFFICIENTS}]\nImageSize: [640, 480]\n"
        ),
        format!(
            "<?xml version=\"1.0\"?>\n<opencv_storage><image_width>640</image_width><image_height>480</image_height><camera_matrix type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt><data>600 0 320 0 610 240 0 0 1</data></camera_matrix><distortion_coefficients><rows>1</rows><cols>4</cols><dt>d</dt><data>{}</data></distortion_coefficients></opencv_storage>",
            COEFFICIENTS.replace(',', "")
        ),
        format!("cam0:\n{kalibr}"),
        format!(
            "sensor_type: camera\ncomment: cam0\nT_BS: {{cols: 4, rows: 4, data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}}\nrate_hz: 20\nresolution: [640, 480]\ncamera_model: pinhole\nintrinsics: [600, 610, 320, 240]\ndistortion_model: radial-tangential\ndistortion_coefficients: [{COEFFICIENTS}]\n"
        ),
        format!(
            "%YAML:1.0\n\nCamera.type: \"PinHole\"\nCamera.fx: 600\nCamera.fy: 610\nCamera.cx: 320\nCamera.cy: 240\nCamera.{orb}"
        ),
        // ORB-SLAM3: what two cameras share, and the other one.
        format!(
            "%YAML:1.0\nFile.version: \"1.0\"\nCamera.type: \"PinHole\"\nCamera1.fx: 600\nCamera1.fy: 610\nCamera1.cx: 320\nCamera1.cy: 240\n{}Camera.newWidth: 320\nCamera.RGB: 1\n",
            orb.replace("Camera.p", "Camera1.p").replace("Camera.k", "Camera1.k").replacen("k1", "Camera1.k1", 1)
        ),
        // OpenVSLAM.
        "Camera:\n  setup: monocular\n  model: perspective\n  fx: 600\n  fy: 610\n  cx: 320\n  cy: 240\n  k1: -0.3\n  k2: 0.1\n  p1: 0.001\n  p2: -0.002\n  k3: 0\n  cols: 640\n  rows: 480\n  color_order: RGB\n".to_owned(),
        // nerfstudio's transforms.json.
        "{\"w\": 640, \"h\": 480, \"fl_x\": 600, \"fl_y\": 610, \"cx\": 320, \"cy\": 240, \"k1\": -0.3, \"k2\": 0.1, \"p1\": 0.001, \"p2\": -0.002, \"camera_model\": \"OPENCV\", \"frames\": []}".to_owned(),
        "model_type: PINHOLE\ncamera_name: c\nimage_width: 640\nimage_height: 480\ndistortion_parameters:\n   k1: -0.3\n   k2: 0.1\n   p1: 0.001\n   p2: -0.002\nprojection_parameters:\n   fx: 600\n   fy: 610\n   cx: 320\n   cy: 240\n".to_owned(),
        format!(
            "# oST version 5.0 parameters\n\n\n[image]\n\nwidth\n640\n\nheight\n480\n\n[narrow_stereo]\n\ncamera matrix\n600 0 320\n0 610 240\n0 0 1\n\ndistortion\n{} 0\n\nrectification\n1 0 0\n0 1 0\n0 0 1\n\nprojection\n1 0 0 0\n0 1 0 0\n0 0 1 0\n",
            COEFFICIENTS.replace(',', "")
        ),
    ] {
        let (found, said) = range(&form, "");
        assert!((found - expected).abs() < 1e-9, "{found} for {expected}: {form}");
        assert_eq!(said, "", "{form}");
    }
}

#[test]
fn kittis_calibration_is_of_rectified_pictures_and_of_a_size_that_the_rig_gives() {
    let kitti = "P0: 6.0e+02 0 3.2e+02 0 0 6.0e+02 2.4e+02 0 0 0 1 0\nP1: 6.0e+02 0 3.2e+02 -30 0 6.0e+02 2.4e+02 0 0 0 1 0\nTr: 1 0 0 0 0 1 0 0 0 0 1 0\n";
    refused(kitti, &["camera.yaml", "does not say the picture's size", "[camera]"]);
    let (_, said) = range(kitti, "[camera]\nwidth = 640\nheight = 480\n");
    assert!(said.contains("rectified") && said.contains("--camera N"), "{said}");
}

#[test]
fn of_several_cameras_one_is_chosen_by_its_number() {
    let camera = |focal: f64| {
        format!(
            "  camera_model: pinhole\n  intrinsics: [{focal}, {focal}, 320, 240]\n  distortion_model: none\n  distortion_coeffs: []\n  resolution: [640, 480]\n"
        )
    };
    let two = format!("cam0:\n{}cam1:\n{}", camera(600.0), camera(500.0));
    let (first, said) = range(&two, "");
    assert!(
        said.starts_with("warning: camera.yaml: holds 2 cameras (cam0, cam1), of which cam0 is used")
            || said.contains("holds 2 cameras (cam0, cam1), of which cam0 is used"),
        "{said}"
    );
    assert_eq!(said.lines().count(), 1, "a warning is one line: {said}");
    assert_eq!(range(&two, "--camera 0"), (first, String::new()));
    assert!((range(&two, "--camera 1").0 - first).abs() > 0.01);
    let folder = Folder::new();
    folder
        .write("camera.yaml", &two)
        .write("rig.toml", format!("{}{MOUNT}", rig("")))
        .write("p.csv", "u,v\n1,2\n");
    folder.fails("range --rig rig.toml p.csv --camera 2", &["camera.yaml", "no camera 2", "cam0, cam1"]);
}

#[test]
fn a_lens_is_never_passed_over() {
    let without = |from: &str, to: &str| ROS.replace(from, to);
    refused(
        &without("distortion_coefficients: {rows: 1, cols: 5, data: [-0.3, 0.1, 0.001, -0.002, 0]}\n", ""),
        &["camera.yaml", "`distortion_coefficients` is missing"],
    );
    refused(
        &without("data: [-0.3, 0.1, 0.001, -0.002, 0]", "data: []").replace("cols: 5", "cols: 0"),
        &["`distortion_coefficients` is missing"],
    );
    refused(
        &without("distortion_coefficients", "DistortionCoeficients"),
        &["`DistortionCoeficients`", "nearest known entry is `distortion_coeff"],
    );
    for (key, model) in [
        ("model", "mei"),
        ("camera_model", "omni"),
        ("Camera.type", "Omni"),
        ("lens_model", "ftheta"),
        ("distortion_type", "fov"),
    ] {
        let text = format!("{ROS}{key}: {model}\n");
        let text = if key.contains('.') {
            format!(
                "Camera.type: \"{model}\"\nCamera.fx: 300\nCamera.fy: 300\nCamera.cx: 320\nCamera.cy: 240\nCamera.k1: 0.1\nCamera.k2: 0\nCamera.k3: 0\nCamera.k4: 0\nCamera.width: 640\nCamera.height: 480\n"
            )
        } else {
            text
        };
        refused(&text, &["camera.yaml", model, "not supported"]);
    }
    // An entry that says nothing of the lens is named and not used.
    let (_, said) = range(&format!("{ROS}my_favourite: 3\n"), "");
    assert!(said.starts_with("warning: ") && said.contains("`my_favourite` is not known"), "{said}");
}

#[test]
fn a_camera_file_in_place_of_a_rig_is_known() {
    let folder = Folder::new();
    folder.write("cam.yaml", ROS).write("p.csv", "u,v\n1,2\n");
    folder.fails(
        "range --rig cam.yaml p.csv",
        &["cam.yaml", "a rig (TOML) is wanted", "camera_info = \"cam.yaml\""],
    );
}

#[test]
fn numbers_that_are_hardly_meant_are_said() {
    let warned = |rig: &str, word: &str| {
        let folder = Folder::new();
        folder.write("rig.toml", rig);
        let outcome = folder.run_with_input("range --rig rig.toml", "u,v\n160,200\n");
        assert!(outcome.status == 0 && outcome.stderr.starts_with("warning: "), "{outcome:?}");
        assert!(outcome.stderr.contains(word) && outcome.stderr.contains("rig.toml"), "{}", outcome.stderr);
    };
    let rig = crate::command::RIG;
    warned(&rig.replace("height = 0.40", "height = 40"), "centimetres");
    warned(&rig.replace("height = 0.40", "height = 400"), "millimetres");
    warned(&rig.replace("tilt_deg = 12.0", "tilt_deg = -40"), "sees the floor");
    warned(&format!("{rig}forward = 20.0\n"), "lengths are metres");
    warned(
        &rig.replace("principal = [145.79917, 114.50956]", "principal = [600.0, 400.0]"),
        "outside the picture",
    );
    let folder = Folder::new();
    folder.write("rig.toml", rig.replace("width = 320", "width = 0x140")).write("plain.toml", rig);
    let range = |rig: &str| folder.run_with_input(&format!("range --rig {rig}"), "u,v\n300,200\n").success();
    assert_eq!(range("rig.toml"), range("plain.toml"), "hexadecimal numbers are TOML");
}

#[test]
fn a_fisheye_is_known_by_every_word_for_it() {
    let list = "distortion_coefficients: [0.1, 0.02, 0.003, 0.0004]\n";
    let size =
        "image_width: 640\nimage_height: 480\ncamera_matrix: [[300, 0, 320], [0, 300, 240], [0, 0, 1]]\n";
    let (expected, _) = range(&format!("{size}{list}distortion_model: equidistant\n"), "");
    let (plain, _) = range(&format!("{size}{list}distortion_model: plumb_bob\n"), "");
    assert!((plain - expected).abs() > 1e-3, "{plain} for {expected}");
    let orb = "Camera.type: \"KannalaBrandt8\"\nCamera.fx: 300\nCamera.fy: 300\nCamera.cx: 320\nCamera.cy: 240\n\
               Camera.k1: 0.1\nCamera.k2: 0.02\nCamera.k3: 0.003\nCamera.k4: 0.0004\nCamera.width: 640\nCamera.height: 480\n";
    for form in [
        format!("{size}{list}fisheye_model: 1\n"),
        format!("{size}{list}model: fisheye\n"),
        format!("{size}{list}camera_model: pinhole\ndistortion_model: equidistant\n"),
        orb.to_owned(),
    ] {
        assert_eq!(range(&form, ""), (expected, String::new()), "{form}");
    }
    refused(
        &format!("{size}{list}distortion_model: plumb_bob\nlens_model: fisheye\n"),
        &["another lens model"],
    );
}
