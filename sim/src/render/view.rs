//! What a frame's rays can meet, sorted by direction.
use super::figure::Part;
use super::lens::{BINS, Lens, azimuth_of, bin_of};
use crate::scene::Scene;
use crate::walker::Walker;
use monorange_core::geometry::{Pose, RangeFinder};
use nalgebra::{Vector2, Vector3};

/// A wall seen from the lens, turned into the robot's axes.
struct Face {
    from: Vector2<f32>,
    to: Vector2<f32>,
    /// from × to, positive for a face that is seen from its free side.
    cross: f32,
    top: f32,
    wall: u16,
}

/// The flat top of a piece of furniture.
struct Lid {
    corners: [Vector2<f32>; 4],
    height: f32,
}

/// Beyond this distance from a foot there is no shadow, m.
const SHADOW_REACH: f32 = 0.4;

/// Scene and walkers from one robot pose.
pub(crate) struct View {
    /// Lens above the floor, m.
    pub(super) height: f32,
    ceiling: f32,
    /// Lens in the world.
    pub(super) lens: Vector2<f32>,
    pub(super) cos: f32,
    pub(super) sin: f32,
    faces: Vec<Face>,
    lids: Vec<Lid>,
    pub(super) parts: Vec<Part>,
    feet: Vec<Vector2<f32>>,
    items: Vec<Item>,
    bins: Vec<Bin>,
}

/// What a direction of the plan can see.
#[derive(Clone, Copy)]
struct Bin {
    /// Where its things begin and end in the items.
    first: u32,
    last: u32,
    /// Nothing is nearer than this, m.
    nearest: f32,
    /// Whether a foot is near.
    shadowed: bool,
}

#[derive(Clone, Copy)]
enum Item {
    Face(u16),
    Lid(u16),
    Part(u16),
    /// The soft shadow round a foot.
    Shadow(u16),
}

/// The things that the rays of one bin can meet, besides floor and ceiling.
#[derive(Clone, Copy)]
pub(super) struct Candidates<'a> {
    items: &'a [Item],
    /// Nothing is nearer than this, m along the floor.
    pub(super) nearest: f32,
    shadowed: bool,
}

/// The first thing on a ray.
#[derive(Clone, Copy)]
pub(super) struct Hit {
    /// Depth along the ray, in units of its direction.
    pub(super) depth: f32,
    pub(super) thing: Thing,
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Thing {
    Floor,
    Ceiling,
    /// A wall, and where along it as a fraction.
    Wall(u16, f32),
    Lid(u16),
    Part(u16),
}

impl View {
    pub(crate) fn new(
        lens: &Lens,
        rig: &RangeFinder<f64>,
        scene: &Scene,
        walkers: &[Walker],
        pose: &Pose<f64>,
    ) -> Self {
        let eye = pose.transform(rig.mount().lever_arm());
        let from_world = pose.rotation().transpose();
        let seen = |place: Vector2<f64>| from_world * (place - eye);
        let mut sorter = Sorter { lens, entries: Vec::new(), limits: vec![f64::MAX; BINS] };
        let height = rig.mount().height();

        let mut faces = Vec::new();
        for (index, wall) in scene.walls.iter().enumerate() {
            let (from, to) = (seen(wall.from), seen(wall.to));
            if from.perp(&to) <= 0.0 {
                continue; // seen from behind
            }
            let hides = wall.top >= scene.ceiling;
            sorter.add_face(Item::Face(faces.len() as u16), from, to, hides);
            let (from, to) = (from.cast::<f32>(), to.cast::<f32>());
            faces.push(Face { from, to, cross: from.perp(&to), top: wall.top as f32, wall: index as u16 });
        }
        let mut lids = Vec::new();
        for lid in scene.lids.iter().filter(|lid| lid.height < height) {
            let corners = lid.corners.map(seen);
            let radius = corners.iter().map(|corner| (corner - corners[0]).norm()).fold(0.0, f64::max);
            sorter.add_disc(Item::Lid(lids.len() as u16), corners[0], radius);
            lids.push(Lid { corners: corners.map(|corner| corner.cast()), height: lid.height as f32 });
        }
        let (mut parts, mut feet) = (Vec::new(), Vec::new());
        for (person, walker) in walkers.iter().enumerate() {
            for (part, reach) in Part::of(walker, person, seen, pose.heading, height) {
                sorter.add_disc(Item::Part(parts.len() as u16), reach.0, reach.1);
                parts.push(part);
            }
            for foot in walker.feet().map(seen) {
                sorter.add_disc(Item::Shadow(feet.len() as u16), foot, f64::from(SHADOW_REACH));
                feet.push(foot.cast());
            }
        }
        let (bins, items) = sorter.sorted();
        Self {
            height: height as f32,
            ceiling: scene.ceiling as f32,
            lens: eye.cast(),
            cos: libm::cos(pose.heading) as f32,
            sin: libm::sin(pose.heading) as f32,
            faces,
            lids,
            parts,
            feet,
            bins,
            items,
        }
    }

