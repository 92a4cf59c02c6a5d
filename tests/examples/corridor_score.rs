//! Scores the pipeline on simulated corridors: `corridor_score [SEEDS] [FRAMES] [ODOMETRY NOISE SCALE]`.
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};
use monorange_tests::corridor::{config_for, median, run};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let numbers: Vec<f64> = std::env::args().skip(1).map(|word| word.parse()).collect::<Result<_, _>>()?;
    let number = |index: usize, default| numbers.get(index).copied().unwrap_or(default);
    for seed in 1..=number(0, 5.0) as u64 {
        let scene = Scene::corridor(&SceneConfig { seed, ..Default::default() });
        let config = SimConfig {
            seed,
            frames: number(1, 600.0) as usize,
            odometry_noise_scale: number(2, 1.0),
            ..Default::default()
        };
        let simulation = Simulation::new(scene, default_rig()?, config)?;
        let score = run(&simulation, config_for(&simulation)?)?;
        println!(
            "seed {seed}: path {:.1} m, precision {:.3}, recall {:.3}, range {:.2} %, end {:.2} %, rms {:.3} m, \
             3σ {:.3}, NEES {:.2}, map {} of {}, landmarks {:.3} m, wrong {:?}",
            score.path,
            score.precision(),
            score.recall(),
            100.0 * median(&score.range_errors),
            100.0 * score.end_share(),
            score.position_rms,
            score.within_3_sigma,
            score.nees,
            score.map[0],
            score.map[1],
            median(&score.landmark_errors),
            score.wrong,
        );
    }
    Ok(())
}
