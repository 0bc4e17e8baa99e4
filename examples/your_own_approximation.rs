//! A new approximation: `cargo run --example your_own_approximation`.
//!
//! A monomial r̃ = r₀ Π (bₖ/bₖ⁰)^αₖ with αₖ = (bₖ⁰/r₀) ∂r/∂bₖ is linear in logarithms, as the condensation of geometric
//! programming. The [`FittedModel`] is generic over the number type, and the [`Approximation`] fits it. The test problem is
//! Svanberg's cantilever of five segments (1987): minimum weight with a limit on the tip deflection Σ aₖ/bₖ³.

use linkwright::approximation::{AnyModel, Approximation, Expansion, FittedModel, Linear};
use linkwright::prelude::*;
use linkwright::problem::{Intermediate, Intermediates, ProblemScalar};
use linkwright::{Error, Result};
use std::sync::Arc;

/// Settings: none.
#[derive(Debug)]
struct Monomial;

impl Approximation for Monomial {
    fn fit(&self, expansion: &Expansion) -> Result<Arc<dyn AnyModel>> {
        let here = &expansion.here;
        if here.value == 0.0 || here.design.contains(&0.0) {
            let why = "a monomial needs a value and variables that are not zero";
            return Err(Error::definition(expansion.name, why, "use the linear approximation"));
        }
        let exponent = |(b, slope): (&f64, &f64)| b * slope / here.value;
        let exponents = here.design.iter().zip(here.gradient).map(exponent).collect();
        Ok(Arc::new(Power { value: here.value, origin: here.design.to_vec(), exponents }))
    }
}

/// The fitted monomial: r₀, b⁰ and α.
struct Power {
    value: f64,
    origin: Vec<f64>,
    exponents: Vec<f64>,
}

impl FittedModel for Power {
    fn at<S: ProblemScalar>(&self, b: &[S]) -> S {
        let factor = |k: usize| (b[k] / self.origin[k]).powf(self.exponents[k]);
        (0..b.len()).map(factor).fold(S::from(self.value), |a, b| a * b)
    }
}

struct Cantilever;

impl ClosedForm for Cantilever {
    fn response<S: Scalar>(&self, _: usize, b: &[S], _: S) -> S {
        let term = |(&b, a): (&S, f64)| b.powi(-3) * a;
        b.iter().zip([61.0, 37.0, 19.0, 7.0, 1.0]).map(term).fold(S::from(0.0), |a, b| a + b)
    }
}

fn cantilever(intermediates: Intermediates) -> Result<Problem> {
    let mut parts = ProblemBuilder::new("cantilever");
    (1..=5).for_each(|k| _ = parts.variable(DesignVariable::new(format!("b{k}"), "", 5.0).within(1.0, 10.0)));
    let deflection = parts.constant("tip deflection", "");
    parts.linearize_in(deflection, intermediates);
    parts.minimize(
        "weight",
        "",
        Quantity::plain(function!(|p| p.design.iter().fold(S::from(0.0), |a, &b| a + b) * 0.0624)),
    );
    parts.subject_to(Constraint::at_most("deflection", 1.0, Quantity::response(None, deflection)));
    parts.build_analytic(Cantilever)
}

fn main() -> Result<()> {
    println!(
        "{:<24} {:>6} {:>6} {:>20} {:>10}",
        "approximation", "cycles", "trials", "E_g of first trial [%]", "weight"
    );
    let run = |name: &str, approximation: Box<dyn Approximation>, intermediates| -> Result<usize> {
        let state = Method { approximation, ..Method::slp() }.solve(&cantilever(intermediates)?, |_| ())?;
        let (trials, error) = (state.history.len() - 1, state.history[1].constraint_error_pct);
        println!("{name:<24} {:>6} {trials:>6} {error:>20.2} {:>10.6}", state.cycles(), state.evaluation.objective);
        assert!(state.status.is_success() && (state.evaluation.objective - 1.339_956_4).abs() < 2e-5, "{name}");
        Ok(trials)
    };
    let linear = run("linear", Box::new(Linear), Intermediates::Identity)?;
    let reciprocal = run("linear in reciprocals", Box::new(Linear), Intermediates::all(5, Intermediate::Reciprocal))?;
    let monomial = run("monomial (our own)", Box::new(Monomial), Intermediates::Identity)?;
    assert!(monomial < linear, "it represents products of powers exactly …");
    assert!(reciprocal < monomial, "… but the deflection is a sum of powers, for which reciprocals are better");
    Ok(())
}
