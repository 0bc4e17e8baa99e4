//! Events of model files: a throw with its known optimum, the trebuchet, and mistakes.

use linkwright::model_file::read;
use linkwright::problem::{Problem, ResponseAt};

/// A stone thrown with 20 m/s at an angle; a wind pushes it from a given time on.
const THROW: &str = r#"
version = 2
gravity = [0, -9.81]
[design]
angle = { start = 0.4, lower = 0.1, upper = 1.4, unit = "rad" }
gust = { start = 0.5, lower = 0.1, upper = 1.0, unit = "s" }
[[body]]
name = "stone"
kind = "point"
mass = 2
position = [0, 0]
velocity = ["20*cos(angle)", "20*sin(angle)"]
[[force]]
name = "wind"
kind = "load"
b = "stone.x"
generalized_force = 3
[[event]]
name = "blow"
when = "time > gust"
switch_on = "wind"
[[event]]
name = "landing"
when = "stone.y < 0"
terminal = true
[time]
to = 5
points = 11
[analysis]
kind = "dynamics"
step = 0.01
[[output]]
name = "range"
value = "stone.x"
at_event = "landing"
unit = "m"
[[output]]
name = "duration"
value = "time"
at_event = "landing"
[[output]]
name = "x"
value = "stone.x"
[objective]
maximize = "range"
[[constraint]]
name = "duration"
value = "duration"
at_most = 3.5
[[constraint]]
name = "gust"
value = "gust"
at_least = 0.5
"#;

fn problem(text: &str) -> Problem {
    read("m.toml", text).unwrap_or_else(|report| panic!("{report}")).problem().unwrap()
}

/// Range, duration and their derivatives by the angle and the time of the gust, in closed form.
fn throw([angle, gust]: [f64; 2]) -> [[f64; 3]; 2] {
    let (sin, cos) = angle.sin_cos();
    let (duration, rate, push) = (40.0 * sin / 9.81, 40.0 * cos / 9.81, 1.5);
    let blown = duration - gust;
    let range = 20.0 * cos * duration + 0.5 * push * blown * blown;
    let by_angle = -20.0 * sin * duration + 20.0 * cos * rate + push * blown * rate;
    [[range, by_angle, -push * blown], [duration, rate, 0.0]]
}

#[test]
fn outputs_at_events_are_numbers_with_exact_derivatives() {
    let problem = problem(THROW);
    let b = [0.7, 0.6];
    let responses = problem.analyze(&b).unwrap();
    let all = [0, 1].map(|response| ResponseAt { response, point: 0 });
    let methods = problem.analysis.gradient_methods();
    for (name, error) in [("direct", 1e-8), ("adjoint", 1e-8), ("semi-analytical", 1e-6)] {
        let method = methods.iter().find(|method| method.name == name).unwrap();
        let rows = method.sensitivities(&b, &responses, &all).unwrap();
        for (h, [value, by_angle, by_gust]) in throw(b).into_iter().enumerate() {
            assert_eq!(responses.values[h].len(), 1);
            assert!((responses.values[h][0] - value).abs() < 1e-9, "{h}: {} {value}", responses.values[h][0]);
            for (i, exact) in [by_angle, by_gust].into_iter().enumerate() {
                assert!((rows[(h, i)] - exact).abs() < error, "{name}, {h} by {i}: {} {exact}", rows[(h, i)]);
            }
        }
    }
    // The history keeps its value after the landing.
    assert_eq!(responses.values[2][10], responses.values[0][0]);
}

#[test]
fn the_farthest_throw_is_the_one_of_the_closed_form() {
    let model = read("m.toml", THROW).unwrap_or_else(|report| panic!("{report}"));
    let outcome = model.method().solve(&model.problem().unwrap(), |_| ()).unwrap();
    assert!(outcome.status.is_success(), "{:?}", outcome.status);
    let best = (0..13_000).map(|k| 0.1 + k as f64 * 1e-4).max_by(|a, b| {
        let range = |angle: &f64| throw([*angle, 0.5])[0][0];
        range(a).total_cmp(&range(b))
    });
    let (found, best) = (outcome.design, best.unwrap());
    assert!((found[0] - best).abs() < 1e-3 && (found[1] - 0.5).abs() < 1e-6, "{found:?} {best}");
}

