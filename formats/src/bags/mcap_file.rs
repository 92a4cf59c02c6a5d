//! MCAP: records in chunks, which may be packed.
use super::bag::{Passing, Place, Topic};
use crate::{
    Error, Result,
    files::{io_error, memory::Opened},
};
use mcap::{
    McapError,
    records::{Record, op::FOOTER},
    sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions},
};
use std::{
    collections::HashMap,
    io::{BufReader, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

/// Bytes of the mark that a file begins with, and of a record's head: its kind and its length.
const MAGIC: u64 = 8;
const HEAD: u64 = 9;
/// Bytes that are read at once.
const AT_ONCE: usize = 1 << 16;
/// More than a record of a camera has; beyond it a length is damage.
const LONGEST: usize = 1 << 30;

/// An MCAP file; of its chunks the last one that was asked for is kept.
#[derive(Debug)]
pub(super) struct McapFile {
    path: PathBuf,
    length: u64,
    unpacked: Mutex<Option<(u64, Vec<u8>)>>,
}

/// Schemas and channels as they come by.
#[derive(Default)]
struct Channels {
    schemas: HashMap<u16, String>,
    topics: HashMap<u16, Topic>,
}

impl McapFile {
    pub(super) fn open(path: &Path) -> Result<Self> {
        let length = Opened::open(path).and_then(|file| file.length());
        let length = length.map_err(|error| io_error(&error).at(path))?;
        Ok(Self { path: path.to_owned(), length, unpacked: Mutex::default() })
    }

    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// From the first message on.
    pub(super) fn walk(&self) -> Result<Walk> {
        let file = Opened::open(&self.path).map_err(|error| io_error(&error).at(&self.path))?;
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_skip_end_magic(true)
            .with_record_length_limit(LONGEST);
        Ok(Walk {
            file: BufReader::with_capacity(AT_ONCE, file),
            reader: LinearReader::new_with_options(options),
            channels: Channels::default(),
            at: MAGIC,
            complete: false,
            ended: None,
        })
    }

    /// The bytes of the message that passed as record `index` of what is at byte `at`.
    pub(super) fn fetch(&self, at: u64, index: usize) -> Result<Vec<u8>> {
        let mut unpacked = self.unpacked.lock().unwrap_or_else(PoisonError::into_inner);
        let content = match unpacked.take() {
            Some((of, content)) if of == at => content,
            _ => self.content(at)?,
        };
        let (_, content) = unpacked.insert((at, content));
        match mcap::read::LinearReader::sans_magic(content).nth(index) {
            Some(Ok(Record::Message { data, .. })) => Ok(data.into_owned()),
            Some(Err(error)) => Err(self.damaged(&error)),
            _ => Err(Error::new("changed while it was read").at(&self.path).help("try again")),
        }
    }

    /// The records of the chunk at byte `at`, or the record there if it is no chunk.
    fn content(&self, at: u64) -> Result<Vec<u8>> {
        let failed = |error: std::io::Error| io_error(&error).at(&self.path);
        let mut file = Opened::open(&self.path).map_err(failed)?;
        file.seek(SeekFrom::Start(at)).map_err(failed)?;
        let mut head = [0; HEAD as usize];
        file.read_exact(&mut head).map_err(failed)?;
        let [kind, length @ ..] = head;
        let mut record = head.to_vec();
        file.take(u64::from_le_bytes(length)).read_to_end(&mut record).map_err(failed)?;
        let body = record.get(HEAD as usize..).unwrap_or_default();
        match mcap::parse_record(kind, body).map_err(|error| self.damaged(&error))? {
            Record::Chunk { header, data } => {
                self.unpack(&header.compression, header.uncompressed_size, &data)
            }
            _ => Ok(record),
        }
    }

    fn unpack(&self, compression: &str, size: u64, data: &[u8]) -> Result<Vec<u8>> {
        let mut content = Vec::new();
        let unpacked = match compression {
            "" => return Ok(data.to_vec()),
            "zstd" => ruzstd::decoding::StreamingDecoder::new(data)
                .map_err(std::io::Error::other)
                .and_then(|decoder| decoder.take(LONGEST as u64).read_to_end(&mut content)),
            "lz4" => lz4_flex::frame::FrameDecoder::new(data).take(LONGEST as u64).read_to_end(&mut content),
            other => {
                let error = Error::new(format!("has chunks packed by `{other}`, not by zstd or lz4"));
                return Err(error.at(&self.path).help("`mcap compress --compression zstd` packs them anew"));
            }
        };
        match unpacked {
            Ok(bytes) if bytes as u64 == size => Ok(content),
            Ok(_) => Err(self.damaged(&"a chunk has another size than it says")),
            Err(error) => Err(self.damaged(&error)),
        }
    }

    fn damaged(&self, error: &dyn std::fmt::Display) -> Error {
        Error::new(format!("is damaged: {error}"))
            .at(&self.path)
            .help("`mcap recover` saves what is whole, or record the drive again")
    }
}

/// On its way from a file's first message to its last.
pub(super) struct Walk {
    file: BufReader<Opened>,
    reader: LinearReader,
    channels: Channels,
    /// Where the next record begins.
    at: u64,
    /// Whether the footer passed.
    complete: bool,
    /// What ended the file before its end.
    ended: Option<McapError>,
}

impl Walk {
    /// Shows the messages in about so many bytes more to `visit`; whether there are others. A file that is cut short
    /// gives what is there.
    pub(super) fn go_on(
        &mut self,
        mcap: &McapFile,
        file: usize,
        bytes: u64,
        visit: &mut dyn FnMut(&Passing<'_>) -> Result<()>,
    ) -> Result<bool> {
        let until = self.at + bytes;
        while self.at < until {
            let (kind, body) = match self.reader.next_event() {
                None => return Ok(false),
                Some(Ok(LinearReadEvent::ReadRequest(bytes))) => {
                    let read = self.file.read(self.reader.insert(bytes));
                    self.reader.notify_read(read.map_err(|error| io_error(&error).at(&mcap.path))?);
                    continue;
                }
                Some(Ok(LinearReadEvent::Record { data, opcode })) => (opcode, data),
                Some(Err(error @ (McapError::UnexpectedEof | McapError::RecordTooLarge { .. }))) => {
                    self.ended = Some(error);
                    return Ok(false);
                }
                Some(Err(error)) => return Err(mcap.damaged(&error)),
            };
            let record = mcap::parse_record(kind, body).map_err(|error| mcap.damaged(&error))?;
            let place = |index| Place { file, at: self.at, index };
            if let Record::Chunk { header, data } = &record {
                let content = mcap.unpack(&header.compression, header.uncompressed_size, data)?;
                let within = mcap::read::LinearReader::sans_magic(&content);
                for (index, record) in within.enumerate() {
                    let record = record.map_err(|error| mcap.damaged(&error))?;
                    self.channels.pass(&record, place(index), visit)?;
                }
            } else {
                self.channels.pass(&record, place(0), visit)?;
            }
            self.at += HEAD + body.len() as u64;
            self.complete |= kind == FOOTER;
        }
        Ok(true)
    }

    /// Bytes that are done.
    pub(super) fn done(&self) -> u64 {
        self.at
    }

    /// The topics, and what is wrong with the file's end.
    pub(super) fn end(self, mcap: &McapFile) -> (Vec<Topic>, Option<Error>) {
        // Cut between two records it has no error, and no footer.
        let why = self.ended.map(|error| error.to_string());
        let why = why.or_else(|| (!self.complete).then(|| "no footer".to_owned()));
        let warning = why.map(|why| {
            Error::new(format!("ends early ({why}): what is before is used"))
                .at(&mcap.path)
                .help("`mcap recover` mends the file")
        });
        (self.channels.topics.into_values().collect(), warning)
    }
}

impl Channels {
    fn pass(
        &mut self,
        record: &Record<'_>,
        place: Place,
        visit: &mut dyn FnMut(&Passing<'_>) -> Result<()>,
    ) -> Result<()> {
        match record {
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id, header.name.clone());
            }
            Record::Channel(channel) => {
                let kind = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                let (name, encoding) = (channel.topic.clone(), channel.message_encoding.clone());
                self.topics.entry(channel.id).or_insert(Topic { name, kind, encoding, messages: 0 });
            }
            Record::Message { header, data } => {
                if let Some(topic) = self.topics.get_mut(&header.channel_id) {
                    topic.messages += 1;
                    visit(&Passing { topic, recorded: header.log_time, data, place })?;
                }
            }
            _ => {}
        }
        Ok(())
    }
}
