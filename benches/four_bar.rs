//! Cost of derivatives and of a whole optimization of the flexible four-bar, in analyses: `cargo bench --bench four_bar`.
//!
//! CPU times of one thread: the minimum of several batches, in which the tasks alternate. More threads reduce the elapsed time of
//! derivatives but add waiting time to the CPU time.

mod cpu;

use cpu::in_turns;
use linkwright::Result;
use linkwright::cases::four_bar::{DerivativeMethod, StressConstrained, method, robust_method};
use linkwright::problem::{Problem, ResponseAt};
use linkwright::sao::Method;

const DESIGN: [f64; 3] = [0.0385, 0.0252, 0.02];

fn problem(derivatives: DerivativeMethod) -> Result<Problem> {
    StressConstrained { derivatives, ..StressConstrained::as_published() }.problem()
}

/// The bending moments whose stresses are retained at this design.
fn retained(problem: &Problem) -> Result<Vec<ResponseAt>> {
    let evaluation = problem.evaluate(&DESIGN, &problem.analyze(&DESIGN)?)?;
    let rows = method().screening.retain(problem, &evaluation);
    // 42 constraints come in pairs, one response each.
    let mut wanted: Vec<ResponseAt> =
        rows.iter().map(|r| ResponseAt { response: r.constraint / 2, point: r.point }).collect();
    wanted.sort_unstable();
    wanted.dedup();
    Ok(wanted)
}

/// Prints the cost of the derivatives at one design; returns that of the direct ones, in analyses.
fn print_derivatives() -> Result<f64> {
    let (plain, direct) = (problem(DerivativeMethod::Forward(1e-3))?, problem(DerivativeMethod::Direct)?);
    let wanted = retained(&plain)?;
    let (here, there) = (plain.analyze(&DESIGN)?, direct.analyze(&DESIGN)?);
    let mut analysis = || drop(direct.analyze(&DESIGN).expect("the design can be analysed"));
    let mut directly = || drop(direct.sensitivities(&DESIGN, &there, &wanted).expect("as above"));
    let mut by_differences = || drop(plain.sensitivities(&DESIGN, &here, &wanted).expect("as above"));
    let [unit, directly, differences] = in_turns(7, [&mut analysis, &mut directly, &mut by_differences]);
    println!("one analysis: {:.2} ms", unit * 1e3);
    println!("all three derivatives, directly:       {:.2} analyses", directly / unit);
    println!("all three derivatives, by differences: {:.2} analyses", differences / unit);
    Ok(directly / unit)
}

/// Prints the cost of a run from the paper's start, counted and measured in analyses.
///
/// A sensitivity analysis counts as `derivatives` analyses; the measured cost includes subproblems and bookkeeping. The paper's
/// run takes 19 + 13 · 3 = 58 analyses.
fn print_run(name: &str, method: &Method, derivatives: f64) -> Result<()> {
    let problem = problem(DerivativeMethod::Direct)?;
    let counters = method.solve(&problem, |_| ())?.counters;
    let counted = counters.analyses as f64 + counters.sensitivity_analyses as f64 * derivatives;
    let mut run = || drop(method.solve(&problem, |_| ()).expect("it ran before"));
    let mut analysis = || drop(problem.analyze(&DESIGN).expect("the design can be analysed"));
    let [spent, unit] = in_turns(7, [&mut run, &mut analysis]);
    let spent = spent / unit;
    println!(
        "{name}: {} analyses and {} sensitivity analyses cost {counted:.1} analyses, {:.0} % of the paper's 58; \
         measured {spent:.1} with the subproblems",
        counters.analyses,
        counters.sensitivity_analyses,
        counted / 58.0 * 100.0
    );
    Ok(())
}

fn main() -> Result<()> {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread can be created").install(all)
}

fn all() -> Result<()> {
    let derivatives = print_derivatives()?;
    print_run("robust_method", &robust_method(), derivatives)?;
    print_run("the paper's rules", &method(), derivatives)
}
