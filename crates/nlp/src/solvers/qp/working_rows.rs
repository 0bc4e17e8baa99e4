//! Programs with many rows and few active ones: the program is solved with some rows, and violated rows are added.
//!
//! A solution with some of the rows is a solution with all rows if it satisfies the others. If some rows are
//! inconsistent, so are all. With few variables only a few rows can be active, so this is much faster than an interior
//! point method with thousands of rows.

use crate::QuadraticProgram;
use crate::program::{Program, most_violated};
use crate::solution::Candidate;
use error::Result;

/// Violation in scaled units above which a row is added.
const VIOLATED: f64 = 1e-12;
/// Rounds after which all rows are used.
const ROUNDS: usize = 20;

/// Result for a scaled program.
#[derive(Clone, Debug)]
pub(super) enum ScaledResult {
    /// A point with multipliers and its residual.
    Point(Candidate, f64),
    /// The rows have no common point within the bounds.
    Infeasible { iterations: usize },
    /// The objective decreases without limit along a direction.
    Unbounded { iterations: usize },
}

/// Rows that can be active within the bounds; `None` if a row is violated at every point within the bounds.
fn possible_rows(program: &QuadraticProgram) -> Option<Vec<usize>> {
    let mut kept = vec![];
    for i in 0..program.offset.len() {
        let (mut least, mut most, mut size) = (program.offset[i], program.offset[i], program.offset[i].abs());
        for j in 0..program.gradient.len() {
            let a = program.rows[(i, j)];
            if a != 0.0 {
                let ends = (a * program.lower[j], a * program.upper[j]);
                (least, most) = (least + ends.0.min(ends.1), most + ends.0.max(ends.1));
                size = size.max(ends.0.abs()).max(ends.1.abs());
            }
        }
        let tolerance = 1e-10 * if size.is_finite() { size.max(1.0) } else { 1.0 };
        if least > tolerance || (program.equality[i] && most < -tolerance) {
            return None;
        }
        // A row of zeros that holds is never active.
        let zeros = program.rows.row(i).iter().all(|&a| a == 0.0);
        if !zeros && (program.equality[i] || most > -tolerance) {
            kept.push(i);
        }
    }
    Some(kept)
}

/// Solves `program` through `solve`, with working rows if it has many rows.
pub(super) fn solve(
    program: &QuadraticProgram,
    solve: impl Fn(&QuadraticProgram) -> Result<ScaledResult>,
) -> Result<ScaledResult> {
    let Some(possible) = possible_rows(program) else { return Ok(ScaledResult::Infeasible { iterations: 0 }) };
    let n = program.gradient.len();
    let few = 8 * n + 24;
    let mut iterations = 0;
    if possible.len() > 2 * few {
        let (mut kept, rest): (Vec<usize>, Vec<usize>) = possible.iter().partition(|&&i| program.equality[i]);
        kept.extend(most_violated(rest.into_iter(), |i| program.offset[i], f64::NEG_INFINITY, few / 2));
        for _ in 0..ROUNDS {
            let outcome = solve(&program.with_rows(&kept))?;
            match outcome {
                // The program may be bounded by the other rows.
                ScaledResult::Unbounded { .. } => break,
                ScaledResult::Infeasible { iterations: more } => {
                    return Ok(ScaledResult::Infeasible { iterations: iterations + more });
                }
                ScaledResult::Point(candidate, residual) => {
                    iterations += candidate.iterations;
                    let added = violated(program, &possible, &kept, &candidate.x, few / 2);
                    if added.is_empty() {
                        return Ok(with_all_rows(program, &kept, candidate, residual, iterations));
                    }
                    kept.extend(added);
                }
            }
            if 2 * kept.len() > possible.len() {
                break;
            }
        }
    }
    Ok(match solve(&program.with_rows(&possible))? {
        ScaledResult::Point(c, residual) => {
            let total = iterations + c.iterations;
            with_all_rows(program, &possible, c, residual, total)
        }
        other => other,
    })
}

/// The most violated rows that are not kept, at most `count`.
fn violated(program: &QuadraticProgram, possible: &[usize], kept: &[usize], x: &[f64], count: usize) -> Vec<usize> {
    let g = program.values_of_rows(&program.step(x));
    let mut is_kept = vec![false; program.rows()];
    kept.iter().for_each(|&i| is_kept[i] = true);
    let others = possible.iter().copied().filter(|&i| !is_kept[i]);
    most_violated(others, |i| g[i], VIOLATED, count)
}

/// The candidate with multipliers of all rows; zero for rows that are not kept.
fn with_all_rows(
    program: &QuadraticProgram,
    kept: &[usize],
    c: Candidate,
    residual: f64,
    iterations: usize,
) -> ScaledResult {
    let mut multipliers = vec![0.0; program.rows()];
    kept.iter().zip(&c.multipliers).for_each(|(&i, &λ)| multipliers[i] = λ);
    ScaledResult::Point(Candidate { multipliers, iterations, ..c }, residual)
}
