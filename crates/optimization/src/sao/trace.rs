//! Quantities of all trial steps of a run, updated step by step, so that the cost of a cycle does not grow with the number of cycles.

use super::Cycle;
use crate::approximation::{Asymptotes, DesignHistory};

/// Ratio of the objectives after and before a step below which the settled range is reset.
const COLLAPSE: f64 = 1e-8;
/// Number of objectives of accepted designs that are kept.
pub(super) const OBJECTIVES: usize = 21;

/// Quantities of the trial steps of a history, from which each step is read once.
#[derive(Clone, Debug, Default)]
pub(super) struct Trace {
    /// Number of steps that were read.
    steps: usize,
    /// The last one of them: accepted or not, design and objective.
    last: Option<(bool, Vec<f64>, f64)>,
    /// The accepted designs.
    pub designs: DesignHistory,
    /// Range of the objective over the accepted designs, without excursions: an excursion is a design to which the run was
    /// displaced, and the designs after it until the objective is as small as before.
    pub objective: Range,
    /// Settled range: that since the last step that reduced the objective by many orders of magnitude. A distant start gives no information
    /// about the size of the objective.
    pub settled: Range,
    /// The last of these objectives, at most [`OBJECTIVES`].
    pub objectives: Vec<f64>,
    /// The objective from which an excursion has begun.
    left: Option<f64>,
    /// That of the minimized quantity: of the peak in a min–max problem.
    pub stated: Range,
    /// True if a step was rejected.
    pub has_rejected: bool,
    /// Steps without a failure of which no other one has a smaller or equal violation and objective, by ascending violation.
    best: Vec<RankedStep>,
}

/// A step that may be the best one.
#[derive(Clone, Copy, Debug)]
struct RankedStep {
    violation: f64,
    objective: f64,
    step: usize,
}

/// Least and largest value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    least: f64,
    most: f64,
}

impl Default for Range {
    fn default() -> Self {
        Self { least: f64::INFINITY, most: f64::NEG_INFINITY }
    }
}

impl Range {
    fn add(&mut self, value: f64) {
        *self = Self { least: self.least.min(value), most: self.most.max(value) };
    }

    /// Largest minus least value; 0 without values.
    pub fn width(self) -> f64 {
        (self.most - self.least).max(0.0)
    }
}

impl Trace {
    /// True if it has read all steps of the history.
    pub fn is_complete(&self, history: &[Cycle]) -> bool {
        self.steps == history.len() && self.is_of(history)
    }

    /// Reads the steps that it has not read, and updates the distances by rules for asymptotes.
    pub fn follow_with(&mut self, rules: &[Asymptotes], history: &[Cycle]) {
        if !self.designs.follows(rules) {
            *self = Self { designs: DesignHistory::new(rules), ..Self::default() };
        }
        self.follow(history);
    }

    /// Reads the steps that it has not read; all of them if these are other ones.
    pub fn follow(&mut self, history: &[Cycle]) {
        if !self.is_of(history) {
            let rules = self.designs.rules();
            *self = Self { designs: DesignHistory::new(&rules), ..Self::default() };
        }
        history[self.steps..].iter().for_each(|cycle| self.read(cycle));
    }

    fn is_of(&self, history: &[Cycle]) -> bool {
        let Some((accepted, design, objective)) = &self.last else { return true };
        let last = history.get(self.steps - 1);
        last.is_some_and(|c| {
            c.accepted == *accepted && c.design == *design && c.objective.to_bits() == objective.to_bits()
        })
    }

