//! What must not break the filter: bad input, and a million updates in `f32`.
use monorange_core::geometry::Pose;
use monorange_core::slam::{
    Covariance, Decision, Feature, FilterConfig, Increment, Integration, Map, MapConfig, Measurement,
    Observation, Outcome,
};
use monorange_core::{Error, Real};
use monorange_tests::Noise;
use monorange_tests::slam::{HostFilter, host_filter};
use nalgebra::{DMatrix, Matrix2, Matrix3, Vector2, Vector3};

/// Everything that a later answer depends on, bit by bit.
fn bits(filter: &HostFilter<f64>) -> Vec<u64> {
    let (size, _) = filter.states();
    let states = (0..size).map(|row| filter.state_at(row).to_bits());
    let covariances = (0..size * size).map(|at| filter.covariance_at(at / size, at % size).to_bits());
    let records = filter.landmarks().iter().flat_map(|landmark| {
        [
            u64::from(landmark.id),
            landmark.offset as u64,
            u64::from(landmark.seen),
            landmark.last_time.to_bits(),
        ]
    });
    let time = std::iter::once(filter.time().to_bits());
    states.chain(covariances).chain(records).chain(time).collect()
}

fn started(covariance: Covariance) -> HostFilter<f64> {
    let config = FilterConfig { covariance, ..FilterConfig::default() };
    let mut filter = host_filter(3, Pose::new(1.0, 2.0, 0.5), Matrix3::identity() * 0.01, config);
    filter.birth(1.0, 4, &Measurement::range_bearing(2.0, 0.3, 0.1, 0.02)).unwrap();
    filter.birth(1.0, 5, &Measurement::range_bearing(3.0, -0.3, 0.1, 0.02)).unwrap();
    filter
}

#[test]
fn bad_input_is_named_and_changes_no_bit() {
    let (nan, infinite) = (f64::NAN, f64::INFINITY);
    let rb = |range, bearing, a, b, c| Measurement::RangeBearing {
        range,
        bearing,
        covariance: Matrix2::new(a, b, b, c),
        by_mount: None,
    };
    let bad = [
        rb(nan, 0.0, 1.0, 0.0, 1.0),
        rb(infinite, 0.0, 1.0, 0.0, 1.0),
        rb(0.0, 0.0, 1.0, 0.0, 1.0),
        rb(-1.0, 0.0, 1.0, 0.0, 1.0),
        rb(2.0, nan, 1.0, 0.0, 1.0),
        rb(2.0, 0.0, -1.0, 0.0, 1.0),
        rb(2.0, 0.0, 0.0, 0.0, 1.0),
        rb(2.0, 0.0, 1.0, 2.0, 1.0),
        rb(2.0, 0.0, nan, 0.0, 1.0),
        rb(2.0, 0.0, 1.0, infinite, 1.0),
        Measurement::Bearing { bearing: nan, variance: 0.1, range_prior: None },
        Measurement::Bearing { bearing: 0.1, variance: 0.0, range_prior: None },
        Measurement::Bearing { bearing: 0.1, variance: 0.1, range_prior: Some((0.0, 1.0)) },
        Measurement::Range { range: 0.0, variance: 1.0 },
        Measurement::Range { range: 1.0, variance: -1.0 },
        Measurement::Point { point: Vector2::new(nan, 0.0), covariance: Matrix2::identity() },
        Measurement::Pixel { pixel: Vector2::new(nan, 0.0), covariance: Matrix2::identity() },
    ];
    let good = Measurement::range_bearing(2.1, 0.31, 0.1, 0.02);
    for covariance in [Covariance::Packed, Covariance::Factored] {
        let mut filter = started(covariance);
        let before = bits(&filter);
        let mut outcomes = [Outcome::default(); 2];
        for measurement in bad {
            // A good one first: nothing of the frame may be used.
            let frame =
                [Observation { landmark: 4, measurement: good }, Observation { landmark: 5, measurement }];
            let error = filter.update(&frame, &mut outcomes).unwrap_err();
            assert!(matches!(error, Error::OutOfRange { .. }), "{measurement:?}: {error}");
            let error = filter.birth(1.0, 9, &measurement).unwrap_err();
            assert!(matches!(error, Error::OutOfRange { .. }), "{measurement:?}: {error}");
            assert_eq!(bits(&filter), before, "{measurement:?}");
        }
        let unknown = Observation { landmark: 77, measurement: good };
        assert_eq!(filter.update(&[unknown], &mut outcomes), Err(Error::UnknownLandmark { id: 77 }));
        assert_eq!(filter.birth(1.0, 4, &good), Err(Error::KnownLandmark { id: 4 }));
        assert_eq!(filter.remove(77), Err(Error::UnknownLandmark { id: 77 }));
        assert!(matches!(filter.birth(0.5, 9, &good), Err(Error::TimeBackwards { .. })));
        assert!(matches!(filter.birth(f64::NAN, 9, &good), Err(Error::TimeBackwards { .. })));
        let range_alone = Measurement::Range { range: 1.0, variance: 1.0 };
        assert!(matches!(filter.birth(1.0, 9, &range_alone), Err(Error::OutOfRange { .. })));
        let step = Increment { delta: Vector3::new(0.1, 0.0, 0.0), covariance: Matrix3::identity() * 1e-4 };
        for time in [0.9, f64::NAN, f64::INFINITY] {
            assert!(matches!(filter.predict(time, &step), Err(Error::TimeBackwards { .. })));
        }
        for step in [
            Increment { delta: Vector3::new(nan, 0.0, 0.0), ..step },
            Increment { covariance: Matrix3::identity() * -1.0, ..step },
            Increment { covariance: Matrix3::identity() * infinite, ..step },
        ] {
            assert!(matches!(filter.predict(2.0, &step), Err(Error::OutOfRange { .. })));
        }
        assert!(filter.update(&[unknown, unknown, unknown], &mut outcomes).is_err());
        assert_eq!(bits(&filter), before);
        filter.birth(1.0, 6, &good).unwrap();
        let full = bits(&filter);
        assert!(matches!(filter.birth(1.0, 7, &good), Err(Error::Full { .. })));
        assert_eq!(bits(&filter), full);
    }
}

