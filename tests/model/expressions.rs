//! Expressions: precedence, derivatives, errors, and random text.

use linkwright::autodiff::{Dual, PolynomialDegree, gradient, hessian};
use linkwright::model_file::Diagnostic;
use linkwright::model_file::expression::{CompiledExpression, ExpressionTree, Inputs, Names, Scope, TextPlace};
use proptest::prelude::*;

fn names() -> Names {
    let mut names = Names::default();
    ["x", "y"].iter().for_each(|name| names.design(name));
    names.constant("c", 3.0);
    names
}

fn compile(text: &str) -> Result<CompiledExpression, Diagnostic> {
    names().compile(&ExpressionTree::parse(text, TextPlace::from(0))?, &Scope::MOTION)
}

fn value(text: &str) -> f64 {
    compile(text).unwrap_or_else(|c| panic!("{text}: {c:?}")).value(&Inputs::at(&[2.0, 5.0], 0.5))
}

#[test]
fn signs_bind_as_in_mathematics() {
    for (text, expected) in [
        ("1 + 2*3", 7.0),
        ("-2^2", -4.0),
        ("2^3^2", 512.0),
        ("2^-1", 0.5),
        ("-x^-2", -0.25),
        ("8/4/2", 1.0),
        ("8 - 4 - 2", 2.0),
        ("2*-3", -6.0),
        ("+x - -y", 7.0),
        ("(1 + 2)*3", 9.0),
        ("1e-3*1E3", 1.0),
        (".5 + 5.", 5.5),
        ("--x", 2.0),
        ("c^x", 9.0),
        ("c/x", 1.5),
        ("c - x", 1.0),
        ("x^y", 32.0),
        ("x^0.5", 2.0_f64.sqrt()),
        ("4*time^2", 1.0),
        ("2 *\tx", 4.0),
    ] {
        assert!((value(text) - expected).abs() < 1e-12, "{text} is {}", value(text));
    }
}

#[test]
fn functions_are_those_of_mathematics() {
    for (text, expected) in [
        ("sin(deg(30))", 0.5),
        ("cos(pi)", -1.0),
        ("tan(deg(45))", 1.0),
        ("asin(1) + acos(1)", std::f64::consts::FRAC_PI_2),
        ("atan2(1, -1)", 0.75 * std::f64::consts::PI),
        ("atan(1)", std::f64::consts::FRAC_PI_4),
        ("hypot(3, 4)", 5.0),
        ("hypot(x, 2*x)", 20.0_f64.sqrt()),
        ("max(x, y) - min(x, y)", 3.0),
        ("max(1, x) + min(x, 1)", 3.0),
        ("pow(x, 3)", 8.0),
        ("abs(-y)", 5.0),
        ("exp(ln(y))", 5.0),
        ("sqrt(x)^2", 2.0),
        ("cosh(x)^2 - sinh(x)^2", 1.0),
        ("tanh(0)", 0.0),
    ] {
        assert!((value(text) - expected).abs() < 1e-12, "{text} is {}", value(text));
    }
}

#[test]
fn derivatives_are_exact() {
    let text = "x^2*sin(y) + exp(-x*y)/hypot(x, y) - atan2(y, x)^3 + 2^x";
    let expression = compile(text).unwrap();
    let by_hand = |x: f64, y: f64| {
        let r = x.hypot(y);
        let e = (-x * y).exp();
        let a = y.atan2(x);
        let dx = 2.0 * x * y.sin() - y * e / r - e * x / r.powi(3)
            + 3.0 * a * a * y / (r * r)
            + 2.0_f64.powf(x) * 2.0_f64.ln();
        let dy = x * x * y.cos() - x * e / r - e * y / r.powi(3) - 3.0 * a * a * x / (r * r);
        [dx, dy]
    };
    let at = [1.3, 0.4];
    let (_, slope) = gradient(|b| expression.value(&Inputs::design(b)), &at);
    for (found, expected) in slope.iter().zip(by_hand(at[0], at[1])) {
        assert!((found - expected).abs() < 1e-13, "{found} and {expected}");
    }
    let (_, again, curvature) = hessian(|b| expression.value(&Inputs::design(b)), &at);
    assert!((again[0] - slope[0]).abs() < 1e-13);
    let h = 1e-6;
    let difference = (by_hand(at[0] + h, at[1])[0] - by_hand(at[0] - h, at[1])[0]) / (2.0 * h);
    assert!((curvature[(0, 0)] - difference).abs() < 1e-7);
}

