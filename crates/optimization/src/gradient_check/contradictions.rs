//! Second examination of derivatives that disagree with the differences.
//!
//! * **Rounding.** A derivative that is zero except for rounding scatters among designs that differ in their last digits. This scatter is
//!   an estimate of its error; a wrong derivative does not scatter. A scatter that is not small for the response has another reason, such as
//!   steps that change with the last digits: derivatives within it are unclear.
//! * **Discrete motions.** Where fixed steps end at events, the response is smooth between designs in which an event changes the step in
//!   which it falls, and has small jumps there. Differences across many of these have the slope of the exact motion, which differs from
//!   the slope of the discrete motion by the discretization error, with an error estimate that is too small. Narrower differences have the
//!   slope of the discrete motion. Deviations larger than the discretization error stay wrong: the response may be a step function.
//! * **Kinks.** A kink close to the design divides the differences: those on its side have another slope. A derivative that agrees with the
//!   slope on one side is that of this side.
//! * **Unclear results.** A derivative is wrong if it contradicts the slopes on both sides, and those of close designs. If these are not
//!   accurate enough for a decision, it is unclear.

use super::ridders;
use super::samples::{DifferenceSamples, FirstStep};
use super::status::{CheckedDerivative, GradientStatus, INEXACT, MARGIN, decide_all, largest};
use crate::problem::{Analysis, GradientMethod, ResponseAt, Responses};
use autodiff::differences::{DifferenceEstimate, StepValues, one_sided};

/// Distances of designs in which derivatives scatter by rounding only, as fractions of the sizes of the variables.
const ROUNDED: [f64; 3] = [1e-11, -1e-10, 3e-10];

/// Largest scatter of a derivative that is rounding, times the size of the variable, as a fraction of the response.
const ROUNDING: f64 = 1e-6;

/// Smallest size of a response in SI units.
const SMALLEST_SIZE: f64 = 1.0;

/// One less than the smallest number of distances from which narrow differences are extrapolated.
const FEWEST: usize = 4;

