//! The update: (9), (13), for all landmarks of a frame at once.
//!
//! Every measurement is linearised about the predicted state, and they are absorbed one after the other: the
//! innovation of each is taken after those before it (ν = z − h(x̂) − H δ), so that their normalised squares are
//! independent and add up to the frame's. The state itself moves once, at the end.
//!
//! ```text
//! S = H P Hᵀ + R = L Lᵀ,   w = P Hᵀ L⁻ᵀ,   δ ← δ + w L⁻¹ν,   P ← P − w wᵀ
//! θ⁺ = θ + δ_θ,   q⁺ = q + V(δ_θ) δ_q            for every position q            (invariant; q + δ_q otherwise)
//! P ← A P Aᵀ,   A = I + a e_θᵀ,   a_q = J (q⁺ − q)
//!   = P + a cᵀ + c aᵀ + P_θθ a aᵀ = P + a bᵀ + b aᵀ,   c = P e_θ,   b = c + ½ P_θθ a
//! ```
//!
//! The last two lines are what makes the filter right-invariant (Barrau and Bonnabel, "The invariant extended
//! Kalman filter as a stable observer", 2017), in ordinary coordinates and in differences alone: nothing depends
//! on where the origin is. The same is done for the map's scale where that is free (`scale`).
#![allow(clippy::indexing_slicing, reason = "kernel: vectors have the filter's capacity, indices its size")]
use crate::association::{Gate, cholesky, forward, inflation};
use crate::slam::covariance::downdate::downdate;
use crate::slam::covariance::factored;
use crate::slam::covariance::packed;
use crate::slam::covariance::triangle::{Triangle, TriangleRef};
use crate::slam::covariance::{Row, Rows};
use crate::slam::filter::elementwise::{add_steps, subtract, turn_steps, whiten};
use crate::slam::filter::outcome::{Decision, Observation, Outcome};
use crate::slam::filter::{BATCH, Covariance, Filter, Parts, ROBOT, Variant};
use crate::slam::landmark::Landmark;
use crate::slam::models::Linearised;
use crate::slam::models::arc_rotation;
use crate::vectors::widest;
use crate::{Error, Real, Result};
use core::ops::Range;
use nalgebra::{Matrix2, Matrix2x3, Matrix2x4, Matrix3, Vector2, Vector3};

/// Corrections found and not yet made.
#[derive(Debug, Default)]
pub(in crate::slam) struct Pending {
    /// Pairs of working vectors that wait for the next pass over the covariance.
    waiting: usize,
    /// Whether δ is in use.
    started: bool,
}

