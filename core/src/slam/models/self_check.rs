//! A check for measurements that the filter does not know: are their Jacobians those of their innovation?
//!
//! A wrong entry of H does not make the filter fail; it makes it slowly wrong. Every Jacobian of this crate's own
//! measurements is held against central differences by this same function, and so should be those of a
//! [`Linearised`] that is given to [`Filter::update_linearised`](super::Filter::update_linearised):
//!
//! ```
//! use monorange_core::geometry::Pose;
//! use monorange_core::slam::{Form, LinearisationPoint, Linearised, check_jacobians};
//! use nalgebra::{Matrix2, Matrix2x3, Matrix2x4, Vector2, Vector4};
//! // A beacon's distance in x and y of the world, as a compass-stabilised sensor would measure it: h = l − p.
//! let measured = Vector2::new(2.0, 1.0);
//! let linearise = |at: &LinearisationPoint<f64>| Some(Linearised {
//!     innovation: measured - (at.landmark.xy() - at.pose.position()),
//!     by_robot: Matrix2x3::new(-1.0, 0.0, 0.0, 0.0, -1.0, 0.0),
//!     by_mount: Matrix2x4::zeros(),
//!     by_landmark: Matrix2x4::identity(),
//!     noise: Matrix2::identity() * 0.01,
//!     dof: 2,
//! });
//! let at = LinearisationPoint { pose: Pose::new(1.0, 2.0, 0.3), mount: Vector4::zeros(), landmark: Vector4::new(3.0, 2.5, 0.0, 0.0) };
//! let check = check_jacobians(&at, Form::Point, linearise).unwrap();
//! assert!(check.error < 1e-8, "{check:?}");
//! ```
use crate::Real;
use crate::geometry::Pose;
use crate::slam::landmark::Form;
use crate::slam::models::Linearised;
use nalgebra::{Vector2, Vector4};

/// Where a measurement is linearised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearisationPoint<T> {
    /// The robot in the world.
    pub pose: Pose<T>,
    /// Errors of the mount's height, tilt, roll and yaw.
    pub mount: Vector4<T>,
    /// The landmark's numbers: (x, y), or (x₀, y₀, φ, ρ) of an inverse-distance landmark.
    pub landmark: Vector4<T>,
}

/// The entry of a Jacobian that is furthest from central differences.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JacobianCheck<T> {
    /// |given − central| / max(1, |central|).
    pub error: T,
    /// `by_robot`, `by_mount` or `by_landmark`.
    pub block: &'static str,
    /// Its row and column there.
    pub place: (usize, usize),
    /// As given, and by central differences.
    pub given_and_central: [T; 2],
}

