//! The sparse, packed filter against the same equations with dense matrices.
use monorange_core::association::Gate;
use monorange_core::geometry::{Pose, wrap_angle};
use monorange_core::slam::{
    Covariance, Decision, Filter, FilterConfig, Increment, Integration, Landmark, Measurement, Observation,
    Outcome, Variant, WHEEL_STATES, arc_rotation, states_for, storage_len,
};
use nalgebra::{
    DMatrix, DVector, Matrix2, Matrix2x3, Matrix2x4, Matrix3, Matrix3x4, Rotation2, Vector2, Vector3,
};

type TestFilter<T> = Filter<T, Vec<T>, Vec<Landmark<T>>>;

fn filter<T: monorange_core::Real>(landmarks: usize, config: FilterConfig<T>) -> TestFilter<T> {
    let states =
        states_for(landmarks, config.mount_std.is_some()) + config.wheels_std.map_or(0, |_| WHEEL_STATES);
    let storage = vec![T::zero(); storage_len(states)];
    let covariance = Matrix3::new(0.04, 0.01, 0.002, 0.01, 0.09, -0.003, 0.002, -0.003, 0.01).map(T::lit);
    let pose = Pose::new(T::lit(3.0), T::lit(-2.0), T::lit(0.7));
    Filter::new(storage, vec![Landmark::default(); landmarks], pose, covariance, config).unwrap()
}

fn dense(filter: &TestFilter<f64>) -> (DVector<f64>, DMatrix<f64>) {
    let (size, _) = filter.states();
    let state = DVector::from_fn(size, |row, _| filter.state_at(row));
    (state, DMatrix::from_fn(size, size, |row, column| filter.covariance_at(row, column)))
}

fn sighting(range: f64, bearing: f64) -> Measurement<f64> {
    let covariance = Matrix2::new(0.01, 0.002, 0.002, 0.004);
    Measurement::RangeBearing { range, bearing, covariance, by_mount: None }
}

/// (9), (13) and the reset with dense matrices, as design and paper write them.
fn dense_update(x: &mut DVector<f64>, p: &mut DMatrix<f64>, seen: &[(usize, f64, f64)], invariant: bool) {
    let size = x.len();
    let mut h = DMatrix::zeros(2 * seen.len(), size);
    let mut r = DMatrix::zeros(2 * seen.len(), 2 * seen.len());
    let mut y = DVector::zeros(2 * seen.len());
    for (k, (at, range, bearing)) in seen.iter().enumerate() {
        let (dx, dy) = (x[*at] - x[0], x[at + 1] - x[1]);
        let q = dx * dx + dy * dy;
        let distance = q.sqrt();
        y[2 * k] = range - distance;
        y[2 * k + 1] = wrap_angle(bearing - (dy.atan2(dx) - x[2]));
        for (column, (a, b)) in [
            (0, (-dx / distance, dy / q)),
            (1, (-dy / distance, -dx / q)),
            (2, (0.0, -1.0)),
            (*at, (dx / distance, -dy / q)),
            (at + 1, (dy / distance, dx / q)),
        ] {
            h[(2 * k, column)] = a;
            h[(2 * k + 1, column)] = b;
        }
        r.fixed_view_mut::<2, 2>(2 * k, 2 * k).copy_from(&Matrix2::new(0.01, 0.002, 0.002, 0.004));
    }
    let s = &h * &*p * h.transpose() + r;
    let gain = &*p * h.transpose() * s.clone().try_inverse().unwrap();
    let delta = &gain * y;
    *p = &*p - &gain * s * gain.transpose();
    if !invariant {
        *x += delta;
        return;
    }
    let turn = delta[2];
    let rotation = arc_rotation(turn);
    let mut a = DMatrix::identity(size, size);
    x[2] = wrap_angle(x[2] + turn);
    for at in core::iter::once(0).chain((3..size).step_by(2)) {
        let step = rotation * Vector2::new(delta[at], delta[at + 1]);
        x[at] += step.x;
        x[at + 1] += step.y;
        a[(at, 2)] += -step.y;
        a[(at + 1, 2)] += step.x;
    }
    *p = &a * &*p * a.transpose();
}

