//! Drives into trouble: `trouble SCENE CARRIER SEEDS [frames=600] [long=0.05] [turns=0.05] [tilt=1] [roll=1] [yaw=1] [proposals]
//! [scale=0.03] [turn_scale=0.02] [turn_bias=0.002] [pitch=1.5] [sway=1.5] [walk=0.06] [readout=0.033] [shutter=0.033] [speed=0.2]
//! [interval=0.6]`, a line a seed; SEEDS is `1-10`, CARRIER is `map`, `floor` or `none`, which is without wheels.
//!
//! `pitch` is by how many degrees the robot pitches, `readout` how many seconds its camera's rolling shutter takes; `sway` and `shutter` are
//! what the settings say of them, `walk` (degrees) what they say of the mount.
//! `long` and `turns` are the shares by which the wheels read travel and turns too long; the angles (degrees) are by how much the
//! camera is knocked when half of the drive is over.
use monorange_core::geometry::{Mount, RangeFinder};
use monorange_core::pipeline::{Carrier, CornersFrom, MotionFrom};
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};
use monorange_tests::corridor::{Score, Trouble, config_for, run_into};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

type Failure = Box<dyn std::error::Error + Send + Sync>;

fn main() -> Result<(), Failure> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [scene, carrier, seeds, ..] = words.as_slice() else {
        return Err("usage: trouble SCENE CARRIER SEEDS [KEY=NUMBER …]".into());
    };
    let (first, last) = seeds.split_once('-').ok_or("seeds are two numbers with a dash between them")?;
    let (next, last) = (AtomicU64::new(first.parse()?), last.parse::<u64>()?);
    let lines = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        let work = || -> Result<(), Failure> {
            loop {
                let seed = next.fetch_add(1, Ordering::Relaxed);
                if seed > last {
                    return Ok(());
                }
                let score = drive(scene, carrier, seed, &words)?;
                println!("{}", line(seed, &score));
                lines.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(score);
            }
        };
        let threads: Vec<_> = (0..2).map(|_| scope.spawn(work)).collect();
        threads.into_iter().try_for_each(|thread| thread.join().map_err(|_| "a drive panicked")?)
    })?;
    let scores = lines.into_inner()?;
    let mean = |of: &dyn Fn(&Score) -> f64| scores.iter().map(of).sum::<f64>() / scores.len().max(1) as f64;
    println!(
        "mean: end {:.2} %, rms {:.3} m, 3σ {:.3}, after {:.3}, NEES/3 {:.2}",
        100.0 * mean(&Score::end_share),
        mean(&|score| score.position_rms),
        mean(&|score| score.within_3_sigma),
        mean(&|score| score.recovered),
        mean(&|score| score.nees) / 3.0
    );
    Ok(())
}

fn drive(scene: &str, carrier: &str, seed: u64, words: &[String]) -> Result<Score, Failure> {
    let number = |key: &str| {
        words.iter().find_map(|word| word.strip_prefix(key)?.strip_prefix('=')?.parse::<f64>().ok())
    };
    let frames = number("frames").unwrap_or(600.0) as usize;
    let simulation = |rig: RangeFinder<f64>| {
        let looks = SceneConfig { seed, ..Default::default() };
        let scene = if scene == "office" { Scene::office(&looks) } else { Scene::corridor(&looks) };
        Simulation::new(
            scene,
            rig,
            SimConfig {
                seed,
                frames,
                pitch: number("pitch").unwrap_or(0.0).to_radians(),
                readout: number("readout").unwrap_or(0.0),
                speed: number("speed").unwrap_or(0.2),
                interval: number("interval").unwrap_or(0.6),
                ..Default::default()
            },
        )
    };
    let straight = simulation(default_rig()?)?;
    let mut config = config_for(&straight)?;
    match carrier {
        "floor" => config.carrier = Carrier::Floor,
        "none" => config.motion_from = MotionFrom::Pictures,
        _ => {}
    }
    if carrier != "none" {
        config.motion = config.motion.with_scales();
    }
    if words.iter().any(|word| word == "proposals") {
        config.corners_from = CornersFrom::Proposals;
    }
    config.sway = number("sway").unwrap_or(0.0).to_radians() as f32;
    config.mount_walk = number("walk").unwrap_or(0.0).to_radians() as f32;
    config.readout = number("shutter").unwrap_or(0.0) as f32;
    let motion = &mut config.motion;
    for (key, std) in [
        ("scale", &mut motion.speed_scale),
        ("turn_scale", &mut motion.turn_scale),
        ("turn_bias", &mut motion.turn_bias),
    ] {
        *std = number(key).map_or(*std, |number| number as f32);
    }
    let angles = ["tilt", "roll", "yaw"].map(|key| number(key).unwrap_or(0.0).to_radians());
    let mut parameters = straight.rig().mount().parameters();
    for (parameter, angle) in parameters.iter_mut().skip(1).zip(angles) {
        *parameter += angle;
    }
    let knocked = simulation(RangeFinder::new(*straight.rig().camera(), Mount::new(parameters)?))?;
    let trouble = Trouble {
        wheels_long: ["long", "turns"].map(|key| number(key).unwrap_or(0.0)),
        knock: angles.iter().any(|angle| *angle != 0.0).then_some((frames / 2, &knocked)),
    };
    Ok(run_into(&straight, config, &trouble)?)
}

fn line(seed: u64, score: &Score) -> String {
    let [wheels, wheels_std] = score.wheels;
    let [mount, mount_std] = score.mount;
    format!(
        "seed {seed}: end {:.2} %, rms {:.3} m, 3σ {:.3}, after {:.3}, NEES/3 {:.2}, map {} of {}, landmarks {:.3} m, range at 3 m {:.2} %, {}{}; \
         wheels {:.2}±{:.2} {:.2}±{:.2} % {:.4}±{:.4} rad/m; mount {:.1}±{:.1} mm {:.2}±{:.2} {:.2}±{:.2} {:.2}±{:.2}°",
        100.0 * score.end_share(),
        score.position_rms,
        score.within_3_sigma,
        score.recovered,
        score.nees / 3.0,
        score.map[0],
        score.map[1],
        monorange_tests::corridor::median(&score.landmark_errors),
        100.0 * monorange_tests::corridor::median(&score.range_errors_at_3_m),
        score.verdict.as_str(),
        score.reason.map_or_else(String::new, |reason| format!(" ({})", reason.as_str())),
        100.0 * wheels[0],
        100.0 * wheels_std[0],
        100.0 * wheels[1],
        100.0 * wheels_std[1],
        wheels[2],
        wheels_std[2],
        1e3 * mount[0],
        1e3 * mount_std[0],
        mount[1].to_degrees(),
        mount_std[1].to_degrees(),
        mount[2].to_degrees(),
        mount_std[2].to_degrees(),
        mount[3].to_degrees(),
        mount_std[3].to_degrees(),
    )
}
