//! Forces of model files against exact solutions and against other forces that are the same.

use linkwright::model_file::read;
use linkwright::problem::{Problem, ResponseAt};

fn problem(text: &str) -> Problem {
    read("m.toml", text).unwrap_or_else(|report| panic!("{text}\n{report}")).problem().unwrap()
}

/// The last values of all outputs at the start design, and their gradients.
fn last(text: &str) -> (Vec<f64>, Vec<Vec<f64>>) {
    let problem = problem(text);
    let b = problem.start();
    let here = problem.analyze(&b).unwrap_or_else(|e| panic!("{text}\n{e}"));
    let at: Vec<ResponseAt> = here
        .values
        .iter()
        .enumerate()
        .map(|(response, values)| ResponseAt { response, point: values.len() - 1 })
        .collect();
    let gradients = problem.sensitivities(&b, &here, &at).unwrap();
    let rows = gradients.row_iter().map(|row| row.iter().copied().collect()).collect();
    (at.iter().map(|at| here.at(*at)).collect(), rows)
}

#[track_caller]
fn close(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= tolerance * (1.0 + b.abs()), "{found:?} instead of {expected:?}");
    }
}

const EXACT: &str = "[analysis]\nkind = 'dynamics'\nscheme = 'rk8'\ntolerance = 1e-12\n";

/// A double pendulum with a named tip.
const PENDULUM: &str = r#"
version = 2
gravity = [0, -9.81]
[design.p]
start = 1.5
[design.q]
start = 0.6
[objective]
minimize = "p"
[time]
to = 0.4
points = 3
[[body]]
name = "upper"
mass = "p"
inertia = 0.2
position = [0.5, 0]
[[body]]
name = "lower"
mass = 1
inertia = 0.1
position = [1, -0.5]
angle = "-pi/2"
[[joint]]
name = "shoulder"
kind = "revolute"
a = "ground"
b = { body = "upper", at = [-0.5, 0] }
[[joint]]
name = "elbow"
kind = "revolute"
a = { body = "upper", at = [0.5, 0] }
b = { body = "lower", at = [-0.5, 0] }
[[point]]
name = "tip"
body = "lower"
at = ["0.5*q", "0.1*p"]
[[output]]
name = "x"
value = "tip.x"
[[output]]
name = "spin"
value = "upper.omega"
"#;

#[test]
fn a_force_that_observes_points_is_a_spring_and_damper() {
    let anchor = "[[point]]\nname = 'anchor'\nbody = 'upper'\nat = [0.1, '0.2*q']\n";
    let spring = "[[force]]\nname = 's'\nkind = 'spring'\na = 'anchor'\nb = 'tip'\nstiffness = '30*p'\ndamping = 2\n";
    // A spring of no unloaded length is the sum of forces along x and y; its damping acts along the line of the points.
    let gap = "hypot(tip.x - anchor.x, tip.y - anchor.y)";
    let rate = format!("((tip.x - anchor.x)*(tip.vx - anchor.vx) + (tip.y - anchor.y)*(tip.vy - anchor.vy))/{gap}");
    let force = |name: &str, at: &str, sign: &str, axis: &str, direction: &str| {
        format!(
            "[[force]]\nname = '{name}'\nkind = 'feedback-force'\nat = '{at}'\ndirection = '{direction}'\n\
             force = '{sign}(30*p + 2*({rate})/{gap})*(tip.{axis} - anchor.{axis})'\n"
        )
    };
    let forces = [
        force("tx", "tip", "-", "x", "0"),
        force("ty", "tip", "-", "y", "pi/2"),
        force("ax", "anchor", "", "x", "0"),
        force("ay", "anchor", "", "y", "pi/2"),
    ]
    .concat();
    let (expected, found) =
        (last(&format!("{PENDULUM}{anchor}{EXACT}{spring}")), last(&format!("{PENDULUM}{anchor}{EXACT}{forces}")));
    close(&found.0, &expected.0, 1e-9);
    for (found, expected) in found.1.iter().zip(&expected.1) {
        close(found, expected, 1e-8);
    }
}

