//! The optimization problem (1)–(3), and its evaluation in plain numbers.

use super::quantity::{QuantityForm, SignedQuantity};
use super::{
    Analysis, AnalyzedDesign, Constraint, DesignVariable, Evaluation, Intermediates, Objective, PeakBound, Quantity,
    Response, ResponseAt, Responses, RowId, TimeGrid,
};
use super::{PeakTime, maxima, words};
use error::{Error, Result};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::HashSet;

/// Minimize F(r(b, t), b, t) subject to g_j(r(b, t), b, t) ≤ c_j and bˡ ≤ b ≤ bᵘ.
///
/// [`ProblemBuilder`](super::ProblemBuilder) builds it and checks that the parts are consistent.
///
/// # Examples
///
/// ```
/// let problem = linkwright_optimization::cases::impact_absorber::peak_acceleration()?;
/// let here = problem.analyze_design(&problem.start())?;
/// let (row, _) = here.evaluation.worst().expect("the problem has constraints");
/// assert_eq!(problem.row_in_words(row), "peak acceleration lower at time 1.08 s");
/// # Ok::<(), linkwright_optimization::Error>(())
/// ```
pub struct Problem {
    /// Name, for tables and files.
    pub name: String,
    /// Design variables b, n of them.
    pub variables: Vec<DesignVariable>,
    /// Time grids.
    pub grids: Vec<TimeGrid>,
    /// Responses r.
    pub responses: Vec<Response>,
    /// Objective F.
    pub objective: Objective,
    /// Constraints g_j, m of them.
    pub constraints: Vec<Constraint>,
    /// The analysis that computes the responses.
    pub analysis: Box<dyn Analysis>,
}

impl Problem {
    /// Number of design variables n.
    pub fn n(&self) -> usize {
        self.variables.len()
    }

    /// The start design.
    pub fn start(&self) -> Vec<f64> {
        self.variables.iter().map(|v| v.start).collect()
    }

    /// Number of time points of a quantity: 1 for a time-independent one.
    pub fn points_of(&self, quantity: &Quantity) -> usize {
        match quantity.form {
            QuantityForm::EachPoint(grid, _) => self.grids[grid].len(),
            QuantityForm::Plain(_) | QuantityForm::AtTime(_) | QuantityForm::Whole(..) => 1,
        }
    }

    /// True if constraint `j` holds at time point `p`: everywhere unless it has a [window](Constraint::window).
    pub fn holds(&self, j: usize, p: usize) -> bool {
        let constraint = &self.constraints[j];
        constraint.window.is_none()
            || constraint.quantity.grid().is_none_or(|grid| constraint.points_in(&self.grids[grid]).contains(&p))
    }

    /// True if constraint `j` is one of f ≤ β and f ≥ −β, which bound the peak of a min–max objective.
    pub fn bounds_peak(&self, j: usize) -> bool {
        let constraint = &self.constraints[j];
        self.objective.peak().is_some_and(|peak| {
            peak.constraints.contains(&j) || (constraint.bound == Some(peak.variable) && constraint.limit == 0.0)
        })
    }

    /// The objective of a min–max problem at an analysed design: the largest |f| over the time points at which it counts, which
    /// is not the variable β that bounds it; `None` for other objectives.
    pub fn peak_objective(&self, design: &[f64], evaluation: &Evaluation) -> Option<f64> {
        let bound = design[self.objective.peak()?.variable];
        let values = |j: usize| {
            let rows = evaluation.residuals[j].iter().enumerate().filter(move |(p, _)| self.holds(j, *p));
            rows.map(move |(_, c)| bound + self.constraints[j].scale * c)
        };
        (0..self.constraints.len()).filter(|&j| self.bounds_peak(j)).flat_map(values).reduce(f64::max)
    }

