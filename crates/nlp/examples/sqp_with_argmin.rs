//! Problem 71 of Hock & Schittkowski, solved by the SQP solver inside argmin's `Executor`.
//!
//! The executor provides observers, a time limit, timing and stop reasons. A run that was stopped can be continued.

use argmin::core::observers::{Observe, ObserverMode};
use argmin::core::{Error, Executor, KV, State, TerminationReason};
use linkwright_nlp::{Gradients, Program, ProgramStatus, Result, Sqp, SqpState, Values};
use nalgebra::DMatrix;
use std::time::Duration;

/// min x₁ x₄ (x₁ + x₂ + x₃) + x₃  subject to  x₁ x₂ x₃ x₄ ≥ 25,  x₁² + x₂² + x₃² + x₄² = 40,  1 ≤ xⱼ ≤ 5.
struct Hs71;

impl Program for Hs71 {
    fn variables(&self) -> usize {
        4
    }
    fn rows(&self) -> usize {
        2
    }
    fn lower(&self) -> &[f64] {
        &[1.0; 4]
    }
    fn upper(&self) -> &[f64] {
        &[5.0; 4]
    }
    fn is_equality(&self, row: usize) -> bool {
        row == 1
    }
    fn values(&self, x: &[f64]) -> Result<Values> {
        let objective = x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2];
        let squares: f64 = x.iter().map(|x| x * x).sum();
        Ok(Values { objective, rows: vec![25.0 - x.iter().product::<f64>(), squares - 40.0] })
    }
    fn gradients(&self, x: &[f64]) -> Result<Gradients> {
        let sum = x[0] + x[1] + x[2];
        let objective = vec![x[3] * (sum + x[0]), x[0] * x[3], x[0] * x[3] + 1.0, x[0] * sum];
        let product: f64 = x.iter().product();
        let rows = DMatrix::from_fn(2, 4, |row, j| if row == 0 { -product / x[j] } else { 2.0 * x[j] });
        Ok(Gradients { values: self.values(x)?, objective, rows })
    }
}

/// Prints a line for each iteration.
struct IterationLog;

impl Observe<SqpState> for IterationLog {
    fn observe_iter(&mut self, state: &SqpState, values: &KV) -> std::result::Result<(), Error> {
        let number = |name: &str| values.get(name).and_then(|value| value.get_float()).unwrap_or(f64::NAN);
        let (kkt, length) = (state.kkt.largest(), number("step length"));
        println!(
            "{:>3}  f = {:<20.13}  KKT residual {kkt:.1e}  step length {length}",
            state.get_iter(),
            state.objective
        );
        Ok(())
    }

    fn observe_final(&mut self, state: &SqpState) -> std::result::Result<(), Error> {
        println!("     {}", state.get_termination_status());
        Ok(())
    }
}

fn main() -> std::result::Result<(), Error> {
    let program = Hs71;
    let start = [1.0, 5.0, 5.0, 1.0];

    // Stop after three iterations.
    let stopped = Executor::new(&program as &dyn Program, Sqp::default())
        .configure(|state: SqpState| state.start(&start, 3))
        .add_observer(IterationLog, ObserverMode::Always)
        .run()?;
    assert_eq!(stopped.state.get_termination_reason(), Some(&TerminationReason::MaxItersReached));
    assert_eq!(stopped.state.solution(&program).status, ProgramStatus::IterationLimit);

    // Continue, with at most 50 iterations and one minute.
    let result = Executor::new(&program as &dyn Program, Sqp::default())
        .configure(|_| stopped.state.resume(50))
        .add_observer(IterationLog, ObserverMode::Always)
        .timeout(Duration::from_secs(60))
        .run()?;
    assert_eq!(result.state.get_termination_reason(), Some(&TerminationReason::SolverConverged));

    let solution = result.state.solution(&program);
    let time = result.state.get_time().expect("a time limit switches the timer on");
    println!("f = {:.7} after {} iterations in {time:.1?}", solution.objective, solution.iterations);
    assert_eq!(solution.status, ProgramStatus::Solved);
    // The optimum that Hock & Schittkowski print.
    assert!((solution.objective - 17.014_017_3).abs() < 5e-8);
    assert!(solution.kkt.largest() < 1e-9);
    Ok(())
}
