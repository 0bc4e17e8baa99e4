//! The choice of derivatives in a model file.

use crate::kinds::assert_derivatives;
use linkwright::approximation::CycleData;
use linkwright::gradient_check::GradientStatus;
use linkwright::model_file::read;
use linkwright::problem::{Problem, ResponseAt};

const MODEL: &str = r#"
version = 2
[design.k]
start = 40.0
[design.c]
start = 0.7
[objective]
minimize = "k"
[time]
to = 0.5
points = 6
[[body]]
name = "cart"
kind = "slider"
mass = 1.3
position = 0.1
[[force]]
name = "spring"
kind = "coordinate-spring"
b = "cart"
stiffness = "k"
damping = "c"
[[output]]
name = "position"
value = "cart.position"
"#;
const DYNAMICS: &str = "kind = \"dynamics\"\nstep = 0.01\n";
const EXPLICIT: &str = "kind = \"dynamics\"\nscheme = \"rk8\"\ntolerance = 1e-10\n";

fn text(analysis: &str, derivatives: &str) -> String {
    format!("{MODEL}[analysis]\n{analysis}derivatives = \"{derivatives}\"\n")
}

fn problem(text: &str) -> linkwright::Result<Problem> {
    read("m.toml", text).unwrap_or_else(|report| panic!("{report}")).problem()
}

fn derivatives_by(text: &str) -> [f64; 2] {
    let problem = problem(text).unwrap();
    let b = problem.start();
    let row =
        problem.sensitivities(&b, &problem.analyze(&b).unwrap(), &[ResponseAt { response: 0, point: 4 }]).unwrap();
    [row[(0, 0)], row[(0, 1)]]
}

#[test]
fn every_choice_gives_the_same_derivatives() {
    let exact = derivatives_by(&text(DYNAMICS, "automatic"));
    for (choice, tolerance) in [
        ("direct", 1e-12),
        ("adjoint", 1e-12),
        ("semi-analytical", 1e-8),
        ("forward", 1e-5),
        ("central", 1e-7),
        ("richardson", 1e-9),
        ("noise-aware", 1e-9),
    ] {
        let found = derivatives_by(&text(DYNAMICS, choice));
        let off = (0..2).map(|k| (found[k] / exact[k] - 1.0).abs()).fold(0.0, f64::max);
        assert!(off < tolerance, "{choice}: {off:.1e}");
    }
    let exact = derivatives_by(&text(EXPLICIT, "automatic"));
    assert_eq!(exact, derivatives_by(&text(EXPLICIT, "direct")));
    // A given step: an error of first order.
    let coarse = derivatives_by(&(text(DYNAMICS, "forward") + "difference = 0.1\n"));
    assert!((coarse[0] / exact[0] - 1.0).abs() > 1e-3);
}

#[test]
fn kinematics_and_statics_have_a_choice_too() {
    let driven = MODEL
        .replace("[[force]]", "[[driver]]\nname = \"drive\"\ncoordinate = \"cart\"\nmotion = \"c*time^2\"\n[[force]]");
    let driven = driven.replace("cart.position\"", "spring.generalized_force\"");
    let still = MODEL.replace(
        "[[force]]",
        "[[force]]\nname = \"pull\"\nkind = \"load\"\nb = \"cart\"\ngeneralized_force = \"c*time\"\n[[force]]",
    );
    for (model, kind) in [(driven, "kinematics"), (still, "statics")] {
        let of = |choice: &str| {
            derivatives_by(&format!("{model}[analysis]\nkind = \"{kind}\"\nderivatives = \"{choice}\"\n"))
        };
        let exact = of("direct");
        assert!(exact.iter().all(|slope| *slope != 0.0), "{exact:?}");
        for choice in ["automatic", "semi-analytical", "central", "richardson", "noise-aware"] {
            let found = of(choice);
            let off = (0..2).map(|k| (found[k] / exact[k] - 1.0).abs()).fold(0.0, f64::max);
            assert!(off < 1e-6, "{kind}, {choice}: {off:.1e}");
        }
    }
}

