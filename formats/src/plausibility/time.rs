use super::median;
use crate::{Error, Result};
use std::path::Path;

/// The clock of a file in seconds: as it is, or divided by what makes it a date.
///
/// Seconds since 1970 are 0.9·10⁹ to 2.5·10⁹ from 1998 to 2049. Numbers a thousand, a million or a milliard times as
/// large are the same years in milli-, micro- or nanoseconds, and as seconds would be ages: they are converted, with a
/// warning. Times that begin at 0 tell no unit; [`check_steps`] looks at them.
pub fn seconds_of_clock(path: &Path, times: impl IntoIterator<Item = f64>) -> f64 {
    let mut unit = None;
    for time in times {
        let of = [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")];
        let this = of.into_iter().find(|(factor, _)| (0.9e9..2.5e9).contains(&(time / factor)));
        if this.is_none() || unit.is_some_and(|unit| Some(unit) != this) {
            return 1.0;
        }
        unit = this;
    }
    let Some((factor, name)) = unit else { return 1.0 };
    Error::new(format!("its times are {name} since 1970")).at(path).help("they are read as seconds").warn();
    factor
}

/// Looks at the steps of a growing clock in seconds.
///
/// # Errors
/// When half of the steps are longer than half an hour: nothing that drives is asked so rarely, but milliseconds or
/// nanoseconds that are taken for seconds are. When one is longer than thirty years.
pub fn check_steps(path: &Path, times: &[f64]) -> Result<()> {
    let steps = times.windows(2).filter_map(|pair| <[f64; 2]>::try_from(pair).ok()).map(|[a, b]| b - a);
    if let Some(long) = steps.clone().find(|step| *step > 1e9) {
        let cause = format!("its times go on by {} s from one line to the next", rounded(long));
        return Err(Error::new(cause).at(path).help("times are seconds: correct that line"));
    }
    let Some(step) = median(steps).filter(|_| times.len() > 2) else { return Ok(()) };
    let unit = match step {
        step if step > 1e6 => "nanoseconds or microseconds",
        step if step > 10.0 => "milliseconds",
        step if step > 0.0 && step < 1e-5 => "hours or days",
        _ => return Ok(()),
    };
    let cause = format!("the median step of its times is {} s: they look like {unit}", rounded(step));
    let error = Error::new(cause).at(path).help("times are seconds: divide or multiply them");
    if step > 1800.0 {
        return Err(error);
    }
    error.warn();
    Ok(())
}

/// The steps that are much longer than the others, as places of their beginnings: ten times the median and a second.
pub fn gaps(times: &[f64]) -> (f64, Vec<usize>) {
    let steps: Vec<_> =
        times.windows(2).filter_map(|pair| <[f64; 2]>::try_from(pair).ok()).map(|[a, b]| b - a).collect();
    let step = median(steps.iter().copied()).unwrap_or_default();
    let long = steps.iter().enumerate().filter(|(_, this)| **this > 10.0 * step && **this > 1.0);
    (step, long.map(|(place, _)| place).collect())
}

fn rounded(step: f64) -> String {
    if !(1e-3..1e4).contains(&step) { format!("{step:.1e}") } else { format!("{step:.3}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_drive_takes_thirty_years() {
        let refused = check_steps(Path::new("t"), &[0.0, 0.5, 1.0, 1e308]).expect_err("1e308 s").to_string();
        assert!(refused.contains("go on by 1.0e308 s") && refused.contains("correct that line"), "{refused}");
        assert!(check_steps(Path::new("t"), &[0.0, 6e8]).is_ok());
    }

    #[test]
    fn only_dates_are_converted() {
        let path = Path::new("t");
        let factor = |times: &[f64]| seconds_of_clock(path, times.iter().copied());
        assert_eq!(factor(&[1_403_636_579_763_555_584.0, 1_403_636_580_363_555_584.0]), 1e9);
        assert_eq!(factor(&[1_403_636_579_763.0]), 1e3);
        assert_eq!(factor(&[1_403_636_579.76, 1_403_636_580.36]), 1.0);
        assert_eq!(factor(&[0.0, 6e8]), 1.0);
        crate::warnings::forget();
    }

    #[test]
    fn a_step_of_ages_is_refused_and_a_long_one_said() {
        let path = Path::new("t");
        assert!(check_steps(path, &[0.0, 6e8, 1.2e9]).unwrap_err().to_string().contains("nanoseconds"));
        check_steps(path, &[0.0, 0.1, 0.2]).unwrap();
        assert!(crate::warnings::fresh().is_empty());
        check_steps(path, &[0.0, 600.0, 1200.0]).unwrap();
        assert!(crate::warnings::fresh()[0].contains("milliseconds"));
        assert_eq!(gaps(&[0.0, 0.1, 0.2, 60.2, 60.3]).1, [2]);
    }
}
