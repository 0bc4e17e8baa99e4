//! A subproblem of the method of moving asymptotes, solved by the dual and by the interior point solver.
//!
//! The dual solver is made for few rows and many variables, the interior point solver for many rows. On a program that
//! both can solve, they agree.

use linkwright_nlp::separable::MovingAsymptotesProgram;
use linkwright_nlp::{ConcurrentSolver, Falk, InteriorPoint, ProgramStatus, Result};

/// Minimizes Σ p₀ⱼ / (2.5 − xⱼ), which increases, with `m` rows Σ qᵢⱼ / (xⱼ + 0.5) ≤ rᵢ that decrease, 0 ≤ xⱼ ≤ 2.
fn subproblem(n: usize, m: usize) -> Result<MovingAsymptotesProgram> {
    let functions = m + 1;
    // Coefficients between 0.5 and 1 without a pattern; the entry of function i and variable j is at j · functions + i.
    let coefficient = |k: usize| 0.5 + 0.5 * (0.618_033_988_75 * k as f64).fract();
    let (mut p, mut q) = (vec![0.0; n * functions], vec![0.0; n * functions]);
    for j in 0..n {
        p[j * functions] = coefficient(j);
        for i in 1..functions {
            q[j * functions + i] = coefficient(31 * j + 17 * i);
        }
    }
    // The point xⱼ = 1 satisfies each row with a margin of five percent.
    let at_one = |i: usize| (0..n).map(|j| q[j * functions + i] / 1.5).sum::<f64>();
    let constants = (0..functions).map(|i| if i == 0 { 0.0 } else { -1.05 * at_one(i) }).collect();
    MovingAsymptotesProgram::new(constants, p, q, (vec![-0.5; n], vec![2.5; n]), (vec![0.0; n], vec![2.0; n]))
}

fn main() -> Result<()> {
    let (n, m) = (2_000, 5);
    let program = subproblem(n, m)?;
    let solvers = ConcurrentSolver::new(Falk::default(), InteriorPoint::default());
    let comparison = solvers.compare(&program, &vec![1.0; n])?;
    for (name, solution) in comparison.names.iter().zip(&comparison.solutions) {
        println!(
            "{name:<15} f = {:.12}  {:>2} iterations  KKT residual {:.1e}",
            solution.objective,
            solution.iterations,
            solution.kkt.largest()
        );
        assert_eq!(solution.status, ProgramStatus::Solved);
        assert!(solution.kkt.largest() < 1e-8);
    }
    println!(
        "largest difference of a variable {:.1e}, of a multiplier {:.1e}",
        comparison.variables, comparison.multipliers
    );
    assert!(comparison.agrees(1e-9) && comparison.variables < 1e-6);
    Ok(())
}
