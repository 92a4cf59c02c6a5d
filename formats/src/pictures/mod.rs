//! Folders of pictures, and pictures as grey pixels.
mod frames;
mod jpeg;

pub use frames::{Frames, beside, frames, times_in_names};

use crate::{
    Error, Result,
    files::{inputs, io_error, sort_names},
    plausibility,
};
use image::{DynamicImage, ImageDecoder, ImageReader, metadata::Orientation};
use monorange_core::image::Grey;
use std::{
    fs,
    io::Cursor,
    path::{Path, PathBuf},
};

/// What a picture's name ends in.
const EXTENSIONS: [&str; 6] = ["png", "jpg", "jpeg", "pgm", "ppm", "pnm"];

/// What pictures end in that are not read: they are said rather than passed over.
const OTHERS: [&str; 13] =
    ["bmp", "gif", "tif", "tiff", "webp", "heic", "heif", "avif", "exr", "jp2", "jxl", "dng", "raw"];

/// A decoded picture: 8-bit grey, row-major.
#[derive(Clone, Debug)]
pub struct Picture {
    /// `width * height` grey values.
    pub pixels: Vec<u8>,
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Picture {
    /// The picture in a PNG, JPEG or PNM file; colours become luma (ITU-R BT.709). A picture that its EXIF data calls
    /// turned is turned, as viewers and calibration programs do.
    ///
    /// # Errors
    /// When the file cannot be read, is cut short, or is none of these formats.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = fs::read(path).map_err(|error| io_error(&error).at(path))?;
        inputs::note(path);
        Self::decode(path, &bytes)
    }

    /// The picture in the bytes of a file; `path` is named in errors.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn decode(path: &Path, bytes: &[u8]) -> Result<Self> {
        check_whole(path, bytes)?;
        let reader = ImageReader::new(Cursor::new(bytes))
            .with_guessed_format()
            .map_err(|error| io_error(&error).at(path))?;
        let decoded = reader.into_decoder().and_then(|mut decoder| {
            let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
            let mut image = DynamicImage::from_decoder(decoder)?;
            image.apply_orientation(orientation);
            Ok(image)
        });
        let image = decoded.map_err(|error| undecodable(path, &error))?;
        let deep = matches!(
            image,
            DynamicImage::ImageLuma16(_)
                | DynamicImage::ImageLumaA16(_)
                | DynamicImage::ImageRgb16(_)
                | DynamicImage::ImageRgba16(_)
        );
        let grey = image.to_luma8();
        let (width, height) = (grey.width() as usize, grey.height() as usize);
        let pixels = grey.into_raw();
        warn_if_dark(path, &pixels, deep);
        Ok(Self { pixels, width, height })
    }

    /// (width, height) as the head of a PNG, JPEG or PNM file says, if it can be read.
    pub fn size_of(bytes: &[u8]) -> Option<[usize; 2]> {
        let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().ok()?;
        reader.into_dimensions().ok().map(|(width, height)| [width as usize, height as usize])
    }

    /// The grey pixels as the core reads them.
    ///
    /// # Errors
    /// When the picture has no pixels.
    pub fn grey(&self) -> Result<Grey<'_>> {
        Grey::new(&self.pixels, self.width, self.height).map_err(Error::new)
    }
}

/// Fails when a file is empty, or a JPEG has no end or too little data for its size. Decoders, browsers' too, fill what is missing with grey, and grey has corners.
///
/// # Errors
/// Names the picture.
pub fn check_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let cause = match bytes {
        [] => "the file is empty",
        _ if jpeg::is_cut(bytes) => "the picture is cut short: its JPEG data has no end",
        _ if jpeg::is_too_short(bytes) => "the picture is damaged: its JPEG data is too short for its size",
        _ => return Ok(()),
    };
    Err(Error::new(cause).at(path).help("copy the picture again, or leave it out"))
}

