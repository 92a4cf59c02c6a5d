//! Consistency on long loops: the filter's covariance against its error, over 50 seeded runs.
use monorange_core::Real;
use monorange_core::geometry::{Pose, wrap_angle};
use monorange_core::slam::{
    Covariance, FilterConfig, Increment, Integration, Measurement, Observation, Outcome, Variant,
};
use monorange_tests::slam::host_filter;
use monorange_tests::slam::ring_drive::{Drive, Step};
use nalgebra::Matrix3;
use std::fmt::Write;

/// Means over a run.
#[derive(Clone, Copy, Debug, Default)]
struct Score {
    /// Of the pose, per degree of freedom.
    nees: f64,
    /// The same, over the last ten steps.
    nees_end: f64,
    position_squared: f64,
    heading_squared: f64,
}

fn score<T: Real>(drive: &Drive, steps: &[Step], config: FilterConfig<T>) -> Score {
    let lit = T::lit;
    let mut filter = host_filter(drive.landmarks, Pose::default(), Matrix3::identity() * lit(1e-8), config);
    let noise = drive.odometry_covariance().map(T::lit);
    let mut outcomes = vec![Outcome::default(); drive.landmarks];
    let mut score = Score::default();
    let share = 1.0 / steps.len() as f64;
    for (index, step) in steps.iter().enumerate() {
        let time = index as f64;
        let moved =
            Increment::from_velocity(lit(step.v), lit(step.omega), T::one(), &noise, Integration::Arc);
        filter.predict(time, &moved).unwrap();
        let (mut known, mut new) = (Vec::new(), Vec::new());
        for &(id, range, bearing) in &step.seen {
            let record = filter.landmark(id).copied();
            let predicted = record.and_then(|record| filter.position(&record));
            let predicted = predicted.map_or(0.0, |at| (at - filter.pose().position()).norm().to_f64());
            // A noise that grows with the range must not be taken from a range that came out short by chance.
            let range_std = drive.range_std_at(range.max(predicted).max(0.3));
            let measurement = Measurement::range_bearing(
                lit(range.max(0.05)),
                lit(bearing),
                lit(range_std),
                lit(drive.bearing_std),
            );
            if record.is_some() {
                known.push(Observation { landmark: id, measurement });
            } else {
                new.push((id, measurement));
            }
        }
        filter.update(&known, &mut outcomes).unwrap();
        for (id, measurement) in new {
            filter.birth(time, id, &measurement).unwrap();
        }
        let truth = Pose::new(lit(step.truth.x), lit(step.truth.y), lit(step.truth.heading));
        let nees = filter.pose_nees(&truth).map_or(f64::INFINITY, T::to_f64) / 3.0;
        let pose = filter.pose();
        score.nees += nees * share;
        score.nees_end += if index + 10 >= steps.len() { nees * 0.1 } else { 0.0 };
        score.position_squared += (pose.position() - truth.position()).norm_squared().to_f64() * share;
        score.heading_squared += wrap_angle(pose.heading - truth.heading).to_f64().powi(2) * share;
    }
    score
}

/// Means over the runs, two threads.
fn monte_carlo<T: Real + Send + Sync>(drive: &Drive, runs: &[Vec<Step>], config: FilterConfig<T>) -> Score {
    let (left, right) = runs.split_at(runs.len() / 2);
    let half = |runs: &[Vec<Step>]| runs.iter().map(|steps| score(drive, steps, config)).collect::<Vec<_>>();
    let scores = std::thread::scope(|scope| {
        let other = scope.spawn(|| half(right));
        let mut scores = half(left);
        scores.extend(other.join().unwrap());
        scores
    });
    let mean = |of: fn(&Score) -> f64| scores.iter().map(of).sum::<f64>() / scores.len() as f64;
    Score {
        nees: mean(|score| score.nees),
        nees_end: mean(|score| score.nees_end),
        position_squared: mean(|score| score.position_squared),
        heading_squared: mean(|score| score.heading_squared),
    }
}

fn line(table: &mut String, name: &str, score: &Score) {
    let Score { nees, nees_end, position_squared, heading_squared } = score;
    let (position, heading) = (position_squared.sqrt(), heading_squared.sqrt().to_degrees());
    writeln!(table, "{name:<34} {nees:>8.2} {nees_end:>8.2} {position:>8.2} {heading:>8.1}").unwrap();
}

#[test]
fn the_invariant_filter_is_consistent_on_long_loops() {
    let drive = Drive::consistency();
    let landmarks = drive.landmarks(12_345);
    let runs: Vec<_> = (1000..1050).map(|seed| drive.run(&landmarks, seed)).collect();
    let mut table =
        format!("{:<34} {:>8} {:>8} {:>8} {:>8}\n", "50 runs of 1,500 steps", "NEES/3", "at end", "m", "deg");
    let base = FilterConfig::<f64>::default();
    let invariant = monte_carlo(&drive, &runs, base);
    line(&mut table, "invariant", &invariant);
    let polar = FilterConfig { polar_as_point: false, ..base };
    line(&mut table, "invariant, range and bearing bent", &monte_carlo(&drive, &runs, polar));
    let factored = FilterConfig { covariance: Covariance::Factored, ..base };
    line(&mut table, "invariant, factored (UD)", &monte_carlo(&drive, &runs, factored));
    let single = monte_carlo(&drive, &runs, FilterConfig::<f32>::default());
    line(&mut table, "invariant, f32", &single);
    for (name, variant) in [("textbook", Variant::Textbook), ("first estimates", Variant::FirstEstimates)] {
        line(&mut table, name, &monte_carlo(&drive, &runs, FilterConfig { variant, ..base }));
    }
    insta::assert_snapshot!(table);
    for nees in [invariant.nees, invariant.nees_end] {
        assert!((0.8..=1.25).contains(&nees), "NEES/3 {nees}");
    }
    assert!((single.nees / invariant.nees - 1.0).abs() < 0.01, "f32 {} f64 {}", single.nees, invariant.nees);
}
