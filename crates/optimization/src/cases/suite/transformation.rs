//! Transformations that do not change the solution of a problem, except for its units: scaling, other starts, and noise.

use super::noise::{Absent, Noisy};
use crate::cases::CatalogueEntry;
use crate::cases::random::{SplitMix64, symmetric};
use crate::problem::{
    Analysis, AnyFunction, AnyFunctional, ContinuousTime, DesignVariable, Intermediates, Point, Problem, QuantityForm,
    ResponseAt, Responses,
};
use autodiff::{Dual, HyperDual, PolynomialDegree};
use error::{Error, Result};
use nalgebra::DMatrix;
use std::sync::Arc;

/// Replacement of the start design.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum StartDesign {
    /// The start of the problem.
    #[default]
    Standard,
    /// This value for all variables, moved inside the bounds.
    Constant(f64),
    /// Each variable times 1 + w u with u random in [−1, 1]; a variable that starts at zero moves by w u times its optimum, or w u.
    Random {
        /// Half width w: 0.3 for ±30 %.
        half_width: f64,
        /// Number of the random start.
        seed: u64,
    },
}

/// Scaling of a problem, replacement of its start, and noise of its analyses.
///
/// # Examples
/// ```
/// use linkwright_optimization::cases::suite::Transformation;
/// let t = Transformation::parse("objective=1e6,variables=1e-3")?;
/// assert_eq!((t.objective, t.variables, t.constraints), (1e6, 1e-3, 1.0));
/// # Ok::<(), linkwright_optimization::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transformation {
    /// Factor of the objective.
    pub objective: f64,
    /// Constant that is added to the objective.
    pub offset: f64,
    /// Factor of all variables.
    pub variables: f64,
    /// Factor of all constraints.
    pub constraints: f64,
    /// The start design.
    pub start: StartDesign,
    /// Number of time points of a problem of the suite `time`; `None` for its own.
    pub points: Option<usize>,
    /// True for objective and rows that are given directly as functions of the design, not by responses.
    pub explicit: bool,
    /// Noise σ of all responses: r + σ u max(|r|, |r⁰|) with the value r⁰ at the start and a random u in [−1, 1] for each design.
    /// They are differentiated by noise-aware differences, and peaks are those of the time points.
    pub noise: f64,
}

impl Default for Transformation {
    /// No change.
    fn default() -> Self {
        Self {
            objective: 1.0,
            offset: 0.0,
            variables: 1.0,
            constraints: 1.0,
            start: StartDesign::Standard,
            points: None,
            explicit: false,
            noise: 0.0,
        }
    }
}

impl std::fmt::Display for Transformation {
    /// The text that [`Transformation::parse`] reads; `standard` for no change.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut parts: Vec<String> = [
            ("objective", self.objective, 1.0),
            ("offset", self.offset, 0.0),
            ("variables", self.variables, 1.0),
            ("constraints", self.constraints, 1.0),
        ]
        .into_iter()
        .filter(|(_, value, neutral)| value != neutral)
        .map(|(key, value, _)| format!("{key}={value:e}"))
        .collect();
        match self.start {
            StartDesign::Standard => {}
            StartDesign::Constant(value) => parts.push(format!("start={value:e}")),
            StartDesign::Random { half_width, seed } => parts.push(format!("random={half_width},seed={seed}")),
        }
        parts.extend(self.points.map(|points| format!("points={points}")));
        parts.extend(self.explicit.then(|| "explicit".to_owned()));
        parts.extend((self.noise > 0.0).then(|| format!("noise={:e}", self.noise)));
        f.write_str(if parts.is_empty() { "standard".to_owned() } else { parts.join(",") }.as_str())
    }
}

/// Other units of objective, variables and constraints.
const SCALINGS: &[&str] = &[
    "objective=1e-12",
    "objective=1e-6",
    "objective=1e6",
    "objective=1e12",
    "offset=1e4",
    "variables=1e-3",
    "variables=1e3",
    "constraints=1e-3",
    "constraints=1e3",
];

