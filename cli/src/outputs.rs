//! Outputs that appear whole or not at all, and over nothing that was read.
use crate::interrupt::Unfinished;
use monorange_formats::{Error, Result, files::inputs, files::io_error};
use std::{
    fs,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};
use tempfile::NamedTempFile;

/// Files that appear in a folder together, or not at all: each is written beside its place under another name,
/// and [`commit`](Self::commit) renames them. Dropped without it, nothing stays.
///
/// A link is followed, and what is no plain file (`/dev/null`, a named pipe) is written to, never replaced. A file that
/// was read is never written over.
#[derive(Debug)]
pub struct Outputs {
    folder: PathBuf,
    /// Folders that were made, the outermost first.
    made: Vec<PathBuf>,
    staged: Vec<(Staged, PathBuf)>,
}

#[derive(Debug)]
enum Staged {
    /// Beside its place.
    File(NamedTempFile, Unfinished),
    /// For what is no plain file.
    Memory(Vec<u8>),
}

impl Outputs {
    /// Outputs into a folder, which is made with its parents if it is not there.
    ///
    /// # Errors
    /// When the folder cannot be made.
    pub fn into_folder(folder: &Path) -> Result<Self> {
        let mut made = Vec::new();
        for part in folder.ancestors().filter(|part| !part.as_os_str().is_empty()) {
            match fs::metadata(part) {
                Ok(found) if found.is_dir() => break,
                Ok(_) => {
                    let help = "name a new folder, or one that is there";
                    return Err(Error::new("is there and is not a folder: outputs go into a folder")
                        .at(part)
                        .help(help));
                }
                Err(_) => made.insert(0, part.to_owned()),
            }
        }
        let outputs = Self { folder: folder.to_owned(), made, staged: Vec::new() };
        for part in &outputs.made {
            Unfinished::folder(part).keep();
            fs::create_dir(part).map_err(|error| io_error(&error).at(part))?;
        }
        Ok(outputs)
    }

    /// As [`into_folder`](Self::into_folder), for a run that writes `names`: other files of these names are not written
    /// over. A folder in which `mark` is, is an earlier run's.
    ///
    /// # Errors
    /// As [`into_folder`](Self::into_folder), and when the folder holds a file of these names and is not an earlier run's.
    pub fn of_a_run(folder: &Path, names: &[&str], mark: &str) -> Result<Self> {
        // Before the work rather than after it.
        names.iter().try_for_each(|name| not_an_input(&folder.join(name)))?;
        if folder.is_dir() && !folder.join(mark).exists() {
            if let Some(name) = names.iter().find(|name| folder.join(name).exists()) {
                let cause =
                    format!("holds a file `{name}` that is not from an earlier run (there is no {mark})");
                return Err(Error::new(cause)
                    .at(folder)
                    .help("name another folder with --out, or move the file away"));
            }
            let others = fs::read_dir(folder).into_iter().flatten().flatten();
            let other = others.map(|entry| entry.file_name().to_string_lossy().into_owned()).min();
            if let Some(other) = other {
                Error::new(format!("holds other files already (`{other}`)"))
                    .at(folder)
                    .help("the results are put beside them; name another folder with --out if that is not meant")
                    .warn();
            }
        }
        Self::into_folder(folder)
    }

