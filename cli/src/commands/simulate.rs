//! `simulate`: a drive through a made-up place, with the truth about it.
use crate::{
    commands::progress,
    outputs::{NewFolder, to_file_or_stdout},
};
use clap::{Args, ValueEnum};
use image::{ExtendedColorType, ImageEncoder, codecs::png};
use monorange_core::geometry::Pose;
use monorange_formats::{
    Error, Result,
    files::{Rig, Stamped, write_tum},
};
use monorange_sim::{MOUNT_STD, PIXEL_STD, Scene, SceneConfig, SimConfig, Simulation, default_rig};
use nalgebra::Vector2;
use std::path::PathBuf;

/// Pictures, odometry and a laser of a drive through a made-up place, with the truth about all of it.
///
/// Writes a new folder: `frames/000000.png …`, `rig.toml`, `times.txt`, `odometry.csv` (`t,v,omega`), `truth.tum`,
/// `landmarks.csv` (`id,x,y`, every true floor corner) and `laser.csv` (`t,bearing,range,x,y`); of a robot that pitches
/// `attitude.csv` as well (`t,pitch,roll`, exact). The world is the
/// robot's first pose: x ahead, y to the left.
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  monorange simulate --scene corridor --frames 50 --out corridor-50")]
pub struct Arguments {
    /// Where to drive.
    #[arg(long, value_enum)]
    scene: Place,
    /// Pictures; the robot goes round again when the way is shorter. 600 unless given, 5 for `table2`.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: Option<u32>,
    /// People who cross and stop.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u16).range(0..=100))]
    walkers: u16,
    /// Degrees by which the robot pitches to either side, once a second; `--attitude`, or `sway` in the rig's `[filter]`, tells `slam` so.
    #[arg(long, default_value_t = 0.0, value_name = "DEG")]
    pitch: f64,
    /// Seconds from the first row's exposure to the last one's, of a rolling shutter; `readout` in the rig's `[shutter]` tells `slam` so.
    #[arg(long, default_value_t = 0.0, value_name = "SECONDS")]
    readout: f64,
    /// Chooses the place's looks, the walkers' ways and every noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The folder to make.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print what was made as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Place {
    /// A closed loop, 66 m round, with doors, niches, pillars and posters.
    Corridor,
    /// Two rooms with desks, cupboards and crates, 27 m round.
    Office,
    /// The five points of the paper's Table 2, one a frame; the robot does not drive.
    Table2,
}

impl Place {
    fn frames(self) -> u32 {
        match self {
            Self::Corridor | Self::Office => 600,
            Self::Table2 => 5,
        }
    }

    fn scene(self, config: &SceneConfig) -> Scene {
        match self {
            Self::Corridor => Scene::corridor(config),
            Self::Office => Scene::office(config),
            Self::Table2 => Scene::table2(config),
        }
    }
}

/// Runs the command.
///
/// # Errors
/// When the folder is there already, or cannot be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let folder = NewFolder::new(&arguments.out)?;
    let scene = arguments.scene.scene(&SceneConfig { seed: arguments.seed, ..SceneConfig::default() });
    let config = SimConfig {
        seed: arguments.seed,
        frames: arguments.frames.unwrap_or(arguments.scene.frames()) as usize,
        walkers: usize::from(arguments.walkers),
        pitch: arguments.pitch.to_radians(),
        readout: arguments.readout,
        ..SimConfig::default()
    };
    let finder = default_rig().map_err(Error::new)?;
    let simulation = Simulation::new(scene, finder, config).map_err(Error::new)?;
    let rig = Rig::new(finder, PIXEL_STD, MOUNT_STD)?;
    folder.write("rig.toml", |out| rig.write(out))?;
    write_frames(&simulation, &folder)?;
    write_tables(&simulation, &folder)?;
    folder.commit()?;
    report(&simulation, arguments)
}

