use super::canvas::{Canvas, Colour, Stroke};
use ab_glyph::{Font, FontRef, OutlineCurve};
use nalgebra::Vector2;
use tiny_skia::PathBuilder;

/// Rectangles of the canvas that are taken.
#[derive(Default)]
pub(super) struct Labels {
    taken: Vec<[f32; 4]>,
}

impl Labels {
    fn is_free(&self, [left, top, right, bottom]: [f32; 4]) -> bool {
        self.taken.iter().all(|[l, t, r, b]| right <= *l || left >= *r || bottom <= *t || top >= *b)
    }
}

/// Advance of every character of the (monospaced) font, and height of a digit, as parts of the size.
const ADVANCE: f32 = 0.602;
const DIGIT: f32 = 0.73;
const RIM: Colour = [0x14, 0x16, 0x18];

impl Canvas {
    /// Width of a text.
    pub fn text_width(text: &str, size: f32) -> f32 {
        text.chars().count() as f32 * ADVANCE * size
    }

    /// A text with a dark rim; `place` is the left end of its base line.
    pub fn text(&mut self, text: &str, place: Vector2<f32>, size: f32, colour: Colour) {
        let Ok(font) = FontRef::try_from_slice(epaint_default_fonts::HACK_REGULAR) else { return };
        // The em square in units, against which outlines are measured.
        let unit = size / font.units_per_em().unwrap_or(2048.0);
        let mut path = PathBuilder::new();
        let mut left = place.x;
        for character in text.chars() {
            if let Some(outline) = font.outline(font.glyph_id(character)) {
                let at = |point: ab_glyph::Point| (left + point.x * unit, place.y - point.y * unit);
                trace(&mut path, &outline.curves, at);
            }
            left += ADVANCE * size;
        }
        if let Some(path) = path.finish() {
            self.stroke(&path, Stroke { opacity: 0.85, ..Stroke::solid(RIM, size * 0.22) });
            self.fill(&path, colour, 1.0);
        }
    }

    /// A text beside a place, where it covers nothing that was labelled or reserved before; none where there is
    /// no room.
    pub fn label(&mut self, text: &str, place: Vector2<f32>, size: f32, colour: Colour) -> bool {
        let (width, height) = (Self::text_width(text, size), DIGIT * size);
        let (gap, [canvas_width, canvas_height]) = (size * 0.65, self.size());
        let right = Vector2::new(gap, height / 2.0);
        let left = Vector2::new(-gap - width, height / 2.0);
        let above = Vector2::new(-width / 2.0, -gap);
        let below = Vector2::new(-width / 2.0, gap + height);
        for offset in [right, left, above, below] {
            let base = place + offset;
            let margin = size * 0.2;
            let area = [base.x - margin, base.y - height - margin, base.x + width + margin, base.y + margin];
            let inside =
                area[0] >= 0.0 && area[1] >= 0.0 && area[2] <= canvas_width && area[3] <= canvas_height;
            if inside && self.labels.is_free(area) {
                self.labels.taken.push(area);
                self.text(text, base, size, colour);
                return true;
            }
        }
        false
    }

    /// Keeps labels away from a square around a place.
    pub fn reserve(&mut self, place: Vector2<f32>, half: f32) {
        self.reserve_area([place.x - half, place.y - half, place.x + half, place.y + half]);
    }

    /// Keeps labels away from left, top, right, bottom.
    pub fn reserve_area(&mut self, area: [f32; 4]) {
        self.labels.taken.push(area);
    }
}

/// Adds a glyph's closed contours to a path; curves of a contour follow each other end to start.
fn trace(path: &mut PathBuilder, curves: &[OutlineCurve], at: impl Fn(ab_glyph::Point) -> (f32, f32)) {
    let mut pen = None;
    for curve in curves {
        let (start, end) = match curve {
            OutlineCurve::Line(start, end)
            | OutlineCurve::Quad(start, _, end)
            | OutlineCurve::Cubic(start, _, _, end) => (at(*start), at(*end)),
        };
        if pen != Some(start) {
            if pen.is_some() {
                path.close();
            }
            path.move_to(start.0, start.1);
        }
        match curve {
            OutlineCurve::Line(..) => path.line_to(end.0, end.1),
            OutlineCurve::Quad(_, control, _) => {
                let (x, y) = at(*control);
                path.quad_to(x, y, end.0, end.1);
            }
            OutlineCurve::Cubic(_, first, second, _) => {
                let ((x1, y1), (x2, y2)) = (at(*first), at(*second));
                path.cubic_to(x1, y1, x2, y2, end.0, end.1);
            }
        }
        pen = Some(end);
    }
    if pen.is_some() {
        path.close();
    }
}
