//! The point of given multipliers, judged variable by variable: nothing of size m × n is stored.

use super::FalkState;
use super::evaluation::minimizer;
use crate::kkt::{KktAccumulator, VariableBounds};
use crate::separable::CHUNK;
use crate::{Evaluations, Solution, Status};
use crate::{Program, Separable};
use rayon::prelude::*;

/// The solution at the multipliers of `state`, with values and KKT residual from fresh evaluations.
pub(super) fn certified(program: &dyn Program, parts: &dyn Separable, start: &[f64], state: &FalkState) -> Solution {
    let (multipliers, status) = (state.multipliers.clone(), state.verdict.unwrap_or(Status::IterationLimit));
    let weights: Vec<f64> = [1.0].into_iter().chain(multipliers.iter().copied()).collect();
    let x = minimizer(parts, &weights);
    let (mut lower, mut upper) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    let sides = lower.par_chunks_mut(CHUNK).zip(upper.par_chunks_mut(CHUNK));
    let chunks: Vec<(Vec<f64>, KktAccumulator)> = sides
        .enumerate()
        .map(|(c, (lower, upper))| survey(program, parts, (start, &x, &multipliers), c * CHUNK, lower, upper))
        .collect();
    let mut sums: Vec<f64> = (0..weights.len()).map(|i| parts.constant(i)).collect();
    let mut all = KktAccumulator::new(multipliers.len());
    for (values, survey) in &chunks {
        sums.iter_mut().zip(values).for_each(|(a, b)| *a += b);
        all.join(survey);
    }
    let kkt = all.finish(program, &sums[1..], &multipliers, &[]);
    Solution {
        x,
        objective: sums[0],
        rows: sums[1..].to_vec(),
        multipliers,
        lower_multipliers: lower,
        upper_multipliers: upper,
        iterations: 0,
        evaluations: Evaluations::default(),
        status,
        relaxation: None,
        relaxed_rows: vec![],
        kkt,
    }
}

/// Sums of the values and the survey of the variables from `first` on; their bounds are priced.
fn survey(
    program: &dyn Program,
    parts: &dyn Separable,
    (start, x, λ): (&[f64], &[f64], &[f64]),
    first: usize,
    lower: &mut [f64],
    upper: &mut [f64],
) -> (Vec<f64>, KktAccumulator) {
    let functions = λ.len() + 1;
    let (mut sums, mut survey) = (vec![0.0; functions], KktAccumulator::new(λ.len()));
    let (mut values, mut slopes) = (vec![0.0; functions], vec![0.0; functions]);
    let (least, most) = (program.lower(), program.upper());
    for k in 0..lower.len() {
        let j = first + k;
        parts.column(j, x[j], &mut values, &mut slopes);
        sums.iter_mut().zip(&values).for_each(|(a, b)| *a += b);
        let sides = VariableBounds::of((least[j], most[j]), x[j], start[j]);
        let objective = [slopes[0], parts.term(0, j, start[j]).slope];
        [lower[k], upper[k]] = survey.add(&sides, objective, &slopes[1..], λ, |slope| sides.multipliers(slope));
    }
    (sums, survey)
}
