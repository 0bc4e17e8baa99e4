//! Energy of conservative mechanisms: detects such mechanisms and records the energy drift of the integration scheme.

use crate::mechanism::element::{ElementState, ElementWorkspace, Family, Role};
use crate::mechanism::scalars::{Dual8, ElementScalar, StateScalar};
use crate::mechanism::{ElementInstance, Mechanism};
use crate::system::outputs::energy_in;
use crate::system::state::{State, gather};
use error::Seconds;

/// Energy drift of a conservative mechanism over the output times of a simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyDrift {
    /// Energy at the start, kinetic and potential, in J.
    pub start: f64,
    /// Largest change of the energy in magnitude, in J; negative if energy is lost.
    pub largest: f64,
    /// Time in s of this change.
    pub time: f64,
    /// Fraction of the largest kinetic energy above which the change is worth a warning: [`NOTABLE`], or less for steps with a small tolerance.
    pub limit: f64,
    /// First time in s at which the change exceeds this, if it does.
    pub notable_from: Option<f64>,
    /// Largest kinetic energy in J.
    pub kinetic: f64,
}

/// Fraction of the largest kinetic energy above which a change of the energy is worth a warning in any motion.
pub const NOTABLE: f64 = 0.01;

/// Such a fraction for adaptive steps, in units of their tolerance. Changes above it come from singular positions, or other
/// places at which the estimated errors are wrong.
const UNCONTROLLED: f64 = 1e5;

/// Least fraction for adaptive steps: rounding and long motions remain below it.
const SMALLEST_LIMIT: f64 = 1e-4;

/// Ratio of the change to the largest kinetic energy from which on the warning states it as a multiple, not in percent.
const MANY: f64 = 10.0;

/// Displacements from the start in m or rad at which the power of elements with switching functions is compared with the rate of
/// their energy: a rope that is slack at the start is taut far away.
const FAR: [f64; 4] = [0.0, 1.0, 1e2, 1e4];

/// Rounding error of the energy, as a fraction of its size.
const ROUNDING: f64 = 1e-9;

/// Velocity in m/s or rad/s below which a mechanism counts as at rest: the kinetic energy of all coordinates at this velocity counts
/// as rounding.
const AT_REST: f64 = 1e-6;

impl EnergyDrift {
    /// The change as a fraction of the largest kinetic energy.
    pub fn relative(&self) -> f64 {
        self.largest / self.kinetic.max(f64::MIN_POSITIVE)
    }

    /// Warning about a loss or gain of energy above the limit: its size, its first time and the remedy; `None` below it.
    pub fn warning(&self) -> Option<String> {
        let from = self.notable_from?;
        let (verb, damping) = if self.largest < 0.0 { ("loses", "less") } else { ("gains", "more") };
        let fraction = self.relative().abs();
        let share = match fraction < MANY {
            true => format!("{:.2} % of", 100.0 * fraction),
            false => format!("{fraction:.1e} times"),
        };
        let limit: f64 = format!("{:.0e}", 100.0 * self.limit).parse().unwrap_or(100.0 * self.limit);
        Some(format!(
            "the motion {verb} {:.3e} J, {share} its largest kinetic energy, although nothing in the mechanism does \
             work or dissipates: more than {limit} % from t = {from} on. Take shorter steps or a smaller tolerance, or {damping} \
             numerical damping; if the change is sudden, the mechanism passes a singular position there.",
            self.largest.abs(),
            from = Seconds(from)
        ))
    }
}

/// Records the energy of a mechanism that conserves it.
pub(crate) struct EnergyWatch {
    drift: Option<EnergyDrift>,
    /// Kinetic energy in J of rounding errors of the velocities.
    at_rest: f64,
    /// Times in s at which the change was larger than ever before, the change in J, and the rounding of the energy in J.
    records: Vec<[f64; 3]>,
    workspace: ElementWorkspace<f64>,
}

impl EnergyWatch {
    /// Recorder for a motion from the state `start`; it records nothing unless the mechanism is conservative.
    pub fn new(mechanism: &Mechanism<f64>, start: &State<f64>) -> Self {
        let mut workspace = ElementWorkspace::default();
        let drift = is_conservative(mechanism, start).then(|| {
            let [kinetic, potential] = energy_in(mechanism, start, &mut workspace);
            EnergyDrift {
                start: kinetic + potential,
                largest: 0.0,
                time: start.t,
                limit: NOTABLE,
                notable_from: None,
                kinetic,
            }
        });
        let mut slow = start.clone();
        slow.v.fill(AT_REST);
        let [at_rest, _] = energy_in(mechanism, &slow, &mut workspace);
        Self { drift, at_rest, records: Vec::new(), workspace }
    }

    /// Records the energy at `state`.
    pub fn add(&mut self, mechanism: &Mechanism<f64>, state: &State<f64>) {
        let Some(drift) = &mut self.drift else { return };
        let [kinetic, potential] = energy_in(mechanism, state, &mut self.workspace);
        let change = kinetic + potential - drift.start;
        drift.kinetic = drift.kinetic.max(kinetic);
        if change.abs() > drift.largest.abs() {
            (drift.largest, drift.time) = (change, state.t);
            let size = kinetic.abs() + potential.abs() + drift.start.abs();
            self.records.push([state.t, change.abs(), ROUNDING * size + self.at_rest]);
        }
    }

