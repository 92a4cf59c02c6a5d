//! What several of the cross-crate tests share: the paper's camera, exact pictures of edges, random numbers, and
//! the way to real data.
pub mod chance;
pub mod corridor;
pub mod dynamic;
pub mod scan;
pub mod slam;
pub mod visual;
pub mod warp;

use monorange_core::Real;
use monorange_core::geometry::{Camera, Distortion, Mount, RangeFinder};
use std::io::Write;
use std::path::PathBuf;

/// The camera of the paper's Table 1.
pub fn table1_camera<T: Real>() -> Camera<T> {
    let [k1, k2, p1, p2, k3] = [-0.22776, 0.36413, -0.00545, -0.00192, 0.0].map(T::lit);
    let (focal, principal) = ([365.12674, 365.02905], [145.79917, 114.50956]);
    let lens = Distortion { k1, k2, p1, p2, k3 };
    Camera::new(320, 240, focal.map(T::lit), principal.map(T::lit), T::zero(), lens)
        .expect("Table 1 is valid")
}

/// Table 1's camera at `height` (m), tilted down by `tilt` (rad).
pub fn table1_range_finder<T: Real>(height: f64, tilt: f64) -> RangeFinder<T> {
    let mount = Mount::new([height, tilt, 0.0, 0.0, 0.0, 0.0].map(T::lit)).expect("a valid mount");
    RangeFinder::new(table1_camera(), mount)
}

/// The folder of real data `name` beside the project, or `None` where it is missing. The test's name then stands in
/// `target/skipped-checks.txt`, since libtest swallows what a test that passes says; `cargo xtask test` counts those lines at its end.
///
/// # Panics
/// With `CI=true` a missing folder is a failure: a check that is always skipped checks nothing.
pub fn real_data(name: &str) -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data").join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(std::env::var("CI").as_deref() != Ok("true"), "{} is missing under CI", folder.display());
    let thread = std::thread::current();
    let line = format!(
        "{}: SKIPPED, needs the real data in {}",
        thread.name().unwrap_or("a check"),
        folder.display()
    );
    eprintln!("{line}");
    let target = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    let list = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..").join(target).join("skipped-checks.txt");
    let file = std::fs::OpenOptions::new().create(true).append(true).open(list);
    let _ = file.and_then(|mut file| writeln!(file, "{line}"));
    None
}
mod edges;
mod noise;

pub use edges::{Exposure, HostExtractor, host_extractor, narrow, plain_range_finder};
pub use noise::Noise;
