//! A run has the same bits for any number of threads.

use linkwright::cases::{impact_absorber, slider_crank};
use linkwright::problem::{Problem, Selection};
use linkwright::sao::{Method, Screening};

fn run(problem: &Problem, threads: usize) -> String {
    // The full grid, so that there is something to share out.
    let screening = Screening { selection: Selection::All, ..Screening::default() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let solve = || Method { screening, ..Method::default() }.solve(problem, |_| ()).unwrap().to_json();
    pool.install(solve)
}

#[test]
fn one_thread_and_four_threads_give_the_same_state_to_the_last_bit() {
    let path = slider_crank::path_generation(slider_crank::STAND_IN_START);
    for problem in [impact_absorber::peak_acceleration(), impact_absorber::comfort(), path] {
        let problem = problem.unwrap();
        assert_eq!(run(&problem, 1), run(&problem, 4), "{}", problem.name);
    }
}
