//! The installed command, run on a folder of its own.
use std::{
    fs,
    io::Write,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// A rig that every test starts from: Table 1's camera, 0.4 m up, looking 12° down.
pub(crate) const RIG: &str = "\
[camera]
width = 320
height = 240
focal = [365.12674, 365.02905]
principal = [145.79917, 114.50956]
distortion = [-0.22776, 0.36413, -0.00545, -0.00192, 0.0]
pixel_std = [0.10083, 0.10936]

[mount]
height = 0.40
tilt_deg = 12.0
";

pub(crate) struct Folder {
    folder: tempfile::TempDir,
}

#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) status: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Folder {
    pub(crate) fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) -> &Self {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
        self
    }

    pub(crate) fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// The names in the folder, sorted.
    pub(crate) fn names(&self) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(self.folder.path())
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    /// Runs `monorange` with arguments separated by spaces.
    pub(crate) fn run(&self, arguments: &str) -> Outcome {
        self.run_with_input(arguments, "")
    }

    pub(crate) fn run_with_input(&self, arguments: &str, input: &str) -> Outcome {
        let mut child = Command::new(env!("CARGO_BIN_EXE_monorange"))
            .args(arguments.split_whitespace())
            .current_dir(self.folder.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // A command that stops early closes its input; that is not this test's business.
        let _ = child.stdin.take().unwrap().write_all(input.as_bytes());
        let output = child.wait_with_output().unwrap();
        Outcome {
            status: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// Runs a command that must fail with status 1, print nothing, leave nothing, and say all of `words`.
    #[track_caller]
    pub(crate) fn fails(&self, arguments: &str, words: &[&str]) {
        let before = self.names();
        let outcome = self.run(arguments);
        assert_eq!(outcome.status, 1, "{outcome:?}");
        assert_eq!(outcome.stdout, "", "a failure prints no result");
        assert_eq!(self.names(), before, "a failure leaves nothing behind");
        for word in words {
            assert!(outcome.stderr.contains(word), "`{word}` is missing from: {}", outcome.stderr);
        }
    }
}

impl Outcome {
    /// Standard output of a run that must have succeeded.
    #[track_caller]
    pub(crate) fn success(self) -> String {
        assert_eq!(self.status, 0, "{}", self.stderr);
        self.stdout
    }
}

/// The rows of a CSV by column name.
pub(crate) fn column<'a>(csv: &'a str, name: &str) -> Vec<&'a str> {
    let mut lines = csv.lines();
    let place = lines.next().unwrap().split(',').position(|column| column == name).unwrap();
    lines.map(|line| line.split(',').nth(place).unwrap()).collect()
}

/// The project's sample data, where it is.
pub(crate) fn data(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data").join(name);
    if path.exists() {
        return Some(path);
    }
    assert!(std::env::var_os("CI").is_none_or(|ci| ci != "true"), "{} is missing", path.display());
    eprintln!("skipped: {} is not here", path.display());
    None
}
