//! Forces of closed contacts and of friction that sticks, and velocities of friction, at the ends of implicit steps.

use crate::Result;
use crate::events::impact::make_consistent;
use crate::initial_conditions::AccelerationSolver;
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;

/// The ends of an implicit step with the accelerations and multipliers of M q̈ + Φ_qᵀ λ = f, Φ̈ = 0.
///
/// The multipliers of a step have errors that change their sign from step to step. Whether a contact opens is decided by those of
/// its positions and velocities, which are also those with which the motion goes on. Velocities satisfy the constraints up to the error
/// of the step; where friction begins and ends to slide is decided by those that satisfy them.
pub(crate) struct ConsistentEnds {
    system: System,
    solver: AccelerationSolver,
    states: [State<f64>; 2],
    /// True if joints couple dry friction to other coordinates.
    has_friction: bool,
    /// True if there is such friction, or if a part is held in the current step.
    is_used: bool,
}

impl ConsistentEnds {
    /// Ends for steps of the `mechanism` from the state `start` on; `None` if no part has modes that follow from the motion.
    pub fn new(mechanism: &Mechanism<f64>, system: &System, start: &State<f64>) -> Option<Box<Self>> {
        mechanism.events.iter().any(|event| event.unilateral.is_some()).then(|| {
            let (system, solver) = (system.clone(), AccelerationSolver::default());
            let has_friction = mechanism.has_coupled_friction();
            Box::new(Self { system, solver, states: [start.clone(), start.clone()], has_friction, is_used: false })
        })
    }

    /// The states, if they are not those of the step.
    pub fn states(&self) -> Option<[&State<f64>; 2]> {
        self.is_used.then_some(self.states.each_ref())
    }

    /// Solves at both ends of a step, if a part is held in it or has friction.
    pub fn begin(&mut self, mechanism: &Mechanism<f64>, [old, new]: [&State<f64>; 2]) -> Result<()> {
        self.is_used = self.has_friction || mechanism.events.iter().any(|event| event.is_held(&old.modes));
        self.solve(mechanism, 0, old)?;
        self.end(mechanism, new)
    }

    /// Solves again at the end of the step, which is now `new`.
    pub fn end(&mut self, mechanism: &Mechanism<f64>, new: &State<f64>) -> Result<()> {
        self.solve(mechanism, 1, new)
    }

    /// Solves at one end, with the `state` of the step.
    fn solve(&mut self, mechanism: &Mechanism<f64>, end: usize, state: &State<f64>) -> Result<()> {
        let Self { system, solver, states, has_friction, is_used } = self;
        if *is_used {
            states[end].copy_from(state);
            if *has_friction {
                make_consistent(system, mechanism, &mut states[end])?;
            }
            solver.solve(system, mechanism, &mut states[end])?;
        }
        Ok(())
    }
}
