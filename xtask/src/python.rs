//! The Python package: a wheel as pip makes it, in an environment with nothing else, and then in one with its tests.
use crate::{setup, shell, test};
use anyhow::{Context, Result};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the tests need beside the package: other readers and judges of the same things, and a cluster.
const NEEDED: [&str; 9] = [
    "pytest>=8",
    "numpy",
    "pillow",
    "mcap",
    "mcap-ros2-support",
    "rosbags",
    "opencv-python-headless",
    "evo",
    "ray",
];

/// Tests the package beside the command line that `cargo test` left, or says that there is no Python.
pub(crate) fn test() -> Result<()> {
    if !setup::python() {
        return test::skipped(
            "the Python package",
            "needs Python 3.9 or newer with its modules venv and pip",
        );
    }
    let folder = shell::target().join("python");
    let (clean, whole) = (folder.join("clean"), tests_environment()?);
    shell::run(shell::command("python3", ["-m", "venv", "--clear"]).arg(&clean))?;
    // The compiler and the registry are waited for at once. With the profile of everything else here little is compiled again.
    let wheels = folder.join("wheels");
    let _ = fs::remove_dir_all(&wheels);
    let mut wheel = pip(&clean, &["wheel", "--no-deps", "--wheel-dir"]);
    wheel.arg(&wheels).arg("./python").env("MATURIN_PEP517_ARGS", "--profile=dev");
    shell::run_together([&mut wheel, pip(&whole, &["install"]).args(NEEDED)])?;
    let wheel = fs::read_dir(&wheels)?.next().context("pip made no wheel")??.path();
    shell::run(pip(&clean, &["install"]).arg(&wheel))?;
    // What the package's README shows first.
    shell::run(&mut shell::command(python(&clean), ["python/tests/test_readme.py"]))?;
    shell::run(pip(&whole, &["install", "--force-reinstall", "--no-deps"]).arg(&wheel))?;
    let monorange = shell::target().join("debug/monorange").with_extension(std::env::consts::EXE_EXTENSION);
    let mut pytest = shell::command(python(&whole), ["-m", "pytest", "--quiet", "--durations=5", "python"]);
    shell::run(pytest.env("MONORANGE", monorange).env("MONORANGE_SKIPPED", test::skipped_list()))
}

/// The interpreter of the tests' environment with this module in it, where this machine has Python and pip gets the module.
pub(crate) fn with(module: &str) -> Result<Option<PathBuf>> {
    if !setup::python() {
        return Ok(None);
    }
    let whole = tests_environment()?;
    let installed = shell::run(pip(&whole, &["install"]).arg(module));
    Ok(installed.is_ok().then(|| python(&whole)))
}

/// What a check [`with`] a module needs.
pub(crate) const NEEDS_MODULE: &str =
    "needs Python 3.9 or newer with venv and pip, and a module that pip gets";

/// The environment that the tests run in, made when it is missing.
fn tests_environment() -> Result<PathBuf> {
    let whole = shell::target().join("python/tests");
    if !python(&whole).exists() {
        shell::run(shell::command("python3", ["-m", "venv"]).arg(&whole))?;
    }
    Ok(whole)
}

/// An environment's interpreter.
fn python(environment: &Path) -> PathBuf {
    let place = if cfg!(windows) { "Scripts/python" } else { "bin/python" };
    environment.join(place).with_extension(std::env::consts::EXE_EXTENSION)
}

/// `pip` of an environment.
fn pip(environment: &Path, words: &[&str]) -> Command {
    let mut pip =
        shell::command(python(environment), ["-m", "pip", "--quiet", "--disable-pip-version-check"]);
    pip.args(words);
    pip
}
