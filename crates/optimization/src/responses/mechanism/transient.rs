//! The outputs of a moving mechanism as responses of an optimization problem.

use super::WithWantedOutputs;
use crate::problem::{Analysis, GradientMethod, ResponseAt, ResponseSum, Responses};
use crate::{Error, Result};
use mechanics::analyses::dynamics::{
    Dynamics, GivenStep, History, StepSize, implicit_steps, replayed_steps, simulate_by_given_steps,
    simulate_explicitly, simulate_recorded, simulate_with_recording,
};
use mechanics::analyses::indeterminate_outputs::warn_of_indeterminate_outputs;
use mechanics::analyses::step_comparison::{explicit_step_warning, step_warning};
use mechanics::checkpointing::ExplicitRecording;
use mechanics::checkpointing::recording::Recording;
use mechanics::derivatives::adjoint::{
    AdjointFunctional, Weighted, differentiate_backwards_within, differentiate_explicit_recording_backwards,
    differentiate_explicitly_backwards_within, differentiate_recording_backwards,
};
use mechanics::derivatives::forward::dynamics::{differentiate, differentiate_recorded};
use mechanics::derivatives::forward::explicit::differentiate_explicitly;
use mechanics::derivatives::history::OutputGradients;
use mechanics::derivatives::method::{Cost, Differentiation};
use mechanics::derivatives::second_order::{
    HessianPart, differentiate_explicitly_twice, differentiate_recorded_twice, differentiate_twice,
};
use mechanics::derivatives::semi_analytical::{self, differentiate_semi_analytically};
use mechanics::integrators::explicit::{Coordinates, Explicit, StepControl};
use mechanics::mechanism::ParametricMechanism;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::sync::Arc;

/// Time integration of a motion, with its settings.
#[derive(Clone, Debug, PartialEq)]
pub enum Integration {
    /// Implicit steps: stiff and flexible mechanisms.
    Implicit(Dynamics),
    /// Explicit steps: smooth motions of rigid bodies at high accuracy.
    Explicit(Explicit),
}

impl From<Dynamics> for Integration {
    fn from(settings: Dynamics) -> Self {
        Self::Implicit(settings)
    }
}

impl From<Explicit> for Integration {
    fn from(settings: Explicit) -> Self {
        Self::Explicit(settings)
    }
}

/// The outputs of a mechanism over one time grid, as responses of an optimization problem.
///
/// Response h is the mechanism's output h, time-dependent, on the grid `times`. An analysis stores its steps in
/// [`Responses::trace`], and sensitivities at the same design reuse them without another iteration. Without them, as after a
/// restart, the motion is integrated again. Differentiation stops at the last wanted time.
pub struct Transient<M> {
    model: M,
    settings: Integration,
    times: Vec<f64>,
    /// For each output, true if it is one number, its value at the last time.
    numbers: Vec<bool>,
    memory: usize,
    differentiation: Differentiation,
    perturbation: f64,
}

/// The steps of an analysis.
struct StoredSteps {
    design: Vec<f64>,
    /// None for a mechanism with events.
    steps: Option<Steps>,
}

enum Steps {
    Implicit(Recording),
    Explicit(ExplicitRecording),
}

impl Steps {
    /// Returns whether the steps are implicit and all of them are stored.
    fn are_complete(&self) -> bool {
        matches!(self, Self::Implicit(recording) if recording.is_complete())
    }
}

impl<M: ParametricMechanism> Transient<M> {
    /// Responses from the outputs of `model` at `times` (s, increasing).
    ///
    /// # Errors
    ///
    /// [`crate::Error::Option`] or [`crate::Error::Definition`] if a setting or the times are impossible.
    pub fn new(model: M, settings: impl Into<Integration>, times: &[f64]) -> Result<Self> {
        let mut settings = settings.into();
        match &mut settings {
            Integration::Implicit(settings) => settings.check(times)?,
            Integration::Explicit(settings) => {
                settings.check(times)?;
                // Derivatives at some of the times are those of the steps of the whole motion.
                *settings = settings.clone().with_end(settings.end_after(times)).with_inspected_times(times);
            }
        }
        Ok(Self {
            model,
            settings,
            times: times.to_vec(),
            numbers: Vec::new(),
            memory: 1 << 28,
            differentiation: Differentiation::Automatic,
            perturbation: semi_analytical::STEP,
        })
    }

