//! A ZIP archive: the list of its files, and each of them when it is read.
use crate::blob::BlobFile;
use std::io::{self, Read, Seek, SeekFrom};
use wasm_bindgen::prelude::*;
use web_sys::Blob;
use zip::{ZipArchive, result::ZipError};

/// A file of more bytes is not unpacked: a page has no room for it.
const LARGEST: u64 = 512 << 20;

/// A file of the browser, with a place that is read next.
struct Cursor {
    file: BlobFile,
    at: u64,
}

impl Read for Cursor {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let left = usize::try_from(self.file.length().saturating_sub(self.at)).unwrap_or(usize::MAX);
        let count = left.min(into.len());
        self.file.read(self.at, into.get_mut(..count).unwrap_or_default())?;
        self.at += count as u64;
        Ok(count)
    }
}

impl Seek for Cursor {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let place = match to {
            SeekFrom::Start(place) => Some(place),
            SeekFrom::End(offset) => self.file.length().checked_add_signed(offset),
            SeekFrom::Current(offset) => self.at.checked_add_signed(offset),
        };
        self.at = place.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.at)
    }
}

/// An open archive.
#[wasm_bindgen]
pub struct Archive {
    archive: ZipArchive<Cursor>,
    paths: Vec<String>,
    places: Vec<usize>,
    notes: Vec<String>,
}

#[wasm_bindgen]
impl Archive {
    /// The archive of this name.
    ///
    /// # Errors
    /// A sentence, where it is damaged or no archive at all.
    #[wasm_bindgen(constructor)]
    pub fn open(name: &str, blob: Blob) -> Result<Archive, JsError> {
        let file = BlobFile::new(blob);
        let archive = ZipArchive::new(Cursor { file, at: 0 })
            .map_err(|error| JsError::new(&format!("{name}: {}", why_unread(&error))))?;
        let (mut paths, mut places) = (Vec::new(), Vec::new());
        for place in 0..archive.len() {
            // A name that is no text can be left out: no file of a sequence has one.
            let Some(Ok(path)) = archive.name_for_index(place) else { continue };
            let path = path.replace('\\', "/");
            if !path.ends_with('/') {
                paths.push(path);
                places.push(place);
            }
        }
        let stem = name.rsplit('/').next().unwrap_or(name);
        let stem = stem.rsplit_once('.').map_or(stem, |(stem, _)| stem);
        let mut notes = Vec::new();
        let before = paths.len();
        let safe = |path: &str| path.split('/').all(|part| !part.is_empty() && part != "." && part != "..");
        (paths, places) = paths.into_iter().zip(places).filter(|(path, _)| safe(path)).unzip();
        if paths.len() < before {
            notes
                .push(format!("{} files of {name} lead out of it and are left aside.", before - paths.len()));
        }
        // As the folder would be that it was made of.
        let top = paths.first().and_then(|path| path.split_once('/')).map(|(top, _)| format!("{top}/"));
        if !top.is_some_and(|top| paths.iter().all(|path| path.starts_with(&top))) {
            paths.iter_mut().for_each(|path| *path = format!("{stem}/{path}"));
        }
        Ok(Self { archive, paths, places, notes })
    }

    /// The paths of its files, as in the folder that it was made of.
    #[wasm_bindgen(getter)]
    pub fn paths(&self) -> Vec<String> {
        self.paths.clone()
    }

    /// Sentences about what is left aside.
    #[wasm_bindgen(getter)]
    pub fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    /// The content of a file, by its place among the paths.
    ///
    /// # Errors
    /// The end of a sentence about the file.
    pub fn read(&mut self, index: usize) -> Result<Vec<u8>, JsError> {
        let place = self.places.get(index).copied().ok_or_else(|| JsError::new("it is not there"))?;
        let mut file = self.archive.by_index(place).map_err(|error| JsError::new(&why_unread(&error)))?;
        let size = file.size();
        if size > LARGEST {
            return Err(JsError::new(&format!(
                "it has {} MB unpacked, and this page unpacks {}; unpack the archive, then open the folder",
                size >> 20,
                LARGEST >> 20
            )));
        }
        let mut content = Vec::new();
        // One that says it is smaller than it is ends where it says.
        let read = file.by_ref().take(size + 1).read_to_end(&mut content);
        match read {
            Ok(count) if count as u64 == size => Ok(content),
            _ => Err(JsError::new("it is damaged in the archive; make the archive again")),
        }
    }
}

/// Why nothing is read, as the end of a sentence.
fn why_unread(error: &ZipError) -> String {
    match error {
        ZipError::UnsupportedArchive(ZipError::PASSWORD_REQUIRED) => {
            "it is encrypted; unpack it with its password, then open the folder".to_owned()
        }
        ZipError::UnsupportedArchive(why) => {
            format!(
                "it is packed in a way that this page does not know ({why}); unpack it, then open the folder"
            )
        }
        ZipError::Io(error) if error.kind() != io::ErrorKind::UnexpectedEof => error.to_string(),
        _ => "the archive is damaged or cut short; copy it or make it again".to_owned(),
    }
}
