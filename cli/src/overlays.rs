//! Pictures that a command draws over its inputs, into a folder in which nobody else's pictures are written over.
use crate::outputs::Outputs;
use monorange_formats::{Error, Result};
use std::{
    collections::HashSet,
    path::{Path, PathBuf},
};

/// A folder of overlays, which appear together.
#[derive(Debug)]
pub struct Overlays {
    folder: PathBuf,
    outputs: Outputs,
    names: HashSet<String>,
}

impl Overlays {
    /// Overlays into a folder, which is made if it is not there.
    ///
    /// # Errors
    /// When the folder cannot be made.
    pub fn into_folder(folder: &Path) -> Result<Self> {
        Ok(Self { folder: folder.to_owned(), outputs: Outputs::into_folder(folder)?, names: HashSet::new() })
    }

    /// Writes what was drawn over `image`.
    ///
    /// # Errors
    /// When a picture of its name is there that is no overlay, or it cannot be written.
    pub fn write(&mut self, image: &Path, png: &[u8]) -> Result<()> {
        let name = overlay_name(image, &mut self.names);
        let there = self.folder.join(&name);
        if there.exists() && !is_overlay(&there) {
            let error = Error::new("is a picture that this command did not draw, and would be written over");
            return Err(error.at(there).help("name another folder with --overlay"));
        }
        self.outputs.write(&name, |out| out.write_all(&marked(png)))
    }

    /// Gives every overlay its name.
    ///
    /// # Errors
    /// When one cannot be written.
    pub fn commit(self) -> Result<()> {
        self.outputs.commit()
    }
}

/// The text chunk by which an overlay of an earlier run is known, as it may be written over.
const MARK: &[u8] = b"tEXtSoftware\0monorange landmarks";

/// A PNG with [`MARK`] behind its first chunk, which has a fixed size.
fn marked(png: &[u8]) -> Vec<u8> {
    const HEAD: usize = 8 + 25;
    let Some((head, rest)) = png.split_at_checked(HEAD) else { return png.to_vec() };
    let length = (MARK.len() as u32 - 4).to_be_bytes();
    let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(MARK).to_be_bytes();
    [head, &length, MARK, &sum, rest].concat()
}

fn is_overlay(path: &Path) -> bool {
    use std::io::Read;
    let mut begin = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(128).read_to_end(&mut begin));
    read.is_ok() && begin.windows(MARK.len()).any(|bytes| bytes == MARK)
}

/// The overlay's name: the picture's, numbered where two pictures of different folders share one.
fn overlay_name(image: &Path, taken: &mut HashSet<String>) -> String {
    let stem = image.file_stem().unwrap_or_default().to_string_lossy();
    let numbered =
        (1..).map(|number| if number == 1 { format!("{stem}.png") } else { format!("{stem}-{number}.png") });
    let name = numbered.into_iter().find(|name| !taken.contains(name)).unwrap_or_default();
    taken.insert(name.clone());
    name
}
