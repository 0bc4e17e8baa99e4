//! `[analysis]` of the kind `program`: another program computes the outputs.

use super::analysis::DerivativeSetting;
use super::key::{Accepts, Key, TableKeys, default, required};
use super::outputs::OutputSpec;
use super::section::{Read, Section};
use crate::model_file::expression::Names;
use crate::model_file::limits;
use crate::problem::{Analysis, DesignVariable, Problem, ProblemBuilder, ResponseAt, Responses};
use crate::responses::Differences;
use crate::responses::program::{Program, ProgramAnalysis, WithThreads};
use crate::{Error, Result};
use nalgebra::DMatrix;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The name of this kind of analysis.
pub const KIND: &str = "program";

pub const KEYS: &[Key] = &[
    required(
        "command",
        Accepts::Texts,
        "the program and its arguments; no shell reads them; the working folder is that of the model file",
    ),
    default("time_limit", Accepts::Number, "600", "longest time for an answer, s"),
    default("retries", Accepts::Count, "1", "how often a request is repeated after the program broke down or was late"),
    default("jobs", Accepts::Count, "1", "number of processes at once, for differences"),
];

/// Declaration for documentation and schema.
pub const TABLE: TableKeys = TableKeys {
    name: "analysis",
    kind: Some(KIND),
    about: "another program computes the outputs, see `docs/programs.md`; it is started only with `--allow-programs`",
    keys: KEYS,
};

/// A program and how its outputs are differentiated.
#[derive(Clone, Debug)]
pub struct ProgramSpec {
    program: Program,
    derivatives: DerivativeSetting,
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
    let program = Program { command, folder: None, time_limit, retries, jobs };
    Ok(Some(ProgramSpec { program, derivatives }))
}

impl ProgramSpec {
    /// The program as text, for messages.
    pub fn command(&self) -> String {
        self.program.command.join(" ")
    }

    /// The problem whose responses are the answers of the program, if it may be started in a folder.
    pub fn build(
        &self,
        parts: ProblemBuilder,
        folder: Option<&Path>,
        variables: &[DesignVariable],
        times: &[f64],
        outputs: &[OutputSpec],
    ) -> Result<Problem> {
        let Some(folder) = folder else { return parts.build(NotAllowed { command: self.command() }) };
        let folder = if folder.as_os_str().is_empty() { PathBuf::from(".") } else { folder.to_owned() };
        let program = Program { folder: Some(folder), ..self.program.clone() };
        let jobs = program.jobs;
        let names = variables.iter().map(|variable| variable.name.as_str());
        let responses = outputs.iter().map(|output| (output.name.as_str(), output.is_transient));
        let analysis = ProgramAnalysis::new(program, names, times, responses)?;
        match self.derivatives {
            DerivativeSetting::Forward(step) => {
                parts.build(WithThreads::new(Differences::forward(analysis, step)?, jobs)?)
            }
            DerivativeSetting::Central(step) => {
                parts.build(WithThreads::new(Differences::central(analysis, step)?, jobs)?)
            }
            DerivativeSetting::Richardson(step) => {
                parts.build(WithThreads::new(Differences::richardson(analysis, step)?, jobs)?)
            }
            DerivativeSetting::NoiseAware => parts.build(WithThreads::new(Differences::noise_aware(analysis), jobs)?),
            DerivativeSetting::Automatic | DerivativeSetting::By(..) => parts.build(analysis),
        }
    }
}

/// In the place of a program that must not be started.
struct NotAllowed {
    command: String,
}

impl NotAllowed {
    fn error(&self) -> Error {
        let why = "a model file starts no program unless that is allowed";
        Error::unsupported(
            format!("the program `{}`", self.command),
            why,
            "look at the file and the program, then add --allow-programs (in Rust: Model::allow_programs)",
        )
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
