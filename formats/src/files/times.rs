use crate::{Error, Result};
use std::path::Path;

/// The times of a sequence's frames in seconds: one number a line, growing; `#` begins a comment.
///
/// # Errors
/// When the file cannot be read, a line is not a finite number, or a time is not later than the one before.
pub fn read_times(path: &Path) -> Result<Vec<f64>> {
    let text = super::read_text(path)?;
    let mut times = Vec::new();
    for (line, number) in (1_u64..).zip(text.lines()) {
        let cell = number.split('#').next().unwrap_or_default().trim();
        if cell.is_empty() {
            continue;
        }
        match cell.parse::<f64>() {
            Ok(time) if time.is_finite() => times.push((time, line)),
            _ => {
                return Err(Error::new(format!("`{cell}` is not a finite number"))
                    .at_line(path, line)
                    .help("write one time in seconds a line"));
            }
        }
    }
    super::table::check_order(path, times.iter().copied())?;
    Ok(times.into_iter().map(|(time, _)| time).collect())
}
