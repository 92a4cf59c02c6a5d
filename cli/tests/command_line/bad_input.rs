//! Every bad input gets one message that names the file, the line or field, the cause and what to do.
use crate::command::{Folder, RIG};

fn rig_fails(rig: &str, words: &[&str]) {
    let folder = Folder::new();
    folder.write("rig.toml", rig).write("pixels.csv", "u,v\n1,200\n");
    folder.fails("range --rig rig.toml pixels.csv --out ranges.csv", words);
}

#[test]
fn an_unknown_rig_key_is_answered_with_the_nearest_known_one() {
    rig_fails(
        &RIG.replace("\nheight = 0.40", "\nheigth = 0.40"),
        &["rig.toml, line 10", "`mount.heigth`", "nearest known key is `mount.height`"],
    );
    rig_fails(&RIG.replace("focal", "focus"), &["rig.toml, line 4", "`camera.focus`", "`camera.focal`"]);
    rig_fails(&RIG.replace("[mount]", "[mounting]"), &["rig.toml, line 9", "`mounting`", "`mount`"]);
}

#[test]
fn a_missing_rig_key_is_named() {
    rig_fails(
        &RIG.replace("tilt_deg = 12.0\n", ""),
        &["rig.toml, line 9", "`mount.tilt_deg` is missing", "help:"],
    );
    rig_fails(&RIG.replace("width = 320\n", ""), &["rig.toml, line 1", "`camera.width` is missing", "help:"]);
    rig_fails("[camera]\nwidth = 3\n", &["`camera.height` is missing"]);
    rig_fails("", &["`camera` is missing", "[camera]"]);
    rig_fails(RIG.split("[mount]").next().unwrap(), &["`mount` is missing", "tilt_deg"]);
}

#[test]
fn absurd_rig_values_are_refused_with_their_line() {
    rig_fails(
        &RIG.replace("= 0.40", "= -0.4"),
        &["rig.toml, line 10", "`mount.height` is -0.4, must be above 0"],
    );
    rig_fails(
        &RIG.replace("= 0.40", "= nan"),
        &["line 10", "`mount.height` is `nan`, must be a finite number"],
    );
    rig_fails(
        &RIG.replace("= 12.0", "= 90"),
        &["line 11", "`mount.tilt_deg` is 90, must be between -90 and 90"],
    );
    rig_fails(&RIG.replace("= 12.0", "= \"steep\""), &["line 11", "`\"steep\"`", "finite number"]);
    rig_fails(&RIG.replace("[365.12674,", "[0,"), &["line 4", "`camera.focal` is 0", "above 0"]);
    rig_fails(&RIG.replace("[365.12674, 365.02905]", "[365.1]"), &["line 4", "2 finite numbers"]);
    rig_fails(
        &RIG.replace("width = 320", "width = 320.5"),
        &["line 2", "`camera.width` is 320.5", "whole number"],
    );
    rig_fails(&RIG.replace("[0.10083,", "[-1,"), &["line 7", "`camera.pixel_std`", "above 0"]);
    rig_fails(
        &format!("{RIG}tilt_std_deg = -1\n"),
        &["line 12", "`mount.tilt_std_deg` is -1, must be 0 or above"],
    );
    rig_fails(&RIG.replace("height = 240", "height = 240 px"), &["rig.toml, line 3", "help:"]);
}

#[test]
fn a_setting_is_refused_with_its_line_and_the_name_that_the_file_has() {
    let fails = |settings: &str, words: &[&str]| rig_fails(&format!("{RIG}{settings}"), words);
    fails(
        "[association]\nconfirm = 2\nbirth_nis = 1\n",
        &["rig.toml, line 14", "`association.birth_nis` is 1, must be at least match_nis"],
    );
    fails("[association]\ncaution = nan\n", &["line 13", "`association.caution` is `nan`"]);
    fails(
        "[association]\ncaution = -0.1\n",
        &["line 13", "`association.caution` is -0.1, must be from 0 to 1e6"],
    );
    fails(
        "[association]\nmin_depression = 0\n",
        &["line 13", "`association.min_depression` is 0, must be from 0.001"],
    );
    fails("[association]\nmin_depression = 1.6\n", &["line 13", "`association.min_depression` is 1.6"]);
    fails("[association]\njoint_nodes = 0\n", &["line 13", "`association.joint_nodes` is 0, must be from 1"]);
    fails("[filter]\nrange_prior = [4, 0]\n", &["line 13", "`filter.range_prior`"]);
    fails(
        "[filter]\npolar_as_point = 1\n",
        &["line 13", "`filter.polar_as_point` is `1`, must be true or false"],
    );
    fails("[filter]\ncaution = 1\n", &["line 13", "`filter.caution` is not a known key"]);
}

