//! A printed chessboard in pictures: its corners, the camera that saw it, and the mount where it lay on the floor.
//!
//! Corners are found by the crate calib-targets-chessboard, and refined where the grey values' saddle is; the camera is
//! [`monorange_core::calibration::board`]'s.
//!
//! Which corner of the board is which cannot be told from a plain chessboard that is turned by half a turn, and need not be: the camera
//! does not depend on where the board's origin is, nor does the floor.
mod calibration;
mod corners;
mod saddle;

pub use calibration::{Calibrated, Outcome, Shot, calibrate};

use crate::{Error, Result};
use monorange_core::calibration::board::BoardPoint;
use monorange_core::image::Grey;

/// What the board is like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    columns: usize,
    rows: usize,
    square: f64,
}

impl Board {
    /// A board with this many inner corners, where four squares meet, and squares of `square` metres.
    ///
    /// # Errors
    /// When there are fewer than 3 or more than 100 a side, or a square is not from 1 mm to 2 m.
    pub fn new(columns: usize, rows: usize, square: f64) -> Result<Self> {
        if let Some(count) = [columns, rows].into_iter().find(|count| !(3..=100).contains(count)) {
            return Err(Error::new(format!("a board has 3 to 100 inner corners a side, not {count}"))
                .help("count the points where four squares meet: a board of 10 × 7 squares has 9 × 6"));
        }
        if !(0.001..=2.0).contains(&square) {
            return Err(Error::new(format!("a square of {square} m cannot be meant"))
                .help("give a square's side in metres, as measured on the print: 0.025 for 25 mm"));
        }
        Ok(Self { columns, rows, square })
    }

    /// Inner corners in all.
    pub fn count(&self) -> usize {
        self.columns * self.rows
    }

    /// The board's corners in a picture. Some may be hidden; half of them are wanted.
    ///
    /// # Errors
    /// Why there are none, as the end of a sentence about the picture.
    pub fn corners(&self, grey: &Grey<'_>) -> std::result::Result<Vec<BoardPoint>, String> {
        corners::find(self, grey)
    }
}

impl std::fmt::Display for Board {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} × {} inner corners, squares of {} mm",
            self.columns,
            self.rows,
            (self.square * 1e5).round() / 1e2
        )
    }
}
