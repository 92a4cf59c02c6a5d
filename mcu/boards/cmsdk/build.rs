//! Names the board that is built for.
fn main() {
    let board = std::env::var("MONORANGE_BOARD").unwrap_or_else(|_| "mps2-an500".into());
    println!("cargo::rustc-env=MONORANGE_BOARD={board}");
    println!("cargo::rerun-if-env-changed=MONORANGE_BOARD");
}
