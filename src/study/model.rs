//! The model of a study, and its analysis at other values of design variables and constants.

use super::error::StudyError;
use crate::model_file::{self, Model, with_constant_as_variable, with_setting};
use crate::problem::{AnalyzedDesign, Problem, ResponseAt, Responses, RowId, Sensitivities, SignedQuantity};
use crate::report::number::{DIGITS, with_unit};
use crate::report::outcome;
use crate::{Error, Result};
use nalgebra::DMatrix;
use std::path::PathBuf;

/// A model file that is read repeatedly with different settings.
#[derive(Clone, Debug)]
pub struct ModelSource {
    /// Name of the file, for messages.
    pub name: String,
    /// Its text.
    pub text: String,
    /// The folder in which the program of the model may run; `None` if it may not.
    pub programs: Option<PathBuf>,
}

impl ModelSource {
    /// The model.
    ///
    /// # Errors
    /// If the file has errors.
    pub fn model(&self) -> std::result::Result<Model, StudyError> {
        let mut model = model_file::read(&self.name, &self.text)?;
        if let Some(folder) = &self.programs {
            model.allow_programs(folder);
        }
        Ok(model)
    }

    /// The source with other settings; keys have the form of [`settings`](crate::model_file::settings).
    ///
    /// # Errors
    /// If the file has no such key.
    pub fn with<'s>(
        &self,
        edits: impl IntoIterator<Item = (&'s str, String)>,
    ) -> std::result::Result<Self, StudyError> {
        let mut changed = self.clone();
        for (key, value) in edits {
            changed.text = with_setting(&self.name, &changed.text, key, &value)?;
        }
        Ok(changed)
    }

    /// The source of a model with other numbers, each in the unit that its setting has.
    ///
    /// # Errors
    /// As [`with`](Self::with).
    pub fn with_numbers(
        &self,
        model: &Model,
        edits: impl IntoIterator<Item = (String, f64)>,
    ) -> std::result::Result<Self, StudyError> {
        edits
            .into_iter()
            .try_fold(self.clone(), |source, (key, value)| source.with([(key.as_str(), model.written(&key, value))]))
    }
}

/// A design variable or constant of a model that a study varies. Its values are in its unit.
#[derive(Clone, Debug)]
pub struct VariedNumber {
    /// Its name.
    pub name: String,
    /// Its unit, or the label of a design variable without one; may be empty.
    pub unit: String,
    /// Its value in the model.
    pub start: f64,
    /// Its bounds; infinite without one.
    pub bounds: [f64; 2],
    is_constant: bool,
}

impl VariedNumber {
    /// The number with this name.
    ///
    /// # Errors
    /// If the model has no such design variable or constant.
    pub fn of(model: &Model, name: &str) -> Result<Self> {
        let new = |unit: &str, start, bounds, is_constant| Self {
            name: name.to_owned(),
            unit: unit.to_owned(),
            start,
            bounds,
            is_constant,
        };
        if let Some(v) = model.variables().iter().find(|v| v.name == name) {
            return Ok(new(&v.unit, v.start, [v.lower, v.upper], false));
        }
        let Some(constant) = model.constants().iter().find(|constant| constant.name == name) else {
            return Err(Error::unknown("design variable or constant", name, names(model)));
        };
        let unit = constant.unit.as_ref().map_or("", |unit| unit.text.as_str());
        Ok(new(unit, constant.value, [f64::NEG_INFINITY, f64::INFINITY], true))
    }

    /// The sentence about values outside the bounds, if there are some.
    pub(super) fn outside(&self, values: impl Iterator<Item = f64>) -> Option<String> {
        let [lower, upper] = self.bounds;
        let count = values.filter(|value| *value < lower || *value > upper).count();
        let [lower, upper] = self.bounds.map(|bound| with_unit(bound, &self.unit, DIGITS));
        (count > 0).then(|| {
            format!(
                "In {count} runs {} is outside its bounds in the model, {lower} and {upper}, which were moved there: no optimization of the model ends there.",
                self.name
            )
        })
    }

