//! Reproducibility: a run has the same bits for any number of threads, and if it is stored after any cycle and continued from
//! the file.

use linkwright::cases::{impact_absorber, slider_crank};
use linkwright::problem::{Problem, Selection};
use linkwright::sao::{Method, RunState, Screening, Status};

fn assert_continues(problem: Problem) {
    let method = Method::slp();
    let mut files = vec![];
    let ended = method.solve(&problem, |state| files.push(state.to_json())).unwrap();
    assert!(files.len() > 2 && ended.status != Status::Running);
    let uninterrupted = ended.to_json();
    for (cycle, file) in files.iter().enumerate() {
        let read = RunState::from_json(file, &problem).unwrap();
        assert_eq!(
            &read.to_json(),
            file,
            "the state that is read equals the one that was written, after trial step {cycle}"
        );
        let continued = method.resume(&problem, read, |_| ()).unwrap();
        assert_eq!(continued.to_json(), uninterrupted, "continued after trial step {cycle}");
    }
}

#[test]
fn the_impact_absorber_continues_from_every_cycle() {
    assert_continues(impact_absorber::peak_acceleration().unwrap());
    assert_continues(impact_absorber::comfort().unwrap());
}

#[test]
fn the_slider_crank_continues_from_every_cycle_rejected_or_not() {
    assert_continues(slider_crank::path_generation(slider_crank::STAND_IN_START).unwrap());
}

#[test]
fn the_cycle_limit_ends_a_run_that_can_be_continued_with_a_larger_one() {
    let problem = impact_absorber::comfort().unwrap();
    let mut method = Method::slp();
    method.stop.max_cycles = 3;
    let stopped = method.solve(&problem, |_| ()).unwrap();
    assert_eq!((stopped.status, stopped.cycles()), (Status::CycleLimit, 3));
    assert!(stopped.reason.contains("continue with a larger number of cycles"), "{}", stopped.reason);
    let continued = Method::slp().resume(&problem, stopped, |_| ()).unwrap();
    assert_eq!(continued.to_json(), Method::slp().solve(&problem, |_| ()).unwrap().to_json());
}

#[test]
fn a_state_in_a_file_continues_with_the_same_bits_and_faults_name_the_file() {
    let (problem, method) = (impact_absorber::peak_acceleration().unwrap(), Method::slp());
    let undisturbed = method.solve(&problem, |_| ()).unwrap();
    let path = std::env::temp_dir().join(format!("linkwright-state-{}.json", std::process::id()));
    let started = method.start(&problem).unwrap();
    method.step(&problem, started).unwrap().save(&path).unwrap();
    let state = RunState::load(&path, &problem).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert_eq!(method.resume(&problem, state, |_| ()).unwrap().to_json(), undisturbed.to_json());

    let name = path.display().to_string();
    let missing = RunState::load(&path, &problem).unwrap_err().to_string();
    assert!(missing.contains(&name) && missing.contains("cannot be read"), "{missing}");
    let nowhere = undisturbed.save(&path.join("state.json")).unwrap_err().to_string();
    assert!(nowhere.contains(&name) && nowhere.contains("cannot be written"), "{nowhere}");
}

/// The final state of a run with this number of threads.
fn run_with(problem: &Problem, threads: usize) -> String {
    // The full grid, so that there is work for several threads.
    let screening = Screening { selection: Selection::All, ..Screening::default() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let solve = || Method { screening, ..Method::slp() }.solve(problem, |_| ()).unwrap().to_json();
    pool.install(solve)
}

#[test]
fn one_thread_and_four_threads_give_the_same_state_to_the_last_bit() {
    let path = slider_crank::path_generation(slider_crank::STAND_IN_START);
    for problem in [impact_absorber::peak_acceleration(), impact_absorber::comfort(), path] {
        let problem = problem.unwrap();
        assert_eq!(run_with(&problem, 1), run_with(&problem, 4), "{}", problem.name);
    }
}