#[test]
fn an_unsupported_method_is_rejected_with_the_supported_ones() {
    let error = |text: &str| read("m.toml", text).map(|_| ()).unwrap_err().to_string();
    let message = error(&text(EXPLICIT, "semi-analytical"));
    assert!(message.contains("explicit schemes") && message.contains("derivatives = \"direct\""), "{message}");
    let message = error(&(text(DYNAMICS, "direct") + "difference = 1e-4\n"));
    assert!(message.contains("these derivatives use none"), "{message}");
    let message = error(&(text(DYNAMICS, "central") + "difference = 2\n"));
    assert!(message.contains("between 0 and 1"), "{message}");
    let message = error(&text(DYNAMICS, "complex"));
    assert!(message.contains("richardson"), "{message}");
}

/// An integral and a mean over 201 time points: with `adjoint` they are responses of their own, with the gradients of `direct`,
/// and the same optimum.
#[test]
fn functionals_of_histories_have_one_gradient_by_the_adjoint_method() {
    let model = MODEL
        .replace("minimize = \"k\"", "name = \"travel\"\nminimize = \"integral(position^2) + 1e-5*k^2\"")
        .replace("points = 6", "points = 201")
        .replace("[time]", "[[constraint]]\nname = \"rms\"\nvalue = \"rms(position)\"\nat_most = 0.2\n[time]");
    let of = |choice: &str| {
        let text = format!("{model}[analysis]\n{DYNAMICS}derivatives = \"{choice}\"\n");
        let problem = problem(&text).unwrap();
        let start = problem.start();
        let analysed = problem.analyze_design(&start).unwrap();
        let rows = CycleData::first_order(&problem, &analysed, problem.all_rows()).unwrap().sensitivities;
        let gradient = |signed, p| problem.total_derivative(signed, p, &start, &analysed.responses, &rows);
        let gradients =
            [gradient(problem.objective.signed(), 0), gradient(problem.constraints[0].signed(), 0)].concat();
        (problem, analysed.evaluation, gradients, rows.at.len())
    };
    let ((_, evaluation, direct, many), (problem, same, adjoint, few)) = (of("direct"), of("adjoint"));
    assert_eq!((many, few), (201, 2));
    assert_eq!((evaluation.objective, evaluation.residuals), (same.objective, same.residuals));
    for (a, b) in direct.iter().zip(&adjoint) {
        assert!((a - b).abs() < 1e-9 * a.abs(), "{direct:?} {adjoint:?}");
    }
    assert_eq!(problem.responses.last().unwrap().name, "rms (value)");
}

