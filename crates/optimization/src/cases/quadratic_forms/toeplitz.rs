//! Products with a symmetric Toeplitz matrix by fast Fourier transform, for matrices too large to store.

use nalgebra::Complex;
use std::f64::consts::PI;

/// The n × n matrix with entries (i, j) = kernel(|i − j|); a product costs O(n log n).
///
/// It is a leading block of a circulant matrix whose order is a power of two, which is diagonal in the Fourier basis.
///
/// # Sources
/// Golub & Van Loan, *Matrix Computations*, 4th ed. (2013), sections 1.4 and 4.8.
#[derive(Clone, Debug)]
pub struct Toeplitz {
    n: usize,
    /// Eigenvalues of the circulant matrix divided by its order; real because the kernel is even.
    spectrum: Vec<f64>,
    /// exp(−2πik/order), k below half the order.
    roots: Vec<Complex<f64>>,
}

impl Toeplitz {
    /// The matrix of order `n` with this kernel.
    pub fn new(n: usize, kernel: impl Fn(usize) -> f64) -> Self {
        let order = (2 * n).next_power_of_two();
        let root = |k: usize| {
            let (sin, cos) = (-2.0 * PI * k as f64 / order as f64).sin_cos();
            Complex::new(cos, sin)
        };
        let mut toeplitz = Self { n, spectrum: vec![], roots: (0..order / 2).map(root).collect() };
        let mut column = vec![Complex::new(0.0, 0.0); order];
        for k in 0..n {
            let value = Complex::new(kernel(k), 0.0);
            column[k] = value;
            column[(order - k) % order] = value;
        }
        toeplitz.transform(&mut column);
        toeplitz.spectrum = column.iter().map(|c| c.re / order as f64).collect();
        toeplitz
    }

    /// Products T v and T w; the two real vectors are the parts of one complex vector.
    pub fn products(&self, v: &[f64], w: &[f64]) -> [Vec<f64>; 2] {
        let mut both = vec![Complex::new(0.0, 0.0); self.spectrum.len()];
        both.iter_mut().zip(v.iter().zip(w)).for_each(|(c, (&v, &w))| *c = Complex::new(v, w));
        self.transform(&mut both);
        // The inverse transform is the conjugate of the transform of the conjugate.
        both.iter_mut().zip(&self.spectrum).for_each(|(c, s)| *c = (*c * *s).conj());
        self.transform(&mut both);
        [both[..self.n].iter().map(|c| c.re).collect(), both[..self.n].iter().map(|c| -c.im).collect()]
    }

    /// Discrete Fourier transform in place (Cooley & Tukey 1965, radix two).
    fn transform(&self, values: &mut [Complex<f64>]) {
        let order = values.len();
        let bits = order.trailing_zeros();
        for i in 0..order {
            let j = i.reverse_bits() >> (usize::BITS - bits);
            if i < j {
                values.swap(i, j);
            }
        }
        let mut half = 1;
        while half < order {
            let stride = order / (2 * half);
            for block in values.chunks_exact_mut(2 * half) {
                let (even, odd) = block.split_at_mut(half);
                for (k, (a, b)) in even.iter_mut().zip(odd).enumerate() {
                    let turned = *b * self.roots[k * stride];
                    (*a, *b) = (*a + turned, *a - turned);
                }
            }
            half *= 2;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_the_stored_matrix() {
        for n in [1, 2, 7, 64, 100] {
            let kernel = |k: usize| 1.0 / (1.0 + k as f64);
            let (v, w): (Vec<f64>, Vec<f64>) = (0..n).map(|i| ((i as f64).sin(), (3.0 * i as f64).cos())).unzip();
            let [tv, tw] = Toeplitz::new(n, kernel).products(&v, &w);
            for i in 0..n {
                let row = |x: &[f64]| (0..n).map(|j: usize| kernel(i.abs_diff(j)) * x[j]).sum::<f64>();
                assert!((tv[i] - row(&v)).abs() < 1e-13 && (tw[i] - row(&w)).abs() < 1e-13, "{n}");
            }
        }
    }
}
