//! Impacts and switches: velocities, accelerations and multipliers after an event.

use crate::constraint_rank::ConstraintRank;
use crate::elements::element::ElementWorkspace;
use crate::initial_conditions::AccelerationSolver;
use crate::mechanism::scalars::{ElementScalar, Jet2, StateScalar};
use crate::mechanism::{EventElement, Mechanism};
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result};
use error::Seconds;

/// Jump of the velocities at an impact, with the impulses in N·s or N·m·s.
#[derive(Clone, Debug)]
pub(crate) struct Jump<T> {
    /// Change of the velocities, by coordinate.
    pub velocity: Vec<T>,
    /// Impulses of the joints, by multiplier.
    pub joints: Vec<T>,
    /// Impulse of the contact.
    pub contact: T,
}

impl<T: StateScalar> Jump<T> {
    /// A jump of zero, of the size of `state`.
    pub fn none(state: &State<T>) -> Self {
        let zero = T::from(0.0);
        Self { velocity: vec![zero; state.v.len()], joints: vec![zero; state.l.len()], contact: zero }
    }

    /// Adds `change(equation)` to velocities and impulses of the joints, and `contact` to the impulse of the contact.
    pub fn add(&mut self, system: &System, change: impl Fn(usize) -> T, contact: T) {
        for (equation, unknown) in system.unknowns().iter().enumerate() {
            match *unknown {
                Unknown::Coordinate(i) => self.velocity[i] += change(equation),
                Unknown::Multiplier(m) => self.joints[m] += change(equation),
            }
        }
        self.contact += contact;
    }
}

impl<T: StateScalar> EventElement<T>
where
    Jet2<T>: ElementScalar,
{
    /// The gap in m or rad; for an event by a condition, the negative of the function that becomes positive.
    pub fn gap(&self, state: &State<T>) -> T {
        if let Some(when) = &self.when {
            return -when.value(state);
        }
        if let Some(value) = self.unilateral.as_ref().and_then(|law| law.value(self, state)) {
            return value;
        }
        self.evaluate(state, T::from(0.0)).constraint[0]
    }

    /// Rate of the gap in m/s or rad/s with the velocities `v` of all coordinates.
    pub fn rate(&self, state: &State<T>, v: &[T]) -> T {
        if let Some(when) = &self.when {
            return -when.rate(state, v);
        }
        if let Some(rate) = self.unilateral.as_ref().and_then(|law| law.rate(self, state)) {
            return rate;
        }
        self.gap_jet(state, v).v1
    }

    /// The gap of a contact with its first and second derivative along the motion with the velocities `v`.
    pub fn gap_jet(&self, state: &State<T>, v: &[T]) -> Jet2<T> {
        let (zero, one) = (T::from(0.0), T::from(1.0));
        let constant = |x: T| Jet2::new(x, zero, zero);
        let coordinates = &self.gap.coordinates;
        let mut workspace = ElementWorkspace::<Jet2<T>> {
            p: self.gap.parameters.iter().map(|&p| constant(p)).collect(),
            q: coordinates.iter().map(|&i| Jet2::new(state.q[i], v[i], state.a[i])).collect(),
            v: vec![constant(zero); coordinates.len()],
            a: vec![constant(zero); coordinates.len()],
            l: vec![constant(zero)],
            ..ElementWorkspace::default()
        };
        Jet2::<T>::residual(self.gap.element.as_ref(), Jet2::new(state.t, one, zero), &mut workspace);
        workspace.constraint[0]
    }

    /// Evaluates Φ_qᵀ times the `impulse`, and the gap.
    fn evaluate(&self, state: &State<T>, impulse: T) -> ElementWorkspace<T> {
        let of = |x: &[T]| self.gap.coordinates.iter().map(|&i| x[i]).collect();
        let mut workspace = ElementWorkspace {
            q: of(&state.q),
            v: of(&state.v),
            a: of(&state.a),
            l: vec![impulse],
            ..ElementWorkspace::default()
        };
        T::residual_of(self.gap.element.as_ref(), &self.gap.parameters, state.t, &mut workspace);
        workspace
    }

    /// Adds Φ_qᵀ times the `impulse` to the rows.
    pub fn add_impulse(&self, system: &System, state: &State<T>, impulse: T, rows: &mut [T]) {
        let workspace = self.evaluate(state, impulse);
        for (&coordinate, &row) in self.gap.coordinates.iter().zip(&workspace.dynamics) {
            if let Some(equation) = system.equation_of(coordinate) {
                rows[equation] += row;
            }
        }
    }

    /// Residual of a jump from the state `before`.
    ///
    /// Writes M Δv + Φ_qᵀ Λ (joints and contact) and Φ̇ of the joints with the new velocities to `rows`, by equation; returns
    /// Φ̇⁺ + e Φ̇⁻ of the contact, with e = 0 if it `stays` closed.
    pub fn rows(
        &self,
        system: &System,
        mechanism: &Mechanism<T>,
        before: &State<T>,
        (jump, stays): (&Jump<T>, bool),
        rows: &mut [T],
    ) -> T {
        let after = joint_rows(system, mechanism, before, jump, rows);
        self.add_impulse(system, before, jump.contact, rows);
        let restitution = self.restitution.filter(|_| !stays).unwrap_or(T::from(0.0));
        self.gap_jet(before, &after.v).v1 + self.gap_jet(before, &before.v).v1 * restitution
    }
}

