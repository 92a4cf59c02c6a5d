//! Paint, light and texture of what a ray meets.
use super::lens::{Ray, Strip};
use super::view::{Candidates, Hit, Thing, View};
use crate::scene::{Decal, Print, Scene, Wall};
use crate::texture::{Texture, plaster, terrazzo};
use nalgebra::Vector3;

/// A scene's surfaces, ready to be looked up.
pub(crate) struct Looks {
    floor: Texture,
    wall: Texture,
    walls: Vec<WallLooks>,
    scene: Scene,
    shading: f32,
    /// Width of a pixel at depth 1.
    pixel_angle: f32,
}

struct WallLooks {
    length: f32,
    shade: f32,
    grey: f32,
    skirting: Option<f32>,
    decals: Vec<Decal>,
    /// Shifts the texture, so that no two walls look the same.
    shift: f32,
}

/// Numbers of surfaces; neighbours differ, so that edges between them are found.
const FLOOR: u32 = 1;
const CEILING: u32 = 2;
const LIDS: u32 = 0x1000;
const PARTS: u32 = 0x10_0000;
const WALLS: u32 = 0x100_0000;
/// Surfaces of one wall: plain, skirting, and the cells of its decals.
const WALL_SURFACES: u32 = 0x1_0000;

/// Whether two surfaces lie on the same wall, so that only print or skirting differs.
pub(super) fn same_wall(one: u32, other: u32) -> bool {
    one >= WALLS && other >= WALLS && one / WALL_SURFACES == other / WALL_SURFACES
}

const CEILING_GREY: f32 = 215.0;

/// Cells of a poster in a row.
const POSTER_COLUMNS: u32 = 6;
const POSTER_ROWS: u32 = 9;

impl Looks {
    pub(crate) fn new(scene: &Scene, pixel_angle: f32) -> Self {
        let contrast = scene.config.texture as f32;
        let looks = |(index, wall): (usize, &Wall)| WallLooks {
            length: wall.length() as f32,
            shade: wall.orientation_shade() as f32,
            grey: wall.paint.grey,
            skirting: wall.paint.skirting,
            decals: wall.decals.clone(),
            shift: (index * 37 % 101) as f32 * 0.53,
        };
        Self {
            floor: terrazzo(scene.config.seed, contrast),
            wall: plaster(scene.config.seed, contrast),
            walls: scene.walls.iter().enumerate().map(looks).collect(),
            scene: scene.clone(),
            shading: scene.config.shading as f32,
            pixel_angle,
        }
    }

    /// What a ray met: the number of the surface, and its paint.
    #[inline]
    pub(super) fn surface(&self, view: &View, direction: &Vector3<f32>, hit: &Hit) -> (u32, f32) {
        match hit.thing {
            Thing::Floor => (FLOOR, self.scene.floor_grey),
            Thing::Ceiling => (CEILING, CEILING_GREY),
            Thing::Wall(wall, fraction) => {
                let looks = &self.walls[usize::from(wall)];
                let height = view.height + hit.depth * direction.z;
                let skirting = self.scene.config.skirting as f32;
                let (part, grey) = looks.paint(fraction * looks.length, height, skirting);
                (WALLS + u32::from(wall) * WALL_SURFACES + part, grey)
            }
            Thing::Lid(lid) => (LIDS + u32::from(lid), self.scene.lids[usize::from(lid)].grey),
            Thing::Part(part) => {
                let part = &view.parts[usize::from(part)];
                (PARTS + part.number, part.grey)
            }
        }
    }

    /// Grey level of a surface painted `paint`, under the light that falls there.
    #[inline]
    pub(super) fn shade(
        &self,
        view: &View,
        candidates: Candidates<'_>,
        direction: &Vector3<f32>,
        hit: &Hit,
        paint: f32,
        ray: &Ray,
    ) -> f32 {
        let plan = direction.xy() * hit.depth;
        let footprint = hit.depth * self.pixel_angle;
        let height = view.height + hit.depth * direction.z;
        let place = view.in_world(plan);
        let factor = match hit.thing {
            Thing::Floor => {
                // Beside an edge: the pixel's own strip, moved to where this ray meets the floor.
                let strip = Strip { place: plan, ..ray.strip };
                return self.floor(view, candidates, &strip).0;
            }
            Thing::Wall(wall, fraction) => {
                let looks = &self.walls[usize::from(wall)];
                let grain = self.wall.level(footprint);
                let along = fraction * looks.length;
                let texture = self.wall.sample(grain, along + looks.shift, height);
                texture
                    * looks.shade(along, height, self.shading)
                    * self.scene.light.on_wall(place.x, place.y)
            }
            Thing::Part(part) => {
                let (facing, round) = view.parts[usize::from(part)].relief(direction, hit.depth);
                let cloth = self.wall.sample(self.wall.level(footprint), round * 3.0, height * 3.0);
                (0.55 + 0.5 * facing.max(0.0)) * cloth * self.scene.light.on_wall(place.x, place.y)
            }
            Thing::Ceiling | Thing::Lid(_) => self.scene.light.on_wall(place.x, place.y),
        };
        paint * factor
    }

