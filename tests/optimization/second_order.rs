//! Stationary points that are not minima: saddle points at designs of symmetry, and bounds and limits without multipliers.

use linkwright::autodiff::Scalar;
use linkwright::function;
use linkwright::problem::{ClosedForm, Constraint, DesignVariable, Problem, ProblemBuilder, Quantity};
use linkwright::sao::{Method, RunState, Status};

fn solve(problem: &Problem) -> RunState {
    Method::automatic().solve(problem, |_| ()).unwrap()
}

fn assert_optimum(end: &RunState, optimum: f64, what: &str) {
    assert_eq!(end.status, Status::Converged, "{what}: {}", end.reason);
    let found = end.evaluation.objective;
    assert!((found - optimum).abs() < 1e-6, "{what}: {found} instead of {optimum} at {:?}", end.design);
}

/// Adds variables without bounds.
fn add_variables(parts: &mut ProblemBuilder, start: &[f64]) {
    for (k, b) in start.iter().enumerate() {
        parts.variable(DesignVariable::new(format!("x{k}"), "", *b));
    }
}

/// A problem in variables without bounds; the objective is response 0.
fn free(start: &[f64], rows: impl Fn(&mut ProblemBuilder, usize), analysis: impl ClosedForm + 'static) -> Problem {
    let mut parts = ProblemBuilder::new("free");
    add_variables(&mut parts, start);
    let [f, c] = ["f", "c"].map(|name| parts.constant(name, ""));
    parts.minimize("f", "", Quantity::response(None, f));
    rows(&mut parts, c);
    parts.build_analytic(analysis).unwrap()
}

fn even_quartic<S: Scalar>(x: &S, y: &S) -> S {
    let (x, y) = (*x * *x, *y * *y);
    x * x * 3.430_442_6 + y * y * 3.487_119_9 + x * y * 0.725_054_1 - x * 2.625_422_6 - y * 2.313_252_6
}

fn ellipse<S: Scalar>(x: &S, y: &S) -> S {
    *x * *x * 1.275_281_4 + *y * *y * 1.038_309_9
}

struct OnEllipse;
impl ClosedForm for OnEllipse {
    fn response<S: Scalar>(&self, h: usize, b: &[S], _: S) -> S {
        if h == 0 { even_quartic(&b[0], &b[1]) } else { ellipse(&b[0], &b[1]) }
    }
}

/// Along the ellipse the objective falls from both vertices, where the gradient of the Lagrangian is zero.
#[test]
fn a_vertex_of_symmetry_on_an_equality_is_left() {
    let limit = 0.633_509_4;
    // The objective along the ellipse, by the square of x.
    let along = |k: u32| {
        let x = f64::from(k) / 1e5 * limit / 1.275_281_4;
        even_quartic(&x.sqrt(), &((limit - 1.275_281_4 * x) / 1.038_309_9).sqrt())
    };
    let optimum = (0..=100_000).map(along).fold(f64::INFINITY, f64::min);
    for start in [[0.0, 1e-9], [1e-9, 0.0], [0.0, -1e-6], [0.0, 0.3]] {
        let row = |parts: &mut ProblemBuilder, c| {
            parts.subject_to(Constraint::equal("ellipse", limit, Quantity::response(None, c)));
        };
        let end = solve(&free(&start, row, OnEllipse));
        assert_optimum(&end, optimum, &format!("from {start:?}"));
    }
}

