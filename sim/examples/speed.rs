//! Prints how many pictures a second one core draws: `speed [FRAMES]`.
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let frames = std::env::args().nth(1).map_or(Ok(200), |frames| frames.parse())?;
    let scene = Scene::corridor(&SceneConfig::default());
    let simulation = Simulation::new(scene, default_rig()?, SimConfig { frames, ..SimConfig::default() })?;
    let mut pixels = vec![0; simulation.rig().camera().width() * simulation.rig().camera().height()];
    let mut times = Vec::new();
    for frame in 0..frames {
        let started = Instant::now();
        simulation.render(frame, &mut pixels)?;
        times.push(started.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    let [least, median] = [0, times.len() / 2].map(|k| times.get(k).copied().unwrap_or_default());
    println!(
        "{} × {} pixels, {frames} frames",
        simulation.rig().camera().width(),
        simulation.rig().camera().height()
    );
    println!("fastest {:.2} ms, median {:.2} ms: {:.0} frames/s", 1e3 * least, 1e3 * median, 1.0 / median);
    Ok(())
}
