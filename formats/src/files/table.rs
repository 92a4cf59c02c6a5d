use crate::{Error, Result, nearest};
use std::path::{Path, PathBuf};

/// A CSV file with a header, by column names. Spaces around cells, empty lines and lines that begin with `#` do
/// not count; other columns than the ones asked for are passed over.
#[derive(Clone, Debug)]
pub struct Table {
    path: PathBuf,
    header: Vec<String>,
    rows: Vec<Row>,
}

#[derive(Clone, Debug)]
struct Row {
    line: u64,
    cells: csv::StringRecord,
}

impl Table {
    /// The table in a file.
    ///
    /// # Errors
    /// When the file cannot be read, or a line has more or fewer cells than the header.
    pub fn read(path: &Path) -> Result<Self> {
        Self::parse(path, &super::read_text(path)?)
    }

    /// The table in `text`, which came from `path`.
    ///
    /// # Errors
    /// When a line has more or fewer cells than the header.
    pub fn parse(path: &Path, text: &str) -> Result<Self> {
        let mut reader =
            csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
        let malformed = |error: csv::Error| match error.kind() {
            csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
                let cause = format!("has {len} cells, the header has {expected_len}");
                let line = pos.as_ref().map_or(0, csv::Position::line);
                Error::new(cause)
                    .at_line(path, line)
                    .help("give every line a cell, which may be empty, for every column")
            }
            _ => Error::new(error).at(path),
        };
        let header: Vec<_> = reader.headers().map_err(malformed)?.iter().map(str::to_owned).collect();
        if header.is_empty() {
            return Err(Error::new("is empty").at(path).help("the first line names the columns"));
        }
        let rows = reader.records().map(|record| {
            let cells = record.map_err(malformed)?;
            let line = cells.position().map_or(0, csv::Position::line);
            Ok(Row { line, cells })
        });
        Ok(Self { path: path.to_owned(), rows: rows.collect::<Result<_>>()?, header })
    }

    /// Where the table came from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether there is a column of this name.
    pub fn has(&self, column: &str) -> bool {
        self.header.iter().any(|name| name == column)
    }

    /// The line in the file of every row, counted from 1.
    pub fn lines(&self) -> impl ExactSizeIterator<Item = u64> {
        self.rows.iter().map(|row| row.line)
    }

    /// The numbers of `N` columns, row by row.
    ///
    /// # Errors
    /// Without one of the columns, or when a cell is empty or is not a finite number.
    pub fn numbers<const N: usize>(&self, columns: [&str; N]) -> Result<Vec<[f64; N]>> {
        let places = self.places(columns)?;
        let row_numbers = |row: &Row| {
            let mut numbers = [0.0; N];
            for ((number, place), column) in numbers.iter_mut().zip(places).zip(columns) {
                *number = self.number(row, place, column)?.ok_or_else(|| {
                    let cause = format!("column `{column}` is empty");
                    Error::new(cause)
                        .at_line(&self.path, row.line)
                        .help("give it a number or remove the line")
                })?;
            }
            Ok(numbers)
        };
        self.rows.iter().map(row_numbers).collect()
    }

    /// The numbers of a column that may be missing or have empty cells.
    ///
    /// # Errors
    /// When a cell is not empty and is not a finite number.
    pub fn optional_numbers(&self, column: &str) -> Result<Vec<Option<f64>>> {
        match self.header.iter().position(|name| name == column) {
            Some(place) => self.rows.iter().map(|row| self.number(row, place, column)).collect(),
            None => Ok(vec![None; self.rows.len()]),
        }
    }

    /// Fails unless the column `t` grows from line to line.
    ///
    /// # Errors
    /// At the first line that is not later than the one before.
    pub fn check_order(&self, times: impl IntoIterator<Item = f64>) -> Result<()> {
        check_order(&self.path, times.into_iter().zip(self.lines()))
    }

    fn places<const N: usize>(&self, columns: [&str; N]) -> Result<[usize; N]> {
        let mut places = [0; N];
        for (place, column) in places.iter_mut().zip(columns) {
            *place = self
                .header
                .iter()
                .position(|name| name == column)
                .ok_or_else(|| self.missing(column, &columns))?;
        }
        Ok(places)
    }

    fn missing(&self, column: &str, wanted: &[&str]) -> Error {
        let header = self.header.join(",");
        let error =
            Error::new(format!("lacks the column `{column}` (its first line is `{header}`)")).at(&self.path);
        let spelt = nearest(column, self.header.iter().map(String::as_str))
            .filter(|name| strsim::jaro_winkler(name, column) > 0.8);
        match spelt {
            _ if self.header.iter().all(|name| name.parse::<f64>().is_ok()) => {
                error.help(format!("begin the file with a line that names its columns: {}", wanted.join(",")))
            }
            Some(name) => {
                error.help(format!("is `{name}` meant? The columns needed are {}", wanted.join(",")))
            }
            None => error.help(format!("the columns needed are {}", wanted.join(","))),
        }
    }

    fn number(&self, row: &Row, place: usize, column: &str) -> Result<Option<f64>> {
        let cell = row.cells.get(place).unwrap_or_default();
        if cell.is_empty() {
            return Ok(None);
        }
        match cell.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Some(number)),
            _ => Err(Error::new(format!("column `{column}` is `{cell}`, must be a finite number"))
                .at_line(&self.path, row.line)
                .help("correct the cell, or remove the line")),
        }
    }
}

/// Fails at the first (time, line) that is not later than the one before.
pub(super) fn check_order(path: &Path, times: impl IntoIterator<Item = (f64, u64)>) -> Result<()> {
    let mut last = f64::NEG_INFINITY;
    for (time, line) in times {
        if time <= last {
            let kind = if time == last { "the same as" } else { "before" };
            return Err(Error::new(format!("time {time} is {kind} the line before's, {last}"))
                .at_line(path, line)
                .help("sort the lines by time and keep one for each"));
        }
        last = time;
    }
    Ok(())
}
