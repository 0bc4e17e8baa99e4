//! An element's rows, weighted and differentiated with respect to its own variables.

use crate::derivatives::adjoint::adjoint_state::{BATCH, BatchValues};
use crate::elements::element::ElementState;
use crate::elements::element::ElementWorkspace;
use crate::mechanism::ElementInstance;
use crate::mechanism::scalars::{Dual8, ElementScalar};
use crate::system::state::State;
use autodiff::WIDTH;

/// A variable of an element, by its local number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slot {
    Position(usize),
    Velocity(usize),
    Acceleration(usize),
    Multiplier(usize),
    Parameter(usize),
}

/// What is weighted.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Rows {
    /// Rows of the coordinates, then those of the multipliers.
    Residual,
    /// The element's outputs.
    Measures,
    /// Kinetic and potential energy.
    Energy,
}

/// Reusable room for evaluating elements with [`WIDTH`] of their variables seeded.
#[derive(Default)]
pub(crate) struct Probe {
    workspace: ElementWorkspace<Dual8>,
    rows: Vec<Dual8>,
}

impl Probe {
    /// Hands over Σ weight · ∂row/∂slot for every slot, for one set of weights (one per row) after the other.
    pub fn vjp<'w>(
        &mut self,
        part: &ElementInstance<f64>,
        state: &State<f64>,
        slots: &[Slot],
        what: Rows,
        weights: impl Iterator<Item = &'w [BatchValues]> + Clone,
        mut give: impl FnMut(usize, Slot, BatchValues),
    ) {
        self.load(part, state);
        for chunk in slots.chunks(WIDTH) {
            self.seed(chunk, 1.0);
            self.evaluate(part, what, state.t);
            self.seed(chunk, 0.0);
            for (set, weights) in weights.clone().enumerate() {
                let mut sums = [[0.0; BATCH]; WIDTH];
                for (row, weight) in self.rows.iter().zip(weights) {
                    for (sum, slope) in sums.iter_mut().zip(row.eps) {
                        sum.iter_mut().zip(weight).for_each(|(sum, weight)| *sum += slope * weight);
                    }
                }
                chunk.iter().zip(sums).for_each(|(&slot, sum)| give(set, slot, sum));
            }
        }
    }

    /// The rows themselves.
    pub fn values(
        &mut self,
        part: &ElementInstance<f64>,
        state: &State<f64>,
        what: Rows,
    ) -> impl Iterator<Item = f64> + '_ {
        self.load(part, state);
        self.evaluate(part, what, state.t);
        self.rows.iter().map(|row| row.re)
    }

    fn load(&mut self, part: &ElementInstance<f64>, state: &State<f64>) {
        let multipliers = &state.l[part.first_multiplier..part.first_multiplier + part.num_constraints];
        for (to, from) in [(&mut self.workspace.p, &part.parameters[..]), (&mut self.workspace.l, multipliers)] {
            to.clear();
            to.extend(from.iter().map(|&x| Dual8::constant(x)));
        }
        for (to, from) in
            [(&mut self.workspace.q, &state.q), (&mut self.workspace.v, &state.v), (&mut self.workspace.a, &state.a)]
        {
            to.clear();
            to.extend(part.coordinates.iter().map(|&i| Dual8::constant(from[i])));
        }
    }

    fn seed(&mut self, slots: &[Slot], value: f64) {
        for (k, slot) in slots.iter().enumerate() {
            let variable = match *slot {
                Slot::Position(i) => &mut self.workspace.q[i],
                Slot::Velocity(i) => &mut self.workspace.v[i],
                Slot::Acceleration(i) => &mut self.workspace.a[i],
                Slot::Multiplier(i) => &mut self.workspace.l[i],
                Slot::Parameter(i) => &mut self.workspace.p[i],
            };
            variable.eps[k] = value;
        }
    }

    fn evaluate(&mut self, part: &ElementInstance<f64>, what: Rows, t: f64) {
        let (element, t) = (part.element.as_ref(), Dual8::constant(t));
        self.rows.clear();
        match what {
            Rows::Residual => {
                Dual8::residual(element, t, &mut self.workspace);
                self.rows.extend(self.workspace.dynamics.iter().chain(&self.workspace.constraint));
            }
            Rows::Measures => {
                self.rows.resize(element.measures().len(), Dual8::constant(0.0));
                let local: ElementState<'_, Dual8> = self.workspace.local(t);
                Dual8::measure(element, &local, &mut self.rows);
            }
            Rows::Energy => {
                let energy = Dual8::energy(element, &self.workspace.local(t));
                self.rows.extend([energy.kinetic, energy.potential]);
            }
        }
    }
}

/// All variables of an element.
pub(crate) fn all_slots(part: &ElementInstance<f64>) -> Vec<Slot> {
    let n = part.coordinates.len();
    let coordinates = [Slot::Position, Slot::Velocity, Slot::Acceleration].map(|slot| (0..n).map(slot));
    let rest = (0..part.num_constraints).map(Slot::Multiplier).chain((0..part.parameters.len()).map(Slot::Parameter));
    coordinates.into_iter().flatten().chain(rest).collect()
}
