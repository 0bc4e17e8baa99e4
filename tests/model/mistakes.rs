//! Wrong model files, each by one change of a good one, and the diagnostics.

use linkwright::model_file::read;
use proptest::prelude::*;

const GOOD: &str = include_str!("good.toml");

/// The mistake, a text of the good file, and its replacement.
const MISTAKES: &[[&str; 3]] = &[
    // The file as such.
    ["broken string", "title = \"good\"", "title = \"good"],
    ["broken table", "[design.length]", "[design.length"],
    ["key twice", "start = 1.0\n", "start = 1.0\nstart = 2.0\n"],
    ["section twice", "[time]", "[time]\nto = 2.0\n[time]"],
    ["no version", "version = 2\n", ""],
    ["another version", "version = 2", "version = 7"],
    ["old kind", "kind = \"fixed\"", "kind = \"weld\"\nturn = 0.0"],
    ["old measure", "value = \"rod.first.moment\"", "value = \"2*spring.effort + clamp.couple\""],
    ["unknown section", "[constants]", "[constant]"],
    ["unknown part", "[[joint]]", "[[joints]]"],
    ["a table in place of tables", "[[driver]]", "[driver]"],
    // Keys and types.
    ["unknown key", "stiffness = \"stiffness\"", "stiffnes = \"stiffness\""],
    ["key of another kind", "kind = \"slider\"", "kind = \"slider\"\ninertia = 1.0"],
    ["missing key", "coordinate = \"cart\"\n", ""],
    ["unknown kind", "kind = \"fixed\"", "kind = \"fxied\""],
    ["missing kind", "kind = \"force\"\n", ""],
    ["text for a flag", "from = 0.5\n", "from = 0.5\ncontinuous = \"yes\"\n"],
    ["number for text", "name = \"motor\"", "name = 3"],
    ["list for a number", "start = 50.0", "start = [50.0]"],
    ["date for a number", "start = 50.0", "start = 2026-01-01"],
    ["three values for two", "at = [\"length/2\", 0]", "at = [\"length/2\", 0, 0]"],
    ["half an element", "elements = 2", "elements = 2.5"],
    ["no element", "elements = 2", "elements = 0"],
    ["negative count", "points = 11", "points = -11"],
    // Numbers.
    ["infinite number", "start = 50.0", "start = inf"],
    ["not a number", "load = 2.0", "load = nan"],
    ["huge number", "load = 2.0", "load = \"1e999\""],
    ["division by zero", "load = 2.0", "load = \"1/0\""],
    ["root of a negative number", "load = 2.0", "load = \"sqrt(-1)\""],
    ["start above the bound", "start = 1.0", "start = 3.0"],
    ["crossed bounds", "lower = 0.5", "lower = 2.5"],
    // Expressions.
    ["unknown name", "\"load*length^2/12\"", "\"load*lenght^2/12\""],
    ["unknown function", "\"deg(0)\"", "\"degree(0)\""],
    ["operand missing", "\"load*length^2/12\"", "\"load*length^2/\""],
    ["parenthesis missing", "\"load*length^2/12\"", "\"load*(length^2/12\""],
    ["sign missing", "\"load*length^2/12\"", "\"load length\""],
    ["strange letter", "\"load*length^2/12\"", "\"load × length\""],
    ["too many arguments", "\"deg(0)\"", "\"deg(0, 1)\""],
    ["too few arguments", "\"deg(0)\"", "\"hypot(1)\""],
    ["function without arguments", "\"deg(0)\"", "\"sin\""],
    ["empty expression", "\"deg(0)\"", "\"\""],
    ["two decimal points", "\"deg(0)\"", "\"1.2.3\""],
    ["power of a negative constant", "\"deg(0)\"", "\"(-2)^length\""],
    ["circle of constants", "load = 2.0\nspeed = \"2*pi\"", "load = \"speed\"\nspeed = \"2*load\""],
    ["circle of expressions", "inertia = \"load*length^2/12\"", "inertia = \"half\"\nhalf = \"inertia/2\""],
    ["constant of a design variable", "load = 2.0", "load = \"length\""],
    ["bound of a design variable", "lower = 0.5", "lower = \"stiffness/100\""],
    ["mass of time", "mass = \"load\"", "mass = \"load*time\""],
    ["mass of an expression of time", "inertia = \"load*length^2/12\"", "inertia = \"load*time\""],
    ["output in a mass", "mass = \"load\"", "mass = \"angle\""],
    // Names.
    ["name with a space", "name = \"arm\"", "name = \"the arm\""],
    ["name of a function", "name = \"arm\"", "name = \"sin\""],
    ["name taken twice", "name = \"cart\"", "name = \"arm\""],
    ["constant named as a design variable", "speed = \"2*pi\"", "speed = \"2*pi\"\nlength = 2.0"],
    ["design variable named time", "[design.stiffness]", "[design.time]"],
    ["output taken twice", "name = \"moment\"", "name = \"angle\""],
    ["constraint taken twice", "name = \"size\"", "name = \"sag\""],
    // References.
    ["unknown body", "a = \"ground\"\n", "a = \"grund\"\n"],
    ["unknown body of a point", "body = \"arm\"\nat", "body = \"amr\"\nat"],
    ["unknown node", "b = \"rod.first\"", "b = \"rod.7\""],
    ["unknown coordinate", "b = \"arm.theta\"", "b = \"arm.phi\""],
    ["unknown measure", "\"arm.theta\"\nlinear", "\"arm.teta\"\nlinear"],
    ["unknown measure of a beam", "\"rod.first.moment\"", "\"rod.first.couple\""],
    ["unknown output", "value = \"angle\"", "value = \"angel\""],
    ["unknown method", "preset = \"slp\"", "preset = \"gcma\""],
    ["unknown intermediate variable", "linear_in = \"reciprocal\"", "linear_in = { lenght = \"reciprocal\" }"],
    // Motions.
    ["unknown motion", "kind = \"ramp\"", "kind = \"rampe\""],
    ["motion of an output", "\"0.1*sin(speed*time)\"", "\"0.1*sin(angle)\""],
    ["table that goes back", "\"0.1*sin(speed*time)\"", "{ kind = \"table\", times = [0, 2, 1], values = [0, 1, 0] }"],
    // Time and analysis.
    ["no time points", "[time]\nto = 1.0\npoints = 11\n", ""],
    ["time that goes back", "to = 1.0\npoints = 11", "at = [0, 2, 1]"],
    ["time both ways", "points = 11", "points = 11\nat = [0, 1]"],
    ["a billion time points", "points = 11", "points = 1000000000"],
    ["a trillion steps", "step = 1e-2", "step = 1e-12"],
    ["step and tolerance", "step = 1e-2", "step = 1e-2\ntolerance = 1e-6"],
    ["negative step", "step = 1e-2", "step = -1e-2"],
    ["too much damping", "step = 1e-2", "step = 1e-2\nscheme = \"hht\"\ndamping = 0.5"],
    ["start after the first time", "step = 1e-2", "step = 1e-2\nstart = 1"],
    ["no analysis", "[analysis]\nkind = \"dynamics\"\nstep = 1e-2\n", ""],
    ["short series", "wanted = [0, 0,", "wanted = [0,"],
    // Objective, constraints, method.
    ["no objective", "[objective]\nminimize = \"(angle - wanted)^2\"\nover = \"mean\"\n", ""],
    ["history for an objective", "over = \"mean\"\n", ""],
    ["misspelt rule", "over = \"mean\"", "over = \"mean\"\nrule = \"simson\""],
    ["constraint without a limit", "at_most = 1.5\n", ""],
    ["limit of a design variable", "at_most = 1.5", "at_most = \"stiffness\""],
    ["empty interval", "at_most = 1.5", "at_most = 1.5\nat_least = 2"],
    ["interval of a constant", "at_most = 1.5", "at_most = 1.5\nfrom = 0.1"],
    ["interval without time points", "from = 0.5", "from = 2.0"],
    ["continuous on an interval", "from = 0.5", "from = 0.5\ncontinuous = true"],
    ["negative scale", "from = 0.5", "scale = -1"],
    ["accuracy out of range", "accuracy = 1e-4", "accuracy = 2.0"],
    ["cut-off out of range", "cutoff = 0.5", "cutoff = 1.5"],
    ["move limits out of range", "cutoff = 0.5", "move_limits = { initial = -1 }"],
    // Copies.
    ["range that goes back", "name = \"cart\"", "each = { i = \"5..1\" }\nname = \"cart{i}\""],
    ["a billion copies", "name = \"cart\"", "each = { i = \"1..1000000000\" }\nname = \"cart{i}\""],
    ["copies of copies", "name = \"cart\"", "each = { i = \"1..999\", j = \"1..999\" }\nname = \"cart{i}_{j}\""],
    ["copies with one name", "name = \"cart\"", "each = { i = [1, 2] }\nname = \"cart\""],
    ["neighbour of a word", "name = \"cart\"", "each = { i = [\"a\"] }\nname = \"cart{i+1}\""],
];

