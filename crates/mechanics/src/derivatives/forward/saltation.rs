//! Derivatives through impacts and switches.
//!
//! The time at which a contact closes and the jump of the velocities depend on the design. The step that closes the
//! contact has a length h(b) with Φ(x₁(h, b), b) = 0, so that
//!
//! $$ \frac{dh}{db} = -\frac{\partial\Phi/\partial b}{\partial\Phi/\partial h} $$
//!
//! The step after it ends at a given time and has the length t − t₁(b). Both lengths are numbers that carry derivatives.
//! With them the formulas of the steps give the jump conditions (saltation matrices), exact for the discrete motion.
//!
//! # Sources
//! Leine & Nijmeijer, *Dynamics and Bifurcations of Non-Smooth Mechanical Systems* (2004), Section 7.3.

use crate::Result;
use crate::derivatives::forward::initial_conditions::InitialDerivatives;
use crate::derivatives::seeding::take_values;
use crate::events::held_outputs::HeldOutputs;
use crate::events::impact::{self, BorderedSystem, Jump, event_offset};
use crate::events::mode_transition::find_transition;
use crate::initial_conditions::AccelerationSolver;
use crate::integrators::settings::StepSize;
use crate::mechanism::Mechanism;
use crate::mechanism::output::EventSide;
use crate::mechanism::scalars::{DerivativeScalar, ElementScalar, Jet2, StateScalar};
use crate::system::System;
use crate::system::state::State;

/// Applies the impact at contact number `contact`, which may stay closed, to the velocities of `state`; `values` is the state in
/// `f64`. Returns the state in `f64` after the impact.
fn apply_impact<T: DerivativeScalar<L>, const L: usize>(
    plain: &Mechanism<f64>,
    mechanism: &Mechanism<T>,
    system: &mut System,
    (contact, stays): (usize, bool),
    values: &State<f64>,
    state: &mut State<T>,
) -> Result<State<f64>>
where
    Jet2<T>: ElementScalar,
{
    let mut after = values.clone();
    let jump = impact::apply_impact(system, plain, (contact, stays), &mut after)?;
    let bordered = BorderedSystem::new(system, plain, &plain.events[contact], values)?;
    let mut lifted = lift(&jump);
    let mut rows = vec![T::from(0.0); system.size()];
    for _ in 0..T::ORDER {
        let off = mechanism.events[contact].rows(system, mechanism, state, (&lifted, stays), &mut rows);
        let mut changes: Vec<[f64; L]> = rows.iter().map(DerivativeScalar::derivatives).collect();
        let impulse = bordered.solve(system, &mut changes, off.derivatives());
        lifted.add(system, |equation| -T::with(0.0, changes[equation]), -T::with(0.0, impulse));
    }
    state.v.iter_mut().zip(&lifted.velocity).for_each(|(v, &change)| *v += change);
    take_values(state, &after);
    Ok(after)
}

/// Applies the event `closed` to `state`, the state at the end of a step, and stores the outputs that are held from it on.
///
/// `step` has the nominal length to which times between events are compared.
pub(crate) fn apply_event<T: DerivativeScalar<L>, const L: usize>(
    plain: &Mechanism<f64>,
    mechanism: &Mechanism<T>,
    system: &mut System,
    held: &mut Option<HeldOutputs<T>>,
    closed: ClosedContact,
    step: StepSize,
    state: &mut State<T>,
) -> Result<()>
where
    Jet2<T>: ElementScalar,
{
    let ClosedContact { contact, at_event, mut values } = closed;
    if let Some(held) = held {
        let before = consistent_at_event(plain, mechanism, system, &values, state)?;
        held.hold(mechanism, EventSide::Before, &at_event, &before);
    }
    let is_impact = plain.events[contact].is_open_contact(&values.modes);
    let transition = find_transition(system, plain, (contact, &at_event), &values, step.nominal())?;
    (state.modes, values.modes) = (transition.jump.clone(), transition.jump);
    let mut values = match is_impact {
        true => apply_impact(plain, mechanism, system, (contact, transition.stays), &values, state)?,
        false => make_consistent(plain, mechanism, system, &values, state)?,
    };
    (state.modes, values.modes) = (transition.after.clone(), transition.after);
    let offset = event_offset(plain, &at_event, &values, step.nominal());
    apply_switch(plain, mechanism, system, offset, &values, state)?;
    if let Some(held) = held {
        held.hold(mechanism, EventSide::After, &at_event, state);
    }
    Ok(())
}

