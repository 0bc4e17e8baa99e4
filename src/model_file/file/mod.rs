//! Sections of a model file: what may stand in them, and what they make.
//!
//! | file | what |
//! |---|---|
//! | `key` | the keys that a section has: one declaration for reader, documentation and schema |
//! | `section` | a table while it is read: known keys, typed values, places |
//! | `log` | mistakes, of which several are shown at once, and where parts stand |
//! | `origin` | the file, to say where what fails in an analysis stands |
//! | `each` | one table that stands for several |
//! | `naming` | design variables, constants, named expressions |
//! | `parts`, `bodies`, `beams`, `element_kinds`, `elements`, `motion`, `feedback` | the mechanism |
//! | `mechanism` | all of it as a pure function of the design |
//! | `measures`, `outputs` | responses |
//! | `time`, `analysis` | time points; how the mechanism is analysed |
//! | `quantity`, `objective`, `constraints` | formulas of responses |
//! | `method` | how the problem is solved |
//! | `drawing` | the mechanism in motion, as pictures |

mod analysis;
mod beams;
mod bodies;
mod constraints;
#[cfg(feature = "report")]
mod drawing;
mod each;
mod element_kinds;
mod elements;
mod feedback;
mod key;
mod log;
mod measures;
mod mechanism;
mod method;
mod motion;
mod naming;
mod objective;
mod origin;
mod outputs;
mod parts;
mod quantity;
mod section;
mod time;

pub(super) use element_kinds::element_of;
pub use key::{Accepts, Key, Need, Table};

use super::{Diagnostic, DiagnosticReport, limits};
use crate::Result;
use crate::model_file::expression::{Inputs, Program};
use crate::problem::{ClosedForm, Constraint, DesignVariable, Problem, ProblemBuilder, TimeGrid};
use crate::sao::Method;
use autodiff::Scalar;
use key::{default, optional, required};
use log::{FileSource, Log};
use mechanism::{MechanismSpec, MechanismTemplate};
use objective::Objective;
use origin::Origin;
use outputs::Output;
use section::{Read, Section};
use std::sync::Arc;
use toml::de::{DeTable, DeValue};

const KEYS: &[Key] = &[
    required("version", Accepts::Count, "version of the format: 1"),
    default("title", Accepts::Text, "", "a line for tables and figures"),
    optional("design", Accepts::Tables, "design variables, as tables [design.NAME]"),
    optional("constants", Accepts::Table, "names for numbers: NAME = 1.0, or an expression of others"),
    optional("expressions", Accepts::Table, "names for expressions of design variables, constants and time"),
    optional("gravity", Accepts::Pair, "gravitational acceleration [x, y] in m/s²; none if left out"),
    optional("body", Accepts::Tables, "what moves"),
    optional("beam", Accepts::Tables, "flexible beams"),
    optional("point", Accepts::Tables, "named points of bodies"),
    optional("joint", Accepts::Tables, "what joins bodies"),
    optional("driver", Accepts::Tables, "what moves as prescribed"),
    optional("force", Accepts::Tables, "what pushes and pulls"),
    optional("time", Accepts::Table, "the time points of all histories"),
    optional("series", Accepts::Table, "rows of numbers, one for each time point: NAME = [ … ]"),
    optional("analysis", Accepts::Table, "how the mechanism is analysed"),
    optional("output", Accepts::Tables, "responses of the analysis"),
    optional("objective", Accepts::Table, "what is minimized"),
    optional("constraint", Accepts::Tables, "what must hold"),
    optional("method", Accepts::Table, "how the problem is solved; the paper's method if left out"),
];

/// The version of the format that is read.
const VERSION: usize = 1;

/// All tables that a file may have, with their keys.
pub fn tables() -> Vec<Table> {
    let top = Table { name: "", kind: None, about: "the file", keys: KEYS };
    let design = Table { name: "design.NAME", kind: None, about: "a design variable", keys: naming::DESIGN };
    let mut all = vec![top, design];
    all.extend(bodies::tables());
    all.extend(beams::TABLES);
    all.extend(element_kinds::tables());
    all.extend(motion::TABLES.iter().chain(time::TABLES).chain(analysis::TABLES).chain(outputs::TABLES));
    all.extend(objective::TABLES.iter().chain(constraints::TABLES).chain(method::TABLES));
    all
}

