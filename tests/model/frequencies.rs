//! Natural frequencies as outputs of model files.

use linkwright::model_file::read;
use linkwright::problem::{Problem, ResponseAt};
use std::f64::consts::PI;

/// Two masses in a row, on springs of the same stiffness.
fn chain(outputs: &str) -> String {
    format!(
        "version = 2\n[design]\nmass = {{ start = 2, lower = 1, upper = 4 }}\nstiffness = {{ start = 500, lower = 100, upper = 900 }}\n\
         [time]\nat = [0]\n[analysis]\nkind = 'statics'\n\
         [[body]]\nname = 'one'\nkind = 'slider'\nmass = 'mass'\n[[body]]\nname = 'two'\nkind = 'slider'\nmass = 'mass'\n\
         [[force]]\nname = 'first'\nkind = 'coordinate-spring'\nb = 'one'\nstiffness = 'stiffness'\n\
         [[force]]\nname = 'second'\nkind = 'coordinate-spring'\na = 'one'\nb = 'two'\nstiffness = 'stiffness'\n{outputs}"
    )
}

const OUTPUTS: &str = "[[output]]\nname = 'w1'\nfrequency = 1\n[[output]]\nname = 'x'\nvalue = 'one.position + 3*mass'\n\
                       [[output]]\nname = 'f2'\nfrequency = 2\nshown_in = 'Hz'\n";

fn problem(text: &str) -> Problem {
    read("m.toml", text).unwrap_or_else(|report| panic!("{text}\n{report}")).problem().unwrap()
}

#[test]
fn frequencies_of_a_chain_and_their_derivatives_are_exact() {
    let problem = problem(&chain(&format!("{OUTPUTS}[objective]\nmaximize = 'final(w1)'\n")));
    let b = problem.start();
    let here = problem.analyze(&b).unwrap();
    let root = f64::sqrt(500.0 / 2.0);
    let factor = [-1.0, 1.0].map(|sign| f64::sqrt((3.0 + sign * f64::sqrt(5.0)) / 2.0));
    let expected = [root * factor[0], 6.0, root * factor[1] / (2.0 * PI)];
    let at = [0, 1, 2].map(|response| ResponseAt { response, point: 0 });
    for (at, expected) in at.iter().zip(expected) {
        assert!((here.at(*at) - expected).abs() < 1e-12 * expected, "{:?}", here.values);
    }
    let gradients = problem.sensitivities(&b, &here, &at).unwrap();
    for (row, w) in [(0, expected[0]), (2, expected[2])] {
        assert!((gradients[(row, 0)] + w / (2.0 * 2.0)).abs() < 1e-11 * w, "{gradients}");
        assert!((gradients[(row, 1)] - w / (2.0 * 500.0)).abs() < 1e-13 * w, "{gradients}");
    }
    assert!((gradients[(1, 0)] - 3.0).abs() < 1e-12, "{gradients}");
}

#[test]
fn the_lightest_chain_above_a_frequency() {
    // The frequency of 2 Hz binds: stiffness/mass = (4π)² · 2/(3 − √5); the lightest mass is 1 kg.
    let wish = "[objective]\nminimize = 'mass + 0.01*stiffness'\n[[constraint]]\nname = 'resonance'\nvalue = 'f'\nat_least = '2 Hz'\n";
    let model =
        read("m.toml", &chain(&format!("[[output]]\nname = 'f'\nfrequency = 1\nshown_in = 'Hz'\n{wish}"))).unwrap();
    let problem = model.problem().unwrap();
    let end = model.method().solve(&problem, |_| ()).unwrap();
    let stiffness = f64::powi(4.0 * PI, 2) * 2.0 / (3.0 - f64::sqrt(5.0));
    assert!((end.design[0] - 1.0).abs() < 1e-6 && (end.design[1] / stiffness - 1.0).abs() < 1e-6, "{:?}", end.design);
}

#[test]
fn equal_frequencies_are_named() {
    let text =
        chain("[[output]]\nname = 'w'\nfrequency = 1\n[objective]\nmaximize = 'final(w)'\n").replace("a = 'one'\n", "");
    let problem = problem(&text);
    let responses = problem.analyze(&problem.start()).unwrap();
    assert!(responses.warnings.iter().any(|w| w.contains("natural frequencies 1 to 2 are equal")), "{responses:?}");
}

/// Frequencies that are equal at all points are one warning, also if several outputs show them.
#[test]
fn frequencies_that_are_equal_at_many_points_are_told_once() {
    let outputs = "[[output]]\nname = 'w'\nfrequency = 1\n[[output]]\nname = 'v'\nfrequency = 2\n[objective]\nmaximize = 'final(w)'\n";
    let problem = problem(&chain(outputs).replace("a = 'one'\n", "").replace("at = [0]", "at = [0.5, 1, 1.5]"));
    let warnings = problem.analyze(&problem.start()).unwrap().warnings;
    let told: Vec<&String> = warnings.iter().filter(|warning| warning.contains("natural frequencies")).collect();
    assert_eq!(told.len(), 1, "{warnings:?}");
    assert!(told[0].contains("1 to 2 are equal at 3 points, first at t = 0.5 s: "), "{warnings:?}");
}