/// Σ kᵢ xᵢ⁴ − Σ cᵢ xᵢ² with couplings of the squares: saddle points on all axes and planes.
fn coupled_quartic<S: Scalar>(b: &[S]) -> S {
    const CURVATURES: [f64; 5] = [-2.516_389, 2.168_106, -1.659_548, -1.681_849, -0.168_029];
    const QUARTIC: [f64; 5] = [1.614_245, 2.144_628, 1.359_45, 1.867_778, 1.695_137];
    const COUPLED: [[f64; 5]; 5] = [
        [0.856_96, 0.810_378, 0.332_72, 0.257_27, 0.877_187],
        [0.810_378, 0.238_668, 0.494_677, 0.854_152, 0.986_391],
        [0.332_72, 0.494_677, 0.697_36, 0.760_998, 0.914_271],
        [0.257_27, 0.854_152, 0.760_998, 0.392_071, 0.386_21],
        [0.877_187, 0.986_391, 0.914_271, 0.386_21, 1.188_368],
    ];
    let square: Vec<S> = b.iter().map(|x| *x * *x).collect();
    let one = |i: usize| {
        let coupled = (0..5).fold(S::from(0.0), |sum, k| sum + square[k] * COUPLED[i][k]);
        (square[i] * QUARTIC[i] + CURVATURES[i] + coupled) * square[i]
    };
    (0..5).fold(S::from(0.0), |sum, i| sum + one(i))
}

fn ellipsoid<S: Scalar>(b: &[S]) -> S {
    let weights = [0.853_147, 1.545_953, 1.593_259, 1.104_979, 1.981_827];
    (0..5).fold(S::from(0.0), |sum, i| sum + b[i] * b[i] * weights[i])
}

struct Coupled;
impl ClosedForm for Coupled {
    fn response<S: Scalar>(&self, h: usize, b: &[S], _: S) -> S {
        if h == 0 { coupled_quartic(b) } else { ellipsoid(b) }
    }
}

/// Best of the minima over all sets of squares that are zero, where the gradient by the others is zero, inside the ellipsoid: the
/// limit is not active there. Found by a projected descent in the squares, in which the function is quadratic and convex.
fn least_of_coupled() -> f64 {
    let at = |s: &[f64; 5]| coupled_quartic(&s.map(f64::sqrt));
    let mut s = [0.1; 5];
    for _ in 0..20_000 {
        for i in 0..5 {
            let value = |x: f64, s: &[f64; 5]| {
                let mut moved = *s;
                moved[i] = x;
                at(&moved)
            };
            // The minimum of the parabola through three points.
            let [a, b, c] = [0.0, 1.0, 2.0].map(|x| value(x, &s));
            s[i] = ((4.0 * b - 3.0 * a - c) / (4.0 * b - 2.0 * a - 2.0 * c)).max(0.0);
        }
    }
    assert!(ellipsoid(&s.map(f64::sqrt)) < 1.042_624, "{s:?}");
    at(&s)
}

#[test]
fn points_of_symmetry_in_several_variables_are_left() {
    let optimum = least_of_coupled();
    for start in [[0.0, 0.0, 1e-9, 0.0, 1e-9], [0.0, 0.0, 1e-9, 0.0, 0.0], [0.0, 0.0, 0.3, 0.0, 0.0]] {
        let by_output = |parts: &mut ProblemBuilder, c| {
            parts.subject_to(Constraint::at_most("ellipsoid", 1.042_624, Quantity::response(None, c)));
        };
        let end = solve(&free(&start, by_output, Coupled));
        assert_optimum(&end, optimum, &format!("from {start:?}"));
    }
}

/// The same functions given directly: their second derivatives are known.
#[test]
fn points_of_symmetry_of_functions_that_are_given_directly_are_left() {
    let optimum = least_of_coupled();
    for start in [[0.0, 0.0, 0.0, 0.0, 0.3], [0.0, 0.0, 0.3, 0.0, 0.0]] {
        let mut parts = ProblemBuilder::new("direct");
        add_variables(&mut parts, &start);
        parts.minimize("f", "", Quantity::plain(function!(|p| coupled_quartic(p.design))));
        let row = Quantity::plain(function!(|p| ellipsoid(p.design)));
        parts.subject_to(Constraint::at_most("ellipsoid", 1.042_624, row));
        let end = solve(&parts.build_analytic(Coupled).unwrap());
        assert_optimum(&end, optimum, &format!("from {start:?}"));
    }
}

