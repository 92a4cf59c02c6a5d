use crate::{Error, Result, nearest};
use std::path::{Path, PathBuf};

/// A CSV file with a header, by column names. Cells are separated by commas, semicolons or tabs, as the header has
/// them. Blanks around cells, empty lines and lines that begin with `#` do not count, nor does the case of a column's
/// name or a unit in brackets behind it; other columns than the ones asked for are passed over.
#[derive(Clone, Debug)]
pub struct Table {
    path: PathBuf,
    /// As the file has it.
    first_line: String,
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
        let Some((header_line, first_line)) = content_lines(text).next() else {
            return Err(Error::new("is empty").at(path).help("the first line names the columns"));
        };
        let delimiter = [b'\t', b';'].into_iter().find(|mark| first_line.as_bytes().contains(mark));
        let delimiter = delimiter.unwrap_or(b',');
        let mut records = records(path, text, delimiter)?.into_iter().peekable();
        let mut names = records.next_if(|row| row.line == header_line).map_or(Vec::new(), |row| row.names());
        let mut rows: Vec<Row> = Vec::new();
        if names.iter().all(|name| is_number(name)) {
            // A header may stand behind `#`.
            let commented = text.lines().take((header_line - 1) as usize).last().unwrap_or_default();
            let commented = commented.trim_start_matches(['#', '%', ' ']).as_bytes();
            let above = self::records(path, std::str::from_utf8(commented).unwrap_or_default(), delimiter)?;
            let above = above.into_iter().next().map_or(Vec::new(), |row| row.names());
            if above.len() == names.len() && !above.iter().any(|name| is_number(name)) {
                let cells = names.iter().map(String::as_str).collect();
                rows.push(Row { line: header_line, cells });
                names = above;
            }
        }
        let header: Vec<_> = names.iter().map(|name| plain(name)).collect();
        for row in records {
            rows.push(row.fitted(path, header.len(), delimiter)?);
        }
        let twice =
            header.iter().enumerate().find(|(place, name)| header.iter().take(*place).any(|n| n == *name));
        if let Some((_, name)) = twice.filter(|(_, name)| !name.is_empty() && !is_number(name)) {
            return Err(Error::new(format!("has two columns `{name}`"))
                .at_line(path, header_line)
                .help("keep one of them, or give the other one another name"));
        }
        Ok(Self { path: path.to_owned(), first_line: first_line.to_owned(), header, rows })
    }

    /// Where the table came from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether there is a column of this name.
    pub fn has(&self, column: &str) -> bool {
        self.place(column).is_some()
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
        match self.place(column) {
            Some(place) => self.rows.iter().map(|row| self.number(row, place, column)).collect(),
            None => Ok(vec![None; self.rows.len()]),
        }
    }

    /// The names of landmarks in a column that may be missing or have empty cells.
    ///
    /// # Errors
    /// When a cell is not empty and is not a whole number from 0 to 4294967294.
    pub fn optional_names(&self, column: &str) -> Result<Vec<Option<u32>>> {
        let numbers = self.optional_numbers(column)?;
        let name = |(number, line): (Option<f64>, u64)| match number {
            None => Ok(None),
            Some(number) => crate::plausibility::landmark_name(number)
                .map(Some)
                .map_err(|error| error.in_entry(&format!("column `{column}`")).at_line(&self.path, line)),
        };
        numbers.into_iter().zip(self.lines()).map(name).collect()
    }

    /// Fails unless the column `t` grows from line to line.
    ///
    /// # Errors
    /// At the first line that is not later than the one before.
    pub fn check_order(&self, times: impl IntoIterator<Item = f64>) -> Result<()> {
        check_order(&self.path, times.into_iter().zip(self.lines()))
    }

    /// The columns of other names than these, each with its name and its cells as they are.
    pub fn others<'a>(&'a self, names: &[&str]) -> Vec<(&'a str, Vec<&'a str>)> {
        let others = self.header.iter().enumerate().filter(|(_, name)| !names.contains(&name.as_str()));
        let cells =
            |place: usize| self.rows.iter().map(|row| row.cells.get(place).unwrap_or_default()).collect();
        others.map(|(place, name)| (name.as_str(), cells(place))).collect()
    }

    /// The line in the file of one row.
    pub(crate) fn line_of(&self, row: usize) -> u64 {
        self.rows.get(row).map_or(0, |row| row.line)
    }

    fn place(&self, column: &str) -> Option<usize> {
        let find = |wanted: &str| self.header.iter().position(|name| name == wanted);
        let other = || if column == "heading" { find("yaw").or_else(|| find("theta")) } else { None };
        find(column).or_else(other)
    }

    fn places<const N: usize>(&self, columns: [&str; N]) -> Result<[usize; N]> {
        let mut places = [0; N];
        for (place, column) in places.iter_mut().zip(columns) {
            *place = self.place(column).ok_or_else(|| self.missing(column, &columns))?;
        }
        Ok(places)
    }

    fn missing(&self, column: &str, wanted: &[&str]) -> Error {
        let header = &self.first_line;
        let error =
            Error::new(format!("lacks the column `{column}` (its first line is `{header}`)")).at(&self.path);
        let others = self.header.iter().map(String::as_str).filter(|name| !wanted.contains(name));
        let spelt = nearest(column, others).filter(|name| strsim::jaro_winkler(name, column) > 0.8);
        let wanted = wanted.join(",");
        match spelt {
            _ if self.header.iter().all(|name| is_number(name)) => {
                error.help(format!("begin the file with a line that names its columns: {wanted}"))
            }
            _ if self.header.len() == 1 && header.split_whitespace().count() > 1 => error
                .help(format!("separate the columns by commas, semicolons or tabs, not by blanks: {wanted}")),
            Some(name) => error.help(format!("is `{name}` meant? The columns needed are {wanted}")),
            None => error.help(format!("the columns needed are {wanted}")),
        }
    }

    fn number(&self, row: &Row, place: usize, column: &str) -> Result<Option<f64>> {
        let cell = row.cells.get(place).unwrap_or_default();
        let cell = cell.trim_matches(['"', '\'', ' ']);
        if cell.is_empty() {
            return Ok(None);
        }
        match cell.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Some(number)),
            _ => {
                let error = Error::new(format!("column `{column}` is `{cell}`, must be a finite number"))
                    .at_line(&self.path, row.line);
                Err(error.help(match is_decimal_comma(cell) {
                    true => "a decimal comma is not read, only a decimal point: write 0.5, not 0,5 (a spreadsheet saves so with English numbers)",
                    false if cell.eq_ignore_ascii_case("nan") => "leave the cell empty, correct it, or remove the line",
                    false => "correct the cell, or remove the line",
                }))
            }
        }
    }
}

