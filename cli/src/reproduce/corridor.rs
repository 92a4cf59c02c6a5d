//! Figures 6 and 7: a corridor with people in it, its map over the laser's, and the errors of the pose.
//!
//! The paper's drive is simulated: 66 m round at 0.2 m/s, Table 1's camera at 320×240, five people who cross and
//! stop. Every method gets the same pictures, corners and odometry.
use super::method::{METHODS, Runner, wheels_before};
use super::{Figures, Section};
use monorange_core::features::Detector;
use monorange_core::geometry::wrap_angle;
use monorange_core::image::Grey;
use monorange_core::pipeline::{Config, MotionNoise, OnHeap, Pipeline, VisualConfig};
use monorange_formats::evaluation::{Align, Pair, TrajectoryErrors, trajectory_errors};
use monorange_formats::files::{MapPoint, Rig, confirmed_map};
use monorange_formats::report::{chart::Chart, floor_plan};
use monorange_formats::{Error, Result};
use monorange_sim::{MOUNT_STD, PIXEL_STD, Scene, SceneConfig, SimConfig, Simulation, default_rig};
use nalgebra::Vector2;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Pictures of a drive once round.
const FRAMES: usize = 560;
const WALKERS: usize = 5;

/// What a method made of a drive.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Poses with the truth.
    pub pairs: Vec<Pair>,
    /// Errors over the whole drive.
    pub errors: TrajectoryErrors,
    /// Confirmed landmarks.
    pub map: Vec<MapPoint>,
    /// Distances of landmarks from the nearest true corner, m, sorted.
    pub landmark_errors: Vec<f64>,
    /// Share of poses whose x, y and heading are each within 3σ: the least of the three.
    pub within_3_sigma: f64,
}

/// A drive, and what every method made of it.
#[derive(Clone, Debug)]
pub struct Drive {
    /// Seed of scene, people and noise.
    pub seed: u64,
    /// In the order of the methods: ours, as in the paper, the paper without its homography.
    pub outcomes: Vec<Outcome>,
    /// True corners in the map's frame.
    pub true_map: Vec<Vector2<f64>>,
    /// Laser echoes in the map's frame, of the first drive only.
    pub laser: Vec<Vector2<f64>>,
}

/// The simulation of a seed.
///
/// # Errors
/// None in practice: the settings are valid.
pub fn simulation(seed: u64, frames: usize) -> Result<Simulation> {
    let scene = Scene::corridor(&SceneConfig { seed, ..SceneConfig::default() });
    let config = SimConfig { seed, frames, walkers: WALKERS, ..SimConfig::default() };
    Simulation::new(scene, default_rig().map_err(Error::new)?, config).map_err(Error::new)
}

/// The pipeline's defaults for a simulation: its rig, and the noise that its odometry was drawn with.
///
/// # Errors
/// None in practice.
pub fn defaults(simulation: &Simulation) -> Result<Config> {
    let noise = simulation.odometry_noise();
    let motion = MotionNoise {
        speed_by_speed: noise.speed_by_speed.hypot(noise.speed_scale) as f32,
        turn_by_turn: noise.turn_by_turn.hypot(noise.turn_scale) as f32,
        turn_by_speed: noise.turn_by_speed as f32,
        ..MotionNoise::default()
    };
    let rig = Rig::new(*simulation.rig(), PIXEL_STD, MOUNT_STD)?;
    Ok(Config { motion, ..rig.settings })
}

/// Drives of the seeds 1 to `seeds`, side by side on the machine's cores; `done` is called after each.
///
/// # Errors
/// When the simulator or the pipeline refuses its settings, which would be a mistake here.
pub fn drives(seeds: u64, done: impl Fn() + Sync) -> Result<Vec<Drive>> {
    let next = AtomicU64::new(1);
    let all = Mutex::new(Vec::new());
    let work = || loop {
        let seed = next.fetch_add(1, Ordering::Relaxed);
        if seed > seeds {
            return;
        }
        let outcome = drive(seed, FRAMES);
        all.lock().unwrap_or_else(PoisonError::into_inner).push((seed, outcome));
        done();
    };
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
    let mut all = all.into_inner().unwrap_or_else(PoisonError::into_inner);
    all.sort_by_key(|(seed, _)| *seed);
    all.into_iter().map(|(_, drive)| drive).collect()
}

