//! The map's upkeep without names: how many landmarks it ends with.
use monorange_core::geometry::{Pose, wrap_angle};
use monorange_core::slam::{
    Feature, FilterConfig, Increment, Integration, Map, MapConfig, Measurement, Outcome, Pairing, Status,
    View,
};
use monorange_tests::Noise;
use monorange_tests::slam::host_filter;
use monorange_tests::slam::ring_drive::Drive;
use nalgebra::{Matrix3, Vector2};

/// A ring of 100 landmarks, 1.4 m apart, seen from a circle of radius 20 m.
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
    let landmarks = (0..drive.landmarks)
        .map(|index| {
            let angle = core::f64::consts::TAU * index as f64 / drive.landmarks as f64;
            let radius = 22.0 + noise.uniform(-0.3, 0.3);
            Vector2::new(radius * angle.cos(), 20.0 + radius * angle.sin())
        })
        .collect();
    (drive, landmarks)
}

#[test]
fn a_ring_of_100_landmarks_without_names_becomes_a_map_of_as_many() {
    let (drive, landmarks) = ring();
    for pairing in [Pairing::Joint, Pairing::Nearest] {
        for seed in 1..=5 {
            let start = std::time::Instant::now();
            let filter = host_filter(
                140,
                Pose::new(0.0, 0.0, 0.0),
                Matrix3::identity() * 1e-8,
                FilterConfig::<f64>::default(),
            );
            let view = View { near: 0.5, far: 6.0, half_angle: core::f64::consts::PI };
            let mut map = Map::new(filter, MapConfig { pairing, view, ..MapConfig::default() }).unwrap();
            let noise = drive.odometry_covariance();
            let (mut gated, mut merged, mut deleted) = (0, 0, 0);
            let mut last = Pose::default();
            for (index, step) in drive.run(&landmarks, seed).iter().enumerate() {
                let moved = Increment::from_velocity(step.v, step.omega, 1.0, &noise, Integration::Arc);
                map.filter_mut().predict(index as f64, &moved).unwrap();
                let features: Vec<_> = step
                    .seen
                    .iter()
                    .map(|(_, range, bearing)| {
                        let std = drive.range_std_at(*range);
                        Feature::new(Measurement::range_bearing(*range, *bearing, std, drive.bearing_std))
                    })
                    .collect();
                let mut outcomes = vec![Outcome::default(); features.len()];
                let report = map.observe(&features, |_, _| true, &mut outcomes).unwrap();
                gated += report.gated;
                merged += report.merged;
                deleted += report.deleted;
                last = step.truth;
            }
            let confirmed =
                map.filter().landmarks().iter().filter(|landmark| landmark.status == Status::Confirmed);
            let pose = map.filter().pose();
            println!(
                "{pairing:?} seed {seed}: {} confirmed of {}, gated {gated} merged {merged} deleted {deleted}, end error {:.3} m {:.3} rad, {:?}, {:?}",
                confirmed.count(),
                map.filter().landmarks().len(),
                (pose.position() - last.position()).norm(),
                wrap_angle(pose.heading - last.heading),
                map.health().verdict(),
                start.elapsed()
            );
        }
    }
}
