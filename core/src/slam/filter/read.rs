//! What can be read from a filter: pose, landmarks, mount and covariances.
use super::{Covariance, Filter, ROBOT};
use crate::Real;
use crate::geometry::{Mount, Pose, RangeFinder};
use crate::slam::covariance::Row;
use crate::slam::covariance::factored;
use crate::slam::covariance::packed;
use crate::slam::landmark::{Form, Landmark};
use nalgebra::{Matrix2, Matrix3, Matrix4, Vector2, Vector4};

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Filter<T, S, L> {
    /// Seconds, as of the last prediction or birth.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// How often the covariance failed, and the map began anew.
    pub fn resets(&self) -> u32 {
        self.resets
    }

    /// The robot in the world.
    pub fn pose(&self) -> Pose<T> {
        let [x, y, heading] = self.robot();
        Pose::new(x, y, heading)
    }

    /// Covariance of (x, y, heading).
    pub fn pose_covariance(&self) -> Matrix3<T> {
        Matrix3::from_fn(|row, column| self.covariance_at(row, column))
    }

    /// The landmarks' records in the order of their births; their numbers come from
    /// [`position`](Self::position).
    pub fn landmarks(&self) -> &[Landmark<T>] {
        self.landmarks.as_ref().get(..self.count).unwrap_or_default()
    }

    /// The records, for the fields that are not the filter's own.
    pub fn landmarks_mut(&mut self) -> &mut [Landmark<T>] {
        self.landmarks.as_mut().get_mut(..self.count).unwrap_or_default()
    }

    /// The landmark called `id`.
    pub fn landmark(&self, id: u32) -> Option<&Landmark<T>> {
        self.landmarks().iter().find(|landmark| landmark.id == id)
    }

    /// A landmark's position in the world; `None` for an inverse-distance landmark without a finite distance.
    pub fn position(&self, landmark: &Landmark<T>) -> Option<Vector2<T>> {
        let anchor = Vector2::new(self.x(landmark.offset), self.x(landmark.offset + 1));
        if landmark.form == Form::Point {
            return Some(anchor);
        }
        let (angle, inverse) = (self.x(landmark.offset + 2), self.x(landmark.offset + 3));
        let towards = Vector2::new(angle.cos(), angle.sin());
        (inverse > T::lit(1e-4)).then(|| anchor + towards / inverse)
    }

    /// Covariance of [`position`](Self::position), to first order.
    pub fn position_covariance(&self, landmark: &Landmark<T>) -> Option<Matrix2<T>> {
        self.position(landmark)?;
        let rows = self.position_rows(landmark);
        Some(self.cross(&rows))
    }

    /// Covariance of one landmark's first two numbers, which are a point's position, with another's.
    pub fn covariance_between(&self, one: &Landmark<T>, other: &Landmark<T>) -> Matrix2<T> {
        Matrix2::from_fn(|row, column| self.covariance_at(one.offset + row, other.offset + column))
    }

    /// Row `i` of P Hᵀ. Zero outside.
    pub(in crate::slam) fn times_row(&self, i: usize, rows: &[Row<T>]) -> [T; 2] {
        let p = self.triangle();
        if i >= p.size {
            return [T::zero(); 2];
        }
        match self.config.covariance {
            Covariance::Packed => packed::times_row(|column| p.side_by_side(i, column), rows),
            Covariance::Factored => {
                let at = |column| factored::covariance_at(p, i, column);
                packed::times_row(|column| [at(column), at(column + 1)], rows)
            }
        }
    }

    /// H P Hᵀ.
    pub(in crate::slam) fn cross(&self, rows: &[Row<T>]) -> Matrix2<T> {
        packed::cross(rows, |i| self.times_row(i, rows))
    }

    /// Errors of the mount's height (m), tilt, roll, yaw (rad), where they are states: true minus assumed.
    pub fn mount_error(&self) -> Option<Vector4<T>> {
        self.config.mount_std.map(|_| Vector4::from_fn(|row, _| self.x(ROBOT + row)))
    }

    /// Covariance of [`mount_error`](Self::mount_error).
    pub fn mount_error_covariance(&self) -> Option<Matrix4<T>> {
        let entry = |row, column| self.covariance_at(ROBOT + row, ROBOT + column);
        self.config.mount_std.map(|_| Matrix4::from_fn(entry))
    }

    /// The range finder with the mount as estimated.
    pub fn finder(&self) -> Option<RangeFinder<T>> {
        let finder = self.config.finder?;
        let Some(error) = self.mount_error() else { return Some(finder) };
        let mut parameters = finder.mount().parameters();
        for (parameter, error) in parameters.iter_mut().zip(error.iter()) {
            *parameter += *error;
        }
        let mount = Mount::new(parameters).ok()?;
        Some(RangeFinder::new(*finder.camera(), mount))
    }

    /// States in use and states there is room for.
    pub fn states(&self) -> (usize, usize) {
        (self.size, self.capacity)
    }

    /// One entry of P. States are x, y, heading, the mount's four and the wheels' three where estimated, then the landmarks' at their
    /// offsets. Zero outside.
    pub fn covariance_at(&self, row: usize, column: usize) -> T {
        if row >= self.size || column >= self.size {
            return T::zero();
        }
        match self.config.covariance {
            Covariance::Packed => self.triangle().at(row, column),
            Covariance::Factored => factored::covariance_at(self.triangle(), row, column),
        }
    }

    /// One number of the state. Zero outside.
    pub fn state_at(&self, index: usize) -> T {
        if index < self.size { self.x(index) } else { T::zero() }
    }

    /// What rounding has taken from a number of the state, which is kept beside it: their sum has twice the digits.
    /// Zero outside.
    pub fn rounding_at(&self, index: usize) -> T {
        let all = self.storage.as_ref();
        let rounding = all.get(self.capacity + index).copied().filter(|_| index < self.size);
        rounding.unwrap_or(T::zero())
    }
}