#[test]
fn the_trebuchet_is_solved_in_at_most_fifteen_analyses() {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/models/trebuchet.toml")).unwrap();
    let model = read("trebuchet.toml", &text).unwrap_or_else(|report| panic!("{report}"));
    let problem = model.problem().unwrap();
    let outcome = model.method().solve(&problem, |_| ()).unwrap();
    assert!(outcome.status.is_success(), "{:?}", outcome.status);
    let analyses = outcome.counters.analyses;
    assert!(analyses <= 15, "{analyses} analyses");
    for (found, expected) in outcome.design.iter().zip([3.0918, 3.8334, 1.1134]) {
        assert!((found - expected).abs() < 1e-3, "{:?}", outcome.design);
    }
    // No design around it throws farther.
    let range = |design: &[f64]| problem.analyze(design).unwrap().values[0][0];
    let best = range(&outcome.design);
    assert!((best - 141.65).abs() < 0.01, "{best}");
    for i in 0..3 {
        for change in [-0.01, 0.01] {
            let mut other = outcome.design.clone();
            other[i] += change;
            assert!(range(&other) < best, "{i} {change}");
        }
    }
}

#[test]
fn derivatives_of_the_trebuchet_equal_differences() {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/models/trebuchet.toml")).unwrap();
    let problem = problem(&text);
    let b = problem.start();
    let responses = problem.analyze(&b).unwrap();
    let all = [0, 1, 2, 3].map(|response| ResponseAt { response, point: 0 });
    let rows = problem.sensitivities(&b, &responses, &all).unwrap();
    for i in 0..b.len() {
        let at = |change: f64| {
            let mut moved = b.clone();
            moved[i] += change;
            problem.analyze(&moved).unwrap().values
        };
        let (low, high, h) = (at(-1e-5), at(1e-5), 2e-5);
        for (k, (low, high)) in low.iter().zip(&high).take(all.len()).enumerate() {
            let (ours, theirs) = (rows[(k, i)], (high[0] - low[0]) / h);
            assert!((ours - theirs).abs() < 1e-5 * theirs.abs().max(1.0), "{k} by {i}: {ours} {theirs}");
        }
    }
}

/// The mistake in the file, its replacement, and what the message and the line that it shows contain.
const MISTAKES: &[[&str; 4]] = &[
    ["switch_on = \"wind\"", "switch_on = \"winds\"", "did you mean `wind`", "switch_on"],
    ["switch_on = \"wind\"", "release = \"wind\"", "cannot be released", "release"],
    ["switch_on = \"wind\"", "switch_on = [\"wind\", \"wind\"]", "changed twice by one event", "switch_on"],
    ["time > gust", "gust > 0.3", "does not change during the motion", "when"],
    ["time > gust", "time - gust", "one of < <= > >=", "when"],
    ["time > gust", "kinetic_energy > 5", "cannot use an energy", "when"],
    ["at_event = \"landing\"", "at_event = \"landin\"", "did you mean `landing`", "at_event"],
    ["name = \"blow\"", "name = \"wind\"", "taken twice", "name"],
];

#[test]
fn every_mistake_is_shown_at_its_place() {
    for [good, bad, message, line] in MISTAKES {
        assert!(THROW.contains(good), "{good}");
        let report = read("m.toml", &THROW.replacen(good, bad, 1)).map(drop).expect_err(bad).to_string();
        assert!(report.contains(message) && report.contains(line), "{bad}:\n{report}");
    }
}

