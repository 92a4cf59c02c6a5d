//! The mount, calibrated: height, tilt, roll and yaw from what the camera sees.
//!
//! The paper measures the mount by hand and names that as its limit; its Table 2 errs mostly by about one degree
//! of mount. Four kinds of evidence replace the hand:
//!
//! | evidence | tells | where |
//! |---|---|---|
//! | floor points of known place | all six | [`fit_points`], [`explain_points`] |
//! | edges that are vertical in the world | tilt and roll | [`fit_verticals`] |
//! | a printed board (feature `alloc`) | the camera; height, tilt and roll where it lies on the floor | `board` |
//! | a drive with odometry | height and angles | [`fit_drive`]; or the filter's own mount states ([`MountError::Estimated`]) |
//!
//! They are weighted least squares over any subset of m = (height, tilt, roll, yaw, forward, left):
//!
//! ```text
//! minimise   Σᵢ rᵢ(m)ᵀ Wᵢ rᵢ(m),      (Σ Jᵢᵀ Wᵢ Jᵢ + λ diag) δ = Σ Jᵢᵀ Wᵢ rᵢ      (Levenberg, Marquardt)
//! Σ_m = (Σ Jᵢᵀ Wᵢ Jᵢ)⁻¹ · max(1, s²)  where the residuals contradict the stated noise,  s² = Σ rᵀWr / dof
//! ```
//!
//! | symbol | in code | shape | unit |
//! |---|---|---|---|
//! | m | `Mount::parameters()` | 6 | m, rad |
//! | r | residual, observed − seen through m | 2 a point, 1 an edge | m, rad; px; 1 |
//! | W | inverse covariance of r | 2×2 / 1 | |
//! | dof | numbers observed − parameters fitted | | |
//!
//! The contradiction is asked of χ² at 99 %: a fit whose residuals agree with the noise keeps the covariance that
//! follows from the noise alone. In `f64`: this runs on a host. Points at one distance cannot tell height from tilt;
//! [`MountFit::indistinct`] says so.
//!
//! [`MountError::Estimated`]: crate::pipeline::MountError::Estimated
#[cfg(feature = "alloc")]
pub mod board;
mod drive;
mod explanation;
mod points;
mod verticals;

pub use drive::{DriveStep, TrackedPoint, fit_drive};
pub use explanation::{Explanation, explain_points};
pub use points::{KnownPoint, PointNoise, deviations, fit_points, point_residual};
pub use verticals::{VerticalEdge, fit_verticals};

use crate::geometry::{MOUNT_PARAMETERS, Mount};
use crate::{Error, Result};
use nalgebra::{Matrix6, Vector6};

/// Which of height, tilt, roll, yaw, forward and left are fitted; the others stay as they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fitted(pub [bool; 6]);

impl Fitted {
    /// Height and attitude; the lever arm as given.
    pub const HEIGHT_AND_ANGLES: Self = Self([true, true, true, true, false, false]);
    /// The camera's attitude; height as given.
    pub const ANGLES: Self = Self([false, true, true, true, false, false]);
    /// What vertical edges tell.
    pub const TILT_AND_ROLL: Self = Self([false, true, true, false, false, false]);

    /// The same, and the lever arm.
    pub fn and_lever_arm(self) -> Self {
        let [height, tilt, roll, yaw, ..] = self.0;
        Self([height, tilt, roll, yaw, true, true])
    }

    /// How many.
    pub fn count(self) -> usize {
        self.0.into_iter().filter(|fitted| *fitted).count()
    }
}

/// A mount that was fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MountFit {
    /// The mount.
    pub mount: Mount<f64>,
    /// Covariance of height (m), tilt, roll, yaw (rad), forward, left (m); rows and columns of what was not fitted are 0.
    pub covariance: Matrix6<f64>,
    /// Σ rᵀ W r at the end.
    pub cost: f64,
    /// Numbers observed, less parameters fitted.
    pub freedom: usize,
}

impl MountFit {
    /// Standard deviations of height (m), tilt, roll, yaw (rad), forward and left (m); 0 where not fitted.
    pub fn std(&self) -> [f64; 6] {
        self.covariance.diagonal().map(libm::sqrt).into()
    }

    /// Whether the residuals agree with the stated noise, by χ² at 99 %.
    pub fn is_consistent(&self) -> bool {
        self.cost <= chi_square_99(self.freedom)
    }

