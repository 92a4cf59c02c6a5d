//! From edges that are vertical in the world: door posts, corners of walls.
//!
//! They all pass through the vanishing point of the vertical. With e = robot_from_camᵀ · (0, 0, 1), the up direction
//! in the camera, and an edge { x : n·(x − c) = 0 } of rays,
//!
//! ```text
//! r = n·e_xy − (n·c) e_z = 0
//! var r = var_α (t·(e_xy − c e_z))² + var_p e_z²          t along the edge, α its angle, p its position
//! e = R_xᵀ(roll) R_yᵀ(tilt) (0, 0, 1), axes turned:       two parameters; yaw and height do not matter
//! ```
//!
//! A chair's leg may lean: some rounds weigh the edges by Cauchy's function, then what is beyond 3σ is left out. An edge
//! in a picture is also off by what no noise explains (a shade beside it, the lens's calibration), the same in every
//! row. So every edge gets the same variance τ² beyond its own, as large as the residuals ask for
//! (Σ r²/(σ² + τ²) = dof, as Paule and Mandel weigh laboratories), and the covariance means what it says.
use super::{Fitted, MountFit, Normal, solve};
use crate::geometry::{Camera, Mount};
use crate::lines::Line;
use crate::{Error, Result};
use nalgebra::{Matrix2, Vector2, Vector3, Vector6};

/// An edge in rays (x, y) = (X/Z, Y/Z) of the camera, lens distortion removed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VerticalEdge {
    /// Unit normal n.
    pub normal: Vector2<f64>,
    /// A point c of the edge, where angle and position are independent.
    pub centroid: Vector2<f64>,
    /// Variance of the position along the normal.
    pub var_position: f64,
    /// Variance of the normal's angle, rad².
    pub var_angle: f64,
}

impl VerticalEdge {
    /// A vertical line of a picture, in the camera's rays.
    pub fn from_line(camera: &Camera<f64>, line: &Line) -> Self {
        let (normal, centroid): (Vector2<f64>, Vector2<f64>) = (line.normal.cast(), line.centroid.cast());
        let (var_position_px2, var_angle): (f64, f64) = (line.var_position_px2.into(), line.var_angle.into());
        // ideal = A ray + b, so that n becomes Aᵀn and distances shrink by its length.
        let (focal, skew) = (camera.focal(), camera.skew());
        let ideal_by_ray = Matrix2::new(focal.x, skew, 0.0, focal.y);
        let turned = ideal_by_ray.tr_mul(&normal);
        let scale = turned.norm();
        let by_angle = ideal_by_ray.determinant() / (scale * scale);
        Self {
            normal: turned / scale,
            centroid: camera.ray_from_ideal(centroid),
            var_position: var_position_px2 / (scale * scale),
            var_angle: var_angle * by_angle * by_angle,
        }
    }
}

/// Cauchy's constant for 95 % efficiency.
const CAUCHY: f64 = 2.385;
const GATE: f64 = 9.0;
/// Of the excess variance and what lies within its gate.
const ROUNDS: usize = 5;

/// Tilt and roll with which the edges are vertical, and how many were used; of `fitted`, no more than
/// [`Fitted::TILT_AND_ROLL`].
///
/// # Errors
/// [`Error::Size`] with fewer than two edges, [`Error::OutOfRange`] where they do not tell tilt from roll.
pub fn fit_verticals(
    first: &Mount<f64>,
    edges: &[VerticalEdge],
    fitted: Fitted,
) -> Result<(MountFit, usize)> {
    let fitted = Fitted([false, fitted.0[1], fitted.0[2], false, false, false]);
    if edges.len() < 2 {
        return Err(Error::Size { name: "vertical edges", got: edges.len(), expected: 2 });
    }
    let cauchy = |distance: f64| 1.0 / (1.0 + distance / (CAUCHY * CAUCHY));
    let mut guess = fit(first, fitted, edges, 0.0, |edge| cauchy(squared(first, edge, 0.0)))?.mount;
    for _ in 0..10 {
        guess = fit(&guess, fitted, edges, 0.0, |edge| cauchy(squared(&guess, edge, 0.0)))?.mount;
    }
    let mut excess = 0.0;
    for _ in 0..ROUNDS {
        let inside = |edge: &VerticalEdge| f64::from(u8::from(squared(&guess, edge, excess) <= GATE));
        let used = || edges.iter().filter(|edge| inside(edge) > 0.0);
        let freedom = used().count().saturating_sub(fitted.count()) as f64;
        let cost = |excess: f64| used().map(|edge| squared(&guess, edge, excess)).sum::<f64>();
        let found = excess_variance(freedom, cost);
        guess = fit(&guess, fitted, edges, found, inside)?.mount;
        excess = found;
    }
    let inside = |edge: &VerticalEdge| f64::from(u8::from(squared(&guess, edge, excess) <= GATE));
    let used = edges.iter().filter(|edge| inside(edge) > 0.0).count();
    Ok((fit(&guess, fitted, edges, excess, inside)?, used))
}

/// The variance τ² that every edge has beyond its own, so that the residuals are as large as they should be.
fn excess_variance(freedom: f64, cost: impl Fn(f64) -> f64) -> f64 {
    if cost(0.0) <= freedom {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, 1e-2);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if cost(middle) > freedom { low = middle } else { high = middle }
    }
    high
}