/// A measurement ready to be absorbed.
pub(in crate::slam) struct Absorbed<'a, T> {
    pub(in crate::slam) innovation: Vector2<T>,
    pub(in crate::slam) noise: Matrix2<T>,
    pub(in crate::slam) dof: usize,
    pub(in crate::slam) rows: &'a [Row<T>],
}

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Filter<T, S, L> {
    /// Corrects the state by a frame's measurements of known landmarks; `outcomes` receives one line for each.
    ///
    /// # Errors
    /// [`Error::UnknownLandmark`]; [`Error::OutOfRange`] for a measurement that fails
    /// [`Measurement::check`](crate::slam::Measurement::check); [`Error::Size`] when `outcomes` is shorter than `observations`. Nothing has changed
    /// then. A measurement that is sound but has no use – the landmark is behind the camera – is
    /// [`Decision::Rejected`] in its outcome, and changes nothing either.
    pub fn update(&mut self, observations: &[Observation<T>], outcomes: &mut [Outcome<T>]) -> Result<()> {
        if outcomes.len() < observations.len() {
            let (got, expected) = (outcomes.len(), observations.len());
            return Err(Error::Size { name: "outcomes", got, expected });
        }
        for observation in observations {
            observation.measurement.check()?;
            self.slot(observation.landmark)?;
        }
        let (finder, heading) = (self.finder(), self.heading());
        let mut pending = Pending::default();
        for (observation, outcome) in observations.iter().zip(outcomes) {
            let slot = self.slot(observation.landmark)?;
            let landmark = self.landmarks()[slot];
            *outcome = match self.linearise(&landmark, heading, &observation.measurement, finder.as_ref()) {
                Some(linear) => self.absorb_linearised(slot, &linear, &mut pending),
                None => Outcome { landmark: Some(landmark.id), ..Outcome::default() },
            };
        }
        self.finish(pending);
        Ok(())
    }

    /// Corrects the state by a measurement the filter does not know, linearised by the caller about the present
    /// state.
    ///
    /// # Errors
    /// [`Error::UnknownLandmark`]; [`Error::OutOfRange`] when a number is not finite.
    pub fn update_linearised(&mut self, landmark: u32, linear: &Linearised<T>) -> Result<Outcome<T>> {
        let slot = self.slot(landmark)?;
        if !linear.is_finite() || cholesky(&linear.noise).is_none() {
            let expected = "finite numbers and a positive definite noise";
            return Err(Error::OutOfRange {
                name: "linearised",
                value: linear.innovation.x.to_f64(),
                expected,
            });
        }
        let mut pending = Pending::default();
        let outcome = self.absorb_linearised(slot, linear, &mut pending);
        self.finish(pending);
        Ok(outcome)
    }

    /// Corrects the mount's and the wheels' errors by `difference`, a measurement of `by_mount` and `by_wheels` times them; where
    /// neither are states nothing happens.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when a number is not finite.
    pub fn update_shared(
        &mut self,
        difference: &Vector2<T>,
        covariance: &Matrix2<T>,
        by_mount: &Matrix2x4<T>,
        by_wheels: &Matrix2x3<T>,
    ) -> Result<Outcome<T>> {
        let finite = [difference.as_slice(), by_mount.as_slice(), by_wheels.as_slice()]
            .iter()
            .all(|part| part.iter().all(|value| value.is_finite()));
        if !finite || cholesky(covariance).is_none() {
            let expected = "finite numbers and a positive definite covariance";
            return Err(Error::OutOfRange { name: "difference", value: difference.x.to_f64(), expected });
        }
        let mut rows = Rows::new();
        if self.config.mount_std.is_some() {
            rows.extend([0, 2].map(|at| Row::new(ROBOT + at, by_mount.fixed_columns::<2>(at).into_owned())));
        }
        if self.config.wheels_std.is_some() {
            // Columns go in pairs: the second pair begins with the first one's last.
            let last = Matrix2::from_columns(&[Vector2::zeros(), by_wheels.column(2).into_owned()]);
            let (at, first) = (self.wheels_at(), by_wheels.fixed_columns::<2>(0).into_owned());
            rows.extend([Row::new(at, first), Row::new(at + 1, last)]);
        }
        if rows.is_empty() {
            return Ok(Outcome::default());
        }
        let absorbed = Absorbed { innovation: *difference, noise: *covariance, dof: 2, rows: &rows };
        let mut pending = Pending::default();
        let outcome = self.absorb(&absorbed, &mut pending);
        self.finish(pending);
        Ok(outcome)
    }

    /// Corrects the mount's angles by `errors`, by how much tilt, roll and yaw are more than the filter has them (rad), a measurement of
    /// this covariance; where the mount is no state nothing happens.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when a number is not finite, or the covariance not positive definite.
    pub fn update_mount(&mut self, errors: &Vector3<T>, covariance: &Matrix3<T>) -> Result<()> {
        let Some(before) = self.mount_error() else { return Ok(()) };
        // Tilt and roll, and then yaw, given those: yaw − k (tilt, roll) is independent of them.
        let of_two = covariance.fixed_view::<2, 2>(0, 0).into_owned();
        let with_yaw = covariance.fixed_view::<2, 1>(0, 2).into_owned();
        let k = of_two.try_inverse().map_or_else(Vector2::zeros, |inverse| inverse * with_yaw);
        let mut by_mount = Matrix2x4::zeros();
        by_mount.fixed_view_mut::<2, 2>(0, 1).fill_with_identity();
        self.update_shared(&errors.xy(), &of_two, &by_mount, &Matrix2x3::zeros())?;
        let done = self.mount_error().unwrap_or(before) - before;
        let row = Vector3::new(-k.x, -k.y, T::one());
        by_mount.fill(T::zero());
        by_mount.fixed_view_mut::<1, 3>(0, 1).copy_from(&row.transpose());
        let left = row.dot(&(errors - done.fixed_rows::<3>(1)));
        let noise = Matrix2::new(covariance.m33 - k.dot(&with_yaw), T::zero(), T::zero(), T::one());
        self.update_shared(&Vector2::new(left, T::zero()), &noise, &by_mount, &Matrix2x3::zeros())?;
        Ok(())
    }

    pub(in crate::slam) fn slot(&self, id: u32) -> Result<usize> {
        let records = self.landmarks();
        let called = |landmark: &Landmark<T>| landmark.id == id;
        // Where landmarks are numbered by their births, one is at its number, or before it when others have gone.
        let (near, far) = records.split_at(records.len().min((id as usize).saturating_add(1)));
        let found = near.iter().rposition(called);
        let found = found.or_else(|| Some(near.len() + far.iter().position(called)?));
        found.ok_or(Error::UnknownLandmark { id })
    }

    fn absorb_linearised(
        &mut self,
        slot: usize,
        linear: &Linearised<T>,
        pending: &mut Pending,
    ) -> Outcome<T> {
        let landmark = self.landmarks()[slot];
        let rows = linear.rows(landmark.offset, landmark.form, self.config.mount_std.is_some());
        let Linearised { innovation, noise, dof, .. } = *linear;
        self.absorb_landmark(slot, &Absorbed { innovation, noise, dof, rows: &rows }, pending)
    }

    /// As [`absorb`](Self::absorb), of the landmark at `slot`.
    pub(in crate::slam) fn absorb_landmark(
        &mut self,
        slot: usize,
        measured: &Absorbed<'_, T>,
        pending: &mut Pending,
    ) -> Outcome<T> {
        let landmark = self.landmarks()[slot];
        let mut outcome = self.absorb(measured, pending);
        outcome.landmark = Some(landmark.id);
        if outcome.decision == Decision::Update {
            if self.config.covariance == Covariance::Packed && !self.fixed {
                packed::cover_rounding(&mut self.parts().p, landmark.offset, landmark.form.len());
            }
            let time = self.time;
            let record = &mut self.landmarks_mut()[slot];
            record.seen = record.seen.saturating_add(1);
            record.last_time = time;
        }
        outcome
    }

    /// Adds one measurement's correction to what is pending.
    pub(in crate::slam) fn absorb(
        &mut self,
        measured: &Absorbed<'_, T>,
        pending: &mut Pending,
    ) -> Outcome<T> {
        let (gate, gate_nis, form) = (self.config.gate, self.config.gate_nis, self.config.covariance);
        let threshold = if measured.dof == 1 { gate_nis[0] } else { gate_nis[1] };
        let (size, start, fixed) = (self.size, self.start(), self.fixed);
        let parts = self.parts();
        let mut vectors = Vectors::new(parts.work, parts.x.len(), size);
        if !pending.started {
            vectors.delta.fill(T::zero());
        }
        let (waiting, current) = vectors.pairs.split_at_mut(pending.waiting);
        let [first, second] = &mut current[0];
        let from_state = match form {
            Covariance::Packed => {
                packed::times(parts.p.view(), measured.rows, [first, second]);
                for vector in waiting.iter().flatten() {
                    let along = product(measured.rows, vector);
                    widest!((&mut **first, along.x, &**vector), subtract);
                    widest!((&mut **second, along.y, &**vector), subtract);
                }
                let (left, right) = (product(measured.rows, first), product(measured.rows, second));
                let coupling = (left.y + right.x) * T::lit(0.5);
                Matrix2::new(left.x, coupling, coupling, right.y)
            }
            Covariance::Factored => factored::innovation(parts.p.view(), measured.rows, [first, second]),
        };
        let own = match form {
            Covariance::Packed => with_rounding(&measured.noise, measured.rows, parts.p.view()),
            Covariance::Factored => measured.noise,
        };
        let innovation = measured.innovation - product(measured.rows, vectors.delta);
        let total = from_state + own;
        let mut outcome = Outcome { innovation, covariance: total, dof: measured.dof, ..Outcome::default() };
        let Some(root) = cholesky(&total) else { return outcome };
        let nis = forward(&root, &innovation).norm_squared();
        if !nis.is_finite() {
            return outcome;
        }
        outcome.nis = Some(nis);
        let mut noise = own;
        if nis > threshold {
            match gate {
                Gate::Open => {}
                Gate::Hard => return Outcome { decision: Decision::Gated, ..outcome },
                Gate::Soft => {
                    let Some(factor) = inflation(&innovation, &from_state, &noise, threshold) else {
                        return outcome;
                    };
                    outcome.inflation = factor;
                    noise *= factor;
                }
            }
        }
        let Some(root) = cholesky(&(from_state + noise)) else { return outcome };
        let whitened = forward(&root, &innovation);
        if !(whitened.x.is_finite() && whitened.y.is_finite()) {
            return outcome;
        }
        pending.started = true;
        outcome.decision = Decision::Update;
        let mut p = parts.p;
        match form {
            Covariance::Packed => {
                let columns = [&mut **first, &mut **second];
                widest!((&root, columns, &whitened, &mut *vectors.delta), whiten);
                if fixed {
                    vectors.delta[start..].fill(T::zero());
                    packed::downdate_leading(&mut p, start, [&**first, &**second]);
                    return outcome;
                }
                pending.waiting += 1;
                if pending.waiting == BATCH {
                    downdate(&mut p, &vectors.shared(BATCH), None);
                    pending.waiting = 0;
                }
            }
            Covariance::Factored => {
                factored::update(&mut p, measured.rows, &noise, &innovation, [first, second], vectors.delta);
            }
        }
        outcome
    }

    /// Makes the pending corrections: the state moves, and the covariance with it.
    pub(in crate::slam) fn finish(&mut self, pending: Pending) {
        if !pending.started {
            return;
        }
        let (variant, form, count) = (self.config.variant, self.config.covariance, self.count);
        let (size, start, height) = (self.size, self.start(), self.free_scale().filter(|_| !self.fixed));
        let wheels = self.wheels_at();
        // Positions: the robot's at 0, and each landmark's (or its anchor's).
        let (parts, landmarks) = self.parts_and_landmarks();
        let Parts { x, rounding, first, work, mut p } = parts;
        let stride = x.len();
        let predicted = robot_block(&p);
        let mut vectors = Vectors::new(work, stride, size);
        let turn = vectors.delta[2];
        let invariant = variant == Variant::Invariant;
        if invariant {
            let rotation = arc_rotation(turn);
            vectors.lever.fill(T::zero());
            let mut turn_run = |at: Range<usize>| {
                let moved = (rotation, &mut vectors.delta[at.clone()], &mut vectors.lever[at]);
                widest!(moved, turn_steps);
            };
            if size == start + 2 * count {
                // Points only: they fill the state.
                turn_run(0..2);
                turn_run(start..size);
            } else {
                let mut run = 0..2;
                for landmark in landmarks.iter().take(count) {
                    if landmark.offset != run.end {
                        turn_run(run);
                        run = landmark.offset..landmark.offset;
                    }
                    run.end += 2;
                }
                turn_run(run);
            }
        }
        match (form, invariant) {
            (Covariance::Packed, false) => downdate(&mut p, &vectors.shared(pending.waiting), None),
            (Covariance::Packed, true) => {
                vectors.turn_column(&p, pending.waiting);
                let pairs = vectors.shared(pending.waiting);
                downdate(&mut p, &pairs, Some([vectors.lever, vectors.column]));
            }
            (Covariance::Factored, false) => {}
            (Covariance::Factored, true) => {
                let [[f, v], ..] = &mut vectors.pairs;
                factored::reset(&mut p, 2, vectors.lever, f, v);
            }
        }
        if let Some(height) = height.filter(|_| invariant) {
            vectors.scale_steps(landmarks, start, wheels, height);
            match form {
                Covariance::Packed => {
                    vectors.height_column(&p);
                    downdate(&mut p, &[], Some([vectors.lever, vectors.column]));
                }
                Covariance::Factored => {
                    let [[f, v], ..] = &mut vectors.pairs;
                    factored::reset(&mut p, ROBOT, vectors.lever, f, v);
                }
            }
        }
        widest!((&mut *x, &mut *rounding, &*vectors.delta), add_steps);
        // Rounding, or a number that was none, can leave no covariance. Then the map is worth nothing: the robot stays as
        // uncertain as it was, and begins a new one.
        let variance = |at: usize| p.at(at, at) >= T::zero() && p.at(at, at).is_finite();
        let sound =
            form == Covariance::Factored || (start..size).all(variance) && is_covariance(&robot_block(&p));
        Parts { x, rounding, first, work: &mut [], p }.wrap_heading();
        if !sound {
            self.begin_anew(&predicted);
        }
    }

    /// Empties the map; the robot stays where it is, with this covariance, which nothing else shares.
    fn begin_anew(&mut self, covariance: &Matrix3<T>) {
        let (size, start, shared) = (self.size, self.start(), self.config.shared_std());
        self.resets = self.resets.saturating_add(1);
        self.count = 0;
        let mut p = self.parts().p;
        for row in 0..size {
            for column in row..size {
                p.set(row, column, T::zero());
            }
        }
        // A frame of many measurements goes through in parts, and an earlier part may have been what failed.
        let sound = is_covariance(covariance);
        for row in 0..ROBOT {
            for column in row..ROBOT {
                let value = covariance[(row, column)];
                let kept = if sound || row == column { value } else { T::zero() };
                let kept = if row == column { kept.abs() } else { kept };
                p.set(row, column, if kept.is_finite() { kept } else { T::one() });
            }
        }
        for (at, std) in shared.into_iter().enumerate() {
            p.set(ROBOT + at, ROBOT + at, std * std);
        }
        self.size = start;
    }
}

