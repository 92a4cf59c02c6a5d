//! What `slam` and `slam-log` give: the same files, and the same lines.
use crate::{
    Error, Result,
    evaluation::Truth,
    files::{self, Outputs},
    report::{self, Observation, Run},
};
use monorange_core::geometry::Pose;
use std::path::Path;

/// True poses further apart than this are not interpolated between, s.
pub(super) const MAX_TRUTH_GAP: f64 = 1.0;

/// The world of the truth, seen from the map: the first true pose is the map's origin.
pub(super) fn map_from_world(truth: &Truth<'_>, start: f64) -> Result<Pose<f64>> {
    truth.at(start).map(|pose| pose.inverse()).ok_or_else(|| {
        Error::new(format!("has no pose at the start, {start} s"))
            .help("give the truth on the same clock, from the start on")
    })
}

/// Writes trajectory, map, observations and reports.
pub(super) fn write(outputs: &mut Outputs, run: &Run) -> Result<()> {
    outputs.write("trajectory.tum", |out| files::write_tum(out, &run.trajectory))?;
    outputs.write("trajectory.csv", |out| files::write_trajectory(out, &run.trajectory))?;
    outputs.write("map.csv", |out| files::write_map(out, &run.map))?;
    outputs.write("map.ply", |out| files::write_ply(out, &run.map))?;
    outputs.write("observations.csv", |out| {
        writeln!(out, "t,frame,u,v,range,bearing,landmark,decision,nis")?;
        let cell = |value: Option<f32>| value.map_or(String::new(), |value| value.to_string());
        run.observations.iter().try_for_each(|seen| {
            let Observation { time, frame, pixel, range, bearing, landmark, decision, nis } = seen;
            let landmark = landmark.map_or(String::new(), |id| id.to_string());
            let [u, v] = [0, 1].map(|axis| cell(pixel.map(|pixel| pixel[axis])));
            let [range, bearing, nis] = [*range, *bearing, *nis].map(cell);
            writeln!(out, "{time},{frame},{u},{v},{range},{bearing},{landmark},{decision},{nis}")
        })
    })?;
    let json = serde_json::to_string_pretty(&run.summary()).map_err(Error::new)?;
    outputs.write("report.json", |out| writeln!(out, "{json}"))?;
    outputs.write("report.html", |out| out.write_all(report::page(run).as_bytes()))
}

/// Prints the summary, for a person or as JSON.
pub(super) fn print(run: &Run, folder: &Path, as_json: bool) -> Result<()> {
    let json = serde_json::to_string_pretty(&run.summary()).map_err(Error::new)?;
    files::to_file_or_stdout(None, |out| {
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
