//! Memory from the caller, given out piece by piece.
use core::{
    ffi::c_void,
    mem::{MaybeUninit, align_of, size_of},
    slice,
};

/// What is left of a piece of memory that C gave for good.
pub(crate) struct Room {
    next: *mut u8,
    left: usize,
}

impl Room {
    /// # Safety
    /// `memory` is null, or nothing else uses its `bytes` bytes from now on.
    pub(crate) unsafe fn new(memory: *mut c_void, bytes: usize) -> Self {
        Self { next: memory.cast(), left: if memory.is_null() { 0 } else { bytes } }
    }

    /// Room for one `T`.
    pub(crate) fn place<T>(&mut self) -> Option<&'static mut MaybeUninit<T>> {
        let start = self.take::<T>(1)?;
        // SAFETY: `take` gave memory for one `T`, aligned, that nothing else uses; any bytes are a `MaybeUninit`.
        Some(unsafe { &mut *start.cast::<MaybeUninit<T>>() })
    }

    /// Room for `count` copies of `value`.
    pub(crate) fn filled<T: Copy>(&mut self, count: usize, value: T) -> Option<&'static mut [T]> {
        let start = self.take::<T>(count)?;
        // SAFETY: `take` gave memory for `count` of `T`, aligned, that nothing else uses; all are written before the slice is made.
        unsafe {
            (0..count).for_each(|index| start.add(index).write(value));
            Some(slice::from_raw_parts_mut(start, count))
        }
    }

    fn take<T>(&mut self, count: usize) -> Option<*mut T> {
        let (gap, bytes) = (self.next.align_offset(align_of::<T>()), count.checked_mul(size_of::<T>())?);
        self.left = self.left.checked_sub(gap.checked_add(bytes)?)?;
        let start = self.next.wrapping_add(gap);
        self.next = start.wrapping_add(bytes);
        Some(start.cast())
    }
}

/// Most bytes that `count` of `T` take, wherever the piece before them ends.
pub(crate) const fn bytes_of<T>(count: usize) -> usize {
    count * size_of::<T>() + align_of::<T>() - 1
}