#[test]
fn predict_update_birth_and_removal_agree_with_dense_matrices() {
    for covariance in [Covariance::Packed, Covariance::Factored] {
        for variant in [Variant::Invariant, Variant::Textbook] {
            let config = FilterConfig {
                variant,
                covariance,
                gate: Gate::Open,
                polar_as_point: false,
                ..FilterConfig::default()
            };
            let mut filter = filter(9, config);
            let near = |filter: &TestFilter<f64>, x: &DVector<f64>, p: &DMatrix<f64>, what: &str| {
                let (state, matrix) = dense(filter);
                assert!((state - x).amax() < 1e-12, "{what}: state, {covariance:?} {variant:?}");
                let error = (&matrix - p).amax();
                assert!(error < 1e-12, "{what}: covariance off by {error}, {covariance:?} {variant:?}");
            };
            for id in 0..7 {
                let (mut x, mut p) = dense(&filter);
                let (range, bearing) = (2.0 + f64::from(id), 0.4 * f64::from(id) - 1.0);
                filter.birth(0.0, id, &sighting(range, bearing)).unwrap();
                // Birth, dense.
                let size = x.len();
                let (sin, cos) = (x[2] + bearing).sin_cos();
                let mut g = DMatrix::zeros(2, size);
                g.fill_diagonal(1.0);
                (g[(0, 2)], g[(1, 2)]) = (-range * sin, range * cos);
                let z = Matrix2::new(cos, -range * sin, sin, range * cos);
                let noise = z * Matrix2::new(0.01, 0.002, 0.002, 0.004) * z.transpose();
                let (cross, own) = (&g * &p, &g * &p * g.transpose() + noise);
                x = x.clone().insert_rows(size, 2, 0.0);
                (x[size], x[size + 1]) = (x[0] + range * cos, x[1] + range * sin);
                p = p.clone().resize(size + 2, size + 2, 0.0);
                p.view_mut((size, 0), (2, size)).copy_from(&cross);
                p.view_mut((0, size), (size, 2)).copy_from(&cross.transpose());
                p.view_mut((size, size), (2, 2)).copy_from(&own);
                near(&filter, &x, &p, "birth");
            }
            let (mut x, mut p) = dense(&filter);
            // Six landmarks: more than share a pass over the covariance.
            let seen: Vec<_> = [1_u32, 6, 0, 3, 5, 2]
                .into_iter()
                .map(|id| (id, 2.1 + f64::from(id), 0.4 * f64::from(id) - 0.95))
                .collect();
            let observations: Vec<_> = seen
                .iter()
                .map(|(landmark, range, bearing)| Observation {
                    landmark: *landmark,
                    measurement: sighting(*range, *bearing),
                })
                .collect();
            let mut outcomes = [Outcome::default(); 6];
            filter.update(&observations, &mut outcomes).unwrap();
            assert!(outcomes.iter().all(|outcome| outcome.decision == Decision::Update));
            let seen: Vec<_> = seen.iter().map(|(id, r, b)| (3 + 2 * *id as usize, *r, *b)).collect();
            dense_update(&mut x, &mut p, &seen, variant == Variant::Invariant);
            near(&filter, &x, &p, "update");

            let noise = Matrix2::new(0.02, 0.001, 0.001, 0.003);
            let step = Increment::from_velocity(1.0, 0.3, 0.5, &noise, Integration::Arc);
            filter.predict(1.0, &step).unwrap();
            let moved =
                Pose::new(x[0], x[1], x[2]).compose(&Pose::new(step.delta.x, step.delta.y, step.delta.z));
            let mut f = DMatrix::identity(x.len(), x.len());
            (f[(0, 2)], f[(1, 2)]) = (-(moved.y - x[1]), moved.x - x[0]);
            let turn = Pose::new(0.0, 0.0, x[2]).rotation().to_homogeneous();
            (x[0], x[1], x[2]) = (moved.x, moved.y, moved.heading);
            p = &f * &p * f.transpose();
            let mut corner = p.fixed_view_mut::<3, 3>(0, 0);
            corner += turn * step.covariance * turn.transpose();
            near(&filter, &x, &p, "predict");

            filter.remove(2).unwrap();
            let x = x.remove_rows(7, 2);
            let p = p.remove_rows(7, 2).remove_columns(7, 2);
            near(&filter, &x, &p, "removal");
            assert_eq!(filter.landmark(3).map(|landmark| landmark.offset), Some(7));
        }
    }
}

