//! Cost of the derivatives of a falling chain: `cargo bench --bench chain`.
//!
//! N slender links, together 1 m and 1 kg, pinned in a row to the ground, are released from rest in the horizontal
//! (g = 9.81 m/s²). Outputs are x(t) and y(t) of the tip at 101 times from 0 to 1 s with an error of at most 1e-8 m, and their
//! derivatives with respect to the 2N lengths and masses. CPU times of all threads are the smallest of several
//! batches, alternating with and without derivatives. The tolerance is the largest power of ten with this accuracy, compared with 1e-13.
//!
//! With an error of 1e-5 m after 1 s, the simulated seconds per CPU second are measured in absolute and in relative coordinates.
//!
//! `-- spatial` measures a chain in space, `-- speed` only the simulated seconds. `-- N…` measures chains of N links instead of 8 and 32, `-- scaling` only the cost per step of long chains.

mod cpu;

use cpu::least;
use linkwright::cases::Chain;
use linkwright::mechanics::analyses::dynamics::simulate_explicitly;
use linkwright::mechanics::analyses::dynamics::{Dynamics, History, simulate};
use linkwright::mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright::mechanics::elements::spatial::MassProperties3;
use linkwright::mechanics::integrators::explicit::{Coordinates, Explicit, StepControl};
use linkwright::mechanics::integrators::time_stepper::TimeStepper;
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism, Pose3};

fn times() -> Vec<f64> {
    (0..=100).map(|k| 0.01 * f64::from(k)).collect()
}

/// The chain with outputs of the tip only, without energies.
fn tip(links: usize) -> Chain {
    Chain { energies: false, ..Chain::horizontal(links) }
}

fn difference(a: &History, b: &History) -> f64 {
    let errors = (0..2).flat_map(|o| a.values[o].iter().zip(&b.values[o]).map(|(a, b)| (a - b).abs()));
    errors.fold(0.0, f64::max)
}

/// Analysis and derivatives with an error of at most 1e-8 m.
fn chain(links: usize, runs: usize) {
    let model = tip(links);
    let (b, times) = (model.equal_links(), times());
    let mechanism = model.build(&b).unwrap();
    let exact = simulate_explicitly(&mechanism, &Explicit::eighth_order(1e-13), &times).unwrap();
    for method in [Explicit::adaptive as fn(f64) -> Explicit, Explicit::eighth_order] {
        let error = |tolerance: f64| {
            let run = simulate_explicitly(&mechanism, &method(tolerance), &times).unwrap();
            (difference(&run, &exact), run.work)
        };
        let tolerances = (6..13).map(|k| 10f64.powi(-k));
        let Some((tolerance, (error, work))) = tolerances.map(|t| (t, error(t))).find(|(_, (error, _))| *error <= 1e-8)
        else {
            println!("chain of {links}: {} does not reach 1e-8", method(1.0).method.name);
            continue;
        };
        let settings = method(tolerance);
        let (mut analysis, mut both) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..runs {
            analysis = analysis.min(least(1, || simulate_explicitly(&mechanism, &settings, &times).unwrap()));
            both = both.min(least(1, || differentiate_explicitly(&model, &b, &settings, &times).unwrap()));
        }
        println!(
            "chain of {links:>2}, {:>2} parameters, {}: all derivatives {:.2} analyses; CPU {:.2} ms and {:.2} ms; \
             tolerance {tolerance:.0e}, error {error:.1e} m, {} steps, {} rejected, {} evaluations",
            b.len(),
            settings.method.name,
            both / analysis,
            analysis * 1e3,
            both * 1e3,
            work.steps,
            work.failed_steps,
            work.iterations
        );
    }
}

