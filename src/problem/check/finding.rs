//! What is found out about a derivative.

use super::ridders::Slope;
use crate::problem::Instant;

/// What a derivative is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finding {
    /// All methods agree with the differences.
    Right,
    /// The response does not depend on the variable, and the methods say so.
    Constant,
    /// A method contradicts the differences.
    Wrong,
    /// The response has a kink here: there is no derivative.
    Kink,
    /// Two analyses of the same design differ: nothing can be said.
    NotRepeatable,
    /// The differences are too noisy to tell.
    Unclear,
}

impl Finding {
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
    pub instant: Instant,
    /// Number of the design variable.
    pub variable: usize,
    /// What each method says.
    pub claimed: Vec<f64>,
    /// What differences say; none if the designs around could not be analysed.
    pub difference: Option<Slope>,
    /// Jump of the slope, if there is a kink.
    pub jump: Option<f64>,
    /// Difference of two analyses of the same design.
    pub drift: f64,
    /// Whether the response has the same bits at all designs along the variable.
    pub is_constant: bool,
    /// The verdict.
    pub finding: Finding,
    /// Numbers of the methods that contradict the differences.
    pub suspects: Vec<usize>,
}

/// The verdicts on all derivatives that were asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Proof {
    /// Names of the methods.
    pub methods: Vec<String>,
    /// By instant, then variable.
    pub derivatives: Vec<Checked>,
}

impl Proof {
    /// Whether no derivative is wrong and everything could be told.
    pub fn is_right(&self) -> bool {
        self.derivatives.iter().all(|d| matches!(d.finding, Finding::Right | Finding::Constant))
    }

    /// Number of derivatives with this verdict.
    pub fn count(&self, finding: Finding) -> usize {
        self.derivatives.iter().filter(|d| d.finding == finding).count()
    }

    /// For tests: fails and names the derivatives that are not right.
    ///
    /// # Panics
    ///
    /// Unless [`Proof::is_right`].
    pub fn expect_right(&self) {
        let bad = self.derivatives.iter().filter(|d| !matches!(d.finding, Finding::Right | Finding::Constant));
        let line = |d: &Checked| {
            let Instant { response, point } = d.instant;
            let difference = d.difference.map_or("none".to_owned(), |s| format!("{} ± {:.0e}", s.value, s.error));
            format!(
                "\nresponse {response} at point {point} by variable {}: {}, {:?} say {:?}, differences {difference}",
                d.variable,
                d.finding.text(),
                self.methods,
                d.claimed
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
            d.finding = Finding::Unclear;
            continue;
        };
        let off = |x: f64| !((x - value).abs() <= MARGIN * error + ALLOWED * size + floor);
        d.suspects = (0..d.claimed.len()).filter(|&k| off(d.claimed[k])).collect();
        let is_noise = error > CLEAR * size && error > floor.max(CLEAR * largest / scales[d.variable]);
        d.finding = match () {
            () if d.drift > 0.0 => Finding::NotRepeatable,
            () if d.jump.is_some() => Finding::Kink,
            () if !d.suspects.is_empty() => Finding::Wrong,
            () if d.is_constant => Finding::Constant,
            () if is_noise => Finding::Unclear,
            () => Finding::Right,
        };
        if matches!(d.finding, Finding::NotRepeatable | Finding::Kink) {
            d.suspects.clear();
        }
    }
}
