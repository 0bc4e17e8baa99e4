//! Derivatives with respect to what the design enters through, and from there with respect to the design.

use crate::derivatives::adjoint::adjoint_state::{Bars, LANES, Lanes, add};
use crate::integrators::generalized_alpha::Prescribed;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{Real, Sensitive};
use autodiff::WIDTH;
use nalgebra::DMatrix;

/// The derivatives of responses with respect to parameters, summed up over a motion.
#[derive(Clone, Debug)]
pub(crate) struct DesignBars {
    /// By each parameter of each element.
    pub parameters: Vec<Vec<Lanes>>,
    /// By each parameter of each coordinate's motion.
    motions: Vec<Vec<Lanes>>,
    /// By the weight of a term of an output.
    pub weights: Vec<Vec<Lanes>>,
}

impl DesignBars {
    /// Zeros.
    pub fn new(mechanism: &Mechanism<f64>) -> Self {
        let zeros = |count| vec![[0.0; LANES]; count];
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
    pub fn take_motion(&mut self, mechanism: &Mechanism<f64>, i: usize, t: f64, how: Prescribed, bars: [&Lanes; 3]) {
        let Some((motion, parameters)) = &mechanism.coordinates[i].motion else { return };
        let seeded: Vec<_> = parameters.iter().enumerate().map(|(k, &p)| Sensitive::seeded(p, k)).collect();
        let moves = match how {
            Prescribed::Exact => Sensitive::motion(motion.as_ref(), &seeded, Sensitive::constant(t)),
            Prescribed::Newmark => {
                let position =
                    crate::mechanism::scalars::Number::position(motion.as_ref(), &seeded, Sensitive::constant(t));
                [position, Sensitive::constant(0.0), Sensitive::constant(0.0)]
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
        chunk: &Mechanism<Sensitive>,
        bars: &Bars,
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
        let mut sums = [[0.0; LANES]; WIDTH];
        for (value, bar) in parameters.chain(motions).chain(weights).chain(built) {
            sums.iter_mut().zip(value.eps).for_each(|(sum, slope)| add(sum, slope, bar));
        }
        for lane in 0..LANES.min(rows.nrows() - row) {
            for k in 0..WIDTH.min(rows.ncols() - first) {
                rows[(row + lane, first + k)] += sums[k][lane];
            }
        }
    }
}
