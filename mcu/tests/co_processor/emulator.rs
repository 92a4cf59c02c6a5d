//! Boards in QEMU.
use std::{
    os::unix::net::UnixStream,
    path::PathBuf,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

/// Seconds after which a board is stopped, whatever its test does.
const LONGEST_RUN: &str = "1800";

/// A board and its program.
pub(crate) struct Board {
    pub(crate) name: &'static str,
    image: PathBuf,
}

/// The boards whose programs are given.
pub(crate) fn boards() -> Vec<Board> {
    given(&[("mps2-an500", "MONORANGE_MPS2_AN500"), ("mps2-an386", "MONORANGE_MPS2_AN386")])
}

/// Those, and one without a floating-point unit, which takes five times as long.
pub(crate) fn every_processor() -> Vec<Board> {
    boards().into_iter().chain(given(&[("mps2-an385", "MONORANGE_MPS2_AN385")])).collect()
}

/// The board whose program crashes when it is asked to, if that is given.
pub(crate) fn crashing_board() -> Option<Board> {
    given(&[("mps2-an500", "MONORANGE_MPS2_AN500_CRASH")]).pop()
}

fn given(names: &[(&'static str, &str)]) -> Vec<Board> {
    let image = |variable: &str| Some(std::env::var_os(variable)?.into());
    let given: Vec<_> =
        names.iter().filter_map(|(name, variable)| Some(Board { name, image: image(variable)? })).collect();
    // CI has a stage of its own for boards; where it runs, nothing may be left out.
    let required = match std::env::var("MONORANGE_QEMU").as_deref() {
        Ok("required") => true,
        Ok("later") => false,
        _ => std::env::var_os("CI").is_some(),
    };
    assert!(!required || given.len() == names.len(), "no firmware given: run `cargo xtask firmware test`");
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
        // A test that is killed leaves no board behind for long.
        let child = Command::new("timeout")
            .args([LONGEST_RUN, "qemu-system-arm"])
            .args(["-machine", self.name, "-icount", "shift=5", "-display", "none", "-monitor", "none"])
            .args(["-chardev", &chardev, "-serial", "chardev:line", "-echr", "0x100", "-kernel"])
            .arg(&self.image)
            .stdin(Stdio::null())
            .spawn()
            .expect("timeout and qemu-system-arm start");
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
        // By its polite signal, which `timeout` hands on; the one of `Child::kill` would leave QEMU running.
        let _ = Command::new("kill").arg(self.child.id().to_string()).status();
        let _ = self.child.wait();
        let _ = std::fs::remove_file(&self.line);
    }
}