    /// Limits the memory for the steps of an analysis to `bytes` (by default a quarter of a gigabyte).
    ///
    /// If the steps do not fit, checkpoints are stored and sensitivities integrate the motion again, block by block for the
    /// adjoint method.
    pub fn with_memory(self, bytes: usize) -> Self {
        Self { memory: bytes, ..self }
    }

    /// Makes the outputs for which `numbers` is true numbers: their values at the last time, such as the value at an event
    /// from which on they are held.
    pub fn with_numbers(self, numbers: Vec<bool>) -> Self {
        Self { numbers, ..self }
    }

    /// Returns whether output `h` is one number.
    fn is_number(&self, h: usize) -> bool {
        self.numbers.get(h).copied().unwrap_or(false)
    }

    /// The response at its time point: numbers are at the last one.
    fn in_history(&self, at: &ResponseAt) -> ResponseAt {
        if self.is_number(at.response) { ResponseAt { point: self.times.len() - 1, ..*at } } else { *at }
    }

    /// Replaces the method of differentiation.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] for semi-analytical derivatives of explicit steps.
    pub fn differentiating(self, differentiation: Differentiation) -> Result<Self> {
        if differentiation == Differentiation::SemiAnalytical && matches!(self.settings, Integration::Explicit(_)) {
            return Err(no_semi_analytical_derivatives());
        }
        Ok(Self { differentiation, ..self })
    }

    /// Replaces the relative step of the residual's differences for semi-analytical derivatives, by default
    /// [`semi_analytical::STEP`].
    ///
    /// # Errors
    ///
    /// [`Error::Option`] unless it is between 0 and 1.
    pub fn with_perturbation(self, step: f64) -> Result<Self> {
        semi_analytical::check_step(step)?;
        Ok(Self { perturbation: step, ..self })
    }

    /// The method for derivatives of the `wanted` responses by this many design variables.
    pub fn differentiation_for(&self, variables: usize, wanted: &[ResponseAt]) -> Differentiation {
        self.differentiation_of(variables, wanted.len())
    }

    fn differentiation_of(&self, variables: usize, count: usize) -> Differentiation {
        let cost = match self.settings {
            Integration::Implicit(_) => Cost::IMPLICIT,
            Integration::Explicit(_) => Cost::EXPLICIT,
        };
        self.differentiation.of(variables, count, cost)
    }

    /// The model.
    pub fn model(&self) -> &M {
        &self.model
    }

    /// The analysis' settings.
    pub fn settings(&self) -> &Integration {
        &self.settings
    }
}

impl<M: ParametricMechanism> Transient<M> {
    /// The method for the derivatives of this many responses or sums of responses. The automatic choice excludes the adjoint
    /// method for mechanisms with events.
    fn chosen(&self, b: &[f64], count: usize) -> Result<Differentiation> {
        let chosen = self.differentiation_of(b.len(), count);
        let is_free = self.differentiation == Differentiation::Automatic && chosen == Differentiation::Adjoint;
        Ok(if is_free && self.model.build(b)?.has_events() { Differentiation::Direct } else { chosen })
    }

    fn sensitivities_by(
        &self,
        method: Differentiation,
        perturbation: f64,
        (b, stored): (&[f64], &Responses),
        wanted: &[ResponseAt],
    ) -> Result<DMatrix<f64>> {
        let wanted: &[ResponseAt] = &wanted.iter().map(|at| self.in_history(at)).collect::<Vec<_>>();
        let (points, places) = points_of(wanted);
        let times: Vec<f64> = points.iter().map(|&p| self.times[p]).collect();
        match method {
            Differentiation::Adjoint => {
                let all: Vec<_> =
                    wanted.iter().zip(places).map(|(i, at)| AdjointFunctional::at(i.response, at)).collect();
                self.backwards(b, &times, stored, &all)
            }
            Differentiation::SemiAnalytical => {
                self.semi_analytically(perturbation, (b, stored), &times, wanted, &places)
            }
            Differentiation::Direct | Differentiation::Automatic => self.directly((b, stored), &times, wanted, &places),
        }
    }

