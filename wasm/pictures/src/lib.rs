//! Pictures that browsers cannot decode, in a module that loads when the first of them comes.
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

use image::{DynamicImage, ImageDecoder, ImageReader, metadata::Orientation};
use std::io::Cursor;
use wasm_bindgen::prelude::*;

/// A decoded picture.
#[wasm_bindgen]
pub struct Picture {
    width: u32,
    height: u32,
    rgba: Vec<u8>,
}

#[wasm_bindgen]
impl Picture {
    /// The picture in a netpbm, TIFF or BMP file.
    ///
    /// # Errors
    /// Why there is none, as the end of a sentence about the file.
    #[wasm_bindgen(constructor)]
    pub fn decode(file: &[u8]) -> Result<Picture, JsError> {
        Self::new(file).map_err(|reason| JsError::new(&reason))
    }

    /// Pixels in a row.
    #[wasm_bindgen(getter)]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    #[wasm_bindgen(getter)]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Red, green, blue, alpha, row by row.
    pub fn rgba(&self) -> Vec<u8> {
        self.rgba.clone()
    }
}

impl Picture {
    /// As [`decode`](Self::decode), for Rust.
    ///
    /// # Errors
    /// As [`decode`](Self::decode).
    pub fn new(file: &[u8]) -> Result<Self, String> {
        let picture = upright(file).map_err(|error| match error {
            image::ImageError::Unsupported(_) => {
                "it is of a kind that cannot be read; save it as PNG".to_owned()
            }
            error => format!("it is damaged or cut short ({error})"),
        })?;
        let rgba = picture.to_rgba8();
        Ok(Self { width: rgba.width(), height: rgba.height(), rgba: rgba.into_raw() })
    }
}

/// The picture, turned as its orientation tag says: as browsers do with those that they decode, and the command line.
fn upright(file: &[u8]) -> image::ImageResult<DynamicImage> {
    let mut decoder = ImageReader::new(Cursor::new(file)).with_guessed_format()?.into_decoder()?;
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let mut picture = DynamicImage::from_decoder(decoder)?;
    picture.apply_orientation(orientation);
    Ok(picture)
}

#[cfg(test)]
mod tests {
    use super::Picture;

    #[test]
    fn a_colour_map_becomes_red_green_blue_alpha() {
        let picture = Picture::new(b"P6 2 1 255\n\x01\x02\x03\x04\x05\x06").unwrap();
        assert_eq!((picture.width, picture.height), (2, 1));
        assert_eq!(picture.rgba, [1, 2, 3, 255, 4, 5, 6, 255]);
    }

    #[test]
    fn what_is_wrong_is_said_in_words() {
        assert!(Picture::new(b"P6 2 1 255\n\x01").err().unwrap().starts_with("it is damaged or cut short"));
        assert!(Picture::new(b"hello").err().unwrap().contains("save it as PNG"));
    }
}
