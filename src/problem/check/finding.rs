//! What is found out about a derivative.

use super::ridders::Slope;
use crate::problem::ResponseAt;

/// What a derivative is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GradientStatus {
    /// All methods agree with the differences.
    Right,
    /// The response does not depend on the variable, and the methods say so.
    Constant,
    /// A method contradicts the differences, or exact methods each other.
    Wrong,
    /// The response has a kink here: there is no derivative.
    Kink,
    /// Two analyses of the same design differ: nothing can be said.
    NotRepeatable,
    /// The differences are too noisy to tell.
    Unclear,
}

impl GradientStatus {
    /// In words.
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

/// The derivative of one response at one instant with respect to one design variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Checked {
    /// Response and time point.
    pub instant: ResponseAt,
    /// Number of the design variable.
    pub variable: usize,
    /// What each method says.
    pub claimed: Vec<f64>,
    /// How far each of them may be off: nothing for exact methods.
    pub uncertainty: Vec<f64>,
    /// What differences say; none if the designs around could not be analysed.
    pub difference: Option<Slope>,
    /// Jump of the slope, if there is a kink.
    pub jump: Option<f64>,
    /// Difference of two analyses of the same design.
    pub drift: f64,
    /// Whether the response has the same bits at all designs along the variable.
    pub is_constant: bool,
    /// The verdict.
    pub finding: GradientStatus,
    /// Numbers of the methods that contradict the differences, or the other methods.
    pub suspects: Vec<usize>,
}

impl Checked {
    /// Whether it is right, or constant and said to be.
    pub fn is_fine(&self) -> bool {
        matches!(self.finding, GradientStatus::Right | GradientStatus::Constant)
    }

    /// By how much the methods and the differences disagree at the most.
    pub fn disagreement(&self) -> f64 {
        let all = || self.claimed.iter().copied().chain(self.difference.map(|slope| slope.value));
        all().fold(f64::MIN, f64::max) - all().fold(f64::MAX, f64::min)
    }

    /// The verdict in a sentence; `methods` are the names of the methods.
    pub fn explanation(&self, methods: &[String]) -> String {
        let named = |which: &dyn Fn(usize) -> bool| {
            let names: Vec<&str> = (0..methods.len()).filter(|&k| which(k)).map(|k| methods[k].as_str()).collect();
            names.join(" and ")
        };
        match self.finding {
            GradientStatus::Right => "all methods agree with the differences".to_owned(),
            GradientStatus::Constant => "the response does not depend on the variable".to_owned(),
            GradientStatus::Kink => {
                let jump = self.jump.unwrap_or(f64::NAN);
                format!("the slope jumps by {jump:.3e} here: there is no derivative; move the design, or smooth the response")
            }
            GradientStatus::NotRepeatable => {
                let drift = self.drift;
                format!("two analyses of this design differ by {drift:.1e}: make the analysis a pure function of the design")
            }
            GradientStatus::Unclear if self.difference.is_none() => {
                "the designs beside this one cannot be analysed: move the design away from there".to_owned()
            }
            GradientStatus::Unclear => {
                let error = self.difference.map_or(f64::NAN, |slope| slope.error);
                format!("the differences are only good to ± {error:.0e}: tighten the tolerances of the analysis")
            }
            GradientStatus::Wrong if self.suspects.len() == methods.len() => {
                "no method agrees with the differences: what they share is wrong, or the analysis takes other steps for \
                 another design"
                    .to_owned()
            }
            GradientStatus::Wrong => {
                let (wrong, others) =
                    (named(&|k| self.suspects.contains(&k)), named(&|k| !self.suspects.contains(&k)));
                let agree = if self.suspects.len() + 1 == methods.len() { "agrees" } else { "agree" };
                let verb = if self.suspects.len() == 1 { "is" } else { "are" };
                format!("{wrong} {verb} wrong: {others} {agree} with the differences")
            }
        }
    }
}

/// The verdicts on all derivatives that were asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct GradientCheck {
    /// Names of the methods.
    pub methods: Vec<String>,
    /// By instant, then variable.
    pub derivatives: Vec<Checked>,
}

impl GradientCheck {
    /// Whether no derivative is wrong and everything could be told.
    pub fn is_right(&self) -> bool {
        self.derivatives.iter().all(Checked::is_fine)
    }

    /// Number of derivatives with this verdict.
    pub fn count(&self, finding: GradientStatus) -> usize {
        self.derivatives.iter().filter(|d| d.finding == finding).count()
    }

