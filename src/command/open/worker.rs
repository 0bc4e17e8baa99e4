//! The process that analyses designs and does the steps of runs, so that both can be stopped at any moment. Standard input: the model as
//! a line of JSON, then a request in each line; standard output: an answer in each line. The process ends with its standard input, even in
//! the middle of an analysis.

use super::super::budget::Budget;
use super::super::model::{located, with_program};
use super::analysis::AnalysedModel;
use super::guard::message;
use anyhow::Context;
use linkwright::model_file::{Model, read_of_run};
use linkwright::problem::Problem;
use linkwright::responses::program::end_programs;
use linkwright::sao::RunState;
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::io::{BufRead, Write};
use std::path::Path;
use std::sync::mpsc;

/// The first line: a model.
#[derive(Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelLine {
    /// Its name in messages.
    pub name: String,
    /// Path of the model file; programs run in its folder.
    pub file: String,
    /// Its text.
    pub text: String,
}

impl ModelLine {
    /// The model.
    pub fn model(&self) -> anyhow::Result<Model> {
        let model = read_of_run(&self.name, &self.text)?.copied_from(&self.file);
        Ok(with_program(model, Path::new(&self.file)))
    }
}

/// A request. The answer to a request for a run is its new state; without a state, the newest one is continued.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WorkerRequest {
    /// The record of a design.
    Analyze { design: Vec<f64>, derivatives: bool },
    /// The start of a run.
    Start,
    /// The next trial step.
    Step { state: Option<Box<RunState>> },
    /// The state with the status that its stop test gives now; an error if the run cannot be continued.
    Restart { state: Option<Box<RunState>> },
    /// The proposal that was rejected last becomes the design.
    Accept { state: Option<Box<RunState>> },
}

/// The answer to a request for a run.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunAnswer {
    /// The new state.
    State(Box<RunState>),
    /// The reason why there is none.
    Error(String),
}

impl RunAnswer {
    fn state(self) -> Option<Box<RunState>> {
        match self {
            Self::State(state) => Some(state),
            Self::Error(_) => None,
        }
    }
}

/// Answers until standard input ends.
pub fn run(budget: Budget) -> anyhow::Result<()> {
    let (sender, lines) = mpsc::channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            drop(sender.send(line));
        }
        end_programs();
        std::process::exit(0);
    });
    let first: ModelLine = serde_json::from_str(&lines.recv().context("there is no model")?)?;
    let mut analysed = None;
    let mut steps = None;
    let mut output = std::io::stdout().lock();
    for line in lines {
        let answer = match serde_json::from_str(&line)? {
            WorkerRequest::Analyze { design, derivatives } => {
                let model = match &mut analysed {
                    Some(model) => model,
                    None => analysed.insert(AnalysedModel::new(first.model()?, budget)),
                };
                match model.analyse(&design, derivatives) {
                    Ok(record) => serde_json::to_string(&record)?,
                    Err(error) => json!({ "error": message(&error) }).to_string(),
                }
            }
            request => {
                let steps = match &mut steps {
                    Some(steps) => steps,
                    None => steps.insert(OptimizedModel::new(first.model()?)?),
                };
                let answer =
                    steps.done(request).map_or_else(|error| RunAnswer::Error(message(&error)), RunAnswer::State);
                let text = serde_json::to_string(&answer)?;
                steps.newest = answer.state();
                text
            }
        };
        writeln!(output, "{answer}")?;
        output.flush()?;
    }
    Ok(())
}

/// A model of which runs are done.
struct OptimizedModel {
    model: Model,
    problem: Problem,
    /// The state of the last answer, with what its analysis keeps for the derivatives.
    newest: Option<Box<RunState>>,
}

impl OptimizedModel {
    fn new(model: Model) -> anyhow::Result<Self> {
        let problem = located(&model, model.problem())?;
        Ok(Self { model, problem, newest: None })
    }

    /// The state after a request.
    fn done(&mut self, request: WorkerRequest) -> anyhow::Result<Box<RunState>> {
        let newest = self.newest.take();
        let of = |given: Option<Box<RunState>>| given.or(newest).map(|state| *state).context("there is no state");
        let (method, problem) = (self.model.method(), &self.problem);
        let state = match request {
            WorkerRequest::Start | WorkerRequest::Analyze { .. } => method.start(problem),
            WorkerRequest::Step { state } => method.step(problem, of(state)?),
            WorkerRequest::Restart { state } => method.restart(problem, of(state)?),
            WorkerRequest::Accept { state } => method.accept_rejected_step(problem, of(state)?),
        };
        located(&self.model, state).map(Box::new)
    }
}
