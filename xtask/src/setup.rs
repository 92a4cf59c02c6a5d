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
