//! The plots over time: pose errors inside ±3σ (the paper's Figure 7), and the innovations.
use super::{Run, chart::Chart};
use crate::files::Stamped;
use monorange_core::geometry::wrap_angle;

const POSE_HEIGHT: f64 = 150.0;
/// 95 % of the normalised innovations squared of two degrees of freedom lie below.
const NIS_95: f64 = 5.991;
/// The gate, 99 %.
const NIS_99: f64 = 9.210;
/// Highest innovation that is drawn to scale.
const NIS_TOP: f64 = 16.0;
/// Innovations in the running mean.
const WINDOW: usize = 64;

/// x, y and heading: with truth the error inside ±3σ, without it ±3σ alone.
pub(super) fn pose(run: &Run) -> String {
    let start = run.start();
    let with_truth = !run.pairs.is_empty();
    let components =
        [("x", "cm", 100.0, 0), ("y", "cm", 100.0, 1), ("heading", "°", 180.0 / std::f64::consts::PI, 2)];
    let mut svgs = String::new();
    for (name, unit, factor, index) in components {
        let sigma = |stamped: &Stamped| {
            let variance = stamped.covariance.map_or(0.0, |covariance| covariance[(index, index)]);
            3.0 * variance.max(0.0).sqrt() * factor
        };
        let band: Vec<_> = run
            .trajectory
            .iter()
            .map(|stamped| [stamped.time - start, -sigma(stamped), sigma(stamped)])
            .collect();
        let errors: Vec<[f64; 2]> = run
            .pairs
            .iter()
            .map(|pair| {
                let (estimate, truth) = (pair.estimate.pose, pair.truth);
                let error = match index {
                    0 => estimate.x - truth.x,
                    1 => estimate.y - truth.y,
                    _ => wrap_angle(estimate.heading - truth.heading),
                };
                [pair.estimate.time - start, error * factor]
            })
            .collect();
        let reach = band.iter().map(|[_, _, high]| *high).chain(errors.iter().map(|[_, error]| error.abs()));
        let top = reach.fold(0.0, f64::max).max(1e-3) * 1.08;
        let title = if with_truth { format!("Error in {name}") } else { format!("±3σ of {name}") };
        let mut chart = Chart::new(&title, unit, [0.0, run.seconds()], [-top, top], POSE_HEIGHT);
        chart.band("band", &band);
        chart.line("zero", &[[0.0, 0.0], [run.seconds(), 0.0]]);
        chart.line("error", &errors);
        svgs += &chart.svg(&title);
    }
    svgs
}

/// The normalised innovations squared against their band.
pub(super) fn innovations(run: &Run) -> String {
    let start = run.start();
    let with_nis = run.observations.iter().filter_map(|seen| Some((seen, f64::from(seen.nis?))));
    let (used, refused): (Vec<_>, Vec<_>) = with_nis.partition(|(seen, _)| seen.is_matched());
    let place = |seen: &(&super::Observation, f64)| [seen.0.time - start, seen.1.min(NIS_TOP)];
    let refused: Vec<_> = refused.iter().map(place).collect();
    let mean: Vec<_> = used
        .windows(WINDOW)
        .filter_map(|window| {
            let (last, _) = window.last()?;
            Some([last.time - start, window.iter().map(|(_, nis)| nis).sum::<f64>() / WINDOW as f64])
        })
        .collect();
    let mut chart = Chart::new(
        "Normalised innovation squared",
        "2 degrees of freedom",
        [0.0, run.seconds()],
        [0.0, NIS_TOP],
        240.0,
    );
    chart.dots("nis", &used.iter().map(place).collect::<Vec<_>>());
    chart.dots("nis-gated", &refused);
    chart.rule("zero", NIS_95, "95 %");
    chart.rule("limit", NIS_99, "gate, 99 %");
    chart.line("nis-mean", &mean);
    chart.svg("Normalised innovation squared of every match over time")
}
