//! Derivatives of positions and velocities along a step.

use crate::derivatives::forward::explicit::Block;
use crate::derivatives::forward::explicit::nystrom::Nystrom;
use crate::integrators::explicit::tableau::{SLOTS, Tableau};
use crate::linalg::simd::{Kernel, dispatch};

/// Derivatives of positions and velocities at the ends of a step, and of the accelerations in between.
pub(crate) struct Steps<const W: usize> {
    /// Beginning and end of the step in s.
    t: [f64; 2],
    ends: [Ends<W>; 2],
    /// Accelerations, slot by slot for each coordinate; those of prescribed ones stay zero.
    pub accelerations: Vec<Slots<W>>,
    started: bool,
}

/// One acceleration slot by slot; one slot more than needed keeps those of many coordinates out of the same cache lines.
type Slots<const W: usize> = [Block<W>; SLOTS + 1];

/// Derivatives at one end of a step.
#[derive(Clone)]
struct Ends<const W: usize> {
    q: Vec<Block<W>>,
    v: Vec<Block<W>>,
}

impl<const W: usize> Steps<W> {
    /// At the time `t`, where positions and then velocities have the derivatives `start`.
    pub fn new(t: f64, start: &[Block<W>]) -> Self {
        let n = start.len() / 2;
        let end = Ends { q: start[..n].to_vec(), v: start[n..].to_vec() };
        let accelerations = vec![[[0.0; W]; SLOTS + 1]; n];
        Self { t: [t; 2], ends: [end.clone(), end], accelerations, started: false }
    }

    /// Goes on to the step from `t[0]` to `t[1]`, whose slots are those of `method`.
    pub fn advance(&mut self, method: &Tableau, t: [f64; 2]) {
        if self.started {
            self.ends.swap(0, 1);
            self.accelerations.iter_mut().for_each(|slots| slots[0] = slots[method.end]);
        }
        (self.t, self.started) = (t, true);
    }

    /// Keeps the derivatives at the end of the step: all positions, then all velocities.
    pub fn finish(&mut self, y: &[Block<W>]) {
        let Ends { q, v } = &mut self.ends[1];
        let (positions, velocities) = y.split_at(q.len());
        q.copy_from_slice(positions);
        v.copy_from_slice(velocities);
    }

    /// Derivatives at the end of the step.
    pub fn end(&self, y: &mut [Block<W>]) {
        let Ends { q, v } = &self.ends[1];
        let (positions, velocities) = y.split_at_mut(q.len());
        positions.copy_from_slice(q);
        velocities.copy_from_slice(v);
    }

    /// Writes positions and velocities of the coordinates `which` for the weights of a slot.
    pub fn combine(&self, weights: &Nystrom, which: impl Iterator<Item = usize>, y: &mut [Block<W>]) {
        let h = self.t[1] - self.t[0];
        self.sum(weights, h, which, y);
    }

    /// Writes all positions and velocities at the time `t` inside the step.
    pub fn interpolate(&self, method: &Tableau, t: f64, y: &mut [Block<W>]) {
        let (h, n) = (self.t[1] - self.t[0], self.accelerations.len());
        let dense = method.dense_weights((t - self.t[0]) / h);
        self.sum(&Nystrom::dense(method, &dense), h, 0..n, y);
        let (positions, velocities) = y.split_at_mut(n);
        let [old, new] = &self.ends;
        for (y, old, new) in [(positions, &old.q, &new.q), (velocities, &old.v, &new.v)] {
            let changes = y.as_flattened_mut().iter_mut().zip(old.as_flattened()).zip(new.as_flattened());
            changes.for_each(|((y, old), new)| *y += dense.change * (new - old));
        }
    }

    fn sum(&self, weights: &Nystrom, h: f64, which: impl Iterator<Item = usize>, y: &mut [Block<W>]) {
        dispatch(Sum { steps: self, weights, h, which, y });
    }
}

/// Positions and velocities of some coordinates from those at the ends and from accelerations.
struct Sum<'a, I, const W: usize> {
    steps: &'a Steps<W>,
    weights: &'a Nystrom,
    h: f64,
    which: I,
    y: &'a mut [Block<W>],
}

impl<I: Iterator<Item = usize>, const W: usize> Kernel for Sum<'_, I, W> {
    #[inline(always)]
    fn run(self) {
        let Self { steps, weights, h, which, y } = self;
        let [old, new] = &steps.ends;
        let (start, end) = (h * weights.start, h * weights.end);
        let (positions, velocities) = y.split_at_mut(old.q.len());
        for i in which {
            let (mut q, mut v) = (old.q[i], old.v[i]);
            add(&mut q, start, &old.v[i]);
            if end != 0.0 {
                add(&mut q, end, &new.v[i]);
            }
            let slots = &steps.accelerations[i];
            for share in weights.shares() {
                add(&mut q, h * h * share.position, &slots[share.slot]);
                add(&mut v, h * share.velocity, &slots[share.slot]);
            }
            (positions[i], velocities[i]) = (q, v);
        }
    }
}

/// x += factor · y.
#[inline(always)]
fn add<const W: usize>(x: &mut Block<W>, factor: f64, y: &Block<W>) {
    for (x, y) in x.iter_mut().zip(y) {
        *x += factor * y;
    }
}
