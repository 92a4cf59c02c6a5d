use super::{
    mcap_file::{self, McapFile},
    sqlite::{self, Database},
};
use crate::{
    Error, Result,
    files::{
        inputs, io_error,
        memory::{self, Opened},
        natural_order,
    },
};
use std::{
    collections::BTreeMap,
    fs,
    io::Read,
    path::{Path, PathBuf},
};

/// A topic of a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Topic {
    /// Its name, `/camera/image_raw`.
    pub name: String,
    /// Its messages' type, `sensor_msgs/msg/Image`.
    pub kind: String,
    /// How they are encoded, `cdr`.
    pub encoding: String,
    /// How many there are.
    pub messages: usize,
}

/// Where a message is: a file of the recording, a chunk or page of that file, and a place in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) file: usize,
    pub(super) at: u64,
    pub(super) index: usize,
}

/// One file of a recording.
#[derive(Debug)]
enum Store {
    Mcap(McapFile),
    Sqlite(Database),
}

/// A recording: an `.mcap` file, a `.db3` file, or the folder that rosbag2 makes of them.
#[derive(Debug)]
pub struct Bag {
    path: PathBuf,
    files: Vec<Store>,
}

/// A message on its way past: its topic, when it was recorded (ns), its bytes, and where it is.
pub(super) struct Passing<'a> {
    pub(super) topic: &'a Topic,
    pub(super) recorded: u64,
    pub(super) data: &'a [u8],
    pub(super) place: Place,
}

impl Bag {
    /// The recording at `path`.
    ///
    /// # Errors
    /// When nothing is there, or it is neither MCAP nor SQLite nor a folder that holds such files.
    pub fn open(path: &Path) -> Result<Self> {
        let mut paths = contents(path).map_err(|error| io_error(&error).at(path))?;
        paths.sort_by(|a, b| natural_order(&a.to_string_lossy(), &b.to_string_lossy()));
        if paths.is_empty() {
            let error = Error::new("the folder holds no .mcap and no .db3 file").at(path);
            return Err(error.help("name a recording: an .mcap file, a .db3 file or rosbag2's folder"));
        }
        let files = paths.iter().map(|file| Store::open(file)).collect::<Result<_>>()?;
        Ok(Self { path: path.to_owned(), files })
    }

    /// The file or folder that was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes of its files together.
    pub(super) fn length(&self) -> u64 {
        self.files.iter().map(Store::length).sum()
    }

    /// The bytes of a message that passed.
    pub(super) fn fetch(&self, place: Place) -> Result<Vec<u8>> {
        match self.files.get(place.file) {
            Some(Store::Mcap(mcap)) => mcap.fetch(place.at, place.index),
            Some(Store::Sqlite(database)) => database.fetch(place.at, place.index),
            None => Err(Error::new("has no such message").at(&self.path)),
        }
    }
}

/// Goes through a recording's messages once, in the files' order, a stretch at a time.
#[derive(Default)]
pub(super) struct Walk {
    file: usize,
    store: Option<StoreWalk>,
    topics: BTreeMap<String, Topic>,
    /// What is wrong with the files' ends.
    warnings: Vec<Error>,
    /// Bytes of the files that are done.
    done: u64,
}

enum StoreWalk {
    Mcap(Box<mcap_file::Walk>),
    Sqlite(sqlite::Walk),
}

