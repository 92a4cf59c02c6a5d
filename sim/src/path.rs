//! The robot's way: a smooth closed path, and the poses of a robot that follows it.
use monorange_core::geometry::{Pose, wrap_angle};
use nalgebra::Vector2;

/// A closed path as points at equal steps of arc length.
#[derive(Clone, Debug)]
pub(crate) struct Path {
    points: Vec<Vector2<f64>>,
    step: f64,
}

/// Speed (m/s) and turn rate (rad/s), held for one frame interval.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Twist {
    /// Along the robot's x axis, m/s.
    pub speed: f64,
    /// To the left, rad/s.
    pub turn: f64,
}

impl Twist {
    /// The pose after `interval` seconds, on the exact arc (the paper's (8) without its Euler step).
    pub fn step(&self, pose: &Pose<f64>, interval: f64) -> Pose<f64> {
        let (length, angle) = (self.speed * interval, self.turn * interval);
        let half = angle * 0.5;
        // The chord is length · sin(½ angle)/(½ angle), turned by ½ angle.
        let chord = if half.abs() < 1e-4 {
            length * (1.0 - half * half / 6.0)
        } else {
            length * libm::sin(half) / half
        };
        let direction = pose.heading + half;
        let (sin, cos) = (libm::sin(direction), libm::cos(direction));
        Pose::new(pose.x + chord * cos, pose.y + chord * sin, pose.heading + angle)
    }
}

/// How far ahead the robot aims, m: long enough to round a right angle gently.
const LOOK_AHEAD: f64 = 1.15;
/// Highest turn rate, rad/s for each m/s.
const MAX_CURVATURE: f64 = 1.5;

impl Path {
    /// Rounds the corners of a closed polygon as a robot does that aims at a point ahead of it.
    pub(crate) fn rounded(corners: &[Vector2<f64>]) -> Self {
        let coarse = Self::along(corners, 0.02);
        let mut pose = coarse.pose(0.0);
        let mut nearest = 0.0;
        let mut points = Vec::new();
        let step = 0.02;
        // The first lap settles, the second is kept.
        for lap in 0..2 {
            points.clear();
            while nearest < coarse.length() * f64::from(lap + 1) {
                points.push(pose.position());
                let twist = coarse.pursue(&pose, &mut nearest, 1.0, 0.0);
                pose = twist.step(&pose, step);
            }
        }
        Self::along(&points, 0.05)
    }

    /// The polygon itself, in equal steps near `step`.
    fn along(corners: &[Vector2<f64>], step: f64) -> Self {
        let sides = || corners.iter().zip(corners.iter().cycle().skip(1));
        let length: f64 = sides().map(|(from, to)| libm::sqrt((to - from).norm_squared())).sum();
        let count = (length / step).max(1.0) as usize;
        let step = length / count as f64;
        let mut points = Vec::with_capacity(count);
        let mut done = 0.0;
        for (from, to) in sides() {
            let side = libm::sqrt((to - from).norm_squared());
            while points.len() < count && points.len() as f64 * step < done + side {
                let fraction = (points.len() as f64 * step - done) / side;
                points.push(from + (to - from) * fraction);
            }
            done += side;
        }
        Self { points, step }
    }

    pub(crate) fn length(&self) -> f64 {
        self.points.len() as f64 * self.step
    }

    /// The point and its direction at an arc length, which may be of any lap.
    pub(crate) fn pose(&self, arc: f64) -> Pose<f64> {
        let position = arc / self.step;
        let whole = libm::floor(position);
        let count = self.points.len() as i64;
        let at = |offset: i64| self.points[(whole as i64 + offset).rem_euclid(count) as usize];
        let fraction = position - whole;
        let point = at(0) + (at(1) - at(0)) * fraction;
        let before = at(1) - at(-1);
        let after = at(2) - at(0);
        let along = before + (after - before) * fraction;
        Pose::new(point.x, point.y, libm::atan2(along.y, along.x))
    }

    /// A point beside the path, positive to the left.
    pub(crate) fn beside(&self, arc: f64, left: f64) -> Pose<f64> {
        let middle = self.pose(arc);
        let place = middle.transform(Vector2::new(0.0, left));
        Pose::new(place.x, place.y, middle.heading)
    }

    /// The twist towards the point [`LOOK_AHEAD`] ahead and `left` of the path; moves `nearest`, the arc length
    /// abreast of the robot, forward.
    pub(crate) fn pursue(&self, pose: &Pose<f64>, nearest: &mut f64, speed: f64, left: f64) -> Twist {
        let distance2 = |arc: f64| (self.pose(arc).position() - pose.position()).norm_squared();
        while distance2(*nearest + self.step) < distance2(*nearest) {
            *nearest += self.step;
        }
        let target = pose.inverse_transform(self.beside(*nearest + LOOK_AHEAD, left).position());
        let curvature = 2.0 * target.y / target.norm_squared();
        Twist { speed, turn: speed * curvature.clamp(-MAX_CURVATURE, MAX_CURVATURE) }
    }
}

/// Poses at every frame, the twists between them, and the arc length abreast of each pose.
pub(crate) struct Drive {
    pub(crate) poses: Vec<Pose<f64>>,
    pub(crate) twists: Vec<Twist>,
    pub(crate) arcs: Vec<f64>,
}

impl Drive {
    /// `frames` poses `interval` seconds apart at `speed`, weaving by `weave` metres to both sides, starting at
    /// the origin of `path` with its heading.
    pub(crate) fn new(path: &Path, frames: usize, interval: f64, speed: f64, weave: f64) -> Self {
        let mut drive = Self { poses: Vec::new(), twists: Vec::new(), arcs: Vec::new() };
        let mut pose = path.pose(0.0);
        pose.heading = wrap_angle(pose.heading);
        let mut nearest = 0.0;
        for _ in 0..frames {
            let left = weave * libm::sin(core::f64::consts::TAU * (nearest + LOOK_AHEAD) / WEAVE_LENGTH);
            let twist = path.pursue(&pose, &mut nearest, speed, left);
            drive.poses.push(pose);
            drive.twists.push(twist);
            drive.arcs.push(nearest);
            pose = twist.step(&pose, interval);
        }
        drive
    }
}

/// Metres of path in one swing to both sides.
const WEAVE_LENGTH: f64 = 7.0;
