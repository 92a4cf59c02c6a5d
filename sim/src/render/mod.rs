//! Pictures: one ray a pixel, through the lens, to the first surface.
//!
//! ```text
//! D = robot_from_cam · (x, y, 1)           the pixel's ray, exact through the lens, once a rig
//! λ_floor = h / −D_z                       depth of the floor along the ray
//! λ_wall  = c / (n · D_xy)                 depth of a wall n · p = c in the robot's plan
//! ```
//!
//! The mount is fixed, so only the plan turns and moves: for each frame the walls are moved to the robot's frame
//! and sorted into directions, and each pixel asks the one to three walls of its direction. Where neighbouring
//! pixels see different surfaces, 16 rays spread over the pixel are averaged (each in its own row and column of a
//! 16 × 16 grid), so that an edge lies where it lies to about 1/50 pixel. Then come blur, vignette and noise.
mod figure;
mod lens;
mod sensor;
mod surface;
mod view;

pub(crate) use lens::Lens;
use lens::Ray;
pub(crate) use sensor::Sensor;
pub(crate) use surface::Looks;
use surface::same_wall;
use view::Candidates;
pub(crate) use view::View;

/// Rays of an edge pixel.
const SAMPLES: usize = 16;

/// Their offsets from the pixel's centre, in pixels: a Hammersley set.
const SAMPLE_OFFSETS: [[f32; 2]; SAMPLES] = {
    let mut offsets = [[0.0; 2]; SAMPLES];
    let mut sample = 0;
    while sample < SAMPLES {
        let reversed = (sample as u32).reverse_bits() >> 28;
        offsets[sample][0] = (sample as f32 + 0.5) / SAMPLES as f32 - 0.5;
        offsets[sample][1] = (reversed as f32 + 0.5) / SAMPLES as f32 - 0.5;
        sample += 1;
    }
    offsets
};

/// Four of them, balanced in both directions.
const PRINT_OFFSETS: [[f32; 2]; 4] =
    [SAMPLE_OFFSETS[1], SAMPLE_OFFSETS[6], SAMPLE_OFFSETS[11], SAMPLE_OFFSETS[12]];

/// Fills `levels` with grey levels between 0 and about 255, row-major.
pub(crate) fn render(lens: &Lens, view: &View, looks: &Looks, levels: &mut [f32]) {
    let mut surfaces = vec![0_u32; levels.len()];
    for ((level, surface), ray) in levels.iter_mut().zip(&mut surfaces).zip(lens.rays()) {
        if let Some(candidates) = view.candidates(ray.bin) {
            if ray.strip.distance < candidates.nearest {
                (*level, *surface) = looks.floor(view, candidates, &ray.strip);
                continue;
            }
            let hit = view.hit(&ray.direction, candidates);
            let (number, paint) = looks.surface(view, &ray.direction, &hit);
            *surface = number;
            *level = looks.shade(view, candidates, &ray.direction, &hit, paint, ray);
        }
    }
    let width = lens.width();
    let rows = surfaces.len() / width;
    for row in 0..rows {
        for column in 0..width {
            let index = row * width + column;
            let here = surfaces[index];
            let neighbours = [
                surfaces[index - usize::from(column > 0)],
                surfaces[index + usize::from(column + 1 < width)],
                surfaces[if row > 0 { index - width } else { index }],
                surfaces[if row + 1 < rows { index + width } else { index }],
            ];
            if neighbours == [here; 4] {
                continue;
            }
            let ray = &lens.rays()[index];
            if let Some(candidates) = view.candidates(ray.bin) {
                // Print on a wall needs fewer rays than the edges that are measured.
                let print = neighbours.iter().all(|other| *other == here || same_wall(*other, here));
                let offsets = if print { &PRINT_OFFSETS[..] } else { &SAMPLE_OFFSETS[..] };
                levels[index] = edge_level(view, looks, ray, candidates, offsets);
            }
        }
    }
}

/// Mean over the rays of one pixel; each surface is shaded once, where the pixel first meets it.
fn edge_level(
    view: &View,
    looks: &Looks,
    ray: &Ray,
    candidates: Candidates<'_>,
    offsets: &[[f32; 2]],
) -> f32 {
    /// More surfaces than this in one pixel are shaded ray by ray.
    const KNOWN: usize = 4;
    let mut known = [(0_u32, 0.0_f32); KNOWN];
    let mut sum = 0.0;
    for offset in offsets {
        let direction = ray.shifted(offset);
        let hit = view.hit(&direction, candidates);
        let (surface, paint) = looks.surface(view, &direction, &hit);
        if let Some((_, level)) = known.iter().find(|(number, _)| *number == surface) {
            sum += level;
            continue;
        }
        let level = looks.shade(view, candidates, &direction, &hit, paint, ray);
        sum += level;
        if let Some(free) = known.iter_mut().find(|(number, _)| *number == 0) {
            *free = (surface, level);
        }
    }
    sum / offsets.len() as f32
}
