//! `settings`: every setting of a rig file, with its default and where that comes from.
use clap::Args;
use monorange_core::geometry::{Camera, Mount, RangeFinder};
use monorange_core::pipeline::{self, Config};
use monorange_core::setting::Value;
use monorange_formats::{
    Error, Result,
    files::{Rig, in_toml, settings_page},
};
use std::{io::Write, path::PathBuf};

/// Every setting of a rig file: section, key, unit, range, default, what it is, and where its default comes from.
///
/// With --rig the values are those of that rig file.
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  monorange settings > settings.md
  monorange settings --json")]
pub struct Arguments {
    /// The rig file (TOML) whose values are shown instead of the defaults.
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// Print a JSON list instead of a page.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// When the rig file cannot be used, or nothing can be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let config = match &arguments.rig {
        Some(path) => Rig::read(path)?.settings,
        None => Config::new(any_finder().map_err(Error::new)?),
    };
    let text = if arguments.json { json(&config) } else { settings_page(&config) };
    std::io::stdout().write_all(text.as_bytes()).map_err(|error| monorange_formats::files::io_error(&error))
}

/// No default depends on the camera.
fn any_finder() -> monorange_core::Result<RangeFinder<f32>> {
    let camera = Camera::new(320, 240, [365.0; 2], [160.0, 120.0], 0.0, Default::default())?;
    Ok(RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0])?))
}

fn json(config: &Config) -> String {
    let line =
        |(setting, reference): (&monorange_core::setting::Setting, &monorange_core::setting::Reference)| {
            let value = config.get(setting);
            let mut line = serde_json::json!({
                "name": setting.name,
                "number": setting.number,
                "unit": setting.unit,
                "value": in_toml(value).trim_matches('"'),
                "help": reference.help,
                "origin": reference.origin,
            });
            match value {
                Value::Choice(_, words) => line["words"] = words.into(),
                Value::Switch(_) => {}
                _ => line["range"] = [setting.least, setting.most].as_slice().into(),
            }
            line
        };
    let lines: Vec<_> = pipeline::settings().map(line).collect();
    serde_json::Value::from(lines).to_string() + "\n"
}