impl Walk {
    /// Shows the messages in about so many bytes more to `visit`; whether there are others.
    pub(super) fn go_on(
        &mut self,
        bag: &Bag,
        bytes: u64,
        visit: &mut dyn FnMut(&Passing<'_>) -> Result<()>,
    ) -> Result<bool> {
        let Some(store) = bag.files.get(self.file) else { return Ok(false) };
        let walk = match &mut self.store {
            Some(walk) => walk,
            none => none.insert(match store {
                Store::Mcap(mcap) => StoreWalk::Mcap(Box::new(mcap.walk()?)),
                Store::Sqlite(database) => StoreWalk::Sqlite(database.walk()?),
            }),
        };
        let more = match (store, &mut *walk) {
            (Store::Mcap(mcap), StoreWalk::Mcap(walk)) => walk.go_on(mcap, self.file, bytes, visit)?,
            (Store::Sqlite(database), StoreWalk::Sqlite(walk)) => {
                walk.go_on(database, self.file, bytes, visit)?
            }
            _ => false,
        };
        if more {
            return Ok(true);
        }
        let (found, warning) = match (store, self.store.take()) {
            (Store::Mcap(mcap), Some(StoreWalk::Mcap(walk))) => walk.end(mcap),
            (_, Some(StoreWalk::Sqlite(walk))) => (walk.end(), None),
            _ => (Vec::new(), None),
        };
        self.warnings.extend(warning);
        for topic in found {
            let known =
                self.topics.entry(topic.name.clone()).or_insert(Topic { messages: 0, ..topic.clone() });
            known.messages += topic.messages;
        }
        (self.file, self.done) = (self.file + 1, self.done + store.length());
        Ok(self.file < bag.files.len())
    }

    /// Bytes that are done.
    pub(super) fn done(&self) -> u64 {
        let here = self.store.as_ref().map_or(0, |walk| match walk {
            StoreWalk::Mcap(walk) => walk.done(),
            StoreWalk::Sqlite(walk) => walk.done(),
        });
        self.done + here
    }

    /// All topics, and what is wrong with the files' ends.
    pub(super) fn end(self) -> (Vec<Topic>, Vec<Error>) {
        (self.topics.into_values().collect(), self.warnings)
    }
}

/// The file itself, or the files of a recording's folder.
fn contents(path: &Path) -> std::io::Result<Vec<PathBuf>> {
    let is_part = |file: &PathBuf| {
        let extension = file.extension().and_then(|extension| extension.to_str());
        matches!(extension, Some("mcap" | "db3" | "zstd"))
    };
    let inside: Vec<_> = memory::inside(path).into_iter().filter(is_part).collect();
    if memory::holds(path) {
        return Ok(vec![path.to_owned()]);
    } else if !inside.is_empty() {
        return Ok(inside);
    } else if !fs::metadata(path)?.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let files = fs::read_dir(path)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
    Ok(files.into_iter().filter(is_part).collect())
}

impl Store {
    fn length(&self) -> u64 {
        match self {
            Self::Mcap(mcap) => mcap.length(),
            Self::Sqlite(database) => database.length(),
        }
    }

    fn open(path: &Path) -> Result<Self> {
        let start = first_bytes(path).map_err(|error| io_error(&error).at(path))?;
        inputs::note(path);
        match start.as_slice() {
            [0x89, b'M', b'C', b'A', b'P', ..] => Ok(Self::Mcap(McapFile::open(path)?)),
            [b'S', b'Q', b'L', b'i', b't', b'e', ..] => Ok(Self::Sqlite(Database::open(path)?)),
            [b'#', b'R', b'O', b'S', b'B', b'A', b'G', ..] => Err(Error::new("is a bag of ROS 1")
                .at(path)
                .help("turn it into ROS 2's: `rosbags-convert --src old.bag --dst new` (PyPI: rosbags)")),
            [0x28, 0xb5, 0x2f, 0xfd, ..] => Err(Error::new("is packed as a whole (zstd)")
                .at(path)
                .help("unpack it first: `zstd -d FILE`, then name the unpacked file")),
            [] => Err(Error::new("is empty").at(path).help("copy the file again, or record the drive again")),
            _ => Err(Error::new("is neither MCAP nor a rosbag2 database")
                .at(path)
                .help("name a recording: an .mcap file, a .db3 file or rosbag2's folder")),
        }
    }
}

fn first_bytes(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut start = Vec::new();
    Opened::open(path)?.take(16).read_to_end(&mut start)?;
    Ok(start)
}
