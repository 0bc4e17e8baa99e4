//! Cost of a cycle without the analysis: `cargo bench --bench driver`.
//!
//! An optimization is recorded once, and its analyses are then replayed from memory. What remains is the driver: screening,
//! approximation, subproblem, errors, move limits, history. In `bookkeeping` the solutions of the subproblems are replayed, too.

use divan::Bencher;
use divan::counter::ItemsCount;
use linkwright::Result;
use linkwright::cases::{impact_absorber, slider_crank};
use linkwright::nlp::Program;
use linkwright::nlp::{AutoSolver, Solution, SubproblemSolver};
use linkwright::problem::{Analysis, Problem, ResponseAt, Responses};
use linkwright::sao::Method;
use nalgebra::DMatrix;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

const RUNS: [&str; 3] = ["table1", "table2", "table4"];

fn main() {
    divan::main();
}

fn problem(run: &str) -> Problem {
    match run {
        "table1" => impact_absorber::peak_acceleration(),
        "table2" => impact_absorber::comfort(),
        _ => slider_crank::path_generation(slider_crank::STAND_IN_START),
    }
    .expect("the library's problems are valid")
}

/// Recorded results of analyses by design.
#[derive(Default)]
struct Recording {
    responses: Vec<(Vec<f64>, Responses)>,
    sensitivities: Vec<(Vec<f64>, DMatrix<f64>)>,
}

fn find<T: Clone>(entries: &[(Vec<f64>, T)], b: &[f64]) -> T {
    entries.iter().find(|(design, _)| design == b).expect("a replayed optimization analyses the same designs").1.clone()
}

/// An analysis that records the results of another one.
struct Recorder(Box<dyn Analysis>, Arc<Mutex<Recording>>);

impl Analysis for Recorder {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let responses = self.0.analyze(b)?;
        self.1.lock().unwrap().responses.push((b.to_vec(), responses.clone()));
        Ok(responses)
    }
    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let rows = self.0.sensitivities(b, responses, wanted)?;
        self.1.lock().unwrap().sensitivities.push((b.to_vec(), rows.clone()));
        Ok(rows)
    }
}

struct Replay(Recording);

impl Analysis for Replay {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        Ok(find(&self.0.responses, b))
    }
    fn sensitivities(&self, b: &[f64], _: &Responses, _: &[ResponseAt]) -> Result<DMatrix<f64>> {
        Ok(find(&self.0.sensitivities, b))
    }
}

/// A solver that records its solutions.
struct SolverRecorder(Arc<Mutex<Vec<Solution>>>);

impl SubproblemSolver for SolverRecorder {
    fn name(&self) -> &'static str {
        "recorder"
    }
    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        let solution = AutoSolver::default().solve(program, start)?;
        self.0.lock().unwrap().push(solution.clone());
        Ok(solution)
    }
}

/// A solver that returns recorded solutions in order, repeatedly.
struct SolverReplay {
    solutions: Vec<Solution>,
    calls: AtomicUsize,
}

impl SubproblemSolver for SolverReplay {
    fn name(&self) -> &'static str {
        "replay"
    }
    fn solve(&self, _: &dyn Program, _: &[f64]) -> Result<Solution> {
        Ok(self.solutions[self.calls.fetch_add(1, Ordering::Relaxed) % self.solutions.len()].clone())
    }
}

/// An optimization with analyses replayed from memory, the number of its trial designs, and the solutions of its subproblems.
fn replayed(run: &str) -> (Problem, usize, Vec<Solution>) {
    let (mut problem, recording) = (problem(run), Arc::new(Mutex::new(Recording::default())));
    let real = std::mem::replace(&mut problem.analysis, Box::new(Replay(Recording::default())));
    problem.analysis = Box::new(Recorder(real, recording.clone()));
    let solutions = Arc::new(Mutex::new(vec![]));
    let method = Method { solver: Box::new(SolverRecorder(solutions.clone())), ..Method::slp() };
    let trials = method.solve(&problem, |_| ()).expect("the library's runs converge").history.len() - 1;
    problem.analysis = Box::new(Replay(std::mem::take(&mut *recording.lock().unwrap())));
    let solutions = std::mem::take(&mut *solutions.lock().unwrap());
    (problem, trials, solutions)
}

/// The whole optimization, including analyses in closed form.
#[divan::bench(args = RUNS)]
fn whole_run(bencher: Bencher, run: &str) {
    let (problem, (_, trials, _)) = (problem(run), replayed(run));
    bencher.counter(ItemsCount::new(trials)).bench(|| Method::slp().solve(&problem, |_| ()).unwrap());
}

/// The optimization without analyses.
#[divan::bench(args = RUNS)]
fn without_analyses(bencher: Bencher, run: &str) {
    let (problem, trials, _) = replayed(run);
    bencher.counter(ItemsCount::new(trials)).bench(|| Method::slp().solve(&problem, |_| ()).unwrap());
}

/// The optimization without analyses and subproblems.
#[divan::bench(args = RUNS)]
fn bookkeeping(bencher: Bencher, run: &str) {
    let (problem, trials, solutions) = replayed(run);
    let method = Method { solver: Box::new(SolverReplay { solutions, calls: 0.into() }), ..Method::slp() };
    bencher.counter(ItemsCount::new(trials)).bench(|| method.solve(&problem, |_| ()).unwrap());
}
