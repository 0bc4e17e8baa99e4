//! Results of mechanisms in space and what is said about them: forces on joint coordinates, energies, and derivatives of zero.

use crate::kinds::outputs;
use crate::space::{OBJECTIVE, assert_near, last_of, problem};
use linkwright::model_file::read;

/// The warnings about the model in `text` at its start design.
fn warnings(text: &str) -> Vec<String> {
    let problem = problem(&format!("{text}{OBJECTIVE}"));
    let start = problem.start();
    let responses = problem.analyze(&start).unwrap();
    problem.analysis.warnings(&start, &responses)
}

/// A free body on a spring along a coordinate: the force of the spring is what acts on the coordinate.
#[test]
fn joint_coordinates_have_the_force_that_acts_on_them() {
    let body = "[[body]]\nname = \"b\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [1, 0, 0.3]\n";
    for coordinates in ["absolute", "automatic"] {
        for (kind, position) in [("displacement", 0.0), ("length", 1.09f64.sqrt()), ("angle", 0.0)] {
            let axis = if kind == "length" { "" } else { "at = [0, 0, 0]\naxis = [0, 0, 1]\n" };
            let text = format!(
                "version = 2\nspace = 3\n[time]\nat = [0]\n[analysis]\nkind = \"dynamics\"\nscheme = \"rk8\"\ncoordinates = \"{coordinates}\"\n{body}\
                 [[joint]]\nname = \"l\"\nkind = \"{kind}\"\na = \"ground\"\nb = \"b\"\n{axis}\
                 [[force]]\nname = \"s\"\nkind = \"coordinate-spring\"\nb = \"l\"\nstiffness = 10\nunloaded = 0.1\n"
            );
            let values = last_of(&(text + &outputs(["l.position", "l.generalized_force"])));
            assert_near(&values, &[position, 10.0 * (0.1 - position)], 1e-9);
        }
    }
}

const REST: &str = "version = 2\nspace = 3\n[time]\nto = 0.5\npoints = 3\n[analysis]\nkind = \"dynamics\"\n\
                    [[output]]\nname = \"x\"\nvalue = \"b.x\"\n";

#[test]
fn rounding_errors_of_a_mechanism_at_rest_are_no_gain_of_energy() {
    let hinge =
        "[[joint]]\nname = \"j\"\nkind = \"revolute\"\na = \"ground\"\nb = \"b\"\nat = [0, 0, 0]\naxis = [0, 1, 0]\n";
    for (gravity, body) in [
        ("", "inertia = [1, 1.2, 1.4]\norientation = { axis = [0, 0, 1], angle = 0.5 }\n".to_owned()),
        (
            "gravity = [0, 0, -9.81]\n",
            format!("inertia = [0.1, 0.1, 0.1]\norientation = {{ euler_parameters = [0.707, 0.707, 0, 0] }}\n{hinge}"),
        ),
        ("gravity = [0, 0, -9.81]\n", format!("kind = \"point\"\n{hinge}")),
    ] {
        let text = REST.replacen("space = 3\n", &format!("space = 3\n{gravity}"), 1);
        let found = warnings(&format!("{text}[[body]]\nname = \"b\"\nmass = 1\n{body}"));
        assert!(found.iter().all(|warning| !warning.contains("kinetic energy")), "{found:?}");
    }
}

/// The energy of a pendulum that starts at rest at the height zero is zero: its size is that of the kinetic energy.
#[test]
fn the_energy_of_a_pendulum_is_compared_with_its_kinetic_energy() {
    let text = "version = 2\nspace = 3\ngravity = [0, 0, -9.81]\n[time]\nto = 0.6\npoints = 3\n\
                [[body]]\nname = \"b\"\nmass = 2\ncentre = [0.3, 0, 0]\ninertia = [0.1, 0.2, 0.3]\n\
                [[joint]]\nname = \"h\"\na = \"ground\"\nb = \"b\"\nat = [0, 0, 0]\naxis = [0, 1, 0]\n\
                [analysis]\nkind = \"dynamics\"\nstep = 1e-3\n\
                [[output]]\nname = \"energy\"\nvalue = \"kinetic_energy+potential_energy\"\n";
    for other in ["", "[[output]]\nname = \"kinetic\"\nvalue = \"kinetic_energy\"\n"] {
        let found = warnings(&format!("{text}{other}"));
        assert!(found.is_empty(), "{found:?}");
    }
}

