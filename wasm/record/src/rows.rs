//! Rows of numbers, their columns written once.
use crate::Decision;
use monorange_core::pipeline::CornerReport;
use monorange_core::scan;
use wasm_bindgen::prelude::*;

/// A structure of numbers, and the enumeration of its columns for JavaScript, whose `Width` is the row's length.
macro_rules! rows {
    ($(#[$about:meta])* $row:ident, $columns:ident { $($(#[$field_about:meta])* $field:ident = $column:ident,)* }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $row { $($(#[$field_about])* pub $field: f32,)* }

        #[doc = concat!("Columns of the rows of [`", stringify!($row), "`].")]
        #[wasm_bindgen]
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $columns {
            $($(#[$field_about])* $column,)*
            /// Numbers in a row.
            Width,
        }

        impl $row {
            /// Numbers in a row.
            pub const WIDTH: usize = $columns::Width as usize;

            /// Appends the row.
            pub fn push(&self, rows: &mut Vec<f32>) {
                rows.extend([$(self.$field),*]);
            }

            /// The row in these numbers, where they are as many.
            pub fn of(row: &[f32]) -> Option<Self> {
                let [$($field),*] = *row else { return None };
                Some(Self { $($field),* })
            }
        }
    };
}

rows! {
    /// A floor corner that was seen.
    Corner, CornerColumn {
        /// Pixel, to the right.
        u = U,
        /// Pixel, down.
        v = V,
        /// Variance of u, px².
        var_u = VarU,
        /// Covariance of u and v, px².
        cov_uv = CovUv,
        /// Variance of v, px².
        var_v = VarV,
        /// Metres from the robot's origin.
        range = Range,
        /// Radians, positive to the left.
        bearing = Bearing,
        /// Standard deviation of the range in metres: the pixel's noise and the mount's uncertainty together.
        range_std = RangeStd,
        /// Number of its landmark; −1: none.
        landmark = Landmark,
        /// Number of its [`Decision`].
        decision = Decision,
        /// Normalised innovation squared; not a number: none.
        nis = Nis,
    }
}

rows! {
    /// Where the map expected a landmark in the picture.
    Predicted, PredictedColumn {
        /// Number of the landmark.
        landmark = Landmark,
        /// Pixel, to the right.
        u = U,
        /// Pixel, down.
        v = V,
        /// Variance of u, px².
        var_u = VarU,
        /// Covariance of u and v, px².
        cov_uv = CovUv,
        /// Variance of v, px².
        var_v = VarV,
        /// Index of the corner that it was matched with; −1: none.
        corner = Corner,
    }
}

rows! {
    /// A landmark in the world.
    Landmark, LandmarkColumn {
        /// Its number, exact up to 2²⁴.
        id = Id,
        /// Metres.
        x = X,
        /// Metres.
        y = Y,
        /// Variance of x, m².
        var_x = VarX,
        /// Covariance of x and y, m².
        cov_xy = CovXy,
        /// Variance of y, m².
        var_y = VarY,
        /// How often it was seen.
        seen = Seen,
        /// 1, or 0 while it is tentative.
        confirmed = Confirmed,
    }
}

rows! {
    /// The ends of a line that was found, pixels.
    Line, LineColumn {
        /// One end, to the right.
        u0 = U0,
        /// One end, down.
        v0 = V0,
        /// The other end, to the right.
        u1 = U1,
        /// The other end, down.
        v1 = V1,
    }
}

rows! {
    /// A beam of the virtual scan.
    Beam, BeamColumn {
        /// Radians, positive to the left.
        bearing = Bearing,
        /// The floor is seen clear up to here, metres; 0 where no floor is seen.
        free = Free,
        /// What bounds it, metres; not a number: nothing that is known.
        range = Range,
        /// Standard deviation of the range in metres.
        range_std = RangeStd,
        /// Number of its [`BeamKind`].
        kind = Kind,
    }
}

/// What ends the free floor of a beam.
#[wasm_bindgen]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BeamKind {
    /// A foot that its neighbours continue.
    Boundary = 0,
    /// A foot by itself.
    Obstacle = 1,
    /// Nothing that is certain.
    Unknown = 2,
    /// Nothing: the floor is free as far as the scan reaches.
    Beyond = 3,
}

impl From<scan::Kind> for BeamKind {
    fn from(kind: scan::Kind) -> Self {
        match kind {
            scan::Kind::Boundary => Self::Boundary,
            scan::Kind::Obstacle => Self::Obstacle,
            scan::Kind::Unknown => Self::Unknown,
            scan::Kind::Beyond => Self::Beyond,
        }
    }
}

impl Beam {
    /// The row of a reading.
    pub fn from_reading(reading: &scan::Reading) -> Self {
        Self {
            bearing: reading.bearing,
            free: reading.free,
            range: reading.range.unwrap_or(f32::NAN),
            range_std: libm::sqrtf(reading.var_range),
            kind: BeamKind::from(reading.kind) as u32 as f32,
        }
    }
}

impl Corner {
    /// The row of a corner; `range_std` is given, since it holds the mount's uncertainty too.
    pub fn from_report(corner: &CornerReport, range_std: f32) -> Self {
        Self {
            u: corner.pixel.x,
            v: corner.pixel.y,
            var_u: corner.pixel_covariance.m11,
            cov_uv: corner.pixel_covariance.m12,
            var_v: corner.pixel_covariance.m22,
            range: corner.range,
            bearing: corner.bearing,
            range_std,
            landmark: corner.outcome.landmark.map_or(-1.0, |id| id as f32),
            decision: Decision::from(corner.outcome.decision) as u32 as f32,
            nis: corner.outcome.nis.unwrap_or(f32::NAN),
        }
    }

    /// The number of its landmark, where it has one.
    pub fn landmark_id(&self) -> Option<u32> {
        (self.landmark >= 0.0).then_some(self.landmark as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_goes_there_and_back() {
        let line = Line { u0: 1.0, v0: 2.0, u1: 3.0, v1: 4.0 };
        let mut rows = Vec::new();
        line.push(&mut rows);
        assert_eq!(rows, [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(Line::of(&rows), Some(line));
        assert_eq!((Line::of(&[1.0]), Line::WIDTH, LineColumn::U1 as u32), (None, 4, 2));
    }
}
