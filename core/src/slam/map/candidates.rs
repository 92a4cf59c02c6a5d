//! Candidates: which landmarks a frame's measurements may be of, and which they are nearest to.
use super::frame::{Candidates, Frame, Nearest, Round, Sighted, Standing};
use super::stacked::Pair;
use super::{Feature, Hint, Map, of_dof};
use crate::Real;
use crate::association::{Candidate, cholesky, normalised_square};
use crate::slam::filter::birth::Nearby;
use crate::slam::landmark::{Form, Landmark};
use crate::slam::models::linearise::Relative;
use crate::slam::models::{Linearised, Measurement};

/// Standard deviation of a bearing, rad, above which a turn is not linear: its cosine is off by 5 %.
const LARGEST_TURN: f64 = 0.35;

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Map<T, S, L> {
    /// Lists the pairs of the round's measurements, and notes where each of these stands.
    pub(super) fn find(
        &self,
        frame: &Frame<'_, T>,
        round: Round,
        standings: &mut [Standing<T>],
        candidates: &mut Candidates<T>,
    ) {
        // Where all are beyond their gates, as after a slip of the wheels, they may have an error in common.
        for gates in [self.config.match_nis, [self.config.birth_nis; 2]] {
            candidates.clear();
            for sighted in frame.sighted(round) {
                let Some(standing) = standings.get_mut(sighted.index) else { break };
                *standing = self.stand(frame, &sighted, frame.may_be, &mut |candidate, pair| {
                    if candidate.nis <= of_dof(gates, candidate.dof) || round == Round::Named {
                        candidates.push(candidate, pair);
                    }
                });
            }
            if !candidates.list.is_empty() {
                return;
            }
        }
    }

    /// Where a measurement stands among the landmarks that it may be of; `each` is told of every one that no other measurement
    /// has named.
    pub(super) fn stand(
        &self,
        frame: &Frame<'_, T>,
        sighted: &Sighted<'_, T>,
        may_be: &dyn Fn(usize, &Landmark<T>) -> bool,
        each: &mut dyn FnMut(Candidate<T>, Pair<T>),
    ) -> Standing<T> {
        let Sighted { index, feature: Feature { measurement, hint, .. } } = *sighted;
        let heading = self.filter.heading();
        let nearby = self.filter.nearby(measurement);
        let mut nearest: Option<Nearest<T>> = None;
        for (slot, landmark) in self.filter.landmarks().iter().enumerate() {
            let named = *hint == Hint::Landmark(landmark.id);
            let excluded = *hint != Hint::Free && !named;
            if excluded || !may_be(index, landmark) {
                continue;
            }
            let now = self.filter.relative_at(landmark, heading);
            let far = |near: &Nearby<T>| {
                let point = now.point().filter(|_| landmark.form == Form::Point);
                let relative = self.filter.relative_variance(landmark);
                point.is_some_and(|point| near.excludes(&point, relative, self.config.birth_nis))
            };
            // A bearing is linear in the heading however far it turns, and the filter takes the lever in full; a pixel is not.
            let pixel = matches!(measurement, Measurement::Pixel { .. });
            if !named && nearby.as_ref().is_some_and(far)
                || pixel && self.is_beyond_first_order(landmark, &now)
            {
                continue;
            }
            let Some(pair) = self.linearise(frame, (index, slot)) else { continue };
            let (innovation, covariance) = (pair.innovation, self.filter.cross(&pair.rows) + pair.noise);
            let (Some(nis), Some([l11, _, l22])) =
                (normalised_square(&innovation, &covariance), cholesky(&covariance))
            else {
                continue;
            };
            if nearest.is_none_or(|least| nis < least.nis) {
                nearest = Some(Nearest { landmark: landmark.id, innovation, covariance, nis });
            }
            if landmark.last_frame != self.frame {
                let cost = nis + T::lit(2.0) * (l11 * l22).ln() + pair.offset;
                each(
                    Candidate { observation: index, landmark: slot, cost, nis, dof: measurement.dof() },
                    pair,
                );
            }
        }
        match nearest {
            None => Standing::Alone,
            Some(nearest) if nearest.nis <= self.config.birth_nis => Standing::Gated(nearest),
            Some(nearest) => Standing::Stranger(nearest),
        }
    }

    /// A measurement of a landmark, given by their indices, linearised about the present state.
    pub(super) fn linearise(&self, frame: &Frame<'_, T>, of: (usize, usize)) -> Option<Pair<T>> {
        let (feature, landmark) = (frame.features.get(of.0)?, self.filter.landmarks().get(of.1)?);
        let heading = self.filter.heading();
        let linear = self.filter.linearise(landmark, heading, &feature.measurement, frame.finder)?;
        let Linearised { innovation, noise, .. } = linear;
        let offset = offset(&linear, landmark.form, self.config.density);
        let rows = linear.rows(landmark.offset, landmark.form, self.filter.config().mount_std.is_some());
        Some(Pair { of, innovation, noise, offset, rows })
    }

    /// Whether the heading is so uncertain, and the landmark with it as the robot sees it, that no Jacobian tells where it may
    /// be: what such a pair would do to state and covariance means nothing. A landmark that was born under this heading
    /// turns with the robot and is none of them.
    fn is_beyond_first_order(&self, landmark: &Landmark<T>, now: &Relative<T>) -> bool {
        let most = T::lit(LARGEST_TURN * LARGEST_TURN);
        landmark.form == Form::Point
            && self.filter.covariance_at(2, 2) > most
            && self.filter.bearing_variance(landmark, &now.offset) > most
    }
}

/// n ln 2π + 2 ln(λ |∂l/∂z|): what the cost of a pair has beside νᵀS⁻¹ν + ln|S|.
fn offset<T: Real>(linear: &Linearised<T>, form: Form, density: T) -> T {
    let two = T::lit(2.0);
    if linear.dof == 1 || form != Form::Point {
        // One landmark a radian or a metre: of one number nothing better is known.
        return T::lit(linear.dof as f64) * T::two_pi().ln();
    }
    let by_landmark = linear.by_landmark.fixed_columns::<2>(0).determinant().abs();
    two * (T::two_pi() * density / by_landmark.max(T::default_epsilon())).ln()
}