#[test]
fn a_frame_of_bad_measurements_is_rejected_line_by_line() {
    let mut map = Map::new(started(Covariance::Packed), MapConfig::default()).unwrap();
    let features: Vec<_> = [
        Measurement::range_bearing(f64::NAN, 0.0, 0.1, 0.1),
        Measurement::range_bearing(0.0, 0.0, 0.1, 0.1),
        Measurement::Range { range: 3.0, variance: -1.0 },
    ]
    .into_iter()
    .map(Feature::new)
    .collect();
    let before = bits(map.filter());
    let mut outcomes = [Outcome::default(); 3];
    let report = map.observe(&features, |_, _| true, &mut outcomes).unwrap();
    assert_eq!(report.rejected, 3);
    assert!(outcomes.iter().all(|outcome| outcome.decision == Decision::Rejected));
    assert_eq!(bits(map.filter()), before);
}

/// Drives circles of radius 2 m among 20 landmarks, seen to 1 mm and 1e-4 rad: (mean NEES/3, least eigenvalue of P
/// over its largest at any tenth of the way).
fn stress<T: Real>(seed: u64, updates: usize, origin: f64, covariance: Covariance) -> (f64, f64) {
    let lit = T::lit;
    let config = FilterConfig { covariance, ..FilterConfig::default() };
    let start = Pose::new(origin, -origin, 0.0);
    let start_t = Pose::new(lit(start.x), lit(start.y), T::zero());
    let mut filter = host_filter(20, start_t, Matrix3::identity() * lit(1e-8), config);
    let mut noise = Noise::new(seed);
    let landmarks: Vec<_> = (0..20)
        .map(|index| {
            let angle = core::f64::consts::TAU * f64::from(index) / 20.0;
            let distance = noise.uniform(2.5, 6.0);
            start.position() + Vector2::new(distance * angle.cos(), 2.0 + distance * angle.sin())
        })
        .collect();
    let (speed, turn, std) = (0.05, 0.025, [5e-4, 2e-4]);
    let arc = monorange_core::slam::arc_rotation(turn) * Vector2::new(speed, 0.0);
    let step = Pose::new(arc.x, arc.y, turn);
    let odometry = Matrix2::from_diagonal(&Vector2::new(std[0] * std[0], std[1] * std[1])).map(T::lit);
    // The robot starts as far off as the filter believes.
    let mut off = || 1e-4 * noise.normal();
    let mut truth = Pose::new(start.x + off(), start.y + off(), off());
    let (mut nees, mut count, mut least) = (0.0, 0, f64::INFINITY);
    let frames = updates / 20;
    let (range_std, bearing_std) = (1e-3, 1e-4);
    for index in 0..frames {
        truth = truth.compose(&step);
        let (v, omega) = (speed + std[0] * noise.normal(), turn + std[1] * noise.normal());
        let moved = Increment::from_velocity(lit(v), lit(omega), T::one(), &odometry, Integration::Arc);
        filter.predict(index as f64, &moved).unwrap();
        let mut frame = Vec::new();
        for (id, landmark) in (0_u32..).zip(&landmarks) {
            let point = truth.inverse_transform(*landmark);
            let range = lit(point.norm() + range_std * noise.normal());
            let bearing = lit(point.y.atan2(point.x) + bearing_std * noise.normal());
            let measurement = Measurement::range_bearing(range, bearing, lit(range_std), lit(bearing_std));
            frame.push(Observation { landmark: id, measurement });
        }
        if index == 0 {
            for Observation { landmark, measurement } in frame {
                filter.birth(0.0, landmark, &measurement).unwrap();
            }
            continue;
        }
        filter.update(&frame, &mut [Outcome::default(); 20]).unwrap();
        if index % 50 == 0 {
            // The truth is rounded once, and not the estimate: the difference is what counts.
            let error = |axis: usize, truth: f64| {
                filter.state_at(axis).to_f64() + filter.rounding_at(axis).to_f64() - truth
            };
            let [dx, dy] = [error(0, truth.x), error(1, truth.y)];
            let turn = monorange_core::geometry::wrap_angle(error(2, truth.heading));
            let p = filter.pose_covariance().map(T::to_f64);
            let e = Vector3::new(dx, dy, turn);
            nees += e.dot(&(p.try_inverse().unwrap() * e)) / 3.0;
            count += 1;
        }
        if (index + 1) % (frames / 10) == 0 {
            let (size, _) = filter.states();
            let p = DMatrix::from_fn(size, size, |row, column| filter.covariance_at(row, column).to_f64());
            let eigenvalues = p.symmetric_eigenvalues();
            least = least.min(eigenvalues.min() / eigenvalues.max());
        }
    }
    (nees / f64::from(count), least)
}