/// Implicit steps of 1 ms have errors near 1e-6 here.
#[test]
fn explicit_schemes_have_events() {
    let analyse = |steps: &str| {
        let model =
            read("m.toml", &THROW.replacen("step = 0.01", steps, 1)).unwrap_or_else(|report| panic!("{report}"));
        let problem = model.problem().unwrap();
        let responses = problem.analyze(&problem.start()).unwrap();
        let count = responses.values.len();
        let wanted: Vec<_> = (0..count).map(|response| ResponseAt { response, point: 0 }).collect();
        (responses.values.clone(), problem.analysis.sensitivities(&problem.start(), &responses, &wanted).unwrap())
    };
    let (values, rows) = analyse("step = 1e-3");
    for steps in ["scheme = \"rk8\"\ntolerance = 1e-10", "scheme = \"rk5\"\nstep = 1e-3"] {
        let (ours, ours_rows) = analyse(steps);
        for (a, b) in ours.iter().flatten().zip(values.iter().flatten()) {
            assert!((a - b).abs() < 1e-4 * b.abs().max(1.0), "{steps}: {a} {b}");
        }
        for (a, b) in ours_rows.iter().zip(&rows) {
            assert!((a - b).abs() < 1e-3 * b.abs().max(1.0), "{steps}: {a} {b}");
        }
    }
}

#[test]
fn an_event_that_does_not_happen_is_shown_at_its_part() {
    let model = read("m.toml", &THROW.replacen("to = 5", "to = 1", 1)).unwrap_or_else(|report| panic!("{report}"));
    let problem = model.problem().unwrap();
    let error = problem.analyze(&problem.start()).map(drop).unwrap_err();
    let report = model.locate(&error).expect("the event is a part of the file").to_string();
    assert!(report.contains("landing") && report.contains("has not happened"), "{report}");
}

/// A slider of 1 kg that forces accelerate, with events whose comparisons are equalities at the start.
fn slider_with_events(velocity: f64, events: &[&str], steps: &str) -> String {
    let event = |(k, text): (usize, &&str)| format!("[[event]]\nname = \"e{k}\"\n{text}\n");
    let events: String = events.iter().enumerate().map(event).collect();
    format!(
        "version = 2\n[[body]]\nname = \"a\"\nkind = \"slider\"\nmass = 1\nposition = 1\nvelocity = {velocity}\n\
         [[force]]\nname = \"push\"\nkind = \"load\"\nb = \"a\"\ngeneralized_force = 1\n\
         [[force]]\nname = \"brake\"\nkind = \"coordinate-spring\"\nb = \"a\"\nstiffness = 0\ndamping = 5\n\
         [[force]]\nname = \"pull\"\nkind = \"load\"\nb = \"a\"\ngeneralized_force = 2\n\
         {events}[time]\nto = 1\npoints = 11\n[analysis]\nkind = \"dynamics\"\n{steps}\n\
         [[output]]\nname = \"v\"\nvalue = \"a.velocity\"\n{}",
        crate::space::OBJECTIVE
    )
}

