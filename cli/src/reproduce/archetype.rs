//! Which distribution has the range error? The paper leaves "an appropriate error archetype" open.
//!
//! For a floor point straight ahead at a true range, the pixel's row is observed with Gaussian noise; each model makes
//! an interval of k standard deviations from what was observed, and is right when that interval holds the truth in
//! 68.27, 95.45 and 99.73 % of the cases:
//!
//! ```text
//! first order    f(v) ± k |f′| σ                                    the paper's
//! second order   f(v) − ½ f″ σ²,  variance f′² σ² + ½ f″² σ⁴
//! unscented      mean and variance of f at v, v ± √3 σ
//! inverse range  1/f(v) ± k |f′|/f² σ
//! pixel          v ± k σ against the row in which the truth is seen: exact
//! ```
//!
//! The observations are the quantiles of the normal distribution, so there is no randomness in the figures.
use super::{Figures, Section};
use monorange_core::geometry::RangeFinder;
use monorange_formats::report::chart::{Axis, Chart};
use monorange_formats::{Error, Result};
use monorange_sim::default_rig;
use nalgebra::Vector2;

/// Standard deviation of the observed row, px: a floor corner's, calibration included.
const SIGMA: f64 = 0.5;
const DRAWS: usize = 20_001;
const RANGES: [f64; 12] = [1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 16.0, 20.0, 30.0, 40.0, 60.0, 80.0];

/// A way to tell the range's uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// Linearised, as in the paper.
    FirstOrder,
    /// With the curvature.
    SecondOrder,
    /// Three sigma points.
    Unscented,
    /// Gaussian in 1/r.
    InverseRange,
    /// Gaussian in the picture.
    Pixel,
}

/// All of them, with names.
pub const MODELS: [(Model, &str); 5] = [
    (Model::FirstOrder, "first order (paper)"),
    (Model::SecondOrder, "second order"),
    (Model::Unscented, "unscented"),
    (Model::InverseRange, "inverse range"),
    (Model::Pixel, "pixel"),
];

struct Ahead {
    finder: RangeFinder<f64>,
    column: f64,
}

impl Ahead {
    fn range(&self, v: f64) -> Option<f64> {
        self.finder.sight(Vector2::new(self.column, v)).ok().map(|sighting| sighting.range)
    }

    /// Range and its first and second derivative by v.
    fn derivatives(&self, v: f64) -> Option<[f64; 3]> {
        const STEP: f64 = 1e-3;
        let (before, at, after) = (self.range(v - STEP)?, self.range(v)?, self.range(v + STEP)?);
        let slope = self.finder.sight(Vector2::new(self.column, v)).ok()?.by_pixel[(0, 1)];
        Some([at, slope, (before - 2.0 * at + after) / (STEP * STEP)])
    }

    /// How many standard deviations the truth lies from what a model makes of the observed row.
    fn deviation(&self, model: Model, observed: f64, range: f64, row: f64) -> Option<f64> {
        let [at, slope, curvature] = self.derivatives(observed)?;
        let deviation = match model {
            Model::FirstOrder => (at - range) / (slope * SIGMA),
            Model::SecondOrder => {
                let bend = curvature * SIGMA * SIGMA;
                let variance = slope * slope * SIGMA * SIGMA + 0.5 * bend * bend;
                (at - 0.5 * bend - range) / variance.sqrt()
            }
            Model::Unscented => {
                let step = 3_f64.sqrt() * SIGMA;
                let (low, high) = (self.range(observed - step)?, self.range(observed + step)?);
                let mean = (4.0 * at + low + high) / 6.0;
                let spread = |value: f64| (value - mean) * (value - mean);
                let variance = (4.0 * spread(at) + spread(low) + spread(high)) / 6.0;
                (mean - range) / variance.sqrt()
            }
            Model::InverseRange => (1.0 / at - 1.0 / range) / (slope / (at * at) * SIGMA),
            Model::Pixel => (observed - row) / SIGMA,
        };
        Some(deviation.abs())
    }
}

