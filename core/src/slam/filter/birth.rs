//! Births by inverse observation, removals, and the conversion of inverse-distance landmarks.
//!
//! ```text
//! l = p + R(θ) d(z),    G_p = I,  G_θ = J (l − p),    P_l· = G P_r·,    P_ll = G P_rr Gᵀ + R(θ) Σ_d R(θ)ᵀ
//! ```
//!
//! with Σ_d = D⁻¹ R_z D⁻ᵀ: the newborn is correlated with the robot and with every landmark from the start, and no
//! huge prior is ever written down.
#![allow(clippy::indexing_slicing, reason = "kernel: offsets come from the filter's own records")]
use crate::geometry::range_bearing_by_floor;
use crate::slam::covariance::factored;
use crate::slam::covariance::packed;
use crate::slam::covariance::{Row, Rows};
use crate::slam::filter::update::product;
use crate::slam::filter::{Covariance, Filter, Variant};
use crate::slam::landmark::{Form, Landmark, Status};
use crate::slam::models::Measurement;
use crate::{Error, Real, Result};
use nalgebra::{Matrix2, Matrix2x4, Vector2};

/// A newborn in the robot's frame.
struct Seed<T> {
    point: Vector2<T>,
    covariance: Matrix2<T>,
    by_mount: Matrix2x4<T>,
}

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Filter<T, S, L> {
    /// Starts the landmark `id` from a measurement at `time` seconds (the filter's own time or later); it is
    /// [`Status::Tentative`]. A bearing alone starts an inverse-distance landmark; a range alone starts nothing,
    /// see [`RingStart`](crate::slam::RingStart).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a measurement that fails [`Measurement::check`] or has no point (a range alone, a
    /// pixel above the horizon); [`Error::Full`]; [`Error::KnownLandmark`]; [`Error::TimeBackwards`].
    pub fn birth(&mut self, time: f64, id: u32, measurement: &Measurement<T>) -> Result<()> {
        measurement.check()?;
        match *measurement {
            Measurement::Bearing { bearing, variance, range_prior } => {
                let (range, std) = range_prior.unwrap_or(self.config.range_prior);
                self.birth_on_ray(time, id, (bearing, variance), (range, std))
            }
            _ => {
                let seed = self.seed(measurement)?;
                self.birth_from(time, id, &seed)
            }
        }
    }

    /// Starts the landmark `id` from its position in the robot's frame.
    ///
    /// # Errors
    /// As [`birth`](Self::birth).
    pub fn birth_at(
        &mut self,
        time: f64,
        id: u32,
        point_in_robot: Vector2<T>,
        covariance: &Matrix2<T>,
    ) -> Result<()> {
        let finite = point_in_robot.iter().chain(covariance.iter()).all(|value| value.is_finite());
        if !finite || crate::association::cholesky(covariance).is_none() {
            let (name, value) = ("landmark", point_in_robot.x.to_f64());
            return Err(Error::OutOfRange {
                name,
                value,
                expected: "finite with a positive definite covariance",
            });
        }
        let seed = Seed { point: point_in_robot, covariance: *covariance, by_mount: Matrix2x4::zeros() };
        self.birth_from(time, id, &seed)
    }

    fn seed(&self, measurement: &Measurement<T>) -> Result<Seed<T>> {
        match measurement {
            Measurement::RangeBearing { range, bearing, covariance, by_mount } => {
                let (sin, cos) = bearing.sin_cos();
                let point = Vector2::new(*range * cos, *range * sin);
                let by_measurement = Matrix2::new(cos, -*range * sin, sin, *range * cos);
                let by_mount = by_mount.unwrap_or_else(Matrix2x4::zeros);
                Ok(Seed {
                    point,
                    covariance: by_measurement * covariance * by_measurement.transpose(),
                    by_mount: by_measurement * by_mount,
                })
            }
            Measurement::Point { point, covariance } => {
                Ok(Seed { point: *point, covariance: *covariance, by_mount: Matrix2x4::zeros() })
            }
            Measurement::Pixel { pixel, covariance } => {
                let (name, value, expected) = ("measurement.pixel", pixel.y.to_f64(), "a pixel of the floor");
                let error = Error::OutOfRange { name, value, expected };
                let sighting = self.finder().ok_or(error)?.sight(*pixel).map_err(|_| error)?;
                let by_point = range_bearing_by_floor(sighting.point_in_robot, sighting.range);
                let point_by = by_point.try_inverse().ok_or(error)?;
                let by_pixel = point_by * sighting.by_pixel;
                Ok(Seed {
                    point: sighting.point_in_robot,
                    covariance: by_pixel * covariance * by_pixel.transpose(),
                    by_mount: point_by * sighting.by_mount.fixed_columns::<4>(0),
                })
            }
            Measurement::Range { range: value, .. } | Measurement::Bearing { bearing: value, .. } => {
                let (name, value) = ("measurement", value.to_f64());
                Err(Error::OutOfRange { name, value, expected: "a measurement that fixes a point" })
            }
        }
    }

    fn birth_from(&mut self, time: f64, id: u32, seed: &Seed<T>) -> Result<()> {
        self.check_birth(time, id, Form::Point)?;
        let rotation = self.pose().rotation();
        let offset = rotation * seed.point;
        let lever = match self.config.variant {
            Variant::FirstEstimates => {
                let [x, y, _] = self.first_pose;
                offset + Vector2::new(self.difference_to(0, x), self.difference_to(1, y))
            }
            Variant::Invariant | Variant::Textbook => offset,
        };
        let by_heading = Vector2::new(-lever.y, lever.x);
        let mut rows = self.robot_rows(&by_heading);
        if self.config.mount_std.is_some() {
            let by_mount = rotation * seed.by_mount;
            for at in [0, 2] {
                let _ = rows.push(Row::new(3 + at, by_mount.fixed_columns::<2>(at).into_owned()));
            }
        }
        let noise = rotation * seed.covariance * rotation.transpose();
        let start = self.size;
        self.append_pair(&rows, &noise);
        self.place(start, 0, offset.x);
        self.place(start + 1, 1, offset.y);
        self.admit(time, id, start, Form::Point);
        Ok(())
    }

    /// (x₀, y₀, φ, ρ) = (p, θ + bearing, 1/range).
    fn birth_on_ray(&mut self, time: f64, id: u32, bearing: (T, T), range: (T, T)) -> Result<()> {
        self.check_birth(time, id, Form::InverseDistance)?;
        let start = self.size;
        let (zero, one) = (T::zero(), T::one());
        let anchor = self.robot_rows(&Vector2::zeros());
        self.append_pair(&anchor, &Matrix2::zeros());
        let mut angle = Rows::new();
        let _ = angle.push(Row::new(1, Matrix2::new(zero, one, zero, zero)));
        let inverse = one / range.0;
        let inverse_std = range.1 * inverse * inverse;
        self.append_pair(&angle, &Matrix2::new(bearing.1, zero, zero, inverse_std * inverse_std));
        let heading = self.x(2);
        self.place(start, 0, zero);
        self.place(start + 1, 1, zero);
        let parts = self.parts();
        parts.x[start + 2] = heading + bearing.0;
        parts.x[start + 3] = inverse;
        parts.rounding[start + 2] = zero;
        parts.rounding[start + 3] = zero;
        self.admit(time, id, start, Form::InverseDistance);
        Ok(())
    }

    fn check_birth(&self, time: f64, id: u32, form: Form) -> Result<()> {
        self.check_time(time)?;
        if self.landmark(id).is_some() {
            return Err(Error::KnownLandmark { id });
        }
        let (size, capacity) = self.states();
        if size + form.len() > capacity {
            return Err(Error::Full { name: "filter.storage", capacity });
        }
        let records = self.landmarks.as_ref().len();
        if self.count >= records {
            return Err(Error::Full { name: "filter.landmarks", capacity: records });
        }
        Ok(())
    }

    /// G of a point that moves with the robot, its heading lever given.
    fn robot_rows(&self, by_heading: &Vector2<T>) -> Rows<T> {
        let zero = T::zero();
        let mut rows = Rows::new();
        let _ = rows.push(Row::new(0, Matrix2::identity()));
        let _ = rows.push(Row::new(1, Matrix2::new(zero, by_heading.x, zero, by_heading.y)));
        rows
    }

    /// Appends two states y = G x + noise to the covariance.
    fn append_pair(&mut self, rows: &[Row<T>], noise: &Matrix2<T>) {
        let form = self.config.covariance;
        let mut parts = self.parts();
        let (stride, size) = (parts.x.len(), parts.p.size);
        let (first, rest) = parts.work.split_at_mut(stride);
        match form {
            Covariance::Packed => {
                let (first, second) = (&mut first[..size], &mut rest[..size]);
                packed::times(parts.p.view(), rows, [first, second]);
                let (left, right) = (product(rows, first), product(rows, second));
                let coupling = (left.y + right.x) * T::lit(0.5);
                let own = Matrix2::new(left.x, coupling, coupling, right.y) + noise;
                packed::append(&mut parts.p, [first, second], &own);
            }
            Covariance::Factored => factored::append(&mut parts.p, rows, noise, [first, rest]),
        }
        self.size += 2;
    }

    /// x[index] = x[from] + step, to the state's full digits.
    fn place(&mut self, index: usize, from: usize, step: T) {
        let mut parts = self.parts();
        parts.x[index] = parts.x[from];
        parts.rounding[index] = parts.rounding[from];
        parts.add(index, step);
    }

    fn difference_to(&self, index: usize, value: T) -> T {
        self.x(index) - value
    }

    fn admit(&mut self, time: f64, id: u32, offset: usize, form: Form) {
        let parts = self.parts();
        for index in offset..offset + form.len() {
            parts.first[index] = parts.x[index];
        }
        let record = Landmark {
            id,
            offset,
            form,
            status: Status::Tentative,
            seen: 1,
            first_time: time,
            last_time: time,
            ..Landmark::default()
        };
        self.landmarks.as_mut()[self.count] = record;
        self.count += 1;
        self.time = time;
    }

    /// Takes a landmark out of the map; what it taught the others stays.
    ///
    /// # Errors
    /// [`Error::UnknownLandmark`].
    pub fn remove(&mut self, id: u32) -> Result<()> {
        let slot = self.slot(id)?;
        let landmark = self.landmarks()[slot];
        self.remove_states(landmark.offset, landmark.form.len());
        let count = self.count;
        self.landmarks.as_mut()[slot..count].rotate_left(1);
        self.count -= 1;
        Ok(())
    }

    /// Makes an inverse-distance landmark a point, when it is linear enough; whether it is a point now.
    ///
    /// The linearity index (Civera, Davison and Montiel, 2008) is 4 σ_d |cos α| / d: σ_d the standard deviation of
    /// the distance, d the distance from the robot now, α the angle between the first ray and the present one.
    ///
    /// # Errors
    /// [`Error::UnknownLandmark`].
    pub fn convert(&mut self, id: u32) -> Result<bool> {
        let slot = self.slot(id)?;
        let landmark = self.landmarks()[slot];
        if landmark.form == Form::Point {
            return Ok(true);
        }
        let Some(position) = self.position(&landmark) else { return Ok(false) };
        let at = landmark.offset;
        let inverse = self.x(at + 3);
        let distance_std = self.covariance_at(at + 3, at + 3).max(T::zero()).sqrt() / (inverse * inverse);
        let first_ray = Vector2::new(self.x(at + 2).cos(), self.x(at + 2).sin());
        let ray = position - self.pose().position();
        let distance = ray.norm();
        let (size, capacity) = self.states();
        let index = T::lit(4.0) * distance_std * (first_ray.dot(&ray) / distance).abs() / distance;
        let linear = index < self.config.linearity;
        if !linear || size + Form::Point.len() > capacity {
            return Ok(false);
        }
        let rows = self.position_rows(&landmark);
        let start = self.size;
        self.append_pair(&rows, &Matrix2::zeros());
        let parts = self.parts();
        for (index, value) in [start, start + 1].into_iter().zip(position.iter()) {
            (parts.x[index], parts.rounding[index], parts.first[index]) = (*value, T::zero(), *value);
        }
        let record = &mut self.landmarks_mut()[slot];
        (record.offset, record.form) = (start, Form::Point);
        self.remove_states(at, Form::InverseDistance.len());
        Ok(true)
    }

    /// Where a measurement's landmark would lie, for passing over landmarks that are far from it; `None` where it fixes no
    /// point.
    pub(in crate::slam) fn nearby(&self, measurement: &Measurement<T>) -> Option<Nearby<T>> {
        let Seed { point, covariance, by_mount } = self.seed(measurement).ok()?;
        let heading = self.covariance_at(2, 2) * point.norm_squared();
        let mount = self.mount_error_covariance();
        let mount = mount.map_or(T::zero(), |own| (by_mount * own * by_mount.transpose()).trace());
        Some(Nearby { point, variance: covariance.trace() + T::lit(3.0) * (heading + mount) })
    }

    /// Trace of the covariance of a landmark's position less the robot's.
    pub(in crate::slam) fn relative_variance(&self, landmark: &Landmark<T>) -> T {
        let at = |row, column| self.covariance_at(row, column);
        let along =
            |robot, landmark| at(robot, robot) + at(landmark, landmark) - T::lit(2.0) * at(robot, landmark);
        (along(0, landmark.offset) + along(1, landmark.offset + 1)).max(T::zero())
    }

    /// Variance of a landmark's bearing, given how it lies to the robot in the world's directions.
    pub(in crate::slam) fn bearing_variance(&self, landmark: &Landmark<T>, offset: &Vector2<T>) -> T {
        let (zero, square) = (T::zero(), offset.norm_squared());
        let across = Vector2::new(-offset.y, offset.x) / square.max(T::default_epsilon());
        let row = |x, y| Matrix2::new(x, y, zero, zero);
        let rows = [
            Row::new(0, row(-across.x, -across.y)),
            Row::new(2, row(-T::one(), zero)),
            Row::new(landmark.offset, row(across.x, across.y)),
        ];
        self.cross(&rows).m11
    }

    /// The difference of two measurements made at once, squared and by their noise; `None` where one has no point.
    pub(in crate::slam) fn difference_nis(&self, a: &Measurement<T>, b: &Measurement<T>) -> Option<T> {
        let (a, b) = (self.seed(a).ok()?, self.seed(b).ok()?);
        crate::association::normalised_square(&(a.point - b.point), &(a.covariance + b.covariance))
    }

    fn remove_states(&mut self, from: usize, length: usize) {
        let (form, size) = (self.config.covariance, self.size);
        let mut parts = self.parts();
        match form {
            Covariance::Packed => parts.p.remove(from, length),
            Covariance::Factored => {
                let stride = parts.x.len();
                let (x, v) = parts.work.split_at_mut(stride);
                factored::remove(&mut parts.p, from, length, [x, v]);
            }
        }
        for vector in [parts.x, parts.rounding, parts.first] {
            vector.copy_within(from + length..size, from);
        }
        self.size -= length;
        for landmark in self.landmarks_mut() {
            if landmark.offset > from {
                landmark.offset -= length;
            }
        }
    }
}

/// Where a measurement's landmark would lie in the robot's frame.
pub(in crate::slam) struct Nearby<T> {
    point: Vector2<T>,
    variance: T,
}

impl<T: Real> Nearby<T> {
    /// Whether a landmark in sight at `point`, of this variance relative to the robot, is certainly beyond `nis`. The
    /// difference's covariance has three correlated parts and the noise; its largest eigenvalue is at most three times the
    /// parts' traces, plus the noise's trace (Cauchy's inequality).
    pub(in crate::slam) fn excludes(&self, point: &Vector2<T>, relative: T, nis: T) -> bool {
        // Twice the bound, for what linearisation leaves out.
        (self.point - point).norm_squared() > T::lit(2.0) * nis * (self.variance + T::lit(3.0) * relative)
    }
}
