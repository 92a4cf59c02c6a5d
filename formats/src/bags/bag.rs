use super::{mcap_file::McapFile, sqlite::Database};
use crate::{
    Error, Result,
    files::{inputs, io_error, natural_order},
};
use std::{
    collections::BTreeMap,
    fs,
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
        let failed = |error: std::io::Error| io_error(&error).at(path);
        let mut paths = vec![path.to_owned()];
        if fs::metadata(path).map_err(failed)?.is_dir() {
            paths.clear();
            for entry in fs::read_dir(path).map_err(failed)? {
                let file = entry.map_err(failed)?.path();
                let extension = file.extension().and_then(|extension| extension.to_str());
                if matches!(extension, Some("mcap" | "db3" | "zstd")) {
                    paths.push(file);
                }
            }
            paths.sort_by(|a, b| natural_order(&a.to_string_lossy(), &b.to_string_lossy()));
        }
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

    /// Shows every message to `visit`, in the files' order; gives all topics and what is wrong with the files' ends.
    pub(super) fn scan(
        &self,
        visit: &mut dyn FnMut(&Passing<'_>) -> Result<()>,
    ) -> Result<(Vec<Topic>, Vec<Error>)> {
        let (mut topics, mut warnings) = (BTreeMap::new(), Vec::new());
        for (file, store) in self.files.iter().enumerate() {
            let (found, warning) = match store {
                Store::Mcap(mcap) => mcap.scan(file, visit)?,
                Store::Sqlite(database) => (database.scan(file, visit)?, None),
            };
            warnings.extend(warning);
            for topic in found {
                let known =
                    topics.entry(topic.name.clone()).or_insert(Topic { messages: 0, ..topic.clone() });
                known.messages += topic.messages;
            }
        }
        Ok((topics.into_values().collect(), warnings))
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

impl Store {
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
    use std::io::Read;
    let mut start = Vec::new();
    fs::File::open(path)?.take(16).read_to_end(&mut start)?;
    Ok(start)
}
