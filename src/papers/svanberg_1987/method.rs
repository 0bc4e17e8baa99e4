//! The iteration of the paper: one approximation of all functions per iteration, without acceptance test.

use crate::approximation::Approximation;
use crate::problem::{Intermediates, Problem};
use crate::sao::{AcceptAlways, Method, MoveLimits, Region, Screening, StepVerdict, Stop, Trial};
use error::Result;

/// Move limits b/2 ≤ b ≤ 2b for positive variables, the same in every iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfToDouble;

impl MoveLimits for HalfToDouble {
    fn check(&self) -> Result<()> {
        Ok(())
    }

    fn start(&self, n: usize) -> Vec<f64> {
        vec![2.0; n]
    }

    fn region(&self, problem: &Problem, b: &[f64], factors: &[f64]) -> Region {
        let mut region = Region { lower: vec![], upper: vec![], is_limit: vec![] };
        for ((variable, b), factor) in problem.variables.iter().zip(b).zip(factors) {
            region.lower.push((b / factor).max(variable.lower));
            region.upper.push((b * factor).min(variable.upper));
            region.is_limit.push([b / factor > variable.lower, b * factor < variable.upper]);
        }
        region
    }

    fn update(&self, _: &mut [f64], _: &Trial, _: StepVerdict) {}
}

/// Replaces the explicit objective of a problem by one that is approximated like the constraints.
#[must_use]
pub fn with_approximated_objective(mut problem: Problem) -> Problem {
    problem.objective = problem.objective.directly(Intermediates::Identity);
    problem
}

/// Method that retains all constraints and accepts every design, for at most `iterations` iterations.
pub fn iterate_with(
    approximation: impl Approximation + 'static,
    move_limits: impl MoveLimits + 'static,
    iterations: usize,
) -> Method {
    Method {
        approximation: Box::new(approximation),
        screening: Screening { cutoff: None, ..Screening::default() },
        move_limits: Box::new(move_limits),
        globalization: Box::new(AcceptAlways),
        stop: Stop { accuracy: 1e-12, max_cycles: iterations, ..Stop::default() },
        ..Method::slp()
    }
}
