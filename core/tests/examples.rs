//! Each example prints what its comment says.
use std::path::PathBuf;
use std::process::Command;

/// Runs the example that cargo built beside this test, and compares.
fn prints_what_it_says(name: &str, source: &str) {
    let mut folder = std::env::current_exe().unwrap();
    folder.pop(); // deps
    folder.pop();
    let example: PathBuf = folder.join("examples").join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    assert!(
        example.is_file(),
        "{} is not built: run `cargo test` or `cargo build --examples`",
        example.display()
    );
    let output = Command::new(&example).output().unwrap();
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    let said = source.split_once("//! ```text\n").and_then(|(_, rest)| rest.split_once("//! ```\n"));
    let lines = said.expect("a block of text in its comment").0.lines();
    let said: String = lines.map(|line| line.trim_start_matches("//! ").to_owned() + "\n").collect();
    assert_eq!(String::from_utf8_lossy(&output.stdout), said);
}

#[test]
fn range() {
    prints_what_it_says("range", include_str!("../examples/range.rs"));
}

#[test]
fn homography() {
    prints_what_it_says("homography", include_str!("../examples/homography.rs"));
}

#[cfg(feature = "alloc")]
#[test]
fn slam() {
    prints_what_it_says("slam", include_str!("../examples/slam.rs"));
}

#[test]
fn own_sensor() {
    prints_what_it_says("own_sensor", include_str!("../examples/own_sensor.rs"));
}
