#[cfg(feature = "proposals")]
use super::canvas::SKY;
use super::{
    canvas::{Canvas, Colour, GREEN, ORANGE, PURPLE, Stroke, WHITE, YELLOW},
    floor,
};
use crate::{Result, files::Rig};
use monorange_core::{
    lines::Extraction,
    scan::{Kind, Reading},
};
use nalgebra::{Matrix2, Vector2};

/// How a mark is drawn; never by its colour alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A filled circle.
    Dot,
    /// A circle.
    Ring,
    /// A cross.
    Cross,
    /// A plus.
    Plus,
}

/// Something at a pixel, with a label; the first of several has the first choice of room.
#[derive(Clone, Debug)]
pub struct Mark {
    /// Where.
    pub pixel: Vector2<f32>,
    /// Its covariance, drawn as a 3σ ellipse where it is large enough to see.
    pub covariance: Matrix2<f32>,
    /// Colour of mark and label.
    pub colour: Colour,
    /// Shape.
    pub shape: Shape,
    /// What is written beside it; the shorter form where the first has no room.
    pub labels: Vec<String>,
}

/// A line of the legend.
#[derive(Clone, Copy, Debug)]
pub enum LegendItem {
    /// A mark.
    Mark(&'static str, Colour, Shape),
    /// A line.
    Line(&'static str, Stroke),
}

/// A drawing over one picture of a rig.
pub struct Overlay<'a> {
    canvas: Canvas,
    rig: &'a Rig,
    legend: Vec<LegendItem>,
    metres: Vec<(String, Vector2<f32>)>,
}

/// Size of labels on the canvas, px.
const LABEL: f32 = 13.0;
const VERTICAL: Stroke = Stroke::solid(PURPLE, 2.2);
const FLOOR: Stroke = Stroke::solid(YELLOW, 2.2);

impl<'a> Overlay<'a> {
    /// A drawing at least `width` wide over a grey picture of the rig's size.
    ///
    /// # Errors
    /// When there are no pixels to draw on.
    pub fn new(rig: &'a Rig, grey: &[u8], width: u32) -> Result<Self> {
        let camera = rig.finder.camera();
        let mut canvas = Canvas::over(grey, [camera.width(), camera.height()], width)?;
        let ([right, bottom], bar) = (canvas.size(), LABEL * 2.0);
        canvas.reserve_area([0.0, 0.0, right, bar]); // of the title
        canvas.reserve_area([0.0, bottom - bar, right, bottom]); // of the legend
        Ok(Self { canvas, rig, legend: Vec::new(), metres: Vec::new() })
    }

    /// The 1 m grid of the floor and the horizon.
    pub fn floor(&mut self) {
        for line in floor::grid(&self.rig.finder) {
            let (opacity, width) = if line.bold { (0.6, 1.6) } else { (0.4, 1.1) };
            let stroke = Stroke { opacity: opacity * line.strength, ..Stroke::solid(WHITE, width) };
            self.canvas.polyline(&line.pixels, stroke);
            // Distances along the middle, where lines are far enough apart for them.
            if let (Some(metres), Some(pixel)) = (line.ahead, line.pixels.get(line.pixels.len() / 2))
                && (line.strength >= 1.0 || line.bold)
            {
                self.metres.push((format!("{metres} m"), self.canvas.place(*pixel)));
            }
        }
        let dashed = Stroke { opacity: 0.8, dash: Some([9.0, 6.0]), ..Stroke::solid(WHITE, 1.4) };
        self.canvas.polyline(&floor::horizon(&self.rig.finder), dashed);
        self.legend.push(LegendItem::Line("horizon", dashed));
        self.legend.push(LegendItem::Line("1 m grid", Stroke { opacity: 0.5, ..Stroke::solid(WHITE, 1.2) }));
    }

    /// Lines.
    pub fn lines(&mut self, extraction: &Extraction) {
        for (lines, stroke) in [(&extraction.vertical_lines, VERTICAL), (&extraction.floor_lines, FLOOR)] {
            for line in lines {
                self.canvas.polyline(&line.ends, stroke);
            }
        }
        self.explain_lines();
    }

