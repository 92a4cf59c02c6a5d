//! The plain files of a run, and the report's.
use super::{Observation, Run, page};
use crate::files::{write_map, write_ply, write_trajectory, write_tum};
use std::io::{self, Write};

/// What a run writes.
pub const OUTPUTS: [&str; 7] = [
    "trajectory.tum",
    "trajectory.csv",
    "map.csv",
    "map.ply",
    "observations.csv",
    "report.json",
    "report.html",
];

impl Run {
    /// Writes one of [`OUTPUTS`].
    ///
    /// # Errors
    /// When writing fails, or there is no output of this name.
    pub fn write(&self, name: &str, out: &mut dyn Write) -> io::Result<()> {
        match name {
            "trajectory.tum" => write_tum(out, &self.trajectory),
            "trajectory.csv" => write_trajectory(out, &self.trajectory),
            "map.csv" => write_map(out, &self.map),
            "map.ply" => write_ply(out, &self.map),
            "observations.csv" => write_observations(out, &self.observations),
            "report.json" => {
                serde_json::to_writer_pretty(&mut *out, &self.summary())?;
                writeln!(out)
            }
            "report.html" => out.write_all(page(self).as_bytes()),
            _ => Err(io::Error::new(io::ErrorKind::NotFound, format!("a run has no output {name}"))),
        }
    }
}

fn write_observations(out: &mut dyn Write, observations: &[Observation]) -> io::Result<()> {
    writeln!(out, "t,frame,u,v,range,bearing,landmark,decision,nis")?;
    let cell = |value: Option<f32>| value.map_or(String::new(), |value| value.to_string());
    observations.iter().try_for_each(|seen| {
        let Observation { time, frame, pixel, range, bearing, landmark, decision, nis, .. } = seen;
        let decision = decision.as_str();
        let landmark = landmark.map_or(String::new(), |id| id.to_string());
        let [u, v] = [0, 1].map(|axis| cell(pixel.map(|pixel| pixel[axis])));
        let [range, bearing, nis] = [*range, *bearing, *nis].map(cell);
        writeln!(out, "{time},{frame},{u},{v},{range},{bearing},{landmark},{decision},{nis}")
    })
}
