//! What do sensitivities cost beside an analysis, and a whole optimization? `cargo bench --bench four_bar`.
//!
//! CPU times of all threads, the least of several batches.

mod cpu;

use cpu::least;
use linkwright::Result;
use linkwright::library::four_bar::{Derivatives, StressConstrained, method, robust_method};
use linkwright::problem::{Instant, Problem};
use linkwright::sao::Method;

const DESIGN: [f64; 3] = [0.0385, 0.0252, 0.02];

fn problem(derivatives: Derivatives) -> Result<Problem> {
    StressConstrained { derivatives, ..StressConstrained::as_published() }.problem()
}

/// The moments whose stresses are kept at this design.
fn kept(problem: &Problem) -> Result<Vec<Instant>> {
    let evaluation = problem.evaluate(&DESIGN, &problem.analyze(&DESIGN)?)?;
    let rows = method().screening.keep(problem, &evaluation);
    // 42 constraints come in pairs, one response each.
    let mut wanted: Vec<Instant> =
        rows.iter().map(|r| Instant { response: r.constraint / 2, point: r.point }).collect();
    wanted.sort_unstable();
    wanted.dedup();
    Ok(wanted)
}

/// Analyses and derivatives at one design; the CPU time of one analysis in s.
fn print_derivatives() -> Result<f64> {
    let (plain, direct) = (problem(Derivatives::Forward(1e-3))?, problem(Derivatives::Direct)?);
    let wanted = kept(&plain)?;
    let both = |problem: &Problem| {
        let responses = problem.analyze(&DESIGN).expect("the design can be analysed");
        problem.sensitivities(&DESIGN, &responses, &wanted).expect("as above")
    };
    let unit = least(5, || plain.analyze(&DESIGN));
    println!("one analysis: {:.2} ms", unit * 1e3);
    println!("with all three derivatives, directly:       {:.2} analyses", least(5, || both(&direct)) / unit);
    println!("with all three derivatives, by differences: {:.2} analyses", least(5, || both(&plain)) / unit);
    Ok(unit)
}

/// A whole run from the paper's start, everything counted; the paper took 19 + 13 · 3 = 58 analyses.
fn print_run(name: &str, method: &Method, unit: f64) -> Result<()> {
    let problem = problem(Derivatives::Direct)?;
    let counters = method.solve(&problem, |_| ())?.counters;
    let run = || method.solve(&problem, |_| ()).expect("it ran before");
    let spent = least(3, run) / unit;
    println!(
        "{name}: {} analyses with derivatives take {spent:.1} analyses, {:.0} % of the paper's 58",
        counters.analyses,
        spent / 58.0 * 100.0
    );
    Ok(())
}

fn main() -> Result<()> {
    let unit = print_derivatives()?;
    print_run("robust_method", &robust_method(), unit)?;
    print_run("the paper's rules", &method(), unit)
}
