//! The npm package as strangers get it: packed, and then installed in scratch projects of Node.js and of three Vites.
use crate::{setup, shell, web};
use anyhow::{Context, Result, ensure};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The newest of each kind that people have.
const VITES: [&str; 3] = ["6.4.6", "7.3.8", "8.4.0"];
const NAME: &str = "monorange-wasm";
/// What the README's example prints.
const RANGE: &str = "0.883 ± 0.0";

/// Builds the package's modules, and tests it.
pub(crate) fn run() -> Result<()> {
    web::build()?;
    test()
}

/// Packs the package, and tries the README's example where it is to be used. The page's modules are there already.
pub(crate) fn test() -> Result<()> {
    setup::node()?;
    setup::node_modules()?;
    setup::browser()?;
    let scratch = shell::target().join("npm");
    let _ = fs::remove_dir_all(&scratch);
    fs::create_dir_all(&scratch)?;
    let package = pack(&scratch)?;
    let example = example()?;
    let node = scratch.join("node");
    let vites = VITES.map(|version| (version, scratch.join(format!("vite-{version}"))));
    let mut installs = vec![project(&node, &package, &example, None)?];
    for (version, folder) in &vites {
        installs.push(project(folder, &package, &example, Some(version))?);
    }
    shell::run_together(&mut installs)?;
    in_node(&node)?;
    typed(&node)?;
    vites.iter().try_for_each(|(version, folder)| in_vite(folder, version))
}

fn npm(folder: &Path, words: &[&str]) -> Command {
    let mut command = shell::command("npm", words);
    command.current_dir(folder);
    command
}

/// The package's tarball; one without its modules must not come about.
fn pack(scratch: &Path) -> Result<PathBuf> {
    let (package, bare) = (shell::root().join("wasm"), scratch.join("bare"));
    fs::create_dir_all(&bare)?;
    for name in ["package.json", "prepack.js", "index.js", "node.js", "index.d.ts", "README.md"] {
        fs::copy(package.join(name), bare.join(name)).with_context(|| format!("wasm/{name}"))?;
    }
    let refused = npm(&bare, &["pack", "--silent"]).output()?;
    let said = String::from_utf8_lossy(&refused.stderr);
    ensure!(!refused.status.success(), "npm packs the package without pkg/");
    ensure!(said.contains("cargo xtask web"), "npm pack without pkg/ does not say what to do: {said}");
    shell::run(npm(&package, &["pack", "--silent", "--pack-destination"]).arg(scratch))?;
    let mut found = fs::read_dir(scratch)?.filter_map(|entry| Some(entry.ok()?.path()));
    found.find(|path| path.extension().is_some_and(|end| end == "tgz")).context("npm pack gave no tarball")
}

/// The first lines of JavaScript in the package's README.
fn example() -> Result<String> {
    let readme = fs::read_to_string(shell::root().join("wasm/README.md"))?;
    let lines = readme.split("```js\n").nth(1).and_then(|rest| rest.split("```").next());
    lines.map(str::to_owned).context("wasm/README.md has no example")
}

/// A project that runs the example, and the command that installs what it needs.
fn project(folder: &Path, package: &Path, example: &str, vite: Option<&str>) -> Result<Command> {
    fs::create_dir_all(folder)?;
    fs::write(
        folder.join("package.json"),
        "{ \"name\": \"scratch\", \"private\": true, \"type\": \"module\" }\n",
    )?;
    fs::write(folder.join("main.js"), example)?;
    let mut install = npm(folder, &["install", "--silent", "--no-fund", "--no-audit", "--prefer-offline"]);
    install.arg(package).args(vite.map(|version| format!("vite@{version}")));
    Ok(install)
}

fn in_node(folder: &Path) -> Result<()> {
    let output = shell::command("node", ["main.js"]).current_dir(folder).output()?;
    let said = String::from_utf8_lossy(&output.stdout);
    let wrong = String::from_utf8_lossy(&output.stderr);
    ensure!(said.contains(RANGE), "Node.js prints {said:?} instead of {RANGE}…: {wrong}");
    for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
        let file = folder.join("node_modules").join(NAME).join(licence);
        ensure!(file.exists(), "the package lacks {licence}");
    }
    eprintln!("Node.js: {}", said.trim());
    Ok(())
}

/// The types hold for the example, for bundlers and for Node.js.
fn typed(folder: &Path) -> Result<()> {
    let compiler = shell::root().join("web/node_modules/.bin/tsc");
    let strict =
        ["--noEmit", "--strict", "--allowJs", "--checkJs", "--target", "es2022", "--lib", "esnext,dom"];
    for [module, resolution] in [["esnext", "bundler"], ["nodenext", "nodenext"]] {
        let how = ["--module", module, "--moduleResolution", resolution, "main.js"];
        shell::run(shell::command(&compiler, strict).args(how).current_dir(folder))
            .with_context(|| format!("the package's types with moduleResolution {resolution}"))?;
    }
    Ok(())
}

/// The example in a page: from Vite's development server, and from what Vite builds, each in a browser.
fn in_vite(folder: &Path, version: &str) -> Result<()> {
    let page = "<!doctype html><link rel=\"icon\" href=\"data:,\"><script type=\"module\" src=\"/main.js\"></script>\n";
    fs::write(folder.join("index.html"), page)?;
    fs::write(folder.join("vite.config.js"), configuration()?)?;
    fs::write(folder.join("try.js"), TRY)?;
    let mut tried = shell::command("node", ["try.js"]);
    tried.arg(setup::browser_program()).arg(RANGE).current_dir(folder);
    shell::run(&mut tried).with_context(|| format!("Vite {version}"))
}

/// As the package's README says.
fn configuration() -> Result<String> {
    let readme = fs::read_to_string(shell::root().join("wasm/README.md"))?;
    let lines = readme.split("```js\n// vite.config.js\n").nth(1).and_then(|rest| rest.split("```").next());
    lines.map(str::to_owned).context("wasm/README.md has no vite.config.js")
}

/// Serves the project both ways, and looks for what the page says to the console.
const TRY: &str = r"
import { build, createServer, preview, version } from 'vite';
import { spawn } from 'node:child_process';
import { mkdtempSync } from 'node:fs';
import { resolve as absolute } from 'node:path';

const [browser, wanted] = process.argv.slice(2);
const own = { logLevel: 'warn', server: { host: '127.0.0.1' }, preview: { host: '127.0.0.1' } };

async function console_of(address) {
  // Stays where it is: the browser's helpers outlive it, and write while it would be removed.
  const profile = mkdtempSync(absolute('profile-'));
  const words = ['--headless', '--no-sandbox', '--disable-gpu', '--enable-logging=stderr', `--user-data-dir=${profile}`];
  const child = spawn(browser, [...words, '--remote-debugging-port=0', address], { stdio: ['ignore', 'ignore', 'pipe'] });
  let said = '';
  await new Promise((resolve) => {
    const patience = setTimeout(resolve, 60_000);
    child.on('exit', resolve);
    child.stderr.on('data', (bytes) => {
      said += bytes;
      if (said.includes(wanted) || /Uncaught/.test(said)) resolve(clearTimeout(patience));
    });
  });
  child.kill();
  if (!said.includes(wanted)) throw new Error(`${address} does not say ${wanted}:\n${said}`);
}

const server = await createServer(own);
await server.listen();
await console_of(`http://127.0.0.1:${server.httpServer.address().port}/`);
await server.close();
await build(own);
const built = await preview(own);
await console_of(`http://127.0.0.1:${built.httpServer.address().port}/`);
console.log(`Vite ${version}: development server and build`);
process.exit(0);
";