/// The working vectors, cut to the present size.
pub(super) struct Vectors<'a, T> {
    pairs: [[&'a mut [T]; 2]; BATCH],
    /// δ.
    pub(super) delta: &'a mut [T],
    /// a.
    pub(super) lever: &'a mut [T],
    /// b.
    pub(super) column: &'a mut [T],
}

impl<'a, T: Real> Vectors<'a, T> {
    fn new(work: &'a mut [T], stride: usize, size: usize) -> Self {
        let mut chunks = work.chunks_exact_mut(stride.max(1)).map(|chunk| &mut chunk[..size]);
        let mut next = || chunks.next().unwrap_or_default();
        let pairs = core::array::from_fn(|_| [next(), next()]);
        Self { pairs, delta: next(), lever: next(), column: next() }
    }

    fn shared(&self, count: usize) -> heapless::Vec<[&[T]; 2], BATCH> {
        self.pairs.iter().take(count).map(|[u, v]| [&**u, &**v]).collect()
    }

    /// b = c + ½ P_θθ a, with c = P e_θ after the downdates that wait.
    fn turn_column(&mut self, p: &Triangle<'_, T>, waiting: usize) {
        self.column[0] = p.at(0, 2);
        self.column[1] = p.at(1, 2);
        self.column[2..].copy_from_slice(p.view().row(2));
        for vector in self.pairs.iter().take(waiting).flatten() {
            widest!((&mut *self.column, vector[2], &**vector), subtract);
        }
        let half = -self.column[2] * T::lit(0.5);
        widest!((&mut *self.column, half, &*self.lever), subtract);
    }
}

/// The covariance of (x, y, heading).
fn robot_block<T: Real>(p: &Triangle<'_, T>) -> Matrix3<T> {
    Matrix3::from_fn(|row, column| p.at(row, column))
}

/// How far below 0 rounding may leave the determinant of correlations.
const ROUNDED: f64 = 1e-3;

/// Whether a matrix can be a covariance but for rounding. A pose that is known by definition has none, and the first step's two
/// errors leave one of its three directions to rounding: Cholesky's factors are asked for too much there.
fn is_covariance<T: Real>(p: &Matrix3<T>) -> bool {
    let least = -T::lit(ROUNDED);
    let correlation = |a: usize, b: usize| {
        let square = p[(a, a)] * p[(b, b)];
        if square > T::zero() { p[(a, b)] / square.sqrt() } else { T::zero() }
    };
    let [xy, xh, yh] = [correlation(0, 1), correlation(0, 2), correlation(1, 2)];
    let minor = |r: T| T::one() - r * r >= least;
    let whole = T::one() + T::lit(2.0) * xy * xh * yh - xy * xy - xh * xh - yh * yh;
    p.iter().all(|value| value.is_finite())
        && p.diagonal().iter().all(|variance| *variance >= T::zero())
        && [xy, xh, yh].into_iter().all(minor)
        && whole >= least
}

/// R with what rounding may have done to H P Hᵀ, where that is not small beside it.
///
/// H P Hᵀ of a landmark seen from nearby is the small difference of large numbers, the variances of robot and landmark in the
/// world, each rounded to ε of itself. Where R is no larger than that, S is what rounding left: it can be far too
/// small, even negative, and such a measurement takes from P more than there is. In `f32` that begins where the pose is
/// uncertain by metres and a pixel's noise is a millimetre on the floor.
fn with_rounding<T: Real>(noise: &Matrix2<T>, rows: &[Row<T>], p: TriangleRef<'_, T>) -> Matrix2<T> {
    let size = rows.iter().fold(Vector2::zeros(), |sum: Vector2<T>, row| {
        let (h, [first, second]) = (row.matrix(), [0, 1].map(|at| p.at(row.column + at, row.column + at)));
        sum + Vector2::new(
            h.m11 * h.m11 * first + h.m12 * h.m12 * second,
            h.m21 * h.m21 * first + h.m22 * h.m22 * second,
        )
    });
    let floor = size * (T::default_epsilon() * T::lit(4.0));
    let matters = |own: T, floor: T| floor * T::lit(16.0) > own;
    if !(matters(noise.m11, floor.x) || matters(noise.m22, floor.y)) {
        return *noise;
    }
    noise + Matrix2::from_diagonal(&floor)
}

/// H v.
pub(in crate::slam) fn product<T: Real>(rows: &[Row<T>], vector: &[T]) -> Vector2<T> {
    let mut sum = Vector2::zeros();
    for row in rows {
        sum += row.matrix() * Vector2::new(vector[row.column], vector[row.column + 1]);
    }
    sum
}

#[cfg(test)]
#[path = "update_tests.rs"]
mod tests;
