//! From a flat board with a grid of known points: the camera itself, and the mount where the board lies on the floor.
//!
//! ```text
//! q = R p + t,   r = (u, v) − π(q_x / q_z, q_y / q_z)        p on the board's plane, π the camera with its lens
//! minimise  Σ_views Σ_points ‖r‖²   over f, c, lens, and R, t of each view
//! (A − Σ B C⁻¹ Bᵀ) δ_camera = g_camera − Σ B C⁻¹ g_pose,      δ_pose = C⁻¹ (g_pose − Bᵀ δ_camera)
//! Σ_camera = s² (A − Σ B C⁻¹ Bᵀ)⁻¹,   s² = Σ ‖r‖² / (numbers observed − numbers fitted)
//! ```
//!
//! | symbol | in code | shape, unit |
//! |---|---|---|
//! | p | [`BoardPoint::on_board`] | 2, m |
//! | R, t | [`BoardPose`] | camera from board; m |
//! | A, C, B | `Sums::camera`, `pose`, `mixed` | 9×9, 6×6 a view, 9×6 a view |
//! | s | [`CameraFit::pixel_std`] has it for u and for v | px |
//!
//! The start is in closed form (Zhang, "A flexible new technique for camera calibration", 2000): a homography H a view, whose
//! columns satisfy h₁ᵀωh₂ = 0 and h₁ᵀωh₁ = h₂ᵀωh₂; with the principal point taken for the picture's centre and no skew, ω has two
//! unknowns, 1/f_u² and 1/f_v². Levenberg's and Marquardt's method does the rest, the views' poses eliminated (Schur complement).
//!
//! The lens gets as many coefficients as the views tell: k₁, then p₁ p₂ k₂, then k₃, each group kept where it explains more than chance
//! does (χ² at 99 %) and the model stays one to one over the picture. A coefficient beyond that bends the picture's
//! corners, where no board was, at will.
//!
//! *Limits.* Polynomial lenses, up to about 120° of view. Boards that are all parallel to one another tell nothing of the focal
//! length or of the centre: their standard deviations say so, or there is no fit.
mod floor;
mod start;
#[cfg(test)]
mod tests;

pub use floor::{FloorMount, mount_on_floor};

use super::chi_square_99;
use crate::geometry::{Camera, Distortion};
use crate::{Error, Result};
use alloc::vec::Vec;
use nalgebra::{
    Matrix2, Matrix2x3, Matrix3, Matrix6, Rotation3, SMatrix, SVector, Vector2, Vector3, Vector6,
};

/// A point of a board, and the pixel that sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardPoint {
    /// On the board's plane, m.
    pub on_board: Vector2<f64>,
    /// (u, v), px.
    pub pixel: Vector2<f64>,
}

/// Where a board is: camera from board, its points at z = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardPose {
    /// A direction of the board's in the optical frame.
    pub rotation: Matrix3<f64>,
    /// The board's origin in the optical frame, m.
    pub translation: Vector3<f64>,
}

impl BoardPose {
    /// A point of the board in the optical frame.
    pub fn point_in_camera(&self, on_board: Vector2<f64>) -> Vector3<f64> {
        self.rotation * on_board.push(0.0) + self.translation
    }

    fn moved(&self, step: &Vector6<f64>) -> Self {
        let turn = Rotation3::new(step.fixed_rows::<3>(0).into_owned());
        Self {
            rotation: turn.matrix() * self.rotation,
            translation: self.translation + step.fixed_rows::<3>(3),
        }
    }
}

/// A camera that was fitted to views of a board.
#[derive(Clone, Debug)]
pub struct CameraFit {
    /// The camera.
    pub camera: Camera<f64>,
    /// Standard deviations of f_u f_v u₀ v₀ (px) and k₁ k₂ p₁ p₂ k₃; 0 where not fitted.
    pub std: [f64; 9],
    /// Of what is left between points and pixels, in u and in v, px.
    pub pixel_std: [f64; 2],
    /// Root mean square distance between points and pixels, px.
    pub rms: f64,
    /// The boards, in the order of the views.
    pub views: Vec<BoardView>,
}

/// A board as the fitted camera sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardView {
    /// Where it is.
    pub pose: BoardPose,
    /// Covariance of a small turn about the optical frame's axes (rad) and of the translation (m).
    pub covariance: Matrix6<f64>,
    /// Root mean square distance between its points and pixels, px.
    pub rms: f64,
}

