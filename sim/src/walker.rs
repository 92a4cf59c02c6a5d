//! People who walk about, stop, turn round and cross the robot's way.
use crate::path::Path;
use crate::random::{Random, Stream};
use nalgebra::Vector2;

/// A person at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walker {
    /// Between the feet, m.
    pub position: Vector2<f64>,
    /// Where the person faces, rad.
    pub heading: f64,
    /// Phase of the step in [0, 1): which foot is in front.
    pub phase: f64,
    /// How far the stride is open, 0 standing to 1 walking.
    pub stride: f64,
}

/// Radius of a leg, m.
pub(crate) const LEG_RADIUS: f64 = 0.075;
/// Distance of each foot from the middle, m.
const STANCE: f64 = 0.10;
/// Length of two steps at full stride, m.
const CYCLE: f64 = 1.1;
/// No person is faster than this, m/s (along and across together).
pub const MAX_WALKING_SPEED: f64 = 2.0;

impl Walker {
    /// The left and the right foot, m.
    pub fn feet(&self) -> [Vector2<f64>; 2] {
        let (sin, cos) = (libm::sin(self.heading), libm::cos(self.heading));
        let (ahead, left) = (Vector2::new(cos, sin), Vector2::new(-sin, cos));
        [(1.0, 0.0), (-1.0, 0.5)].map(|(side, shift)| {
            let phase = self.phase + shift - libm::floor(self.phase + shift);
            // On the ground for one half of the cycle (the body passes over it), in the air for the other.
            let swing = if phase < 0.5 { 1.0 - 4.0 * phase } else { 4.0 * phase - 3.0 };
            self.position + left * (side * STANCE) + ahead * (swing * 0.25 * CYCLE * self.stride)
        })
    }
}

/// What one person does now.
struct Mind {
    arc: f64,
    left: f64,
    goal_left: f64,
    /// Along the path; negative against the robot.
    speed: f64,
    goal_speed: f64,
    direction: f64,
    facing: f64,
    phase: f64,
    patience: f64,
}

/// Every person at every frame: `[frame][person]`.
pub(crate) fn walk(
    path: &Path,
    robot_arcs: &[f64],
    interval: f64,
    walkway: f64,
    people: usize,
    seed: u64,
) -> Vec<Vec<Walker>> {
    let mut random = Random::new(seed, Stream::Walkers);
    let start = robot_arcs.first().copied().unwrap_or_default();
    let mut minds: Vec<Mind> = (0..people)
        .map(|person| {
            let side = if person % 2 == 0 { 1.0 } else { -1.0 };
            let left = side * random.within(0.75, 1.0) * walkway;
            let direction = if random.chance(0.5) { 1.0 } else { -1.0 };
            Mind {
                arc: start + 3.5 + 2.3 * person as f64 + random.within(0.0, 1.5),
                left,
                goal_left: left,
                speed: 0.0,
                goal_speed: direction * random.within(0.5, 1.0),
                direction,
                facing: if direction > 0.0 { 0.0 } else { core::f64::consts::PI },
                phase: random.unit(),
                patience: random.within(0.5, 3.0),
            }
        })
        .collect();
    let sub_steps = (interval / 0.05).max(1.0) as usize;
    let step = interval / sub_steps as f64;
    let mut frames = Vec::with_capacity(robot_arcs.len());
    for (frame, &robot) in robot_arcs.iter().enumerate() {
        frames.push(minds.iter().map(|mind| mind.seen(path)).collect());
        let next = robot_arcs.get(frame + 1).copied().unwrap_or(robot);
        for sub_step in 0..sub_steps {
            let robot = robot + (next - robot) * sub_step as f64 / sub_steps as f64;
            for mind in &mut minds {
                mind.step(robot, walkway, step, &mut random);
            }
        }
    }
    frames
}

impl Mind {
    fn seen(&self, path: &Path) -> Walker {
        let pose = path.beside(self.arc, self.left);
        let heading = pose.heading + self.facing;
        let stride = (self.speed.abs() / 0.8).min(1.0);
        Walker { position: pose.position(), heading, phase: self.phase, stride }
    }

    fn step(&mut self, robot: f64, walkway: f64, step: f64, random: &mut Random) {
        self.patience -= step;
        if self.patience <= 0.0 {
            self.decide(walkway, random);
        }
        // Stays about the robot, where it can be seen.
        let ahead = self.arc - robot;
        if !(-4.0..=8.0).contains(&ahead) {
            self.direction = if ahead > 0.0 { -1.0 } else { 1.0 };
            self.goal_speed = self.direction * self.goal_speed.abs().max(0.6);
        }
        // Makes way for the robot; nobody crosses right in front of it.
        let clearance = 0.75 * walkway;
        let near = ahead.abs() < 1.6;
        let mut goal = self.goal_left;
        if near {
            let side = if self.left >= 0.0 { 1.0 } else { -1.0 };
            goal = side * goal.abs().max(clearance);
        }
        let acceleration = 1.5 * step;
        self.speed += (self.goal_speed - self.speed).clamp(-acceleration, acceleration);
        let sideways = if near { 1.1 } else { 0.6 } * step;
        let shift = (goal - self.left).clamp(-sideways, sideways);
        self.left += shift;
        self.arc += self.speed * step;
        let walked = libm::sqrt(self.speed * self.speed * step * step + shift * shift);
        self.phase += walked / CYCLE;
        self.phase -= libm::floor(self.phase);
        // Turns the body towards where it goes.
        if walked > 0.1 * step {
            let wanted = libm::atan2(shift, self.speed * step);
            let turn = monorange_core::geometry::wrap_angle(wanted - self.facing);
            self.facing += turn.clamp(-4.0 * step, 4.0 * step);
        }
    }

    fn decide(&mut self, walkway: f64, random: &mut Random) {
        let choice = random.unit();
        if choice < 0.22 {
            self.goal_speed = 0.0;
            self.patience = random.within(1.5, 5.0);
            return;
        }
        if choice < 0.36 {
            self.direction = -self.direction;
        }
        if random.chance(0.3) {
            let side = if self.left >= 0.0 { -1.0 } else { 1.0 };
            self.goal_left = side * random.within(0.75, 1.0) * walkway;
        }
        let pace = if random.chance(0.3) { random.within(0.3, 0.6) } else { random.within(0.7, 1.3) };
        self.goal_speed = self.direction * pace;
        self.patience = random.within(2.0, 7.0);
    }
}