/// The torque of a bushing jumps at half a turn of its rotation vector.
#[test]
fn a_bushing_that_turns_by_half_a_turn_is_told() {
    let text = |to: &str| {
        format!(
            "version = 2\nspace = 3\n[time]\nto = {to}\npoints = 41\n[analysis]\nkind = \"dynamics\"\n\
             [[body]]\nname = \"b\"\nmass = 1\ninertia = [1, 1, 1]\n\
             [[joint]]\nname = \"h\"\nkind = \"revolute\"\na = \"ground\"\nb = \"b\"\naxis = [0, 0, 1]\nat = [0, 0, 0]\n\
             [[driver]]\nname = \"m\"\ncoordinate = \"h.angle\"\nmotion = \"time\"\n\
             [[force]]\nname = \"rubber\"\nkind = \"bushing\"\na = \"ground\"\nb = \"b\"\nstiffness = [0, 0, 0]\n\
             torsional = [1, 1, 1]\n[[output]]\nname = \"t\"\nvalue = \"rubber.torque_z\"\n"
        )
    };
    assert!(warnings(&text("2")).is_empty());
    let found = warnings(&text("4"));
    assert!(
        found.len() == 1 && found[0].contains("rubber: at t = 2.9") && found[0].contains("half a turn"),
        "{found:?}"
    );
}

/// Of two free bodies, the motion of one does not depend on variables of the other; steps do, and so do the errors of both.
#[test]
fn derivatives_of_zero_are_right_where_designs_have_other_steps() {
    let text = "version = 2\nspace = 3\n[design.p1]\nstart = 1\nlower = 0.5\nupper = 1.5\n\
                [design.p3]\nstart = 1\nlower = 0.5\nupper = 1.5\n\
                [[body]]\nname = \"a\"\nmass = \"2*p1\"\ncentre = [0.05, 0.02, 0.1]\ninertia = [0.3, 0.5, 0.7]\n\
                position = [0.5, 0.2, 0.1]\norientation = { order = \"zyx\", angles = [0.1, -0.4, 0.9] }\n\
                velocity = [0.3, 0.1, -0.4]\nangular_velocity = [0.5, -0.3, 0.8]\n\
                [[body]]\nname = \"b\"\nmass = 1.3\ninertia = [0.2, 0.4, 0.5]\nposition = [1, 0.4, 0.3]\n\
                orientation = { order = \"zyx\", angles = [0.3, 0.4, \"0.5*p1\"] }\n\
                velocity = [\"-0.7*p3\", -0.2, 0.1]\nangular_velocity = [0.05, 1.0, 0.1]\n\
                [[joint]]\nname = \"l\"\nkind = \"length\"\na = { body = \"a\", at = [0.1, 0, 0] }\n\
                b = { body = \"b\", at = [0, 0.1, 0] }\n\
                [[force]]\nname = \"s\"\nkind = \"rigid-stop\"\nb = \"l\"\na = \"ground.x\"\nclearance = 0.3\n\
                restitution = 1\n[time]\nto = 2\npoints = 6\n\
                [analysis]\nkind = \"dynamics\"\nscheme = \"rk8\"\ntolerance = 1e-10\n";
    let measures = ["a.omega_y", "b.omega_x", "b.vz", "a.vy", "a.roll", "l.position", "kinetic_energy"];
    let outputs = outputs(measures);
    let problem = problem(&format!("{text}{outputs}[objective]\nminimize = \"final(o0)\"\n"));
    problem.check_sensitivities(&problem.start(), 3).unwrap().expect_right();
}