/// Numbers of a camera that are fitted: f_u f_v u₀ v₀ k₁ k₂ p₁ p₂ k₃.
const NUMBERS: usize = 9;
/// Of [`NUMBERS`], what each stage fits.
const STAGES: [[bool; NUMBERS]; 4] = {
    let (t, f) = (true, false);
    [[t, t, t, t, f, f, f, f, f], [t, t, t, t, t, f, f, f, f], [t, t, t, t, t, t, t, t, f], [t; NUMBERS]]
};
const MAX_ITERATIONS: usize = 100;
/// Points of a view that a homography needs.
const LEAST_POINTS: usize = 4;

/// The camera of `width` × `height` pixels that sees the boards' points where they were seen, each view a board of its own pose.
///
/// # Errors
/// [`Error::Size`] with fewer than two views or four points a view; [`Error::OutOfRange`] where the views do not determine a camera.
pub fn fit_camera(width: usize, height: usize, views: &[&[BoardPoint]]) -> Result<CameraFit> {
    if views.len() < 2 {
        return Err(Error::Size { name: "views of the board", got: views.len(), expected: 2 });
    }
    if let Some(view) = views.iter().find(|view| view.len() < LEAST_POINTS) {
        return Err(Error::Size { name: "points of a view", got: view.len(), expected: LEAST_POINTS });
    }
    let (camera, poses) = start::start(width, height, views)?;
    let mut best: Option<State> = None;
    for free in STAGES {
        let from = best.as_ref().map_or((camera, &poses), |state| (state.camera, &state.poses));
        let Some(next) = State::solved(from.0, from.1, views, free) else { continue };
        let better = best.as_ref().is_none_or(|best| {
            let (fewer, more) = (best.fitted(), next.fitted());
            let explained = (best.cost - next.cost) / next.variance();
            explained > chi_square_99(more.saturating_sub(fewer)) && covers_picture(&next.camera)
        });
        if better {
            best = Some(next);
        }
    }
    best.ok_or(UNDETERMINED)?.finished()
}

/// The board of known points that a known camera sees.
///
/// # Errors
/// As [`fit_camera`].
pub fn fit_pose(camera: &Camera<f64>, points: &[BoardPoint]) -> Result<BoardView> {
    if points.len() < LEAST_POINTS {
        return Err(Error::Size { name: "points of a view", got: points.len(), expected: LEAST_POINTS });
    }
    let pose = start::pose(camera, points).ok_or(UNDETERMINED)?;
    let state = State::solved(*camera, &[pose], &[points], [false; NUMBERS]).ok_or(UNDETERMINED)?;
    state.finished()?.views.pop().ok_or(UNDETERMINED)
}

const UNDETERMINED: Error = Error::OutOfRange {
    name: "views of the board",
    value: 0.0,
    expected: "boards that are tilted to the camera, each in another direction",
};

/// Whether every pixel has a ray: of the outermost ones the corners and the sides' middles.
fn covers_picture(camera: &Camera<f64>) -> bool {
    let ends = |size: usize| [0.0, 0.5, 1.0].map(|share| share * (size as f64 - 1.0));
    let (across, down) = (ends(camera.width()), ends(camera.height()));
    across.iter().all(|u| down.iter().all(|v| camera.ray_from_pixel(Vector2::new(*u, *v)).is_some()))
}

/// Camera and poses on their way to the least cost.
struct State {
    camera: Camera<f64>,
    poses: Vec<BoardPose>,
    free: [bool; NUMBERS],
    sums: Vec<Sums>,
    cost: f64,
}

/// Of one view: the blocks of the normal equations, and the cost in u and in v.
#[derive(Clone, Debug)]
struct Sums {
    camera: SMatrix<f64, NUMBERS, NUMBERS>,
    mixed: SMatrix<f64, NUMBERS, 6>,
    pose: Matrix6<f64>,
    camera_gradient: SVector<f64, NUMBERS>,
    pose_gradient: Vector6<f64>,
    cost: Vector2<f64>,
    count: usize,
}

impl State {
    fn at(
        camera: Camera<f64>,
        poses: Vec<BoardPose>,
        views: &[&[BoardPoint]],
        free: [bool; NUMBERS],
    ) -> Option<Self> {
        let sums = poses.iter().zip(views).map(|(pose, view)| Sums::of(&camera, pose, view));
        let sums = sums.collect::<Option<Vec<_>>>()?;
        let cost: f64 = sums.iter().map(|sums| sums.cost.sum()).sum();
        cost.is_finite().then_some(Self { camera, poses, free, sums, cost })
    }

