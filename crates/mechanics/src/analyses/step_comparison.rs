//! Comparison of a simulation by fixed steps with one by steps of twice the length.

use crate::Result;
use crate::analyses::dynamics::{History, simulate, simulate_explicitly};
use crate::integrators::explicit::{Explicit, StepControl};
use crate::integrators::settings::{Dynamics, StepSize};
use crate::mechanism::{AnyFormula, FormulaIn, MeasuredQuantity, Mechanism, OutputData, WeightedQuantity};
use error::Seconds;

/// Change of an output, as a fraction of its size, that is worth a warning.
///
/// For a method of second order the error is about a third of the change, for methods of higher order less.
pub const NOTABLE: f64 = 0.2;

/// Size of an output below which its change counts as rounding: as a fraction of the largest output, and in SI units.
const ROUNDING: [f64; 2] = [1e-9, 1e-6];

/// Fraction of the largest output of the same unit below which an output counts as zero, such as the moment at a pin compared with
/// the moments of beams.
const SMALL: f64 = 1e-2;

/// Relative change that is not shown in percent.
const LARGE: f64 = 100.0;

/// Unit of energies.
const ENERGY: &str = "J";

/// Change of an output if fixed steps are twice as long.
///
/// A simulation by fixed steps has no error estimate of its own. This one holds for implicit and explicit schemes, with drives,
/// dissipation and events, and costs half of the simulation. Sizes and changes are root mean squares over the output times, so
/// that a jump that moves across one time point counts little.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepComparison {
    /// Number of the output with the largest change.
    pub output: usize,
    /// Its change, as a fraction of its size.
    pub relative: f64,
    /// Largest change at one time, in the unit of the output.
    pub largest: f64,
    /// Time in s of the largest change.
    pub time: f64,
}

impl StepComparison {
    /// Comparison of the `values` of the outputs of `mechanism` at `times` (s) with those by steps of twice the length, `coarse`.
    ///
    /// The level of energies is arbitrary: they are compared with the largest kinetic energy, too, where it is known.
    ///
    /// `None` if the mechanism has no outputs or if there are no times.
    pub fn of(mechanism: &Mechanism<f64>, times: &[f64], values: &[Vec<f64>], coarse: &History) -> Option<Self> {
        let root_mean_square = |x: &mut dyn Iterator<Item = f64>| {
            let (count, sum) = x.fold((0usize, 0.0), |(count, sum), x| (count + 1, sum + x * x));
            (sum / count.max(1) as f64).sqrt()
        };
        let sizes: Vec<f64> = values.iter().map(|series| root_mean_square(&mut series.iter().copied())).collect();
        let rounding = ROUNDING[0] * sizes.iter().fold(0.0, |most: f64, size| most.max(*size)) + ROUNDING[1];
        let units: Vec<_> = (0..values.len()).map(|output| unit(mechanism, output)).collect();
        let kinetic = SMALL * coarse.energy_drift.map_or(0.0, |drift| drift.kinetic);
        let size = |output: usize| {
            let same = (0..values.len()).filter(|&k| units[output].is_some() && units[k] == units[output]);
            let least = if units[output] == Some(ENERGY) { kinetic } else { 0.0 };
            same.map(|k| SMALL * sizes[k]).fold(sizes[output].max(rounding).max(least), f64::max)
        };
        let compared = (0..values.len()).filter_map(|output| {
            // A held output is compared at its event.
            let is_held = mechanism.outputs[output].held.is_some();
            let at = |p: usize| if is_held { times.len() - 1 } else { p };
            let change = |p: usize| (values[output][at(p)] - coarse.values[output][at(p)]).abs();
            let relative = root_mean_square(&mut (0..times.len()).map(change)) / size(output);
            let largest = (0..times.len()).max_by(|&p, &q| change(p).total_cmp(&change(q)))?;
            Some(Self { output, relative, largest: change(largest), time: times[largest] })
        });
        compared.max_by(|a, b| a.relative.total_cmp(&b.relative))
    }
}

