//! Names the element or coordinate behind a singular, non-finite or diverging system.

use crate::constraint_rank::ConstraintRank;
use crate::elements::element::{ElementState, ElementWorkspace, JacobianWorkspace, TangentWeights};
use crate::mechanism::scalars::StateScalar;
use crate::mechanism::{ElementInstance, Mechanism};
use crate::system::state::{State, evaluate, gather};
use crate::system::{System, Unknown};
use crate::{Error, Result};
use error::Seconds;

/// Names the first prescribed motion, or else the first element, that is not finite at `state`; `None` if all are finite.
///
/// The error has the name, the time, and the explanation that the element itself gives.
pub fn not_finite(mechanism: &Mechanism<f64>, state: &State<f64>) -> Option<Error> {
    let t = state.t;
    if let Err(error) = check_motions(mechanism, state) {
        return Some(error);
    }
    let mut workspace = ElementWorkspace::default();
    mechanism.elements.iter().filter(|instance| !instance.element.is_sensor()).find_map(|instance| {
        let what = describe_non_finite(instance, state, &mut workspace)?;
        let why = format!("{what} at t = {t}", t = Seconds(t));
        Some(Error::analysis(
            &instance.name,
            why,
            "check the function that computes them, or bound the design away from this point; where the motion grows without limit, take shorter \
             steps",
        ))
    })
}

/// Describes what is not finite in an element; `None` if everything is finite.
fn describe_non_finite(
    instance: &ElementInstance<f64>,
    state: &State<f64>,
    workspace: &mut ElementWorkspace<f64>,
) -> Option<String> {
    evaluate(instance, state, workspace);
    let broken = |rows: &[f64]| rows.iter().any(|row| !row.is_finite());
    let what = match (broken(&workspace.dynamics), broken(&workspace.constraint)) {
        (_, true) => "its constraint is not finite",
        (true, _) => "its forces are not finite",
        _ if broken(&columns(instance, state, workspace)) => "the derivatives of its forces are not finite",
        _ => return None,
    };
    gather(instance, state, workspace);
    workspace.p.clone_from(&instance.parameters);
    let explanation = instance.element.diagnose_state(&workspace.local(state.t));
    Some(explanation.map_or(what.to_owned(), |why| format!("{what}: {why}")))
}

/// Residual of an element and its derivatives with respect to all variables of the element.
fn columns(instance: &ElementInstance<f64>, state: &State<f64>, workspace: &mut ElementWorkspace<f64>) -> Vec<f64> {
    gather(instance, state, workspace);
    workspace.p.clone_from(&instance.parameters);
    let active: Vec<usize> = (0..instance.coordinates.len() + instance.multipliers().len()).collect();
    let mut out = vec![0.0; active.len() * (active.len() + 1)];
    let weights = TangentWeights { position: 1.0, velocity: 1.0, acceleration: 1.0 };
    instance.element.columns(&workspace.local(state.t), weights, &active, &mut JacobianWorkspace::default(), &mut out);
    out
}

/// Name of the unknown with the largest residual in `rows`, and of the element with the largest share in it.
pub fn dominant_residual(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>, rows: &[[f64; 1]]) -> String {
    let name = system.dominant_residual(mechanism, rows);
    let Some(Unknown::Coordinate(i)) = system.dominant_unknown(rows) else { return name };
    let mut workspace = ElementWorkspace::default();
    let mut share = |instance: &ElementInstance<f64>| {
        let row = instance.coordinates.iter().position(|&c| c == i)?;
        evaluate(instance, state, &mut workspace);
        Some(workspace.dynamics[row].abs())
    };
    let instances = mechanism.elements.iter().filter(|instance| !instance.element.is_sensor());
    let shares = instances.filter_map(|instance| Some((share(instance)?, &instance.name)));
    let largest = shares.max_by(|a, b| a.0.total_cmp(&b.0));
    largest.map_or(name.clone(), |(_, element)| format!("{name}, mostly by {element}"))
}

/// Checks that the prescribed motions are finite.
fn check_motions(mechanism: &Mechanism<f64>, state: &State<f64>) -> Result<()> {
    let is_finite = |i: usize| [state.q[i], state.v[i], state.a[i]].iter().all(|x| x.is_finite());
    let broken = (0..state.q.len()).find(|&i| mechanism.coordinates[i].motion.is_some() && !is_finite(i));
    broken.map_or(Ok(()), |i| {
        let [q, v, a] = [state.q[i], state.v[i], state.a[i]];
        let why = format!("its prescribed motion is {q}, {v}, {a} at t = {}", Seconds(state.t));
        Err(Error::analysis(&mechanism.coordinates[i].name, why, "check the function that prescribes it"))
    })
}