#[test]
fn structure_is_kept() {
    let degree = |text: &str| {
        let b = [PolynomialDegree::variable(2.0), PolynomialDegree::variable(5.0)];
        compile(text).unwrap().value(&Inputs::at(&b, PolynomialDegree::from(0.5))).degree
    };
    assert_eq!([degree("2*x + y/4 - c"), degree("x*y"), degree("x^2"), degree("(x + 1)^3")], [1, 2, 2, 3]);
    assert_eq!([degree("c^2"), degree("min(2, 3)")], [0, 0]);
    for text in ["x/y", "sin(x)", "abs(x)", "min(x, y)", "max(x, 0)"] {
        assert_eq!(degree(text), PolynomialDegree::NONLINEAR, "{text}");
    }
}

#[test]
fn named_expressions_are_evaluated_once() {
    // 2^60 operations if each name were replaced by its definition.
    let mut names = names();
    let named = |k: usize| {
        let text = if k == 0 { "x".to_owned() } else { format!("e{0} + e{0}", k - 1) };
        (format!("e{k}"), ExpressionTree::parse(&text, TextPlace::from(0)).unwrap())
    };
    names.expressions((0..=60).map(named).collect()).unwrap();
    let expression = names.compile(&ExpressionTree::parse("e60", TextPlace::from(0)).unwrap(), &Scope::DESIGN).unwrap();
    assert_eq!(expression.value(&Inputs::design(&[1.0, 0.0])), 2.0_f64.powi(60));
    assert_eq!(expression.value(&Inputs::design(&[Dual::from(1.0), Dual::from(0.0)])).re, 2.0_f64.powi(60));
}

#[test]
fn sizes_are_limited() {
    let deep = "(".repeat(100_000) + "1" + &")".repeat(100_000);
    let signs = "-".repeat(3000) + "1";
    let powers = "x".to_owned() + &"^x".repeat(2000);
    for text in [deep, signs, powers, "1+".repeat(4000) + "1"] {
        let error = ExpressionTree::parse(&text, TextPlace::from(0)).unwrap_err();
        assert!(error.message.contains("levels") || error.message.contains("too long"), "{error:?}");
    }
    assert_eq!(value(&("1".to_owned() + &"+1".repeat(2000))), 2001.0);
}

