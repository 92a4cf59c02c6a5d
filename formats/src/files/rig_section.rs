//! A section of a rig file, read key by key with the line of every value.
use crate::{Error, Result, nearest};
use std::path::Path;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

/// A rig file's text while it is read.
pub(super) struct Source<'a> {
    pub(super) path: &'a Path,
    pub(super) text: &'a str,
}

impl Source<'_> {
    /// The line of a byte, counted from 1.
    pub(super) fn line(&self, byte: usize) -> u64 {
        1 + self.text.bytes().take(byte).filter(|byte| *byte == b'\n').count() as u64
    }
}

/// One table of the file; the name of the outermost one is empty.
pub(super) struct Section<'a> {
    source: &'a Source<'a>,
    name: &'static str,
    table: &'a DeTable<'a>,
    line: u64,
}

impl<'a> Section<'a> {
    /// The outermost table.
    pub(super) fn root(
        source: &'a Source<'a>,
        table: &'a DeTable<'a>,
        known: &[&'static str],
    ) -> Result<Self> {
        Self { source, name: "", table, line: 1 }.checked(known)
    }

    /// The table `name` in this one, whose keys must be among `known`.
    pub(super) fn section(&self, name: &'static str, known: &[&'static str]) -> Result<Option<Self>> {
        let Some((_, value)) = self.entry(name) else { return Ok(None) };
        let DeValue::Table(table) = value.get_ref() else {
            return Err(self.wrong(
                name,
                value,
                "a section",
                &format!("write `[{name}]` on a line of its own"),
            ));
        };
        let line = self.source.line(value.span().start);
        Self { source: self.source, name, table, line }.checked(known).map(Some)
    }

    fn checked(self, known: &[&'static str]) -> Result<Self> {
        for (key, _) in self.table {
            let given = key.get_ref().as_ref();
            if known.contains(&given) {
                continue;
            }
            let line = self.source.line(key.span().start);
            let cause = format!("`{}` is not a known key", self.full(given));
            let nearest = nearest(given, known.iter().copied()).unwrap_or_default();
            let help = format!("the nearest known key is `{}`", self.full(nearest));
            return Err(Error::new(cause).at_line(self.source.path, line).help(help));
        }
        Ok(self)
    }

    /// Whether this table has a table `name` with this key.
    pub(super) fn has_in(&self, name: &str, key: &str) -> bool {
        let Some((_, value)) = self.entry(name) else { return false };
        matches!(value.get_ref(), DeValue::Table(table) if table.keys().any(|known| known.get_ref() == key))
    }

    /// The table's name.
    pub(super) fn name(&self) -> &'static str {
        self.name
    }

    /// A number, or `None` without the key.
    pub(super) fn number(&self, key: &'static str) -> Result<Option<f64>> {
        let Some((_, value)) = self.entry(key) else { return Ok(None) };
        match finite(value) {
            Some(number) => Ok(Some(number)),
            None => Err(self.wrong(key, value, "a finite number", "write a number")),
        }
    }

    /// A number that must be there.
    pub(super) fn required_number(&self, key: &'static str, help: &str) -> Result<f64> {
        self.number(key)?.ok_or_else(|| self.missing(key, help))
    }

    /// As many numbers as `lengths` allows, or `None` without the key.
    pub(super) fn numbers(&self, key: &'static str, lengths: &[usize]) -> Result<Option<Vec<f64>>> {
        let Some((_, value)) = self.entry(key) else { return Ok(None) };
        let numbers: Option<Vec<f64>> = match value.get_ref() {
            DeValue::Array(array) => array.iter().map(finite).collect(),
            _ => None,
        };
        let count = lengths.iter().map(usize::to_string).collect::<Vec<_>>().join(" or ");
        match numbers {
            Some(numbers) if lengths.contains(&numbers.len()) => Ok(Some(numbers)),
            _ => Err(self.wrong(key, value, &format!("{count} finite numbers"), "write them as [1.0, 2.0]")),
        }
    }

    /// Two numbers, or `None` without the key.
    pub(super) fn pair(&self, key: &'static str) -> Result<Option<[f64; 2]>> {
        Ok(self.numbers(key, &[2])?.and_then(|numbers| numbers.try_into().ok()))
    }

    /// A string, or `None` without the key.
    pub(super) fn string(&self, key: &'static str) -> Result<Option<&'a str>> {
        let Some((_, value)) = self.entry(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::String(text) => Ok(Some(text.as_ref())),
            _ => Err(self.wrong(key, value, "a string", "put it in double quotes")),
        }
    }

    /// `true` or `false`, or `None` without the key.
    pub(super) fn switch(&self, key: &'static str) -> Result<Option<bool>> {
        let Some((_, value)) = self.entry(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::Boolean(on) => Ok(Some(*on)),
            _ => Err(self.wrong(key, value, "true or false", "write it without quotes")),
        }
    }

    /// Whether the key is there.
    pub(super) fn has(&self, key: &str) -> bool {
        self.entry(key).is_some()
    }

    /// The error that `key` has a value out of its range.
    pub(super) fn out_of_range(&self, key: &str, value: f64, expected: &str) -> Error {
        self.error(key, format!("`{}` is {value}, must be {expected}", self.full(key)))
    }

    /// The error that `key` is missing.
    pub(super) fn missing(&self, key: &str, help: &str) -> Error {
        let cause = format!("`{}` is missing", self.full(key));
        Error::new(cause).at_line(self.source.path, self.line).help(help)
    }

    /// An error at the line of `key`.
    pub(super) fn error(&self, key: &str, cause: String) -> Error {
        Error::new(cause).at_line(self.source.path, self.line_of(key))
    }

    /// The line of `key`, or of the section without it.
    pub(super) fn line_of(&self, key: &str) -> u64 {
        self.entry(key).map_or(self.line, |(key, _)| self.source.line(key.span().start))
    }

    fn wrong(&self, key: &str, value: &Spanned<DeValue<'_>>, expected: &str, help: &str) -> Error {
        let given = self.source.text.get(value.span()).unwrap_or_default();
        self.error(key, format!("`{}` is `{given}`, must be {expected}", self.full(key))).help(help)
    }

    fn entry(&self, key: &str) -> Option<(&'a Spanned<std::borrow::Cow<'a, str>>, &'a Spanned<DeValue<'a>>)> {
        self.table.iter().find(|(name, _)| name.get_ref() == key)
    }

    fn full(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) }
    }
}

fn finite(value: &Spanned<DeValue<'_>>) -> Option<f64> {
    let number: f64 = match value.get_ref() {
        DeValue::Float(float) => float.as_str().parse().ok()?,
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok()? as f64,
        _ => return None,
    };
    number.is_finite().then_some(number)
}
