//! The batch optimum of a log with names: Gauss–Newton over all poses and landmarks.
//!
//! Poses form a chain, landmarks a border: the normal equations are block tridiagonal in the poses with a dense
//! border, and are eliminated pose by pose. With K poses and M landmark coordinates an iteration costs about
//! 3·K·M²/2 multiplications; nothing is sparse but the chain, and no ordering has to be found.
#![allow(clippy::indexing_slicing, reason = "test tooling: every index comes from the same log")]
use monorange_core::geometry::{Pose, wrap_angle};
use nalgebra::{DMatrix, DVector, Matrix2, Matrix2x3, Matrix3, Matrix3xX, Vector2, Vector3};

/// A step of the chain: the increment in the earlier pose's frame with its information matrix.
#[derive(Clone, Debug)]
pub struct Step {
    /// (d_x, d_y, Δθ).
    pub delta: Vector3<f64>,
    /// Inverse covariance.
    pub information: Matrix3<f64>,
}

/// A landmark seen from a pose.
#[derive(Clone, Debug)]
pub struct Sight {
    /// Index of the pose.
    pub pose: usize,
    /// Index of the landmark.
    pub landmark: usize,
    /// In the pose's frame.
    pub point: Vector2<f64>,
    /// Inverse covariance of `point`.
    pub information: Matrix2<f64>,
}

/// A chain of poses, the first one known, and landmarks seen from them.
#[derive(Clone, Debug)]
pub struct Batch {
    /// One more than there are steps.
    pub poses: Vec<Pose<f64>>,
    /// Landmarks.
    pub landmarks: Vec<Vector2<f64>>,
    /// Steps from each pose to the next.
    pub steps: Vec<Step>,
    /// Sights, sorted by pose.
    pub sights: Vec<Sight>,
}

impl Batch {
    /// Iterates until the largest correction of a position is below a millimetre; the number of iterations.
    ///
    /// # Panics
    /// When the equations cannot be solved: a landmark without sights.
    pub fn optimise(&mut self, most: usize) -> usize {
        for iteration in 1..=most {
            if self.iterate() < 1e-3 {
                return iteration;
            }
        }
        most
    }

    /// Half the sum of squared, weighted residuals.
    pub fn cost(&self) -> f64 {
        let steps = (0..self.steps.len()).map(|k| {
            let (error, ..) = self.step_residual(k);
            error.dot(&(self.steps[k].information * error))
        });
        let sights = self.sights.iter().map(|sight| {
            let (error, ..) = self.sight_residual(sight);
            error.dot(&(sight.information * error))
        });
        0.5 * (steps.sum::<f64>() + sights.sum::<f64>())
    }

    /// Residual and its Jacobians w.r.t. the earlier and the later pose.
    fn step_residual(&self, k: usize) -> (Vector3<f64>, Matrix3<f64>, Matrix3<f64>) {
        let (from, to, step) = (self.poses[k], self.poses[k + 1], &self.steps[k]);
        let back = from.rotation().transpose();
        let d = back * (to.position() - from.position());
        let turn = wrap_angle(to.heading - from.heading - step.delta.z);
        let error = Vector3::new(d.x - step.delta.x, d.y - step.delta.y, turn);
        let by_from = Matrix3::new(-back.m11, -back.m12, d.y, -back.m21, -back.m22, -d.x, 0.0, 0.0, -1.0);
        let by_to = Matrix3::new(back.m11, back.m12, 0.0, back.m21, back.m22, 0.0, 0.0, 0.0, 1.0);
        (error, by_from, by_to)
    }

    fn sight_residual(&self, sight: &Sight) -> (Vector2<f64>, Matrix2x3<f64>, Matrix2<f64>) {
        let pose = self.poses[sight.pose];
        let back = pose.rotation().transpose();
        let d = back * (self.landmarks[sight.landmark] - pose.position());
        let by_pose = Matrix2x3::new(-back.m11, -back.m12, d.y, -back.m21, -back.m22, -d.x);
        (d - sight.point, by_pose, back)
    }

    fn iterate(&mut self) -> f64 {
        let (count, border) = (self.poses.len(), 2 * self.landmarks.len());
        let mut own = vec![Matrix3::<f64>::zeros(); count];
        let mut next = vec![Matrix3::<f64>::zeros(); count];
        let mut right = vec![Vector3::<f64>::zeros(); count];
        let mut corner = DMatrix::<f64>::zeros(border, border);
        let mut corner_right = DVector::<f64>::zeros(border);
        own[0] += Matrix3::identity() * 1e12; // the first pose is where it is
        for k in 0..self.steps.len() {
            let (error, by_from, by_to) = self.step_residual(k);
            let weight = self.steps[k].information;
            own[k] += by_from.transpose() * weight * by_from;
            own[k + 1] += by_to.transpose() * weight * by_to;
            next[k] += by_from.transpose() * weight * by_to;
            right[k] -= by_from.transpose() * weight * error;
            right[k + 1] -= by_to.transpose() * weight * error;
        }
        let mut eliminated: Vec<(Matrix3<f64>, Matrix3xX<f64>)> = Vec::with_capacity(count);
        let mut carried = Matrix3xX::<f64>::zeros(border);
        let mut sights = self.sights.iter().peekable();
        for k in 0..count {
            let mut coupling = core::mem::replace(&mut carried, Matrix3xX::zeros(0));
            while let Some(sight) = sights.next_if(|sight| sight.pose == k) {
                let (error, by_pose, by_landmark) = self.sight_residual(sight);
                let weight = sight.information;
                let at = 2 * sight.landmark;
                own[k] += by_pose.transpose() * weight * by_pose;
                right[k] -= by_pose.transpose() * weight * error;
                let mut columns = coupling.fixed_columns_mut::<2>(at);
                columns += by_pose.transpose() * weight * by_landmark;
                let mut block = corner.fixed_view_mut::<2, 2>(at, at);
                block += by_landmark.transpose() * weight * by_landmark;
                let mut rows = corner_right.fixed_rows_mut::<2>(at);
                rows -= by_landmark.transpose() * weight * error;
            }
            let inverse = own[k].try_inverse().expect("a chain of steps");
            let reduced = inverse * &coupling;
            // The border's share, upper half.
            for column in 0..border {
                let scaled = reduced.column(column);
                if scaled.amax() == 0.0 {
                    continue;
                }
                for row in 0..=column {
                    let left = coupling.column(row);
                    corner[(row, column)] -= left[0] * scaled[0] + left[1] * scaled[1] + left[2] * scaled[2];
                }
            }
            corner_right -= coupling.transpose() * (inverse * right[k]);
            if k + 1 < count {
                let down = next[k].transpose();
                own[k + 1] -= down * inverse * next[k];
                let moved = right[k];
                right[k + 1] -= down * inverse * moved;
                carried = -(down * &reduced);
            }
            eliminated.push((inverse, coupling));
        }
        corner.fill_lower_triangle_with_upper_triangle();
        let landmarks = corner.cholesky().expect("every landmark has a sight").solve(&corner_right);
        let mut largest = landmarks.amax();
        let mut later = Vector3::zeros();
        for k in (0..count).rev() {
            let (inverse, coupling) = &eliminated[k];
            let step = inverse * (right[k] - next[k] * later - coupling * &landmarks);
            let pose = self.poses[k];
            self.poses[k] = Pose::new(pose.x + step.x, pose.y + step.y, pose.heading + step.z);
            largest = largest.max(step.xy().amax());
            later = step;
        }
        for (index, landmark) in self.landmarks.iter_mut().enumerate() {
            *landmark += landmarks.fixed_rows::<2>(2 * index);
        }
        largest
    }
}
