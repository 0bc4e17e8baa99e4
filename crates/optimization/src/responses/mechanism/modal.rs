//! Natural frequencies and mode shapes about static equilibrium as responses, in addition to other outputs.

use super::StaticResponses;
use crate::problem::{Analysis, GradientMethod, ResponseAt, Responses};
use crate::{Error, Result};
use error::Seconds;
use mechanics::analyses::statics::equilibrium_states;
use mechanics::derivatives::method::Differentiation;
use mechanics::derivatives::modal::{About, ModeSensitivities, differentiate_modes, squared_frequencies};
use mechanics::derivatives::mode_shapes::{differentiate_mode_shapes, mode_shapes};
use mechanics::derivatives::semi_analytical;
use mechanics::mechanism::{Mechanism, ParametricMechanism};
use mechanics::system::state::State;
use nalgebra::DMatrix;

/// The outputs of a mechanism in static equilibrium at given times, some of which are natural angular frequencies
/// ω (rad/s) of small undamped vibrations about it, or amplitudes of outputs in a mode.
///
/// A square ω² < 0 belongs to an unstable equilibrium and gives −√(−ω²). Derivatives are exact:
/// [`differentiate_modes`], [`differentiate_mode_shapes`]. Those of equal frequencies are one-sided, which is a warning; their shapes are
/// not determined and have no derivatives.
pub struct ModalResponses<M> {
    outputs: StaticResponses<M>,
    /// For each output the modal quantity that it is; `None` if it is an output of the mechanism.
    quantities: Vec<Option<ModalQuantity>>,
}

/// A quantity of a natural mode as an output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ModalQuantity {
    /// The natural frequency.
    Frequency(NaturalFrequency),
    /// The amplitude of the output in the mode of this number, from zero, see [`mode_shapes`].
    Amplitude(usize),
}

impl ModalQuantity {
    /// Number of the mode.
    fn mode(self) -> usize {
        match self {
            Self::Frequency(frequency) => frequency.mode,
            Self::Amplitude(mode) => mode,
        }
    }
}

/// A natural frequency as an output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NaturalFrequency {
    /// Number of the mode, from zero, the lowest frequency.
    pub mode: usize,
    /// Unit of the output in rad/s: 1, or 2π for Hz.
    pub unit: f64,
}

/// A design, and its equilibria at all time points.
type AtEquilibria<'s> = (&'s [f64], &'s [State<f64>]);

/// Squares whose relative difference is smaller are reported as equal.
const EQUAL: f64 = 1e-7;

/// Modes of equal frequencies, and the time points at which they are equal.
struct EqualModes {
    /// Numbers of the first and the last mode, from one.
    modes: [usize; 2],
    /// True if an output is an amplitude in one of them, false if it is their frequency.
    is_shape: bool,
    /// Increasing.
    points: Vec<usize>,
}

impl EqualModes {
    /// Adds the time point `p` at which modes are equal, once.
    fn add(all: &mut Vec<Self>, modes: [usize; 2], is_shape: bool, p: usize) {
        match all.iter_mut().find(|one| (one.modes, one.is_shape) == (modes, is_shape)) {
            None => all.push(Self { modes, is_shape, points: vec![p] }),
            Some(one) if one.points.last() != Some(&p) => one.points.push(p),
            Some(_) => {}
        }
    }

    /// A warning; `times` (s) are those of all time points.
    fn in_words(&self, times: &[f64]) -> String {
        let ([first, last], t) = (self.modes, Seconds(times[self.points[0]]));
        let place = match self.points.len() {
            1 => format!("at t = {t}"),
            count => format!("at {count} points, first at t = {t}"),
        };
        let what = match self.is_shape {
            false => "their derivatives are one-sided; limit all of them, or separate them",
            true => "their shapes are not determined and have no derivatives; separate the frequencies",
        };
        format!("natural frequencies {first} to {last} are equal {place}: {what}")
    }
}

impl<M: ParametricMechanism> ModalResponses<M> {
    /// Replaces outputs of the mechanism by natural frequencies and amplitudes in modes.
    ///
    /// * `quantities`: one for each output of the mechanism, `None` for those that stay.
    pub fn new(outputs: StaticResponses<M>, quantities: Vec<Option<ModalQuantity>>) -> Self {
        Self { outputs, quantities }
    }

    /// Replaces the method of differentiation of the other outputs.
    ///
    /// # Errors
    /// As [`StaticResponses::differentiating`].
    pub fn differentiating(self, differentiation: Differentiation) -> Result<Self> {
        Ok(Self { outputs: self.outputs.differentiating(differentiation)?, ..self })
    }

    /// The equilibria at all time points, along the load path.
    fn equilibria(&self, mechanism: &Mechanism<f64>) -> Result<Vec<State<f64>>> {
        equilibrium_states(mechanism, &self.outputs.settings, &self.outputs.times)
    }

    fn quantity(&self, at: ResponseAt) -> Option<ModalQuantity> {
        self.quantities.get(at.response).copied().flatten()
    }

    /// Numbers of the modes in which outputs have amplitudes, increasing.
    fn shapes(&self) -> Vec<usize> {
        let mode = |quantity: &Option<ModalQuantity>| match *quantity {
            Some(ModalQuantity::Amplitude(mode)) => Some(mode),
            _ => None,
        };
        let mut modes: Vec<usize> = self.quantities.iter().filter_map(mode).collect();
        modes.sort_unstable();
        modes.dedup();
        modes
    }

