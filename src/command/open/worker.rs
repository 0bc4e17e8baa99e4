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

/// A request. States of runs are JSON; the answer to a request for a run is such a state.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WorkerRequest {
    /// The record of a design.
    Analyze { design: Vec<f64>, derivatives: bool },
    /// The start of a run.
    Start,
    /// The next trial step.
    Step { state: String },
    /// The same state, if it can be continued, with the status that it has now.
    Restart { state: String },
    /// The proposal that was rejected last becomes the design.
    Accept { state: String },
}

/// The answer to a request for a run.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunAnswer {
    /// The new state.
    State(String),
    /// The reason why there is none.
    Error(String),
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
                    None => steps.insert(Steps::new(first.model()?)?),
                };
                serde_json::to_string(&match steps.done(&request) {
                    Ok(state) => RunAnswer::State(state),
                    Err(error) => RunAnswer::Error(message(&error)),
                })?
            }
        };
        writeln!(output, "{answer}")?;
        output.flush()?;
    }
    Ok(())
}

/// A model of which runs are done.
struct Steps {
    model: Model,
    problem: Problem,
    /// The newest state, with what its analysis keeps for the derivatives, and as JSON.
    last: Option<(RunState, String)>,
}

impl Steps {
    fn new(model: Model) -> anyhow::Result<Self> {
        let problem = located(&model, model.problem())?;
        Ok(Self { model, problem, last: None })
    }

    /// The state after a request, as JSON.
    fn done(&mut self, request: &WorkerRequest) -> anyhow::Result<String> {
        let known = self.last.take();
        let (method, problem) = (self.model.method(), &self.problem);
        let state_of = |text: &str| match known {
            Some((state, of)) if of == text => Ok(state),
            _ => RunState::from_json(text, problem),
        };
        let state = match request {
            WorkerRequest::Start | WorkerRequest::Analyze { .. } => method.start(problem),
            WorkerRequest::Step { state } => state_of(state).and_then(|state| method.step(problem, state)),
            WorkerRequest::Restart { state } => state_of(state).and_then(|state| method.restart(problem, state)),
            WorkerRequest::Accept { state } => state_of(state).and_then(|state| method.accept_by_hand(problem, state)),
        };
        let state = located(&self.model, state)?;
        let text = state.to_json();
        self.last = Some((state, text.clone()));
        Ok(text)
    }
}