    /// Writes one file; it has its name only after [`commit`](Self::commit).
    ///
    /// # Errors
    /// When it cannot be written, or was read.
    pub fn write(
        &mut self,
        name: &str,
        content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<()> {
        let named = self.folder.join(name);
        let target = fs::canonicalize(&named).unwrap_or(named);
        not_an_input(&target)?;
        if is_special(&target) {
            let mut bytes = Vec::new();
            content(&mut bytes).map_err(|error| io_error(&error).at(&target))?;
            self.staged.push((Staged::Memory(bytes), target));
            return Ok(());
        }
        let folder = target.parent().unwrap_or(&self.folder);
        let written = (|| {
            let mut builder = tempfile::Builder::new();
            builder.prefix(".monorange-").suffix(".part");
            #[cfg(unix)] // as a plain file would be made, where temporary files are private
            builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
            let (file, unfinished) = Unfinished::file(|| builder.tempfile_in(folder))?;
            let mut buffered = BufWriter::new(file);
            content(&mut buffered)?;
            Ok((buffered.into_inner().map_err(io::IntoInnerError::into_error)?, unfinished))
        })();
        let (file, unfinished) = written.map_err(|error: io::Error| io_error(&error).at(&target))?;
        self.staged.push((Staged::File(file, unfinished), target));
        Ok(())
    }

    /// Gives every file its name.
    ///
    /// # Errors
    /// When a name is taken by a folder or cannot be written.
    pub fn commit(mut self) -> Result<()> {
        let staged = std::mem::take(&mut self.staged);
        if let Some((_, target)) = staged.iter().find(|(_, target)| target.is_dir()) {
            return Err(Error::new("is a folder, a file is to be written").at(target).help("name a file"));
        }
        // A signal that comes now waits until all of them have their names.
        let _whole = Unfinished::pause();
        self.made.clear();
        for (file, target) in staged {
            let put = match file {
                Staged::File(file, _unfinished) => {
                    not_an_input(&target)?;
                    file.persist(&target).map(drop).map_err(|error| error.error)
                }
                Staged::Memory(bytes) => pour(&bytes, &target),
            };
            put.map_err(|error| io_error(&error).at(&target))?;
        }
        Ok(())
    }
}

/// Fails when a file that was read would be written over.
pub fn not_an_input(target: &Path) -> Result<()> {
    match inputs::was_read(target) {
        false => Ok(()),
        true => Err(Error::new("is an input of this run, and would be written over")
            .at(target)
            .help("name another file or folder for the output")),
    }
}

/// Whether something is there that is neither a plain file nor a folder.
fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// Writes into what is there already.
fn pour(bytes: &[u8], into: &Path) -> io::Result<()> {
    let mut out = fs::OpenOptions::new().write(true).open(into)?;
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

impl Drop for Outputs {
    fn drop(&mut self) {
        self.staged.clear();
        for folder in self.made.iter().rev() {
            // Only empty folders go; what someone else put there meanwhile stays.
            let _ = fs::remove_dir(folder);
        }
    }
}

/// A folder that appears whole or not at all: it is filled beside its place under another name.
#[derive(Debug)]
pub struct NewFolder {
    staged: tempfile::TempDir,
    _unfinished: Unfinished,
    target: PathBuf,
    /// Its parents, which are made with it.
    parents: Outputs,
}

impl NewFolder {
    /// A folder that must not be there yet, or be empty.
    ///
    /// # Errors
    /// When something is there already, or nothing can be written beside it.
    pub fn new(target: &Path) -> Result<Self> {
        let occupied = match fs::read_dir(target) {
            Ok(mut entries) => entries.next().is_some(),
            Err(error) => error.kind() != io::ErrorKind::NotFound,
        };
        if occupied {
            let error = Error::new("is there already and is not an empty folder").at(target);
            return Err(error.help("name a new folder, or remove this one first"));
        }
        let parent =
            target.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let parents = Outputs::into_folder(parent)?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(".monorange-").suffix(".part");
        #[cfg(unix)] // as a plain folder would be made, where temporary ones are private
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let staged = Unfinished::file(|| builder.tempdir_in(parent));
        let (staged, unfinished) = staged.map_err(|error| io_error(&error).at(target))?;
        Ok(Self { staged, _unfinished: unfinished, target: target.to_owned(), parents })
    }

    /// Writes one file into it.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, name: &str, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
        let path = self.staged.path().join(name);
        let mut bytes = Vec::new();
        let written = content(&mut bytes).and_then(|()| {
            // Not while a signal clears the folder away.
            let _whole = Unfinished::pause();
            fs::create_dir_all(path.parent().unwrap_or(Path::new("")))?;
            fs::write(&path, bytes)
        });
        written.map_err(|error| io_error(&error).at(self.target.join(name)))
    }

    /// Gives the folder its name.
    ///
    /// # Errors
    /// When the name was taken meanwhile.
    pub fn commit(mut self) -> Result<()> {
        let _whole = Unfinished::pause();
        // An empty folder in its place goes, or renaming fails on some systems.
        let _ = fs::remove_dir(&self.target);
        fs::rename(self.staged.path(), &self.target).map_err(|error| io_error(&error).at(&self.target))?;
        self.parents.made.clear();
        let _ = self.staged.keep();
        Ok(())
    }
}

/// Writes one result to a file, whole or not at all, or to standard output.
///
/// # Errors
/// When it cannot be written. A reader that closes standard output early is not an error.
pub fn to_file_or_stdout(
    path: Option<&Path>,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<()> {
    let stream: Option<(&str, Box<dyn Write>)> = match path {
        None => Some(("standard output", Box::new(io::stdout().lock()))),
        // By these names a file would be opened anew, at its beginning, or be replaced by what is renamed.
        Some(path) if names_stream(path, 1, "stdout") => {
            Some(("standard output", Box::new(io::stdout().lock())))
        }
        Some(path) if names_stream(path, 2, "stderr") => {
            Some(("standard error", Box::new(io::stderr().lock())))
        }
        Some(_) => None,
    };
    if let Some((name, stream)) = stream {
        let mut out = BufWriter::new(stream);
        return match content(&mut out).and_then(|()| out.flush()) {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(io_error(&error).at(name)),
            _ => Ok(()),
        };
    }
    let path = path.unwrap_or(Path::new(""));
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = path.file_name().and_then(|name| name.to_str());
    let name =
        name.ok_or_else(|| Error::new("is not the name of a file").at(path).help("name a file to write"))?;
    if path.starts_with("/dev/fd") || path.starts_with("/proc/self/fd") {
        let mut bytes = Vec::new();
        let open = || fs::OpenOptions::new().append(true).open(path);
        let written = content(&mut bytes).and_then(|()| open()?.write_all(&bytes));
        return written.map_err(|error| io_error(&error).at(path));
    }
    let mut outputs = Outputs::into_folder(folder)?;
    outputs.write(name, content)?;
    outputs.commit()
}

/// Whether a path is one of the names of a standard stream.
fn names_stream(path: &Path, number: u8, name: &str) -> bool {
    let names = [format!("/dev/{name}"), format!("/dev/fd/{number}"), format!("/proc/self/fd/{number}")];
    // A link of the person's own to such a name is one of its names.
    let linked = fs::read_link(path).unwrap_or_else(|_| path.to_owned());
    names.iter().any(|name| path == Path::new(name) || linked == Path::new(name))
}
