//! Every model file that has a twin in the library runs through the same cycles.

use linkwright::cases::{Andrews, Chain, FourBar, Governor, RigidFourBar, SliderCrank as Crank, SpinningBeam};
use linkwright::cases::{
    cantilever, four_bar, four_bar::StressConstrained, impact_absorber, nonlinear_absorber, slider_crank,
    ten_bar_truss, two_bar_truss, vehicle_suspension,
};
use linkwright::mechanics::analyses::dynamics::Dynamics;
use linkwright::mechanics::analyses::statics::Statics;
use linkwright::mechanics::initial_conditions::Assembly;
use linkwright::model_file::{Model, read};
use linkwright::problem::{Analysis, Problem, TimeGrid};
use linkwright::responses::mechanism::{KinematicResponses, StaticResponses, Transient};
use linkwright::sao::{Method, RunState, preset};

fn model(name: &str) -> Model {
    let path = format!("{}/examples/models/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap();
    read(name, &text).unwrap_or_else(|report| panic!("{report}"))
}

/// Runs both and compares every cycle: acceptance exactly, numbers to `tolerance`.
fn assert_twins(name: &str, twin: Problem, method: Method, tolerance: f64) -> RunState {
    let model = model(name);
    let ours = model.method().solve(&model.problem().unwrap(), |_| ()).unwrap();
    let theirs = method.solve(&twin, |_| ()).unwrap();
    assert_eq!(ours.status, theirs.status, "{}", ours.reason);
    assert_eq!(ours.history.len(), theirs.history.len());
    assert_eq!(ours.counters.analyses, theirs.counters.analyses);
    for (a, b) in ours.history.iter().zip(&theirs.history) {
        assert_eq!((a.cycle, a.accepted, &a.retained), (b.cycle, b.accepted, &b.retained));
        for (x, y) in a.design.iter().zip(&b.design).chain([(&a.objective, &b.objective)]) {
            assert!((x - y).abs() <= tolerance * y.abs().max(1e-3), "cycle {}: {x} and {y}", a.cycle);
        }
    }
    ours
}

#[test]
fn the_impact_absorber_as_a_mechanism() {
    let twin = impact_absorber::peak_acceleration_simulated().unwrap();
    let end = assert_twins("impact-absorber", twin, Method::slp(), 1e-10);
    assert_eq!((end.counters.analyses, end.counters.sensitivity_analyses), (6, 6));
    assert_twins("impact-absorber-comfort", impact_absorber::comfort_simulated().unwrap(), Method::slp(), 1e-10);
}

#[test]
fn the_impact_absorber_as_a_formula() {
    let twin = impact_absorber::peak_acceleration().unwrap();
    // Bounds keep the formula where it is underdamped; they are not met.
    assert_twins("impact-absorber-formula", twin, Method::slp(), 1e-8);
}

#[test]
fn the_slider_crank_in_closed_form_and_assembled() {
    let start = slider_crank::STAND_IN_START;
    assert_twins("slider-crank", slider_crank::path_generation(start).unwrap(), Method::slp(), 1e-8);
    let twin = slider_crank::path_generation_assembled(start).unwrap();
    assert_twins("slider-crank-assembled", twin, Method::slp(), 1e-8);
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

/// Compares the histories of a file at its start design with those of its twin, to `tolerance` of the largest value of each
/// response. `kept` selects the responses of the twin that the file has.
fn assert_histories(name: &str, twin: &dyn Analysis, design: &[f64], tolerance: f64, kept: impl Fn(usize) -> bool) {
    let problem = model(name).problem().unwrap();
    assert_eq!(problem.start()[..design.len()], *design, "{name}");
    let ours = problem.analyze(&problem.start()).unwrap().values;
    let theirs = twin.analyze(design).unwrap().values;
    let theirs: Vec<_> = theirs.into_iter().enumerate().filter(|(h, _)| kept(*h)).map(|(_, series)| series).collect();
    assert_eq!(ours.len(), theirs.len(), "{name}");
    let mut worst = 0.0f64;
    for (ours, theirs) in ours.iter().zip(&theirs) {
        assert_eq!(ours.len(), theirs.len(), "{name}");
        let largest = theirs.iter().fold(1e-300f64, |a, x| a.max(x.abs()));
        worst = ours.iter().zip(theirs).fold(worst, |a, (x, y)| a.max((x - y).abs() / largest));
    }
    println!("{name}: {worst:.1e}");
    assert!(worst <= tolerance, "{name}: {worst:.1e}");
}

fn all(_: usize) -> bool {
    true
}

fn uniform(to: f64, points: usize) -> Vec<f64> {
    TimeGrid::uniform(0.0, to, points).unwrap().points
}

#[test]
fn mechanisms_move_as_their_twins() {
    let andrews = Transient::new(Andrews, Dynamics::fixed(1e-4), &uniform(0.03, 31)).unwrap();
    assert_histories("andrews", &andrews, &Andrews::DESIGN, 1e-9, all);
    let chain = Chain::horizontal(5);
    let hanging = Transient::new(chain, Dynamics::fixed(0.005), &uniform(0.5, 26)).unwrap();
    assert_histories("chain", &hanging, &chain.equal_links(), 1e-9, all);
    let beam = SpinningBeam::published(8);
    let spinning = Transient::new(beam, Dynamics::fixed(0.01), &uniform(15.0, 31)).unwrap();
    assert_histories("spinning-beam", &spinning, &SpinningBeam::DESIGN, 1e-8, all);
    let rod = Crank { elements: 4, ..Crank::rigid() };
    let bending = Transient::new(rod, Dynamics::fixed(1e-3), &uniform(0.4, 41)).unwrap();
    assert_histories("slider-crank-flexible", &bending, &Crank::DESIGN, 1e-8, all);
}

#[test]
fn driven_mechanisms_move_as_their_twins() {
    let crank = KinematicResponses::new(Crank::rigid(), Assembly::default(), &uniform(0.4, 41)).unwrap();
    assert_histories("slider-crank-torque", &crank, &Crank::DESIGN, 1e-10, all);
    let times = TimeGrid::uniform(0.3, 0.5, 41).unwrap().points;
    let four_bar = KinematicResponses::new(RigidFourBar(FourBar::physical()), Assembly::default(), &times).unwrap();
    // Moments at pins are zero; the file has no outputs for them.
    let kept = |h: usize| h == 0 || (1..6).contains(&(h % 7));
    assert_histories("rigid-four-bar", &four_bar, &[0.0385, 0.0252, 0.02], 1e-9, kept);
}

#[test]
fn equilibria_are_those_of_their_twins() {
    let governor = StaticResponses::new(Governor { angle: 0.8 }, Statics::default(), &[0.0]).unwrap();
    assert_histories("governor", &governor, &Governor::DESIGN, 1e-10, all);
    // Strains of 1e-9: the results of the linear truss to that accuracy.
    let truss = ten_bar_truss::equal_strengths().unwrap();
    assert_histories("ten-bar-truss", truss.analysis.as_ref(), &[5.0; 10], 1e-6, all);
}

#[test]
fn equations_of_motion_by_hand_move_as_their_files() {
    let twin = nonlinear_absorber::peak_acceleration().unwrap();
    assert_histories("nonlinear-absorber", twin.analysis.as_ref(), &[0.5, 0.1, 0.3, 0.1], 1e-9, all);
    let twin = vehicle_suspension::peak_acceleration().unwrap();
    assert_histories("vehicle-suspension", twin.analysis.as_ref(), &twin.start()[..6], 1e-7, all);
}

#[test]
fn optima_of_mechanisms_are_those_of_the_catalogue() {
    for (name, optimum) in [("ten-bar-truss", 1593.181), ("nonlinear-absorber", 0.499_807_79)] {
        let model = model(name);
        let end = model.method().solve(&model.problem().unwrap(), |_| ()).unwrap();
        assert!(end.status.is_success(), "{name}: {}", end.reason);
        assert!((end.evaluation.objective / optimum - 1.0).abs() < 1e-5, "{name}: {}", end.evaluation.objective);
    }
}

#[test]
fn every_model_file_is_analysed() {
    for item in std::fs::read_dir(format!("{}/examples/models", env!("CARGO_MANIFEST_DIR"))).unwrap() {
        let path = item.unwrap().path();
        if path.is_dir() {
            continue;
        }
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let problem = model(&name).problem().unwrap_or_else(|e| panic!("{name}: {e}"));
        let start = problem.start();
        let here = problem.analyze(&start).unwrap_or_else(|e| panic!("{name}: {e}"));
        problem.evaluate(&start, &here).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
}