/// The function of event number `event` at `state`, the end of an implicit step, with its values in `values`.
///
/// Forces and accelerations are those of its positions and velocities, and velocities of friction satisfy the constraints, as where the
/// event is located.
pub(crate) fn event_value<T: DerivativeScalar<L>, const L: usize>(
    plain: &Mechanism<f64>,
    mechanism: &Mechanism<T>,
    system: &mut System,
    event: usize,
    values: &State<f64>,
    state: &State<T>,
) -> Result<T>
where
    Jet2<T>: ElementScalar,
{
    let is_projected = plain.has_consistent_velocities();
    if !plain.events[event].needs_forces(&values.modes) && !is_projected {
        return Ok(mechanism.events[event].gap(state));
    }
    let (mut values, mut state) = (values.clone(), state.clone());
    if is_projected {
        values = make_consistent(plain, mechanism, system, &values, &mut state)?;
    }
    AccelerationSolver::default().solve(system, plain, &mut values)?;
    InitialDerivatives::new(plain, mechanism, system).accelerations(&values, &mut state)?;
    Ok(mechanism.events[event].gap(&state))
}

/// The `state` at the end of an implicit step that ends at an event, with velocities that satisfy the joints and the accelerations and
/// multipliers of the equations of motion, as [`at_event`](crate::integrators::consistent_ends::at_event); `values` is the state in `f64`.
pub(crate) fn consistent_at_event<T: DerivativeScalar<L>, const L: usize>(
    plain: &Mechanism<f64>,
    mechanism: &Mechanism<T>,
    system: &mut System,
    values: &State<f64>,
    state: &State<T>,
) -> Result<State<T>>
where
    Jet2<T>: ElementScalar,
{
    let mut consistent = state.clone();
    let Ok(mut values) = make_consistent(plain, mechanism, system, values, &mut consistent) else {
        return Ok(state.clone());
    };
    if AccelerationSolver::default().solve(system, plain, &mut values).is_err() {
        return Ok(state.clone());
    }
    InitialDerivatives::new(plain, mechanism, system).accelerations(&values, &mut consistent)?;
    Ok(consistent)
}

/// The event at the end of a step.
pub(crate) struct ClosedContact {
    pub contact: usize,
    /// All events of this time, in their order.
    pub at_event: Vec<usize>,
    /// The state at the end of the step.
    pub values: State<f64>,
}

impl ClosedContact {
    /// Returns whether the event ends the motion.
    pub fn is_terminal(&self, mechanism: &Mechanism<f64>) -> bool {
        self.at_event.iter().any(|k| mechanism.events[*k].is_terminal())
    }
}

/// Makes the velocities of `state` consistent with the joints; `values` is the state in `f64`. Returns the state in `f64` with
/// these velocities.
fn make_consistent<T: DerivativeScalar<L>, const L: usize>(
    plain: &Mechanism<f64>,
    mechanism: &Mechanism<T>,
    system: &mut System,
    values: &State<f64>,
    state: &mut State<T>,
) -> Result<State<f64>>
where
    Jet2<T>: ElementScalar,
{
    let mut after = values.clone();
    let jump = impact::make_consistent(system, plain, &mut after)?;
    let mut lifted = lift(&jump);
    let mut rows = vec![T::from(0.0); system.size()];
    for _ in 0..if plain.multipliers > 0 { T::ORDER } else { 0 } {
        impact::joint_rows(system, mechanism, state, &lifted, &mut rows);
        let mut changes: Vec<[f64; L]> = rows.iter().map(DerivativeScalar::derivatives).collect();
        system.factor().solve(&mut changes);
        lifted.add(system, |equation| -T::with(0.0, changes[equation]), T::from(0.0));
    }
    state.v.iter_mut().zip(&lifted.velocity).for_each(|(v, &change)| *v += change);
    take_values(state, &after);
    Ok(after)
}

/// A jump without derivatives.
fn lift<T: StateScalar>(jump: &Jump<f64>) -> Jump<T> {
    let lift = |x: &[f64]| x.iter().map(|&x| T::from(x)).collect();
    Jump { velocity: lift(&jump.velocity), joints: lift(&jump.joints), contact: T::from(jump.contact) }
}

/// Applies a switch: sets accelerations and multipliers of `state` to those of the state extrapolated by `offset` (s).
///
/// `values` is the state in `f64`.
fn apply_switch<T: DerivativeScalar<L>, const L: usize>(
    plain: &Mechanism<f64>,
    mechanism: &Mechanism<T>,
    system: &mut System,
    offset: f64,
    values: &State<f64>,
    state: &mut State<T>,
) -> Result<()>
where
    Jet2<T>: ElementScalar,
{
    let after = impact::apply_switch(system, plain, offset, &mut values.clone())?;
    let mut extrapolated = impact::extrapolate(state, offset);
    take_values(&mut extrapolated, &after);
    InitialDerivatives::new(plain, mechanism, system).accelerations(&after, &mut extrapolated)?;
    (state.a, state.l) = (extrapolated.a, extrapolated.l);
    Ok(())
}
