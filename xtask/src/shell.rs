//! Running other programs, aloud.
use anyhow::{Context, Result, ensure};
use std::ffi::OsStr;
use std::path::PathBuf;
use std::process::Command;

/// The workspace's root folder.
pub(crate) fn root() -> PathBuf {
    let xtask = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    xtask.parent().map(PathBuf::from).unwrap_or(xtask)
}

/// The folder of what cargo builds.
pub(crate) fn target() -> PathBuf {
    root().join(std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into()))
}

/// The command `program arguments…`, to be run in the workspace's root.
pub(crate) fn command<A: AsRef<OsStr>>(
    program: impl AsRef<OsStr>,
    arguments: impl IntoIterator<Item = A>,
) -> Command {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(root());
    if is_ci() {
        // Nothing is compiled a second time there, nor looked at in a debugger; what this leaves out is a quarter of the compiler's work.
        command.env("CARGO_INCREMENTAL", "0");
        command.env("CARGO_PROFILE_DEV_DEBUG", "false").env("CARGO_PROFILE_DEV_CODEGEN_UNITS", "4");
    }
    command
}

/// The command `cargo words…`, the words separated by spaces.
pub(crate) fn cargo(words: &str) -> Command {
    command(std::env::var("CARGO").unwrap_or_else(|_| "cargo".into()), words.split_whitespace())
}

/// Whether this is continuous integration, where nothing may be skipped.
pub(crate) fn is_ci() -> bool {
    std::env::var("CI").is_ok_and(|ci| ci == "true")
}

/// Runs a command after printing it; its output goes where ours goes.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    run_together([command])
}

/// Runs commands side by side, as [`run`] does one.
pub(crate) fn run_together<'a>(commands: impl IntoIterator<Item = &'a mut Command>) -> Result<()> {
    let mut running = Vec::new();
    for command in commands {
        let words: Vec<_> = [command.get_program()].into_iter().chain(command.get_args()).collect();
        let line = words.iter().map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ");
        eprintln!("\n▸ {line}");
        let child = command.spawn().with_context(|| format!("cannot start `{line}`"))?;
        running.push((line, child));
    }
    // All of them are waited for before the first failure is told.
    let ended = running.into_iter().map(|(line, mut child)| (child.wait(), line)).collect::<Vec<_>>();
    for (status, line) in ended {
        let status = status?;
        ensure!(status.success(), "`{line}` failed ({status})");
    }
    Ok(())
}

/// Runs a command in the place of this one, which ends with it: what stops one stops both.
pub(crate) fn become_program(command: &mut Command) -> Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::process::CommandExt;
        Err(command.exec()).with_context(|| format!("cannot start {}", command.get_program().display()))
    }
    #[cfg(not(unix))]
    run(command)
}
