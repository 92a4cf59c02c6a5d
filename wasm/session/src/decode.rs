//! Pictures from files: what the browser knows by the browser, plain grey maps here, the rest by another module.
use crate::readers::{RarePicture, Readers};
use crate::{object, wait};
use js_sys::Uint8Array;
use std::borrow::Cow;
use wasm_bindgen::{Clamped, prelude::*};
use web_sys::{
    Blob, ColorSpaceConversion, DedicatedWorkerGlobalScope, ImageBitmap, ImageBitmapOptions, ImageData,
    OffscreenCanvas, OffscreenCanvasRenderingContext2d, PremultiplyAlpha,
};

/// A picture of more pixels would take more memory than a phone's browser gives a page.
const MOST_PIXELS: u64 = 64_000_000;

/// A decoded picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row by row.
    pub pixels: Pixels,
}

/// A picture's numbers.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// One a pixel.
    Grey(Vec<u8>),
    /// Red, green, blue, alpha.
    Colour(Vec<u8>),
}

impl Picture {
    /// In grey.
    pub fn grey(&self) -> Cow<'_, [u8]> {
        match &self.pixels {
            Pixels::Grey(pixels) => Cow::Borrowed(pixels),
            Pixels::Colour(pixels) => Cow::Owned(pixels.chunks_exact(4).map(luma).collect()),
        }
    }

    fn colours(&self) -> Cow<'_, [u8]> {
        match &self.pixels {
            Pixels::Colour(pixels) => Cow::Borrowed(pixels),
            Pixels::Grey(pixels) => {
                Cow::Owned(pixels.iter().flat_map(|&grey| [grey, grey, grey, 255]).collect())
            }
        }
    }

    /// For the screen.
    pub(crate) async fn bitmap(&self) -> Result<ImageBitmap, JsValue> {
        let colours = self.colours();
        let picture = ImageData::new_with_u8_clamped_array(Clamped(&colours), self.width as u32)?;
        Ok(wait(scope().create_image_bitmap_with_image_data(&picture)?).await?.unchecked_into())
    }
}

/// Rec. 709 luma in whole numbers, as the host reads coloured pictures.
pub fn luma(pixel: &[u8]) -> u8 {
    let [red, green, blue, ..] = *pixel else { return 0 };
    ((2126 * u32::from(red) + 7152 * u32::from(green) + 722 * u32::from(blue)) / 10_000) as u8
}

pub(crate) fn scope() -> DedicatedWorkerGlobalScope {
    js_sys::global().unchecked_into()
}

/// Whether there is room for a picture of this size.
pub(crate) fn check_size(width: u32, height: u32) -> Result<(), JsValue> {
    if u64::from(width) * u64::from(height) <= MOST_PIXELS {
        return Ok(());
    }
    Err(object::error(&format!(
        "it has {width} × {height} pixels, and this page takes {} million; make it smaller",
        MOST_PIXELS / 1_000_000
    )))
}

/// The pixels that the page gives.
pub(crate) fn read_pixels(picture: &ImageData) -> Picture {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    Picture { width, height, pixels: Pixels::Colour(picture.data().0) }
}

/// Lets the browser decode. It turns a photograph upright, as the photograph says.
pub(crate) async fn by_browser(blob: &Blob) -> Result<Picture, JsValue> {
    let options = ImageBitmapOptions::new();
    // No colour conversion: the host tool reads the numbers as they are in the file.
    options.set_color_space_conversion(ColorSpaceConversion::None);
    options.set_premultiply_alpha(PremultiplyAlpha::None);
    let decoding = scope().create_image_bitmap_with_blob_and_image_bitmap_options(blob, &options)?;
    let bitmap: ImageBitmap = wait(decoding).await.map_err(|_| {
        object::error("it cannot be decoded as a picture; it may be damaged or cut short, or of a kind that this browser does not know")
    })?.unchecked_into();
    let (width, height) = (bitmap.width(), bitmap.height());
    let context = context(width, height)?;
    context.draw_image_with_image_bitmap(&bitmap, 0.0, 0.0)?;
    bitmap.close();
    let picture = context.get_image_data(0.0, 0.0, f64::from(width), f64::from(height))?;
    Ok(read_pixels(&picture))
}

thread_local! {
    /// The canvas is made anew only for another size.
    static CANVAS: std::cell::RefCell<Option<(OffscreenCanvas, OffscreenCanvasRenderingContext2d)>> =
        const { std::cell::RefCell::new(None) };
}

