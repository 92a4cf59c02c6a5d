//! What `slam` and `slam-log` give: the same files, and the same lines.
use crate::outputs::{Outputs, to_file_or_stdout};
use monorange_core::geometry::Pose;
use monorange_formats::{
    Error, Result,
    evaluation::Truth,
    report::{OUTPUTS, Run},
};
use std::path::Path;

/// The world of the truth, seen from the map: the first true pose is the map's origin.
pub(super) fn map_from_world(truth: &Truth<'_>, start: f64) -> Result<Pose<f64>> {
    truth.at(start).map(|pose| pose.inverse()).ok_or_else(|| no_first_pose(start))
}

/// What is wrong with a truth that begins too late.
pub(super) fn no_first_pose(start: f64) -> Error {
    Error::new(format!("has no pose at the start, {start} s"))
        .help("give the truth on the same clock, from the start on")
}

/// Writes trajectory, map, observations and reports.
pub(super) fn write(outputs: &mut Outputs, run: &Run) -> Result<()> {
    OUTPUTS.iter().try_for_each(|name| outputs.write(name, |out| run.write(name, out)))
}

/// Prints the summary, for a person or as JSON.
pub(super) fn print(run: &Run, folder: &Path, as_json: bool) -> Result<()> {
    let json = serde_json::to_string_pretty(&run.summary()).map_err(Error::new)?;
    to_file_or_stdout(None, |out| {
        if as_json {
            return writeln!(out, "{json}");
        }
        let [x, y, heading] = run.end_std();
        writeln!(out, "{}: {} of {} frames used, {}", run.title, run.frames_used, run.frames, run.verdict)?;
        writeln!(out, "  path       {:.2} m in {:.1} s", run.path(), run.seconds())?;
        writeln!(out, "  end, 1σ    {:.3} m, {:.2}°", x.hypot(y), heading.to_degrees())?;
        let (landmarks, measured) = (run.map.len(), run.observations.len());
        writeln!(out, "  landmarks  {landmarks} from {measured} {}", run.subject.long())?;
        if let Some(errors) = &run.errors {
            let absolute = &errors.absolute;
            let (end, percent) = (absolute.end_position, absolute.end_position_percent);
            let turn = absolute.end_heading.to_degrees();
            writeln!(out, "  end error  {end:.3} m ({percent:.2} % of the path), {turn:.2}°")?;
            if let Some(nees) = &errors.nees {
                let (mean, inside) = (nees.mean_per_dof, 100.0 * nees.inside_3_sigma);
                writeln!(out, "  NEES/3     {mean:.2} (1 is right), {inside:.1} % of the poses inside 3σ")?;
            }
        }
        if let Some(map) = &run.map_errors {
            let [raw, aligned] = [map.position.rms, map.aligned_position.rms];
            let (matched, truth) = (map.matched, map.truth);
            writeln!(
                out,
                "  map error  {raw:.3} m rms, {aligned:.3} m aligned, {matched} of {truth} landmarks"
            )?;
        }
        writeln!(out, "  report     {}", folder.join("report.html").display())
    })
}