#[test]
fn the_good_file_is_good() {
    let model = read("good.toml", GOOD).unwrap_or_else(|report| panic!("{report}"));
    let problem = model.problem().unwrap();
    let here = problem.evaluate(&problem.start(), &problem.analyze(&problem.start()).unwrap()).unwrap();
    assert!(here.objective > 0.0);
}

#[test]
fn every_mistake_is_shown_at_its_location() {
    let mut all = String::new();
    for [what, good, bad] in MISTAKES {
        assert!(GOOD.contains(good), "{what}: `{good}` is not in the good file");
        let report = match read("model.toml", &GOOD.replacen(good, bad, 1)) {
            Ok(_) => panic!("{what}: the file was read"),
            Err(report) => report,
        };
        all += &format!("## {what}\n{report}\n\n");
    }
    assert!(MISTAKES.len() >= 60);
    insta::assert_snapshot!("mistakes", all);
}

#[test]
fn cut_anywhere_a_file_is_read_or_rejected() {
    for end in (0..GOOD.len()).step_by(7) {
        if let Err(report) = read("m.toml", &GOOD[..end]) {
            assert!(!report.to_string().is_empty());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_good_file_with_anything_typed_into_it_is_read_or_rejected(
        at in 0..GOOD.len(),
        cut in 0..20usize,
        typed in "[-+*/^(){}\\[\\]\"'=,.#a-z0-9 \n]{0,12}",
    ) {
        let end = (at + cut).min(GOOD.len());
        let text = format!("{}{typed}{}", &GOOD[..at], &GOOD[end..]);
        match read("m.toml", &text) {
            Ok(model) => drop(model.problem()),
            Err(report) => prop_assert!(report.to_string().contains("--> m.toml:")),
        }
    }
}

/// All mistakes are shown at once, in the order of the file, without those that follow from others.
#[test]
fn several_mistakes_are_shown_at_once() {
    let bad = GOOD
        .replacen("start = 1.0", "start = 9.0", 1)
        .replacen("mass = \"load\"", "mass = \"laod\"", 1)
        .replacen("a = \"ground\"\n", "a = \"grund\"\n", 1)
        .replacen("\"rod.first.moment\"", "\"rod.first.couple\"", 1)
        .replacen("cutoff = 0.5", "cutof = 0.5", 1);
    let report = read("model.toml", &bad).err().unwrap();
    insta::assert_snapshot!("several", report);
    // At most ten are shown.
    let many: String = (0..100).map(|k| format!("[[body]]\nname = \"b{k}\"\nkind = \"bodie\"\n")).collect();
    let report = read("model.toml", &format!("version = 2\n{many}")).err().unwrap();
    assert_eq!(report.diagnostics.len(), 10);
}

/// An error of an analysis is shown at the part that it names.
#[test]
fn an_error_of_an_analysis_is_shown_at_its_part() {
    let mut all = String::new();
    for [what, good, bad] in FAILURES {
        assert!(GOOD.contains(good), "{what}: `{good}` is not in the good file");
        let model =
            read("model.toml", &GOOD.replacen(good, bad, 1)).unwrap_or_else(|report| panic!("{what}: {report}"));
        let done = model.problem().and_then(|p| p.evaluate(&p.start(), &p.analyze(&p.start())?));
        let error = done.err().unwrap_or_else(|| panic!("{what}: nothing fails"));
        let report = model.locate(&error).unwrap_or_else(|| panic!("{what}: {error}"));
        all += &format!("## {what}\n{report}\n\n");
    }
    insta::assert_snapshot!("failures", all);
}

/// A quarter ring whose clamp is turned by 90° against the tangent of the built beam: the assembly bends its first element.
#[test]
fn statics_name_the_joint_that_the_built_positions_miss() {
    let text = "version = 2\n[[beam]]\nname = \"ring\"\nfrom = [0, 0]\nto = [1, 1]\nrise = 0.2928932188134524\ndiameter = 0.02\n\
                young = 2e11\ndensity = 7800\nelements = 16\nshear = \"rigid\"\n\
                [[joint]]\nname = \"clamp\"\nkind = \"fixed\"\na = \"ground\"\nb = \"ring.first\"\nangle = 0\n\
                [[force]]\nname = \"f\"\nkind = \"force\"\nat = \"ring.last\"\ndirection = 0\nforce = 1\n\
                [time]\nat = [0]\n[analysis]\nkind = \"statics\"\n[[output]]\nname = \"x\"\nvalue = \"ring.last.x\"\n";
    let error = read("m.toml", text).unwrap().simulate(&[]).err().unwrap().to_string();
    assert!(
        error.contains("clamp") && error.contains("the built positions miss this joint by 1.571 m or rad"),
        "{error}"
    );
}

/// Valid files of mechanisms that cannot be analysed.
const FAILURES: &[[&str; 3]] = &[
    ["no mass", "mass = \"load\"", "mass = \"load - 2\""],
    ["not a number", "inertia = \"load*length^2/12\"", "inertia = \"sqrt(0.5 - length)\""],
    ["output not a number", "value = \"arm.theta\"", "value = \"sqrt(arm.theta - 10)\""],
    [
        "two joints for one",
        "[[driver]]",
        "[[joint]]\nname = \"again\"\nkind = \"distance\"\na = \"ground\"\nb = \"arm\"\nlength = 7\n\n[[driver]]",
    ],
];

/// Explicit schemes have no equilibrium at the start, no other initial accelerations and no other rates of drivers.
#[test]
fn settings_of_implicit_schemes_are_errors_with_explicit_ones() {
    for key in
        ["initial_configuration = \"equilibrium\"", "initial_acceleration = \"zero\"", "prescribed = \"newmark\""]
    {
        for (scheme, is_right) in [("hht", true), ("rk5", false), ("rk8", false)] {
            let text = GOOD.replace("step = 1e-2\n", &format!("step = 1e-2\nscheme = \"{scheme}\"\n{key}\n"));
            let errors = read("model.toml", &text).err().map(|report| report.to_string());
            assert_eq!(errors.is_none(), is_right, "{scheme}, {key}: {errors:?}");
            assert!(errors.is_none_or(|errors| errors.contains("implicit schemes only")));
        }
    }
}

/// A longest step bounds steps with a tolerance: explicit schemes have one by default, implicit ones if it is given.
#[test]
fn a_longest_step_needs_steps_with_a_tolerance() {
    for (settings, is_right) in [
        ("scheme = \"rk8\"", true),
        ("scheme = \"hht\"\ntolerance = 1e-6", true),
        ("scheme = \"hht\"", false),
        ("scheme = \"rk8\"\nstep = 1e-2", false),
    ] {
        let text = GOOD.replace("step = 1e-2\n", &format!("{settings}\nlongest_step = 0.02\n"));
        let errors = read("model.toml", &text).err().map(|report| report.to_string());
        assert_eq!(errors.is_none(), is_right, "{settings}: {errors:?}");
        assert!(errors.is_none_or(|errors| errors.contains("`longest_step` is for steps with a `tolerance`")));
    }
}

/// A measure outside of an output, and a point in place of a coordinate, are explained.
#[test]
fn what_stands_at_a_wrong_place_is_told_where_it_belongs() {
    let report = |from: &str, to: &str| {
        let text = GOOD.replacen(from, to, 1);
        assert_ne!(text, GOOD);
        read("m.toml", &text).err().map(|report| report.to_string()).unwrap_or_default()
    };
    let measure = report("length^2/12\"", "length^2/12 + rod.first.x\"");
    assert!(
        measure.contains("there is no name `rod.first.x`") && measure.contains("`value` of an [[output]]"),
        "{measure}"
    );
    let point = report("b = \"arm.theta\"", "b = \"tip.x\"");
    assert!(point.contains("there is no coordinate `tip.x`") && point.contains("`tip` is a point"), "{point}");
}

/// A body with a mistake has no number of its own, so that no other body was taken for it.
#[test]
fn a_mistake_in_one_body_is_no_mistake_in_its_joints() {
    for space in ["", "space = 3\n"] {
        let body = |name: &str, x: &str| {
            let (place, inertia) = match space {
                "" => (format!("[\"{x}\", 0]"), "0.1"),
                _ => (format!("[\"{x}\", 0, 0]"), "[0.1, 0.1, 0.1]"),
            };
            format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = {inertia}\nposition = {place}\n")
        };
        let text = format!(
            "version = 2\n{space}[constants]\nlength = 1\n{}{}[[joint]]\nname = \"pin\"\na = \"crank\"\nb = \"coupler\"\n",
            body("crank", "lenght/2"),
            body("coupler", "length")
        );
        let report = linkwright::model_file::read("m.toml", &text).err().unwrap().to_string();
        assert!(report.contains("there is no name `lenght`") && !report.contains("same part"), "{report}");
    }
}