    fn sum_sensitivities_by(
        &self,
        method: Differentiation,
        perturbation: f64,
        (b, stored): (&[f64], &Responses),
        sums: &[ResponseSum],
    ) -> Result<DMatrix<f64>> {
        let at = ResponseSum::responses_in(sums);
        if method != Differentiation::Adjoint {
            return Ok(ResponseSum::add_rows(
                sums,
                &at,
                &self.sensitivities_by(method, perturbation, (b, stored), &at)?,
            ));
        }
        let at: Vec<_> = at.iter().map(|at| self.in_history(at)).collect();
        let (points, _) = points_of(&at);
        let times: Vec<f64> = points.iter().map(|&p| self.times[p]).collect();
        let term = |&(at, weight): &(ResponseAt, f64)| {
            let at = self.in_history(&at);
            let point = points.binary_search(&at.point).expect("every point of the sums is among them");
            Weighted { output: at.response, point, weight }
        };
        let functional = |sum: &ResponseSum| AdjointFunctional { terms: sum.terms.iter().map(term).collect() };
        let all: Vec<_> = sums.iter().map(functional).collect();
        self.backwards(b, &times, stored, &all)
    }

    fn directly(
        &self,
        (b, stored): (&[f64], &Responses),
        times: &[f64],
        wanted: &[ResponseAt],
        places: &[usize],
    ) -> Result<DMatrix<f64>> {
        let model = &WithWantedOutputs::new(&self.model, wanted.iter().map(|at| at.response));
        let history = match (&self.settings, steps(stored, b)) {
            (Integration::Implicit(settings), Some(Steps::Implicit(recording))) if recording.is_complete() => {
                let gradients = differentiate_recorded(model, b, settings, times, recording)?;
                return Ok(recorded_rows(&gradients, b.len(), wanted, places));
            }
            (Integration::Implicit(settings), _) => differentiate(model, b, settings, times)?,
            (Integration::Explicit(settings), _) => differentiate_explicitly(model, b, settings, times)?,
        };
        Ok(super::gradient_rows(&history, b.len(), wanted, places))
    }

    fn semi_analytically(
        &self,
        step: f64,
        (b, stored): (&[f64], &Responses),
        times: &[f64],
        wanted: &[ResponseAt],
        places: &[usize],
    ) -> Result<DMatrix<f64>> {
        let Integration::Implicit(settings) = &self.settings else { return Err(no_semi_analytical_derivatives()) };
        let model = &WithWantedOutputs::new(&self.model, wanted.iter().map(|at| at.response));
        let Some(Steps::Implicit(recording)) = steps(stored, b).filter(|steps| steps.are_complete()) else {
            let history = differentiate_semi_analytically(model, b, settings, times, step)?;
            return Ok(super::gradient_rows(&history, b.len(), wanted, places));
        };
        let gradients = semi_analytical::differentiate_recorded(model, b, settings, times, recording, step)?;
        Ok(recorded_rows(&gradients, b.len(), wanted, places))
    }

    /// The warning about fixed steps that are too long: it costs half an analysis.
    fn step_warning(&self, b: &[f64], responses: &Responses) -> Result<Option<String>> {
        let mechanism = self.model.build(b)?;
        let series = |(h, values): (usize, &Vec<f64>)| match values.first() {
            Some(&number) if self.is_number(h) => vec![number; self.times.len()],
            _ => values.clone(),
        };
        let values: Vec<Vec<f64>> = responses.values.iter().enumerate().map(series).collect();
        match &self.settings {
            Integration::Implicit(settings) => step_warning(&mechanism, settings, &self.times, &values),
            Integration::Explicit(settings) => explicit_step_warning(&mechanism, settings, &self.times, &values),
        }
    }