fn squared(mount: &Mount<f64>, edge: &VerticalEdge, excess: f64) -> f64 {
    let (residual, variance, _) = residual(mount, edge);
    residual * residual / (variance + excess)
}

fn fit(
    first: &Mount<f64>,
    fitted: Fitted,
    edges: &[VerticalEdge],
    excess: f64,
    weight: impl Fn(&VerticalEdge) -> f64,
) -> Result<MountFit> {
    solve(first, fitted, |mount| {
        let mut normal = Normal::default();
        for edge in edges {
            let (residual, variance, by_mount) = residual(mount, edge);
            let share = weight(edge) / (variance + excess);
            normal.matrix += by_mount * by_mount.transpose() * share;
            normal.gradient -= by_mount * (residual * share);
            normal.cost += residual * residual * share;
            normal.count += usize::from(share > 0.0);
        }
        normal.cost.is_finite().then_some(normal)
    })
}

/// The residual, its variance and ∂r/∂m.
fn residual(mount: &Mount<f64>, edge: &VerticalEdge) -> (f64, f64, Vector6<f64>) {
    let [_, tilt, roll, ..] = mount.parameters();
    let (st, ct) = (libm::sin(tilt), libm::cos(tilt));
    let (sr, cr) = (libm::sin(roll), libm::cos(roll));
    // Up in the body's axes, R_xᵀ R_yᵀ ẑ = (−st, ct sr, ct cr), and (x, y, z)_cam = (−y, −z, x)_body.
    let up = Vector3::new(-ct * sr, -ct * cr, -st);
    let by_tilt = Vector3::new(st * sr, st * cr, -ct);
    let by_roll = Vector3::new(-ct * cr, ct * sr, 0.0);
    let line = edge.normal.push(-edge.normal.dot(&edge.centroid));
    let along = Vector2::new(-edge.normal.y, edge.normal.x);
    let lever = along.dot(&(up.xy() - edge.centroid * up.z));
    let variance = edge.var_angle * lever * lever + edge.var_position * up.z * up.z;
    (line.dot(&up), variance, Vector6::new(0.0, line.dot(&by_tilt), line.dot(&by_roll), 0.0, 0.0, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// The edge that a world's vertical at (X, Y) of the robot makes.
    fn edge(mount: &Mount<f64>, place: [f64; 2], turned: f64) -> VerticalEdge {
        let ray = |z: f64| {
            let in_cam = mount.robot_from_cam().tr_mul(&Vector3::new(place[0], place[1], z - mount.height()));
            in_cam.xy() / in_cam.z
        };
        let (foot, top) = (ray(0.0), ray(1.0));
        let along = (top - foot).normalize();
        let (sin, cos) = (libm::sin(turned), libm::cos(turned));
        let along = Vector2::new(cos * along.x - sin * along.y, sin * along.x + cos * along.y);
        VerticalEdge {
            normal: Vector2::new(-along.y, along.x),
            centroid: (foot + top) * 0.5,
            var_position: 1e-8,
            var_angle: 1e-7,
        }
    }

    #[test]
    fn vertical_edges_give_tilt_and_roll_and_a_leaning_one_is_left_out() {
        let truth = Mount::new([0.4, 0.2, 0.014, 0.02, 0.0, 0.0]).unwrap();
        let mut edges: Vec<_> =
            [[2.0, 0.8], [3.0, -0.9], [2.5, 0.1], [4.0, 1.0]].map(|place| edge(&truth, place, 0.0)).into();
        edges.push(edge(&truth, [2.2, 0.4], 0.05));
        let by_hand = Mount::new([0.4, 0.21, 0.0, 0.0, 0.0, 0.0]).unwrap();
        let (fit, used) = fit_verticals(&by_hand, &edges, Fitted::HEIGHT_AND_ANGLES).unwrap();
        let [_, tilt, roll, ..] = fit.mount.parameters();
        assert_eq!(used, 4);
        assert!((tilt - 0.2).abs() < 1e-9 && (roll - 0.014).abs() < 1e-9, "{fit:?}");
    }

    #[test]
    fn the_derivative_agrees_with_a_difference() {
        let mount = [0.4, 0.2, 0.014, 0.02, 0.0, 0.0];
        let edge = edge(&Mount::new([0.4, 0.25, 0.05, 0.0, 0.0, 0.0]).unwrap(), [2.0, 0.7], 0.01);
        let (_, _, by_mount) = residual(&Mount::new(mount).unwrap(), &edge);
        for index in 0..4 {
            let at = |step: f64| {
                let mut moved = mount;
                moved[index] += step;
                residual(&Mount::new(moved).unwrap(), &edge).0
            };
            assert!((by_mount[index] - (at(1e-6) - at(-1e-6)) / 2e-6).abs() < 1e-9);
        }
    }

    #[test]
    fn one_edge_is_too_few() {
        let mount = Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap();
        assert!(fit_verticals(&mount, &[edge(&mount, [2.0, 0.0], 0.0)], Fitted::HEIGHT_AND_ANGLES).is_err());
    }
}
