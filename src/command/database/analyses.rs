//! Analyses of earlier runs: an optimization takes them from the database instead of computing them again, and adds its own.
//!
//! An analysis is a pure function of its design, and a stored one has the same bits as one that is computed, so that a run is the same
//! with and without them. They belong to a model (its hash without bounds, start values and method) and a version of linkwright.
//!
//! A program keeps its answers itself, in a file of the run, which begins with the answers of earlier runs.

use super::{Database, absolute};
use crate::command::model::model_file;
use crate::command::output::complain;
use crate::command::run_directory::ANSWERS;
use anyhow::Context;
use linkwright::Result;
use linkwright::model_file::Model;
use linkwright::problem::{Analysis, ContinuousTime, GradientMethod, Problem, ResponseAt, ResponseSum, Responses};
use linkwright::storage::{Directory, Fnv1a, fnv1a, read_file};
use nalgebra::DMatrix;
use rusqlite::{Transaction, params};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Version of linkwright: another one may compute other bits.
const PROGRAM: &str = env!("CARGO_PKG_VERSION");
/// Largest number of bytes of answers that are given to a program.
const ANSWERS_LIMIT: u64 = 1 << 30;

/// Stored numbers of one request at a design.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Empty for responses; otherwise the kind of derivatives, the method and what is wanted.
    request: String,
    /// Number of values of each response; rows and columns of a matrix.
    sizes: Vec<usize>,
    numbers: Vec<f64>,
    warnings: Vec<String>,
}

impl Record {
    /// The responses of a design.
    pub fn of_responses(responses: &Responses) -> Self {
        Self {
            request: String::new(),
            sizes: responses.values.iter().map(Vec::len).collect(),
            numbers: responses.values.concat(),
            warnings: responses.warnings.clone(),
        }
    }

    fn responses(&self) -> Responses {
        let mut rest = self.numbers.as_slice();
        let take = |size: &usize| {
            let (values, others) = rest.split_at(*size);
            rest = others;
            values.to_vec()
        };
        let values = self.sizes.iter().map(take).collect();
        Responses { warnings: self.warnings.clone(), ..Responses::new(values) }
    }

    fn of_matrix(request: String, matrix: &DMatrix<f64>) -> Self {
        let numbers = matrix.transpose().as_slice().to_vec();
        Self { request, sizes: vec![matrix.nrows(), matrix.ncols()], numbers, warnings: vec![] }
    }

    fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.numbers.chunks_exact(self.sizes[1].max(1))
    }

    fn hash(&self, design: &[u8]) -> String {
        let Self { request, sizes, numbers, warnings } = self;
        let mut hash = Fnv1a::default();
        [design, request.as_bytes(), format!("{sizes:?}{warnings:?}").as_bytes(), &bytes(numbers)]
            .iter()
            .for_each(|part| hash.add(part));
        format!("{:016x}", hash.value())
    }

    /// Adds the record to the table, if its numbers are finite. Returns true if it is new.
    pub fn insert(&self, change: &Transaction<'_>, model: &str, program: &str, design: &[f64]) -> anyhow::Result<bool> {
        if !self.numbers.iter().all(|number| number.is_finite()) {
            return Ok(false);
        }
        let design = bytes(design);
        let (hash, content) = (self.hash(&design), bytes(&self.numbers));
        // The content of a damaged record does not match its hash; such a record is replaced.
        let known =
            "SELECT count(*) FROM analyses WHERE (model, program, design, request, hash, numbers) = (?, ?, ?, ?, ?, ?)";
        let key = params![model, program, design, self.request, hash, content];
        if change.query_row(known, key, |row| row.get::<_, i64>(0))? > 0 {
            return Ok(false);
        }
        change.execute(
            "INSERT OR REPLACE INTO analyses VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
            params![
                model,
                program,
                design,
                self.request,
                serde_json::to_string(&self.sizes)?,
                content,
                serde_json::to_string(&self.warnings)?,
                hash
            ],
        )?;
        Ok(true)
    }
}