/// Residual of a jump without a contact, from the state `before`: writes M Δv + Φ_qᵀ Λ and Φ̇ of the joints with the new
/// velocities to `rows`, by equation. Returns the state with these velocities. Impulses of joints cause no friction.
pub(crate) fn joint_rows<T: StateScalar>(
    system: &System,
    mechanism: &Mechanism<T>,
    before: &State<T>,
    jump: &Jump<T>,
    rows: &mut [T],
) -> State<T>
where
    Jet2<T>: ElementScalar,
{
    let zero = T::from(0.0);
    let mut still = before.clone();
    still.a.fill(zero);
    still.l.fill(zero);
    let mut forces = vec![zero; rows.len()];
    let mut workspace = ElementWorkspace::default();
    system.impulse_rows(mechanism, &still, &mut workspace, &mut forces);
    still.a.copy_from_slice(&jump.velocity);
    still.l.copy_from_slice(&jump.joints);
    system.impulse_rows(mechanism, &still, &mut workspace, rows);
    rows.iter_mut().zip(&forces).for_each(|(row, &force)| *row -= force);
    let mut after = before.clone();
    after.v.iter_mut().zip(&jump.velocity).for_each(|(v, &change)| *v += change);
    system.constraint_rates(mechanism, &after, 1, &mut ElementWorkspace::default(), rows);
    after
}

