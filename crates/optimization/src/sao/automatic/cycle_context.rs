//! Data at the beginning of a cycle: the current design, its derivatives, the stored designs, and surrogates from these.

use super::candidates::{AcceptedPoint, ApproximationKind, FittedApproximation, Samples, gradient_changes};
use super::convergence::{is_feasible, is_feasible_by_itself, largest_change};
use super::lengths::Units;
use super::linearized::Linearized;
use super::quasi_newton::{SecantPair, damped_bfgs};
use super::surrogate::Surrogate;
use super::{Automatic, AutomaticState};
use crate::approximation::CycleData;
use crate::problem::{Problem, RowId};
use crate::sao::{Cycle, Region, RunState};
use nalgebra::{DMatrix, DVector};

/// Number of the last designs whose slopes show how much a row changes the objective.
const RECENT: usize = 4;

/// The current design with everything that a cycle derives from it.
pub(super) struct CycleContext<'a> {
    pub settings: &'a Automatic,
    pub problem: &'a Problem,
    pub state: &'a RunState,
    pub data: &'a CycleData,
    pub memory: &'a AutomaticState,
    pub linearized: Linearized,
    pub units: Units,
    pub violation: f64,
}

/// Kind of the surrogate of a cycle.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum SurrogateKind {
    /// All numbers are linear.
    Linear,
    /// Each number has the approximation with the best score.
    Selected,
    /// All numbers are linear, and the objective has a BFGS matrix of the Lagrangian.
    Lagrangian,
}

impl<'a> CycleContext<'a> {
    pub(super) fn new(
        settings: &'a Automatic,
        problem: &'a Problem,
        state: &'a RunState,
        data: &'a CycleData,
        memory: &'a AutomaticState,
    ) -> Self {
        let units = Units::new(memory, &state.trace(), &state.evaluation);
        let violation = units.violation(&state.evaluation.violations());
        let linearized = Linearized::new(problem, (&state.design, &state.responses, &state.evaluation), data)
            .without(|here, i| units.is_identity[here.rows[i].constraint]);
        Self { settings, problem, state, data, memory, linearized, units, violation }
    }

    pub(super) fn n(&self) -> usize {
        self.state.design.len()
    }

    /// Multipliers of the retained rows in the last accepted step; zero at the start.
    pub(super) fn last_multipliers(&self) -> Vec<f64> {
        let known = self.state.multipliers();
        let of = |row| known.iter().find(|(r, _)| r == row).map_or(0.0, |(_, λ)| *λ);
        self.linearized.rows.iter().map(of).collect()
    }