/// Numbers of 8 bytes, the least significant first.
fn bytes(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn numbers(bytes: &[u8]) -> Vec<f64> {
    bytes.chunks_exact(8).map(|eight| f64::from_le_bytes(eight.try_into().expect("there are eight bytes"))).collect()
}

/// The analyses of one model in a database, which several analyses may share.
pub struct AnalysisStore {
    model: String,
    /// Number of design variables on which responses depend: all but the bound of a peak, which is the last.
    variables: usize,
    inner: Mutex<Inner>,
}

struct Inner {
    database: Database,
    /// Records of the designs of this run, by the bytes of the design; new ones have not been written yet.
    known: BTreeMap<Vec<u8>, Vec<Record>>,
    new: Vec<(Vec<f64>, Record)>,
    /// Analyses and derivatives that were taken, and records that were added.
    taken: [usize; 2],
    added: usize,
    damaged: usize,
    /// The first error. The run does not need the database, and continues without it.
    failure: Option<anyhow::Error>,
}

impl AnalysisStore {
    fn new(database: Database, model: &Model) -> Self {
        let inner =
            Inner { database, known: BTreeMap::new(), new: vec![], taken: [0; 2], added: 0, damaged: 0, failure: None };
        let (name, variables) = (format!("{:016x}", model.analysis_fingerprint()), model.variables().len());
        Self { model: name, variables, inner: Mutex::new(inner) }
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The design variables on which responses depend.
    fn key<'b>(&self, b: &'b [f64]) -> &'b [f64] {
        &b[..self.variables.min(b.len())]
    }

    /// Finds a result in the records of a design, and counts it.
    fn find<T>(&self, b: &[f64], count: usize, find: impl FnOnce(&[Record]) -> Option<T>) -> Option<T> {
        let mut inner = self.inner();
        let design = bytes(self.key(b));
        if !inner.known.contains_key(&design) {
            let read = inner.read(&self.model, &design).unwrap_or_else(|why| {
                inner.failure.get_or_insert(why);
                vec![]
            });
            inner.known.insert(design.clone(), read);
        }
        let found = find(&inner.known[&design]);
        inner.taken[count] += usize::from(found.is_some());
        found
    }

    fn add(&self, b: &[f64], record: Record) {
        let mut inner = self.inner();
        let design = self.key(b);
        inner.known.entry(bytes(design)).or_default().push(record.clone());
        inner.new.push((design.to_vec(), record));
    }

    /// Writes the new records to the database.
    pub fn save(&self) {
        let mut inner = self.inner();
        let new = std::mem::take(&mut inner.new);
        if new.is_empty() || inner.failure.is_some() {
            return;
        }
        let written = inner.database.change(|change| {
            new.iter().try_fold(0, |count, (design, record)| {
                Ok(count + usize::from(record.insert(change, &self.model, PROGRAM, design)?))
            })
        });
        match written {
            Ok(count) => inner.added += count,
            Err(why) => inner.failure = Some(why),
        }
    }

    /// Numbers of analyses and derivatives that were taken and added, in words.
    pub fn summary(&self) -> String {
        let inner = self.inner();
        let [analyses, derivatives] = inner.taken;
        let damaged = match inner.damaged {
            0 => String::new(),
            count => format!("; {count} damaged records were computed again"),
        };
        let shown = inner.database.path.display();
        if let Some(why) = &inner.failure {
            complain(&format!("Warning: {why:#}. The run is complete; its analyses are not all in the database."));
        }
        format!(
            "{analyses} analyses and {derivatives} sensitivity analyses were taken from {shown}, {} were added{damaged}",
            inner.added
        )
    }
}

