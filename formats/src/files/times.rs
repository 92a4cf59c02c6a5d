use crate::{Error, Result, plausibility};
use std::path::Path;

/// The times of a sequence's frames in seconds: one number a line, growing; `#` begins a comment.
///
/// # Errors
/// When the file cannot be read, a line is not a finite number, a time is not later than the one before, or they are no
/// seconds.
pub fn read_times(path: &Path) -> Result<Vec<f64>> {
    Ok(read_frame_list(path)?.into_iter().map(|(time, _)| time).collect())
}

/// The frames of a list in seconds, with the pictures' names where it gives them behind the times, separated by a comma
/// or by blanks: `data.csv` of EuRoC, `rgb.txt` of TUM RGB-D.
///
/// # Errors
/// As [`read_times`].
pub fn read_frame_list(path: &Path) -> Result<Vec<(f64, Option<String>)>> {
    let text = super::read_text(path)?;
    let (mut times, mut names) = (Vec::new(), Vec::new());
    for (line, content) in (1_u64..).zip(text.lines()) {
        let content = content.split('#').next().unwrap_or_default().trim();
        if content.is_empty() {
            continue;
        }
        let (cell, name) = match content.split_once(|c: char| c == ',' || c == ';' || c.is_whitespace()) {
            Some((cell, name)) => (cell.trim(), Some(name.trim()).filter(|name| !name.is_empty())),
            None => (content, None),
        };
        let time =
            seconds_of_date(content).or_else(|| cell.parse::<f64>().ok()).filter(|time| time.is_finite());
        let Some(time) = time else {
            if times.is_empty() && content.chars().all(|c| !c.is_ascii_digit()) {
                continue; // a header
            }
            return Err(Error::new(format!("`{cell}` is not a finite number")).at_line(path, line).help(
                match super::table::is_decimal_comma(content) {
                    true => "a decimal comma is not read, only a decimal point: write 0.5, not 0,5",
                    false => "write one time in seconds a line",
                },
            ));
        };
        if let Some(name) = name.filter(|_| super::table::is_decimal_comma(content)) {
            let cause = format!("`{cell},{name}` has a decimal comma");
            return Err(Error::new(cause)
                .at_line(path, line)
                .help("write one time in seconds a line, with a decimal point"));
        }
        times.push((time, line));
        names.push(name.filter(|_| seconds_of_date(content).is_none()).map(str::to_owned));
    }
    check_not_numbered(path, &times, &names)?;
    let unit = plausibility::seconds_of_clock(path, times.iter().map(|(time, _)| *time));
    for (time, _) in &mut times {
        *time /= unit;
    }
    super::table::check_order(path, times.iter().copied())?;
    let seconds: Vec<_> = times.iter().map(|(time, _)| *time).collect();
    plausibility::check_steps(path, &seconds)?;
    Ok(seconds.into_iter().zip(names).collect())
}

/// Fails when lines hold the frames' numbers before what looks like their times.
fn check_not_numbered(path: &Path, times: &[(f64, u64)], names: &[Option<String>]) -> Result<()> {
    let numbers: Option<Vec<f64>> =
        names.iter().map(|name| name.as_ref().and_then(|name| name.parse().ok())).collect();
    let counts = |first: f64| (0_u32..).zip(times).all(|(row, (time, _))| *time == first + f64::from(row));
    match (numbers, times) {
        (Some(seconds), [(_, line), _, ..]) if counts(0.0) || counts(1.0) => {
            let cause = format!("holds the frame's number and {:?}: two numbers a line", seconds[0]);
            let help = "write one time in seconds a line, without the number before it";
            Err(Error::new(cause).at_line(path, *line).help(help))
        }
        _ => Ok(()),
    }
}

/// Seconds since 1970 of a date as KITTI's raw recordings have it, `2011-09-26 13:02:25.964389445`.
fn seconds_of_date(text: &str) -> Option<f64> {
    let (date, time) = text.split_once([' ', 'T'])?;
    let mut date = date.splitn(3, '-').map(str::parse::<i64>);
    let (year, month, day) = (date.next()?.ok()?, date.next()?.ok()?, date.next()?.ok()?);
    let mut time = time.trim_end_matches('Z').splitn(3, ':').map(str::parse::<f64>);
    let (hours, minutes, seconds) = (time.next()?.ok()?, time.next()?.ok()?, time.next()?.ok()?);
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) || !(1900..=9999).contains(&year) {
        return None;
    }
    // Days since 1 March of year 0: a year begins in March, so that the odd day is its last.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day - 1;
    Some((days - 719_468) as f64 * 86_400.0 + hours * 3600.0 + minutes * 60.0 + seconds)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::memory;

    fn read(text: &str) -> Result<Vec<(f64, Option<String>)>> {
        memory::offer("times.txt", text.as_bytes().to_vec());
        read_frame_list(Path::new("times.txt"))
    }

    #[test]
    fn lists_of_known_datasets_are_read() {
        let list = read("#timestamp [ns],filename\n1403636579763555584,1403636579763555584.png\n").unwrap();
        assert_eq!(list[0].1.as_deref(), Some("1403636579763555584.png"));
        assert!((list[0].0 - 1_403_636_579.763_555_5).abs() < 1e-6);
        assert_eq!(
            read("# t file\n1305031102.1 rgb/a.png\n").unwrap()[0],
            (1_305_031_102.1, Some("rgb/a.png".into()))
        );
        assert_eq!(read("0.0\r\n1.03e-01\r\n").unwrap()[1].0, 0.103);
        let dates = read("2011-09-26 13:02:25.5\n2011-09-26 13:02:26.5\n").unwrap();
        assert_eq!((dates[0].0, &dates[0].1), (1_317_042_145.5, &None));
        for (text, word) in [
            ("0\n0,5\n", "decimal comma"),
            ("0\nx\n", "line 2"),
            ("0\n6e8\n12e8\n", "nanoseconds"),
            ("0 0.0\n1 0.6\n", "frame's number"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
        crate::warnings::forget();
    }
}