    /// Derivatives by the adjoint method from the stored steps, or from a new analysis.
    fn backwards(
        &self,
        b: &[f64],
        times: &[f64],
        stored: &Responses,
        wanted: &[AdjointFunctional],
    ) -> Result<DMatrix<f64>> {
        let outputs = wanted.iter().flat_map(|functional| &functional.terms).map(|term| term.output);
        let model = &WithWantedOutputs::new(&self.model, outputs);
        let (rows, _) = match (&self.settings, steps(stored, b)) {
            (Integration::Implicit(settings), Some(Steps::Implicit(steps))) => {
                differentiate_recording_backwards(model, b, settings, times, wanted, steps)?
            }
            (Integration::Implicit(settings), _) => {
                differentiate_backwards_within(self.memory, model, b, settings, times, wanted)?
            }
            (Integration::Explicit(settings), Some(Steps::Explicit(steps))) => {
                differentiate_explicit_recording_backwards(model, b, settings, times, wanted, steps)?
            }
            (Integration::Explicit(settings), _) => {
                differentiate_explicitly_backwards_within(self.memory, model, b, settings, times, wanted)?
            }
        };
        Ok(rows)
    }
}

/// Adaptive steps of a motion, for motions of other designs.
enum FrozenSteps {
    /// Settings, and steps.
    Implicit(Dynamics, Vec<GivenStep>),
    /// Settings with these steps.
    Explicit(Explicit),
}

impl<M: ParametricMechanism> Transient<M> {
    /// The responses of a motion, without a trace. Numbers have their last value only.
    fn responses(&self, history: History) -> Responses {
        let mut values = history.values;
        for (h, series) in values.iter_mut().enumerate().filter(|(h, _)| self.is_number(*h)) {
            series.drain(..self.times.len() - 1);
            debug_assert_eq!(series.len(), 1, "output {h} is a number");
        }
        Responses { values, warnings: history.warnings, notes: notes(history.coordinates), trace: None }
    }

    /// Adaptive steps at the design `b`, which derivatives do not vary.
    ///
    /// `None` for fixed steps, and for explicit steps that end at events: then the motion determines their lengths.
    fn adaptive_steps(&self, b: &[f64]) -> Option<FrozenSteps> {
        let mechanism = self.model.build(b).ok()?;
        match &self.settings {
            Integration::Implicit(settings) => {
                let is_adaptive = matches!(settings.step, StepSize::Adaptive { .. });
                let steps = is_adaptive.then(|| implicit_steps(&mechanism, settings, &self.times))?;
                Some(FrozenSteps::Implicit(*settings, steps.ok()?))
            }
            Integration::Explicit(settings) => {
                let is_adaptive =
                    matches!(settings.step_control, StepControl::Adaptive { .. }) && !mechanism.has_events();
                let steps = is_adaptive.then(|| replayed_steps(&mechanism, settings, &self.times))?;
                Some(FrozenSteps::Explicit(settings.clone().with_step_control(StepControl::Taken(steps.ok()?))))
            }
        }
    }
}

