//! What is measured at a place that may be a corner of the floor.
use super::view::{UNIT_FOCAL, View};
use crate::image::GreyMemory;
use nalgebra::Vector2;

/// Samples along a side of [`Candidate::patch`](super::Candidate::patch), 5 cm at the candidate's range between them.
pub const PATCH_SIDE: usize = 16;
/// Samples along a side of [`Candidate::context`](super::Candidate::context), a step of six units between them.
pub const CONTEXT_SIDE: usize = 12;
/// Steps between samples, units of 1/370 rad.
const PATCH_STEP_M: f32 = 0.05;
/// The least and the most of the patch's steps in units.
const PATCH_STEPS: [f32; 2] = [2.0, 24.0];
/// The row of the patch on which the foot is: more is above than below.
const PATCH_FOOT: f32 = 10.0;
const CONTEXT_STEP: f32 = 6.0;

macro_rules! features {
    ($($(#[$doc:meta])* $name:ident,)+) => {
        /// What is measured at a candidate. Lengths are in *units* of 1/370 rad, gradients and differences of grey in the
        /// picture's own noise; what is missing is 0.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct Features {
            $($(#[$doc])* pub $name: f32,)+
        }

        /// The features' names, in order.
        pub const FEATURE_NAMES: [&str; FEATURES] = [$(stringify!($name)),+];
        /// How many there are.
        pub const FEATURES: usize = 0 $(+ { let _ = stringify!($name); 1 })+;

        impl Features {
            /// The features' values, in order.
            pub fn values(&self) -> [f32; FEATURES] {
                [$(self.$name),+]
            }
        }
    };
}

features! {
    /// Length of the vertical edge.
    vertical_length,
    /// Its points to a unit of its length.
    vertical_density,
    /// Its gradient.
    vertical_gradient,
    /// Width of its profile, px.
    vertical_width,
    /// Its angle to gravity, degrees.
    vertical_turn,
    /// Root mean square distance of its points, px.
    vertical_residual,
    /// Whether it is brighter on the right (1) or on the left (−1).
    vertical_brighter_right,
    /// Height above the floor of its upper end, m, if it stands at the foot.
    vertical_height,
    /// How far the foot is below its lower end.
    below_end,
    /// Share of the 12 units below the foot that have points of a vertical edge.
    vertical_below,
    /// The same above.
    vertical_above,
    /// Points of the floor's edge to the left.
    left_points,
    /// Its length.
    left_length,
    /// Where it begins beside the vertical edge.
    left_begin,
    /// Its gradient.
    left_gradient,
    /// Its width, px.
    left_width,
    /// Its root mean square distance, px.
    left_residual,
    /// Its angle, rad, positive where it falls outwards.
    left_fall,
    /// Whether it is brighter below (1) or above (−1).
    left_brighter_below,
    /// As for the left.
    right_points,
    /// As for the left.
    right_length,
    /// As for the left.
    right_begin,
    /// As for the left.
    right_gradient,
    /// As for the left.
    right_width,
    /// As for the left.
    right_residual,
    /// As for the left.
    right_fall,
    /// As for the left.
    right_brighter_below,
    /// 1 where there is an edge on both sides.
    both,
    /// How far apart the two cross the vertical edge.
    disagreement,
    /// The angle between the two on the floor, rad; 0 on one line.
    floor_turn,
    /// The angle between the floor's edge and the line of sight, on the floor, rad: left, or 0.
    left_sight,
    /// The same on the right.
    right_sight,
    /// Angle below the horizon, rad.
    depression,
    /// Range on the floor, m.
    range,
    /// Height above the floor of the next foot above on the same edge, m; 1 where there is none.
    next_above,
    /// Height of this one if the next foot below is the floor's, m; 1 where there is none.
    next_below,
    /// Points of the floor lines of the next foot below, over this one's.
    next_below_points,
    /// Gradient of the floor lines of the next foot below, over this one's.
    next_below_gradient,
    /// Floor lines of five points or more that cross the vertical edge lower.
    lines_below,
    /// The strongest point of a floor's edge straight below, over the floor lines' gradient.
    edge_below,
    /// The same within 12 units.
    edge_near_below,
    /// Grey above on the left less that at the lower border, in noise.
    above_left,
    /// The same on the right.
    above_right,
    /// Below on the left.
    below_left,
    /// Below on the right.
    below_right,
    /// Straight below, 4 to 12 units.
    straight_below,
    /// Straight below, 12 to 30 units.
    far_below,
    /// |above left − above right|.
    contrast_above,
    /// |below left − below right|.
    contrast_below,
    /// Largest |above − below| of a side with a floor line.
    contrast_floor,
    /// Mean |below − lower border| over contrast_floor.
    unlike_floor,
    /// Deviation of the grey 12 to 30 units below.
    texture_below,
    /// Deviation of the grey below on the left and right.
    texture_sides,
    /// Deviation of the grey above.
    texture_above,
    /// Grey at the lower border, of 255.
    floor_grey,
    /// Grey levels that count as noise.
    noise,
    /// Units to the nearest border to the left or right.
    border,
    /// Units to the lower border.
    border_below,
}

/// The frame of a candidate in the picture: its pixel, and a unit downwards and to the right.
pub(super) struct Place<'a> {
    grey: &'a GreyMemory<'a>,
    pixel: Vector2<f32>,
    down: Vector2<f32>,
    right: Vector2<f32>,
}

/// Mean and deviation of some grey.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Grey {
    pub(super) mean: f32,
    pub(super) std: f32,
}

impl<'a> Place<'a> {
    /// The frame at a place; `None` where it is not seen.
    pub(super) fn new(view: &View, grey: &'a GreyMemory<'a>, place: Vector2<f32>) -> Option<Self> {
        let pixel = view.pixel(place)?;
        let step = view.gravity(place) * view.unit;
        let below = view.pixel(place + step)?;
        let down = below - pixel;
        let length = libm::sqrtf(down.norm_squared());
        if !grey.contains(pixel.x, pixel.y) || length <= 0.0 {
            return None;
        }
        // A unit is no less than what the smoothing leaves apart.
        let down = down * (view.unit.max(0.7) / length);
        Some(Self { grey, pixel, down, right: Vector2::new(down.y, -down.x) })
    }

    fn at(&self, right: f32, down: f32) -> Vector2<f32> {
        self.pixel + self.right * right + self.down * down
    }

    /// The grey of a box, by 4 × 4 samples of it; `None` beyond the borders.
    pub(super) fn grey(&self, [left, right]: [f32; 2], [top, bottom]: [f32; 2]) -> Option<Grey> {
        let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for j in 0..4 {
            for i in 0..4 {
                let across = left + (right - left) * (i as f32 + 0.5) * 0.25;
                let down = top + (bottom - top) * (j as f32 + 0.5) * 0.25;
                let at = self.at(across, down);
                if self.grey.contains(at.x, at.y) {
                    let level = f32::from(self.grey.cell(at.x, at.y));
                    count += 1.0;
                    sum += level;
                    squares += level * level;
                }
            }
        }
        if count < 5.0 {
            return None;
        }
        let mean = sum / count;
        let variance = squares / count - mean * mean;
        Some(Grey { mean, std: libm::sqrtf(if variance > 0.0 { variance } else { 0.0 }) })
    }

    /// Units down to the picture's lower border, and to the nearer of the others.
    pub(super) fn borders(&self, width: f32, height: f32) -> (f32, f32) {
        let unit = libm::sqrtf(self.down.norm_squared());
        let beside = self.pixel.x.min(width - 1.0 - self.pixel.x) / unit;
        ((height - 1.0 - self.pixel.y) / unit, beside)
    }

    /// Samples round the place, row by row, upright along gravity; beyond the border the border's.
    fn samples(&self, side: usize, step: f32, foot: f32, out: &mut [u8]) {
        let first = self.at(-0.5 * (side as f32 - 1.0) * step, -foot * step);
        let first = [first.x, first.y].map(GreyMemory::parts);
        // In parts of a cell, finer by 64 while steps are added.
        let parts = |step: f32| (step * (64.0 * GreyMemory::PARTS as f32 / GreyMemory::CELL as f32)) as i32;
        let [right, down] = [self.right, self.down].map(|axis| [parts(axis.x * step), parts(axis.y * step)]);
        let [mut u, mut v] = first.map(|at| at * 64);
        for row in out.chunks_exact_mut(side) {
            let (mut along_u, mut along_v) = (u, v);
            for out in row {
                *out = self.grey.at(along_u / 64, along_v / 64);
                along_u += right[0];
                along_v += right[1];
            }
            u += down[0];
            v += down[1];
        }
    }

    /// The patch of a place on the floor so far from the camera, m.
    pub(super) fn patch(&self, distance: f32, out: &mut [u8; PATCH_SIDE * PATCH_SIDE]) {
        let [least, most] = PATCH_STEPS;
        let step = (PATCH_STEP_M * UNIT_FOCAL / distance.max(1e-3)).max(least).min(most);
        self.samples(PATCH_SIDE, step, PATCH_FOOT, out);
    }

    pub(super) fn context(&self, out: &mut [u8; CONTEXT_SIDE * CONTEXT_SIDE]) {
        self.samples(CONTEXT_SIDE, CONTEXT_STEP, 0.5 * (CONTEXT_SIDE as f32 - 1.0), out);
    }
}
