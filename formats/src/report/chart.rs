//! A chart of something over time or over another quantity, as SVG whose colours are the page's.
use super::svg::{coordinate, number, path_data, ticks};
use std::fmt::Write as _;

/// What runs from left to right.
#[derive(Clone, Copy, Debug)]
pub struct Axis {
    /// First and last value.
    pub range: [f64; 2],
    /// Its unit.
    pub unit: &'static str,
}

/// A chart under construction; its coordinates are those of the data.
pub struct Chart {
    title: String,
    unit: String,
    x: [f64; 2],
    x_unit: &'static str,
    y: [f64; 2],
    height: f64,
    body: String,
}

const WIDTH: f64 = 1080.0;
const LEFT: f64 = 56.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 22.0;
/// Points of a line beyond which only every n-th is drawn: more cannot be told apart.
const MAX_POINTS: usize = 1500;

impl Chart {
    /// A chart of `title` in `unit` over seconds and a y range.
    pub fn new(title: &str, unit: &str, seconds: [f64; 2], y: [f64; 2], height: f64) -> Self {
        Self::over(Axis { range: seconds, unit: "s" }, title, unit, y, height)
    }

    /// A chart of `title` in `unit` over an axis and a y range.
    pub fn over(axis: Axis, title: &str, unit: &str, y: [f64; 2], height: f64) -> Self {
        let widen = |[low, high]: [f64; 2]| if high > low { [low, high] } else { [low - 0.5, low + 0.5] };
        let (x, y) = (widen(axis.range), widen(y));
        Self { title: title.into(), unit: unit.into(), x, x_unit: axis.unit, y, height, body: String::new() }
    }

    /// Words left of and above a point.
    pub fn label(&mut self, x: f64, y: f64, class: &str, words: &str) {
        let (x, y) = self.place(x, y);
        let _ = write!(
            self.body,
            r#"<text class="label {class}" x="{:.1}" y="{:.1}" text-anchor="end">{words}</text>"#,
            x - 3.0,
            y - 5.0
        );
    }

    /// The area between two curves (x, low, high).
    pub fn band(&mut self, class: &str, points: &[[f64; 3]]) {
        let thinned: Vec<_> = thin(points).collect();
        let lower = thinned.iter().map(|[x, low, _]| self.place(*x, *low));
        let upper = thinned.iter().rev().map(|[x, _, high]| self.place(*x, *high));
        let data = path_data(lower.chain(upper).collect::<Vec<_>>());
        let _ = write!(self.body, r#"<path class="{class}" d="{data}Z"/>"#);
    }

    /// A curve.
    pub fn line(&mut self, class: &str, points: &[[f64; 2]]) {
        let places: Vec<_> = thin(points).map(|[x, y]| self.place(*x, *y)).collect();
        let _ = write!(self.body, r#"<path class="{class}" d="{}"/>"#, path_data(places));
    }

    /// Points; those beyond the chart lie on its upper edge.
    pub fn dots(&mut self, class: &str, points: &[[f64; 2]]) {
        let mut data = String::new();
        for [x, y] in points {
            let (x, y) = self.place(*x, *y);
            let _ = write!(data, "M{} {}h0", coordinate(x), coordinate(y));
        }
        let _ = write!(self.body, r#"<path class="{class}" d="{data}"/>"#);
    }

    /// A horizontal line with words at its right end.
    pub fn rule(&mut self, class: &str, y: f64, words: &str) {
        let ((x0, y), (x1, _)) = (self.place(self.x[0], y), self.place(self.x[1], y));
        let _ = write!(
            self.body,
            r#"<path class="{class}" d="M{x0} {y:.1}H{x1}"/><text class="note" x="{:.1}" y="{:.1}" text-anchor="end">{words}</text>"#,
            x1 - 4.0,
            y - 4.0
        );
    }

    /// The chart; `legend` is a line of HTML-free words for readers without the picture.
    pub fn svg(&self, words: &str) -> String {
        let mut svg = format!(
            r#"<svg class="chart" viewBox="0 0 {WIDTH} {}" role="img" aria-label="{words}">"#,
            self.height
        );
        let bottom = self.height - BOTTOM;
        for value in ticks(self.y, 4) {
            let (_, y) = self.place(self.x[0], value);
            let _ = write!(
                svg,
                r#"<path class="grid" d="M{LEFT} {y:.1}H{}"/><text class="tick" x="{}" y="{:.1}" text-anchor="end">{}</text>"#,
                WIDTH - RIGHT,
                LEFT - 6.0,
                y + 3.5,
                number(value)
            );
        }
        let times = ticks(self.x, 12);
        for value in &times {
            let (x, _) = self.place(*value, self.y[0]);
            let unit = if times.last() == Some(value) { self.x_unit } else { "" };
            let _ = write!(
                svg,
                r#"<path class="grid" d="M{x:.1} {TOP}V{bottom}"/><text class="tick" x="{x:.1}" y="{}" text-anchor="middle">{} {unit}</text>"#,
                bottom + 15.0,
                number(*value)
            );
        }
        let _ = write!(
            svg,
            r#"<text class="title" x="{LEFT}" y="15">{} <tspan class="unit">{}</tspan></text>"#,
            self.title, self.unit,
        );
        svg + &self.body + "</svg>"
    }

    fn place(&self, x: f64, y: f64) -> (f64, f64) {
        let part = |value: f64, [low, high]: [f64; 2]| ((value - low) / (high - low)).clamp(0.0, 1.0);
        let (width, height) = (WIDTH - LEFT - RIGHT, self.height - TOP - BOTTOM);
        (LEFT + part(x, self.x) * width, TOP + (1.0 - part(y, self.y)) * height)
    }
}

/// At most [`MAX_POINTS`] of the points, evenly chosen.
pub(super) fn thin<P>(points: &[P]) -> impl DoubleEndedIterator<Item = &P> {
    points.iter().step_by(points.len().div_ceil(MAX_POINTS).max(1))
}
