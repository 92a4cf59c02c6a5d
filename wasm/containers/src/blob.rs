//! A file of the browser, read piece by piece; a worker may wait for it.
use std::cell::RefCell;
use std::io;
use wasm_bindgen::prelude::*;
use web_sys::{Blob, FileReaderSync};

/// Bytes that are read at once: asking the browser takes longer than copying.
const PIECE: u64 = 1 << 20;

/// A file, and the piece of it that was read last.
pub struct BlobFile {
    blob: Blob,
    length: u64,
    last: RefCell<(u64, Vec<u8>)>,
}

impl BlobFile {
    /// Nothing of it is read yet.
    pub fn new(blob: Blob) -> Self {
        let length = blob.size() as u64;
        Self { blob, length, last: RefCell::default() }
    }

    /// Bytes.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Fills `into` with what is there from byte `at` on.
    ///
    /// # Errors
    /// Where the file ends before, or the browser can no longer read it.
    pub fn read(&self, at: u64, mut into: &mut [u8]) -> io::Result<()> {
        let mut at = at;
        while !into.is_empty() {
            let mut last = self.last.borrow_mut();
            let (start, piece) = &mut *last;
            if !(*start..*start + piece.len() as u64).contains(&at) {
                *start = at / PIECE * PIECE;
                *piece = self.slice(*start, (*start + PIECE).min(self.length))?;
            }
            let rest = usize::try_from(at - *start).ok().and_then(|offset| piece.get(offset..));
            let rest = rest.filter(|rest| !rest.is_empty()).ok_or(io::ErrorKind::UnexpectedEof)?;
            let count = rest.len().min(into.len());
            let (now, later) = into.split_at_mut(count);
            now.copy_from_slice(rest.get(..count).unwrap_or_default());
            (into, at) = (later, at + count as u64);
        }
        Ok(())
    }

    fn slice(&self, from: u64, to: u64) -> io::Result<Vec<u8>> {
        let read = || -> Result<_, JsValue> {
            let slice = self.blob.slice_with_f64_and_f64(from as f64, to as f64)?;
            FileReaderSync::new()?.read_as_array_buffer(&slice)
        };
        let buffer = read().map_err(|_| {
            io::Error::other("the browser can no longer read it: it was changed or moved, open it again")
        })?;
        Ok(js_sys::Uint8Array::new(&buffer).to_vec())
    }
}
