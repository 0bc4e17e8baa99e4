//! Impacts: what velocities do when a rigid contact closes.

use crate::elements::element::ElementWorkspace;
use crate::initial_conditions::AccelerationSolver;
use crate::mechanism::scalars::{ElementScalar, Jet2, StateScalar};
use crate::mechanism::{EventElement, Mechanism};
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result};

/// Change of the velocities by an impact, with its impulses in N·s or N·m·s.
#[derive(Clone, Debug)]
pub(crate) struct Jump<T> {
    /// By coordinate.
    pub velocity: Vec<T>,
    /// Of the joints, by multiplier.
    pub joints: Vec<T>,
    /// Of the contact.
    pub contact: T,
}

impl<T: StateScalar> Jump<T> {
    /// None, in a state like `state`.
    pub fn none(state: &State<T>) -> Self {
        let zero = T::from(0.0);
        Self { velocity: vec![zero; state.v.len()], joints: vec![zero; state.l.len()], contact: zero }
    }

    /// Adds a change by equation, and of the contact's impulse.
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
    /// The gap in m or rad.
    pub fn gap(&self, state: &State<T>) -> T {
        self.evaluate(state, T::from(0.0)).constraint[0]
    }

    /// Its rate with the velocities `v` of all coordinates.
    pub fn rate(&self, state: &State<T>, v: &[T]) -> T {
        let (zero, one) = (T::from(0.0), T::from(1.0));
        let constant = |x: T| Jet2::new(x, zero, zero);
        let coordinates = &self.part.coordinates;
        let mut workspace = ElementWorkspace::<Jet2<T>> {
            p: self.part.parameters.iter().map(|&p| constant(p)).collect(),
            q: coordinates.iter().map(|&i| Jet2::new(state.q[i], v[i], zero)).collect(),
            v: vec![constant(zero); coordinates.len()],
            a: vec![constant(zero); coordinates.len()],
            l: vec![constant(zero)],
            ..ElementWorkspace::default()
        };
        Jet2::<T>::residual(self.part.element.as_ref(), Jet2::new(state.t, one, zero), &mut workspace);
        workspace.constraint[0].v1
    }

    /// Rows of the coordinates with the `impulse`, and the gap.
    fn evaluate(&self, state: &State<T>, impulse: T) -> ElementWorkspace<T> {
        let of = |x: &[T]| self.part.coordinates.iter().map(|&i| x[i]).collect();
        let mut workspace = ElementWorkspace {
            q: of(&state.q),
            v: of(&state.v),
            a: of(&state.a),
            l: vec![impulse],
            ..ElementWorkspace::default()
        };
        T::residual_of(self.part.element.as_ref(), &self.part.parameters, state.t, &mut workspace);
        workspace
    }

    /// Adds Φ_qᵀ times the `impulse` to the rows.
    fn push(&self, system: &System, state: &State<T>, impulse: T, rows: &mut [T]) {
        let workspace = self.evaluate(state, impulse);
        for (&coordinate, &row) in self.part.coordinates.iter().zip(&workspace.dynamics) {
            if let Some(equation) = system.equation_of(coordinate) {
                rows[equation] += row;
            }
        }
    }

    /// What is wrong with a jump from the state `before`: M Δv + Φ_qᵀ Λ of joints and contact, Φ̇ of the joints with the
    /// new velocities, written to `rows` by equation, and Φ̇⁺ + e Φ̇⁻ of the contact.
    pub fn rows(
        &self,
        system: &System,
        mechanism: &Mechanism<T>,
        before: &State<T>,
        jump: &Jump<T>,
        rows: &mut [T],
    ) -> T {
        let zero = T::from(0.0);
        let mut still = before.clone();
        still.a.fill(zero);
        still.l.fill(zero);
        let mut forces = vec![zero; rows.len()];
        let mut workspace = ElementWorkspace::default();
        system.residual(mechanism, &still, 1.0, &mut workspace, &mut forces);
        still.a.copy_from_slice(&jump.velocity);
        still.l.copy_from_slice(&jump.joints);
        system.residual(mechanism, &still, 1.0, &mut workspace, rows);
        rows.iter_mut().zip(&forces).for_each(|(row, &force)| *row -= force);
        self.push(system, before, jump.contact, rows);
        let mut after = before.clone();
        after.v.iter_mut().zip(&jump.velocity).for_each(|(v, &change)| *v += change);
        system.closure_rates(mechanism, &after, 1, &mut ElementWorkspace::default(), rows);
        let restitution = self.restitution.unwrap_or(zero);
        self.rate(before, &after.v) + self.rate(before, &before.v) * restitution
    }
}

