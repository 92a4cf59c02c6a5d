//! Consistency on long loops: the filter's covariance against its error.
use monorange_core::Real;
use monorange_core::association::Gate;
use monorange_core::geometry::Pose;
use monorange_core::slam::{
    Covariance, FilterConfig, Increment, Integration, Measurement, Observation, Outcome, Variant,
};
use monorange_tests::slam::host_filter;
use monorange_tests::slam::ring_drive::{Drive, Step};
use nalgebra::Matrix3;

#[derive(Clone, Copy, Debug, Default)]
struct Score {
    nees_mean: f64,
    nees_end: f64,
    position_squared: f64,
    heading_squared: f64,
}

fn score<T: Real>(drive: &Drive, steps: &[Step], config: FilterConfig<T>) -> Score {
    let lit = |value: f64| T::lit(value);
    let start = Pose::new(T::zero(), T::zero(), T::zero());
    let mut filter = host_filter(drive.landmarks, start, Matrix3::identity() * lit(1e-8), config);
    let noise = drive.odometry_covariance().map(T::lit);
    let mut score = Score::default();
    let mut outcomes = vec![Outcome::default(); drive.landmarks];
    for (index, step) in steps.iter().enumerate() {
        let time = index as f64;
        let moved =
            Increment::from_velocity(lit(step.v), lit(step.omega), T::one(), &noise, Integration::Arc);
        filter.predict(time, &moved).unwrap();
        let (known, new): (Vec<_>, Vec<_>) =
            step.seen.iter().partition(|(id, ..)| filter.landmark(*id).is_some());
        let measure = |&&(id, range, bearing): &&(u32, f64, f64)| {
            let range_std = lit(drive.range_std_at(range.max(0.3)));
            let range = lit(range.max(0.01));
            (id, Measurement::range_bearing(range, lit(bearing), range_std, lit(drive.bearing_std)))
        };
        let known: Vec<_> = known
            .iter()
            .map(measure)
            .map(|(landmark, measurement)| Observation { landmark, measurement })
            .collect();
        filter.update(&known, &mut outcomes).unwrap();
        for (id, measurement) in new.iter().map(measure) {
            filter.birth(time, id, &measurement).unwrap();
        }
        let truth = Pose::new(lit(step.truth.x), lit(step.truth.y), lit(step.truth.heading));
        let nees = filter.pose_nees(&truth).map_or(f64::INFINITY, T::to_f64) / 3.0;
        let pose = filter.pose();
        score.nees_mean += nees;
        score.nees_end = nees;
        score.position_squared += (pose.position() - truth.position()).norm_squared().to_f64();
        let turn = monorange_core::geometry::wrap_angle(pose.heading - truth.heading).to_f64();
        score.heading_squared += turn * turn;
    }
    score
}

#[test]
fn quick() {
    let drive = Drive::consistency();
    let landmarks = drive.landmarks(12345);
    for variant in [Variant::Textbook, Variant::FirstEstimates, Variant::Invariant] {
        for gate in [Gate::Open, Gate::Soft] {
            let (mut mean, mut end, mut square, mut turn) = (0.0, 0.0, 0.0, 0.0);
            let runs = 50;
            let start = std::time::Instant::now();
            for run in 0..runs {
                let steps = drive.run(&landmarks, 1000 + run);
                let config = FilterConfig {
                    variant,
                    gate,
                    covariance: Covariance::Packed,
                    ..FilterConfig::<f64>::default()
                };
                let score = score(&drive, &steps, config);
                mean += score.nees_mean / steps.len() as f64 / runs as f64;
                end += score.nees_end / runs as f64;
                square += score.position_squared / steps.len() as f64 / runs as f64;
                turn += score.heading_squared / steps.len() as f64 / runs as f64;
            }
            println!(
                "{variant:?} {gate:?} NEES/3 mean {mean:.3} end {end:.3} position {:.3} m heading {:.2} deg  {:?}",
                square.sqrt(),
                turn.sqrt().to_degrees(),
                start.elapsed()
            );
        }
    }
}
