//! Verification of what a run claims: its last design is compared with the known solution, independently of the method.

use super::Transformation;
use crate::cases::{CatalogueEntry, KnownSolution, Optimum};
use crate::problem::{DirectCoupling, Problem};
use crate::sao::Status;
use error::{Error, Result};
use nalgebra::DMatrix;
use nlp::{Gradients, Program, Sqp, SubproblemSolver, Values};

/// Relative error of the objective, and violation relative to the terms of the row, up to which a run is at an optimum.
pub const TOLERANCE: f64 = 1e-5;
/// Least terms of a row, relative to the largest ones of its constraint at other time points.
const ROUNDED_TERMS: f64 = 1e-9;
/// Multiple of the noise of an analysis below which differences may be due to it.
const OF_NOISE: f64 = 10.0;
/// Half widths of the local searches, in lengths of the variables.
const WIDTHS: [f64; 2] = [0.01, 0.1];
/// Fraction by which a local search must reduce the violation to refute a claim of infeasibility.
const LESS_VIOLATION: f64 = 0.01;
/// Part of the largest violation to which a row may increase when a smaller violation is sought.
const SMALL_SHARE: f64 = 0.1;

/// The statement of a program about the design at its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Claim {
    /// It is an optimum.
    Converged,
    /// No design in its neighbourhood is feasible.
    Infeasible,
    /// None: a limit was reached, or no progress was made.
    Nothing,
}

impl From<Status> for Claim {
    fn from(status: Status) -> Self {
        match status {
            Status::Converged => Self::Converged,
            Status::Infeasible => Self::Infeasible,
            _ => Self::Nothing,
        }
    }
}

/// Verdict on the claim of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Claimed to be an optimum, and is the best known one.
    Optimum,
    /// Claimed to be an optimum, and is another one that a local search does not improve.
    LocalOptimum,
    /// The problem has no solution. The run claims infeasibility where there is no feasible design, or claims nothing where the
    /// objective has no lower limit.
    CorrectEnd,
    /// Claimed nothing, or infeasibility at a local minimum of the violation.
    Unsolved,
    /// The claim is false.
    False,
}

impl Verdict {
    /// True if the run has solved its problem.
    pub fn is_solved(self) -> bool {
        matches!(self, Self::Optimum | Self::LocalOptimum | Self::CorrectEnd)
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Optimum => "optimum",
            Self::LocalOptimum => "local optimum",
            Self::CorrectEnd => "correct end",
            Self::Unsolved => "honest end",
            Self::False => "FALSE",
        })
    }
}

/// A verdict with the numbers on which it is based.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verification {
    /// The verdict.
    pub verdict: Verdict,
    /// Objective at the end, in the units of the published problem; NaN where the problem is not defined.
    pub objective: f64,
    /// Largest violation at the end, relative to the terms of its row; NaN where the problem is not defined.
    pub violation: f64,
    /// (F − F*) / max(|F*|, min(1, |F(start) − F*|)) for the nearest known optimum, with F(start) at the published start.
    pub excess: Option<f64>,
    /// True if the design is at a known optimum, whatever is claimed of it.
    pub is_reached: bool,
}

impl Verification {
    /// The verification of a claim about a design at which the problem is not defined.
    fn of_undefined(claim: Claim) -> Self {
        let verdict = if claim == Claim::Nothing { Verdict::Unsolved } else { Verdict::False };
        Self { verdict, objective: f64::NAN, violation: f64::NAN, excess: None, is_reached: false }
    }
}

