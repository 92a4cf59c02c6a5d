use crate::{
    error::{Error, fail},
    rig::Rig,
    room::{Room, bytes_of},
};
use core::ffi::c_void;
use monorange_core::geometry::{NoFloor, RangeFinder as Finder};
use nalgebra::{Matrix2, Vector2};

pub(crate) const BYTES: usize = bytes_of::<RangeFinder>(1);

/// Pixels of the floor to ranges.
#[derive(Debug)]
pub struct RangeFinder {
    finder: Finder<f32>,
    mount_std: [f32; 6],
}

/// What a pixel sees.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sees {
    /// The floor.
    Floor = 0,
    /// Nothing of the floor: it looks at or above the horizon.
    AboveHorizon = 1,
    /// Nothing: it lies outside the picture.
    OutsideImage = 2,
    /// Nothing: the lens model does not hold there.
    OutsideLensModel = 3,
    /// A pointer was null.
    Nothing = 4,
}

/// Covariance of (range, bearing).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RangeCovariance {
    /// m².
    pub var_range: f32,
    /// m rad.
    pub cov_range_bearing: f32,
    /// rad².
    pub var_bearing: f32,
}

impl From<Matrix2<f32>> for RangeCovariance {
    fn from(matrix: Matrix2<f32>) -> Self {
        Self { var_range: matrix.m11, cov_range_bearing: matrix.m12, var_bearing: matrix.m22 }
    }
}

/// The point of the floor that a pixel sees.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sighting {
    /// From the robot's origin, m.
    pub range: f32,
    /// From the robot's x axis, positive to the left, rad.
    pub bearing: f32,
    /// Forward, m.
    pub x: f32,
    /// To the left, m.
    pub y: f32,
    /// From the pixel's noise.
    pub noise: RangeCovariance,
    /// From what the mount is not known to; common to all pixels.
    pub systematic: RangeCovariance,
}

/// A range finder in `memory` of `MONORANGE_RANGE_FINDER_BYTES`; null, and why, for a rig that cannot be.
///
/// # Safety
/// Nothing else uses the memory while the range finder is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn monorange_range_finder_start(
    rig: Option<&Rig>,
    memory: *mut c_void,
    bytes: usize,
    error: Option<&mut Error>,
) -> Option<&'static mut RangeFinder> {
    let Some(rig) = rig else {
        fail(error, "rig is NULL");
        return None;
    };
    let finder = match rig.finder() {
        Ok(finder) => finder,
        Err(why) => {
            fail(error, why);
            return None;
        }
    };
    // SAFETY: as promised for this function.
    let place = unsafe { Room::new(memory, bytes) }.place();
    if place.is_none() {
        fail(error, format_args!("memory has {bytes} bytes, a range finder needs {BYTES}"));
    }
    Some(place?.write(RangeFinder { finder, mount_std: rig.mount_std() }))
}

/// Range and bearing of the floor that the pixel (u, v) sees, whose noise has the standard deviation `pixel_std` (px) in both directions.
#[unsafe(no_mangle)]
pub extern "C" fn monorange_sight(
    finder: Option<&RangeFinder>,
    u: f32,
    v: f32,
    pixel_std: f32,
    sighting: Option<&mut Sighting>,
) -> Sees {
    let (Some(finder), Some(sighting)) = (finder, sighting) else { return Sees::Nothing };
    match finder.finder.sight(Vector2::new(u, v)) {
        Ok(seen) => {
            *sighting = Sighting {
                range: seen.range,
                bearing: seen.bearing,
                x: seen.point_in_robot.x,
                y: seen.point_in_robot.y,
                noise: seen.noise(&(Matrix2::identity() * (pixel_std * pixel_std))).into(),
                systematic: seen.systematic(&finder.mount_std).into(),
            };
            Sees::Floor
        }
        Err(NoFloor::AboveHorizon) => Sees::AboveHorizon,
        Err(NoFloor::OutsideImage) => Sees::OutsideImage,
        Err(NoFloor::OutsideLensModel) => Sees::OutsideLensModel,
    }
}
