use super::*;
use crate::geometry::Pose;
use crate::slam::filter::{FilterConfig, states_for, storage_len};
use crate::slam::models::Measurement;
use nalgebra::{Matrix2x3, Matrix3, Vector3};

type Small = Filter<f64, [f64; storage_len(states_for(2, false))], [Landmark<f64>; 2]>;

/// A filter whose robot is uncertain, with a landmark 7.
fn with_a_landmark() -> Small {
    let storage = [0.0; storage_len(states_for(2, false))];
    let covariance = Matrix3::from_diagonal(&Vector3::new(0.04, 0.09, 0.01));
    let pose = Pose::new(1.0, -2.0, 0.7);
    let mut filter =
        Filter::new(storage, [Landmark::default(); 2], pose, covariance, FilterConfig::default()).unwrap();
    filter.birth_at(0.0, 7, Vector2::new(2.0, 0.5), &(Matrix2::identity() * 0.01)).unwrap();
    filter
}

fn bits(filter: &Small) -> std::vec::Vec<u64> {
    let (size, _) = filter.states();
    let covariance = (0..size).flat_map(|row| (0..size).map(move |column| filter.covariance_at(row, column)));
    (0..size).map(|at| filter.state_at(at)).chain(covariance).map(f64::to_bits).collect()
}

#[test]
fn a_measurement_linearised_by_the_caller_does_what_the_filters_own_does() {
    let covariance = Matrix2::new(0.02, 0.003, 0.003, 0.01);
    let measurement = Measurement::Point { point: Vector2::new(2.1, 0.3), covariance };
    let (mut own, mut callers) = (with_a_landmark(), with_a_landmark());
    let linear = {
        let landmark = callers.landmark(7).unwrap();
        callers.linearise(landmark, callers.heading(), &measurement, None).unwrap()
    };
    let mut outcomes = [Outcome::default()];
    own.update(&[Observation { landmark: 7, measurement }], &mut outcomes).unwrap();
    let before = bits(&callers);
    let outcome = callers.update_linearised(7, &linear).unwrap();
    assert_eq!((outcome, bits(&callers)), (outcomes[0], bits(&own)));
    assert!(outcome.decision == Decision::Update && bits(&callers) != before);
}

#[test]
fn a_linearised_measurement_that_cannot_be_used_changes_nothing() {
    let mut filter = with_a_landmark();
    let linear = Linearised {
        innovation: Vector2::new(0.1, -0.1),
        by_robot: Matrix2x3::new(-1.0, 0.0, 0.0, 0.0, -1.0, 0.0),
        by_mount: Matrix2x4::zeros(),
        by_landmark: Matrix2x4::identity(),
        noise: Matrix2::identity() * 0.01,
        dof: 2,
    };
    let before = bits(&filter);
    assert_eq!(filter.update_linearised(8, &linear), Err(Error::UnknownLandmark { id: 8 }));
    let infinite = Linearised { innovation: Vector2::new(f64::INFINITY, 0.0), ..linear };
    let without_noise = Linearised { noise: Matrix2::zeros(), ..linear };
    for useless in [infinite, without_noise] {
        let refused = filter.update_linearised(7, &useless);
        assert!(matches!(refused, Err(Error::OutOfRange { name: "linearised", .. })), "{refused:?}");
    }
    assert_eq!(bits(&filter), before);
}

#[test]
fn a_robot_lost_by_metres_that_sees_to_a_tenth_of_a_pixel_keeps_a_covariance() {
    use crate::geometry::{Camera, Mount, Pose, RangeFinder};
    use crate::slam::{FilterConfig, Increment, storage_len};
    use nalgebra::Vector3;
    let lens = Default::default();
    let camera = Camera::new(320, 240, [365.0_f32; 2], [160.0, 120.0], 0.0, lens).unwrap();
    let finder = RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap());
    let config = FilterConfig { finder: Some(finder), ..FilterConfig::default() };
    let storage = std::vec![0.0_f32; storage_len(60)];
    let landmarks = std::vec![Landmark::default(); 20];
    let start = Matrix3::identity() * 1e-6;
    let mut filter = Filter::new(storage, landmarks, Pose::default(), start, config).unwrap();
    let seen = |at: usize, shift: f32| Measurement::Pixel {
        pixel: Vector2::new(20.0 + 70.0 * at as f32, 130.0 + 13.0 * at as f32 + shift),
        covariance: Matrix2::identity() * 0.01,
    };
    let walk = Vector3::new(4.0, 30.0, 0.5);
    let lost = Increment { delta: Vector3::zeros(), covariance: Matrix3::from_diagonal(&walk) };
    for frame in 0..400_usize {
        if frame % 100 == 50 {
            filter.predict(0.0, &lost).unwrap();
        }
        let generation = 5 * (frame / 100);
        for at in 0..5 {
            let (id, shift) = ((generation + at) as u32, 0.1 * (frame as f32 * (at + 1) as f32).sin());
            if frame % 100 == 75 || frame == 0 {
                let _ = filter.birth(0.0, id, &seen(at, shift)); // those of a former place stay unseen
            } else if filter.landmark(id).is_some() {
                let one = Observation { landmark: id, measurement: seen(at, shift) };
                filter.update(&[one], &mut [Outcome::default()]).unwrap();
            }
        }
        assert!(filter.pose_covariance().cholesky().is_some(), "{frame}: {}", filter.pose_covariance());
    }
    assert_eq!(filter.resets, 0);
}

#[test]
fn a_covariance_that_failed_leaves_the_robot_as_uncertain_as_it_was_with_an_empty_map() {
    use crate::geometry::Pose;
    use crate::slam::{FilterConfig, storage_len};
    let (storage, landmarks) = (std::vec![0.0; storage_len(9)], std::vec![Landmark::default(); 3]);
    let start = Matrix3::identity() * 0.04;
    let mut filter =
        Filter::new(storage, landmarks, Pose::default(), start, FilterConfig::default()).unwrap();
    for (id, range) in [(0, 2.0), (1, 3.0)] {
        filter.birth(0.0, id, &Measurement::range_bearing(range, 0.3, 0.01, 0.01)).unwrap();
    }
    let before = filter.pose_covariance();
    filter.parts().p.set(5, 5, -1.0);
    let sighting = Observation { landmark: 0, measurement: Measurement::range_bearing(2.0, 0.3, 0.01, 0.01) };
    filter.update(&[sighting], &mut [Outcome::default()]).unwrap();
    assert_eq!((filter.resets, filter.landmarks().len(), filter.states().0), (1, 0, 3));
    assert!((filter.pose_covariance() - before).amax() < 1e-12);
    filter.birth(0.0, 2, &Measurement::range_bearing(2.0, 0.3, 0.01, 0.01)).unwrap();
}
