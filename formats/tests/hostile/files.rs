//! What a file can hold: nothing may panic, and nothing may take long.
//!
//! Sound files are damaged again and again. `MONORANGE_FUZZ_SECONDS=600 cargo test -p monorange-formats --test hostile files` is the
//! long run: seconds of processor time for each kind.

use crate::chance::Chance;
use crate::work::Work;
use image::{ExtendedColorType, GrayImage, ImageEncoder, Luma, codecs::jpeg::JpegEncoder};
use monorange_formats::{
    files::{Attitudes, Odometry, Rig, memory, read_camera_of, read_frame_list, read_map, read_trajectory},
    pictures::Picture,
    sensor_log::{Dataset, read_sightings},
    warnings,
};
use nalgebra::Vector2;
use std::{path::Path, time::Duration};

const WORDS: &[&str] = &[
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-308",
    "0",
    "-0",
    "-1",
    "18446744073709551616",
    "4294967295",
    "0x7fffffff",
    "1,5",
    "",
    " ",
    "\t",
    "\n",
    "\r",
    "\r\n",
    "\n\n",
    ",",
    ";",
    ":",
    "#",
    "\"",
    "'",
    "[",
    "]",
    "{",
    "}",
    "---\n",
    "%YAML:1.0\n",
    "<a>",
    "</a>",
    "&a ",
    "*a",
    "!!opencv-matrix",
    "null",
    "true",
    "~",
    "\u{feff}",
    "\u{0}",
    "é",
    "[camera]\n",
    "[mount]\n",
    "[[",
    "1403636579763555584",
    "2011-09-26 13:02:25.5",
    "t,v,omega\n",
    "t,dx,dy,dtheta\n",
    "dist_coeffs",
    "xi: 1\n",
    "rows: 99999999\n",
    "width = 65536\n",
];

fn word(chance: &mut Chance) -> &'static str {
    WORDS[chance.below(WORDS.len())]
}

fn damaged(sound: &[Vec<u8>], chance: &mut Chance) -> Vec<u8> {
    let mut bytes = sound[chance.below(sound.len())].clone();
    for _ in 0..=chance.below(4) {
        let length = bytes.len();
        let (from, to) = (chance.below(length + 1), chance.below(length + 1));
        let (from, to) = (from.min(to), from.max(to));
        match chance.below(7) {
            0 if length > 0 => bytes[from.min(length - 1)] = chance.next() as u8,
            1 if length > 0 => bytes[from.min(length - 1)] ^= 1 << chance.below(8),
            2 => drop(bytes.splice(from..from, word(chance).bytes())),
            3 => drop(bytes.splice(from..to.min(from + 12), word(chance).bytes())),
            4 => drop(bytes.drain(from..to.min(from + 40))),
            5 => {
                let piece = bytes[from..to.min(from + 200)].to_vec();
                drop(bytes.splice(to..to, piece));
            }
            _ => {
                let other = &sound[chance.below(sound.len())];
                let start = chance.below(other.len() + 1);
                bytes.truncate(from);
                bytes.extend(other.iter().skip(start));
            }
        }
    }
    bytes.truncate(1 << 16);
    bytes
}

/// Damaged files that a test reads unless it is told for how long: always the same ones.
const FILES: u64 = 2000;

/// Reads damaged files: a fixed number, or for as long as is asked for.
pub(crate) fn survive(name: &str, sound: &[Vec<u8>], read: impl Fn(&Path, &[u8])) {
    let seconds = std::env::var("MONORANGE_FUZZ_SECONDS").ok().and_then(|text| text.parse().ok());
    let (mut chance, begun, mut count) = (Chance(0x9e37_79b9_7f4a_7c15), Work::begin(), 0_u64);
    let goes_on = |count| seconds.map_or(count < FILES, |s| begun.done() < Duration::from_secs_f64(s));
    while goes_on(count) {
        let bytes = damaged(sound, &mut chance);
        memory::offer(name, bytes.clone());
        let clock = Work::begin();
        let outcome =
            std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| read(Path::new(name), &bytes)));
        let text = String::from_utf8_lossy(&bytes);
        assert!(outcome.is_ok(), "{name} number {count}: {text:?}");
        assert!(clock.done() < Duration::from_secs(10), "{name} takes {:?}: {text:?}", clock.done());
        warnings::forget();
        count += 1;
    }
    println!("{name}: {count} files in {:.0} s of processor time", begun.done().as_secs_f64());
}

fn texts(list: &[&str]) -> Vec<Vec<u8>> {
    list.iter().map(|text| text.as_bytes().to_vec()).collect()
}

