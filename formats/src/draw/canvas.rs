use super::text::Labels;
use crate::{Error, Result};
use image::codecs::{jpeg, png};
use image::{ExtendedColorType, ImageEncoder};
use nalgebra::{Matrix2, Vector2};
use tiny_skia::{
    Color, FillRule, FilterQuality, LineCap, LineJoin, Paint, PathBuilder, Pixmap, PixmapPaint, StrokeDash,
    Transform,
};

/// Red, green, blue.
pub type Colour = [u8; 3];
/// Okabe and Ito's colours, which colour-blind people tell apart: seen.
pub const ORANGE: Colour = [0xE6, 0x9F, 0x00];
/// Predicted.
pub const SKY: Colour = [0x56, 0xB4, 0xE9];
/// In the map.
pub const GREEN: Colour = [0x00, 0x9E, 0x73];
/// Floor edges.
pub const YELLOW: Colour = [0xF0, 0xE4, 0x42];
/// Refused.
pub const VERMILLION: Colour = [0xD5, 0x5E, 0x00];
/// Vertical edges.
pub const PURPLE: Colour = [0xCC, 0x79, 0xA7];
/// Grid and horizon.
pub const WHITE: Colour = [0xFF, 0xFF, 0xFF];

/// How a line is drawn; widths are in pixels of the canvas.
#[derive(Clone, Copy, Debug)]
pub struct Stroke {
    /// Colour.
    pub colour: Colour,
    /// 0 to 1.
    pub opacity: f32,
    /// Width.
    pub width: f32,
    /// Lengths of dash and gap, if it is dashed.
    pub dash: Option<[f32; 2]>,
}

impl Stroke {
    /// A solid, opaque line.
    pub const fn solid(colour: Colour, width: f32) -> Self {
        Self { colour, opacity: 1.0, width, dash: None }
    }
}

/// A picture to draw on, enlarged by a whole factor. Places are pixels of the picture, whose first one has its
/// centre at (0, 0).
pub struct Canvas {
    pixmap: Pixmap,
    scale: f32,
    pub(super) labels: Labels,
}

impl Canvas {
    /// A canvas at least `width` wide over a grey picture, darkened a little so that colours stand out.
    ///
    /// # Errors
    /// When the pixels are fewer than width × height, or there are none.
    pub fn over(grey: &[u8], size: [usize; 2], width: u32) -> Result<Self> {
        let [columns, rows] = size.map(|side| side as u32);
        let failed = || Error::new(format!("cannot draw on a picture of {columns}×{rows} pixels"));
        let mut small = Pixmap::new(columns, rows).ok_or_else(failed)?;
        if grey.len() != small.pixels().len() {
            return Err(failed());
        }
        for (pixel, level) in small.pixels_mut().iter_mut().zip(grey) {
            let dimmed = (u16::from(*level) * 7 / 8) as u8;
            *pixel = tiny_skia::ColorU8::from_rgba(dimmed, dimmed, dimmed, 255).premultiply();
        }
        let factor = width.div_ceil(columns).clamp(1, 8);
        let mut pixmap = Pixmap::new(columns * factor, rows * factor).ok_or_else(failed)?;
        pixmap.fill(Color::BLACK);
        let paint = PixmapPaint { quality: FilterQuality::Bicubic, ..PixmapPaint::default() };
        let enlarge = Transform::from_scale(factor as f32, factor as f32);
        pixmap.draw_pixmap(0, 0, small.as_ref(), &paint, enlarge, None);
        Ok(Self { pixmap, scale: factor as f32, labels: Labels::default() })
    }

    /// Pixels of the canvas for one of the picture.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// Width and height of the canvas.
    pub fn size(&self) -> [f32; 2] {
        [self.pixmap.width() as f32, self.pixmap.height() as f32]
    }

    /// The place on the canvas of a pixel of the picture.
    pub fn place(&self, pixel: Vector2<f32>) -> Vector2<f32> {
        pixel.map(|coordinate| (coordinate + 0.5) * self.scale)
    }

    /// A line through pixels of the picture.
    pub fn polyline(&mut self, pixels: &[Vector2<f32>], stroke: Stroke) {
        let places: Vec<_> = pixels.iter().map(|pixel| self.place(*pixel)).collect();
        self.line(&places, stroke);
    }

    /// A line through places of the canvas.
    pub fn line(&mut self, places: &[Vector2<f32>], stroke: Stroke) {
        let mut path = PathBuilder::new();
        for (index, place) in places.iter().enumerate() {
            if index == 0 { path.move_to(place.x, place.y) } else { path.line_to(place.x, place.y) }
        }
        if let Some(path) = path.finish() {
            self.stroke(&path, stroke);
        }
    }

