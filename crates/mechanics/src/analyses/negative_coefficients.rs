//! Warnings about stiffnesses and dampings that are negative, at the start or during a motion.

use crate::elements::element::ElementWorkspace;
use crate::mechanism::element::{Input, Role};
use crate::mechanism::{ElementInstance, Mechanism};
use crate::system::state::{State, measure};
use error::Seconds;

/// Recorder of coefficients that change during a motion: inputs that are functions, with a measure of the same name.
pub(crate) struct CoefficientWatch {
    watched: Vec<VariableCoefficient>,
    workspace: ElementWorkspace<f64>,
    measures: Vec<f64>,
}

/// A coefficient that changes during a motion.
struct VariableCoefficient {
    element: usize,
    measure: usize,
    name: &'static str,
    unit: &'static str,
    /// The first recorded time in s at which it is negative, and its value there.
    negative_from: Option<[f64; 2]>,
}

/// Effect of a negative coefficient, if `name` is that of one.
fn effect_of(name: &str) -> Option<&'static str> {
    match name {
        "stiffness" => Some("pushes away from the unloaded position"),
        "damping" => Some("adds energy to the motion"),
        _ => None,
    }
}

impl CoefficientWatch {
    /// Recorder before the start of a motion.
    pub fn new(mechanism: &Mechanism<f64>) -> Self {
        let elements = mechanism.elements.iter().enumerate();
        let watched = elements.flat_map(|(element, instance)| variable_coefficients(element, instance)).collect();
        Self { watched, workspace: ElementWorkspace::default(), measures: Vec::new() }
    }

    /// Records the coefficients at `state`.
    pub fn add(&mut self, mechanism: &Mechanism<f64>, state: &State<f64>) {
        let Self { watched, workspace, measures } = self;
        for coefficient in watched.iter_mut().filter(|coefficient| coefficient.negative_from.is_none()) {
            let instance = &mechanism.elements[coefficient.element];
            measures.clear();
            measures.resize(instance.element.measures().len(), 0.0);
            measure(instance, state, workspace, measures);
            let value = measures[coefficient.measure];
            coefficient.negative_from = (value < 0.0).then_some([state.t, value]);
        }
    }

    /// Warnings about constant coefficients that are negative, and about those that were negative at a recorded time.
    pub fn warnings(&self, mechanism: &Mechanism<f64>) -> Vec<String> {
        let mut warnings: Vec<String> = mechanism.elements.iter().flat_map(negative_constants).collect();
        for coefficient in &self.watched {
            let VariableCoefficient { element, name, unit, .. } = *coefficient;
            if let (Some([t, value]), Some(effect)) = (coefficient.negative_from, effect_of(name)) {
                let part = &mechanism.elements[element].name;
                let value = rounded(value);
                warnings.push(format!(
                    "{part}: its {name} of {value} {unit} at t = {t} {effect}; keep it positive unless this is meant",
                    t = Seconds(t)
                ));
            }
        }
        warnings
    }
}

/// A value to six digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// The coefficients of an element that are functions.
fn variable_coefficients(element: usize, instance: &ElementInstance<f64>) -> Vec<VariableCoefficient> {
    let inputs = instance.element.descriptor().map_or(&[][..], |descriptor| descriptor.inputs);
    let is_function = |role: &Role| matches!(role, Role::TimeFunction | Role::StateFunction);
    let functions = inputs.iter().filter(|input| is_function(&input.role) && effect_of(input.name).is_some());
    let coefficient = |name: &'static str| {
        let measures = instance.element.measures();
        let measure = measures.iter().position(|measure| measure.name == name)?;
        Some(VariableCoefficient { element, measure, name, unit: measures[measure].unit, negative_from: None })
    };
    functions.filter_map(|input| coefficient(input.name)).collect()
}

/// Warnings about the constant coefficients of an element that are negative.
fn negative_constants(instance: &ElementInstance<f64>) -> Vec<String> {
    let warning = |(input, value): (&Input, f64)| {
        let effect = effect_of(input.name).filter(|_| value < 0.0)?;
        let (part, name, unit) = (&instance.name, input.name, input.unit);
        Some(format!("{part}: its {name} of {value} {unit} {effect}; make it positive unless this is meant"))
    };
    instance.values().into_iter().filter_map(warning).collect()
}
