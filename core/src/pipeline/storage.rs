//! The memory that a pipeline works in: arrays on a microcontroller, `Vec`s on a host.
use crate::lines::{EdgePoint, Extraction};
use crate::slam::Landmark;
use core::borrow::BorrowMut;

/// Where a pipeline keeps what depends on the size of the picture and of the map.
///
/// A microcontroller names arrays here or lends statics ([`Lent`]), a host uses `OnHeap` (feature `alloc`).
pub trait Storage {
    /// 16-bit words: line buffers and the Hough accumulator.
    type Words: AsRef<[u16]> + AsMut<[u16]>;
    /// 32-bit words: bit masks.
    type Masks: AsRef<[u32]> + AsMut<[u32]>;
    /// Edge points.
    type Points: AsRef<[EdgePoint]> + AsMut<[EdgePoint]>;
    /// What a picture gave.
    type Extraction: BorrowMut<Extraction>;
    /// State and covariance of the filter.
    type Numbers: AsRef<[f32]> + AsMut<[f32]>;
    /// Records of the landmarks.
    type Landmarks: AsRef<[Landmark<f32>]> + AsMut<[Landmark<f32>]>;
}

/// Storage in memory that is lent for good, as statics are.
#[derive(Clone, Copy, Debug)]
pub struct Lent;

impl Storage for Lent {
    type Words = &'static mut [u16];
    type Masks = &'static mut [u32];
    type Points = &'static mut [EdgePoint];
    type Extraction = &'static mut Extraction;
    type Numbers = &'static mut [f32];
    type Landmarks = &'static mut [Landmark<f32>];
}

/// The memory that a [`Pipeline`](super::Pipeline) is lent.
pub struct Memory<S: Storage> {
    /// [`lines::row_words`](crate::lines::row_words) of them.
    pub words: S::Words,
    /// [`lines::mask_words`](crate::lines::mask_words) of them.
    pub masks: S::Masks,
    /// [`lines::point_count`](crate::lines::point_count) of them, more for busy pictures.
    pub points: S::Points,
    /// One, whatever is in it.
    pub extraction: S::Extraction,
    /// [`slam::storage_len`](crate::slam::storage_len) of them.
    pub numbers: S::Numbers,
    /// As many as landmarks are wanted.
    pub landmarks: S::Landmarks,
}

/// Storage in `Vec`s.
#[cfg(feature = "alloc")]
#[derive(Clone, Copy, Debug)]
pub struct OnHeap;

#[cfg(feature = "alloc")]
mod on_heap {
    use super::{EdgePoint, Extraction, Landmark, Memory, OnHeap, Storage};
    use crate::lines::{mask_words, point_count, row_words};
    use crate::slam::{states_for, storage_len};
    use alloc::vec;
    use alloc::vec::Vec;

    impl Storage for OnHeap {
        type Words = Vec<u16>;
        type Masks = Vec<u32>;
        type Points = Vec<EdgePoint>;
        type Extraction = Extraction;
        type Numbers = Vec<f32>;
        type Landmarks = Vec<Landmark<f32>>;
    }

    impl Memory<OnHeap> {
        /// Memory for pictures of this size and a map of so many landmarks.
        pub fn on_heap(width: usize, height: usize, landmarks: usize) -> Self {
            Self {
                words: vec![0; row_words(width, height)],
                masks: vec![0; mask_words(width)],
                points: vec![EdgePoint::default(); point_count(width, height)],
                extraction: Extraction::default(),
                numbers: vec![0.0; storage_len(states_for(landmarks, true))],
                landmarks: vec![Landmark::default(); landmarks],
            }
        }
    }
}