/// Expressions that are defined at most points.
fn valid() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        Just("x".to_owned()),
        Just("y".to_owned()),
        Just("c".to_owned()),
        (1..50u8).prop_map(|n| format!("{}", f64::from(n) / 10.0))
    ];
    leaf.prop_recursive(5, 40, 2, |inner| {
        prop_oneof![
            (inner.clone(), inner.clone(), prop_oneof![Just('+'), Just('-'), Just('*'), Just('/')])
                .prop_map(|(a, b, sign)| format!("({a} {sign} {b})")),
            (inner.clone(), 1..4u8).prop_map(|(a, n)| format!("({a})^{n}")),
            (inner.clone(), prop_oneof![Just("sin"), Just("cos"), Just("tanh"), Just("atan")])
                .prop_map(|(a, f)| format!("{f}({a})")),
            inner.clone().prop_map(|a| format!("-{a}")),
            (inner.clone(), inner).prop_map(|(a, b)| format!("hypot({a}, {b})")),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn derivatives_agree_with_differences(text in valid(), x in 0.5..2.0f64, y in 0.5..2.0f64) {
        // A constant part may be infinite, which is an error.
        let Ok(expression) = compile(&text) else { return Ok(()) };
        let at = |x: f64, y: f64| expression.value(&Inputs::design(&[x, y]));
        let (value, slope) = gradient(|b| expression.value(&Inputs::design(b)), &[x, y]);
        prop_assume!(value.is_finite() && slope.iter().all(|s| s.abs() < 1e3));
        let difference = |h: f64| (at(x + h, y) - at(x - h, y)) / (2.0 * h);
        let (coarse, fine) = (difference(2e-5), difference(1e-5));
        // If two steps disagree, differences of the function are not accurate.
        prop_assume!((coarse - fine).abs() < 1e-6 * (1.0 + fine.abs()));
        prop_assert!((slope[0] - fine).abs() < 1e-4 * (1.0 + fine.abs() + value.abs()), "{text}: {} and {fine}", slope[0]);
        // The real part of a dual may differ in the last digit.
        prop_assert!((value - at(x, y)).abs() <= 1e-13 * value.abs().max(1.0));
    }

    #[test]
    fn anything_typed_is_read_or_rejected_with_its_location(text in "[-+*/^(),.a-z0-9eE_ πé]{0,60}") {
        match compile(&text) {
            Ok(expression) => drop(expression.value(&Inputs::at(&[1.0, 2.0], 0.0))),
            Err(error) => prop_assert!(error.span.end <= text.len(), "{error:?}"),
        }
    }

    #[test]
    fn any_text_is_read_or_rejected(text in "\\PC{0,80}") {
        drop(compile(&text));
    }
}

#[test]
fn a_quadratic_drag_at_rest_has_its_derivative() {
    for text in ["x*hypot(x, y)", "hypot(0*x, y)*y", "x*hypot(x, y)^2"] {
        let drag = compile(text).unwrap();
        let (value, slopes) = gradient(|b| drag.value(&Inputs::design(b)), &[0.0, 0.0]);
        assert!(value == 0.0 && slopes == [0.0, 0.0], "{text}: {value}, {slopes:?}");
    }
}

#[test]
fn a_choice_and_a_smooth_step_have_the_values_and_derivatives_of_their_branches() {
    for (text, expected) in [
        ("if(x < y, 1, 2)", 1.0),
        ("if(x >= 2, x*y, 0)", 10.0),
        ("if(x > 2, x*y, -x)", -2.0),
        ("if(1 > 2, 1/0*x, y)", 5.0),
        ("1 + if(x > 1, if(y > 9, 7, 8), 9)", 9.0),
        ("if(x - 5 > 0, sqrt(x - 5), 3)", 3.0),
        ("sign(-x) + sign(0*y)", -1.0),
        ("smooth_step(x, 1, 3)", 0.5),
        ("smooth_step(x, 3, 4) + smooth_step(y, 3, 4)", 1.0),
        ("smooth_step(time, 0, 1 s)", 0.5),
        ("smooth_step(3, 2, 6)", 0.103515625),
    ] {
        assert!((value(text) - expected).abs() < 1e-12, "{text} is {}", value(text));
    }
    let step = compile("if(x > 1, x^2*y, 0) + y*smooth_step(x, 1, 4)").unwrap();
    let slopes = gradient(|b| step.value(&Inputs::design(b)), &[2.0, 5.0]).1;
    // With t = 1/3 the slope of 6t⁵ − 15t⁴ + 10t³ is 30 t² (1 − t)².
    let [t, width] = [1.0 / 3.0, 3.0];
    let (rise, shape) = (30.0 * t * t * (1.0 - t) * (1.0 - t) / width, t * t * t * (t * (6.0 * t - 15.0) + 10.0));
    assert!((slopes[0] - (20.0 + 5.0 * rise)).abs() < 1e-12 && (slopes[1] - (4.0 + shape)).abs() < 1e-12, "{slopes:?}");
    for text in ["if(x, 1, 2)", "if(x > 1, 2)", "x > 1", "smooth_step(x, 1)", "none(x)", "none(x, y)", "if"] {
        assert!(compile(text).is_err(), "{text}");
    }
}

/// Conditions that are combined as in programming languages: the message says how they are written.
#[test]
fn combined_conditions_have_a_remedy() {
    for (text, remedy) in [
        ("x > 1 and y < 2", "min(x - a, b - x) > 0"),
        ("x > c and y < 2", "min(x - a, b - x) > 0"),
        ("x > 1 && y < 2", "min(x - a, b - x) > 0"),
        ("1 < x < 2", "min(x - a, b - x) > 0"),
        ("x > 1 or y < 2", "max(a - x, x - b) > 0"),
        ("x > 1 || y < 2", "max(a - x, x - b) > 0"),
        ("!x > 1", "turn the comparison around"),
        ("x == 1", "< <= > >="),
    ] {
        let error = ExpressionTree::parse_condition(text, TextPlace::from(0)).unwrap_err();
        assert!(error.help.as_deref().is_some_and(|help| help.contains(remedy)), "{text}: {error:?}");
        let choice = ExpressionTree::parse(&format!("if({text}, 1, 2)"), TextPlace::from(0)).unwrap_err();
        assert_eq!(choice.help, error.help, "{text}");
    }
    let inside = ExpressionTree::parse_condition("min(x - 1, 2 - x) > 0", TextPlace::from(0)).unwrap();
    let value = names().compile(&inside, &Scope::MOTION).unwrap().value(&Inputs::at(&[1.25, 5.0], 0.5));
    assert_eq!(value, 0.25);
}