    /// The analysed design with the bound variable of a min–max objective at its peak, as far as the bounds of the variable allow: the
    /// objective is then the peak itself, and constraints f ≤ β and f ≥ −β are not violated. Other problems keep their design, and so do those
    /// in which another constraint changes with β: its limit may require a larger one.
    ///
    /// # Errors
    ///
    /// As [`evaluate`](Self::evaluate).
    pub fn with_bound_at_peak(&self, analyzed: AnalyzedDesign) -> Result<AnalyzedDesign> {
        let Some(PeakBound { variable, .. }) = self.objective.peak() else { return Ok(analyzed) };
        let mut design = analyzed.design.clone();
        // From zero the peak does not have the rounding errors of the proposed bound.
        design[variable] = 0.0;
        let Some(peak) = self.peak_objective(&design, &self.evaluate(&design, &analyzed.responses)?) else {
            return Ok(analyzed);
        };
        let DesignVariable { lower, upper, .. } = self.variables[variable];
        design[variable] = peak.max(lower).min(upper);
        let evaluation = self.evaluate(&design, &analyzed.responses)?;
        let is_changed = |j: usize| evaluation.residuals[j] != analyzed.evaluation.residuals[j];
        if (0..self.constraints.len()).any(|j| !self.bounds_peak(j) && is_changed(j)) {
            return Ok(analyzed);
        }
        Ok(AnalyzedDesign { design, responses: analyzed.responses, evaluation })
    }

    /// Every constraint at every time point at which it holds.
    pub fn all_rows(&self) -> Vec<RowId> {
        let of = |(constraint, c): (usize, &Constraint)| {
            let points = (0..self.points_of(&c.quantity)).filter(move |&p| self.holds(constraint, p));
            points.map(move |point| RowId { constraint, point })
        };
        self.constraints.iter().enumerate().flat_map(of).collect()
    }

    /// The other side of a two-sided constraint.
    pub fn partner(&self, j: usize) -> Option<usize> {
        let pair = self.constraints[j].pair.as_ref()?;
        (0..self.constraints.len()).find(|&k| k != j && self.constraints[k].pair.as_ref() == Some(pair))
    }

    /// Analyses design `b` and checks shape and finiteness of every response.
    ///
    /// # Errors
    ///
    /// [`Error::NotFinite`] with response, time and design, or the error of the analysis.
    pub fn analyze(&self, b: &[f64]) -> Result<Responses> {
        Error::check_length("design", self.n(), b.len())?;
        self.checked(b, self.analysis.analyze(&self.analysis_design(b))?)
    }