    fn read(&mut self, cycle: &Cycle) {
        let stated = cycle.stated_objective();
        if cycle.accepted {
            self.designs.push(&cycle.design);
            if cycle.is_displaced {
                self.left = self.left.or(self.objectives.last().copied());
            } else if self.left.is_none_or(|left| cycle.objective <= left) {
                self.left = None;
                self.objective.add(cycle.objective);
                let is_collapse = |last: &f64| cycle.objective.abs() < COLLAPSE * last.abs();
                if self.objectives.last().is_some_and(is_collapse) {
                    self.settled = Range::default();
                }
                self.settled.add(cycle.objective);
                self.stated.add(stated);
                self.objectives.push(cycle.objective);
                let surplus = self.objectives.len().saturating_sub(OBJECTIVES);
                self.objectives.drain(..surplus);
            }
        }
        self.has_rejected |= !cycle.accepted;
        if cycle.failure.is_none() {
            self.consider(RankedStep { violation: cycle.violation(), objective: stated, step: self.steps });
        }
        self.last = Some((cycle.accepted, cycle.design.clone(), cycle.objective));
        self.steps += 1;
    }

    fn consider(&mut self, new: RankedStep) {
        let not_more = self.best.partition_point(|c| c.violation.total_cmp(&new.violation).is_le());
        if not_more > 0 && self.best[not_more - 1].objective.total_cmp(&new.objective).is_le() {
            return;
        }
        let first = self.best.partition_point(|c| c.violation.total_cmp(&new.violation).is_lt());
        let others = self.best[first..].iter().take_while(|c| c.objective.total_cmp(&new.objective).is_ge()).count();
        self.best.splice(first..first + others, [new]);
    }

    /// The step with the least objective among those whose violation is at most `tolerance`; without any, the one with the least
    /// violation. Among equal ones it is the earliest with the least violation.
    pub fn best(&self, tolerance: f64) -> Option<usize> {
        let feasible = self.best.partition_point(|c| c.violation <= tolerance);
        self.best.get(feasible.saturating_sub(1)).map(|c| c.step)
    }
}

#[cfg(test)]
mod tests {
    use crate::cases::impact_absorber;
    use crate::prelude::*;
    use crate::sao::Cycle;

    /// A history of many steps with random numbers: the best step is that of a search among all of them.
    #[test]
    fn the_best_step_is_that_of_a_search() {
        let problem = impact_absorber::comfort().unwrap();
        let mut state = Method::slp().start(&problem).unwrap();
        let first = state.history[0].clone();
        let mut draw = 1_u64;
        let mut random = || {
            draw = draw.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (draw >> 40) as f64 / f64::from(1 << 24)
        };
        for k in 0..300 {
            let [objective, violation] = [1.0 + random(), 10.0 * random().powi(2) - 0.5];
            let failure = (k % 7 == 3).then(|| "it failed".to_owned());
            let accepted = failure.is_none() && k % 3 > 0;
            let (peak, violation_pct) = (None, violation);
            let mut cycle = first.clone();
            (cycle.cycle, cycle.accepted, cycle.objective) = (k + 1, accepted, objective);
            (cycle.peak, cycle.violation_pct, cycle.failure) = (peak, violation_pct, failure);
            cycle.design[0] = objective;
            state.history.push(cycle);
            if k == 200 {
                state.follow(&[]);
            }
            for tolerance in [1e-9, 1e-3, 1e-2, 0.5] {
                let merit = |c: &&Cycle| {
                    let violation = c.violation_pct / 100.0;
                    if violation <= tolerance { [0.0, c.peak.unwrap_or(c.objective)] } else { [violation, 0.0] }
                };
                let all = state.history.iter().filter(|c| c.failure.is_none());
                let best = all.min_by(|a, b| merit(a).partial_cmp(&merit(b)).unwrap()).unwrap();
                let found = state.trace().best(tolerance).unwrap();
                assert_eq!(state.history[found].cycle, best.cycle, "step {k}, tolerance {tolerance}");
            }
        }
        // Another history of the same length is read again.
        state.follow(&[]);
        let objective = state.history[150].objective;
        state.history.truncate(151);
        assert!(state.trace().best(0.5).unwrap() <= 150 && objective > 0.0);
        assert!(matches!(state.trace(), std::borrow::Cow::Owned(_)));
        state.follow(&[]);
        assert!(matches!(state.trace(), std::borrow::Cow::Borrowed(_)));
    }
}
