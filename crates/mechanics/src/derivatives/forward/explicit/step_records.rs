//! What a step leaves behind for its derivatives.

use crate::derivatives::forward::explicit::entries::Entries;
use crate::derivatives::forward::explicit::linearize::{ElementWorkspaces, Linearizer};
use crate::integrators::explicit::mechanism::{SAMPLE, StageRecord, StepRecord};
use crate::mechanism::Mechanism;
use crate::system::state::State;
use rayon::prelude::*;

/// What a step leaves behind for its derivatives, linearized once for all design variables.
pub(crate) struct StageRecords {
    /// What was done; it is lent by the flow while derivatives follow.
    pub tape: Option<StepRecord>,
    /// Derivatives of the rows at each visit.
    pub entries: Vec<Entries>,
    /// Derivatives of both projections, see [`Linearizer::projections`].
    pub projections: [Entries; 3],
    /// Whether there is nothing to project onto.
    pub is_free: bool,
    /// Positions before the projection with the correction of velocities.
    corrections: State<f64>,
    workspaces: Vec<ElementWorkspaces>,
}

impl StageRecords {
    /// Room for the visits of a mechanism in the state `state`.
    pub fn new(linearizer: &Linearizer, state: &State<f64>) -> Self {
        Self {
            tape: None,
            entries: vec![linearizer.entries(); SAMPLE + 1],
            projections: [(); 3].map(|()| linearizer.entries()),
            is_free: state.l.is_empty(),
            corrections: state.clone(),
            workspaces: vec![ElementWorkspaces::default(); SAMPLE + 2],
        }
    }

    /// What was done.
    pub fn tape(&self) -> &StepRecord {
        self.tape.as_ref().expect("the tape is here while derivatives follow")
    }

    /// Differentiates the rows at the visits of `slots`.
    pub fn linearize(
        &mut self,
        linearizer: &Linearizer,
        mechanism: &Mechanism<f64>,
        slots: std::ops::Range<usize>,
        parallel: bool,
    ) {
        let Self { tape, entries, workspaces, .. } = self;
        let visits = &tape.as_ref().expect("the tape is here").visits[slots.clone()];
        let tasks = (&mut entries[slots.clone()], visits, &mut workspaces[slots]);
        let task = |(entries, visit, workspaces): (&mut Entries, &StageRecord, &mut ElementWorkspaces)| {
            linearizer.accelerations(mechanism, &visit.state, workspaces, entries);
        };
        if parallel {
            tasks.into_par_iter().for_each(task);
        } else {
            tasks.0.iter_mut().zip(tasks.1).zip(tasks.2).for_each(|((e, v), r)| task((e, v, r)));
        }
    }

    /// Differentiates the projections at the end of a step.
    pub fn linearize_projections(&mut self, linearizer: &Linearizer, mechanism: &Mechanism<f64>) {
        let Self { tape, corrections, workspaces, projections, is_free, .. } = self;
        if *is_free {
            return;
        }
        let projected = &tape.as_ref().expect("the tape is here").projected;
        corrections.copy_from(&projected.before);
        corrections.a.copy_from_slice(&projected.after.a);
        corrections.l.copy_from_slice(&projected.after.l);
        linearizer.projections(mechanism, projected, corrections, &mut workspaces[SAMPLE + 1], projections);
    }
}
