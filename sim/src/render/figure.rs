//! People as leaning cylinders: two for each shoe, one for each leg, body, head.
use crate::walker::{LEG_RADIUS, Walker};
use nalgebra::{Vector2, Vector3};

/// A round part of a person, seen from the lens in the robot's axes.
pub(super) struct Part {
    /// Its axis at the height of the lens.
    axis: Vector2<f32>,
    /// How much the axis moves for each metre up.
    lean: Vector2<f32>,
    radius: f32,
    low: f32,
    high: f32,
    pub(super) grey: f32,
    /// Different for neighbouring parts.
    pub(super) number: u32,
}

/// Height of the hips, m.
const HIP: f64 = 0.88;

impl Part {
    /// The parts of a person, each with a disc of the plan (centre, radius) that holds it.
    pub(super) fn of(
        walker: &Walker,
        person: usize,
        seen: impl Fn(Vector2<f64>) -> Vector2<f64>,
        robot_heading: f64,
        lens_height: f64,
    ) -> Vec<(Self, (Vector2<f64>, f64))> {
        const TROUSERS: [f32; 5] = [62.0, 40.0, 92.0, 74.0, 50.0];
        const COATS: [f32; 5] = [150.0, 64.0, 182.0, 104.0, 210.0];
        let angle = walker.heading - robot_heading;
        let ahead = Vector2::new(libm::cos(angle), libm::sin(angle));
        let side = Vector2::new(-ahead.y, ahead.x);
        let middle = seen(walker.position);
        let mut parts = Vec::new();
        let mut add = |foot: Vector2<f64>, top: Vector2<f64>, radius: f64, low: f64, high: f64, grey: f32| {
            let lean = (top - foot) / HIP;
            let number = (person * 8 + parts.len()) as u32;
            let part = Self {
                axis: (foot + lean * lens_height).cast(),
                lean: lean.cast(),
                radius: radius as f32,
                low: low as f32,
                high: high as f32,
                grey,
                number,
            };
            // The axis wanders from its place at `low` to that at `high`.
            let (first, last) = (foot + lean * low, foot + lean * high);
            let reach = 0.5 * (last - first).norm() + radius;
            parts.push((part, ((first + last) * 0.5, reach)));
        };
        for (foot, left) in walker.feet().into_iter().zip([1.0, -1.0]) {
            let foot = seen(foot);
            let hip = middle + side * (left * 0.085);
            let (heel, toe) = (foot + ahead * 0.01, foot + ahead * 0.12);
            add(heel, heel, LEG_RADIUS * 0.97, 0.0, 0.08, 26.0);
            add(toe, toe, LEG_RADIUS * 0.72, 0.0, 0.06, 30.0);
            add(foot, hip, LEG_RADIUS, 0.065, HIP, TROUSERS[person % TROUSERS.len()]);
        }
        add(middle, middle, 0.19, HIP - 0.08, 1.46, COATS[person % COATS.len()]);
        add(middle, middle, 0.095, 1.5, 1.74, 168.0);
        parts
    }

    /// Depth of the near side along a ray.
    #[inline]
    pub(super) fn depth(&self, direction: &Vector3<f32>, lens_height: f32) -> Option<f32> {
        if direction.z <= 0.0 && self.low >= lens_height {
            return None; // the ray never rises to it
        }
        // |depth · (D_xy − lean · D_z) − axis|² = radius²
        let across = direction.xy() - self.lean * direction.z;
        let (a, b) = (across.norm_squared(), across.dot(&self.axis));
        let c = self.axis.norm_squared() - self.radius * self.radius;
        let discriminant = b * b - a * c;
        if discriminant < 0.0 {
            return None;
        }
        let depth = (b - libm::sqrtf(discriminant)) / a;
        let height = lens_height + depth * direction.z;
        (depth > 0.0 && height >= self.low && height <= self.high).then_some(depth)
    }

    /// (cosine between surface and ray, metres round the part) at a hit: for shade and cloth.
    #[inline]
    pub(super) fn relief(&self, direction: &Vector3<f32>, depth: f32) -> (f32, f32) {
        let across = direction.xy() - self.lean * direction.z;
        let normal = (across * depth - self.axis) / self.radius;
        let length = libm::sqrtf(direction.xy().norm_squared());
        (-normal.dot(&direction.xy()) / length, normal.perp(&direction.xy()) / length * self.radius)
    }
}