impl Row {
    fn names(&self) -> Vec<String> {
        self.cells.iter().map(|cell| cell.trim_matches(['"', ' ']).to_owned()).collect()
    }

    /// The row with as many cells as the header; empty ones at the end do not count.
    fn fitted(mut self, path: &Path, columns: usize, delimiter: u8) -> Result<Self> {
        let superfluous = self.cells.iter().skip(columns).all(str::is_empty);
        if self.cells.len() > columns && superfluous {
            self.cells.truncate(columns);
        }
        if self.cells.len() == columns {
            return Ok(self);
        }
        let error = Error::new(format!("has {} cells, the header has {columns}", self.cells.len()))
            .at_line(path, self.line);
        let digits = |cell: &str| !cell.is_empty() && cell.bytes().all(|byte| byte.is_ascii_digit());
        let commas = delimiter == b',' && self.cells.len() > columns && self.cells.iter().skip(1).any(digits);
        Err(error.help(match commas {
            true => {
                "give every line a cell for every column; a number has a decimal point, not a decimal comma"
            }
            false => "give every line a cell, which may be empty, for every column",
        }))
    }
}

/// The lines that are neither empty nor comments, with their numbers.
fn content_lines(text: &str) -> impl Iterator<Item = (u64, &str)> {
    (1_u64..)
        .zip(text.lines())
        .map(|(number, line)| (number, line.trim()))
        .filter(|(_, line)| is_content(line))
}

fn is_content(line: &str) -> bool {
    let line = line.trim();
    !line.is_empty() && !line.starts_with('#')
}