impl Transformation {
    /// Reads `objective=`, `offset=`, `variables=`, `constraints=`, `start=`, `random=` (half width), `seed=`, `points=` and
    /// `noise=` with numbers and `explicit`, separated by commas, or `standard`.
    ///
    /// # Errors
    /// [`Error::Definition`] for another word or a value that is not a number, [`Error::Option`] for a factor that is not positive,
    /// less than two points, or a noise of 1 or more.
    pub fn parse(text: &str) -> Result<Self> {
        let mut read = Self::default();
        let (mut random, mut seed) = (None, 1);
        for part in text.split(',').filter(|part| *part != "standard") {
            if part == "explicit" {
                read.explicit = true;
                continue;
            }
            let wrong = |why: &str| {
                let remedy = "write KEY=NUMBER with objective, offset, variables, constraints, start, random, seed, points or noise, \
                    or explicit";
                Error::definition(format!("transformation `{part}`"), why, remedy)
            };
            let (key, value) = part.split_once('=').ok_or_else(|| wrong("it has no `=`"))?;
            let value: f64 = value.parse().map_err(|_| wrong("the value is not a number"))?;
            match key {
                "objective" => read.objective = value,
                "offset" => read.offset = value,
                "variables" => read.variables = value,
                "constraints" => read.constraints = value,
                "start" => read.start = StartDesign::Constant(value),
                "random" => random = Some(value),
                "seed" => seed = value as u64,
                "points" => {
                    let is_count = (2.0..=1e7).contains(&value) && value.fract() == 0.0;
                    Error::check_option("number of time points", "a whole number from 2 to 1e7", value, is_count)?;
                    read.points = Some(value as usize);
                }
                "noise" => {
                    Error::check_option("noise", "at least 0 and below 1", value, (0.0..1.0).contains(&value))?;
                    read.noise = value;
                }
                _ => return Err(wrong("the word is unknown")),
            }
        }
        if let Some(half_width) = random {
            read.start = StartDesign::Random { half_width, seed };
        }
        for (name, factor) in
            [("objective", read.objective), ("variables", read.variables), ("constraints", read.constraints)]
        {
            Error::check_option(
                &format!("factor of the {name}"),
                "positive",
                factor,
                factor > 0.0 && factor.is_finite(),
            )?;
        }
        Ok(read)
    }

    /// Reads a transformation, or the name of a set of them: `scalings` (units of objective, variables and constraints), `starts` (0,
    /// 0.001, and five random ones each within ±30 % and ±60 %), or `all` (both, and the standard one).
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_set(text: &str) -> Result<Vec<Self>> {
        let each = |texts: &[&str]| texts.iter().map(|text| Self::parse(text)).collect::<Result<Vec<_>>>();
        match text {
            "scalings" => each(SCALINGS),
            "starts" => {
                let random = |half_width| (1..=5).map(move |seed| StartDesign::Random { half_width, seed });
                let constant = [0.0, 1e-3].map(StartDesign::Constant);
                let starts = constant.into_iter().chain(random(0.3)).chain(random(0.6));
                Ok(starts.map(|start| Self { start, ..Self::default() }).collect())
            }
            "all" => Ok([vec![Self::default()], Self::parse_set("scalings")?, Self::parse_set("starts")?].concat()),
            one => Ok(vec![Self::parse(one)?]),
        }
    }

    /// Builds the problem of an entry, transformed.
    ///
    /// Bound variables of a min–max objective keep their unit, which is that of the objective.
    ///
    /// # Errors
    /// If the problem cannot be built, or has no number of time points that could be replaced.
    pub fn build(&self, entry: &CatalogueEntry) -> Result<Problem> {
        let without = |why, remedy| Error::definition(format!("problem `{}`", entry.name), why, remedy);
        let fixed = || without("its number of time points is fixed", "use `points` with the suite `time`");
        let by_analysis =
            || without("its responses come from an analysis", "use `explicit` with the suites `hs` and `adversarial`");
        let mut problem = match self.points {
            _ if self.explicit => entry.explicit.ok_or_else(by_analysis)?()?,
            None => (entry.build)()?,
            Some(points) => entry.on_points.ok_or_else(fixed)?(points)?,
        };
        self.move_start(entry, &mut problem);
        for constraint in &mut problem.constraints {
            constraint.scale /= self.constraints;
        }
        let scaled = self.scaled(&problem);
        if !scaled.is_neutral() {
            scaled.apply(&mut problem);
        }
        if self.noise > 0.0 {
            Noisy::replace(&mut problem, self.noise);
        }
        Ok(problem)
    }

    /// This transformation without its noise.
    pub(super) fn without_noise(&self) -> Self {
        Self { noise: 0.0, ..*self }
    }

    /// The objective in the units of the problem as published, from that of the transformed one.
    pub fn published_objective(&self, objective: f64) -> f64 {
        (objective - self.offset) / self.objective
    }

    fn move_start(&self, entry: &CatalogueEntry, problem: &mut Problem) {
        let optimum = entry.optima().first().and_then(|o| o.design);
        let moved = |j: usize, variable: &DesignVariable| match self.start {
            StartDesign::Standard => variable.start,
            StartDesign::Constant(value) => value,
            StartDesign::Random { half_width, seed } => {
                let size = if variable.start != 0.0 { variable.start } else { optimum.map_or(1.0, |d| d[j]) };
                let size = if size == 0.0 { 1.0 } else { size };
                variable.start + half_width * uniform(entry.name, seed, j) * size
            }
        };
        for (j, variable) in problem.variables.iter_mut().enumerate() {
            variable.start = moved(j, variable).max(variable.lower).min(variable.upper);
        }
    }