impl Inner {
    fn read(&mut self, model: &str, design: &[u8]) -> anyhow::Result<Vec<Record>> {
        let read = || -> rusqlite::Result<Vec<(Record, String)>> {
            let text = "SELECT request, sizes, numbers, warnings, hash FROM analyses WHERE (model, program, design) = (?, ?, ?)";
            let mut select = self.database.connection.prepare(text)?;
            let rows = select.query_map(params![model, PROGRAM, design], |row| {
                let list = |text: String| serde_json::from_str(&text).unwrap_or_default();
                let record = Record {
                    request: row.get(0)?,
                    sizes: list(row.get(1)?),
                    numbers: numbers(&row.get::<_, Vec<u8>>(2)?),
                    warnings: serde_json::from_str(&row.get::<_, String>(3)?).unwrap_or_default(),
                };
                Ok((record, row.get(4)?))
            })?;
            rows.collect()
        };
        let all = read().map_err(|why| super::explained(&self.database.path, &why))?;
        let count = all.len();
        let right: Vec<Record> =
            all.into_iter().filter(|(record, hash)| record.hash(design) == *hash).map(|(record, _)| record).collect();
        self.damaged += count - right.len();
        Ok(right)
    }
}

/// An analysis that takes known results from a store and adds new ones to it.
struct KnownAnalyses {
    analysis: Box<dyn Analysis>,
    store: Arc<AnalysisStore>,
    /// True if responses are wanted between the time points, for which a stored analysis has no data.
    is_continuous: bool,
}

/// Which derivatives are wanted, as text.
fn request(kind: &str, method: Option<&str>, wanted: impl std::fmt::Debug) -> String {
    format!("{kind} {} {wanted:?}", method.unwrap_or("-"))
}

fn places(wanted: &[ResponseAt]) -> Vec<[usize; 2]> {
    wanted.iter().map(|at| [at.response, at.point]).collect()
}

impl KnownAnalyses {
    fn known(&self, b: &[f64]) -> Option<Responses> {
        if self.is_continuous {
            return None;
        }
        self.store.find(b, 0, |all| all.iter().find(|record| record.request.is_empty()).map(Record::responses))
    }

    fn keep(&self, b: &[f64], responses: &Responses) {
        self.store.add(b, Record::of_responses(responses));
    }

    /// The matrix of a request, known or new.
    fn matrix(
        &self,
        b: &[f64],
        request: String,
        compute: impl FnOnce() -> Result<DMatrix<f64>>,
    ) -> Result<DMatrix<f64>> {
        let found = self.store.find(b, 1, |all| {
            let record = all.iter().find(|record| record.request == request)?;
            Some(DMatrix::from_row_slice(record.sizes[0], record.sizes[1], &record.numbers))
        });
        if let Some(found) = found {
            return Ok(found);
        }
        let matrix = compute()?;
        self.store.add(b, Record::of_matrix(request, &matrix));
        Ok(matrix)
    }
}

