//! Loops compiled for more than one width of vector.

/// A loop over elements that do not depend on each other.
pub(crate) trait Kernel {
    /// Runs it. `COPY` tells the two compilations apart.
    fn run<const COPY: usize>(self);
}

/// Runs `kernel` with AVX2 where the processor has it and the feature `dispatch` is on, else as it was compiled.
#[inline(always)]
pub(crate) fn widest(kernel: impl Kernel) {
    #[cfg(all(feature = "dispatch", target_arch = "x86_64"))]
    if let Some(avx2) = fearless_simd::Level::new().as_avx2() {
        return fearless_simd::Simd::vectorize(
            avx2,
            #[inline(always)]
            || kernel.run::<1>(),
        );
    }
    kernel.run::<0>();
}
