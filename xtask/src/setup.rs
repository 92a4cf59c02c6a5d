//! What a fresh machine lacks.
use crate::shell;
use anyhow::{Context, Result};

/// Makes sure that the pinned toolchain can build for `triple`.
pub(crate) fn rust_target(triple: &str) -> Result<()> {
    let installed = shell::command("rustup", ["target", "list", "--installed"]).output();
    let installed = installed
        .with_context(|| format!("rustup is needed to add the target {triple}: https://rustup.rs"))?;
    if String::from_utf8_lossy(&installed.stdout).lines().any(|line| line == triple) {
        return Ok(());
    }
    shell::run(&mut shell::command("rustup", ["target", "add", triple])).with_context(|| {
        format!("the target {triple} is missing and could not be added; run `rustup target add {triple}`")
    })
}

/// Makes sure that the page's npm packages are there, in the versions of the lock file.
pub(crate) fn node_modules() -> Result<()> {
    let web = shell::root().join("web");
    let (lock, installed) = (web.join("package-lock.json"), web.join("node_modules/.package-lock.json"));
    let modified = |path: &std::path::Path| path.metadata().and_then(|data| data.modified()).ok();
    if modified(&installed).is_some_and(|there| modified(&lock).is_none_or(|lock| lock <= there)) {
        return Ok(());
    }
    shell::run(shell::command("npm", ["ci", "--no-fund", "--no-audit"]).current_dir(web))
        .context("the page needs Node.js 20.19 or newer with npm: https://nodejs.org")
}