    pub(super) fn samples(&self, k: usize) -> Samples<'_> {
        Samples::new(self.problem, &self.memory.points, k, &self.units.lengths)
    }

    pub(super) fn current(&self) -> &AcceptedPoint {
        self.memory.points.last().expect("the current design is stored")
    }

    /// True at a feasible start where the gradient of the objective is zero: it may be a maximum or a saddle point.
    pub(super) fn is_flat_start(&self) -> bool {
        let trace = self.state.trace();
        let is_start = self.state.design.iter().enumerate().all(|(j, &b)| trace.designs.extent(j) == [b; 2]);
        is_start && self.violation == 0.0 && self.linearized.gradient.iter().all(|g| *g == 0.0)
    }

    /// True if a converged design may have the violation here; the limits are those of the automatic method times `factor`.
    pub(super) fn is_feasible(&self, factor: f64) -> bool {
        let violations = self.state.evaluation.violations();
        let in_terms = self.units.violation_in_terms(&violations, self.current(), &self.memory.start_lengths);
        let is_own = |(v, slopes): (&f64, &Vec<f64>)| {
            is_feasible_by_itself(*v, slopes, (&self.state.design, &self.units.lengths), factor)
        };
        is_feasible(self.violation, in_terms, factor) && violations.iter().zip(&self.current().slopes).all(is_own)
    }

    /// Objectives of the last accepted designs without excursions, and of the current one, which is the last.
    pub(super) fn objectives(&self) -> Vec<f64> {
        let (mut objectives, current) = (self.state.trace().objectives.clone(), self.state.evaluation.objective);
        if objectives.last() != Some(&current) {
            objectives.push(current);
        }
        objectives
    }

    /// The largest change of the objective by a rejected step from the current design.
    pub(super) fn rejected_change(&self) -> f64 {
        let rejected = self.state.history.iter().rev().take_while(|cycle| !cycle.accepted);
        let change = |cycle: &Cycle| (cycle.objective - self.state.evaluation.objective).abs();
        rejected.map(change).filter(|change| change.is_finite()).fold(0.0, f64::max)
    }

    /// The last stored designs, the newest first, without the first one and those to which the run was displaced.
    pub(super) fn last_points(&self, count: usize) -> impl Iterator<Item = &AcceptedPoint> {
        self.memory.points.iter().skip(1).rev().filter(|point| !point.is_displaced).take(count)
    }

    /// Largest change of the objective by a row, |λᵢ| Σ |∂cᵢ/∂bⱼ| ℓⱼ, with its slopes at the last designs.
    pub(super) fn largest_multiplier(&self, multipliers: &[f64]) -> f64 {
        let change = |point: &AcceptedPoint| {
            let one =
                |(λ, row): (&f64, &RowId)| λ.abs() * largest_change(&point.slopes[row.constraint], &self.units.lengths);
            multipliers.iter().zip(&self.linearized.rows).map(one).fold(0.0, f64::max)
        };
        self.last_points(RECENT).map(change).fold(0.0, f64::max)
    }

    /// The surrogate of this kind at the current design; `None` for the Lagrangian before a step along which it has positive curvature.
    pub(super) fn surrogate(&self, kind: SurrogateKind) -> Option<Surrogate<'_>> {
        let numbers = &self.current().numbers;
        let model = |k: usize| -> FittedApproximation {
            let samples = self.samples(k);
            let candidate = match kind {
                SurrogateKind::Selected => self.memory.scores.select(numbers[k].id.group()),
                SurrogateKind::Linear | SurrogateKind::Lagrangian => ApproximationKind::Linear,
            };
            let fitted = samples.fit(candidate).or_else(|| samples.fit(ApproximationKind::Linear));
            fitted.expect("a linear candidate needs the current gradient only")
        };
        let models = (0..numbers.len()).map(model).collect();
        let at = (&self.state.design[..], &self.state.responses);
        let mut surrogate = Surrogate::new(self.problem, at, self.data, numbers, models);
        surrogate.ignore(|row| self.units.is_identity[row.constraint]);
        if kind == SurrogateKind::Lagrangian {
            surrogate.hessian = Some(self.lagrangian_matrix()?);
        }
        Some(surrogate)
    }

    /// The weight of each number in the Lagrangian L = F + Σ λᵢ cᵢ at the current design.
    pub(super) fn lagrangian_weights(&self, multipliers: &[f64]) -> Vec<f64> {
        let surrogate = self.surrogate(SurrogateKind::Linear).expect("only the Lagrangian may be missing");
        let values: Vec<f64> = self.current().numbers.iter().map(|number| number.value).collect();
        surrogate.number_weights(multipliers, &values)
    }

    /// The steps between the stored designs and the changes of ∂L/∂b along them, in lengths, with these weights of the numbers in L.
    pub(super) fn lagrangian_steps(&self, weights: &[f64]) -> Vec<SecantPair> {
        let (n, points) = (self.n(), &self.memory.points);
        let mut changes = vec![vec![0.0; n]; points.len() - 1];
        for (number, weight) in self.current().numbers.iter().zip(weights).filter(|(_, w)| **w != 0.0) {
            for (sum, change) in changes.iter_mut().zip(gradient_changes(self.problem, points, number)) {
                let change = change.unwrap_or_else(|| vec![0.0; n]);
                sum.iter_mut().zip(change).for_each(|(s, c)| *s += weight * c);
            }
        }
        let l = &self.units.lengths;
        let pair = |(ends, change): (&[AcceptedPoint], &Vec<f64>)| {
            let step = DVector::from_fn(n, |j, _| (ends[1].design[j] - ends[0].design[j]) / l[j]);
            [step, DVector::from_fn(n, |j, _| change[j] * l[j])]
        };
        points.windows(2).zip(&changes).map(pair).collect()
    }

    /// The pairs of [`Self::lagrangian_steps`] whose step is not zero.
    pub(super) fn lagrangian_pairs(&self, weights: &[f64]) -> Vec<SecantPair> {
        let mut pairs = self.lagrangian_steps(weights);
        pairs.retain(|[step, _]| step.norm() > 0.0);
        pairs
    }

    /// The damped BFGS matrix of the Lagrangian; `None` before a step along which it has positive curvature.
    pub(super) fn lagrangian_matrix(&self) -> Option<DMatrix<f64>> {
        let scaled = damped_bfgs(&self.lagrangian_pairs(&self.lagrangian_weights(&self.last_multipliers())))?;
        let (n, l) = (self.n(), &self.units.lengths);
        Some(DMatrix::from_fn(n, n, |i, j| scaled[(i, j)] / l[i] / l[j]))
    }

    /// The surrogate with the best score, with corrections through the rejected designs.
    pub(super) fn selected_surrogate(&self) -> Surrogate<'_> {
        let lagrangian =
            if self.memory.scores.prefers_lagrangian() { self.surrogate(SurrogateKind::Lagrangian) } else { None };
        let mut surrogate = lagrangian
            .unwrap_or_else(|| self.surrogate(SurrogateKind::Selected).expect("only the Lagrangian may be missing"));
        for point in &self.memory.rejected {
            surrogate.correct(&point.design, &point.values, &self.units.lengths);
        }
        surrogate
    }

    /// The sides of a box of half widths `widths` in the design space.
    pub(super) fn sides(&self, widths: &[f64]) -> Region {
        Region::around(self.problem, &self.state.design, widths)
    }
}