    /// Edge points as an ideal camera sees them, px, vertical lines, and the floor lines of proposals, the likelier the stronger.
    #[cfg(feature = "proposals")]
    pub fn proposals(
        &mut self,
        extraction: &monorange_core::proposals::Extraction,
        edges: impl Iterator<Item = Vector2<f32>>,
    ) {
        let camera = self.rig.finder.camera();
        for edge in edges {
            let ray = camera.ray_from_ideal(edge.cast());
            if let Some(pixel) = camera.pixel_from_ray(ray) {
                let place = self.canvas.place(pixel.cast());
                self.canvas.dot(place, (self.canvas.scale() * 0.4).max(1.0), SKY, 0.75);
            }
        }
        for line in &extraction.vertical_lines {
            self.canvas.polyline(&line.ends, VERTICAL);
        }
        for (proposal, end) in extraction.proposals.iter().flat_map(|one| one.ends.map(|end| (one, end))) {
            if end.x.is_finite() {
                let likely = Stroke { opacity: 0.15 + 0.85 * proposal.probability, ..FLOOR };
                self.canvas.polyline(&[proposal.pixel, end], likely);
            }
        }
        self.legend.push(LegendItem::Mark("edge", SKY, Shape::Dot));
        self.explain_lines();
    }

    /// A scan: the free floor tinted, and what bounds it with ±1σ.
    pub fn scan(&mut self, readings: &[Reading]) {
        let finder = &self.rig.finder;
        let pixel = |bearing: f32, range: f32| {
            let (sin, cos) = libm::sincos(f64::from(bearing));
            let point = finder.mount().lever_arm() + Vector2::new(cos, sin) * f64::from(range);
            finder.pixel_from_floor_unbounded(point).ok().map(|pixel| pixel.cast::<f32>())
        };
        let bottom = finder.camera().height() as f32 - 0.5;
        for pair in readings.windows(2) {
            let [right, left] = pair else { continue };
            if right.free <= 0.0 || left.free <= 0.0 {
                continue;
            }
            if let (Some(a), Some(b)) = (pixel(right.bearing, right.free), pixel(left.bearing, left.free)) {
                self.canvas.area(&[a, b, Vector2::new(b.x, bottom), Vector2::new(a.x, bottom)], GREEN, 0.35);
            }
        }
        for reading in readings {
            let Some(range) = reading.range else { continue };
            let colour = if reading.kind == Kind::Boundary { YELLOW } else { ORANGE };
            let deviation = reading.var_range.sqrt();
            if let (Some(near), Some(far)) =
                (pixel(reading.bearing, range - deviation), pixel(reading.bearing, range + deviation))
            {
                self.canvas.polyline(&[near, far], Stroke::solid(colour, 1.4));
            }
            if let Some(place) = pixel(reading.bearing, range) {
                let place = self.canvas.place(place);
                self.canvas.dot(place, 3.2, colour, 1.0);
            }
        }
        self.legend.push(LegendItem::Mark("free floor", GREEN, Shape::Dot));
        self.legend.push(LegendItem::Mark("boundary ±1σ", YELLOW, Shape::Dot));
        self.legend.push(LegendItem::Mark("obstacle ±1σ", ORANGE, Shape::Dot));
    }

    fn explain_lines(&mut self) {
        self.legend.push(LegendItem::Line("vertical", VERTICAL));
        self.legend.push(LegendItem::Line("floor edge", FLOOR));
    }

