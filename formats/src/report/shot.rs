//! The frames that a report shows.
use super::Observation;
use crate::{
    Result,
    draw::{GREEN, LegendItem, Mark, ORANGE, Overlay, SKY, Shape, VERMILLION},
    files::Rig,
};
use monorange_core::slam::Decision;
use nalgebra::Vector2;

/// A frame chosen for the report.
#[derive(Clone, Debug)]
pub struct Shot {
    /// What it shows.
    pub caption: String,
    /// The overlay as JPEG.
    pub jpeg: Vec<u8>,
}

/// Frames shown in the report: of each part of the drive the one with the most corners.
pub const SHOTS: usize = 6;

/// Draws a grey picture with what was found in it, `seconds` into the drive.
///
/// # Errors
/// When there are no pixels to draw on.
pub fn shot(
    rig: &Rig,
    pixels: &[u8],
    lines: impl FnOnce(&mut Overlay<'_>),
    seen: &[Observation],
    frame: usize,
    seconds: f64,
) -> Result<Shot> {
    let mut overlay = Overlay::new(rig, pixels, 640)?;
    overlay.floor();
    lines(&mut overlay);
    overlay.explain(&[
        LegendItem::Mark("matched", ORANGE, Shape::Dot),
        LegendItem::Mark("new", GREEN, Shape::Plus),
        LegendItem::Mark("refused", VERMILLION, Shape::Cross),
    ]);
    overlay.marks(&marks(seen));
    let jpeg = overlay.finish(&format!("frame {frame}   t = {seconds:.2} s")).jpeg(82)?;
    let matched = seen.iter().filter(|seen| seen.is_matched()).count();
    let caption = format!("Frame {frame}, {seconds:.1} s: {} floor corners, {matched} matched.", seen.len());
    Ok(Shot { caption, jpeg })
}

/// The corners of a frame by what became of them, the nearest first.
fn marks(seen: &[Observation]) -> Vec<Mark> {
    let mut seen: Vec<_> = seen.iter().filter_map(|seen| Some((seen, seen.pixel?, seen.range?))).collect();
    seen.sort_by(|(_, _, a), (_, _, b)| a.total_cmp(b));
    let mark = |(seen, pixel, range): (&Observation, Vector2<f32>, f32)| {
        let (colour, shape) = match seen.decision {
            Decision::Update => (ORANGE, Shape::Dot),
            Decision::Tentative => (SKY, Shape::Dot),
            Decision::Birth => (GREEN, Shape::Plus),
            Decision::Gated | Decision::Rejected => (VERMILLION, Shape::Cross),
        };
        let range = format!("{range:.2} m");
        let named = seen.landmark.map(|id| format!("#{id} {range}"));
        Mark {
            pixel,
            covariance: seen.pixel_covariance.unwrap_or_default(),
            colour,
            shape,
            labels: named.into_iter().chain([range]).collect(),
        }
    };
    seen.into_iter().map(mark).collect()
}