#[test]
fn a_spring_that_changes_with_time_is_a_force_that_observes_time() {
    let spring = "[[force]]\nname = 's'\nkind = 'variable-spring'\na = 'ground'\nb = 'tip'\nstiffness = '30*p*(1 + sin(9*time))'\n";
    let force = |name: &str, axis: &str, direction: &str| {
        format!(
            "[[force]]\nname = '{name}'\nkind = 'feedback-force'\nat = 'tip'\ndirection = '{direction}'\n\
             force = '-30*p*(1 + sin(9*time))*tip.{axis}'\n"
        )
    };
    let forces = [force("tx", "x", "0"), force("ty", "y", "pi/2")].concat();
    let (expected, found) = (last(&format!("{PENDULUM}{EXACT}{forces}")), last(&format!("{PENDULUM}{EXACT}{spring}")));
    close(&found.0, &expected.0, 1e-9);
    for (found, expected) in found.1.iter().zip(&expected.1) {
        close(found, expected, 1e-8);
    }
}

#[test]
fn a_thruster_on_a_spinning_body() {
    // Through the centre: x = F/(m ω²) (1 − cos ωt), y = F/(m ω²) (ωt − sin ωt).
    let text = format!(
        "version = 2\n[design]\nforce = {{ start = 3 }}\nspin = {{ start = 2 }}\n[objective]\nminimize = 'force'\n\
         [time]\nto = 1\npoints = 3\n[[body]]\nname = 'craft'\nmass = 1.5\ninertia = 0.2\nposition = [0, 0]\nspin = 'spin'\n\
         [[force]]\nname = 'jet'\nkind = 'follower-force'\nat = {{ body = 'craft', at = [-0.4, 0] }}\ndirection = 0\n\
         force = 'force'\n{EXACT}[[output]]\nname = 'x'\nvalue = 'craft.x'\n[[output]]\nname = 'y'\nvalue = 'craft.y'\n"
    );
    let (f, w) = (3.0 / 1.5, 2.0_f64);
    let (sin, cos) = w.sin_cos();
    let (x, y) = (f / (w * w) * (1.0 - cos), f / (w * w) * (w - sin));
    let found = last(&text);
    close(&found.0, &[x, y], 1e-10);
    close(&found.1[0], &[x / 3.0, -2.0 * x / w + f / (w * w) * sin], 1e-9);
    close(&found.1[1], &[y / 3.0, -2.0 * y / w + f / (w * w) * (1.0 - cos)], 1e-9);
}

/// A stone falls by h, is caught by a rope of length L, and rises again: its height at 1 s.
fn rope(analysis: &str) -> String {
    format!(
        "version = 2\ngravity = [0, -9.81]\n[design]\nstiffness = {{ start = 400 }}\n[objective]\nminimize = 'stiffness'\n\
         [time]\nto = 1\npoints = 3\n[[body]]\nname = 'stone'\nkind = 'point'\nmass = 2\nposition = [0, -0.2]\n\
         [[force]]\nname = 'rope'\nkind = 'rope'\na = 'ground'\nb = 'stone'\nstiffness = 'stiffness'\nlength = 0.7\n\
         {analysis}[[output]]\nname = 'y'\nvalue = 'stone.y'\n[[output]]\nname = 'tension'\nvalue = 'rope.tension'\n"
    )
}

