//! A primal–dual interior point method for separable convex programs.

mod newton;
mod point;
mod stiffness;
mod working_rows;

use super::kkt::supported;
use super::normalized::Normalized;
use super::solver::{Candidate, SubproblemSolver, check_finite, feasible_start, separable_part};
use super::{Evaluations, Solution, Status, elastic};
use crate::{Gradients, Program};
use error::{Error, Result};
use point::Frame;
use std::cell::Cell;

/// KKT residual up to which a point is called a solution.
const ACCEPTED: f64 = 1e-8;
/// Newton steps for one value of the perturbation.
const INNER: usize = 60;
/// Halvings of a step.
const HALVINGS: usize = 30;

/// The solver of separable convex programs with many rows, or with terms that have no curvature, and of those that are separable
/// but for a convex quadratic of low rank in the objective ([`Program::coupled`]).
///
/// Newton's method on the optimality conditions with complementarity λ s = μ, μ → 0. The system is reduced to the
/// smaller of n and m, and rows are taken in as they are violated where they are many. A program without a feasible point
/// is relaxed and reported.
///
/// **Source.** Svanberg, *MMA and GCMMA – two methods for nonlinear optimization* (2007), section 5; Wright,
/// *Primal-Dual Interior-Point Methods* (1997).
///
/// **Errors.** [`Error::Definition`] if the program is neither [`Separable`](crate::Separable) nor that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InteriorPoint {
    tolerance: f64,
    iterations: usize,
}

impl Default for InteriorPoint {
    fn default() -> Self {
        Self { tolerance: 1e-12, iterations: 300 }
    }
}

impl InteriorPoint {
    /// With settings:
    ///
    /// * `tolerance` — the last value of the perturbation μ, in units of the program at the start, in 1e-14 … 1e-4 (1e-12);
    /// * `iterations` — Newton steps at most, at least 1 (300).
    ///
    /// **Errors.** [`Error::Option`] outside these ranges.
    pub fn new(tolerance: f64, iterations: usize) -> Result<Self> {
        let good = (1e-14..=1e-4).contains(&tolerance);
        Error::check_option("tolerance of the interior point solver", "between 1e-14 and 1e-4", tolerance, good)?;
        let got = iterations as f64;
        Error::check_option("iterations of the interior point solver", "at least 1", got, iterations >= 1)?;
        Ok(Self { tolerance, iterations })
    }

    /// One run, without relaxation: with rows as they are violated where they are many, with all of them if that fails.
    fn thorough(&self, program: &dyn Program, start: &[f64]) -> Result<Run> {
        if let Some(parts) = program.separable() {
            let start = feasible_start(program, start)?;
            let here = program.gradients(&start)?;
            check_finite(program, &start, &here)?;
            let run = working_rows::solve(self, parts, &start, &here)?;
            if let Some(run) = run.filter(|run| run.solution.status == Status::Solved) {
                return Ok(run);
            }
        }
        self.run(program, start)
    }

    /// One run, without relaxation.
    fn run(&self, program: &dyn Program, start: &[f64]) -> Result<Run> {
        let start = feasible_start(program, start)?;
        let here = program.gradients(&start)?;
        check_finite(program, &start, &here)?;
        let normalized = Normalized::new(program, &start, &here);
        let (candidate, evaluations) = self.central_path(&Frame::new(&normalized), &normalized.inward(&start))?;
        let candidate = snapped(program, normalized.restore(candidate));
        let gradients = program.gradients(&candidate.x)?;
        let certified = |c: Candidate| c.certified(program, &start, evaluations, &gradients, Some(&here.objective));
        let mut solution = certified(multipliers(program, candidate.clone(), &gradients));
        if !(solution.kkt.largest() <= ACCEPTED) {
            // Near a bound that is hardly active the multipliers of the central path are the better ones.
            let central = certified(candidate);
            if central.kkt.largest() < solution.kkt.largest() {
                solution = central;
            }
        }
        if solution.kkt.largest() <= ACCEPTED {
            solution.status = Status::Solved;
        }
        Ok(Run { solution, first: here.objective })
    }

