//! The adjoint of analyses that solve each time point separately: equilibria, and kinematics with inverse dynamics.

use crate::Result;
use crate::analyses::dynamics::InitialConfiguration;
use crate::analyses::kinematics::KinematicDriver;
use crate::analyses::statics::Statics;
use crate::derivatives::adjoint::adjoint_state::BATCH;
use crate::derivatives::adjoint::batch::{AdjointBatch, SystemVjp};
use crate::derivatives::adjoint::element_vjp::ElementVjp;
use crate::derivatives::adjoint::initial_conditions::InitialConditionAdjoint;
use crate::derivatives::adjoint::problem::{AdjointFunctional, AdjointProblem};
use crate::derivatives::forward::instants::{factorize_equilibrium, for_each_driven_state, for_each_equilibrium};
use crate::initial_conditions::Assembly;
use crate::integrators::generalized_alpha::Prescribed;
use crate::mechanism::ParametricMechanism;
use crate::system::Unknown;
use crate::system::state::State;
use nalgebra::DMatrix;

/// Finds static equilibria of `model` at `times` (s), a load path, and differentiates `responses` of its outputs. Returns
/// the gradients, a row per response.
///
/// At an equilibrium F(x, p) = 0 of positions and multipliers x,
///
/// $$ \left(\frac{\partial F}{\partial x}\right)^{\!T}\psi = -\left(\frac{\partial J}{\partial x}\right)^{\!T},\qquad
///    \frac{dJ}{dp} = \frac{\partial J}{\partial p} + \psi^T\frac{\partial F}{\partial p} $$
///
/// with one factorization, and one transposed back-substitution for up to four responses at a time point. The result is
/// that of [`differentiate_equilibria`](crate::derivatives::forward::instants::differentiate_equilibria) up to rounding.
///
/// # Errors
/// As [`differentiate_equilibria`](crate::derivatives::forward::instants::differentiate_equilibria), and
/// [`Error::Definition`](crate::Error::Definition) if a response refers to a missing output or time point.
pub fn differentiate_equilibria_backwards<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Statics,
    times: &[f64],
    responses: &[AdjointFunctional],
) -> Result<DMatrix<f64>> {
    solve_equilibria(&AdjointProblem::build(model, b, times, responses)?, settings)
}

/// Solves kinematics and inverse dynamics of `model` at `times` (s) and differentiates `responses` of its outputs. Returns
/// the gradients, a row per response.
///
/// Each time point takes three transposed back-substitutions for up to four responses: of accelerations and multipliers,
/// of velocities, and of positions. The result is that of
/// [`differentiate_kinematics`](crate::derivatives::forward::instants::differentiate_kinematics) up to rounding.
///
/// # Errors
/// As [`differentiate_kinematics`](crate::derivatives::forward::instants::differentiate_kinematics), and
/// [`Error::Definition`](crate::Error::Definition) if a response refers to a missing output or time point.
pub fn differentiate_kinematics_backwards<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    assembly: Assembly,
    times: &[f64],
    responses: &[AdjointFunctional],
) -> Result<DMatrix<f64>> {
    solve_kinematics(&AdjointProblem::build(model, b, times, responses)?, assembly)
}

// The functions below are not generic over the model: they are compiled once, in this crate.

fn solve_equilibria(problem: &AdjointProblem<'_>, settings: &Statics) -> Result<DMatrix<f64>> {
    let AdjointProblem { mechanism, activity, .. } = problem;
    let (mut batches, mut vjp) = (Vec::new(), None);
    for_each_equilibrium(mechanism, settings, problem.times, |k, system, state| {
        let vjp = vjp.get_or_insert_with(|| SystemVjp::at_rest(mechanism, activity, system, problem.batches()));
        batches.resize_with(problem.batches(), || AdjointBatch::new(mechanism, system.size()));
        factorize_equilibrium(system, mechanism, state)?;
        let mut batches = add_outputs(problem, k, state, &mut batches, &mut vjp.element);
        for batch in &mut batches {
            batch.solve(system, |adjoint, unknown| match unknown {
                Unknown::Coordinate(i) => adjoint.q[i],
                Unknown::Multiplier(m) => adjoint.l[m],
            });
        }
        vjp.add(mechanism, system, state, 1.0, &mut batches);
        let zeros = [0.0; BATCH];
        for batch in batches {
            for i in activity.moving_coordinates() {
                let adjoints = [&batch.state.q[i], &zeros, &zeros];
                batch.design.add_motion(mechanism, i, state.t, Prescribed::Exact, adjoints);
            }
            batch.state.clear(); // an equilibrium does not depend on its initial guess
        }
        Ok(())
    })?;
    Ok(problem.gradients(&batches))
}

fn solve_kinematics(problem: &AdjointProblem<'_>, assembly: Assembly) -> Result<DMatrix<f64>> {
    let AdjointProblem { mechanism, activity, .. } = problem;
    let (mut batches, mut vjp, mut initial) = (Vec::new(), ElementVjp::default(), None);
    for_each_driven_state(mechanism, assembly, problem.times, |k, driver| {
        let KinematicDriver { state, projection, system, .. } = driver;
        let initial =
            initial.get_or_insert_with(|| InitialConditionAdjoint::new(mechanism, activity, system, &state.modes));
        batches.resize_with(problem.batches(), || AdjointBatch::new(mechanism, system.size()));
        let mut batches = add_outputs(problem, k, state, &mut batches, &mut vjp);
        if !batches.is_empty() {
            initial.accelerations(system, state, &mut batches)?;
            initial.start(system, state, projection, InitialConfiguration::Built, &mut batches)?;
        }
        // The state of a driven mechanism does not depend on its initial guess.
        batches.into_iter().for_each(|batch| batch.state.clear());
        Ok(())
    })?;
    Ok(problem.gradients(&batches))
}

/// Adds the derivatives of the outputs at time number `k`. Returns the batches whose responses they enter.
fn add_outputs<'b>(
    problem: &AdjointProblem<'_>,
    k: usize,
    state: &State<f64>,
    batches: &'b mut [AdjointBatch],
    vjp: &mut ElementVjp,
) -> Vec<&'b mut AdjointBatch> {
    let terms = &problem.terms[k];
    terms.iter().for_each(|term| batches[term.batch].add_output(&problem.mechanism, state, term, vjp));
    let is_used = |batch: usize| terms.iter().any(|term| term.batch == batch);
    batches.iter_mut().enumerate().filter(|(batch, _)| is_used(*batch)).map(|(_, batch)| batch).collect()
}
