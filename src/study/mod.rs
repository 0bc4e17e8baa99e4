//! Studies: many runs of one model, and conclusions from them.
//!
//! | module | contents |
//! |---|---|
//! | `file` | the study file: its keys |
//! | `plan` | phases, columns, and the trait of a kind of study |
//! | `error` | errors of studies |
//! | `rows` | rows, and the lines in which they are stored |
//! | `model` | the model as a function of design variables and constants |
//! | `sequence`, `distribution` | points of the unit cube; distributions of variables |
//! | `sample` | grids and samples of analyses |
//! | `multi_start`, `sweep`, `optimum` | optimizations from many starts, over a parameter, on a Pareto front |
//! | `tolerance`, `reliability` | scatter of results, and reliability indices |
//! | `indices` | sensitivity indices |
//! | `figures` | figures of rows |
//!
//! A run is a pure function of its number. Rows are therefore the same for any number of threads, and runs may be done in parts.
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use linkwright::study::{ModelSource, Part, Study, StudyFile};
//!
//! let model = "version = 2\n[design.width]\nstart = 3.0\n[[output]]\nname = \"stress\"\nvalue = \"1/width\"\n";
//! let file = StudyFile::read(
//!     "study.toml",
//!     "version = 1\nmodel = \"bar.toml\"\nkind = \"grid\"\n[vary.width]\nfrom = 1\nto = 2\npoints = 3\n",
//! )?;
//! let source = ModelSource { name: "bar.toml".into(), text: model.into(), programs: None };
//! let study = Study::new(file, &source)?;
//! let rows = study.run(study.no_rows(), Part::WHOLE, &|_| true)?;
//! assert_eq!(study.table(&rows, 0)?.csv(), "run,width,stress,status,failure\n0,1,1,done,\n1,1.5,0.6666666666666666,done,\n2,2,0.5,done,\n");
//! # Ok(())
//! # }
//! ```

mod distribution;
mod error;
mod figures;
mod file;
mod indices;
mod model;
mod multi_start;
mod optimum;
mod plan;
mod reliability;
mod rows;
mod sample;
mod sequence;
mod sweep;
mod tolerance;

pub use distribution::{Distribution, normal_probability, normal_quantile};
pub use error::StudyError;
pub use file::{KINDS, RUNS, StudyFile, StudyKind, Vary, study_tables};
pub use indices::sobol_indices;
pub use model::{Evaluator, ModelSource, QuantityGradients, StudyQuantity, VariedNumber};
pub use plan::{Column, Conclusions, Phase, RunResult, StudyPlan, bisection};
pub use reliability::{DesignPoint, first_order_reliability};
pub use rows::{Row, RowHeader, Rows, StoredRows};
pub use sequence::{PointSequence, SOBOL_DIMENSIONS, SequenceKind};
pub use sweep::undominated;

use self::model::two_sides;
use crate::model_file::{Diagnostic, Read, Word, settings};
use crate::report::number::counted;
use crate::report::page::{Badge, Page, PageSection};
use crate::report::table::Table;
use crate::storage::fnv1a;
use crate::{Error, Result};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Version of row files and study folders.
pub const VERSION: u32 = 1;

/// Largest number of failed runs in the table of the page.
const FAILURES: usize = 50;

/// One of several equal parts of the runs of a study: those whose number leaves the same remainder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Number of the part, from 1.
    pub number: usize,
    /// Number of parts.
    pub of: usize,
}

impl Part {
    /// All runs.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// True if the part has a run.
    pub fn has(self, run: usize) -> bool {
        run % self.of == self.number - 1
    }
}

/// A study: its file, its model, and its plan.
pub struct Study {
    file: StudyFile,
    source: ModelSource,
    title: String,
    plan: Box<dyn StudyPlan>,
}

impl Study {
    /// The study of a file with a model, of which the settings of the file are applied.
    ///
    /// # Errors
    /// If the model has errors, or the study does not fit it; the error names the place in the file.
    pub fn new(file: StudyFile, source: &ModelSource) -> std::result::Result<Self, StudyError> {
        let mut changed = source.clone();
        for (key, value) in &file.settings {
            changed = changed.with([(key.text.as_str(), value.clone())]).map_err(|error| file.at(&key.span, &error))?;
        }
        let title = match file.title.as_str() {
            "" => changed.model()?.title().to_owned(),
            title => title.to_owned(),
        };
        let plan = plan_of(&file, &changed)?;
        let runs = plan.phases().iter().map(|phase| phase.runs as f64).sum::<f64>();
        Error::check_option("number of runs", "at most 10 million", runs, runs <= RUNS as f64)?;
        Ok(Self { file, source: changed, title, plan })
    }

    /// The study file.
    pub fn file(&self) -> &StudyFile {
        &self.file
    }

    /// The model with the settings of the study.
    pub fn source(&self) -> &ModelSource {
        &self.source
    }

    /// Names of the numbers of the model that it varies or sets.
    pub fn changed(&self) -> impl Iterator<Item = &str> {
        let varied = self.file.vary.iter().map(|vary| vary.name.text.as_str());
        varied.chain(self.file.settings.iter().map(|(key, _)| key.text.as_str()))
    }

