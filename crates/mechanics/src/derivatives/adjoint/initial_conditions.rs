//! The transposes of what puts a mechanism in a consistent state: positions, velocities, accelerations.

use crate::Result;
use crate::analyses::dynamics::InitialConfiguration;
use crate::derivatives::activity::Dependence;
use crate::derivatives::adjoint::adjoint_state::{AdjointState, BATCH, BatchValues};
use crate::derivatives::adjoint::batch::{AdjointBatch, ElementProducts};
use crate::derivatives::forward::explicit::entries::Entries;
use crate::derivatives::forward::explicit::linearize::{ConstraintDerivative, ElementWorkspaces, Linearizer};
use crate::derivatives::forward::initial_conditions::at_rest;
use crate::initial_conditions::Projection;
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::Unknown;
use crate::system::linearization::Linearization;
use crate::system::state::State;

/// From the derivatives by a consistent state back to those by what it was made from.
///
/// Positions, velocities and accelerations are had from
///
/// $$ \begin{aligned} q - q_b + \Phi_q^T\mu &= 0, & \Phi &= 0 \\ v - v_b + \Phi_q^T\nu &= 0, & \dot\Phi &= 0 \\
///    M\ddot q + \Phi_q^T\lambda - f &= 0, & \ddot\Phi &= 0 \end{aligned} $$
///
/// where q_b and v_b are those that the mechanism was built with. With the transposed matrices ψ of the last comes first:
/// it adds to the derivatives by velocities and positions, ψ of the velocities to those by positions.
pub(crate) struct InitialConditionAdjoint<'m> {
    mechanism: &'m Mechanism<f64>,
    dependence: &'m Dependence,
    linearizer: Linearizer,
    entries: Entries,
    workspaces: ElementWorkspaces,
    unknowns: Vec<Unknown>,
    rows: Vec<[f64; 1]>,
    /// By each variable of the entries.
    sources: Vec<BatchValues>,
    at: State<f64>,
}

impl<'m> InitialConditionAdjoint<'m> {
    /// For `mechanism` with the equations `system`.
    pub fn new(mechanism: &'m Mechanism<f64>, dependence: &'m Dependence, system: &System) -> Self {
        let linearizer = Linearizer::new(mechanism, dependence, system);
        Self {
            entries: linearizer.entries(),
            sources: vec![[0.0; BATCH]; linearizer.sources()],
            linearizer,
            workspaces: ElementWorkspaces::default(),
            unknowns: system.unknowns().to_vec(),
            rows: vec![[0.0]; system.size()],
            at: State::built(mechanism, 0.0),
            mechanism,
            dependence,
        }
    }

    /// All the way back from the consistent state `values`; accelerations are left out unless they were `solved`. What the
    /// lanes then have are derivatives by the positions (if they were assembled from these) and velocities
    /// that free coordinates were built with.
    pub fn back(
        &mut self,
        system: &mut System,
        values: &State<f64>,
        projection: &Projection,
        solved: bool,
        origin: InitialConfiguration,
        batches: &mut [&mut AdjointBatch],
    ) -> Result<()> {
        if solved {
            self.accelerations(system, values, batches)?;
        }
        if self.mechanism.multipliers > 0 {
            self.velocities(system, values, projection, batches)?;
        }
        match origin {
            InitialConfiguration::Equilibrium(_) => self.equilibrium(system, values, projection, batches)?,
            InitialConfiguration::Built if self.mechanism.multipliers > 0 => {
                self.positions(system, values, projection, batches)?
            }
            InitialConfiguration::Built => {}
        }
        for batch in batches {
            batch.take_motions(self.mechanism, self.dependence, values.t);
        }
        Ok(())
    }

    fn accelerations(
        &mut self,
        system: &mut System,
        values: &State<f64>,
        batches: &mut [&mut AdjointBatch],
    ) -> Result<()> {
        self.at.copy_from(values);
        self.at.l.fill(0.0);
        self.factorize(system, Linearization::accelerations())?;
        self.linearizer.accelerations(self.mechanism, values, &mut self.workspaces, &mut self.entries);
        for batch in batches {
            batch.solve_accelerations(&self.unknowns, system.factor());
            batch.vjp(&self.entries, &self.linearizer, &mut self.sources);
        }
        Ok(())
    }

    fn velocities(
        &mut self,
        system: &mut System,
        values: &State<f64>,
        projection: &Projection,
        batches: &mut [&mut AdjointBatch],
    ) -> Result<()> {
        self.at.copy_from(values);
        self.at.l.fill(0.0);
        self.factorize(system, Linearization::projection())?;
        self.at.l.copy_from_slice(&projection.velocity);
        self.num_constraints(ConstraintDerivative::Rates);
        for batch in batches {
            self.project(system, batch, |bars| &mut bars.v);
        }
        Ok(())
    }

    fn positions(
        &mut self,
        system: &mut System,
        values: &State<f64>,
        projection: &Projection,
        batches: &mut [&mut AdjointBatch],
    ) -> Result<()> {
        self.at.copy_from(values);
        self.at.a.fill(0.0);
        self.at.l.copy_from_slice(&projection.position);
        self.factorize(system, Linearization::projection())?;
        self.num_constraints(ConstraintDerivative::Positions);
        for batch in batches {
            self.project(system, batch, |bars| &mut bars.q);
        }
        Ok(())
    }

    /// From positions in equilibrium: what free coordinates were built with does not matter.
    fn equilibrium(
        &mut self,
        system: &mut System,
        values: &State<f64>,
        projection: &Projection,
        batches: &mut [&mut AdjointBatch],
    ) -> Result<()> {
        self.at.copy_from(&at_rest(values, projection));
        self.factorize(system, Linearization::statics())?;
        for batch in batches.iter_mut() {
            let positions = batch.now.q.clone();
            batch.solve_free(&self.unknowns, system.factor(), &positions);
            for unknown in &self.unknowns {
                if let Unknown::Coordinate(i) = *unknown {
                    batch.now.q[i] = [0.0; BATCH];
                }
            }
        }
        ElementProducts::at_rest(self.mechanism, self.dependence, system, batches.len()).vjp(
            self.mechanism,
            system,
            &self.at,
            1.0,
            batches,
        );
        Ok(())
    }

    fn factorize(&mut self, system: &mut System, how: Linearization) -> Result<()> {
        system.assemble(self.mechanism, &self.at, how, &mut self.rows);
        system.factorize(self.mechanism, self.at.t)
    }

    fn num_constraints(&mut self, constraint: ConstraintDerivative) {
        self.entries.clear();
        self.linearizer.num_constraints(self.mechanism, &self.at, constraint, &mut self.workspaces, &mut self.entries);
    }

    /// From what was projected to the nearest that the constraints allow, to what it was before.
    fn project(
        &mut self,
        system: &mut System,
        batch: &mut AdjointBatch,
        which: impl Fn(&mut AdjointState) -> &mut Vec<BatchValues>,
    ) {
        let projected = std::mem::take(which(&mut batch.now));
        batch.solve_free(&self.unknowns, system.factor(), &projected);
        *which(&mut batch.now) = projected;
        batch.vjp(&self.entries, &self.linearizer, &mut self.sources);
        for (psi, unknown) in batch.multipliers.iter().zip(system.unknowns()) {
            if let Unknown::Coordinate(i) = *unknown {
                which(&mut batch.now)[i] = psi.map(|x| -x);
            }
        }
    }
}