/// One drive by every method.
///
/// # Errors
/// As [`drives`].
pub fn drive(seed: u64, frames: usize) -> Result<Drive> {
    let simulation = simulation(seed, frames)?;
    let camera = simulation.rig().camera();
    let (width, height) = (camera.width(), camera.height());
    let base = defaults(&simulation)?;
    let runners = METHODS.iter().map(|method| Runner::new(method, base, frames));
    let mut runners = runners.collect::<Result<Vec<_>>>()?;
    let mut detector = Detector::new(VisualConfig::default().features).map_err(Error::new)?;
    let map_from_world = simulation.true_pose(0).inverse();
    let mut pixels = vec![0; width * height];
    let mut laser = Vec::new();
    for frame in 0..simulation.len() {
        let time = simulation.time(frame);
        let truth = map_from_world.compose(&simulation.true_pose(frame));
        simulation.render(frame, &mut pixels).map_err(Error::new)?;
        let picture = Grey::new(&pixels, width, height).map_err(Error::new)?;
        let wheels = wheels_before(&simulation, frame);
        let features = detector.detect(picture).map_err(Error::new)?;
        for runner in &mut runners {
            runner.step(time, wheels, picture, &features).map_err(Error::new)?;
            runner.note(time, truth);
        }
        if seed == 1 {
            laser.extend(simulation.laser(frame).into_iter().filter_map(|beam| {
                let echo = Vector2::new(beam.bearing.cos(), beam.bearing.sin()) * beam.range?;
                Some(truth.transform(echo))
            }));
        }
    }
    let true_map: Vec<_> =
        simulation.landmarks().iter().map(|landmark| map_from_world.transform(landmark.position)).collect();
    let outcomes = runners.into_iter().map(|runner| outcome(&runner.pipeline, runner.pairs, &true_map));
    Ok(Drive { seed, outcomes: outcomes.collect(), true_map, laser })
}

fn outcome(pipeline: &Pipeline<OnHeap>, pairs: Vec<Pair>, true_map: &[Vector2<f64>]) -> Outcome {
    let map = confirmed_map(pipeline.filter(), 0.0);
    let nearest = |point: &MapPoint| {
        true_map.iter().map(|corner| (corner - point.position).norm()).fold(f64::INFINITY, f64::min)
    };
    let mut landmark_errors: Vec<_> = map.iter().map(nearest).collect();
    landmark_errors.sort_by(f64::total_cmp);
    let errors = trajectory_errors(&pairs, Align::None, 1.0);
    let inside = |axis: usize| {
        let within = |pair: &&Pair| {
            let sigma =
                pair.estimate.covariance.map_or(0.0, |covariance| covariance[(axis, axis)].max(0.0).sqrt());
            deviation(pair, axis).abs() <= 3.0 * sigma + 1e-6
        };
        pairs.iter().filter(within).count() as f64 / pairs.len().max(1) as f64
    };
    let within_3_sigma = [0, 1, 2].map(inside).into_iter().fold(1.0, f64::min);
    Outcome { pairs, errors, map, landmark_errors, within_3_sigma }
}

/// Estimate less truth in x, y (m) or heading (rad).
fn deviation(pair: &Pair, axis: usize) -> f64 {
    let (estimate, truth) = (pair.estimate.pose, pair.truth);
    match axis {
        0 => estimate.x - truth.x,
        1 => estimate.y - truth.y,
        _ => wrap_angle(estimate.heading - truth.heading),
    }
}

