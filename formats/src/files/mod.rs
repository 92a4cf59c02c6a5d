//! The files that are read and written, one module a format.
//!
//! Text files are read whole, so that a mistake on the last line is found before anything is written.
mod attitude;
mod camera;
pub mod inputs;
mod map;
mod map_file;
#[cfg_attr(
    not(feature = "bags"),
    allow(dead_code, reason = "recordings are read piece by piece, and nothing else")
)]
pub mod memory;
mod odometry;
mod order;
mod rig;
mod rig_section;
mod settings;
mod table;
mod times;
mod trajectory;

pub use attitude::Attitudes;
pub use camera::{Intrinsics, read_camera_info, read_camera_of};
pub use map::{MapPoint, confirmed_map, read_map, write_map, write_ply};
pub use map_file::MapFile;
pub use odometry::{Control, Odometry};
pub use order::{natural_order, sort_names};
pub use rig::{MOUNT_KEYS, Rig, with_mount};
pub use settings::{changed_settings, in_toml, in_words, settings_page};
pub use table::Table;
pub use times::{read_frame_list, read_times};
pub use trajectory::{Stamped, read_trajectory, write_trajectory, write_tum};

use crate::{Error, Result};
use std::{fs, io::Read, path::Path};

/// The text of a file, of the one in [`memory`] before the one on the disk.
///
/// # Errors
/// Without the file, without leave to read it, or when it is not UTF-8.
pub fn read_text(path: &Path) -> Result<String> {
    let bytes = read_bytes(path)?;
    decode(bytes).map_err(|error| error.at(path))
}

/// What a file holds, as [`read_text`].
fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    if let Some(bytes) = memory::copy_of(path) {
        return Ok(bytes);
    }
    let bytes = fs::read(path).map_err(|error| io_error(&error).at(path))?;
    inputs::note(path);
    Ok(bytes)
}

/// The text of standard input.
///
/// # Errors
/// When it cannot be read or is not UTF-8.
pub fn read_standard_input() -> Result<String> {
    let mut bytes = Vec::new();
    let read = std::io::stdin().read_to_end(&mut bytes).map_err(|error| io_error(&error));
    inputs::note(Path::new("/dev/stdin"));
    read.and_then(|_| decode(bytes)).map_err(|error| error.at(STANDARD_INPUT))
}

/// How messages name standard input.
pub const STANDARD_INPUT: &str = "standard input";

/// An input or output error in words, with what to do where that is plain.
pub fn io_error(error: &std::io::Error) -> Error {
    use std::io::ErrorKind;
    match error.kind() {
        ErrorKind::NotFound => Error::new("no such file or folder").help("check the path"),
        ErrorKind::PermissionDenied => Error::new("permission denied"),
        ErrorKind::IsADirectory => Error::new("is a folder, not a file").help("name a file in it"),
        ErrorKind::NotADirectory => Error::new("is a file, not a folder").help("name the folder"),
        ErrorKind::AlreadyExists => {
            Error::new("is there already").help("name another one, or remove it first")
        }
        ErrorKind::StorageFull => Error::new("no space left on the disk"),
        _ => Error::new(error),
    }
}

fn decode(bytes: Vec<u8>) -> Result<String> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(
            Error::new("is UTF-16 text, must be UTF-8").help("save it as UTF-8 (in Excel: CSV UTF-8)")
        );
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        Error::new(format!("is not text: byte {at} is not UTF-8"))
            .help("save it as UTF-8, or check that this is the right file")
    })?;
    Ok(match text.strip_prefix('\u{feff}') {
        Some(rest) => rest.to_owned(),
        None => text,
    })
}