    /// The title.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// The study with another title.
    #[must_use]
    pub fn titled(self, title: &str) -> Self {
        Self { title: title.to_owned(), ..self }
    }

    /// The phases.
    pub fn phases(&self) -> &[Phase] {
        self.plan.phases()
    }

    /// Number of runs of each phase.
    pub fn runs(&self) -> Vec<usize> {
        self.phases().iter().map(|phase| phase.runs).collect()
    }

    /// True if the runs do not need each other, so that they may be done in parts.
    pub fn has_parts(&self) -> bool {
        self.phases().iter().all(|phase| phase.waves.is_none())
    }

    /// No rows yet.
    pub fn no_rows(&self) -> Rows {
        Rows::new(&self.runs())
    }

    /// The header of its row file, which binds rows to the settings of the study and of the model. Comments, order of keys, and title do
    /// not count.
    pub fn header(&self) -> RowHeader {
        let mut own = settings(&self.file.file, &self.file.text).unwrap_or_default();
        ["title", "model"].iter().for_each(|key| drop(own.remove(*key)));
        let mut model = settings(&self.source.name, &self.source.text).unwrap_or_default();
        model.remove("title");
        RowHeader { study: format!("{:016x}", fnv1a(&format!("{VERSION}\n{own:?}\n{model:?}"))), version: VERSION }
    }

    /// One run, given the rows that it needs.
    ///
    /// # Errors
    /// Those of [`StudyPlan::run`].
    pub fn row(&self, phase: usize, run: usize, done: &Rows) -> Result<Row> {
        Ok(self.phases()[phase].row(phase, run, self.plan.run(phase, run, done)?))
    }

    /// Does the runs of a part that have no row yet, in parallel, and returns all rows. `observe` gets each new row as soon as the run ends, in
    /// any order and one at a time, and stops the study if it returns false: runs that have begun are finished.
    ///
    /// # Errors
    /// If the rows are those of another study, or the runs of the study cannot be done in parts; those of [`row`](Self::row), which stop the
    /// study in the same way as `observe`.
    pub fn run(&self, mut rows: Rows, part: Part, observe: &(dyn Fn(&Row) -> bool + Sync)) -> Result<Rows> {
        if part != Part::WHOLE && !self.has_parts() {
            let why = "its runs start from the results of others";
            return Err(Error::unsupported("parts of this study", why, "do it as a whole, with threads"));
        }
        let stopped = AtomicBool::new(false);
        let one_at_a_time = std::sync::Mutex::new(());
        for (number, phase) in self.phases().iter().enumerate() {
            let all = || (0..phase.runs).filter(|run| part.has(*run)).collect();
            for wave in phase.waves.clone().unwrap_or_else(|| vec![all()]) {
                let missing: Vec<usize> = wave.into_iter().filter(|run| rows.get(number, *run).is_none()).collect();
                let done = |run: usize| {
                    if stopped.load(Ordering::Relaxed) {
                        return Ok(None);
                    }
                    let row = self.row(number, run, &rows).inspect_err(|_| stopped.store(true, Ordering::Relaxed))?;
                    let _alone = one_at_a_time.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                    if !observe(&row) {
                        stopped.store(true, Ordering::Relaxed);
                    }
                    Ok(Some(row))
                };
                let new: Vec<Result<Option<Row>>> = missing.into_par_iter().with_max_len(1).map(done).collect();
                let new = new.into_iter().collect::<Result<Vec<_>>>()?;
                new.into_iter().flatten().try_for_each(|row| rows.add(row))?;
                if stopped.load(Ordering::Relaxed) {
                    return Ok(rows);
                }
            }
        }
        Ok(rows)
    }

    /// Number of runs of a part without a row.
    pub fn missing(&self, rows: &Rows, part: Part) -> usize {
        let of = |(number, phase): (usize, &Phase)| {
            (0..phase.runs).filter(|run| part.has(*run) && rows.get(number, *run).is_none()).count()
        };
        self.phases().iter().enumerate().map(of).sum()
    }

    /// The rows of a phase as a table.
    ///
    /// # Errors
    /// Those of [`Phase::table`].
    pub fn table(&self, rows: &Rows, phase: usize) -> Result<Table> {
        self.phases()[phase].table(&self.title, rows.of(phase))
    }

    /// The conclusions, with a sentence about the runs that failed.
    ///
    /// # Errors
    /// Those of [`StudyPlan::conclude`].
    pub fn conclude(&self, rows: &Rows) -> Result<Conclusions> {
        let mut conclusions = self.plan.conclude(rows)?;
        for (number, phase) in self.phases().iter().enumerate() {
            let failed = || rows.of(number).filter(|row| row.has_failed());
            let Some(first) = failed().next() else { continue };
            let of_phase = if self.phases().len() > 1 { format!(" of {}", phase.name) } else { String::new() };
            conclusions.sentences.push(format!(
                "{} of {} runs{of_phase} failed, and the results are those of the others only; run {}: {}.",
                failed().count(),
                phase.runs,
                first.run,
                first.failure.trim_end_matches('.')
            ));
        }
        Ok(conclusions)
    }
}

