//! Results of a gradient check: the status of each derivative, and the rules that decide it.

use crate::problem::ResponseAt;
use autodiff::differences::DifferenceEstimate;

/// Result of the check of a derivative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GradientStatus {
    /// All methods agree with the differences.
    Right,
    /// The response does not depend on the variable, and all methods return zero.
    Constant,
    /// A method contradicts the differences, or exact methods each other.
    Wrong,
    /// The response has a kink at the design or very close to it: a derivative is that of one side.
    Kink,
    /// Two analyses of the same design differ: derivatives cannot be checked.
    NotRepeatable,
    /// The differences are too noisy for a decision, or contradict each other.
    Unclear,
}

impl GradientStatus {
    /// The status as a word.
    pub fn text(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Constant => "constant",
            Self::Wrong => "WRONG",
            Self::Kink => "kink",
            Self::NotRepeatable => "not repeatable",
            Self::Unclear => "unclear",
        }
    }
}

/// The derivative of one response at one time point with respect to one design variable.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckedDerivative {
    /// Response and time point.
    pub at: ResponseAt,
    /// Number of the design variable.
    pub variable: usize,
    /// Derivative by each method.
    pub computed: Vec<f64>,
    /// Estimated error of each of them; zero for exact methods.
    pub uncertainty: Vec<f64>,
    /// Derivative by finite differences; `None` if the neighbouring designs could not be analysed.
    pub difference: Option<DifferenceEstimate>,
    /// Jump of the slope, if there is a kink.
    pub slope_discontinuity: Option<f64>,
    /// Difference of two analyses of the same design.
    pub drift: f64,
    /// Rounding error of the differences at the smallest distance, or of the computed derivatives where these contradict the differences;
    /// with the error of steps that differ between designs.
    pub rounding: f64,
    /// True if the response has the same bits at all designs along the variable.
    pub is_constant: bool,
    /// True if a derivative contradicts the differences by no more than it scatters among designs that differ in their last digits, and scatters by
    /// more than rounding.
    pub is_scattered: bool,
    /// Result of the check.
    pub status: GradientStatus,
    /// Numbers of the methods that disagree with the differences, or with the other methods.
    pub disagreeing: Vec<usize>,
    /// Numbers of the methods that are too inaccurate here, by their own estimate, for the status to hold for them.
    pub inaccurate: Vec<usize>,
}

impl CheckedDerivative {
    /// True if it is right or constant.
    pub fn is_fine(&self) -> bool {
        matches!(self.status, GradientStatus::Right | GradientStatus::Constant)
    }

    /// Largest difference between two of the methods and the finite differences.
    pub fn disagreement(&self) -> f64 {
        let all = || self.computed.iter().copied().chain(self.difference.map(|slope| slope.value));
        all().fold(f64::MIN, f64::max) - all().fold(f64::MAX, f64::min)
    }

    /// The largest of the derivatives by methods and differences, without differences that are smaller than their own error, and estimates of
    /// methods that are not accurate.
    fn size(&self) -> f64 {
        let computed = self.computed.iter().zip(&self.uncertainty).map(|(x, error)| [x.abs(), error / CLEAR]);
        let difference = self.difference.map(|slope| [slope.value.abs(), slope.error]);
        let known = computed.chain(difference).filter(|[x, error]| x >= error);
        known.fold(0.0, |largest, [x, _]| largest.max(x))
    }

    /// Returns whether method number `k` deviates from `slope` by more than both of their errors; `largest` is the largest derivative of
    /// the response with respect to this variable, in the scales of the variables.
    pub(super) fn is_off(&self, k: usize, slope: &DifferenceEstimate, largest: f64) -> bool {
        let estimate = MARGIN * self.uncertainty[k];
        let inexact = if k == 0 { estimate.min(INEXACT * largest) } else { estimate };
        let allowed = MARGIN * slope.error + inexact + ALLOWED * self.size() + self.floor(largest);
        !((self.computed[k] - slope.value).abs() <= allowed)
    }