/// Verifies the claim of a run about its last design.
///
/// Terms of a row: Σⱼ |∂ĝ/∂xⱼ| max(|xⱼ|, |xⱼ − x⁰ⱼ|, |xᴾⱼ|), evaluated at the start and at the end, of which the larger one counts; xᴾ is the
/// published start. They are at least 1e-9 of those of other time points. A design
/// is at an optimum if its objective is within 1e-5 of it and no row is violated by more than 1e-5 of its terms. A local optimum is
/// a design of which sequential quadratic programming in boxes of 1 % and 10 % of the lengths of the variables finds no improvement
/// by 1e-5. Infeasibility is false if such a search reduces all violations at once. With noise of the analysis the exact problem
/// is used, to ten times the noise.
///
/// A design at which objective, constraints or their derivatives are not finite is no optimum: any claim about it is false.
///
/// # Errors
/// If the problem cannot be evaluated at the design for another reason.
pub fn verify_claim(
    entry: &CatalogueEntry,
    transformation: &Transformation,
    problem: &Problem,
    claim: Claim,
    design: &[f64],
) -> Result<Verification> {
    // A design is verified with the exact problem, not with noisy analyses.
    let exact = if transformation.noise > 0.0 { Some(transformation.without_noise().build(entry)?) } else { None };
    let end = match VerifiedDesign::new(entry, transformation, exact.as_ref().unwrap_or(problem), design) {
        Err(Error::NotFinite { .. }) => return Ok(Verification::of_undefined(claim)),
        end => end?,
    };
    let known = end.nearest();
    let is_feasible = end.violation <= end.row_tolerance();
    let verdict = match (claim, entry.solution) {
        (Claim::Nothing, KnownSolution::Unbounded) => Verdict::CorrectEnd,
        (Claim::Nothing, _) => Verdict::Unsolved,
        (Claim::Converged, KnownSolution::Infeasible | KnownSolution::Unbounded) => Verdict::False,
        (Claim::Infeasible, _) if is_feasible || end.violation_can_decrease()? => Verdict::False,
        (Claim::Infeasible, KnownSolution::Infeasible) => Verdict::CorrectEnd,
        (Claim::Infeasible, _) => Verdict::Unsolved,
        (Claim::Converged, _) if !is_feasible => Verdict::False,
        (Claim::Converged, _) => match known {
            Some(k) if k.is_reached() && k.is_best => Verdict::Optimum,
            Some(k) if k.is_reached() => Verdict::LocalOptimum,
            _ if end.objective_can_decrease()? => Verdict::False,
            _ => Verdict::LocalOptimum,
        },
    };
    Ok(Verification {
        verdict,
        objective: end.objective,
        violation: end.violation,
        excess: known.map(|k| k.excess),
        is_reached: is_feasible && known.is_some_and(|k| k.is_reached()),
    })
}

/// A known optimum and the distance of the objective from it.
#[derive(Clone, Copy)]
struct KnownDistance {
    optimum: &'static Optimum,
    excess: f64,
    /// Part of the excess that may be due to noise.
    noise: f64,
    is_best: bool,
}

impl KnownDistance {
    fn is_reached(&self) -> bool {
        self.excess.abs() <= TOLERANCE.max(self.optimum.uncertainty).max(self.noise)
    }
}

/// The last design of a run with what is needed to verify the claim.
struct VerifiedDesign<'a> {
    optima: &'static [Optimum],
    transformation: &'a Transformation,
    coupling: DirectCoupling<'a>,
    design: &'a [f64],
    /// Objective in the units of the published problem, and its start value.
    objective: f64,
    start_objective: f64,
    violation: f64,
    terms: Vec<f64>,
    /// Lengths of the variables.
    lengths: Vec<f64>,
}

impl<'a> VerifiedDesign<'a> {
    fn new(
        entry: &CatalogueEntry,
        transformation: &'a Transformation,
        problem: &'a Problem,
        design: &'a [f64],
    ) -> Result<Self> {
        let published = (entry.build)()?;
        // A start that was replaced by zero or a small value gives no sizes of the terms.
        let at_published = published.start();
        let at_start = published.analyze_design(&at_published).map(|d| d.evaluation.objective);
        let coupling = DirectCoupling::new(problem);
        let start = problem.start();
        let optimum = entry.optima().first().and_then(|o| o.design);
        let optimum_length = |j: usize| optimum.map_or(0.0, |o| o[j].abs() * transformation.variables);
        let published_length = |j: usize| at_published[j].abs() * transformation.variables;
        let reach = |j: usize| design[j].abs().max((design[j] - start[j]).abs()).max(published_length(j));
        let reach: Vec<f64> = (0..design.len()).map(reach).collect();
        // Whether a design is a local optimum does not depend on the start of the run.
        let length = |j: usize| design[j].abs().max(published_length(j)).max(optimum_length(j));
        let positive = |length: f64| if length > 0.0 { length } else { transformation.variables };
        let lengths = (0..design.len()).map(|j| positive(length(j))).collect();
        let here = coupling.gradients(design)?;
        let mut terms = row_terms(&here, &reach);
        if let Ok(first) = coupling.gradients(&start) {
            terms.iter_mut().zip(row_terms(&first, &reach)).for_each(|(a, b)| *a = a.max(b));
        }
        // Terms of a time point that vanish are compared with those of the others: a violation of 1e-17 is a rounding error.
        let mut largest = vec![0.0f64; problem.constraints.len()];
        let constraint_of = |i: usize| coupling.row(i).constraint;
        terms.iter().enumerate().for_each(|(i, t)| largest[constraint_of(i)] = largest[constraint_of(i)].max(*t));
        for (i, t) in terms.iter_mut().enumerate() {
            *t = t.max(ROUNDED_TERMS * largest[constraint_of(i)]);
            *t = if *t > 0.0 { *t } else { 1.0 };
        }
        let objective = transformation.published_objective(here.values.objective);
        let mut end = Self {
            // The optima are those of the problem's own time points.
            optima: if transformation.points.is_none() { entry.optima() } else { &[] },
            transformation,
            coupling,
            design,
            objective,
            start_objective: at_start.unwrap_or(objective),
            violation: 0.0,
            terms,
            lengths,
        };
        end.violation = end.violation_of(&here.values.rows);
        Ok(end)
    }

