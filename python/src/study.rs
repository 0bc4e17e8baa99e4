//! Studies: their runs, rows and conclusions, and the file of rows.

use super::work::{raise, raise_report, work, work_with_programs};
use linkwright::storage::{Appender, Directory, Lock};
use linkwright::study::{self, ModelSource, Part, Rows, StudyError, StudyFile};
use linkwright::{Error, Result};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Largest size of a row file in bytes.
const LIMIT: u64 = 1 << 36;

/// A study of a model file.
#[pyclass(module = "linkwright._core", frozen)]
pub struct Study(study::Study);

/// Name, columns (name, unit, words), number of runs, and waves of runs of a phase.
type PhaseRow<'s> = (&'s str, Vec<(&'s str, &'s str, &'s [String])>, usize, Option<Vec<Vec<usize>>>);

/// Sentences, tables as lines of JSON by name, and figures by name with caption and SVG.
type ConclusionTables = (Vec<String>, Vec<(String, Vec<String>)>, Vec<(String, String, String)>);

#[pymethods]
impl Study {
    /// Reads the text of a study file and that of its model; the names are for messages. `programs` is the folder in which the program of
    /// the model may run.
    #[new]
    #[pyo3(signature = (name, text, model_name, model, programs=None))]
    fn new(
        py: Python<'_>,
        name: &str,
        text: &str,
        model_name: &str,
        model: &str,
        programs: Option<PathBuf>,
    ) -> PyResult<Self> {
        let source = ModelSource { name: model_name.to_owned(), text: model.to_owned(), programs };
        let made = work(py, || {
            let read = StudyFile::read(name, text).map_err(StudyError::from);
            Ok(read.and_then(|file| study::Study::new(file, &source)))
        })?;
        made.map(Self).map_err(|error| match error {
            StudyError::File(report) => raise_report(py, &report),
            StudyError::Other(error) => raise(py, &error),
        })
    }

    /// The title.
    #[getter]
    fn title(&self) -> &str {
        self.0.title()
    }

    /// The first line of its row file, which names the settings of study and model by their hash.
    #[getter]
    fn header(&self) -> String {
        self.0.header().line()
    }

    /// The phases.
    #[getter]
    fn phases(&self) -> Vec<PhaseRow<'_>> {
        fn columns(phase: &study::Phase) -> Vec<(&str, &str, &[String])> {
            phase.columns.iter().map(|c| (c.name.as_str(), c.unit.as_str(), c.words.as_slice())).collect()
        }
        self.0.phases().iter().map(|phase| (phase.name, columns(phase), phase.runs, phase.waves.clone())).collect()
    }

    /// Does runs of a phase, given the lines of the rows that they need, and returns their lines in the same order.
    fn run(&self, py: Python<'_>, phase: usize, runs: Vec<usize>, known: Vec<String>) -> PyResult<Vec<String>> {
        let task = || {
            use rayon::prelude::*;
            let known = self.rows(&known)?;
            let count = self.0.phases().get(phase).map_or(0, |phase| phase.runs);
            if let Some(run) = runs.iter().find(|run| **run >= count) {
                return Err(Error::definition(
                    format!("run {run}"),
                    "the study has no such run",
                    "give runs of this study",
                ));
            }
            let line = |run: &usize| Ok(self.0.row(phase, *run, &known)?.line());
            runs.par_iter().with_max_len(1).map(line).collect()
        };
        if self.0.source().programs.is_some() { work_with_programs(py, task) } else { work(py, task) }
    }

    /// The whole row file: header, and rows in their order.
    fn text(&self, py: Python<'_>, lines: Vec<String>) -> PyResult<String> {
        work(py, || Ok(self.rows(&lines)?.text(&self.0.header())))
    }

    /// The page of the rows of all runs.
    fn report(&self, py: Python<'_>, lines: Vec<String>) -> PyResult<String> {
        work(py, || {
            let (rows, found) = self.concluded(&lines)?;
            let foot = format!("Written by linkwright {} from Python.", env!("CARGO_PKG_VERSION"));
            self.0.page(&rows, &found).foot(foot).html()
        })
    }

    /// The conclusions from the rows of all runs.
    fn conclude(&self, py: Python<'_>, lines: Vec<String>) -> PyResult<ConclusionTables> {
        work(py, || {
            let (_, found) = self.concluded(&lines)?;
            let tables = found.tables.iter().map(|(name, table)| (name.to_string(), table.json_lines())).collect();
            let figures = found
                .figures
                .iter()
                .map(|(name, caption, figure)| Ok((name.to_string(), caption.to_string(), figure.svg()?)));
            Ok((found.sentences.clone(), tables, figures.collect::<Result<_>>()?))
        })
    }
}

