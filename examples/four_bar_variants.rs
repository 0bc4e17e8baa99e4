//! Shows the effect of each part of the method on the flexible four-bar mechanism, from one start and from 40, and that
//! `robust_method` converges from nearly all 40: `cargo run --release --example four_bar_variants`.

use linkwright::Result;
use linkwright::cases::four_bar::{DerivativeMethod, LinearizedResponses, StressConstrained, method, robust_method};
use linkwright::nlp::{AutoSolver, MultiStart, Program, ProgramStatus, Solution, SubproblemSolver};
use linkwright::problem::Selection;
use linkwright::sao::{Method, RelativeLimits, RunState, Screening};
use rayon::prelude::*;
use std::ops::RangeInclusive;

type Make = dyn Fn() -> Method + Sync;

/// Starts with which the settings of `robust_method` were chosen, and other starts.
const STARTS: RangeInclusive<u32> = 1..=40;
const FRESH: RangeInclusive<u32> = 1001..=1040;

/// A solver that returns its start if the approximate problem has no feasible design within the move limits.
struct Inelastic(AutoSolver);

impl SubproblemSolver for Inelastic {
    fn name(&self) -> &'static str {
        "inelastic"
    }

    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        let found = self.0.solve(program, start)?;
        let at_start = program.values(start)?;
        let stays = Solution { x: start.to_vec(), objective: at_start.objective, rows: at_start.rows, ..found.clone() };
        Ok(if found.status == ProgramStatus::Relaxed { stays } else { found })
    }
}

fn run(name: &str, setup: &StressConstrained, method: &Method) -> Result<RunState> {
    let end = method.solve(&setup.problem()?, |_| ())?;
    let rejected = end.history.iter().filter(|c| !c.accepted).count();
    let (work, f) = (end.counters, end.evaluation.objective);
    let [cycles, analyses] = [end.cycles(), work.analyses];
    println!(
        "{name:<44} {cycles:>3} + {rejected:<2} {analyses:>4} {:>4}  {f:.4} kg  {:?}",
        work.sensitivity_analyses, end.status
    );
    Ok(end)
}

/// Runs the method from 40 starts, spread evenly within 5 % of the paper's start. Returns the number of converged runs and the
/// median of the cycles.
fn study(name: &str, setup: &StressConstrained, method: &Make, starts: RangeInclusive<u32>) -> Result<(usize, usize)> {
    let start = |k: u32| [0.8191725, 0.6710436, 0.5497005].map(|a| 356.8 * (0.95 + 0.1 * (f64::from(k) * a).fract()));
    let solve = |k: u32| method().solve(&setup.clone().from_mm(start(k)).problem()?, |_| ());
    let ends = starts.into_par_iter().map(solve).collect::<Result<Vec<RunState>>>()?;
    let successful: Vec<&RunState> = ends.iter().filter(|end| end.status.is_success()).collect();
    let mean = |f: fn(&RunState) -> usize| ends.iter().map(f).sum::<usize>() as f64 / 40.0;
    let near = |kg: f64| successful.iter().filter(|e| (e.evaluation.objective / kg - 1.0).abs() < 3e-3).count();
    let mut cycles: Vec<usize> = ends.iter().map(RunState::cycles).collect();
    cycles.sort_unstable();
    println!(
        "{name:<44} {:>2} of 40; cycles {} {} {} {} {}; {:.1} + {:.1}; I {}, II {}",
        successful.len(),
        cycles[0],
        cycles[10],
        cycles[20],
        cycles[30],
        cycles[39],
        mean(|e| e.counters.analyses),
        mean(|e| e.counters.sensitivity_analyses),
        near(2.882),
        near(2.670)
    );
    Ok((successful.len(), cycles[20]))
}

fn main() -> Result<()> {
    let (soft, stiff) = (StressConstrained::as_published(), StressConstrained::as_published().stiffened(10.0));
    println!("{:<44} cycles + rejected, analyses, sensitivity analyses", "");
    for (name, setup) in [("E", &soft), ("10 E", &stiff)] {
        use LinearizedResponses::{MomentsInDiameters, StressesInDiameters};
        run(&format!("{name}: moments in areas"), setup, &method())?;
        for linearized in [MomentsInDiameters, StressesInDiameters] {
            run(&format!("{name}: {linearized:?}"), &StressConstrained { linearized, ..setup.clone() }, &method())?;
        }
        for neighbours in [0, 1, 2] {
            let screening = Screening { selection: Selection::NearMaxima(neighbours), ..Screening::above(0.5) };
            run(&format!("{name}: {neighbours} neighbours"), setup, &Method { screening, ..method() })?;
        }
        for cutoff in [0.5, 0.7, 0.9] {
            let screening = Screening { cutoff: Some(cutoff), ..Screening::default() };
            run(&format!("{name}: cut-off {cutoff}"), setup, &Method { screening, ..method() })?;
        }
        assert!(run(&format!("{name}: staying feasible"), setup, &robust_method())?.status.is_success());
    }
    println!("{:<44} converged; min, quartiles, max; analyses + sensitivity analyses; optima", "40 starts");
    let several = || -> Method {
        let solver = MultiStart::new(AutoSolver::default(), 4, 1).expect("four is at least one");
        Method { solver: Box::new(solver), ..method() }
    };
    let inelastic = || Method { solver: Box::new(Inelastic(AutoSolver::default())), ..method() };
    let uncapped = || Method { move_limits: Box::new(RelativeLimits { cap: 0.9, ..Default::default() }), ..method() };
    let forward = StressConstrained { derivatives: DerivativeMethod::Forward(1e-3), ..soft.clone() };
    for (name, starts) in [("staying feasible", STARTS), ("… other 40 starts", FRESH)] {
        let (converged, median) = study(name, &soft, &robust_method, starts)?;
        assert!(converged >= 38 && median <= 15);
    }
    study("the paper's rules, exact derivatives", &soft, &method, STARTS)?;
    study("… forward differences 1e-3", &forward, &method, STARTS)?;
    study("… four starts for each subproblem", &soft, &several, STARTS)?;
    study("… subproblems without elastic relaxation", &soft, &inelastic, STARTS)?;
    study("… factors capped at 0.9 instead of 0.53", &soft, &uncapped, STARTS)?;
    Ok(())
}