    /// Size of derivatives that are rounding errors; `largest` as in [`CheckedDerivative::is_off`].
    fn floor(&self, largest: f64) -> f64 {
        NEGLIGIBLE * largest + self.rounding
    }

    /// Returns whether exact methods differ from each other by more than rounding.
    pub(super) fn is_contradictory(&self, largest: f64) -> bool {
        !contradictions(self, CONTRADICTION * self.size() + self.floor(largest)).is_empty()
    }

    /// Largest deviation of a method that disagrees from the differences.
    pub(super) fn deviation(&self) -> f64 {
        let value = self.difference.map_or(f64::NAN, |slope| slope.value);
        self.disagreeing.iter().map(|&k| (self.computed[k] - value).abs()).fold(0.0, f64::max)
    }

    /// Returns whether a method that disagrees is not one of the slopes on the two sides of a kink with this jump, nor between them.
    fn is_beyond(&self, jump: f64) -> bool {
        let Some(slope) = self.difference else { return false };
        self.disagreeing
            .iter()
            .any(|&k| (self.computed[k] - slope.value).abs() > BETWEEN * jump.abs() + MARGIN * slope.error)
    }

    /// Returns whether a method deviates from the differences by more than their error.
    fn is_undecided(&self) -> bool {
        let is_off =
            |slope: DifferenceEstimate| self.computed.iter().any(|x| (x - slope.value).abs() > DOUBTFUL * slope.error);
        self.difference.is_some_and(is_off)
    }

    /// Returns whether the analysis' own method deviates from the differences by more than their error, but not by so much that it is wrong,
    /// and by more than `negligible`.
    fn is_doubtful(&self, slope: &DifferenceEstimate, negligible: f64) -> bool {
        let deviation = (self.computed[0] - slope.value).abs();
        deviation > DOUBTFUL * slope.error + MARGIN * self.uncertainty[0] && deviation > negligible
    }

    /// Returns whether all methods return zero, and the differences are rounding errors of zero for a change by the `scale` of the variable: of
    /// a conserved quantity such as a momentum that is zero.
    fn is_zero(&self, scale: f64) -> bool {
        let is_rounding = |slope: DifferenceEstimate| (slope.value.abs() + slope.error) * scale <= ZERO;
        self.computed.iter().all(|x| *x == 0.0) && self.difference.is_some_and(is_rounding)
    }

    /// Returns whether all derivatives are smaller than the error of the differences.
    fn may_be_zero(&self) -> bool {
        self.difference.is_some_and(|slope| self.computed.iter().all(|x| x.abs() <= slope.error))
    }

    /// Returns whether the differences are confirmed by a method: one that does not disagree and is closer to the differences than to the methods that do: it may be allowed to differ
    /// from both by the estimate of its own error.
    fn has_confirmed_differences(&self) -> bool {
        let Some(slope) = self.difference else { return true };
        let mut others = (0..self.computed.len()).filter(|k| !self.disagreeing.contains(k));
        let is_nearer = |k: usize| {
            let to_methods = self.disagreeing.iter().map(|&j| (self.computed[k] - self.computed[j]).abs());
            (self.computed[k] - slope.value).abs() <= to_methods.fold(f64::INFINITY, f64::min)
        };
        others.any(is_nearer)
    }

