//! Where the true floor corners are in a picture, and whether they can be seen.
use crate::scene::{Landmark, Scene};
use crate::walker::{LEG_RADIUS, Walker};
use monorange_core::geometry::{Pose, RangeFinder, range_bearing_from_floor};
use nalgebra::Vector2;

/// A true floor corner within the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueCorner {
    /// The landmark's id.
    pub id: u32,
    /// Exact, through the lens.
    pub pixel: Vector2<f64>,
    /// From the robot's origin, m.
    pub range: f64,
    /// From the robot's x axis, positive to the left, rad.
    pub bearing: f64,
    /// What hides it.
    pub hidden: Option<HiddenBy>,
}

/// What stands before a corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HiddenBy {
    /// A wall, or the corner's own walls seen from behind.
    Wall,
    /// A walker's leg.
    Walker,
}

/// So much of the vertical edge above a corner must be free of people, too, m.
const EDGE_HEIGHT: f64 = 0.15;

pub(crate) fn corners(
    scene: &Scene,
    rig: &RangeFinder<f64>,
    walkers: &[Walker],
    pose: &Pose<f64>,
) -> Vec<TrueCorner> {
    let eye = pose.transform(rig.mount().lever_arm());
    let seen = scene.landmarks.iter().filter_map(|landmark| {
        let point = pose.inverse_transform(landmark.position);
        let pixel = rig.pixel_from_floor(point).ok()?;
        let (range, bearing) = range_bearing_from_floor(point);
        let hidden = if behind_walls(scene, landmark, eye, rig.mount().height()) {
            Some(HiddenBy::Wall)
        } else if behind_legs(walkers, landmark.position, eye, rig.mount().height()) {
            Some(HiddenBy::Walker)
        } else {
            None
        };
        Some(TrueCorner { id: landmark.id, pixel, range, bearing, hidden })
    });
    seen.collect()
}

fn behind_walls(scene: &Scene, landmark: &Landmark, eye: Vector2<f64>, height: f64) -> bool {
    let faces = |wall: usize| {
        let wall = &scene.walls[wall];
        wall.normal().dot(&(eye - wall.from)) > 0.0
    };
    if !landmark.walls.iter().any(|wall| faces(*wall)) {
        return true;
    }
    let sight = landmark.position - eye;
    scene.walls.iter().enumerate().filter(|(index, _)| !landmark.walls.contains(index)).any(|(_, wall)| {
        let along = wall.to - wall.from;
        let offset = wall.from - eye;
        let determinant = sight.perp(&along);
        let distance = offset.perp(&along) / determinant;
        let fraction = offset.perp(&sight) / determinant;
        let crossed = determinant != 0.0
            && distance > 0.0
            && distance < 1.0 - 1e-6
            && (-1e-9..=1.0 + 1e-9).contains(&fraction);
        // The line of sight comes down from the lens to the floor.
        crossed && height * (1.0 - distance) < wall.top
    })
}

fn behind_legs(walkers: &[Walker], place: Vector2<f64>, eye: Vector2<f64>, height: f64) -> bool {
    let sight = place - eye;
    let length = libm::sqrt(sight.norm_squared());
    walkers.iter().flat_map(Walker::feet).any(|foot| {
        let along = (foot - eye).dot(&sight) / length;
        let beside = (foot - eye).perp(&sight).abs() / length;
        // Edge and leg overlap when the leg's silhouette covers the bearing and the leg is nearer; a little
        // more than the leg, for its lean and the shoe.
        let rises = height - (height - EDGE_HEIGHT) * along / length;
        along > 0.0 && along < length && beside < LEG_RADIUS * 1.5 && rises < 1.0
    })
}
