//! The settings of a rig file's sections, read and written by the core's own table.
use super::rig_section::Section;
use crate::{Error, Result, nearest};
use monorange_core::pipeline::{self, Config};
use monorange_core::setting::{Reference, Setting, Value};

/// The sections that hold settings, in the table's order.
pub(super) fn sections() -> Vec<&'static str> {
    let mut sections: Vec<_> = pipeline::settings().map(|(setting, _)| setting.section()).collect();
    sections.dedup();
    sections
}

/// A setting's value as one would say it.
pub fn in_words(value: Value) -> String {
    match value {
        Value::Number(number) => number.to_string(),
        Value::Pair(numbers) => format!("{numbers:?}"),
        Value::Whole(number) => number.to_string(),
        Value::Choice(place, words) => words.get(usize::from(place)).unwrap_or(&"").to_string(),
        Value::Switch(on) => on.to_string(),
    }
}

/// A setting's value as a rig file has it.
pub fn in_toml(value: Value) -> String {
    match value {
        Value::Number(number) => format!("{number:?}"),
        Value::Choice(..) => format!("\"{}\"", in_words(value)),
        _ => in_words(value),
    }
}

/// The settings that differ from their defaults, as sections of a rig file.
pub fn changed_settings(config: &Config) -> String {
    let defaults = Config::new(config.finder);
    let (mut toml, mut section) = (String::new(), "");
    for (setting, _) in pipeline::settings() {
        let value = config.get(setting);
        if value == defaults.get(setting) {
            continue;
        }
        if section != setting.section() {
            section = setting.section();
            toml += &format!("\n[{section}]\n");
        }
        toml += &format!("{} = {}\n", setting.key(), in_toml(value));
    }
    toml
}

/// A page that lists every setting with its default and where that comes from, in Markdown.
pub fn settings_page(defaults: &Config) -> String {
    let mut page = String::from(
        "# Settings\n\nEvery setting of a rig file, by its section. A key that is left out has its default; what is outside its range is refused \
         with the line of the file. `monorange settings` prints this page, `monorange settings --json` the same as data.\n\n\
         Each default says where it comes from. *Judgement* and *not recorded* mean that no measurement stands behind it.\n",
    );
    let mut section = "";
    for (setting, reference) in pipeline::settings() {
        if section != setting.section() {
            section = setting.section();
            page += &format!(
                "\n## [{section}]\n\n| key | default | range | what it is | where the default comes from |\n|---|---|---|---|---|\n"
            );
        }
        let default = defaults.get(setting);
        let range = match default {
            Value::Choice(_, words) => words.join(", "),
            Value::Switch(_) => "true or false".to_owned(),
            _ => setting.expected.to_owned(),
        };
        let (key, default) = (setting.key(), in_toml(default));
        page += &format!("| `{key}` | `{default}` | {range} | {} | {} |\n", reference.help, reference.origin);
    }
    page
}

/// The settings of a rig file over their defaults.
///
/// # Errors
/// Names the line of an unknown key (with the nearest known one), and of a value that cannot be used.
pub(super) fn read(root: &Section<'_>, defaults: Config) -> Result<Config> {
    let mut config = defaults;
    let mut found = Vec::new();
    for name in sections() {
        let known: Vec<_> = pipeline::settings()
            .filter(|(setting, _)| setting.section() == name)
            .map(|(s, _)| s.key())
            .collect();
        let Some(section) = root.section(name, &known)? else { continue };
        for (setting, reference) in pipeline::settings().filter(|(setting, _)| setting.section() == name) {
            if section.has(setting.key()) {
                let value = value(&section, setting, reference, config.get(setting))?;
                config.set(setting, value).map_err(|error| refused(&section, error))?;
            }
        }
        found.push(section);
    }
    // What is left are settings that do not go together, and those of the mount.
    if let Err(error) = config.validated() {
        let named = names(error).and_then(|(of, _)| found.iter().find(|section| section.name() == of));
        return Err(
            named.map_or_else(|| root.error("", error.to_string()), |section| refused(section, error))
        );
    }
    Ok(config)
}

/// The value that a section gives to a setting, of the kind of its value so far.
fn value(section: &Section<'_>, setting: &Setting, reference: &Reference, before: Value) -> Result<Value> {
    let key = setting.key();
    Ok(match before {
        Value::Number(_) => Value::Number(section.number(key)?.unwrap_or_default() as f32),
        Value::Pair(_) => Value::Pair(section.pair(key)?.unwrap_or_default().map(|number| number as f32)),
        Value::Whole(_) => {
            let number = section.number(key)?.unwrap_or_default();
            if !(number >= 0.0 && number.fract() == 0.0 && number <= f64::from(u32::MAX)) {
                let expected = format!("a whole number, {}", setting.expected);
                return Err(section.out_of_range(key, number, &expected).help(reference.help));
            }
            Value::Whole(number as u32)
        }
        Value::Choice(_, words) => {
            let word = section.string(key)?.unwrap_or_default();
            let Some(place) = words.iter().position(|known| *known == word) else {
                let cause = format!("`{}` is \"{word}\", must be one of {}", setting.name, words.join(", "));
                let closest = nearest(word, words.iter().copied()).unwrap_or_default();
                return Err(section.error(key, cause).help(format!("the nearest one is \"{closest}\"")));
            };
            Value::Choice(place as u8, words)
        }
        Value::Switch(_) => Value::Switch(section.switch(key)?.unwrap_or_default()),
    })
}

/// Section and key that an error of the core names.
fn names(error: monorange_core::Error) -> Option<(&'static str, &'static str)> {
    match error {
        monorange_core::Error::OutOfRange { name, .. } => name.split_once('.'),
        _ => None,
    }
}

/// The core's refusal with the line of the key that it names.
fn refused(section: &Section<'_>, error: monorange_core::Error) -> Error {
    match (error, names(error)) {
        (monorange_core::Error::OutOfRange { value, expected, .. }, Some((_, key))) => {
            let help = pipeline::settings().find(|(setting, _)| setting.key() == key);
            // As it is written, where it is a number.
            let value = section.number(key).ok().flatten().unwrap_or(value);
            section.out_of_range(key, value, expected).help(help.map_or("", |(_, reference)| reference.help))
        }
        _ => section.error("", error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorange_core::geometry::{Camera, Mount, RangeFinder};

    /// After a wanted change: `MONORANGE_BLESS=1 cargo test -p monorange-formats page_of_settings`.
    #[test]
    fn the_page_of_settings_is_the_table() {
        let camera = Camera::new(320, 240, [365.0; 2], [160.0, 120.0], 0.0, Default::default()).unwrap();
        let mount = Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap();
        let page = settings_page(&Config::new(RangeFinder::new(camera, mount)));
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/settings.md");
        if std::env::var_os("MONORANGE_BLESS").is_some() {
            std::fs::write(path, &page).unwrap();
        }
        assert!(
            std::fs::read_to_string(path).unwrap() == page,
            "docs/settings.md is not what the table says"
        );
    }
}
