//! Paint, light and texture of what a ray meets.
use super::view::{Hit, Thing, View};
use crate::scene::{Decal, Print, Scene, Wall};
use crate::texture::{Texture, plaster, terrazzo};
use nalgebra::{Vector2, Vector3};

/// A scene's surfaces, ready to be looked up.
pub(crate) struct Looks {
    floor: Texture,
    wall: Texture,
    paints: Vec<WallLooks>,
    scene: Scene,
    shading: f32,
}

struct WallLooks {
    from: Vector2<f32>,
    along: Vector2<f32>,
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

/// Cells of a poster in a row.
const POSTER_COLUMNS: u32 = 6;
const POSTER_ROWS: u32 = 9;

/// Most probes of the floor texture along one ray's footprint.
const MAX_PROBES: f32 = 6.0;

impl Looks {
    pub(crate) fn new(scene: &Scene) -> Self {
        let contrast = scene.config.texture as f32;
        let looks = |(index, wall): (usize, &Wall)| WallLooks {
            from: wall.from.cast(),
            along: (wall.to - wall.from).cast(),
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
            paints: scene.walls.iter().enumerate().map(looks).collect(),
            scene: scene.clone(),
            shading: scene.config.shading as f32,
        }
    }

    /// Grey level, and the number of the surface.
    #[inline]
    pub(super) fn shade(
        &self,
        view: &View,
        direction: &Vector3<f32>,
        hit: &Hit,
        pixel_angle: f32,
    ) -> (f32, u32) {
        let plan = direction.xy() * hit.depth;
        let footprint = hit.depth * pixel_angle;
        match hit.thing {
            Thing::Floor => (self.floor(view, direction, plan, footprint), FLOOR),
            Thing::Ceiling => {
                let place = view.in_world(plan);
                (150.0 + 70.0 * self.scene.light.at(place.x, place.y)[1], CEILING)
            }
            Thing::Wall(wall, fraction) => {
                let height = view.height + hit.depth * direction.z;
                self.wall(usize::from(wall), fraction, height, footprint)
            }
            Thing::Lid(lid) => {
                let place = view.in_world(plan);
                let grey = self.scene.lids[usize::from(lid)].grey;
                (grey * self.scene.light.at(place.x, place.y)[1], LIDS + u32::from(lid))
            }
            Thing::Part(part) => {
                let part = &view.parts[usize::from(part)];
                let (facing, round) = part.relief(direction, hit.depth);
                let place = view.in_world(plan);
                let height = view.height + hit.depth * direction.z;
                let light = self.scene.light.at(place.x, place.y)[1];
                let cloth = self.wall.sample(self.wall.level(footprint), round * 3.0, height * 3.0);
                (part.grey * (0.55 + 0.5 * facing.max(0.0)) * light * cloth, PARTS + part.number)
            }
        }
    }

    #[inline]
    fn floor(&self, view: &View, direction: &Vector3<f32>, plan: Vector2<f32>, footprint: f32) -> f32 {
        // A pixel sees a strip of floor, long away from the lens: depth/|D_z| times its width.
        let place = view.in_world(plan);
        let away = view.turned(plan);
        let distance2 = plan.norm_squared();
        let stretch = libm::sqrtf(distance2 + view.height * view.height) / view.height;
        let length = footprint * stretch;
        let probes = (stretch + 0.5).min(MAX_PROBES) as u32;
        let probes = probes.max(1);
        let level = self.floor.level(footprint.max(length / probes as f32));
        let step = away * (length / probes as f32 / libm::sqrtf(distance2.max(1e-6)));
        let mut point = place - step * (0.5 * (probes - 1) as f32);
        let mut texture = 0.0;
        for _ in 0..probes {
            texture += self.floor.sample(level, point.x, point.y);
            point += step;
        }
        texture /= probes as f32;
        let mut light = self.scene.light.at(place.x, place.y)[0];
        for part in view.parts.iter().filter(|part| part.number % 2 == 1) {
            let offset2 = (plan - part.foot).norm_squared();
            if offset2 < 0.16 {
                // A soft shadow under each foot.
                let fade = 1.0 - offset2 / 0.16;
                light *= 1.0 - 0.4 * self.shading * fade * fade;
            }
        }
        let _ = direction;
        self.scene.floor_grey * texture * light
    }

    #[inline]
    fn wall(&self, index: usize, fraction: f32, height: f32, footprint: f32) -> (f32, u32) {
        let looks = &self.paints[index];
        let along = fraction * looks.length;
        let surface = WALLS + index as u32 * WALL_SURFACES;
        let (grey, part) = looks.paint(along, height, self.scene.config.skirting as f32);
        let place = looks.from + looks.along * fraction;
        let light = self.scene.light.at(place.x, place.y)[1];
        let grain = self.wall.sample(self.wall.level(footprint), along + looks.shift, height);
        // Brighter towards the lamps, darker at the foot and in the corners.
        let foot = (1.0 - height / 0.22).max(0.0);
        let corner = (1.0 - along.min(looks.length - along) / 0.3).max(0.0);
        let soft = 0.05 * (height - 0.6).min(1.0) - 0.10 * foot * foot - 0.05 * corner * corner;
        let shade = looks.shade * light * (1.0 + self.shading * soft);
        (grey * shade * grain, surface + part)
    }
}

impl WallLooks {
    /// Grey level and part of the wall at a place.
    #[inline]
    fn paint(&self, along: f32, height: f32, skirting_height: f32) -> (f32, u32) {
        if let Some(skirting) = self.skirting
            && height < skirting_height
        {
            return (skirting, 1);
        }
        for (number, decal) in self.decals.iter().enumerate() {
            let inside = along >= decal.along[0]
                && along < decal.along[1]
                && height >= decal.height[0]
                && height < decal.height[1];
            if inside {
                let (grey, cell) = decal.grey(along, height);
                return (grey, 2 + number as u32 * 256 + cell);
            }
        }
        (self.grey, 0)
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
