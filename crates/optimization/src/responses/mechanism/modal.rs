//! Natural frequencies about static equilibrium as responses, beside other outputs.

use super::StaticResponses;
use crate::problem::{Analysis, GradientMethod, ResponseAt, Responses};
use crate::{Error, Result};
use mechanics::derivatives::method::Differentiation;
use mechanics::derivatives::modal::{About, ModeSensitivities, differentiate_modes, squared_frequencies};
use mechanics::derivatives::semi_analytical;
use mechanics::mechanism::ParametricMechanism;
use nalgebra::DMatrix;

/// The outputs of a mechanism in static equilibrium at given times, some of which are natural angular frequencies
/// ω (rad/s) of small undamped vibrations about it.
///
/// A square ω² < 0 belongs to an unstable equilibrium and gives −√(−ω²). Derivatives are exact:
/// [`differentiate_modes`]. Those of equal frequencies are one-sided, which is a warning.
pub struct ModalResponses<M> {
    outputs: StaticResponses<M>,
    /// For each output the natural frequency that it is; `None` if it is an output of the mechanism.
    frequencies: Vec<Option<NaturalFrequency>>,
}

/// A natural frequency as an output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NaturalFrequency {
    /// Number of the mode, from zero, the lowest frequency.
    pub mode: usize,
    /// Unit of the output in rad/s: 1, or 2π for Hz.
    pub unit: f64,
}

/// Squares whose relative difference is smaller are told as equal.
const EQUAL: f64 = 1e-7;

impl<M: ParametricMechanism> ModalResponses<M> {
    /// Replaces outputs of the mechanism by natural frequencies.
    ///
    /// * `frequencies`: one for each output of the mechanism, `None` for those that stay.
    pub fn new(outputs: StaticResponses<M>, frequencies: Vec<Option<NaturalFrequency>>) -> Self {
        Self { outputs, frequencies }
    }

    /// Replaces the method of differentiation of the other outputs.
    ///
    /// # Errors
    /// As [`StaticResponses::differentiating`].
    pub fn differentiating(self, differentiation: Differentiation) -> Result<Self> {
        Ok(Self { outputs: self.outputs.differentiating(differentiation)?, ..self })
    }

    fn about(&self) -> About {
        About::Equilibrium(self.outputs.settings)
    }

    fn frequency(&self, at: ResponseAt) -> Option<NaturalFrequency> {
        self.frequencies.get(at.response).copied().flatten()
    }

    /// ω² of a mode.
    fn square(&self, squares: &[f64], mode: usize, t: f64) -> Result<f64> {
        squares.get(mode).copied().ok_or_else(|| {
            let message = format!("natural frequency {} at t = {t} s: there are only {}", mode + 1, squares.len());
            Error::analysis("modes", message, "ask for a lower one; each degree of freedom has one")
        })
    }

    /// Derivatives of the wanted frequencies, each in its row.
    fn add_modes(&self, b: &[f64], wanted: &[ResponseAt], rows: &mut DMatrix<f64>) -> Result<()> {
        let mut known: Option<(usize, ModeSensitivities)> = None;
        let mut order: Vec<usize> = (0..wanted.len()).collect();
        order.sort_by_key(|&row| wanted[row].point);
        for row in order {
            let at = wanted[row];
            let Some(NaturalFrequency { mode, unit }) = self.frequency(at) else { continue };
            let t = self.outputs.times[at.point];
            let modes = match known.take() {
                Some((point, modes)) if point == at.point => modes,
                _ => differentiate_modes(&self.outputs.model, b, self.about(), t)?,
            };
            let frequency = signed_root(self.square(&modes.squares, mode, t)?);
            if frequency == 0.0 {
                let message = format!("natural frequency {} is zero at t = {t} s and has no derivative", mode + 1);
                return Err(Error::analysis(
                    "modes",
                    message,
                    "ask for a frequency of a motion that is held by springs",
                ));
            }
            for (k, gradient) in modes.gradients[mode].iter().enumerate() {
                rows[(row, k)] = gradient / (2.0 * frequency.abs() * unit);
            }
            known = Some((at.point, modes));
        }
        Ok(())
    }

    fn sensitivities_with(
        &self,
        b: &[f64],
        wanted: &[ResponseAt],
        others: impl FnOnce(&[ResponseAt]) -> Result<DMatrix<f64>>,
    ) -> Result<DMatrix<f64>> {
        let places: Vec<usize> = (0..wanted.len()).filter(|&row| self.frequency(wanted[row]).is_none()).collect();
        let mut rows = DMatrix::zeros(wanted.len(), b.len());
        if !places.is_empty() {
            let found = others(&places.iter().map(|&row| wanted[row]).collect::<Vec<_>>())?;
            places.iter().enumerate().for_each(|(k, &row)| rows.set_row(row, &found.row(k)));
        }
        self.add_modes(b, wanted, &mut rows)?;
        Ok(rows)
    }
}

/// √x, and −√(−x) of a negative number.
fn signed_root(square: f64) -> f64 {
    square.abs().sqrt().copysign(square)
}

impl<M: ParametricMechanism> Analysis for ModalResponses<M> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let mut responses = self.outputs.analyze(b)?;
        let mechanism = self.outputs.model.build(b)?;
        for (p, &t) in self.outputs.times.iter().enumerate() {
            let squares = squared_frequencies(&mechanism, self.about(), t)?;
            for (h, frequency) in self.frequencies.iter().enumerate() {
                let Some(NaturalFrequency { mode, unit }) = *frequency else { continue };
                let square = self.square(&squares, mode, t)?;
                responses.values[h][p] = signed_root(square) / unit;
                let is_equal = |other: &f64| (other - square).abs() <= EQUAL * square.abs();
                let first = squares.iter().position(is_equal).unwrap_or(mode);
                let last = squares.iter().rposition(is_equal).unwrap_or(mode);
                if first < last {
                    responses.warnings.push(format!(
                        "natural frequencies {} to {} are equal at t = {t} s: their derivatives are one-sided; limit all \
                         of them, or separate them",
                        first + 1,
                        last + 1
                    ));
                }
            }
        }
        Ok(responses)
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        self.sensitivities_with(b, wanted, |others| self.outputs.sensitivities(b, responses, others))
    }

    fn differentiation(&self, variables: usize, wanted: &[ResponseAt]) -> Option<&'static str> {
        self.outputs.differentiation(variables, wanted)
    }

    fn gradient_methods(&self) -> Vec<GradientMethod<'_>> {
        use Differentiation::{Adjoint, Direct, SemiAnalytical};
        let by = |method, step| {
            move |b: &[f64], _: &Responses, wanted: &[ResponseAt]| {
                self.sensitivities_with(b, wanted, |others| self.outputs.sensitivities_by(method, step, b, others))
            }
        };
        let step = semi_analytical::STEP;
        let semi = move |step: f64, b: &[f64], _: &Responses, wanted: &[ResponseAt]| {
            self.sensitivities_with(b, wanted, |others| self.outputs.sensitivities_by(SemiAnalytical, step, b, others))
        };
        vec![
            GradientMethod::exact("direct", by(Direct, step)),
            GradientMethod::exact("adjoint", by(Adjoint, step)),
            GradientMethod::approximate("semi-analytical", step, semi),
        ]
    }

    fn curvatures(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<Option<Vec<DMatrix<f64>>>> {
        if wanted.iter().any(|at| self.frequency(*at).is_some()) {
            return Ok(None);
        }
        self.outputs.curvatures(b, responses, wanted)
    }
}
