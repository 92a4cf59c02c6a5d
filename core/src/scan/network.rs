//! From evidence to the log-odds that something's foot is at a sample, given that the floor is free up to there.
use super::evidence::INPUTS;
use super::weights::{HIDDEN, HIDDEN_BIAS, OUT, OUT_BIAS};

/// Log-odds beyond this are not believed.
const CERTAIN: f32 = 12.0;

/// ln(h / (1 − h)) of the hazard h: one layer of rectified sums.
pub(super) fn log_odds(evidence: &[f32; INPUTS]) -> f32 {
    let mut sum = OUT_BIAS;
    for ((weights, bias), out) in HIDDEN.iter().zip(&HIDDEN_BIAS).zip(&OUT) {
        let mut unit = *bias;
        for (weight, value) in weights.iter().zip(evidence) {
            unit += weight * value;
        }
        if unit > 0.0 {
            sum += out * unit;
        }
    }
    sum.clamp(-CERTAIN, CERTAIN)
}

/// The hazard of log-odds.
pub(super) fn hazard(log_odds: f32) -> f32 {
    1.0 / (1.0 + libm::expf(-log_odds))
}