#[test]
fn a_rope_catches_a_falling_stone() {
    let (g, h, m) = (9.81, 0.5, 2.0);
    let speed = f64::sqrt(2.0 * g * h);
    let height = |k: f64| {
        // Taut for 2 (π − atan(v ω/g))/ω, then thrown up with the speed of the fall.
        let w = f64::sqrt(k / m);
        let taut = 2.0 * (std::f64::consts::PI - (speed * w / g).atan()) / w;
        let free = 1.0 - speed / g - taut;
        assert!(free > 0.1 && free < 2.0 * speed / g);
        -0.7 + speed * free - 0.5 * g * free * free
    };
    let slope = (height(401.0) - height(399.0)) / 2.0;
    let analyses = [
        ("[analysis]\nkind = 'dynamics'\nscheme = 'rk8'\ntolerance = 1e-12\n", 1e-9, 1e-6),
        ("[analysis]\nkind = 'dynamics'\nscheme = 'rk5'\ntolerance = 1e-11\n", 1e-7, 1e-6),
        ("[analysis]\nkind = 'dynamics'\ntolerance = 1e-7\n", 1e-4, 1e-2),
    ];
    for (analysis, tolerance, allowed) in analyses {
        let (values, gradients) = last(&rope(analysis));
        close(&values, &[height(400.0), 0.0], tolerance);
        close(&gradients[0], &[slope], allowed);
    }
}

#[test]
fn a_cantilever_under_its_line_load() {
    // q ℓ⁴/(8 EI) of bending and q ℓ²/(2 GA) of shear; the load of 2 N/m bends a millimetre.
    let text = |elements: usize| {
        format!(
            "version = 2\n[design]\nload = {{ start = 2 }}\n[objective]\nminimize = 'load'\n[time]\nto = 1\npoints = 2\n\
             [[beam]]\nname = 'rod'\nkind = 'section'\nfrom = [0, 0]\nto = [1, 0]\nelements = {elements}\naxial = 1e6\n\
             transverse = 1e5\nbending = 250\nmass = 1\ninertia = 1e-3\nload_y = '-load*time'\n\
             [[joint]]\nname = 'clamp'\nkind = 'fixed'\na = 'ground'\nb = 'rod.first'\n[analysis]\nkind = 'statics'\n\
             [[output]]\nname = 'y'\nvalue = 'rod.last.y'\n[[output]]\nname = 'moment'\nvalue = 'clamp.moment'\n"
        )
    };
    let exact = -2.0 / (8.0 * 250.0) - 2.0 / (2.0 * 1e5);
    let errors = [8, 16].map(|elements| {
        let (values, gradients) = last(&text(elements));
        close(&[values[1].abs()], &[1.0], 1e-5);
        assert!((gradients[0][0] - values[0] / 2.0).abs() < 1e-5 * values[0].abs(), "{gradients:?} {values:?}");
        (values[0] - exact).abs()
    });
    assert!(errors[0] < 0.02 * exact.abs() && errors[1] < 0.3 * errors[0], "{errors:?}");
}

#[test]
fn a_damper_that_grows_with_time_stops_a_mass() {
    // m v' = −c (1 + t) v: v = v₀ exp(−c (t + t²/2)/m).
    let text = format!(
        "version = 2\n[design]\ndamping = {{ start = 0.8 }}\n[objective]\nminimize = 'damping'\n[time]\nto = 1.4\npoints = 3\n\
         [[body]]\nname = 'bob'\nkind = 'point'\nmass = 1.5\nposition = [1, 0]\nvelocity = [2, 0]\n\
         [[force]]\nname = 'brake'\nkind = 'variable-damper'\na = 'ground'\nb = 'bob'\ndamping = 'damping*(1 + time)'\n\
         {EXACT}[[output]]\nname = 'v'\nvalue = 'bob.vx'\n[[output]]\nname = 'pull'\nvalue = 'brake.tension'\n"
    );
    let (time, c, mass) = (1.4, 0.8, 1.5);
    let factor = (time + 0.5 * time * time) / mass;
    let v = 2.0 * f64::exp(-c * factor);
    let (values, gradients) = last(&text);
    close(&values, &[v, c * (1.0 + time) * v], 1e-11);
    close(&[gradients[0][0], gradients[1][0]], &[-factor * v, (1.0 + time) * v * (1.0 - c * factor)], 1e-10);
}

