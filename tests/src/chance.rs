//! Homographies as `match` finds them, between pictures of simulated corridors.
use monorange_core::features::{Detector, ENOUGH_KEYPOINTS, FeatureKind, Features, MatchConfig, SiftConfig};
use monorange_core::homography::{HomographyConfig, Match, estimate_homography};
use monorange_core::image::Grey;
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};

/// Both kinds of keypoints, as the commands find them.
pub fn kinds() -> [(&'static str, FeatureKind); 2] {
    [("SIFT", FeatureKind::Sift(SiftConfig::default())), ("BRIEF", FeatureKind::Brief { threshold: 20 })]
}

/// A drive through a corridor of its own, without walkers.
///
/// # Panics
/// Never, for its settings are sound.
pub fn corridor(seed: u64, frames: usize) -> Simulation {
    drive(SceneConfig { seed, ..SceneConfig::default() }, frames)
}

/// A drive through a corridor whose walls and floor are next to plain: few keypoints.
///
/// # Panics
/// Never, for its settings are sound.
pub fn plain_corridor(seed: u64, frames: usize) -> Simulation {
    drive(SceneConfig { seed, texture: 0.15, posters: false, ..SceneConfig::default() }, frames)
}

fn drive(scene: SceneConfig, frames: usize) -> Simulation {
    let (seed, scene) = (scene.seed, Scene::corridor(&scene));
    let config = SimConfig { seed, frames, walkers: 0, ..SimConfig::default() };
    Simulation::new(scene, default_rig().expect("a sound rig"), config).expect("a sound drive")
}

/// The keypoints of a drive's picture.
///
/// # Panics
/// When there is no such picture.
pub fn seen(drive: &Simulation, frame: usize, kind: FeatureKind) -> Features {
    let (width, height) = (drive.rig().camera().width(), drive.rig().camera().height());
    let mut pixels = vec![0; width * height];
    drive.render(frame, &mut pixels).expect("a picture of the drive");
    features(&pixels, [width, height], kind)
}

/// The keypoints of a picture.
///
/// # Panics
/// When the pixels are not as many as the size says.
pub fn features(pixels: &[u8], [width, height]: [usize; 2], kind: FeatureKind) -> Features {
    let picture = Grey::new(pixels, width, height).expect("as many pixels as the size says");
    Detector::new(kind)
        .and_then(|mut detector| detector.detect_at_least(picture, ENOUGH_KEYPOINTS))
        .expect("sound settings")
}

/// What `match` finds in two pictures.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Found {
    /// No homography.
    Nothing,
    /// One that chance or a place that looks alike could give: `match` refuses it.
    Doubtful,
    /// One that `match` gives.
    Confirmed,
}

/// What `match` finds in two pictures' keypoints.
pub fn homography(a: &Features, b: &Features) -> Found {
    let Ok(ends) = a.matches(b, &MatchConfig::default()) else { return Found::Nothing };
    let ends: Vec<_> = ends.iter().map(|pair| [a.keypoints[pair.first], b.keypoints[pair.second]]).collect();
    let matches: Vec<Match<f64>> =
        ends.iter().map(|[from, to]| Match::of_uneven_keypoints(from, to)).collect();
    let config = HomographyConfig { scale_noise: true, ..HomographyConfig::default() };
    let keypoints = a.keypoints.len().min(b.keypoints.len());
    match estimate_homography(&config, &matches, &mut vec![0.0; matches.len()]) {
        Err(_) => Found::Nothing,
        Ok(found) if found.is_confirmed_by(&matches, &ends, keypoints) => Found::Confirmed,
        Ok(_) => Found::Doubtful,
    }
}