impl Analysis for KnownAnalyses {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        if let Some(known) = self.known(b) {
            return Ok(known);
        }
        let responses = self.analysis.analyze(b)?;
        self.keep(b, &responses);
        Ok(responses)
    }

    fn analyze_many(&self, designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
        let known: Vec<_> = designs.iter().map(|b| self.known(b)).collect();
        let missing: Vec<Vec<f64>> =
            designs.iter().zip(&known).filter(|(_, known)| known.is_none()).map(|(b, _)| b.clone()).collect();
        let mut new = self.analysis.analyze_many(&missing).into_iter();
        let one = |(b, known): (&Vec<f64>, Option<Responses>)| match known {
            Some(known) => Ok(known),
            None => new.next().expect("each missing design was analysed").inspect(|responses| self.keep(b, responses)),
        };
        designs.iter().zip(known).map(one).collect()
    }

    fn analyze_around(&self, b: &[f64], designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
        self.analysis.analyze_around(b, designs)
    }

    fn step_tolerance(&self, b: &[f64]) -> f64 {
        self.analysis.step_tolerance(b)
    }

    /// Rows that were computed by the same method, even in a request for other rows.
    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let method = self.analysis.differentiation(b.len(), wanted);
        let prefix = request("sensitivities", method, "");
        let prefix = prefix.trim_end_matches('"');
        let found = self.store.find(b, 1, |all| {
            let mut rows = BTreeMap::new();
            for record in all {
                let Some(places) = record.request.strip_prefix(prefix) else { continue };
                let places: Vec<[usize; 2]> = serde_json::from_str(places).ok()?;
                rows.extend(places.into_iter().zip(record.rows()));
            }
            let rows = wanted.iter().map(|at| rows.get(&[at.response, at.point]).copied());
            let rows = rows.collect::<Option<Vec<_>>>()?;
            Some(DMatrix::from_row_slice(wanted.len(), b.len(), &rows.concat()))
        });
        if let Some(found) = found {
            return Ok(found);
        }
        let rows = self.analysis.sensitivities(b, responses, wanted)?;
        self.store.add(b, Record::of_matrix(request("sensitivities", method, places(wanted)), &rows));
        Ok(rows)
    }

    fn sum_sensitivities(&self, b: &[f64], responses: &Responses, sums: &[ResponseSum]) -> Result<DMatrix<f64>> {
        let method = self.analysis.differentiation(b.len(), &ResponseSum::responses_in(sums));
        let terms: Vec<Vec<_>> = sums
            .iter()
            .map(|sum| sum.terms.iter().map(|(at, weight)| (at.response, at.point, weight.to_bits())).collect())
            .collect();
        let compute = || self.analysis.sum_sensitivities(b, responses, sums);
        self.matrix(b, request("sums", method, terms), compute)
    }

    fn curvatures(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<Option<Vec<DMatrix<f64>>>> {
        self.analysis.curvatures(b, responses, wanted)
    }

    fn gradient_methods(&self) -> Vec<GradientMethod<'_>> {
        self.analysis.gradient_methods()
    }

    fn differentiation(&self, variables: usize, wanted: &[ResponseAt]) -> Option<&'static str> {
        self.analysis.differentiation(variables, wanted)
    }

    fn warnings(&self, b: &[f64], responses: &Responses) -> Vec<String> {
        self.analysis.warnings(b, responses)
    }

    fn continuous(&self) -> Option<&dyn ContinuousTime> {
        self.analysis.continuous()
    }
}

/// The database with which an optimization starts.
pub enum WarmStart {
    /// Analyses by this program.
    Analyses(Arc<AnalysisStore>),
    /// Answers of another program, with the key of that program.
    Answers(Mutex<Database>, String),
}

impl WarmStart {
    /// Opens the database, and returns it with the problem that uses it. `file` is that of the model.
    pub fn new(path: &Path, model: &Model, file: &Path, problem: Problem) -> anyhow::Result<(Self, Problem)> {
        let database = Database::open(path)?;
        if let Some(program) = model.program_analysis()? {
            let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let key = program_key(model, folder, program.command())?;
            return Ok((Self::Answers(Mutex::new(database), key), problem));
        }
        let store = Arc::new(AnalysisStore::new(database, model));
        let is_continuous = problem.constraints.iter().any(|constraint| constraint.is_continuous);
        let analysis = KnownAnalyses { analysis: problem.analysis, store: Arc::clone(&store), is_continuous };
        Ok((Self::Analyses(store), Problem { analysis: Box::new(analysis), ..problem }))
    }

    /// Returns `true` if it has answers of another program.
    pub fn has_answers(&self) -> bool {
        matches!(self, Self::Answers(..))
    }

    /// Gives a run that begins the known answers of its program. Returns what was taken, in words.
    pub fn begin(&self, directory: &Directory) -> anyhow::Result<Option<String>> {
        let Self::Answers(database, key) = self else { return Ok(None) };
        let database = database.lock().unwrap_or_else(PoisonError::into_inner);
        let explain = |why: rusqlite::Error| super::explained(&database.path, &why);
        let mut text = String::new();
        let mut count = 0;
        let mut read = || -> rusqlite::Result<()> {
            let select = "SELECT head, line FROM answers WHERE program = ?1 AND head = (SELECT max(head) FROM answers WHERE program = ?1)";
            let mut select = database.connection.prepare(select)?;
            let mut rows = select.query([key])?;
            while let Some(row) = rows.next()? {
                if text.is_empty() {
                    text = row.get::<_, String>(0)? + "\n";
                }
                text += &(row.get::<_, String>(1)? + "\n");
                count += 1;
            }
            Ok(())
        };
        read().map_err(explain)?;
        if count > 0 {
            let written = directory.replace(ANSWERS, text.as_bytes(), false);
            written.with_context(|| format!("cannot write {}", directory.path().join(ANSWERS).display()))?;
        }
        Ok(Some(format!("{count} answers of the program are known from {}", database.path.display())))
    }

