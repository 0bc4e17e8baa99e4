//! Sections of a model file: their keys, and their conversion to a mechanism, a problem and a method.
//!
//! | file | content |
//! |---|---|
//! | `key` | the keys of a section: one declaration for reader, documentation and schema |
//! | `value`, `section`, `replicate` | typed values with locations; a table with checked keys; its copies by `each` |
//! | `naming` | design variables, constants, named expressions |
//! | `parts`, `bodies`, `beams`, `element_kinds`, `elements`, `motion`, `feedback` | the mechanism |
//! | `joint_checks` | joints whose keys contradict each other or have no effect |
//! | `markers`, `bodies3`, `beams3` | points with axes, bodies and beams in space |
//! | `mechanism` | the mechanism as a pure function of the design |
//! | `measures`, `measured`, `outputs`, `label` | measured quantities, formulas of them, outputs and their units |
//! | `events` | events by a condition |
//! | `axis` | the points of all histories, over time or over another quantity |
//! | `analysis`, `program` | the analysis; analysis by another program |
//! | `quantity`, `objective`, `constraints` | objective and constraints as formulas of outputs |
//! | `event_sides` | limited histories at events |
//! | `method` | the optimization method |
//! | `drawing`, `drawing3`, `symbols` | drawings of the mechanism in motion, in the plane and in space, and shapes of its elements |

mod analysis;
mod axis;
mod beams;
mod beams3;
mod bodies;
mod bodies3;
mod constraints;
#[cfg(feature = "report")]
mod drawing;
#[cfg(feature = "report")]
mod drawing3;
mod element_kinds;
mod element_spec;
mod elements;
mod event_sides;
mod events;
mod feedback;
mod joint_checks;
mod key;
mod label;
mod markers;
mod measured;
mod measures;
mod mechanism;
mod method;
mod motion;
mod naming;
mod objective;
mod outputs;
mod parts;
mod program;
mod quantity;
mod replicate;
mod section;
#[cfg(feature = "report")]
mod symbols;
mod value;

#[cfg(feature = "report")]
pub use drawing::DrawnOutputs;
pub(super) use element_kinds::element_of;
pub use key::{Accepts, Key, Need, TableKeys};
pub(crate) use key::{default, optional, required};
pub use naming::Constant;
pub(crate) use section::{FileSource, Read, Section};
#[cfg(feature = "report")]
pub(crate) use section::{Word, find, ordered, wrong_type};

use super::diagnostics::{DiagnosticLog, SourceMap};
use super::version::{self, Modernizer};
use super::{Diagnostic, DiagnosticReport, limits, settings};
use crate::model_file::expression::{CompiledExpression, ExpressionTree, Inputs, Names, TextPlace};
use crate::model_file::unit::Unit;
#[cfg(feature = "report")]
use crate::problem::{Analysis, Analytic, ResponseAt, Responses, not_finite};
use crate::problem::{
    ClosedForm, Constraint, DesignVariable, Intermediate, Intermediates, Problem, ProblemBuilder, Quantity, TimeGrid,
};
use crate::responses::program::ProgramAnalysis;
use crate::sao::Method;
use crate::{Error, Result};
use autodiff::Scalar;
use event_sides::EventSides;
use label::Labels;
use mechanics::SimulationClock;
use mechanism::{MechanismSpec, MechanismTemplate};
use naming::VariableUnit;
use objective::ObjectiveSpec;
use outputs::OutputSpec;
use program::{AskedProgram, ProgramSpec};
use std::path::Path;
use std::sync::Arc;
use toml::Spanned;
use toml::de::DeTable;