/// The rows with the lines that a person counts: neither `\r\n` nor a comment or an empty line before a row shifts it.
fn records(path: &Path, text: &str, delimiter: u8) -> Result<Vec<Row>> {
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .has_headers(false)
        .flexible(true)
        .delimiter(delimiter)
        .from_reader(text.as_bytes());
    let (mut counted, mut line) = (0, 1);
    let mut rows = Vec::new();
    for record in reader.records() {
        let cells = record.map_err(|error| Error::new(error).at(path))?;
        let mut start = cells.position().map_or(0, csv::Position::byte) as usize;
        // The position may lie before what stands in front of the row.
        while let Some(rest) = text.get(start..) {
            let skip = rest.find('\n').map_or(rest.len(), |end| end + 1);
            if skip == 0 || is_content(rest.get(..skip).unwrap_or_default()) {
                break;
            }
            start += skip;
        }
        let passed = text.as_bytes().get(counted..start).unwrap_or_default();
        line += passed.iter().filter(|byte| **byte == b'\n').count() as u64;
        counted = counted.max(start);
        let comment = cells.get(0).is_some_and(|cell| cell.starts_with('#')) && !rows.is_empty();
        if !comment && cells.iter().any(|cell| !cell.is_empty()) {
            rows.push(Row { line, cells });
        }
    }
    Ok(rows)
}

/// A column's name as it is looked for: in small letters, without a unit in brackets, under our name for it.
fn plain(name: &str) -> String {
    let name = name.split(['[', '(']).next().unwrap_or_default();
    let name = name.trim_matches([' ', '#', '"']).to_lowercase();
    let ours = match name.as_str() {
        "time" | "timestamp" | "stamp" => "t",
        "p_rs_r_x" => "x",
        "p_rs_r_y" => "y",
        "p_rs_r_z" => "z",
        "q_rs_w" => "qw",
        "q_rs_x" => "qx",
        "q_rs_y" => "qy",
        "q_rs_z" => "qz",
        other => other,
    };
    ours.to_owned()
}

fn is_number(text: &str) -> bool {
    text.parse::<f64>().is_ok()
}

/// Whether a text is a number but for a comma in place of its point.
pub(super) fn is_decimal_comma(cell: &str) -> bool {
    cell.matches(',').count() == 1 && is_number(&cell.replacen(',', ".", 1))
}

/// Whether a text is a number, be it with a decimal comma.
pub(super) fn is_decimal_comma_or_number(cell: &str) -> bool {
    is_number(cell) || is_decimal_comma(cell)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Table> {
        Table::parse(Path::new("t.csv"), text)
    }

    #[test]
    fn lines_are_counted_as_an_editor_does() {
        for end in ["\n", "\r\n"] {
            let text = ["# a", "", "u,v", "1,2", "", "# b", "   ", "3,4", "5,x", ""].join(end);
            let table = parse(&text).unwrap();
            assert_eq!(table.lines().collect::<Vec<_>>(), [4, 8, 9], "{text:?}");
            let error = table.numbers(["u", "v"]).unwrap_err().to_string();
            assert!(error.starts_with("t.csv, line 9: column `v` is `x`"), "{error}");
        }
    }

    #[test]
    fn headers_are_read_as_people_write_them() {
        for text in [
            "T,X\n0,1\n",
            "t;x\n0;1\n",
            "t\tx\n0\t1\n",
            "\"t\", \"x\"\n0, \"1\" \n",
            "# t,x\n0,1\n",
            "#timestamp [s],x [m]\n0,1\n",
            "t,x,\n0,1,\n",
        ] {
            assert_eq!(parse(text).unwrap().numbers(["t", "x"]).unwrap(), [[0.0, 1.0]], "{text:?}");
        }
    }

    #[test]
    fn a_decimal_comma_is_named() {
        for text in ["t;x\n0,5;1\n", "t,x\n0,5,1\n", "t\tx\n0\t1,5\n"] {
            let error =
                parse(text).and_then(|table| table.numbers(["t", "x"]).map(drop)).unwrap_err().to_string();
            assert!(error.contains("line 2") && error.contains("decimal comma"), "{error}");
        }
        assert!(parse("t,T\n0,1\n").unwrap_err().to_string().contains("two columns `t`"));
    }
}