    /// For tests: fails and names the derivatives that are not right.
    ///
    /// # Panics
    ///
    /// Unless [`GradientCheck::is_right`].
    pub fn expect_right(&self) {
        let bad = self.derivatives.iter().filter(|d| !d.is_fine());
        let line = |d: &Checked| {
            let ResponseAt { response, point } = d.instant;
            let difference = d.difference.map_or("none".to_owned(), |s| format!("{} ± {:.0e}", s.value, s.error));
            format!(
                "\nresponse {response} at point {point} by variable {}: {}, {:?} say {:?}, differences {difference}: {}",
                d.variable,
                d.finding.text(),
                self.methods,
                d.claimed,
                d.explanation(&self.methods)
            )
        };
        let lines: String = bad.map(line).collect();
        assert!(lines.is_empty(), "{lines}");
    }
}

/// Errors of the differences that a derivative may be off.
const MARGIN: f64 = 10.0;

/// Part of the largest scaled derivative of a response that is not looked at: rounding of what cancels.
const NEGLIGIBLE: f64 = 1e-9;

/// Part of a derivative that it may be off in any case.
const ALLOWED: f64 = 1e-7;

/// Part of the largest scaled derivative of a response that the analysis' own method, the first, may be off because it takes
/// steps, whatever it knows of it; the others are witnesses and only as good as they know.
const INEXACT: f64 = 1e-3;

/// Part of a derivative by which exact methods contradict each other, where differences are too noisy to tell.
const CONTRADICTION: f64 = 1e-4;

/// Part of a derivative up to which differences can tell that it is right.
const CLEAR: f64 = 0.03;

/// Judges the derivatives of one response at one instant; `scales` are the sizes of the variables.
pub(super) fn judge(derivatives: &mut [Checked], scales: &[f64]) {
    let size = |d: &Checked| {
        let claimed = d.claimed.iter().fold(0.0f64, |a, x| a.max(x.abs()));
        claimed.max(d.difference.map_or(0.0, |s| s.value.abs())) * scales[d.variable]
    };
    let largest = derivatives.iter().map(size).fold(0.0, f64::max);
    for d in derivatives {
        let floor = NEGLIGIBLE * largest / scales[d.variable];
        let size = size(d) / scales[d.variable];
        let Some(Slope { value, error, .. }) = d.difference else {
            d.finding = GradientStatus::Unclear;
            continue;
        };
        let off = |k: usize| {
            let known = MARGIN * d.uncertainty[k];
            let inexact = if k == 0 { known.min(INEXACT * largest / scales[d.variable]) } else { known };
            let allowed = MARGIN * error + inexact + ALLOWED * size + floor;
            !((d.claimed[k] - value).abs() <= allowed)
        };
        d.suspects = (0..d.claimed.len()).filter(|&k| off(k)).collect();
        if d.suspects.is_empty() && d.difference.is_some_and(|slope| slope.error > CONTRADICTION * size) {
            d.suspects = contradictions(d, CONTRADICTION * size + floor);
        }
        let is_noise = error > CLEAR * size && error > floor.max(CLEAR * largest / scales[d.variable]);
        d.finding = match () {
            () if d.drift > 0.0 => GradientStatus::NotRepeatable,
            () if d.jump.is_some() => GradientStatus::Kink,
            () if !d.suspects.is_empty() => GradientStatus::Wrong,
            () if d.is_constant => GradientStatus::Constant,
            () if is_noise => GradientStatus::Unclear,
            () => GradientStatus::Right,
        };
        if matches!(d.finding, GradientStatus::NotRepeatable | GradientStatus::Kink) {
            d.suspects.clear();
        }
    }
}

/// The exact methods that do not agree with the others: those away from an approximate method if one is sure enough, else all
/// of them.
fn contradictions(d: &Checked, allowed: f64) -> Vec<usize> {
    let exact: Vec<usize> = (0..d.claimed.len()).filter(|&k| d.uncertainty[k] == 0.0).collect();
    let apart = |a: usize, b: usize| (d.claimed[a] - d.claimed[b]).abs() > allowed;
    if !exact.iter().any(|&k| apart(exact[0], k)) {
        return Vec::new();
    }
    let sure = |&k: &usize| d.uncertainty[k] > 0.0 && MARGIN * d.uncertainty[k] <= allowed;
    match (0..d.claimed.len()).find(sure) {
        Some(witness) => exact.into_iter().filter(|&k| apart(witness, k)).collect(),
        None => exact,
    }
}