    fn scaled(&self, problem: &Problem) -> Scaled {
        let bound_variables: Vec<usize> = problem.constraints.iter().filter_map(|c| c.bound).collect();
        let mapped = problem.responses.iter().any(|r| matches!(r.intermediates, Intermediates::Map(_)));
        let factor = |j: usize| if mapped || bound_variables.contains(&j) { 1.0 } else { self.variables };
        let only = |h: &usize| problem.constraints.iter().all(|c| !c.quantity.responses().contains(h));
        Scaled {
            variables: (0..problem.n()).map(factor).collect(),
            response: problem.objective.quantity.as_response().filter(only),
            affine: [self.objective, self.offset],
        }
    }
}

/// A number in [−1, 1) from the name of a problem, the seed and the variable.
fn uniform(name: &str, seed: u64, j: usize) -> f64 {
    let of_seed = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    symmetric(SplitMix64::new(crate::storage::fnv1a(name) ^ of_seed).after(j as u64).bits())
}

/// Factors of the variables; factor and constant of the response that is the objective, or of the objective's function.
#[derive(Clone)]
struct Scaled {
    variables: Vec<f64>,
    response: Option<usize>,
    affine: [f64; 2],
}

impl Scaled {
    fn is_neutral(&self) -> bool {
        self.affine == [1.0, 0.0] && self.variables.iter().all(|&c| c == 1.0)
    }

    /// Changes the units of a problem.
    fn apply(self, problem: &mut Problem) {
        for (variable, factor) in problem.variables.iter_mut().zip(&self.variables) {
            for value in [&mut variable.start, &mut variable.lower, &mut variable.upper] {
                *value *= factor;
            }
        }
        let functions = problem.constraints.iter_mut().map(|c| (&mut c.quantity.form, [1.0, 0.0]));
        let objective = if self.response.is_some() { [1.0, 0.0] } else { self.affine };
        for (form, affine) in functions.chain([(&mut problem.objective.quantity.form, objective)]) {
            wrap(form, &self.variables, affine);
        }
        let inner = std::mem::replace(&mut problem.analysis, Box::new(Absent));
        problem.analysis = Box::new(ScaledAnalysis { inner, scaled: self });
    }

    /// The design in the units of the inner analysis.
    fn inner(&self, b: &[f64]) -> Vec<f64> {
        b.iter().zip(&self.variables).map(|(b, c)| b / c).collect()
    }

    /// Factor and constant of a response.
    fn of(&self, h: usize) -> [f64; 2] {
        if self.response == Some(h) { self.affine } else { [1.0, 0.0] }
    }

    fn scale_row(&self, h: usize, row: &mut [f64]) {
        let factor = self.of(h)[0];
        row.iter_mut().zip(&self.variables).for_each(|(v, c)| *v *= factor / c);
    }

    fn scale_matrix(&self, h: usize, matrix: &mut DMatrix<f64>) {
        let factor = self.of(h)[0];
        for i in 0..matrix.nrows() {
            for j in 0..matrix.ncols() {
                matrix[(i, j)] *= factor / (self.variables[i] * self.variables[j]);
            }
        }
    }
}

/// An analysis in other units of the variables and of the response that is the objective.
struct ScaledAnalysis {
    inner: Box<dyn Analysis>,
    scaled: Scaled,
}

impl ScaledAnalysis {
    /// The responses of the inner analysis, which needs their trace only.
    fn original(&self, responses: &Responses) -> Responses {
        let mut original = responses.clone();
        if let Some(h) = self.scaled.response {
            let [factor, constant] = self.scaled.affine;
            original.values[h].iter_mut().for_each(|v| *v = (*v - constant) / factor);
        }
        original
    }
}

impl Analysis for ScaledAnalysis {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let mut responses = self.inner.analyze(&self.scaled.inner(b))?;
        for (h, values) in responses.values.iter_mut().enumerate() {
            let [factor, constant] = self.scaled.of(h);
            if [factor, constant] != [1.0, 0.0] {
                values.iter_mut().for_each(|v| *v = *v * factor + constant);
            }
        }
        Ok(responses)
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let mut rows = self.inner.sensitivities(&self.scaled.inner(b), &self.original(responses), wanted)?;
        for (i, at) in wanted.iter().enumerate() {
            let factor = self.scaled.of(at.response)[0];
            (0..rows.ncols()).for_each(|j| rows[(i, j)] *= factor / self.scaled.variables[j]);
        }
        Ok(rows)
    }

    fn curvatures(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<Option<Vec<DMatrix<f64>>>> {
        let found = self.inner.curvatures(&self.scaled.inner(b), &self.original(responses), wanted)?;
        Ok(found.map(|mut all| {
            all.iter_mut().zip(wanted).for_each(|(matrix, at)| self.scaled.scale_matrix(at.response, matrix));
            all
        }))
    }

    fn warnings(&self, b: &[f64], responses: &Responses) -> Vec<String> {
        self.inner.warnings(&self.scaled.inner(b), &self.original(responses))
    }

    fn differentiation(&self, variables: usize, wanted: &[ResponseAt]) -> Option<&'static str> {
        self.inner.differentiation(variables, wanted)
    }

    fn continuous(&self) -> Option<&dyn ContinuousTime> {
        self.inner.continuous().map(|_| self as &dyn ContinuousTime)
    }
}

