use clap::Args;
use monorange_formats::{Result, files::Rig};
use std::path::PathBuf;

/// The rig that a command is given.
#[derive(Args, Debug)]
pub(super) struct RigFile {
    /// Camera, mount and settings (TOML).
    #[arg(long, value_name = "FILE")]
    pub(super) rig: PathBuf,
    /// Which camera of the file that the rig names with `camera_info`, counted from 0, where it holds several.
    #[arg(long, value_name = "N")]
    camera: Option<usize>,
}

impl RigFile {
    /// Reads it.
    pub(super) fn read(&self) -> Result<Rig> {
        let rig = Rig::read_of(&self.rig, self.camera)?;
        crate::warnings::say();
        Ok(rig)
    }
}