    fn solved(
        camera: Camera<f64>,
        poses: &[BoardPose],
        views: &[&[BoardPoint]],
        free: [bool; NUMBERS],
    ) -> Option<Self> {
        let mut state = Self::at(camera, poses.to_vec(), views, free)?;
        let mut damping = 1e-3;
        for _ in 0..MAX_ITERATIONS {
            match state.stepped(damping, views) {
                Some(next) if next.cost <= state.cost => {
                    let settled = state.cost - next.cost <= 1e-12 * (1e-6 + state.cost);
                    state = next;
                    damping = (damping * 0.2).max(1e-12);
                    if settled {
                        break;
                    }
                }
                _ if damping > 1e8 => break,
                _ => damping *= 5.0,
            }
        }
        Some(state)
    }

    /// A, and what of it is left when the poses are eliminated, with its right side; parameters that stay have the identity.
    fn reduced(&self, damping: f64) -> Option<(SMatrix<f64, NUMBERS, NUMBERS>, SVector<f64, NUMBERS>)> {
        let mut matrix = SMatrix::<f64, NUMBERS, NUMBERS>::zeros();
        let mut gradient = SVector::<f64, NUMBERS>::zeros();
        for sums in &self.sums {
            let inverse = damped(&sums.pose, damping).cholesky()?.inverse();
            let mixed = sums.mixed * inverse;
            matrix += damped(&sums.camera, damping) - mixed * sums.mixed.transpose();
            gradient += sums.camera_gradient - mixed * sums.pose_gradient;
        }
        let keep = SMatrix::from_diagonal(&SVector::from(self.free.map(|free| f64::from(u8::from(free)))));
        Some((keep * matrix * keep + (SMatrix::identity() - keep), keep * gradient))
    }

    fn stepped(&self, damping: f64, views: &[&[BoardPoint]]) -> Option<Self> {
        let (matrix, gradient) = self.reduced(damping)?;
        let step = matrix.cholesky()?.solve(&gradient);
        let poses = self.poses.iter().zip(&self.sums).map(|(pose, sums)| {
            let right = sums.pose_gradient - sums.mixed.transpose() * step;
            Some(pose.moved(&damped(&sums.pose, damping).cholesky()?.solve(&right)))
        });
        let poses = poses.collect::<Option<Vec<_>>>()?;
        Self::at(with_step(&self.camera, &step, &self.free)?, poses, views, self.free)
    }

    /// Numbers fitted.
    fn fitted(&self) -> usize {
        6 * self.poses.len() + self.free.iter().filter(|free| **free).count()
    }

    /// Of a pixel in one direction, from what is left.
    fn variance(&self) -> f64 {
        let observed: usize = self.sums.iter().map(|sums| 2 * sums.count).sum();
        self.cost / observed.saturating_sub(self.fitted()).max(1) as f64
    }

    fn finished(self) -> Result<CameraFit> {
        let count: usize = self.sums.iter().map(|sums| sums.count).sum();
        let (matrix, _) = self.reduced(0.0).ok_or(UNDETERMINED)?;
        // Scaled to a unit diagonal, so that pixels and coefficients do not decide what counts as singular.
        let scale = SMatrix::from_diagonal(&matrix.diagonal().map(|entry| 1.0 / libm::sqrt(entry)));
        let scaled = scale * matrix * scale;
        if (scaled - SMatrix::identity() * 1e-12).cholesky().is_none() {
            return Err(UNDETERMINED);
        }
        let inverse = scale * scaled.cholesky().ok_or(UNDETERMINED)?.inverse() * scale;
        let variance = self.variance();
        let keep = SMatrix::from_diagonal(&SVector::from(self.free.map(|free| f64::from(u8::from(free)))));
        let covariance = keep * inverse * keep * variance;
        let view = |(pose, sums): (&BoardPose, &Sums)| {
            let own = sums.pose.cholesky()?.inverse();
            let carried = own * sums.mixed.transpose();
            Some(BoardView {
                pose: *pose,
                covariance: own * variance + carried * covariance * carried.transpose(),
                rms: libm::sqrt(sums.cost.sum() / sums.count as f64),
            })
        };
        let boards = self.poses.iter().zip(&self.sums).map(view).collect::<Option<Vec<_>>>();
        let cost: Vector2<f64> = self.sums.iter().map(|sums| sums.cost).sum();
        let share = self.variance() / (self.cost / (2 * count) as f64).max(f64::MIN_POSITIVE);
        Ok(CameraFit {
            camera: self.camera,
            std: covariance.diagonal().map(libm::sqrt).into(),
            pixel_std: cost.map(|cost| libm::sqrt(cost / count as f64 * share)).into(),
            rms: libm::sqrt(self.cost / count as f64),
            views: boards.ok_or(UNDETERMINED)?,
        })
    }
}

