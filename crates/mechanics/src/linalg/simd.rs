//! Loops compiled for the widest vector registers of the processor.

use pulp::{Arch, Simd, WithSimd};
use std::ops::{Add, Mul, Sub};

/// Derivatives of one quantity with respect to `W` design variables.
pub(crate) type Gradient<const W: usize> = [f64; W];

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

/// A loop over many columns that is written with wide registers, because the compiler does not vectorize it itself.
pub(crate) trait WideKernel {
    /// Executes the loop. Mark it and all functions that it calls `#[inline(always)]`.
    fn run<S: Simd>(self, simd: S);
}

/// Executes `kernel` with the widest vector registers of the processor. Results are the same bits for all registers.
pub(crate) fn dispatch_wide(kernel: impl WideKernel) {
    Arch::new().dispatch(DispatchedWide(kernel));
}

struct DispatchedWide<K>(K);

impl<K: WideKernel> WithSimd for DispatchedWide<K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.0.run(simd);
    }
}

/// Numbers of neighbouring columns in one register.
#[derive(Clone, Copy)]
pub(crate) struct Lanes<S: Simd> {
    simd: S,
    values: S::f64s,
}

impl<S: Simd> Add for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { values: self.simd.add_f64s(self.values, other.values), ..self }
    }
}

impl<S: Simd> Sub for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { values: self.simd.sub_f64s(self.values, other.values), ..self }
    }
}

impl<S: Simd> Mul<f64> for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self { values: self.simd.mul_f64s(self.values, self.simd.splat_f64s(factor)), ..self }
    }
}

/// Computes `O` rows from `I` rows, register by register. `W` is a multiple of four.
#[inline(always)]
pub(crate) fn rows<S: Simd, const W: usize, const I: usize, const O: usize>(
    simd: S,
    inputs: [&[f64; W]; I],
    compute: impl Fn([Lanes<S>; I]) -> [Lanes<S>; O],
) -> [[f64; W]; O] {
    let mut out = [[0.0; W]; O];
    let inputs = inputs.map(|row| S::as_simd_f64s(row).0);
    for k in 0..W / S::F64_LANES {
        let computed = compute(inputs.map(|row| Lanes { simd, values: row[k] }));
        for (row, lanes) in out.iter_mut().zip(computed) {
            S::as_mut_simd_f64s(row).0[k] = lanes.values;
        }
    }
    out
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

    struct SumOfProducts<'a>([&'a [f64; 16]; 2], &'a mut [f64; 16]);

    impl WideKernel for SumOfProducts<'_> {
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) {
            [*self.1] = rows(simd, self.0, |[x, y]| [x * 0.1 + y * 0.3 - x]);
        }
    }

    #[test]
    fn rows_are_computed_as_their_numbers() {
        let [x, y] = [1.7f64, 2.9].map(|step| std::array::from_fn::<f64, 16, _>(|i| (step * i as f64).sin()));
        let mut out = [0.0; 16];
        dispatch_wide(SumOfProducts([&x, &y], &mut out));
        assert_eq!(out, std::array::from_fn(|i| x[i] * 0.1 + y[i] * 0.3 - x[i]));
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
