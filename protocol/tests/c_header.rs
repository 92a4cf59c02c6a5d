//! `c/monorange.h` sends and reads the vectors of `SPEC.md`, says its own program in C; here it is compiled and run.
use std::process::Command;

#[test]
fn the_c_header_sends_and_reads_the_vectors() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/c");
    let program = concat!(env!("CARGO_TARGET_TMPDIR"), "/vectors");
    if Command::new("cc").arg("--version").output().is_err() {
        assert!(std::env::var_os("CI").is_none(), "there is no C compiler: install gcc or clang");
        eprintln!("SKIPPED: there is no C compiler, `cc`");
        return;
    }
    let strict = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", "-O1"];
    let compiled =
        Command::new("cc").args(strict).args(["test/vectors.c", "-o", program]).current_dir(folder).status();
    assert!(compiled.unwrap().success());
    let told = Command::new(program).arg("../SPEC.md").current_dir(folder).output().unwrap();
    let text = String::from_utf8_lossy(&told.stdout);
    assert!(told.status.success() && text.contains(" checks, 0 failures"), "{text}");
}
