//! The matrix and its rows, element by element.

use crate::elements::element::ElementState;
use crate::elements::element::{ElementWorkspace, JacobianWorkspace};
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::linearization::Linearization;
use crate::system::residual::gather;
use crate::system::state::State;
use nalgebra::DMatrix;

impl System {
    /// Assembles the residual rows into `rows` and the matrix into the factor (not yet factorized).
    pub fn assemble(
        &mut self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        how: Linearization,
        rows: &mut [[f64; 1]],
    ) {
        rows.fill([0.0]);
        self.begin_matrix(how);
        for (part, place) in mechanism.parts.iter().zip(&self.places) {
            let constraint = part.num_constraints > 0;
            if place.active.is_empty() || (how.projection && !constraint) {
                continue;
            }
            gather(part, state, &mut self.workspace);
            let (width, n) = (place.varying.len() + 1, part.coordinates.len());
            let size = (n + part.num_constraints) * width;
            if self.columns.len() < size {
                self.columns.resize(size, 0.0);
            }
            let columns = &mut self.columns[..size];
            let tangent_weights = if constraint { how.constraint_weights } else { how.dynamics_weights };
            let local = ElementState { p: &part.parameters, ..self.workspace.local(state.t) };
            part.element.columns(&local, tangent_weights, &place.varying, &mut self.jacobian_workspace, columns);
            for (&r, &equation) in place.active.iter().zip(&place.equations) {
                rows[equation][0] += columns[r * width] * if r < n { 1.0 } else { how.constraint_scale };
            }
            let entries = self.factor.entries_mut();
            for &(from, slot) in &place.dynamics {
                entries[slot] += columns[from];
            }
            for &(from, [slot, mirrored]) in &place.constraint {
                entries[slot] += columns[from] * how.constraint_scale;
                entries[mirrored] += columns[from] / tangent_weights.position;
            }
        }
    }

    /// What is in the matrix whatever the state is.
    fn begin_matrix(&mut self, how: Linearization) {
        let entries = self.factor.entries_mut();
        entries.fill(0.0);
        if how.projection {
            self.free_diagonal.iter().for_each(|&slot| entries[slot] = 1.0);
        } else {
            let tangent_weights = how.dynamics_weights;
            for &(slot, [stiffness, damping, mass]) in &self.constants.dynamics {
                entries[slot] += stiffness * tangent_weights.position
                    + damping * tangent_weights.velocity
                    + mass * tangent_weights.acceleration;
            }
        }
        for &([slot, mirrored], gradient) in &self.constants.constraint {
            entries[slot] += gradient * how.constraint_scale * how.constraint_weights.position;
            entries[mirrored] += gradient;
        }
    }

    /// Rows of Φ_q with respect to all coordinates, zero for prescribed ones; one row per multiplier.
    pub fn closure_gradients(&self, mechanism: &Mechanism<f64>, state: &State<f64>) -> Vec<Vec<f64>> {
        let (mut jacobian_workspace, mut workspace, mut columns) =
            (JacobianWorkspace::default(), ElementWorkspace::default(), Vec::new());
        let mut gradients = vec![vec![0.0; mechanism.coordinates.len()]; mechanism.multipliers];
        for (part, place) in mechanism.parts.iter().zip(&self.places).filter(|(part, _)| part.num_constraints > 0) {
            gather(part, state, &mut workspace);
            let (width, n) = (place.active.len() + 1, part.coordinates.len());
            columns.resize((n + part.num_constraints) * width, 0.0);
            let local = ElementState { p: &part.parameters, ..workspace.local(state.t) };
            part.element.columns(
                &local,
                Linearization::statics().constraint_weights,
                &place.active,
                &mut jacobian_workspace,
                &mut columns,
            );
            for k in 0..part.num_constraints {
                let row = &columns[(n + k) * width + 1..(n + k + 1) * width];
                for (&local, &value) in place.active.iter().zip(row).filter(|(local, _)| **local < n) {
                    gradients[part.first_multiplier + k][part.coordinates[local]] += value;
                }
            }
        }
        gradients
    }

    /// The assembled matrix, dense: only before it is factorized.
    pub fn dense(&mut self) -> DMatrix<f64> {
        let n = self.size();
        let mut dense = DMatrix::zeros(n, n);
        for (i, row) in self.pattern.iter().enumerate() {
            for &j in row {
                let slot = self.factor.slot(i, j);
                dense[(i, j)] = self.factor.entries_mut()[slot];
            }
        }
        dense
    }

    /// The matrix again, by seeding every unknown of every element and using nothing that elements declare of themselves:
    /// slow, for checks.
    pub fn dense_by_seeding(&self, mechanism: &Mechanism<f64>, state: &State<f64>, how: Linearization) -> DMatrix<f64> {
        let (mut jacobian_workspace, mut workspace, mut columns) =
            (JacobianWorkspace::default(), ElementWorkspace::default(), Vec::new());
        let mut dense = DMatrix::zeros(self.size(), self.size());
        for (part, place) in mechanism.parts.iter().zip(&self.places) {
            gather(part, state, &mut workspace);
            let (width, n) = (place.active.len() + 1, part.coordinates.len());
            columns.resize((n + part.num_constraints) * width, 0.0);
            let local = ElementState { p: &part.parameters, ..workspace.local(state.t) };
            let tangent_weights = if part.num_constraints > 0 { how.constraint_weights } else { how.dynamics_weights };
            part.element.columns(&local, tangent_weights, &place.active, &mut jacobian_workspace, &mut columns);
            for (&r, &i) in place.active.iter().zip(&place.equations) {
                for (&j, value) in place.equations.iter().zip(&columns[r * width + 1..]) {
                    dense[(i, j)] += value * if r < n { 1.0 } else { how.constraint_scale };
                }
            }
        }
        dense
    }
}