    /// The recorded change; `None` for mechanisms that do not conserve their energy. `tolerance` is that of steps whose error is controlled.
    pub fn finish(self, tolerance: Option<f64>) -> Option<EnergyDrift> {
        let drift = self.drift?;
        let limit = tolerance.map_or(NOTABLE, |tolerance| (UNCONTROLLED * tolerance).clamp(SMALLEST_LIMIT, NOTABLE));
        let is_notable = |[_, change, rounding]: &&[f64; 3]| *change > limit * drift.kinetic + rounding;
        let notable_from = self.records.iter().find(is_notable).map(|[t, _, _]| *t);
        Some(EnergyDrift { limit, notable_from, ..drift })
    }
}

/// Returns whether the energy of the mechanism is constant along every motion that satisfies its equations.
///
/// This is so if for any positions, velocities v, accelerations and multipliers λ each element has v·r = dE/dt + λ·dΦ/dt,
/// where r are its rows of the equations of motion and E is its energy: forces are gradients of the energy, and constraints
/// do not depend on time. The identity is evaluated in dual numbers along two motions through the state `start`, and far away from it
/// for elements that switch, such as ropes. Elements with functions of time or state, contacts and events can do work elsewhere;
/// mechanisms with them are not conservative.
pub fn is_conservative(mechanism: &Mechanism<f64>, start: &State<f64>) -> bool {
    let stands_still = |i: usize| {
        mechanism.coordinates[i].motion.as_ref().is_none_or(|(motion, parameters)| {
            let at = |t: f64| f64::motion(motion.as_ref(), parameters, t);
            let breaks = motion.breaks(parameters);
            let between = breaks.windows(2).map(|ends| ends[0] + 0.371 * (ends[1] - ends[0]));
            let times = [0.0, 0.371, 1.93].map(|t| start.t + t).into_iter().chain(between);
            let mut times = times.chain(breaks.last().map(|last| last + 1.0));
            times.all(|t| at(t) == [at(start.t)[0], 0.0, 0.0])
        })
    };
    let acts = |instance: &&ElementInstance<f64>| !instance.element.is_sensor();
    !mechanism.has_events()
        && (0..mechanism.coordinates.len()).all(stands_still)
        && mechanism.elements.iter().filter(acts).all(|instance| conserves(instance, start))
}

/// Returns whether an element does not add energy, see [`is_conservative`].
fn conserves(instance: &ElementInstance<f64>, start: &State<f64>) -> bool {
    let Some(descriptor) = instance.element.descriptor() else { return false };
    let is_function = |role: &Role| matches!(role, Role::TimeFunction | Role::StateFunction);
    if descriptor.family == Family::Contact || descriptor.inputs.iter().any(|input| is_function(&input.role)) {
        return false;
    }
    let moving = |value: f64, rate: f64| Dual8 { re: value, eps: [rate, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0] };
    let parameters: Vec<_> = instance.parameters.iter().map(|&p| moving(p, 0.0)).collect();
    let (mut plain, mut switching) = (ElementWorkspace::default(), Vec::new());
    gather(instance, start, &mut plain);
    let local = ElementState { p: &instance.parameters, ..plain.local(start.t) };
    f64::switching_functions(instance.element.as_ref(), &local, &mut switching);
    let places: &[f64] = if switching.is_empty() { &[0.0] } else { &FAR };
    let cases = places.iter().flat_map(|away| (0..2).map(move |motion| (*away, motion)));
    cases.into_iter().all(|(away, motion)| {
        let number = |i: usize, k: usize| (1.0 + 2.3 * i as f64 + 1.7 * k as f64 + 0.9 * f64::from(motion)).sin();
        let (n, mut workspace) = (plain.q.len(), ElementWorkspace::<Dual8>::default());
        workspace.q = (0..n).map(|i| moving(plain.q[i] + away * number(i, 3), number(i, 0))).collect();
        workspace.v = (0..n).map(|i| moving(number(i, 0), number(i, 1))).collect();
        workspace.a = (0..n).map(|i| moving(number(i, 1), 0.0)).collect();
        workspace.l = (0..plain.l.len()).map(|m| moving(number(m, 2), 0.0)).collect();
        let t = moving(start.t, 1.0);
        Dual8::residual_of(instance.element.as_ref(), &parameters, t, &mut workspace);
        let local = ElementState { p: &parameters, ..workspace.local(t) };
        let energy = Dual8::energy(instance.element.as_ref(), &local);
        let work = workspace.dynamics.iter().zip(&workspace.v).map(|(row, v)| row.re * v.re);
        let constraint = workspace.constraint.iter().zip(&workspace.l).map(|(row, l)| -row.eps[0] * l.re);
        let storage = [-energy.kinetic.eps[0], -energy.potential.eps[0]];
        let (mut sum, mut size) = (0.0, 0.0);
        for term in work.chain(constraint).chain(storage) {
            sum += term;
            size += term.abs();
        }
        sum.abs() <= ROUNDING * size
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A change of 0.06 % of the kinetic energy is more than steps with a tolerance of 1e-9 explain, and is possible with longer ones.
    #[test]
    fn a_change_is_compared_with_the_tolerance_of_the_steps() {
        let warning = |tolerance| {
            let drift =
                EnergyDrift { start: 0.0, largest: -6e-4, time: 2.0, limit: NOTABLE, notable_from: None, kinetic: 1.0 };
            let records = vec![[1.0, 5e-5, 0.0], [2.0, 6e-4, 0.0]];
            let workspace = ElementWorkspace::default();
            EnergyWatch { drift: Some(drift), at_rest: 0.0, records, workspace }.finish(tolerance).unwrap().warning()
        };
        assert!(warning(None).is_none() && warning(Some(1e-8)).is_none());
        let text = warning(Some(1e-9)).unwrap();
        assert!(
            text.contains("loses 6.000e-4 J, 0.06 % of") && text.contains("more than 0.01 % from t = 2 s on"),
            "{text}"
        );
    }
}
