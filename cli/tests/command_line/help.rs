//! The examples that `--help` shows work as they stand.
use crate::command::Folder;
use std::process::Command;

/// Runs the lines below `Example:` of a command's help in a shell, as a reader would.
fn run_example(command: &str) {
    let folder = Folder::new();
    let help = folder.run(&format!("{command} --help")).success();
    let example = help.split("Example:").nth(1).unwrap_or_else(|| panic!("{command} has no example"));
    run_script(&folder, command, example);
}

fn run_script(folder: &Folder, name: &str, script: &str) {
    let binary = std::path::Path::new(env!("CARGO_BIN_EXE_monorange"));
    let path =
        format!("{}:{}", binary.parent().unwrap().display(), std::env::var("PATH").unwrap_or_default());
    let output = Command::new("sh")
        .arg("-c")
        .arg(format!("set -e\n{script}"))
        .env("PATH", path)
        .current_dir(folder.path(""))
        .output()
        .unwrap();
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    assert!(!output.stdout.is_empty(), "{name} prints something");
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

/// What simulates its own pictures can be run anywhere; the rest wants a robot, a board or a browser.
#[test]
#[cfg(unix)]
fn the_starts_of_the_book_run() {
    let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/start.md");
    let page = std::fs::read_to_string(page).unwrap();
    let blocks = page.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next());
    let mut run = 0;
    for script in blocks.filter(|script| script.contains("monorange simulate") && !script.contains("feed")) {
        run_script(&Folder::new(), "docs/start.md", script);
        run += 1;
    }
    assert_eq!(run, 2);
}