impl Study {
    /// The page: what the study answers, figures, tables, and failures.
    pub fn page(&self, rows: &Rows, conclusion: &Conclusions) -> Page {
        let failed = rows.all().filter(|row| row.has_failed()).count();
        let (word, badge) = match failed {
            0 => ("complete".to_owned(), Badge::Good),
            _ => (format!("{} failed", counted(failed, ["run", "runs"])), Badge::Fair),
        };
        let mut answer = conclusion
            .sentences
            .iter()
            .fold(PageSection::new("answer", "Result"), |section, text| section.paragraph(text));
        for (name, caption, figure) in &conclusion.figures {
            answer = answer.figure(name, caption, figure.clone());
        }
        for (_, table) in &conclusion.tables {
            answer = answer.table(table.clone());
        }
        let page = Page::new(self.title()).status(word, badge).card("runs", rows.len().to_string(), "").with(answer);
        if failed > 0 { page.with(self.failures(rows)) } else { page }
    }

    fn failures(&self, rows: &Rows) -> PageSection {
        let mut table = Table::new("Failed runs", ["phase", "run", "reason"]);
        for row in rows.all().filter(|row| row.has_failed()).take(FAILURES) {
            let cells = [self.phases()[row.phase].name.into(), row.run.into(), row.failure.as_str().into()];
            table.push(cells).expect("the row has three cells");
        }
        PageSection::new("failures", "Failures").table(table)
    }
}

impl StudyFile {
    /// An error at a place of this file.
    fn at(&self, span: &std::ops::Range<usize>, error: &dyn std::fmt::Display) -> StudyError {
        let text = error.to_string();
        let message = text.lines().next().unwrap_or_default().to_owned();
        StudyError::File(self.report(Diagnostic::new(span.clone(), message)))
    }

    /// The quantities that the study file names, or the default ones.
    fn wanted(&self, evaluator: &Evaluator) -> std::result::Result<Vec<StudyQuantity>, StudyError> {
        if self.quantities.is_empty() {
            return Ok(evaluator.usual());
        }
        let mut wanted: Vec<StudyQuantity> = vec![];
        for word in &self.quantities {
            let all = evaluator.quantities();
            // A name of a constraint with limits on both sides means both.
            let sides = two_sides(&word.text);
            let is_named = |q: &&StudyQuantity| q.name == word.text;
            let named: Vec<&StudyQuantity> = match all.iter().any(|q| is_named(&q)) {
                true => all.iter().filter(is_named).collect(),
                false => all.iter().filter(|q| sides.contains(&q.name)).collect(),
            };
            if named.is_empty() {
                return Err(self.unknown(word, "quantity", all.iter().map(|q| q.name.as_str())));
            }
            wanted.extend(named.into_iter().cloned());
        }
        Ok(wanted)
    }

    /// The model as a function of what varies.
    fn evaluator(&self, source: &ModelSource) -> std::result::Result<Evaluator, StudyError> {
        let model = source.model()?;
        for vary in &self.vary {
            if VariedNumber::of(&model, &vary.name.text).is_err() {
                return Err(self.unknown(&vary.name, "design variable or constant", model::names(&model)));
            }
        }
        let names: Vec<String> = self.vary.iter().map(|vary| vary.name.text.clone()).collect();
        Evaluator::new(source, &names)
    }

    /// The distributions of what varies.
    fn distributions(&self, evaluator: &Evaluator) -> std::result::Result<Vec<Distribution>, StudyError> {
        let all = self.vary.iter().zip(evaluator.varied());
        all.map(|(vary, number)| self.here(vary.distribution(number))).collect()
    }

    /// A result of reading this file, whose error shows the place in it.
    fn here<T>(&self, read: Read<T>) -> std::result::Result<T, StudyError> {
        read.map_err(|diagnostic| StudyError::File(self.report(diagnostic)))
    }

    /// The error about a name that the model does not have.
    fn unknown<'k>(&self, name: &Word, kind: &str, known: impl IntoIterator<Item = &'k str>) -> StudyError {
        StudyError::File(self.report(Diagnostic::unknown(name.span.clone(), kind, &name.text, known)))
    }
}

fn plan_of(file: &StudyFile, source: &ModelSource) -> std::result::Result<Box<dyn StudyPlan>, StudyError> {
    Ok(match file.kind {
        StudyKind::Grid | StudyKind::Sample => Box::new(sample::Analyses::new(file, source)?),
        StudyKind::MultiStart => Box::new(multi_start::MultiStartPlan::new(file, source)?),
        StudyKind::Sweep | StudyKind::Pareto => Box::new(sweep::Sweep::new(file, source)?),
        StudyKind::Tolerance => Box::new(tolerance::Tolerances::new(file, source)?),
        StudyKind::Indices => Box::new(indices::Indices::new(file, source)?),
    })
}
