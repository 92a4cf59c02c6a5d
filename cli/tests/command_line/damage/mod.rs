//! Every kind of file with every kind of damage: one sentence with the file, the line or entry, and what to do.
mod binary;
mod cameras;

use crate::command::{Folder, RIG};
use cameras::CAMERAS;

/// A kind of file: how it is called, what a sound one holds, the command that reads it, what a missing, an unknown and a
/// wrong entry look like there (what is replaced, by what, and the words of the answer).
struct Kind {
    name: &'static str,
    sound: &'static str,
    command: &'static str,
    damages: &'static [(&'static str, &'static str, &'static [&'static str])],
}

const CAMERA_RIG: &str = "camera_info = \"camera.yaml\"\n[mount]\nheight = 0.4\ntilt_deg = 12\n";
const ROS: &str = "image_width: 320\nimage_height: 240\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [365, 0, 146, 0, 365, 115, 0, 0, 1]\n\
                   distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.2, 0.3, 0, 0, 0]\n";
const TUM: &str = "0 0 0 0 0 0 0 1\n0.5 0.5 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n";
const ODOMETRY: &str = "t,v,omega\n0,1,0\n0.5,1,0\n1,1,0\n";
const MEASURED: &str = "t,range,bearing,id\n0,2,0.1,1\n0.5,1.5,0.1,1\n1,1.1,0.2,1\n";

const KINDS: &[Kind] = &[
    Kind {
        name: "rig.toml",
        sound: RIG,
        command: "range --rig rig.toml pixels.csv",
        damages: &[
            ("height = 240\n", "", &["line 1", "`camera.height` is missing"]),
            ("focal", "focus", &["line 4", "`camera.focus`", "`camera.focal`"]),
            ("365.12674", "nan", &["line 4", "finite"]),
            ("365.12674", "1e308", &["line 4", "`focal` is"]),
            ("365.12674, 365.02905", "0.94, 1.25", &["line 4", "parts of the picture's width"]),
            ("145.79917, 114.50956", "0.5, 0.5", &["line 5", "corner of the picture"]),
            ("tilt_deg = 12.0", "tilt_deg = 12.0\nrig = \"C:\\Users\\me\"", &["line 12", "single quotes"]),
        ],
    },
    Kind {
        name: "camera.yaml",
        sound: ROS,
        command: "range --rig file-rig.toml pixels.csv",
        damages: &[
            ("image_height: 240\n", "", &["`image_height` is missing"]),
            (
                "distortion_coefficients",
                "distortion_coefficents",
                &["`distortion_coefficents`", "`distortion_coefficients`"],
            ),
            (
                "distortion_model: plumb_bob\n",
                "distortion_model: plumb_bob\nlens_shading: 3\n",
                &["`lens_shading` is not a known entry"],
            ),
            ("plumb_bob", "equidistant", &["5 coefficients", "must have 4"]),
            ("distortion_model: plumb_bob", "fisheye_model: 1", &["5 coefficients", "must have 4"]),
            ("distortion_model: plumb_bob", "distortion_model: plumb_bob\nxi: 0.9", &["another lens"]),
            (
                "data: [-0.2, 0.3, 0, 0, 0]",
                "data: [-0.2, 0.3, 0]",
                &["`distortion_coefficients` has 3 numbers", "1 × 5"],
            ),
            ("115, 0, 0, 1]", "115, 0, 0]", &["`camera_matrix` has 8 numbers", "3 × 3"]),
            ("rows: 3", "rows: 5", &["`camera_matrix` has 9 numbers", "5 × 3"]),
            ("365, 0, 146", ".nan, 0, 146", &["line 6", "non-finite"]),
            ("365, 0, 146", "1e300, 0, 146", &["`focal` is"]),
            (
                "[365, 0, 146, 0, 365, 115, 0, 0, 1]",
                "[365, 0, 0, 0, 365, 0, 146, 115, 1]",
                &["last row", "transposed"],
            ),
            (
                "[365, 0, 146, 0, 365, 115, 0, 0, 1]",
                "[1.1, 0, 0.5, 0, 1.5, 0.5, 0, 0, 1]",
                &["parts of the picture's width", "focal 352.0"],
            ),
            (
                "image_width: 320",
                "image_width: 320\nbinning_x: 2\nbinning_y: 2",
                &["`binning_x`", "160×120", "width = 160"],
            ),
            (
                "image_width: 320",
                "image_width: 320\nroi: {x_offset: 20, y_offset: 0, width: 200, height: 240}",
                &["`roi`", "200×240"],
            ),
            ("0, 1]\n", "0, 1\n", &["line 7", "not YAML"]),
        ],
    },
    Kind {
        name: "pixels.csv",
        sound: "u,v\n160,200\n100,180\n",
        command: "range --rig rig.toml pixels.csv",
        damages: &[
            ("u,v", "u,w", &["lacks the column `v`"]),
            ("100,180", "100", &["line 3", "has 1 cells"]),
            ("100,180", "100,nan", &["line 3", "`v` is `nan`"]),
            ("100,180", "\n# a remark\n100,x", &["line 5", "`v` is `x`"]),
            ("u,v\n160,200\n100,180", "u;v\n160,5;200\n100;180", &["line 2", "decimal comma"]),
        ],
    },
    Kind {
        name: "truth.tum",
        sound: TUM,
        command: "evaluate --truth truth.tum --estimate sound.tum",
        damages: &[
            ("0.5 0.5 0 0 0 0 0 1", "0.5 0.5 0 0 0 0 1", &["line 2", "eight finite numbers"]),
            ("0.5 0.5 0 0 0 0 0 1", "0.5 0.5 0 0 0 0 0 nan", &["line 2", "eight finite numbers"]),
            ("0.5 0.5 0 0 0 0 0 1", "0,5 0,5 0 0 0 0 0 1", &["line 2", "decimal comma"]),
            ("0.5 0.5 0 0 0 0 0 1", "0.5 0.5 0 0 0 0 0 7", &["line 2", "quaternion's length"]),
            ("1 1 0 0", "0.1 1 0 0", &["line 3", "before the line before's"]),
            ("0.5 0.5 0 0 0 0 0 1\n1 1", "5e8 0.5 0 0 0 0 0 1\n1e9 1", &["nanoseconds"]),
        ],
    },
    Kind {
        name: "odometry.csv",
        sound: ODOMETRY,
        command: "slam-log --odometry odometry.csv --measurements measured.csv --out out",
        damages: &[
            ("v,omega", "speed,omega", &["lacks the column `v`"]),
            ("0.5,1,0", "0.5,1,", &["line 3", "`omega` is empty"]),
            ("0.5,1,0", "2,1,0", &["line 4", "before the line before's"]),
            ("0.5,1,0\n1,1,0\n", "", &["1 lines of odometry"]),
            ("0.5,1,0\n1,1", "6e8,1,0\n12e8,1", &["nanoseconds"]),
            (
                "t,v,omega\n0,1,0\n0.5,1,0\n1,1,0",
                "t,dx,dy,dtheta\n0,1,0,0\n0.5,1,0,45\n1,1,0,0",
                &["line 3", "degrees"],
            ),
        ],
    },
    Kind {
        name: "imu.csv",
        sound: "t,pitch,roll\n0,0.01,0\n0.5,0,0.01\n1,0,0\n",
        command: "slam --rig rig.toml --frames frames --times times.txt --odometry odometry.csv --attitude imu.csv --out out",
        damages: &[
            ("pitch", "nick", &["lacks the column `pitch`"]),
            ("0.5,0,0.01", "0.5,nan,0", &["line 3", "`pitch` is `nan`"]),
            ("0.5,0,0.01", "0.5,3.5,0", &["line 3", "radians"]),
            ("0.5,0,0.01", "2,0,0", &["line 4", "before the line before's"]),
            ("0,0.01,0\n0.5,0,0.01\n1,0,0", "900,0,0", &["900 s", "frames' clock"]),
            (
                "t,pitch,roll\n0,0.01,0\n0.5,0,0.01\n1,0,0",
                "t,qx,qy,qz,qw\n0,0,0,0,0",
                &["line 2", "quaternion's length is 0", "no attitude"],
            ),
        ],
    },
    Kind {
        name: "measured.csv",
        sound: MEASURED,
        command: "slam-log --odometry odometry.csv --measurements measured.csv --out out",
        damages: &[
            ("range", "distance", &["lacks the column `range`"]),
            ("1.5,0.1,1", "1.5,0.1,-1", &["line 3", "`id` is -1"]),
            ("1.5,0.1,1", "1.5,0.1,1.2", &["line 3", "`id` is 1.2", "whole"]),
            ("1.5,0.1,1", "1.5,0.1,4294967296", &["line 3", "`id` is 4294967296"]),
            ("1.5,0.1,1", "-1.5,0.1,1", &["line 3", "range is -1.5"]),
            ("1.5,0.1,1", "1.5,45,1", &["line 3", "degrees"]),
            ("1.5,0.1,1", ",,1", &["line 3", "neither range nor bearing"]),
            ("1.5,0.1,1", "inf,0.1,1", &["line 3", "`range` is `inf`"]),
        ],
    },
    Kind {
        name: "times.txt",
        sound: "0\n0.5\n1\n",
        command: "scan --rig rig.toml --frames frames --times times.txt --beams 5",
        damages: &[
            ("0.5", "0,5", &["line 2", "decimal comma"]),
            ("0.5", "nan", &["line 2", "`nan`"]),
            ("0.5", "half", &["line 2", "`half`"]),
            ("0.5", "0", &["line 2", "same as the line before's"]),
            ("0.5\n1", "1\n0.5", &["line 3", "before the line before's"]),
            ("0.5\n1", "5e8\n10e8", &["nanoseconds"]),
            ("0\n0.5\n1", "0 0\n1 0.5\n2 1", &["line 1", "frame's number"]),
            ("0.5\n", "", &["2 times for 3 pictures"]),
            ("0.5", "0.5 3.png", &["names no picture at 0 s"]),
            ("0\n0.5\n1", "0 0.png\n0.5 3.png\n1 2.png", &["`3.png`, which is not in"]),
        ],
    },
    Kind {
        name: "points.csv",
        sound: "u,v,range,bearing\n60,200,0.88,0.26\n250,195,0.92,-0.30\n60,150,1.33,0.25\n240,140,1.48,-0.26\n",
        command: "calibrate-mount --rig rig.toml --points points.csv --fit tilt,height",
        damages: &[
            ("range", "distance", &["lacks the column `range`"]),
            ("0.92", "-0.92", &["line 3", "not above 0"]),
            ("0.92", "nan", &["line 3", "`range` is `nan`"]),
            ("250,195", "2500,195", &["line 3", "not in the picture"]),
            ("-0.30", "-15", &["degrees"]),
        ],
    },
    Kind {
        name: "map.csv",
        sound: "id,x,y\n1,2,3\n2,3,4\n",
        command: "evaluate --truth sound.tum --estimate sound.tum --map map.csv --true-map map.csv",
        damages: &[
            ("id,x,y", "id,x,z", &["lacks the column `y`"]),
            ("2,3,4", "-2,3,4", &["line 3", "`id` is -2"]),
            ("2,3,4", "1,3,4", &["line 3", "landmark 1 is there already, in line 2"]),
            ("2,3,4", "2,3,inf", &["line 3", "`y` is `inf`"]),
        ],
    },
];

const MRCLAM: &[Kind] = &[
    Kind {
        name: "log/Robot1_Odometry.dat",
        sound: "0 1 0\n0.5 1 0\n1 1 0\n1.5 1 0\n",
        command: "slam-log --dataset mrclam --from log --out out",
        damages: &[
            ("0.5 1 0", "0.5 1", &["line 2", "is not 3 finite numbers"]),
            ("0.5 1 0", "0.5 nan 0", &["line 2", "is not 3 finite numbers"]),
            ("0.5 1 0\n1 1 0\n1.5", "5e8 1 0\n10e8 1 0\n15e8", &["nanoseconds"]),
        ],
    },
    Kind {
        name: "log/Robot1_Measurement.dat",
        sound: "0.5 72 2 0.1\n1 72 1.5 0.1\n",
        command: "slam-log --dataset mrclam --from log --out out",
        damages: &[
            ("1 72 1.5", "1 72,5 1.5", &["line 2", "is not 4 finite numbers"]),
            ("1 72 1.5", "1 72.5 1.5", &["line 2", "is 72.5", "whole"]),
            ("1 72 1.5", "1 72 -1.5", &["line 2", "the range is -1.5"]),
            ("1.5 0.1", "1.5 45", &["line 2", "degrees"]),
        ],
    },
];

fn kinds() -> impl Iterator<Item = &'static Kind> {
    KINDS.iter().chain(MRCLAM).chain(CAMERAS)
}

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("file-rig.toml", CAMERA_RIG).write("sound.tum", TUM);
    for camera in CAMERAS {
        folder.write(&format!("{}.toml", camera.name), CAMERA_RIG.replace("camera.yaml", camera.name));
    }
    for name in ["0.png", "1.png", "2.png"] {
        folder.write(&format!("frames/{name}"), "");
        image::GrayImage::from_pixel(320, 240, image::Luma([90]))
            .save(folder.path(&format!("frames/{name}")))
            .unwrap();
    }
    folder
        .write("log/Barcodes.dat", "6 72\n")
        .write("log/Landmark_Groundtruth.dat", "6 2 0 0 0\n")
        .write("log/Robot1_Groundtruth.dat", "0 0 0 0\n0.5 0.5 0 0\n1 1 0 0\n1.5 1.5 0 0\n");
    for kind in kinds() {
        folder.write(kind.name, kind.sound);
    }
    folder
}

