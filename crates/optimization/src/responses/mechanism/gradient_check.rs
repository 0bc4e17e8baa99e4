//! Gradient check of a mechanism, for instance of a new element.

use super::quasi_static::{KinematicResponses, StaticResponses};
use super::transient::{Integration, Transient};
use crate::Result;
use crate::gradient_check::{GradientCheck, check, methods};
use crate::problem::{Analysis, ResponseAt};
use mechanics::analyses::dynamics::Dynamics;
use mechanics::analyses::statics::Statics;
use mechanics::initial_conditions::Assembly;
use mechanics::integrators::explicit::Explicit;
use mechanics::mechanism::ParametricMechanism;

/// The analysis of a mechanism, with its settings.
#[derive(Clone, Debug, PartialEq)]
pub enum AnalysisSettings {
    /// Its motion over time.
    Motion(Integration),
    /// Kinematics and inverse dynamics, every degree of freedom driven.
    Kinematics(Assembly),
    /// Static equilibria.
    Statics(Statics),
}

impl From<Dynamics> for AnalysisSettings {
    fn from(settings: Dynamics) -> Self {
        Self::Motion(settings.into())
    }
}

impl From<Explicit> for AnalysisSettings {
    fn from(settings: Explicit) -> Self {
        Self::Motion(settings.into())
    }
}

impl From<Assembly> for AnalysisSettings {
    fn from(settings: Assembly) -> Self {
        Self::Kinematics(settings)
    }
}

impl From<Statics> for AnalysisSettings {
    fn from(settings: Statics) -> Self {
        Self::Statics(settings)
    }
}

/// Checks the derivatives of all outputs of `model` at `times` with respect to the design `b`, by every method of the analysis
/// (direct, adjoint, semi-analytical), against finite differences.
///
/// `settings` are those of the analysis: [`Dynamics`], [`Explicit`], [`Assembly`] for kinematics or [`Statics`]. The test of a
/// new element is one line: `check_model(model, &b, settings, &times)?.expect_right()`.
///
/// # Errors
///
/// As [`check`].
pub fn check_model<M: ParametricMechanism>(
    model: M,
    b: &[f64],
    settings: impl Into<AnalysisSettings>,
    times: &[f64],
) -> Result<GradientCheck> {
    let outputs = model.build(b)?.output_names().len();
    let analysis: Box<dyn Analysis> = match settings.into() {
        AnalysisSettings::Motion(settings) => Box::new(Transient::new(model, settings, times)?),
        AnalysisSettings::Kinematics(assembly) => Box::new(KinematicResponses::new(model, assembly, times)?),
        AnalysisSettings::Statics(settings) => Box::new(StaticResponses::new(model, settings, times)?),
    };
    let points = |response| (0..times.len()).map(move |point| ResponseAt { response, point });
    let wanted: Vec<ResponseAt> = (0..outputs).flat_map(points).collect();
    let scales: Vec<f64> = b.iter().map(|x| if *x == 0.0 { 1.0 } else { x.abs() }).collect();
    check(analysis.as_ref(), &methods(analysis.as_ref()), b, &scales, &wanted)
}