/// Warns of a picture that is almost black; `deep`: it has 16 bits a pixel, and bits of a sensor in their lower part leave it so.
pub fn warn_if_dark(path: &Path, pixels: &[u8], deep: bool) {
    let brightest = pixels.iter().copied().max().unwrap_or_default();
    // Of 12 bits in 16 the brightest grey is 15 of 255, of 14 bits 63.
    let dark = match brightest {
        0..=15 => "almost black: no pixel is brighter than 6 %",
        16..=63 if deep => "dark: no pixel is brighter than 25 %",
        _ => return,
    };
    Error::new(format!("the picture is {dark} of the range")).at(path).help(match deep {
        true => "it looks like 10, 12 or 14 bits in a 16-bit file: write the pictures with values shifted to the top",
        false => "check the exposure",
    }).warn();
}

fn undecodable(path: &Path, error: &image::ImageError) -> Error {
    let (cause, help) = match error {
        image::ImageError::Unsupported(_) => {
            ("is not a PNG, JPEG or PNM picture".to_owned(), "save it as PNG")
        }
        error => (format!("the picture is damaged or cut short ({error})"), "write the picture again"),
    };
    Error::new(cause).at(path).help(format!("{help}, or leave it out"))
}

/// Fails when a picture says, in its header, that it has another size than the rig's camera. A picture whose
/// header cannot be read passes: decoding will name it.
///
/// # Errors
/// Names the picture and both sizes.
pub fn check_size(path: &Path, width: usize, height: usize) -> Result<()> {
    inputs::note(path);
    let decoder = ImageReader::open(path).and_then(ImageReader::with_guessed_format).ok();
    let Some(mut decoder) = decoder.and_then(|reader| reader.into_decoder().ok()) else { return Ok(()) };
    let (w, h) = decoder.dimensions();
    let [w, h] = [w as usize, h as usize];
    let upright = match decoder.orientation().unwrap_or(Orientation::NoTransforms) {
        Orientation::NoTransforms
        | Orientation::Rotate180
        | Orientation::FlipHorizontal
        | Orientation::FlipVertical => [w, h],
        _ => [h, w],
    };
    plausibility::check_picture(path, upright, [width, height])
}

/// The pictures in a folder, in the natural order of their names (2.png before 10.png; 0.15.png before 0.2.png where
/// all names are decimal numbers). What is no file is passed over; pictures of other formats are, with a warning.
///
/// # Errors
/// When the folder cannot be read or holds no picture.
pub fn in_folder(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |error: std::io::Error| io_error(&error).at(folder);
    let (mut pictures, mut others) = (Vec::new(), Vec::new());
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let hidden = path.file_name().is_none_or(|name| name.to_string_lossy().starts_with('.'));
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        let named = |list: &[&str]| extension.as_deref().is_some_and(|extension| list.contains(&extension));
        // A link that leads nowhere stays: reading it will name it.
        if hidden || path.is_dir() {
            continue;
        }
        if named(&EXTENSIONS) {
            pictures.push(path);
        } else if named(&OTHERS) {
            others.push(path.file_name().unwrap_or_default().to_string_lossy().into_owned());
        }
    }
    others.sort();
    let other = others
        .first()
        .map(|first| format!("{} pictures of formats that are not read ({first})", others.len()));
    if pictures.is_empty() {
        let cause = format!("the folder holds no picture ({})", EXTENSIONS.join(", "));
        return Err(Error::new(cause).at(folder).help(match other {
            Some(other) => format!("it holds {other}: convert them to PNG"),
            None => "name the folder that the frames are in".to_owned(),
        }));
    }
    if let Some(other) = other {
        let cause = format!("the folder holds {other}");
        Error::new(cause).at(folder).help("they are left out: convert them to PNG").warn();
    }
    sort_names(&mut pictures, |path| path.file_name().unwrap_or_default().to_string_lossy().into_owned());
    Ok(pictures)
}