#[track_caller]
fn answers(folder: &Folder, kind: &Kind, content: impl AsRef<[u8]>, words: &[&str]) {
    folder.write(kind.name, content);
    folder.fails(kind.command, &[&[kind.name, "help:"], words].concat());
    folder.write(kind.name, kind.sound);
}

#[test]
fn every_damage_is_answered_with_the_file_the_place_and_what_to_do() {
    let folder = folder();
    for kind in kinds() {
        folder.run(kind.command).success();
        let _ = std::fs::remove_dir_all(folder.path("out"));
        let empty: &[&str] = match kind.name {
            "rig.toml" => &["is missing"],
            "truth.tum" => &["holds no pose"],
            "times.txt" => &["0 times for 3 pictures"],
            _ => &["is empty"],
        };
        answers(&folder, kind, "", empty);
        let utf16: Vec<u8> =
            [0xfe, 0xff].into_iter().chain(kind.sound.bytes().flat_map(|byte| [0, byte])).collect();
        answers(&folder, kind, utf16, &["UTF-16", "UTF-8"]);
        answers(&folder, kind, [b"u,v\n".as_slice(), &[0xff, 0x00]].concat(), &["byte 4", "UTF-8"]);
        for (from, to, words) in kind.damages {
            assert!(kind.sound.contains(from), "{}: `{from}`", kind.name);
            for end in ["\n", "\r\n"] {
                answers(&folder, kind, kind.sound.replacen(from, to, 1).replace('\n', end), words);
            }
        }
    }
}

