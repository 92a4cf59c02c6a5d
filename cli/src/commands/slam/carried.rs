//! A robot that was carried away while it drove, and is found again in the map that it has made.
use super::placed::{double, of_the_frame, put};
use monorange_core::{
    geometry::Pose,
    pipeline::{OnHeap, Pipeline, Recovered, Report},
};
use monorange_formats::{
    Error,
    files::Stamped,
    report::{Observation, Run},
};

/// Puts what was driven since the robot was missed to where it was, and says so. `frames` are those of the run's poses. Returns the poses of
/// these pictures, the last one at hand.
pub(super) fn put_back(
    found: &Recovered,
    pipeline: &Pipeline<OnHeap>,
    frames: &[usize],
    run: &mut Run,
) -> Vec<Pose<f32>> {
    let moved = double(found.located.map_from_own);
    let filter = pipeline.filter();
    let now = (double(filter.pose()), filter.pose_covariance().cast());
    let uncertain = of_the_frame(&moved, &now, &found.own_covariance.cast());
    let first = run.trajectory.len().saturating_sub(found.reports.len());
    let since = run.trajectory.get(first).map_or(f64::INFINITY, |missed| missed.time);
    run.observations.retain(|seen| seen.time < since);
    let (path, poses) = (run.path(), run.trajectory.iter_mut().skip(first));
    for ((stamped, frame), report) in poses.zip(frames.iter().skip(first)).zip(&found.reports) {
        let (pose, covariance) = (double(report.pose), Some(report.pose_covariance.cast()));
        *stamped = Stamped { time: stamped.time, pose, covariance };
        put(stamped, &moved, &uncertain);
        run.observations.extend(report.corners.iter().map(|corner| {
            let mut seen = Observation::of_corner(stamped.time, *frame, corner);
            let name = found.located.names.iter().find(|(own, _)| seen.landmark == Some(*own));
            seen.landmark = name.map(|(_, name)| *name).or(seen.landmark);
            seen
        }));
    }
    if let Some(last) = run.trajectory.last_mut() {
        (last.pose, last.covariance) = (now.0, Some(now.1));
        Error::new(format!(
            "the robot is missed where its map has it at {since:.1} s, and found elsewhere in it at {:.1} s, after {path:.1} m: it was carried \
             there, or its wheels slipped",
            last.time
        ))
        .help("the poses of the second before it was missed are not to be relied on")
        .warn();
    }
    let place = |report: &Report| found.located.map_from_own.compose(&report.pose);
    found.reports.iter().map(place).collect()
}