/// Simulated seconds per CPU second with an error of the tip after 1 s of at most 1e-5 m, in absolute and in relative coordinates.
fn speed(links: usize) {
    let model = tip(links);
    let mechanism = model.build(&model.equal_links()).unwrap();
    let end = |run: &History| [run.values[0][0], run.values[1][0]];
    let exact = end(&simulate_explicitly(&mechanism, &Explicit::eighth_order(1e-13), &[1.0]).unwrap());
    for coordinates in [Coordinates::Absolute, Coordinates::Relative] {
        let settings = |tolerance| Explicit::eighth_order(tolerance).with_coordinates(coordinates);
        let error = |tolerance: f64| {
            let [x, y] = end(&simulate_explicitly(&mechanism, &settings(tolerance), &[1.0]).unwrap());
            (x - exact[0]).hypot(y - exact[1])
        };
        let tolerances = (4..24).map(|k| 10f64.powf(-0.5 * f64::from(k)));
        let Some((tolerance, error)) = tolerances.map(|t| (t, error(t))).find(|(_, error)| *error <= 1e-5) else {
            println!("chain of {links:>2}, {}: does not reach 1e-5", coordinates.name());
            continue;
        };
        let settings = settings(tolerance);
        let work = simulate_explicitly(&mechanism, &settings, &[1.0]).unwrap().work;
        let run = || (0..20).for_each(|_| drop(simulate_explicitly(&mechanism, &settings, &[1.0]).unwrap()));
        let spent = least(5, run) / 20.0;
        println!(
            "chain of {links:>2}, {} coordinates: {:.0} simulated seconds per CPU second, error {error:.1e} m, {} steps, {} \
             evaluations of {:.2} µs",
            coordinates.name(),
            1.0 / spent,
            work.steps,
            work.iterations,
            spent / work.iterations as f64 * 1e6
        );
    }
}

/// A spatial chain: N slender links, together 1 m and 1 kg, on hinges whose axes are −y and (0.6, 0, 0.8) in turn, released along x with
/// the weight along −z. Outputs are the coordinates of the tip.
fn spatial_chain(links: usize) -> Mechanism<f64> {
    let length = 1.0 / links as f64;
    let bending = length * length * length / 12.0;
    let mut m = Mechanism::with_gravity3([0.0, 0.0, -9.81]);
    let mut last = m.ground3().origin();
    for k in 0..links {
        let properties = MassProperties3::principal(length, [1e-3 * bending, bending, bending]);
        let pose = Pose3::at([(k as f64 + 0.5) * length, 0.0, 0.0]);
        let link = m.body3(&format!("link {k}"), properties, pose);
        let axis = if k % 2 == 1 { [0.6, 0.0, 0.8] } else { [0.0, -1.0, 0.0] };
        m.revolute3(&format!("hinge {k}"), last.with_z(axis), link.at([-0.5 * length, 0.0, 0.0]).with_z(axis));
        last = link.at([0.5 * length, 0.0, 0.0]);
    }
    let sensor = m.sensor3("tip", last);
    for name in ["x", "y", "z"] {
        let term = m.measure(sensor, name).expect("the sensor measures it");
        m.output(name, &[term]);
    }
    m
}

/// The spatial chain with an error of the tip after 1 s of at most 1e-5 m, and the cost per step and link of long chains.
fn spatial() {
    let end = |run: &History| [0, 1, 2].map(|k| run.values[k][0]);
    for links in [8, 32] {
        let mechanism = spatial_chain(links);
        let exact = end(&simulate_explicitly(&mechanism, &Explicit::eighth_order(1e-13), &[1.0]).unwrap());
        println!("spatial chain of {links:>2}: tip after 1 s at {:.12} {:.12} {:.12}", exact[0], exact[1], exact[2]);
        let error = |tolerance: f64| {
            let tip = end(&simulate_explicitly(&mechanism, &Explicit::eighth_order(tolerance), &[1.0]).unwrap());
            (0..3).map(|k| (tip[k] - exact[k]).powi(2)).sum::<f64>().sqrt()
        };
        let tolerances = (4..24).map(|k| 10f64.powf(-0.5 * f64::from(k)));
        let Some((tolerance, error)) = tolerances.map(|t| (t, error(t))).find(|(_, error)| *error <= 1e-5) else {
            println!("spatial chain of {links:>2}: does not reach 1e-5");
            continue;
        };
        let settings = Explicit::eighth_order(tolerance);
        let work = simulate_explicitly(&mechanism, &settings, &[1.0]).unwrap().work;
        let spent =
            least(5, || (0..10).for_each(|_| drop(simulate_explicitly(&mechanism, &settings, &[1.0]).unwrap()))) / 10.0;
        println!(
            "spatial chain of {links:>2}: {:.0} simulated seconds per CPU second, error {error:.1e} m, {} steps, {} evaluations of {:.2} µs",
            1.0 / spent,
            work.steps,
            work.iterations,
            spent / work.iterations as f64 * 1e6
        );
    }
    for links in [10, 100, 1000, 10_000] {
        let (mechanism, h) = (spatial_chain(links), 1e-5);
        let settings = Explicit::eighth_order(1.0)
            .with_step_control(StepControl::Fixed(h))
            .with_coordinates(Coordinates::Relative);
        let run = |steps: f64| simulate_explicitly(&mechanism, &settings, &[h * steps]).unwrap();
        let (few, many) = (2.0, 2.0 + (20_000 / links).max(16) as f64);
        let cost = (least(2, || run(many)) - least(2, || run(few))) / (many - few) / links as f64 * 1e6;
        println!("spatial chain of {links:>5}: per step and link {cost:.2} µs (DOP853, 12 evaluations)");
    }
}

