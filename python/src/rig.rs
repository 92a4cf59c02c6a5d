//! A rig from a file, or from a camera matrix and a mount.
use crate::errors::value;
use monorange_core::geometry::MOUNT_PARAMETERS;
use monorange_formats::files::{MOUNT_KEYS, Rig};
use pyo3::prelude::*;
use std::path::Path;

/// The rig in a TOML file.
pub(crate) fn read(path: &Path) -> PyResult<Rig> {
    Rig::read(path).map_err(value)
}

/// Numbers of a rig that is not in a file: lengths in metres, angles in radians.
pub(crate) struct Numbers {
    pub(crate) size: (usize, usize),
    pub(crate) matrix: [[f64; 3]; 3],
    pub(crate) distortion: Vec<f64>,
    pub(crate) lens: String,
    pub(crate) mount: [f64; 6],
    pub(crate) mount_std: Option<[f64; 6]>,
    pub(crate) pixel_std: Option<(f64, f64)>,
}

impl Numbers {
    /// The rig, checked as a file of the same numbers is.
    pub(crate) fn rig(&self) -> PyResult<Rig> {
        let [[fu, shear, u0], [below, fv, v0], last] = self.matrix;
        if below != 0.0 || last != [0.0, 0.0, 1.0] {
            return Err(value("camera_matrix must be [[fu, s, u0], [0, fv, v0], [0, 0, 1]]"));
        }
        let skew = if fu == 0.0 { 0.0 } else { shear / fu };
        let (width, height) = self.size;
        let mut text = format!(
            "[camera]\nwidth = {width}\nheight = {height}\nfocal = [{fu:?}, {fv:?}]\nprincipal = [{u0:?}, {v0:?}]\n\
             skew = {skew:?}\nlens = {:?}\n",
            self.lens
        );
        match self.distortion.as_slice() {
            [] => {}
            some => text += &format!("distortion = {some:?}\n"),
        }
        if let Some((u, v)) = self.pixel_std {
            text += &format!("pixel_std = [{u:?}, {v:?}]\n");
        }
        text += "[mount]\n";
        for (index, (key, std_key, unit)) in MOUNT_KEYS.into_iter().enumerate() {
            text += &format!("{key} = {:?}\n", self.mount[index] / unit);
            if let Some(std) = self.mount_std {
                text += &format!("{std_key} = {:?}\n", std[index] / unit);
            }
        }
        Rig::parse(Path::new("arguments"), &text).map_err(value)
    }
}

/// The mount of a rig by the names of its parameters: m and rad.
pub(crate) fn named(values: [f64; 6]) -> [(&'static str, f64); 6] {
    let mut named = [("", 0.0); 6];
    for (slot, pair) in named.iter_mut().zip(MOUNT_PARAMETERS.into_iter().zip(values)) {
        *slot = pair;
    }
    named
}
