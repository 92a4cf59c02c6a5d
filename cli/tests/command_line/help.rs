//! The examples that `--help` shows work as they stand.
use crate::command::Folder;
use std::process::Command;

/// Runs the lines below `Example:` of a command's help in a shell, as a reader would.
fn run_example(command: &str) {
    let folder = Folder::new();
    let help = folder.run(&format!("{command} --help")).success();
    let example = help.split("Example:").nth(1).unwrap_or_else(|| panic!("{command} has no example"));
    let binary = std::path::Path::new(env!("CARGO_BIN_EXE_monorange"));
    let path =
        format!("{}:{}", binary.parent().unwrap().display(), std::env::var("PATH").unwrap_or_default());
    let script = format!("set -e\n{example}");
    let output = Command::new("sh")
        .arg("-c")
        .arg(script)
        .env("PATH", path)
        .current_dir(folder.path(""))
        .output()
        .unwrap();
    assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
    assert!(!output.stdout.is_empty(), "{command} prints something");
}

#[test]
#[cfg(unix)]
fn the_examples_of_the_quick_commands_run() {
    for command in [
        "range",
        "landmarks",
        "keypoints",
        "match",
        "simulate",
        "scan",
        "slam",
        "slam-log",
        "evaluate",
        "calibrate-mount",
        "reproduce",
        "settings",
    ] {
        run_example(command);
    }
}
