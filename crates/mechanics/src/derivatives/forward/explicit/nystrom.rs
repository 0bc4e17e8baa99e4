//! The weights of a method for positions and velocities.

use crate::integrators::explicit::tableau::{DenseWeights, SLOTS, Tableau};

/// How positions and velocities come from those at the ends of a step and from its accelerations.
///
/// An explicit Runge–Kutta method takes velocities as rates of positions. What it makes of them is written with
/// accelerations alone, so that no velocity between the ends is kept:
///
/// $$ v_i = v_0 + h\sum_j a_{ij}\,\ddot q_j ,\qquad
///    q_i = q_0 + h\Big(\sum_{j\ne e} a_{ij}\Big) v_0 + h\,a_{ie} v_1 + h^2 \sum_l \sum_{j\ne e} a_{ij} a_{jl}\,\ddot q_l $$
///
/// where e is the end of the step, whose velocity v₁ is projected.
///
/// **Source.** Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, 2nd ed. (1993), Section II.14.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nystrom {
    /// Weight of h v₀ in a position.
    pub start: f64,
    /// Weight of h v₁ in a position.
    pub end: f64,
    slots: [Share; SLOTS],
    count: usize,
}

/// What the acceleration of one slot contributes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Share {
    pub slot: usize,
    /// Weight of h² q̈ in a position.
    pub position: f64,
    /// Weight of h q̈ in a velocity.
    pub velocity: f64,
}

impl Nystrom {
    /// For each slot of `method` the state at which it is evaluated.
    pub fn table(method: &Tableau) -> Vec<Self> {
        method.stages.iter().map(|row| Self::new(method, row.iter().copied())).collect()
    }

    /// For dense output, the changes between the ends left out.
    pub fn dense(method: &Tableau, weights: &DenseWeights) -> Self {
        Self::new(method, weights.slots.into_iter().enumerate())
    }

    fn new(method: &Tableau, weights: impl Iterator<Item = (usize, f64)>) -> Self {
        let mut all = [Share::default(); SLOTS];
        let (mut start, mut end) = (0.0, 0.0);
        for (j, weight) in weights.filter(|(_, weight)| *weight != 0.0) {
            all[j].velocity += weight;
            if j == method.end {
                end += weight;
                continue;
            }
            start += weight;
            method.stages[j].iter().for_each(|&(l, inner)| all[l].position += weight * inner);
        }
        let (mut slots, mut count) = (all, 0);
        for (slot, share) in all.into_iter().enumerate() {
            if share.position != 0.0 || share.velocity != 0.0 {
                slots[count] = Share { slot, ..share };
                count += 1;
            }
        }
        Self { start, end, slots, count }
    }

    /// What each acceleration contributes.
    pub fn shares(&self) -> &[Share] {
        &self.slots[..self.count]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrators::explicit::dop853::DOP853;
    use crate::integrators::explicit::tableau::DOPRI5;

    /// x(t) = t³ from rest: its accelerations 6 t are integrated exactly where the order allows.
    #[test]
    fn a_cubic_is_met_at_the_end_and_inside() {
        for method in [&DOPRI5, &DOP853] {
            let table = Nystrom::table(method);
            let sum = |w: &Nystrom, of: fn(&Share) -> f64| -> f64 {
                w.shares().iter().map(|share| of(share) * 6.0 * method.nodes[share.slot]).sum()
            };
            let end = &table[method.end];
            assert!((sum(end, |s| s.position) - 1.0).abs() < 1e-13, "{}", method.name);
            assert!((sum(end, |s| s.velocity) - 3.0).abs() < 1e-13, "{}", method.name);
            assert!((end.start - 1.0).abs() < 1e-13 && end.end == 0.0);
            let weights = method.dense_weights(0.3);
            let inside = Nystrom::dense(method, &weights);
            let found = weights.change + 3.0 * inside.end + sum(&inside, |s| s.position);
            assert!((found - 0.027).abs() < 1e-13, "{}: {found}", method.name);
        }
    }
}
