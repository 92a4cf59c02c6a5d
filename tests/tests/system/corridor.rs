//! The main job on simulated corridors, as a golden table: pictures and slipping odometry in; corners, ranges,
//! trajectory and map out, with three people walking about.
//!
//! `cargo run -p monorange-tests --example corridor_score` prints the same for other seeds, lengths and noise.
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};
use monorange_tests::corridor::{Score, config_for, median, run};
use std::fmt::Write;

const SEEDS: [u64; 5] = [1, 2, 3, 4, 5];

fn drive(seed: u64) -> Score {
    let scene = Scene::corridor(&SceneConfig { seed, ..Default::default() });
    let config = SimConfig { seed, frames: 560, walkers: 3, ..Default::default() };
    let simulation = Simulation::new(scene, default_rig().unwrap(), config).unwrap();
    run(&simulation, config_for(&simulation).unwrap()).unwrap()
}

/// Golden table. precision and recall: 1 is perfect (recall counts every true corner between 0.5 m and 6 m, seen in part or not). range %,
/// end %, rms m, landmark m: smaller is better. in 3σ: 0.997 is right for one dimension, 1 is cautious. NEES/3: 1 is right, below is
/// cautious, above is over-confident. wrong: updates by another corner than the landmark's; 0 is right.
#[test]
#[ignore = "golden run: cargo xtask test"]
fn a_drive_round_the_corridor_ends_where_it_should() {
    let scores: Vec<Score> = std::thread::scope(|scope| {
        let runs: Vec<_> = SEEDS.into_iter().map(|seed| scope.spawn(move || drive(seed))).collect();
        runs.into_iter().map(|run| run.join().unwrap()).collect()
    });
    let mut table = String::from(
        "seed  path m  precision  recall  range %  end %  rms m  in 3σ  NEES/3  map of seen  landmark m  wrong\n",
    );
    for (seed, score) in SEEDS.into_iter().zip(&scores) {
        let [landmarks, seen] = score.map;
        let (range, end) = (100.0 * median(&score.range_errors), 100.0 * score.end_share());
        let (precision, recall) = (score.precision(), score.recall());
        let (landmark, wrong) = (median(&score.landmark_errors), score.wrong[0]);
        let (path, rms, inside, nees) =
            (score.path, score.position_rms, score.within_3_sigma, score.nees / 3.0);
        writeln!(
            table,
            "{seed:4}  {path:6.1}  {precision:9.3}  {recall:6.3}  {range:7.2}  {end:5.2}  {rms:5.3}  {inside:5.3}  \
             {nees:6.2}  {landmarks:4} of {seen:4}  {landmark:10.3}  {wrong:5}"
        )
        .unwrap();
    }
    println!("{table}");
    insta::assert_snapshot!(table);
    for (seed, score) in SEEDS.into_iter().zip(&scores) {
        assert!(score.path >= 60.0, "seed {seed}: {} m", score.path);
        assert!(score.precision() >= 0.9, "seed {seed}: precision {}", score.precision());
        assert!(median(&score.range_errors) <= 0.02, "seed {seed}: {}", median(&score.range_errors));
        assert!(score.end_share() <= 0.01, "seed {seed}: end {}", score.end_share());
        assert!(score.within_3_sigma >= 0.95, "seed {seed}: {} inside 3σ", score.within_3_sigma);
    }
}