/// The equations of an impact, factorized: those of the accelerations, bordered by the contact.
pub(crate) struct Border {
    /// Φ_q of the contact by equation.
    direction: Vec<f64>,
    /// How velocities and joints answer a unit impulse.
    answer: Vec<[f64; 1]>,
    /// How far the gap's rate does.
    compliance: f64,
}

impl Border {
    /// At the state `before` the impact.
    ///
    /// **Errors.** [`Error::Analysis`] if nothing can move.
    pub fn new(
        system: &mut System,
        mechanism: &Mechanism<f64>,
        impact: &EventElement<f64>,
        before: &State<f64>,
    ) -> Result<Self> {
        let mut answer = vec![[0.0]; system.size()];
        let mut free = before.clone();
        free.l.fill(0.0); // M and Φ_q alone
        system.assemble(mechanism, &free, Linearization::accelerations(), &mut answer);
        system.factorize(mechanism, before.t)?;
        let mut direction = vec![0.0; system.size()];
        impact.push(system, before, 1.0, &mut direction);
        answer.iter_mut().zip(&direction).for_each(|(to, from)| *to = [*from]);
        system.factor().solve(&mut answer);
        let compliance: f64 = direction.iter().zip(&answer).map(|(u, w)| u * w[0]).sum();
        if !(compliance > 0.0) {
            let why = format!("the impact at t = {:.6e} s cannot move anything", before.t);
            return Err(Error::analysis(&impact.part.name, why, "let it act on a coordinate that is free"));
        }
        Ok(Self { direction, answer, compliance })
    }

    /// Solves for what is wrong: `rows` and `contact` become the corrections, without their sign.
    pub fn solve<const W: usize>(&self, system: &mut System, rows: &mut [[f64; W]], contact: [f64; W]) -> [f64; W] {
        system.factor().solve(rows);
        let mut impulse = contact.map(|x| -x);
        for (u, row) in self.direction.iter().zip(rows.iter()) {
            impulse.iter_mut().zip(row).for_each(|(c, x)| *c += u * x);
        }
        impulse = impulse.map(|c| c / self.compliance);
        for (w, row) in self.answer.iter().zip(rows.iter_mut()) {
            row.iter_mut().zip(impulse).for_each(|(x, c)| *x -= w[0] * c);
        }
        impulse
    }
}

/// The state `state` a moment `ahead` (s) later, on the other side of a switch.
pub(crate) fn beyond<T: StateScalar>(state: &State<T>, ahead: f64) -> State<T> {
    let mut beyond = state.clone();
    beyond.t += ahead;
    beyond.q.iter_mut().zip(&state.v).for_each(|(q, &v)| *q += v * ahead);
    beyond
}

/// Passes a switch: accelerations and reactions are those beyond it, velocities stay.
pub(crate) fn apply_switch(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    ahead: f64,
    state: &mut State<f64>,
) -> Result<State<f64>> {
    let mut beyond = beyond(state, ahead);
    AccelerationSolver::default().solve(system, mechanism, &mut beyond)?;
    state.a.copy_from_slice(&beyond.a);
    state.l.copy_from_slice(&beyond.l);
    Ok(beyond)
}

/// Lets the mechanism bounce off contact number `contact`: velocities jump, accelerations and reactions follow.
pub(crate) fn apply_impact(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    contact: usize,
    state: &mut State<f64>,
) -> Result<Jump<f64>> {
    let impact = &mechanism.impacts[contact];
    let border = Border::new(system, mechanism, impact, state)?;
    let mut jump = Jump::none(state);
    let mut rows = vec![0.0; system.size()];
    let off = impact.rows(system, mechanism, state, &jump, &mut rows);
    let mut changes: Vec<[f64; 1]> = rows.iter().map(|row| [*row]).collect();
    let [impulse] = border.solve(system, &mut changes, [off]);
    jump.add(system, |equation| -changes[equation][0], -impulse);
    state.v.iter_mut().zip(&jump.velocity).for_each(|(v, change)| *v += change);
    AccelerationSolver::default().solve(system, mechanism, state)?;
    Ok(jump)
}

/// For an analysis that knows no impacts.
///
/// **Errors.** [`Error::Definition`] if the mechanism has contacts to bounce off.
pub(crate) fn refuse<T>(mechanism: &Mechanism<T>, analysis: &str) -> Result<()> {
    mechanism.impacts.first().map_or(Ok(()), |impact| {
        let why = format!("{analysis} know no impacts");
        Err(Error::definition(
            &impact.part.name,
            why,
            "simulate the motion by implicit steps, or leave the contact out",
        ))
    })
}
