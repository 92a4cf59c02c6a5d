//! Visual odometry alone: `visual_odometry road|corridor [key=value…]…`, for sweeps; a comma separates the settings of
//! one run, a space runs: `visual_odometry road height=1.6,tilt=0.5 accel=2`. Settings of the features come first,
//! as `features:contrast=0.04,doubled=0`; of the simulation, as `sim:seeds=3,frames=150,walkers=3`.
use image::ImageReader;
use monorange_core::features::{Detector, FeatureKind, SiftConfig};
use monorange_core::geometry::{Camera, Mount, Pose, RangeFinder};
use monorange_core::homography::FloorTexture;
use monorange_core::image::Grey;
use monorange_core::pipeline::{Look, VisualConfig};
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};
use monorange_tests::corridor::single_precision;
use monorange_tests::visual::{Frame, VisualDrive, drive, simulated};
use std::error::Error;

type Settings = Vec<(String, f64)>;

fn settings(words: &str) -> Settings {
    let pairs = words.split(',').filter_map(|word| word.split_once('='));
    pairs.filter_map(|(key, value)| Some((key.to_owned(), value.parse().ok()?))).collect()
}

fn get(settings: &Settings, key: &str, default: f32) -> f32 {
    settings.iter().find(|(name, _)| name == key).map_or(default, |(_, value)| *value as f32)
}

fn configured(settings: &Settings) -> VisualConfig {
    let mut config = VisualConfig::default();
    let odometry = &mut config.odometry;
    config.keypoint_std_px = get(settings, "std", config.keypoint_std_px);
    config.matching.ratio = get(settings, "ratio", config.matching.ratio);
    odometry.acceleration_std = get(settings, "accel", odometry.acceleration_std);
    odometry.turn_acceleration_std = get(settings, "accel", odometry.turn_acceleration_std);
    odometry.keyframe_path = get(settings, "keyframe", odometry.keyframe_path);
    odometry.motion.pitch_std = get(settings, "pitch", odometry.motion.pitch_std);
    odometry.motion.roll_std = get(settings, "roll", odometry.motion.roll_std);
    odometry.motion.tilt_std = get(settings, "tilt_std", odometry.motion.tilt_std);
    config
}

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let part =
        |name: &str| words.iter().find_map(|word| word.strip_prefix(name)).map(settings).unwrap_or_default();
    let (features, sim) = (part("features:"), part("sim:"));
    let kind = match VisualConfig::default().features {
        FeatureKind::Sift(sift) => FeatureKind::Sift(SiftConfig {
            doubled: get(&features, "doubled", f32::from(u8::from(sift.doubled))) > 0.0,
            contrast: get(&features, "contrast", sift.contrast),
            ..sift
        }),
        other => other,
    };
    let runs = words.iter().skip(1).filter(|word| !word.contains(':'));
    if words.first().is_some_and(|word| word == "road") {
        let frames = road(kind)?;
        println!(
            "{} keypoints a picture",
            frames.iter().map(|f| f.look.features.keypoints.len()).sum::<usize>() / frames.len()
        );
        for run in runs {
            let run_settings = settings(run);
            let camera =
                Camera::new(1226, 370, [707.0912; 2], [601.8873, 183.1104], 0.0, Default::default())?;
            let (height, tilt) = (get(&run_settings, "height", 1.65), get(&run_settings, "tilt", 1.0));
            let finder =
                RangeFinder::new(camera, Mount::new([height, tilt.to_radians(), 0.0, 0.0, 0.0, 0.0])?);
            print(run, &drive(configured(&run_settings), &finder, &frames));
        }
        return Ok(());
    }
    for seed in 1..=get(&sim, "seeds", 2.0) as u64 {
        let scene = Scene::corridor(&SceneConfig { seed, ..Default::default() });
        let (frames, walkers) = (get(&sim, "frames", 150.0) as usize, get(&sim, "walkers", 3.0) as usize);
        let simulation = Simulation::new(
            scene,
            default_rig()?,
            SimConfig { seed, frames, walkers, ..Default::default() },
        )?;
        let finder = single_precision(simulation.rig())?;
        let frames = simulated(&simulation, kind);
        println!(
            "{} keypoints a picture",
            frames.iter().map(|f| f.look.features.keypoints.len()).sum::<usize>() / frames.len()
        );
        for run in runs.clone() {
            print(&format!("corridor {seed}, {run}"), &drive(configured(&settings(run)), &finder, &frames));
        }
    }
    Ok(())
}

fn road(kind: FeatureKind) -> Result<Vec<Frame>, Box<dyn Error>> {
    let camera = Camera::new(1226, 370, [707.0912; 2], [601.8873, 183.1104], 0.0, Default::default())?;
    let folder = monorange_tests::real_data("road_a").ok_or("no data")?;
    let truth = std::fs::read_to_string(folder.join("poses.txt"))?;
    let mut detector = Detector::new(kind)?;
    let mut frames = Vec::new();
    for (index, line) in truth.lines().enumerate() {
        let n: Vec<f64> = line.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        // The camera's x right, z forward; the robot's x forward, y left.
        let truth = Pose::new(n[11], -n[3], (-n[2]).atan2(n[10]));
        let picture =
            ImageReader::open(folder.join(format!("image_l/{index:06}.png")))?.decode()?.into_luma8();
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let picture = Grey::new(picture.as_raw(), width, height)?;
        let look =
            Look { features: detector.detect(picture)?, texture: Some(FloorTexture::new(&camera, picture)) };
        frames.push(Frame { time: index as f64 * 0.1, look, truth });
    }
    Ok(frames)
}

fn print(name: &str, drive: &VisualDrive) {
    let degrees = |angle: f64| angle.to_degrees();
    println!(
        "{name}: {:.2} m, path {:+.2} %, end {:.2} %, heading {:.2}°, worst {:.2}°, measured {:?}, step NEES/2 {:.2}, since keyframe {:.2?}, \
         pose NEES/3 {:.2}, path std {:.3} m, floor {:.0}, factor {:.2}",
        drive.path,
        100.0 * (drive.estimated_path / drive.path - 1.0),
        100.0 * drive.end_share(),
        degrees(drive.heading_error),
        degrees(drive.worst_heading),
        drive.measured,
        drive.step_nees / 2.0,
        drive.motion_nees,
        drive.pose_nees / 3.0,
        drive.path_std,
        drive.floor,
        drive.variance_factor
    );
}
