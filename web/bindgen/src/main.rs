//! `monorange-bindgen IN.wasm OUT_DIR`: the JavaScript and TypeScript side of a wasm-bindgen module.
//!
//! The generator must have the very version of the `wasm-bindgen` that the module was built with; as a library
//! in the workspace's lock file it always has, and nobody has to install a command.
use anyhow::{Context, Result};
use wasm_bindgen_cli_support::Bindgen;

fn main() -> Result<()> {
    let mut arguments = std::env::args_os().skip(1);
    let mut next = |what| arguments.next().with_context(|| format!("the {what} is missing: IN.wasm OUT_DIR"));
    let (input, output) = (next("module")?, next("output folder")?);
    let mut bindgen = Bindgen::new();
    bindgen.input_path(&input).web(true)?.typescript(true).omit_default_module_path(true);
    bindgen.remove_name_section(true).remove_producers_section(true);
    bindgen.generate(&output).with_context(|| format!("no bindings for {}", input.display()))
}
