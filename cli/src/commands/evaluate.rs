//! `evaluate`: a trajectory and a map against the truth.
use crate::outputs::to_file_or_stdout;
use clap::Args;
use monorange_formats::{
    Error, Result,
    evaluation::{
        Align, MapErrors, MapPairing, Pair, TrajectoryErrors, Truth, map_errors, trajectory_errors,
    },
    files::{read_map, read_trajectory},
};
use nalgebra::Vector2;
use serde::Serialize;
use std::path::PathBuf;

/// Errors of a trajectory, and of a map, against the truth, as JSON.
///
/// Trajectories are TUM (`t tx ty tz qx qy qz qw`) or CSV (`t,x,y,heading` and, for NEES, the six covariances of
/// trajectory.csv). The truth is interpolated at every estimated pose's time; poses that it does not cover are
/// counted and left out. Lengths in metres, angles in radians; 1 is right for every `…_per_dof`.
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  monorange simulate --scene corridor --frames 10 --out corridor-10
  monorange evaluate --truth corridor-10/truth.tum --estimate corridor-10/truth.tum")]
pub struct Arguments {
    /// True trajectory (TUM or CSV).
    #[arg(long, value_name = "FILE")]
    truth: PathBuf,
    /// Estimated trajectory (TUM or CSV).
    #[arg(long, value_name = "FILE")]
    estimate: PathBuf,
    /// True landmarks (CSV id,x,y).
    #[arg(long, value_name = "FILE", requires = "map")]
    true_map: Option<PathBuf>,
    /// Estimated landmarks (map.csv).
    #[arg(long, value_name = "FILE", requires = "true_map")]
    map: Option<PathBuf>,
    /// What is fitted before errors are measured; NEES is given for `none` only.
    #[arg(long, value_enum, default_value_t)]
    align: Align,
    /// Length of the stretches for the relative error, m.
    #[arg(long, value_name = "METRES", default_value_t = 1.0, value_parser = positive)]
    delta: f64,
    /// True poses further apart than this are not interpolated between, s.
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0, value_parser = positive)]
    max_gap: f64,
    /// Landmarks further apart than this are not the same, m.
    #[arg(long, value_name = "METRES", default_value_t = 0.5, value_parser = positive)]
    map_gate: f64,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

fn positive(text: &str) -> std::result::Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite() && *number > 0.0);
    number.ok_or_else(|| "must be a number above 0".to_owned())
}

/// What cannot be fitted to poses that all stand at one place.
fn check_motion(arguments: &Arguments, pairs: &[Pair]) -> Result<()> {
    let spread = |position: fn(&Pair) -> Vector2<f64>| {
        let first = pairs.first().map(position).unwrap_or_default();
        pairs.iter().map(|pair| (position(pair) - first).norm()).fold(0.0, f64::max)
    };
    let (truth, estimate) =
        (spread(|pair| pair.truth.position()), spread(|pair| pair.estimate.pose.position()));
    for (name, path, spread) in
        [("truth", &arguments.truth, truth), ("estimate", &arguments.estimate, estimate)]
    {
        // A millimetre is below what any truth is good for.
        if spread > 1e-3 {
            continue;
        }
        let error = Error::new(format!(
            "the {name} does not move ({} poses within {:.1} mm)",
            pairs.len(),
            1e3 * spread
        ))
        .at(path);
        match arguments.align {
            Align::Sim2 => return Err(error.help("no scale can be fitted to it: use --align none or se2")),
            Align::Se2 => error.help("no rotation can be fitted to it").warn(),
            Align::None if name == "truth" => error.help("errors in percent of its path say nothing").warn(),
            Align::None => {}
        }
    }
    Ok(())
}

#[derive(Serialize)]
struct Evaluation {
    trajectory: TrajectoryErrors,
    poses_without_truth: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    map: Option<MapErrors>,
}

/// Runs the command.
///
/// # Errors
/// When a file is missing or malformed, or truth and estimate have no time in common.
pub fn run(arguments: &Arguments) -> Result<()> {
    let truth = read_trajectory(&arguments.truth)?;
    let estimate = read_trajectory(&arguments.estimate)?;
    let pairs = Truth::new(&truth, arguments.max_gap).pairs(&estimate);
    if pairs.is_empty() {
        let range = |poses: &[monorange_formats::files::Stamped]| match poses {
            [first, .., last] => format!("{} s to {} s", first.time, last.time),
            poses => poses.first().map_or(String::new(), |only| format!("{} s", only.time)),
        };
        let cause = format!("covers {}, the truth {}: no pose to compare", range(&estimate), range(&truth));
        return Err(Error::new(cause)
            .at(&arguments.estimate)
            .help("give both on the same clock, or a larger --max-gap"));
    }
    check_motion(arguments, &pairs)?;
    let trajectory = trajectory_errors(&pairs, arguments.align, arguments.delta);
    let map = match (&arguments.map, &arguments.true_map) {
        (Some(map), Some(true_map)) => {
            let pairing = MapPairing::Closest(arguments.map_gate);
            Some(map_errors(&read_map(map)?, &read_map(true_map)?, &trajectory.alignment, pairing))
        }
        _ => None,
    };
    let evaluation = Evaluation { poses_without_truth: estimate.len() - pairs.len(), trajectory, map };
    let text = serde_json::to_string_pretty(&evaluation).map_err(Error::new)?;
    to_file_or_stdout(arguments.out.as_deref(), |out| writeln!(out, "{text}"))
}