    /// Grey level of a strip of floor, and the number of the floor's surface.
    #[inline]
    pub(super) fn floor(&self, view: &View, candidates: Candidates<'_>, strip: &Strip) -> (f32, u32) {
        let (place, step) = (view.in_world(strip.place), view.turned(strip.step));
        let first = place - step * (0.5 * (strip.probes - 1) as f32);
        let level = self.floor.level(strip.width);
        let texture = self.floor.mean(level, first.into(), step.into(), strip.probes);
        let light = self.scene.light.on_floor(place.x, place.y);
        let shadow = view.shadow(candidates, strip.place) * self.shading;
        (self.scene.floor_grey * texture * light * (1.0 - shadow), FLOOR)
    }
}

impl WallLooks {
    /// Brighter towards the lamps, darker at the foot and in the corners.
    #[inline]
    fn shade(&self, along: f32, height: f32, shading: f32) -> f32 {
        let foot = (1.0 - height / 0.22).max(0.0);
        let corner = (1.0 - along.min(self.length - along) / 0.3).max(0.0);
        let soft = 0.05 * (height - 0.6).min(1.0) - 0.10 * foot * foot - 0.05 * corner * corner;
        self.shade * (1.0 + shading * soft)
    }

    /// Part of the wall at a place, and its paint.
    #[inline]
    fn paint(&self, along: f32, height: f32, skirting_height: f32) -> (u32, f32) {
        if let Some(skirting) = self.skirting
            && height < skirting_height
        {
            return (1, skirting);
        }
        for (number, decal) in self.decals.iter().enumerate() {
            let inside = along >= decal.along[0]
                && along < decal.along[1]
                && height >= decal.height[0]
                && height < decal.height[1];
            if inside {
                let (grey, cell) = decal.grey(along, height);
                return (2 + number as u32 * 256 + cell, grey);
            }
        }
        (0, self.grey)
    }
}

impl Decal {
    /// Grey level and cell of the print.
    #[inline]
    fn grey(&self, along: f32, height: f32) -> (f32, u32) {
        let seed = match self.print {
            Print::Plain(grey) => return (grey, 0),
            Print::Poster(seed) => seed,
        };
        let across = (self.along[1] - along) / (self.along[1] - self.along[0]);
        let down = (self.height[1] - height) / (self.height[1] - self.height[0]);
        let paper = 208.0 + (seed % 28) as f32;
        // A margin of paper all round.
        let inner = |x: f32| (x - 0.07) / 0.86;
        let (x, y) = (inner(across), inner(down));
        if !(0.0..1.0).contains(&x) || !(0.0..1.0).contains(&y) {
            return (paper, 0);
        }
        let column = ((x * POSTER_COLUMNS as f32) as u32).min(POSTER_COLUMNS - 1);
        let row = ((y * POSTER_ROWS as f32) as u32).min(POSTER_ROWS - 1);
        let picture_rows = 3 + seed / 32 % 3;
        let cell = 1 + row * POSTER_COLUMNS + column;
        if row < picture_rows {
            // A picture of blocks, two cells wide.
            let mixed = mix(seed ^ (row * 31 + column / 2 * 7 + 1));
            return (40.0 + (mixed % 150) as f32, cell);
        }
        // Lines of text: dark, ragged on the right.
        let ragged = 3 + mix(seed ^ (row + 77)) % 4;
        let line = y * POSTER_ROWS as f32 - row as f32;
        if column < ragged && (0.3..0.75).contains(&line) { (92.0, 128 + cell) } else { (paper, 0) }
    }
}

/// Scrambles a number.
#[inline]
fn mix(number: u32) -> u32 {
    let number = (number ^ (number >> 16)).wrapping_mul(0x7feb_352d);
    let number = (number ^ (number >> 15)).wrapping_mul(0x846c_a68b);
    number ^ (number >> 16)
}