/// In Bricard's mechanism each constraint follows from the others, in other positions other ones.
#[test]
fn a_mechanism_that_is_overconstrained_in_every_position_conserves_its_energy() {
    let bodies: String = [
        ("r1", "[1, 0, 0.5]", "[0.0833, 0.0833, 1e-4]"),
        ("r2", "[1, 0.5, 1]", "[0.0833, 1e-4, 0.0833]"),
        ("r3", "[0.5, 1, 1]", "[1e-4, 0.0833, 0.0833]"),
        ("r4", "[0, 1, 0.5]", "[0.0833, 0.0833, 1e-4]"),
        ("r5", "[0, 0.5, 0]", "[0.0833, 1e-4, 0.0833]"),
    ]
    .map(|(name, at, inertia)| format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = {inertia}\nposition = {at}\n"))
    .concat();
    let joints: String = [
        ("r5", "ground", "[0, 0, 0]", "[0, 0, 1]"),
        ("ground", "r1", "[1, 0, 0]", "[0, 1, 0]"),
        ("r1", "r2", "[1, 0, 1]", "[1, 0, 0]"),
        ("r2", "r3", "[1, 1, 1]", "[0, 0, 1]"),
        ("r3", "r4", "[0, 1, 1]", "[0, 1, 0]"),
        ("r4", "r5", "[0, 1, 0]", "[1, 0, 0]"),
    ]
    .map(|(a, b, at, axis)| {
        format!(
            "[[joint]]\nname = \"{a}_{b}\"\nkind = \"revolute\"\na = \"{a}\"\nb = \"{b}\"\nat = {at}\naxis = {axis}\n"
        )
    })
    .concat();
    let model = |coordinates: &str| {
        format!(
            "version = 2\nspace = 3\ngravity = [0, -9.81, 0]\n[time]\nto = 1.5\npoints = 16\n\
             [analysis]\nkind = \"dynamics\"\nscheme = \"rk8\"\ntolerance = 1e-8\ncoordinates = \"{coordinates}\"\n\
             {bodies}{joints}[[output]]\nname = \"energy\"\nvalue = \"kinetic_energy + potential_energy\"\n"
        )
    };
    let energy = |coordinates: &str| {
        let found = read("m.toml", &model(coordinates)).unwrap_or_else(|report| panic!("{report}")).simulate(&[]);
        found.unwrap().values[0].clone()
    };
    for coordinates in ["automatic", "absolute", "relative"] {
        let energy = energy(coordinates);
        assert!(energy.iter().all(|e| (e - energy[0]).abs() < 1e-4), "{coordinates}: {energy:?}");
    }
}

#[test]
fn the_warning_about_reactions_of_redundant_constraints_is_true_in_both_coordinates() {
    let hinge = |name: &str, z: f64| {
        format!(
            "[[joint]]\nname = \"{name}\"\nkind = \"revolute\"\na = \"ground\"\nb = \"door\"\nat = [0, 0, {z}]\naxis = [0, 0, 1]\n\
             [[output]]\nname = \"{name}_z\"\nvalue = \"{name}.force_z\"\n"
        )
    };
    for coordinates in ["absolute", "relative"] {
        let text = format!(
            "version = 2\nspace = 3\ngravity = [0, 0, -9.81]\n[time]\nto = 0.1\npoints = 2\n\
             [analysis]\nkind = \"dynamics\"\nscheme = \"rk8\"\ncoordinates = \"{coordinates}\"\n\
             [[body]]\nname = \"door\"\nmass = 10\ninertia = [1, 1, 1]\nposition = [0.5, 0, 1]\n{}{}",
            hinge("low", 0.0),
            hinge("high", 2.0)
        );
        let found = warnings(&text);
        assert!(found.iter().all(|warning| warning.contains("one of many")) && found.len() == 2, "{found:?}");
        let values = last_of(&text);
        assert_near(&[values[0] + values[1]], &[98.1], 1e-9);
        if coordinates == "absolute" {
            assert_near(&values, &[49.05; 2], 1e-6);
        }
    }
}

/// A beam that is fixed to a body whose reference point is 0.3 m from its end: its nodes are where it begins and ends, and a force at the last one
/// does not twist it.
#[test]
fn the_first_and_last_node_of_a_beam_are_its_ends() {
    let text = |fixed: &str| {
        format!(
            "version = 2\nspace = 3\n[[body]]\nname = \"A\"\nkind = \"fixed-node\"\n{}             [[beam]]\nname = \"bm\"\ndiameter = 0.02\nfrom = [0, 0, 0.3]\nto = [1, 0, 0.3]\nyoung = 2e9\ndensity = 3000\n             elements = 4\n{fixed}[[force]]\nname = \"F\"\nkind = \"force\"\nat = \"bm.last\"\ndirection = [0, 1, 0]\n             magnitude = 1\n[time]\nat = [0]\n[analysis]\nkind = \"statics\"\n",
            if fixed.contains("end") {
                "[[body]]\nname = \"B\"\nkind = \"massless-node\"\nposition = [1, 0, 0.6]\n"
            } else {
                ""
            }
        )
    };
    // F L³/(3 E I) and the shear of F L/(k G A).
    let tip = 1.0 / (3.0 * 2e9 * std::f64::consts::PI * 0.02f64.powi(4) / 64.0);
    for fixed in ["start = \"A\"\n", "start = \"A\"\nend = \"B\"\n"] {
        let places = ["bm.first.z", "bm.last.z", "bm.last.roll", "bm.last.y"];
        let values = last_of(&(text(fixed) + &outputs(places)));
        assert_near(&values[..3], &[0.3, 0.3, 0.0], 1e-9);
        assert!((values[3] / tip - 1.0).abs() < 1e-3, "{values:?} for {tip}");
    }
}
