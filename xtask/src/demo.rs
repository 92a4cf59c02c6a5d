//! `cargo xtask demo`: the main job, to look at.
use crate::{setup, shell, web};
use anyhow::Result;
use std::path::Path;

/// What the demo shows.
#[derive(clap::Args)]
pub(crate) struct Options {
    /// Without the page: simulate a corridor, map it from its pictures, name the report
    #[arg(long)]
    cli: bool,
    /// Pictures to simulate for the command line
    #[arg(long, default_value_t = 560)]
    frames: u32,
    /// Port to serve the page on
    #[arg(long, default_value_t = 4173)]
    port: u16,
}

pub(crate) fn run(options: &Options) -> Result<()> {
    if options.cli {
        return command_line(options.frames);
    }
    if let Err(error) = setup::node() {
        eprintln!("{error:#}.\nUntil then, the same on the command line (`cargo xtask demo --cli`):");
        return command_line(options.frames);
    }
    web::build()?;
    web::serve(options.port)
}

fn command_line(frames: u32) -> Result<()> {
    let out = shell::root().join("out/demo");
    let (sequence, result) = (out.join("corridor"), out.join("slam"));
    // The demo may be run again.
    for folder in [&sequence, &result] {
        if folder.exists() {
            std::fs::remove_dir_all(folder)?;
        }
    }
    let monorange = |arguments: &[String]| {
        let mut command = shell::cargo("run --quiet --release -p monorange --");
        shell::run(command.args(arguments))
    };
    let path = |path: &Path| path.display().to_string();
    monorange(&[
        "simulate".into(),
        "--scene=corridor".into(),
        format!("--frames={frames}"),
        "--walkers=3".into(),
        format!("--out={}", path(&sequence)),
    ])?;
    monorange(&[
        "slam".into(),
        format!("--rig={}", path(&sequence.join("rig.toml"))),
        format!("--frames={}", path(&sequence.join("frames"))),
        format!("--times={}", path(&sequence.join("times.txt"))),
        format!("--odometry={}", path(&sequence.join("odometry.csv"))),
        format!("--truth={}", path(&sequence.join("truth.tum"))),
        format!("--out={}", path(&result)),
    ])?;
    println!("The report: {}", path(&result.join("report.html")));
    Ok(())
}
