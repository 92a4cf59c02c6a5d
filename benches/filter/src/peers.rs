//! The peers, each given the same sparse Jacobian in the form that it wants.
use crate::time;
use std::hint::black_box;

/// ∂(range, bearing)/∂(x, y, heading, landmark).
const JACOBIAN: [(usize, f32, f32); 5] =
    [(0, -0.8, 0.1), (1, -0.6, -0.1), (2, 0.0, -1.0), (3, 0.8, -0.1), (4, 0.6, 0.1)];

pub(crate) fn minikalman<const N: usize>() -> [f64; 2] {
    use minikalman::extended::builder::KalmanFilterBuilder;
    use minikalman::prelude::*;
    let builder = KalmanFilterBuilder::<N, f32>::default();
    let (mut filter, mut measurement) = (builder.build(), builder.observations().build::<2>());
    filter.estimate_covariance_mut().make_identity();
    filter.direct_process_noise_mut().make_scalar(1e-4);
    measurement.measurement_noise_covariance_mut().apply(|r| {
        r.set_at(0, 0, 0.01);
        r.set_at(1, 1, 0.001);
    });
    measurement.observation_jacobian_matrix_mut().apply(|h| {
        for (column, range, bearing) in JACOBIAN {
            h.set_at(0, column, range);
            h.set_at(1, column, bearing);
        }
    });
    filter.state_transition_jacobian_mut().apply(|a| {
        a.make_identity();
        a.set_at(0, 2, -0.1);
        a.set_at(1, 2, 0.1);
    });
    let update = time(|| {
        measurement.measurement_vector_mut().set_row(0, 0.01);
        filter.correct_nonlinear(&mut measurement, |x, z| {
            z[0] = x[3] - x[0];
            z[1] = x[4] - x[1] - x[2];
        });
        filter.estimate_covariance_mut().apply(|p| p.set_at(0, 0, 1.0));
    });
    let predict = time(|| {
        filter.predict_nonlinear(|x, next| {
            for index in 0..N {
                next[index] = x[index];
            }
        });
        filter.estimate_covariance_mut().apply(|p| p.set_at(0, 0, 1.0));
    });
    [update, predict]
}

pub(crate) fn kfilter<const N: usize>() -> [f64; 2] {
    use kfilter::{Kalman1M, KalmanPredict};
    use nalgebra_of_kfilter::{SMatrix, SVector};
    let mut h = Box::new(SMatrix::<f32, 2, N>::zeros());
    for (column, range, bearing) in JACOBIAN {
        (h[(0, column)], h[(1, column)]) = (range, bearing);
    }
    let mut f = Box::new(SMatrix::<f32, N, N>::identity());
    (f[(0, 2)], f[(1, 2)]) = (-0.1, 0.1);
    let noise = SMatrix::<f32, N, N>::identity() * 1e-3;
    let measured = SMatrix::<f32, 2, 2>::identity() * 0.01;
    let mut filter = Box::new(Kalman1M::new(*f, noise, *h, measured, SVector::<f32, N>::zeros()));
    let update = time(|| {
        let _ = black_box(filter.update(SVector::<f32, 2>::new(0.01, 0.0)));
    });
    [
        update,
        time(|| {
            let _ = black_box(filter.predict());
        }),
    ]
}

pub(crate) fn numeris<const N: usize>() -> [f64; 2] {
    use numeris::{Matrix, Vector, estimate::Ekf};
    let mut h = Matrix::<f32, 2, N>::zeros();
    for (column, range, bearing) in JACOBIAN {
        (h[(0, column)], h[(1, column)]) = (range, bearing);
    }
    let mut f = Matrix::<f32, N, N>::eye();
    (f[(0, 2)], f[(1, 2)]) = (-0.1, 0.1);
    let (q, r) = (Matrix::<f32, N, N>::eye() * 1e-4, Matrix::<f32, 2, 2>::eye() * 0.01);
    let start = Vector::<f32, N>::from_array([0.0; N]);
    let mut filter = Box::new(Ekf::<f32, N, 2>::new(start, Matrix::<f32, N, N>::eye()));
    let z = Vector::<f32, 2>::from_array([0.01, 0.0]);
    let update = time(|| {
        let _ = black_box(filter.update(&z, |_| Vector::<f32, 2>::from_array([0.0; 2]), |_| h, &r));
    });
    let predict = time(|| {
        filter.predict(|x| *x, |_| f, Some(&q));
    });
    [update, predict]
}
