use crate::geometry::Camera;
use nalgebra::Vector2;

/// Cells of the grid, and nodes with one ring beyond the picture.
const CELLS: [usize; 2] = [20, 15];
const COLUMNS: usize = CELLS[0] + 3;
const ROWS: usize = CELLS[1] + 3;

/// The lens's displacement on a coarse grid: where an ideal camera would see what is seen at a pixel.
///
/// Catmull–Rom interpolation between the nodes: its error is of fourth order in the node distance, so that 23 × 18
/// nodes (3.3 kB) stay below 0.01 px for Table 1's lens at 320×240.
/// The grid lies in lent words, as the bits of its numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LensGrid<'a> {
    shift: &'a [u32],
    cells_by_pixel: Vector2<f32>,
}

/// Words of a grid.
pub(crate) const LENS_WORDS: usize = 2 * COLUMNS * ROWS;

/// Pixels between nodes.
fn pitch(camera: &Camera<f32>) -> Vector2<f32> {
    [(camera.width(), CELLS[0]), (camera.height(), CELLS[1])]
        .map(|(size, cells)| size.saturating_sub(1).max(1) as f32 / cells as f32)
        .into()
}

impl<'a> LensGrid<'a> {
    /// Writes the grid of a camera's lens to words.
    pub(crate) fn write(camera: &Camera<f32>, words: &mut [u32]) {
        let pitch = pitch(camera);
        let lost = Vector2::repeat(f32::NAN);
        let (nodes, _) = words.as_chunks_mut::<2>();
        for (row, nodes) in nodes.chunks_exact_mut(COLUMNS).enumerate() {
            for (column, node) in nodes.iter_mut().enumerate() {
                let pixel = pitch.component_mul(&Vector2::new(column as f32 - 1.0, row as f32 - 1.0));
                let shift =
                    camera.ray_from_pixel(pixel).map_or(lost, |ray| camera.ideal_from_ray(ray) - pixel);
                *node = [shift.x.to_bits(), shift.y.to_bits()];
            }
        }
    }

    /// The grid of this camera that was written to these words.
    pub(crate) fn new(camera: &Camera<f32>, words: &'a [u32]) -> Self {
        Self { shift: words, cells_by_pixel: pitch(camera).map(|pitch| 1.0 / pitch) }
    }

    /// The ideal pixel, and the ideal direction of the picture's direction `tangent` there; `None` outside the
    /// lens model.
    pub(crate) fn ideal_from_pixel(
        &self,
        pixel: Vector2<f32>,
        tangent: Vector2<f32>,
    ) -> Option<(Vector2<f32>, Vector2<f32>)> {
        let cell = pixel.component_mul(&self.cells_by_pixel);
        let split = |value: f32, cells: usize| {
            let whole = (value as usize).min(cells - 1); // below 0 saturates
            (whole, value - whole as f32)
        };
        let (column, s) = split(cell.x, CELLS[0]);
        let (row, t) = split(cell.y, CELLS[1]);
        let (across, down) = (weights(s), weights(t));
        // Down the four columns first, eight numbers side by side: the shift, and its derivative downwards.
        // The first of four products is the sum so far: added to 0 they are a sixth of all additions.
        let mut rows = self.shift.get(2 * (row * COLUMNS + column)..)?.chunks(2 * COLUMNS).zip(down);
        let (nodes, (weight, slope)) = rows.next()?;
        let nodes: &[u32; 8] = nodes.first_chunk()?;
        let mut shift = nodes.map(|node| f32::from_bits(node) * weight);
        let mut by_down = nodes.map(|node| f32::from_bits(node) * slope);
        for (nodes, (weight, slope)) in rows {
            let nodes: &[u32; 8] = nodes.first_chunk()?;
            for ((node, shift), by_down) in nodes.iter().zip(&mut shift).zip(&mut by_down) {
                let node = f32::from_bits(*node);
                *shift += node * weight;
                *by_down += node * slope;
            }
        }
        let columns = shift.as_chunks::<2>().0.iter().zip(by_down.as_chunks::<2>().0);
        let columns = columns.map(|(shift, by_down)| (Vector2::from(*shift), Vector2::from(*by_down)));
        let mut columns = columns.zip(across);
        let ((shift, by_down), (weight, slope)) = columns.next()?;
        let (mut sum, mut sum_by_across, mut sum_by_down) = (shift * weight, shift * slope, by_down * weight);
        for ((shift, by_down), (weight, slope)) in columns {
            sum += shift * weight;
            sum_by_across += shift * slope;
            sum_by_down += by_down * weight;
        }
        let moved = tangent.component_mul(&self.cells_by_pixel);
        let ideal = pixel + sum;
        let direction = tangent + sum_by_across * moved.x + sum_by_down * moved.y;
        (ideal.x.is_finite() && ideal.y.is_finite()).then_some((ideal, direction))
    }
}

