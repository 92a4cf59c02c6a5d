//! The paper's tables and figures, with this project's improvements beside them.
//!
//! | module | of the paper | what it shows |
//! |---|---|---|
//! | [`table2`] | Table 2 | ranges and bearings as published, and with the mount fitted; a simulated replica |
//! | [`corridor`] | Figures 6 and 7 | map and pose errors in a corridor with people, by three methods |
//! | [`failover`] | introduction: a laser that fails | the camera takes over half-way |
//! | [`bearing_only`] | introduction and conclusion | landmarks started with and without the floor's range |
//! | [`archetype`] | conclusion: an error archetype | which distribution the range error has |
//!
//! Each gives a [`Section`]: tables of figures and drawings, which become one page, CSV files and text.
pub mod archetype;
pub mod bearing_only;
pub mod corridor;
pub mod failover;
mod method;
mod page;
pub mod table2;

pub use page::page;

use std::fmt;

/// One experiment's outcome.
#[derive(Clone, Debug, Default)]
pub struct Section {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it is.
    pub title: &'static str,
    /// What it shows, a paragraph each.
    pub words: Vec<String>,
    /// Its tables.
    pub tables: Vec<Figures>,
    /// Its drawings: caption, SVG or a picture.
    pub drawings: Vec<(String, String)>,
}

/// A table of figures.
#[derive(Clone, Debug, Default)]
pub struct Figures {
    /// What its rows are.
    pub caption: String,
    /// Names of its columns, with units.
    pub header: Vec<String>,
    /// Its cells.
    pub rows: Vec<Vec<String>>,
}

impl Figures {
    /// An empty table.
    pub fn new(caption: impl Into<String>, header: &[&str]) -> Self {
        let header = header.iter().map(|name| (*name).to_owned()).collect();
        Self { caption: caption.into(), header, rows: Vec::new() }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = impl Into<String>>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    /// The table as CSV.
    pub fn csv(&self) -> String {
        let quoted = |cell: &String| match cell.contains([',', '"']) {
            true => format!("\"{}\"", cell.replace('"', "\"\"")),
            false => cell.clone(),
        };
        let line = |cells: &Vec<String>| cells.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n";
        std::iter::once(&self.header).chain(&self.rows).map(line).collect()
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lines = || std::iter::once(&self.header).chain(&self.rows);
        let width = |column: usize| {
            lines().filter_map(|cells| cells.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        writeln!(out, "{}", self.caption)?;
        for cells in lines() {
            for (column, cell) in cells.iter().enumerate() {
                let pad = " ".repeat(width(column) - cell.chars().count());
                match column {
                    0 => write!(out, "  {cell}{pad}")?,
                    _ => write!(out, "  {pad}{cell}")?,
                }
            }
            writeln!(out)?;
        }
        Ok(())
    }
}

impl fmt::Display for Section {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "{}\n{}", self.title, "=".repeat(self.title.chars().count()))?;
        for table in &self.tables {
            writeln!(out, "{table}")?;
        }
        Ok(())
    }
}