fn median(sorted: &[f64]) -> f64 {
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The map of the first drive over the laser's, and the landmarks' errors of all.
///
/// # Errors
/// Without a drive.
pub fn figure6(drives: &[Drive]) -> Result<Section> {
    let first = drives.first().ok_or_else(|| Error::new("there is no drive"))?;
    let mut header = vec!["seed"];
    header.extend(METHODS.iter().flat_map(|method| [method.name, "median cm", "90 % cm"]));
    let caption = "Landmarks, and their distance from the nearest true corner";
    let mut table = Figures::new(caption, &header);
    let cells = |sorted: &[f64]| {
        let ninth = sorted.get(sorted.len() * 9 / 10).copied().unwrap_or(f64::NAN);
        [sorted.len().to_string(), format!("{:.1}", 100.0 * median(sorted)), format!("{:.1}", 100.0 * ninth)]
    };
    for drive in drives {
        let outcomes = drive.outcomes.iter().flat_map(|outcome| cells(&outcome.landmark_errors));
        table.row([drive.seed.to_string()].into_iter().chain(outcomes));
    }
    let all = |method: usize| {
        let errors = drives.iter().filter_map(|drive| drive.outcomes.get(method));
        let mut errors: Vec<_> = errors.flat_map(|outcome| outcome.landmark_errors.iter().copied()).collect();
        errors.sort_by(f64::total_cmp);
        errors
    };
    table
        .row(["all".to_owned()].into_iter().chain((0..METHODS.len()).flat_map(|method| cells(&all(method)))));
    let drawings = first.outcomes.iter().zip(METHODS).map(|(outcome, method)| {
        let trajectory: Vec<_> = outcome.pairs.iter().map(|pair| pair.estimate).collect();
        let above = floor_plan::FromAbove {
            trajectory: &trajectory,
            pairs: &outcome.pairs,
            map: &outcome.map,
            true_map: &first.true_map,
            laser: &first.laser,
        };
        let caption = format!(
            "{}: landmarks with 3σ (green) over the laser (grey), path (blue), truth (dashed), true corners (+). Seed 1.",
            capital(method.name)
        );
        (caption, floor_plan::svg(&above))
    });
    Ok(Section {
        name: "figure6",
        title: "Figure 6: the map over the laser’s",
        words: vec![format!(
            "{} drives of 66 m through simulated corridors with {WALKERS} people, Table 1’s camera at 320×240 and odometry that slips. The \
             laser is drawn from the true poses and is not used.",
            drives.len()
        )],
        tables: vec![table],
        drawings: drawings.collect(),
    })
}

/// Errors of the pose inside 3σ for the first drive, and of all drives in figures.
///
/// # Errors
/// Without a drive.
pub fn figure7(drives: &[Drive]) -> Result<Section> {
    let first = drives.first().ok_or_else(|| Error::new("there is no drive"))?;
    let header = ["ATE rms cm", "end cm", "end % of path", "heading rms °", "NEES/3", "within 3σ %"];
    let headed = |first| [first].into_iter().chain(header).collect::<Vec<_>>();
    let mut summary =
        Figures::new(format!("Pose errors, mean of {} drives", drives.len()), &headed("method"));
    let mut tables = Vec::new();
    for (index, method) in METHODS.iter().enumerate() {
        let mut table = Figures::new(format!("Pose errors, {}", method.name), &headed("seed"));
        let mut means = [0.0; FIGURES];
        for drive in drives {
            let Some(outcome) = drive.outcomes.get(index) else { continue };
            let figures = figures(outcome);
            for (mean, figure) in means.iter_mut().zip(figures) {
                *mean += figure / drives.len() as f64;
            }
            table.row([drive.seed.to_string()].into_iter().chain(cells(figures)));
        }
        summary.row([method.name.to_owned()].into_iter().chain(cells(means)));
        tables.push(table);
    }
    tables.insert(0, summary);
    Ok(Section {
        name: "figure7",
        title: "Figure 7: errors of the pose inside three standard deviations",
        words: vec![
            "Estimate less truth of the first drive, for each method; the area is ±3σ of ours. Below, every drive in figures: ATE is the \
             root mean square distance from the true position without any alignment; NEES/3 is 1 for a filter that knows how wrong it is."
                .to_owned(),
            "Ours: right-invariant filter on pixels, with the mount’s errors as states; the floor’s homography between pictures \
             carries the corners and, together with the wheels, gives the motion. As in the paper: textbook filter on range and \
             bearing, motion from the wheels, corners carried by the homography of eight parameters. Paper, no homography: the same \
             with corners matched in the map alone. Corners within 3° of the horizon are left out by all."
                .to_owned(),
        ],
        tables,
        drawings: charts(first),
    })
}

fn ate(outcome: &Outcome) -> f64 {
    outcome.errors.absolute.position.rms
}

fn nees(outcome: &Outcome) -> f64 {
    outcome.errors.nees.as_ref().map_or(f64::NAN, |nees| nees.mean_per_dof)
}

/// What is told of a drive.
const FIGURES: usize = 6;

fn figures(outcome: &Outcome) -> [f64; FIGURES] {
    let absolute = &outcome.errors.absolute;
    [
        100.0 * ate(outcome),
        100.0 * absolute.end_position,
        absolute.end_position_percent,
        absolute.heading.rms.to_degrees(),
        nees(outcome),
        100.0 * outcome.within_3_sigma,
    ]
}

fn cells(figures: [f64; FIGURES]) -> impl Iterator<Item = String> {
    let digits = [1, 1, 2, 2, 2, 2];
    figures.into_iter().zip(digits).map(|(figure, digits)| format!("{figure:.digits$}"))
}

fn charts(drive: &Drive) -> Vec<(String, String)> {
    let components = [("x", "cm", 100.0), ("y", "cm", 100.0), ("heading", "°", 180.0 / std::f64::consts::PI)];
    let chart = |(axis, (name, unit, factor)): (usize, (&str, &str, f64))| {
        let curves: Vec<Vec<[f64; 2]>> = drive
            .outcomes
            .iter()
            .map(|outcome| {
                outcome
                    .pairs
                    .iter()
                    .map(|pair| [pair.estimate.time, factor * deviation(pair, axis)])
                    .collect()
            })
            .collect();
        let ours = drive.outcomes.first().map_or(&[][..], |outcome| &outcome.pairs);
        let sigma = |pair: &Pair| {
            factor
                * pair.estimate.covariance.map_or(0.0, |covariance| covariance[(axis, axis)].max(0.0).sqrt())
        };
        let band: Vec<_> =
            ours.iter().map(|pair| [pair.estimate.time, -3.0 * sigma(pair), 3.0 * sigma(pair)]).collect();
        let values =
            band.iter().map(|[_, _, high]| *high).chain(curves.iter().flatten().map(|[_, y]| y.abs()));
        let top = values.fold(1e-3, f64::max) * 1.08;
        let seconds = ours.last().map_or(1.0, |pair| pair.estimate.time);
        let mut chart = Chart::new(&format!("Error in {name}"), unit, [0.0, seconds], [-top, top], 170.0);
        chart.band("band", &band);
        chart.line("zero", &[[0.0, 0.0], [seconds, 0.0]]);
        for (index, (curve, method)) in curves.iter().zip(METHODS).enumerate().rev() {
            let class = ["error", "series s0", "series s1"].get(index).copied().unwrap_or("series s2");
            chart.line(class, curve);
            if index > 0 {
                // In a stack where the errors are still small.
                let (x, y) = (0.25 * seconds, top * (1.05 - 0.25 * index as f64));
                chart.label(x, y, class.trim_start_matches("series "), method.name);
            }
        }
        let words =
            format!("Error in {name} over time for each method, with three standard deviations of ours");
        (String::new(), chart.svg(&words))
    };
    let mut drawings: Vec<_> = components.into_iter().enumerate().map(chart).collect();
    if let Some((caption, _)) = drawings.last_mut() {
        "Ours: blue, its 3σ: area. Seed 1.".clone_into(caption);
    }
    drawings
}

fn capital(word: &str) -> String {
    let mut characters = word.chars();
    characters.next().map_or(String::new(), |first| first.to_uppercase().chain(characters).collect())
}
