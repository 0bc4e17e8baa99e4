//! The outputs of a mechanism at time points that are solved one by one, without integration, as responses of a problem.

use super::WithWantedOutputs;
use crate::Result;
use crate::problem::{Analysis, GradientMethod, ResponseAt, Responses, TimeGrid};
use error::replace_times;
use mechanics::analyses::dynamics::check_times;
use mechanics::analyses::equilibrium_jumps::warn_of_equilibrium_jumps;
use mechanics::analyses::indeterminate_outputs::warn_of_indeterminate_outputs;
use mechanics::analyses::kinematics::{kinematics, warn_of_motion};
use mechanics::analyses::statics::{Statics, equilibria, warn_of_equilibria};
use mechanics::derivatives::adjoint::{
    AdjointFunctional, differentiate_equilibria_backwards, differentiate_kinematics_backwards,
};
use mechanics::derivatives::forward::instants::{differentiate_equilibria, differentiate_kinematics};
use mechanics::derivatives::history::SensitiveHistory;
use mechanics::derivatives::method::{Cost, Differentiation};
use mechanics::derivatives::second_order::{
    HessianHistory, HessianPart, differentiate_equilibria_twice, differentiate_kinematics_twice,
};
use mechanics::derivatives::semi_analytical::{self, difference_equilibria, difference_kinematics};
use mechanics::initial_conditions::Assembly;
use mechanics::mechanism::{Mechanism, ParametricMechanism};
use nalgebra::DMatrix;

/// The outputs of a mechanism in static equilibrium at given times: a load path where loads are functions of time.
pub type StaticResponses<M> = QuasiStaticResponses<M, Statics>;

/// The outputs of a mechanism whose every degree of freedom is driven, at given times: positions, velocities,
/// accelerations, reactions and driving forces. The mechanism is assembled at each time point.
pub type KinematicResponses<M> = QuasiStaticResponses<M, Assembly>;

/// The outputs of a mechanism at given times, which are solved one by one, without integration: [`StaticResponses`] or
/// [`KinematicResponses`].
///
/// Response h is the mechanism's output h, on the grid `times`.
pub struct QuasiStaticResponses<M, P> {
    pub(super) model: M,
    pub(super) settings: P,
    pub(super) times: Vec<f64>,
    differentiation: Differentiation,
    /// The quantity that the times stand for; `None` for the time itself.
    axis: Option<TimeGrid>,
}

/// An analysis of one time point, with its settings.
pub trait InstantAnalysis: Send + Sync {
    /// Costs of the direct and the adjoint method.
    #[doc(hidden)]
    const COST: Cost;

    /// One series for each output.
    fn values(&self, mechanism: &Mechanism<f64>, times: &[f64]) -> Result<Vec<Vec<f64>>>;

    /// Warnings about the states at the times.
    fn warnings(&self, mechanism: &Mechanism<f64>, times: &[f64]) -> Vec<String>;

    /// Outputs with derivatives by the direct method.
    fn direct<M: ParametricMechanism>(&self, model: &M, b: &[f64], times: &[f64]) -> Result<SensitiveHistory>;

    /// Outputs with derivatives by the semi-analytical method, with this relative step.
    fn semi_analytical<M: ParametricMechanism>(
        &self,
        model: &M,
        b: &[f64],
        times: &[f64],
        step: f64,
    ) -> Result<SensitiveHistory>;

    /// Outputs with their Hessians.
    fn hessians<M: ParametricMechanism>(&self, model: &M, b: &[f64], times: &[f64]) -> Result<HessianHistory>;

    /// Derivatives of `responses` by the adjoint method.
    fn adjoint<M: ParametricMechanism>(
        &self,
        model: &M,
        b: &[f64],
        times: &[f64],
        responses: &[AdjointFunctional],
    ) -> Result<DMatrix<f64>>;
}

