//! `cargo xtask test`: what CI runs.
use crate::{firmware, house, setup, shell, web};
use anyhow::Result;
use std::time::Instant;

/// Pictures that the emulated co-processors get: each takes a second on its way through the line.
const FRAMES: usize = 40;

pub(crate) fn run() -> Result<()> {
    stage("the house in order", house::check)?;
    stage("format and lints", lints)?;
    stage("tests", tests)?;
    stage("core on bare targets", bare_targets)?;
    stage("the page", web::test)?;
    stage("co-processor in QEMU", || firmware::test(FRAMES))
}

fn stage(name: &str, checks: fn() -> Result<()>) -> Result<()> {
    let start = Instant::now();
    checks()?;
    eprintln!("✓ {name} ({:.0} s)", start.elapsed().as_secs_f64());
    Ok(())
}

fn lints() -> Result<()> {
    shell::run(&mut shell::cargo("fmt --all --check"))?;
    shell::run(&mut shell::cargo("clippy --all-targets --quiet -- -D warnings"))?;
    firmware::lint()
}

fn tests() -> Result<()> {
    // What needs emulated boards has its own stage.
    shell::run(shell::cargo("test").env("MONORANGE_QEMU", "later"))
}

/// The core without a standard library, as a microcontroller and a browser build it.
fn bare_targets() -> Result<()> {
    let mut targets = String::new();
    for triple in ["thumbv7em-none-eabihf", "wasm32-unknown-unknown"] {
        setup::rust_target(triple)?;
        targets += &format!(" --target {triple}");
    }
    let core = "--quiet -p monorange-core --no-default-features";
    shell::run(&mut shell::cargo(&format!("build {core} {targets}")))?;
    shell::run(&mut shell::cargo(&format!("check {core} --features sift {targets}")))
}