    /// The status in a sentence; `methods` are the names of the methods.
    pub fn explanation(&self, methods: &[String]) -> String {
        let named = |which: &dyn Fn(usize) -> bool| {
            let names: Vec<&str> = (0..methods.len()).filter(|&k| which(k)).map(|k| methods[k].as_str()).collect();
            names.join(" and ")
        };
        match self.status {
            GradientStatus::Right if !self.inaccurate.is_empty() => {
                let (others, inaccurate) =
                    (named(&|k| !self.inaccurate.contains(&k)), named(&|k| self.inaccurate.contains(&k)));
                let error = self.inaccurate.iter().map(|&k| self.uncertainty[k]).fold(0.0, f64::max);
                format!("{others} agree with the differences; {inaccurate} is only good to ± {error:.0e} here")
            }
            GradientStatus::Right => "all methods agree with the differences".to_owned(),
            GradientStatus::Constant => "the response does not depend on the variable".to_owned(),
            GradientStatus::Kink => {
                let slope_discontinuity = self.slope_discontinuity.unwrap_or(f64::NAN);
                format!(
                    "the slope jumps by {slope_discontinuity:.3e} at this design or very close to it: a derivative is that of one side; move \
                     the design, or smooth the response"
                )
            }
            GradientStatus::NotRepeatable => {
                let drift = self.drift;
                format!("two analyses of this design differ by {drift:.1e}: make the analysis a pure function of the design")
            }
            GradientStatus::Unclear if self.difference.is_none() => {
                "the neighbouring designs cannot be analysed: move the design away from there".to_owned()
            }
            GradientStatus::Unclear if self.is_undecided() => {
                "the derivatives differ from the differences, whose slopes on the two sides or at other distances differ as well: the response \
                 has kinks or jumps close to this design, such as those of other steps; give an integration in time smaller steps or tighter tolerances, or \
                 move the design"
                    .to_owned()
            }
            GradientStatus::Unclear if self.may_be_zero() => {
                let error = self.difference.map_or(f64::NAN, |slope| slope.error);
                format!(
                    "the derivative is zero, or smaller than the error of the differences, ± {error:.0e}, which cannot check it: nothing is to be \
                     done unless derivatives of this size matter"
                )
            }
            GradientStatus::Unclear => {
                let error = self.difference.map_or(f64::NAN, |slope| slope.error);
                format!(
                    "the differences are only good to ± {error:.0e}: give an integration in time smaller steps or tighter tolerances, or move the \
                     design"
                )
            }
            GradientStatus::Wrong if self.disagreeing.len() == methods.len() => {
                "no method agrees with the differences: what they share is wrong, or the analysis takes other steps for \
                 another design"
                    .to_owned()
            }
            GradientStatus::Wrong if !self.has_confirmed_differences() => {
                let (wrong, others) =
                    (named(&|k| self.disagreeing.contains(&k)), named(&|k| !self.disagreeing.contains(&k)));
                format!(
                    "{wrong} and {others} agree with each other, and not with the differences: what they share is wrong, or the analysis takes \
                     other steps for another design, and the differences are worse than their estimate"
                )
            }
            GradientStatus::Wrong => {
                let (wrong, others) =
                    (named(&|k| self.disagreeing.contains(&k)), named(&|k| !self.disagreeing.contains(&k)));
                let agree = if self.disagreeing.len() + 1 == methods.len() { "agrees" } else { "agree" };
                let verb = if self.disagreeing.len() == 1 { "is" } else { "are" };
                format!("{wrong} {verb} wrong: {others} {agree} with the differences")
            }
        }
    }
}

/// Results of a check of derivatives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GradientCheck {
    /// Names of the methods.
    pub methods: Vec<String>,
    /// Ordered by response and time point, then by variable.
    pub derivatives: Vec<CheckedDerivative>,
    /// Numbers of the responses that have no derivatives, and the reasons: reactions that redundant constraints leave indeterminate.
    pub without_derivatives: Vec<(usize, String)>,
    /// Methods that failed, and the reasons.
    pub failed: Vec<(String, String)>,
}

impl GradientCheck {
    /// True if every derivative is right or constant, every response has derivatives, and no method failed.
    pub fn is_right(&self) -> bool {
        self.failed.is_empty()
            && self.without_derivatives.is_empty()
            && self.derivatives.iter().all(CheckedDerivative::is_fine)
    }

