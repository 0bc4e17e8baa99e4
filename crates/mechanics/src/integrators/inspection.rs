//! Inspection of long steps between their ends.

use crate::Result;
use crate::analyses::sampling::interpolate;
use crate::events::impact::make_consistent;
use crate::initial_conditions::AccelerationSolver;
use crate::integrators::consistent_ends;
use crate::integrators::event_location::{EventLocator, TrialStep};
use crate::integrators::generalized_alpha::{Integrator, Prescribed};
use crate::integrators::velocity_violation::consistent_velocities;
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;

/// Number of intervals of a motion between inspections, if output times are not closer.
const INTERVALS: usize = 100;

/// Fractions of each piece of a function of time at which steps are inspected. In the middle of a smooth ramp there is no acceleration.
const QUARTERS: [f64; 3] = [0.25, 0.5, 0.75];

/// Times at which long steps are inspected: loads and motions of short duration may lie between the ends of a step.
///
/// They are the output times, times that divide the motion evenly, and those at which functions of time change their form, with times
/// between these. A step that contains none of them is not inspected: it is shorter than the interval of the outputs.
#[derive(Clone, Debug, Default)]
pub struct InspectionTimes(Vec<f64>);

impl InspectionTimes {
    /// Times of a motion from `start` to `end` (s) with outputs at the increasing `times` (s) and functions of time that change their form
    /// at the increasing `breaks` (s).
    pub fn new(start: f64, end: f64, times: &[f64], breaks: &[f64]) -> Self {
        let even = (1..INTERVALS).map(|k| start + (end - start) * (k as f64 / INTERVALS as f64));
        let pieces = breaks.windows(2).flat_map(|ends| QUARTERS.map(|part| ends[0] + part * (ends[1] - ends[0])));
        let all = times.iter().chain(breaks).copied().chain(even).chain(pieces);
        let mut all: Vec<f64> = all.filter(|t| start < *t && *t < end).collect();
        all.sort_by(f64::total_cmp);
        let distance = 1e-9 * (end - start);
        all.dedup_by(|later, earlier| *later - *earlier <= distance);
        Self(all)
    }

    /// The times inside a step with these `ends` (s); times that equal an end up to rounding are excluded.
    pub fn inside(&self, [begin, end]: [f64; 2]) -> &[f64] {
        let tiny = 1e-9 * (end - begin);
        let first = self.0.partition_point(|t| *t <= begin + tiny);
        let last = self.0.partition_point(|t| *t < end - tiny);
        &self.0[first..last.max(first)]
    }
}

/// Times in s at which the functions of time of a mechanism change their form, increasing.
pub(crate) fn breaks(mechanism: &Mechanism<f64>) -> Vec<f64> {
    let motions = mechanism.coordinates.iter().filter_map(|coordinate| coordinate.motion.as_ref());
    let of_motions = motions.flat_map(|(motion, parameters)| motion.breaks(parameters));
    let of_elements = mechanism.elements.iter().flat_map(|instance| instance.element.breaks(&instance.parameters));
    let mut all: Vec<f64> = of_motions.chain(of_elements).filter(|t| t.is_finite()).collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

/// Inspection of implicit steps.
///
/// The state between the ends of a step is interpolated, and its accelerations and multipliers are those of the equations of motion. Where
/// nothing moves at the ends, the estimate of the local error is zero, whatever loads and prescribed motions do between them.
pub(crate) struct Inspector {
    system: System,
    solver: AccelerationSolver,
    at: State<f64>,
    is_projected: bool,
}

/// Largest deviation of accelerations inside a step from linear interpolation between its ends, in units of the deviation that changes
/// positions by the tolerance. For smooth motions it is smaller than the change of the accelerations over the step.
const LARGEST: f64 = 10.0;

impl Inspector {
    /// Workspace for the steps of `integrator`.
    pub fn new(integrator: &Integrator<'_>) -> Self {
        let is_projected = integrator.mechanism.has_consistent_velocities();
        let (system, at) = (integrator.system.clone(), integrator.step.new.clone());
        Self { system, solver: AccelerationSolver::default(), at, is_projected }
    }

    /// The first of the `times` inside the solved step before which an event has happened, or at which accelerations differ from those of
    /// the step by more than `tolerated` (m/s² or rad/s²).
    pub fn first_miss(
        &mut self,
        integrator: &mut Integrator<'_>,
        locator: &EventLocator,
        times: &InspectionTimes,
        tolerated: Option<f64>,
    ) -> Result<Option<f64>> {
        let mechanism = integrator.mechanism;
        let inside = times.inside([integrator.step.old.t, integrator.step.new.t]);
        if inside.is_empty() || (tolerated.is_none() && !mechanism.has_events()) {
            return Ok(None);
        }
        if mechanism.has_events() {
            integrator.begin()?;
        }
        let tolerated = tolerated.filter(|_| integrator.prescribed == Prescribed::Exact);
        let [old, _] = integrator.ends();
        for &t in inside {
            let step = &integrator.step;
            interpolate(&step.old, &step.new, t, &mut self.at);
            let line = self.at.a.clone();
            self.at.prescribe(mechanism);
            if !self.solve(integrator) {
                continue;
            }
            let is_far =
                |tolerated: f64| line.iter().zip(&self.at.a).any(|(a, b)| !((a - b).abs() <= LARGEST * tolerated));
            if locator.has_closed(mechanism, [old, &self.at], t - old.t) || tolerated.is_some_and(is_far) {
                return Ok(Some(t));
            }
        }
        Ok(None)
    }

    /// The consistent velocities at the beginning of the step, where it rescales those that violate the constraints.
    pub fn consistent_velocities(&mut self, integrator: &Integrator<'_>) -> Option<Vec<f64>> {
        let (mechanism, step) = (integrator.mechanism, &integrator.step);
        consistent_velocities(&mut self.system, mechanism, &step.old).map(|(consistent, _)| consistent.v)
    }

    /// The state at the event at the `end` of a step, see [`consistent_ends::at_event`].
    pub fn at_event(&mut self, mechanism: &Mechanism<f64>, end: &State<f64>) -> State<f64> {
        consistent_ends::at_event(&mut self.system, mechanism, end)
    }

    /// Solves for accelerations and multipliers. Returns false in singular positions, which steps may pass.
    fn solve(&mut self, integrator: &Integrator<'_>) -> bool {
        let Self { system, solver, at, is_projected } = self;
        let is_consistent = !*is_projected || make_consistent(system, integrator.mechanism, at).is_ok();
        is_consistent && solver.solve(system, integrator.mechanism, at).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_those_of_outputs_and_an_even_division() {
        let times = InspectionTimes::new(1.0, 3.0, &[1.0, 1.013, 2.0, 3.0], &[]);
        assert_eq!(times.0.len(), INTERVALS);
        assert_eq!(times.inside([1.0, 1.03]), [1.013, 1.02]);
        assert_eq!(times.inside([1.013, 1.02]), [0.0; 0]);
        assert_eq!(times.inside([2.99, 4.0]), [0.0; 0]);
        assert_eq!(InspectionTimes::new(0.0, 0.0, &[0.0], &[]).inside([0.0, 1.0]), [0.0; 0]);
    }
}