    /// The settings that give it another value. A bound that excludes the value is moved to it.
    fn settings(&self, value: f64) -> Vec<(String, f64)> {
        if self.is_constant {
            return vec![(format!("constants.{}", self.name), value)];
        }
        let [lower, upper] = self.bounds;
        let all = [("start", true), ("lower", value < lower), ("upper", value > upper)];
        let is_set = all.into_iter().filter(|(_, is_set)| *is_set);
        is_set.map(|(key, _)| (format!("design.{}.{key}", self.name), value)).collect()
    }
}

/// Names of the design variables and constants of a model.
pub fn names(model: &Model) -> impl Iterator<Item = &str> + Clone {
    let constants = model.constants().iter().map(|constant| constant.name.as_str());
    model.variables().iter().map(|v| v.name.as_str()).chain(constants)
}

/// A scalar result of an analysis.
#[derive(Clone, Debug, PartialEq)]
enum ResultKind {
    Objective,
    /// A constrained quantity at its smallest margin: number among the stated constraints.
    Constraint(usize),
    /// Its margin.
    Margin(usize),
    /// The margin of an equation: minus the distance of its value.
    Distance(usize),
    /// Largest violation of all constraints in percent.
    Violation,
    /// An output without time.
    Value(usize),
    Minimum(usize),
    Maximum(usize),
    End(usize),
}

/// Name of the largest violation of all constraints.
pub const VIOLATION: &str = "violation_pct";

/// A scalar result of an analysis, with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyQuantity {
    /// Name: that of the objective or of a constraint; `violation_pct`; an output, with `.min`, `.max` or `.end` if it changes with time;
    /// a constraint with `.margin`.
    pub name: String,
    /// Unit; may be empty.
    pub unit: String,
    measure: ResultKind,
}

impl StudyQuantity {
    /// True if it has derivatives: all but the largest violation.
    pub fn is_differentiable(&self) -> bool {
        self.measure != ResultKind::Violation
    }

    /// True for the margin of an equation, which is negative on both sides.
    pub fn is_of_equation(&self) -> bool {
        matches!(self.measure, ResultKind::Distance(_))
    }
}

/// A model as a function of some of its design variables and constants.
pub struct Evaluator {
    source: ModelSource,
    varied: Vec<VariedNumber>,
    form: ModelForm,
    all: Vec<StudyQuantity>,
}

enum ModelForm {
    /// All names are design variables, or constants that were made design variables: their indices.
    Problem(Box<Problem>, Vec<usize>),
    /// A model without an objective.
    Simulation(Box<Model>, Vec<usize>),
    /// The file is read again with the values of the constants.
    Text,
}

/// Values and derivatives of quantities.
#[derive(Clone, Debug, PartialEq)]
pub struct QuantityGradients {
    /// Values of the quantities.
    pub values: Vec<f64>,
    /// Derivatives: a row for each quantity, a column for each name.
    pub rows: DMatrix<f64>,
}

impl Evaluator {
    /// The function of these names.
    ///
    /// A constant is made a design variable where the file allows that, so that its derivatives exist; otherwise the file is read
    /// again for each value.
    ///
    /// # Errors
    /// If the model has errors, or no such name.
    pub fn new(source: &ModelSource, names: &[String]) -> std::result::Result<Self, StudyError> {
        let model = source.model()?;
        let varied = names.iter().map(|name| VariedNumber::of(&model, name)).collect::<Result<Vec<_>>>()?;
        let form = match promoted(source, &varied) {
            Some(model) => Self::form(model, names)?,
            None => ModelForm::Text,
        };
        let all = if model.is_problem() { of_problem(&model.problem()?) } else { of_simulation(&model) };
        Ok(Self { source: source.clone(), varied, form, all })
    }

    fn form(model: Model, names: &[String]) -> std::result::Result<ModelForm, StudyError> {
        let index =
            |name: &String| model.variables().iter().position(|v| v.name == *name).expect("the name is a variable");
        let indices = names.iter().map(index).collect();
        Ok(match model.is_problem() {
            true => ModelForm::Problem(Box::new(model.problem()?), indices),
            false => ModelForm::Simulation(Box::new(model), indices),
        })
    }