#[test]
fn a_camera_file_is_checked_as_the_rig_is() {
    let rig = "camera_info = \"camera.yaml\"\n[mount]\nheight = 0.4\ntilt_deg = 12\n";
    let fails = |camera: &str, words: &[&str]| {
        let folder = Folder::new();
        folder.write("rig.toml", rig).write("pixels.csv", "u,v\n1,2\n").write("camera.yaml", camera);
        folder.fails("range --rig rig.toml pixels.csv", words);
    };
    let ros = "image_width: 320\nimage_height: 240\ncamera_matrix: {rows: 3, cols: 3, data: [300, 0, 160, 0, 300, 120, 0, 0, 1]}\n\
               distortion_coefficients: [0, 0, 0, 0, 0]\n";
    fails(&format!("{ros}distortion_model: omni\n"), &["camera.yaml", "`omni` is not supported", "help:"]);
    fails(
        &ros.replace("[0, 0, 0, 0, 0]", "[0, 0, 0, 0, 0, 0, 0, 0, 0.1]"),
        &["camera.yaml", "9 coefficients", "help:"],
    );
    fails(&ros.replace("300", "-300"), &["camera.yaml", "camera.focal is -300"]);
    fails("image_width: 320\n", &["camera.yaml", "`camera_matrix` is missing"]);
    fails("a: [1, 2\n", &["camera.yaml", "is not YAML"]);
    fails("<a><b></a>", &["camera.yaml", "is not XML"]);
    let folder = Folder::new();
    folder.write("rig.toml", rig).write("pixels.csv", "u,v\n1,2\n");
    folder.fails("range --rig rig.toml pixels.csv", &["camera.yaml", "no such file"]);
    folder.write("rig.toml", format!("[camera]\nwidth = 3\n{rig}").replace("camera_info", "camera_info"));
    folder.fails("range --rig rig.toml pixels.csv", &["rig.toml, line 2", "`camera.width`", "keep one"]);
}

#[test]
fn a_csv_is_refused_with_its_line_and_column() {
    let fails = |csv: &str, words: &[&str]| {
        let folder = Folder::new();
        folder.write("rig.toml", RIG).write("pixels.csv", csv);
        folder.fails("range --rig rig.toml pixels.csv --out ranges.csv", words);
    };
    fails("u,w\n1,2\n", &["pixels.csv: lacks the column `v`", "u,v"]);
    fails("U,W\n1,2\n", &["lacks the column `v`", "U,W"]);
    fails("u;v\n0,5;2\n", &["pixels.csv, line 2", "decimal comma"]);
    fails("160,200\n", &["lacks the column `u`", "begin the file with a line that names its columns: u,v"]);
    fails("u,v\n1,2\n1,nan\n", &["pixels.csv, line 3", "`v` is `nan`", "finite"]);
    fails("u,v\n\n1,2\n1,x\n", &["pixels.csv, line 4", "`v` is `x`"]);
    fails("u,v\n1,\n", &["pixels.csv, line 2", "`v` is empty"]);
    fails("u,v\n1,2,3\n", &["pixels.csv, line 2", "has 3 cells, the header has 2"]);
    fails("", &["pixels.csv", "is empty"]);
    let folder = Folder::new();
    folder.write("rig.toml", RIG).write("pixels.csv", [0x75, 0xff]);
    folder.fails("range --rig rig.toml pixels.csv", &["pixels.csv", "not UTF-8"]);
    folder.fails("range --rig rig.toml absent.csv", &["absent.csv: no such file"]);
    folder.fails("range --rig rig.toml .", &["is a folder"]);
}

#[test]
fn standard_input_is_named_too() {
    let folder = Folder::new();
    folder.write("rig.toml", RIG);
    let outcome = folder.run_with_input("range --rig rig.toml", "u,v\n1\n");
    assert_eq!((outcome.status, outcome.stdout.as_str()), (1, ""));
    assert!(outcome.stderr.contains("standard input, line 2"), "{}", outcome.stderr);
}

#[test]
fn a_wrong_command_line_has_status_2() {
    let folder = Folder::new();
    for arguments in [
        "",
        "rnge",
        "range",
        "range --rig",
        "evaluate --truth a",
        "evaluate --truth a --estimate b --align se3",
    ] {
        assert_eq!(folder.run(arguments).status, 2, "{arguments}");
    }
    assert_eq!(folder.run("--help").status, 0);
    assert_eq!(folder.run("--version").status, 0);
}

#[test]
fn trajectories_are_refused_with_their_line() {
    let fails = |estimate: &str, words: &[&str]| {
        let folder = Folder::new();
        folder.write("truth.tum", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n").write("estimate", estimate);
        folder.fails("evaluate --truth truth.tum --estimate estimate --out e.json", words);
    };
    fails("1 0 0 0 0 0 0 1\n0 1 0 0 0 0 0 1\n", &["estimate, line 2", "time 0 is before"]);
    fails("0 0 0 0 0 0 1\n", &["estimate, line 1", "eight finite numbers"]);
    fails("0 0 0 0 0 0 0 7\n", &["estimate, line 1", "quaternion's length"]);
    fails("t,x,y\n0,0,0\n", &["lacks the column `heading`"]);
    fails("t,x,y,heading\n0,0,0,inf\n", &["estimate, line 2", "`heading` is `inf`"]);
    fails("# nothing\n", &["holds no pose"]);
    fails("7 0 0 0 0 0 0 1\n", &["no pose to compare", "--max-gap"]);
}
