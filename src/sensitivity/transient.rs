//! The seam to the optimization wing: a mechanism's outputs as responses.

use super::adjoint::{Functional, differentiate_backwards, differentiate_recording_backwards};
use super::differentiation::Differentiation;
use super::direct::{differentiate, differentiate_recorded};
use super::explicit::{differentiate_explicitly, simulate_explicitly};
use super::semi_analytical::{self, differentiate_semi_analytically};
use crate::analysis::{Dynamics, Explicit, Recording, simulate_recorded};
use crate::multibody::Model;
use crate::problem::{Alternative, Analysis, Instant, Responses};
use crate::{Error, Result};
use nalgebra::DMatrix;
use std::sync::Arc;

/// How a motion is integrated.
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
/// Response h is the mechanism's output h, time-dependent, on the grid `times`. Nothing is differentiated beyond the last
/// wanted time. An analysis by implicit steps leaves them in [`Responses::trace`], and
/// sensitivities at the same design are had from there without another iteration; without them, as after a restart, the
/// motion is integrated again.
pub struct Transient<M> {
    model: M,
    settings: Integration,
    times: Vec<f64>,
    memory: usize,
    differentiation: Differentiation,
    perturbation: f64,
}

/// What an analysis leaves behind.
struct Trace {
    design: Vec<f64>,
    recording: Recording,
}

impl<M: Model> Transient<M> {
    /// For the outputs of `model` at `times` (s, increasing).
    ///
    /// **Errors.** [`crate::Error::Option`] or [`crate::Error::Definition`] if a setting or the times are impossible.
    pub fn new(model: M, settings: impl Into<Integration>, times: &[f64]) -> Result<Self> {
        let settings = settings.into();
        match &settings {
            Integration::Implicit(settings) => settings.check(times)?,
            Integration::Explicit(settings) => settings.check(times)?,
        }
        Ok(Self {
            model,
            settings,
            times: times.to_vec(),
            memory: 1 << 28,
            differentiation: Differentiation::Automatic,
            perturbation: semi_analytical::STEP,
        })
    }

    /// With at most `bytes` of memory for the steps of an analysis (a quarter of a gigabyte unless told). A longer
    /// motion is integrated again when sensitivities are asked for.
    pub fn with_memory(self, bytes: usize) -> Self {
        Self { memory: bytes, ..self }
    }

    /// With derivatives by this method.
    ///
    /// **Errors.** [`Error::Definition`] for adjoint and semi-analytical derivatives of explicit steps.
    pub fn differentiating(self, differentiation: Differentiation) -> Result<Self> {
        use Differentiation::{Adjoint, SemiAnalytical};
        if matches!(differentiation, Adjoint | SemiAnalytical) && matches!(self.settings, Integration::Explicit(_)) {
            let why = "explicit steps are differentiated by the direct method only";
            return Err(Error::definition("differentiation", why, "take the direct method, or implicit steps"));
        }
        Ok(Self { differentiation, ..self })
    }

    /// With this relative step of the residual's differences for semi-analytical derivatives, in place of
    /// [`semi_analytical::STEP`].
    ///
    /// **Errors.** [`Error::Option`] unless it is between 0 and 1.
    pub fn with_perturbation(self, step: f64) -> Result<Self> {
        semi_analytical::check_step(step)?;
        Ok(Self { perturbation: step, ..self })
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

impl<M: Model> Analysis for Transient<M> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let mechanism = self.model.build(b)?;
        match &self.settings {
            Integration::Implicit(settings) => {
                let (history, recording) = simulate_recorded(&mechanism, settings, &self.times, self.memory)?;
                let trace = Trace { design: b.to_vec(), recording };
                Ok(Responses { values: history.values, trace: Some(Arc::new(trace)) })
            }
            Integration::Explicit(settings) => {
                Ok(Responses::new(simulate_explicitly(&mechanism, settings, &self.times)?.values))
            }
        }
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[Instant]) -> Result<DMatrix<f64>> {
        self.sensitivities_by(self.differentiation, self.perturbation, b, responses, wanted)
    }

    fn alternatives(&self) -> Vec<Alternative<'_>> {
        let by = |method, step| {
            move |b: &[f64], r: &Responses, wanted: &[Instant]| self.sensitivities_by(method, step, b, r, wanted)
        };
        let direct = Alternative::exact("direct", by(Differentiation::Direct, self.perturbation));
        if matches!(self.settings, Integration::Explicit(_)) {
            return vec![direct];
        }
        let adjoint = Alternative::exact("adjoint", by(Differentiation::Adjoint, self.perturbation));
        let semi = move |step: f64, b: &[f64], r: &Responses, wanted: &[Instant]| {
            self.sensitivities_by(Differentiation::SemiAnalytical, step, b, r, wanted)
        };
        vec![direct, adjoint, Alternative::approximate("semi-analytical", self.perturbation, semi)]
    }
}