fn context(width: u32, height: u32) -> Result<OffscreenCanvasRenderingContext2d, JsValue> {
    let known = CANVAS.with_borrow(|canvas| {
        let (canvas, context) = canvas.as_ref()?;
        (canvas.width() == width && canvas.height() == height).then(|| context.clone())
    });
    if let Some(context) = known {
        return Ok(context);
    }
    let canvas = OffscreenCanvas::new(width, height)?;
    let options = js_sys::Object::new();
    object::fill(&options, [("willReadFrequently", true.into())]);
    let context: OffscreenCanvasRenderingContext2d = canvas
        .get_context_with_context_options("2d", &options)?
        .ok_or_else(|| object::error("this browser gives no canvas to decode pictures with"))?
        .unchecked_into();
    context.set_global_composite_operation("copy")?;
    CANVAS.with_borrow_mut(|kept| *kept = Some((canvas, context.clone())));
    Ok(context)
}

/// A camera's picture as a small file, for another run.
pub(crate) async fn keep(picture: &ImageData) -> Result<Blob, JsValue> {
    let context = context(picture.width(), picture.height())?;
    context.put_image_data(picture, 0.0, 0.0)?;
    let canvas = CANVAS.with_borrow(|kept| kept.as_ref().map(|(canvas, _)| canvas.clone()));
    let canvas = canvas.ok_or_else(|| object::error("the picture was lost"))?;
    Ok(wait(canvas.convert_to_blob()?).await?.unchecked_into())
}

/// A plain grey map, or any kind that no browser knows.
pub(crate) async fn from_bytes(file: &Uint8Array, readers: &Readers) -> Result<Picture, JsValue> {
    if let Some(picture) = grey_map(&file.to_vec()).map_err(|reason| object::error(&reason))? {
        return Ok(picture);
    }
    let rare: RarePicture = wait(readers.decode(file.clone())).await?.unchecked_into();
    Ok(Picture { width: rare.width(), height: rare.height(), pixels: Pixels::Colour(rare.pixels()) })
}

/// A binary grey map of 8 bits, or nothing for any other kind.
///
/// # Errors
/// How much of it there is, where it is cut short.
pub fn grey_map(file: &[u8]) -> Result<Option<Picture>, String> {
    let Some((width, height, start)) = grey_map_head(file) else { return Ok(None) };
    let size = width.saturating_mul(height);
    let pixels = file.get(start..).unwrap_or_default();
    match pixels.get(..size) {
        Some(pixels) => Ok(Some(Picture { width, height, pixels: Pixels::Grey(pixels.to_vec()) })),
        None => Err(format!("it is cut short: {} of {size} pixels", pixels.len())),
    }
}

/// Width, height, and where the pixels begin.
fn grey_map_head(file: &[u8]) -> Option<(usize, usize, usize)> {
    let mut rest = file.strip_prefix(b"P5")?;
    let mut numbers = [0; 3];
    for number in &mut numbers {
        rest = skip_blanks(rest)?;
        let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
        *number = core::str::from_utf8(rest.get(..digits)?).ok()?.parse().ok()?;
        rest = rest.get(digits..)?;
    }
    let [width, height, 255] = numbers else { return None };
    let pixels = rest.get(1..)?;
    Some((width, height, file.len() - pixels.len()))
}

/// What follows white space, of which there must be some, and comments.
fn skip_blanks(mut text: &[u8]) -> Option<&[u8]> {
    let before = text.len();
    loop {
        let blanks = text.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
        text = text.get(blanks..)?;
        if text.first() != Some(&b'#') {
            return (text.len() < before).then_some(text);
        }
        let end = text.iter().position(|&byte| byte == b'\n')?;
        text = text.get(end..)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grey_map_with_a_comment_is_read() {
        let picture = grey_map(b"P5\n# by hand\n3 2\n255\n\x01\x02\x03\x04\x05\x06").unwrap().unwrap();
        assert_eq!((picture.width, picture.height, &*picture.grey()), (3, 2, &[1, 2, 3, 4, 5, 6][..]));
    }

    #[test]
    fn a_grey_map_that_is_cut_short_says_so() {
        assert_eq!(grey_map(b"P5 3 2 255\n\x01\x02\x03").unwrap_err(), "it is cut short: 3 of 6 pixels");
    }

    #[test]
    fn other_kinds_are_left_to_others() {
        assert_eq!(grey_map(b"P5 3 2 65535\n"), Ok(None));
        assert_eq!(grey_map(b"P6 3 2 255\n"), Ok(None));
    }

    #[test]
    fn grey_in_colour_is_the_same_grey() {
        for grey in 0..=255 {
            assert_eq!(luma(&[grey, grey, grey, 255]), grey);
        }
    }
}