/// A comparison that is an equality at the start, and true at once after it, is an event at the start; one that is false after it is none, and one
/// that is true from the start is named as such.
#[test]
fn comparisons_that_are_equalities_at_the_start_become_true_or_not() {
    let (brake, pull) = ("switch_on = \"brake\"", "switch_on = \"pull\"");
    let braked = |velocity: f64, force: f64| force / 5.0 + (velocity - force / 5.0) * (-5.0f64).exp();
    let free = |velocity: f64, force: f64| velocity + force;
    // With the events that are off in the beginning, where they do not happen.
    let never = |effect: &str| format!("when = \"time > 2\"\n{effect}");
    let when = |condition: &str, effect: &str| format!("when = \"{condition}\"\n{effect}");
    let cases = [
        (0.0, vec![when("a.velocity > 0", brake), never(pull)], braked(0.0, 1.0)),
        (0.0, vec![when("a.position > 1", brake), never(pull)], braked(0.0, 1.0)),
        (0.0, vec![when("a.position < 1", brake), never(pull)], free(0.0, 1.0)),
        (2.0, vec![when("a.position > 1", brake), when("time > 0", pull)], braked(2.0, 3.0)),
        (2.0, vec![when("a.position > 0", brake), when("2*time > 0", pull)], free(2.0, 3.0)),
        (-1.0, vec![when("a.position < 1", brake), never(pull)], braked(-1.0, 1.0)),
        // The slider returns to the place of its start, at t = 0.4 s.
        (-0.2, vec![when("a.position > 1", pull), never(brake)], 0.2 + 0.6 * 3.0),
    ];
    for steps in ["scheme = \"rk8\"\ntolerance = 1e-10", "step = 1e-3", "tolerance = 1e-9"] {
        for (velocity, events, exact) in &cases {
            let events: Vec<&str> = events.iter().map(String::as_str).collect();
            let text = slider_with_events(*velocity, &events, steps);
            let problem = read("m.toml", &text).unwrap_or_else(|report| panic!("{report}")).problem().unwrap();
            let responses = problem.analyze(&problem.start()).unwrap_or_else(|error| panic!("{events:?}: {error}"));
            let found = *responses.values[0].last().unwrap();
            assert!((found - exact).abs() < 2e-5, "{steps} {events:?}: {found} for {exact}");
            let holds = problem.analysis.warnings(&problem.start(), &responses);
            let is_named = holds.iter().any(|warning| warning.contains("holds from the start"));
            assert_eq!(is_named, events[0].contains("position > 0\""), "{events:?}: {holds:?}");
        }
    }
}

/// A ball that falls from 1 m, bounces, and ends in its second rebound; a slider under the square of its speed.
const BOUNCES: &str = r#"
version = 2
[design.restitution]
start = 0.8
[[body]]
name = "ball"
kind = "slider"
mass = 1
position = 1
[[force]]
name = "weight"
kind = "load"
b = "ball"
generalized_force = -9.81
[[force]]
name = "floor"
kind = "rigid-stop"
b = "ball"
clearance = 0
restitution = "restitution"
[[body]]
name = "meter"
kind = "slider"
mass = 1
[[force]]
name = "squared"
kind = "feedback"
coordinate = "meter"
generalized_force = "ball.velocity^2"
[[output]]
name = "integrated"
value = "meter.velocity"
[time]
to = 1.2
points = 25
[analysis]
kind = "dynamics"
scheme = "rk8"
[objective]
minimize = "final(integrated)"
"#;

/// ∫ v² dt up to 1.2 s: each part of the motion with the speed w after an impact adds (w³ − (w − g d)³)/(3 g) in its duration d.
#[test]
fn a_slider_of_unit_mass_integrates_a_history_that_jumps() {
    let problem = problem(BOUNCES);
    let integral = |e: f64| {
        let (g, fall) = (9.81, (2.0f64 / 9.81).sqrt());
        let (first, second) = (e * g * fall, e * e * g * fall);
        let rebound = 2.0 * first / g;
        let rest = 1.2 - fall - rebound;
        let part = |w: f64, d: f64| (w.powi(3) - (w - g * d).powi(3)) / (3.0 * g);
        part(0.0, fall) + part(first, rebound) + part(second, rest)
    };
    let responses = problem.analyze(&[0.8]).unwrap();
    assert!((responses.values[0][24] - integral(0.8)).abs() < 1e-9, "{}", responses.values[0][24]);
    let difference = (integral(0.8 + 1e-5) - integral(0.8 - 1e-5)) / 2e-5;
    for method in
        problem.analysis.gradient_methods().iter().filter(|method| ["direct", "adjoint"].contains(&method.name))
    {
        let rows = method.sensitivities(&[0.8], &responses, &[ResponseAt { response: 0, point: 24 }]).unwrap();
        assert!((rows[(0, 0)] - difference).abs() < 1e-7, "{}: {} and {difference}", method.name, rows[(0, 0)]);
    }
}

