//! `cargo xtask test`: what CI runs.
use crate::{c, firmware, house, npm, python, setup, shell, web};
use anyhow::{Context, Result, ensure};
use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

/// Pictures that the emulated co-processors get: each takes a second on its way through the line.
const FRAMES: usize = 40;

pub(crate) fn run() -> Result<()> {
    let start = Instant::now();
    let _ = fs::remove_file(skipped_list());
    stage("the house in order", house::check)?;
    stage("format and lints", lints)?;
    stage("tests of every day", tests)?;
    stage("golden runs", golden_runs)?;
    stage("documentation", documentation)?;
    stage("packages", packages)?;
    stage("core on bare targets", bare_targets)?;
    stage("the page", web::test)?;
    stage("the npm package", npm::test)?;
    stage("the Python package", python::test)?;
    stage("the C API", c::test)?;
    stage("co-processor in QEMU", || firmware::test(FRAMES))?;
    let skipped = fs::read_to_string(skipped_list()).unwrap_or_default();
    eprint!("{skipped}");
    let (seconds, skipped) = (start.elapsed().as_secs_f64(), skipped.lines().count());
    eprintln!("✓ all stages in {seconds:.0} s; {skipped} checks SKIPPED for want of what they need");
    Ok(())
}

/// Where checks that were skipped leave a line each.
pub(crate) fn skipped_list() -> PathBuf {
    shell::target().join("skipped-checks.txt")
}

/// Notes that a check is left out for want of something, which CI must have.
pub(crate) fn skipped(check: &str, needs: &str) -> Result<()> {
    ensure!(!shell::is_ci(), "{check} cannot be tested under CI: it {needs}");
    let line = format!("{check}: SKIPPED, {needs}");
    eprintln!("{line}");
    writeln!(fs::OpenOptions::new().create(true).append(true).open(skipped_list())?, "{line}")?;
    Ok(())
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
    // The core's tests compare what these print. Examples that only measure are left to the lints: each would be compiled with the
    // whole system in it. All in one command, which leaves no core idle in between.
    let examples = "--example range --example homography --example slam --example own_sensor";
    shell::run(&mut shell::cargo(&format!("build --tests {examples}")))?;
    // What needs emulated boards has its own stage.
    shell::run(shell::cargo("test --tests").env("MONORANGE_QEMU", "later"))?;
    shell::run(&mut shell::cargo("test --doc"))
}

/// Tables of long runs, which `cargo test` leaves out. Of the same packages, so that nothing is compiled with other features.
fn golden_runs() -> Result<()> {
    shell::run(shell::cargo("test --tests -- --ignored").env("MONORANGE_QEMU", "later"))
}

/// The pages that docs.rs would show: every feature, no warning.
fn documentation() -> Result<()> {
    let packages = PACKAGES.map(|name| format!("-p {name}")).join(" ");
    let doc = format!("doc --no-deps --all-features --quiet {packages}");
    shell::run(shell::cargo(&doc).env("RUSTDOCFLAGS", "-D warnings"))
}

/// Everything that is published, in the order of dependence.
const PACKAGES: [&str; 6] = [
    "monorange-core",
    "monorange-protocol",
    "monorange-sim",
    "monorange-mcu",
    "monorange-formats",
    "monorange",
];

/// What would be uploaded to crates.io holds all that it needs: the archives are unpacked and checked, each against the others. Not by
/// `cargo package` itself, which compiles every dependency anew, and takes five minutes for it.
fn packages() -> Result<()> {
    let names = PACKAGES.map(|name| format!("-p {name}")).join(" ");
    // The first as it would be done, short of the upload; the second keeps the archives.
    for command in ["publish --dry-run", "package"] {
        shell::run(&mut shell::cargo(&format!("{command} --no-verify --allow-dirty --quiet {names}")))?;
    }
    let folder = shell::target().join("packages");
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;
    // With the same profile, dependencies need not be looked at again.
    let root = fs::read_to_string(shell::root().join("Cargo.toml"))?;
    let profile =
        root.find("[profile.").and_then(|start| root.get(start..)).context("Cargo.toml has no profile")?;
    let mut workspace = "[workspace]\nresolver = \"3\"\nmembers = [\"*\"]\n\n[patch.crates-io]\n".to_owned();
    for name in PACKAGES {
        let package = format!("{name}-{}", env!("CARGO_PKG_VERSION"));
        let archive = shell::target().join("package").join(format!("{package}.crate"));
        shell::run(shell::command("tar", ["-xzf"]).arg(archive).arg("-C").arg(&folder))?;
        workspace += &format!("{name} = {{ path = \"{package}\" }}\n");
    }
    fs::write(folder.join("Cargo.toml"), format!("{workspace}\n{profile}"))?;
    fs::copy(shell::root().join("Cargo.lock"), folder.join("Cargo.lock"))?;
    shell::run(
        shell::cargo("check --workspace --quiet")
            .current_dir(&folder)
            .env("CARGO_TARGET_DIR", shell::target()),
    )
}

/// The core without a standard library, as a microcontroller and a browser build it.
fn bare_targets() -> Result<()> {
    const CORE: &str = "--quiet -p monorange-core --no-default-features";
    let [board, browser] = ["thumbv7em-none-eabihf", "wasm32-unknown-unknown"];
    setup::rust_target(board)?;
    setup::rust_target(browser)?;
    // The C library for a board is made with it.
    shell::run(&mut shell::cargo(&format!("build {CORE} --target {board}")))?;
    shell::run(&mut shell::cargo(&format!("check {CORE} --target {browser}")))?;
    shell::run(&mut shell::cargo(&format!(
        "check {CORE} --features sift --target {board} --target {browser}"
    )))
}