    fn violation_of(&self, rows: &[f64]) -> f64 {
        let of = |i: usize| violated(self.coupling.is_equality(i), rows[i]) / self.terms[i];
        (0..rows.len()).map(of).fold(0.0, f64::max)
    }

    /// Violation in terms of a row below which it counts as none.
    fn row_tolerance(&self) -> f64 {
        TOLERANCE.max(OF_NOISE * self.transformation.noise)
    }

    /// Change of the objective that may be due to noise.
    fn objective_noise(&self) -> f64 {
        OF_NOISE * self.transformation.noise * self.objective.abs().max(self.start_objective.abs())
    }

    fn nearest(&self) -> Option<KnownDistance> {
        let known = |(k, optimum): (usize, &'static Optimum)| {
            let apart = self.objective - optimum.objective;
            let from_start = (self.start_objective - optimum.objective).abs().min(1.0);
            let unit = optimum.objective.abs().max(from_start).max(f64::MIN_POSITIVE);
            KnownDistance { optimum, excess: apart / unit, noise: self.objective_noise() / unit, is_best: k == 0 }
        };
        let all = self.optima.iter().enumerate().map(known);
        all.min_by(|a, b| a.excess.abs().total_cmp(&b.excess.abs()))
    }

    /// True if a local search finds a feasible design with a smaller objective.
    fn objective_can_decrease(&self) -> Result<bool> {
        let apart = self.optima.first().map(|o| (self.objective - o.objective).max(0.0));
        let scale = self.optima.first().map_or(self.objective.abs(), |o| o.objective.abs().max(self.objective.abs()));
        let enough = (TOLERANCE * scale)
            .max(f64::MIN_POSITIVE)
            .min(apart.filter(|a| *a > 0.0).map_or(f64::INFINITY, |a| 0.5 * a))
            .max(self.objective_noise());
        for width in WIDTHS {
            let local = InBox::new(self, width);
            for start in local.starts(self.design) {
                let Ok(found) = Sqp::default().solve(&local, &start) else { continue };
                let objective = self.transformation.published_objective(found.objective);
                if self.violation_of(&found.rows) <= self.violation.max(1e-8) && objective < self.objective - enough {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    /// True if a local search finds a design that is violated less.
    fn violation_can_decrease(&self) -> Result<bool> {
        for width in WIDTHS {
            let local = InBox::new(self, width);
            // All violated rows must decrease together, for the weights between them are the choice of a method. Rows with
            // a small share of the largest violation, relative to their terms and as the problem gives it, may increase to that share.
            let of = |rows: &[f64], i: usize| violated(self.coupling.is_equality(i), rows[i]);
            let here = self.coupling.values(self.design)?.rows;
            let share = (SMALL_SHARE * self.violation).max(self.row_tolerance());
            let largest = (0..here.len()).map(|i| of(&here, i)).fold(0.0, f64::max);
            let small = |i: usize| (share * self.terms[i]).min(SMALL_SHARE.max(self.row_tolerance()) * largest);
            let units: Vec<f64> = (0..here.len()).map(|i| of(&here, i).max(small(i))).collect();
            let least = LeastViolation::new(&local, &units);
            let mut start = self.design.to_vec();
            start.push(1.0);
            let Ok(found) = Sqp::default().solve(&least, &start) else { continue };
            let rows = self.coupling.values(&found.x[..self.design.len()])?.rows;
            if (0..rows.len()).all(|i| of(&rows, i) < (1.0 - LESS_VIOLATION) * units[i]) {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

fn violated(is_equality: bool, row: f64) -> f64 {
    if is_equality { row.abs() } else { row.max(0.0) }
}

fn row_terms(at: &Gradients, reach: &[f64]) -> Vec<f64> {
    at.rows.row_iter().map(|row| row.iter().zip(reach).map(|(g, l)| (g * l).abs()).sum()).collect()
}

/// The problem in a box around a design.
struct InBox<'a> {
    coupling: &'a DirectCoupling<'a>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl<'a> InBox<'a> {
    fn new(end: &'a VerifiedDesign<'a>, width: f64) -> Self {
        let side = |bound: &[f64], sign: f64| -> Vec<f64> {
            let moved = |j: usize| end.design[j] + sign * width * end.lengths[j];
            (0..end.design.len())
                .map(|j| if sign < 0.0 { moved(j).max(bound[j]) } else { moved(j).min(bound[j]) })
                .collect()
        };
        let (lower, upper) = (side(end.coupling.lower(), -1.0), side(end.coupling.upper(), 1.0));
        Self { coupling: &end.coupling, lower, upper }
    }

    /// The design, and two points a tenth of the box away.
    fn starts(&self, design: &[f64]) -> [Vec<f64>; 3] {
        let towards =
            |corner: &dyn Fn(usize) -> f64| (0..design.len()).map(|j| 0.9 * design[j] + 0.1 * corner(j)).collect();
        let alternating = |j: usize| if j.is_multiple_of(2) { self.lower[j] } else { self.upper[j] };
        let opposite = |j: usize| if j.is_multiple_of(2) { self.upper[j] } else { self.lower[j] };
        [design.to_vec(), towards(&alternating), towards(&opposite)]
    }
}

impl Program for InBox<'_> {
    fn variables(&self) -> usize {
        self.lower.len()
    }
    fn rows(&self) -> usize {
        self.coupling.rows()
    }
    fn lower(&self) -> &[f64] {
        &self.lower
    }
    fn upper(&self) -> &[f64] {
        &self.upper
    }
    fn is_equality(&self, i: usize) -> bool {
        self.coupling.is_equality(i)
    }
    fn values(&self, x: &[f64]) -> Result<Values> {
        self.coupling.values(x)
    }
    fn gradients(&self, x: &[f64]) -> Result<Gradients> {
        self.coupling.gradients(x)
    }
}

/// min t subject to gᵢ ≤ t τᵢ with the terms τᵢ; an equality gives two rows.
struct LeastViolation<'a> {
    inner: &'a InBox<'a>,
    terms: &'a [f64],
    /// Row of the problem and sign of each row.
    sides: Vec<(usize, f64)>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl<'a> LeastViolation<'a> {
    fn new(inner: &'a InBox<'a>, terms: &'a [f64]) -> Self {
        let signs = |i: usize| if inner.is_equality(i) { &[1.0, -1.0][..] } else { &[1.0][..] };
        let sides = (0..inner.rows()).flat_map(|i| signs(i).iter().map(move |&s| (i, s))).collect();
        let with = |side: &[f64], t: f64| side.iter().copied().chain([t]).collect();
        let (lower, upper) = (with(&inner.lower, 0.0), with(&inner.upper, f64::INFINITY));
        Self { inner, terms, sides, lower, upper }
    }

    fn rows_at(&self, rows: &[f64], t: f64) -> Vec<f64> {
        self.sides.iter().map(|&(i, sign)| sign * rows[i] / self.terms[i] - t).collect()
    }
}

impl Program for LeastViolation<'_> {
    fn variables(&self) -> usize {
        self.lower.len()
    }
    fn rows(&self) -> usize {
        self.sides.len()
    }
    fn lower(&self) -> &[f64] {
        &self.lower
    }
    fn upper(&self) -> &[f64] {
        &self.upper
    }
    fn values(&self, x: &[f64]) -> Result<Values> {
        let (t, x) = x.split_last().expect("there is at least the violation");
        Ok(Values { objective: *t, rows: self.rows_at(&self.inner.values(x)?.rows, *t) })
    }
    fn gradients(&self, x: &[f64]) -> Result<Gradients> {
        let (t, x) = x.split_last().expect("there is at least the violation");
        let (n, at) = (x.len(), self.inner.gradients(x)?);
        let slope = |k: usize, j: usize| {
            let (i, sign) = self.sides[k];
            if j == n { -1.0 } else { sign * at.rows[(i, j)] / self.terms[i] }
        };
        let mut objective = vec![0.0; n + 1];
        objective[n] = 1.0;
        let values = Values { objective: *t, rows: self.rows_at(&at.values.rows, *t) };
        Ok(Gradients { values, objective, rows: DMatrix::from_fn(self.sides.len(), n + 1, slope) })
    }
}
