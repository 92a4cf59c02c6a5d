//! Whether the house is still in order: what stands once must stand once, and nothing imports upwards.
//!
//! It reads sources as text, up to a file's `#[cfg(test)]`, and takes no comment for code.
use crate::shell;
use anyhow::{Context, Result, ensure};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The rooms of each package, from the ground up: a room imports from those before it and from itself.
const FLOORS: [(&str, &[&str]); 4] = [
    (
        "core/src",
        &[
            "real",
            "error",
            "sort",
            "vectors",
            "setting",
            "geometry",
            "image",
            "lines",
            "proposals",
            "scan",
            "features",
            "homography",
            "association",
            "slam",
            "pipeline",
            "calibration",
        ],
    ),
    (
        "core/src/slam",
        &["landmark", "covariance", "models", "ring", "filter", "consistency", "health", "map", "snapshot"],
    ),
    (
        "formats/src",
        &[
            "error",
            "files",
            "pictures",
            "board",
            "bags",
            "extraction",
            "evaluation",
            "draw",
            "sensor_log",
            "report",
        ],
    ),
    (
        "cli/src",
        &[
            "interrupt",
            "warnings",
            "outputs",
            "sequence",
            "calibration",
            "mcap_output",
            "reproduce",
            "commands",
        ],
    ),
];

/// Settings that a file outside the core may name: `slam-log` offers eight as options, whose ranges and sentences it takes from the table.
const NAMED_SETTINGS: usize = 8;

/// A word that only one folder may say; `with` in the same file, if it is not empty.
struct Alone {
    what: &'static str,
    words: &'static [&'static str],
    only_in: &'static str,
}

/// What has one place.
const ALONE: [Alone; 3] = [
    Alone {
        what: "one place takes pictures through extractor and filter",
        words: &["Extractor", "Map::new("],
        only_in: "core/src/pipeline",
    },
    Alone {
        what: "one place joins the pictures' motion with the map",
        words: &["VisualMotion", "Pipeline"],
        only_in: "core/src/pipeline",
    },
    Alone {
        what: "one place says how an unchecked filter is called",
        words: &["\"unchecked\""],
        only_in: "core/src/slam/health.rs",
    },
];

/// Every check.
pub(crate) fn check() -> Result<()> {
    let root = shell::root();
    let mut faults = Vec::new();
    for (package, rooms) in FLOORS {
        for file in sources(&root.join(package))? {
            faults.extend(upward_imports(&file, &root.join(package), rooms)?);
        }
    }
    let settings = settings(&fs::read_to_string(root.join("docs/settings.md"))?);
    let folders =
        ["core/src", "formats/src", "cli/src", "mcu/src", "protocol/src", "sim/src", "tests/src", "wasm"];
    for folder in folders {
        for file in sources(&root.join(folder))? {
            let code = code(&fs::read_to_string(&file)?);
            let here = file.strip_prefix(&root)?;
            let named =
                settings.iter().filter(|(name, key)| code.contains(name) || code.contains(key)).count();
            if named > NAMED_SETTINGS && !here.starts_with("core/src") {
                faults.push(format!("{}: a second list of settings names {named} of them", here.display()));
            }
            for Alone { what, words, only_in } in ALONE {
                if !here.starts_with(only_in) && words.iter().all(|word| code.contains(word)) {
                    faults.push(format!("{}: {what}: {only_in}", here.display()));
                }
            }
        }
    }
    ensure!(faults.is_empty(), "the house is not in order:\n{}", faults.join("\n"));
    Ok(())
}

/// The settings of the reference page as code would name them: `"section.key"` and `"key"`.
fn settings(page: &str) -> Vec<(String, String)> {
    let mut section = "";
    let mut names = Vec::new();
    for line in page.lines() {
        if let Some(name) = line.strip_prefix("## [") {
            section = name.trim_end_matches(']');
        } else if let Some((key, _)) = line.strip_prefix("| `").and_then(|row| row.split_once('`')) {
            names.push((format!("\"{section}.{key}\""), format!("\"{key}\"")));
        }
    }
    names
}

/// The Rust files of a folder.
fn sources(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let entries = fs::read_dir(folder).with_context(|| format!("no folder {}", folder.display()))?;
    for entry in entries {
        let path = entry?.path();
        if path.is_dir() && path.file_name().is_some_and(|name| name != "target" && name != "tests") {
            files.extend(sources(&path)?);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// A file's code: no comments, and nothing from its tests on.
fn code(text: &str) -> String {
    let before_tests = text.split("\n#[cfg(test)]\nmod ").next().unwrap_or_default();
    let lines = before_tests.lines().map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

fn upward_imports(file: &Path, package: &Path, rooms: &[&str]) -> Result<Vec<String>> {
    let place = file.strip_prefix(package)?;
    let Some(room) = place.iter().next().and_then(|part| Path::new(part).file_stem()?.to_str()) else {
        return Ok(Vec::new());
    };
    let floor = |name: &str| rooms.iter().position(|room| *room == name);
    let Some(own) = floor(room) else { return Ok(Vec::new()) };
    // Inside `slam` its rooms are named by their whole path.
    let prefix = if package.ends_with("slam") { "crate::slam::" } else { "crate::" };
    let code = code(&fs::read_to_string(file)?);
    let above =
        imported(&code, prefix).into_iter().filter(|name| floor(name).is_some_and(|other| other > own));
    Ok(above.map(|name| format!("{}: imports `{name}`, which stands above it", file.display())).collect())
}

/// The names right behind `prefix`, also those of a group in braces.
fn imported(code: &str, prefix: &str) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for rest in code.split(prefix).skip(1) {
        let Some(group) = rest.strip_prefix('{') else {
            names.extend(name_at(rest));
            continue;
        };
        let mut depth = 1;
        let mut item_begins = true;
        for (at, letter) in group.char_indices() {
            match letter {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 1 => item_begins = true,
                letter if item_begins && depth == 1 && !letter.is_whitespace() => {
                    names.extend(name_at(&group[at..]));
                    item_begins = false;
                }
                _ => {}
            }
            if depth == 0 {
                break;
            }
        }
    }
    names
}

fn name_at(text: &str) -> Option<String> {
    let name: String =
        text.chars().take_while(|letter| letter.is_ascii_lowercase() || *letter == '_').collect();
    (!name.is_empty()).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_behind_a_prefix_are_found_alone_and_in_groups() {
        let code =
            "use crate::{\n    Error, files::{Rig, read},\n    report,\n};\nlet a = crate::draw::mark();";
        let expected = ["draw", "files", "report"].map(str::to_owned);
        assert_eq!(imported(code, "crate::"), BTreeSet::from(expected));
    }

    #[test]
    fn comments_and_tests_are_no_code() {
        let text =
            "/// crate::pipeline\nuse crate::lines; // crate::slam\n\n#[cfg(test)]\nmod tests { crate::map }";
        assert_eq!(imported(&code(text), "crate::"), BTreeSet::from(["lines".to_owned()]));
    }

    #[test]
    fn settings_are_named_as_on_their_page() {
        let page = "## [extract]\n| key | default |\n|---|---|\n| `opening` | `5` |\n## [filter]\n| `gate` | `\"soft\"` |";
        let names = settings(page).into_iter().map(|(name, _)| name).collect::<Vec<_>>();
        assert_eq!(names, ["\"extract.opening\"", "\"filter.gate\""]);
    }

    #[test]
    fn this_house_is_in_order() {
        check().unwrap();
    }
}