/// Two sliders that move together and cross zero at the same time, where one event switches a force on and the other one switches a force off.
const TOGETHER: &str = r#"
version = 2
[design]
k = { start = 20, lower = 1, upper = 100 }
F = { start = 4, lower = 0, upper = 10 }
[[body]]
name = "p"
kind = "slider"
mass = 1
position = 0.3
[[body]]
name = "q"
kind = "slider"
mass = 2
position = 0.3
[[force]]
name = "sp"
kind = "coordinate-spring"
b = "p"
stiffness = "k"
[[force]]
name = "sq"
kind = "coordinate-spring"
b = "q"
stiffness = "2*k"
[[force]]
name = "push"
kind = "load"
b = "q"
generalized_force = "F"
[[event]]
name = "cross_p"
when = "p.position < 0"
switch_on = "push"
[[event]]
name = "cross_q"
when = "q.position < 0"
switch_off = "sp"
[time]
to = 0.5
points = 6
[analysis]
kind = "dynamics"
step = 1e-3
[[output]]
name = "crossing"
value = "time"
at_event = "cross_p"
[[output]]
name = "p"
value = "p.position"
[[output]]
name = "q"
value = "q.position"
[objective]
minimize = "at(p, 0.5)"
"#;

#[test]
fn events_at_the_same_time_have_derivatives_by_every_method() {
    let (k, force, t) = (20.0_f64, 4.0, 0.5);
    let omega = k.sqrt();
    let crossing = std::f64::consts::FRAC_PI_2 / omega;
    let rate = -0.5 * crossing / k; // of the time of crossing with k
    let p = -0.3 * omega * (t - crossing);
    let p_by_k = -0.3 * (0.5 / omega * (t - crossing) - omega * rate);
    let angle = omega * (t - crossing);
    let q_by_force = (1.0 - angle.cos()) / (2.0 * k);
    let q = -0.3 * angle.sin() + force * q_by_force;
    for scheme in ["scheme = \"rk8\"\ntolerance = 1e-11", "step = 2e-4", "tolerance = 1e-10"] {
        let problem = problem(&TOGETHER.replace("step = 1e-3", scheme));
        let responses = problem.analyze(&[k, force]).unwrap();
        let wanted = [(0, 0), (1, 5), (2, 5)].map(|(response, point)| ResponseAt { response, point });
        let values = wanted.map(|at| responses.values[at.response][at.point]);
        for (value, exact) in values.into_iter().zip([crossing, p, q]) {
            assert!((value - exact).abs() < 1e-5, "{scheme}: {value} {exact}");
        }
        let methods = problem.analysis.gradient_methods();
        let names: Vec<_> = methods.iter().map(|method| method.name).collect();
        assert!(names.contains(&"direct") && names.contains(&"adjoint"), "{names:?}");
        for (method, name) in methods.iter().zip(names) {
            let rows = method.sensitivities(&[k, force], &responses, &wanted).unwrap();
            for (row, variable, exact) in [(0, 0, rate), (0, 1, 0.0), (1, 0, p_by_k), (1, 1, 0.0), (2, 1, q_by_force)] {
                let found = rows[(row, variable)];
                assert!((found - exact).abs() < 1e-5, "{scheme}, {name}: {found} {exact}");
            }
        }
    }
}

