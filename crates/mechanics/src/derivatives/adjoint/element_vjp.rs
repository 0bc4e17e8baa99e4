//! Vector-Jacobian products of one element: weighted rows, differentiated with respect to the element's variables.

use crate::derivatives::adjoint::adjoint_state::{BATCH, BatchValues};
use crate::elements::element::{ElementState, ElementWorkspace};
use crate::mechanism::ElementInstance;
use crate::mechanism::scalars::{Dual8, ElementScalar, StateScalar};
use crate::system::state::{State, clear_loads};
use autodiff::WIDTH;

/// A variable of an element, by its local number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ElementVariable {
    Position(usize),
    Velocity(usize),
    Acceleration(usize),
    Multiplier(usize),
    Parameter(usize),
}

/// The rows that are weighted.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ElementRows {
    /// The residual: rows of the coordinates, then those of the multipliers.
    Residual,
    /// The element's measures.
    Measures,
    /// Kinetic and potential energy.
    Energy,
}

/// Evaluates elements with [`WIDTH`] of their variables seeded at a time.
#[derive(Default)]
pub(crate) struct ElementVjp {
    workspace: ElementWorkspace<Dual8>,
    rows: Vec<Dual8>,
    /// True if the element is inactive: an event has deactivated it, or will activate it later.
    is_inactive: bool,
}

impl ElementVjp {
    /// Calls `add` with Σ weight · ∂row/∂variable for each of the `variables` and each set of weights (one per row).
    pub fn evaluate<'w>(
        &mut self,
        instance: &ElementInstance<f64>,
        state: &State<f64>,
        variables: &[ElementVariable],
        rows: ElementRows,
        weights: impl Iterator<Item = &'w [BatchValues]> + Clone,
        mut add: impl FnMut(usize, ElementVariable, BatchValues),
    ) {
        self.load(instance, state);
        for chunk in variables.chunks(WIDTH) {
            self.seed(chunk, 1.0);
            self.evaluate_rows(instance, rows, state.t);
            self.seed(chunk, 0.0);
            for (set, weights) in weights.clone().enumerate() {
                let mut sums = [[0.0; BATCH]; WIDTH];
                for (row, weight) in self.rows.iter().zip(weights) {
                    for (sum, derivative) in sums.iter_mut().zip(row.eps) {
                        sum.iter_mut().zip(weight).for_each(|(sum, weight)| *sum += derivative * weight);
                    }
                }
                chunk.iter().zip(sums).for_each(|(&variable, sum)| add(set, variable, sum));
            }
        }
    }

    /// The values of the rows.
    pub fn values(
        &mut self,
        instance: &ElementInstance<f64>,
        state: &State<f64>,
        rows: ElementRows,
    ) -> impl Iterator<Item = f64> + '_ {
        self.load(instance, state);
        self.evaluate_rows(instance, rows, state.t);
        self.rows.iter().map(|row| row.re)
    }

    fn load(&mut self, instance: &ElementInstance<f64>, state: &State<f64>) {
        self.is_inactive = !state.modes.is_active(instance);
        self.workspace.sides = state.modes.sides_of(instance);
        let multipliers = &state.l[instance.multipliers()];
        for (to, from) in [(&mut self.workspace.p, &instance.parameters[..]), (&mut self.workspace.l, multipliers)] {
            to.clear();
            to.extend(from.iter().map(|&x| Dual8::constant(x)));
        }
        for (to, from) in
            [(&mut self.workspace.q, &state.q), (&mut self.workspace.v, &state.v), (&mut self.workspace.a, &state.a)]
        {
            to.clear();
            to.extend(instance.coordinates.iter().map(|&i| Dual8::constant(from[i])));
        }
    }

    fn seed(&mut self, variables: &[ElementVariable], value: f64) {
        for (k, variable) in variables.iter().enumerate() {
            let variable = match *variable {
                ElementVariable::Position(i) => &mut self.workspace.q[i],
                ElementVariable::Velocity(i) => &mut self.workspace.v[i],
                ElementVariable::Acceleration(i) => &mut self.workspace.a[i],
                ElementVariable::Multiplier(i) => &mut self.workspace.l[i],
                ElementVariable::Parameter(i) => &mut self.workspace.p[i],
            };
            variable.eps[k] = value;
        }
    }

    fn evaluate_rows(&mut self, instance: &ElementInstance<f64>, rows: ElementRows, t: f64) {
        let (element, t) = (instance.element.as_ref(), Dual8::constant(t));
        self.rows.clear();
        match rows {
            ElementRows::Residual => {
                Dual8::residual(element, t, &mut self.workspace);
                let ElementWorkspace { dynamics, constraint, l, .. } = &mut self.workspace;
                if self.is_inactive {
                    dynamics.fill(Dual8::constant(0.0));
                    constraint.copy_from_slice(l);
                }
                self.rows.extend(dynamics.iter().chain(constraint.iter()));
            }
            ElementRows::Measures => {
                self.rows.resize(element.measures().len(), Dual8::constant(0.0));
                let local: ElementState<'_, Dual8> = self.workspace.local(t);
                Dual8::measure(element, &local, &mut self.rows);
                if self.is_inactive {
                    clear_loads(element, &mut self.rows);
                }
            }
            ElementRows::Energy if self.is_inactive => self.rows.extend([Dual8::constant(0.0); 2]),
            ElementRows::Energy => {
                let energy = Dual8::energy(element, &self.workspace.local(t));
                self.rows.extend([energy.kinetic, energy.potential]);
            }
        }
    }
}

/// All variables of an element.
pub(crate) fn all_variables(instance: &ElementInstance<f64>) -> Vec<ElementVariable> {
    let n = instance.coordinates.len();
    let coordinates = [ElementVariable::Position, ElementVariable::Velocity, ElementVariable::Acceleration]
        .map(|variable| (0..n).map(variable));
    let rest = (0..instance.multipliers().len())
        .map(ElementVariable::Multiplier)
        .chain((0..instance.parameters.len()).map(ElementVariable::Parameter));
    coordinates.into_iter().flatten().chain(rest).collect()
}
