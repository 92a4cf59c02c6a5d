//! Files that are in memory and not on a disk: in a browser, the ones that someone dropped on the page.
//!
//! Every reader of this module looks here first, so that a rig can name a camera file beside it wherever both
//! are. The files belong to the thread that offered them. A file that is too large to be offered whole is lent: a
//! function reads what is asked for.
use std::{
    cell::RefCell,
    collections::HashMap,
    fs::File,
    io::{self, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

/// Fills a piece of memory with what a file has from a byte on.
type ReadAt = Box<dyn Fn(u64, &mut [u8]) -> io::Result<()>>;

enum Held {
    Whole(Vec<u8>),
    Lent { length: u64, read: ReadAt },
}

thread_local! {
    static OFFERED: RefCell<HashMap<PathBuf, Held>> = RefCell::default();
}

/// Makes a file readable under a path, in place of another one of that path.
///
/// ```
/// use monorange_formats::files::{memory, read_times};
/// memory::offer("times.txt", b"0.0\n0.1\n".to_vec());
/// assert_eq!(read_times("times.txt".as_ref())?, [0.0, 0.1]);
/// memory::withdraw_all();
/// # Ok::<(), monorange_formats::Error>(())
/// ```
pub fn offer(path: impl Into<PathBuf>, content: Vec<u8>) {
    OFFERED.with_borrow_mut(|files| files.insert(path.into(), Held::Whole(content)));
}

/// Makes a file of `length` bytes readable under a path, piece by piece: `read` is given where a piece begins, and
/// fills it. It must not call anything of this module.
pub fn lend(
    path: impl Into<PathBuf>,
    length: u64,
    read: impl Fn(u64, &mut [u8]) -> io::Result<()> + 'static,
) {
    let held = Held::Lent { length, read: Box::new(read) };
    OFFERED.with_borrow_mut(|files| files.insert(path.into(), held));
}

/// Forgets a file.
pub fn withdraw(path: &Path) {
    OFFERED.with_borrow_mut(|files| files.remove(path));
}

/// Forgets every file that was offered or lent.
pub fn withdraw_all() {
    OFFERED.with_borrow_mut(HashMap::clear);
}

pub(super) fn copy_of(path: &Path) -> Option<Vec<u8>> {
    OFFERED.with_borrow(|files| match files.get(path)? {
        Held::Whole(content) => Some(content.clone()),
        Held::Lent { length, read } => {
            let mut content = vec![0; usize::try_from(*length).ok()?];
            read(0, &mut content).ok()?;
            Some(content)
        }
    })
}

/// The files whose folder this is; none of the disk.
pub(crate) fn inside(folder: &Path) -> Vec<PathBuf> {
    OFFERED.with_borrow(|files| files.keys().filter(|path| path.parent() == Some(folder)).cloned().collect())
}

/// Whether a file of this path is here.
pub(crate) fn holds(path: &Path) -> bool {
    OFFERED.with_borrow(|files| files.contains_key(path))
}

/// A file that is read from any place: one in memory, or one on the disk. One in memory is looked up whenever it is
/// read, so that this can go to another thread, where it is not.
#[derive(Debug)]
pub(crate) enum Opened {
    Memory { path: PathBuf, at: u64, length: u64 },
    Disk(File),
}

impl Opened {
    /// The file in memory before the one on the disk.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        let length = OFFERED.with_borrow(|files| match files.get(path)? {
            Held::Whole(content) => Some(content.len() as u64),
            Held::Lent { length, .. } => Some(*length),
        });
        match length {
            Some(length) => Ok(Self::Memory { path: path.to_owned(), at: 0, length }),
            None => Ok(Self::Disk(File::open(path)?)),
        }
    }

    /// Bytes.
    pub(crate) fn length(&self) -> io::Result<u64> {
        match self {
            Self::Memory { length, .. } => Ok(*length),
            Self::Disk(file) => Ok(file.metadata()?.len()),
        }
    }
}

impl Read for Opened {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let (path, at, length) = match self {
            Self::Disk(file) => return file.read(into),
            Self::Memory { path, at, length } => (path, at, *length),
        };
        let left = usize::try_from(length.saturating_sub(*at)).unwrap_or(usize::MAX);
        let count = left.min(into.len());
        let into = into.get_mut(..count).unwrap_or_default();
        OFFERED.with_borrow(|files| match files.get(path) {
            Some(Held::Lent { read, .. }) => read(*at, into),
            Some(Held::Whole(content)) => {
                let start = usize::try_from(*at).unwrap_or(usize::MAX);
                let piece = content.get(start..).and_then(|rest| rest.get(..count));
                into.copy_from_slice(piece.ok_or(io::ErrorKind::UnexpectedEof)?);
                Ok(())
            }
            None => Err(io::ErrorKind::NotFound.into()),
        })?;
        *at += count as u64;
        Ok(count)
    }
}

impl Seek for Opened {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let (at, length) = match self {
            Self::Disk(file) => return file.seek(to),
            Self::Memory { at, length, .. } => (at, *length),
        };
        let place = match to {
            SeekFrom::Start(place) => Some(place),
            SeekFrom::End(offset) => length.checked_add_signed(offset),
            SeekFrom::Current(offset) => at.checked_add_signed(offset),
        };
        *at = place.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(*at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lent_file_is_read_piece_by_piece() {
        let path = Path::new("lent.bin");
        lend(path, 10, |at, into| {
            assert!(at + into.len() as u64 <= 10, "beyond the end");
            into.iter_mut().zip(at..).for_each(|(byte, place)| *byte = place as u8);
            Ok(())
        });
        let mut file = Opened::open(path).unwrap();
        assert_eq!(file.length().unwrap(), 10);
        file.seek(SeekFrom::End(-3)).unwrap();
        let mut rest = Vec::new();
        file.read_to_end(&mut rest).unwrap();
        assert_eq!((rest, copy_of(path).map(|all| all.len())), (vec![7, 8, 9], Some(10)));
        offer("folder/whole.bin", vec![1, 2]);
        assert_eq!(inside(Path::new("folder")), [Path::new("folder/whole.bin")]);
        withdraw_all();
        assert!(!holds(path));
        assert!(Opened::open(path).is_err());
    }
}