/// Last outputs of a cantilever that is a quarter of a circle of the radius 1 m without load, and a moment of 30 N·m at its end.
fn arc(elements: usize) -> (Vec<f64>, Vec<Vec<f64>>) {
    last(&format!(
        "version = 2\n[design]\nmoment = {{ start = 30 }}\n[objective]\nminimize = 'moment'\n[time]\nto = 1\npoints = 2\n\
         [[beam]]\nname = 'rod'\nkind = 'section'\nfrom = [0, 0]\nto = [1, 1]\nrise = 'sqrt(0.5) - 1'\n\
         elements = {elements}\naxial = 1e6\ntransverse = 1e5\nbending = 100\nmass = 1\ninertia = 1e-3\n\
         [[joint]]\nname = 'clamp'\nkind = 'fixed'\na = 'ground'\nb = 'rod.first'\n[analysis]\nkind = 'statics'\n\
         [[force]]\nname = 'end'\nkind = 'load'\na = 'ground.theta'\nb = 'rod.last.theta'\ngeneralized_force = 'moment*time'\n\
         [[output]]\nname = 'x'\nvalue = 'rod.last.x'\n[[output]]\nname = 'y'\nvalue = 'rod.last.y'\n\
         [[output]]\nname = 'angle'\nvalue = 'rod.last.theta'\n"
    ))
}

#[test]
fn an_arc_under_an_end_moment_is_an_arc_of_another_curvature() {
    // The curvature is 1 + M/EI; the arc has the length π/2.
    let (length, moment, bending) = (std::f64::consts::FRAC_PI_2, 30.0, 100.0);
    let (curvature, rate) = (1.0 + moment / bending, 1.0 / bending);
    let (sin, cos) = (curvature * length).sin_cos();
    let exact = [sin / curvature, (1.0 - cos) / curvature, curvature * length];
    let slopes = [
        (length * cos / curvature - sin / curvature.powi(2)) * rate,
        (length * sin / curvature - (1.0 - cos) / curvature.powi(2)) * rate,
        length * rate,
    ];
    let errors = [8, 16].map(|elements| {
        let (values, gradients) = arc(elements);
        let worst =
            |found: &[f64], exact: &[f64]| found.iter().zip(exact).fold(0.0f64, |e, (a, b)| e.max((a - b).abs()));
        let found: Vec<f64> = gradients.iter().map(|row| row[0]).collect();
        [worst(&values, &exact), worst(&found, &slopes)]
    });
    println!("values and derivatives of 8 and 16 elements: {errors:?}");
    for k in 0..2 {
        assert!(errors[1][k] < 2e-3 && (errors[0][k] / errors[1][k]).log2() > 1.8, "{errors:?}");
    }
}

#[test]
fn a_prestressed_beam_vibrates_as_a_string_with_bending() {
    // Pinned at both ends: ω² = (π/L)⁴ EI/m + (π/L)² N/m, with N = 400 N, EI = 100 N·m², 0.5 kg/m and L = 2 m.
    let text = |elements: usize| {
        format!(
            "version = 2\n[design]\ntension = {{ start = 400 }}\n[objective]\nmaximize = 'final(w)'\n[time]\nat = [0]\n\
             [[body]]\nname = 'left'\nkind = 'fixed-node'\nposition = [0, 0]\n\
             [[body]]\nname = 'right'\nkind = 'fixed-node'\nposition = [2, 0]\n\
             [[beam]]\nname = 'rod'\nkind = 'section'\nfrom = [0, 0]\nto = [2, 0]\nstart = 'left'\nend = 'right'\n\
             tension = 'tension'\nelements = {elements}\naxial = 1e6\ntransverse = 1e5\nshear = 'rigid'\nbending = 100\n\
             mass = 0.5\ninertia = 1e-9\n[analysis]\nkind = 'statics'\n[[output]]\nname = 'w'\nfrequency = 1\n"
        )
    };
    let wave = std::f64::consts::PI / 2.0;
    let square = wave.powi(4) * 100.0 / 0.5 + wave.powi(2) * 400.0 / 0.5;
    let (exact, slope) = (square.sqrt(), 0.5 * wave.powi(2) / 0.5 / square.sqrt());
    let errors = [10, 20].map(|elements| {
        let (values, gradients) = last(&text(elements));
        [(values[0] / exact - 1.0).abs(), (gradients[0][0] / slope - 1.0).abs()]
    });
    println!("frequency and derivative of 10 and 20 elements: {errors:?}");
    for k in 0..2 {
        assert!(errors[1][k] < 5e-3 && (errors[0][k] / errors[1][k]).log2() > 1.8, "{errors:?}");
    }
}

