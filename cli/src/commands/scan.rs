//! `scan`: a sequence of pictures → how far the floor is free, in every direction.
use super::rig_file::RigFile;
use crate::{
    commands::progress,
    outputs::to_file_or_stdout,
    overlays::Overlays,
    sequence::{Sequence, SequenceFiles},
};
use clap::Args;
use monorange_core::scan::{BEAMS, Kind, Reading, ScanConfig};
use monorange_formats::{Error, Result, draw::Overlay, extraction::scanner};
use std::{fmt::Write as _, path::PathBuf};

/// How far the floor is free, in every direction, from one camera's pictures: a laser scan without a laser.
///
/// Writes `t,bearing,free,range,var_range,kind`, one row a bearing of each picture: the floor is seen clear up to `free`;
/// `range` is what bounds it, with its variance (the mount's uncertainty is in it). `kind` is `boundary` (its neighbours go
/// on beside it), `obstacle` (it stands by itself), `unknown` (nothing is certain beyond `free`) or `beyond` (free as
/// far as is looked at, 20 heights of the camera); the last two have no range. Unknown is never free. With odometry
/// what pictures say about the same place of the floor is put together; without it each picture stands for itself.
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  monorange simulate --scene corridor --frames 10 --out corridor-10
  monorange scan --rig corridor-10/rig.toml --frames corridor-10/frames \\
    --odometry corridor-10/odometry.csv --overlay corridor-10/scans")]
pub struct Arguments {
    #[command(flatten)]
    rig: RigFile,
    /// The folder of pictures, or a folder of EuRoC, KITTI or TUM RGB-D.
    #[arg(long, value_name = "DIR")]
    frames: PathBuf,
    /// Times of the frames, one a line, s.
    #[arg(long, value_name = "FILE")]
    times: Option<PathBuf>,
    /// Odometry (CSV `t,v,omega` or `t,dx,dy,dtheta`, or poses as TUM or `t,x,y,heading`).
    #[arg(long, value_name = "FILE")]
    odometry: Option<PathBuf>,
    /// Beams of a scan, evenly over the field; one a degree without it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(2..=BEAMS as i64))]
    beams: Option<u16>,
    /// Angle from the first beam to the last, centred ahead, degrees; what the picture shows without it.
    #[arg(long, value_name = "DEG", value_parser = field)]
    field: Option<f32>,
    /// Draw the free floor and what bounds it over every picture, into this folder.
    #[arg(long, value_name = "DIR")]
    overlay: Option<PathBuf>,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// When a file is missing, malformed or does not fit the others, or nothing can be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let rig = arguments.rig.read()?;
    let files = SequenceFiles {
        frames: &arguments.frames,
        times: arguments.times.as_deref(),
        odometry: arguments.odometry.as_deref(),
        attitude: None,
        truth: None,
    };
    let sequence = Sequence::read(files, &rig)?;
    let config = ScanConfig {
        beams: arguments.beams.map_or(0, usize::from),
        field: arguments.field.map(|field| {
            let half = field.to_radians() * 0.5;
            [-half, half]
        }),
        ..ScanConfig::default()
    };
    let mut scanner = scanner(&rig, config)?;
    let mut outputs = arguments.overlay.as_deref().map(Overlays::into_folder).transpose()?;
    let mut table = HEADER.to_owned();
    let bar = progress::bar(sequence.images.len(), "pictures");
    let (mut before, mut read): (Option<f64>, usize) = (None, 0);
    for (image, time) in sequence.images.iter().zip(&sequence.times) {
        bar.inc(1);
        if let Some(before) = before {
            scanner.follow(
                sequence.odometry.as_ref().and_then(|odometry| odometry.motion(before, *time)).as_ref(),
            );
        }
        before = Some(*time);
        let picture = match image.read() {
            Ok(picture) => picture,
            Err(error) => {
                bar.suspend(|| crate::warnings::left_out(&error));
                continue;
            }
        };
        read += 1;
        let readings = scanner.scan(picture.grey()?).map_err(|error| Error::new(error).at(image.name()))?;
        readings.iter().for_each(|reading| row(&mut table, *time, reading));
        if let Some(outputs) = &mut outputs {
            let name = image.name().file_stem().unwrap_or_default().to_string_lossy();
            let mut overlay = Overlay::new(&rig, &picture.pixels, 960)?;
            overlay.scan(readings);
            overlay.floor();
            let free = readings.iter().filter(|reading| reading.kind != Kind::Unknown).count();
            let title = format!("{name}   {free} of {} beams end somewhere", readings.len());
            let png = overlay.finish(&title).png()?;
            outputs.write(image.name(), &png)?;
        }
    }
    bar.finish_and_clear();
    if read == 0 {
        return Err(Error::new("none of the pictures could be read").help("give PNG, JPEG or PNM pictures"));
    }
    if let Some(outputs) = outputs {
        outputs.commit()?;
    }
    to_file_or_stdout(arguments.out.as_deref(), |out| out.write_all(table.as_bytes()))
}

/// What the columns are.
pub(super) const HEADER: &str = "t,bearing,free,range,var_range,kind\n";

/// One beam as a line of the table.
pub(super) fn row(table: &mut String, time: f64, reading: &Reading) {
    let Reading { bearing, free, range, var_range, kind } = reading;
    let _ = match range {
        Some(range) => writeln!(table, "{time},{bearing},{free},{range},{var_range},{}", kind.name()),
        None => writeln!(table, "{time},{bearing},{free},,,{}", kind.name()),
    };
}

/// An angle above 0° and below 180°.
fn field(text: &str) -> std::result::Result<f32, String> {
    let degrees: f32 = text.parse().map_err(|_| "not a number".to_owned())?;
    if degrees > 0.0 && degrees < 180.0 { Ok(degrees) } else { Err("not above 0 and below 180".to_owned()) }
}