impl<M: ParametricMechanism> Analysis for Transient<M> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let mechanism = self.model.build(b)?;
        let (history, steps) = match &self.settings {
            Integration::Implicit(settings) => {
                let (history, steps) = simulate_recorded(&mechanism, settings, &self.times, self.memory)?;
                (history, Some(Steps::Implicit(steps)))
            }
            Integration::Explicit(settings) => {
                let (history, steps) = simulate_with_recording(&mechanism, settings, &self.times, self.memory)?;
                (history, Some(Steps::Explicit(steps)))
            }
        };
        let trace = StoredSteps { design: b.to_vec(), steps };
        Ok(Responses { trace: Some(Arc::new(trace)), ..self.responses(history) })
    }

    fn analyze_around(&self, b: &[f64], designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
        let Some(steps) = self.adaptive_steps(b) else { return self.analyze_many(designs) };
        let one = |design: &Vec<f64>| {
            let mechanism = self.model.build(design)?;
            let history = match &steps {
                FrozenSteps::Implicit(settings, steps) => {
                    simulate_by_given_steps(&mechanism, settings, steps, &self.times)?
                }
                FrozenSteps::Explicit(settings) => simulate_explicitly(&mechanism, settings, &self.times)?,
            };
            Ok(self.responses(history))
        };
        designs.par_iter().map(one).collect()
    }

    fn step_tolerance(&self, b: &[f64]) -> f64 {
        let tolerance = match &self.settings {
            Integration::Implicit(_) => 0.0,
            Integration::Explicit(settings) => match &settings.step_control {
                StepControl::Adaptive { tolerance, .. } => {
                    tolerance.relative.iter().chain(&tolerance.absolute).fold(0.0, |most: f64, x| most.max(*x))
                }
                _ => 0.0,
            },
        };
        let is_repeated = || self.model.build(b).is_ok_and(|mechanism| !mechanism.has_events());
        if tolerance == 0.0 || is_repeated() { 0.0 } else { tolerance }
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        self.sensitivities_by(self.chosen(b, wanted.len())?, self.perturbation, (b, responses), wanted)
    }

    fn sum_sensitivities(&self, b: &[f64], responses: &Responses, sums: &[ResponseSum]) -> Result<DMatrix<f64>> {
        self.sum_sensitivities_by(self.chosen(b, sums.len())?, self.perturbation, (b, responses), sums)
    }

    fn warnings(&self, b: &[f64], responses: &Responses) -> Vec<String> {
        let mut warnings = responses.warnings.clone();
        // A design that cannot be built or simulated has no responses.
        warnings.extend(self.step_warning(b, responses).unwrap_or_default());
        let (assembly, start) = match &self.settings {
            Integration::Implicit(settings) => (settings.assembly, settings.start),
            Integration::Explicit(settings) => (settings.assembly, settings.start),
        };
        let built = self.model.build(b);
        warnings.extend(built.and_then(|m| warn_of_indeterminate_outputs(&m, assembly, start)).unwrap_or_default());
        warnings
    }

    fn differentiation(&self, variables: usize, wanted: &[ResponseAt]) -> Option<&'static str> {
        Some(self.differentiation_for(variables, wanted).name())
    }

    fn gradient_methods(&self) -> Vec<GradientMethod<'_>> {
        let by = |method, step| {
            move |b: &[f64], stored: &Responses, wanted: &[ResponseAt]| {
                self.sensitivities_by(method, step, (b, stored), wanted)
            }
        };
        let exact = |name, method| GradientMethod::exact(name, by(method, self.perturbation));
        let sums = |b: &[f64], stored: &Responses, sums: &[ResponseSum]| {
            self.sum_sensitivities_by(Differentiation::Adjoint, self.perturbation, (b, stored), sums)
        };
        let adjoint = exact("adjoint", Differentiation::Adjoint).with_sums(sums);
        let mut all = vec![exact("direct", Differentiation::Direct), adjoint];
        if matches!(self.settings, Integration::Implicit(_)) {
            let semi = move |step: f64, b: &[f64], stored: &Responses, wanted: &[ResponseAt]| {
                self.sensitivities_by(Differentiation::SemiAnalytical, step, (b, stored), wanted)
            };
            all.push(GradientMethod::approximate("semi-analytical", self.perturbation, semi));
        }
        all
    }

    fn curvatures(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<Option<Vec<DMatrix<f64>>>> {
        let wanted: &[ResponseAt] = &wanted.iter().map(|at| self.in_history(at)).collect::<Vec<_>>();
        let (points, at) = points_of(wanted);
        let times: Vec<f64> = points.iter().map(|&p| self.times[p]).collect();
        let model = &WithWantedOutputs::new(&self.model, wanted.iter().map(|at| at.response));
        let part = HessianPart::Full;
        let history = match (&self.settings, steps(responses, b)) {
            (Integration::Implicit(settings), Some(Steps::Implicit(steps))) if steps.is_complete() => {
                differentiate_recorded_twice(model, b, settings, &times, part, steps)?
            }
            (Integration::Implicit(settings), _) => differentiate_twice(model, b, settings, &times, part)?,
            (Integration::Explicit(settings), _) => differentiate_explicitly_twice(model, b, settings, &times, part)?,
        };
        Ok(wanted.iter().zip(at).map(|(wanted, at)| history.hessian(wanted.response, at)).collect())
    }
}

