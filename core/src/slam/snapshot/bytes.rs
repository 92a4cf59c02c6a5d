//! Little-endian numbers and records, to and from bytes.
use crate::slam::landmark::{Form, Landmark, Status};
use crate::{Error, Result};
use nalgebra::Vector2;

/// Bytes still to be written.
pub(super) struct Out<'a>(pub(super) &'a mut [u8]);

impl Out<'_> {
    pub(super) fn put<const N: usize>(&mut self, bytes: [u8; N]) {
        if let Some((place, rest)) = core::mem::take(&mut self.0).split_first_chunk_mut() {
            *place = bytes;
            self.0 = rest;
        }
    }
}

/// Bytes still to be read.
#[derive(Clone, Copy, Debug)]
pub(super) struct In<'a>(pub(super) &'a [u8]);

impl In<'_> {
    pub(super) fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (bytes, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*bytes)
    }

    /// The number at a place, of numbers only.
    pub(super) fn number(&self, place: usize) -> Option<f32> {
        self.0.get(4 * place..)?.first_chunk().map(|bytes| f32::from_le_bytes(*bytes))
    }
}

pub(super) fn put_landmark(out: &mut Out<'_>, landmark: &Landmark<f32>) {
    // Field by field, so that a new one cannot be forgotten.
    let Landmark {
        id,
        offset,
        form,
        status,
        seen,
        expected,
        missed,
        in_view,
        first_time,
        last_time,
        last_frame,
        last_pixel,
        descriptor,
    } = *landmark;
    out.put(id.to_le_bytes());
    out.put((offset as u16).to_le_bytes());
    let flags = [
        form == Form::InverseDistance,
        status == Status::Confirmed,
        last_pixel.is_some(),
        descriptor.is_some(),
        in_view,
    ];
    let flags = flags.into_iter().rev().fold(0_u16, |bits, flag| 2 * bits + u16::from(flag));
    out.put(flags.to_le_bytes());
    [seen, expected, missed].into_iter().for_each(|count| out.put(count.to_le_bytes()));
    [first_time, last_time].into_iter().for_each(|time| out.put(time.to_le_bytes()));
    out.put(last_frame.to_le_bytes());
    let pixel = last_pixel.unwrap_or_default();
    [pixel.x, pixel.y].into_iter().for_each(|value| out.put(value.to_le_bytes()));
    out.put(descriptor.unwrap_or_default().to_le_bytes());
}

pub(super) fn in_16_bits(number: usize) -> Result<u16> {
    let full = Error::Full { name: "filter.snapshot", capacity: usize::from(u16::MAX) };
    u16::try_from(number).map_err(|_| full)
}

pub(super) fn take_landmark(input: &mut In<'_>) -> Option<Landmark<f32>> {
    let id = u32::from_le_bytes(input.take()?);
    let offset = usize::from(u16::from_le_bytes(input.take()?));
    let flags = u16::from_le_bytes(input.take()?);
    let has = |bit: u16| flags >> bit & 1 == 1;
    let mut count = || Some(u32::from_le_bytes(input.take()?));
    let (seen, expected, missed) = (count()?, count()?, count()?);
    let mut time = || input.take().map(f64::from_le_bytes).filter(|time| time.is_finite());
    let (first_time, last_time) = (time()?, time()?);
    let last_frame = u32::from_le_bytes(input.take()?);
    let mut number = || input.take().map(f32::from_le_bytes).filter(|number| number.is_finite());
    let pixel = Vector2::new(number()?, number()?);
    let descriptor = u32::from_le_bytes(input.take()?);
    Some(Landmark {
        id,
        offset,
        form: if has(0) { Form::InverseDistance } else { Form::Point },
        status: if has(1) { Status::Confirmed } else { Status::Tentative },
        seen,
        expected,
        missed,
        in_view: has(4),
        first_time,
        last_time,
        last_frame,
        last_pixel: has(2).then_some(pixel),
        descriptor: has(3).then_some(descriptor),
    })
}