#[test]
fn what_is_no_frequency_is_explained() {
    let message = |outputs: &str| match read("m.toml", &chain(outputs)) {
        Err(report) => report.to_string(),
        Ok(_) => panic!("{outputs} is read"),
    };
    for (outputs, words) in [
        ("[[output]]\nname = 'w'\nfrequency = 0\n", "counted from 1"),
        ("[[output]]\nname = 'w'\nfrequency = 1\nvalue = 'one.position'\n", "exclude each other"),
        ("[[output]]\nname = 'w'\nfrequency = 1\nshown_in = 'mm'\n", "cannot be shown in mm"),
    ] {
        assert!(message(outputs).contains(words), "{}", message(outputs));
    }
    let of_motion = chain("[[output]]\nname = 'w'\nfrequency = 1\n")
        .replace("kind = 'statics'", "kind = 'dynamics'\nstep = 1e-3")
        .replace("at = [0]", "to = 1\npoints = 3");
    let report = read("m.toml", &of_motion).map(|_| ()).unwrap_err().to_string();
    assert!(report.contains("about a static equilibrium") && report.contains("kind = \"statics\""), "{report}");
    let problem = problem(&chain("[[output]]\nname = 'w'\nfrequency = 3\n[objective]\nmaximize = 'final(w)'\n"));
    let error = problem.analyze(&problem.start()).unwrap_err().to_string();
    assert!(error.contains("natural frequency 3") && error.contains("only 2"), "{error}");
}

/// A product of numbers with an angular velocity is no frequency, however it is written.
#[test]
fn an_angular_velocity_is_no_limit_of_a_frequency_in_hertz() {
    let model = |limit: &str| {
        chain(&format!(
            "{OUTPUTS}[objective]\nminimize = 'mass'\n[[constraint]]\nname = 'limit'\nvalue = 'f2'\nat_least = '{limit}'\n"
        ))
    };
    for limit in ["62.8 rad/s", "2*pi*10 rad/s", "600 rpm", "2*300 rpm", "(1 + 1)*(3 rad/s)"] {
        let error = read("m.toml", &model(limit)).map(drop).unwrap_err().to_string();
        assert!(error.contains("an angular velocity") && error.contains("1 Hz is 2*pi rad/s"), "{limit}: {error}");
    }
    for limit in ["10 Hz", "2*5 Hz", "10", "2*pi", "600 rpm*(1 Hz)/(60 rpm)", "(62.8 rad/s)/(2*pi)"] {
        assert!(read("m.toml", &model(limit)).is_ok(), "{limit}");
    }
}

#[test]
fn a_mode_shape_is_the_amplitude_of_its_value() {
    let outputs = "[[output]]\nname = 'one'\nvalue = 'one.position'\nmode = 1\n[[output]]\nname = 'ratio'\nvalue = '2*two.position'\nmode = 1\n\
                   [[output]]\nname = 'w'\nfrequency = 1\n[objective]\nmaximize = 'final(w)'\n";
    let problem = problem(&chain(outputs));
    let b = problem.start();
    let here = problem.analyze(&b).unwrap();
    let golden = (1.0 + f64::sqrt(5.0)) / 2.0;
    let unit = 1.0 / f64::sqrt(2.0 * (1.0 + golden * golden));
    let at = [0, 1].map(|response| ResponseAt { response, point: 0 });
    let gradients = problem.sensitivities(&b, &here, &at).unwrap();
    for (row, expected) in [(0, unit), (1, 2.0 * golden * unit)] {
        assert!((here.at(at[row]) - expected).abs() < 1e-12, "{:?}", here.values);
        // It is proportional to m^(-1/2) and does not depend on the stiffness of both springs.
        assert!(
            (gradients[(row, 0)] + expected / 4.0).abs() < 1e-12 && gradients[(row, 1)].abs() < 1e-14,
            "{gradients}"
        );
    }
    let message = |outputs: &str| match read("m.toml", &chain(outputs)) {
        Err(report) => report.to_string(),
        Ok(_) => panic!("{outputs} is read"),
    };
    let with = |key: &str| message(&format!("[[output]]\nname = 'w'\nvalue = 'one.position'\n{key}\n"));
    assert!(with("mode = 0").contains("counted from 1"), "{}", with("mode = 0"));
    assert!(with("mode = 1\nshown_in = 'mm'").contains("exclude each other"), "{}", with("mode = 1\nshown_in = 'mm'"));
}

