//! The commands, one module each: its arguments, and `run`.
pub mod calibrate;
pub mod calibrate_mount;
pub mod evaluate;
pub mod feed;
pub mod keypoints;
pub mod landmarks;
pub mod matching;
mod progress;
pub mod range;
pub mod reproduce;
mod results;
mod rig_file;
pub mod scan;
pub mod settings;
pub mod simulate;
pub mod slam;
pub mod slam_log;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use monorange_formats::Result;

/// One calibrated camera on a robot as a range finder, and its pictures as a map.
///
/// Lengths are metres, angles radians (x forward, y left, bearing positive to the left), pixel (0, 0) is the
/// centre of the top-left one. Exit status: 0 done, 1 failed (one message says why), 2 wrong command line.
#[derive(Debug, Parser)]
#[command(name = "monorange", version, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

impl Cli {
    /// The command line, in which a value may begin with a minus: it is a number to be judged, not an unknown flag.
    pub fn of_arguments() -> Self {
        let command = Self::command().mut_subcommands(|command| {
            command.mut_args(|arg| {
                let takes_a_value = arg.get_action().takes_values() && !arg.is_positional();
                arg.allow_negative_numbers(takes_a_value)
            })
        });
        Self::from_arg_matches(&command.get_matches()).unwrap_or_else(|error| error.exit())
    }
}

#[derive(Debug, Subcommand)]
enum Command {
    Range(range::Arguments),
    Landmarks(landmarks::Arguments),
    Keypoints(keypoints::Arguments),
    Match(matching::Arguments),
    Scan(scan::Arguments),
    Slam(slam::Arguments),
    SlamLog(slam_log::Arguments),
    Simulate(simulate::Arguments),
    Evaluate(evaluate::Arguments),
    Calibrate(calibrate::Arguments),
    CalibrateMount(calibrate_mount::Arguments),
    Reproduce(reproduce::Arguments),
    Feed(feed::Arguments),
    Settings(settings::Arguments),
}

/// Runs the command that the arguments name.
///
/// # Errors
/// Whatever stops it, in words for a person.
pub fn run(cli: Cli) -> Result<()> {
    match cli.command {
        Command::Range(arguments) => range::run(&arguments),
        Command::Landmarks(arguments) => landmarks::run(&arguments),
        Command::Keypoints(arguments) => keypoints::run(&arguments),
        Command::Match(arguments) => matching::run(&arguments),
        Command::Scan(arguments) => scan::run(&arguments),
        Command::Slam(arguments) => slam::run(&arguments),
        Command::SlamLog(arguments) => slam_log::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Evaluate(arguments) => evaluate::run(&arguments),
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::CalibrateMount(arguments) => calibrate_mount::run(&arguments),
        Command::Reproduce(arguments) => reproduce::run(&arguments),
        Command::Feed(arguments) => feed::run(&arguments),
        Command::Settings(arguments) => settings::run(&arguments),
    }
}