impl Sums {
    fn of(camera: &Camera<f64>, pose: &BoardPose, points: &[BoardPoint]) -> Option<Self> {
        let mut sums = Self {
            camera: SMatrix::zeros(),
            mixed: SMatrix::zeros(),
            pose: Matrix6::zeros(),
            camera_gradient: SVector::zeros(),
            pose_gradient: Vector6::zeros(),
            cost: Vector2::zeros(),
            count: points.len(),
        };
        for point in points {
            let place = pose.point_in_camera(point.on_board);
            if place.z <= 0.0 {
                return None;
            }
            let ray = place.xy() / place.z;
            let pixel = camera.pixel_from_ray(ray)?;
            let residual = point.pixel - pixel;
            let by_place =
                camera.pixel_by_ray(ray) * Matrix2x3::new(1.0, 0.0, -ray.x, 0.0, 1.0, -ray.y) / place.z;
            // A turn dω moves R p by dω × R p.
            let arm = place - pose.translation;
            let by_turn = by_place * -arm.cross_matrix();
            let mut by_pose = SMatrix::<f64, 2, 6>::zeros();
            by_pose.fixed_columns_mut::<3>(0).copy_from(&by_turn);
            by_pose.fixed_columns_mut::<3>(3).copy_from(&by_place);
            let by_camera = pixel_by_camera(camera, ray, pixel);
            sums.camera += by_camera.transpose() * by_camera;
            sums.mixed += by_camera.transpose() * by_pose;
            sums.pose += by_pose.transpose() * by_pose;
            sums.camera_gradient += by_camera.transpose() * residual;
            sums.pose_gradient += by_pose.transpose() * residual;
            sums.cost += residual.component_mul(&residual);
        }
        Some(sums)
    }
}

/// ∂(u, v)/∂(f_u, f_v, u₀, v₀, k₁, k₂, p₁, p₂, k₃); the lens is linear in its coefficients.
fn pixel_by_camera(camera: &Camera<f64>, ray: Vector2<f64>, pixel: Vector2<f64>) -> SMatrix<f64, 2, NUMBERS> {
    let (focal, rho) = (camera.focal(), ray.norm_squared());
    let bent = (pixel - camera.principal()).component_div(&focal);
    let (x, y) = (ray.x, ray.y);
    let scale = Matrix2::from_diagonal(&focal);
    let tangential =
        [Vector2::new(2.0 * x * y, rho + 2.0 * y * y), Vector2::new(rho + 2.0 * x * x, 2.0 * x * y)];
    let [p1, p2] = tangential.map(|by| scale * by);
    SMatrix::from_columns(&[
        Vector2::new(bent.x, 0.0),
        Vector2::new(0.0, bent.y),
        Vector2::x(),
        Vector2::y(),
        scale * ray * rho,
        scale * ray * (rho * rho),
        p1,
        p2,
        scale * ray * (rho * rho * rho),
    ])
}

fn with_step(
    camera: &Camera<f64>,
    step: &SVector<f64, NUMBERS>,
    free: &[bool; NUMBERS],
) -> Option<Camera<f64>> {
    if !free.contains(&true) {
        return Some(*camera);
    }
    let [fu, fv, u0, v0, k1, k2, p1, p2, k3] = (*step).into();
    let mut lens = camera.lens().coefficients().into_iter();
    let mut moved = |by: f64| lens.next().unwrap_or_default() + by;
    let lens = Distortion { k1: moved(k1), k2: moved(k2), p1: moved(p1), p2: moved(p2), k3: moved(k3) };
    let (focal, principal) = (camera.focal(), camera.principal());
    let focal = [focal.x + fu, focal.y + fv];
    Camera::new(camera.width(), camera.height(), focal, [principal.x + u0, principal.y + v0], 0.0, lens).ok()
}

fn damped<const N: usize>(matrix: &SMatrix<f64, N, N>, damping: f64) -> SMatrix<f64, N, N> {
    let mut damped = *matrix;
    for index in 0..N {
        if let Some(entry) = damped.get_mut((index, index)) {
            *entry *= 1.0 + damping;
        }
    }
    damped
}
