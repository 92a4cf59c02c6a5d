//! `cargo xtask firmware`: the co-processor in QEMU.
use crate::{setup, shell};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Build, run and test the co-processor's firmware; QEMU is its board.
#[derive(clap::Args)]
pub(crate) struct Options {
    #[command(subcommand)]
    task: Task,
}

#[derive(clap::Subcommand)]
enum Task {
    /// Start a board in QEMU, its serial line on a socket, for `monorange feed`; Ctrl-C ends it
    Run {
        /// The board
        #[arg(long, value_enum, default_value_t = Board::An500)]
        board: Board,
        /// The line on this Unix socket
        #[arg(long, default_value = "target/firmware.sock", conflicts_with = "tcp")]
        unix: PathBuf,
        /// The line on this TCP port of this machine
        #[arg(long)]
        tcp: Option<u16>,
    },
    /// Both boards in QEMU against the host: the same bits, faults on the line, crashes
    Test,
    /// Flash and static RAM of both boards' programs; the link fails beyond 160 KiB and 128 KiB
    Size,
}

/// What QEMU emulates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Board {
    /// Cortex-M4F
    An386,
    /// Cortex-M7
    An500,
}

const BOARDS: [Board; 2] = [Board::An500, Board::An386];
const TRIPLE: &str = "thumbv7em-none-eabihf";

impl Board {
    fn machine(self) -> &'static str {
        match self {
            Self::An386 => "mps2-an386",
            Self::An500 => "mps2-an500",
        }
    }

    fn processor(self) -> &'static str {
        match self {
            Self::An386 => "cortex-m4",
            Self::An500 => "cortex-m7",
        }
    }

    /// Builds the board's program and returns its path.
    fn build(self, features: &str) -> Result<PathBuf> {
        setup::rust_target(TRIPLE)?;
        let folder = shell::root().join("mcu/boards/mps2");
        // A target folder a processor: the flags are part of what is built.
        let target = shell::root().join("target/firmware").join(format!("{}{features}", self.machine()));
        let mut cargo = shell::cargo("build --release --locked --target");
        cargo.arg(TRIPLE).arg("--target-dir").arg(&target).current_dir(folder);
        if !features.is_empty() {
            cargo.args(["--features", features]);
        }
        let flags = format!("-Clink-arg=-Tlink.x -Clink-arg=--nmagic -Ctarget-cpu={}", self.processor());
        cargo.env("RUSTFLAGS", flags).env("MONORANGE_BOARD", self.machine());
        shell::run(&mut cargo)?;
        Ok(target.join(TRIPLE).join("release/monorange-mps2"))
    }
}

pub(crate) fn run(options: &Options) -> Result<()> {
    match &options.task {
        Task::Run { board, unix, tcp } => serve(*board, unix, *tcp),
        Task::Test => test(),
        Task::Size => size(),
    }
}

fn qemu() -> Result<Command> {
    let found = Command::new("qemu-system-arm").arg("--version").output();
    if found.is_err() {
        bail!(
            "qemu-system-arm is missing: install your system's package (Debian: `apt install qemu-system-arm`)"
        );
    }
    Ok(Command::new("qemu-system-arm"))
}

fn serve(board: Board, unix: &Path, tcp: Option<u16>) -> Result<()> {
    let mut qemu = qemu()?;
    let image = board.build("")?;
    let line = match tcp {
        Some(port) => {
            format!("socket,id=line,host=127.0.0.1,port={port},nodelay=on,server=on,wait=off,mux=on")
        }
        None => format!("socket,id=line,path={},server=on,wait=off,mux=on", unix.display()),
    };
    let place = tcp.map_or(format!("--unix {}", unix.display()), |port| format!("--tcp 127.0.0.1:{port}"));
    eprintln!("{} answers `monorange feed {place} …`", board.machine());
    qemu.args(["-machine", board.machine(), "-icount", "shift=5", "-display", "none", "-monitor", "none"]);
    qemu.args(["-chardev", &line, "-serial", "chardev:line", "-echr", "0x100", "-kernel"]).arg(image);
    shell::run(qemu.current_dir(shell::root()))
}

/// Runs the tests that need boards, with the programs of both.
fn test() -> Result<()> {
    qemu()?;
    let mut cargo =
        shell::cargo("test --package monorange-mcu --test in_qemu -- --nocapture --test-threads 1");
    cargo.env("MONORANGE_QEMU", "required");
    for board in BOARDS {
        let variable = format!("MONORANGE_{}", board.machine().to_uppercase().replace('-', "_"));
        cargo.env(variable, board.build("")?);
    }
    shell::run(&mut cargo)
}

fn size() -> Result<()> {
    for board in BOARDS {
        let image = board.build("")?;
        let file = std::fs::read(&image).with_context(|| format!("cannot read {}", image.display()))?;
        let (flash, ram) =
            flash_and_ram(&file).with_context(|| format!("{} is no program", image.display()))?;
        println!(
            "{}: flash {flash} bytes, static RAM {ram} bytes; the rest of 131072 is stack",
            board.machine()
        );
    }
    Ok(())
}

/// Bytes that a 32-bit little-endian ELF file loads, and bytes of RAM that it names.
fn flash_and_ram(file: &[u8]) -> Option<(u32, u32)> {
    const LOAD: u32 = 1;
    const RAM: u32 = 0x2000_0000;
    let word = |at: usize| Some(u32::from_le_bytes(*file.get(at..)?.first_chunk()?));
    let half = |at: usize| Some(u16::from_le_bytes(*file.get(at..)?.first_chunk()?));
    let (headers, size, count) = (word(28)? as usize, usize::from(half(42)?), usize::from(half(44)?));
    let (mut flash, mut ram) = (0, 0);
    for header in (0..count).map(|number| headers + number * size).filter(|at| word(*at) == Some(LOAD)) {
        let [address, in_file, in_memory] = [word(header + 8)?, word(header + 16)?, word(header + 20)?];
        flash += in_file;
        ram += if address >= RAM { in_memory } else { 0 };
    }
    Some((flash, ram))
}