/// The worst entry of all three Jacobians of a measurement at a point; `None` where the measurement has no value at the
/// point or beside it.
///
/// Only rows within the measurement's degrees of freedom and the columns of `form` count. In `f64` right Jacobians of
/// a smooth measurement come out below 1e-8, in `f32` below 1e-2. Choose a point where the innovation is small: a
/// bearing's must not wrap between the differences.
pub fn check_jacobians<T: Real>(
    at: &LinearisationPoint<T>,
    form: Form,
    linearise: impl Fn(&LinearisationPoint<T>) -> Option<Linearised<T>>,
) -> Option<JacobianCheck<T>> {
    let given = linearise(at)?;
    let step = T::default_epsilon().cbrt();
    let by = |nudge: &dyn Fn(&mut LinearisationPoint<T>, T)| -> Option<Vector2<T>> {
        let moved = |step: T| {
            let mut moved = *at;
            nudge(&mut moved, step);
            linearise(&moved).map(|linear| linear.innovation)
        };
        // The innovation is measured minus predicted.
        Some((moved(-step)? - moved(step)?) / (step + step))
    };
    let mut worst = JacobianCheck {
        error: T::zero(),
        block: "by_robot",
        place: (0, 0),
        given_and_central: [T::zero(); 2],
    };
    let mut compare = |block, column, entries: Vector2<T>, central: Vector2<T>| {
        for (row, (given, central)) in entries.iter().zip(central.iter()).enumerate().take(given.dof) {
            let error = (*given - *central).abs() / central.abs().max(T::one());
            if error > worst.error || !error.is_finite() {
                worst = JacobianCheck {
                    error,
                    block,
                    place: (row, column),
                    given_and_central: [*given, *central],
                };
            }
        }
    };
    for column in 0..3 {
        let central = by(&|point, step| match column {
            0 => point.pose.x += step,
            1 => point.pose.y += step,
            _ => point.pose.heading += step,
        })?;
        compare("by_robot", column, given.by_robot.column(column).into_owned(), central);
    }
    for column in 0..4 {
        let central = by(&|point, by| point.mount += Vector4::ith(column, by))?;
        compare("by_mount", column, given.by_mount.column(column).into_owned(), central);
    }
    for column in 0..form.len() {
        let central = by(&|point, by| point.landmark += Vector4::ith(column, by))?;
        compare("by_landmark", column, given.by_landmark.column(column).into_owned(), central);
    }
    Some(worst)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Camera, Distortion, Mount, RangeFinder};
    use crate::slam::models::Measurement;
    use crate::slam::models::linearise::{self, Relative};
    use nalgebra::Matrix2;

    /// A camera with a lens, its mount off by `error` of height, tilt, roll and yaw.
    fn finder(error: &Vector4<f64>) -> RangeFinder<f64> {
        let lens = Distortion { k1: -0.22, k2: 0.36, p1: -0.005, p2: -0.002, k3: 0.0 };
        let camera = Camera::new(320, 240, [365.0, 366.0], [146.0, 115.0], 0.0, lens).unwrap();
        let mut parameters = [0.4, 0.2, 0.02, -0.03, 0.05, 0.01];
        for (parameter, error) in parameters.iter_mut().zip(error.iter()) {
            *parameter += error;
        }
        RangeFinder::new(camera, Mount::new(parameters).unwrap())
    }

    fn linearise(
        at: &LinearisationPoint<f64>,
        form: Form,
        measurement: &Measurement<f64>,
        as_point: bool,
    ) -> Option<Linearised<f64>> {
        let finder = finder(&at.mount);
        let (sin, cos) = at.pose.heading.sin_cos();
        let ray = (form == Form::InverseDistance).then(|| (at.landmark[2], at.landmark[3]));
        let now = Relative { heading: (cos, sin), offset: at.landmark.xy() - at.pose.position(), ray };
        linearise::linearise(measurement, &now, &now, Some(&finder), as_point)
    }

    fn measurements() -> [Measurement<f64>; 5] {
        let covariance = Matrix2::new(0.01, 0.001, 0.001, 0.02);
        [
            Measurement::RangeBearing { range: 2.1, bearing: 0.1, covariance, by_mount: None },
            Measurement::Point { point: Vector2::new(2.0, 0.2), covariance },
            Measurement::Bearing { bearing: 0.1, variance: 0.01, range_prior: None },
            Measurement::Range { range: 2.1, variance: 0.01 },
            Measurement::Pixel { pixel: Vector2::new(150.0, 120.0), covariance },
        ]
    }

    #[test]
    fn every_measurement_of_either_form_of_landmark_follows_central_differences() {
        let mount = Vector4::new(0.003, -0.004, 0.002, 0.005);
        for (x, y, heading) in [(1.0_f64, 2.0_f64, 0.3_f64), (-4.0, 1.5, -2.8), (100.0, -50.0, 1.5)] {
            let pose = Pose::new(x, y, heading);
            // 2 m ahead and a little to the left; and the same place from a ray that began 1 m to the right.
            let place = pose.transform(Vector2::new(2.0, 0.15));
            let anchor = pose.transform(Vector2::new(0.2, -1.0));
            let ray = place - anchor;
            let forms = [
                (Form::Point, Vector4::new(place.x, place.y, 0.0, 0.0)),
                (
                    Form::InverseDistance,
                    Vector4::new(anchor.x, anchor.y, ray.y.atan2(ray.x), 1.0 / ray.norm()),
                ),
            ];
            for (form, landmark) in forms {
                let at = LinearisationPoint { pose, mount, landmark };
                for measurement in measurements() {
                    for as_point in [false, true] {
                        let own = |at: &LinearisationPoint<f64>| linearise(at, form, &measurement, as_point);
                        let check = check_jacobians(&at, form, own).unwrap();
                        // An inverse-distance landmark's bearing is taken from ρ d, whose Jacobian is the same.
                        let scale =
                            if matches!(measurement, Measurement::Pixel { .. }) { 1e-6 } else { 1e-8 };
                        assert!(check.error < scale, "{measurement:?} {form:?}: {check:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_range_and_bearing_through_the_camera_follow_the_mount() {
        let pixel = Vector2::new(150.0, 120.0);
        let at_mount = |error: &Vector4<f64>| {
            let sight = finder(error).sight(pixel).unwrap();
            let by_mount = sight.by_mount.fixed_columns::<4>(0).into_owned();
            let (covariance, by_mount) = (Matrix2::identity() * 0.01, Some(by_mount));
            (
                Measurement::RangeBearing {
                    range: sight.range,
                    bearing: sight.bearing,
                    covariance,
                    by_mount,
                },
                sight,
            )
        };
        let (pose, mount) = (Pose::new(1.0, 2.0, 0.3), Vector4::new(0.003, -0.004, 0.002, 0.005));
        // A little nearer than it was measured: the error across is then taken at the measured range.
        let place = pose.transform(at_mount(&mount).1.point_in_robot * 0.999);
        let at = LinearisationPoint { pose, mount, landmark: Vector4::new(place.x, place.y, 0.0, 0.0) };
        for as_point in [false, true] {
            let check = check_jacobians(&at, Form::Point, |at| {
                linearise(at, Form::Point, &at_mount(&at.mount).0, as_point)
            });
            assert!(check.unwrap().error < 1e-7, "{check:?}");
        }
    }

    #[test]
    fn a_wrong_sign_is_found_and_named() {
        let at = LinearisationPoint {
            pose: Pose::new(1.0, 2.0, 0.3),
            mount: Vector4::zeros(),
            landmark: Vector4::new(3.0, 2.5, 0.0, 0.0),
        };
        let [measurement, ..] = measurements();
        let wrong = |at: &LinearisationPoint<f64>| {
            let mut linear = linearise(at, Form::Point, &measurement, false)?;
            linear.by_robot[(1, 2)] = -linear.by_robot[(1, 2)];
            Some(linear)
        };
        let check = check_jacobians(&at, Form::Point, wrong).unwrap();
        assert_eq!((check.block, check.place), ("by_robot", (1, 2)));
        assert!((check.error - 2.0).abs() < 1e-6);
    }
}
