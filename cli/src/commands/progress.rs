//! Progress on standard error; nothing is drawn where that is not a terminal.
use indicatif::{ProgressBar, ProgressStyle};

/// A bar over `length` things of a kind, with the time left.
pub(super) fn bar(length: usize, things: &'static str) -> ProgressBar {
    styled(length, &format!("{{bar:28}} {{pos}}/{{len}} {things}  {{per_sec}}  {{eta}} left  {{msg}}"))
}

/// A bar over the frames of several drives; the prefix says how far those are.
pub(super) fn bar_of_drives() -> ProgressBar {
    styled(0, "{bar:28} {pos}/{len} frames  {per_sec}  {eta} left  {prefix}")
}

fn styled(length: usize, template: &str) -> ProgressBar {
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length as u64).with_style(style)
}