/// A model: mechanism or closed form, problem and method.
pub struct Model {
    title: String,
    variables: Vec<DesignVariable>,
    plan: Option<(Arc<MechanismSpec>, analysis::Settings)>,
    grid: Option<TimeGrid>,
    outputs: Arc<Vec<Output>>,
    objective: Objective,
    constraints: Vec<Constraint>,
    method: Method,
    fingerprint: u64,
    origin: Origin,
}

/// Reads a model; `file` is its name in messages.
///
/// **Errors.** The first mistakes, with their places; those that follow from others are left out.
pub fn read(file: &str, text: &str) -> std::result::Result<Model, Box<DiagnosticReport>> {
    let log = Log::default();
    let model = log.keep(model(file, FileSource { text, log: &log }));
    let (mut mistakes, places) = log.into_parts();
    let origin = Origin { file: file.to_owned(), text: text.to_owned(), places };
    match model {
        Some(model) if mistakes.is_empty() => Ok(Model { origin, ..model }),
        _ => {
            let others = mistakes.split_off(1);
            let complaint = mistakes.remove(0);
            Err(Box::new(DiagnosticReport { file: origin.file, text: origin.text, complaint, others }))
        }
    }
}

fn model(file: &str, source: FileSource<'_>) -> Read<Model> {
    let text = source.text;
    if text.len() > limits::FILE {
        let message = format!("a file of {} bytes is too long", text.len());
        return Err(Diagnostic::new(0..0, message).help(format!("at most {} are read", limits::FILE)));
    }
    let broken = |e: toml::de::Error| {
        let complaint = |message: &str| Diagnostic::new(e.span().unwrap_or(0..0), message);
        match first_line(e.message()) {
            deep if deep.contains("recurs") => {
                complaint("tables and lists are too deep inside each other").help("a model needs three levels")
            }
            message => complaint(&message),
        }
    };
    let table = DeTable::parse(text).map_err(broken)?.into_inner();
    check_version(&table)?;
    let section = Section::of(table, 0..text.len(), "the file", &[KEYS], source)?;
    // A section with a wrong name is as good as missing: whatever it has would be missed below.
    source.log.stop()?;
    let (mut names, variables) = naming::read(&section)?;
    let plan = mechanism::read(&section, &names)?;
    let grid = time::read(&section, &names)?;
    let series = quantity::series(&section, &names, grid.as_ref())?;
    let outputs = outputs::read(&section, &names, plan.as_ref().map(|plan| &plan.parts), &variables, grid.as_ref())?;
    let bound = objective::read_bound(&section, &mut names)?;
    let all: Vec<DesignVariable> = variables.iter().chain(&bound).cloned().collect();
    naming::some(&all, &section)?;
    check_times(&section, &outputs, grid.as_ref())?;
    let outputs = extended(outputs, &variables, &bound);
    let known = quantity::QuantityContext { names: &names, outputs: &outputs, series: &series };
    let objective = source.log.keep(objective::read(&section, &known, grid.as_ref(), &all, bound));
    let constraints = constraints::read(&section, &known, grid.as_ref(), &all)?;
    let method = source.log.keep(method::read(&section, &names));
    let plan = match (plan, &grid) {
        (None, _) => None,
        (Some(plan), Some(grid)) => {
            let settings = analysis::read(&section, &names, grid, plan.coordinates())?;
            Some((Arc::new(plan), settings))
        }
        (Some(_), None) => return Err(section.complain("time", "a mechanism needs time points").help("add [time]")),
    };
    let title = section.text("title")?;
    let title = if title.is_empty() { file.to_owned() } else { title };
    let fingerprint = fingerprint(&section.table);
    let (outputs, origin) = (Arc::new(outputs), Origin::default());
    source.log.stop()?;
    let (objective, method) = (objective.expect("no mistake was noted"), method.expect("no mistake was noted"));
    Ok(Model { title, variables, plan, grid, outputs, objective, constraints, method, fingerprint, origin })
}

/// Intermediate variables for one design variable more, if a peak has added it.
fn extended(outputs: Vec<Output>, variables: &[DesignVariable], bound: &Option<DesignVariable>) -> Vec<Output> {
    use crate::problem::{Intermediate, Intermediates};
    let longer = |mut output: Output| {
        if let (Intermediates::Each(each), Some(_)) = (&mut output.intermediates, bound) {
            each.resize(variables.len() + 1, Intermediate::Identity);
        }
        output
    };
    outputs.into_iter().map(longer).collect()
}