pub(super) const KEYS: &[Key] = &[
    required("version", Accepts::Count, "version of the format: 2; files of version 1 are read, with a note"),
    default("title", Accepts::Text, "", "title for tables and figures"),
    optional(
        "include",
        Accepts::Texts,
        "files in the folder of this one, or below, whose tables and parts are added to those of this file",
    ),
    optional("design", Accepts::Tables, "design variables, as tables [design.NAME]"),
    optional("constants", Accepts::Table, "names for numbers: NAME = 1.0, or an expression of others"),
    optional(
        "table",
        Accepts::Tables,
        "functions through given points, as tables [table.NAME]; expressions call them: NAME(x)",
    ),
    optional("expressions", Accepts::Table, "names for expressions of design variables, constants and time"),
    default(
        "space",
        Accepts::Count,
        "2",
        "dimensions of mechanisms: 2 in the plane, 3 in space, with tables of their own",
    ),
    optional(
        "gravity",
        Accepts::Vector,
        "gravitational acceleration [x, y], in space [x, y, z], in m/s²; none by default",
    )
    .of("m/s²"),
    optional("body", Accepts::Tables, "bodies"),
    optional("beam", Accepts::Tables, "flexible beams"),
    optional("point", Accepts::Tables, "named points of bodies"),
    optional("joint", Accepts::Tables, "joints between bodies"),
    optional("driver", Accepts::Tables, "prescribed motions"),
    optional("force", Accepts::Tables, "forces"),
    optional(
        "event",
        Accepts::Tables,
        "events: joints that are released, forces that are switched, the end of the motion",
    ),
    optional("time", Accepts::Table, "the time points of all histories"),
    optional("sweep", Accepts::Table, "points of another quantity, such as a travel, in place of [time]"),
    optional("series", Accepts::Table, "series of numbers, one for each time point: NAME = [ … ]"),
    optional("analysis", Accepts::Table, "analysis of the mechanism, or by another program"),
    optional("output", Accepts::Tables, "responses of the analysis"),
    optional("objective", Accepts::Table, "the function to minimize"),
    optional("constraint", Accepts::Tables, "constraints"),
    optional("method", Accepts::Table, "optimization method; by default `automatic`"),
];