    /// Number of derivatives with this status.
    pub fn count(&self, status: GradientStatus) -> usize {
        self.derivatives.iter().filter(|d| d.status == status).count()
    }

    /// Panics with the derivatives that are not right; for tests.
    ///
    /// # Panics
    ///
    /// Unless [`GradientCheck::is_right`].
    pub fn expect_right(&self) {
        let bad = self.derivatives.iter().filter(|d| !d.is_fine());
        let line = |d: &CheckedDerivative| {
            let ResponseAt { response, point } = d.at;
            let difference = d.difference.map_or("none".to_owned(), |s| format!("{} ± {:.0e}", s.value, s.error));
            format!(
                "\nresponse {response} at point {point} by variable {}: {}, {:?} say {:?}, differences {difference}: {}",
                d.variable,
                d.status.text(),
                self.methods,
                d.computed,
                d.explanation(&self.methods)
            )
        };
        let failed = self.failed.iter().map(|(method, why)| format!("\n{method} failed: {why}"));
        let without = self.without_derivatives.iter().map(|(response, why)| format!("\nresponse {response}: {why}"));
        let lines: String = bad.map(line).chain(without).chain(failed).collect();
        assert!(lines.is_empty(), "{lines}");
    }
}

/// Allowed deviation of a derivative, in errors of the differences.
pub(super) const MARGIN: f64 = 10.0;

/// Deviation of a derivative, in errors of the differences, from which on they do not confirm it.
const DOUBTFUL: f64 = 3.0;

/// Change of a response in SI units that is a rounding error of zero.
const ZERO: f64 = 1e-15;

/// Deviation that is ignored, relative to the largest scaled derivative of the response: rounding of terms that cancel.
const NEGLIGIBLE: f64 = 1e-9;

/// Relative deviation that is always allowed. Steps that end at contacts are frozen for derivatives, and differ among the designs of
/// differences: both results differ by the discretization error.
const ALLOWED: f64 = 5e-6;

/// Largest error estimate that counts for the analysis' own method, the first, relative to the largest scaled derivative of
/// the response. The other methods serve for comparison: their whole error estimate counts.
pub(super) const INEXACT: f64 = 1e-3;

/// Relative difference of two exact methods that counts as a contradiction where differences are too noisy.
const CONTRADICTION: f64 = 1e-4;

/// Largest distance of a derivative at a kink from the mean of the slopes, in jumps, which are estimates: half a jump is a slope.
const BETWEEN: f64 = 0.75;

/// Largest relative error of the differences with which a derivative can be confirmed.
const CLEAR: f64 = 0.03;

/// The largest derivative of a response at all time points, by methods or differences, times the size of the variable.
pub(super) fn largest(derivatives: &[CheckedDerivative], scales: &[f64]) -> f64 {
    derivatives.iter().map(|d| d.size() * scales[d.variable]).fold(0.0, f64::max)
}

/// Decides the status of all derivatives, response by response.
pub(super) fn decide_all(checked: &mut [CheckedDerivative], scales: &[f64]) {
    checked.chunk_by_mut(|a, b| a.at.response == b.at.response).for_each(|one| decide(one, scales));
}