/// Decides again about derivatives with the status wrong; `wide` are the samples of the differences by variable.
pub(super) fn examine(
    analysis: &dyn Analysis,
    (methods, names): (&[GradientMethod<'_>], &[String]),
    (b, here): (&[f64], &Responses),
    (scales, wide): (&[f64], &[DifferenceSamples]),
    checked: &mut [CheckedDerivative],
) {
    if checked.iter().any(is_wrong) {
        estimate_rounding(analysis, (methods, names), (b, here), scales, checked);
        decide_all(checked, scales);
    }
    if !checked.iter().any(is_wrong) {
        return;
    }
    let includes = |i: usize| checked.iter().any(|d| is_wrong(d) && d.variable == i);
    let first: Vec<FirstStep> = scales.iter().map(|size| FirstStep::of_size(*size)).collect();
    let narrow = DifferenceSamples::close_to(|designs| analysis.analyze_around(b, designs), b, &first, includes);
    let evidence = |d: &CheckedDerivative| {
        let (at, value) = (d.at, here.at(d.at));
        Evidence::new(value, &wide[d.variable].steps(at, value), &narrow[d.variable].steps(at, value))
    };
    let slight = slight_deviations(checked, scales);
    for (d, _) in checked.iter_mut().zip(slight).filter(|(_, is_slight)| *is_slight) {
        d.difference = evidence(d).narrow.filter(|slope| slope.error < d.deviation()).or(d.difference);
    }
    decide_all(checked, scales);
    for one in checked.chunk_by_mut(|a, b| a.at.response == b.at.response) {
        let largest = largest(one, scales);
        one.iter_mut().filter(|d| is_wrong(d)).for_each(|d| evidence(d).weigh(d, largest / scales[d.variable]));
    }
}

/// Slopes of a response near the design.
struct Evidence {
    /// By differences at short distances.
    narrow: Option<DifferenceEstimate>,
    /// On the lower and on the upper side.
    sides: [Option<DifferenceEstimate>; 2],
    /// On the two sides, at short distances.
    narrow_sides: [Option<DifferenceEstimate>; 2],
}

/// Comparison of a slope with the derivatives that contradict the differences.
#[derive(Clone, Copy, PartialEq)]
enum SlopeComparison {
    /// It agrees with them, and is accurate enough to differ from the differences.
    Supports,
    /// It does not agree with them.
    Opposes,
    /// It is not accurate enough.
    Inconclusive,
}

impl Evidence {
    fn new(here: f64, wide: &[StepValues], narrow: &[StepValues]) -> Self {
        // A jump between two of the distances makes those above it useless.
        let starts = 0..narrow.len().saturating_sub(FEWEST);
        let estimates = starts.filter_map(|from| ridders(here, &narrow[from..]));
        Self {
            narrow: estimates.min_by(|a, b| a.error.total_cmp(&b.error)),
            sides: one_sided(here, wide),
            narrow_sides: one_sided(here, narrow),
        }
    }

    /// Decides about a wrong derivative: it stays wrong if exact methods contradict each other, or if it contradicts the slopes on both sides
    /// and those of close designs.
    fn weigh(&self, d: &mut CheckedDerivative, largest: f64) {
        let Some(slope) = d.difference.filter(|_| !d.is_contradictory(largest)) else { return };
        let compare = |side: &Option<DifferenceEstimate>| {
            let Some(side) = side else { return SlopeComparison::Inconclusive };
            let is_accurate = MARGIN * side.error < (side.value - slope.value).abs();
            match d.disagreeing.iter().any(|&k| d.is_off(k, side, largest)) {
                true => SlopeComparison::Opposes,
                false if is_accurate => SlopeComparison::Supports,
                false => SlopeComparison::Inconclusive,
            }
        };
        let is_kink = |sides: &[Option<DifferenceEstimate>; 2]| {
            let compared = sides.each_ref().map(compare);
            compared.contains(&SlopeComparison::Supports) && compared.contains(&SlopeComparison::Opposes)
        };
        let [behind, ahead] = self.sides.each_ref().map(compare);
        let (status, jump) = match compare(&self.narrow) {
            // Beyond the kink, on one side, the differences have another slope: twice as far away as that of both sides.
            SlopeComparison::Supports if [behind, ahead].contains(&SlopeComparison::Supports) => {
                let narrow = self.narrow.map_or(f64::NAN, |narrow| narrow.value);
                let sign = if ahead == SlopeComparison::Supports { -1.0 } else { 1.0 };
                d.difference = self.narrow;
                (GradientStatus::Kink, Some(sign * 2.0 * (slope.value - narrow)))
            }
            SlopeComparison::Supports => (GradientStatus::Unclear, d.slope_discontinuity),
            _ => match [&self.sides, &self.narrow_sides].into_iter().find(|sides| is_kink(sides)) {
                Some([Some(behind), Some(ahead)]) => (GradientStatus::Kink, Some(ahead.value - behind.value)),
                _ if [behind, ahead] == [SlopeComparison::Opposes; 2] => return,
                _ => (GradientStatus::Unclear, d.slope_discontinuity),
            },
        };
        (d.status, d.slope_discontinuity) = (status, jump);
        d.disagreeing.clear();
    }
}

fn is_wrong(d: &CheckedDerivative) -> bool {
    d.status == GradientStatus::Wrong
}

/// Adds the scatter of the derivatives by exact methods to the rounding errors of each response with a wrong derivative.
fn estimate_rounding(
    analysis: &dyn Analysis,
    (methods, names): (&[GradientMethod<'_>], &[String]),
    (b, here): (&[f64], &Responses),
    scales: &[f64],
    checked: &mut [CheckedDerivative],
) {
    for one in checked.chunk_by_mut(|a, b| a.at.response == b.at.response).filter(|one| one.iter().any(is_wrong)) {
        let mut wanted: Vec<ResponseAt> = one.iter().map(|d| d.at).collect();
        wanted.dedup();
        let mut scatter = 0.0f64;
        for by in ROUNDED {
            let moved: Vec<f64> = b.iter().zip(scales).map(|(b, scale)| b + by * scale).collect();
            let Ok(responses) = analysis.analyze(&moved) else { continue };
            for (k, name) in names.iter().enumerate() {
                let is_exact = one.iter().all(|d| d.uncertainty[k] == 0.0);
                let method = methods.iter().find(|method| method.name == *name).filter(|_| is_exact);
                let Some(Ok(rows)) = method.map(|method| method.sensitivities(&moved, &responses, &wanted)) else {
                    continue;
                };
                let other = |d: &CheckedDerivative| {
                    let row = wanted.iter().position(|at| *at == d.at).expect("it is one of them");
                    (rows[(row, d.variable)] - d.computed[k]).abs() * scales[d.variable]
                };
                scatter = one.iter().map(other).fold(scatter, f64::max);
            }
        }
        let size = here.values[one[0].at.response].iter().fold(SMALLEST_SIZE, |size: f64, x| size.max(x.abs()));
        // At a kink the scatter is that of the slopes on its sides.
        for d in one.iter_mut().filter(|d| d.status != GradientStatus::Kink) {
            d.is_scattered = is_wrong(d) && scatter > ROUNDING * size;
            d.rounding += MARGIN * scatter / scales[d.variable];
        }
    }
}

/// For each derivative, true if it is wrong by no more than the discretization error.
fn slight_deviations(checked: &[CheckedDerivative], scales: &[f64]) -> Vec<bool> {
    let of_response = |one: &[CheckedDerivative]| {
        let largest = largest(one, scales);
        let is_slight = |d: &CheckedDerivative| is_wrong(d) && d.deviation() * scales[d.variable] <= INEXACT * largest;
        one.iter().map(is_slight).collect::<Vec<_>>()
    };
    checked.chunk_by(|a, b| a.at.response == b.at.response).flat_map(of_response).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gradient_check::{check, methods};
    use error::Result;
    use nalgebra::DMatrix;

    /// One response of one variable, with the derivative that the analysis returns for it.
    struct Claimed<F, D>(F, D);

    impl<F: Fn(f64) -> f64 + Send + Sync, D: Fn(f64) -> f64 + Send + Sync> Analysis for Claimed<F, D> {
        fn analyze(&self, b: &[f64]) -> Result<Responses> {
            Ok(Responses::new(vec![vec![(self.0)(b[0])]]))
        }

        fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
            Ok(DMatrix::from_element(wanted.len(), 1, (self.1)(b[0])))
        }
    }

    fn check_one(analysis: &dyn Analysis) -> CheckedDerivative {
        let wanted = [ResponseAt { response: 0, point: 0 }];
        check(analysis, &methods(analysis), &[1.0], &[1.0], &wanted).unwrap().derivatives.remove(0)
    }

    fn status(analysis: &dyn Analysis) -> GradientStatus {
        check_one(analysis).status
    }

    /// A number between −1 and 1 that depends on all digits of x.
    fn noise(x: f64) -> f64 {
        let mut z = x.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// A discrete motion whose slope between changes of a step is 2·10⁻⁴ less than that of the exact motion.
    #[test]
    fn a_slope_between_small_jumps_is_that_of_close_designs() {
        for place in 0..20 {
            let (width, jump) = (1.5e-4, 3e-8);
            let motion = move |x: f64| x - 2e-4 * x + jump * (x / width + 0.05 * f64::from(place)).floor();
            let right = |d: f64| status(&Claimed(motion, move |_| d));
            assert_eq!(right(1.0 - 2e-4), GradientStatus::Right, "{place}");
            assert_ne!(right(1.0 - 3e-4), GradientStatus::Right, "{place}");
            assert_eq!(right(1.0 + 1e-2), GradientStatus::Wrong, "{place}");
        }
    }

    /// A staircase: the slope of its steps is not that of the response.
    #[test]
    fn a_derivative_of_the_steps_of_a_staircase_is_unclear() {
        let staircase = |x: f64| 0.5 * x + 5e-5 * (x / 1e-4 + 0.3).floor();
        let found = check_one(&Claimed(staircase, |_| 0.5));
        assert_eq!(found.status, GradientStatus::Unclear);
        let words = found.explanation(&["analysis".to_owned()]);
        assert!(words.contains("kinks or jumps close to this design"), "{words}");
        assert_eq!(status(&Claimed(staircase, |_| 0.3)), GradientStatus::Wrong);
    }

    /// A kink at distances from the least one of the differences to a twentieth of the greatest: the derivative is that of its side.
    #[test]
    fn a_derivative_beside_a_kink_is_not_wrong() {
        for (place, side) in [1e-8, 1.4e-5, 1e-4, 5e-4].into_iter().flat_map(|x| [(x, -1.0), (x, 1.0)]) {
            for jump in [0.012, 0.5] {
                let bent = |x: f64| (2.0 * x).sin() + jump * (side * (x - 1.0) - place).max(0.0);
                let slope = 2.0 * 2f64.cos();
                let found = check_one(&Claimed(bent, |_| slope));
                // Where the kink is as far away as the differences reach, their error may cover it.
                assert_ne!(found.status, GradientStatus::Wrong, "{place} {side} {jump}: {found:?}");
                if found.status == GradientStatus::Kink {
                    let discontinuity = found.slope_discontinuity.unwrap();
                    assert!((discontinuity - jump).abs() < 0.2 * jump, "{place} {side} {jump}: {discontinuity}");
                }
                assert!(place > 1e-5 || found.status == GradientStatus::Kink, "{place} {side} {jump}: {found:?}");
                // The error of the differences may cover the other slope of a distant kink, too.
                let others = [-slope, slope - side * jump, slope + 2.0 * side * jump];
                for &wrong in &others[..if place < 1e-4 { 3 } else { 1 }] {
                    assert_eq!(
                        status(&Claimed(bent, |_| wrong)),
                        GradientStatus::Wrong,
                        "{place} {side} {jump} {wrong}"
                    );
                }
            }
        }
    }

    #[test]
    fn derivatives_that_are_zero_but_for_rounding_are_not_wrong() {
        let zero = |x: f64| 1e-20 * x;
        assert_ne!(status(&Claimed(zero, |x| 1e-9 * noise(x))), GradientStatus::Wrong);
        assert_eq!(status(&Claimed(zero, |_| 1e-9)), GradientStatus::Wrong);
        // Of a conserved quantity, the error of the steps remains.
        let conserved = |x: f64| 41.0 + 3e-8 * x;
        assert_eq!(status(&Claimed(conserved, |_| 3.01e-8)), GradientStatus::Right);
        assert_eq!(status(&Claimed(conserved, |_| 1e-5)), GradientStatus::Wrong);
    }
}
