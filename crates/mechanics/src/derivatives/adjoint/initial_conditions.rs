//! Transposes of assembly, consistent velocities and accelerations, and of an initial equilibrium.

use crate::Result;
use crate::analyses::dynamics::InitialConfiguration;
use crate::checkpointing::recording::ExplicitRecording;
use crate::derivatives::adjoint::adjoint_state::{AdjointState, BATCH, BatchValues, add};
use crate::derivatives::adjoint::batch::{AdjointBatch, SystemVjp};
use crate::derivatives::adjoint::problem::AdjointProblem;
use crate::derivatives::forward::explicit::constraint::ConstraintDerivative;
use crate::derivatives::forward::explicit::entries::Entries;
use crate::derivatives::forward::explicit::linearize::{ElementWorkspaces, Linearizer};
use crate::derivatives::forward::initial_conditions::{
    ProjectedPart, factorize_accelerations, factorize_initial_equilibrium,
};
use crate::derivatives::seeding::Activity;
use crate::elements::element::ElementWorkspace;
use crate::initial_conditions::Projection;
use crate::initial_velocities::{VelocityMatrix, VelocityProjection, sticking_coordinates};
use crate::mechanism::Mechanism;
use crate::system::modes::Modes;
use crate::system::state::State;
use crate::system::{System, Unknown};
use nalgebra::DMatrix;

/// Gradients from the adjoint states at the start of explicit steps, through the initial conditions.
pub(super) fn gradients_from_start(
    problem: &AdjointProblem<'_>,
    recording: &ExplicitRecording,
    mut batches: Vec<&mut AdjointBatch>,
) -> Result<DMatrix<f64>> {
    let (mut system, begin) = (recording.system.clone(), &recording.start);
    InitialConditionAdjoint::new(&problem.mechanism, &problem.activity, &system, &begin.state.modes).start(
        &mut system,
        &begin.state,
        &begin.projection,
        InitialConfiguration::Built,
        &mut batches,
    )?;
    Ok(problem.gradients(batches.iter().map(|batch| &**batch)))
}

/// Propagates derivatives from a consistent state back to the configuration in which the mechanism was built.
///
/// Positions, velocities and accelerations solve
///
/// $$ \begin{aligned} q - q_b + \Phi_q^T\mu &= 0, & \Phi &= 0 \\ M v + \Phi_q^T\nu - E p &= 0, & \dot\Phi &= 0, \; E^T(v - v_b) = 0 \\
///    M\ddot q + \Phi_q^T\lambda - f &= 0, & \ddot\Phi &= 0 \end{aligned} $$
///
/// where q_b and v_b are those in which the mechanism was built, and E the coordinates with given velocities that are held. If these
/// contradict the constraints, M v − E p is M (v − v_b). The transposed problems are solved in reverse order: ψ of the accelerations
/// contributes to the derivatives with respect to velocities and positions, ψ of the velocities to those with respect to positions.
pub(crate) struct InitialConditionAdjoint<'m> {
    mechanism: &'m Mechanism<f64>,
    activity: &'m Activity,
    linearizer: Linearizer,
    entries: Entries,
    workspaces: ElementWorkspaces,
    unknowns: Vec<Unknown>,
    /// Workspace: derivatives with respect to each source of the entries.
    sources: Vec<BatchValues>,
}

impl<'m> InitialConditionAdjoint<'m> {
    /// Adjoint of the initial conditions of `mechanism`, with the equations `system` and the initial `modes`.
    pub fn new(mechanism: &'m Mechanism<f64>, activity: &'m Activity, system: &System, modes: &Modes) -> Self {
        let linearizer = Linearizer::new(mechanism, activity, system, modes);
        Self {
            entries: linearizer.entries(),
            sources: vec![[0.0; BATCH]; linearizer.sources()],
            linearizer,
            workspaces: ElementWorkspaces::default(),
            unknowns: system.unknowns().to_vec(),
            mechanism,
            activity,
        }
    }

    /// Propagates from the positions and velocities of `values` to those in which free coordinates were built, and to the
    /// motions of prescribed ones. Initial positions in equilibrium do not depend on those in which they were built.
    pub fn start(
        &mut self,
        system: &mut System,
        values: &State<f64>,
        projection: &Projection,
        initial_configuration: InitialConfiguration,
        batches: &mut [&mut AdjointBatch],
    ) -> Result<()> {
        let has_constraints = self.mechanism.multipliers > 0;
        if has_constraints {
            self.stopped_velocities(system, values, batches)?;
            self.velocities(system, values, projection, batches)?;
        }
        match initial_configuration {
            InitialConfiguration::Equilibrium(_) => self.equilibrium(system, values, projection, batches)?,
            InitialConfiguration::Built if has_constraints => {
                self.project(ProjectedPart::Positions, system, values, projection, batches)?
            }
            InitialConfiguration::Built => {}
        }
        for batch in batches {
            batch.take_motions(self.mechanism, self.activity, values.t);
        }
        Ok(())
    }

