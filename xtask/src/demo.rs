//! `cargo xtask demo`: the main job on a simulated corridor.
use crate::shell;
use anyhow::Result;

/// What the demo simulates.
#[derive(clap::Args)]
pub(crate) struct Options {
    /// Pictures to simulate
    #[arg(long, default_value_t = 560)]
    frames: u32,
}

pub(crate) fn run(options: &Options) -> Result<()> {
    let out = shell::root().join("out/demo");
    let (sequence, result) = (out.join("corridor"), out.join("slam"));
    let monorange = |arguments: &[String]| {
        let mut command = shell::cargo("run --quiet --release -p monorange --");
        shell::run(command.args(arguments))
    };
    let path = |path: &std::path::Path| path.display().to_string();
    monorange(&[
        "simulate".into(),
        "--scene=corridor".into(),
        format!("--frames={}", options.frames),
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
