//! The analysis whose responses a program computes.

use super::ExternalProgram;
use super::answers::Answers;
use super::processes::Processes;
use super::protocol::{Answer, Declared, ProgramResponse};
use crate::problem::{Analysis, ContinuousTime, GradientMethod, ResponseAt, ResponseSum, Responses};
use crate::storage::Directory;
use error::{Error, Result};
use nalgebra::DMatrix;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// An [`Analysis`] by another program: see [the module](super).
///
/// Answers are stored (up to 2²⁴ numbers, the oldest are removed first), so that no design is analysed twice. Derivatives are
/// those that the program gives, for which [`with_derivatives`](Self::with_derivatives) asks together with the values; for a program that gives
/// none, use [`Differences`](crate::responses::Differences) of this analysis, in [`WithThreads`] for several processes at once.
///
/// The program receives the first design variables, those with names; no response depends on further ones, such as the bound of a
/// peak.
pub struct ProgramAnalysis {
    declared: Declared,
    processes: Processes,
    answers: Mutex<Answers>,
    /// True if the analysis of one design asks for derivatives, too.
    has_derivatives: bool,
}

impl ProgramAnalysis {
    /// The analysis by `program` of the responses, each with its name and `true` for a history over `times`.
    ///
    /// The program is started by the first analysis.
    ///
    /// # Errors
    /// [`Error::Definition`] without a command or responses, or if two names are equal.
    pub fn new<'n>(
        program: ExternalProgram,
        variables: impl IntoIterator<Item = &'n str>,
        times: &[f64],
        responses: impl IntoIterator<Item = (&'n str, bool)>,
    ) -> Result<Self> {
        let response = |(name, is_history): (&str, bool)| ProgramResponse { name: name.to_owned(), is_history };
        let declared = Declared {
            variables: variables.into_iter().map(str::to_owned).collect(),
            times: times.to_vec(),
            responses: responses.into_iter().map(response).collect(),
        };
        let bad = |why: String, remedy: &str| Err(Error::definition("the analysis by a program", why, remedy));
        if program.command.first().is_none_or(String::is_empty) {
            return bad("its command is empty".to_owned(), "give the program and its arguments");
        }
        if declared.responses.is_empty() {
            return bad("it has no responses".to_owned(), "name at least one");
        }
        for names in
            [declared.variables.iter().collect(), declared.responses.iter().map(|r| &r.name).collect::<Vec<_>>()]
        {
            if let Some((_, name)) = names.iter().enumerate().find(|(i, name)| names[..*i].contains(name)) {
                return bad(format!("the name `{name}` is given twice"), "use each name once");
            }
        }
        let processes = Processes::new(program, &declared);
        Ok(Self { declared, processes, answers: Mutex::default(), has_derivatives: false })
    }

    /// The analysis whose [`analyze`](Analysis::analyze) asks for values and derivatives in one request, as an optimization needs both. Without, a
    /// design at which derivatives are needed is sent a second time. [`analyze_many`](Analysis::analyze_many) asks for values only.
    #[must_use]
    pub fn with_derivatives(self) -> Self {
        Self { has_derivatives: true, ..self }
    }

    /// The answer at a design, from the stored ones if possible.
    fn answer(&self, b: &[f64], derivatives: bool) -> Result<Arc<Answer>> {
        let count = self.declared.variables.len();
        let Some(b) = b.get(..count) else {
            return Err(Error::Length { what: "design".to_owned(), expected: count, got: b.len() });
        };
        let known = self.answers().at(b);
        if let Some(known) = known.filter(|answer| !derivatives || answer.derivatives.is_some()) {
            return Ok(known);
        }
        let answer = Arc::new(self.processes.ask(&self.declared, b, derivatives)?);
        self.answers().add(&self.declared, b, &answer)?;
        Ok(answer)
    }

    fn answers(&self) -> MutexGuard<'_, Answers> {
        self.answers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The program and its arguments.
    pub fn command(&self) -> &[String] {
        self.processes.command()
    }

