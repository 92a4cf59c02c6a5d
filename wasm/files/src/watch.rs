//! What looks wrong in the pictures of a run, beside what their files say.
use monorange_formats::pictures::{check_whole, warn_if_dark};
use monorange_formats::plausibility::FrozenCamera;
use monorange_formats::warnings;
use std::path::Path;
use wasm_bindgen::prelude::*;

/// Looks at the pictures of one run.
#[wasm_bindgen]
#[derive(Default)]
pub struct Watch {
    frozen: FrozenCamera,
}

#[wasm_bindgen]
impl Watch {
    /// Before the first picture.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// Looks at a grey picture and at the way that the wheels have made since the one before, m.
    pub fn look(&mut self, name: &str, pixels: &[u8], way: f64) {
        warn_if_dark(Path::new(name), pixels, false);
        self.frozen.look(pixels, way);
    }

    /// Whether the camera froze so often that its pictures check nothing.
    pub fn froze(&self) -> bool {
        self.frozen.is_frozen()
    }

    /// Warns of a camera that froze; as [`froze`](Self::froze).
    pub fn judge(&self) -> bool {
        self.frozen.judge()
    }
}

/// Why a picture's file is not whole, as the end of a sentence; nothing where it is, or where its decoder finds out.
#[wasm_bindgen(js_name = whyCut)]
pub fn why_cut(file: &[u8]) -> Option<String> {
    check_whole(Path::new(""), file).err().map(|_| "it is cut short: its JPEG data has no end".to_owned())
}

/// The warnings since [`forget_all`](crate::layout::forget_all), one sentence each.
#[wasm_bindgen]
pub fn warnings() -> Vec<String> {
    warnings::all()
}

/// Those of them that were not told before.
#[wasm_bindgen(js_name = freshWarnings)]
pub fn fresh_warnings() -> Vec<String> {
    warnings::fresh()
}
