//! The horizon and the floor's 1 m grid, as lines of the picture (through the lens).
use monorange_core::geometry::RangeFinder;
use nalgebra::Vector2;

/// A grid line's visible part.
pub(super) struct GridLine {
    pub(super) pixels: Vec<Vector2<f32>>,
    /// 0 to 1: how far apart it is from the next line.
    pub(super) strength: f32,
    /// Every fifth metre.
    pub(super) bold: bool,
    /// Distance ahead for the lines across, in metres.
    pub(super) ahead: Option<i32>,
}

/// Pixels between neighbouring lines at which they are fully drawn; they fade in proportion below that.
const FULL_SPACING_PX: f64 = 14.0;
/// The same at which they are left out.
const LEAST_SPACING_PX: f64 = 2.5;

/// Where the camera sees infinitely far along the floor.
pub(super) fn horizon(finder: &RangeFinder<f64>) -> Vec<Vector2<f32>> {
    let line = finder.horizon();
    let camera = finder.camera();
    let rays = (-200..=200).map(|step| {
        let x = f64::from(step) * 0.01;
        Vector2::new(x, -(line.x * x + line.z) / line.y)
    });
    let pixels = rays.filter_map(|ray| camera.pixel_from_ray(ray)).filter(|pixel| camera.contains(*pixel));
    pixels.map(|pixel| pixel.cast()).collect()
}

/// Lines of whole metres ahead and to the sides, as far as they can be told apart.
pub(super) fn grid(finder: &RangeFinder<f64>) -> Vec<GridLine> {
    // A metre at distance d is about h f / d² pixels high.
    let reach = finder.mount().height() * finder.camera().focal().y;
    let bold_limit = (5.0 * reach / LEAST_SPACING_PX).sqrt();
    let fine_limit = (reach / LEAST_SPACING_PX).sqrt();
    let metres = |limit: f64| (limit.ceil() as i32).clamp(1, 100);
    let mut lines = Vec::new();
    for metre in -metres(bold_limit)..=metres(bold_limit) {
        let bold = metre % 5 == 0;
        let coordinate = f64::from(metre);
        if !bold && coordinate.abs() > fine_limit {
            continue;
        }
        let spacing = reach / (coordinate * coordinate).max(0.01) * if bold { 5.0 } else { 1.0 };
        let strength = (spacing / FULL_SPACING_PX).min(1.0) as f32;
        let limit = if bold { bold_limit } else { fine_limit };
        let across = steps(-limit, limit).map(|left| Vector2::new(coordinate, left));
        let along = steps(0.0, limit).map(|ahead| Vector2::new(ahead, coordinate));
        if metre > 0 {
            lines.extend(visible(finder, across).map(|pixels| GridLine {
                pixels,
                strength,
                bold,
                ahead: Some(metre),
            }));
        }
        lines.extend(visible(finder, along).map(|pixels| GridLine {
            pixels,
            strength: 0.7,
            bold,
            ahead: None,
        }));
    }
    lines
}

/// Places along an axis, denser near the robot.
fn steps(from: f64, to: f64) -> impl Iterator<Item = f64> {
    let next = |at: &f64| Some(at + 0.02 + 0.02 * at.abs());
    std::iter::successors(Some(from), next).take_while(move |at| *at <= to)
}

/// The runs of points that the picture shows.
fn visible(
    finder: &RangeFinder<f64>,
    points: impl Iterator<Item = Vector2<f64>>,
) -> impl Iterator<Item = Vec<Vector2<f32>>> {
    let mut runs = vec![Vec::new()];
    for point in points {
        match (finder.pixel_from_floor(point), runs.last_mut()) {
            (Ok(pixel), Some(run)) => run.push(pixel.cast()),
            (Err(_), Some(run)) if !run.is_empty() => runs.push(Vec::new()),
            _ => {}
        }
    }
    runs.into_iter().filter(|run| run.len() > 1)
}