    /// Stores what is new.
    pub fn save(&self) {
        if let Self::Analyses(store) = self {
            store.save();
        }
    }

    /// Stores what is new at the end of a run in a folder. Returns what was taken and added, in words.
    pub fn end(&self, directory: &Directory) -> String {
        match self {
            Self::Analyses(store) => {
                store.save();
                store.summary()
            }
            Self::Answers(database, key) => {
                let mut database = database.lock().unwrap_or_else(PoisonError::into_inner);
                let path = database.path.display().to_string();
                match database.change(|change| add_answers(change, key, directory)) {
                    Ok(count) => format!("{count} answers of the program were added to {path}"),
                    Err(why) => {
                        complain(&format!("Warning: {why:#}. The run is complete and has its answers."));
                        format!("0 answers of the program were added to {path}")
                    }
                }
            }
        }
    }
}

/// Largest size in bytes of a file of a command that identifies it.
const PROGRAM_LIMIT: u64 = 1 << 30;

/// Identifies a program: its model, its folder, and the files that its command names.
fn program_key(model: &Model, folder: &Path, command: &[String]) -> anyhow::Result<String> {
    let mut text = format!("{:016x} {} {command:?}", model.analysis_fingerprint(), absolute(folder)?);
    for word in command {
        if let Ok(content) = read_file(&folder.join(word), PROGRAM_LIMIT) {
            let mut hash = Fnv1a::default();
            hash.add(&content);
            text += &format!(" {:016x}", hash.value());
        }
    }
    Ok(format!("{:016x}", fnv1a(&text)))
}

/// The command in the first line of a file of answers.
fn command_of(head: &str) -> Option<Vec<String>> {
    let head: serde_json::Value = serde_json::from_str(head).ok()?;
    serde_json::from_value(head["command"].clone()).ok()
}

fn answers_in(directory: &Directory) -> anyhow::Result<Option<String>> {
    let place = directory.path().join(ANSWERS);
    let read = directory.read(ANSWERS, ANSWERS_LIMIT).with_context(|| format!("cannot read {}", place.display()))?;
    read.map(|bytes| String::from_utf8(bytes).with_context(|| format!("{} is not UTF-8", place.display()))).transpose()
}

/// Adds the answers in the folder of a run; an incomplete last line is left out. Returns the number of new ones.
fn add_answers(change: &Transaction<'_>, key: &str, directory: &Directory) -> anyhow::Result<usize> {
    let text = answers_in(directory)?.unwrap_or_default();
    let mut lines = text.split_inclusive('\n').filter_map(|line| line.strip_suffix('\n'));
    let Some(head) = lines.next() else { return Ok(0) };
    lines.try_fold(0, |count, line| {
        Ok(count + change.execute("INSERT OR IGNORE INTO answers VALUES (?, ?, ?)", [key, head, line])?)
    })
}

/// As [`add_answers`], for the run of a model file that may be elsewhere now: then nothing is added.
pub fn take_answers(
    change: &Transaction<'_>,
    model: &Model,
    file: &Path,
    directory: &Directory,
) -> anyhow::Result<usize> {
    let Some(text) = answers_in(directory)? else { return Ok(0) };
    let Some(command) = text.lines().next().and_then(command_of) else { return Ok(0) };
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match program_key(model, folder, &command) {
        Ok(key) if model_file(file).exists() => add_answers(change, &key, directory),
        _ => Ok(0),
    }
}
