//! The matrix and its rows, element by element.

use crate::elements::element::Local;
use crate::elements::element::{Room, Scratchpad};
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
            let constraint = part.closures > 0;
            if place.active.is_empty() || (how.projection && !constraint) {
                continue;
            }
            gather(part, state, &mut self.room);
            let (width, n) = (place.varying.len() + 1, part.coordinates.len());
            let size = (n + part.closures) * width;
            if self.columns.len() < size {
                self.columns.resize(size, 0.0);
            }
            let columns = &mut self.columns[..size];
            let seeds = if constraint { how.constraint } else { how.balance };
            let local = Local { p: &part.parameters, ..self.room.local(state.t) };
            part.element.columns(&local, seeds, &place.varying, &mut self.pad, columns);
            for (&r, &equation) in place.active.iter().zip(&place.equations) {
                rows[equation][0] += columns[r * width] * if r < n { 1.0 } else { how.closure };
            }
            let entries = self.factor.entries_mut();
            for &(from, slot) in &place.balance {
                entries[slot] += columns[from];
            }
            for &(from, [slot, mirrored]) in &place.closure {
                entries[slot] += columns[from] * how.closure;
                entries[mirrored] += columns[from] / seeds.position;
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
            let seeds = how.balance;
            for &(slot, [stiffness, damping, mass]) in &self.constants.balance {
                entries[slot] += stiffness * seeds.position + damping * seeds.velocity + mass * seeds.acceleration;
            }
        }
        for &([slot, mirrored], gradient) in &self.constants.closure {
            entries[slot] += gradient * how.closure * how.constraint.position;
            entries[mirrored] += gradient;
        }
    }

    /// Rows of Φ_q with respect to all coordinates, zero for prescribed ones; one row per multiplier.
    pub fn closure_gradients(&self, mechanism: &Mechanism<f64>, state: &State<f64>) -> Vec<Vec<f64>> {
        let (mut pad, mut room, mut columns) = (Scratchpad::default(), Room::default(), Vec::new());
        let mut gradients = vec![vec![0.0; mechanism.coordinates.len()]; mechanism.multipliers];
        for (part, place) in mechanism.parts.iter().zip(&self.places).filter(|(part, _)| part.closures > 0) {
            gather(part, state, &mut room);
            let (width, n) = (place.active.len() + 1, part.coordinates.len());
            columns.resize((n + part.closures) * width, 0.0);
            let local = Local { p: &part.parameters, ..room.local(state.t) };
            part.element.columns(&local, Linearization::statics().constraint, &place.active, &mut pad, &mut columns);
            for k in 0..part.closures {
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
        let (mut pad, mut room, mut columns) = (Scratchpad::default(), Room::default(), Vec::new());
        let mut dense = DMatrix::zeros(self.size(), self.size());
        for (part, place) in mechanism.parts.iter().zip(&self.places) {
            gather(part, state, &mut room);
            let (width, n) = (place.active.len() + 1, part.coordinates.len());
            columns.resize((n + part.closures) * width, 0.0);
            let local = Local { p: &part.parameters, ..room.local(state.t) };
            let seeds = if part.closures > 0 { how.constraint } else { how.balance };
            part.element.columns(&local, seeds, &place.active, &mut pad, &mut columns);
            for (&r, &i) in place.active.iter().zip(&place.equations) {
                for (&j, value) in place.equations.iter().zip(&columns[r * width + 1..]) {
                    dense[(i, j)] += value * if r < n { 1.0 } else { how.closure };
                }
            }
        }
        dense
    }
}