/// Returns whether an output is a sum or a difference of its measures: then it has their unit.
fn is_sum(output: &OutputData<f64>) -> bool {
    let Some(formula) = &output.formula else { return true };
    let value = |x: &[f64]| <dyn AnyFormula as FormulaIn<f64>>::value(formula.as_ref(), 0.0, x);
    let count = output.terms.len();
    let of_one = |i: usize| value(&(0..count).map(|k| f64::from(u8::from(k == i))).collect::<Vec<_>>());
    let signs: Vec<f64> = (0..count).map(of_one).collect();
    let sample: Vec<f64> = (0..count).map(|k| (1.0 + 1.7 * k as f64).sin()).collect();
    let sum: f64 = signs.iter().zip(&sample).map(|(sign, x)| sign * x).sum();
    signs.iter().all(|sign| sign.abs() == 1.0) && (value(&sample) - sum).abs() < 1e-12
}

/// The unit of an output that is a sum or a difference of measures of one unit; `None` for others.
fn unit(mechanism: &Mechanism<f64>, output: usize) -> Option<&'static str> {
    let data = &mechanism.outputs[output];
    let of_term = |term: &WeightedQuantity<f64>| match term.source {
        MeasuredQuantity::Measure { element, measure } => {
            Some(mechanism.elements[element].element.measures().get(measure)?.unit)
        }
        MeasuredQuantity::KineticEnergy | MeasuredQuantity::PotentialEnergy => Some(ENERGY),
        MeasuredQuantity::DrivingForce { .. } => None,
    };
    let mut units = data.terms.iter().map(of_term);
    let first = units.next().flatten()?;
    (is_sum(data) && units.all(|unit| unit == Some(first))).then_some(first)
}

/// The warning about implicit steps of a fixed length that is too long for the `values` of the outputs at `times` (s); `None`
/// for steps whose error is controlled.
///
/// # Errors
///
/// Those of [`simulate`] that do not depend on the length of the steps.
pub fn step_warning(
    mechanism: &Mechanism<f64>,
    settings: &Dynamics,
    times: &[f64],
    values: &[Vec<f64>],
) -> Result<Option<String>> {
    let StepSize::Fixed(h) = settings.step else { return Ok(None) };
    settings.check(times)?;
    let coarse = Dynamics { step: StepSize::Fixed(2.0 * h), ..*settings };
    Ok(warning(mechanism, h, times, values, simulate(mechanism, &coarse, times)))
}

/// The warning about explicit steps, as [`step_warning`].
///
/// # Errors
///
/// Those of [`simulate_explicitly`] that do not depend on the length of the steps.
pub fn explicit_step_warning(
    mechanism: &Mechanism<f64>,
    settings: &Explicit,
    times: &[f64],
    values: &[Vec<f64>],
) -> Result<Option<String>> {
    let StepControl::Fixed(h) = settings.step_control else { return Ok(None) };
    settings.check(times)?;
    let coarse = settings.clone().with_step_control(StepControl::Fixed(2.0 * h));
    Ok(warning(mechanism, h, times, values, simulate_explicitly(mechanism, &coarse, times)))
}

/// Warning about steps of the length `h` (s), from the simulation by steps of twice this length.
fn warning(
    mechanism: &Mechanism<f64>,
    h: f64,
    times: &[f64],
    values: &[Vec<f64>],
    coarse: Result<History>,
) -> Option<String> {
    let remedy = format!("Use a time step of {:.1e} s and compare, or adaptive steps.", 0.5 * h);
    let coarse = match coarse {
        Ok(coarse) => coarse,
        Err(error) => {
            return Some(format!("a time step of {:.1e} s, twice the one given, fails: {error}. {remedy}", 2.0 * h));
        }
    };
    let StepComparison { output, relative, largest, time } = StepComparison::of(mechanism, times, values, &coarse)?;
    (!(relative <= NOTABLE)).then(|| {
        let name = &mechanism.outputs[output].name;
        let change = match relative {
            relative if relative <= LARGE => format!("changes by {:.0} %", 100.0 * relative),
            relative if relative.is_finite() => format!("changes by {relative:.1e} times its size"),
            _ => "grows without limit".to_owned(),
        };
        format!(
            "{name}: it {change} if the time step is {:.1e} s, twice the one given; most, by {largest:.3e}, at t = {time}. {remedy}",
            2.0 * h,
            time = Seconds(time)
        )
    })
}
