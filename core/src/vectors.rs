//! Loops compiled for more than one width of vector.
use core::ops::Range;

/// Whether the target has vector instructions at all: elsewhere a loop cut to their measure is only longer code.
pub(crate) const VECTORS: bool = cfg!(any(target_arch = "x86_64", target_arch = "aarch64"));

/// Calls `part` with the indices that fill vectors of eight, then with four, two and one of those that are left.
#[inline(always)]
pub(crate) fn in_powers(count: usize, mut part: impl FnMut(Range<usize>)) {
    if !VECTORS {
        return part(0..count);
    }
    let mut rest = count & !7;
    part(0..rest);
    for length in [4, 2, 1] {
        if count & length != 0 {
            part(rest..rest + length);
            rest += length;
        }
    }
}

/// `widest!(arguments, run)` is `run(arguments)`, with AVX-512 or AVX2 where the feature `dispatch` is on and the processor has it:
/// the same loop every time.
///
/// The compiler widens a loop only within the function that has the wider vectors, so all are `#[inline(always)]` down to
/// the loop. (That is why this is a macro: a function that is handed on by its name is called, and then lacks the vectors.)
/// Elementwise loops give the same bits at any width: the compiler fuses no product with a sum, although a
/// processor that has AVX2 could.
macro_rules! widest {
    ($arguments:expr, $run:path) => {
        $crate::vectors::widest_of_three(
            $arguments,
            #[inline(always)]
            |arguments| $run(arguments),
            #[inline(always)]
            |arguments| $run(arguments),
            $run,
        )
    };
}
pub(crate) use widest;

/// Runs `wider` with AVX-512, `wide` with AVX2 or else `plain`; as [`widest`], which has one function for all. Each width needs its own
/// copy of all that is not inlined: a function that two widths shared would be compiled for only one of them.
#[inline(always)]
pub(crate) fn widest_of_three<A, R>(
    arguments: A,
    wider: impl FnOnce(A) -> R,
    wide: impl FnOnce(A) -> R,
    plain: impl FnOnce(A) -> R,
) -> R {
    #[cfg(all(any(feature = "dispatch", test), target_arch = "x86_64"))]
    {
        let level = fearless_simd::Level::new();
        if let fearless_simd::Level::Avx512(avx512) = level {
            return fearless_simd::Simd::vectorize(
                avx512,
                #[inline(always)]
                || wider(arguments),
            );
        }
        if let Some(avx2) = level.as_avx2() {
            return fearless_simd::Simd::vectorize(
                avx2,
                #[inline(always)]
                || wide(arguments),
            );
        }
    }
    let _ = (wider, wide);
    plain(arguments)
}
