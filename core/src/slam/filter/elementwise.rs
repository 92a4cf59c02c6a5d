//! Loops along the state and the update's vectors, for `widest!`: each gives the same bits at any width of vector.
use crate::Real;
use nalgebra::{Matrix2, Vector2};

/// from ← from − factor · vector.
#[inline(always)]
pub(super) fn subtract<T: Real>((from, factor, vector): (&mut [T], T, &[T])) {
    for (value, step) in from.iter_mut().zip(vector) {
        *value -= factor * *step;
    }
}

/// δ_q ← q⁺ − q = V δ_q and a_q = J (q⁺ − q), of positions side by side.
#[inline(always)]
pub(super) fn turn_steps<T: Real>((rotation, delta, lever): (Matrix2<T>, &mut [T], &mut [T])) {
    let ((steps, _), (levers, _)) = (delta.as_chunks_mut::<2>(), lever.as_chunks_mut::<2>());
    for (step, lever) in steps.iter_mut().zip(levers) {
        let [x, y] = *step;
        *step = [rotation.m11 * x + rotation.m12 * y, rotation.m21 * x + rotation.m22 * y];
        *lever = [-step[1], step[0]];
    }
}

type Whitening<'a, T> = (&'a [T; 3], [&'a mut [T]; 2], &'a Vector2<T>, &'a mut [T]);

/// (u, v) ← (u, v) L⁻ᵀ, δ ← δ + u w₁ + v w₂.
#[inline(always)]
pub(super) fn whiten<T: Real>((root, [first, second], innovation, delta): Whitening<'_, T>) {
    let inverse = [T::one() / root[0], T::one() / root[2]];
    for ((u, v), delta) in first.iter_mut().zip(second).zip(delta) {
        *u *= inverse[0];
        *v = (*v - root[1] * *u) * inverse[1];
        *delta += innovation.x * *u + innovation.y * *v;
    }
}

/// x += steps, keeping what rounding takes.
#[inline(always)]
pub(super) fn add_steps<T: Real>((x, rounding, steps): (&mut [T], &mut [T], &[T])) {
    for ((value, rounding), step) in x.iter_mut().zip(rounding).zip(steps) {
        // Fast-two-sum needs no ordering this way round (Knuth's two-sum).
        let (old, step) = (*value, *rounding + *step);
        let new = old + step;
        let virtual_step = new - old;
        *rounding = (old - (new - virtual_step)) + (step - virtual_step);
        *value = new;
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::vectors::widest;
    use std::vec::Vec;

    #[test]
    fn the_processors_own_vectors_give_the_same_bits() {
        for size in 0..40 {
            let numbers = |seed: f32| (0..size).map(move |at| (seed + 1.7 * at as f32).sin());
            let vectors = || [0.3, 1.1, 2.9].map(|seed| numbers(seed).collect::<Vec<f32>>());
            let (mut one, mut other) = (vectors(), vectors());
            let ([a, b, c], [u, v, w]) = (&mut one, &mut other);
            let (root, innovation) = ([0.7, -0.2, 1.3], Vector2::new(0.4, -0.9));
            widest!((&root, [&mut **a, &mut **b], &innovation, &mut **c), whiten);
            whiten((&root, [u, v], &innovation, w));
            widest!((&mut **a, 0.3, &**b), subtract);
            subtract((u, 0.3, v));
            widest!((&mut **a, &mut **b, &**c), add_steps);
            add_steps((u, v, w));
            let bits =
                |vectors: [Vec<f32>; 3]| vectors.map(|v| v.into_iter().map(f32::to_bits).collect::<Vec<_>>());
            assert_eq!(bits(one), bits(other), "size {size}");
        }
    }
}
