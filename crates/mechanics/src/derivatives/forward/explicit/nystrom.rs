//! Derivatives of positions and velocities along an explicit step.

use crate::integrators::explicit::grading::Grading;
use crate::integrators::explicit::tableau::{DenseWeights, SLOTS, Tableau};
use crate::linalg::simd::Gradient;
use crate::linalg::simd::{Kernel, dispatch};

/// Weights of positions and velocities in terms of those at the ends of a step and of its accelerations.
///
/// An explicit Runge–Kutta method takes velocities as the rates of positions. Written with accelerations alone, no
/// velocity between the ends is stored:
///
/// $$ v_i = v_0 + h\sum_j a_{ij}\,\ddot q_j ,\qquad
///    q_i = q_0 + h\Big(\sum_{j\ne e} a_{ij}\Big) v_0 + h\,a_{ie} v_1 + h^2 \sum_l \sum_{j\ne e} a_{ij} a_{jl}\,\ddot q_l $$
///
/// where e is the end of the step, whose velocity v₁ is projected.
///
/// # Sources
/// Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, 2nd ed. (1993), Section II.14.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NystromWeights {
    /// Weight of h v₀ in a position.
    pub start: f64,
    /// Weight of h v₁ in a position.
    pub end: f64,
    slots: [SlotWeights; SLOTS],
    count: usize,
}

/// Weights of the acceleration of one slot.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SlotWeights {
    pub slot: usize,
    /// Weight of h² q̈ in a position.
    pub position: f64,
    /// Weight of h q̈ in a velocity.
    pub velocity: f64,
}

impl NystromWeights {
    /// Weights of the state at which each slot of `method` is evaluated in steps with a `grading`.
    pub fn table(method: &Tableau, grading: Grading) -> Vec<Self> {
        (0..method.slots()).map(|slot| Self::new(method, grading, method.row(slot, grading))).collect()
    }

    /// Weights of dense output, without the change between the ends.
    pub fn dense(method: &Tableau, grading: Grading, weights: &DenseWeights) -> Self {
        Self::new(method, grading, weights.slots.into_iter().enumerate())
    }

    fn new(method: &Tableau, grading: Grading, weights: impl Iterator<Item = (usize, f64)>) -> Self {
        let mut all = [SlotWeights::default(); SLOTS];
        let (mut start, mut end) = (0.0, 0.0);
        for (j, weight) in weights.filter(|(_, weight)| *weight != 0.0) {
            all[j].velocity += weight;
            if j == method.end {
                end += weight;
                continue;
            }
            start += weight;
            method.row(j, grading).for_each(|(l, inner)| all[l].position += weight * inner);
        }
        let (mut slots, mut count) = (all, 0);
        for (slot, weights) in all.into_iter().enumerate() {
            if weights.position != 0.0 || weights.velocity != 0.0 {
                slots[count] = SlotWeights { slot, ..weights };
                count += 1;
            }
        }
        Self { start, end, slots, count }
    }

    /// Weights of the accelerations, without those that are zero.
    pub fn slots(&self) -> &[SlotWeights] {
        &self.slots[..self.count]
    }
}

/// Derivatives of positions and velocities at the ends of a step, and of the accelerations in between.
pub(crate) struct StepDerivatives<const W: usize> {
    /// Beginning and end of the step in s.
    t: [f64; 2],
    ends: [EndDerivatives<W>; 2],
    /// Accelerations, slot by slot for each coordinate; those of prescribed ones stay zero.
    pub accelerations: Vec<Slots<W>>,
    started: bool,
}

/// One acceleration slot by slot; one unused slot avoids cache conflicts between coordinates.
type Slots<const W: usize> = [Gradient<W>; SLOTS + 1];

/// Derivatives at one end of a step.
#[derive(Clone)]
struct EndDerivatives<const W: usize> {
    q: Vec<Gradient<W>>,
    v: Vec<Gradient<W>>,
}

impl<const W: usize> EndDerivatives<W> {
    /// Writes all positions, then all velocities.
    fn write(&self, y: &mut [Gradient<W>]) {
        let (positions, velocities) = y.split_at_mut(self.q.len());
        positions.copy_from_slice(&self.q);
        velocities.copy_from_slice(&self.v);
    }
}

impl<const W: usize> StepDerivatives<W> {
    /// Derivatives at the time `t` (s), where all positions and then all velocities have the derivatives `start`.
    pub fn new(t: f64, start: &[Gradient<W>]) -> Self {
        let n = start.len() / 2;
        let end = EndDerivatives { q: start[..n].to_vec(), v: start[n..].to_vec() };
        let accelerations = vec![[[0.0; W]; SLOTS + 1]; n];
        Self { t: [t; 2], ends: [end.clone(), end], accelerations, started: false }
    }

