//! The packed upper triangle that a symmetric matrix is kept in.
//!
//! Row i holds columns i..n, one row after the other, and rows are laid out for the *capacity*, not for the
//! present size: a landmark is appended without moving anything, and the robot's rows, which a prediction
//! changes, are contiguous.
#![allow(
    clippy::indexing_slicing,
    reason = "kernel: rows are sliced once, to a length the filter has checked"
)]
use crate::Real;

/// Numbers in the packed upper triangle of an n × n matrix: n(n+1)/2.
///
/// ```
/// assert_eq!(monorange_core::slam::packed_len(67), 2278); // a robot and 32 landmarks
/// ```
pub const fn packed_len(size: usize) -> usize {
    size * (size + 1) / 2
}

/// A packed upper triangle of which the leading `size` rows and columns are in use.
#[derive(Debug)]
pub(in crate::slam) struct Triangle<'a, T> {
    data: &'a mut [T],
    capacity: usize,
    pub(in crate::slam) size: usize,
}

/// As [`Triangle`], to be read only.
#[derive(Clone, Copy, Debug)]
pub(in crate::slam) struct TriangleRef<'a, T> {
    data: &'a [T],
    capacity: usize,
    pub(in crate::slam) size: usize,
}

const fn row_start(capacity: usize, row: usize) -> usize {
    row * (2 * capacity + 1 - row) / 2
}

impl<'a, T: Real> TriangleRef<'a, T> {
    pub(in crate::slam) fn new(data: &'a [T], capacity: usize, size: usize) -> Self {
        Self { data, capacity, size }
    }

    pub(in crate::slam) fn at(&self, row: usize, column: usize) -> T {
        let (row, column) = if row <= column { (row, column) } else { (column, row) };
        self.data[row_start(self.capacity, row) + column - row]
    }

    /// The entries in `column` and the next one.
    pub(in crate::slam) fn side_by_side(&self, row: usize, column: usize) -> [T; 2] {
        let below = row > column;
        let (first, last) = if below { (column, row) } else { (row, column) };
        let at = row_start(self.capacity, first) + last - first;
        // Below the diagonal the neighbour lies in the next row.
        [self.data[at], self.data[at + if below { self.capacity - 1 - column } else { 1 }]]
    }

    /// Columns `row..size` of a row.
    #[inline(always)]
    pub(in crate::slam) fn row(&self, row: usize) -> &'a [T] {
        let start = row_start(self.capacity, row);
        &self.data[start..start + self.size - row]
    }

    /// What lies above the diagonal in a column and the next one, from row 0 on.
    #[inline(always)]
    pub(in crate::slam) fn columns_above(&self, column: usize) -> impl Iterator<Item = [T; 2]> {
        let mut offset = column;
        (0..column).map(move |row| {
            let entries = &self.data[offset..][..2];
            offset += self.capacity - 1 - row;
            [entries[0], entries[1]]
        })
    }
}

impl<'a, T: Real> Triangle<'a, T> {
    pub(in crate::slam) fn new(data: &'a mut [T], capacity: usize, size: usize) -> Self {
        Self { data, capacity, size }
    }

    pub(in crate::slam) fn view(&self) -> TriangleRef<'_, T> {
        TriangleRef { data: self.data, capacity: self.capacity, size: self.size }
    }

    pub(in crate::slam) fn at(&self, row: usize, column: usize) -> T {
        self.view().at(row, column)
    }

    pub(in crate::slam) fn set(&mut self, row: usize, column: usize, value: T) {
        let (row, column) = if row <= column { (row, column) } else { (column, row) };
        self.data[row_start(self.capacity, row) + column - row] = value;
    }

    /// Columns `row..size` of a row.
    pub(in crate::slam) fn row_mut(&mut self, row: usize) -> &mut [T] {
        let start = row_start(self.capacity, row);
        &mut self.data[start..start + self.size - row]
    }

    /// All that is kept from a row on, and the row's length: each has one less than the one before.
    #[inline(always)]
    pub(in crate::slam) fn below_mut(&mut self, row: usize) -> (&mut [T], usize) {
        (&mut self.data[row_start(self.capacity, row)..], self.capacity - row)
    }

    /// Columns `row..size` of a row, and `row + 1..size` of the next, which is empty below the last.
    #[inline(always)]
    pub(in crate::slam) fn two_rows_mut(&mut self, row: usize) -> [&mut [T]; 2] {
        let (start, count) = (row_start(self.capacity, row), self.size - row);
        let (upper, lower) = self.data[start..].split_at_mut(self.capacity - row);
        [&mut upper[..count], &mut lower[..count - 1]]
    }

    /// Columns 3..size of the robot's rows 0, 1 and 2.
    pub(in crate::slam) fn robot_rows_mut(&mut self) -> [&mut [T]; 3] {
        let (size, capacity) = (self.size, self.capacity);
        let (first, rest) = self.data.split_at_mut(capacity);
        let (second, third) = rest.split_at_mut(capacity - 1);
        [&mut first[3..size], &mut second[2..size - 1], &mut third[1..size - 2]]
    }

    /// Takes `count` rows and columns from `from` out; what follows moves up.
    pub(in crate::slam) fn remove(&mut self, from: usize, count: usize) {
        let (size, capacity) = (self.size, self.capacity);
        for row in (0..size).filter(|row| *row < from || *row >= from + count) {
            let start = row_start(capacity, row);
            if row < from {
                self.data.copy_within(start + from + count - row..start + size - row, start + from - row);
            } else {
                self.data.copy_within(start..start + size - row, row_start(capacity, row - count));
            }
        }
        self.size -= count;
    }
}
