//! `[analysis]` of the kind `program`: another program computes the outputs.

use super::analysis::DerivativeSetting;
use super::key::{Accepts, Key, TableKeys, default, required};
use super::outputs::OutputSpec;
use super::section::{Read, Section};
use crate::model_file::expression::Names;
use crate::model_file::limits;
use crate::problem::{Analysis, DesignVariable, Problem, ProblemBuilder, ResponseAt, Responses, TimeGrid};
use crate::responses::Differences;
use crate::responses::program::{ExternalProgram, ProgramAnalysis, WithThreads};
use crate::{Error, Result};
use nalgebra::DMatrix;
use std::path::Path;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// The name of this kind of analysis.
pub const KIND: &str = "program";

pub const KEYS: &[Key] = &[
    required(
        "command",
        Accepts::Texts,
        "the program and its arguments; no shell reads them; the working folder is that of the model file",
    ),
    default("time_limit", Accepts::Number, "600", "longest time for an answer, s").of("s"),
    default(
        "retries",
        Accepts::Count,
        "1",
        "how often a request is repeated after the program crashed or exceeded the time limit",
    ),
    default("jobs", Accepts::Count, "1", "number of processes at once, for differences"),
];

/// Declaration for documentation and schema.
pub const TABLE: TableKeys = TableKeys {
    name: "analysis",
    kind: Some(KIND),
    about: "another program computes the outputs, see `docs/programs.md`; it is started only with `--allow-programs`",
    keys: KEYS,
};

/// A program, and the method that differentiates its outputs. It may be started only if `program` has a folder.
pub struct ProgramSpec {
    program: ExternalProgram,
    derivatives: DerivativeSetting,
    /// The started program and its answers, as soon as they are needed.
    analysis: OnceLock<Arc<ProgramAnalysis>>,
}

/// Reads `[analysis]` if its kind is `program`.
pub fn read(file: &Section<'_>, names: &Names) -> Read<Option<ProgramSpec>> {
    let Some(value) = file.get("analysis") else { return Ok(None) };
    let kind = value.get_ref().as_table().and_then(|table| table.get("kind"));
    if kind.and_then(|kind| kind.get_ref().as_str()) != Some(KIND) {
        return Ok(None);
    }
    if let Some(key) =
        ["body", "beam", "joint", "driver", "force", "point", "gravity"].into_iter().find(|key| file.has(key))
    {
        let message = format!("a program computes the outputs, so there cannot be a mechanism (`{key}`)");
        return Err(file.error_at(key, message).help("remove the mechanism, or choose another kind of analysis"));
    }
    let section = Section::open(value, "[analysis]", &[super::analysis::KEYS, KEYS], file.source())?;
    let command = section.texts("command")?;
    if command.first().is_none_or(String::is_empty) {
        return Err(section
            .error_at("command", "the command is empty")
            .help("for instance [\"python3\", \"analysis.py\"]"));
    }
    let time_limit = section.number("time_limit", names)?.unwrap_or(600.0);
    let Some(time_limit) = Duration::try_from_secs_f64(time_limit).ok().filter(|limit| !limit.is_zero()) else {
        return Err(section.error_at("time_limit", "`time_limit` must be a positive number of seconds"));
    };
    let jobs = section.count("jobs", limits::JOBS)?.unwrap_or(1);
    if jobs == 0 {
        return Err(section.error_at("jobs", "`jobs` must be at least 1"));
    }
    let retries = section.count("retries", limits::RETRIES)?.unwrap_or(1);
    let derivatives = DerivativeSetting::of_program(&section, names)?;
    let program = ExternalProgram { command, folder: None, time_limit, retries, jobs };
    Ok(Some(ProgramSpec { program, derivatives, analysis: OnceLock::new() }))
}

impl ProgramSpec {
    /// The program as text, for messages.
    pub fn command(&self) -> String {
        self.program.command.join(" ")
    }

    /// True if the derivatives are those of the program.
    fn gives_derivatives(&self) -> bool {
        matches!(self.derivatives, DerivativeSetting::Automatic | DerivativeSetting::By(..))
    }

