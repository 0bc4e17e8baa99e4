//! Derivatives with respect to what the design enters through, and from there with respect to the design.

use super::bars::{Bars, LANES, Lanes, add};
use super::local::Slot;
use crate::analysis::State;
use crate::analysis::generalized_alpha::Prescribed;
use crate::multibody::{Mechanism, Real, Sensitive};
use crate::scalar::WIDTH;
use nalgebra::DMatrix;

/// Which parameters of elements and motions depend on the design at all.
pub(super) struct Dependence {
    /// Of each element, the local numbers.
    pub parameters: Vec<Vec<usize>>,
    /// Whether a coordinate is prescribed by a motion that depends on the design.
    pub motions: Vec<bool>,
}

impl Dependence {
    /// Of mechanisms whose design variables are seeded, a chunk each.
    pub fn of(chunks: &[Mechanism<Sensitive>], mechanism: &Mechanism<f64>) -> Self {
        let depends = |x: &Sensitive| x.eps.iter().any(|slope| *slope != 0.0);
        let parameter = |part: usize, k: usize| chunks.iter().any(|c| depends(&c.parts[part].parameters[k]));
        let parameters =
            |part: usize| (0..mechanism.parts[part].parameters.len()).filter(|&k| parameter(part, k)).collect();
        let moves = |c: &Mechanism<Sensitive>, i: usize| {
            c.coordinates[i].motion.as_ref().is_some_and(|(_, parameters)| parameters.iter().any(depends))
        };
        Self {
            parameters: (0..mechanism.parts.len()).map(parameters).collect(),
            motions: (0..mechanism.coordinates.len()).map(|i| chunks.iter().any(|c| moves(c, i))).collect(),
        }
    }

    /// The variables of each element that a derivative has to be handed on to.
    pub fn slots(&self, mechanism: &Mechanism<f64>) -> Vec<Vec<Slot>> {
        let parts = mechanism.parts.iter().enumerate().filter(|(_, part)| !part.element.is_sensor());
        let mut slots = vec![Vec::new(); mechanism.parts.len()];
        for (k, part) in parts {
            let counts = |i: &usize| self.motions[*i] || mechanism.coordinates[*i].motion.is_none();
            let moving = || part.coordinates.iter().enumerate().filter(|(_, i)| counts(i)).map(|(local, _)| local);
            let driven = part.coordinates.iter().enumerate().filter(|(_, i)| self.motions[**i]).map(|(local, _)| local);
            // What a constraint adds is λ Φ_q(q): velocities and accelerations are not in it.
            if part.closures == 0 {
                slots[k].extend(driven.map(Slot::Acceleration).chain(moving().map(Slot::Velocity)));
            }
            slots[k].extend(moving().map(Slot::Position));
            slots[k].extend(self.parameters[k].iter().map(|&p| Slot::Parameter(p)));
        }
        slots
    }
}

/// The derivatives of responses with respect to parameters, summed up over a motion.
#[derive(Clone, Debug)]
pub(super) struct DesignBars {
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
        let motion = |c: &crate::multibody::mechanism::CoordinateData<f64>| {
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
                let position = crate::multibody::Number::position(motion.as_ref(), &seeded, Sensitive::constant(t));
                [position, Sensitive::constant(0.0), Sensitive::constant(0.0)]
            }
        };
        for (value, bar) in moves.iter().zip(bars) {
            self.motions[i].iter_mut().zip(value.eps).for_each(|(to, slope)| add(to, slope, bar));
        }
    }

    /// Rows of the responses' derivatives with respect to the design variables from `first` on, of which `chunk` is seeded
    /// and `start` is the initial state.
    pub fn contract(
        &self,
        chunk: &Mechanism<Sensitive>,
        start: &State<Sensitive>,
        bars: &Bars,
        rows: &mut DMatrix<f64>,
        [row, first]: [usize; 2],
    ) {
        let parameters =
            chunk.parts.iter().zip(&self.parameters).flat_map(|(part, bars)| part.parameters.iter().zip(bars));
        let motion = |c: &'_ crate::multibody::mechanism::CoordinateData<Sensitive>| {
            c.motion.as_ref().map_or(Vec::new(), |(_, parameters)| parameters.clone())
        };
        let motions: Vec<_> = chunk.coordinates.iter().map(motion).collect();
        let motions = motions.iter().zip(&self.motions).flat_map(|(parameters, bars)| parameters.iter().zip(bars));
        let weights = chunk.outputs.iter().zip(&self.weights);
        let weights = weights.flat_map(|(output, bars)| output.terms.iter().map(|term| &term.weight).zip(bars));
        let state =
            [(&start.q, &bars.q), (&start.v, &bars.v), (&start.a, &bars.a), (&start.a, &bars.w), (&start.l, &bars.l)];
        let state = state.into_iter().flat_map(|(values, bars)| values.iter().zip(bars));
        let mut sums = [[0.0; LANES]; WIDTH];
        for (value, bar) in parameters.chain(motions).chain(weights).chain(state) {
            sums.iter_mut().zip(value.eps).for_each(|(sum, slope)| add(sum, slope, bar));
        }
        for lane in 0..LANES.min(rows.nrows() - row) {
            for k in 0..WIDTH.min(rows.ncols() - first) {
                rows[(row + lane, first + k)] += sums[k][lane];
            }
        }
    }
}