impl<M: Model> Transient<M> {
    fn sensitivities_by(
        &self,
        differentiation: Differentiation,
        perturbation: f64,
        b: &[f64],
        responses: &Responses,
        wanted: &[Instant],
    ) -> Result<DMatrix<f64>> {
        let mut points: Vec<usize> = wanted.iter().map(|instant| instant.point).collect();
        points.sort_unstable();
        points.dedup();
        let times: Vec<f64> = points.iter().map(|&p| self.times[p]).collect();
        let at = |instant: &Instant| points.binary_search(&instant.point).expect("every wanted point is among them");
        let settings = match &self.settings {
            Integration::Implicit(settings) => settings,
            Integration::Explicit(settings) => {
                return Ok(differentiate_explicitly(&self.model, b, settings, &times)?.rows(b.len(), wanted, at));
            }
        };
        let task = Task { model: &self.model, b, settings, times: &times, steps: recording(responses, b) };
        match differentiation.of(b.len(), wanted.len()) {
            Differentiation::Adjoint => task.adjoint(wanted, at),
            Differentiation::SemiAnalytical => task.semi_analytical(perturbation, wanted, at),
            Differentiation::Direct | Differentiation::Automatic => task.direct(wanted, at),
        }
    }
}

/// Derivatives of one motion by implicit steps at some times, from its recorded steps if there are any.
struct Task<'t, M> {
    model: &'t M,
    b: &'t [f64],
    settings: &'t Dynamics,
    times: &'t [f64],
    steps: Option<&'t Recording>,
}

impl<M: Model> Task<'_, M> {
    fn direct(&self, wanted: &[Instant], at: impl Fn(&Instant) -> usize) -> Result<DMatrix<f64>> {
        let Self { model, b, settings, times, steps } = *self;
        let Some(steps) = steps else { return Ok(differentiate(model, b, settings, times)?.rows(b.len(), wanted, at)) };
        let slopes = differentiate_recorded(model, b, settings, times, steps)?;
        let slope = |row: usize, i: usize| slopes.at(at(&wanted[row]), wanted[row].response, i);
        Ok(DMatrix::from_fn(wanted.len(), b.len(), slope))
    }

    fn adjoint(&self, wanted: &[Instant], at: impl Fn(&Instant) -> usize) -> Result<DMatrix<f64>> {
        let Self { model, b, settings, times, steps } = *self;
        let all: Vec<_> = wanted.iter().map(|i| Functional::at(i.response, at(i))).collect();
        match steps {
            Some(steps) => differentiate_recording_backwards(model, b, settings, times, &all, steps),
            None => differentiate_backwards(model, b, settings, times, &all),
        }
    }

    fn semi_analytical(&self, step: f64, wanted: &[Instant], at: impl Fn(&Instant) -> usize) -> Result<DMatrix<f64>> {
        let Self { model, b, settings, times, steps } = *self;
        let Some(steps) = steps else {
            let history = differentiate_semi_analytically(model, b, settings, times, step)?;
            return Ok(history.rows(b.len(), wanted, at));
        };
        let slopes = semi_analytical::differentiate_recorded(model, b, settings, times, steps, step)?;
        let slope = |row: usize, i: usize| slopes.at(at(&wanted[row]), wanted[row].response, i);
        Ok(DMatrix::from_fn(wanted.len(), b.len(), slope))
    }
}

/// The steps that the analysis of `b` left behind, if it did.
fn recording<'r>(responses: &'r Responses, b: &[f64]) -> Option<&'r Recording> {
    let trace = responses.trace.as_ref()?.downcast_ref::<Trace>()?;
    (trace.design == b && trace.recording.is_whole()).then_some(&trace.recording)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multibody::mechanisms::FourBar;

    #[test]
    fn wanted_instants_come_in_the_order_asked() {
        let model = FourBar::as_published();
        let analysis = Transient::new(model, model.dynamics().unwrap(), &FourBar::window()).unwrap();
        let b = [0.0385, 0.0252, 0.02];
        let responses = analysis.analyze(&b).unwrap();
        let wanted = [(2, 17), (20, 3), (2, 16)].map(|(response, point)| Instant { response, point });
        let rows = analysis.sensitivities(&b, &responses, &wanted).unwrap();
        let all = differentiate(&model, &b, &model.dynamics().unwrap(), &FourBar::window()).unwrap();
        for (k, instant) in wanted.iter().enumerate() {
            assert_eq!(rows.row(k).iter().copied().collect::<Vec<_>>(), all.slopes[instant.response][instant.point]);
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
        // Semi-analytical up to curvature, and the same from recorded steps.
        let analysis = Transient::new(model, model.dynamics().unwrap(), &FourBar::window()).unwrap();
        let semi = analysis.differentiating(Differentiation::SemiAnalytical).unwrap().with_perturbation(1e-6).unwrap();
        let found = semi.sensitivities(&b, &responses, &wanted).unwrap();
        assert!((&found - &rows).amax() < 1e-5 * rows.amax());
        let recorded = semi.sensitivities(&b, &semi.analyze(&b).unwrap(), &wanted).unwrap();
        assert_eq!(recorded, semi.sensitivities(&b, &Responses::new(responses.values.clone()), &wanted).unwrap());
        let forgetful = Transient::new(model, model.dynamics().unwrap(), &FourBar::window()).unwrap().with_memory(1000);
        assert_eq!(rows, wanted_anew(&forgetful.analyze(&b).unwrap()));
    }
}
