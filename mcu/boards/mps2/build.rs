//! Puts the memory map where the linker looks for it, and names the processor that is built for.
use std::{env, error::Error, fs, path::Path};

fn main() -> Result<(), Box<dyn Error>> {
    let out = env::var("OUT_DIR")?;
    fs::copy("memory.x", Path::new(&out).join("memory.x"))?;
    println!("cargo::rustc-link-search={out}");
    println!("cargo::rerun-if-changed=memory.x");
    let board = env::var("MONORANGE_BOARD").unwrap_or_else(|_| "mps2-an500".into());
    println!("cargo::rustc-env=MONORANGE_BOARD={board}");
    println!("cargo::rerun-if-env-changed=MONORANGE_BOARD");
    Ok(())
}