#[test]
fn a_step_that_the_camera_saw_takes_the_errors_of_mount_and_wheels_along() {
    for covariance in [Covariance::Packed, Covariance::Factored] {
        let mount_std = Some([0.01, 0.005, 0.004, 0.006]);
        let stds = [0.03, 0.04, 0.005];
        let wheels_std = Some(stds);
        let mut filter =
            filter(3, FilterConfig { covariance, mount_std, wheels_std, ..FilterConfig::default() });
        let by_wheels = Matrix3::new(0.3, -0.1, 0.2, 0.05, 0.1, -0.2, 0.0, 0.4, 0.5);
        let by_mount = Matrix3x4::new(0.9, -0.2, 0.1, 0.3, 0.05, 0.4, -0.6, 0.2, -0.1, 0.7, 1.1, -0.8);
        let noise = Matrix2::new(0.02, 0.001, 0.001, 0.003);
        let step = Increment::from_velocity(1.0, 0.3, 0.5, &noise, Integration::Arc);
        for id in 0..3_u32 {
            let (x, p) = dense(&filter);
            filter.predict_seen(f64::from(id), &step, &by_mount, &by_wheels).unwrap();
            let (moved, found) = dense(&filter);
            let turn = Pose::new(0.0, 0.0, x[2]).rotation().to_homogeneous();
            let mut f = DMatrix::identity(x.len(), x.len());
            (f[(0, 2)], f[(1, 2)]) = (-(moved[1] - x[1]), moved[0] - x[0]);
            f.view_mut((0, 3), (3, 4)).copy_from(&(turn * by_mount));
            f.view_mut((0, 7), (3, 3)).copy_from(&(turn * by_wheels));
            let mut expected = &f * &p * f.transpose();
            let mut corner = expected.fixed_view_mut::<3, 3>(0, 0);
            corner += turn * step.covariance * turn.transpose();
            for (at, std) in (7..).zip(stds) {
                // The wheels' errors wander as they drive.
                expected[(at, at)] += (0.02 * std).powi(2) * step.delta.xy().norm();
            }
            let error = (&found - &expected).amax();
            assert!(error < 1e-12, "covariance off by {error} after {id} landmarks, {covariance:?}");
            // The next step has a landmark more, which the mount's error reaches through the robot.
            filter.birth(f64::from(id), id, &sighting(2.0 + f64::from(id), 0.3)).unwrap();
        }
    }
}

