//! What a cycle costs besides the analysis: `cargo bench --bench driver`.
//!
//! A run is recorded once; then its analyses are replayed from memory, so that what remains is the driver: screening,
//! approximation, subproblem, errors, move limits, history. In `bookkeeping` the subproblem's solutions are replayed too.

use divan::Bencher;
use divan::counter::ItemsCount;
use linkwright::Result;
use linkwright::cases::{impact_absorber, slider_crank};
use linkwright::nlp::Program;
use linkwright::nlp::{Automatic, Solution, SubproblemSolver};
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

/// What an analysis said, by design.
#[derive(Default)]
struct Tape {
    responses: Vec<(Vec<f64>, Responses)>,
    sensitivities: Vec<(Vec<f64>, DMatrix<f64>)>,
}

fn find<T: Clone>(entries: &[(Vec<f64>, T)], b: &[f64]) -> T {
    entries.iter().find(|(design, _)| design == b).expect("a replayed run visits the same designs").1.clone()
}

/// Passes through and writes down.
struct Recorder(Box<dyn Analysis>, Arc<Mutex<Tape>>);

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

struct Replay(Tape);

impl Analysis for Replay {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        Ok(find(&self.0.responses, b))
    }
    fn sensitivities(&self, b: &[f64], _: &Responses, _: &[ResponseAt]) -> Result<DMatrix<f64>> {
        Ok(find(&self.0.sensitivities, b))
    }
}

/// Solves and writes the solutions down.
struct SolverRecorder(Arc<Mutex<Vec<Solution>>>);

impl SubproblemSolver for SolverRecorder {
    fn name(&self) -> &'static str {
        "recorder"
    }
    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        let solution = Automatic::default().solve(program, start)?;
        self.0.lock().unwrap().push(solution.clone());
        Ok(solution)
    }
}

/// The solutions of the subproblems of a run, in order, again and again.
struct SolverReplay {
    known: Vec<Solution>,
    calls: AtomicUsize,
}

impl SubproblemSolver for SolverReplay {
    fn name(&self) -> &'static str {
        "replay"
    }
    fn solve(&self, _: &dyn Program, _: &[f64]) -> Result<Solution> {
        Ok(self.known[self.calls.fetch_add(1, Ordering::Relaxed) % self.known.len()].clone())
    }
}

/// A run with everything replayed from memory, the number of its tries, and its subproblem solutions.
fn replayed(run: &str) -> (Problem, usize, Vec<Solution>) {
    let (mut problem, tape) = (problem(run), Arc::new(Mutex::new(Tape::default())));
    let real = std::mem::replace(&mut problem.analysis, Box::new(Replay(Tape::default())));
    problem.analysis = Box::new(Recorder(real, tape.clone()));
    let solutions = Arc::new(Mutex::new(vec![]));
    let method = Method { solver: Box::new(SolverRecorder(solutions.clone())), ..Method::default() };
    let tries = method.solve(&problem, |_| ()).expect("the library's runs converge").history.len() - 1;
    problem.analysis = Box::new(Replay(std::mem::take(&mut *tape.lock().unwrap())));
    let known = std::mem::take(&mut *solutions.lock().unwrap());
    (problem, tries, known)
}

/// Everything, analyses in closed form included.
#[divan::bench(args = RUNS)]
fn whole_run(bencher: Bencher, run: &str) {
    let (problem, (_, tries, _)) = (problem(run), replayed(run));
    bencher.counter(ItemsCount::new(tries)).bench(|| Method::default().solve(&problem, |_| ()).unwrap());
}

/// Everything but the analyses.
#[divan::bench(args = RUNS)]
fn without_analyses(bencher: Bencher, run: &str) {
    let (problem, tries, _) = replayed(run);
    bencher.counter(ItemsCount::new(tries)).bench(|| Method::default().solve(&problem, |_| ()).unwrap());
}

/// Everything but the analyses and the subproblems.
#[divan::bench(args = RUNS)]
fn bookkeeping(bencher: Bencher, run: &str) {
    let (problem, tries, known) = replayed(run);
    let method = Method { solver: Box::new(SolverReplay { known, calls: 0.into() }), ..Method::default() };
    bencher.counter(ItemsCount::new(tries)).bench(|| method.solve(&problem, |_| ()).unwrap());
}