    /// Reads the answers in a file of a directory, if it exists and belongs to this program, its variables, time points and responses.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be read, or if it is damaged.
    pub fn read_answers_from(&self, directory: &Directory, name: &str) -> Result<()> {
        self.answers().read_from(directory, name, self.processes.command(), &self.declared).map(|_| ())
    }

    /// Reads the answers in a file of a directory, and appends all further ones to it, so that no design is analysed twice after a
    /// restart. A file of another program, or with other variables, time points or responses, is replaced.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be read or written, or if it is damaged.
    pub fn keep_answers_in(&self, directory: &Directory, name: &str) -> Result<()> {
        self.answers().keep_in(directory, name, self.processes.command(), &self.declared)
    }
}

impl Analysis for ProgramAnalysis {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        Ok(Responses::new(self.answer(b, self.has_derivatives)?.values.clone()))
    }

    fn analyze_many(&self, designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
        let values = |b: &Vec<f64>| Ok(Responses::new(self.answer(b, false)?.values.clone()));
        designs.par_iter().map(values).collect()
    }

    fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let answer = self.answer(b, true)?;
        let Some(derivatives) = &answer.derivatives else {
            let (what, why) = ("derivatives by the program", "its answer has no `derivatives`");
            return Err(Error::unsupported(what, why, "use finite differences, or let the program give them"));
        };
        let derivative = |row: usize, i: usize| {
            let ResponseAt { response, point } = wanted[row];
            derivatives[response].get(i).map_or(0.0, |of_variable| of_variable[point])
        };
        Ok(DMatrix::from_fn(wanted.len(), b.len(), derivative))
    }

    fn differentiation(&self, _variables: usize, _wanted: &[ResponseAt]) -> Option<&'static str> {
        Some("program")
    }
}

/// An analysis that runs on its own threads.
///
/// Threads that wait for other programs take no processor time, so there may be more of them than processors:
/// [`Differences`](crate::responses::Differences) of a [`ProgramAnalysis`] with `jobs` processes needs as many threads.
pub struct WithThreads<A> {
    analysis: A,
    threads: ThreadPool,
}

impl<A: Analysis> WithThreads<A> {
    /// The analysis with this many threads.
    ///
    /// # Errors
    /// [`Error::Option`] unless there are between 1 and 1024; [`Error::Unsupported`] if the system has not so many.
    pub fn new(analysis: A, threads: usize) -> Result<Self> {
        Error::check_option("threads", "from 1 to 1024", threads as f64, (1..=1024).contains(&threads))?;
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        let pool =
            pool.map_err(|why| Error::unsupported(format!("{threads} threads"), why.to_string(), "use fewer"))?;
        Ok(Self { analysis, threads: pool })
    }
}

impl<A: Analysis> Analysis for WithThreads<A> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        self.analysis.analyze(b)
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        self.threads.install(|| self.analysis.sensitivities(b, responses, wanted))
    }

    fn sum_sensitivities(&self, b: &[f64], responses: &Responses, sums: &[ResponseSum]) -> Result<DMatrix<f64>> {
        self.threads.install(|| self.analysis.sum_sensitivities(b, responses, sums))
    }

    fn analyze_many(&self, designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
        self.threads.install(|| self.analysis.analyze_many(designs))
    }

    fn curvatures(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<Option<Vec<DMatrix<f64>>>> {
        self.threads.install(|| self.analysis.curvatures(b, responses, wanted))
    }

    fn gradient_methods(&self) -> Vec<GradientMethod<'_>> {
        self.analysis.gradient_methods()
    }

    fn warnings(&self, b: &[f64], responses: &Responses) -> Vec<String> {
        self.analysis.warnings(b, responses)
    }

    fn differentiation(&self, variables: usize, wanted: &[ResponseAt]) -> Option<&'static str> {
        self.analysis.differentiation(variables, wanted)
    }

    fn continuous(&self) -> Option<&dyn ContinuousTime> {
        self.analysis.continuous()
    }
}
