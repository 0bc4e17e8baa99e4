//! The process that analyses designs. Standard input: the model as a line of JSON, then a request in each line; standard output: an
//! answer in each line. The process ends with its standard input, even in the middle of an analysis.

use super::super::budget::Budget;
use super::super::model::with_program;
use super::analysis::AnalysedModel;
use super::guard::message;
use anyhow::Context;
use linkwright::model_file::read;
use linkwright::responses::program::end_programs;
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::io::{BufRead, Write};
use std::path::Path;
use std::sync::mpsc;

/// The first line.
#[derive(Serialize, Deserialize)]
pub struct ModelLine {
    /// Path of the model file, for messages and programs.
    pub file: String,
    /// Its text.
    pub text: String,
}

#[derive(Deserialize)]
struct Wanted {
    design: Vec<f64>,
    derivatives: bool,
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
    let file = Path::new(&first.file);
    let mut model = AnalysedModel::new(with_program(read(&first.file, &first.text)?, file), budget);
    let mut output = std::io::stdout().lock();
    for line in lines {
        let wanted: Wanted = serde_json::from_str(&line)?;
        let answer = match model.analyse(&wanted.design, wanted.derivatives) {
            Ok(record) => serde_json::to_string(&record)?,
            Err(error) => json!({ "error": message(&error) }).to_string(),
        };
        writeln!(output, "{answer}")?;
        output.flush()?;
    }
    Ok(())
}
