//! Is the filter to be believed? A verdict from what every update says about itself.
//!
//! The normalised innovations of a consistent filter average to 1 a degree of freedom, ± √(2/(n·dof)) over n of
//! them: ± 0.125 over the window of 64 measurements of two. A gated measurement contributes the gate's value, not its own: it may
//! belong to a neighbour that has no landmark, and its distance tells nothing of the covariance. A run of inflated or gated
//! measurements means that the estimated pose is no longer where the sensor is.
use crate::Real;
use crate::slam::filter::{Decision, Outcome};

/// What a user can act on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Verdict {
    /// No landmark was measured twice: nothing speaks for or against the motion.
    #[default]
    Unchecked,
    /// Errors are of the size the covariance says.
    Consistent,
    /// Errors are larger than the covariance says: raise the sensor's or the odometry's noise.
    OverConfident,
    /// Measurement after measurement lies beyond its gate: the map or the pose is wrong. Start anew.
    Diverging,
}

impl Verdict {
    /// Every verdict.
    pub const ALL: [Self; 4] = [Self::Unchecked, Self::Consistent, Self::OverConfident, Self::Diverging];

    /// The word for it.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Unchecked => "unchecked",
            Self::Consistent => "consistent",
            Self::OverConfident => "over-confident",
            Self::Diverging => "diverging",
        }
    }
}

/// Measurements in the window.
const WINDOW: usize = 64;
/// Measurements beyond their gate in a row that mean divergence.
const RUN: u32 = 12;

/// Running figures of the updates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Health<T> {
    /// Measurements beyond their gate in a row, up to now.
    pub beyond_gate_in_a_row: u32,
    /// Measurements beyond their gate, ever.
    pub beyond_gate: u32,
    /// Measurements with an innovation, ever.
    pub measurements: u32,
    /// The last measurement's ratio of the eigenvalues of S: 1e6 in `f32` leaves no digit.
    pub condition: T,
    window: [T; WINDOW],
}

impl<T: Real> Default for Health<T> {
    fn default() -> Self {
        Self {
            beyond_gate_in_a_row: 0,
            beyond_gate: 0,
            measurements: 0,
            condition: T::one(),
            window: [T::one(); WINDOW],
        }
    }
}

impl<T: Real> Health<T> {
    /// Takes note of an outcome. `threshold` is the gate it was held against.
    pub fn note(&mut self, outcome: &Outcome<T>, threshold: T) {
        let Some(nis) = outcome.nis else { return };
        if !matches!(outcome.decision, Decision::Update | Decision::Tentative | Decision::Gated) {
            return;
        }
        let at = self.measurements as usize % WINDOW;
        if let Some(entry) = self.window.get_mut(at) {
            *entry = nis.min(threshold) / T::lit(outcome.dof.max(1) as f64);
        }
        self.measurements = self.measurements.wrapping_add(1);
        if nis > threshold {
            self.beyond_gate = self.beyond_gate.saturating_add(1);
            self.beyond_gate_in_a_row = self.beyond_gate_in_a_row.saturating_add(1);
        } else {
            self.beyond_gate_in_a_row = 0;
        }
        let s = &outcome.covariance;
        let half = T::lit(0.5);
        let (mean, difference) = ((s.m11 + s.m22) * half, (s.m11 - s.m22) * half);
        let spread = (difference * difference + s.m12 * s.m12).sqrt();
        self.condition = (mean + spread) / (mean - spread).max(T::default_epsilon() * mean);
    }

    /// Mean of the normalised innovation squared a degree of freedom, over the last 64 measurements (1 before
    /// there are any).
    pub fn mean_nis(&self) -> T {
        let used = (self.measurements as usize).clamp(1, WINDOW);
        let sum = self.window.iter().take(used).fold(T::zero(), |sum, value| sum + *value);
        sum / T::lit(used as f64)
    }

    /// The verdict.
    pub fn verdict(&self) -> Verdict {
        if self.measurements == 0 {
            Verdict::Unchecked
        } else if self.beyond_gate_in_a_row >= RUN {
            Verdict::Diverging
        } else if self.measurements as usize >= WINDOW && self.mean_nis() > T::lit(1.5) {
            Verdict::OverConfident
        } else {
            Verdict::Consistent
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict_after(nis: impl Fn(usize) -> f64) -> Verdict {
        let mut health = Health::default();
        for index in 0..2 * WINDOW {
            let nis = nis(index);
            let decision = if nis > 9.21 { Decision::Gated } else { Decision::Update };
            health.note(&Outcome { decision, nis: Some(nis), dof: 2, ..Outcome::default() }, 9.21);
        }
        health.verdict()
    }

    #[test]
    fn nothing_measured_is_unchecked() {
        assert_eq!(Health::<f32>::default().verdict(), Verdict::Unchecked);
        let mut health = Health::default();
        health.note(&Outcome { decision: Decision::Birth, ..Outcome::default() }, 9.21);
        assert_eq!(health.verdict(), Verdict::Unchecked);
        health.note(
            &Outcome { decision: Decision::Update, nis: Some(1.0), dof: 2, ..Outcome::default() },
            9.21,
        );
        assert_eq!(health.verdict(), Verdict::Consistent);
    }

    #[test]
    fn a_neighbour_that_is_gated_again_and_again_is_not_over_confidence() {
        assert_eq!(verdict_after(|index| if index % 5 == 0 { 24.0 } else { 1.0 }), Verdict::Consistent);
        assert_eq!(verdict_after(|_| 4.0), Verdict::OverConfident);
        assert_eq!(verdict_after(|index| if index % 2 == 0 { 24.0 } else { 1.0 }), Verdict::OverConfident);
        assert_eq!(verdict_after(|_| 24.0), Verdict::Diverging);
    }
}
