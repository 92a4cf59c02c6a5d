//! rosbag2's `.db3`: the two tables of a SQLite file, read from its pages (<https://sqlite.org/fileformat2.html>).
//!
//! Only what a recording needs: tables are walked from the first row to the last, nothing is looked up or written.
//! `topics(id, name, type, serialization_format, …)` and `messages(id, topic_id, timestamp, data)`.
use super::bag::{Passing, Place, Topic};
use crate::{
    Error, Result,
    files::{io_error, memory::Opened},
};
use std::{
    collections::BTreeMap,
    io::{Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

/// Depth at which a tree of pages has a loop.
const DEEPEST: usize = 20;
/// What says that a message is packed: zstd's mark.
const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

#[derive(Debug)]
pub(super) struct Database {
    path: PathBuf,
    file: Mutex<Opened>,
    page_size: usize,
    /// Bytes of a page that hold content.
    usable: usize,
    pages: u64,
}

/// A column of a row.
enum Value {
    Integer(i64),
    /// Text too.
    Bytes(Vec<u8>),
    Other,
}

impl Value {
    fn integer(&self) -> Option<i64> {
        if let Self::Integer(value) = self { Some(*value) } else { None }
    }

    fn text(&self) -> String {
        if let Self::Bytes(bytes) = self {
            String::from_utf8_lossy(bytes).into_owned()
        } else {
            String::new()
        }
    }
}

/// A row: its number, its columns, and the page and cell it is in.
struct Row {
    id: i64,
    values: Vec<Value>,
    at: u64,
    index: usize,
}

impl Database {
    pub(super) fn open(path: &Path) -> Result<Self> {
        let failed = |error: std::io::Error| io_error(&error).at(path);
        let log = PathBuf::from(format!("{}-wal", path.display()));
        if log.metadata().is_ok_and(|log| log.len() > 0) {
            let cause = "was not closed: its last messages are in the log beside it";
            let help = format!("close it: `sqlite3 {} 'PRAGMA wal_checkpoint(TRUNCATE)'`", path.display());
            return Err(Error::new(cause).at(path).help(help));
        }
        let mut file = Opened::open(path).map_err(failed)?;
        let mut head = [0; 100];
        file.read_exact(&mut head).map_err(failed)?;
        let page_size = match u16::from_be_bytes([head[16], head[17]]) {
            1 => 65_536,
            size => usize::from(size),
        };
        let usable = page_size.saturating_sub(usize::from(head[20]));
        let length = file.length().map_err(failed)?;
        let database = Self {
            path: path.to_owned(),
            file: Mutex::new(file),
            page_size,
            usable,
            pages: length / page_size.max(1) as u64,
        };
        if page_size < 512 || usable < 480 {
            return Err(database.damaged());
        }
        Ok(database)
    }

    pub(super) fn length(&self) -> u64 {
        self.pages * self.page_size as u64
    }

    /// From the first message on.
    pub(super) fn walk(&self) -> Result<Walk> {
        let (mut roots, mut topics) = (BTreeMap::new(), BTreeMap::new());
        self.rows(1, &mut |row| {
            // sqlite_schema: type, name, tbl_name, rootpage, sql
            if let [kind, name, _, root, ..] = row.values.as_slice()
                && kind.text() == "table"
            {
                roots.insert(name.text(), root.integer().unwrap_or_default());
            }
            Ok(())
        })?;
        let root = |name: &str| {
            let root = roots.get(name).and_then(|root| u64::try_from(*root).ok());
            root.ok_or_else(|| {
                let error = Error::new(format!("is a database without the table `{name}`")).at(&self.path);
                error.help("name a file that `ros2 bag record` wrote")
            })
        };
        self.rows(root("topics")?, &mut |row| {
            if let [_, name, kind, encoding, ..] = row.values.as_slice() {
                let (name, kind, encoding) = (name.text(), kind.text(), encoding.text());
                topics.insert(row.id, Topic { name, kind, encoding, messages: 0 });
            }
            Ok(())
        })?;
        Ok(Walk { topics, pages: vec![(root("messages")?, DEEPEST)], done: 0 })
    }

    /// The bytes of the message in a cell of a page.
    pub(super) fn fetch(&self, at: u64, index: usize) -> Result<Vec<u8>> {
        let page = self.page(at)?;
        let mut row = self.leaf_row(&page, at, index).ok_or_else(|| self.damaged())?;
        match row.values.pop() {
            Some(Value::Bytes(data)) => Ok(self.unpacked(&data)?.unwrap_or(data)),
            _ => Err(self.damaged()),
        }
    }

    /// A message that rosbag2 packed by itself.
    fn unpacked(&self, data: &[u8]) -> Result<Option<Vec<u8>>> {
        if !data.starts_with(&ZSTD) {
            return Ok(None);
        }
        let mut content = Vec::new();
        let unpacked = ruzstd::decoding::StreamingDecoder::new(data)
            .map_err(std::io::Error::other)
            .and_then(|mut decoder| decoder.read_to_end(&mut content));
        unpacked.map_err(|_| self.damaged())?;
        Ok(Some(content))
    }

    /// Shows the rows of the table whose first page is `root` to `visit`, in their order.
    fn rows(&self, root: u64, visit: &mut dyn FnMut(Row) -> Result<()>) -> Result<()> {
        let mut pages = vec![(root, DEEPEST)];
        while self.next_page(&mut pages, visit)? {}
        Ok(())
    }

    /// Takes the last page off the list: its rows go to `visit`, the pages under it onto the list, the first one last.
    fn next_page(
        &self,
        pages: &mut Vec<(u64, usize)>,
        visit: &mut dyn FnMut(Row) -> Result<()>,
    ) -> Result<bool> {
        let Some((at, depth)) = pages.pop() else { return Ok(false) };
        let page = self.page(at)?;
        let (head, cells) = self.cells(&page, at).ok_or_else(|| self.damaged())?;
        match page.get(head) {
            Some(0x0d) => {
                for index in 0..cells.len() {
                    visit(self.leaf_row(&page, at, index).ok_or_else(|| self.damaged())?)?;
                }
            }
            Some(0x05) if depth > 0 => {
                let left = cells.iter().map(|cell| number(&page, *cell));
                let children = left.chain([number(&page, head + 8)]).rev();
                for child in children {
                    pages.push((child.ok_or_else(|| self.damaged())?, depth - 1));
                }
            }
            _ => return Err(self.damaged()),
        }
        Ok(true)
    }

    /// Where the page's head begins, and where its cells do.
    fn cells(&self, page: &[u8], at: u64) -> Option<(usize, Vec<usize>)> {
        let head = if at == 1 { 100 } else { 0 };
        let short = |at: usize| Some(u16::from_be_bytes(page.get(at..at + 2)?.try_into().ok()?).into());
        let first = head + if page.get(head)? == &0x05 { 12 } else { 8 };
        let count: usize = short(head + 3)?;
        let cells = (0..count).map(|index| short(first + 2 * index)).collect::<Option<_>>()?;
        Some((head, cells))
    }

    fn leaf_row(&self, page: &[u8], at: u64, index: usize) -> Option<Row> {
        let (_, cells) = self.cells(page, at)?;
        let mut cell = page.get(*cells.get(index)?..)?;
        let size = usize::try_from(varint(&mut cell)?).ok()?;
        let id = varint(&mut cell)? as i64;
        let (largest, least) = (self.usable - 35, (self.usable - 12) * 32 / 255 - 23);
        let local = match size {
            size if size <= largest => size,
            size => {
                Some(least + (size - least) % (self.usable - 4)).filter(|k| *k <= largest).unwrap_or(least)
            }
        };
        let mut record = cell.get(..local)?.to_vec();
        let mut next = if local < size { number(cell, local)? } else { 0 };
        while record.len() < size {
            let page = self.page(next).ok()?;
            next = number(&page, 0)?;
            let take = (size - record.len()).min(self.usable - 4);
            record.extend_from_slice(page.get(4..4 + take)?);
        }
        Some(Row { id, values: columns(&record)?, at, index })
    }

    fn page(&self, number: u64) -> Result<Vec<u8>> {
        if number == 0 || number > self.pages {
            return Err(self.damaged());
        }
        let mut page = vec![0; self.page_size];
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start((number - 1) * self.page_size as u64))
            .and_then(|_| file.read_exact(&mut page))
            .map_err(|error| io_error(&error).at(&self.path))?;
        Ok(page)
    }

    fn damaged(&self) -> Error {
        let help = "`sqlite3 FILE .recover` saves what is whole, or record the drive again";
        Error::new("is a damaged SQLite file").at(&self.path).help(help)
    }
}

/// On its way through the table of messages.
pub(super) struct Walk {
    topics: BTreeMap<i64, Topic>,
    /// Pages to come, the next one last, with the depth that may be under them.
    pages: Vec<(u64, usize)>,
    /// Bytes of messages that passed.
    done: u64,
}

impl Walk {
    /// Shows the messages in about so many bytes more to `visit`; whether there are others.
    pub(super) fn go_on(
        &mut self,
        database: &Database,
        file: usize,
        bytes: u64,
        visit: &mut dyn FnMut(&Passing<'_>) -> Result<()>,
    ) -> Result<bool> {
        let Self { topics, pages, done } = self;
        let until = *done + bytes;
        while *done < until {
            let mut pass = |row: Row| {
                let place = Place { file, at: row.at, index: row.index };
                if let [_, topic, time, data] = row.values.as_slice()
                    && let Some(topic) = topic.integer().and_then(|id| topics.get_mut(&id))
                    && let Value::Bytes(data) = data
                {
                    topic.messages += 1;
                    *done += data.len() as u64;
                    let recorded =
                        time.integer().and_then(|time| u64::try_from(time).ok()).unwrap_or_default();
                    let unpacked = database.unpacked(data)?;
                    let data = unpacked.as_deref().unwrap_or(data);
                    visit(&Passing { topic, recorded, data, place })?;
                }
                Ok(())
            };
            if !database.next_page(pages, &mut pass)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Bytes that are done.
    pub(super) fn done(&self) -> u64 {
        self.done
    }

    pub(super) fn end(self) -> Vec<Topic> {
        self.topics.into_values().collect()
    }
}

fn columns(record: &[u8]) -> Option<Vec<Value>> {
    let mut head = record;
    let size = usize::try_from(varint(&mut head)?).ok()?;
    let mut head = record.get(record.len() - head.len()..size)?;
    let mut body = record.get(size..)?;
    let mut values = Vec::new();
    while !head.is_empty() {
        let kind = usize::try_from(varint(&mut head)?).ok()?;
        let length = match kind {
            0..=4 => kind,
            5 => 6,
            6 | 7 => 8,
            8..=11 => 0,
            _ => (kind - 12) / 2,
        };
        let (value, rest) = body.split_at_checked(length)?;
        body = rest;
        values.push(match kind {
            1..=6 => {
                let negative = value.first().is_some_and(|first| first & 0x80 != 0);
                let start = if negative { -1 } else { 0 };
                Value::Integer(value.iter().fold(start, |sum, byte| (sum << 8) | i64::from(*byte)))
            }
            8 | 9 => Value::Integer(kind as i64 - 8),
            12.. => Value::Bytes(value.to_vec()),
            _ => Value::Other,
        });
    }
    Some(values)
}

/// SQLite's integer of one to nine bytes; what is read is taken off `bytes`.
fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for index in 0..9 {
        let (first, rest) = bytes.split_first()?;
        *bytes = rest;
        if index == 8 {
            return Some((value << 8) | u64::from(*first));
        }
        value = (value << 7) | u64::from(first & 0x7f);
        if first & 0x80 == 0 {
            break;
        }
    }
    Some(value)
}

fn number(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?).into())
}