fn write_frames(simulation: &Simulation, folder: &NewFolder) -> Result<()> {
    let camera = simulation.rig().camera();
    let (width, height) = (camera.width(), camera.height());
    let mut pixels = vec![0; width * height];
    let bar = progress::bar(simulation.len(), "frames");
    for frame in 0..simulation.len() {
        simulation.render(frame, &mut pixels).map_err(Error::new)?;
        folder.write(&format!("frames/{frame:06}.png"), |out| {
            let encoder =
                png::PngEncoder::new_with_quality(out, png::CompressionType::Fast, png::FilterType::Up);
            let written = encoder.write_image(&pixels, width as u32, height as u32, ExtendedColorType::L8);
            written.map_err(std::io::Error::other)
        })?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(())
}

fn write_tables(simulation: &Simulation, folder: &NewFolder) -> Result<()> {
    let frames = || 0..simulation.len();
    // The world of the files is the robot's first pose, where a filter begins too.
    let world_from_scene = simulation.true_pose(0).inverse();
    let pose = |frame: usize| world_from_scene.compose(&simulation.true_pose(frame));
    folder.write("times.txt", |out| {
        frames().try_for_each(|frame| writeln!(out, "{}", time(simulation, frame)))
    })?;
    folder.write("odometry.csv", |out| {
        writeln!(out, "t,v,omega")?;
        frames().try_for_each(|frame| {
            let twist = simulation.odometry(frame);
            writeln!(out, "{},{},{}", time(simulation, frame), twist.speed, twist.turn)
        })
    })?;
    if simulation.config().pitch > 0.0 {
        let level = simulation.rig().mount().parameters()[1];
        folder.write("attitude.csv", |out| {
            writeln!(out, "t,pitch,roll")?;
            frames().try_for_each(|frame| {
                let tilt = simulation.true_rig(frame).mount().parameters()[1];
                writeln!(out, "{},{},0", time(simulation, frame), tilt - level)
            })
        })?;
    }
    folder.write("truth.tum", |out| {
        let stamped = |frame| Stamped { time: time(simulation, frame), pose: pose(frame), covariance: None };
        write_tum(out, &frames().map(stamped).collect::<Vec<_>>())
    })?;
    folder.write("landmarks.csv", |out| {
        writeln!(out, "id,x,y")?;
        simulation.landmarks().iter().try_for_each(|landmark| {
            let position = world_from_scene.transform(landmark.position);
            writeln!(out, "{},{},{}", landmark.id, position.x, position.y)
        })
    })?;
    folder.write("laser.csv", |out| {
        writeln!(out, "t,bearing,range,x,y")?;
        for frame in frames() {
            for beam in simulation.laser(frame) {
                let Some(range) = beam.range else { continue };
                let echo = Pose::transform(
                    &pose(frame),
                    Vector2::new(beam.bearing.cos(), beam.bearing.sin()) * range,
                );
                let (time, bearing) = (time(simulation, frame), beam.bearing);
                writeln!(out, "{time},{bearing:.5},{range:.4},{:.4},{:.4}", echo.x, echo.y)?;
            }
        }
        Ok(())
    })
}

/// The frame's time without the dust of its multiplication, s.
fn time(simulation: &Simulation, frame: usize) -> f64 {
    (simulation.time(frame) * 1e6).round() / 1e6
}

fn report(simulation: &Simulation, arguments: &Arguments) -> Result<()> {
    let frames = simulation.len();
    let step = |frame: usize| {
        (simulation.true_pose(frame).position() - simulation.true_pose(frame - 1).position()).norm()
    };
    let path: f64 = (1..frames).map(step).sum();
    let (scene, landmarks, out) = (simulation.scene().name(), simulation.landmarks().len(), &arguments.out);
    let seconds = time(simulation, frames.saturating_sub(1));
    to_file_or_stdout(None, |to| match arguments.json {
        true => {
            let summary = serde_json::json!({
                "scene": scene, "frames": frames, "path": path, "seconds": seconds,
                "landmarks": landmarks, "walkers": arguments.walkers, "seed": arguments.seed, "out": out,
            });
            writeln!(to, "{summary:#}")
        }
        false => {
            writeln!(
                to,
                "{}: {frames} frames of a {scene}, {path:.1} m in {seconds:.0} s, {landmarks} floor corners",
                out.display()
            )
        }
    })
}