    /// Marks, each with the longest of its labels that has room.
    pub fn marks(&mut self, marks: &[Mark]) {
        let places: Vec<_> = marks.iter().map(|mark| self.canvas.place(mark.pixel)).collect();
        for (mark, place) in marks.iter().zip(&places) {
            self.canvas.reserve(*place, 5.0);
            let largest = mark.covariance.symmetric_eigenvalues().max().max(0.0).sqrt();
            if 3.0 * largest * self.canvas.scale() > 7.0 {
                self.canvas.ellipse(mark.pixel, &mark.covariance, 3.0, Stroke::solid(mark.colour, 1.2));
            }
            draw_mark(&mut self.canvas, *place, mark.shape, mark.colour);
        }
        for (mark, place) in marks.iter().zip(&places) {
            let _ = mark.labels.iter().any(|label| self.canvas.label(label, *place, LABEL, mark.colour));
        }
    }

    /// Adds lines to the legend.
    pub fn explain(&mut self, items: &[LegendItem]) {
        self.legend.extend_from_slice(items);
    }

    /// The drawing with a title and its legend.
    pub fn finish(mut self, title: &str) -> Canvas {
        let size = LABEL * 0.92;
        let height = size * 1.9;
        let [width, bottom] = self.canvas.size();
        for (metres, place) in std::mem::take(&mut self.metres) {
            self.canvas.label(&metres, place, LABEL * 0.85, [0xCC, 0xCC, 0xCC]);
        }
        self.canvas.panel(
            Vector2::zeros(),
            Vector2::new(Canvas::text_width(title, size) + size * 1.4, height),
            [0; 3],
            0.55,
        );
        self.canvas.text(title, Vector2::new(size * 0.7, height * 0.66), size, WHITE);
        let item_width = |item: &LegendItem| Canvas::text_width(name(item), size) + size * 3.0;
        let total: f32 = self.legend.iter().map(item_width).sum();
        let top = bottom - height;
        self.canvas.panel(
            Vector2::new(0.0, top),
            Vector2::new((total + size * 0.4).min(width), height),
            [0; 3],
            0.55,
        );
        let mut left = size * 0.7;
        for item in std::mem::take(&mut self.legend) {
            let middle = Vector2::new(left + size * 0.8, top + height / 2.0);
            match item {
                LegendItem::Mark(_, colour, shape) => draw_mark(&mut self.canvas, middle, shape, colour),
                LegendItem::Line(_, stroke) => {
                    let half = Vector2::new(size * 0.8, 0.0);
                    self.canvas.line(&[middle - half, middle + half], stroke);
                }
            }
            self.canvas.text(name(&item), Vector2::new(left + size * 2.0, top + height * 0.66), size, WHITE);
            left += item_width(&item);
        }
        self.canvas
    }
}

/// The corner's mark and the words for it.
pub const SEEN: LegendItem = LegendItem::Mark("floor corner", ORANGE, Shape::Dot);

fn name(item: &LegendItem) -> &'static str {
    match item {
        LegendItem::Mark(name, ..) | LegendItem::Line(name, _) => name,
    }
}

fn draw_mark(canvas: &mut Canvas, place: Vector2<f32>, shape: Shape, colour: Colour) {
    const RADIUS: f32 = 4.5;
    let rim = Stroke { opacity: 0.9, ..Stroke::solid([0x14, 0x16, 0x18], 1.6) };
    let line = Stroke::solid(colour, 2.2);
    let wide = Stroke { width: 4.2, ..rim };
    let bars = |turned: bool| {
        let arm = if turned { Vector2::new(RADIUS, RADIUS) } else { Vector2::new(RADIUS * 1.2, 0.0) };
        [
            [place - arm, place + arm],
            [place - Vector2::new(-arm.y, arm.x), place + Vector2::new(-arm.y, arm.x)],
        ]
    };
    match shape {
        Shape::Dot => {
            canvas.dot(place, RADIUS, colour, 1.0);
            canvas.ring(place, RADIUS + 0.8, rim);
        }
        Shape::Ring => {
            canvas.ring(place, RADIUS, wide);
            canvas.ring(place, RADIUS, line);
        }
        Shape::Cross | Shape::Plus => {
            for stroke in [wide, line] {
                for bar in bars(shape == Shape::Cross) {
                    canvas.line(&bar, stroke);
                }
            }
        }
    }
}
