//! Named outputs of a mechanism at one state, and its energy.

use crate::elements::element::{ElementState, ElementWorkspace};
use crate::mechanism::scalars::StateScalar;
use crate::mechanism::{AnyFormula, FormulaIn, MeasuredQuantity, Mechanism};
use crate::system::state::{State, evaluate, gather, measure};

/// Evaluates the named outputs of a mechanism, with one evaluation of every element that they refer to.
#[derive(Clone, Debug)]
pub struct Sampler<T> {
    /// Elements with referenced measures, and the index of their first measure in `measured`.
    elements: Vec<(usize, usize)>,
    /// Index of the first measure of every element in `measured`.
    first_measure: Vec<usize>,
    measured: Vec<T>,
    /// Prescribed coordinates whose driving forces are outputs, with the elements and rows that contribute to them.
    driving_forces: Vec<(usize, Vec<(usize, usize)>)>,
    energy: bool,
    terms: Vec<T>,
    workspace: ElementWorkspace<T>,
    /// The first output whose formula was not finite, and why.
    pub(crate) undefined: Option<(usize, String)>,
}

impl<T: StateScalar> Sampler<T> {
    /// Sampler of the outputs of `mechanism`.
    pub fn new(mechanism: &Mechanism<T>) -> Self {
        let mut first_measure = vec![usize::MAX; mechanism.elements.len()];
        let (mut elements, mut count, mut driving_forces, mut energy) = (Vec::new(), 0, Vec::new(), false);
        for term in mechanism.outputs.iter().flat_map(|output| &output.terms) {
            match term.source {
                MeasuredQuantity::Measure { element, .. } if first_measure[element] == usize::MAX => {
                    first_measure[element] = count;
                    elements.push((element, count));
                    count += mechanism.elements[element].element.measures().len();
                }
                MeasuredQuantity::Measure { .. } => {}
                MeasuredQuantity::DrivingForce { coordinate } => {
                    driving_forces.push((coordinate, rows_of(mechanism, coordinate)));
                }
                MeasuredQuantity::KineticEnergy | MeasuredQuantity::PotentialEnergy => energy = true,
            }
        }
        let measured = vec![T::from(0.0); count];
        let (terms, workspace) = (Vec::new(), ElementWorkspace::default());
        Self { elements, first_measure, measured, driving_forces, energy, terms, workspace, undefined: None }
    }

    /// Writes the outputs at `state` to `out`, in the order of the mechanism's outputs.
    pub fn outputs(&mut self, mechanism: &Mechanism<T>, state: &State<T>, out: &mut Vec<T>) {
        self.measure(mechanism, state);
        let [kinetic, potential] = if self.energy { energy(mechanism, state) } else { [T::from(0.0); 2] };
        let mut driving_forces = self.driving_forces.iter();
        out.clear();
        for output in &mechanism.outputs {
            self.terms.clear();
            for term in &output.terms {
                let quantity = match term.source {
                    MeasuredQuantity::Measure { element, measure } => {
                        self.measured[self.first_measure[element] + measure]
                    }
                    MeasuredQuantity::KineticEnergy => kinetic,
                    MeasuredQuantity::PotentialEnergy => potential,
                    MeasuredQuantity::DrivingForce { .. } => {
                        let (_, rows) = driving_forces.next().expect("one for each output of this kind");
                        generalized_force(mechanism, state, rows, &mut self.workspace)
                    }
                };
                self.terms.push(quantity * term.weight);
            }
            let value = match &output.formula {
                Some(formula) => T::formula(formula.as_ref(), state.t, &self.terms),
                None => self.terms.iter().copied().sum(),
            };
            if let (false, Some(formula), None) = (value.value().is_finite(), &output.formula, &self.undefined) {
                let terms: Vec<f64> = self.terms.iter().map(|term| term.value()).collect();
                let why = <dyn AnyFormula as FormulaIn<f64>>::undefined(formula.as_ref(), state.t.value(), &terms);
                self.undefined = why.map(|why| (out.len(), why));
            }
            out.push(value);
        }
    }

    /// Evaluates the measures of all elements that outputs refer to.
    fn measure(&mut self, mechanism: &Mechanism<T>, state: &State<T>) {
        self.measured.fill(T::from(0.0));
        for &(index, first) in &self.elements {
            let instance = &mechanism.elements[index];
            let count = instance.element.measures().len();
            measure(instance, state, &mut self.workspace, &mut self.measured[first..first + count]);
        }
    }
}

/// Elements that act on a coordinate, with their local rows of it.
fn rows_of<T>(mechanism: &Mechanism<T>, coordinate: usize) -> Vec<(usize, usize)> {
    let rows = mechanism.elements.iter().enumerate().filter(|(_, instance)| !instance.element.is_sensor());
    let rows = rows.flat_map(|(k, instance)| instance.coordinates.iter().enumerate().map(move |(row, &c)| (k, row, c)));
    rows.filter(|&(_, _, c)| c == coordinate).map(|(k, row, _)| (k, row)).collect()
}

/// Inertia minus force of all elements on a coordinate: the force or torque of its drive in N or N·m.
fn generalized_force<T: StateScalar>(
    mechanism: &Mechanism<T>,
    state: &State<T>,
    rows: &[(usize, usize)],
    workspace: &mut ElementWorkspace<T>,
) -> T {
    let share = |&(element, row): &(usize, usize)| {
        evaluate(&mechanism.elements[element], state, workspace);
        workspace.dynamics[row]
    };
    rows.iter().map(share).sum()
}

/// Kinetic and potential energy of the mechanism in J.
pub fn energy<T: StateScalar>(mechanism: &Mechanism<T>, state: &State<T>) -> [T; 2] {
    energy_in(mechanism, state, &mut ElementWorkspace::default())
}

/// [`energy`] with a workspace.
pub(crate) fn energy_in<T: StateScalar>(
    mechanism: &Mechanism<T>,
    state: &State<T>,
    workspace: &mut ElementWorkspace<T>,
) -> [T; 2] {
    let mut total = [T::from(0.0); 2];
    for instance in mechanism.elements.iter().filter(|instance| state.modes.is_active(instance)) {
        gather(instance, state, workspace);
        let local = ElementState { p: &instance.parameters, ..workspace.local(state.t) };
        let energy = T::energy(instance.element.as_ref(), &local);
        total[0] += energy.kinetic;
        total[1] += energy.potential;
    }
    total
}
