//! Vector-Jacobian products of the outputs, with respect to the state, parameters and weights.

use crate::derivatives::adjoint::adjoint_state::{BATCH, BatchValues, add};
use crate::derivatives::adjoint::batch::AdjointBatch;
use crate::derivatives::adjoint::element_vjp::{ElementRows, ElementVjp, all_variables};
use crate::derivatives::adjoint::problem::OutputTerm;
use crate::derivatives::seeding::seed_chunk;
use crate::mechanism::scalars::{Dual8, StateScalar};
use crate::mechanism::{MeasuredQuantity, Mechanism, OutputData};
use crate::system::state::State;
use autodiff::WIDTH;

impl AdjointBatch {
    /// Adds the derivatives of the output `term` at `state`, times its weights.
    pub fn add_output(
        &mut self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        term: &OutputTerm,
        vjp: &mut ElementVjp,
    ) {
        let output = &mechanism.outputs[term.output];
        let quantities: Vec<f64> =
            output.terms.iter().map(|term| quantity(mechanism, state, term.source, vjp)).collect();
        for (k, derivative) in term_derivatives(output, state.t, &quantities).into_iter().enumerate() {
            let OutputData { terms, .. } = output;
            add(&mut self.design.weights[term.output][k], derivative * quantities[k], &term.weight);
            let weight = term.weight.map(|weight| weight * derivative * terms[k].weight);
            self.add_quantity(mechanism, state, terms[k].source, &weight, vjp);
        }
    }

    fn add_quantity(
        &mut self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        source: MeasuredQuantity,
        weight: &BatchValues,
        vjp: &mut ElementVjp,
    ) {
        for ElementShare { element: k, rows, row, count } in shares(mechanism, source) {
            let mut weights = vec![[0.0; BATCH]; count];
            weights[row] = *weight;
            let instance = &mechanism.elements[k];
            let sets = std::iter::once(&weights[..]);
            vjp.evaluate(instance, state, &all_variables(instance), rows, sets, |_, variable, derivative| {
                self.add(k, instance, variable, &derivative);
            });
        }
    }
}

/// A row of an element that contributes to a quantity.
struct ElementShare {
    /// Number of the element.
    element: usize,
    rows: ElementRows,
    row: usize,
    /// Number of rows of this kind.
    count: usize,
}

/// Rows of elements whose sum is a quantity.
fn shares(mechanism: &Mechanism<f64>, source: MeasuredQuantity) -> Vec<ElementShare> {
    let instances = || mechanism.elements.iter().enumerate();
    let energy = |row| {
        instances().map(|(element, _)| ElementShare { element, rows: ElementRows::Energy, row, count: 2 }).collect()
    };
    match source {
        MeasuredQuantity::Measure { element, measure } => {
            let count = mechanism.elements[element].element.measures().len();
            vec![ElementShare { element, rows: ElementRows::Measures, row: measure, count }]
        }
        MeasuredQuantity::DrivingForce { coordinate } => {
            let acting = instances().filter(|(_, instance)| !instance.element.is_sensor());
            let shares = acting.flat_map(|(element, instance)| {
                let count = instance.coordinates.len() + instance.num_constraints;
                let rows = instance.coordinates.iter().enumerate().filter(|(_, c)| **c == coordinate);
                rows.map(move |(row, _)| ElementShare { element, rows: ElementRows::Residual, row, count })
            });
            shares.collect()
        }
        MeasuredQuantity::KineticEnergy => energy(0),
        MeasuredQuantity::PotentialEnergy => energy(1),
    }
}

fn quantity(mechanism: &Mechanism<f64>, state: &State<f64>, source: MeasuredQuantity, vjp: &mut ElementVjp) -> f64 {
    let value = |ElementShare { element, rows, row, .. }| {
        vjp.values(&mechanism.elements[element], state, rows).nth(row).expect("every row is evaluated")
    };
    shares(mechanism, source).into_iter().map(value).sum()
}

/// Derivatives of an output with respect to its weighted terms.
fn term_derivatives(output: &OutputData<f64>, t: f64, quantities: &[f64]) -> Vec<f64> {
    let Some(formula) = &output.formula else { return vec![1.0; quantities.len()] };
    let weighted: Vec<f64> = output.terms.iter().zip(quantities).map(|(term, x)| term.weight * x).collect();
    let chunk = |first: usize| {
        let seeded: Vec<Dual8> = seed_chunk(&weighted, first);
        Dual8::formula(formula.as_ref(), Dual8::constant(t), &seeded).eps
    };
    let all = (0..weighted.len()).step_by(WIDTH).flat_map(chunk);
    all.take(weighted.len()).collect()
}
