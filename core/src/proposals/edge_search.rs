#![allow(clippy::indexing_slicing, reason = "kernel: a bit's number is masked to its window")]
use super::edge::{EdgePoint, FLOOR, SPARE, STEEP_STRIDE, VERTICAL};
use super::edge_list::EdgeList;
use super::view::View;
use crate::image::{GRADIENT_SCALE, MARGIN, threshold_row};
use crate::lines::edge::{Profile, STEPS, Slope, maximum, unit};
use crate::lines::edge_search::{flat_maxima, flat_profile, ones, steep_maxima, steep_profile, window};
use crate::lines::lens::LensGrid;
use nalgebra::Vector2;

/// Three rows of (G_u, G_v), as they are stored; value 0 belongs to column [`MARGIN`].
type Rows<'a> = [(&'a [u16], &'a [u16]); 3];

/// The search for the edge points of a row, the maxima of the gradient across edges.
///
/// Steep edges (|G_u| ≥ |G_v|) have their maxima along the row, the others along the column. What a point can be follows from
/// its direction beside that of gravity at its place (see [`View::kinds`]); what can be nothing is left out.
pub(super) struct EdgeSearch<'a> {
    pub(super) view: &'a View,
    pub(super) lens: LensGrid<'a>,
    /// Least gradient, grey levels per pixel.
    pub(super) threshold: f32,
    /// The gradient's deviation where there is no edge, in the same unit.
    pub(super) gradient_noise: f32,
}

impl EdgeSearch<'_> {
    /// Adds the edge points of row `centre` with the gradients around it; `mask` is memory for a row of bits.
    pub(super) fn row(
        &self,
        centre: usize,
        rows: Rows<'_>,
        mask: &mut [u32],
        points: &mut [EdgePoint],
        edges: &mut EdgeList,
    ) {
        let [_, at, _] = rows;
        // On a diagonal the larger component is 0.71 of the gradient.
        let component = (0.7 * self.threshold * GRADIENT_SCALE) as u16;
        let [first, second] = &mut [[0; 34]; 2];
        if centre.is_multiple_of(STEEP_STRIDE) {
            threshold_row(at.0, component, mask);
            for (word, bits) in mask.iter().enumerate().filter(|(_, bits)| **bits != 0) {
                let along = window(at.0, 32 * word, 1, first);
                let across = window(at.1, 32 * word, 1, second);
                for bit in ones(steep_maxima(along, *bits)) {
                    if let Some(profile) = steep_profile(along, across, bit)
                        && let Some(point) = self.point((32 * word + bit + MARGIN, centre), true, profile)
                    {
                        edges.push(points, point, self.view);
                    }
                }
            }
        }
        threshold_row(at.1, component, mask);
        let [[a, b, c], [d, e, f]] = &mut [[[0; 32]; 3]; 2];
        for (word, bits) in mask.iter().enumerate() {
            if *bits == 0 {
                continue; // as most are
            }
            let [above, at, below] = rows;
            let along = [(above.1, &mut *a), (at.1, &mut *b), (below.1, &mut *c)]
                .map(|(row, spare)| window(row, 32 * word, 0, spare));
            let across = [(above.0, &mut *d), (at.0, &mut *e), (below.0, &mut *f)]
                .map(|(row, spare)| window(row, 32 * word, 0, spare));
            for bit in ones(flat_maxima(&along, *bits)) {
                if let Some(profile) = flat_profile(&along, &across, bit)
                    && let Some(point) = self.point((32 * word + bit + MARGIN, centre), false, profile)
                {
                    edges.push(points, point, self.view);
                }
            }
        }
    }

    /// The point of a profile at a pixel, if it can be on an edge that is looked for.
    fn point(&self, (column, row): (usize, usize), steep: bool, profile: Profile) -> Option<EdgePoint> {
        let [_, (u, v), _] = profile;
        let slope = Slope::new(u as f32, v as f32);
        let gradient = slope.length() / GRADIENT_SCALE;
        if gradient < self.threshold {
            return None;
        }
        let (offset, curvature) = maximum(profile)?;
        let pixel = Vector2::new(column as f32, row as f32);
        let moved = if steep { Vector2::new(offset, 0.0) } else { Vector2::new(0.0, offset) };
        let normal = unit(slope.direction);
        let tangent = Vector2::new(normal.y, -normal.x);
        let (ideal, seen) = self.lens.ideal_from_pixel(pixel + moved, tangent)?;
        let place = ideal - self.view.principal;
        let kinds = self.view.kinds(place, seen, gradient, self.gradient_noise);
        if kinds & (VERTICAL | FLOOR) == 0 {
            return None;
        }
        // The lens turns by little: the angle is its tangent.
        let turn = tangent.perp(&seen) / tangent.dot(&seen) * (STEPS / core::f32::consts::TAU);
        let direction = slope.direction.wrapping_add((turn + 128.5) as u8).wrapping_sub(128);
        // The samples were taken along an axis; along the normal the profile is narrower by the cosine.
        let curvature = curvature * slope.foreshortening();
        let spare = if steep || column.is_multiple_of(2) { 0 } else { SPARE };
        EdgePoint::new(place, direction, gradient, curvature, kinds | spare)
    }
}
