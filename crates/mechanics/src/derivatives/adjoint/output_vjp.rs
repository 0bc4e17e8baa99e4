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
        for ElementShare { part: k, rows, row, count } in shares(mechanism, source) {
            let mut weights = vec![[0.0; BATCH]; count];
            weights[row] = *weight;
            let part = &mechanism.elements[k];
            let sets = std::iter::once(&weights[..]);
            vjp.evaluate(part, state, &all_variables(part), rows, sets, |_, variable, derivative| {
                self.add(k, part, variable, &derivative);
            });
        }
    }
}

/// One row of an element, which contributes to a quantity.
struct ElementShare {
    /// Number of the element.
    part: usize,
    rows: ElementRows,
    row: usize,
    /// Number of these rows.
    count: usize,
}

/// The rows of elements whose sum a quantity is.
fn shares(mechanism: &Mechanism<f64>, source: MeasuredQuantity) -> Vec<ElementShare> {
    let parts = || mechanism.elements.iter().enumerate();
    let energy =
        |row| parts().map(|(part, _)| ElementShare { part, rows: ElementRows::Energy, row, count: 2 }).collect();
    match source {
        MeasuredQuantity::Measure { element: part, measure } => {
            let count = mechanism.elements[part].element.measures().len();
            vec![ElementShare { part, rows: ElementRows::Measures, row: measure, count }]
        }
        MeasuredQuantity::DrivingForce { coordinate } => {
            let acting = parts().filter(|(_, part)| !part.element.is_sensor());
            let shares = acting.flat_map(|(k, part)| {
                let count = part.coordinates.len() + part.num_constraints;
                let rows = part.coordinates.iter().enumerate().filter(|(_, c)| **c == coordinate);
                rows.map(move |(row, _)| ElementShare { part: k, rows: ElementRows::Residual, row, count })
            });
            shares.collect()
        }
        MeasuredQuantity::KineticEnergy => energy(0),
        MeasuredQuantity::PotentialEnergy => energy(1),
    }
}

fn quantity(mechanism: &Mechanism<f64>, state: &State<f64>, source: MeasuredQuantity, vjp: &mut ElementVjp) -> f64 {
    let value = |ElementShare { part, rows, row, .. }| {
        vjp.values(&mechanism.elements[part], state, rows).nth(row).expect("every row is evaluated")
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