/// Implements [`InstantAnalysis`] for settings by functions of the mechanics, in the order of the trait. `[*]` passes the
/// settings by value.
macro_rules! impl_instant_analysis {
    ($settings:ty, $cost:expr, [$($deref:tt)?], $values:ident, $direct:ident, $semi:ident, $twice:ident, $adjoint:ident, $warnings:ident) => {
        impl InstantAnalysis for $settings {
            const COST: Cost = $cost;

            fn values(&self, mechanism: &Mechanism<f64>, times: &[f64]) -> Result<Vec<Vec<f64>>> {
                $values(mechanism, $($deref)? self, times)
            }

            fn warnings(&self, mechanism: &Mechanism<f64>, times: &[f64]) -> Vec<String> {
                $warnings(mechanism, self, times)
            }

            fn direct<M: ParametricMechanism>(&self, model: &M, b: &[f64], times: &[f64]) -> Result<SensitiveHistory> {
                $direct(model, b, $($deref)? self, times)
            }

            fn semi_analytical<M: ParametricMechanism>(
                &self,
                model: &M,
                b: &[f64],
                times: &[f64],
                step: f64,
            ) -> Result<SensitiveHistory> {
                $semi(model, b, $($deref)? self, times, step)
            }

            fn hessians<M: ParametricMechanism>(&self, model: &M, b: &[f64], times: &[f64]) -> Result<HessianHistory> {
                $twice(model, b, $($deref)? self, times, HessianPart::Full)
            }

            fn adjoint<M: ParametricMechanism>(
                &self,
                model: &M,
                b: &[f64],
                times: &[f64],
                responses: &[AdjointFunctional],
            ) -> Result<DMatrix<f64>> {
                $adjoint(model, b, $($deref)? self, times, responses)
            }
        }
    };
}
impl_instant_analysis!(
    Statics,
    Cost::EQUILIBRIUM,
    [],
    equilibria,
    differentiate_equilibria,
    difference_equilibria,
    differentiate_equilibria_twice,
    differentiate_equilibria_backwards,
    warn_of_statics
);
impl_instant_analysis!(
    Assembly,
    Cost::KINEMATICS,
    [*],
    kinematics,
    differentiate_kinematics,
    difference_kinematics,
    differentiate_kinematics_twice,
    differentiate_kinematics_backwards,
    warn_of_motion
);

fn warn_of_statics(mechanism: &Mechanism<f64>, settings: &Statics, times: &[f64]) -> Vec<String> {
    let jumps = warn_of_equilibrium_jumps(mechanism, settings, times);
    warn_of_equilibria(mechanism, settings, times).into_iter().chain(jumps).collect()
}

impl<M: ParametricMechanism, P: InstantAnalysis> QuasiStaticResponses<M, P> {
    /// Responses from the outputs of `model` at `times` (s, increasing).
    ///
    /// # Errors
    ///
    /// [`crate::Error::Definition`] if times do not increase.
    pub fn new(model: M, settings: P, times: &[f64]) -> Result<Self> {
        check_times(f64::NEG_INFINITY, times)?;
        Ok(Self { model, settings, times: times.to_vec(), differentiation: Differentiation::Automatic, axis: None })
    }

    /// Messages name points of the quantity `axis`, such as a travel, in place of times; without one, times.
    pub fn over(self, axis: Option<TimeGrid>) -> Self {
        Self { axis, ..self }
    }

    /// A result whose error names points of the axis.
    pub(super) fn on_axis<T>(&self, result: Result<T>) -> Result<T> {
        result.map_err(|error| error.map_reason(|why| self.in_words(why)))
    }

    /// A message with points of the axis in place of times.
    pub(super) fn in_words(&self, message: &str) -> String {
        let Some(axis) = &self.axis else { return message.to_owned() };
        let mut times = vec![];
        replace_times(message, |t| {
            times.push(t);
            String::new()
        });
        replace_times(message, |t| axis.in_words_beside(t, &times))
    }

    /// Replaces the method of differentiation.
    ///
    /// # Errors
    ///
    /// None, as this analysis offers all methods; other analyses return [`crate::Error::Unsupported`].
    pub fn differentiating(self, differentiation: Differentiation) -> Result<Self> {
        Ok(Self { differentiation, ..self })
    }

    /// The method for derivatives of the `wanted` responses by this many design variables.
    ///
    /// Costs are counted for each time point: one transposed solve carries four responses of a time point.
    pub fn differentiation_for(&self, variables: usize, wanted: &[ResponseAt]) -> Differentiation {
        self.differentiation.at_points(variables, wanted.iter().map(|at| at.point), P::COST)
    }
}

