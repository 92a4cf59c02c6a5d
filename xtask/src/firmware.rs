//! `cargo xtask firmware`: the co-processor in QEMU.
mod program;

use crate::{python, setup, shell, test};
use anyhow::{Context, Result, ensure};
use program::{Program, is_double};
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
    /// The emulated boards against the host: the same bits, instructions, restarts and crashes
    Test {
        /// Pictures of the corridor
        #[arg(long, default_value_t = 200)]
        frames: usize,
    },
    /// Flash and static RAM of all boards' programs; the link fails beyond 192 KiB and 128 KiB
    Size,
}

/// What QEMU emulates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Board {
    /// Cortex-M3, without a floating-point unit
    An385,
    /// Cortex-M4F
    An386,
    /// Cortex-M7
    An500,
}

const BOARDS: [Board; 3] = [Board::An500, Board::An386, Board::An385];
/// What the boards' linker scripts allow.
const FLASH: usize = 192 * 1024;
const RAM: usize = 128 * 1024;
/// The function that every row goes through, as a part of its symbol.
const PER_PIXEL: &str = "6mapper6Mapper4push17h";
/// Of boards with a floating-point unit.
const TRIPLE: &str = "thumbv7em-none-eabihf";

impl Board {
    fn machine(self) -> &'static str {
        match self {
            Self::An385 => "mps2-an385",
            Self::An386 => "mps2-an386",
            Self::An500 => "mps2-an500",
        }
    }

    fn processor(self) -> &'static str {
        match self {
            Self::An385 => "cortex-m3",
            Self::An386 => "cortex-m4",
            Self::An500 => "cortex-m7",
        }
    }

    fn triple(self) -> &'static str {
        match self {
            Self::An385 => "thumbv7m-none-eabi",
            Self::An386 | Self::An500 => TRIPLE,
        }
    }

    /// Where the board's program is, once it is built.
    fn image(self) -> PathBuf {
        built(self.processor(), self.triple(), "monorange-mps2")
    }

    /// Builds the board's program.
    fn compiler(self) -> Command {
        let mut cargo = compiler("mps2", self.processor());
        cargo.args(["--target", self.triple()]);
        let flags = format!("-Clink-arg=-Tlink.x -Clink-arg=--nmagic -Ctarget-cpu={}", self.processor());
        cargo.env("RUSTFLAGS", flags).env("MONORANGE_BOARD", self.machine());
        cargo
    }
}

/// Builds a program of `mcu/boards`, in a target folder for each processor: its flags are part of what is built.
fn compiler(folder: &str, processor: &str) -> Command {
    let mut cargo = shell::cargo("build --release --locked --target-dir");
    cargo.arg(target(processor)).current_dir(shell::root().join("mcu/boards").join(folder));
    cargo
}

fn target(processor: &str) -> PathBuf {
    shell::root().join("target/firmware").join(processor)
}

fn built(processor: &str, triple: &str, program: &str) -> PathBuf {
    target(processor).join(triple).join("release").join(program)
}

pub(crate) fn run(options: &Options) -> Result<()> {
    match &options.task {
        Task::Run { board, unix, tcp } => serve(*board, unix, *tcp),
        Task::Test { frames } => test(*frames),
        Task::Size => size(),
    }
}

fn serve(board: Board, unix: &Path, tcp: Option<u16>) -> Result<()> {
    setup::qemu()?;
    build([board.compiler()])?;
    let mut qemu = Command::new("qemu-system-arm");
    let line = match tcp {
        Some(port) => {
            format!("socket,id=line,host=127.0.0.1,port={port},nodelay=on,server=on,wait=off,mux=on")
        }
        None => format!("socket,id=line,path={},server=on,wait=off,mux=on", unix.display()),
    };
    let place = tcp.map_or(format!("--unix {}", unix.display()), |port| format!("--tcp 127.0.0.1:{port}"));
    eprintln!("{} answers `monorange feed {place} …`", board.machine());
    qemu.args(["-machine", board.machine(), "-icount", "shift=5", "-display", "none", "-monitor", "none"]);
    qemu.args(["-chardev", &line, "-serial", "chardev:line", "-echr", "0x100", "-kernel"]).arg(board.image());
    shell::run(qemu.current_dir(shell::root()))
}

/// Format and lints of the boards, which the root's workspace does not have.
pub(crate) fn lint() -> Result<()> {
    setup::rust_target(TRIPLE)?;
    let boards = shell::root().join("mcu/boards");
    shell::run(shell::cargo("fmt --all --check").current_dir(&boards))?;
    // Macros and build scripts are compiled once, with those of the programs.
    let mut clippy = shell::cargo("clippy --workspace --release --locked --quiet --target");
    clippy.arg(TRIPLE).arg("--target-dir").arg(target(Board::An500.processor()));
    shell::run(clippy.args(["--", "-D", "warnings"]).current_dir(&boards))
}

