//! The page: its WebAssembly modules, its bundle, and the size limits on both.
use crate::{setup, shell};
use anyhow::{Context, Result, ensure};
use std::path::Path;

const WASM: &str = "wasm32-unknown-unknown";

/// A crate that becomes a WebAssembly package in its own folder's `pkg/`.
struct Package {
    folder: &'static str,
    library: &'static str,
    simd: bool,
}

const PACKAGES: [Package; 3] = [
    Package { folder: "wasm", library: "monorange_wasm", simd: true },
    Package { folder: "wasm/files", library: "monorange_wasm_files", simd: false },
    Package { folder: "wasm/pictures", library: "monorange_wasm_pictures", simd: false },
];

/// What must stay small, in bytes after gzip: (glob-free prefix of the file's name, suffix, limit).
const LIMITS: [(&str, &str, u64); 2] = [("monorange_wasm_simd", ".wasm", 200_000), ("index", ".js", 120_000)];

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
        Options { test: true, .. } => test(),
        Options { serve: true, port, .. } => serve(*port),
        _ => build(),
    }
}

/// Builds `web/dist` and checks its sizes.
pub(crate) fn build() -> Result<()> {
    packages()?;
    setup::node_modules()?;
    optimise()?;
    npm(&["run", "build"])?;
    sizes()
}

/// The page's own tests, then the built page in a real browser, beside the command line.
pub(crate) fn test() -> Result<()> {
    build()?;
    shell::run(&mut shell::cargo("build --quiet -p monorange"))?;
    npm(&["test"])?;
    npm(&["run", "test:browser"])
}

/// Builds the page and serves it to this machine alone, until interrupted.
pub(crate) fn serve(port: u16) -> Result<()> {
    build()?;
    println!("The page: http://127.0.0.1:{port}/   (Ctrl+C ends it)");
    npm(&["run", "serve", "--", "--port", &port.to_string(), "--open"])
}

fn npm(arguments: &[&str]) -> Result<()> {
    shell::run(shell::command("npm", arguments).current_dir(shell::root().join("web")))
}

fn packages() -> Result<()> {
    setup::rust_target(WASM)?;
    for package in &PACKAGES {
        let pkg = shell::root().join(package.folder).join("pkg");
        std::fs::create_dir_all(&pkg)?;
        let variants: &[(&str, &str)] =
            if package.simd { &[("scalar", ""), ("simd", "+simd128")] } else { &[("scalar", "")] };
        for (variant, features) in variants {
            let name = package.library.replace('_', "-");
            let mut build =
                shell::cargo(&format!("build --quiet -p {name} --lib --profile wasm --target {WASM}"));
            if !package.simd {
                // Loaded when needed, and never in a hurry: as small as can be.
                build.env("CARGO_PROFILE_WASM_OPT_LEVEL", "s");
            }
            build.env("RUSTFLAGS", format!("-Ctarget-feature={features}"));
            // A folder each, or every change of flags would build everything anew.
            build.env("CARGO_TARGET_DIR", shell::root().join("target/wasm").join(variant));
            shell::run(&mut build)?;
            let module = format!("target/wasm/{variant}/{WASM}/wasm/{}.wasm", package.library);
            shell::run(shell::cargo("run --quiet -p monorange-bindgen --").arg(&module).arg(&pkg))?;
            std::fs::rename(
                pkg.join(format!("{}_bg.wasm", package.library)),
                pkg.join(format!("{}_{variant}.wasm", package.library)),
            )
            .with_context(|| format!("{} gave no module", package.folder))?;
        }
    }
    Ok(())
}

fn optimise() -> Result<()> {
    for package in &PACKAGES {
        let pkg = shell::root().join(package.folder).join("pkg");
        for variant in ["scalar", "simd"] {
            let module = pkg.join(format!("{}_{variant}.wasm", package.library));
            if module.exists() {
                let optimiser = shell::root().join("web/node_modules/.bin/wasm-opt");
                let mut command = shell::command(&optimiser.display().to_string(), ["-O3", "--all-features"]);
                // Relaxed SIMD may fuse a multiplication with an addition: never.
                command.arg("--disable-relaxed-simd").arg(&module).arg("-o").arg(&module);
                shell::run(&mut command)?;
            }
        }
    }
    Ok(())
}

fn sizes() -> Result<()> {
    let assets = shell::root().join("web/dist/assets");
    let mut files: Vec<_> = std::fs::read_dir(&assets)?.collect::<Result<_, _>>()?;
    files.sort_by_key(std::fs::DirEntry::file_name);
    for file in files {
        let name = file.file_name().to_string_lossy().into_owned();
        let size = gzip_size(&file.path())?;
        eprintln!("{size:>9} bytes gzip  {name}");
        for (prefix, suffix, limit) in LIMITS {
            let checked = name.starts_with(prefix) && name.ends_with(suffix);
            ensure!(!checked || size <= limit, "{name} has {size} bytes after gzip, more than {limit}");
        }
    }
    Ok(())
}

fn gzip_size(path: &Path) -> Result<u64> {
    let script =
        "console.log(require('zlib').gzipSync(require('fs').readFileSync(process.argv[1]),{level:9}).length)";
    let output = shell::command("node", ["-e", script]).arg(path).output().context("node is needed")?;
    String::from_utf8_lossy(&output.stdout).trim().parse().with_context(|| format!("{}", path.display()))
}
