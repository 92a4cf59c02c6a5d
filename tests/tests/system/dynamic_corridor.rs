//! Five people about: who is who in pixels and in the map, at the wheels' noise and at three times that.
use monorange_core::pipeline::Carrier;
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};
use monorange_tests::dynamic::{Association, associate};
use std::fmt::Write;

const CARRIERS: [Carrier; 3] = [Carrier::Map, Carrier::Floor, Carrier::Free];

fn sums(noise: f64) -> [Association; 3] {
    let mut sums = [Association::default(); 3];
    for seed in 1..=5 {
        let scene = Scene::corridor(&SceneConfig { seed, ..Default::default() });
        let config =
            SimConfig { seed, frames: 100, walkers: 5, odometry_noise_scale: noise, ..Default::default() };
        let simulation = Simulation::new(scene, default_rig().unwrap(), config).unwrap();
        for (sum, score) in sums.iter_mut().zip(associate(&simulation, &CARRIERS).unwrap()) {
            *sum = sum.with(score);
        }
    }
    sums
}

#[test]
#[ignore = "golden run: cargo xtask test"]
fn corners_find_their_landmarks_among_people() {
    let mut table = String::from("noise  by      wrong %  of  missed %  of  map  seen  carried  of\n");
    let mut gained = Vec::new();
    let mut by_floor = Vec::new();
    for noise in [1.0, 3.0] {
        let [map, floor, free] = sums(noise);
        for (carrier, sum) in CARRIERS.iter().zip([map, floor, free]) {
            let (wrong, missed) = (100.0 * sum.wrong_share(), 100.0 * sum.missed_share());
            let Association { updates, expected, landmarks, seen, carried, frames, .. } = sum;
            let name = format!("{carrier:?}");
            writeln!(table, "{noise}×     {name:6} {wrong:8.2} {updates:4} {missed:8.1} {expected:4} {landmarks:4} {seen:5} {carried:8} {frames:4}").unwrap();
        }
        assert!(free.missed > floor.missed, "the corridor's homography is seldom the floor's\n{table}");
        gained.push(map.missed_share() - floor.missed_share());
        by_floor.push(floor);
    }
    println!("{table}");
    for floor in &by_floor {
        assert!(floor.wrong_share() <= 0.005, "{table}");
        assert!(floor.missed_share() <= 0.10, "{table}");
        assert!((floor.map_ratio() - 1.0).abs() <= 0.05, "{table}");
    }
    assert!(
        gained[0] > 0.0 && gained[1] > 2.0 * gained[0],
        "pixels gain more the worse the wheels are: {gained:?}\n{table}"
    );
}
