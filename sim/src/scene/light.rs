//! Light on the floor and on the walls, baked into a grid.
use super::{SceneConfig, Wall};
use crate::random::Random;
use nalgebra::Vector2;

/// Brightness factors over the plan.
#[derive(Clone, Debug)]
pub(crate) struct LightMap {
    origin: [f32; 2],
    columns: usize,
    /// (on the floor, on what stands there)
    cells: Vec<[f32; 2]>,
}

/// Side of a cell, m.
const CELL: f64 = 0.06;
/// Beyond this distance from a wall its shade is not felt, m.
const SHADE_REACH: f64 = 0.6;

impl LightMap {
    /// The light of `lamps` (place, strength) that hang at `ceiling`, with soft shades at the walls' feet and
    /// faint stains.
    pub(crate) fn new(
        walls: &[Wall],
        lamps: &[(Vector2<f64>, f64)],
        ceiling: f64,
        config: &SceneConfig,
        random: &mut Random,
    ) -> Self {
        let ends = || walls.iter().flat_map(|wall| [wall.from, wall.to]);
        let low = ends().fold(Vector2::repeat(f64::MAX), |low, end| low.inf(&end)) - Vector2::repeat(0.5);
        let high = ends().fold(Vector2::repeat(f64::MIN), |high, end| high.sup(&end)) + Vector2::repeat(0.5);
        let [columns, rows] = [high.x - low.x, high.y - low.y].map(|side| (side / CELL) as usize + 2);
        let centre =
            |column: usize, row: usize| low + Vector2::new(column as f64 + 0.5, row as f64 + 0.5) * CELL;

        let mut distance = vec![SHADE_REACH; columns * rows];
        for wall in walls {
            let cell = |value: f64, limit: usize| ((value / CELL).max(0.0) as usize).min(limit - 1);
            let reach = Vector2::repeat(SHADE_REACH);
            let first = wall.from.inf(&wall.to) - reach - low;
            let last = wall.from.sup(&wall.to) + reach - low;
            for row in cell(first.y, rows)..=cell(last.y, rows) {
                for column in cell(first.x, columns)..=cell(last.x, columns) {
                    let nearest = &mut distance[row * columns + column];
                    *nearest = nearest.min(distance_to_segment(centre(column, row), wall));
                }
            }
        }

        let stains: Vec<(Vector2<f64>, f64, f64)> = (0..(columns * rows / 1500))
            .map(|_| {
                let place = centre(random.index(columns), random.index(rows));
                (place, random.within(0.15, 0.7), random.within(-0.09, 0.06))
            })
            .collect();
        let mut stain = vec![0.0; columns * rows];
        for (place, radius, depth) in stains {
            let cell = |value: f64, limit: usize| ((value / CELL).max(0.0) as usize).min(limit - 1);
            let reach = Vector2::repeat(2.0 * radius);
            let (first, last) = (place - reach - low, place + reach - low);
            for row in cell(first.y, rows)..=cell(last.y, rows) {
                for column in cell(first.x, columns)..=cell(last.x, columns) {
                    let fraction = (centre(column, row) - place).norm_squared() / (radius * radius);
                    let fade = 1.0 / (1.0 + fraction * fraction * fraction);
                    stain[row * columns + column] += depth * fade;
                }
            }
        }

        let mut cells = Vec::with_capacity(columns * rows);
        for row in 0..rows {
            for column in 0..columns {
                let place = centre(column, row);
                let lamp_light: f64 = lamps
                    .iter()
                    .map(|(lamp, strength)| {
                        let falloff = ceiling * ceiling / (ceiling * ceiling + (place - lamp).norm_squared());
                        strength * falloff * falloff
                    })
                    .sum();
                // Compressed, as an exposure is chosen: white walls under two lamps are not burnt out.
                let bright = 0.6 + 0.52 * lamp_light / (1.0 + 0.45 * lamp_light);
                let index = row * columns + column;
                let shade = 1.0 - 0.26 * libm::exp(-distance[index] / 0.13);
                let even = |value: f64| (1.0 + (value - 1.0) * config.shading) as f32;
                cells.push([even(bright * shade * (1.0 + stain[index])), even(bright)]);
            }
        }
        Self { origin: [low.x as f32, low.y as f32], columns, cells }
    }

    /// On the floor at a place of the plan.
    #[inline]
    pub(crate) fn on_floor(&self, x: f32, y: f32) -> f32 {
        self.at::<0>(x, y)
    }

    /// On what stands at a place of the plan.
    #[inline]
    pub(crate) fn on_wall(&self, x: f32, y: f32) -> f32 {
        self.at::<1>(x, y)
    }

    #[inline]
    fn at<const KIND: usize>(&self, x: f32, y: f32) -> f32 {
        const FRACTION: f32 = 65536.0;
        let inverse = FRACTION / CELL as f32;
        let x = ((x - self.origin[0]) * inverse - 0.5 * FRACTION) as i32;
        let y = ((y - self.origin[1]) * inverse - 0.5 * FRACTION) as i32;
        let [fx, fy] = [x, y].map(|fixed| (fixed & 0xffff) as f32 * (1.0 / FRACTION));
        // The map reaches half a metre beyond the walls; nothing is seen outside it.
        let (column, row) = ((x >> 16).max(0) as usize, (y >> 16).max(0) as usize);
        let index = row * self.columns + column;
        let (Some([a, b]), Some([c, d])) = (
            self.cells.get(index..).and_then(|cells| cells.first_chunk::<2>()),
            self.cells.get(index + self.columns..).and_then(|cells| cells.first_chunk::<2>()),
        ) else {
            return 1.0;
        };
        let upper = a[KIND] + (b[KIND] - a[KIND]) * fx;
        let lower = c[KIND] + (d[KIND] - c[KIND]) * fx;
        upper + (lower - upper) * fy
    }
}

fn distance_to_segment(point: Vector2<f64>, wall: &Wall) -> f64 {
    let along = wall.to - wall.from;
    let fraction = ((point - wall.from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
    libm::sqrt((point - wall.from - along * fraction).norm_squared())
}
