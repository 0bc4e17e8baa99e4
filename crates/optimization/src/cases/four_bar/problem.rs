//! The stress-constrained four-bar mechanism with three flexible links (Section 6.3 of the paper; Sohoni & Haug 1982).
//!
//! Minimize the mass over the three diameters, subject to |σ| ≤ 27.58 MPa at 21 nodes and 201 time points:
//!
//! $$ \sigma = \frac{32 M(t)}{\pi d^3} = \frac{4 \sqrt\pi M(t)}{A^{3/2}} \qquad (51) $$
//!
//! The bending moments M are the responses of the analysis and depend mildly on the diameters; the stress is explicit
//! in (M, d). Linearized in the areas A = π d²/4 (54), few cycles suffice although the stress is far from linear.

use super::mechanism::FourBar;
use crate::cases::Optimum;
use crate::function;
use crate::problem::{
    Constraint, DesignVariable, Intermediate, Intermediates, Problem, ProblemBuilder, Quantity, TimeGrid,
};
use crate::responses::Differences;
use crate::responses::mechanism::Transient;
use crate::sao::{Method, RelativeLimits, Screening, StayFeasible, Stop};
use error::{Error, Result};

/// Names of the links.
pub const LINKS: [&str; 3] = ["crank", "coupler", "rocker"];

/// Linearized responses, and the variables in which they are linearized.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinearizedResponses {
    /// The bending moments, in the areas: the paper's intermediate responses and intermediate design variables.
    MomentsInAreas,
    /// The bending moments, in the diameters: intermediate responses only.
    MomentsInDiameters,
    /// The stresses, in the diameters: no intermediate responses or variables.
    StressesInDiameters,
}

/// Method for the derivatives of the moments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DerivativeMethod {
    /// Direct differentiation, exact for the discrete motion.
    Direct,
    /// Forward differences with this relative step.
    Forward(f64),
    /// Forward differences with this step in m, as in the paper.
    ForwardBy(f64),
    /// Central differences with this relative step.
    Central(f64),
}

/// The problem with its options; the default is the paper's problem with [`FourBar::physical`].
#[derive(Clone, Debug, PartialEq)]
pub struct StressConstrained {
    /// The mechanism and its motion.
    pub mechanism: FourBar,
    /// Times in s at which the stress is bounded, increasing.
    pub times: Vec<f64>,
    /// Start diameters in m.
    pub start: [f64; 3],
    /// Smallest and largest diameter in m.
    pub bounds: [f64; 2],
    /// The linearized responses.
    pub linearized: LinearizedResponses,
    /// The method for derivatives.
    pub derivatives: DerivativeMethod,
}

impl Default for StressConstrained {
    fn default() -> Self {
        Self {
            mechanism: FourBar::physical(),
            times: FourBar::window(),
            start: [0.3568; 3],
            bounds: [5e-3, 1.0],
            linearized: LinearizedResponses::MomentsInAreas,
            derivatives: DerivativeMethod::Direct,
        }
    }
}

impl StressConstrained {
    /// The problem with the modelling choices that give the printed stresses; see [`FourBar::as_published`].
    pub fn as_published() -> Self {
        Self { mechanism: FourBar::as_published(), ..Self::default() }
    }

    /// Multiplies Young's modulus by `factor`.
    #[must_use]
    pub fn stiffened(mut self, factor: f64) -> Self {
        self.mechanism.young *= factor;
        self
    }

    /// Sets the start diameters, in mm.
    #[must_use]
    pub fn from_mm(self, start: [f64; 3]) -> Self {
        Self { start: start.map(|d| d * 1e-3), ..self }
    }