/// Derivatives of adaptive steps are those of the steps at this design. `check` compares them with differences of motions by
/// the same steps: differences of motions by other steps deviate by the discretization error, here 1e-4 and more. All
/// methods differentiate the steps up to the last output time, whatever times are wanted.
#[test]
fn derivatives_of_adaptive_steps_are_right_at_every_tolerance() {
    for name in ["impact-absorber", "nonlinear-absorber", "pendulum-chain", "vehicle-suspension"] {
        let path = format!("{}/examples/models/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let file = std::fs::read_to_string(path).unwrap();
        for tolerance in ["1e-5", "1e-8"] {
            let lines = file.lines().map(|line| match line.starts_with("tolerance") {
                true => format!("tolerance = {tolerance}\n"),
                false => format!("{line}\n"),
            });
            let problem = problem(&lines.collect::<String>()).unwrap();
            let b: Vec<f64> = problem.start().iter().map(|b| 1.037 * b).collect();
            let checked = problem.check_sensitivities(&b, 3).unwrap();
            let of_design = checked.derivatives.iter().map(|d| (d.computed[0] - d.computed[1]).abs());
            // Close to the limit of stability the differences of the energy of the pendulums are inaccurate, and say so.
            assert_eq!(checked.count(GradientStatus::Wrong), 0, "{name} at {tolerance}");
            assert!(checked.count(GradientStatus::Unclear) <= 2, "{name} at {tolerance}");
            let apart = of_design.fold(0.0, f64::max);
            assert!(apart < 1e-9, "{name} at {tolerance}: direct and adjoint differ by {apart:.1e}");
        }
    }
    let implicit = text("kind = \"dynamics\"\ntolerance = 1e-5\n", "automatic");
    let problem = problem(&implicit).unwrap();
    problem.check_sensitivities(&problem.start(), 4).unwrap().expect_right();
}

/// Formulas that are smooth where their parts are singular: powers at zero, angles on an axis, the magnitude of a force that is zero. Most were
/// refused, as their derivatives were NaN.
#[test]
fn smooth_formulas_have_derivatives_where_their_parts_are_singular() {
    let values =
        ["(n*time)^2.5", "n*max(time-0.5,0)^1.5", "time^(n+0.5)", "atan2(n*(time+1), time-0.5)", "norm(time*n, 2.5)"];
    for value in values {
        let text = format!(
            "version = 2\n[design.n]\nstart = 1.5\n[time]\nto = 1\npoints = 11\n[[output]]\nname = \"o\"\nvalue = \"{}\"\n\
             [objective]\nminimize = \"{}\"\n",
            if value.starts_with("norm") { "time*n" } else { value },
            if value.starts_with("norm") { "norm(o, 2.5)" } else { "final(o)" },
        );
        assert_derivatives(&text);
    }
    for motion in ["n*time^2.5", "0.3*time^(n + 1)"] {
        let text = format!(
            "version = 2\n[design.n]\nstart = 1.5\n[[body]]\nname = \"s\"\nkind = \"slider\"\nmass = 1\n[[driver]]\nname = \"d\"\n\
             coordinate = \"s\"\nmotion = \"{motion}\"\n[time]\nto = 1\npoints = 6\n[analysis]\nkind = \"kinematics\"\n\
             [[output]]\nname = \"o\"\nvalue = \"d.driving_force\"\n[objective]\nminimize = \"final(o)\"\n"
        );
        assert_derivatives(&text);
    }
    // An arm without gravity whose torque rises from zero: no force in its pin at the start.
    let text = "version = 2\n[design.L]\nstart = 1\n[[body]]\nname = \"p\"\nmass = 1\ninertia = 0.1\nposition = [\"L\", 0]\n[[joint]]\n\
                name = \"pin\"\na = \"ground\"\nb = { body = \"p\", at = [\"-L\", 0] }\n[[force]]\nname = \"m\"\nkind = \"load\"\n\
                b = \"p.theta\"\ngeneralized_force = \"2*time\"\n[time]\nto = 1\npoints = 11\n[analysis]\nkind = \"dynamics\"\n\
                scheme = \"rk8\"\n[[output]]\nname = \"f\"\nvalue = \"pin.force\"\n[objective]\nminimize = \"mean(f)\"\n";
    assert_derivatives(text);
}

/// The assembly of a linkage of a micrometre is as accurate as that of a metre: x = 1/2 − … by the law of cosines.
#[test]
fn small_linkages_are_assembled_as_accurately_as_large_ones() {
    let position = |s: f64| {
        let text = format!(
            "version = 2\n[constants]\ns = {s:e}\n[[body]]\nname = \"p\"\nkind = \"point\"\nmass = 1\nposition = [\"0.55*s\", \"0.8*s\"]\n\
             [[joint]]\nname = \"a\"\nkind = \"distance\"\na = \"ground\"\nb = \"p\"\nlength = \"s\"\n[[driver]]\nname = \"m\"\n\
             kind = \"length\"\na = {{ body = \"ground\", at = [\"s\", 0] }}\nb = \"p\"\nmotion = \"s*(1 + 0.3*sin(6*time))\"\n[time]\n\
             to = 1\npoints = 6\n[analysis]\nkind = \"kinematics\"\n[[output]]\nname = \"x\"\nvalue = \"p.x/s\"\n{}",
            crate::space::OBJECTIVE
        );
        problem(&text).unwrap().analyze(&[1.0]).unwrap().values[0].clone()
    };
    for s in [1.0, 1e-3, 1e-6] {
        for (k, x) in position(s).into_iter().enumerate() {
            let length = 1.0 + 0.3 * (6.0 * 0.2 * k as f64).sin();
            let exact = 1.0 - 0.5 * length * length;
            assert!((x - exact).abs() < 1e-9, "{s:e}, point {k}: {x} for {exact}");
        }
    }
}

/// Lengths may have any unit: a four-bar with a rough guess assembles as well in micrometres as in metres.
#[test]
fn rough_positions_are_assembled_in_any_unit_of_length() {
    let bar = |name: &str, [x, y]: [f64; 2], angle: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = \"s^2\"\nposition = [\"{x}*s\", \"{y}*s\"]\nangle = {angle}\n"
        )
    };
    let pin = |name: &str, [a, from]: [&str; 2], [b, to]: [&str; 2]| {
        format!(
            "[[joint]]\nname = \"{name}\"\na = {{ body = \"{a}\", at = [\"{from}*s\", 0] }}\nb = {{ body = \"{b}\", at = [\"{to}*s\", 0] }}\n"
        )
    };
    let angle = |s: f64| {
        let bars = [bar("c", [0.1, 0.0], 0.0), bar("k", [0.5, 0.2], 0.4), bar("l", [0.8, 0.25], 1.5)].concat();
        let pins = [
            pin("A", ["ground", "0"], ["c", "-0.1"]),
            pin("B", ["c", "0.1"], ["k", "-0.35"]),
            pin("C", ["k", "0.35"], ["l", "0.25"]),
            pin("D", ["ground", "0.8"], ["l", "-0.25"]),
        ];
        let text = format!(
            "version = 2\n[constants]\ns = {s:e}\n{bars}{}[[driver]]\nname = \"m\"\ncoordinate = \"c.theta\"\nmotion = \"0.3 + time\"\n\
             [time]\nat = [0, 1]\n[analysis]\nkind = \"kinematics\"\n[[output]]\nname = \"x\"\nvalue = \"k.theta\"\n{}",
            pins.concat(),
            crate::space::OBJECTIVE
        );
        let problem = problem(&text).unwrap();
        problem.analyze(&[1.0]).unwrap_or_else(|error| panic!("{s:e}: {error}")).values[0].clone()
    };
    let exact = angle(1.0);
    // The loop is closed: the end of the coupler is half a unit from the pivot of the last bar.
    for (k, coupler) in exact.iter().enumerate() {
        let crank = 0.3 + k as f64;
        let end = [0.2 * crank.cos() + 0.7 * coupler.cos(), 0.2 * crank.sin() + 0.7 * coupler.sin()];
        assert!(((end[0] - 0.8).hypot(end[1]) - 0.5).abs() < 1e-9, "{coupler}");
    }
    for s in [1e-3, 30.0, 1e3, 1e6] {
        let found = angle(s);
        assert!(found.iter().zip(&exact).all(|(a, b)| (a - b).abs() < 1e-9), "{s:e}: {found:?} {exact:?}");
    }
}