/// Another version may have other keys: it is looked at before everything else.
fn check_version(table: &DeTable<'_>) -> Read<()> {
    let Some(value) = table.get("version") else {
        let help = format!("write version = {VERSION} in the first line");
        return Err(Diagnostic::new(0..0, "the file lacks `version`").help(help));
    };
    let version = value.get_ref().as_integer().and_then(|i| i.as_str().parse().ok());
    if version == Some(VERSION) {
        return Ok(());
    }
    let message = format!("this program reads version {VERSION} of the format");
    Err(Diagnostic::new(value.span(), message).label(format!("expected {VERSION}")))
}

fn check_times(section: &Section<'_>, outputs: &[Output], grid: Option<&TimeGrid>) -> Read<()> {
    match outputs.iter().find(|o| o.is_transient && grid.is_none()) {
        None => Ok(()),
        Some(output) => {
            let message = format!("the output `{}` changes with time, but there are no time points", output.name);
            Err(section.complain("time", message).help("add [time] with `to` and `points`"))
        }
    }
}

fn first_line(message: &str) -> String {
    message.lines().next().unwrap_or("").to_owned()
}

/// A number that tells problems apart: of everything but method, title, and bounds of design variables. Comments and order of
/// keys do not matter.
fn fingerprint(table: &DeTable<'_>) -> u64 {
    let mut text = String::new();
    for (key, value) in table {
        if !matches!(&**key.get_ref(), "method" | "title") {
            text += key.get_ref();
            write_plainly(value.get_ref(), &mut text);
        }
    }
    // FNV-1a, which is the same on every machine and in every version.
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

fn write_plainly(value: &DeValue<'_>, out: &mut String) {
    match value {
        DeValue::String(text) => *out += &format!("{text:?}"),
        DeValue::Integer(i) => *out += i.as_str(),
        DeValue::Float(f) => *out += f.as_str(),
        DeValue::Boolean(b) => *out += if *b { "true" } else { "false" },
        DeValue::Datetime(_) => {}
        DeValue::Array(list) => list.iter().for_each(|item| {
            write_plainly(item.get_ref(), out);
            out.push(',');
        }),
        DeValue::Table(table) => {
            let is_variable = table.contains_key("start");
            for (key, value) in table {
                // Bounds of design variables may change between two parts of a run.
                if !(is_variable && matches!(&**key.get_ref(), "lower" | "upper")) {
                    *out += &format!("{:?}=", key.get_ref());
                    write_plainly(value.get_ref(), out);
                    out.push(';');
                }
            }
        }
    }
}

impl Model {
    /// The title, or the name of the file.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// The method, with its settings.
    pub fn method(&self) -> &Method {
        &self.method
    }

    /// A number that tells problems apart: of everything in the file but method, title, bounds of design variables and comments.
    pub fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    /// An error of this model's problem as a fault of the file: the part that is to blame, underlined. None if the error names
    /// no part of the file.
    pub fn locate(&self, error: &crate::Error) -> Option<DiagnosticReport> {
        self.origin.locate(error)
    }

    /// The optimization problem.
    ///
    /// **Errors.** As [`ProblemBuilder::build`].
    pub fn problem(&self) -> Result<Problem> {
        let mut parts = ProblemBuilder::new(&self.title);
        for variable in &self.variables {
            parts.variable(variable.clone());
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
        self.objective.build(&mut parts);
        for constraint in &self.constraints {
            parts.subject_to(constraint.clone());
        }
        match (&self.plan, &self.grid) {
            (Some((plan, settings)), Some(grid)) => {
                settings.build(parts, MechanismTemplate::new(plan, &self.outputs), &grid.points)
            }
            _ => parts.build_analytic(Formulas(self.outputs.iter().map(|o| o.program.clone()).collect())),
        }
    }
}

/// Responses as formulas of design and time.
struct Formulas(Vec<Program>);

impl ClosedForm for Formulas {
    fn response<S: Scalar>(&self, h: usize, b: &[S], t: S) -> S {
        self.0[h].value(&Inputs::at(b, t))
    }
}