    /// The varied quantities.
    pub fn varied(&self) -> &[VariedNumber] {
        &self.varied
    }

    /// The quantities that rows have by default: objective, constraints and violation, or all outputs of a simulation.
    pub fn usual(&self) -> Vec<StudyQuantity> {
        let is_output = |m: &ResultKind| {
            matches!(m, ResultKind::Value(_) | ResultKind::Minimum(_) | ResultKind::Maximum(_) | ResultKind::End(_))
        };
        let is_problem = self.all.iter().any(|q| q.measure == ResultKind::Objective);
        let is_usual = |q: &&StudyQuantity| {
            if is_problem { !is_output(&q.measure) && !is_margin(q) } else { true }
        };
        self.all.iter().filter(is_usual).cloned().collect()
    }

    /// The margins of all constraints, positive where a limit is met; those of inequalities are limit states.
    pub fn margins(&self) -> Vec<StudyQuantity> {
        self.all.iter().filter(|q| is_margin(q)).cloned().collect()
    }

    /// All quantities.
    pub fn quantities(&self) -> &[StudyQuantity] {
        &self.all
    }

    /// The quantities at values of the names.
    ///
    /// # Errors
    /// Those of the analysis.
    pub fn values(&self, x: &[f64], wanted: &[StudyQuantity]) -> std::result::Result<Vec<f64>, StudyError> {
        match &self.form {
            ModelForm::Problem(problem, indices) => {
                Ok(of_analyzed(problem, &problem.analyze_values(&placed(problem.start(), indices, x))?, wanted))
            }
            ModelForm::Simulation(model, indices) => {
                let start = model.variables().iter().map(|v| v.start).collect();
                Ok(of_responses(&model.simulate(&placed(start, indices, x))?, wanted))
            }
            ModelForm::Text => {
                let model = self.edited(x)?;
                let start: Vec<f64> = model.variables().iter().map(|v| v.start).collect();
                if model.is_problem() {
                    let problem = model.problem()?;
                    return Ok(of_analyzed(&problem, &problem.analyze_values(&problem.start())?, wanted));
                }
                Ok(of_responses(&model.simulate(&start)?, wanted))
            }
        }
    }

    /// The model with these values.
    fn edited(&self, x: &[f64]) -> std::result::Result<Model, StudyError> {
        let edits = self.varied.iter().zip(x).flat_map(|(number, value)| number.settings(*value));
        self.source.with_numbers(&self.source.model()?, edits)?.model()
    }

    /// Values and derivatives. Exact where the analysis has derivatives; central differences with the steps `h` otherwise.
    ///
    /// # Errors
    /// Those of the analysis and of its derivatives.
    pub fn gradients(
        &self,
        x: &[f64],
        h: &[f64],
        wanted: &[StudyQuantity],
    ) -> std::result::Result<QuantityGradients, StudyError> {
        if let ModelForm::Problem(problem, indices) = &self.form {
            return Ok(exact(problem, &placed(problem.start(), indices, x), indices, wanted)?);
        }
        let values = self.values(x, wanted)?;
        let mut rows = DMatrix::zeros(wanted.len(), x.len());
        for k in 0..x.len() {
            let at = |step: f64| {
                let mut moved = x.to_vec();
                moved[k] += step;
                self.values(&moved, wanted)
            };
            let (up, down) = (at(h[k])?, at(-h[k])?);
            (0..wanted.len()).for_each(|i| rows[(i, k)] = (up[i] - down[i]) / (2.0 * h[k]));
        }
        Ok(QuantityGradients { values, rows })
    }
}

fn is_margin(quantity: &StudyQuantity) -> bool {
    matches!(quantity.measure, ResultKind::Margin(_) | ResultKind::Distance(_))
}

/// The model with constants as design variables; `None` if it cannot be read in this form.
fn promoted(source: &ModelSource, varied: &[VariedNumber]) -> Option<Model> {
    let mut constants = varied.iter().filter(|number| number.is_constant);
    let text = constants.try_fold(source.text.clone(), |text, c| with_constant_as_variable(&text, &c.name))?;
    ModelSource { text, ..source.clone() }.model().ok()
}

