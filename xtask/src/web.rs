//! The page: its WebAssembly modules, its bundle, and the size limits on both.
use crate::{setup, shell};
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

const WASM: &str = "wasm32-unknown-unknown";

/// Crates that become WebAssembly packages in their own folders' `pkg/`.
struct Build {
    /// Folders and names.
    packages: &'static [(&'static str, &'static str)],
    /// As in the workspace's `Cargo.toml`.
    profile: &'static str,
    variant: &'static str,
}

const PIPELINE: (&str, &str) = ("wasm", "monorange-wasm");
const SCAN: (&str, &str) = ("wasm/scan", "monorange-wasm-scan");
const BUILDS: [Build; 6] = [
    // For speed too, since every picture goes through the scan; but the page does not wait for it.
    Build { packages: &[PIPELINE, SCAN], profile: "wasm", variant: "simd" },
    Build { packages: &[PIPELINE, SCAN], profile: "wasm", variant: "scalar" },
    // Loaded when needed, and never in a hurry.
    Build {
        packages: &[
            ("wasm/files", "monorange-wasm-files"),
            ("wasm/containers", "monorange-wasm-containers"),
            ("wasm/results", "monorange-wasm-results"),
        ],
        profile: "wasm-small",
        variant: "scalar",
    },
    // By itself: with the others it would get what they ask of the core.
    Build {
        packages: &[("wasm/session", "monorange-wasm-session")],
        profile: "wasm-small",
        variant: "scalar",
    },
    // By itself: with the others it would get their formats of pictures too.
    Build {
        packages: &[("wasm/pictures", "monorange-wasm-pictures")],
        profile: "wasm-small",
        variant: "scalar",
    },
    // By itself: what finds chessboards asks for more of the libraries that the others have as well.
    Build { packages: &[("wasm/board", "monorange-wasm-board")], profile: "wasm-small", variant: "scalar" },
];

/// Two thirds of LLVM's own: large products of small matrices stay loops, 1 to 2 % less to load at the same speed. Half of it is a third slower.
const UNROLL_LESS: &str = "-Cllvm-args=-unroll-threshold=100";

/// What must stay small, in bytes after gzip: start and end of the file's name, limit.
const LIMITS: [(&str, &str, u64); 3] = [
    ("monorange_wasm_simd", ".wasm", 200_000),
    ("monorange_wasm_scalar", ".wasm", 200_000),
    ("index", ".js", 120_000),
];

/// What the empty page loads in all, bytes after gzip.
const FIRST_LOAD: u64 = 330_000;
/// What it does not load: how the names of the parts begin that come when they are needed.
const LATER: [&str; 13] = [
    "board",
    "containers",
    "files",
    "pictures",
    "results",
    "scan",
    "monorange_wasm_board",
    "monorange_wasm_containers",
    "monorange_wasm_files",
    "monorange_wasm_pictures",
    "monorange_wasm_results",
    "monorange_wasm_scan",
    "monorange_wasm_scalar",
];

/// Second bytes of i16x8.add, sub and mul, i32x4.add and sub, f32x4.add, sub and mul.
const LANE_ARITHMETIC: [u8; 8] = [0x8e, 0x91, 0x95, 0xae, 0xb1, 0xe4, 0xe5, 0xe6];

/// What to do with the page.
#[derive(clap::Args)]
pub(crate) struct Options {
    /// Run its tests, in a real browser too
    #[arg(long)]
    test: bool,
    /// Serve it on the loopback address, until interrupted
    #[arg(long)]
    serve: bool,
    /// Port to serve on
    #[arg(long, default_value_t = 4173)]
    port: u16,
}

pub(crate) fn run(options: &Options) -> Result<()> {
    match options {
        Options { test: true, .. } => {
            // With the features of the whole workspace, as the workspace's tests build it.
            shell::run(&mut shell::cargo("build --quiet --bin monorange"))?;
            test()
        }
        Options { serve: true, port, .. } => {
            build()?;
            serve(*port)
        }
        _ => build(),
    }
}

/// Builds `web/dist` and checks its sizes.
pub(crate) fn build() -> Result<()> {
    setup::rust_target(WASM)?;
    setup::node()?;
    packages()?;
    setup::node_modules()?;
    has_simd()?;
    shell::run(&mut tool("tsc", &["--noEmit"]))?;
    shell::run(&mut tool("vite", &["build", "--logLevel", "warn"]))?;
    sizes()
}

/// The page's own tests, then the built page in a real browser, beside the command line, which `cargo test` and
/// `cargo build` leave in the same place.
pub(crate) fn test() -> Result<()> {
    setup::browser()?;
    build()?;
    let monorange = shell::target().join("debug/monorange").with_extension(std::env::consts::EXE_EXTENSION);
    shell::run(
        tool("vitest", &["run", "--project", "unit", "--project", "browser", "--project", "alone"])
            .env("MONORANGE", monorange),
    )
}

