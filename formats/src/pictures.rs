//! Folders of pictures, and pictures as grey pixels.
use crate::{
    Error, Result,
    files::{io_error, natural_order},
};
use image::ImageReader;
use monorange_core::image::Grey;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// What a picture's name ends in.
const EXTENSIONS: [&str; 6] = ["png", "jpg", "jpeg", "pgm", "ppm", "pnm"];

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
    /// The picture in a PNG, JPEG or PNM file; colours become luma (ITU-R BT.709).
    ///
    /// # Errors
    /// When the file cannot be read, is cut short, or is none of these formats.
    pub fn read(path: &Path) -> Result<Self> {
        let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
        let image = reader
            .map_err(|error| io_error(&error).at(path))?
            .decode()
            .map_err(|error| undecodable(path, &error))?;
        let grey = image.to_luma8();
        let (width, height) = (grey.width() as usize, grey.height() as usize);
        Ok(Self { pixels: grey.into_raw(), width, height })
    }

    /// The grey pixels as the core reads them.
    ///
    /// # Errors
    /// When the picture has no pixels.
    pub fn grey(&self) -> Result<Grey<'_>> {
        Grey::new(&self.pixels, self.width, self.height).map_err(Error::new)
    }
}

fn undecodable(path: &Path, error: &image::ImageError) -> Error {
    let cause = match error {
        image::ImageError::Unsupported(_) => "is not a PNG, JPEG or PNM picture".to_owned(),
        error => format!("the picture is damaged or cut short ({error})"),
    };
    Error::new(cause).at(path).help("write the picture again, or leave it out")
}

/// Fails when a picture says, in its header, that it has another size than the rig's camera. A picture whose
/// header cannot be read passes: decoding will name it.
///
/// # Errors
/// Names the picture and both sizes.
pub fn check_size(path: &Path, width: usize, height: usize) -> Result<()> {
    let size = ImageReader::open(path)
        .and_then(ImageReader::with_guessed_format)
        .ok()
        .and_then(|r| r.into_dimensions().ok());
    match size {
        Some((w, h)) if (w as usize, h as usize) != (width, height) => {
            let cause = format!("the picture is {w}×{h}, the rig's camera {width}×{height}");
            Err(Error::new(cause)
                .at(path)
                .help("give pictures as they were calibrated, or a rig for this size"))
        }
        _ => Ok(()),
    }
}

/// The pictures in a folder, in the natural order of their names (2.png before 10.png).
///
/// # Errors
/// When the folder cannot be read or holds no picture.
pub fn in_folder(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |error: std::io::Error| io_error(&error).at(folder);
    let mut pictures = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let hidden = path.file_name().is_none_or(|name| name.to_string_lossy().starts_with('.'));
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        if !hidden && extension.is_some_and(|extension| EXTENSIONS.contains(&extension.as_str())) {
            pictures.push(path);
        }
    }
    if pictures.is_empty() {
        let cause = format!("the folder holds no picture ({})", EXTENSIONS.join(", "));
        return Err(Error::new(cause).at(folder).help("name the folder that the frames are in"));
    }
    pictures.sort_by(|a, b| natural_order(&a.to_string_lossy(), &b.to_string_lossy()));
    Ok(pictures)
}
