//! An element's rows, weighted and differentiated with respect to its own variables.

use crate::derivatives::adjoint::adjoint_state::{LANES, Lanes};
use crate::elements::element::Local;
use crate::elements::element::Room;
use crate::mechanism::PartData;
use crate::mechanism::scalars::{Number, Sensitive};
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
    room: Room<Sensitive>,
    rows: Vec<Sensitive>,
}

impl Probe {
    /// Hands over Σ weight · ∂row/∂slot for every slot, for one set of weights (one per row) after the other.
    pub fn pull<'w>(
        &mut self,
        part: &PartData<f64>,
        state: &State<f64>,
        slots: &[Slot],
        what: Rows,
        weights: impl Iterator<Item = &'w [Lanes]> + Clone,
        mut give: impl FnMut(usize, Slot, Lanes),
    ) {
        self.load(part, state);
        for chunk in slots.chunks(WIDTH) {
            self.seed(chunk, 1.0);
            self.evaluate(part, what, state.t);
            self.seed(chunk, 0.0);
            for (set, weights) in weights.clone().enumerate() {
                let mut sums = [[0.0; LANES]; WIDTH];
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
    pub fn values(&mut self, part: &PartData<f64>, state: &State<f64>, what: Rows) -> impl Iterator<Item = f64> + '_ {
        self.load(part, state);
        self.evaluate(part, what, state.t);
        self.rows.iter().map(|row| row.re)
    }

    fn load(&mut self, part: &PartData<f64>, state: &State<f64>) {
        let multipliers = &state.l[part.first_multiplier..part.first_multiplier + part.closures];
        for (to, from) in [(&mut self.room.p, &part.parameters[..]), (&mut self.room.l, multipliers)] {
            to.clear();
            to.extend(from.iter().map(|&x| Sensitive::constant(x)));
        }
        for (to, from) in [(&mut self.room.q, &state.q), (&mut self.room.v, &state.v), (&mut self.room.a, &state.a)] {
            to.clear();
            to.extend(part.coordinates.iter().map(|&i| Sensitive::constant(from[i])));
        }
    }

    fn seed(&mut self, slots: &[Slot], value: f64) {
        for (k, slot) in slots.iter().enumerate() {
            let variable = match *slot {
                Slot::Position(i) => &mut self.room.q[i],
                Slot::Velocity(i) => &mut self.room.v[i],
                Slot::Acceleration(i) => &mut self.room.a[i],
                Slot::Multiplier(i) => &mut self.room.l[i],
                Slot::Parameter(i) => &mut self.room.p[i],
            };
            variable.eps[k] = value;
        }
    }

    fn evaluate(&mut self, part: &PartData<f64>, what: Rows, t: f64) {
        let (element, t) = (part.element.as_ref(), Sensitive::constant(t));
        self.rows.clear();
        match what {
            Rows::Residual => {
                Sensitive::residual(element, t, &mut self.room);
                self.rows.extend(self.room.balance.iter().chain(&self.room.closure));
            }
            Rows::Measures => {
                self.rows.resize(element.measures().len(), Sensitive::constant(0.0));
                let local: Local<'_, Sensitive> = self.room.local(t);
                Sensitive::measure(element, &local, &mut self.rows);
            }
            Rows::Energy => {
                let energy = Sensitive::energy(element, &self.room.local(t));
                self.rows.extend([energy.kinetic, energy.potential]);
            }
        }
    }
}

/// All variables of an element.
pub(crate) fn all_slots(part: &PartData<f64>) -> Vec<Slot> {
    let n = part.coordinates.len();
    let coordinates = [Slot::Position, Slot::Velocity, Slot::Acceleration].map(|slot| (0..n).map(slot));
    let rest = (0..part.closures).map(Slot::Multiplier).chain((0..part.parameters.len()).map(Slot::Parameter));
    coordinates.into_iter().flatten().chain(rest).collect()
}