    /// `None` for a pixel without a ray.
    #[inline]
    pub(super) fn candidates(&self, bin: u16) -> Option<Candidates<'_>> {
        let bin = self.bins.get(usize::from(bin))?;
        let items = self.items.get(bin.first as usize..bin.last as usize)?;
        Some(Candidates { items, nearest: bin.nearest, shadowed: bin.shadowed })
    }

    /// The first thing on the ray.
    #[inline]
    pub(super) fn hit(&self, direction: &Vector3<f32>, candidates: Candidates<'_>) -> Hit {
        let mut hit = if direction.z < 0.0 {
            Hit { depth: self.height / -direction.z, thing: Thing::Floor }
        } else {
            Hit { depth: (self.ceiling - self.height) / direction.z.max(1e-9), thing: Thing::Ceiling }
        };
        let plan = direction.xy();
        for item in candidates.items {
            match *item {
                Item::Face(index) => {
                    let face = &self.faces[usize::from(index)];
                    // Both vertices' cross products: neighbours share them bit by bit, so nothing leaks through.
                    let (after, before) = (face.from.perp(&plan), plan.perp(&face.to));
                    if after < 0.0 || before < 0.0 {
                        continue;
                    }
                    let depth = face.cross / (after + before);
                    if depth < hit.depth && self.height + depth * direction.z <= face.top {
                        hit = Hit { depth, thing: Thing::Wall(face.wall, after / (after + before)) };
                    }
                }
                Item::Lid(index) => {
                    let lid = &self.lids[usize::from(index)];
                    if direction.z >= 0.0 {
                        continue;
                    }
                    let depth = (self.height - lid.height) / -direction.z;
                    let point = plan * depth;
                    let inside = (0..4).all(|k| {
                        let (from, to) = (lid.corners[k], lid.corners[(k + 1) % 4]);
                        (to - from).perp(&(point - from)) >= 0.0
                    });
                    if depth < hit.depth && inside {
                        hit = Hit { depth, thing: Thing::Lid(index) };
                    }
                }
                Item::Part(index) => {
                    let part = &self.parts[usize::from(index)];
                    if let Some(depth) = part.depth(direction, self.height)
                        && depth < hit.depth
                    {
                        hit = Hit { depth, thing: Thing::Part(index) };
                    }
                }
                Item::Shadow(_) => {}
            }
        }
        hit
    }

    /// Share of the light that people keep from a point of the floor.
    #[inline]
    pub(super) fn shadow(&self, candidates: Candidates<'_>, plan: Vector2<f32>) -> f32 {
        if !candidates.shadowed {
            return 0.0;
        }
        let mut light = 1.0;
        for item in candidates.items {
            if let Item::Shadow(index) = *item {
                let distance2 = (plan - self.feet[usize::from(index)]).norm_squared();
                let fade = (1.0 - distance2 / (SHADOW_REACH * SHADOW_REACH)).max(0.0);
                light *= 1.0 - 0.4 * fade * fade;
            }
        }
        1.0 - light
    }

    /// A point of the robot's axes at the lens, in the world.
    #[inline]
    pub(super) fn in_world(&self, point: Vector2<f32>) -> Vector2<f32> {
        self.lens
            + Vector2::new(self.cos * point.x - self.sin * point.y, self.sin * point.x + self.cos * point.y)
    }

