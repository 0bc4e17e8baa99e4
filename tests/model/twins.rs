//! Every model file that has a twin in the library runs through the same cycles.

use linkwright::library::{
    cantilever, four_bar, four_bar::StressConstrained, impact_absorber, slider_crank, two_bar_truss,
};
use linkwright::model::{Model, read};
use linkwright::problem::Problem;
use linkwright::sao::{Method, State, preset};

fn model(name: &str) -> Model {
    let path = format!("{}/examples/models/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap();
    read(name, &text).unwrap_or_else(|fault| panic!("{fault}"))
}

/// Runs both and compares every cycle: verdicts exactly, numbers to `tolerance`.
fn assert_twins(name: &str, twin: Problem, method: Method, tolerance: f64) -> State {
    let model = model(name);
    let ours = model.method().solve(&model.problem().unwrap(), |_| ()).unwrap();
    let theirs = method.solve(&twin, |_| ()).unwrap();
    assert_eq!(ours.status, theirs.status, "{}", ours.reason);
    assert_eq!(ours.history.len(), theirs.history.len());
    assert_eq!(ours.counters.analyses, theirs.counters.analyses);
    for (a, b) in ours.history.iter().zip(&theirs.history) {
        assert_eq!((a.cycle, a.accepted, &a.kept), (b.cycle, b.accepted, &b.kept));
        for (x, y) in a.design.iter().zip(&b.design).chain([(&a.objective, &b.objective)]) {
            assert!((x - y).abs() <= tolerance * y.abs().max(1e-3), "cycle {}: {x} and {y}", a.cycle);
        }
    }
    ours
}

#[test]
fn the_impact_absorber_as_a_mechanism() {
    let twin = impact_absorber::peak_acceleration_simulated().unwrap();
    let end = assert_twins("impact-absorber", twin, Method::default(), 1e-10);
    assert_eq!((end.counters.analyses, end.counters.sensitivity_analyses), (6, 5));
    assert_twins("impact-absorber-comfort", impact_absorber::comfort_simulated().unwrap(), Method::default(), 1e-10);
}

#[test]
fn the_impact_absorber_as_a_formula() {
    let twin = impact_absorber::peak_acceleration().unwrap();
    // Bounds keep the formula where it is underdamped; they are not met.
    assert_twins("impact-absorber-formula", twin, Method::default(), 1e-8);
}

#[test]
fn the_slider_crank_in_closed_form_and_assembled() {
    let start = slider_crank::STAND_IN_START;
    assert_twins("slider-crank", slider_crank::path_generation(start).unwrap(), Method::default(), 1e-8);
    let twin = slider_crank::path_generation_assembled(start).unwrap();
    assert_twins("slider-crank-assembled", twin, Method::default(), 1e-8);
}

#[test]
fn trusses_and_beams_of_the_literature() {
    let method = |name: &str| (preset(name).unwrap().method)();
    assert_twins("two-bar-truss", two_bar_truss::problem().unwrap(), method("gcmma"), 1e-9);
    assert_twins("cantilever", cantilever::problem().unwrap(), method("mma"), 1e-9);
}

#[test]
fn the_flexible_four_bar() {
    let twin = StressConstrained::as_published().problem().unwrap();
    assert_twins("four-bar", twin, four_bar::method(), 1e-6);
}

#[test]
fn the_chain_loses_energy_and_its_tip_stays_above_the_floor() {
    let model = model("pendulum-chain");
    let end = model.method().solve(&model.problem().unwrap(), |_| ()).unwrap();
    assert!(end.status.is_success(), "{}", end.reason);
    let [tip, energy] = [0, 1].map(|h: usize| &end.responses.values[h]);
    assert!(energy.windows(2).all(|e| e[1] < e[0]), "{energy:?}");
    let lowest = tip.iter().copied().fold(0.0, f64::min);
    assert!((lowest + 0.8).abs() < 1e-4, "the floor is touched: {lowest}");
}