/// Shares of cases in which k = 1, 2, 3 standard deviations hold the truth, for each model in order. A row that looks
/// above the horizon gives no range, and holds nothing.
///
/// # Errors
/// When the range is out of the picture.
pub fn coverage(range: f64) -> Result<[[f64; 3]; 5]> {
    let finder = default_rig().map_err(Error::new)?;
    let seen = finder.pixel_from_floor(Vector2::new(range, 0.0));
    let seen = seen.map_err(|_| Error::new(format!("{range} m ahead is out of the picture")))?;
    let ahead = Ahead { finder, column: seen.x };
    let mut shares = [[0.0; 3]; 5];
    for draw in 0..DRAWS {
        let observed = seen.y + SIGMA * normal_quantile((draw as f64 + 0.5) / DRAWS as f64);
        for ((model, _), shares) in MODELS.into_iter().zip(&mut shares) {
            // The pixel itself needs no floor to be compared with.
            let deviation = match model {
                Model::Pixel => Some(((observed - seen.y) / SIGMA).abs()),
                _ => ahead.deviation(model, observed, range, seen.y),
            };
            for (k, share) in shares.iter_mut().enumerate() {
                let inside = deviation.is_some_and(|deviation| deviation <= (k + 1) as f64);
                *share += f64::from(u8::from(inside)) / DRAWS as f64;
            }
        }
    }
    Ok(shares)
}

/// The number below which a standard normal variable lies with this probability, by bisection.
fn normal_quantile(probability: f64) -> f64 {
    let (mut low, mut high) = (-8.0, 8.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let below = 0.5 * libm::erfc(-middle * core::f64::consts::FRAC_1_SQRT_2);
        if below < probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The section.
///
/// # Errors
/// As [`coverage`].
pub fn section() -> Result<Section> {
    let mut header = vec!["range m"];
    header.extend(MODELS.iter().map(|(_, name)| *name));
    let captions = [
        "Truth within 1σ, % (68.27 is right)",
        "Truth within 2σ, % (95.45 is right)",
        "Truth within 3σ, % (99.73 is right)",
    ];
    let mut tables = captions.map(|caption| Figures::new(caption, &header));
    let axis = Axis { range: [0.0, RANGES[RANGES.len() - 1]], unit: "m" };
    let mut chart = Chart::over(axis, "Truth within 3σ", "% of cases", [96.0, 100.1], 300.0);
    let mut curves = vec![Vec::new(); MODELS.len()];
    for range in RANGES {
        let shares = coverage(range)?;
        for (k, table) in tables.iter_mut().enumerate() {
            let cells = shares.iter().map(|shares| format!("{:.2}", 100.0 * shares[k]));
            table.row([format!("{range:.0}")].into_iter().chain(cells));
        }
        for (curve, shares) in curves.iter_mut().zip(shares) {
            curve.push([range, 100.0 * shares[2]]);
        }
    }
    chart.rule("zero", 99.73, "99.73 %, right");
    for ((index, (_, name)), curve) in MODELS.iter().enumerate().zip(&curves) {
        chart.line(&format!("series s{index}"), curve);
        // In a stack where no curve runs.
        chart.label(0.25 * RANGES[RANGES.len() - 1], 98.2 - 0.4 * index as f64, &format!("s{index}"), name);
    }
    let drawing =
        chart.svg("Share of cases in which three standard deviations hold the true range, over range");
    Ok(Section {
        name: "archetype",
        title: "The error archetype of the virtual range finder",
        words: vec![
            format!(
                "A corner’s row is observed with {SIGMA} px of Gaussian noise; each model says how far the range may be off, up to the \
                 horizon. The range error is skewed: its far tail is long. First order promises 99.73 % \
                 for 3σ and holds less from some ten metres on; inverse range, nearly linear in the row, holds it to the horizon; the \
                 pixel is Gaussian by construction."
            ),
            "The pipeline gives the filter the pixel (<code>filter.model = \"pixel\"</code>) and leaves out what lies within 3° of the \
             horizon; range and bearing stay selectable."
                .to_owned(),
        ],
        tables: tables.into(),
        drawings: vec![("Coverage of 3σ: where a curve drops, the model promises more than it holds.".to_owned(), drawing)],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_the_robot_every_model_is_right_and_far_away_only_the_pixel() {
        let right = [0.6827, 0.9545, 0.9973];
        for shares in coverage(2.0).unwrap() {
            for (share, right) in shares.into_iter().zip(right) {
                assert!((share - right).abs() < 0.01, "{shares:?}");
            }
        }
        let [first, .., inverse, pixel] = coverage(60.0).unwrap();
        assert!(first[2] < 0.99 && (inverse[2] - right[2]).abs() < 0.005, "{first:?} {inverse:?}");
        assert!(pixel.into_iter().zip(right).all(|(share, right)| (share - right).abs() < 1e-3), "{pixel:?}");
    }
}
