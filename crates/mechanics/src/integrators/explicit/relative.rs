//! A mechanism in relative coordinates as a system of first-order equations.

use crate::Result;
use crate::integrators::explicit::constraint_drift::ConstraintDrift;
use crate::integrators::explicit::settings::{Coordinates, Explicit};
use crate::integrators::explicit::tableau::SAMPLE;
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;
use crate::tree::cut::TreeFactor;
use crate::tree::dynamics::ProjectionRecord;
use crate::tree::{Tree, TreeDynamics};

/// A mechanism in relative coordinates as a system of first-order equations.
pub(crate) struct RelativeRhs {
    pub dynamics: TreeDynamics,
    /// The projection at the end of the step onto the constraints of cut joints, for its derivatives.
    pub projection: ProjectionRecord,
    /// Joint coordinates and velocities at the end of the step before the projection of Euler parameters, for its derivatives.
    pub unprojected: Vec<f64>,
    /// Evaluations at each slot of the current step, if they are recorded; the last one is for outputs.
    pub stages: Option<Vec<RelativeStageRecord>>,
}

/// One evaluation of accelerations in relative coordinates.
#[derive(Clone)]
pub(crate) struct RelativeStageRecord {
    /// Time in s.
    pub t: f64,
    /// Joint coordinates, followed by their velocities.
    pub y: Vec<f64>,
    /// Accelerations of the joint coordinates.
    pub a: Vec<f64>,
    /// Multipliers of the cut joints.
    pub l: Vec<f64>,
    /// The factorized equations of motion.
    pub factor: TreeFactor,
}

impl RelativeRhs {
    /// The mechanism in the relative coordinates of `tree`, with a record of each step if `recorded`; and its components in `state`.
    pub fn new(
        tree: Tree,
        mechanism: &Mechanism<f64>,
        system: &System,
        state: &State<f64>,
        recorded: bool,
    ) -> (Self, Vec<f64>) {
        let y = tree.joint_state(mechanism, state);
        let dynamics = TreeDynamics::new(tree, mechanism, system);
        let a = vec![0.0; dynamics.tree.count];
        let l = vec![0.0; dynamics.tree.cuts.len()];
        let stage = || RelativeStageRecord { t: state.t, y: y.clone(), a, l, factor: dynamics.factor.clone() };
        let stages = recorded.then(|| vec![stage(); SAMPLE + 1]);
        let projection = ProjectionRecord::new(&dynamics.tree);
        (Self { dynamics, projection, unprojected: y.clone(), stages }, y)
    }

    /// Writes the rates of the components `y` at the time `t` (s) to `k`, and the state of all coordinates to `state`.
    pub fn rates(
        &mut self,
        mechanism: &Mechanism<f64>,
        slot: usize,
        (t, y): (f64, &[f64]),
        state: &mut State<f64>,
        k: &mut [f64],
    ) -> Result<()> {
        let (velocities, accelerations) = k.split_at_mut(self.dynamics.tree.count);
        velocities.copy_from_slice(&y[velocities.len()..]);
        self.dynamics.place(mechanism, t, y, state);
        self.dynamics.accelerations(mechanism, y, state, accelerations)?;
        if slot == SAMPLE {
            self.dynamics.complete(mechanism, (y, accelerations), state);
        }
        if let Some(stages) = &mut self.stages {
            let stage = &mut stages[slot];
            stage.t = t;
            stage.y.copy_from_slice(y);
            stage.a.copy_from_slice(accelerations);
            stage.l.iter_mut().zip(&self.dynamics.tree.cuts).for_each(|(l, cut)| *l = state.l[cut.multiplier]);
            std::mem::swap(&mut stage.factor, &mut self.dynamics.factor);
        }
        Ok(())
    }

    /// Projects the joint coordinates onto the constraints of cut joints, and Euler parameters among them onto their length one.
    pub fn project(
        &mut self,
        mechanism: &Mechanism<f64>,
        t: f64,
        y: &mut [f64],
        state: &mut State<f64>,
        drift: &mut ConstraintDrift,
    ) -> Result<()> {
        let Self { dynamics, projection, unprojected, stages } = self;
        if !dynamics.tree.cuts.is_empty() {
            let violations = dynamics.project(mechanism, t, y, state, projection)?;
            drift.set_trial(t, violations, [&state.q, &state.v]);
        }
        if stages.is_some() {
            unprojected.copy_from_slice(y);
        }
        let (q, v) = y.split_at_mut(dynamics.tree.count);
        dynamics.tree.space.normalize(q, v);
        Ok(())
    }
}

/// The tree of `mechanism` with the equations `system`, if relative coordinates are its unknowns.
///
/// # Errors
///
/// [`Error::Unsupported`] naming the part that relative coordinates do not support, if they are asked for.
pub(crate) fn relative_tree(mechanism: &Mechanism<f64>, system: &System, settings: &Explicit) -> Result<Option<Tree>> {
    match settings.coordinates {
        Coordinates::Absolute => Ok(None),
        Coordinates::Relative => Tree::new(mechanism, system).map(Some),
        Coordinates::Automatic if settings.has_tolerance_vectors() => Ok(None),
        Coordinates::Automatic => {
            let is_safe = |tree: &Tree| tree.is_open() && tree.mass_ratio(mechanism, system) < LARGEST_MASS_RATIO;
            Ok(Tree::new(mechanism, system).ok().filter(is_safe))
        }
    }
}

/// Ratio of the masses of two bodies above which the recursion of relative coordinates would lose too many digits.
const LARGEST_MASS_RATIO: f64 = 1e6;