    /// Begins the step of `method` from `t[0]` to `t[1]` at the end of the previous one.
    pub fn advance(&mut self, method: &Tableau, t: [f64; 2]) {
        if self.started {
            self.ends.swap(0, 1);
            self.accelerations.iter_mut().for_each(|slots| slots[0] = slots[method.end]);
        }
        (self.t, self.started) = (t, true);
    }

    /// Stores the derivatives at the end of the step: all positions, then all velocities.
    pub fn finish(&mut self, y: &[Gradient<W>]) {
        let EndDerivatives { q, v } = &mut self.ends[1];
        let (positions, velocities) = y.split_at(q.len());
        q.copy_from_slice(positions);
        v.copy_from_slice(velocities);
    }

    /// Writes the derivatives at the beginning of the step.
    pub fn begin(&self, y: &mut [Gradient<W>]) {
        self.ends[0].write(y);
    }

    /// Writes the derivatives at the end of the step.
    pub fn end(&self, y: &mut [Gradient<W>]) {
        self.ends[1].write(y);
    }

    /// Writes positions and velocities of the coordinates `which` with the weights of a slot.
    pub fn combine(&self, weights: &NystromWeights, which: impl Iterator<Item = usize>, y: &mut [Gradient<W>]) {
        let h = self.t[1] - self.t[0];
        self.sum(weights, h, which, y);
    }

    /// Writes all positions and velocities at the time `t` inside the step.
    pub fn interpolate(&self, method: &Tableau, grading: Grading, t: f64, y: &mut [Gradient<W>]) {
        let (h, n) = (self.t[1] - self.t[0], self.accelerations.len());
        let dense = method.graded_dense_weights((t - self.t[0]) / h, grading);
        self.sum(&NystromWeights::dense(method, grading, &dense), h, 0..n, y);
        let (positions, velocities) = y.split_at_mut(n);
        let [old, new] = &self.ends;
        for (y, old, new) in [(positions, &old.q, &new.q), (velocities, &old.v, &new.v)] {
            let changes = y.as_flattened_mut().iter_mut().zip(old.as_flattened()).zip(new.as_flattened());
            changes.for_each(|((y, old), new)| *y += dense.change * (new - old));
        }
    }

    fn sum(&self, weights: &NystromWeights, h: f64, which: impl Iterator<Item = usize>, y: &mut [Gradient<W>]) {
        dispatch(Sum { step: self, weights, h, which, y });
    }
}

/// Positions and velocities of some coordinates from those at the ends and from accelerations.
struct Sum<'a, I, const W: usize> {
    step: &'a StepDerivatives<W>,
    weights: &'a NystromWeights,
    h: f64,
    which: I,
    y: &'a mut [Gradient<W>],
}

impl<I: Iterator<Item = usize>, const W: usize> Kernel for Sum<'_, I, W> {
    #[inline(always)]
    fn run(self) {
        let Self { step, weights, h, which, y } = self;
        let [old, new] = &step.ends;
        let (start, end) = (h * weights.start, h * weights.end);
        let (positions, velocities) = y.split_at_mut(old.q.len());
        for i in which {
            let (mut q, mut v) = (old.q[i], old.v[i]);
            add(&mut q, start, &old.v[i]);
            if end != 0.0 {
                add(&mut q, end, &new.v[i]);
            }
            let slots = &step.accelerations[i];
            for slot in weights.slots() {
                add(&mut q, h * h * slot.position, &slots[slot.slot]);
                add(&mut v, h * slot.velocity, &slots[slot.slot]);
            }
            (positions[i], velocities[i]) = (q, v);
        }
    }
}

/// x += factor · y.
#[inline(always)]
fn add<const W: usize>(x: &mut Gradient<W>, factor: f64, y: &Gradient<W>) {
    for (x, y) in x.iter_mut().zip(y) {
        *x += factor * y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrators::explicit::dop853::DOP853;
    use crate::integrators::explicit::tableau::DOPRI5;

    /// x(t) = t³ from rest: its accelerations 6 t are integrated exactly where the order allows.
    #[test]
    fn a_cubic_is_exact_at_the_end_and_inside() {
        for method in [&DOPRI5, &DOP853] {
            let table = NystromWeights::table(method, Grading::Even);
            let sum = |w: &NystromWeights, of: fn(&SlotWeights) -> f64| -> f64 {
                w.slots().iter().map(|slot| of(slot) * 6.0 * method.nodes[slot.slot]).sum()
            };
            let end = &table[method.end];
            assert!((sum(end, |s| s.position) - 1.0).abs() < 1e-13, "{}", method.name);
            assert!((sum(end, |s| s.velocity) - 3.0).abs() < 1e-13, "{}", method.name);
            assert!((end.start - 1.0).abs() < 1e-13 && end.end == 0.0);
            let weights = method.dense_weights(0.3);
            let inside = NystromWeights::dense(method, Grading::Even, &weights);
            let computed = weights.change + 3.0 * inside.end + sum(&inside, |s| s.position);
            assert!((computed - 0.027).abs() < 1e-13, "{}: {computed}", method.name);
        }
    }
}