/// The flights of a ball on a shaken table end where they are as high as the rounding errors of the driven position: those of the time.
#[test]
fn a_ball_on_a_shaken_table_comes_to_rest_on_it() {
    let text = |amplitude: f64, restitution: f64| {
        format!(
            r#"
version = 2
gravity = [0, -9.81]
[[body]]
name = "table"
kind = "massless-node"
position = [0, 0]
[[driver]]
name = "dx"
coordinate = "table.x"
motion = "0"
[[driver]]
name = "dy"
coordinate = "table.y"
motion = "{amplitude}*sin(10*pi*time)"
[[driver]]
name = "dth"
coordinate = "table.theta"
motion = "0"
[[body]]
name = "ball"
kind = "point"
mass = 0.2
position = [0, 0]
velocity = [0, "10*pi*{amplitude}"]
[[force]]
name = "floor"
kind = "rigid-wall"
a = "table"
b = "ball"
restitution = {restitution}
[time]
to = 1
points = 201
[analysis]
kind = "dynamics"
scheme = "rk8"
tolerance = 1e-11
[[output]]
name = "force"
value = "floor.contact_force"
"#
        )
    };
    // The number of time points after 0.2 s at which the ball rests, by an integration from impact to impact in another program.
    let cases =
        [(0.015, 0.35, 48), (0.015, 0.5, 28), (0.018, 0.35, 12), (0.019, 0.35, 0), (0.019, 0.5, 1), (0.022, 0.35, 0)];
    for (amplitude, restitution, expected) in cases {
        let model = read("m.toml", &text(amplitude, restitution)).unwrap_or_else(|report| panic!("{report}"));
        let force = &model.simulate(&[]).unwrap().values[0];
        let omega = 10.0 * std::f64::consts::PI;
        let mut rests = 0;
        for (t, found) in force.iter().enumerate().map(|(k, found)| (0.005 * k as f64, *found)) {
            // On the table the force is that of its acceleration; in flight it is zero.
            let pressed = 0.2 * (9.81 - amplitude * omega * omega * (omega * t).sin());
            let is_right = found == 0.0 || (found - pressed).abs() < 1e-9;
            assert!(is_right, "{amplitude}, {restitution}, {t}: {found} {pressed}");
            rests += usize::from(found > 0.0 && t > 0.2);
        }
        assert_eq!(rests, expected, "{amplitude}, {restitution}");
    }
}

/// A weight on a spring, which would hang 0.4 m lower without the floor: the equilibrium at the start has no rigid contacts, and says so.
#[test]
fn an_equilibrium_at_the_start_says_that_it_has_no_rigid_contacts() {
    let text = |floor: f64, spring: &str| {
        format!(
            "version = 2\n[[body]]\nname = \"weight\"\nkind = \"slider\"\nmass = 2\n{spring}\
             [[force]]\nname = \"floor\"\nkind = \"rigid-stop\"\nb = \"weight\"\nclearance = {floor}\nrestitution = 0.5\n\
             [time]\nto = 1\npoints = 3\n[analysis]\nkind = \"dynamics\"\nstep = 0.01\ninitial_configuration = \"equilibrium\"\n\
             [[output]]\nname = \"y\"\nvalue = \"weight.position\"\n"
        )
    };
    let spring = "[[force]]\nname = \"s\"\nkind = \"coordinate-spring\"\nb = \"weight\"\nstiffness = 50\n";
    let weight = "[[force]]\nname = \"g\"\nkind = \"load\"\nb = \"weight\"\ngeneralized_force = -20\n";
    let run =
        |floor: f64, spring: &str| read("m.toml", &text(floor, &format!("{spring}{weight}"))).unwrap().simulate(&[]);
    let values = run(-0.5, spring).unwrap().values;
    assert!(values[0].iter().all(|y| (y + 0.4).abs() < 1e-9), "{values:?}");
    let error = run(-0.1, spring).err().unwrap().to_string();
    assert!(
        error.contains("floor") && error.contains("without rigid contacts") && error.contains("3.000e-1"),
        "{error}"
    );
    assert!(error.contains("stiffness and damping"), "{error}");
    // Nothing but the floor carries the weight.
    let error = run(0.0, "").err().unwrap().to_string();
    assert!(error.contains("such as floor") && error.contains("stiffness and damping"), "{error}");
}

/// A slider of 1 kg with 10 m/s that a damper of the coefficient c slows down from x = 1 m on: its force is 10 c there, and decreases. The end of
/// the motion after 2 s is x = 1 + 10/c (1 − exp(−1.9 c)).
fn braked(objective: &str) -> String {
    format!(
        "version = 2\n[design]\nc = {{ start = 2, lower = 0.5, upper = 20 }}\n\
         [[body]]\nname = \"car\"\nkind = \"slider\"\nmass = 1\nvelocity = 10\n\
         [[force]]\nname = \"brake\"\nkind = \"coordinate-spring\"\nb = \"car\"\nstiffness = 0\ndamping = \"c\"\n\
         [[event]]\nname = \"on\"\nwhen = \"car.position > 1\"\nswitch_on = \"brake\"\n\
         [[output]]\nname = \"x\"\nvalue = \"car.position\"\n[[output]]\nname = \"force\"\nvalue = \"brake.generalized_force\"\n\
         [time]\nto = 2\npoints = 31\n[analysis]\nkind = \"dynamics\"\n{objective}"
    )
}

