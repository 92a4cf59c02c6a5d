//! `calibrate`: the camera and the mount from pictures of a board, the rig file with both, and what is refused.
use crate::command::Folder;
use monorange_core::calibration::board::BoardPose;
use monorange_core::geometry::{Camera, Mount, RangeFinder};
use nalgebra::{Matrix3, Rotation3, Vector2, Vector3};

const SQUARE: f64 = 0.03;
const HEIGHT: f64 = 0.4;

fn camera() -> Camera<f64> {
    Camera::new(320, 240, [300.0, 300.0], [162.0, 118.0], 0.0, Default::default()).unwrap()
}

/// A board of 9 × 6 inner corners as a grey map, each pixel the mean of 16 samples.
fn picture(pose: &BoardPose) -> Vec<u8> {
    let (camera, from_camera) = (camera(), pose.rotation.transpose());
    let eye = from_camera * -pose.translation;
    let grey = |u: f64, v: f64| {
        let direction = from_camera * camera.ray_from_pixel(Vector2::new(u, v)).unwrap().push(1.0);
        let cell = ((eye - direction * (eye.z / direction.z)).xy() / SQUARE).map(f64::floor);
        let inside = |margin: f64| {
            (-1.0 - margin..9.0 + margin).contains(&cell.x) && (-1.0 - margin..6.0 + margin).contains(&cell.y)
        };
        match (inside(1.0), inside(0.0) && (cell.x + cell.y).rem_euclid(2.0) == 0.0) {
            (false, _) => 90.0,
            (true, black) => {
                if black {
                    35.0
                } else {
                    215.0
                }
            }
        }
    };
    let steps = [-0.375, -0.125, 0.125, 0.375];
    let mut file = b"P5\n320 240\n255\n".to_vec();
    for (row, column) in (0..240).flat_map(|row| (0..320).map(move |column| (row, column))) {
        let samples =
            steps.iter().flat_map(|dv| steps.map(|du| grey(f64::from(column) + du, f64::from(row) + dv)));
        file.push((samples.sum::<f64>() / 16.0).round() as u8);
    }
    file
}

fn held(turn: [f64; 3], middle: [f64; 3]) -> Vec<u8> {
    let rotation = Rotation3::new(Vector3::from(turn)).into_inner();
    let half = Vector3::new(4.0, 2.5, 0.0) * SQUARE;
    picture(&BoardPose { rotation, translation: Vector3::from(middle) - rotation * half })
}

/// In front of a camera that looks 35° down, its long side across the robot's way.
fn on_floor() -> Vec<u8> {
    let mount = Mount::new([HEIGHT, 35_f64.to_radians(), 0.0, 0.0, 0.0, 0.0]).unwrap();
    let cam_from_robot = RangeFinder::new(camera(), mount).robot_from_cam().transpose();
    let sides = Matrix3::from_columns(&[-Vector3::y(), -Vector3::x(), -Vector3::z()]);
    picture(&BoardPose {
        rotation: cam_from_robot * sides,
        translation: cam_from_robot * Vector3::new(0.7, 0.12, -HEIGHT),
    })
}

fn folder() -> Folder {
    let folder = Folder::new();
    folder
        .write("1.pgm", held([0.45, 0.1, 0.0], [-0.05, -0.03, 0.4]))
        .write("2.pgm", held([-0.45, 0.2, 0.3], [0.06, -0.03, 0.42]))
        .write("3.pgm", held([0.1, 0.5, 0.1], [-0.05, 0.03, 0.4]))
        .write("4.pgm", held([0.0, -0.5, 0.4], [0.05, 0.03, 0.42]))
        .write("5.pgm", held([-0.3, -0.4, -0.2], [0.02, 0.01, 0.5]))
        .write("floor.pgm", on_floor())
        .write("wall.pgm", [b"P5\n320 240\n255\n".as_slice(), &[120; 320 * 240]].concat());
    folder
}

#[test]
fn a_board_gives_a_rig_file_that_other_commands_read() {
    let folder = folder();
    let pictures = "1.pgm 2.pgm 3.pgm 4.pgm 5.pgm floor.pgm wall.pgm missing.pgm";
    let options = "--board 9x6 --square 0.03 --floor floor.pgm --along --out rig.toml";
    let text = folder.run(&format!("calibrate {pictures} {options}")).success();
    assert!(text.contains("The corners of 6 of 8 pictures are off by 0."), "{text}");
    assert!(text.contains("wall.pgm: left out: it shows no chessboard"), "{text}");
    assert!(text.contains("missing.pgm: left out: it cannot be used: no such file"), "{text}");
    let json = folder.run(&format!("calibrate {pictures} {options} --json")).success();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let (focal, mount) = (number(&json["focal"][0]), &json["mount"]);
    assert!((focal - 300.0).abs() < 3.0 && number(&json["rms_px"]) < 0.15, "{json}");
    assert!((number(&mount["height"]) - HEIGHT).abs() < 3.0 * number(&mount["height_std"]), "{json}");
    assert!((number(&mount["tilt_deg"]) - 35.0).abs() < 3.0 * number(&mount["tilt_std_deg"]), "{json}");
    assert!(number(&mount["yaw_deg"]).abs() < 3.0 * number(&mount["yaw_std_deg"]), "{json}");
    folder.write("pixels.csv", "u,v\n160,160\n");
    folder.run("range --rig rig.toml pixels.csv").success();
}

#[test]
fn without_the_floor_the_rig_file_asks_for_the_mount() {
    let folder = folder();
    folder.run("calibrate 1.pgm 2.pgm 3.pgm 4.pgm 5.pgm --board 9x6 --square 0.03 --out rig.toml").success();
    assert!(folder.read("rig.toml").contains("# Say how the camera sits on the robot"));
    folder.write("pixels.csv", "u,v\n160,160\n");
    folder.fails("range --rig rig.toml pixels.csv", &["`mount` is missing"]);
}

#[test]
fn what_tells_no_camera_is_refused_with_a_remedy() {
    let folder = folder();
    folder.fails(
        "calibrate 1.pgm wall.pgm --board 9x6 --square 0.03",
        &["1 of 2 pictures", "wall.pgm shows no chessboard"],
    );
    folder.fails("calibrate 1.pgm --board 9x6 --square 30", &["0.025 for 25 mm"]);
    folder.fails(
        "calibrate 1.pgm --board 9x6 --square 0.03 --floor 2.pgm",
        &["2.pgm: is not one of the pictures"],
    );
    assert_eq!(folder.run("calibrate 1.pgm --board nine --square 0.03").status, 2);
}