/// −s x − (s y − 1)² with s = ±1: at (1, 1) the bound of y has no multiplier, and the objective falls inwards.
struct Inwards(f64);
impl ClosedForm for Inwards {
    fn response<S: Scalar>(&self, h: usize, b: &[S], _: S) -> S {
        if h == 0 { -b[0] * self.0 - (b[1] * self.0 - 1.0).powi(2) } else { b[1] * self.0 + 3.0 }
    }
}

#[test]
fn a_bound_or_a_limit_without_a_multiplier_is_left_where_the_objective_falls_inwards() {
    for sign in [1.0, -1.0] {
        for is_limit in [false, true] {
            let mut parts = ProblemBuilder::new("inwards");
            let [inner, outer] = if is_limit { [-2.0, 5.0] } else { [-2.0, 1.0] };
            let within = |upper: f64| if sign > 0.0 { (inner, upper) } else { (-upper, -inner) };
            let (x, y) = (within(1.0), within(outer));
            parts.variable(DesignVariable::new("x", "", 0.0).within(x.0, x.1));
            parts.variable(DesignVariable::new("y", "", sign).within(y.0, y.1));
            let [f, c] = ["f", "c"].map(|name| parts.constant(name, ""));
            parts.minimize("f", "", Quantity::response(None, f));
            if is_limit {
                parts.subject_to(Constraint::at_most("y", 4.0, Quantity::response(None, c)));
            }
            let end = solve(&parts.build_analytic(Inwards(sign)).unwrap());
            assert_optimum(&end, -10.0, &format!("{sign} {is_limit}"));
        }
    }
}

/// A cubic in four variables whose gradient at (−2, 2, 2, 2) is (24, −32, −80, 0). Inwards, the objective falls with the last one.
struct Cubic;
impl ClosedForm for Cubic {
    fn response<S: Scalar>(&self, _: usize, b: &[S], _: S) -> S {
        let [x, y, z, w] = [b[0], b[1], b[2], b[3]];
        x * (x * (x + y * 2.0 - z * 2.0 + w - 1.0)
            + y * (y * 4.0 + z * 6.0 - w * 9.0 + 2.0)
            + z * (w * 3.0 + 3.0)
            + w * (-w * 3.0 + 1.0))
            + y * (y * (-w * 3.0 + z + 2.0) + z * (w * 4.0 - z - 4.0) + w * (-w * 2.0 - 2.0))
            + z * (z * (-z * 2.0 - w + 2.0) + w * (-w - 3.0))
            + w * (w * (-w - 1.0))
    }
}

#[test]
fn a_vertex_with_one_bound_without_a_multiplier_is_left() {
    let mut parts = ProblemBuilder::new("cubic");
    for (name, start) in [("x", 0.0), ("y", 0.0), ("z", 1.0), ("w", -1.0)] {
        parts.variable(DesignVariable::new(name, "", start).within(-2.0, 2.0));
    }
    let f = parts.constant("f", "");
    parts.minimize("f", "", Quantity::response(None, f));
    let end = solve(&parts.build_analytic(Cubic).unwrap());
    // The least value on the edge of the last variable: that of its other end.
    assert_optimum(&end, -156.0, "cubic");
}

/// x³ + y³ between −2 and 2: all curvatures vanish at the point of inflection at zero, to which the steps of Newton's method lead.
#[test]
fn a_point_where_all_curvatures_vanish_is_left() {
    let mut parts = ProblemBuilder::new("cubes");
    for (name, start) in [("x", 1.5), ("y", 1.2)] {
        parts.variable(DesignVariable::new(name, "", start).within(-2.0, 2.0));
    }
    let cubes = function!(|p| p.design[0].powi(3) + p.design[1].powi(3));
    parts.minimize("f", "", Quantity::plain(cubes));
    let end = solve(&parts.build_analytic(Cubic).unwrap());
    assert!(end.status.is_success() && end.evaluation.objective < -7.999, "{}: {:?}", end.reason, end.design);
}