/// Generalized-α steps as in `peers/exudyn_chain.py`: CPU time, and the error of the tip after 1 s.
fn implicit(links: usize) {
    let model = tip(links);
    let mechanism = model.build(&model.equal_links()).unwrap();
    let end = |run: &History| [run.values[0][0], run.values[1][0]];
    let exact = end(&simulate_explicitly(&mechanism, &Explicit::eighth_order(1e-13), &[1.0]).unwrap());
    println!("chain of {links:>2}: tip after 1 s at {:.12} {:.12}", exact[0], exact[1]);
    for h in [1e-3, 5e-4, 2.5e-4, 1.25e-4] {
        let ([x, y], work) = match simulate(&mechanism, &Dynamics::fixed(h), &[1.0]) {
            Ok(run) => (end(&run), run.work),
            Err(error) => {
                println!("chain of {links:>2}, generalized-α, step {h:.2e} s: {error}");
                continue;
            }
        };
        let spent = least(3, || simulate(&mechanism, &Dynamics::fixed(h), &[1.0]).unwrap()) * 1e3;
        let error = (x - exact[0]).hypot(y - exact[1]);
        println!(
            "chain of {links:>2}, generalized-α, step {h:.2e} s: CPU {spent:.1} ms, error {error:.1e} m, {} iterations in {} \
             steps",
            work.iterations, work.steps
        );
    }
}

/// CPU time per step and link of long chains, for implicit and explicit steps.
fn scaling() {
    for links in [10, 100, 1000, 10_000] {
        let model = tip(links);
        let mechanism = model.build(&model.equal_links()).unwrap();
        let h = 1e-5;
        let mut stepper = TimeStepper::new(&mechanism, &Dynamics::fixed(h), &[1.0]).unwrap();
        let batch = (20_000 / links).max(4);
        let steps = || (0..batch).map(|_| stepper.advance().unwrap()).sum::<f64>();
        let implicit = least(4, steps) / batch as f64;
        let settings = Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(h));
        let run = |steps: f64| simulate_explicitly(&mechanism, &settings, &[h * steps]).unwrap();
        let (few, many) = (2.0, 2.0 + (20_000 / links).max(16) as f64);
        let explicit = (least(2, || run(many)) - least(2, || run(few))) / (many - few);
        let [implicit, explicit] = [implicit, explicit].map(|cost| cost / links as f64 * 1e6);
        println!(
            "chain of {links:>5}: per step and link {implicit:.2} µs (generalized-α), {explicit:.2} µs (DOP853, 12 \
             evaluations)"
        );
    }
}

/// Allocations of 40 more steps, with and without derivatives.
fn allocations() {
    let model = tip(8);
    let b = model.equal_links();
    let mechanism = model.build(&b).unwrap();
    let count = |run: &dyn Fn(f64)| {
        let allocated = |steps: f64| allocation_counter::measure(|| run(steps)).count_total;
        allocated(10.0); // starts threads and initializes tables
        allocated(50.0).abs_diff(allocated(10.0))
    };
    let h = 1e-3;
    let settings = Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(h));
    let analysis = count(&|steps| drop(simulate_explicitly(&mechanism, &settings, &[h * steps]).unwrap()));
    let both = count(&|steps| drop(differentiate_explicitly(&model, &b, &settings, &[h * steps]).unwrap()));
    let implicit = count(&|steps| drop(simulate(&mechanism, &Dynamics::fixed(h), &[h * steps]).unwrap()));
    println!("allocations in 40 more steps: DOP853 {analysis}, with 16 derivatives {both}, generalized-α {implicit}");
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let links: Vec<usize> = arguments.iter().filter_map(|a| a.parse().ok()).collect();
    let asks = |what: &str| arguments.iter().any(|a| a == what);
    match (links.is_empty(), asks("scaling"), asks("speed")) {
        (false, ..) => links.iter().for_each(|&n| chain(n, 8)),
        _ if asks("spatial") => spatial(),
        (true, true, _) => scaling(),
        (true, false, true) => [8, 32].into_iter().for_each(speed),
        (true, false, false) => {
            [8, 32].into_iter().for_each(speed);
            chain(8, 8);
            chain(32, 6);
            implicit(8);
            implicit(32);
            scaling();
            spatial();
            allocations();
        }
    }
}
