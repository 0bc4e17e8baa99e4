//! Forces and torques that depend on time and motion.

use super::parts::{BuildContext, CoordinateRef, Parts, Symbol};
use super::section::{Read, Section};
use crate::model_file::expression::{Inputs, Names, Program, Wants};
use autodiff::Scalar;
use mechanics::elements::StateFunction;
use mechanics::mechanism::Coordinate;
use std::cell::RefCell;

/// A force or torque with its parameters as programs of the design.
#[derive(Clone, Debug)]
pub struct Feedback {
    law: ObservedFormula,
    observed: Vec<CoordinateRef>,
    parameters: Vec<Program>,
}

/// A formula of its parameters, the time and the motion of the observed coordinates.
#[derive(Clone, Debug)]
pub struct ObservedFormula {
    program: Program,
    /// For each reading of the program, the number of its coordinate and whether it is the velocity.
    readings: Vec<(usize, bool)>,
}

/// Largest number of readings without an allocation at every evaluation.
const FEW: usize = 16;

impl StateFunction for ObservedFormula {
    fn generalized_force<T: Scalar>(&self, p: &[T], t: T, q: &[T], v: &[T]) -> T {
        let reading = |&(k, is_rate): &(usize, bool)| if is_rate { v[k] } else { q[k] };
        let value = |others: &[T]| self.program.value(&Inputs { design: p, time: t, others });
        if self.readings.len() > FEW {
            return value(&self.readings.iter().map(reading).collect::<Vec<T>>());
        }
        let mut few = [T::from(0.0); FEW];
        few.iter_mut().zip(&self.readings).for_each(|(to, from)| *to = reading(from));
        value(&few[..self.readings.len()])
    }
}

/// The force or torque at `key` of a section.
pub fn read(section: &Section<'_>, key: &str, names: &Names, parts: &Parts) -> Read<Feedback> {
    let (observed, readings) = (RefCell::<Vec<CoordinateRef>>::default(), RefCell::<Vec<(usize, bool)>>::default());
    let others = |text: &str| {
        let (place, is_rate) = find(text, parts)?;
        let k = position_or_push(&mut observed.borrow_mut(), place);
        Some(position_or_push(&mut readings.borrow_mut(), (k, is_rate)))
    };
    let suggestions = || suggestions(parts);
    let place = "an effort";
    let wants = Wants { place, others: &others, suggestions: &suggestions, ..Wants::MOTION };
    let program = section.program(key, names, &wants)?;
    let used = program.uses();
    let parameters = used.iter().map(|&i| Program::variable(i)).collect();
    let law = ObservedFormula { program: program.with_design(&used), readings: readings.into_inner() };
    Ok(Feedback { law, observed: observed.into_inner(), parameters })
}

impl Feedback {
    /// The formula, its parameters, and the coordinates that it observes.
    pub fn build<S: Scalar>(&self, world: &BuildContext<S>, b: &[S]) -> (ObservedFormula, Vec<S>, Vec<Coordinate>) {
        let parameters = self.parameters.iter().map(|program| program.value(&Inputs::design(b))).collect();
        (self.law.clone(), parameters, self.observed.iter().map(|&place| world.coordinate(place)).collect())
    }
}

fn position_or_push<T: PartialEq>(list: &mut Vec<T>, item: T) -> usize {
    list.iter().position(|known| *known == item).unwrap_or_else(|| {
        list.push(item);
        list.len() - 1
    })
}

/// Velocities and the coordinates of which they are the rates.
const RATES: [(&str, &str); 3] = [("vx", "x"), ("vy", "y"), ("omega", "theta")];

/// The coordinate of a name such as `crank.theta` or `cart.position`, or of its velocity: `crank.omega`, `cart.velocity`.
fn find(text: &str, parts: &Parts) -> Option<(CoordinateRef, bool)> {
    let (owner, what) = text.rsplit_once('.')?;
    if let Some(Symbol::Slide(k)) = parts.get(owner) {
        return matches!(what, "position" | "velocity").then_some((CoordinateRef::Slide(*k), what == "velocity"));
    }
    match RATES.iter().find(|(rate, _)| *rate == what) {
        Some((_, position)) => Some((parts.find_place(&format!("{owner}.{position}"))?, true)),
        None => Some((parts.find_place(text)?, false)),
    }
}

fn suggestions(parts: &Parts) -> Vec<String> {
    let of = |name: &String| -> Vec<String> {
        let all = |known: &[&str]| known.iter().map(|what| format!("{name}.{what}")).collect();
        match parts.get(name) {
            Some(Symbol::Slide(_)) => all(&["position", "velocity"]),
            Some(Symbol::Frame(_)) => all(&["x", "y", "theta", "vx", "vy", "omega"]),
            _ => vec![],
        }
    };
    parts.order.iter().flat_map(of).collect()
}
