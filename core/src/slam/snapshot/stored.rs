//! A filter's state in bytes, checked for what cannot be.
use super::bytes::{In, take_landmark};
use super::{FORMAT, HEADER, snapshot_len};
use crate::slam::filter::{ROBOT, WHEEL_STATES};
use crate::slam::landmark::Landmark;
use crate::{Error, Result};
use nalgebra::Vector2;

/// States of the mount, where they are estimated.
const MOUNT_STATES: usize = 4;
/// No state (m, rad, 1/m) is larger, so that squares do not overflow in what follows: a position on Earth is below 1e7 m.
const LARGEST: f32 = 1e8;
/// No variance is larger.
const MOST_VARIABLE: f32 = 1e10;
/// Above 1 by what rounding may do to the covariance of two landmarks that are known together far better than apart.
const MOST_CORRELATED: f32 = 1.01;

/// A state, cut into its parts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stored<'a> {
    kind: [u8; 4],
    pub(super) count: usize,
    pub(super) size: usize,
    pub(super) time: f64,
    pub(super) first_pose: [f32; 3],
    /// `count` landmarks.
    pub(super) records: In<'a>,
    /// State, rounding errors, first estimates, each of `size`, and the triangle.
    pub(super) numbers: In<'a>,
    triangle: In<'a>,
}

pub(super) fn refuse(bytes: &[u8], expected: &'static str) -> Error {
    Error::OutOfRange { name: "filter.snapshot", value: bytes.len() as f64, expected }
}

pub(super) fn cut(bytes: &[u8], expected: usize) -> Error {
    Error::Size { name: "filter.snapshot", got: bytes.len(), expected }
}

impl<'a> Stored<'a> {
    /// # Errors
    /// [`Error::Size`] when the bytes are not as many as they say; [`Error::OutOfRange`] when they hold what cannot be.
    pub(super) fn read(bytes: &'a [u8]) -> Result<Self> {
        let refuse = |expected| refuse(bytes, expected);
        let mut input = In(bytes);
        let kind: [u8; 4] = input.take().ok_or(cut(bytes, HEADER))?;
        if kind[0] != FORMAT || kind[3] > 3 {
            return Err(refuse("the state of a filter of this version"));
        }
        let count = usize::from(u16::from_le_bytes(input.take().ok_or(cut(bytes, HEADER))?));
        let size = usize::from(u16::from_le_bytes(input.take().ok_or(cut(bytes, HEADER))?));
        let expected = snapshot_len(size, count);
        let cut = cut(bytes, expected);
        let time = f64::from_le_bytes(input.take().ok_or(cut)?);
        let mut first_pose = [0.0; 3];
        for value in &mut first_pose {
            *value = f32::from_le_bytes(input.take().ok_or(cut)?);
        }
        let records = input;
        let mut states = start(kind);
        if bytes.len() != expected || size < states {
            return Err(cut);
        }
        for _ in 0..count {
            let landmark = take_landmark(&mut input).ok_or(refuse("records of landmarks"))?;
            let length = landmark.form.len();
            if landmark.offset < start(kind) || landmark.offset + length > size {
                return Err(refuse("landmarks within the state"));
            }
            states += length;
        }
        if !are_apart(records, count) {
            return Err(refuse("states of its own for every landmark"));
        }
        let numbers = input;
        let sane = |value: f32| value.abs() <= LARGEST;
        let mut vectors = (0..3 * size).map_while(|_| input.take().map(f32::from_le_bytes));
        if !vectors.all(sane) || !time.is_finite() || !first_pose.into_iter().all(sane) || states != size {
            return Err(refuse("finite numbers, one set for every landmark"));
        }
        let stored = Self { kind, count, size, time, first_pose, records, numbers, triangle: input };
        if !stored.is_possible() {
            return Err(refuse("variances that are not negative, correlations between -1 and 1"));
        }
        Ok(stored)
    }

    /// Whether the triangle is the covariance's own, not its factors'.
    pub(super) fn is_packed(&self) -> bool {
        self.kind[2] == 0
    }

    /// The landmarks' records.
    pub(super) fn landmarks(&self) -> impl Iterator<Item = Landmark<f32>> {
        let mut records = self.records;
        (0..self.count).map_while(move |_| take_landmark(&mut records))
    }

    /// Two numbers of the state from `offset` on, with what rounding has taken.
    pub(super) fn pair(&self, offset: usize) -> Vector2<f32> {
        let number = |place| self.numbers.number(place).unwrap_or_default();
        Vector2::from([0, 1].map(|axis| number(offset + axis) + number(self.size + offset + axis)))
    }

    /// An entry of the triangle.
    pub(super) fn entry(&self, row: usize, column: usize) -> f32 {
        let (row, column) = (row.min(column), row.max(column));
        self.triangle.number(row * self.size + column - row * (row + 1) / 2).unwrap_or_default()
    }

    /// Whether a triangle of its rows can be a covariance as this kind of filter keeps it.
    fn is_possible(&self) -> bool {
        let (packed, size, triangle) = (self.is_packed(), self.size, self.triangle);
        let diagonal = |row: usize| triangle.number(row * size - row * row.saturating_sub(1) / 2);
        let variance = |row: usize| {
            // Only the robot, its mount and its wheels may be known exactly.
            let least = if packed && row >= start(self.kind) { f32::MIN_POSITIVE } else { 0.0 };
            diagonal(row).filter(|value| (least..=MOST_VARIABLE).contains(value))
        };
        let mut numbers = triangle;
        for row in 0..size {
            let (Some(own), Some(_)) = (variance(row), numbers.take::<4>()) else { return false };
            let mut sum = own;
            for column in row + 1..size {
                let (Some(entry), Some(other)) = (numbers.take().map(f32::from_le_bytes), variance(column))
                else {
                    return false;
                };
                let square = entry * entry;
                sum += square * other;
                let correlated = MOST_CORRELATED * MOST_CORRELATED * own * other;
                if !square.is_finite() || packed && square > correlated {
                    return false;
                }
            }
            // Of P = U D Uᵀ, whose rows hold D and U.
            if !packed && (sum.is_nan() || sum > MOST_VARIABLE) {
                return false;
            }
        }
        true
    }
}

/// States before the landmarks'.
fn start(kind: [u8; 4]) -> usize {
    ROBOT + usize::from(kind[3] & 1) * MOUNT_STATES + usize::from(kind[3] >> 1 & 1) * WHEEL_STATES
}

/// Whether no two of the `count` landmarks at the start of `records` share a state.
fn are_apart(mut records: In<'_>, count: usize) -> bool {
    (1..=count).rev().all(|left| {
        let Some(one) = take_landmark(&mut records) else { return false };
        let mut others = records;
        (1..left).filter_map(|_| take_landmark(&mut others)).all(|other| {
            one.offset + one.form.len() <= other.offset || other.offset + other.form.len() <= one.offset
        })
    })
}