impl<M: ParametricMechanism, P: InstantAnalysis> Analysis for QuasiStaticResponses<M, P> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let mechanism = self.on_axis(self.model.build(b))?;
        Ok(Responses::new(self.on_axis(self.settings.values(&mechanism, &self.times))?))
    }

    fn warnings(&self, b: &[f64], responses: &Responses) -> Vec<String> {
        let mut warnings = responses.warnings.clone();
        if let (Ok(mechanism), Some(start)) = (self.model.build(b), self.times.first()) {
            let told = warn_of_indeterminate_outputs(&mechanism, Assembly::default(), *start);
            warnings.extend(told.unwrap_or_default());
            warnings.extend(self.settings.warnings(&mechanism, &self.times));
        }
        warnings.iter().map(|warning| self.in_words(warning)).collect()
    }

    fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        self.sensitivities_by(self.differentiation_for(b.len(), wanted), semi_analytical::STEP, b, wanted)
    }

    fn differentiation(&self, variables: usize, wanted: &[ResponseAt]) -> Option<&'static str> {
        Some(self.differentiation_for(variables, wanted).name())
    }

    fn gradient_methods(&self) -> Vec<GradientMethod<'_>> {
        use Differentiation::{Adjoint, Direct, SemiAnalytical};
        let by = |method, step| {
            move |b: &[f64], _: &Responses, wanted: &[ResponseAt]| self.sensitivities_by(method, step, b, wanted)
        };
        let step = semi_analytical::STEP;
        let semi = |step: f64, b: &[f64], _: &Responses, wanted: &[ResponseAt]| {
            self.sensitivities_by(SemiAnalytical, step, b, wanted)
        };
        vec![
            GradientMethod::exact("direct", by(Direct, step)),
            GradientMethod::exact("adjoint", by(Adjoint, step)),
            GradientMethod::approximate("semi-analytical", step, semi),
        ]
    }

    fn curvatures(&self, b: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<Option<Vec<DMatrix<f64>>>> {
        let model = WithWantedOutputs::new(&self.model, wanted.iter().map(|at| at.response));
        let history = self.on_axis(self.settings.hessians(&model, b, self.times_of(wanted)))?;
        Ok(wanted.iter().map(|at| history.hessian(at.response, at.point)).collect())
    }
}

impl<M: ParametricMechanism, P: InstantAnalysis> QuasiStaticResponses<M, P> {
    /// All times up to the last wanted one: each solution is the initial guess of the next, as in the analysis.
    fn times_of(&self, wanted: &[ResponseAt]) -> &[f64] {
        &self.times[..wanted.iter().map(|at| at.point + 1).max().unwrap_or(0)]
    }

    pub(super) fn sensitivities_by(
        &self,
        method: Differentiation,
        step: f64,
        b: &[f64],
        wanted: &[ResponseAt],
    ) -> Result<DMatrix<f64>> {
        let times = self.times_of(wanted);
        let model = WithWantedOutputs::new(&self.model, wanted.iter().map(|at| at.response));
        let history = match method {
            Differentiation::Adjoint => {
                let rows = by_points(wanted, |responses| self.settings.adjoint(&model, b, times, responses));
                return self.on_axis(rows);
            }
            Differentiation::SemiAnalytical => self.settings.semi_analytical(&model, b, times, step),
            Differentiation::Direct | Differentiation::Automatic => self.settings.direct(&model, b, times),
        };
        let history = self.on_axis(history)?;
        Ok(super::gradient_rows(&history, b.len(), wanted, &wanted.iter().map(|at| at.point).collect::<Vec<_>>()))
    }
}

/// Rows of the wanted responses from `adjoint`, which receives them ordered by time point: those of one share a factorization.
fn by_points(
    wanted: &[ResponseAt],
    adjoint: impl FnOnce(&[AdjointFunctional]) -> Result<DMatrix<f64>>,
) -> Result<DMatrix<f64>> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by_key(|&k| wanted[k].point);
    let responses: Vec<_> = order.iter().map(|&k| AdjointFunctional::at(wanted[k].response, wanted[k].point)).collect();
    let rows = adjoint(&responses)?;
    let mut sorted = DMatrix::zeros(rows.nrows(), rows.ncols());
    order.iter().enumerate().for_each(|(from, &to)| sorted.set_row(to, &rows.row(from)));
    Ok(sorted)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::SliderCrank;

    #[test]
    fn derivatives_have_the_order_of_the_request() {
        let times: Vec<f64> = (0..10).map(|k| 0.05 * f64::from(k)).collect();
        let driven = || KinematicResponses::new(SliderCrank::rigid(), Assembly::default(), &times).unwrap();
        let analysis = driven().differentiating(Differentiation::Direct).unwrap();
        let b = SliderCrank::DESIGN;
        let responses = analysis.analyze(&b).unwrap();
        let wanted = [(3, 7), (0, 2), (3, 1)].map(|(response, point)| ResponseAt { response, point });
        let rows = analysis.sensitivities(&b, &responses, &wanted).unwrap();
        let all = differentiate_kinematics(&SliderCrank::rigid(), &b, Assembly::default(), &times).unwrap();
        assert_eq!(responses.values, all.values);
        for (k, at) in wanted.iter().enumerate() {
            assert_eq!(rows.row(k).iter().copied().collect::<Vec<_>>(), all.gradients[at.response][at.point]);
        }
        let adjoint = driven().differentiating(Differentiation::Adjoint).unwrap();
        let difference = adjoint.sensitivities(&b, &responses, &wanted).unwrap() - &rows;
        assert!(difference.amax() < 1e-11 * rows.amax());
        assert!(KinematicResponses::new(SliderCrank::rigid(), Assembly::default(), &[0.1, 0.1]).is_err());
    }
}
