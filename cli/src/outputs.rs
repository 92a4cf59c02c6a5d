//! Outputs that appear whole or not at all.
use monorange_formats::{Error, Result, files::io_error};
use std::{
    fs,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};
use tempfile::NamedTempFile;

/// Files that appear in a folder together, or not at all: each is written beside its place under another name,
/// and [`commit`](Self::commit) renames them. Dropped without it, nothing stays.
///
/// A link is followed, and what is no plain file (`/dev/null`, a named pipe) is written to, never replaced.
#[derive(Debug)]
pub struct Outputs {
    folder: PathBuf,
    made_folder: bool,
    staged: Vec<(NamedTempFile, PathBuf)>,
}

impl Outputs {
    /// Outputs into a folder, which is made with its parents if it is not there.
    ///
    /// # Errors
    /// When the folder cannot be made.
    pub fn into_folder(folder: &Path) -> Result<Self> {
        let made_folder = !folder.exists();
        fs::create_dir_all(folder).map_err(|error| io_error(&error).at(folder))?;
        Ok(Self { folder: folder.to_owned(), made_folder, staged: Vec::new() })
    }

    /// Writes one file; it has its name only after [`commit`](Self::commit).
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(
        &mut self,
        name: &str,
        content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<()> {
        let named = self.folder.join(name);
        let target = fs::canonicalize(&named).unwrap_or(named);
        let elsewhere = std::env::temp_dir();
        let folder = if is_special(&target) { &elsewhere } else { target.parent().unwrap_or(&self.folder) };
        fs::create_dir_all(folder).map_err(|error| io_error(&error).at(folder))?;
        let written = (|| {
            let mut builder = tempfile::Builder::new();
            builder.prefix(".monorange-").suffix(".part");
            #[cfg(unix)] // as a plain file would be made, where temporary files are private
            builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
            let mut buffered = BufWriter::new(builder.tempfile_in(folder)?);
            content(&mut buffered)?;
            buffered.into_inner().map_err(io::IntoInnerError::into_error)
        })();
        self.staged.push((written.map_err(|error| io_error(&error).at(&target))?, target));
        Ok(())
    }

    /// Gives every file its name.
    ///
    /// # Errors
    /// When a name is taken by a folder or cannot be written.
    pub fn commit(mut self) -> Result<()> {
        self.made_folder = false;
        for (file, target) in std::mem::take(&mut self.staged) {
            let put = if is_special(&target) {
                pour(file.path(), &target)
            } else {
                file.persist(&target).map(drop).map_err(|error| error.error)
            };
            put.map_err(|error| io_error(&error).at(&target))?;
        }
        Ok(())
    }
}

/// Whether something is there that is neither a plain file nor a folder.
fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// Writes a file's content into what is there already.
fn pour(from: &Path, into: &Path) -> io::Result<()> {
    let mut out = fs::OpenOptions::new().write(true).open(into)?;
    io::copy(&mut fs::File::open(from)?, &mut out).map(drop)
}

impl Drop for Outputs {
    fn drop(&mut self) {
        self.staged.clear();
        if self.made_folder {
            // Only empty folders go; what someone else put there meanwhile stays.
            let _ = fs::remove_dir(&self.folder);
        }
    }
}

/// A folder that appears whole or not at all: it is filled beside its place under another name.
#[derive(Debug)]
pub struct NewFolder {
    staged: tempfile::TempDir,
    target: PathBuf,
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
        let staged = fs::create_dir_all(parent).and_then(|()| {
            let mut builder = tempfile::Builder::new();
            builder.prefix(".monorange-").suffix(".part");
            #[cfg(unix)] // as a plain folder would be made, where temporary ones are private
            builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
            builder.tempdir_in(parent)
        });
        let staged = staged.map_err(|error| io_error(&error).at(target))?;
        Ok(Self { staged, target: target.to_owned() })
    }

    /// Writes one file into it.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, name: &str, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
        let path = self.staged.path().join(name);
        let written = (|| {
            fs::create_dir_all(path.parent().unwrap_or(Path::new("")))?;
            let mut buffered = BufWriter::new(fs::File::create(&path)?);
            content(&mut buffered)?;
            buffered.flush()
        })();
        written.map_err(|error| io_error(&error).at(self.target.join(name)))
    }

    /// Gives the folder its name.
    ///
    /// # Errors
    /// When the name was taken meanwhile.
    pub fn commit(self) -> Result<()> {
        // An empty folder in its place goes, or renaming fails on some systems.
        let _ = fs::remove_dir(&self.target);
        fs::rename(self.staged.path(), &self.target).map_err(|error| io_error(&error).at(&self.target))?;
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
    let Some(path) = path else {
        let mut out = BufWriter::new(io::stdout().lock());
        return match content(&mut out).and_then(|()| out.flush()) {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                Err(io_error(&error).at("standard output"))
            }
            _ => Ok(()),
        };
    };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = path.file_name().and_then(|name| name.to_str());
    let name =
        name.ok_or_else(|| Error::new("is not the name of a file").at(path).help("name a file to write"))?;
    let mut outputs = Outputs::into_folder(folder)?;
    outputs.write(name, content)?;
    outputs.commit()
}
