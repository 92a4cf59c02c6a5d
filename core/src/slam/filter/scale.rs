//! The reset for the map's scale.
//!
//! Where the camera's height and the wheels' scale are both states, no measurement sees the whole map grow with them, as none sees
//! it turn. The covariance of that direction moves with the estimates as that of the turn does:
//!
//! ```text
//! P ← B P Bᵀ,   B = I + b e_hᵀ/h,   b_q = q⁺ − q for every position,   b_s = δ_s for the wheels' scale
//!   = P + (b/h) cᵀ + c (b/h)ᵀ + P_hh (b/h)(b/h)ᵀ,   c = P e_h
//! ```
//!
//! Without it height and scale drift together by two of their deviations on a loop of 66 m: each correction is taken along
//! a direction that an earlier estimate had for the scale's.
#![allow(clippy::indexing_slicing, reason = "kernel: vectors have the filter's size")]
use super::elementwise::subtract;
use super::update::Vectors;
use super::{Filter, ROBOT};
use crate::Real;
use crate::slam::covariance::triangle::Triangle;
use crate::slam::landmark::{Form, Landmark};
use crate::vectors::widest;

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Filter<T, S, L> {
    /// The camera's height, where nothing but its prior and the wheels' says how large the map is.
    pub(super) fn free_scale(&self) -> Option<T> {
        let free = self.config.mount_std.is_some() && self.config.wheels_std.is_some();
        let finder = self.config.finder.filter(|_| free)?;
        let height = finder.mount().height() + self.x(ROBOT);
        (height > T::zero()).then_some(height)
    }
}

impl<T: Real> Vectors<'_, T> {
    /// The lever of the scale, b/h: how far positions, and the wheels' scale, have moved by this correction.
    pub(super) fn scale_steps(&mut self, landmarks: &[Landmark<T>], start: usize, wheels: usize, height: T) {
        let Self { delta, lever, .. } = self;
        lever.copy_from_slice(delta);
        lever[2..start].fill(T::zero());
        lever[wheels] = delta[wheels];
        for landmark in landmarks.iter().filter(|landmark| landmark.form == Form::InverseDistance) {
            lever[landmark.offset + 2..landmark.offset + 4].fill(T::zero());
        }
        lever.iter_mut().for_each(|step| *step /= height);
    }

    /// P e_h + ½ P_hh lever.
    pub(super) fn height_column(&mut self, p: &Triangle<'_, T>) {
        for (row, value) in self.column.iter_mut().enumerate().take(ROBOT) {
            *value = p.at(row, ROBOT);
        }
        self.column[ROBOT..].copy_from_slice(p.view().row(ROBOT));
        let half = -self.column[ROBOT] * T::lit(0.5);
        widest!((&mut *self.column, half, &*self.lever), subtract);
    }
}
