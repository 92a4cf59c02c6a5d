//! The map's upkeep without names: a loop of landmarks that look alike closes on the right one.
//!
//! `cargo test -p monorange-tests slam_map:: -- --nocapture` prints the table.
use monorange_core::geometry::Pose;
use monorange_core::slam::{
    Decision, Feature, FilterConfig, Increment, Integration, Map, MapConfig, Measurement, Outcome, Status,
    View,
};
use monorange_tests::Noise;
use monorange_tests::slam::host_filter;
use monorange_tests::slam::ring_drive::Drive;
use nalgebra::{Matrix3, Vector2};
use std::collections::HashMap;
use std::fmt::Write;

/// A ring of 100 landmarks, 1.4 m apart and up to 0.3 m off the circle, seen up to 6 m away from a circle 2 m inside:
/// two laps and more. Where the loop closes the pose is off by as much as the landmarks are apart.
fn ring() -> (Drive, Vec<Vector2<f64>>) {
    let drive = Drive {
        speed: 0.25,
        turn: 0.0125,
        steps: 1100,
        landmarks: 100,
        spread: 0.0,
        view: (0.5, 6.0),
        range_std: (0.02, 0.02),
        bearing_std: 1_f64.to_radians(),
        odometry_std: (0.01, 0.005),
    };
    let mut noise = Noise::new(77);
    let landmarks = (0..drive.landmarks).map(|index| {
        let angle = core::f64::consts::TAU * index as f64 / drive.landmarks as f64;
        let radius = 22.0 + noise.uniform(-0.3, 0.3);
        Vector2::new(radius * angle.cos(), 20.0 + radius * angle.sin())
    });
    let landmarks = landmarks.collect();
    (drive, landmarks)
}

/// How a run ended.
struct End {
    landmarks: usize,
    /// Measurements taken for another landmark than the one that was born from.
    wrong: usize,
    position_error: f64,
    nees: f64,
}

fn run(drive: &Drive, landmarks: &[Vector2<f64>], seed: u64) -> End {
    let start = Matrix3::identity() * 1e-8;
    let filter = host_filter(140, Pose::default(), start, FilterConfig::<f64>::default());
    let config = MapConfig {
        view: View { near: 0.5, far: 6.0, half_angle: core::f64::consts::PI },
        density: 1.0, // a landmark every 1.4 m along a band 0.6 m wide
        ambiguity: 13.0,
        joint_nodes: 2048,
        ..MapConfig::default()
    };
    let mut map = Map::new(filter, config).unwrap();
    let noise = drive.odometry_covariance();
    let (mut owners, mut wrong) = (HashMap::new(), 0);
    let steps = drive.run(landmarks, seed);
    for (index, step) in steps.iter().enumerate() {
        let moved = Increment::from_velocity(step.v, step.omega, 1.0, &noise, Integration::Arc);
        map.filter_mut().predict(index as f64, &moved).unwrap();
        let feature = |&(_, range, bearing): &(u32, f64, f64)| {
            let std = drive.range_std_at(range);
            Feature::new(Measurement::range_bearing(range, bearing, std, drive.bearing_std))
        };
        let features: Vec<_> = step.seen.iter().map(feature).collect();
        let mut outcomes = vec![Outcome::default(); features.len()];
        map.observe(&features, |_, _| true, &mut outcomes).unwrap();
        for (outcome, (truth, ..)) in outcomes.iter().zip(&step.seen) {
            let used = matches!(outcome.decision, Decision::Birth | Decision::Update | Decision::Tentative);
            if let (true, Some(id)) = (used, outcome.landmark) {
                wrong += usize::from(*owners.entry(id).or_insert(*truth) != *truth);
            }
        }
    }
    let filter = map.filter();
    let truth = steps.last().unwrap().truth;
    End {
        landmarks: filter.landmarks().iter().filter(|known| known.status == Status::Confirmed).count(),
        wrong,
        position_error: (filter.pose().position() - truth.position()).norm(),
        nees: filter.pose_nees(&truth).unwrap() / 3.0,
    }
}

#[test]
fn a_ring_of_100_landmarks_without_names_closes_and_becomes_a_map_of_as_many() {
    let (drive, landmarks) = ring();
    let mut table = String::from("seed  landmarks  wrong  end m  NEES/3\n");
    let ends: Vec<_> = (1..=5).map(|seed| run(&drive, &landmarks, seed)).collect();
    for (seed, end) in (1..).zip(&ends) {
        let End { landmarks, wrong, position_error, nees } = end;
        writeln!(table, "{seed:4}  {landmarks:9}  {wrong:5}  {position_error:5.2}  {nees:6.2}").unwrap();
    }
    println!("{table}");
    insta::assert_snapshot!(table);
    for end in ends {
        assert!((98..=102).contains(&end.landmarks), "{} landmarks", end.landmarks);
        assert!(end.wrong == 0 && end.position_error < 0.5, "{} wrong, {} m", end.wrong, end.position_error);
    }
}
