//! The core's C API: its example on this computer and on a board without an operating system, which print the same bits.
use crate::{setup, shell, test};
use anyhow::{Context, Result, ensure};
use std::path::PathBuf;
use std::process::Command;

const BOARD: &str = "thumbv7em-none-eabihf";
const STRICT: [&str; 6] = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-I../include"];

/// Builds the library for both, and runs the example on both. In the profile of everything else here: most is compiled already.
pub(crate) fn test() -> Result<()> {
    setup::rust_target(BOARD)?;
    let library = "build --quiet -p monorange-c";
    shell::run(&mut shell::cargo(library))?;
    shell::run(&mut shell::cargo(&format!("{library} --no-default-features --target {BOARD}")))?;
    let here = on_this_computer()?;
    if let Some(here) = &here {
        print!("{here}");
        ensure!(here.contains("confirmed landmark at x"), "the example made no map");
    }
    let board = on_a_board()?;
    if let (Some(here), Some(board)) = (here, board) {
        ensure!(here == board, "the board prints other numbers:\n{board}");
        println!("The same on an emulated Cortex-M7, bit by bit.");
    }
    Ok(())
}

fn on_this_computer() -> Result<Option<String>> {
    if shell::command("cc", ["--version"]).output().is_err() {
        test::skipped("the example in C", "needs a C compiler named cc")?;
        return Ok(None);
    }
    let program = shell::target().join("debug/monorange-first-map");
    let library = shell::target().join("debug/libmonorange_c.a");
    let mut compiler = examples("cc", &["first_map.c", "host.c"]);
    shell::run(compiler.arg(library).args(["-lm", "-lpthread", "-ldl", "-o"]).arg(&program))?;
    output(shell::command(program, [""; 0])).map(Some)
}

fn on_a_board() -> Result<Option<String>> {
    if !setup::arm_compiler() {
        test::skipped("the example in C on a board", "needs arm-none-eabi-gcc (Debian: gcc-arm-none-eabi)")?;
        return Ok(None);
    }
    setup::qemu()?;
    let folder = shell::target().join(BOARD).join("debug");
    let (library, program) = (folder.join("libmonorange_c.a"), folder.join("monorange-first-map.elf"));
    let mut compiler = examples("arm-none-eabi-gcc", &["first_map.c", "board.c"]);
    compiler.args(["-mcpu=cortex-m7", "-mfpu=fpv5-sp-d16", "-mfloat-abi=hard", "-mthumb", "-ffreestanding"]);
    compiler.args([
        "-fno-tree-loop-distribute-patterns",
        "-nostdlib",
        "-Wl,--gc-sections,-z,noexecstack",
        "-T",
        "board.ld",
    ]);
    shell::run(compiler.arg(library).args(["-lgcc", "-o"]).arg(&program))?;
    let words = ["60", "qemu-system-arm", "-machine", "mps2-an500", "-display", "none", "-monitor", "none"];
    let mut board = shell::command("timeout", words);
    board.args(["-serial", "none", "-semihosting-config", "enable=on,target=native", "-kernel"]).arg(program);
    output(board).map(Some)
}

/// A compiler of the example.
fn examples(compiler: &str, sources: &[&str]) -> Command {
    let mut command = shell::command(compiler, STRICT);
    command.args(sources).current_dir(folder());
    command
}

fn folder() -> PathBuf {
    shell::root().join("core/c/examples")
}

/// What a program prints, wherever it prints it.
fn output(mut command: Command) -> Result<String> {
    let ended = command.output().with_context(|| format!("cannot start {command:?}"))?;
    let text = String::from_utf8_lossy(&[ended.stdout, ended.stderr].concat()).into_owned();
    ensure!(ended.status.success(), "{command:?} failed ({}):\n{text}", ended.status);
    Ok(text)
}