/// The note about the unknowns if the analysis has chosen them.
fn notes(coordinates: Coordinates) -> Vec<String> {
    let note = "relative coordinates: the unknowns of the steps are joint angles and displacements";
    if coordinates == Coordinates::Relative { vec![note.to_owned()] } else { Vec::new() }
}

/// The error of semi-analytical derivatives of explicit steps.
fn no_semi_analytical_derivatives() -> Error {
    let why = "explicit steps have no semi-analytical derivatives";
    Error::unsupported("differentiation", why, "use another method, or implicit steps")
}

/// Gradients of the wanted responses, one in each row; `places` are the indices of their times in `gradients`.
fn recorded_rows(
    gradients: &OutputGradients,
    variables: usize,
    wanted: &[ResponseAt],
    places: &[usize],
) -> DMatrix<f64> {
    let derivative = |row: usize, i: usize| gradients.at(places[row], wanted[row].response, i);
    DMatrix::from_fn(wanted.len(), variables, derivative)
}

/// The wanted time points, in order, and for each wanted response the index of its own among them.
fn points_of(wanted: &[ResponseAt]) -> (Vec<usize>, Vec<usize>) {
    let mut points: Vec<usize> = wanted.iter().map(|at| at.point).collect();
    points.sort_unstable();
    points.dedup();
    let place = |at: &ResponseAt| points.binary_search(&at.point).expect("every wanted point is among them");
    let places = wanted.iter().map(place).collect();
    (points, places)
}

/// The stored steps of the analysis of `b`, if there are any.
fn steps<'r>(responses: &'r Responses, b: &[f64]) -> Option<&'r Steps> {
    let stored = responses.trace.as_ref()?.downcast_ref::<StoredSteps>().filter(|stored| stored.design == b)?;
    stored.steps.as_ref()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::FourBar;

    #[test]
    fn derivatives_come_in_the_order_asked() {
        let model = FourBar::as_published();
        let analysis = Transient::new(model, model.dynamics().unwrap(), &FourBar::window()).unwrap();
        let b = [0.0385, 0.0252, 0.02];
        let responses = analysis.analyze(&b).unwrap();
        let wanted = [(2, 17), (20, 3), (2, 16)].map(|(response, point)| ResponseAt { response, point });
        let rows = analysis.sensitivities(&b, &responses, &wanted).unwrap();
        let all = differentiate(&model, &b, &model.dynamics().unwrap(), &FourBar::window()).unwrap();
        for (k, at) in wanted.iter().enumerate() {
            assert_eq!(rows.row(k).iter().copied().collect::<Vec<_>>(), all.gradients[at.response][at.point]);
        }
        // Integrated again, the same bits: without a trace, with too little memory, or at another design.
        let wanted_anew = |responses: &Responses| analysis.sensitivities(&b, responses, &wanted).unwrap();
        assert_eq!(rows, wanted_anew(&Responses::new(responses.values.clone())));
        assert_eq!(rows, wanted_anew(&analysis.analyze(&[0.04, 0.0252, 0.02]).unwrap()));
        // Backward the same up to rounding.
        let analysis = Transient::new(model, model.dynamics().unwrap(), &FourBar::window()).unwrap();
        let backward = analysis.differentiating(Differentiation::Adjoint).unwrap();
        let difference = backward.sensitivities(&b, &responses, &wanted).unwrap() - &rows;
        assert!(difference.amax() < 1e-10 * rows.amax());
        let forgetful = Transient::new(model, model.dynamics().unwrap(), &FourBar::window()).unwrap().with_memory(1000);
        assert_eq!(rows, wanted_anew(&forgetful.analyze(&b).unwrap()));
        // From checkpoints the same bits as from all steps.
        let settings = model.dynamics().unwrap();
        let short = Transient::new(model, settings, &FourBar::window()).unwrap().with_memory(1 << 18);
        let short = short.differentiating(Differentiation::Adjoint).unwrap();
        let again = short.sensitivities(&b, &short.analyze(&b).unwrap(), &wanted).unwrap();
        assert_eq!(again, backward.sensitivities(&b, &responses, &wanted).unwrap());
    }
}