    /// A filled polygon of pixels of the picture.
    pub fn area(&mut self, pixels: &[Vector2<f32>], colour: Colour, opacity: f32) {
        let mut path = PathBuilder::new();
        for (index, place) in pixels.iter().map(|pixel| self.place(*pixel)).enumerate() {
            if index == 0 { path.move_to(place.x, place.y) } else { path.line_to(place.x, place.y) }
        }
        path.close();
        if let Some(path) = path.finish() {
            self.fill(&path, colour, opacity);
        }
    }

    /// A filled circle on the canvas.
    pub fn dot(&mut self, place: Vector2<f32>, radius: f32, colour: Colour, opacity: f32) {
        if let Some(path) = PathBuilder::from_circle(place.x, place.y, radius) {
            self.fill(&path, colour, opacity);
        }
    }

    /// A circle on the canvas.
    pub fn ring(&mut self, place: Vector2<f32>, radius: f32, stroke: Stroke) {
        if let Some(path) = PathBuilder::from_circle(place.x, place.y, radius) {
            self.stroke(&path, stroke);
        }
    }

    /// The ellipse of `sigmas` standard deviations around a pixel of the picture.
    pub fn ellipse(&mut self, pixel: Vector2<f32>, covariance: &Matrix2<f32>, sigmas: f32, stroke: Stroke) {
        let axes = covariance.symmetric_eigen();
        let half = axes.eigenvalues.map(|variance| sigmas * variance.max(0.0).sqrt());
        let around = (0..=48).map(|step| {
            let (sin, cos) = libm::sincosf(step as f32 * std::f32::consts::TAU / 48.0);
            pixel + axes.eigenvectors * Vector2::new(half.x * cos, half.y * sin)
        });
        self.polyline(&around.collect::<Vec<_>>(), stroke);
    }

    /// A filled rectangle with rounded corners on the canvas.
    pub fn panel(&mut self, place: Vector2<f32>, size: Vector2<f32>, colour: Colour, opacity: f32) {
        if let Some(rect) = tiny_skia::Rect::from_xywh(place.x, place.y, size.x, size.y) {
            self.fill(&PathBuilder::from_rect(rect), colour, opacity);
        }
    }

    pub(super) fn fill(&mut self, path: &tiny_skia::Path, colour: Colour, opacity: f32) {
        let paint = paint(colour, opacity);
        self.pixmap.fill_path(path, &paint, FillRule::Winding, Transform::identity(), None);
    }

    pub(super) fn stroke(&mut self, path: &tiny_skia::Path, stroke: Stroke) {
        let dash = stroke.dash.and_then(|lengths| StrokeDash::new(lengths.to_vec(), 0.0));
        let line = tiny_skia::Stroke {
            width: stroke.width,
            line_cap: if dash.is_some() { LineCap::Butt } else { LineCap::Round },
            line_join: LineJoin::Round,
            dash,
            ..tiny_skia::Stroke::default()
        };
        let paint = paint(stroke.colour, stroke.opacity);
        self.pixmap.stroke_path(path, &paint, &line, Transform::identity(), None);
    }

    /// The drawing as PNG.
    ///
    /// # Errors
    /// When encoding fails.
    pub fn png(&self) -> Result<Vec<u8>> {
        // A run writes one for each picture: with the default level that takes twice as long, for files of 0.6 times the size.
        let mut bytes = Vec::new();
        let encoder = png::PngEncoder::new_with_quality(
            &mut bytes,
            png::CompressionType::Fast,
            png::FilterType::Adaptive,
        );
        self.encode(encoder)?;
        Ok(bytes)
    }

    /// The drawing as JPEG, for pages that hold many.
    ///
    /// # Errors
    /// When encoding fails.
    pub fn jpeg(&self, quality: u8) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.encode(jpeg::JpegEncoder::new_with_quality(&mut bytes, quality))?;
        Ok(bytes)
    }

    /// What is drawn is opaque: the picture below it is.
    fn encode(&self, encoder: impl ImageEncoder) -> Result<()> {
        let rgb: Vec<u8> = self.pixmap.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
        let (width, height) = (self.pixmap.width(), self.pixmap.height());
        encoder.write_image(&rgb, width, height, ExtendedColorType::Rgb8).map_err(Error::new)
    }
}

fn paint([red, green, blue]: Colour, opacity: f32) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color_rgba8(red, green, blue, (opacity.clamp(0.0, 1.0) * 255.0).round() as u8);
    paint
}
