//! Forces of closed contacts and of friction that sticks at the ends of implicit steps.

use crate::Result;
use crate::initial_conditions::AccelerationSolver;
use crate::integrators::generalized_alpha::Step;
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;

/// The ends of an implicit step with the accelerations and multipliers of M q̈ + Φ_qᵀ λ = f, Φ̈ = 0.
///
/// The multipliers of a step have errors that change their sign from step to step. Whether a contact opens is decided by those of
/// its positions and velocities, which are also those with which the motion goes on.
pub(crate) struct ConsistentEnds {
    system: System,
    solver: AccelerationSolver,
    states: [State<f64>; 2],
    /// True if a part is held in the current step.
    is_used: bool,
}

impl ConsistentEnds {
    /// Ends for steps of the `mechanism` from the state `start` on; `None` if no part has modes that follow from the motion.
    pub fn new(mechanism: &Mechanism<f64>, system: &System, start: &State<f64>) -> Option<Box<Self>> {
        mechanism.events.iter().any(|event| event.unilateral.is_some()).then(|| {
            let (system, solver) = (system.clone(), AccelerationSolver::default());
            Box::new(Self { system, solver, states: [start.clone(), start.clone()], is_used: false })
        })
    }

    /// The states, if a part is held in the step.
    pub fn states(&self) -> Option<[&State<f64>; 2]> {
        self.is_used.then_some(self.states.each_ref())
    }

    /// Solves at both ends of `step`, if a part is held in it.
    pub fn begin(&mut self, mechanism: &Mechanism<f64>, step: &Step<f64>) -> Result<()> {
        self.is_used = mechanism.events.iter().any(|event| event.is_held(&step.old.modes));
        if self.is_used {
            self.states[0].copy_from(&step.old);
            self.solver.solve(&mut self.system, mechanism, &mut self.states[0])?;
        }
        self.end(mechanism, step)
    }

    /// Solves at the end of `step` again.
    pub fn end(&mut self, mechanism: &Mechanism<f64>, step: &Step<f64>) -> Result<()> {
        if self.is_used {
            self.states[1].copy_from(&step.new);
            self.solver.solve(&mut self.system, mechanism, &mut self.states[1])?;
        }
        Ok(())
    }
}