/// A design with other values of some variables.
fn placed(mut design: Vec<f64>, indices: &[usize], x: &[f64]) -> Vec<f64> {
    indices.iter().zip(x).for_each(|(k, value)| design[*k] = *value);
    design
}

fn outputs<'o>(all: impl Iterator<Item = (&'o str, &'o str, bool)>) -> Vec<StudyQuantity> {
    let of = |(h, (name, unit, is_transient)): (usize, (&str, &str, bool))| {
        let quantity =
            |suffix: &str, measure| StudyQuantity { name: format!("{name}{suffix}"), unit: unit.to_owned(), measure };
        match is_transient {
            false => vec![quantity("", ResultKind::Value(h))],
            true => vec![
                quantity(".min", ResultKind::Minimum(h)),
                quantity(".max", ResultKind::Maximum(h)),
                quantity(".end", ResultKind::End(h)),
            ],
        }
    };
    all.enumerate().flat_map(of).collect()
}

fn of_simulation(model: &Model) -> Vec<StudyQuantity> {
    outputs(model.output_names().map(|(name, unit, grid)| (name, unit, grid.is_some())))
}

fn of_problem(problem: &Problem) -> Vec<StudyQuantity> {
    let objective = &problem.objective;
    let quantity = |name: String, unit: &str, measure| StudyQuantity { name, unit: unit.to_owned(), measure };
    let mut all = vec![quantity(objective.name.clone(), &objective.unit, ResultKind::Objective)];
    let stated: Vec<usize> = outcome::stated_constraints(problem).collect();
    let name = |j: usize| constraint_name(problem, j);
    all.extend(
        stated
            .iter()
            .enumerate()
            .map(|(i, &j)| quantity(name(j), outcome::unit(problem, j), ResultKind::Constraint(i))),
    );
    if !stated.is_empty() {
        all.push(quantity(VIOLATION.to_owned(), "%", ResultKind::Violation));
    }
    let margin = |(i, &j): (usize, &usize)| {
        let measure =
            if problem.constraints[j].is_equality() { ResultKind::Distance(i) } else { ResultKind::Margin(i) };
        quantity(format!("{}.margin", name(j)), outcome::unit(problem, j), measure)
    };
    all.extend(stated.iter().enumerate().map(margin));
    all.extend(outputs(problem.responses.iter().map(|r| (r.name.as_str(), r.unit.as_str(), r.grid.is_some()))));
    // An output may have the name of the objective or of a constraint.
    let mut seen = std::collections::HashSet::new();
    all.retain(|q| seen.insert(q.name.clone()));
    all
}

/// The name of a constraint; with its side if both sides are limited, and as `NAME constraint` if the objective has the same name.
pub fn constraint_name(problem: &Problem, j: usize) -> String {
    let name = outcome::name(problem, j);
    let sides = outcome::stated_constraints(problem).filter(|&i| outcome::name(problem, i) == name).count();
    match (sides, problem.constraints[j].sign() < 0.0) {
        (1, _) if name == problem.objective.name => format!("{name} constraint"),
        (1, _) => name.to_owned(),
        (_, true) => format!("{name} lower"),
        (_, false) => format!("{name} upper"),
    }
}

/// The names of both sides of a constraint, or of their margins, for the name without its side.
pub fn two_sides(name: &str) -> [String; 2] {
    let (name, suffix) = name.strip_suffix(".margin").map_or((name, ""), |name| (name, ".margin"));
    ["lower", "upper"].map(|side| format!("{name} {side}{suffix}"))
}

/// Index of the first of the largest values.
fn largest(values: &[f64], sign: f64) -> usize {
    (1..values.len()).fold(0, |best, p| if sign * values[p] > sign * values[best] { p } else { best })
}

fn of_responses(responses: &Responses, wanted: &[StudyQuantity]) -> Vec<f64> {
    wanted.iter().map(|q| output(responses, &q.measure).map_or(f64::NAN, |at| responses.at(at))).collect()
}