/// Adaptive implicit steps for motions of any length: a pendulum in units of time from 10 ns to 1000 s has the same motion.
#[test]
fn the_first_adaptive_step_fits_the_length_of_the_motion() {
    let angle = |unit: f64| {
        let text = format!(
            "version = 2\ngravity = [0, \"-9.81/T^2\"]\n[constants]\nT = {unit:e}\n[[body]]\nname = \"a\"\nmass = 1\ninertia = 0.1\n\
             position = [0.5, 0]\n[[joint]]\nname = \"j\"\na = \"ground\"\nb = {{ body = \"a\", at = [-0.5, 0] }}\n[time]\nto = \"2*T\"\n\
             points = 21\n[analysis]\nkind = \"dynamics\"\ntolerance = 1e-9\n[[output]]\nname = \"th\"\nvalue = \"a.theta\"\n{}",
            crate::space::OBJECTIVE
        );
        let problem = problem(&text).unwrap();
        problem.analyze(&[1.0]).unwrap_or_else(|error| panic!("{unit:e}: {error}")).values[0].clone()
    };
    let exact = angle(1.0);
    // The energy is that of the start: ½ (I + m r²) ω² = m g r sin(−θ), so that the bar turns back at −π.
    let lowest = exact.iter().fold(0.0f64, |lowest, angle| lowest.min(*angle));
    assert!(lowest > -std::f64::consts::PI - 1e-5 && lowest < -3.0, "{lowest}");
    for unit in [1e-8, 1e-3, 1e3] {
        let found = angle(unit);
        assert!(found.iter().zip(&exact).all(|(a, b)| (a - b).abs() < 1e-5), "{unit:e}: {found:?} {exact:?}");
    }
}