/// Decides the status of the derivatives of one response at all time points; `scales` are the sizes of the variables.
fn decide(derivatives: &mut [CheckedDerivative], scales: &[f64]) {
    let largest = largest(derivatives, scales);
    for d in derivatives {
        let largest = largest / scales[d.variable];
        let (floor, size) = (d.floor(largest), d.size());
        let Some(slope @ DifferenceEstimate { value, error, .. }) = d.difference else {
            d.status = GradientStatus::Unclear;
            continue;
        };
        d.disagreeing = (0..d.computed.len()).filter(|&k| d.is_off(k, &slope, largest)).collect();
        let is_inaccurate = |k: &usize| {
            let deviation = (d.computed[*k] - value).abs();
            deviation > CLEAR * size && deviation > MARGIN * error + floor && !d.disagreeing.contains(k)
        };
        d.inaccurate = (0..d.computed.len()).filter(is_inaccurate).collect();
        if d.disagreeing.is_empty() && d.difference.is_some_and(|slope| slope.error > CONTRADICTION * size) {
            d.disagreeing = contradictions(d, CONTRADICTION * size + floor);
        }
        let is_noise = error > CLEAR * size && error > floor.max(CLEAR * largest);
        let is_doubtful = d.is_doubtful(&slope, CONTRADICTION * largest.max(size) + floor);
        d.status = match () {
            () if d.drift > 0.0 => GradientStatus::NotRepeatable,
            () if d.slope_discontinuity.is_some_and(|jump| !(jump.abs() <= floor) && !d.is_beyond(jump)) => {
                GradientStatus::Kink
            }
            () if !d.disagreeing.is_empty() => GradientStatus::Wrong,
            () if d.is_scattered => GradientStatus::Unclear,
            () if d.is_constant || d.is_zero(scales[d.variable]) => GradientStatus::Constant,
            () if is_noise || is_doubtful => GradientStatus::Unclear,
            () => GradientStatus::Right,
        };
        if matches!(d.status, GradientStatus::NotRepeatable | GradientStatus::Kink) {
            d.disagreeing.clear();
        }
    }
}

