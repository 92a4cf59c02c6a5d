//! Drawing over pictures: what was found, where the floor is, and how far things are.
//!
//! | module | what |
//! |---|---|
//! | `canvas` | anti-aliased lines, dots and ellipses in the picture's pixels |
//! | `text` | labels with a dark rim, legible on anything, that do not cover each other |
//! | `floor` | the horizon and the floor's 1 m grid as lines of the picture |
//! | `overlay` | all of it over one picture |
mod canvas;
mod floor;
mod overlay;
mod text;

pub use canvas::{Canvas, Colour, GREEN, ORANGE, PURPLE, SKY, Stroke, VERMILLION, WHITE, YELLOW};
pub use overlay::{LegendItem, Mark, Overlay, SEEN, Shape};
