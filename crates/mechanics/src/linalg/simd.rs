//! Loops compiled for the widest vector registers of the processor.

use pulp::{Arch, Simd, WithSimd};

/// A loop over many columns, compiled for wide registers as well as for any processor.
pub(crate) trait Kernel {
    /// Executes the loop. Mark it and all functions that it calls `#[inline(always)]`.
    fn run(self);
}

/// Executes `kernel` with the widest vector registers of the processor, which is detected once.
///
/// Results are the same bits for all registers: no product is fused with a sum.
pub(crate) fn dispatch(kernel: impl Kernel) {
    Arch::new().dispatch(Dispatched(kernel));
}

struct Dispatched<K>(K);

impl<K: Kernel> WithSimd for Dispatched<K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.0.run();
    }
}

/// A factorized matrix.
pub(crate) trait Substitute {
    /// Solves A X = B in place; row i of B is `b[i]`. Mark it `#[inline(always)]`.
    fn substitute<const W: usize>(&self, b: &mut [[f64; W]]);
}

/// Solves A X = B in place, with wide registers if B has enough columns to fill them.
pub(crate) fn substitute<M: Substitute, const W: usize>(matrix: &M, b: &mut [[f64; W]]) {
    if W < 4 { matrix.substitute(b) } else { dispatch(Substitution { matrix, b }) }
}

struct Substitution<'a, M, const W: usize> {
    matrix: &'a M,
    b: &'a mut [[f64; W]],
}

impl<M: Substitute, const W: usize> Kernel for Substitution<'_, M, W> {
    #[inline(always)]
    fn run(self) {
        self.matrix.substitute(self.b);
    }
}

/// x −= factor · y.
#[inline(always)]
pub(crate) fn subtract<const W: usize>(x: &mut [f64; W], factor: f64, y: &[f64; W]) {
    for (x, y) in x.iter_mut().zip(y) {
        *x -= factor * y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct AffineMap<'a>(&'a mut [f64]);

    impl Kernel for AffineMap<'_> {
        #[inline(always)]
        fn run(self) {
            self.0.iter_mut().for_each(|x| *x = 0.1 + *x * 0.3);
        }
    }

    #[test]
    fn rounds_as_any_processor_does() {
        let mut values: Vec<f64> = (0..37).map(|i| (1.7 * i as f64).sin()).collect();
        let mut others = values.clone();
        dispatch(AffineMap(&mut values));
        AffineMap(&mut others).run();
        assert_eq!(values, others);
    }
}
