//! Kinematics and inverse dynamics of driven mechanisms.

use crate::analyses::sampling::OutputRecorder;
use crate::constraint_rank::undetermined_coordinates;
use crate::events::impact;
use crate::initial_conditions::{AccelerationSolver, Assembly, Projection, assemble, nearest_consistent_velocities};
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;
use crate::{Error, Result};

/// Largest error of a predicted position for which a substep is accepted, as a fraction of the change of the position.
const GOOD_PREDICTION: f64 = 0.2;

/// Smallest substep, as a fraction of the interval, or of the time in which the fastest coordinate moves by 1 rad or 1 m if that is shorter.
const SMALLEST: f64 = 1.0 / 256.0;

/// Solver for the motion of a driven mechanism, without integration: each time point is solved separately.
///
/// If all degrees of freedom are driven, this is kinematics. Multipliers and driving forces are then the inverse dynamics: the
/// reactions of the joints and the forces of the drives.
pub struct KinematicDriver<'m> {
    /// The mechanism.
    pub mechanism: &'m Mechanism<f64>,
    /// Equations of motion, with the factor of the accelerations.
    pub system: System,
    /// State at the current time point.
    pub state: State<f64>,
    /// Multipliers of the projections at the current time point.
    pub projection: Projection,
    assembly: Assembly,
    solver: AccelerationSolver,
}

impl<'m> KinematicDriver<'m> {
    /// Assembles the mechanism at the time `t` (s) from the positions that it was built with.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] for a mechanism with impacts or switches; [`Error::Analysis`] if it cannot be assembled, or if
    /// drives and joints do not determine all coordinates.
    pub fn new(mechanism: &'m Mechanism<f64>, assembly: Assembly, t: f64) -> Result<Self> {
        impact::refuse(mechanism, "kinematics")?;
        let (system, state) = (System::at(mechanism, t)?, State::built(mechanism, t));
        let (projection, solver) = (Projection::default(), AccelerationSolver::default());
        let mut driver = Self { mechanism, system, state, projection, assembly, solver };
        let solved = driver.solve_position();
        driver.check_determined()?;
        solved?;
        Ok(driver)
    }

    /// Checks that drives and joints determine every coordinate.
    fn check_determined(&self) -> Result<()> {
        let Self { mechanism, system, state, .. } = self;
        let free = system.size() - mechanism.multipliers;
        if free <= mechanism.multipliers && !system.allows_redundancy() {
            return Ok(());
        }
        let left = undetermined_coordinates(system, mechanism, state);
        if left.is_empty() {
            return Ok(());
        }
        let degrees = if left.len() == 1 { "a degree of freedom is" } else { "degrees of freedom are" };
        let why = format!("{degrees} not driven: kinematics does not determine the motion");
        let remedy = "add a driver for each of these coordinates, or simulate the motion by dynamics";
        Err(Error::analysis(left.join(", "), why, remedy))
    }

    /// Advances to the time `t` (s) on the same branch, predicting positions from velocities and accelerations.
    ///
    /// If the prediction is poor, or the mechanism cannot be assembled from it, the interval is halved.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] if a joint cannot be closed, for example beyond a dead centre.
    pub fn advance_to(&mut self, t: f64) -> Result<()> {
        let start = self.state.clone();
        let interval = t - start.t;
        let mut substep = interval;
        while self.state.t != t {
            let last = (t - self.state.t).abs() <= substep.abs() * (1.0 + 1e-9);
            let to = if last { t } else { self.state.t + substep };
            let before = self.state.clone();
            let fastest = before.v.iter().fold(0.0, |fastest: f64, v| fastest.max(v.abs()));
            match self.substep(to) {
                Ok(true) => substep *= 2.0,
                outcome if 2.0 * SMALLEST * interval.abs().min(1.0 / fastest) > substep.abs() => {
                    outcome.inspect_err(|_| self.state.copy_from(&start))?;
                }
                _ => {
                    self.state.copy_from(&before);
                    substep *= 0.5;
                }
            }
        }
        Ok(())
    }

    /// Advances to `t` in one substep. Returns whether the prediction was accurate.
    fn substep(&mut self, t: f64) -> Result<bool> {
        let h = t - self.state.t;
        let (mut change, mut error) = (0.0f64, 0.0f64);
        for i in 0..self.state.q.len() {
            let increment = h * (self.state.v[i] + 0.5 * h * self.state.a[i]);
            change = change.max(increment.abs());
            self.state.q[i] += increment;
            self.state.v[i] += h * self.state.a[i];
        }
        let predicted = self.state.q.clone();
        self.state.t = t;
        self.solve_position()?;
        for (i, predicted) in predicted.iter().enumerate().filter(|(i, _)| self.system.equation_of(*i).is_some()) {
            error = error.max((self.state.q[i] - predicted).abs());
        }
        Ok(error <= GOOD_PREDICTION * change.max(1e-6))
    }

    /// Assembles the current time point and solves for velocities, accelerations and multipliers.
    fn solve_position(&mut self) -> Result<()> {
        let Self { mechanism, system, state, .. } = self;
        state.prescribe(mechanism);
        self.projection = assemble(system, mechanism, state, self.assembly)?;
        self.projection.nearest_velocity = nearest_consistent_velocities(system, mechanism, state)?;
        self.solver.solve(system, mechanism, state)
    }
}

/// Outputs of a driven mechanism at `times` (s): one series per output, including reactions and driving forces.
///
/// # Errors
///
/// As [`KinematicDriver::new`] and [`KinematicDriver::advance_to`].
pub fn kinematics(mechanism: &Mechanism<f64>, assembly: Assembly, times: &[f64]) -> Result<Vec<Vec<f64>>> {
    let mut recorder = OutputRecorder::new(mechanism, times.len());
    let Some(&first) = times.first() else { return Ok(recorder.series) };
    let mut driver = KinematicDriver::new(mechanism, assembly, first)?;
    for &t in times {
        if t != driver.state.t {
            driver.advance_to(t)?;
        }
        recorder.record(mechanism, &driver.state)?;
    }
    Ok(recorder.series)
}
