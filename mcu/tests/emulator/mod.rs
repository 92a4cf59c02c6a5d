//! Boards in QEMU.
#![allow(dead_code, reason = "each test uses its part")]
use std::{
    os::unix::net::UnixStream,
    path::PathBuf,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

/// A board and its program.
pub(crate) struct Board {
    pub(crate) name: &'static str,
    image: PathBuf,
}

/// The boards whose programs are given.
pub(crate) fn boards() -> Vec<Board> {
    given(&[("mps2-an500", "MONORANGE_MPS2_AN500"), ("mps2-an386", "MONORANGE_MPS2_AN386")])
}

/// The board whose program crashes when it is asked to, if that is given.
pub(crate) fn crashing_board() -> Option<Board> {
    given(&[("mps2-an500", "MONORANGE_MPS2_AN500_CRASH")]).pop()
}

fn given(names: &[(&'static str, &str)]) -> Vec<Board> {
    let image = |variable: &str| Some(std::env::var_os(variable)?.into());
    let given: Vec<_> =
        names.iter().filter_map(|(name, variable)| Some(Board { name, image: image(variable)? })).collect();
    let required = std::env::var_os("MONORANGE_QEMU").is_some_and(|value| value == "required");
    assert!(!required || given.len() == names.len(), "the boards' programs are not given");
    if given.is_empty() {
        eprintln!("skipped: no firmware given; `cargo xtask firmware test` builds it and runs this test");
    }
    given
}

impl Board {
    /// Starts it, its line on a socket; `purpose` keeps tests that run side by side apart.
    pub(crate) fn start(&self, purpose: &str) -> Emulator {
        let folder = std::env::temp_dir();
        let line = folder.join(format!("monorange-{}-{purpose}-{}.sock", self.name, std::process::id()));
        let chardev = format!("socket,id=line,path={},server=on,wait=off,mux=on", line.display());
        let child = Command::new("qemu-system-arm")
            .args(["-machine", self.name, "-icount", "shift=5", "-display", "none", "-monitor", "none"])
            .args(["-chardev", &chardev, "-serial", "chardev:line", "-echr", "0x100", "-kernel"])
            .arg(&self.image)
            .stdin(Stdio::null())
            .spawn()
            .expect("qemu-system-arm starts");
        Emulator { child, line }
    }
}

/// A running board; it ends with this.
pub(crate) struct Emulator {
    child: Child,
    line: PathBuf,
}

impl Emulator {
    /// The socket that its line is on.
    pub(crate) fn line(&self) -> &std::path::Path {
        &self.line
    }

    /// Its line, once it is there.
    pub(crate) fn connect(&self) -> UnixStream {
        let start = Instant::now();
        loop {
            match UnixStream::connect(&self.line) {
                Ok(stream) => {
                    stream.set_read_timeout(Some(Duration::from_millis(5))).expect("5 ms is a time");
                    return stream;
                }
                Err(error) if start.elapsed() > Duration::from_secs(20) => panic!("no line: {error}"),
                Err(_) => std::thread::sleep(Duration::from_millis(20)),
            }
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = std::fs::remove_file(&self.line);
    }
}
