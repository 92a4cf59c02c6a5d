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
pub(crate) use sensor::Sensor;
pub(crate) use surface::Looks;
pub(crate) use view::View;

/// Offsets of the rays of an edge pixel from its centre, in pixels: a Hammersley set.
const SAMPLES: usize = 16;

fn sample_offset(sample: usize) -> [f32; 2] {
    let reversed = (sample as u32).reverse_bits() >> 28;
    [sample, reversed as usize].map(|k| (k as f32 + 0.5) / SAMPLES as f32 - 0.5)
}

/// Fills `levels` with grey levels between 0 and about 255, row-major.
pub(crate) fn render(lens: &Lens, view: &View, looks: &Looks, levels: &mut [f32]) {
    let width = lens.width();
    let mut surfaces = vec![0_u32; levels.len()];
    for ((level, surface), ray) in levels.iter_mut().zip(&mut surfaces).zip(lens.rays()) {
        if let Some(candidates) = view.candidates(ray.bin) {
            let hit = view.hit(&ray.direction, candidates);
            (*level, *surface) = looks.shade(view, &ray.direction, &hit, lens.pixel_angle());
        }
    }
    let offsets: [[f32; 2]; SAMPLES] = core::array::from_fn(sample_offset);
    for (index, ray) in lens.rays().iter().enumerate() {
        let surface = surfaces[index];
        let differs = |other: Option<&u32>| other.is_some_and(|other| *other != surface);
        let column = index % width;
        let edge = (column > 0 && differs(surfaces.get(index - 1)))
            || (column + 1 < width && differs(surfaces.get(index + 1)))
            || (index >= width && differs(surfaces.get(index - width)))
            || differs(surfaces.get(index + width));
        if !edge {
            continue;
        }
        let Some(candidates) = view.candidates(ray.bin) else { continue };
        let mut sum = 0.0;
        for offset in &offsets {
            let direction = ray.shifted(offset);
            let hit = view.hit(&direction, candidates);
            sum += looks.shade(view, &direction, &hit, 0.5 * lens.pixel_angle()).0;
        }
        levels[index] = sum * (1.0 / SAMPLES as f32);
    }
}
