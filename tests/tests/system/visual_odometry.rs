//! Visual odometry alone, without wheels: a simulated corridor, and 60 m of a real street.
use monorange_core::features::{Detector, Features, MatchConfig};
use monorange_core::geometry::{Camera, Mount, Pose, RangeFinder};
use monorange_core::homography::{Match, Track, VisualOdometry};
use monorange_core::image::Grey;
use monorange_core::pipeline::VisualConfig;
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};
use monorange_tests::corridor::single_precision;
use monorange_tests::real_data;
use monorange_tests::visual::{drive, simulated};

#[test]
#[ignore = "golden run: cargo xtask test"]
fn a_corridor_is_driven_without_wheels() {
    let config = VisualConfig::default();
    for seed in [1, 2] {
        let scene = Scene::corridor(&SceneConfig { seed, ..Default::default() });
        let simulation = SimConfig { seed, frames: 100, ..Default::default() };
        let simulation = Simulation::new(scene, default_rig().unwrap(), simulation).unwrap();
        let finder = single_precision(simulation.rig()).unwrap();
        let result = drive(config, &finder, &simulated(&simulation, config.features));
        println!(
            "corridor {seed}: {:.1} m, end {:.2} %, heading {:.2}°, step NEES/2 {:.2}",
            result.path,
            100.0 * result.end_share(),
            result.heading_error.to_degrees(),
            result.step_nees / 2.0
        );
        assert!(result.measured[0] == result.measured[1] && result.end_share() <= 0.015, "{result:?}");
    }
}

/// Matches from picture to picture.
type Steps = Vec<Vec<Match<f32>>>;

/// Every picture is a keyframe: the car drives further in a picture than [`VisualOdometry`] waits.
fn street() -> Option<(Steps, Vec<Pose<f64>>)> {
    let folder = real_data("road_a")?;
    let config = VisualConfig::default();
    let variance = config.keypoint_std_px * config.keypoint_std_px;
    let mut detector = Detector::new(config.features).unwrap();
    let (mut steps, mut poses, mut last) = (Vec::new(), Vec::new(), None::<Features>);
    for (index, line) in std::fs::read_to_string(folder.join("poses.txt")).unwrap().lines().enumerate() {
        let n: Vec<f64> = line.split_whitespace().map(|word| word.parse().unwrap()).collect();
        // The camera's x right and z ahead; the robot's x ahead and y to the left.
        poses.push(Pose::new(n[11], -n[3], (-n[2]).atan2(n[10])));
        let picture = image::open(folder.join(format!("image_l/{index:06}.png"))).unwrap().into_luma8();
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let now = detector.detect(Grey::new(picture.as_raw(), width, height).unwrap()).unwrap();
        if let Some(before) = &last {
            let pairs = before.matches(&now, &MatchConfig::default()).unwrap();
            let ends = pairs.iter().map(|pair| (before, pair.first, pair.second));
            let ends = ends.map(|(before, a, b)| (before.keypoints[a].pixel, now.keypoints[b].pixel));
            steps.push(ends.map(|(from, to)| Match::new(from, to, variance, variance)).collect());
        }
        last = Some(now);
    }
    Some((steps, poses))
}

#[test]
#[ignore = "golden run: cargo xtask test"]
fn a_street_is_driven_without_wheels() {
    let Some((steps, poses)) = street() else { return };
    let path: f64 = poses.windows(2).map(|pair| (pair[1].position() - pair[0].position()).norm()).sum();
    let end = poses[poses.len() - 1];
    // As the data's page has it, first; then how the result depends on what it leaves open.
    for (height, tilt_deg) in [(1.65, 1.0), (1.60, 0.5), (1.70, 1.0), (1.65, 0.7), (1.65, 1.3)] {
        let camera = Camera::new(1226, 370, [707.0912; 2], [601.8873, 183.1104], 0.0, Default::default());
        let mount = Mount::new([height, f32::to_radians(tilt_deg), 0.0, 0.0, 0.0, 0.0]).unwrap();
        let finder = RangeFinder::new(camera.unwrap(), mount);
        let (mut odometry, mut pose) = (VisualOdometry::<f32>::new(), Pose::<f64>::default());
        for matches in &steps {
            let mut tracks = vec![Track::default(); matches.len()];
            let config = VisualConfig::default().odometry;
            let report = odometry.step(&config, &finder, matches, 0.1, None, &mut tracks);
            assert!(report.measured && report.new_keyframe);
            let step = report.increment;
            pose = pose.compose(&Pose::new(step.x.into(), step.y.into(), step.heading.into()));
        }
        let share = (pose.position() - end.position()).norm() / path;
        let heading = (pose.heading - end.heading).to_degrees();
        println!("height {height} m, tilt {tilt_deg}°: end {:.2} %, heading {heading:+.2}°", 100.0 * share);
        if (height, tilt_deg) == (1.65, 1.0) {
            assert!(share <= 0.02 && heading.abs() <= 1.0, "{share} {heading}");
        }
    }
}
