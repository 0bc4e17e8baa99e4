//! A run that is stored after any cycle and continued from the file ends with the same bits.

use linkwright::library::{impact_absorber, slider_crank};
use linkwright::problem::Problem;
use linkwright::sao::{Method, State, Status};

fn assert_continues(problem: Problem) {
    let method = Method::default();
    let mut files = vec![];
    let ended = method.solve(&problem, |state| files.push(state.to_json())).unwrap();
    assert!(files.len() > 2 && ended.status != Status::Running);
    let uninterrupted = ended.to_json();
    for (cycle, file) in files.iter().enumerate() {
        let read = State::from_json(file, &problem).unwrap();
        assert_eq!(&read.to_json(), file, "what is read is what was written, after try {cycle}");
        let continued = method.resume(&problem, read, |_| ()).unwrap();
        assert_eq!(continued.to_json(), uninterrupted, "continued after try {cycle}");
    }
}

#[test]
fn the_impact_absorber_continues_from_every_cycle() {
    assert_continues(impact_absorber::peak_acceleration().unwrap());
    assert_continues(impact_absorber::comfort().unwrap());
}

#[test]
fn the_slider_crank_continues_from_every_cycle_the_rejected_try_too() {
    assert_continues(slider_crank::path_generation(slider_crank::STAND_IN_START).unwrap());
}

#[test]
fn the_cycle_limit_ends_a_run_that_can_be_continued_with_a_larger_one() {
    let problem = impact_absorber::comfort().unwrap();
    let mut method = Method::default();
    method.stop.max_cycles = 3;
    let stopped = method.solve(&problem, |_| ()).unwrap();
    assert_eq!((stopped.status, stopped.cycles()), (Status::CycleLimit, 3));
    assert!(stopped.reason.contains("continue with a larger number of cycles"), "{}", stopped.reason);
    let continued = Method::default().resume(&problem, stopped, |_| ()).unwrap();
    assert_eq!(continued.to_json(), Method::default().solve(&problem, |_| ()).unwrap().to_json());
}
