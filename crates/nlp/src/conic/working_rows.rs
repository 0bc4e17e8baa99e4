//! Many rows, few of them active: the program is solved with some rows, and violated ones are added.
//!
//! A point that solves the program with some of its rows and satisfies the others solves the program; if some rows
//! contradict each other, so do all. With few variables only a few rows can be active, so this is much faster than
//! to hand thousands of rows to an interior point method.

use crate::Program;
use crate::QuadraticProgram;
use crate::solver::Candidate;
use error::Result;

/// A row is violated above this, in scaled units.
const VIOLATED: f64 = 1e-12;
/// Rounds before all rows are taken.
const ROUNDS: usize = 20;

/// What became of a scaled program.
#[derive(Clone, Debug)]
pub(super) enum Outcome {
    /// A point with multipliers and its residual.
    Point(Candidate, f64),
    /// The rows contradict each other, as far as one can tell.
    Infeasible { iterations: usize },
    /// A direction along which the objective falls for ever.
    Unbounded { iterations: usize },
}

/// Rows that some point of the box violates or touches; `None` where a row is violated all over the box.
pub(super) fn possible_rows(program: &QuadraticProgram) -> Option<Vec<usize>> {
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
        let doubt = 1e-10 * if size.is_finite() { size.max(1.0) } else { 1.0 };
        if least > doubt || (program.equality[i] && most < -doubt) {
            return None;
        }
        // A row of zeros that holds is met everywhere.
        let zeros = program.rows.row(i).iter().all(|&a| a == 0.0);
        if !zeros && (program.equality[i] || most > -doubt) {
            kept.push(i);
        }
    }
    Some(kept)
}

/// Solves `program` through `solve`, row by row if it has many.
pub(super) fn solve(
    program: &QuadraticProgram,
    solve: impl Fn(&QuadraticProgram) -> Result<Outcome>,
) -> Result<Outcome> {
    let Some(possible) = possible_rows(program) else { return Ok(Outcome::Infeasible { iterations: 0 }) };
    let n = program.gradient.len();
    let few = 8 * n + 24;
    let mut iterations = 0;
    if possible.len() > 2 * few {
        let (mut kept, mut rest): (Vec<usize>, Vec<usize>) = possible.iter().partition(|&&i| program.equality[i]);
        rest.sort_by(|&a, &b| program.offset[b].total_cmp(&program.offset[a]));
        kept.extend(rest.into_iter().take(few / 2));
        for _ in 0..ROUNDS {
            let outcome = solve(&program.with_rows(&kept))?;
            match outcome {
                // Without all rows nothing is known about the bottom.
                Outcome::Unbounded { .. } => break,
                Outcome::Infeasible { iterations: more } => {
                    return Ok(Outcome::Infeasible { iterations: iterations + more });
                }
                Outcome::Point(candidate, residual) => {
                    iterations += candidate.iterations;
                    let added = violated(program, &possible, &kept, &candidate.x, few / 2);
                    if added.is_empty() {
                        return Ok(spread(program, &kept, candidate, residual, iterations));
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
        Outcome::Point(c, residual) => {
            let total = iterations + c.iterations;
            spread(program, &possible, c, residual, total)
        }
        other => other,
    })
}

/// The most violated rows beyond those kept, at most `count`.
fn violated(program: &QuadraticProgram, possible: &[usize], kept: &[usize], x: &[f64], count: usize) -> Vec<usize> {
    let g = program.values_of_rows(&program.step(x));
    let mut held = vec![false; program.rows()];
    kept.iter().for_each(|&i| held[i] = true);
    let mut out: Vec<usize> = possible.iter().copied().filter(|&i| !held[i] && g[i] > VIOLATED).collect();
    out.sort_by(|&a, &b| g[b].total_cmp(&g[a]));
    out.truncate(count);
    out
}

/// Multipliers of the kept rows at their places among all rows.
fn spread(program: &QuadraticProgram, kept: &[usize], c: Candidate, residual: f64, iterations: usize) -> Outcome {
    let mut multipliers = vec![0.0; program.rows()];
    kept.iter().zip(&c.multipliers).for_each(|(&i, &λ)| multipliers[i] = λ);
    Outcome::Point(Candidate { multipliers, iterations, ..c }, residual)
}