    /// A direction of the robot's axes, in the world.
    #[inline]
    pub(super) fn turned(&self, step: Vector2<f32>) -> Vector2<f32> {
        Vector2::new(self.cos * step.x - self.sin * step.y, self.sin * step.x + self.cos * step.y)
    }
}

/// Puts things into the bins that can see them.
struct Sorter<'a> {
    lens: &'a Lens,
    /// (bin, nearest distance, thing)
    entries: Vec<(u16, f64, Item)>,
    /// For each bin, the farthest point of the nearest wall that fills it: what is farther is hidden.
    limits: Vec<f64>,
}

impl Sorter<'_> {
    fn add_face(&mut self, item: Item, from: Vector2<f64>, to: Vector2<f64>, hides: bool) {
        let along = to - from;
        let fraction = (-from.dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        let near = libm::sqrt((from + along * fraction).norm_squared());
        let start = libm::atan2(from.y, from.x);
        let end = start + libm::atan2(from.perp(&to), from.dot(&to));
        let margin = self.lens.margin;
        self.each_bin(start - margin, end + margin, |sorter, bin, low, high| {
            let fills = low - margin >= start && high + margin <= end;
            if !fills {
                sorter.entries.push((bin as u16, near, item));
                return;
            }
            // The wall's distance at both sides of the bin; in between it can only be a little less.
            let distances =
                sorter.lens.sides[bin].map(|side| from.perp(&to) / (from.perp(&side) + side.perp(&to)));
            let (less, more) = (distances[0].min(distances[1]), distances[0].max(distances[1]));
            sorter.entries.push((bin as u16, near.max(less * 0.98), item));
            if hides {
                sorter.limits[bin] = sorter.limits[bin].min(more * 1.0001);
            }
        });
    }

    fn add_disc(&mut self, item: Item, centre: Vector2<f64>, radius: f64) {
        let distance = libm::sqrt(centre.norm_squared());
        let half =
            if distance > radius { libm::asin(radius / distance) } else { core::f64::consts::PI * 0.999 };
        let middle = libm::atan2(centre.y, centre.x);
        let margin = self.lens.margin;
        self.each_bin(middle - half - margin, middle + half + margin, |sorter, bin, _, _| {
            sorter.entries.push((bin as u16, (distance - radius).max(0.0), item));
        });
    }

    /// Calls with every used bin between two azimuths, and the bin's edges in the same turn as `start`.
    fn each_bin(&mut self, start: f64, end: f64, mut visit: impl FnMut(&mut Self, usize, f64, f64)) {
        let width = core::f64::consts::TAU / BINS as f64;
        let first = monorange_core::geometry::wrap_angle(start);
        let shift = start - first;
        let first = bin_of(first);
        let origin = azimuth_of(first) + shift;
        let count = (((end - origin) / width) as usize + 1).min(BINS);
        for step in 0..count {
            let bin = (first + step) % BINS;
            if self.lens.used[bin] {
                let low = origin + step as f64 * width;
                visit(self, bin, low, low + width);
            }
        }
    }

    /// The bins, and the things that they point into.
    fn sorted(mut self) -> (Vec<Bin>, Vec<Item>) {
        let limits = self.limits;
        self.entries.retain(|(bin, near, _)| *near <= limits[usize::from(*bin)]);
        self.entries.sort_by_key(|(bin, _, _)| *bin);
        let mut bins = vec![Bin { first: 0, last: 0, nearest: f32::INFINITY, shadowed: false }; BINS];
        for (index, (bin, near, item)) in self.entries.iter().enumerate() {
            let bin = &mut bins[usize::from(*bin)];
            if bin.last == 0 {
                bin.first = index as u32;
            }
            bin.last = index as u32 + 1;
            match item {
                Item::Shadow(_) => bin.shadowed = true,
                _ => bin.nearest = bin.nearest.min(*near as f32 * 0.999),
            }
        }
        (bins, self.entries.into_iter().map(|(_, _, item)| item).collect())
    }
}
