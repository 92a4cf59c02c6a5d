//! The filter with a sensor that it does not know: a compass-stabilised radio that tells where a beacon lies, in the
//! world's directions. The measurement is linearised here, and its Jacobians are checked.
//!
//! `cargo run -p monorange-core --example own_sensor` prints
//!
//! ```text
//! Jacobians right: true
//! after 1 s: 1.00 m by the wheels, 0.85 ± 0.10 m with the radio (update)
//! after 2 s: 1.85 m by the wheels, 1.65 ± 0.10 m with the radio (update)
//! after 3 s: 2.65 m by the wheels, 2.45 ± 0.10 m with the radio (update)
//! ```
use monorange_core::geometry::Pose;
use monorange_core::slam::{
    Filter, FilterConfig, Form, Increment, Integration, Landmark, LinearisationPoint, Linearised,
    check_jacobians, states_for, storage_len,
};
use nalgebra::{Matrix2, Matrix2x3, Matrix2x4, Matrix3, Vector2, Vector4};

/// Standard deviation of the radio in x and y of the world, m.
const STD: f64 = 0.1;

/// h = l − p: it depends on the robot's place and the landmark's, and on no heading.
fn linearise(measured: Vector2<f64>, at: &LinearisationPoint<f64>) -> Linearised<f64> {
    Linearised {
        innovation: measured - (at.landmark.xy() - at.pose.position()),
        by_robot: Matrix2x3::new(-1.0, 0.0, 0.0, 0.0, -1.0, 0.0),
        by_mount: Matrix2x4::zeros(),
        by_landmark: Matrix2x4::identity(),
        noise: Matrix2::identity() * (STD * STD),
        dof: 2,
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let states = states_for(8, false);
    let (numbers, landmarks) = (vec![0.0; storage_len(states)], vec![Landmark::default(); 8]);
    let mut filter =
        Filter::new(numbers, landmarks, Pose::default(), Matrix3::zeros(), FilterConfig::default())?;
    // The beacon, 4 m ahead and 2 m to the left of the start, is known to 5 cm.
    filter.birth_at(0.0, 7, Vector2::new(4.0, 2.0), &(Matrix2::identity() * (0.05 * 0.05)))?;
    let at = LinearisationPoint {
        pose: Pose::new(1.0, 0.5, 0.3),
        mount: Vector4::zeros(),
        landmark: Vector4::new(4.0, 2.0, 0.0, 0.0),
    };
    let check = check_jacobians(&at, Form::Point, |at| Some(linearise(Vector2::new(3.0, 1.5), at)));
    println!("Jacobians right: {}", check.is_some_and(|check| check.error < 1e-8));
    // The wheels slip: they say 1 m/s, the robot does 0.8 m/s.
    let noise = Matrix2::from_diagonal(&Vector2::new(0.2 * 0.2, 0.02 * 0.02));
    for second in 1..=3 {
        let time = f64::from(second);
        filter.predict(time, &Increment::from_velocity(1.0, 0.0, 1.0, &noise, Integration::Arc))?;
        let by_wheels = filter.pose().x;
        let beacon = filter.landmark(7).and_then(|known| filter.position(known)).ok_or("no beacon")?;
        let now = LinearisationPoint {
            pose: filter.pose(),
            mount: Vector4::zeros(),
            landmark: Vector4::new(beacon.x, beacon.y, 0.0, 0.0),
        };
        let measured = Vector2::new(4.0 - 0.8 * time, 2.0);
        let outcome = filter.update_linearised(7, &linearise(measured, &now))?;
        let std = filter.pose_covariance().m11.sqrt();
        println!(
            "after {second} s: {by_wheels:.2} m by the wheels, {:.2} ± {std:.2} m with the radio ({})",
            filter.pose().x,
            outcome.decision.as_str(),
        );
    }
    Ok(())
}