#[test]
fn a_step_of_the_wheels_is_corrected_by_their_errors_and_takes_them_along() {
    for covariance in [Covariance::Packed, Covariance::Factored] {
        let stds = [0.03, 0.04, 0.005];
        let wheels_std = Some(stds);
        let mut filter = filter(3, FilterConfig { covariance, wheels_std, ..FilterConfig::default() });
        let noise = Matrix2::new(0.02, 0.001, 0.001, 0.003);
        // Ahead and back, and a measurement of the errors between, so that they are not zero.
        for (time, v) in [(1.0, 1.0_f64), (2.0, -0.7), (3.0, 1.2)] {
            let step = Increment::from_velocity(v, 0.3, 0.5, &noise, Integration::Arc);
            let (x, p) = dense(&filter);
            let errors = x.fixed_rows::<3>(3).into_owned();
            let pose = |errors: &Vector3<f64>| {
                let (turn, way) = (step.delta.z, v.signum() * step.delta.xy().norm());
                let more = turn * errors.y + way * errors.z;
                let path = Rotation2::new(x[2] + 0.5 * more) * step.delta.xy() * (1.0 + errors.x);
                Vector3::new(x[0] + path.x, x[1] + path.y, x[2] + turn + more)
            };
            filter.predict_driven(time, &step).unwrap();
            let (moved, found) = dense(&filter);
            assert!((moved.fixed_rows::<3>(0) - pose(&errors)).amax() < 1e-12, "{covariance:?}");
            let mut f = DMatrix::identity(x.len(), x.len());
            (f[(0, 2)], f[(1, 2)]) = (-(moved[1] - x[1]), moved[0] - x[0]);
            for column in 0..3 {
                let change = Vector3::ith(column, 1e-6);
                let difference = (pose(&(errors + change)) - pose(&(errors - change))) / 2e-6;
                f.view_mut((0, 3 + column), (3, 1)).copy_from(&difference);
            }
            let mut expected = &f * &p * f.transpose();
            let turn = Pose::new(0.0, 0.0, x[2]).rotation().to_homogeneous();
            let mut corner = expected.fixed_view_mut::<3, 3>(0, 0);
            corner += turn * step.covariance * turn.transpose();
            let metres = (moved.fixed_rows::<2>(0) - x.fixed_rows::<2>(0)).norm();
            for (at, std) in (3..).zip(stds) {
                expected[(at, at)] += (0.02 * std).powi(2) * metres;
            }
            let error = (&found - &expected).amax();
            assert!(error < 1e-9, "covariance off by {error}, {covariance:?}");
            let (by_mount, by_wheels) = (Matrix2x4::zeros(), Matrix2x3::new(1.0, 0.2, -0.3, 0.1, 0.9, 0.4));
            let noise = Matrix2::new(2e-4, 3e-5, 3e-5, 1e-4);
            filter.update_shared(&Vector2::new(0.02, -0.01), &noise, &by_mount, &by_wheels).unwrap();
            filter.birth(time, time as u32, &sighting(2.0, 0.3)).unwrap();
        }
    }
}

#[test]
fn a_measurement_of_mount_and_wheels_corrects_all_that_hangs_on_them() {
    let (difference, noise) = (Vector2::new(0.004, -0.003), Matrix2::new(2e-5, 3e-6, 3e-6, 1e-5));
    let by_mount = Matrix2x4::new(0.9, -0.2, 0.1, 0.3, 0.05, 0.4, -0.6, 0.2);
    let by_wheels = Matrix2x3::new(0.2, -0.1, 0.4, 0.0, 0.3, -0.5);
    for covariance in [Covariance::Packed, Covariance::Factored] {
        let mount_std = Some([0.01, 0.005, 0.004, 0.006]);
        let stds = [0.03, 0.04, 0.005];
        let wheels_std = Some(stds);
        let variant = Variant::Textbook;
        let config = FilterConfig { covariance, mount_std, wheels_std, variant, ..FilterConfig::default() };
        let mut filter = filter(1, config);
        let step = Increment::from_velocity(1.0, 0.3, 0.5, &noise, Integration::Arc);
        filter.predict_seen(1.0, &step, &Matrix3x4::from_element(0.3), &Matrix3::from_element(0.2)).unwrap();
        filter.birth(1.0, 0, &sighting(2.0, 0.3)).unwrap();
        let (x, p) = dense(&filter);
        let outcome = filter.update_shared(&difference, &noise, &by_mount, &by_wheels).unwrap();
        assert_eq!(outcome.decision, Decision::Update);
        let mut h = DMatrix::zeros(2, x.len());
        h.view_mut((0, 3), (2, 4)).copy_from(&by_mount);
        h.view_mut((0, 7), (2, 3)).copy_from(&by_wheels);
        let gain = &p * h.transpose() * (&h * &p * h.transpose() + noise).try_inverse().unwrap();
        let (moved, found) = dense(&filter);
        // These states were zero: the difference is its own innovation.
        assert!((moved - (x + &gain * difference)).amax() < 1e-12, "{covariance:?}");
        assert!((found - (&p - &gain * &h * &p)).amax() < 1e-12, "{covariance:?}");
    }
    let mut exact = filter::<f64>(1, FilterConfig::default());
    let before = dense(&exact);
    let outcome = exact.update_shared(&difference, &noise, &by_mount, &by_wheels).unwrap();
    assert_eq!((outcome.decision, dense(&exact)), (Decision::Rejected, before.clone()));
    assert!(exact.update_shared(&Vector2::new(f64::NAN, 0.0), &noise, &by_mount, &by_wheels).is_err());
    assert!(exact.update_shared(&difference, &-noise, &by_mount, &by_wheels).is_err());
    assert_eq!(dense(&exact), before);
}