impl Study {
    /// All rows, and the conclusions from them.
    fn concluded(&self, lines: &[String]) -> Result<(Rows, linkwright::study::Conclusions)> {
        let rows = self.rows(lines)?;
        let missing = self.0.missing(&rows, Part::WHOLE);
        if missing > 0 {
            let why = format!("{missing} runs are missing");
            return Err(Error::definition("the study", why, "do them with `run` first"));
        }
        let found = self.0.conclude(&rows)?;
        Ok((rows, found))
    }

    fn rows(&self, lines: &[String]) -> Result<Rows> {
        let text = self.0.header().line() + &lines.concat();
        Ok(Rows::read("the rows", text.as_bytes(), &self.0.runs())?.rows)
    }
}

/// The path of the model in the text of a study file.
#[pyfunction]
pub fn study_model(py: Python<'_>, name: &str, text: &str) -> PyResult<String> {
    StudyFile::read(name, text).map(|file| file.model).map_err(|report| raise_report(py, &report))
}

/// The file of rows of a study, locked against other processes while it is open.
#[pyclass(module = "linkwright._core", frozen)]
pub struct RowFile {
    directory: Directory,
    name: String,
    open: Mutex<Option<(Appender, File)>>,
}

fn cannot(place: &Path, what: &str, why: &std::io::Error) -> PyErr {
    PyOSError::new_err(format!(
        "cannot {what} {}: {why}; finished runs are kept: mend that, then call `run` with this file again",
        place.display()
    ))
}

#[pymethods]
impl RowFile {
    /// Opens or creates the file of a study in a folder. Returns it with the lines of its rows; an incomplete last line is removed.
    #[staticmethod]
    fn open(py: Python<'_>, folder: &str, name: &str, study: &Study) -> PyResult<(Self, Vec<String>)> {
        let place = Path::new(folder).join(name);
        let fails = |what: &'static str| {
            let place = place.clone();
            move |why: std::io::Error| cannot(&place, what, &why)
        };
        let directory = Directory::open(Path::new(folder)).map_err(fails("open the folder of"))?;
        let mut appender = directory.appender(name).map_err(fails("write"))?;
        let lock = match directory.lock(name).map_err(fails("lock"))? {
            Lock::Own(file) => Some(file),
            Lock::NotOffered => None,
            Lock::OfOther => {
                let text = format!(
                    "another process writes rows to {}; wait for its end, or give another file",
                    place.display()
                );
                return Err(PyOSError::new_err(text));
            }
        };
        let lock = lock.map_or_else(|| File::open(&place), Ok).map_err(fails("read"))?;
        let bytes = directory.read(name, LIMIT).map_err(fails("read"))?.unwrap_or_default();
        let shown = place.display().to_string();
        let read = work(py, || Rows::read(&shown, &bytes, &study.0.runs()))?;
        let header = study.0.header();
        match read.header {
            Some(found) if found != header => {
                let why = "it has the rows of another study: the settings of the study or of the model have changed";
                return Err(raise(
                    py,
                    &Error::File {
                        file: shown,
                        why: why.to_owned(),
                        remedy: "give another file, or restore the settings".to_owned(),
                    },
                ));
            }
            Some(_) => {
                if (read.length as u64) < bytes.len() as u64 {
                    appender.cut(read.length as u64).map_err(fails("write"))?;
                }
            }
            None => {
                appender.cut(0).and_then(|()| appender.append(header.line().as_bytes())).map_err(fails("write"))?;
            }
        }
        let lines = read.rows.all().map(study::Row::line).collect();
        Ok((Self { directory, name: name.to_owned(), open: Mutex::new(Some((appender, lock))) }, lines))
    }

    /// Appends lines of rows, and flushes them to disk.
    fn append(&self, py: Python<'_>, lines: Vec<String>) -> PyResult<()> {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        let Some((appender, _)) = open.as_mut() else { return Ok(()) };
        let written = py.detach(|| appender.append(lines.concat().as_bytes()).and_then(|()| appender.flush()));
        written.map_err(|why| cannot(&self.directory.path().join(&self.name), "write", &why))
    }

    /// Replaces the content, and closes the file.
    fn finish(&self, py: Python<'_>, text: &str) -> PyResult<()> {
        let written = py.detach(|| self.directory.replace(&self.name, text.as_bytes(), true));
        self.close();
        written.map_err(|why| cannot(&self.directory.path().join(&self.name), "write", &why))
    }

    /// Closes the file.
    fn close(&self) {
        drop(self.open.lock().unwrap_or_else(PoisonError::into_inner).take());
    }
}
