//! What a fresh machine lacks.
use crate::shell;
use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};

/// The oldest Node.js that the page's tools run on.
const NODE: [u32; 2] = [20, 19];
/// Where systems put a browser that the page's tests can drive.
const BROWSERS: [&str; 3] = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];

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

/// Makes sure that Node.js is there and new enough.
pub(crate) fn node() -> Result<()> {
    let [major, minor] = NODE;
    let help = format!("the page needs Node.js {major}.{minor} or newer with npm: https://nodejs.org");
    if shell::command("node", ["--version"]).output().is_err() {
        debian_packages(&["nodejs", "npm"]).with_context(|| help.clone())?;
    }
    let output = shell::command("node", ["--version"]).output().with_context(|| help.clone())?;
    let version = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    let mut numbers = version.trim_start_matches('v').split('.').map(|number| number.parse().unwrap_or(0));
    let found = [numbers.next().unwrap_or(0), numbers.next().unwrap_or(0)];
    ensure!(found >= NODE, "{help}; here is {version}");
    Ok(())
}

/// Makes sure that the page's npm packages are there, in the versions of the lock file.
pub(crate) fn node_modules() -> Result<()> {
    let web = shell::root().join("web");
    let (lock, installed) = (web.join("package-lock.json"), web.join("node_modules/.package-lock.json"));
    let modified = |path: &Path| path.metadata().and_then(|data| data.modified()).ok();
    if modified(&installed).is_some_and(|there| modified(&lock).is_none_or(|lock| lock <= there)) {
        return Ok(());
    }
    shell::run(shell::command("npm", ["ci", "--no-fund", "--no-audit"]).current_dir(web))
        .context("the page's npm packages could not be installed")
}

/// Makes sure that there is a browser for the page's tests.
pub(crate) fn browser() -> Result<()> {
    // A second engine is tried where there is one; on Debian it can be had.
    if std::env::var_os("FIREFOX").is_none() && !Path::new("/usr/bin/firefox-esr").exists() {
        let _ = debian_packages(&["firefox-esr"]);
    }
    if std::env::var_os("CHROMIUM").is_some() || BROWSERS.iter().any(|path| Path::new(path).exists()) {
        return Ok(());
    }
    debian_packages(&["chromium"]).context(
        "the page's tests need Chromium: install your system's package (Debian: `apt install chromium`), or name \
         the program in the variable CHROMIUM",
    )
}

/// The browser that [`browser`] made sure of.
pub(crate) fn browser_program() -> PathBuf {
    let found = || BROWSERS.iter().find(|path| Path::new(path).exists()).map(PathBuf::from);
    std::env::var_os("CHROMIUM").map(PathBuf::from).or_else(found).unwrap_or_else(|| "chromium".into())
}

/// Whether there is a Python that can make environments of its own; on Debian and its kin root gets one.
pub(crate) fn python() -> bool {
    let there = || {
        let check = "import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 9))";
        shell::command("python3", ["-c", check]).output().is_ok_and(|output| output.status.success())
    };
    there() || (debian_packages(&["python3", "python3-venv"]).is_ok() && there())
}

/// Whether there is a C compiler for boards; on Debian and its kin root gets one.
pub(crate) fn arm_compiler() -> bool {
    let there = || shell::command("arm-none-eabi-gcc", ["--version"]).output().is_ok();
    there() || (debian_packages(&["gcc-arm-none-eabi"]).is_ok() && there())
}

/// Whether a browser can be opened for the person at the machine.
pub(crate) fn has_display() -> bool {
    !cfg!(target_os = "linux")
        || ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some())
}

/// Installs packages where that needs no question: on Debian and its kin, as root.
fn debian_packages(names: &[&str]) -> Result<()> {
    let root = shell::command("id", ["-u"]).output().is_ok_and(|output| output.stdout.starts_with(b"0"));
    if !(root && Path::new("/usr/bin/apt-get").exists()) {
        bail!("{} is missing", names.join(" "));
    }
    shell::run(&mut shell::command("apt-get", ["update", "--quiet"]))?;
    let mut install = shell::command("apt-get", ["install", "--quiet", "--yes", "--no-install-recommends"]);
    shell::run(install.args(names).env("DEBIAN_FRONTEND", "noninteractive"))
}

/// Makes sure that QEMU for Arm is there: root on Debian and its kin gets the package.
pub(crate) fn qemu() -> Result<()> {
    if shell::command("qemu-system-arm", ["--version"]).output().is_ok() {
        return Ok(());
    }
    let is_root = shell::command("id", ["-u"]).output().is_ok_and(|id| id.stdout.trim_ascii() == b"0");
    let has_apt = shell::command("apt-get", ["--version"]).output().is_ok();
    if is_root && has_apt {
        shell::run(&mut shell::command("apt-get", ["update", "--quiet"]))?;
        let words = ["install", "--yes", "--quiet", "--no-install-recommends", "qemu-system-arm"];
        return shell::run(shell::command("apt-get", words).env("DEBIAN_FRONTEND", "noninteractive"));
    }
    anyhow::bail!(
        "qemu-system-arm is missing: install your system's package (Debian: `sudo apt install qemu-system-arm`)"
    )
}