#[test]
fn what_pictures_say_of_the_mounts_angles_corrects_all_that_hangs_on_them() {
    let errors = Vector3::new(0.004, -0.003, 0.002);
    let noise = Matrix3::new(4e-5, 1e-6, -2e-6, 1e-6, 2e-5, 3e-6, -2e-6, 3e-6, 1e-5);
    let mount_std = Some([0.01, 0.005, 0.004, 0.006]);
    let mut filter =
        filter::<f64>(1, FilterConfig { mount_std, variant: Variant::Textbook, ..FilterConfig::default() });
    let step = Increment::from_velocity(1.0, 0.3, 0.5, &(Matrix2::identity() * 1e-5), Integration::Arc);
    filter.predict_seen(1.0, &step, &Matrix3x4::from_element(0.3), &Matrix3::zeros()).unwrap();
    filter.birth(1.0, 0, &sighting(2.0, 0.3)).unwrap();
    let (x, p) = dense(&filter);
    filter.update_mount(&errors, &noise).unwrap();
    let mut h = DMatrix::zeros(3, x.len());
    h.view_mut((0, 4), (3, 3)).fill_with_identity();
    let gain = &p * h.transpose() * (&h * &p * h.transpose() + noise).try_inverse().unwrap();
    let (moved, found) = dense(&filter);
    assert!((moved - (x + &gain * errors)).amax() < 1e-12);
    assert!((found - (&p - &gain * &h * &p)).amax() < 1e-12);
    assert!(filter.update_mount(&errors, &-noise).is_err());
}

#[test]
fn the_retraction_and_the_reset_do_not_depend_on_the_origin() {
    // The same run a kilometre away: the same differences, the same covariance, to rounding.
    let run = |offset: f64| {
        let config = FilterConfig::default();
        let storage = vec![0.0; storage_len(states_for(3, false))];
        let pose = Pose::new(offset, -offset, 0.3);
        let covariance = Matrix3::from_diagonal(&nalgebra::Vector3::new(0.01, 0.01, 0.02));
        let mut filter =
            Filter::new(storage, vec![Landmark::default(); 3], pose, covariance, config).unwrap();
        filter.birth(0.0, 1, &sighting(2.0, 0.2)).unwrap();
        let seen = Observation { landmark: 1, measurement: sighting(2.2, 0.5) };
        filter.update(&[seen], &mut [Outcome::default()]).unwrap();
        (filter.pose().x - offset, filter.pose_covariance(), filter.covariance_at(0, 4))
    };
    let (here, there) = (run(0.0), run(1000.0));
    assert!(
        (here.0 - there.0).abs() < 1e-12
            && (here.1 - there.1).amax() < 1e-12
            && (here.2 - there.2).abs() < 1e-12
    );
}
