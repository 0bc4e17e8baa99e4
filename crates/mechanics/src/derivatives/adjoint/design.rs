//! Derivatives with respect to what the design enters through, and from there with respect to the design.

use crate::derivatives::adjoint::adjoint_state::{AdjointState, BATCH, BatchValues, add};
use crate::integrators::generalized_alpha::Prescribed;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{Dual8, StateScalar};
use autodiff::WIDTH;
use nalgebra::DMatrix;

/// The derivatives of responses with respect to parameters, summed up over a motion.
#[derive(Clone, Debug)]
pub(crate) struct DesignAdjoint {
    /// By each parameter of each element.
    pub parameters: Vec<Vec<BatchValues>>,
    /// By each parameter of each coordinate's motion.
    motions: Vec<Vec<BatchValues>>,
    /// By the weight of a term of an output.
    pub weights: Vec<Vec<BatchValues>>,
}

impl DesignAdjoint {
    /// Zeros.
    pub fn new(mechanism: &Mechanism<f64>) -> Self {
        let zeros = |count| vec![[0.0; BATCH]; count];
        let motion = |c: &crate::mechanism::CoordinateData<f64>| {
            zeros(c.motion.as_ref().map_or(0, |(_, parameters)| parameters.len()))
        };
        Self {
            parameters: mechanism.parts.iter().map(|part| zeros(part.parameters.len())).collect(),
            motions: mechanism.coordinates.iter().map(motion).collect(),
            weights: mechanism.outputs.iter().map(|output| zeros(output.terms.len())).collect(),
        }
    }

    /// Takes those by the prescribed position, velocity and acceleration of coordinate `i` at time `t`.
    pub fn take_motion(
        &mut self,
        mechanism: &Mechanism<f64>,
        i: usize,
        t: f64,
        how: Prescribed,
        bars: [&BatchValues; 3],
    ) {
        let Some((motion, parameters)) = &mechanism.coordinates[i].motion else { return };
        let seeded: Vec<_> = parameters.iter().enumerate().map(|(k, &p)| Dual8::seeded(p, k)).collect();
        let moves = match how {
            Prescribed::Exact => Dual8::motion(motion.as_ref(), &seeded, Dual8::constant(t)),
            Prescribed::Newmark => {
                let position =
                    crate::mechanism::scalars::ElementScalar::position(motion.as_ref(), &seeded, Dual8::constant(t));
                [position, Dual8::constant(0.0), Dual8::constant(0.0)]
            }
        };
        for (value, bar) in moves.iter().zip(bars) {
            self.motions[i].iter_mut().zip(value.eps).for_each(|(to, slope)| add(to, slope, bar));
        }
    }

    /// Rows of the responses' derivatives with respect to the design variables from `first` on, of which `chunk` is seeded;
    /// `bars` are the derivatives by the positions and velocities that free coordinates were built with.
    pub fn contract(
        &self,
        chunk: &Mechanism<Dual8>,
        bars: &AdjointState,
        rows: &mut DMatrix<f64>,
        [row, first]: [usize; 2],
    ) {
        let parameters =
            chunk.parts.iter().zip(&self.parameters).flat_map(|(part, bars)| part.parameters.iter().zip(bars));
        let coordinates = || chunk.coordinates.iter().enumerate();
        let driven = coordinates().filter_map(|(i, c)| c.motion.as_ref().map(|(_, parameters)| (i, parameters)));
        let motions = driven.flat_map(|(i, parameters)| parameters.iter().zip(&self.motions[i]));
        let weights = chunk.outputs.iter().zip(&self.weights);
        let weights = weights.flat_map(|(output, bars)| output.terms.iter().map(|term| &term.weight).zip(bars));
        let free = coordinates().filter(|(_, c)| c.motion.is_none());
        let built = free.flat_map(|(i, c)| [(&c.position, &bars.q[i]), (&c.velocity, &bars.v[i])]);
        let mut sums = [[0.0; BATCH]; WIDTH];
        for (value, bar) in parameters.chain(motions).chain(weights).chain(built) {
            sums.iter_mut().zip(value.eps).for_each(|(sum, slope)| add(sum, slope, bar));
        }
        for batch in 0..BATCH.min(rows.nrows() - row) {
            for k in 0..WIDTH.min(rows.ncols() - first) {
                rows[(row + batch, first + k)] += sums[k][batch];
            }
        }
    }
}