/// Cases for each of the five properties of the frame decoder: more than a million in all.
const FUZZ_CASES: &str = "250000";

/// Runs the tests that need boards, with so many pictures of the corridor, and the long run of hostile bytes; builds and weighs
/// the program for silicon as well.
pub(crate) fn test(frames: usize) -> Result<()> {
    setup::qemu()?;
    let crashing = crashing()?;
    build(programs())?;
    weigh()?;
    // Of the whole workspace, as `cargo test` builds it: the features of a package by itself would have all compiled again.
    let mut cargo = shell::cargo("test");
    for test in ["co_processor", "feed", "hostile_line"] {
        cargo.args(["--test", test]);
    }
    cargo.args(["--", "--nocapture"]);
    cargo.env("MONORANGE_QEMU", "required").env("MONORANGE_FRAMES", frames.to_string());
    cargo.env("MONORANGE_FUZZ_CASES", FUZZ_CASES).env("MONORANGE_MPS2_AN500_CRASH", crashing);
    // What another reader of MAVLink makes of `feed --mavlink`.
    match python::with("pymavlink")? {
        Some(python) => _ = cargo.env("MONORANGE_PYTHON", python),
        None => test::skipped("MAVLink by pymavlink", python::NEEDS_MODULE)?,
    }
    // The chip that the Nucleo's program runs on.
    match python::with("unicorn")? {
        Some(python) => _ = cargo.env("MONORANGE_UNICORN", python).env("MONORANGE_NUCLEO", nucleo_image()),
        None => test::skipped("the Nucleo's program on an emulated STM32H7", python::NEEDS_MODULE)?,
    }
    for board in BOARDS {
        let variable = format!("MONORANGE_{}", board.machine().to_uppercase().replace('-', "_"));
        cargo.env(variable, board.image());
    }
    shell::run(&mut cargo)
}

fn size() -> Result<()> {
    build(programs())?;
    weigh()
}

/// Runs compilers side by side: each ends in one long piece of work for one core.
fn build(compilers: impl IntoIterator<Item = Command>) -> Result<()> {
    setup::rust_target(TRIPLE)?;
    setup::rust_target(Board::An385.triple())?;
    shell::run_together(&mut compilers.into_iter().collect::<Vec<_>>())
}

/// The compilers of every board's program.
fn programs() -> [Command; 4] {
    let [first, second, third] = BOARDS.map(Board::compiler);
    [first, second, third, compiler("nucleo-h743zi", Board::An500.processor())]
}

/// Builds the program that panics, overflows its stack or hangs when it is told to, and keeps it beside the one that does not.
fn crashing() -> Result<PathBuf> {
    let mut compiler = Board::An500.compiler();
    compiler.args(["--features", "crash"]);
    build([compiler])?;
    let (built, kept) = (Board::An500.image(), target("crash").with_extension("elf"));
    std::fs::copy(&built, &kept).with_context(|| format!("cannot copy {}", built.display()))?;
    Ok(kept)
}

/// Prints what the programs take, and checks that no pixel costs a call of double precision.
fn weigh() -> Result<()> {
    for board in BOARDS {
        report(&board.image(), board.machine())?;
    }
    report(&nucleo_image(), "nucleo-h743zi")
}

fn report(image: &Path, board: &str) -> Result<()> {
    let file = std::fs::read(image).with_context(|| format!("cannot read {}", image.display()))?;
    let program = Program::parse(&file).with_context(|| format!("{} is no program", image.display()))?;
    let [flash, ram] = program.flash_and_ram();
    println!("{board}: flash {flash} of {FLASH} bytes, static RAM {ram} of {RAM} bytes; the rest is stack");
    let per_pixel =
        program.called_from(PER_PIXEL).with_context(|| format!("{board} has no function {PER_PIXEL}"))?;
    let double: Vec<_> = per_pixel.iter().filter(|name| is_double(name)).collect();
    ensure!(
        double.is_empty(),
        "{board}: {PER_PIXEL} calls {double:?}, which are slow without double precision"
    );
    println!(
        "{board}: none of the {} functions that rows go through is in double precision",
        per_pixel.len()
    );
    Ok(())
}

/// Where the program for silicon is, once it is built.
fn nucleo_image() -> PathBuf {
    built(Board::An500.processor(), TRIPLE, "monorange-nucleo-h743zi")
}
