//! Forces and torques that depend on time and motion.

use super::parts::{BuildContext, CoordinateRef, NamedPart, Parts, position_or_push};
use super::section::{Read, Section};
use crate::model_file::expression::{CompiledExpression, Inputs, Names, Scope};
use autodiff::Scalar;
use mechanics::elements::StateFunction;
use mechanics::mechanism::Coordinate;
use std::cell::RefCell;

/// A force or torque whose parameters are expressions of the design variables.
#[derive(Clone, Debug)]
pub struct Feedback {
    law: ObservedFormula,
    observed: Vec<CoordinateRef>,
    parameters: Vec<CompiledExpression>,
}

/// A formula of parameters, time, and positions and velocities of the observed coordinates.
#[derive(Clone, Debug)]
pub struct ObservedFormula {
    expression: CompiledExpression,
    /// For each motion input of the expression: index of the observed coordinate, and whether it is its velocity.
    inputs: Vec<(usize, bool)>,
}

/// Largest number of motion inputs without heap allocation at every evaluation.
const FEW: usize = 16;

impl StateFunction for ObservedFormula {
    fn generalized_force<T: Scalar>(&self, p: &[T], t: T, q: &[T], v: &[T]) -> T {
        let input = |&(k, is_rate): &(usize, bool)| if is_rate { v[k] } else { q[k] };
        let value = |others: &[T]| self.expression.value(&Inputs { design: p, time: t, others });
        if self.inputs.len() > FEW {
            return value(&self.inputs.iter().map(input).collect::<Vec<T>>());
        }
        let mut few = [T::from(0.0); FEW];
        few.iter_mut().zip(&self.inputs).for_each(|(to, from)| *to = input(from));
        value(&few[..self.inputs.len()])
    }
}

/// The force or torque at `key` of a section.
pub fn read(section: &Section<'_>, key: &str, names: &Names, parts: &Parts) -> Read<Feedback> {
    let (observed, inputs) = (RefCell::<Vec<CoordinateRef>>::default(), RefCell::<Vec<(usize, bool)>>::default());
    let others = |text: &str| {
        let (place, is_rate) = find(text, parts)?;
        let k = position_or_push(&mut observed.borrow_mut(), place);
        Some(position_or_push(&mut inputs.borrow_mut(), (k, is_rate)))
    };
    let suggestions = || suggestions(parts);
    let scope = Scope { others: &others, suggestions: &suggestions, ..Scope::MOTION };
    let expression = section.expression(key, names, &scope)?;
    let used = expression.uses();
    let parameters = used.iter().map(|&i| CompiledExpression::variable(i)).collect();
    let law = ObservedFormula { expression: expression.with_design(&used), inputs: inputs.into_inner() };
    Ok(Feedback { law, observed: observed.into_inner(), parameters })
}

impl Feedback {
    /// The formula, its parameters, and the coordinates that it observes.
    pub fn build<S: Scalar>(&self, context: &BuildContext<S>, b: &[S]) -> (ObservedFormula, Vec<S>, Vec<Coordinate>) {
        let parameters = self.parameters.iter().map(|expression| expression.value(&Inputs::design(b))).collect();
        (self.law.clone(), parameters, self.observed.iter().map(|&place| context.coordinate(place)).collect())
    }
}

/// Names of velocities and of their coordinates.
const RATES: [(&str, &str); 3] = [("vx", "x"), ("vy", "y"), ("omega", "theta")];

/// The coordinate of a name such as `crank.theta` or `cart.position`, and whether the name is that of its velocity, such as
/// `crank.omega` or `cart.velocity`.
fn find(text: &str, parts: &Parts) -> Option<(CoordinateRef, bool)> {
    let (owner, what) = text.rsplit_once('.')?;
    if let Some(NamedPart::Slider(k)) = parts.get(owner) {
        return matches!(what, "position" | "velocity").then_some((CoordinateRef::Slider(*k), what == "velocity"));
    }
    match RATES.iter().find(|(rate, _)| *rate == what) {
        Some((_, position)) => Some((parts.find_coordinate(&format!("{owner}.{position}"))?, true)),
        None => Some((parts.find_coordinate(text)?, false)),
    }
}

fn suggestions(parts: &Parts) -> Vec<String> {
    let of = |name: &String| -> Vec<String> {
        let all = |known: &[&str]| known.iter().map(|what| format!("{name}.{what}")).collect();
        match parts.get(name) {
            Some(NamedPart::Slider(_)) => all(&["position", "velocity"]),
            Some(NamedPart::Frame(_)) => all(&["x", "y", "theta", "vx", "vy", "omega"]),
            _ => vec![],
        }
    };
    parts.order.iter().flat_map(of).collect()
}