const RIG: &str = "[camera]\nwidth = 320\nheight = 240\nfocal = [365.1, 365.0]\nprincipal = [145.8, 114.5]\nskew = 0.0\n\
    distortion = [-0.2, 0.3, 0, 0, 0]\npixel_std = [0.1, 0.1]\n[mount]\nheight = 0.4\ntilt_deg = 12.0\nroll_std_deg = 0.3\n\
    [extract]\ncorners = \"lines\"\n[filter]\ngate = \"hard\"\n[association]\nconfirm = 2\n";

#[test]
fn camera_files() {
    let sound = [
        "image_width: 640\nimage_height: 480\ncamera_matrix: {rows: 3, cols: 3, data: [600, 0, 320, 0, 610, 240, 0, 0, 1]}\ndistortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: [-0.3, 0.1, 0.001, -0.002, 0]}\nbinning_x: 0\nroi: {x_offset: 0, y_offset: 0, width: 0, height: 0}\n",
        "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 600., 0., 320., 0., 610., 240., 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ -0.3, 0.1, 0, 0, 0 ]\n",
        "<?xml version=\"1.0\"?>\n<opencv_storage><image_width>640</image_width><image_height>480</image_height><camera_matrix type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt><data>600 0 320 0 610 240 0 0 1</data></camera_matrix><distortion_coefficients type_id=\"opencv-matrix\"><rows>1</rows><cols>5</cols><dt>d</dt><data>-0.3 0.1 0 0 0</data></distortion_coefficients></opencv_storage>\n",
        "cam0:\n  camera_model: pinhole\n  intrinsics: [600, 610, 320, 240]\n  distortion_model: equidistant\n  distortion_coeffs: [0.1, 0.02, 0, 0]\n  resolution: [640, 480]\ncam1:\n  camera_model: pinhole\n  intrinsics: [600, 610, 320, 240]\n  distortion_model: radtan\n  distortion_coeffs: [0.1, 0.02, 0, 0]\n  resolution: [640, 480]\n",
        "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nrate_hz: 20\nresolution: [752, 480]\ncamera_model: pinhole\nintrinsics: [458, 457, 367, 248]\ndistortion_model: radial-tangential\ndistortion_coefficients: [-0.28, 0.07, 0.0001, 0]\n",
        "Camera.type: \"PinHole\"\nCamera.fx: 517.3\nCamera.fy: 516.5\nCamera.cx: 318.6\nCamera.cy: 255.3\nCamera.k1: 0.26\nCamera.k2: -0.95\nCamera.p1: -0.005\nCamera.p2: 0.002\nCamera.width: 640\nCamera.height: 480\n",
        "P0: 6.0e+02 0 3.2e+02 0 0 6.0e+02 2.4e+02 0 0 0 1 0\nP1: 6.0e+02 0 3.2e+02 -30 0 6.0e+02 2.4e+02 0 0 0 1 0\nTr: 1 0 0 0 0 1 0 0 0 0 1 0\n",
        "# oST\n[image]\n\nwidth\n640\n\nheight\n480\n\n[camera]\n\ncamera matrix\n600 0 320\n0 610 240\n0 0 1\n\ndistortion\n-0.3 0.1 0 0 0\n",
    ];
    survive("camera.yaml", &texts(&sound), |path, _| {
        let _ = read_camera_of(path, None, None);
        let _ = read_camera_of(path, Some(1), Some([640, 480]));
        memory::offer(
            "rig.toml",
            b"camera_info = \"camera.yaml\"\n[mount]\nheight = 0.4\ntilt_deg = 12\n".to_vec(),
        );
        if let Ok(rig) = Rig::read(Path::new("rig.toml")) {
            for pixel in [[0.0, 0.0], [320.0, 400.0], [1e9, -1e9]] {
                let _ = rig.finder.sight(Vector2::from(pixel));
            }
        }
    });
}

#[test]
fn rig_files() {
    survive("rig.toml", &texts(&[RIG]), |path, _| {
        if let Ok(rig) = Rig::read(path) {
            let _ = rig.finder.sight(Vector2::new(160.0, 200.0));
            rig.write(&mut Vec::new()).unwrap();
        }
    });
}

#[test]
fn odometry() {
    let sound = [
        "t,v,omega\n0,1,0\n0.5,1,0.1\n1,1,0\n1,1,0\n20,1,0\n",
        "t;dx;dy;dtheta\r\n0;0;0;0\r\n0.5;1;0;6.1\r\n1;1;0;0.2\r\n",
        // A metre in no time: one time with the line before.
        "t,dx,dy,dtheta\n0,0,0,0\n1e-308,1,0,0.2\n1,1,0,0\n",
        // A way longer than any number.
        "t,v,omega\n0,1,0\n0.5,1,0.1\n1,1,0\n1e308,1,0\n",
    ];
    survive("o.csv", &texts(&sound), |path, _| {
        if let Ok(odometry) = Odometry::read(path) {
            let [from, to] = odometry.range();
            assert!(odometry.way(from, to).is_finite() && odometry.step(from, to).1.is_finite());
            assert!(odometry.between(from, to).iter().all(|span| span.duration > 0.0));
        }
    });
}