/// The exact methods that disagree with the others: those that differ from an approximate method with a small error estimate,
/// or all of them if there is no such method.
fn contradictions(d: &CheckedDerivative, allowed: f64) -> Vec<usize> {
    let exact: Vec<usize> = (0..d.computed.len()).filter(|&k| d.uncertainty[k] == 0.0).collect();
    let apart = |a: usize, b: usize| (d.computed[a] - d.computed[b]).abs() > allowed;
    if !exact.iter().any(|&k| apart(exact[0], k)) {
        return Vec::new();
    }
    let is_reliable = |&k: &usize| d.uncertainty[k] > 0.0 && MARGIN * d.uncertainty[k] <= allowed;
    match (0..d.computed.len()).find(is_reliable) {
        Some(reference) => exact.into_iter().filter(|&k| apart(reference, k)).collect(),
        None => exact,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(computed: Vec<f64>, uncertainty: Vec<f64>, value: f64, error: f64) -> CheckedDerivative {
        CheckedDerivative {
            at: ResponseAt { response: 0, point: 0 },
            variable: 0,
            computed,
            uncertainty,
            difference: Some(DifferenceEstimate { value, error, noise: 0.0 }),
            slope_discontinuity: None,
            drift: 0.0,
            rounding: 0.0,
            is_constant: false,
            is_scattered: false,
            status: GradientStatus::Right,
            disagreeing: vec![],
            inaccurate: vec![],
        }
    }

    /// The moment at a pin: the semi-analytical derivative has the other sign, and an error estimate of its own size.
    #[test]
    fn a_method_that_differs_in_sign_is_not_called_right() {
        let mut derivatives = [checked(vec![-9.7e-2, 6.3e-2], vec![0.0, 0.2], -9.7e-2, 1e-6)];
        decide(&mut derivatives, &[1.0]);
        assert_eq!((derivatives[0].status, &derivatives[0].inaccurate[..]), (GradientStatus::Right, &[1][..]));
        let methods = ["direct".to_owned(), "semi-analytical".to_owned()];
        let words = derivatives[0].explanation(&methods);
        assert!(words.contains("semi-analytical is only good to ± 2e-1"), "{words}");
    }

    /// The yaw at a pitch of 90° jumps by π: differences and semi-analytical derivatives are larger than any slope, but not than their errors.
    #[test]
    fn differences_that_are_all_error_confirm_nothing() {
        let mut derivatives = [checked(vec![0.0, 0.0, 1.57e5], vec![0.0, 0.0, 1.6e5], 366.5, 400.0)];
        decide(&mut derivatives, &[1.0]);
        assert_eq!(derivatives[0].status, GradientStatus::Unclear);
    }

    /// A force that begins at a design variable, `if(time > T, F, 0)`: the methods miss its effect, and the differences are noisy.
    #[test]
    fn noisy_differences_do_not_confirm_a_derivative_of_zero() {
        let mut derivatives = [checked(vec![0.0], vec![0.0], -0.61, 0.1), checked(vec![20.0], vec![0.0], 20.0, 1e-6)];
        decide(&mut derivatives, &[1.0]);
        assert_eq!(derivatives.each_ref().map(|d| d.status), [GradientStatus::Unclear, GradientStatus::Right]);
        let words = derivatives[0].explanation(&["direct".to_owned()]);
        assert!(words.starts_with("the derivatives differ from the differences"), "{words}");
    }

    /// Statics and kinematics have no steps that could be smaller: a derivative of zero needs no remedy.
    #[test]
    fn a_derivative_of_zero_is_told_as_such() {
        let mut derivatives = [checked(vec![0.0, 6.8e-34], vec![0.0, 0.0], 6.5e-15, 4e-14)];
        derivatives[0].rounding = 1e-17;
        decide(&mut derivatives, &[1.0]);
        assert_eq!(derivatives[0].status, GradientStatus::Unclear);
        let words = derivatives[0].explanation(&["direct".to_owned(), "adjoint".to_owned()]);
        assert!(words.starts_with("the derivative is zero, or smaller") && !words.contains("steps"), "{words}");
    }

    /// The momentum of a mechanism at rest stays zero up to rounding.
    #[test]
    fn a_quantity_that_stays_zero_is_constant() {
        let mut derivatives = [checked(vec![0.0, 0.0], vec![0.0, 0.0], 1e-23, 5e-22)];
        decide(&mut derivatives, &[1.0]);
        assert_eq!(derivatives[0].status, GradientStatus::Constant);
    }

    /// A semi-analytical derivative with a large error estimate agrees with the exact ones, not with the differences.
    #[test]
    fn a_method_that_is_merely_inaccurate_is_no_witness_for_the_differences() {
        let mut derivatives = [checked(vec![-88.297, -88.297, -88.296], vec![0.0, 0.0, 0.2], -87.02, 0.1)];
        decide(&mut derivatives, &[1.0]);
        let methods = ["direct", "adjoint", "semi-analytical"].map(str::to_owned);
        let words = derivatives[0].explanation(&methods);
        assert!(words.contains("agree with each other, and not with the differences"), "{words}");
    }

    /// Where the response does not depend on the design, such as a wheel at ride height, its derivatives are rounding.
    #[test]
    fn rounding_at_one_time_is_compared_with_the_derivatives_at_others() {
        let methods =
            |first: f64, second: f64, value: f64| checked(vec![first, second], vec![0.0, 1e-20], value, 1e-10);
        let mut jumping = methods(1e-15, 1e-15, 1e-15);
        jumping.slope_discontinuity = Some(2e-12);
        let mut derivatives = [methods(1.9e-15, 6.6e-20, -8e-12), methods(0.7, 0.7, 0.7), jumping];
        decide(&mut derivatives, &[1.0]);
        assert_eq!(derivatives.map(|d| d.status), [GradientStatus::Right; 3]);
    }

    /// The steps of an adaptive analysis differ between designs: both derivatives have its discretization error.
    #[test]
    fn methods_that_agree_to_the_discretization_error_are_right() {
        for (deviation, status) in [(2.5e-6, GradientStatus::Right), (1e-4, GradientStatus::Wrong)] {
            let computed = vec![0.3187 * (1.0 + deviation); 2];
            let mut derivatives = [checked(computed, vec![0.0; 2], 0.3187, 3e-10)];
            decide(&mut derivatives, &[1.0]);
            assert_eq!(derivatives[0].status, status, "{deviation}");
        }
    }
}
