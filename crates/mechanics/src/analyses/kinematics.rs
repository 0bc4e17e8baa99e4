//! Kinematics and inverse dynamics of driven mechanisms.

use crate::analyses::assembly_branch::{AssemblyBranch, SingularPassage};
use crate::analyses::element_warnings::StateWatch;
use crate::analyses::sampling::OutputRecorder;
use crate::constraint_rank::{singular_instant, undetermined_coordinates};
use crate::events::impact;
use crate::initial_conditions::{AccelerationSolver, Assembly, Projection, assemble, nearest_consistent_velocities};
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;
use crate::{Error, Result};
use error::Seconds;

/// Largest error of a predicted coordinate for which a substep is accepted, relative to the terms |h v| + ½ h² |a| of its change.
const GOOD_PREDICTION: f64 = 0.2;

/// Smallest substep, as a fraction of the interval, or of the time in which the fastest coordinate moves by 1 rad or 1 m if that is shorter.
const SMALLEST: f64 = 1.0 / 256.0;

/// Smallest motion in a substep (m or rad), and smallest fraction of the interval, after one has ended on another branch of the assembly. A
/// motion that comes closer to a singular position passes it, others turn back. Positions of a mechanism with exact symmetry, such as a
/// parallelogram, have the distance of a square root of rounding.
const NEAR_BRANCHES: [f64; 2] = [3e-6, 1e-9];

/// Length of the substep across a singular position, relative to the smallest one.
const CROSSING: f64 = 8.0;

/// Factor by which such substeps are shortened. By halves they would end in the singular position itself, if that is in the middle.
const SHORTER_NEAR_BRANCHES: f64 = 0.43;

/// Terms of the next change of a position, relative to that in a substep, above which velocity and acceleration may be those of a singular
/// position.
const SUSPICIOUS: f64 = 10.0;

