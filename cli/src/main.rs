//! The `monorange` command.
use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    match monorange::commands::run(monorange::commands::Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