/// Both numbers of digits, near the origin and a kilometre away.
fn a_long_run_loses_neither_the_covariance_nor_the_map(covariance: Covariance) {
    // Fewer updates for a quick look; more drives for the mean: where one drive ends is one draw of χ²(3), and what
    // rounding moves it by is divided by however small that came out.
    let number =
        |name, default| std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default);
    let (updates, drives) = (number("MONORANGE_UPDATES", 1_000_000), number("MONORANGE_DRIVES", 1) as u64);
    for origin in [0.0, 1000.0] {
        let (mut double, mut single, mut least) = (0.0, 0.0, f64::INFINITY);
        for seed in 5..5 + drives {
            let both = (
                stress::<f64>(seed, updates, origin, covariance),
                stress::<f32>(seed, updates, origin, covariance),
            );
            double += both.0.0 / drives as f64;
            single += both.1.0 / drives as f64;
            least = least.min(both.1.1);
        }
        eprintln!(
            "{covariance:?} {origin} m from the origin, {updates} updates: NEES/3 {double:.4} in f64, {single:.4} in f32, least eigenvalue {least:.2e} of the largest"
        );
        assert!(least > 0.0, "an eigenvalue of {least}");
        assert!((single / double - 1.0).abs() < 0.01, "NEES/3 {single} in f32, {double} in f64");
    }
}

#[test]
fn a_long_run_in_f32_is_as_one_in_f64_with_the_covariance_itself() {
    a_long_run_loses_neither_the_covariance_nor_the_map(Covariance::Packed);
}

#[test]
fn a_long_run_in_f32_is_as_one_in_f64_with_the_covariance_in_factors() {
    a_long_run_loses_neither_the_covariance_nor_the_map(Covariance::Factored);
}

#[test]
fn the_stress_is_consistent_over_many_drives() {
    // Where the map lies is decided by the first frame and never again: however long a drive, its NEES is one draw of
    // χ²(3). The mean over drives is what must be 1.
    for covariance in [Covariance::Packed, Covariance::Factored] {
        let drives = 60;
        let mean = |drive: fn(u64, usize, f64, Covariance) -> (f64, f64), origin| {
            (0..drives).map(|seed| drive(100 + seed, 2_000, origin, covariance).0).sum::<f64>()
                / drives as f64
        };
        let (double, single) = (mean(stress::<f64>, 0.0), mean(stress::<f32>, 1000.0));
        eprintln!(
            "{covariance:?}: NEES/3 {double:.3} over {drives} drives; in f32 a kilometre away {single:.3}"
        );
        assert!((0.75..=1.25).contains(&double), "NEES/3 {double}"); // 1 ± 2.4 standard deviations
        assert!((single / double - 1.0).abs() < 0.01, "NEES/3 {single} in f32, {double} in f64");
    }
}