/// Independent part of the gradient of a constraint below which a position is singular: for given positions, and for those of a
/// suspicious substep, which are less accurate.
const SINGULAR: [f64; 2] = [1e-9, 1e-6];

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
    /// The branch of the assembly; `None` if it cannot be told from others.
    branch: Option<AssemblyBranch>,
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
        let mut driver = Self { mechanism, system, state, projection, assembly, solver, branch: None };
        let solved = driver.solve_position();
        driver.check_determined()?;
        solved?;
        driver.check_regular(SINGULAR[0])?;
        driver.branch = AssemblyBranch::of(&driver.system, mechanism, &driver.state);
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

    /// Checks that the position determines velocities, accelerations and reactions.
    fn check_regular(&self, largest_share: f64) -> Result<()> {
        singular_instant(largest_share, &self.system, self.mechanism, &self.state).map_or(Ok(()), Err)
    }

    /// Advances to the time `t` (s), predicting positions from velocities and accelerations. Returns the last singular position, where
    /// branches of its assembly meet, that the mechanism has passed.
    ///
    /// If the prediction is poor, the mechanism cannot be assembled from it, or the assembly is on another branch, the interval is
    /// shortened: the mechanism stays on its branch where this one continues, and otherwise goes on as smoothly as it came.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] if a joint cannot be closed, for example beyond a dead centre, or if `t` is the time of a singular position:
    /// velocities and reactions are not determined there.
    pub fn advance_to(&mut self, t: f64) -> Result<Option<SingularPassage>> {
        let start = self.state.clone();
        let interval = t - start.t;
        let (mut substep, mut is_near_branches, mut passage) = (interval, false, None);
        while self.state.t != t {
            let before = self.state.clone();
            let fastest = before.v.iter().fold(0.0, |fastest: f64, v| fastest.max(v.abs()));
            let [motion, fraction] = NEAR_BRANCHES;
            let is_last_attempt = match is_near_branches {
                true => 2.0 * fastest * substep.abs() < motion || substep.abs() < fraction * interval.abs(),
                false => 2.0 * SMALLEST * interval.abs().min(1.0 / fastest) > substep.abs(),
            };
            let mut outcome = self.substep(up_to(t, before.t, substep));
            let mut is_on_branch = outcome.is_err() || self.is_on_branch(&before);
            if is_near_branches && is_last_attempt && (outcome.is_err() || !is_on_branch) {
                // The singular position itself is stepped over.
                self.state.copy_from(&before);
                outcome = self.substep(up_to(t, before.t, CROSSING * substep)).map(|_| false);
                if outcome.is_ok() && !self.is_on_branch(&before) {
                    self.branch = AssemblyBranch::of(&self.system, self.mechanism, &self.state);
                    passage = SingularPassage::at(&self.system, self.mechanism, &self.state);
                }
                is_on_branch = true;
            }
            is_near_branches |= !is_on_branch;
            match outcome {
                Ok(true) if is_on_branch => substep *= 2.0,
                Ok(false) if is_on_branch && is_last_attempt => {}
                Err(error) if is_last_attempt => {
                    self.state.copy_from(&start);
                    return Err(error);
                }
                _ => {
                    self.state.copy_from(&before);
                    substep *= if is_near_branches { SHORTER_NEAR_BRANCHES } else { 0.5 };
                }
            }
        }
        Ok(passage)
    }

    /// Returns whether the state is on the branch of the one `before`.
    fn is_on_branch(&mut self, before: &State<f64>) -> bool {
        let Self { branch, system, mechanism, state, .. } = self;
        branch.as_mut().is_none_or(|branch| branch.continues(system, mechanism, before, state))
    }

    /// Advances to `t` in one substep. Returns whether the prediction of each coordinate was accurate.
    fn substep(&mut self, t: f64) -> Result<bool> {
        let h = t - self.state.t;
        let before = self.state.clone();
        for i in 0..self.state.q.len() {
            self.state.q[i] += h * (before.v[i] + 0.5 * h * before.a[i]);
            self.state.v[i] += h * before.a[i];
        }
        let predicted = self.state.q.clone();
        self.state.t = t;
        if let Err(error) = self.solve_position() {
            self.check_regular(SINGULAR[1])?;
            return Err(error);
        }
        let (mut is_accurate, mut moved, mut next) = (true, 0.0f64, 0.0f64);
        for i in (0..predicted.len()).filter(|&i| self.system.equation_of(i).is_some()) {
            // Coordinates have different units.
            let terms = |state: &State<f64>| (h * state.v[i]).abs() + 0.5 * h * h * state.a[i].abs();
            is_accurate &= (self.state.q[i] - predicted[i]).abs() <= GOOD_PREDICTION * terms(&before).max(1e-6);
            moved = moved.max((self.state.q[i] - before.q[i]).abs());
            next = next.max(terms(&self.state));
        }
        if next > SUSPICIOUS * moved {
            self.check_regular(SINGULAR[1])?;
        }
        Ok(is_accurate)
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

/// The end of a substep from `begin`, at most `t`.
fn up_to(t: f64, begin: f64, substep: f64) -> f64 {
    if (t - begin).abs() <= substep.abs() * (1.0 + 1e-9) { t } else { begin + substep }
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

/// Warnings about a driven mechanism on its way through the `times` (s): it changes the branch of its assembly in a singular position, such as a
/// parallelogram that becomes flat, or an element has a doubtful law, such as Euler angles without derivatives. Empty if the analysis fails,
/// which the analysis says.
pub fn warn_of_motion(mechanism: &Mechanism<f64>, assembly: &Assembly, times: &[f64]) -> Vec<String> {
    warnings_of_motion(mechanism, assembly, times).unwrap_or_default()
}

fn warnings_of_motion(mechanism: &Mechanism<f64>, assembly: &Assembly, times: &[f64]) -> Result<Vec<String>> {
    let (mut passage, mut states) = (None, StateWatch::default());
    let Some(&first) = times.first() else { return Ok(vec![]) };
    let mut driver = KinematicDriver::new(mechanism, *assembly, first)?;
    for &t in times {
        let passed = driver.advance_to(t)?;
        passage = passage.or(passed);
        states.add(mechanism, &driver.state);
    }
    let of_passage = |SingularPassage { time, constraint }| {
        format!(
            "{constraint}: at t = {} the mechanism passes a singular position, where branches of its assembly meet: it goes on as smoothly \
             as it came, and derivatives hold on each side only; if it must stay on the side where it was built, keep it away from this \
             position",
            Seconds(time)
        )
    };
    Ok(passage.map(of_passage).into_iter().chain(states.warnings()).collect())
}