    /// Two parameters that the evidence cannot tell apart, and their correlation, where that is beyond ±0.98.
    pub fn indistinct(&self) -> Option<([&'static str; 2], f64)> {
        let std = self.std();
        let names = || MOUNT_PARAMETERS.into_iter().zip(std).enumerate();
        let pairs = names().flat_map(|one| names().skip(one.0 + 1).map(move |other| (one, other)));
        pairs
            .filter(|((_, (_, one)), (_, (_, other)))| *one > 0.0 && *other > 0.0)
            .map(|((i, (first, one)), (j, (second, other)))| {
                let correlation = self.covariance.get((i, j)).map_or(0.0, |shared| shared / (one * other));
                ([first, second], correlation)
            })
            .filter(|(_, correlation)| correlation.abs() > 0.98)
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
    }
}

/// The sums of a least-squares step at one mount.
#[derive(Clone, Copy, Debug, Default)]
struct Normal {
    matrix: Matrix6<f64>,
    gradient: Vector6<f64>,
    cost: f64,
    count: usize,
}

const MAX_ITERATIONS: usize = 100;

/// The mount with the least cost; `at` gives the sums at a mount, or `None` where the evidence contradicts it.
fn solve(first: &Mount<f64>, fitted: Fitted, at: impl Fn(&Mount<f64>) -> Option<Normal>) -> Result<MountFit> {
    let mut mount = *first;
    let mut normal = at(&mount).ok_or(undetermined(0))?;
    let mut damping = 1e-3;
    for _ in 0..MAX_ITERATIONS {
        let mut damped = chosen(&normal.matrix, fitted);
        damped.set_diagonal(&(damped.diagonal() * (1.0 + damping)));
        let factor = damped.cholesky().ok_or(undetermined(normal.count))?;
        let step = factor.solve(&masked(&normal.gradient, fitted));
        match moved(&mount, &step).and_then(|moved| Some((moved, at(&moved)?))) {
            Some((next, sums)) if sums.cost <= normal.cost => {
                let settled = normal.cost - sums.cost <= 1e-13 * (1.0 + normal.cost);
                (mount, normal) = (next, sums);
                damping = (damping * 0.2).max(1e-12);
                if settled {
                    break;
                }
            }
            _ if damping > 1e8 => break,
            _ => damping *= 5.0,
        }
    }
    let freedom = normal.count.checked_sub(fitted.count()).ok_or(undetermined(normal.count))?;
    let information = chosen(&normal.matrix, fitted);
    // Scaled to a unit diagonal, so that metres and radians do not decide what counts as singular.
    let scale = information.diagonal().map(|entry| 1.0 / libm::sqrt(entry));
    let scaled = Matrix6::from_diagonal(&scale) * information * Matrix6::from_diagonal(&scale);
    // The least eigenvalue is above 1e-12 where the matrix less that much is still positive definite.
    if (scaled - Matrix6::identity() * 1e-12).cholesky().is_none() {
        return Err(undetermined(normal.count));
    }
    let inverse = scaled.cholesky().ok_or(undetermined(normal.count))?.inverse();
    let mut covariance = Matrix6::from_diagonal(&scale) * inverse * Matrix6::from_diagonal(&scale);
    for (index, _) in fitted.0.iter().enumerate().filter(|(_, fitted)| !**fitted) {
        covariance.row_mut(index).fill(0.0);
        covariance.column_mut(index).fill(0.0);
    }
    if normal.cost > chi_square_99(freedom) {
        covariance *= normal.cost / freedom.max(1) as f64;
    }
    Ok(MountFit { mount, covariance, cost: normal.cost, freedom })
}

fn undetermined(count: usize) -> Error {
    Error::OutOfRange {
        name: "mount evidence",
        value: count as f64,
        expected: "enough of it to tell the fitted parameters apart (points below the horizon, near and far)",
    }
}

/// The matrix with the identity where a parameter is not fitted.
fn chosen(matrix: &Matrix6<f64>, fitted: Fitted) -> Matrix6<f64> {
    let keep = Matrix6::from_diagonal(&Vector6::from(fitted.0.map(|fitted| f64::from(u8::from(fitted)))));
    keep * matrix * keep + (Matrix6::identity() - keep)
}

fn masked(vector: &Vector6<f64>, fitted: Fitted) -> Vector6<f64> {
    vector.component_mul(&Vector6::from(fitted.0.map(|fitted| f64::from(u8::from(fitted)))))
}

fn moved(mount: &Mount<f64>, step: &Vector6<f64>) -> Option<Mount<f64>> {
    let mut parameters = mount.parameters();
    for (parameter, change) in parameters.iter_mut().zip(step.iter()) {
        *parameter += *change;
    }
    Mount::new(parameters).ok()
}

/// The 99 % quantile of χ² by Wilson and Hilferty's approximation; 0 without freedom.
fn chi_square_99(freedom: usize) -> f64 {
    if freedom == 0 {
        return f64::INFINITY;
    }
    let dof = freedom as f64;
    let spread = 2.0 / (9.0 * dof);
    let root = 1.0 - spread + 2.3263 * libm::sqrt(spread);
    dof * root * root * root
}
