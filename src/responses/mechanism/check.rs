//! Proving the derivatives of a mechanism, for instance of an element of one's own.

use super::instants::{Balanced, Driven};
use super::transient::{Integration, Transient};
use crate::Result;
use crate::problem::check::{Proof, check, methods};
use crate::problem::{Analysis, Instant};
use mechanics::analyses::dynamics::Dynamics;
use mechanics::analyses::statics::Statics;
use mechanics::initial_conditions::Assembly;
use mechanics::integrators::explicit::Explicit;
use mechanics::mechanism::Model;

/// How a mechanism is analysed.
#[derive(Clone, Debug, PartialEq)]
pub enum Study {
    /// Its motion over time.
    Motion(Integration),
    /// Kinematics and inverse dynamics, every degree of freedom driven.
    Kinematics(Assembly),
    /// Static equilibria.
    Statics(Statics),
}

impl From<Dynamics> for Study {
    fn from(settings: Dynamics) -> Self {
        Self::Motion(settings.into())
    }
}

impl From<Explicit> for Study {
    fn from(settings: Explicit) -> Self {
        Self::Motion(settings.into())
    }
}

impl From<Assembly> for Study {
    fn from(settings: Assembly) -> Self {
        Self::Kinematics(settings)
    }
}

impl From<Statics> for Study {
    fn from(settings: Statics) -> Self {
        Self::Statics(settings)
    }
}

/// Derivatives of all outputs of `model` at `times` by the design `b`, by every method that the analysis has (direct, adjoint,
/// semi-analytical), against differences.
///
/// `study` are the settings of the analysis: [`Dynamics`], [`Explicit`], [`Assembly`] for kinematics or [`Statics`]. In a test
/// of an element of one's own, one line: `check_model(model, &b, settings, &times)?.expect_right()`.
///
/// **Errors.** As [`check`].
pub fn check_model<M: Model>(model: M, b: &[f64], study: impl Into<Study>, times: &[f64]) -> Result<Proof> {
    let outputs = model.build(b)?.output_names().len();
    let analysis: Box<dyn Analysis> = match study.into() {
        Study::Motion(settings) => Box::new(Transient::new(model, settings, times)?),
        Study::Kinematics(assembly) => Box::new(Driven::new(model, assembly, times)?),
        Study::Statics(settings) => Box::new(Balanced::new(model, settings, times)?),
    };
    let instants = |response| (0..times.len()).map(move |point| Instant { response, point });
    let wanted: Vec<Instant> = (0..outputs).flat_map(instants).collect();
    let scales: Vec<f64> = b.iter().map(|x| if *x == 0.0 { 1.0 } else { x.abs() }).collect();
    check(analysis.as_ref(), &methods(analysis.as_ref()), b, &scales, &wanted)
}