    /// The design for the analysis: with the start of the bound variable of a min–max objective, on which the analysis does not depend. Stored
    /// steps of an analysis are found again by its design, for all values of that variable.
    pub(super) fn analysis_design<'b>(&self, b: &'b [f64]) -> Cow<'b, [f64]> {
        let mut design = Cow::Borrowed(b);
        if let Some(PeakBound { variable, .. }) = self.objective.peak() {
            design.to_mut()[variable] = self.variables[variable].start;
        }
        design
    }

    /// The responses at design `b`, if their shape is correct and all values are finite.
    fn checked(&self, b: &[f64], responses: Responses) -> Result<Responses> {
        self.check_shape(&responses)?;
        for (response, (declared, values)) in self.responses.iter().zip(&responses.values).enumerate() {
            if let Some(point) = values.iter().position(|v| !v.is_finite()) {
                let what = format!("response `{}`", declared.name);
                let time = declared.grid.map(|grid| (&self.grids[grid], point));
                let why = self.analysis.undefined(b, ResponseAt { response, point });
                return Err(words::not_finite(what, values[point], time, &self.variables, b, why));
            }
        }
        Ok(responses)
    }

    /// Analyses design `b` and evaluates objective and constraints there.
    ///
    /// # Errors
    ///
    /// As [`analyze`](Self::analyze) and [`evaluate`](Self::evaluate).
    pub fn analyze_design(&self, b: &[f64]) -> Result<AnalyzedDesign> {
        let responses = self.analyze(b)?;
        let evaluation = self.evaluate(b, &responses)?;
        Ok(AnalyzedDesign { design: b.to_vec(), responses, evaluation })
    }

    /// As [`analyze_design`](Self::analyze_design), without the trace: for a design at which no derivatives are needed. A program is not asked for
    /// them.
    ///
    /// # Errors
    ///
    /// Those of [`analyze_design`](Self::analyze_design).
    pub fn analyze_values(&self, b: &[f64]) -> Result<AnalyzedDesign> {
        let one = self.analyze_designs(&[b.to_vec()]).pop();
        one.unwrap_or_else(|| self.analyze_design(b))
    }

    /// Analyses and evaluates many designs by [`Analysis::analyze_many`], by default in parallel: the result of
    /// [`analyze_design`](Self::analyze_design) for each, without traces.
    pub fn analyze_designs(&self, designs: &[Vec<f64>]) -> Vec<Result<AnalyzedDesign>> {
        if let Some(b) = designs.iter().find(|b| b.len() != self.n()) {
            let wrong = || Error::check_length("design", self.n(), b.len()).expect_err("the lengths differ");
            return designs.iter().map(|_| Err(wrong())).collect();
        }
        let evaluated = |(b, responses): (&Vec<f64>, Result<Responses>)| {
            let responses = self.checked(b, responses?)?;
            let evaluation = self.evaluate(b, &responses)?;
            Ok(AnalyzedDesign { design: b.clone(), responses, evaluation })
        };
        let mut for_analysis = Cow::Borrowed(designs);
        if let Some(PeakBound { variable, .. }) = self.objective.peak() {
            for_analysis.to_mut().iter_mut().for_each(|design| design[variable] = self.variables[variable].start);
        }
        designs.par_iter().zip(self.analysis.analyze_many(&for_analysis)).map(evaluated).collect()
    }

    /// Checks that every response has a value at every point of its grid.
    ///
    /// # Errors
    ///
    /// [`Error::Length`] otherwise.
    pub fn check_shape(&self, responses: &Responses) -> Result<()> {
        Error::check_length("responses of the analysis", self.responses.len(), responses.values.len())?;
        for (declared, values) in self.responses.iter().zip(&responses.values) {
            let points = declared.grid.map_or(1, |g| self.grids[g].len());
            Error::check_length(&format!("values of response `{}`", declared.name), points, values.len())?;
        }
        Ok(())
    }

    /// Checks that design `b` has the right length and is within its bounds.
    ///
    /// # Errors
    ///
    /// [`Error::Length`] or [`Error::Definition`] otherwise.
    pub fn check_design(&self, b: &[f64]) -> Result<()> {
        Error::check_length("design", self.n(), b.len())?;
        self.variables.iter().zip(b).try_for_each(|(variable, &b)| variable.check_start(b))
    }

    /// Objective and normalized constraints at design `b` from its responses.
    ///
    /// # Errors
    ///
    /// [`Error::Length`] for a wrong shape, [`Error::NotFinite`] for a value that is not finite.
    pub fn evaluate(&self, b: &[f64], responses: &Responses) -> Result<Evaluation> {
        Error::check_length("design", self.n(), b.len())?;
        self.check_shape(responses)?;
        let at = |g: SignedQuantity, p| g.value(p, &self.grids, b, |h, p| self.read(responses, h, p));
        let objective = at(self.objective.signed(), 0);
        if !objective.is_finite() {
            return Err(self.not_finite(format!("objective `{}`", self.objective.name), objective, None, 0, b));
        }
        let mut residuals = Vec::with_capacity(self.constraints.len());
        let mut peaks: Vec<PeakTime> = vec![];
        for (j, constraint) in self.constraints.iter().enumerate() {
            let outside = if constraint.is_equality() { 0.0 } else { -1.0 };
            let value = |p| {
                if self.holds(j, p) { constraint.residual(at(constraint.signed(), p)) } else { outside }
            };
            let mut history: Vec<f64> = (0..self.points_of(&constraint.quantity)).map(value).collect();
            if let Some(p) = history.iter().position(|v| !v.is_finite()) {
                let what = format!("constraint `{}`", constraint.name);
                return Err(self.not_finite(what, history[p], constraint.quantity.grid(), p, b));
            }
            if constraint.is_continuous {
                peaks.extend(self.refine(j, b, responses, &mut history)?);
            }
            residuals.push(history);
        }
        let equalities = (0..self.constraints.len()).filter(|&j| self.constraints[j].is_equality()).collect();
        Ok(Evaluation { objective, residuals, equalities, peaks })
    }

    /// Replaces the values of time points that are local maxima by those of the peaks, which are returned.
    fn refine(&self, j: usize, b: &[f64], responses: &Responses, history: &mut [f64]) -> Result<Vec<PeakTime>> {
        let mut peaks: Vec<PeakTime> = vec![];
        for point in maxima(history) {
            let Some((time, value)) = self.peak_near(j, b, responses, point)? else { continue };
            // A peak between the first or the last two time points is near both of them.
            if peaks.last().is_none_or(|last| (time - last.time).abs() > 1e-9 * time.abs()) {
                history[point] = history[point].max(value);
                peaks.push(PeakTime { row: RowId { constraint: j, point }, time });
            }
        }
        Ok(peaks)
    }

    /// A scale for each variable, constant during a run: its range if it is bounded, else |its start|, else 1.
    pub fn scales(&self) -> Vec<f64> {
        let scale = |v: &DesignVariable| {
            let range = v.upper - v.lower;
            if range.is_finite() && range > 0.0 {
                range
            } else if v.start != 0.0 {
                v.start.abs()
            } else {
                1.0
            }
        };
        self.variables.iter().map(scale).collect()
    }

    /// Names of the responses, and of objective and constraints that are approximated directly.
    pub fn approximated(&self) -> impl Iterator<Item = &str> {
        let objective = self.objective.quantity.direct.is_some().then_some(self.objective.name.as_str());
        let direct = self.constraints.iter().filter(|c| c.quantity.direct.is_some()).map(|c| c.name.as_str());
        self.responses.iter().map(|r| r.name.as_str()).chain(objective).chain(direct)
    }

    /// Response `h` at time point `p`; a time-independent response has the same value at all points.
    fn read(&self, responses: &Responses, h: usize, p: usize) -> f64 {
        responses.values[h][if self.responses[h].grid.is_some() { p } else { 0 }]
    }

    /// The time of point `p` in words, with the unit of its grid.
    pub fn time_in_words(&self, grid: Option<usize>, p: usize) -> String {
        grid.map_or_else(|| "no particular time".to_owned(), |grid| self.grids[grid].point_in_words(p))
    }

    /// The design in words: `k = 1 N/m, c = 0.3 N·s/m`.
    pub fn design_in_words(&self, b: &[f64]) -> String {
        words::design(&self.variables, b)
    }

    /// A constraint and its time in words: `displacement at time 1.2 s`.
    pub fn row_in_words(&self, row: RowId) -> String {
        let constraint = &self.constraints[row.constraint];
        if constraint.quantity.is_transient() {
            format!("{} at {}", constraint.name, self.time_in_words(constraint.quantity.grid(), row.point))
        } else {
            constraint.name.clone()
        }
    }

    pub(super) fn not_finite(&self, what: String, value: f64, grid: Option<usize>, p: usize, b: &[f64]) -> Error {
        words::not_finite(what, value, grid.map(|grid| (&self.grids[grid], p)), &self.variables, b, None)
    }

    /// A hash of all names, bounds, limits, windows and time points, which identifies a problem. Units for display are not a part of it.
    pub fn fingerprint(&self) -> u64 {
        let Objective { name, goal, quantity, .. } = &self.objective;
        let mut text = format!("{} {name} {goal:?} {:?} {:?}", self.name, quantity.uses, self.variables);
        for TimeGrid { name, points, .. } in &self.grids {
            text += &format!(" {name} {points:?}");
        }
        for r in &self.responses {
            text += &format!(" {} {:?} {:?}", r.name, r.grid, r.intermediates);
        }
        for c in &self.constraints {
            text += &format!(" {} {} {} {:?}", c.name, c.signed_limit(), c.scale, c.quantity.uses);
            if let Some(window) = c.window {
                text += &format!(" {window:?}");
            }
            if c.is_equality() || c.is_continuous {
                text += &format!(" {} {}", c.is_equality(), c.is_continuous);
            }
        }
        crate::storage::fnv1a(&text)
    }

    /// Checks that the parts are consistent, when a problem is built and again when a run starts, since fields are public.
    ///
    /// # Errors
    ///
    /// [`Error::Definition`], [`Error::Option`] or [`Error::Length`] with the name of the first inconsistent part.
    pub fn check(&self) -> Result<()> {
        if self.variables.is_empty() {
            return Err(Error::definition(&self.name, "there is no design variable", "add at least one"));
        }
        unique("design variable", self.variables.iter().map(|v| &v.name))?;
        unique("response", self.responses.iter().map(|r| &r.name))?;
        unique("constraint", self.constraints.iter().map(|c| &c.name))?;
        self.variables.iter().try_for_each(DesignVariable::check)?;
        self.grids.iter().try_for_each(TimeGrid::check)?;
        self.responses
            .iter()
            .try_for_each(|r| self.check_intermediates(&format!("response `{}`", r.name), &r.intermediates))?;
        self.check_objective()?;
        self.constraints.iter().try_for_each(|constraint| self.check_constraint(constraint))
    }

    fn check_objective(&self) -> Result<()> {
        let Objective { name, quantity, .. } = &self.objective;
        self.check_quantity(&format!("objective `{name}`"), quantity)?;
        if quantity.is_transient() {
            let remedy = "minimize a sum or an integral over the grid, or its peak with `minimize_peak`";
            return Err(Error::definition(name, "the objective is a history, not a number", remedy));
        }
        let exists = self.objective.peak().is_none_or(|peak| {
            peak.variable < self.n() && peak.constraints.into_iter().all(|j| j < self.constraints.len())
        });
        if !exists {
            let why = "the bound variable of its peak, or a constraint by it, does not exist";
            return Err(Error::definition(format!("objective `{name}`"), why, "make it with `minimize_peak`"));
        }
        Ok(())
    }

    fn check_constraint(&self, constraint: &Constraint) -> Result<()> {
        let what = format!("constraint `{}`", constraint.name);
        self.check_quantity(&what, &constraint.quantity)?;
        let option = |word| format!("{word} of {what}");
        Error::check_option(&option("limit"), "finite", constraint.limit, constraint.limit.is_finite())?;
        let positive = constraint.scale > 0.0 && constraint.scale.is_finite();
        Error::check_option(&option("scale"), "positive and finite", constraint.scale, positive)?;
        let refused = |why: &str, remedy| Err(Error::definition(&what, why, remedy));
        let (is_transient, direct) = (constraint.quantity.is_transient(), constraint.quantity.direct.is_some());
        let grid = constraint.quantity.grid();
        if constraint.bound.is_some_and(|k| k >= self.n()) {
            return refused("its bound variable does not exist", "use the index that adding the variable returned");
        }
        if constraint.is_continuous && !is_transient {
            return refused(
                "it holds in continuous time, but has one value only",
                "make its quantity with `each_point`",
            );
        }
        if constraint.is_continuous && (constraint.is_equality() || direct) {
            let why = "an equality, or a quantity that is approximated directly, cannot hold in continuous time";
            return refused(why, "use the time points");
        }
        if constraint.window.is_none() {
            return Ok(());
        }
        if !is_transient || constraint.is_continuous {
            let why = "only a constraint at the time points of a grid can hold in a part of them";
            return refused(why, "remove its window");
        }
        if grid.is_some_and(|grid| constraint.points_in(&self.grids[grid]).is_empty()) {
            return refused("no time point is inside its window", "widen the window");
        }
        Ok(())
    }

    fn check_intermediates(&self, of: &str, intermediates: &Intermediates) -> Result<()> {
        match intermediates {
            Intermediates::Each(choice) => {
                Error::check_length(&format!("intermediate variables of {of}"), self.n(), choice.len())
            }
            Intermediates::Identity | Intermediates::Map(_) => Ok(()),
        }
    }

    fn check_quantity(&self, what: &str, quantity: &Quantity) -> Result<()> {
        if quantity.grid().is_some_and(|g| g >= self.grids.len()) {
            return Err(Error::definition(what, "its time grid does not exist", "add the grid and use its index"));
        }
        if let QuantityForm::Whole(grid, functional) = &quantity.form {
            let points = self.grids[*grid].len();
            Error::check_length(&format!("{what}: weights"), points, functional.made_for().unwrap_or(points))?;
        }
        if let Some(intermediates) = &quantity.direct {
            self.check_intermediates(what, intermediates)?;
        }
        for &h in &quantity.uses {
            let Some(response) = self.responses.get(h) else {
                let why = format!("it uses response number {h}, but there are {}", self.responses.len());
                return Err(Error::definition(what, why, "use the index that adding the response returned"));
            };
            if response.grid.is_some() && response.grid != quantity.grid() {
                let why = format!("it uses `{}`, which has another time grid", response.name);
                return Err(Error::definition(what, why, "give both the same grid"));
            }
        }
        Ok(())
    }
}

fn unique<'a>(what: &str, names: impl Iterator<Item = &'a String>) -> Result<()> {
    let mut seen = HashSet::new();
    for name in names {
        if !seen.insert(name) {
            let remedy = "give every part its own name";
            return Err(Error::definition(format!("{what} `{name}`"), "the name is taken twice", remedy));
        }
    }
    Ok(())
}
