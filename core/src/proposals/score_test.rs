use super::super::features::{CONTEXT_SIDE, FEATURE_NAMES, Features, PATCH_SIDE};
use super::weights::{EXPECTED, NAMES, SCALES};
use super::{logit, probability};

/// Made-up candidates, as `tests/scoring/weights.py` makes them.
fn candidate(number: u32) -> (Features, [u8; 256], [u8; 144]) {
    let mut state = 12_345 + number;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state >> 24
    };
    let mut grey = |out: &mut [u8]| out.iter_mut().for_each(|grey| *grey = next() as u8);
    let (mut patch, mut context) = ([0; PATCH_SIDE * PATCH_SIDE], [0; CONTEXT_SIDE * CONTEXT_SIDE]);
    grey(&mut patch);
    grey(&mut context);
    let mut level = || next() as f32;
    let features = Features {
        vertical_length: level(),
        vertical_brighter_right: if number.is_multiple_of(2) { 1.0 } else { -1.0 },
        below_end: level() / 16.0 - 8.0,
        left_length: level(),
        right_fall: level() / 256.0,
        left_sight: level() / 128.0 - 1.0,
        above_left: level() / 8.0 - 16.0,
        below_right: level() / 8.0 - 16.0,
        contrast_floor: level() / 4.0,
        range: level() / 32.0,
        noise: 1.0 + level() / 64.0,
        ..Features::default()
    };
    (features, patch, context)
}

#[test]
fn agrees_with_the_network_that_was_fitted() {
    for (number, expected) in (0..).zip(EXPECTED) {
        let (features, patch, context) = candidate(number);
        let logit = logit(&features, &patch, &context);
        assert!((logit - expected).abs() < 2e-3, "candidate {number}: {logit}, fitted {expected}");
    }
}

#[test]
fn takes_the_features_by_their_names() {
    for (scale, name) in SCALES.iter().zip(NAMES) {
        assert_eq!(FEATURE_NAMES[scale.index], name);
    }
}

#[test]
fn left_and_right_do_not_matter() {
    let (features, patch, context) = candidate(0);
    let mut mirror = super::mirrored(&features);
    mirror.vertical_brighter_right = -features.vertical_brighter_right;
    let (mut mirrored_patch, mut mirrored_context) = (patch, context);
    mirrored_patch.chunks_exact_mut(PATCH_SIDE).for_each(<[u8]>::reverse);
    mirrored_context.chunks_exact_mut(CONTEXT_SIDE).for_each(<[u8]>::reverse);
    let one = probability(&features, &patch, &context);
    assert_eq!(one, probability(&mirror, &mirrored_patch, &mirrored_context));
    assert!((0.0..=1.0).contains(&one));
}

#[test]
fn what_is_not_a_number_says_nothing() {
    let (mut features, patch, context) = candidate(2);
    (features.range, features.vertical_turn) = (f32::NAN, f32::NAN);
    assert!(probability(&features, &patch, &context).is_finite());
}
