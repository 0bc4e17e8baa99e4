//! Positions, velocities, accelerations and reactions of driven mechanisms.

use crate::Result;
use crate::analyses::sampling::Sampler;
use crate::diagnostics;
use crate::events::impact;
use crate::initial_conditions::{AccelerationSolver, Assembly, Projection, assemble, make_velocities_consistent};
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;

/// A guess is good if it is wrong by at most this part of the way.
const GOOD_GUESS: f64 = 0.2;

/// Smallest stride in parts of the wanted one.
const SMALLEST: f64 = 1.0 / 256.0;

/// Walks a driven mechanism through time: no integration, each instant is solved by itself.
///
/// With all degrees of freedom driven this is kinematics, and the multipliers and efforts are its inverse dynamics:
/// what drives and joints must supply. Where freedom is left, positions stay nearest to the instant before.
pub struct KinematicDriver<'m> {
    /// The mechanism.
    pub mechanism: &'m Mechanism<f64>,
    /// Its equations, with the factor of the accelerations.
    pub system: System,
    /// The current instant.
    pub state: State<f64>,
    /// Multipliers of the projections at the current instant.
    pub projection: Projection,
    assembly: Assembly,
    solver: AccelerationSolver,
}

impl<'m> KinematicDriver<'m> {
    /// Assembled at time `t` from the positions that the mechanism was built in.
    pub fn new(mechanism: &'m Mechanism<f64>, assembly: Assembly, t: f64) -> Result<Self> {
        impact::refuse(mechanism, "kinematics")?;
        let (system, state) = (System::at(mechanism, t)?, State::built(mechanism, t));
        let (projection, solver) = (Projection::default(), AccelerationSolver::default());
        let mut walk = Self { mechanism, system, state, projection, assembly, solver };
        walk.solve_position()?;
        Ok(walk)
    }

    /// Goes to time `t`, guessing positions from velocities and accelerations so that the branch is kept.
    ///
    /// Where the guess is poor, or nothing can be assembled from it, the way is gone in halves.
    ///
    /// **Errors.** [`crate::Error::Analysis`] if a joint cannot be closed, for instance behind a dead centre.
    pub fn go(&mut self, t: f64) -> Result<()> {
        let (from, start) = (self.state.t, self.state.clone());
        let mut stride = t - from;
        while self.state.t != t {
            let last = (t - self.state.t).abs() <= stride.abs() * (1.0 + 1e-9);
            let to = if last { t } else { self.state.t + stride };
            let before = self.state.clone();
            match self.stride(to) {
                Ok(true) => continue,
                outcome if (2.0 * SMALLEST * (t - from)).abs() > stride.abs() => {
                    outcome.inspect_err(|_| self.state.copy_from(&start))?;
                }
                _ => {
                    self.state.copy_from(&before);
                    stride *= 0.5;
                }
            }
        }
        Ok(())
    }

    /// One stride to `t`. Returns whether the guess was good.
    fn stride(&mut self, t: f64) -> Result<bool> {
        let h = t - self.state.t;
        let (mut moved, mut wrong) = (0.0f64, 0.0f64);
        for i in 0..self.state.q.len() {
            let change = h * (self.state.v[i] + 0.5 * h * self.state.a[i]);
            moved = moved.max(change.abs());
            self.state.q[i] += change;
            self.state.v[i] += h * self.state.a[i];
        }
        let guess = self.state.q.clone();
        self.state.t = t;
        self.solve_position()?;
        for (i, guess) in guess.iter().enumerate().filter(|(i, _)| self.system.equation_of(*i).is_some()) {
            wrong = wrong.max((self.state.q[i] - guess).abs());
        }
        Ok(wrong <= GOOD_GUESS * moved.max(1e-6))
    }

    fn solve_position(&mut self) -> Result<()> {
        let Self { mechanism, system, state, .. } = self;
        state.prescribe(mechanism);
        self.projection = assemble(system, mechanism, state, self.assembly)?;
        self.projection.velocity = make_velocities_consistent(system, mechanism, state)?;
        self.solver.solve(system, mechanism, state)
    }
}

/// Outputs of a driven mechanism at `times`: one series per output, reactions and driving efforts included.
pub fn kinematics(mechanism: &Mechanism<f64>, assembly: Assembly, times: &[f64]) -> Result<Vec<Vec<f64>>> {
    let (mut sampler, mut outputs) = (Sampler::new(mechanism), Vec::new());
    let mut series = vec![Vec::with_capacity(times.len()); mechanism.outputs.len()];
    let Some(&first) = times.first() else { return Ok(series) };
    let mut walk = KinematicDriver::new(mechanism, assembly, first)?;
    for &t in times {
        if t != walk.state.t {
            walk.go(t)?;
        }
        sampler.outputs(mechanism, &walk.state, &mut outputs);
        diagnostics::check(mechanism, &walk.state, &outputs)?;
        series.iter_mut().zip(&outputs).for_each(|(s, &value)| s.push(value));
    }
    Ok(series)
}
