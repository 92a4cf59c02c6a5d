//! What `slam` and `slam-log` give: the same files, and the same lines.
use crate::outputs::{Outputs, to_file_or_stdout};
use monorange_core::slam::Verdict;
use monorange_formats::{
    Error, Result,
    report::{InMap, OUTPUTS, Run},
    warnings,
};
use std::{
    fmt::{self, Write as _},
    path::Path,
};

/// What is wrong with a truth that covers no pose of a run.
pub(super) fn no_common_pose(start: f64) -> Error {
    Error::new(format!("has no pose from the start, {start} s, to the end"))
        .help("give the truth on the same clock, without gaps of more than a second")
}

/// Writes trajectory, map, observations and reports, with what there is to warn of.
pub(super) fn write(outputs: &mut Outputs, run: &mut Run) -> Result<()> {
    if run.map.is_empty() && run.verdict == Verdict::Consistent {
        run.verdict = Verdict::Unchecked; // candidates alone confirm nothing
    }
    run.warn();
    crate::warnings::say();
    run.warnings = warnings::all();
    OUTPUTS.iter().try_for_each(|name| outputs.write(name, |out| run.write(name, out)))
}

/// Prints the summary, for a person or as JSON.
pub(super) fn print(run: &Run, folder: &Path, as_json: bool) -> Result<()> {
    let text = summary(run, folder, as_json)?;
    to_file_or_stdout(None, |out| write!(out, "{text}"))
}

/// The summary, for a person or as JSON, in lines.
pub(super) fn summary(run: &Run, folder: &Path, as_json: bool) -> Result<String> {
    if as_json {
        return Ok(serde_json::to_string_pretty(&run.summary()).map_err(Error::new)? + "\n");
    }
    let mut text = String::new();
    lines(&mut text, run, folder).map_err(Error::new)?;
    Ok(text)
}

fn lines(out: &mut String, run: &Run, folder: &Path) -> fmt::Result {
    let [x, y, heading] = run.end_std();
    let reason = run.reason.map_or_else(String::new, |reason| format!(": {}", reason.as_str()));
    let (title, verdict) = (&run.title, run.verdict.as_str());
    writeln!(out, "{title}: {} of {} frames used, {verdict}{reason}", run.frames_used, run.frames)?;
    writeln!(out, "  path       {:.2} m in {:.1} s", run.path(), run.seconds())?;
    writeln!(out, "  end, 1σ    {:.3} m, {:.2}°", x.hypot(y), heading.to_degrees())?;
    let (landmarks, measured) = (run.map.len(), run.observations.len());
    writeln!(out, "  landmarks  {landmarks} from {measured} {}", run.subject.long())?;
    if let Some(when) = run.knocked_when() {
        writeln!(out, "  camera     knocked {when}")?;
    }
    if let Some(InMap { map, found_after_s, found_after_m, recognised, .. }) = &run.in_map {
        match found_after_s.zip(*found_after_m) {
            Some((seconds, metres)) => writeln!(
                out,
                "  map        {map}: recognised by {recognised} landmarks after {metres:.1} m, {seconds:.1} s"
            )?,
            None => writeln!(out, "  map        {map}: the place in it was not found")?,
        }
    }
    if let Some(errors) = &run.errors {
        let absolute = &errors.absolute;
        let (end, percent) = (absolute.end_position, absolute.end_position_percent);
        let turn = absolute.end_heading.to_degrees();
        let poses = run.trajectory.len();
        let last = errors.last_time - run.trajectory.first().map_or(0.0, |stamped| stamped.time);
        if errors.poses < poses {
            writeln!(
                out,
                "  compared   {} of {poses} poses, the last one {last:.1} s after the start",
                errors.poses
            )?;
        }
        // The truth may be silent at the end.
        let label = if run.trajectory.last().is_some_and(|end| end.time > errors.last_time) {
            "last error"
        } else {
            "end error"
        };
        writeln!(out, "  {label:<10} {end:.3} m ({percent:.2} % of the path), {turn:.2}°")?;
        if let Some(nees) = &errors.nees {
            let (mean, inside) = (nees.mean_per_dof, 100.0 * nees.inside_3_sigma);
            writeln!(out, "  NEES/3     {mean:.2} (1 is right), {inside:.1} % of the poses inside 3σ")?;
        }
    }
    if let Some(map) = run.map_errors.as_ref().filter(|map| map.matched == 0) {
        writeln!(out, "  map error  none: 0 of {} landmarks could be compared", map.truth)?;
    } else if let Some(map) = &run.map_errors {
        let [raw, aligned] = [map.position.rms, map.aligned_position.rms];
        let (matched, truth) = (map.matched, map.truth);
        writeln!(out, "  map error  {raw:.3} m rms, {aligned:.3} m aligned, {matched} of {truth} landmarks")?;
    }
    writeln!(out, "  report     {}", folder.join("report.html").display())
}