/// Serves the built page to this machine alone, until interrupted.
pub(crate) fn serve(port: u16) -> Result<()> {
    let port = port.to_string();
    let mut server = tool("vite", &["preview", "--host", "127.0.0.1", "--strictPort", "--port", &port]);
    println!("\nThe page: http://127.0.0.1:{port}/   (Ctrl+C ends it)");
    if setup::has_display() {
        server.arg("--open");
    } else {
        println!("There is no display here: open that address in a browser of this machine.");
    }
    shell::become_program(&mut server)
}

/// A command of the page's npm packages.
fn tool(name: &str, arguments: &[&str]) -> Command {
    let web = shell::root().join("web");
    let program = web.join("node_modules/.bin").join(name);
    let mut command = shell::command(program, arguments);
    command.current_dir(web);
    command
}

/// Compiles the crates, side by side, and writes their JavaScript sides.
fn packages() -> Result<()> {
    let mut compilers = BUILDS.each_ref().map(Build::compiler);
    shell::run_together(&mut compilers)?;
    for build in &BUILDS {
        for (folder, name) in build.packages {
            let pkg = shell::root().join(folder).join("pkg");
            std::fs::create_dir_all(&pkg)?;
            let bindings = &mut shell::cargo("run --quiet --package monorange-bindgen --");
            shell::run(bindings.arg(build.compiled(name)).arg(&pkg))?;
            std::fs::rename(
                pkg.join(format!("{}_bg.wasm", library(name))),
                module(folder, name, build.variant),
            )
            .with_context(|| format!("{name} gave no module"))?;
        }
    }
    Ok(())
}

impl Build {
    fn compiler(&self) -> Command {
        let mut words = format!("build --quiet --lib --profile {} --target {WASM}", self.profile);
        for (_, name) in self.packages {
            words += &format!(" --package {name}");
        }
        let mut compiler = shell::cargo(&words);
        compiler.env("CARGO_TARGET_DIR", self.target());
        let simd = if self.variant == "simd" { "-Ctarget-feature=+simd128 " } else { "" };
        compiler.env("RUSTFLAGS", format!("{simd}{UNROLL_LESS}"));
        compiler
    }

    /// A folder for each set of flags, or every change of them would build everything anew.
    fn target(&self) -> PathBuf {
        shell::target().join(format!("{}-{}", self.profile, self.variant))
    }

    fn compiled(&self, name: &str) -> PathBuf {
        self.target().join(WASM).join(self.profile).join(format!("{}.wasm", library(name)))
    }
}

fn library(name: &str) -> String {
    name.replace('-', "_")
}

fn module(folder: &str, name: &str, variant: &str) -> PathBuf {
    shell::root().join(folder).join("pkg").join(format!("{}_{variant}.wasm", library(name)))
}

/// Looks into the modules: a SIMD build without SIMD would be slow, and nothing else would tell.
fn has_simd() -> Result<()> {
    let count = |variant| -> Result<usize> {
        let code = std::fs::read(module(PIPELINE.0, PIPELINE.1, variant))?;
        let is_simd =
            |bytes: &[u8]| matches!(bytes, [0xfd, operation, 0x01] if LANE_ARITHMETIC.contains(operation));
        Ok(code.windows(3).filter(|bytes| is_simd(bytes)).count())
    };
    let (simd, scalar) = (count("simd")?, count("scalar")?);
    ensure!(
        simd >= 200 + 10 * scalar,
        "the SIMD build has only {simd} SIMD instructions, the scalar one {scalar}"
    );
    eprintln!("{simd} instructions of SIMD arithmetic");
    Ok(())
}

fn sizes() -> Result<()> {
    let assets = shell::root().join("web/dist/assets");
    let mut files: Vec<_> = std::fs::read_dir(&assets)?.collect::<Result<_, _>>()?;
    files.sort_by_key(std::fs::DirEntry::file_name);
    let mut checked = [false; LIMITS.len()];
    let mut first_load = gzip_size(&shell::root().join("web/dist/index.html"))?;
    for file in files {
        let name = file.file_name().to_string_lossy().into_owned();
        let size = gzip_size(&file.path())?;
        eprintln!("{size:>9} bytes gzip  {name}");
        if !LATER.iter().any(|start| name.starts_with(start)) {
            first_load += size;
        }
        for ((start, end, limit), checked) in LIMITS.iter().zip(&mut checked) {
            if name.starts_with(start) && name.ends_with(end) {
                ensure!(size <= *limit, "{name} has {size} bytes after gzip, more than {limit}");
                *checked = true;
            }
        }
    }
    eprintln!("{first_load:>9} bytes gzip  the empty page in all");
    ensure!(first_load <= FIRST_LOAD, "the empty page loads {first_load} bytes, more than {FIRST_LOAD}");
    ensure!(checked == [true; LIMITS.len()], "a file whose size is limited is not there: {LIMITS:?}");
    Ok(())
}

fn gzip_size(path: &Path) -> Result<u64> {
    let script =
        "console.log(require('zlib').gzipSync(require('fs').readFileSync(process.argv[1]),{level:9}).length)";
    let output = shell::command("node", ["-e", script]).arg(path).output().context("node is needed")?;
    String::from_utf8_lossy(&output.stdout).trim().parse().with_context(|| format!("{}", path.display()))
}