/// The design and the objective where the model converges.
fn optimum(text: &str) -> (Vec<f64>, f64) {
    let model = read("m.toml", text).unwrap_or_else(|report| panic!("{report}"));
    let outcome = model.method().solve(&model.problem().unwrap(), |_| ()).unwrap();
    assert!(outcome.status.is_success(), "{:?}: {text}", outcome.status);
    (outcome.design, outcome.evaluation.objective)
}

/// The largest force is the one just after the event, which no time point has.
#[test]
fn limited_histories_include_both_sides_of_events() {
    let limit = |value: &str, limits: &str| {
        format!(
            "[objective]\nminimize = \"final(x)\"\n[[constraint]]\nname = \"limit\"\nvalue = \"{value}\"\n{limits}\n"
        )
    };
    let schemes = ["", "tolerance = 1e-9\n", "scheme = \"rk8\"\ntolerance = 1e-10\n"];
    let cases = [
        limit("force", "at_most = 50"),
        limit("abs(force)", "at_most = 50"),
        limit("-force", "at_least = -50\nat_most = 1"),
        limit("force", "at_most = 50\ncontinuous = true"),
        limit("max(force)", "at_most = 50"),
        limit("force^2 + time", "at_most = 2500.1"), // the event is at 0.1 s
        limit("force", "at_most = 50\nfrom = 0.05\nto = 0.2"),
        limit("max(force, 0.05, 2)", "at_most = 50"),
        limit("force^2 + time", "at_most = 2500.1\nto = 0.12"),
    ];
    for scheme in schemes {
        for objective in &cases {
            let (design, _) = optimum(&braked(&format!("{scheme}{objective}")));
            assert!((design[0] - 5.0).abs() < 2e-4, "{scheme} {objective}: {design:?}");
        }
        let objective = "[objective]\nminimize = \"peak(force)\"\n[[constraint]]\nname = \"way\"\nvalue = \"final(x)\"\nat_most = 3\n";
        let (design, peak) = optimum(&braked(&format!("{scheme}{objective}")));
        // 10/c (1 − exp(−1.9 c)) = 2
        let exact = (0..50).fold(5.0f64, |c, _| 5.0 * (1.0 - (-1.9 * c).exp()));
        assert!((design[0] - exact).abs() < 2e-4 && (peak - 10.0 * exact).abs() < 2e-3, "{scheme}: {design:?} {peak}");
        let windowed = objective.replace("peak(force)", "peak(force, 0.05, 2)");
        let (design, peak) = optimum(&braked(&format!("{scheme}{windowed}")));
        assert!((design[0] - exact).abs() < 2e-4 && (peak - 10.0 * exact).abs() < 2e-3, "{scheme}: {design:?} {peak}");
        // The value at the event, 10 c at 0.1 s, has no limit outside the interval: 10 c exp(−0.1 c) = 30 at 0.2 s, or no limit at all.
        let at_first_point = (0..200).fold(3.0f64, |c, _| 3.0 * (0.1 * c).exp());
        for (interval, exact) in [("from = 0.19\nto = 2", at_first_point), ("to = 0.07", 8.0)] {
            let objective = limit("force", &format!("at_most = 30\n{interval}"));
            let (design, _) = optimum(&braked(&format!("{scheme}{objective}")).replace("upper = 20", "upper = 8"));
            assert!((design[0] - exact).abs() < 2e-3, "{scheme} {interval}: {design:?} {exact}");
        }
    }
}