    /// Follows μ → 0 from the middle of the box.
    fn central_path(&self, frame: &Frame<'_>, start: &[f64]) -> Result<(Candidate, Evaluations)> {
        let mut p = frame.inside(start)?;
        let mut at = frame.local(&p)?;
        let (mut μ, mut steps, mut evaluations) = (1.0f64, 0, 2);
        'path: loop {
            for _ in 0..INNER {
                let (largest, squares) = frame.residual(&p, &at, μ);
                if largest <= 0.9 * μ || steps == self.iterations {
                    break;
                }
                steps += 1;
                let Some(d) = newton::step(frame, &p, &at, μ) else { break 'path };
                let mut share = frame.longest(&p, &d);
                let mut accepted = false;
                for _ in 0..HALVINGS {
                    let next = frame.moved(&p, &d, share);
                    let there = frame.local(&next)?;
                    evaluations += 1;
                    if frame.residual(&next, &there, μ).1 < squares {
                        (p, at, accepted) = (next, there, true);
                        break;
                    }
                    share *= 0.5;
                }
                if !accepted {
                    break;
                }
            }
            if μ <= self.tolerance || steps == self.iterations {
                break;
            }
            μ = (0.1 * μ).min(μ.powf(1.5)).max(self.tolerance);
        }
        let status = if steps == self.iterations { Status::IterationLimit } else { Status::Stalled };
        let c =
            Candidate {
                x: p.x, multipliers: p.λ, lower: p.ξ, upper: p.η, iterations: steps, status, relaxation: None
            };
        Ok((c, Evaluations { values: 1, gradients: evaluations, hessians: steps }))
    }
}

struct Run {
    solution: Solution,
    first: Vec<f64>,
}

/// The candidate with variables whose multiplier exceeds their distance to a bound put on it, where that is tiny.
fn snapped(program: &dyn Program, mut c: Candidate) -> Candidate {
    const TINY: f64 = 1e-10;
    for (j, x) in c.x.iter_mut().enumerate() {
        let (l, u) = (program.lower()[j], program.upper()[j]);
        let range = if (u - l).is_finite() { u - l } else { x.abs().max(1.0) };
        if *x - l <= TINY * range {
            *x = l;
        } else if u - *x <= TINY * range {
            *x = u;
        }
    }
    c
}

/// Multipliers of the bounds from the slope of the Lagrangian, none for variables off their bounds.
fn multipliers(program: &dyn Program, mut c: Candidate, g: &Gradients) -> Candidate {
    (c.lower, c.upper) = super::falk::reduced(program, &c.x, g, &c.multipliers);
    c
}

impl SubproblemSolver for InteriorPoint {
    fn name(&self) -> &'static str {
        "interior point"
    }

    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        let parts = separable_part(program).ok_or_else(|| {
            let why = "the program is not a sum over its variables, not even but for a quadratic of low rank";
            Error::definition("interior point solver", why, "use the automatic solver")
        })?;
        let start = feasible_start(program, start)?;
        let here = program.gradients(&start)?;
        check_finite(program, &start, &here)?;
        let run = match working_rows::solve(self, parts, &start, &here)? {
            Some(run) => run,
            None => self.run(program, &start)?,
        };
        let mut solution = run.solution;
        if solution.status != Status::Solved {
            let total = Cell::new(solution.evaluations);
            let plain = |p: &dyn Program, x: &[f64]| {
                let run = self.thorough(p, x)?;
                total.set(total.get() + run.solution.evaluations);
                Ok(Candidate::from(run.solution))
            };
            let settled = elastic::settle(program, &start, solution.into(), &plain)?;
            let gradients = program.gradients(&settled.x)?;
            solution = settled.certified(program, &start, total.get(), &gradients, Some(&run.first));
        }
        solution.status = supported(solution.status, &solution.kkt, 10.0 * ACCEPTED);
        Ok(solution)
    }
}
