//! What both kinds of drawing need of SVG.
use std::fmt::Write as _;

/// A number in few characters.
pub(super) fn number(value: f64) -> String {
    let digits = if value.abs() >= 100.0 { 1 } else { 3 };
    let text = format!("{value:.digits$}");
    let short = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if short == "-0" { "0".to_owned() } else { short.replace('-', "\u{2212}") }
}

/// A coordinate; SVG wants the plain minus.
pub(super) fn coordinate(value: f64) -> String {
    format!("{value:.1}")
}

/// A path through places, open.
pub(super) fn path_data(places: impl IntoIterator<Item = (f64, f64)>) -> String {
    let mut data = String::new();
    for (index, (x, y)) in places.into_iter().enumerate() {
        let _ = write!(data, "{}{} {}", if index == 0 { 'M' } else { 'L' }, coordinate(x), coordinate(y));
    }
    data
}

/// About `count` round numbers within a range.
pub(super) fn ticks([low, high]: [f64; 2], count: usize) -> Vec<f64> {
    let step = round_step((high - low) / count as f64);
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    (first..=last.min(first + 100)).map(|index| index as f64 * step).collect()
}

/// The round number (1, 2 or 5 times a power of ten) nearest above `at_least`.
pub(super) fn round_step(at_least: f64) -> f64 {
    let at_least = at_least.max(1e-9);
    let power = libm::pow(10.0, libm::log10(at_least).floor());
    [1.0, 2.0, 5.0, 10.0]
        .map(|factor| factor * power)
        .into_iter()
        .find(|step| *step >= at_least * 0.999)
        .unwrap_or(power)
}

/// Text that HTML shows as it is.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks([0.0, 9.7], 5), [0.0, 2.0, 4.0, 6.0, 8.0]);
        assert_eq!(ticks([-0.031, 0.031], 4).len(), 3);
        assert_eq!(number(-0.02), "−0.02");
        assert_eq!(number(1234.5), "1234.5");
        assert_eq!(number(20.0), "20");
    }
}
