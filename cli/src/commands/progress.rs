//! Progress on standard error; nothing is drawn where that is not a terminal.
use indicatif::{ProgressBar, ProgressStyle};

/// A bar over `length` things of a kind, with the time left.
pub(super) fn bar(length: usize, things: &'static str) -> ProgressBar {
    let template = format!("{{bar:28}} {{pos}}/{{len}} {things}  {{per_sec}}  {{eta}} left  {{msg}}");
    let style = ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length as u64).with_style(style)
}