/// A value just after an event is one with the forces that begin there, by every method of differentiation.
#[test]
fn outputs_just_after_an_event_have_exact_derivatives() {
    let sides = "[[output]]\nname = \"before\"\nvalue = \"brake.generalized_force\"\nat_event = \"on\"\n\
                 [[output]]\nname = \"after\"\nvalue = \"brake.generalized_force\"\nafter_event = \"on\"\n";
    for scheme in ["", "tolerance = 1e-9\n", "scheme = \"rk8\"\ntolerance = 1e-10\n"] {
        let text = braked(&format!("{scheme}[objective]\nminimize = \"after\"\n{sides}"));
        let problem = problem(&text);
        let responses = problem.analyze(&[2.0]).unwrap();
        assert!(responses.values[2] == [0.0] && (responses.values[3][0] - 20.0).abs() < 1e-9, "{:?}", responses.values);
        let wanted = [2, 3].map(|response| ResponseAt { response, point: 0 });
        let methods = problem.analysis.gradient_methods();
        assert!(methods.len() >= 2);
        for method in methods {
            let rows = method.sensitivities(&[2.0], &responses, &wanted).unwrap();
            assert!(rows[(0, 0)].abs() < 1e-9 && (rows[(1, 0)] - 10.0).abs() < 1e-6, "{}: {rows}", method.name);
        }
    }
    let both = braked("[objective]\nminimize = \"after\"\n")
        + &sides.replace("\nafter_event", "\nat_event = \"on\"\nafter_event");
    assert!(read("m.toml", &both).map(drop).unwrap_err().to_string().contains("exclude each other"));
}

/// A table or belt of 7 kg whose speed jumps from 0 to 4/3 m/s and back, and what it moves: an impulse has no limit in steps of any kind, while friction
/// and contacts have one.
#[test]
fn jumps_of_driven_velocities_with_friction_or_contacts_are_refused() {
    let text = |contact: &str, analysis: &str| {
        format!(
            "version = 2\n[[body]]\nname = \"table\"\nkind = \"slider\"\nmass = 7\n[[body]]\nname = \"block\"\nkind = \"slider\"\nmass = 1.5\n\
             [[driver]]\nname = \"lift\"\ncoordinate = \"table\"\n\
             motion = {{ kind = \"ramp\", from = 0, to = 0.4, begin = 0.2, duration = 0.3, profile = \"linear\" }}\n\
             [[force]]\nname = \"weight\"\nkind = \"load\"\nb = \"block\"\ngeneralized_force = -14.7\n\
             [[force]]\nname = \"contact\"\n{contact}\na = \"table\"\nb = \"block\"\n\
             [time]\nto = 1\npoints = 21\n[analysis]\nkind = \"dynamics\"\n{analysis}\n[[output]]\nname = \"x\"\nvalue = \"block.position\"\n"
        )
    };
    let stop = "kind = \"rigid-stop\"\nclearance = 0\nrestitution = 0.5";
    let rub = "kind = \"dry-friction\"\ncoulomb_force = 30\nstatic_ratio = 1.2";
    for contact in [stop, rub] {
        for analysis in
            ["step = 1e-3", "step = 2.7e-4\nscheme = \"hht\"", "tolerance = 1e-6", "scheme = \"rk8\"\ntolerance = 1e-8"]
        {
            let error = read("m.toml", &text(contact, analysis)).unwrap().simulate(&[]).err().unwrap().to_string();
            assert!(error.contains("table") && error.contains("jumps by 1.333"), "{contact} {analysis}: {error}");
            assert!(
                error.contains("continuous velocity") && !error.contains("fixed steps"),
                "{contact} {analysis}: {error}"
            );
        }
        // A smooth ramp is fine.
        let smooth = text(contact, "step = 1e-3").replace("\"linear\"", "\"smooth\"");
        assert!(read("m.toml", &smooth).unwrap().simulate(&[]).is_ok(), "{contact}");
    }
    // A spring and a damper transmit the motion without a limit.
    let spring = "kind = \"coordinate-spring\"\nstiffness = 1e3\ndamping = 10";
    assert!(read("m.toml", &text(spring, "step = 1e-3")).unwrap().simulate(&[]).is_ok());
}
