//! `cargo xtask`: everything that is more than one cargo command. Each task does its own set-up.
mod c;
mod demo;
mod firmware;
mod house;
mod npm;
mod python;
mod setup;
mod shell;
mod test;
mod web;

use clap::{Parser, Subcommand};

/// Set-up, demo and tests of monorange; each command installs what it needs or says exactly what to install.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// The main job, to look at: the page, served to this machine alone (or, with --cli, a report)
    Demo(demo::Options),
    /// Every check: formatting, lints, tests, and the core built for microcontroller and browser
    Test,
    /// The page: build it into web/dist, test it, or serve it to this machine
    Web(web::Options),
    /// The npm package: packed, and tried in projects of Node.js and of three Vites
    Npm,
    /// The C API: its example on this computer and on an emulated board, bit by bit
    C,
    /// The Python package: as a wheel in a clean environment, and its tests in another one
    Python,
    /// The co-processor: start it in QEMU, test both boards against the host, or show its size
    Firmware(firmware::Options),
}

fn main() -> anyhow::Result<()> {
    match Arguments::parse().task {
        Task::Demo(options) => demo::run(&options),
        Task::Test => test::run(),
        Task::Web(options) => web::run(&options),
        Task::Npm => npm::run(),
        Task::C => c::test(),
        Task::Python => {
            // With the features of the whole workspace, as the workspace's tests build it.
            shell::run(&mut shell::cargo("build --quiet --bin monorange"))?;
            python::test()
        }
        Task::Firmware(options) => firmware::run(&options),
    }
}
