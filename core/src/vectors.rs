//! Loops compiled for more than one width of vector.

/// Whether the target has vector instructions at all: elsewhere a loop cut to their measure is only longer code.
pub(crate) const VECTORS: bool = cfg!(any(target_arch = "x86_64", target_arch = "aarch64"));

/// Runs `wide` with AVX2 where the feature `dispatch` is on and the processor has it, else `plain`: the same loop twice.
///
/// The compiler widens a loop only within the function that has the wider vectors, so both are `#[inline(always)]` down to
/// the loop. Elementwise loops give the same bits at any width: the compiler fuses no product with a sum, although a
/// processor that has AVX2 could.
#[inline(always)]
pub(crate) fn widest<A, R>(arguments: A, wide: impl FnOnce(A) -> R, plain: impl FnOnce(A) -> R) -> R {
    #[cfg(all(any(feature = "dispatch", test), target_arch = "x86_64"))]
    if let Some(avx2) = fearless_simd::Level::new().as_avx2() {
        return fearless_simd::Simd::vectorize(
            avx2,
            #[inline(always)]
            || wide(arguments),
        );
    }
    let _ = wide;
    plain(arguments)
}