#[test]
fn copies_count_frequencies() {
    let wish = "[objective]\nmaximize = 'final(w1)'\n";
    let one_by_one = "[[output]]\nname = 'w1'\nfrequency = 1\n[[output]]\nname = 'w2'\nfrequency = 2\n";
    let copies = "[[output]]\neach = { i = '1..2' }\nname = 'w{i}'\nfrequency = '{i}'\n";
    let values = [one_by_one, copies].map(|outputs| {
        let problem = problem(&chain(&format!("{outputs}{wish}")));
        problem.analyze(&problem.start()).unwrap().values
    });
    assert_eq!(values[0], values[1]);
    let report = read("m.toml", &chain(&format!("{}{wish}", copies.replace("'{i}'", "'{i}.5'")))).err().unwrap();
    assert!(report.to_string().contains("`frequency` must be a whole number"), "{report}");
}

/// A truss of two bars that snaps through and is unloaded: frequencies are those about the equilibrium of the load path, also where the
/// equilibrium from the built position would be another one. Exact: k_yy and k_xx of the two springs at the height y.
#[test]
fn frequencies_follow_the_load_path() {
    let text = "version = 2\n[design]\nk = { start = 2000, lower = 500 }\nh = { start = 0.2, lower = 0.05 }\n\
        [[body]]\nname = \"top\"\nkind = \"point\"\nmass = 1.2\nposition = [0, \"h\"]\n\
        [[force]]\neach = [{ n = \"l\", s = -1 }, { n = \"r\", s = 1 }]\nname = \"bar{n}\"\nkind = \"spring\"\n\
        a = { body = \"ground\", at = [\"{s}\", 0] }\nb = \"top\"\nstiffness = \"k\"\nlength = \"hypot(1, h)\"\n\
        [[force]]\nname = \"P\"\nkind = \"load\"\nb = \"top.y\"\ngeneralized_force = \"-if(time < 10, time, 20 - time)\"\n\
        [time]\nto = 20\npoints = 21\n[analysis]\nkind = \"statics\"\n\
        [[output]]\nname = \"y\"\nvalue = \"top.y\"\n[[output]]\nname = \"w\"\nfrequency = 1\n\
        [[output]]\nname = \"mode\"\nmode = 1\nvalue = \"barr.tension\"\n\
        [objective]\nminimize = \"k\"\n";
    let problem = problem(text);
    let exact = |k: f64, h: f64, y: f64| {
        let (l, l0) = (1f64.hypot(y), 1f64.hypot(h));
        let geometric = k * (1.0 - l0 / l);
        let vertical = 2.0 * (k * (y / l).powi(2) + geometric / (l * l));
        let horizontal = 2.0 * (k / (l * l) + geometric * (y / l).powi(2));
        (vertical.min(horizontal) / 1.2).sqrt()
    };
    let at = |design: &[f64]| problem.analyze(design).unwrap();
    let design = [2000.0, 0.2];
    let responses = at(&design);
    let [y, w] = [0, 1].map(|h| &responses.values[h]);
    assert!(y[6] > 0.0 && y[14] < -0.15 && y[20] < -0.19, "{y:?}");
    for p in 0..21 {
        let expected = exact(design[0], design[1], y[p]);
        assert!((w[p] - expected).abs() < 1e-6 * expected, "{p}: {} and {expected}", w[p]);
        // The lowest mode is vertical, with the shape 1/√m; a bar is stretched by y/L of it.
        let tension = design[0] * y[p] / 1f64.hypot(y[p]) / 1.2f64.sqrt();
        assert!((responses.values[2][p] - tension).abs() < 1e-6 * tension.abs(), "{p}: {:?}", responses.values[2][p]);
    }
    // The picture at one point of the sweep is that of the load path.
    let drawn = read("m.toml", text).unwrap().drawings(&[&design], &[15.0]).unwrap().unwrap().remove(0).remove(0);
    assert!((drawn.masses[0][1] - y[15]).abs() < 1e-9, "{:?} and {}", drawn.masses, y[15]);
    let warnings = problem.analysis.warnings(&design, &responses);
    assert!(warnings.iter().any(|warning| warning.contains("snap-through")), "{warnings:?}");
    // Derivatives on the way back, against differences.
    let wanted = [1, 2].map(|response| ResponseAt { response, point: 15 });
    let rows = problem.sensitivities(&design, &responses, &wanted).unwrap();
    for (variable, step) in [(0, 0.2), (1, 2e-5)] {
        let moved = |sign: f64| {
            let mut moved = design;
            moved[variable] += sign * step;
            at(&moved)
        };
        let (up, down) = (moved(1.0), moved(-1.0));
        for (row, at) in wanted.iter().enumerate() {
            let slope = (up.at(*at) - down.at(*at)) / (2.0 * step);
            let found = rows[(row, variable)];
            assert!((found - slope).abs() < 1e-5 * slope.abs().max(1e-3), "{row} by {variable}: {found} and {slope}");
        }
    }
}