    /// The optimization problem: diameters in m, moments in N·m, stresses in N/m², mass in kg.
    ///
    /// # Errors
    /// [`Error::Option`] or [`Error::Definition`] if times, bounds, start or settings are out of range.
    pub fn problem(&self) -> Result<Problem> {
        let [lower, upper] = self.bounds;
        Error::check_option("smallest diameter", "positive", lower, lower > 0.0)?;
        let mut parts = ProblemBuilder::new("flexible four-bar mechanism");
        for (link, start) in LINKS.iter().zip(self.start) {
            parts.variable(DesignVariable::new(format!("{link} diameter"), "m", start).within(lower, upper));
        }
        let time = parts.grid(TimeGrid::new("time", "s", self.times.clone())?);
        let mechanism = self.mechanism;
        parts.minimize("mass", "kg", Quantity::plain(function!([m: FourBar = mechanism] |p| m.mass(p.design))));
        for (link, name) in LINKS.iter().enumerate() {
            for node in 1..=mechanism.elements + 1 {
                self.bound_stress(&mut parts, time, link, &format!("{name} node {node}"));
            }
        }
        self.build(parts)
    }

    /// |σ| ≤ σ_a at one node, as two constraints.
    fn bound_stress(&self, parts: &mut ProblemBuilder, time: usize, link: usize, place: &str) {
        let moment = parts.transient(&format!("moment {place}"), "N·m", time);
        if self.linearized == LinearizedResponses::MomentsInAreas {
            parts.linearize_in(moment, Intermediates::all(3, Intermediate::AreaOfDiameter));
        }
        let stress = function!([link: usize = link] |p| p.response[0] * FourBar::stress_per_moment(p.design[link]));
        let mut stress = Quantity::each_point(time, stress).of(&[moment]);
        if self.linearized == LinearizedResponses::StressesInDiameters {
            stress = stress.directly(Intermediates::Identity);
        }
        let limit = FourBar::ALLOWED_STRESS;
        parts.subject_to(Constraint::at_most(format!("tension {place}"), limit, stress.clone()));
        parts.subject_to(Constraint::at_least(format!("compression {place}"), -limit, stress));
    }

    fn build(&self, parts: ProblemBuilder) -> Result<Problem> {
        let settings = self.mechanism.dynamics()?;
        let transient = Transient::new(self.mechanism, settings, &self.times)?;
        match self.derivatives {
            DerivativeMethod::Direct => parts.build(transient),
            DerivativeMethod::Forward(step) => parts.build(Differences::forward(transient, step)?),
            DerivativeMethod::ForwardBy(step) => parts.build(Differences::forward_by(transient, vec![step; 3])?),
            DerivativeMethod::Central(step) => parts.build(Differences::central(transient, step)?),
        }
    }
}

/// The paper's method for this problem: screening at 50 % of the allowed stress, the paper's stop test with accuracy 1e-4
/// of mass and stress.
///
/// The accuracy is a hundredth of the discretization error of time step and mesh.
pub fn method() -> Method {
    Method {
        screening: Screening { cutoff: Some(0.5), ..Screening::as_published() },
        stop: Stop { accuracy: 1e-4, ..Stop::as_published() },
        ..Method::as_published()
    }
}

/// [`method`] with another acceptance rule: accepts designs that stay feasible, independently of the approximation errors.
///
/// From 40 starts within 5 % of the paper's start all runs converge, half of them in at most 11 cycles. With the paper's
/// rule half of the runs take 19 or more cycles, and six of 40 fail.
pub fn robust_method() -> Method {
    let move_limits = RelativeLimits { increase_violation_pct: 3.0, ..RelativeLimits::default() };
    Method { globalization: Box::new(StayFeasible::default()), move_limits: Box::new(move_limits), ..method() }
}

/// Optima I and II of the published problem.
pub const fn published_optima() -> [Optimum; 2] {
    let source = "Etman et al. 1998, Table V, here to four digits";
    [
        Optimum::published(2.882, &[38.39e-3, 25.13e-3, 19.99e-3], source).within(1e-3),
        Optimum::published(2.670, &[37.24e-3, 23.63e-3, 19.84e-3], source).within(1e-3),
    ]
}

/// The optimum III of the published problem with ten times Young's modulus.
pub const fn published_stiff_optimum() -> Optimum {
    let source = "Etman et al. 1998, Table V, here to four digits";
    Optimum::published(2.417, &[35.50e-3, 23.02e-3, 18.02e-3], source).within(1e-3)
}