/// An arm that is hinged twice at one place: its angle has derivatives, and the share of one hinge in the reaction has none.
fn hinged_twice(part: &str, analysis: &str) -> String {
    format!(
        "version = 2\ngravity = [0, -10]\n[design.k]\nstart = 40\nlower = 10\nupper = 90\n[objective]\nminimize = \"k\"\n\
         [time]\nto = 0.2\npoints = 3\n[[body]]\nname = \"arm\"\nmass = 2\ninertia = 0.1\nposition = [0.5, 0]\n\
         [[joint]]\neach = [{{ n = \"pin\" }}, {{ n = \"again\" }}]\nname = \"{{n}}\"\na = \"ground\"\nb = {{ body = \"arm\", at = [-0.5, 0] }}\n\
         {part}\n[[output]]\nname = \"share\"\nvalue = \"pin.force_y\"\n[[output]]\nname = \"height\"\nvalue = \"arm.y\"\n[analysis]\n{analysis}"
    )
}

const HINGED_SPRING: &str =
    "[[force]]\nname = \"s\"\nkind = \"coordinate-spring\"\nb = \"arm.theta\"\nstiffness = \"k\"\n";

#[test]
fn one_indeterminate_output_does_not_stop_the_check_of_the_others() {
    let drive = "[[driver]]\nname = \"d\"\ncoordinate = \"arm.theta\"\nmotion = \"k*time/100\"\n";
    for (part, analysis) in [
        (HINGED_SPRING, DYNAMICS),
        (HINGED_SPRING, EXPLICIT),
        (HINGED_SPRING, "kind = \"statics\"\n"),
        (drive, "kind = \"kinematics\"\n"),
    ] {
        let problem =
            read("m.toml", &hinged_twice(part, analysis)).unwrap_or_else(|e| panic!("{e}")).problem().unwrap();
        let start = problem.start();
        let checked = problem.check_sensitivities(&start, 3).unwrap();
        let (response, why) = &checked.without_derivatives[0];
        assert_eq!((*response, checked.without_derivatives.len()), (0, 1), "{analysis}");
        assert!(why.contains("share") && why.contains("indeterminate"), "{analysis}: {why}");
        assert!(
            checked.methods.len() > 1 && checked.failed.is_empty() && !checked.is_right(),
            "{analysis}: {checked:?}"
        );
        assert!(checked.derivatives.len() == 3, "{analysis}: {checked:?}");
        assert!(checked.derivatives.iter().all(|d| d.at.response == 1 && d.is_fine()), "{analysis}: {checked:?}");
        // A quantity that is not wanted does not stop the derivatives of another one, and one that is wanted does.
        let responses = problem.analyze(&start).unwrap();
        let at = |response| [ResponseAt { response, point: 2 }];
        assert!(problem.sensitivities(&start, &responses, &at(1)).is_ok(), "{analysis}");
        let error = problem.sensitivities(&start, &responses, &at(0)).unwrap_err().to_string();
        assert!(error.contains("share") && error.contains("no derivative"), "{analysis}: {error}");
    }
}

