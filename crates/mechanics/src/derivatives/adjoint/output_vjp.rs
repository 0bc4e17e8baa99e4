//! The outputs of a state, differentiated with respect to the state, parameters and weights.

use crate::derivatives::adjoint::adjoint_state::{AdjointState, BATCH, BatchValues, add};
use crate::derivatives::adjoint::design::DesignAdjoint;
use crate::derivatives::adjoint::element_vjp::{Probe, Rows, Slot, all_slots};
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{Dual8, StateScalar};
use crate::mechanism::{MeasuredQuantity, OutputData};
use crate::system::state::State;
use autodiff::WIDTH;

/// What one output's derivatives are added to.
pub(crate) struct OutputVjp<'b> {
    /// By the state.
    pub bars: &'b mut AdjointState,
    /// By parameters and weights.
    pub design: &'b mut DesignAdjoint,
}

impl OutputVjp<'_> {
    /// Adds the derivatives of output number `output` at `state`, times `weight` in each response.
    pub fn output(
        &mut self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        output: usize,
        weight: &BatchValues,
        probe: &mut Probe,
    ) {
        let data = &mechanism.outputs[output];
        let quantities: Vec<f64> =
            data.terms.iter().map(|term| quantity(mechanism, state, term.source, probe)).collect();
        for (k, slope) in slopes(data, state.t, &quantities).into_iter().enumerate() {
            let term = &data.terms[k];
            add(&mut self.design.weights[output][k], slope * quantities[k], weight);
            let weight = weight.map(|weight| weight * slope * term.weight);
            self.source(mechanism, state, term.source, &weight, probe);
        }
    }

    fn source(
        &mut self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        source: MeasuredQuantity,
        weight: &BatchValues,
        probe: &mut Probe,
    ) {
        for (part, what, row, count) in shares(mechanism, source) {
            let mut weights = vec![[0.0; BATCH]; count];
            weights[row] = *weight;
            let data = &mechanism.parts[part];
            let sets = std::iter::once(&weights[..]);
            probe.vjp(data, state, &all_slots(data), what, sets, |_, slot, bar| {
                let to = match slot {
                    Slot::Position(i) => &mut self.bars.q[data.coordinates[i]],
                    Slot::Velocity(i) => &mut self.bars.v[data.coordinates[i]],
                    Slot::Acceleration(i) => &mut self.bars.a[data.coordinates[i]],
                    Slot::Multiplier(i) => &mut self.bars.l[data.first_multiplier + i],
                    Slot::Parameter(i) => &mut self.design.parameters[part][i],
                };
                add(to, 1.0, &bar);
            });
        }
    }
}

/// The elements that a quantity is the sum of: number, what of it, which row of how many.
fn shares(mechanism: &Mechanism<f64>, source: MeasuredQuantity) -> Vec<(usize, Rows, usize, usize)> {
    let parts = || mechanism.parts.iter().enumerate();
    match source {
        MeasuredQuantity::Measure { part, measure } => {
            vec![(part, Rows::Measures, measure, mechanism.parts[part].element.measures().len())]
        }
        MeasuredQuantity::Effort { coordinate } => {
            let acting = parts().filter(|(_, part)| !part.element.is_sensor());
            let rows = acting.flat_map(|(k, part)| {
                let count = part.coordinates.len() + part.num_constraints;
                part.coordinates.iter().enumerate().map(move |(row, &c)| (k, row, count, c))
            });
            rows.filter(|row| row.3 == coordinate).map(|(k, row, count, _)| (k, Rows::Residual, row, count)).collect()
        }
        MeasuredQuantity::KineticEnergy => parts().map(|(k, _)| (k, Rows::Energy, 0, 2)).collect(),
        MeasuredQuantity::PotentialEnergy => parts().map(|(k, _)| (k, Rows::Energy, 1, 2)).collect(),
    }
}

fn quantity(mechanism: &Mechanism<f64>, state: &State<f64>, source: MeasuredQuantity, probe: &mut Probe) -> f64 {
    let share = |(part, what, row, _): (usize, Rows, usize, usize)| {
        probe.values(&mechanism.parts[part], state, what).nth(row).expect("every row is evaluated")
    };
    shares(mechanism, source).into_iter().map(share).sum()
}

/// Derivatives of an output with respect to its weighted terms.
fn slopes(output: &OutputData<f64>, t: f64, quantities: &[f64]) -> Vec<f64> {
    let Some(formula) = &output.formula else { return vec![1.0; quantities.len()] };
    let weighted: Vec<f64> = output.terms.iter().zip(quantities).map(|(term, x)| term.weight * x).collect();
    let chunk = |first: usize| {
        let seed = |(k, &x): (usize, &f64)| match k.checked_sub(first) {
            Some(k) if k < WIDTH => Dual8::seeded(x, k),
            _ => Dual8::constant(x),
        };
        let seeded: Vec<_> = weighted.iter().enumerate().map(seed).collect();
        Dual8::formula(formula.as_ref(), Dual8::constant(t), &seeded).eps
    };
    let all = (0..weighted.len()).step_by(WIDTH).flat_map(chunk);
    all.take(weighted.len()).collect()
}