/// The tables that have a key of this name.
fn owners(key: &str) -> Vec<&'static str> {
    let file = TableKeys { name: "", kind: None, about: "the file", keys: KEYS };
    let has = |table: &TableKeys| table.keys.iter().any(|known| known.name == key);
    let mut names = Vec::new();
    for table in std::iter::once(file).chain(families()).filter(has) {
        let name = table.name.trim_end_matches('3'); // tables in space
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// Declarations of all tables, without the top level of the file.
pub(super) fn families() -> Vec<TableKeys> {
    let mut all = vec![TableKeys { name: "design.NAME", kind: None, about: "a design variable", keys: naming::DESIGN }];
    all.push(TableKeys {
        name: "table.NAME",
        kind: None,
        about: "a function through given points",
        keys: naming::TABLE,
    });
    all.extend(bodies::tables());
    all.extend(beams::TABLES);
    all.extend(element_kinds::tables());
    all.extend(bodies3::tables());
    all.extend(markers::TABLES);
    all.extend(beams3::TABLES);
    all.extend(element_kinds::tables3());
    all.extend(events::TABLES);
    all.extend(
        motion::TABLES
            .iter()
            .chain(axis::TABLES)
            .chain(analysis::TABLES)
            .chain([&program::TABLE])
            .chain(outputs::TABLES),
    );
    all.extend(objective::TABLES.iter().chain(constraints::TABLES).chain(method::TABLES));
    all
}

/// A model: mechanism, formulas or a program; problem and method.
pub struct Model {
    title: String,
    variables: Vec<DesignVariable>,
    /// Units of the values of the design variables.
    units: Vec<Option<Unit>>,
    constants: Vec<Constant>,
    mechanism: Option<(Arc<MechanismSpec>, analysis::Settings)>,
    program: Option<ProgramSpec>,
    /// Name of the time, or of the quantity of a sweep, in expressions.
    axis: String,
    grid: Option<TimeGrid>,
    outputs: Arc<Vec<OutputSpec>>,
    objective: Option<ObjectiveSpec>,
    constraints: Vec<Constraint>,
    method: Method,
    fingerprint: u64,
    analysis_fingerprint: u64,
    source: SourceMap,
    notes: Vec<Diagnostic>,
}

/// Reads a model; `file` is its name in messages.
///
/// # Errors
/// The first errors of the file with their locations, without those that follow from others.
pub fn read(file: &str, text: &str) -> std::result::Result<Model, Box<DiagnosticReport>> {
    read_as(file, text, false, limits::FILE)
}

/// As [`read`], for a text that a program has written from data in memory: it may be longer than a file.
///
/// # Errors
/// As [`read`].
pub fn read_generated(file: &str, text: &str) -> std::result::Result<Model, Box<DiagnosticReport>> {
    read_as(file, text, false, limits::GENERATED)
}

/// As [`read`], for the model of a run that has begun: bounds may exclude its start.
///
/// # Errors
/// As [`read`].
pub fn read_of_run(file: &str, text: &str) -> std::result::Result<Model, Box<DiagnosticReport>> {
    read_as(file, text, true, limits::FILE)
}

fn read_as(
    file: &str,
    text: &str,
    is_of_run: bool,
    longest: usize,
) -> std::result::Result<Model, Box<DiagnosticReport>> {
    let log = DiagnosticLog::default();
    let table = settings::parse_up_to(longest, text);
    let model = log.keep(table.and_then(|table| model_of_table(file, table, text, is_of_run, &log)));
    let (errors, locations) = log.into_parts();
    let source = SourceMap { file: file.to_owned(), text: text.to_owned(), locations };
    match model {
        Some(model) if errors.is_empty() => Ok(Model { source, ..model }),
        _ => Err(Box::new(source.report(errors))),
    }
}

/// Reads another kind of file, or a part of a model, with the same diagnostics: `open` gets its top level, of which no key has been checked.
pub(crate) fn read_document<T>(
    file: &str,
    text: &str,
    open: impl FnOnce(&DeTable<'_>, FileSource<'_>) -> Read<T>,
) -> std::result::Result<T, Box<DiagnosticReport>> {
    let (log, words) = (DiagnosticLog::default(), Modernizer::default());
    let source = FileSource { text, log: &log, words: &words, is_of_run: false, owners: |_| Vec::new() };
    let read = settings::parse(text).and_then(|table| open(&table, source));
    let read = log.keep(read);
    let (errors, locations) = log.into_parts();
    match read {
        Some(read) if errors.is_empty() => Ok(read),
        _ => Err(Box::new(SourceMap { file: file.to_owned(), text: text.to_owned(), locations }.report(errors))),
    }
}

/// The units of the design variables of a text, of which nothing else is read.
///
/// # Errors
/// If names or constants have errors.
pub(super) fn variable_units(file: &str, text: &str) -> std::result::Result<Vec<VariableUnit>, Box<DiagnosticReport>> {
    read_document(file, text, |table, source| {
        let section = Section::of(table.clone(), 0..text.len(), "the file", &[KEYS], source)?;
        naming::read_names(&section)?.units()
    })
}

fn model_of_table(file: &str, mut table: DeTable<'_>, text: &str, is_of_run: bool, log: &DiagnosticLog) -> Read<Model> {
    let version = version::version(&table)?;
    let (fingerprint, analysis_fingerprint) = (settings::fingerprint(&table), settings::analysis_fingerprint(&table));
    let words = Modernizer::default();
    for name in ["analysis", "method"] {
        if let Some(toml::de::DeValue::Table(table)) = table.get_mut(name).map(Spanned::get_mut) {
            words.update(name, table, text);
        }
    }
    let model = log.keep(model_of_document(file, &table, FileSource { text, log, words: &words, is_of_run, owners }));
    if version == version::CURRENT {
        words.errors().into_iter().for_each(|error| log.note(error));
    }
    log.check()?;
    let note = (version < version::CURRENT).then(|| words.note(&table));
    let notes = note.into_iter().chain(log.remarks()).collect();
    let mut model = model.expect("no error was logged");
    if version < version::CURRENT {
        model.objective.iter_mut().for_each(ObjectiveSpec::keep_first_scale);
    }
    Ok(Model { fingerprint, analysis_fingerprint, notes, ..model })
}

/// Reads the tables of a document, in the order of their dependence on each other.
fn model_of_document(file: &str, table: &DeTable<'_>, source: FileSource<'_>) -> Read<Model> {
    let section = Section::of(table.clone(), 0..source.text.len(), "the file", &[KEYS], source)?;
    // The content of a section with a wrong name would be missed below.
    source.log.check()?;
    let (mut names, variables, constants) = naming::read(&section)?;
    let program = program::read(&section, &names)?;
    let mechanism = if program.is_some() { None } else { mechanism::read(&section, &names)? };
    let labels = Labels::of(table, &variables);
    let grid = axis::read(&section, &names, &labels)?;
    let series = quantity::series(&section, &names, grid.as_ref())?;
    let outputs = outputs::read(
        &section,
        &names,
        mechanism.as_ref().map(|mechanism| &mechanism.parts),
        &variables,
        program.is_some(),
        grid.as_ref(),
        &labels,
    )?;
    let bound = objective::read_bound(&section, &mut names, &outputs)?;
    let of_peak = bound.as_ref().map(|bound| bound.variable.clone());
    let all: Vec<DesignVariable> = variables.iter().chain(&of_peak).cloned().collect();
    let is_problem = section.has("objective") || section.has("constraint");
    if is_problem {
        naming::check_any(&section)?;
    }
    check_times(&section, &outputs, grid.as_ref())?;
    let outputs = extended(outputs, &variables, &of_peak);
    let known = quantity::QuantityContext {
        names: &names,
        outputs: &outputs,
        series: &series,
        grid: grid.as_ref(),
        variables: &all,
        labels: &labels,
        has_events: mechanism.as_ref().is_some_and(MechanismSpec::has_events),
    };
    let objective = match is_problem {
        true => source.log.keep(objective::read(&section, &known, bound)).map(Some),
        false => Some(None),
    };
    let constraints = constraints::read(&section, &known)?;
    let method = source.log.keep(method::read(&section, &names));
    let mechanism = match mechanism {
        Some(mechanism) => Some(with_settings(&section, &names, mechanism, grid.as_ref())?),
        None => None,
    };
    if program.is_none() {
        remark_unused(&section, &names);
    }
    let title = section.text("title")?;
    let title = if title.is_empty() { file_name(file) } else { title };
    source.log.check()?;
    let (mut objective, method) = (objective.expect("no error was logged"), method.expect("no error was logged"));
    let events = mechanism.as_ref().map_or(&[][..], |(mechanism, _)| &mechanism.events);
    let mut sides = EventSides::new(events, grid.as_ref(), outputs);
    objective.iter_mut().for_each(|objective| objective.add_sides(&mut sides));
    let constraints = sides.constrain(constraints);
    let outputs = sides.into_outputs();
    Ok(Model {
        title,
        units: variables.iter().map(|variable| names.unit_of(&variable.name).cloned()).collect(),
        variables,
        constants,
        mechanism,
        program,
        axis: names.axis().name().to_owned(),
        grid,
        outputs: Arc::new(outputs),
        objective,
        constraints,
        method,
        fingerprint: 0,
        analysis_fingerprint: 0,
        source: SourceMap::default(),
        notes: vec![],
    })
}

/// A mechanism, which starts at the start of its analysis, with the settings of the analysis.
fn with_settings(
    section: &Section<'_>,
    names: &Names,
    mut mechanism: MechanismSpec,
    grid: Option<&TimeGrid>,
) -> Read<(Arc<MechanismSpec>, analysis::Settings)> {
    let Some(grid) = grid else {
        return Err(section.error_at("time", "a mechanism needs time points").help("add [time], or [sweep]"));
    };
    let settings = analysis::read(section, names, grid, &mechanism)?;
    mechanism.start = settings.start();
    Ok((Arc::new(mechanism), settings))
}

/// Notes design variables that no expression uses.
fn remark_unused(section: &Section<'_>, names: &Names) {
    let Some(designs) = section.get("design").and_then(|value| value.get_ref().as_table()) else { return };
    for name in designs.keys().filter(|name| !names.is_in_use(name.get_ref())) {
        let message = format!("no expression uses the design variable `{}`: it has no effect", name.get_ref());
        section.source().log.remark(Diagnostic::new(name.span(), message).help("use it, or remove it"));
    }
}

/// Extends the intermediate variables of outputs by the bound of a peak, if the objective has one.
fn extended(outputs: Vec<OutputSpec>, variables: &[DesignVariable], bound: &Option<DesignVariable>) -> Vec<OutputSpec> {
    let longer = |mut output: OutputSpec| {
        if let (Intermediates::Each(each), Some(_)) = (&mut output.intermediates, bound) {
            each.resize(variables.len() + 1, Intermediate::Identity);
        }
        output
    };
    outputs.into_iter().map(longer).collect()
}

fn check_times(section: &Section<'_>, outputs: &[OutputSpec], grid: Option<&TimeGrid>) -> Read<()> {
    match outputs.iter().find(|o| o.is_transient && grid.is_none()) {
        None => Ok(()),
        Some(output) => {
            let message = format!("the output `{}` changes with time, but there are no time points", output.name);
            Err(section.error_at("time", message).help("add [time] with `to` and `points`, or [sweep]"))
        }
    }
}

/// The name of a file without its folder.
fn file_name(file: &str) -> String {
    std::path::Path::new(file).file_name().map_or_else(|| file.to_owned(), |name| name.to_string_lossy().into_owned())
}

impl Model {
    /// The title, or the name of the file.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// The model as a copy of the file with this name, which is its title if it has none of its own.
    #[must_use]
    pub fn copied_from(self, file: &str) -> Self {
        let is_named = file.is_empty() || self.title != file_name(&self.source.file);
        Self { title: if is_named { self.title } else { file_name(file) }, ..self }
    }

    /// The constants.
    pub fn constants(&self) -> &[Constant] {
        &self.constants
    }

    /// The unit of the number of a setting, by its key as in [`settings`](crate::model_file::settings): of a design variable or constant, of a
    /// constraint that is shown in a unit, otherwise that with which the number is written. `None` if it has none.
    pub fn unit_of(&self, key: &str) -> Option<Unit> {
        let (table, rest) = key.split_once('.')?;
        let (name, last) = rest.rsplit_once('.').unwrap_or((rest, ""));
        let constraint = self.constraints.iter().find(|constraint| constraint.name == name);
        match (table, constraint, last) {
            ("design", ..) => self.units[self.variables.iter().position(|v| v.name == name)?].clone(),
            ("constants", ..) => self.constants.iter().find(|constant| constant.name == name)?.unit.clone(),
            ("constraint", Some(constraint), "at_least" | "at_most" | "equals" | "scale") => {
                Unit::parse(&constraint.unit)
            }
            _ => {
                let text = settings::settings(&self.source.file, &self.source.text).ok()?.remove(key)?;
                ExpressionTree::parse(text.trim_matches('"'), TextPlace::From(0)).ok()?.unit().cloned()
            }
        }
    }

    /// A number of a setting as TOML, with the unit that the setting has.
    pub fn written(&self, key: &str, number: f64) -> String {
        Unit::written(self.unit_of(key).as_ref(), number)
    }

    /// The method, with its settings.
    pub fn method(&self) -> &Method {
        &self.method
    }

    /// A number that identifies the problem: a hash of everything in the file but method, title, bounds of design variables,
    /// comments and version.
    pub fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    /// Hash of all that the responses of a design depend on: of everything except method, title, bounds and start values. Two models with
    /// the same hash have the same responses at the same design.
    pub fn analysis_fingerprint(&self) -> u64 {
        self.analysis_fingerprint
    }

    /// Notes about a file that is read: its version is 1, with the new names of its old words, or a `unit` is not that of the values.
    pub fn note(&self) -> Option<DiagnosticReport> {
        (!self.notes.is_empty()).then(|| self.source.report(self.notes.clone()))
    }

    /// Converts an error of the analysis to a diagnostic at the part of the file that it names; `None` if it names no part.
    pub fn locate(&self, error: &crate::Error) -> Option<DiagnosticReport> {
        self.source.locate(error)
    }

    /// The command of the program that computes the outputs, if there is one.
    pub fn program(&self) -> Option<String> {
        self.program.as_ref().map(ProgramSpec::command)
    }

    /// Allows the program of the file to be started, in this working folder. Without it, every analysis fails with
    /// [`Error::File`](crate::Error::File).
    pub fn allow_programs(&mut self, folder: &Path) {
        if let Some(program) = &mut self.program {
            program.allow_in(folder);
        }
    }

    /// The analysis by the program of the file, which all problems of this model share; `None` if there is no program, or if it
    /// must not be started.
    ///
    /// # Errors
    /// As [`ProgramAnalysis::new`].
    pub fn program_analysis(&self) -> Result<Option<Arc<ProgramAnalysis>>> {
        self.asked_program().map_or(Ok(None), |program| program.analysis())
    }

    /// The program of the file with the requests of the model.
    fn asked_program(&self) -> Option<AskedProgram<'_>> {
        self.program.as_ref().map(|program| program.asked(&self.variables, self.grid.as_ref(), &self.outputs))
    }

    /// The optimization problem. Analyses the start design if the objective is a peak without a scale or a start of its bound.
    ///
    /// # Errors
    /// As [`ProblemBuilder::build`], and those of that analysis.
    pub fn problem(&self) -> Result<Problem> {
        let objective = self.stated_objective()?;
        objective.complete(self.build(|parts| objective.build(parts))?, &self.variables)
    }

    /// The optimization problem, without an analysis of the start design: a peak without a scale has 1, and the start of its bound is that of
    /// its declaration. Describes the problem, and evaluates designs where the start cannot be analysed; [`problem`](Self::problem) is for runs.
    ///
    /// # Errors
    /// As [`ProblemBuilder::build`].
    pub fn unscaled_problem(&self) -> Result<Problem> {
        let objective = self.stated_objective()?;
        Ok(objective.named(self.build(|parts| objective.build(parts))?))
    }

    fn stated_objective(&self) -> Result<&ObjectiveSpec> {
        let remedy = "add [objective] with minimize = \"…\"; without one, `linkwright analyze` computes the outputs, and `linkwright check` their \
                      derivatives";
        self.objective.as_ref().ok_or_else(|| Error::definition("[objective]", "there is no objective", remedy))
    }

    /// The outputs as the responses of a problem, for analyses and derivatives of a file without an objective. The objective of this problem
    /// is its first design variable and has no name; there are no constraints.
    ///
    /// # Errors
    /// [`Error::Definition`] without a design variable; those of [`ProblemBuilder::build`].
    pub fn simulation(&self) -> Result<Problem> {
        if self.variables.is_empty() {
            let remedy = "add a design variable; `linkwright analyze` simulates the file as it is";
            return Err(Error::definition(&self.title, "there is no design variable", remedy));
        }
        self.build(|parts| parts.minimize("", "", Quantity::variable(0)))
    }

    /// Returns `true` if the file has an objective; without one it is a simulation.
    pub fn is_problem(&self) -> bool {
        self.objective.is_some()
    }

    /// The design variables, without the one that bounds a peak.
    pub fn variables(&self) -> &[DesignVariable] {
        &self.variables
    }

    /// Names and units of the outputs, with the indices of their time grids: 0 for histories.
    pub fn output_names(&self) -> impl Iterator<Item = (&str, &str, Option<usize>)> {
        self.outputs.iter().map(|o| (o.name.as_str(), o.unit.as_str(), o.is_transient.then_some(0)))
    }

    /// For each output, the SI value of one of the unit in which it is shown: formulas use SI values. `None` for an output whose unit is
    /// a label, or the SI unit: formulas and limits use its values as they are shown.
    pub fn output_factors(&self) -> impl Iterator<Item = Option<f64>> {
        let factor = |unit: &crate::model_file::unit::Unit| unit.factors()[0] / unit.factors()[1];
        self.outputs.iter().map(move |output| output.shown_in.as_ref().map(factor))
    }

    /// The time that running simulations of the mechanism have reached; `None` if the analysis does not simulate over time.
    pub fn clock(&self) -> Option<SimulationClock> {
        let (mechanism, settings) = self.mechanism.as_ref()?;
        settings.is_simulation().then(|| mechanism.clock.clone())
    }

    /// The outputs at a design, which has a value for each of the [`variables`](Self::variables).
    ///
    /// # Errors
    /// Those of the analysis; [`Error::NotFinite`] for an output that is undefined there.
    #[cfg(feature = "report")]
    pub fn simulate(&self, design: &[f64]) -> Result<Responses> {
        Error::check_length("design", self.variables.len(), design.len())?;
        if let Some(program) = self.asked_program() {
            return program.analyze(design);
        }
        match (&self.mechanism, &self.grid) {
            (Some((mechanism, settings)), Some(grid)) => {
                settings.analyze(MechanismTemplate::new(mechanism, &self.outputs), &grid.points, design)
            }
            (_, grid) => {
                let grids: Vec<_> = self.outputs.iter().map(|o| grid.as_ref().filter(|_| o.is_transient)).collect();
                let formulas = FormulaAnalysis(self.outputs.iter().map(|o| o.formula.expression.clone()).collect());
                let analysis = Analytic::new(formulas, &grids);
                let responses = analysis.analyze(design)?;
                self.check_finite(&analysis, design, &responses)?;
                Ok(responses)
            }
        }
    }

    /// The error about the first output that is not finite. Mechanisms and programs check their outputs themselves.
    #[cfg(feature = "report")]
    fn check_finite(&self, analysis: &impl Analysis, design: &[f64], responses: &Responses) -> Result<()> {
        for (response, (output, values)) in self.outputs.iter().zip(&responses.values).enumerate() {
            if let Some(point) = values.iter().position(|value| !value.is_finite()) {
                let time = self.grid.as_ref().filter(|_| output.is_transient).map(|grid| (grid, point));
                let why = analysis.undefined(design, ResponseAt { response, point });
                let what = format!("response `{}`", output.name);
                return Err(not_finite(what, values[point], time, &self.variables, design, why));
            }
        }
        Ok(())
    }

    fn build(&self, add_objective: impl FnOnce(&mut ProblemBuilder)) -> Result<Problem> {
        let mut parts = ProblemBuilder::new(&self.title);
        for variable in &self.variables {
            // The start in the file of a run may be outside of bounds that were edited later.
            let start = variable.start.clamp(variable.lower, variable.upper);
            parts.variable(DesignVariable { start, ..variable.clone() });
        }
        if let Some(grid) = &self.grid {
            parts.grid(grid.clone());
        }
        for output in self.outputs.iter() {
            let h = if output.is_transient {
                parts.transient(&output.name, &output.unit, 0)
            } else {
                parts.constant(&output.name, &output.unit)
            };
            parts.linearize_in(h, output.intermediates.clone());
        }
        add_objective(&mut parts);
        for constraint in &self.constraints {
            parts.subject_to(constraint.clone());
        }
        if let Some(program) = self.asked_program() {
            return program.build(parts);
        }
        match (&self.mechanism, &self.grid) {
            (Some((mechanism, settings)), Some(grid)) => {
                settings.build(parts, MechanismTemplate::new(mechanism, &self.outputs), &grid.points)
            }
            _ => parts
                .build_analytic(FormulaAnalysis(self.outputs.iter().map(|o| o.formula.expression.clone()).collect())),
        }
    }
}

/// Outputs without a mechanism: formulas of design and time.
struct FormulaAnalysis(Vec<CompiledExpression>);

impl ClosedForm for FormulaAnalysis {
    fn response<S: Scalar>(&self, h: usize, b: &[S], t: S) -> S {
        self.0[h].value(&Inputs::at(b, t))
    }

    fn undefined(&self, h: usize, b: &[f64], t: f64) -> Option<String> {
        self.0[h].undefined(&Inputs::at(b, t))
    }
}
