//! Velocities, accelerations and forces at the ends of implicit steps, where events depend on them.

use crate::Result;
use crate::events::impact::make_consistent;
use crate::initial_conditions::AccelerationSolver;
use crate::mechanism::{EventElement, Mechanism};
use crate::system::System;
use crate::system::state::State;

/// The ends of an implicit step with the accelerations and multipliers of M q̈ + Φ_qᵀ λ = f, Φ̈ = 0.
///
/// The accelerations and multipliers of a step have errors that change their sign from step to step. Whether a contact opens, or a force
/// exceeds a limit, is therefore decided by those that the equations of motion give at its positions and velocities; the motion also
/// continues with these. The velocities of a step satisfy the constraints up to its error; whether friction begins or ceases to slide, and
/// whether a condition on velocities is true, is decided by velocities that satisfy them.
pub(crate) struct ConsistentEnds {
    system: System,
    solver: AccelerationSolver,
    states: [State<f64>; 2],
    /// True if there is dry friction, or a condition that uses velocities or forces.
    is_projected: bool,
    /// True if there is such a part, or if a contact is held in the current step.
    is_used: bool,
}

impl ConsistentEnds {
    /// Ends for steps of the `mechanism` from the state `start` on; `None` if no event depends on forces.
    pub fn new(mechanism: &Mechanism<f64>, system: &System, start: &State<f64>) -> Option<Box<Self>> {
        let needs_forces = |event: &EventElement<f64>| event.unilateral.is_some() || event.needs_forces(&start.modes);
        let is_projected = mechanism.has_consistent_velocities();
        (is_projected || mechanism.events.iter().any(needs_forces)).then(|| {
            let (system, solver) = (system.clone(), AccelerationSolver::default());
            Box::new(Self { system, solver, states: [start.clone(), start.clone()], is_projected, is_used: false })
        })
    }

    /// The states, if they are not those of the step.
    pub fn states(&self) -> Option<[&State<f64>; 2]> {
        self.is_used.then_some(self.states.each_ref())
    }

    /// Solves at both ends of a step, if an event in it depends on forces or friction.
    pub fn begin(&mut self, mechanism: &Mechanism<f64>, [old, new]: [&State<f64>; 2]) -> Result<()> {
        self.is_used = self.is_projected || mechanism.events.iter().any(|event| event.needs_forces(&old.modes));
        self.solve(mechanism, 0, old)?;
        self.end(mechanism, new)
    }

    /// Solves again at the end of the step, which is now `new`.
    pub fn end(&mut self, mechanism: &Mechanism<f64>, new: &State<f64>) -> Result<()> {
        self.solve(mechanism, 1, new)
    }

    /// Solves at one end, with the `state` of the step.
    fn solve(&mut self, mechanism: &Mechanism<f64>, end: usize, state: &State<f64>) -> Result<()> {
        let Self { system, solver, states, is_projected, is_used } = self;
        if *is_used {
            states[end].copy_from(state);
            if *is_projected {
                make_consistent(system, mechanism, &mut states[end])?;
            }
            solver.solve(system, mechanism, &mut states[end])?;
        }
        Ok(())
    }
}

/// The state `end` of a step that ends at an event, with velocities that satisfy the joints and the accelerations and multipliers of the
/// equations of motion.
///
/// Such a step may be so short that its accelerations consist of errors of positions, divided by the square of its length. Its velocities
/// violate the joints by the square of its length, which depends on the design: their derivatives would have an error of the order of the
/// step. In singular positions, where the equations have no solution, the values of the step are returned.
pub(crate) fn at_event(system: &mut System, mechanism: &Mechanism<f64>, end: &State<f64>) -> State<f64> {
    let mut state = end.clone();
    let solved = make_consistent(system, mechanism, &mut state)
        .and_then(|_| AccelerationSolver::default().solve(system, mechanism, &mut state));
    if solved.is_ok() { state } else { end.clone() }
}
