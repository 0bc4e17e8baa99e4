//! Compares sequential approximation with an SQP solver applied directly to the analysis:
//! `cargo run --example direct_coupling`.
//!
//! In direct coupling every evaluation of the SQP solver is an analysis, and every gradient is a sensitivity analysis with all
//! constraints at all time points. The paper reports 23 of both for the comfort criterion; Gabriele (1993) reports 803
//! evaluations for the slider-crank. This SQP solver needs far fewer. With two or three variables it needs about as many
//! analyses as sequential approximation; with the eight variables of the slider-crank it needs several times as many.

use linkwright::Result;
use linkwright::cases::{impact_absorber, slider_crank};
use linkwright::nlp::{Program, Sqp, SubproblemSolver};
use linkwright::problem::DirectCoupling;
use linkwright::sao::Method;

fn main() -> Result<()> {
    let path = slider_crank::path_generation(slider_crank::STAND_IN_START)?;
    let cases = [
        (impact_absorber::peak_acceleration()?, impact_absorber::peak_acceleration_optimum(), "-"),
        (impact_absorber::comfort()?, impact_absorber::comfort_optimum(), "23 and 23"),
        (path, slider_crank::optimum(), "803 evaluations"),
    ];
    println!("{:<34} {:>22} {:>30}   {:<16}", "", "sequential approx.", "direct coupling (SQP)", "published direct");
    let head = "analyses  gradients";
    println!("{:<34} {head:>22} {head:>22} {:>7}", "", "rows");
    let mut ratios = vec![];
    for (problem, optimum, published) in &cases {
        let state = Method::slp().solve(problem, |_| ())?;
        let direct = DirectCoupling::new(problem);
        let solution = Sqp::default().solve(&direct, &problem.start())?;
        let (ours, theirs) = (state.counters, [direct.analyses(), direct.sensitivity_analyses()]);
        let name = &problem.name;
        print!("{name:<34} {:>12} {:>9} ", ours.analyses, ours.sensitivity_analyses);
        println!("{:>12} {:>9} {:>7}   {published:<16}", theirs[0], theirs[1], direct.rows());
        let error = (solution.objective / optimum.objective - 1.0).abs();
        assert!(solution.status.was_successful() && error < 1e-5, "{name}: {:?}, {error:e}", solution.status);
        ratios.push(theirs[0] as f64 / ours.analyses as f64);
    }
    assert!(ratios[1] * 9.0 <= 23.0, "no more analyses than published for the comfort criterion");
    assert!(ratios[2] > 2.0, "intermediate responses save analyses on the slider-crank");
    Ok(())
}