    /// Propagates from accelerations and multipliers to positions and velocities.
    pub fn accelerations(
        &mut self,
        system: &mut System,
        values: &State<f64>,
        batches: &mut [&mut AdjointBatch],
    ) -> Result<()> {
        factorize_accelerations(system, self.mechanism, values)?;
        self.linearizer.accelerations(self.mechanism, values, &mut self.workspaces, &mut self.entries);
        for batch in batches {
            batch.solve_accelerations(&self.unknowns, system.factor());
            batch.add_vjp(&self.entries, &self.linearizer, &mut self.sources);
        }
        Ok(())
    }

    /// Propagates from velocities v₀ = v + `change` (v − v_c) to v, where v_c are the consistent velocities nearest to v, in `consistent`.
    pub fn rescaled_velocities(
        &mut self,
        system: &mut System,
        (consistent, projection): (&State<f64>, &Projection),
        change: f64,
        batches: &mut [&mut AdjointBatch],
    ) -> Result<()> {
        let rescaled: Vec<Vec<BatchValues>> = batches.iter().map(|batch| batch.state.v.clone()).collect();
        for batch in batches.iter_mut() {
            let velocities = &mut batch.state.v;
            velocities.iter_mut().for_each(|v| *v = v.map(|x| -change * x));
            self.prescribed().for_each(|i| velocities[i] = [0.0; BATCH]);
        }
        self.project(ProjectedPart::Velocities, system, consistent, projection, batches)?;
        for (batch, rescaled) in batches.iter_mut().zip(rescaled) {
            let mut factors = vec![1.0 + change; rescaled.len()];
            self.prescribed().for_each(|i| factors[i] = 1.0);
            for ((v, rescaled), factor) in batch.state.v.iter_mut().zip(&rescaled).zip(factors) {
                add(v, factor, rescaled);
            }
        }
        Ok(())
    }

    /// The prescribed coordinates.
    fn prescribed(&self) -> impl Iterator<Item = usize> + use<'_, 'm> {
        let coordinates = self.mechanism.coordinates.iter().enumerate();
        coordinates.filter(|(_, coordinate)| coordinate.motion.is_some()).map(|(i, _)| i)
    }

    /// Propagates from the velocities after the impulse of friction that sticks to those before it, see [`sticking_coordinates`].
    fn stopped_velocities(
        &mut self,
        system: &mut System,
        values: &State<f64>,
        batches: &mut [&mut AdjointBatch],
    ) -> Result<()> {
        let held = sticking_coordinates(self.mechanism, &values.modes);
        if held.is_empty() {
            return Ok(());
        }
        let matrix = VelocityMatrix::new(system, self.mechanism, values, &held)?;
        for batch in batches {
            let by_equation = |unknown: &Unknown| match *unknown {
                Unknown::Coordinate(i) => batch.state.v[i],
                Unknown::Multiplier(_) => [0.0; BATCH],
            };
            let velocities: Vec<BatchValues> = self.unknowns.iter().map(by_equation).collect();
            for (&i, rate) in held.iter().zip(matrix.stop_transposed(&velocities)) {
                add(&mut batch.state.v[i], 1.0, &rate);
            }
        }
        Ok(())
    }

    /// Propagates from consistent velocities to the given ones.
    fn velocities(
        &mut self,
        system: &mut System,
        values: &State<f64>,
        projection: &Projection,
        batches: &mut [&mut AdjointBatch],
    ) -> Result<()> {
        if !projection.nearest_velocity.is_empty() {
            return self.project(ProjectedPart::Velocities, system, values, projection, batches);
        }
        let velocity = &projection.velocity;
        let VelocityProjection { multipliers, held, is_nearest } = velocity;
        let matrix = VelocityMatrix::new(system, self.mechanism, values, held)?;
        let at = State { l: multipliers.clone(), ..values.clone() };
        let derivative = ConstraintDerivative::Rates;
        self.linearizer.constraints(self.mechanism, &at, derivative, &mut self.workspaces, &mut self.entries);
        let mut momenta = State { v: vec![0.0; values.v.len()], a: vec![0.0; values.a.len()], ..at };
        let deviations = velocity.deviations(self.mechanism, &values.v);
        for unknown in &self.unknowns {
            if let Unknown::Coordinate(i) = *unknown {
                momenta.a[i] = deviations[i];
            }
        }
        self.linearizer.momenta(self.mechanism, &momenta, &mut self.workspaces, &mut self.entries);
        let mut by_given = Vec::new();
        for batch in batches {
            let AdjointBatch { state, multipliers, .. } = &mut **batch;
            for (psi, unknown) in multipliers.iter_mut().zip(&self.unknowns) {
                *psi = match *unknown {
                    Unknown::Coordinate(i) => state.v[i].map(|x| -x),
                    Unknown::Multiplier(_) => [0.0; BATCH],
                };
            }
            matrix.solve_transposed(system, multipliers, &mut by_given);
            batch.add_vjp(&self.entries, &self.linearizer, &mut self.sources);
            for unknown in &self.unknowns {
                if let Unknown::Coordinate(i) = *unknown {
                    batch.state.v[i] = [0.0; BATCH];
                }
            }
            held.iter().zip(&by_given).for_each(|(&i, pi)| batch.state.v[i] = pi.map(|x| -x));
            if *is_nearest {
                self.nearest_velocities(system, &matrix, values, batch);
            }
        }
        Ok(())
    }