#[test]
fn attitudes() {
    let sound = [
        "t,pitch,roll,std\n0,0.01,0,0.002\n0.1,0,0.01,\n1,0,0,0.01\n",
        "t,qx,qy,qz,qw\n0,0,0.01,0.7,0.7\n0.1,0,0,0,1\n",
    ];
    survive("imu.csv", &texts(&sound), |path, _| {
        let Ok(attitudes) = Attitudes::read(path) else { return };
        for time in [0.0, 0.05, 0.5, 1.0, 1e308] {
            let lean = attitudes.at(time);
            assert!(lean.is_none_or(|lean| lean.iter().all(|angle| (-0.8..=0.8).contains(angle))));
        }
    });
}

#[test]
fn trajectories_and_times() {
    let sound = [
        "0 0 0 0 0 0 0 1\n0.5 0.5 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n",
        "t,x,y,heading,var_x,cov_xy,cov_xh,var_y,cov_yh,var_h\n0,0,0,0,1,0,0,1,0,1\n1,1,0,0,,,,,,\n",
        "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n1403636580838555648,1,2,0,1,0,0,0\n",
        "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 1\n",
        "1305031102.175304 rgb/a.png\n1305031102.211214 rgb/b.png\n",
    ];
    memory::offer("times.txt", b"0\n1\n".to_vec());
    survive("t.tum", &texts(&sound), |path, _| {
        if let Ok(poses) = read_trajectory(path) {
            assert!(poses.windows(2).all(|pair| pair[0].time < pair[1].time));
        }
        if let Ok(list) = read_frame_list(path) {
            assert!(list.windows(2).all(|pair| pair[0].0 < pair[1].0));
        }
    });
}

#[test]
fn measurements_and_maps() {
    let sound = [
        "t,range,bearing,id,var_range,var_bearing\n0,2,0.1,1,0.01,0.001\n0.5,,0.1,,,\n1,1.1,,2,,\n",
        "id,x,y,var_x,cov_xy,var_y,seen,first_t,last_t\n1,2,3,0.1,0,0.1,5,0,1\n2,3,4,,,,1,,\n",
    ];
    survive("m.csv", &texts(&sound), |path, _| {
        if let Ok(sightings) = read_sightings(path) {
            assert!(sightings.iter().all(|sighting| sighting.range.is_none_or(|range| range > 0.0)));
        }
        let _ = read_map(path);
    });
}

#[test]
fn mrclam_folders() {
    let files = [
        ("log/Barcodes.dat", "6 72\n7 25\n"),
        ("log/Landmark_Groundtruth.dat", "6 2 0 0 0\n7 3 1 0 0\n"),
        ("log/Robot1_Odometry.dat", "0 1 0\n0.5 1 0.1\n1 1 0\n1.5 1 0\n"),
        ("log/Robot1_Measurement.dat", "0.5 72 2 0.1\n1 25 1.5 0.1\n"),
        ("log/Robot1_Groundtruth.dat", "0 0 0 0\n0.5 0.5 0 0\n1 1 0 0\n1.5 1.5 0 0\n"),
    ];
    let sound = texts(&files.map(|(_, text)| text));
    survive("damaged", &sound, |path, _| {
        let damaged = std::cell::RefCell::new(monorange_formats::files::read_text(path).unwrap_or_default());
        for (name, _) in files {
            for (other, text) in files {
                let text = if other == name { damaged.borrow().clone() } else { text.to_owned() };
                memory::offer(other, text.into_bytes());
            }
            let _ = Dataset::Mrclam.read(Path::new("log"), 1);
        }
    });
}

#[test]
fn pictures() {
    let picture = GrayImage::from_fn(48, 32, |u, v| Luma([(u * 5 + v * 3) as u8]));
    let mut sound = Vec::new();
    for format in [image::ImageFormat::Png, image::ImageFormat::Pnm] {
        let mut file = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut file, format).unwrap();
        sound.push(file.into_inner());
    }
    let mut file = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut file, 90);
    encoder
        .set_exif_metadata(b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0".to_vec())
        .unwrap();
    encoder.write_image(&picture, 48, 32, ExtendedColorType::L8).unwrap();
    sound.push(file);
    survive("picture.png", &sound, |path, bytes| {
        let _ = Picture::size_of(bytes);
        if let Ok(picture) = Picture::decode(path, bytes) {
            assert_eq!(picture.pixels.len(), picture.width * picture.height);
        }
    });
}