/// A load that begins at a design variable, on the grid of the steps: the methods miss its effect, and differences are noisy; a driven velocity that jumps on
/// the grid: derivatives scatter among designs that differ in their last digits.
#[test]
fn derivatives_beside_jumps_on_the_grid_are_not_called_right() {
    let arm = |part: &str| {
        format!(
            "version = 2\ngravity = [0, -9.81]\n[design]\ntd = {{ start = 0.4, lower = 0.1, upper = 1 }}\n\
             [[body]]\nname = \"cart\"\nmass = 2\ninertia = 0.1\nposition = [0, 0]\n\
             [[body]]\nname = \"bob\"\nmass = 1.3\ninertia = 0.02\nposition = [\"0.6*sin(0.2)\", \"-0.6*cos(0.2)\"]\nangle = 0.2\n\
             [[joint]]\nname = \"rail\"\nkind = \"prismatic\"\na = \"ground\"\nb = \"cart\"\n\
             [[joint]]\nname = \"pin\"\na = \"cart\"\nb = {{ body = \"bob\", at = [0, 0.6] }}\n{part}\n\
             [time]\nto = 1\npoints = 11\n[analysis]\nkind = \"dynamics\"\nstep = 1e-3\n\
             [[output]]\nname = \"th\"\nvalue = \"bob.theta\"\n[[output]]\nname = \"w\"\nvalue = \"bob.omega\"\n\
             [objective]\nminimize = \"final(w)\"\n"
        )
    };
    let load =
        "[[force]]\nname = \"push\"\nkind = \"load\"\nb = \"cart.x\"\ngeneralized_force = \"if(time > td, 10, 0)\"\n";
    let drive = "[[driver]]\nname = \"run\"\ncoordinate = \"cart.x\"\n\
                 motion = { kind = \"ramp\", from = 0, to = 0.7, begin = \"td\", duration = 0.45, profile = \"linear\" }\n";
    for (part, after) in [(load, 0.45), (drive, 0.45)] {
        let problem = read("m.toml", &arm(part)).unwrap_or_else(|e| panic!("{e}")).problem().unwrap();
        let checked = problem.check_sensitivities(&problem.start(), 11).unwrap();
        for d in &checked.derivatives {
            let is_after = problem.grids[0].points[d.at.point] > after;
            // Derivatives below 3 % of the largest are right within the error of the largest.
            let is_right =
                d.status == GradientStatus::Right && d.difference.is_some_and(|slope| slope.value.abs() > 1.0);
            assert!(!is_after || !is_right || d.disagreement() < 1e-3 * d.computed[0].abs(), "{part}: {d:?}");
        }
    }
}

#[test]
#[cfg(feature = "cli")]
fn an_indeterminate_output_has_a_verdict_of_its_own() {
    let place = crate::shell::TempFolder::new("no-derivative");
    std::fs::write(place.0.join("m.toml"), hinged_twice(HINGED_SPRING, DYNAMICS)).unwrap();
    let shown = place.run(&["check", "m", "--out", "out"], 0);
    assert!(shown.contains("right") && shown.contains("1 without derivatives, by direct"), "{shown}");
    assert!(shown.lines().any(|line| line.trim() == "no derivative"), "{shown}");
    assert!(shown.contains("share: ") && shown.contains("it has one of many values"), "{shown}");
    let csv = place.read("out/derivatives.csv");
    assert!(csv.lines().any(|line| line.starts_with("share,,,") && line.contains("no derivative")), "{csv}");
    // The derivatives of all other outputs are printed, unless the objective depends on it.
    let shown = place.run(&["sensitivities", "m", "--out", "derivatives"], 0);
    assert!(shown.contains("Warning: the output share is left out of the derivatives: "), "{shown}");
    let csv = place.read("derivatives/sensitivities.csv");
    assert!(csv.lines().count() > 3 && !csv.contains("share"), "{csv}");
    let minimized = hinged_twice(HINGED_SPRING, DYNAMICS).replace("minimize = \"k\"", "minimize = \"final(share)\"");
    std::fs::write(place.0.join("share.toml"), minimized).unwrap();
    let shown = place.run(&["sensitivities", "share"], 1);
    assert!(shown.contains("share") && shown.contains("indeterminate"), "{shown}");
    let json = crate::shell::linkwright(&["check", "m", "--json"], &place.0);
    let lines: Vec<serde_json::Value> =
        String::from_utf8(json.stdout).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let share = lines.iter().find(|line| line["response"] == "share").unwrap();
    assert!(share["finding"] == "no derivative" && share["variable"].is_null(), "{share}");
    assert!(share["explanation"].as_str().unwrap().contains("indeterminate"), "{share}");
    assert!(lines.last().unwrap()["no derivative"] == 1 && lines.last().unwrap()["wrong"] == 0, "{lines:?}");
    // Nothing else to check: the reason is the error.
    let shown = place.run(&["check", "m", "--response", "share"], 1);
    assert!(shown.contains("indeterminate"), "{shown}");
}