/// Factorizes M and Φ_q at `state`.
pub(crate) fn factorize_jump(system: &mut System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Result<()> {
    let mut free = state.clone();
    free.l.fill(0.0);
    system.assemble(mechanism, &free, Linearization::accelerations(), &mut vec![[0.0]; system.size()]);
    system.factorize(mechanism, state.t)
}

/// Makes the velocities of `state` consistent with the joints, by impulses of the joints. Returns the jump.
///
/// The steps satisfy the constraints of the positions; the velocities have errors of the order h² in the directions of the reactions, which depend
/// on the length of the last step. A joint that an event releases no longer constrains them.
pub(crate) fn make_consistent(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
) -> Result<Jump<f64>> {
    let mut jump = Jump::none(state);
    if mechanism.multipliers > 0 {
        factorize_jump(system, mechanism, state)?;
        let mut rows = vec![0.0; system.size()];
        joint_rows(system, mechanism, state, &jump, &mut rows);
        let mut changes: Vec<[f64; 1]> = rows.iter().map(|row| [*row]).collect();
        system.factor().solve(&mut changes);
        jump.add(system, |equation| -changes[equation][0], 0.0);
        state.v.iter_mut().zip(&jump.velocity).for_each(|(v, change)| *v += change);
    }
    Ok(jump)
}

/// The factorized equations of an impact: the matrix of the accelerations, bordered by row and column of the contact.
pub(crate) struct BorderedSystem {
    /// Φ_q of the contact by equation.
    direction: Vec<f64>,
    /// Change of velocities and joint impulses per unit impulse of the contact.
    response: Vec<[f64; 1]>,
    /// Change of the gap's rate per unit impulse of the contact.
    compliance: f64,
}

impl BorderedSystem {
    /// Equations at the state `before` the impact.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] if the contact acts on no free coordinate.
    pub fn new(
        system: &mut System,
        mechanism: &Mechanism<f64>,
        impact: &EventElement<f64>,
        before: &State<f64>,
    ) -> Result<Self> {
        factorize_jump(system, mechanism, before)?;
        let mut response = vec![[0.0]; system.size()];
        let mut direction = vec![0.0; system.size()];
        impact.add_impulse(system, before, 1.0, &mut direction);
        response.iter_mut().zip(&direction).for_each(|(to, from)| *to = [*from]);
        system.factor().solve(&mut response);
        let compliance: f64 = direction.iter().zip(&response).map(|(u, w)| u * w[0]).sum();
        if !(compliance > 0.0) {
            let why = format!("the impact at t = {} acts on no free coordinate", Seconds(before.t));
            return Err(Error::analysis(&impact.gap.name, why, "let the contact act on a free coordinate"));
        }
        Ok(Self { direction, response, compliance })
    }

    /// Change of the gap's rate per unit impulse of the contact.
    pub fn compliance(&self) -> f64 {
        self.compliance
    }

    /// Change of the gap's rate per unit impulse of the contact of `other` equations at the same state.
    pub fn change_by(&self, other: &Self) -> f64 {
        self.direction.iter().zip(&other.response).map(|(u, w)| u * w[0]).sum()
    }

    /// Solves the equations of the impact for the residuals `rows` (by equation) and `contact`.
    ///
    /// Overwrites `rows` with the negative corrections of velocities and joint impulses. Returns the negative correction of
    /// the contact's impulse.
    pub fn solve<const W: usize>(&self, system: &mut System, rows: &mut [[f64; W]], contact: [f64; W]) -> [f64; W] {
        system.factor().solve(rows);
        let mut impulse = contact.map(|x| -x);
        for (u, row) in self.direction.iter().zip(rows.iter()) {
            impulse.iter_mut().zip(row).for_each(|(c, x)| *c += u * x);
        }
        impulse = impulse.map(|c| c / self.compliance);
        for (w, row) in self.response.iter().zip(rows.iter_mut()) {
            row.iter_mut().zip(impulse).for_each(|(x, c)| *x -= w[0] * c);
        }
        impulse
    }
}

/// Coupling of two contacts, as a fraction of their compliances, below which an impulse of one does not change the velocity of the other.
const UNCOUPLED: f64 = 1e-10;

/// Returns whether an impulse of one of two `contacts` changes the rate of the gap of the other at `state`.
///
/// # Errors
///
/// As [`BorderedSystem::new`].
pub(crate) fn are_coupled(
    system: &System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
    contacts: [usize; 2],
) -> Result<bool> {
    let mut system = system.clone();
    let of = |system: &mut System, k: usize| BorderedSystem::new(system, mechanism, &mechanism.events[k], state);
    let (one, other) = (of(&mut system, contacts[0])?, of(&mut system, contacts[1])?);
    let coupling = other.change_by(&one);
    Ok(coupling.abs() > UNCOUPLED * (one.compliance * other.compliance).sqrt())
}

/// Gap in m or rad up to which a contact can block a prescribed motion.
const NEARLY_CLOSED: f64 = 1e-6;

/// The contact that, together with the contact number `event`, blocks a prescribed motion at `state`; `None` if there is none.
///
/// The gradients of both gaps with respect to the free coordinates then depend on each other and on the joints.
pub(crate) fn locked_with(mechanism: &Mechanism<f64>, state: &State<f64>, event: usize) -> Option<usize> {
    let is_driven = |k: usize| {
        let coordinates = &mechanism.events[k].gap.coordinates;
        coordinates
            .iter()
            .any(|&i| mechanism.coordinates[i].motion.as_ref().is_some_and(|(motion, _)| !motion.is_fixed()))
    };
    let is_contact = |k: usize| mechanism.events[k].restitution.is_some();
    if !is_contact(event) {
        return None;
    }
    let system = System::at(mechanism, state.t).ok()?;
    let gradient = |k: usize| {
        let workspace = mechanism.events[k].evaluate(state, 1.0);
        let mut row = vec![0.0; state.q.len()];
        for (&i, x) in mechanism.events[k].gap.coordinates.iter().zip(&workspace.dynamics) {
            row[i] += if system.equation_of(i).is_some() { *x } else { 0.0 };
        }
        row
    };
    let joints = ConstraintRank::of(&system, mechanism, state);
    let others = (0..mechanism.events.len()).filter(|&k| k != event && is_contact(k));
    let near = others.filter(|&k| mechanism.events[k].gap_jet(state, &state.v).re.abs() <= NEARLY_CLOSED);
    near.filter(|&k| is_driven(k) || is_driven(event)).find(|&k| {
        let mut rank = joints.clone();
        rank.add(0, gradient(k));
        rank.depends(gradient(event))
    })
}

/// Extrapolates the positions of `state` by the time `offset` (s).
pub(crate) fn extrapolate<T: StateScalar>(state: &State<T>, offset: f64) -> State<T> {
    let mut extrapolated = state.clone();
    extrapolated.t += offset;
    extrapolated.q.iter_mut().zip(&state.v).for_each(|(q, &v)| *q += v * offset);
    extrapolated
}

/// Rounding error of the time of a switch, as a fraction of the time.
pub(crate) const TIME_ROUNDING: f64 = 1024.0 * f64::EPSILON;

/// Rounding error of a position, as a fraction of its size.
pub(crate) const POSITION_ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Rounding error of the gap of a `switch` at `state`, the end of a step `h` (s).
pub(crate) fn gap_rounding(switch: &EventElement<f64>, state: &State<f64>, h: f64) -> f64 {
    let largest = switch.gap.coordinates.iter().map(|&i| state.q[i].abs()).fold(0.0, f64::max);
    let largest = switch.unilateral.as_ref().map_or(largest, |law| law.size(switch, state));
    TIME_ROUNDING * (state.t.abs() + h) * switch.rate(state, &state.v).abs() + POSITION_ROUNDING * largest
}

/// The switches that cross zero at the same time as event number `event`, up to rounding.
///
/// `state` is the state at the event, at the end of a step `h` (s).
pub(crate) fn simultaneous_switches(
    mechanism: &Mechanism<f64>,
    event: usize,
    state: &State<f64>,
    h: f64,
) -> Vec<usize> {
    let is_simultaneous = |k: &usize| {
        let switch = &mechanism.events[*k];
        switch.gap(state).abs() <= gap_rounding(switch, state, h)
    };
    let switches = (0..mechanism.events.len()).filter(|&k| k != event && mechanism.events[k].restitution.is_none());
    let to_come = switches.filter(|&k| !state.modes.has_happened(k));
    to_come.filter(is_simultaneous).collect()
}

/// Time after a switch at which forces are evaluated, in nominal steps.
const SWITCH_OFFSET: f64 = 1e-6;

/// Time (s) after the events `at_event` in the state `state` at which forces are evaluated; `nominal` is the nominal length of the steps (s).
///
/// After a switch it is a small part of a step, but less than half of the time to the next switch. A step ends before a condition becomes
/// true, by less than the rounding error of its time: this error later, functions that jump with the condition have jumped. The effects of
/// other events do not depend on the sign of a function, and the time is zero.
pub(crate) fn event_offset(mechanism: &Mechanism<f64>, at_event: &[usize], state: &State<f64>, nominal: f64) -> f64 {
    let longest = SWITCH_OFFSET * nominal;
    if at_event.iter().all(|&k| !mechanism.events[k].is_switch()) {
        let conditions = at_event.iter().map(|&k| &mechanism.events[k]).filter(|event| event.when.is_some());
        let errors = conditions.map(|event| gap_rounding(event, state, nominal) / event.rate(state, &state.v).abs());
        let largest = errors.filter(|error| error.is_finite()).fold(0.0, f64::max);
        return largest.min(longest.max(2.0 * TIME_ROUNDING * state.t.abs()));
    }
    let others = (0..mechanism.events.len()).filter(|k| !at_event.contains(k));
    let switches = others.map(|k| &mechanism.events[k]).filter(|event| event.is_switch());
    let times = switches.map(|switch| -switch.gap(state) / switch.rate(state, &state.v));
    times.filter(|time| *time > 0.0).fold(longest, |offset, time| offset.min(0.5 * time))
}

/// Sets accelerations and multipliers of `state` to those after the switch.
///
/// Returns the state after the switch, extrapolated by the time `offset` (s).
pub(crate) fn apply_switch(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    offset: f64,
    state: &mut State<f64>,
) -> Result<State<f64>> {
    let mut after = extrapolate(state, offset);
    AccelerationSolver::default().solve(system, mechanism, &mut after)?;
    state.a.copy_from_slice(&after.a);
    state.l.copy_from_slice(&after.l);
    Ok(after)
}

/// Applies the impact at the contact with the number `contact` to the velocities of `state`; without restitution if the contact
/// `stays` closed.
pub(crate) fn apply_impact(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    (contact, stays): (usize, bool),
    state: &mut State<f64>,
) -> Result<Jump<f64>> {
    let impact = &mechanism.events[contact];
    let bordered = BorderedSystem::new(system, mechanism, impact, state)?;
    let mut jump = Jump::none(state);
    let mut rows = vec![0.0; system.size()];
    let off = impact.rows(system, mechanism, state, (&jump, stays), &mut rows);
    let mut changes: Vec<[f64; 1]> = rows.iter().map(|row| [*row]).collect();
    let [impulse] = bordered.solve(system, &mut changes, [off]);
    jump.add(system, |equation| -changes[equation][0], -impulse);
    state.v.iter_mut().zip(&jump.velocity).for_each(|(v, change)| *v += change);
    Ok(jump)
}

/// Checks that the mechanism has no events, for an `analysis` that does not handle them.
///
/// # Errors
///
/// [`Error::Unsupported`] if the mechanism has a rigid contact, dry friction, or an event.
pub(crate) fn refuse<T>(mechanism: &Mechanism<T>, analysis: &str) -> Result<()> {
    mechanism.events.first().map_or(Ok(()), |impact| {
        let why = format!("{analysis} do not support impacts, friction that sticks and events");
        let remedy = "simulate over time (dynamics), or remove it";
        Err(Error::unsupported(&impact.gap.name, why, remedy))
    })
}