impl ScaledAnalysis {
    fn in_time(&self) -> Result<&dyn ContinuousTime> {
        let missing = || Error::definition("analysis", "it has no responses in continuous time", "use the time points");
        self.inner.continuous().ok_or_else(missing)
    }
}

impl ContinuousTime for ScaledAnalysis {
    fn rates(&self, b: &[f64], responses: &Responses, h: usize, t: f64) -> Result<[f64; 3]> {
        let [value, rate, second] = self.in_time()?.rates(&self.scaled.inner(b), &self.original(responses), h, t)?;
        let [factor, constant] = self.scaled.of(h);
        Ok([value * factor + constant, rate * factor, second * factor])
    }

    fn rate_sensitivities(&self, b: &[f64], responses: &Responses, h: usize, t: f64) -> Result<[Vec<f64>; 2]> {
        let mut rows = self.in_time()?.rate_sensitivities(&self.scaled.inner(b), &self.original(responses), h, t)?;
        rows.iter_mut().for_each(|row| self.scaled.scale_row(h, row));
        Ok(rows)
    }

    fn curvature(&self, b: &[f64], responses: &Responses, h: usize, t: f64) -> Result<Option<DMatrix<f64>>> {
        let mut found = self.in_time()?.curvature(&self.scaled.inner(b), &self.original(responses), h, t)?;
        found.iter_mut().for_each(|matrix| self.scaled.scale_matrix(h, matrix));
        Ok(found)
    }
}

/// Replaces a function by the same function in other units of the design, times a factor, plus a constant.
fn wrap(form: &mut QuantityForm, variables: &[f64], affine: [f64; 2]) {
    if affine == [1.0, 0.0] && variables.iter().all(|&c| c == 1.0) {
        return;
    }
    let variables: Arc<[f64]> = variables.into();
    *form = match &*form {
        QuantityForm::Plain(f) => QuantityForm::Plain(Arc::new(Wrapped { inner: f.clone(), variables, affine })),
        QuantityForm::AtTime(f) => QuantityForm::AtTime(Arc::new(Wrapped { inner: f.clone(), variables, affine })),
        QuantityForm::EachPoint(grid, f) => {
            QuantityForm::EachPoint(*grid, Arc::new(Wrapped { inner: f.clone(), variables, affine }))
        }
        QuantityForm::Whole(grid, f) => {
            QuantityForm::Whole(*grid, Arc::new(Wrapped { inner: f.clone(), variables, affine }))
        }
    };
}

/// A function in other units of the design, times a factor, plus a constant.
struct Wrapped<F: ?Sized> {
    variables: Arc<[f64]>,
    affine: [f64; 2],
    inner: Arc<F>,
}

macro_rules! wrapped {
    ($($number:ty => $name:ident),*) => {
        impl AnyFunction for Wrapped<dyn AnyFunction> {
            $(fn $name(&self, point: &Point<$number>) -> $number {
                let design: Vec<$number> = point.design.iter().zip(&*self.variables).map(|(&b, &c)| b / c).collect();
                let value = self.inner.$name(&Point { design: &design, ..*point });
                value * self.affine[0] + self.affine[1]
            })*
        }
        impl AnyFunctional for Wrapped<dyn AnyFunctional> {
            $(fn $name(&self, history: &[Point<$number>]) -> $number {
                let scaled = |p: &Point<$number>| p.design.iter().zip(&*self.variables).map(|(&b, &c)| b / c).collect();
                let designs: Vec<Vec<$number>> = history.iter().map(scaled).collect();
                let points: Vec<Point<$number>> =
                    history.iter().zip(&designs).map(|(p, design)| Point { design, ..*p }).collect();
                self.inner.$name(&points) * self.affine[0] + self.affine[1]
            })*
            fn made_for(&self) -> Option<usize> { self.inner.made_for() }
        }
    };
}
wrapped!(f64 => real, Dual => dual, HyperDual => hyper_dual, PolynomialDegree => degree);