#[test]
fn what_does_no_damage_is_read() {
    let folder = folder();
    for kind in kinds() {
        for content in [
            format!("\u{feff}{}", kind.sound),
            kind.sound.replace('\n', "\r\n"),
            format!("{}\n\n", kind.sound),
            format!("# a remark\n\n{}", kind.sound),
        ] {
            if content.starts_with('#') && kind.name.ends_with(".xml") {
                continue; // XML has other remarks
            }
            folder.write(kind.name, content);
            folder.run(kind.command).success();
            let _ = std::fs::remove_dir_all(folder.path("out"));
        }
        folder.write(kind.name, kind.sound);
    }
}

#[test]
fn a_file_that_is_cut_anywhere_is_read_or_refused_by_name() {
    let folder = folder();
    for kind in kinds() {
        for length in (0..kind.sound.len()).step_by(17) {
            folder.write(kind.name, &kind.sound[..length]);
            let outcome = folder.run(kind.command);
            let named = outcome.stderr.contains(kind.name) && outcome.stderr.contains("help:");
            assert!(
                outcome.status == 0 || (outcome.status == 1 && named),
                "{} of {length} bytes: {outcome:?}",
                kind.name
            );
            let _ = std::fs::remove_dir_all(folder.path("out"));
        }
        folder.write(kind.name, kind.sound);
    }
}