/// The response and time point of an output's value.
fn output(responses: &Responses, measure: &ResultKind) -> Option<ResponseAt> {
    let (response, point): (usize, fn(&[f64]) -> usize) = match measure {
        ResultKind::Value(h) => (*h, |_| 0),
        ResultKind::Minimum(h) => (*h, |values| largest(values, -1.0)),
        ResultKind::Maximum(h) => (*h, |values| largest(values, 1.0)),
        ResultKind::End(h) => (*h, |values| values.len() - 1),
        _ => return None,
    };
    Some(ResponseAt { response, point: point(&responses.values[response]) })
}

fn of_analyzed(problem: &Problem, analyzed: &AnalyzedDesign, wanted: &[StudyQuantity]) -> Vec<f64> {
    let AnalyzedDesign { design, responses, evaluation } = analyzed;
    let constraints = outcome::constraints(problem, design, evaluation);
    let value = |q: &StudyQuantity| match &q.measure {
        ResultKind::Objective => outcome::objective(problem, design, evaluation),
        ResultKind::Constraint(i) => constraints[*i].value,
        ResultKind::Margin(i) | ResultKind::Distance(i) => constraints[*i].margin,
        ResultKind::Violation => {
            let worst = |j: usize| evaluation.worst_of(j).map(|(_, c)| evaluation.violation(j, c));
            100.0 * outcome::stated_constraints(problem).filter_map(worst).fold(-1.0, f64::max)
        }
        other => output(responses, other).map_or(f64::NAN, |at| responses.at(at)),
    };
    wanted.iter().map(value).collect()
}

/// Values and exact derivatives. The derivative of an extreme over time is that at its time.
fn exact(problem: &Problem, design: &[f64], indices: &[usize], wanted: &[StudyQuantity]) -> Result<QuantityGradients> {
    let analyzed = problem.analyze_design(design)?;
    let AnalyzedDesign { responses, evaluation, .. } = &analyzed;
    let constraints = outcome::constraints(problem, design, evaluation);
    let peak = outcome::peak_row(problem, design, evaluation);
    let rows: Vec<RowId> = constraints.iter().map(|c| c.row).chain(peak).collect();
    let of_rows = rows.iter().flat_map(|r| problem.responses_of(&problem.constraints[r.constraint].quantity, r.point));
    let mut at: Vec<ResponseAt> = of_rows.chain(problem.responses_of(&problem.objective.quantity, 0)).collect();
    at.extend(wanted.iter().filter_map(|q| output(responses, &q.measure)));
    at.sort_unstable();
    at.dedup();
    let sensitivities = Sensitivities { rows: problem.sensitivities(design, responses, &at)?, at };
    let of_row = |row, sign| problem.row_derivative(row, sign, &analyzed, &sensitivities);
    let objective = SignedQuantity { quantity: &problem.objective.quantity, sign: 1.0, bound: None };
    let gradient = |q: &StudyQuantity| -> Result<Vec<f64>> {
        Ok(match &q.measure {
            ResultKind::Objective => match peak {
                Some(row) => of_row(row, problem.constraints[row.constraint].sign())?,
                None => problem.total_derivative(objective, 0, design, responses, &sensitivities),
            },
            ResultKind::Constraint(i) => of_row(constraints[*i].row, 1.0)?,
            ResultKind::Margin(i) | ResultKind::Distance(i) => {
                let c = &constraints[*i];
                let constraint = &problem.constraints[c.row.constraint];
                let sign = if constraint.is_equality() { (c.value - c.limit).signum() } else { constraint.sign() };
                of_row(c.row, -sign)?
            }
            ResultKind::Violation => vec![f64::NAN; design.len()],
            other => {
                let place = output(responses, other).and_then(|place| sensitivities.row_of(place));
                place.map_or(vec![f64::NAN; design.len()], |k| sensitivities.rows.row(k).iter().copied().collect())
            }
        })
    };
    let all: Vec<Vec<f64>> = wanted.iter().map(gradient).collect::<Result<_>>()?;
    let rows = DMatrix::from_fn(wanted.len(), indices.len(), |i, k| all[i][indices[k]]);
    Ok(QuantityGradients { values: of_analyzed(problem, &analyzed, wanted), rows })
}