    /// Allows the program to be started, in this working folder.
    pub fn allow_in(&mut self, folder: &Path) {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        self.program.folder = Some(folder.to_owned());
        self.analysis = OnceLock::new();
    }

    /// The program with the requests of a model: outputs at the points of a grid, as functions of variables.
    pub fn asked<'m>(
        &'m self,
        variables: &'m [DesignVariable],
        grid: Option<&'m TimeGrid>,
        outputs: &'m [OutputSpec],
    ) -> AskedProgram<'m> {
        AskedProgram { spec: self, variables, grid, outputs }
    }
}

/// A program with the requests of a model.
pub struct AskedProgram<'m> {
    spec: &'m ProgramSpec,
    variables: &'m [DesignVariable],
    grid: Option<&'m TimeGrid>,
    outputs: &'m [OutputSpec],
}

impl AskedProgram<'_> {
    /// The analysis by the program, or `None` if it must not be started.
    ///
    /// The bound of a peak is a variable of the problem, not of the program.
    pub fn analysis(&self) -> Result<Option<Arc<ProgramAnalysis>>> {
        let spec = self.spec;
        if spec.program.folder.is_none() {
            return Ok(None);
        }
        if let Some(analysis) = spec.analysis.get() {
            return Ok(Some(Arc::clone(analysis)));
        }
        let names = self.variables.iter().map(|variable| variable.name.as_str());
        let times = self.grid.map_or(&[][..], |grid| &grid.points);
        let responses = self.outputs.iter().map(|output| (output.name.as_str(), output.is_transient));
        let analysis = ProgramAnalysis::new(spec.program.clone(), names, times, responses)?;
        let analysis = Arc::new(if spec.gives_derivatives() { analysis.with_derivatives() } else { analysis });
        Ok(Some(Arc::clone(spec.analysis.get_or_init(|| analysis))))
    }

    fn not_allowed(&self) -> NotAllowed {
        NotAllowed { command: self.spec.command() }
    }

    /// The outputs at a design.
    #[cfg(feature = "report")]
    pub fn analyze(&self, design: &[f64]) -> Result<Responses> {
        match self.analysis()? {
            Some(analysis) => {
                analysis.analyze_many(&[design.to_vec()]).pop().unwrap_or_else(|| analysis.analyze(design))
            }
            None => self.not_allowed().analyze(design),
        }
    }

    /// The problem whose responses are the answers of the program.
    pub fn build(&self, parts: ProblemBuilder) -> Result<Problem> {
        let Some(analysis) = self.analysis()? else { return parts.build(self.not_allowed()) };
        let jobs = self.spec.program.jobs;
        let differences = match self.spec.derivatives {
            DerivativeSetting::Forward(step) => Differences::forward(analysis, step)?,
            DerivativeSetting::Central(step) => Differences::central(analysis, step)?,
            DerivativeSetting::Richardson(step) => Differences::richardson(analysis, step)?,
            DerivativeSetting::NoiseAware => Differences::noise_aware(analysis),
            DerivativeSetting::Automatic | DerivativeSetting::By(..) => return parts.build(analysis),
        };
        let differences = differences.with_variables(parts.variables());
        parts.build(WithThreads::new(differences, jobs)?)
    }
}

/// Replaces a program that must not be started.
struct NotAllowed {
    command: String,
}

impl NotAllowed {
    fn error(&self) -> Error {
        Error::File {
            file: format!("the program `{}`", self.command),
            why: "a model file starts no program unless that is allowed".to_owned(),
            remedy:
                "look at the file and the program, then add --allow-programs (in Python: allow_programs=True; in Rust: \
                     Model::allow_programs)"
                    .to_owned(),
        }
    }
}

impl Analysis for NotAllowed {
    fn analyze(&self, _: &[f64]) -> Result<Responses> {
        Err(self.error())
    }

    fn sensitivities(&self, _: &[f64], _: &Responses, _: &[ResponseAt]) -> Result<DMatrix<f64>> {
        Err(self.error())
    }
}
