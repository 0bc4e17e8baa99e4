//! Coefficients of an explicit Runge–Kutta method.

use crate::integrators::explicit::grading::Grading;
use autodiff::Scalar;

/// A row of weights: pairs of slot and nonzero weight.
pub type TableauRow = &'static [(usize, f64)];

/// Largest number of slots of a method. A slot stores one derivative of a step.
pub const SLOTS: usize = 16;

/// Slot of the evaluations for outputs.
pub const SAMPLE: usize = SLOTS;

/// Number of components combined at a time.
const PIECE: usize = 8;

/// An explicit Runge–Kutta method with embedded error estimates and dense output.
///
/// $$ k_i = f\Big(t_0 + c_i h,\; y_0 + h\sum_{j<i} a_{ij} k_j\Big) $$
///
/// Slot `end` holds the derivative at the end of the step, and its row of weights gives y₁. It is the first slot of the
/// next step. Later slots are for dense output only. With x = (t − t₀)/h and Δ = y₁ − y₀ dense output is
///
/// $$ y_0 + x\Delta + x(1-x)(hk_0-\Delta) + x^2(1-x)(2\Delta-hk_0-hk_e) + x^2(1-x)^2\,h\sum_j P_j(x)\sum_i d_{ji}k_i $$
///
/// with P = 1, x, x(1−x), x²(1−x).
#[derive(Debug, PartialEq)]
pub struct Tableau {
    /// Name of the method.
    pub name: &'static str,
    /// Order of the solution.
    pub order: i32,
    /// Order of the error estimate.
    pub error_order: i32,
    /// Order of dense output.
    pub dense_order: i32,
    /// Nodes c.
    pub nodes: &'static [f64],
    /// Rows of the coefficients a.
    pub stages: &'static [TableauRow],
    /// Slot of the derivative at the end of the step.
    pub end: usize,
    /// True if the error estimate uses the derivative at the end.
    pub error_needs_end: bool,
    /// Error estimates: one, or two that are combined as in DOP853.
    pub errors: &'static [TableauRow],
    /// Rows of the coefficients d of dense output.
    pub dense: &'static [TableauRow],
}

/// Weights of a state inside a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DenseWeights<T = f64> {
    /// Weight of y₁ − y₀.
    pub change: T,
    /// Weights of h k, slot by slot.
    pub slots: [T; SLOTS],
}

impl Tableau {
    /// Number of slots, including those of dense output.
    pub fn slots(&self) -> usize {
        self.stages.len()
    }

    /// Weights of the state at which `slot` is evaluated in a step with the given `grading`: pairs of slot and weight.
    pub fn row(&self, slot: usize, grading: Grading) -> impl Iterator<Item = (usize, f64)> {
        self.stages[slot].iter().map(move |&(j, weight)| (j, weight * grading.slope(self.nodes[j])))
    }

    /// Weights of dense output at the fraction `s` of the length of a step with the given `grading`.
    pub fn graded_dense_weights<T: Scalar>(&self, s: T, grading: Grading) -> DenseWeights<T> {
        let mut weights = self.dense_weights(grading.variable(s));
        for (weight, &node) in weights.slots.iter_mut().zip(self.nodes) {
            *weight *= grading.slope(node);
        }
        weights
    }

    /// Writes the state at which `slot` is evaluated in a step of the length `h` with a grading, y = y₀ + h Σ a k.
    ///
    /// Works on pieces that fit into registers: every rate is read once and y is written once.
    pub fn combine<'a>(
        &self,
        slot: usize,
        (h, grading): (f64, Grading),
        start: &[f64],
        rates: impl Fn(usize) -> &'a [f64],
        y: &mut [f64],
    ) {
        let (mut all, mut count) = ([(0, 0.0); SLOTS], 0);
        for weight in self.row(slot, grading) {
            all[count] = weight;
            count += 1;
        }
        let row = &all[..count];
        let (mut y_pieces, mut start_pieces) = (y.chunks_exact_mut(PIECE), start.chunks_exact(PIECE));
        let mut at = 0;
        for (y, start) in (&mut y_pieces).zip(&mut start_pieces) {
            let mut sum = [0.0; PIECE];
            for &(j, weight) in row {
                sum.iter_mut().zip(&rates(j)[at..at + PIECE]).for_each(|(sum, k)| *sum += weight * k);
            }
            y.iter_mut().zip(start).zip(sum).for_each(|((y, start), sum)| *y = start + h * sum);
            at += PIECE;
        }
        for (i, (y, start)) in y_pieces.into_remainder().iter_mut().zip(start_pieces.remainder()).enumerate() {
            *y = start + h * row.iter().map(|&(j, weight)| weight * rates(j)[at + i]).sum::<f64>();
        }
    }

    /// Weights of dense output at the fraction `x` of a step.
    pub fn dense_weights<T: Scalar>(&self, x: T) -> DenseWeights<T> {
        let one = T::from(1.0);
        let (y, mut slots) = (one - x, [T::from(0.0); SLOTS]);
        slots[0] += x * y * y;
        slots[self.end] -= x * x * y;
        let factors = [one, x, x * y, x * x * y];
        for (row, factor) in self.dense.iter().zip(factors) {
            for &(slot, weight) in *row {
                slots[slot] += x * x * y * y * factor * weight;
            }
        }
        DenseWeights { change: x * x * (y * 2.0 + 1.0), slots }
    }
}

