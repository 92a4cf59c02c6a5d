//! Association among people, in pixels and in the map: `dynamic_corridor [SEEDS] [FRAMES] [ODOMETRY NOISE SCALE]…`.
use monorange_core::pipeline::Carrier;
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};
use monorange_tests::dynamic::{Association, associate};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let numbers: Vec<f64> = std::env::args().skip(1).map(|word| word.parse()).collect::<Result<_, _>>()?;
    let number = |index: usize, default| numbers.get(index).copied().unwrap_or(default);
    let carriers = [Carrier::Map, Carrier::Floor, Carrier::Free];
    let scales = numbers.get(2..).filter(|scales| !scales.is_empty()).unwrap_or(&[1.0, 3.0]);
    for scale in scales {
        let mut sums = [Association::default(); 3];
        for seed in 1..=number(0, 5.0) as u64 {
            let scene = Scene::corridor(&SceneConfig { seed, ..Default::default() });
            let config = SimConfig {
                seed,
                frames: number(1, 120.0) as usize,
                walkers: 5,
                odometry_noise_scale: *scale,
                ..Default::default()
            };
            let simulation = Simulation::new(scene, default_rig()?, config)?;
            for (sum, score) in sums.iter_mut().zip(associate(&simulation, &carriers)?) {
                *sum = sum.with(score);
            }
        }
        for (carrier, sum) in carriers.iter().zip(sums) {
            println!(
                "{scale}× {carrier:?}: wrong {:.2} % of {}, missed {:.1} % of {}, map {} of {} ({:.3}), carried {} of {}, end {:.2} %",
                100.0 * sum.wrong_share(),
                sum.updates,
                100.0 * sum.missed_share(),
                sum.expected,
                sum.landmarks,
                sum.seen,
                sum.map_ratio(),
                sum.carried,
                sum.frames,
                100.0 * sum.end_error / sum.path,
            );
        }
    }
    Ok(())
}
