use crate::{
    error::{Error, fail, there, told},
    rig::Rig,
    room::{Room, bytes_of},
};
use core::{ffi::c_void, slice};
use monorange_core::lines::{self, EdgePoint, ExtractConfig, mask_words, point_count, row_words};

type Lent = lines::Extractor<&'static mut [u16], &'static mut [u32], &'static mut [EdgePoint]>;

/// Finds floor corners in a picture that comes row by row.
pub struct Extractor {
    extractor: Lent,
    width: usize,
}

/// A floor corner: where an upright edge meets the floor.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corner {
    /// Column, px.
    pub u: f32,
    /// Row, px.
    pub v: f32,
    /// px².
    pub var_u: f32,
    /// px².
    pub cov_uv: f32,
    /// px².
    pub var_v: f32,
}

pub(crate) const fn bytes(width: usize, height: usize) -> usize {
    bytes_of::<Extractor>(1) + working_bytes(width, height)
}

/// What an extractor works in.
pub(crate) const fn working_bytes(width: usize, height: usize) -> usize {
    bytes_of::<u16>(row_words(width, height))
        + bytes_of::<u32>(mask_words(width))
        + bytes_of::<EdgePoint>(point_count(width, height))
}

/// Bytes of memory for an extractor of pictures of this size.
#[unsafe(no_mangle)]
pub extern "C" fn monorange_extractor_bytes(width: u32, height: u32) -> usize {
    bytes(width as usize, height as usize)
}

/// An extractor in `memory` of `monorange_extractor_bytes`; null, and why, for a rig that cannot be.
///
/// # Safety
/// Nothing else uses the memory while the extractor is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn monorange_extractor_start(
    rig: Option<&Rig>,
    memory: *mut c_void,
    bytes: usize,
    mut error: Option<&mut Error>,
) -> Option<&'static mut Extractor> {
    let Some(rig) = rig else {
        fail(error, "rig is NULL");
        return None;
    };
    // SAFETY: as promised for this function.
    let room = unsafe { Room::new(memory, bytes) };
    let started = start(rig, room).unwrap_or_else(|| {
        let needed = monorange_extractor_bytes(rig.camera.width, rig.camera.height);
        fail(error.as_deref_mut(), format_args!("memory has {bytes} bytes, this extractor needs {needed}"));
        Ok(None)
    });
    started.unwrap_or_else(|why| {
        fail(error, why);
        None
    })
}

/// `None` where there is too little room.
fn start(rig: &Rig, mut room: Room) -> Option<monorange_core::Result<Option<&'static mut Extractor>>> {
    let (width, height) = (rig.camera.width as usize, rig.camera.height as usize);
    let place = room.place()?;
    let words = room.filled(row_words(width, height), 0)?;
    let masks = room.filled(mask_words(width), 0)?;
    let points = room.filled(point_count(width, height), EdgePoint::default())?;
    let made = rig
        .finder()
        .and_then(|finder| Lent::new(ExtractConfig::default(), finder, words, masks, points))
        .map(|extractor| Some(place.write(Extractor { extractor, width })));
    Some(made)
}

/// A picture begins.
#[unsafe(no_mangle)]
pub extern "C" fn monorange_extractor_begin(extractor: Option<&mut Extractor>) {
    if let Some(extractor) = extractor {
        extractor.extractor.begin();
    }
}

/// Takes its next row: as many grey pixels as the camera is wide.
///
/// # Safety
/// `pixels` points to so many bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn monorange_extractor_row(
    extractor: Option<&mut Extractor>,
    pixels: *const u8,
    mut error: Option<&mut Error>,
) -> bool {
    let Some(extractor) = there(extractor, &mut error) else { return false };
    // SAFETY: as promised for this function.
    let row = unsafe { row(pixels, extractor.width) };
    told(extractor.extractor.push_row(row), error)
}

/// The row at `pixels`, none where that is null.
///
/// # Safety
/// `pixels` is null or points to `width` bytes that do not change while the row is in use.
pub(crate) unsafe fn row<'a>(pixels: *const u8, width: usize) -> &'a [u8] {
    if pixels.is_null() {
        return &[];
    }
    // SAFETY: as promised for this function.
    unsafe { slice::from_raw_parts(pixels, width) }
}

/// Ends the picture: `room` corners at most are written to `corners`. Returns how many were found, -1 for an error.
///
/// # Safety
/// `corners` points to room for so many.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn monorange_extractor_finish(
    extractor: Option<&mut Extractor>,
    corners: *mut Corner,
    room: usize,
    mut error: Option<&mut Error>,
) -> i32 {
    let Some(extractor) = there(extractor, &mut error) else { return -1 };
    match extractor.extractor.finish() {
        Ok(found) => {
            let told = found.corners.iter().map(|corner| Corner {
                u: corner.pixel.x,
                v: corner.pixel.y,
                var_u: corner.covariance.m11,
                cov_uv: corner.covariance.m12,
                var_v: corner.covariance.m22,
            });
            // SAFETY: as promised for this function.
            unsafe { give(told, corners, room) }
        }
        Err(why) => {
            fail(error, why);
            -1
        }
    }
}

/// Writes as many of `items` as there is room for; gives how many there are.
///
/// # Safety
/// `to` is null or points to room for `room` of them.
pub(crate) unsafe fn give<T>(items: impl Iterator<Item = T>, to: *mut T, room: usize) -> i32 {
    let room = if to.is_null() { 0 } else { room };
    let mut count = 0;
    for item in items {
        if count < room {
            // SAFETY: as promised for this function.
            unsafe { to.add(count).write(item) };
        }
        count += 1;
    }
    count as i32
}