/// A mass on a spring and a redundant guide. A force jumps at the time `at`, where an event without an effect happens.
fn jumping(force: &str, analysis: &str) -> String {
    format!(
        "version = 2\n[design.at]\nstart = 0.503\nlower = 0.1\nupper = 0.9\n[[body]]\nname = \"m\"\nkind = \"point\"\nmass = 2\nposition = [1, 0]\n\
         [[joint]]\nname = \"guide\"\nkind = \"prismatic\"\na = \"ground\"\nb = \"m\"\nangle = 0\n[[force]]\nname = \"spring\"\nkind = \"spring\"\n\
         a = \"ground\"\nb = \"m\"\nstiffness = 18\nlength = 0\n[[force]]\nname = \"push\"\nkind = \"force\"\nat = \"m\"\ndirection = 0\n\
         force = \"{force}\"\n[[event]]\nname = \"on\"\nwhen = \"time > at\"\n[time]\nto = 1\npoints = 2\n[analysis]\nkind = \"dynamics\"\n{analysis}\n\
         [[output]]\nname = \"x\"\nvalue = \"m.x\"\n[objective]\nminimize = \"at\"\n"
    )
}

/// Steps end before a force that jumps at an event, and begin after it: values keep their order, and derivatives have the effect of the time.
#[test]
fn forces_may_jump_where_an_event_happens() {
    let exact = |at: f64| {
        let (shift, since) = (7.0 / 18.0, 3.0 * (1.0 - at));
        shift + ((3.0 * at).cos() - shift) * since.cos() - (3.0 * at).sin() * since.sin()
    };
    let slope = (exact(0.503 + 1e-5) - exact(0.503 - 1e-5)) / 2e-5;
    let implicit = ["direct", "adjoint", "semi-analytical"].as_slice();
    let schemes = [
        ("step = 0.01", [1e-3, 2e-3], implicit),
        ("tolerance = 1e-8", [1e-4, 1e-3], implicit),
        ("scheme = \"rk5\"\nstep = 0.01", [1e-8, 1e-6], &implicit[..2]),
        ("scheme = \"rk8\"\nstep = 0.01", [1e-10, 1e-8], &implicit[..2]),
        ("scheme = \"rk8\"\ntolerance = 1e-10", [1e-8, 1e-7], &implicit[..2]),
    ];
    for force in ["if(time > at, 7, 0)", "if(time < at, 0, 7)", "3.5 + 3.5*sign(time - at)"] {
        for (analysis, most, methods) in schemes {
            for method in methods {
                let text = jumping(force, &format!("{analysis}\nderivatives = \"{method}\""));
                let problem = problem(&text).unwrap();
                let b = problem.start();
                let responses = problem.analyze(&b).unwrap();
                let row = problem.sensitivities(&b, &responses, &[ResponseAt { response: 0, point: 1 }]).unwrap();
                let off = [responses.values[0][1] - exact(0.503), row[(0, 0)] - slope].map(f64::abs);
                println!("{force}, {analysis}, {method}: {off:?}");
                assert!(off[0] < most[0] && off[1] < most[1], "{force}, {analysis}, {method}: {off:?}");
            }
        }
    }
}