/// Dormand–Prince 5(4): order 5, seven stages of which the last is the first of the next step.
///
/// # Sources
///
/// Dormand & Prince, *J. Comput. Appl. Math.* 6 (1980) 19–26; dense output of order 4 by Shampine as in
/// Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, 2nd ed. (1993), Section II.6.
pub const DOPRI5: Tableau = Tableau {
    name: "Dormand–Prince 5(4)",
    order: 5,
    error_order: 4,
    dense_order: 4,
    nodes: &[0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0],
    stages: &[
        &[],
        &[(0, 0.2)],
        &[(0, 3.0 / 40.0), (1, 9.0 / 40.0)],
        &[(0, 44.0 / 45.0), (1, -56.0 / 15.0), (2, 32.0 / 9.0)],
        &[(0, 19372.0 / 6561.0), (1, -25360.0 / 2187.0), (2, 64448.0 / 6561.0), (3, -212.0 / 729.0)],
        &[(0, 9017.0 / 3168.0), (1, -355.0 / 33.0), (2, 46732.0 / 5247.0), (3, 49.0 / 176.0), (4, -5103.0 / 18656.0)],
        &[(0, 35.0 / 384.0), (2, 500.0 / 1113.0), (3, 125.0 / 192.0), (4, -2187.0 / 6784.0), (5, 11.0 / 84.0)],
    ],
    end: 6,
    error_needs_end: true,
    errors: &[&[
        (0, 71.0 / 57600.0),
        (2, -71.0 / 16695.0),
        (3, 71.0 / 1920.0),
        (4, -17253.0 / 339200.0),
        (5, 22.0 / 525.0),
        (6, -1.0 / 40.0),
    ]],
    dense: &[&[
        (0, -12715105075.0 / 11282082432.0),
        (2, 87487479700.0 / 32700410799.0),
        (3, -10690763975.0 / 1880347072.0),
        (4, 701980252875.0 / 199316789632.0),
        (5, -1453857185.0 / 822651844.0),
        (6, 69997945.0 / 29380423.0),
    ]],
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrators::explicit::dop853::DOP853;

    #[test]
    fn rows_sum_to_the_nodes_and_quadrature_is_of_full_order() {
        for table in [&DOPRI5, &DOP853] {
            for (row, c) in table.stages.iter().zip(table.nodes) {
                let sum: f64 = row.iter().map(|(_, w)| w).sum();
                assert!((sum - c).abs() < 1e-14, "{}", table.name);
            }
            for k in 1..=table.order {
                let moment: f64 = table.stages[table.end].iter().map(|&(j, w)| w * table.nodes[j].powi(k - 1)).sum();
                assert!((moment - 1.0 / f64::from(k)).abs() < 1e-14, "{} moment {k}: {moment}", table.name);
            }
            for row in table.errors {
                assert!(row.iter().map(|(_, w)| w).sum::<f64>().abs() < 1e-14);
            }
        }
    }

    #[test]
    fn dense_output_integrates_polynomials_of_its_order() {
        for table in [&DOPRI5, &DOP853] {
            for x in [0.0, 0.13, 0.5, 0.77, 1.0] {
                let weights = table.dense_weights(x);
                for k in 1..=table.dense_order {
                    // y' = k t^(k−1) from 0 over a step of length one.
                    let slots = weights.slots.iter().zip(table.nodes);
                    let sum: f64 = slots.map(|(w, c)| w * f64::from(k) * c.powi(k - 1)).sum();
                    let error = weights.change + sum - x.powi(k);
                    assert!(error.abs() < 1e-12, "{} at {x}, power {k}: {error:.2e}", table.name);
                }
            }
        }
    }
}