    /// Derivatives with respect to given velocities that contradict the constraints: −M ψ.
    fn nearest_velocities(
        &self,
        system: &System,
        matrix: &VelocityMatrix,
        values: &State<f64>,
        batch: &mut AdjointBatch,
    ) {
        let (mut jets, mut rows) = (ElementWorkspace::default(), vec![0.0; system.size()]);
        for k in 0..BATCH {
            let mut velocities = vec![0.0; values.v.len()];
            for (psi, unknown) in batch.multipliers.iter().zip(&self.unknowns) {
                if let Unknown::Coordinate(i) = *unknown {
                    velocities[i] = psi[k];
                }
            }
            rows.fill(0.0);
            matrix.add_momenta(system, self.mechanism, (values, &velocities), &mut jets, &mut rows);
            for (row, unknown) in rows.iter().zip(&self.unknowns) {
                if let Unknown::Coordinate(i) = *unknown
                    && self.mechanism.coordinates[i].is_given
                {
                    batch.state.v[i][k] = -row;
                }
            }
        }
    }

    /// Propagates from projected positions or velocities to those before the projection.
    fn project(
        &mut self,
        part: ProjectedPart,
        system: &mut System,
        values: &State<f64>,
        projection: &Projection,
        batches: &mut [&mut AdjointBatch],
    ) -> Result<()> {
        part.factorize(system, self.mechanism, values, projection)?;
        let mut at = State { l: part.multipliers(projection).to_vec(), ..values.clone() };
        let derivative = match part {
            ProjectedPart::Positions => {
                at.a.fill(0.0);
                ConstraintDerivative::Positions
            }
            ProjectedPart::Velocities => ConstraintDerivative::Rates,
        };
        self.linearizer.constraints(self.mechanism, &at, derivative, &mut self.workspaces, &mut self.entries);
        for batch in batches {
            let projected = adjoint_of(part, &mut batch.state).clone();
            batch.solve_coordinates(&self.unknowns, system.factor(), &projected);
            batch.add_vjp(&self.entries, &self.linearizer, &mut self.sources);
            let AdjointBatch { state, multipliers, .. } = &mut **batch;
            for (psi, unknown) in multipliers.iter().zip(&self.unknowns) {
                if let Unknown::Coordinate(i) = *unknown {
                    let weight = part.weight(self.mechanism, &values.modes, i);
                    adjoint_of(part, state)[i] = psi.map(|x| -x * weight);
                }
            }
        }
        Ok(())
    }

    /// Propagates from positions in equilibrium to parameters and motions.
    fn equilibrium(
        &mut self,
        system: &mut System,
        values: &State<f64>,
        projection: &Projection,
        batches: &mut [&mut AdjointBatch],
    ) -> Result<()> {
        let rest = factorize_initial_equilibrium(system, self.mechanism, values, projection)?;
        for batch in batches.iter_mut() {
            let positions = batch.state.q.clone();
            batch.solve_coordinates(&self.unknowns, system.factor(), &positions);
            for unknown in &self.unknowns {
                if let Unknown::Coordinate(i) = *unknown {
                    batch.state.q[i] = [0.0; BATCH];
                }
            }
        }
        let mut vjp = SystemVjp::at_rest(self.mechanism, self.activity, system, batches.len());
        vjp.add(self.mechanism, system, &rest, 1.0, batches);
        Ok(())
    }
}

/// The derivatives with respect to the projected part of a state.
fn adjoint_of(part: ProjectedPart, state: &mut AdjointState) -> &mut Vec<BatchValues> {
    match part {
        ProjectedPart::Positions => &mut state.q,
        ProjectedPart::Velocities => &mut state.v,
    }
}
