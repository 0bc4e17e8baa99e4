//! Defect of dense output: checks that the rates along a step agree with those at its stages.

use crate::integrators::explicit::settings::Tolerance;
use crate::integrators::explicit::stepper::{OdeRhs, Stepper};
use crate::integrators::explicit::tableau::SAMPLE;
use crate::integrators::inspection::InspectionTimes;

/// Check of completed adaptive steps at given times inside them.
///
/// The estimate of the local error depends on the rates at the stages only. If nothing moves it is zero, and steps become so long that a
/// load of short duration may lie between the stages. The defect of dense output u(t), f(t, u) − u̇, shows it.
///
/// # Sources
///
/// Enright, *SIAM J. Numer. Anal.* 26 (1989) 588–599; Shampine, *Math. Comput. Simul.* 68 (2005) 479–490.
#[derive(Debug, Default)]
pub(crate) struct DefectControl {
    y: Vec<f64>,
    slopes: Vec<f64>,
    rates: Vec<f64>,
}

/// Largest defect times the length of a step, in units of the tolerance. That of smooth motions is of the size of the local error, with a
/// larger constant.
const LARGEST: f64 = 1e3;

impl DefectControl {
    /// Workspace for systems of `size` components.
    pub fn new(size: usize) -> Self {
        Self { y: vec![0.0; size], slopes: vec![0.0; size], rates: vec![0.0; size] }
    }

    /// The first of the `times` inside the completed step at which the defect is too large, or the rates cannot be computed.
    pub fn first_miss<F: OdeRhs>(
        &mut self,
        stepper: &mut Stepper<F>,
        times: &InspectionTimes,
        tolerance: &Tolerance,
    ) -> Option<f64> {
        let (h, inside) = (stepper.length(), times.inside(stepper.t));
        if inside.is_empty() {
            return None;
        }
        if stepper.make_dense().is_err() {
            return inside.first().copied();
        }
        inside.iter().copied().find(|&t| {
            stepper.interpolate(t, &mut self.y);
            stepper.interpolate_rates(t, &mut self.slopes);
            stepper.evaluations += 1;
            if stepper.rhs.rates(SAMPLE, t, &self.y, &mut self.rates).is_err() {
                return true;
            }
            let defects = self.rates.iter().zip(&self.slopes).map(|(rate, slope)| h * (rate - slope).abs());
            let is_large = |(i, defect): (usize, f64)| {
                let size = stepper.old[i].abs().max(stepper.new[i].abs());
                !(defect <= LARGEST * tolerance.at(i, size))
            };
            defects.enumerate().any(is_large)
        })
    }
}
