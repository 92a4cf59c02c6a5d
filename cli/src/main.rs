//! The `monorange` command.
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = monorange::commands::Cli::of_arguments();
    monorange::interrupt::watch();
    let done = monorange::commands::run(arguments);
    monorange::warnings::say();
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
