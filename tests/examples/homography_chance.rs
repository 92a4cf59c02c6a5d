//! How often chance gives a homography: pairs of different places and pairs that overlap, in simulated corridors.
//!
//! `cargo run --release -p monorange-tests --example homography_chance`
use monorange_core::features::{Detector, FeatureKind, Features, MatchConfig, SiftConfig};
use monorange_core::homography::{HomographyConfig, Match, estimate_homography};
use monorange_core::image::Grey;
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};

fn main() {
    for brief in [false, true] {
        let (mut apart, mut accepted_apart, mut near, mut accepted_near) = (0, 0, 0, 0);
        for seed in 1..=6 {
            let scene = Scene::corridor(&SceneConfig { seed, ..SceneConfig::default() });
            let config = SimConfig { seed, frames: 560, walkers: 0, ..SimConfig::default() };
            let drive = Simulation::new(scene, default_rig().unwrap(), config).unwrap();
            let frames: Vec<_> = (0..560).step_by(40).collect();
            let features: Vec<_> = frames.iter().map(|frame| detect(&drive, *frame, brief)).collect();
            for (i, a) in features.iter().enumerate() {
                for (j, b) in features.iter().enumerate().skip(i + 1) {
                    let [p, q] = [frames[i], frames[j]].map(|frame| drive.true_pose(frame));
                    if (p.position() - q.position()).norm() > 10.0 {
                        apart += 1;
                        if let Some(words) = found(a, b) {
                            accepted_apart += 1;
                            println!("  apart {seed} {} {}: {words}", frames[i], frames[j]);
                        }
                    }
                }
                let next = detect(&drive, frames[i] + 1, brief);
                near += 1;
                match found(a, &next) {
                    Some(_) => accepted_near += 1,
                    None => println!("  near {seed} {}: none", frames[i]),
                }
            }
        }
        println!("brief {brief}: {accepted_apart} of {apart} apart, {accepted_near} of {near} near");
    }
}

fn detect(drive: &Simulation, frame: usize, brief: bool) -> Features {
    let (width, height) = (drive.rig().camera().width(), drive.rig().camera().height());
    let mut pixels = vec![0; width * height];
    drive.render(frame, &mut pixels).unwrap();
    let kind =
        if brief { FeatureKind::Brief { threshold: 20 } } else { FeatureKind::Sift(SiftConfig::default()) };
    Detector::new(kind).unwrap().detect(Grey::new(&pixels, width, height).unwrap()).unwrap()
}

/// What `match` finds.
fn found(a: &Features, b: &Features) -> Option<String> {
    let ends = a.matches(b, &MatchConfig::default()).unwrap();
    let pair = |ends: &monorange_core::features::Match| {
        Match::of_keypoints(&a.keypoints[ends.first], &b.keypoints[ends.second])
    };
    let matches: Vec<Match<f64>> = ends.iter().map(pair).collect();
    let config = HomographyConfig { scale_noise: true, ..HomographyConfig::default() };
    let found = estimate_homography(&config, &matches, &mut vec![0.0; matches.len()]).ok()?;
    if !found.is_confirmed_by(&matches) {
        return None;
    }
    Some(format!(
        "{} matches, {:.1} right, factor {:.2}",
        matches.len(),
        found.inliers,
        found.variance_factor
    ))
}
