//! The state of a mechanism at one time, and the residual of one element at a state.

use crate::elements::element::{ElementState, ElementWorkspace};
use crate::mechanism::element::AnyElement;
use crate::mechanism::scalars::StateScalar;
use crate::mechanism::{ElementInstance, Mechanism};
use crate::system::modes::Modes;

/// Positions, velocities and accelerations of all coordinates, and all multipliers, at time `t` (s).
#[derive(Clone, Debug, PartialEq)]
pub struct State<T> {
    /// Time in s. It carries derivatives if it is the time of an event that depends on the design.
    pub t: T,
    /// Positions, one per coordinate.
    pub q: Vec<T>,
    /// Velocities, one per coordinate.
    pub v: Vec<T>,
    /// Accelerations, one per coordinate.
    pub a: Vec<T>,
    /// Multipliers: reactions of the joints, one per constraint equation.
    pub l: Vec<T>,
    /// Elements that are active, events that have happened, and sides of switching functions that are held.
    pub modes: Modes,
}

impl<T: StateScalar> State<T> {
    /// The initial state of the model, with the prescribed coordinates as prescribed at the time `t` (s).
    pub fn built(mechanism: &Mechanism<T>, t: f64) -> Self {
        let zero = T::from(0.0);
        let mut state = Self {
            t: T::from(t),
            q: mechanism.coordinates.iter().map(|c| c.position).collect(),
            v: mechanism.coordinates.iter().map(|c| c.velocity).collect(),
            a: vec![zero; mechanism.coordinates.len()],
            l: vec![zero; mechanism.multipliers],
            modes: Modes::initial(mechanism),
        };
        state.prescribe(mechanism);
        state
    }

    /// Sets position, velocity and acceleration of the prescribed coordinates at the state's time.
    pub fn prescribe(&mut self, mechanism: &Mechanism<T>) {
        for (i, coordinate) in mechanism.coordinates.iter().enumerate() {
            if let Some((motion, parameters)) = &coordinate.motion {
                [self.q[i], self.v[i], self.a[i]] = T::motion(motion.as_ref(), parameters, self.t);
            }
        }
    }

    /// Copies `other` without allocating.
    pub fn copy_from(&mut self, other: &Self) {
        self.t = other.t;
        self.q.copy_from_slice(&other.q);
        self.v.copy_from_slice(&other.v);
        self.a.copy_from_slice(&other.a);
        self.l.copy_from_slice(&other.l);
        self.modes.copy_from(&other.modes);
    }
}

/// Copies the variables of an element from the state to `workspace`, without its parameters.
pub(crate) fn gather<T: StateScalar>(
    instance: &ElementInstance<T>,
    state: &State<T>,
    workspace: &mut ElementWorkspace<T>,
) {
    for (to, from) in [(&mut workspace.q, &state.q), (&mut workspace.v, &state.v), (&mut workspace.a, &state.a)] {
        to.clear();
        to.extend(instance.coordinates.iter().map(|&i| from[i]));
    }
    workspace.l.clear();
    workspace.l.extend_from_slice(&state.l[instance.multipliers()]);
    workspace.sides = state.modes.sides_of(instance);
}

/// Evaluates the residual of an element into `workspace`. That of an inactive element is its multipliers.
pub(crate) fn evaluate<T: StateScalar>(
    instance: &ElementInstance<T>,
    state: &State<T>,
    workspace: &mut ElementWorkspace<T>,
) {
    gather(instance, state, workspace);
    T::residual_of(instance.element.as_ref(), &instance.parameters, state.t, workspace);
    if !state.modes.is_active(instance) {
        workspace.dynamics.fill(T::from(0.0));
        workspace.constraint.copy_from_slice(&workspace.l);
    }
}

/// Evaluates the measures of an element. Forces, torques and powers of an inactive element are zero.
pub(crate) fn measure<T: StateScalar>(
    instance: &ElementInstance<T>,
    state: &State<T>,
    workspace: &mut ElementWorkspace<T>,
    out: &mut [T],
) {
    gather(instance, state, workspace);
    let local = ElementState { p: &instance.parameters, ..workspace.local(state.t) };
    T::measure(instance.element.as_ref(), &local, out);
    if !state.modes.is_active(instance) {
        clear_loads(instance.element.as_ref(), out);
    }
}

/// Sets the forces, torques and powers among the measures of an inactive `element` to zero.
pub(crate) fn clear_loads<T: StateScalar>(element: &dyn AnyElement, measures: &mut [T]) {
    let is_load = |unit: &str| unit.split(" or ").any(|unit| LOADS.contains(&unit));
    let loads = measures.iter_mut().zip(element.measures()).filter(|(_, measure)| is_load(measure.unit));
    loads.for_each(|(value, _)| *value = T::from(0.0));
}

/// Units of measures that an inactive element does not have.
const LOADS: [&str; 3] = ["N", "N·m", "W"];