/// Checks that prescribed motions and `outputs` are finite.
///
/// # Errors
///
/// [`Error::Analysis`] naming the motion, the element or the output that is not finite.
pub fn check(mechanism: &Mechanism<f64>, state: &State<f64>, outputs: &[f64]) -> Result<()> {
    check_motions(mechanism, state)?;
    let checked = check_finite(mechanism, outputs, state.t);
    checked.map_err(|error| not_finite(mechanism, state).unwrap_or(error))
}

/// Checks that the values of `outputs` at the time `t` (s) are finite.
pub(crate) fn check_finite<T: StateScalar>(mechanism: &Mechanism<T>, outputs: &[T], t: f64) -> Result<()> {
    outputs.iter().position(|value| !value.value().is_finite()).map_or(Ok(()), |k| {
        let why = format!("the output is {} at t = {t}", outputs[k].value(), t = Seconds(t));
        Err(Error::analysis(&mechanism.outputs[k].name, why, "check the element that it measures"))
    })
}

/// Checks that the constraints of an assembled mechanism are satisfied in the intended way.
///
/// # Errors
///
/// [`Error::Analysis`] naming the joint, with the explanation of
/// [`Element::diagnose_assembly`](crate::elements::Element::diagnose_assembly).
pub(crate) fn check_assembly(mechanism: &Mechanism<f64>, state: &State<f64>) -> Result<()> {
    let mut workspace = ElementWorkspace::default();
    let is_closed = |instance: &&ElementInstance<f64>| instance.num_constraints > 0 && state.modes.is_active(instance);
    for instance in mechanism.elements.iter().filter(is_closed) {
        gather(instance, state, &mut workspace);
        let local = ElementState { p: &instance.parameters, ..workspace.local(state.t) };
        if let Some(why) = instance.element.diagnose_assembly(&local) {
            let why = format!("{why} at t = {}", Seconds(state.t));
            let remedy =
                "change the initial orientations of its bodies, so that they are nearer to the intended assembly";
            return Err(Error::analysis(&instance.name, why, remedy));
        }
    }
    Ok(())
}

/// Factorizes the matrix of statics assembled at `state`.
///
/// # Errors
///
/// [`Error::Analysis`] naming what is not finite, or else the unknown without a pivot, with ropes that are slack and contacts that are open
/// if the position has no stiffness.
pub fn factorize_stiffness(system: &mut System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Result<()> {
    let Err(error) = factorize(system, mechanism, state) else { return Ok(()) };
    let is_regular = system.allows_redundancy() || ConstraintRank::of(system, mechanism, state).redundant.is_empty();
    match error {
        Error::Analysis { what, .. } if is_regular && not_finite(mechanism, state).is_none() => {
            let (slack, t) = (slack_elements(mechanism, state), state.t);
            let without =
                if slack.is_empty() { String::new() } else { format!("; slack or open there: {}", slack.join(", ")) };
            let why =
                format!("the stiffness is zero in a direction at the position of t = {t}{without}", t = Seconds(t));
            let remedy = "start from another position: where ropes are taut and contacts closed, and where loads do not merely change \
                          their lever arms; or give every free motion a spring or a joint";
            Err(Error::analysis(what, why, remedy))
        }
        error => Err(error),
    }
}

/// Names of ropes and compliant contacts without force.
fn slack_elements(mechanism: &Mechanism<f64>, state: &State<f64>) -> Vec<String> {
    let mut workspace = ElementWorkspace::default();
    let sided = mechanism.elements.iter().filter(|instance| instance.sides.is_some());
    let is_slack = |instance: &&ElementInstance<f64>| {
        evaluate(instance, state, &mut workspace);
        workspace.dynamics.iter().all(|force| *force == 0.0)
    };
    sided.filter(is_slack).map(|instance| instance.name.clone()).collect()
}

/// Factorizes the matrix assembled at `state`.
///
/// # Errors
///
/// [`Error::Analysis`] naming what is not finite, or else the unknown without a pivot.
pub fn factorize(system: &mut System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Result<()> {
    system.factorize(mechanism, state.t).map_err(|error| not_finite(mechanism, state).unwrap_or(error))
}