/// A pendulum of 1 kg at 0.5 m whose pin rubs; it starts with 4 rad/s.
fn rubbing(friction: &str) -> String {
    format!(
        "version = 2\ngravity = [0, -9.81]\n[design.p]\nstart = 0.4\n[objective]\nminimize = 'p'\n[time]\nat = [0.1]\n{EXACT}\
         [[body]]\nname = 'bob'\nmass = 1\ninertia = 0.05\nposition = [0, -0.5]\nvelocity = [2, 0]\nspin = 4\n\
         [[joint]]\nname = 'pin'\na = 'ground'\nb = {{ body = 'bob', at = [0, 0.5] }}\n\
         [[force]]\nname = 'rub'\n{friction}"
    )
}

#[test]
fn friction_of_a_pin_is_its_reaction_times_radius_and_coefficient() {
    let friction = "kind = 'revolute-friction'\njoint = 'pin'\ncoefficient = 'p'\nradius = 0.03\nspeed = 0.01\n";
    let outputs = "[[output]]\nname = 'torque'\nvalue = 'rub.moment'\n[[output]]\nname = 'same'\nvalue = '0.03*p*pin.force'\n\
                   [[output]]\nname = 'heat'\nvalue = 'rub.power - rub.moment*bob.omega'\n";
    let (values, gradients) = last(&format!("{}{outputs}", rubbing(friction)));
    assert!(values[0] > 0.1, "{values:?}");
    close(&values[..1], &values[1..2], 1e-7);
    close(&gradients[0], &gradients[1], 1e-6);
    close(&values[2..], &[0.0], 1e-12);
}

#[test]
fn friction_and_profiles_with_mistakes_are_explained() {
    let message = |text: &str| match read("m.toml", text) {
        Err(report) => report.to_string(),
        Ok(model) => {
            let problem = model.problem().unwrap();
            problem.analyze(&problem.start()).expect_err(text).to_string()
        }
    };
    let of_joint = |kind: &str, joint: &str| {
        message(&rubbing(&format!(
            "kind = '{kind}'\njoint = '{joint}'\ncoefficient = 0.1\nradius = 0.1\nspeed = 0.1\n"
        )))
    };
    assert!(of_joint("revolute-friction", "pni").contains("pin"), "{}", of_joint("revolute-friction", "pni"));
    assert!(of_joint("revolute-friction", "bob").contains("joint of kind `revolute`"));
    let text = message(&rubbing("kind = 'guide-friction'\njoint = 'pin'\ncoefficient = 0.1\nspeed = 0.1\n"));
    assert!(text.contains("`pin` is of kind `revolute`, not a joint of kind `prismatic` or `point-on-line`"), "{text}");
    let text =
        message(&rubbing("kind = 'revolute-friction'\njoint = 'pin'\ncoefficient = 0.1\nradius = 0.1\nspeed = 0\n"));
    assert!(text.contains("rub") && text.contains("transition speed is 0"), "{text}");
    let profile = |points: &str| {
        message(&rubbing(&format!(
            "kind = 'profile-contact'\na = 'ground'\nb = 'bob'\nstiffness = 1e3\nprofile = {points}\n"
        )))
    };
    assert!(profile("[[0, 0], [1, 0], [1, 1]]").contains("needs 4"), "{}", profile("[[0, 0], [1, 0], [1, 1]]"));
    assert!(profile("[[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]").contains("do not repeat the first point"));
    assert!(profile("3").contains("a list of points"), "{}", profile("3"));
}