/// Catmull–Rom weights of four nodes at the fraction `t` between the middle two, and their derivatives.
fn weights(t: f32) -> [(f32, f32); 4] {
    let u = 1.0 - t;
    // Halves are exact: the same bits as −½ t u² and −½ u t².
    let half = 0.5 * t;
    let product = half * u;
    [
        (-(product * u), -0.5 * u * (u - 2.0 * t)),
        (1.0 + t * t * (1.5 * t - 2.5), t * (4.5 * t - 5.0)),
        (1.0 + u * u * (1.5 * u - 2.5), -u * (4.5 * u - 5.0)),
        (-(product * t), half * (t - 2.0 * u)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Distortion;
    use std::{vec, vec::Vec};

    fn table_1() -> Camera<f32> {
        let lens = Distortion { k1: -0.22776, k2: 0.36413, p1: -0.00545, p2: -0.00192, k3: 0.0 };
        Camera::new(320, 240, [365.12674, 365.02905], [145.79917, 114.50956], 0.0, lens).unwrap()
    }

    fn written(camera: &Camera<f32>) -> Vec<u32> {
        let mut words = vec![0; LENS_WORDS];
        LensGrid::write(camera, &mut words);
        words
    }

    #[test]
    fn every_pixel_of_table_1_is_undistorted_within_a_hundredth() {
        let camera = table_1();
        let words = written(&camera);
        let grid = LensGrid::new(&camera, &words);
        let mut worst = 0.0_f32;
        for v in 0..240 {
            for u in 0..320 {
                let pixel = Vector2::new(u as f32, v as f32);
                let exact = camera.ideal_from_ray(camera.ray_from_pixel(pixel).unwrap());
                worst = worst.max((grid.ideal_from_pixel(pixel, Vector2::x()).unwrap().0 - exact).norm());
            }
        }
        assert!(worst < 0.01, "{worst} px");
    }

    #[test]
    fn directions_turn_as_neighbouring_points_do() {
        let camera = table_1();
        let words = written(&camera);
        let grid = LensGrid::new(&camera, &words);
        let (pixel, step) = (Vector2::new(300.0, 210.0), Vector2::new(0.3, -0.4));
        let [before, after] =
            [pixel - step, pixel + step].map(|p| grid.ideal_from_pixel(p, Vector2::x()).unwrap().0);
        let (_, direction) = grid.ideal_from_pixel(pixel, step).unwrap();
        assert!(((after - before) * 0.5 - direction).norm() < 1e-3);
    }

    #[test]
    fn without_a_lens_nothing_moves() {
        let camera = Camera::new(1, 1, [1.0, 1.0], [0.0, 0.0], 0.0, Distortion::default()).unwrap();
        let words = written(&camera);
        let grid = LensGrid::new(&camera, &words);
        let (ideal, direction) = grid.ideal_from_pixel(Vector2::zeros(), Vector2::y()).unwrap();
        assert!(ideal.norm() < 1e-6 && (direction - Vector2::y()).norm() < 1e-6);
    }
}