    /// Derivatives of the wanted amplitudes, each in its row.
    fn add_shapes(&self, (b, states): AtEquilibria<'_>, wanted: &[ResponseAt], rows: &mut DMatrix<f64>) -> Result<()> {
        for (p, (&t, state)) in self.outputs.times.iter().zip(states).enumerate() {
            let here = wanted.iter().enumerate().filter(|(_, at)| at.point == p);
            let amplitude = |(row, at): (usize, &ResponseAt)| match self.quantity(*at)? {
                ModalQuantity::Amplitude(mode) => Some((row, at.response, mode)),
                ModalQuantity::Frequency(_) => None,
            };
            let all: Vec<(usize, usize, usize)> = here.filter_map(amplitude).collect();
            let mut modes: Vec<usize> = all.iter().map(|(.., mode)| *mode).collect();
            modes.sort_unstable();
            modes.dedup();
            if modes.is_empty() {
                continue;
            }
            let shapes = differentiate_mode_shapes(&self.outputs.model, b, About::At(state), t, &modes)?;
            for (row, output, mode) in all {
                let k = modes.binary_search(&mode).expect("it is one of them");
                let gradient = &shapes.gradients[k][output];
                gradient.iter().enumerate().for_each(|(variable, x)| rows[(row, variable)] = *x);
            }
        }
        Ok(())
    }

    /// ω² of a mode.
    fn square(&self, squares: &[f64], mode: usize, t: f64) -> Result<f64> {
        squares.get(mode).copied().ok_or_else(|| {
            let message = format!("natural frequency {} at t = {t} s: there are only {}", mode + 1, squares.len());
            Error::analysis("modes", message, "ask for a lower one; each degree of freedom has one")
        })
    }

    /// Derivatives of the wanted frequencies, each in its row.
    fn add_modes(&self, (b, states): AtEquilibria<'_>, wanted: &[ResponseAt], rows: &mut DMatrix<f64>) -> Result<()> {
        let mut known: Option<(usize, ModeSensitivities)> = None;
        let mut order: Vec<usize> = (0..wanted.len()).collect();
        order.sort_by_key(|&row| wanted[row].point);
        for row in order {
            let at = wanted[row];
            let Some(ModalQuantity::Frequency(NaturalFrequency { mode, unit })) = self.quantity(at) else { continue };
            let t = self.outputs.times[at.point];
            let modes = match known.take() {
                Some((point, modes)) if point == at.point => modes,
                _ => differentiate_modes(&self.outputs.model, b, About::At(&states[at.point]), t)?,
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
        let places: Vec<usize> = (0..wanted.len()).filter(|&row| self.quantity(wanted[row]).is_none()).collect();
        let mut rows = DMatrix::zeros(wanted.len(), b.len());
        if !places.is_empty() {
            let found = others(&places.iter().map(|&row| wanted[row]).collect::<Vec<_>>())?;
            places.iter().enumerate().for_each(|(k, &row)| rows.set_row(row, &found.row(k)));
        }
        if places.len() < wanted.len() {
            let states = self.equilibria(&self.outputs.model.build(b)?)?;
            self.add_modes((b, &states), wanted, &mut rows)?;
            self.add_shapes((b, &states), wanted, &mut rows)?;
        }
        Ok(rows)
    }
}

/// √x, and −√(−x) of a negative number.
fn signed_root(square: f64) -> f64 {
    square.abs().sqrt().copysign(square)
}

impl<M: ParametricMechanism> ModalResponses<M> {
    /// The outputs, frequencies and amplitudes at design `b`, with warnings that name times.
    fn outputs_and_modes(&self, b: &[f64]) -> Result<Responses> {
        let mut responses = self.outputs.analyze(b)?;
        let mechanism = self.outputs.model.build(b)?;
        let states = self.equilibria(&mechanism)?;
        let mut equal = vec![];
        for (p, (&t, state)) in self.outputs.times.iter().zip(&states).enumerate() {
            let squares = squared_frequencies(&mechanism, About::At(state), t)?;
            let shapes = self.shapes();
            let amplitudes = match shapes.is_empty() {
                true => Vec::new(),
                false => mode_shapes(&self.outputs.model, b, About::At(state), t, &shapes)?,
            };
            for (h, quantity) in self.quantities.iter().enumerate() {
                let Some(quantity) = *quantity else { continue };
                let mode = quantity.mode();
                let square = self.square(&squares, mode, t)?;
                responses.values[h][p] = match quantity {
                    ModalQuantity::Frequency(NaturalFrequency { unit, .. }) => signed_root(square) / unit,
                    ModalQuantity::Amplitude(mode) => {
                        amplitudes[shapes.binary_search(&mode).expect("it is one of them")][h]
                    }
                };
                let is_equal = |other: &f64| (other - square).abs() <= EQUAL * square.abs();
                let first = squares.iter().position(is_equal).unwrap_or(mode);
                let last = squares.iter().rposition(is_equal).unwrap_or(mode);
                if first < last {
                    let is_shape = matches!(quantity, ModalQuantity::Amplitude(_));
                    EqualModes::add(&mut equal, [first + 1, last + 1], is_shape, p);
                }
            }
        }
        responses.warnings.extend(equal.iter().map(|modes| modes.in_words(&self.outputs.times)));
        Ok(responses)
    }
}

impl<M: ParametricMechanism> Analysis for ModalResponses<M> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let responses = self.outputs.on_axis(self.outputs_and_modes(b))?;
        let warnings = responses.warnings.iter().map(|warning| self.outputs.in_words(warning)).collect();
        Ok(Responses { warnings, ..responses })
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        self.sensitivities_with(b, wanted, |others| self.outputs.sensitivities(b, responses, others))
    }

    fn warnings(&self, b: &[f64], responses: &Responses) -> Vec<String> {
        self.outputs.warnings(b, responses)
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
        if wanted.iter().any(|at| self.quantity(*at).is_some()) {
            return Ok(None);
        }
        self.outputs.curvatures(b, responses, wanted)
    }
}
