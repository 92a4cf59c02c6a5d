//! Where pictures come from, and the text files beside them.
use crate::decode::{self, Picture};
use crate::readers::{Layout, Readers, Source};
use crate::{object, wait};
use js_sys::{Function, Promise, Uint8Array};
use wasm_bindgen::prelude::*;
use web_sys::{Blob, ImageData};

/// A picture of a camera that was kept.
#[derive(Clone, Debug)]
pub(crate) struct Kept {
    pub(crate) name: String,
    pub(crate) picture: Blob,
}

/// Where the picture of a frame comes from.
#[derive(Clone, Debug)]
pub(crate) enum Frame {
    File(Source),
    Video { name: String, number: usize, fetch: Function },
    Kept(Kept),
}

/// A picture on its way. The browser works at it from the start, and not first when it is waited for.
pub(crate) enum Decoding {
    /// The first bytes of a file that the browser can decode, and the file.
    Known(Promise, Blob),
    /// The bytes of a JPEG, and the file: of one that is cut short a browser makes up the rest.
    Jpeg(Promise, Blob),
    /// The bytes of a file that is decoded elsewhere.
    Bytes(Promise),
    Fetched(Promise),
}

/// Enough of a file to hold its size, behind a camera's preview picture.
const HEAD: f64 = 65_536.0;

fn ends_in(path: &str, endings: &[&str]) -> bool {
    path.rsplit_once('.').is_some_and(|(_, end)| endings.iter().any(|known| end.eq_ignore_ascii_case(known)))
}

impl Frame {
    /// For messages and lists.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::File(file) => file.path().rsplit('/').next().unwrap_or_default().to_owned(),
            Self::Video { name, number, .. } => format!("{name}, frame {}", number + 1),
            Self::Kept(kept) => kept.name.clone(),
        }
    }

    /// Begins to decode.
    pub(crate) fn begin(&self, _readers: &Readers) -> Result<Decoding, JsValue> {
        let blob = match self {
            Self::Video { number, fetch, .. } => {
                let promise = fetch.call1(&JsValue::NULL, &(*number as f64).into())?;
                return Ok(Decoding::Fetched(promise.unchecked_into()));
            }
            Self::Kept(kept) => kept.picture.clone(),
            Self::File(file) => {
                let blob = file.blob()?;
                if ends_in(&file.path(), &["pgm", "pnm", "ppm", "pbm", "tif", "tiff"]) {
                    return Ok(Decoding::Bytes(blob.array_buffer()));
                }
                if ends_in(&file.path(), &["jpg", "jpeg"]) {
                    return Ok(Decoding::Jpeg(blob.array_buffer(), blob));
                }
                blob
            }
        };
        Ok(Decoding::Known(blob.slice_with_f64_and_f64(0.0, HEAD)?.array_buffer(), blob))
    }
}

impl Decoding {
    /// The picture, or why there is none, as the end of a sentence.
    pub(crate) async fn finish(self, readers: &Readers) -> Result<Picture, JsValue> {
        let is_jpeg = matches!(self, Self::Jpeg(..));
        match self {
            Self::Fetched(promise) => {
                let picture: ImageData = wait(promise).await?.unchecked_into();
                Ok(decode::read_pixels(&picture))
            }
            Self::Bytes(promise) => {
                decode::from_bytes(&Uint8Array::new(&wait(promise).await?), readers).await
            }
            Self::Known(promise, blob) | Self::Jpeg(promise, blob) => {
                let head = Uint8Array::new(&wait(promise).await?);
                if is_jpeg && let Some(reason) = readers.why_cut(head.clone()) {
                    return Err(object::error(&reason));
                }
                if let Some([width, height]) = readers.size_of(head).as_deref() {
                    decode::check_size(*width, *height)?;
                }
                decode::by_browser(&blob).await
            }
        }
    }
}

/// Reads the text files of a drop and says what all of its files are to one another.
pub(crate) async fn read_beside(
    files: &[Source],
    fresh: usize,
    streamed: Option<usize>,
    interval: f64,
    readers: &Readers,
) -> Result<Layout, JsValue> {
    let paths: Vec<_> = files.iter().map(Source::path).collect();
    for (file, path) in files.iter().zip(&paths) {
        if readers.wants(path) {
            let content = bytes_of(file).await.map_err(|reason| {
                object::error(&format!("{path} could not be read: {}", object::words(&reason)))
            })?;
            readers.offer(path, content);
        }
    }
    readers.layout(paths, fresh, streamed, interval)
}

async fn bytes_of(file: &Source) -> Result<Uint8Array, JsValue> {
    Ok(Uint8Array::new(&wait(file.blob()?.array_buffer()).await?))
}

/// The focal length of a photograph in pixels and its standard deviation, by its EXIF data.
pub(crate) async fn focal_of(file: &Source, width: u32, height: u32, readers: &Readers) -> Option<Vec<f64>> {
    let head = file.blob().ok()?.slice_with_f64_and_f64(0.0, 2.0 * HEAD).ok()?.array_buffer();
    readers.focal_of(Uint8Array::new(&wait(head).await.ok()?), width, height)
}
