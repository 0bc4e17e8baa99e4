//! An analysis that calls Python functions.

use super::work::{is_failed_analysis, is_interrupted, keep};
use linkwright::problem::{Analysis, ResponseAt, Responses};
use linkwright::{Error, Result};
use nalgebra::DMatrix;
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::sync::Arc;

/// The functions of an analysis in Python. The Python part has checked what they return.
pub struct Functions {
    /// `f(b)` returns all values of all responses in one array of length N.
    pub analyze: Py<PyAny>,
    /// `f(b)` returns their derivatives, N × n.
    pub derivatives: Option<Py<PyAny>>,
    /// `f(b)` returns their second derivatives, N × n × n.
    pub second: Option<Py<PyAny>>,
    /// `f(list of b)` returns a list with an array of length N, or an `AnalysisError`, for each.
    pub analyze_many: Option<Py<PyAny>>,
}

/// An analysis by Python functions, which are called in the thread of the run, one after another.
///
/// Functions are not called from several threads: many simulators cannot be, Ctrl-C reaches the main thread only, and a function
/// that itself uses linkwright would wait for threads that wait for it.
#[derive(Clone)]
pub struct FunctionAnalysis {
    functions: Arc<Functions>,
    /// Index of the first value of each response, and the total number of values.
    offsets: Arc<[usize]>,
}

impl FunctionAnalysis {
    /// An analysis whose responses have these numbers of values.
    pub fn new(functions: Functions, points: &[usize]) -> Self {
        let mut offsets = vec![0];
        for count in points {
            offsets.push(offsets[offsets.len() - 1] + count);
        }
        Self { functions: Arc::new(functions), offsets: offsets.into() }
    }

    /// True if there are derivatives.
    pub fn has_derivatives(&self) -> bool {
        self.functions.derivatives.is_some()
    }

    fn total(&self) -> usize {
        self.offsets[self.offsets.len() - 1]
    }

    fn split(&self, values: &[f64]) -> Result<Responses> {
        Error::check_length("values of the Python function", self.total(), values.len())?;
        Ok(Responses::new(self.offsets.windows(2).map(|ends| values[ends[0]..ends[1]].to_vec()).collect()))
    }

    fn position(&self, at: ResponseAt) -> usize {
        self.offsets[at.response] + at.point
    }
}

/// Calls Python. Its exception is kept for the end of the work, unless it says that the design cannot be analysed.
fn call<T>(run: impl FnOnce(Python<'_>) -> PyResult<T>) -> Result<T> {
    if is_interrupted() {
        return Err(interrupted());
    }
    Python::attach(|py| {
        run(py).map_err(|error| {
            if is_failed_analysis(py, &error) {
                return failed(error.value(py).to_string());
            }
            keep(error);
            interrupted()
        })
    })
}

fn interrupted() -> Error {
    Error::analysis("the Python function", "it raised an exception", "see its traceback")
}

fn failed(why: String) -> Error {
    Error::analysis("the Python function", why, "move the design away from there")
}

impl Analysis for FunctionAnalysis {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let values = call(|py| {
            let values = self.functions.analyze.bind(py).call1((PyArray1::from_slice(py, b),))?;
            Ok(values.extract::<PyReadonlyArray1<'_, f64>>()?.as_array().to_vec())
        })?;
        self.split(&values)
    }

    fn analyze_many(&self, designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
        let Some(function) = &self.functions.analyze_many else {
            return designs.iter().map(|b| self.analyze(b)).collect();
        };
        let all = call(|py| {
            let arrays: Vec<_> = designs.iter().map(|b| PyArray1::from_slice(py, b)).collect();
            let results = function.bind(py).call1((arrays,))?.extract::<Vec<Bound<'_, PyAny>>>()?;
            let one = |result: &Bound<'_, PyAny>| match result.extract::<PyReadonlyArray1<'_, f64>>() {
                Ok(values) => Ok(values.as_array().to_vec()),
                Err(_) => Err(failed(result.to_string())),
            };
            Ok(results.iter().map(one).collect::<Vec<_>>())
        });
        match all {
            Ok(all) => all.into_iter().map(|values| self.split(&values?)).collect(),
            Err(error) => designs.iter().map(|_| Err(error.clone())).collect(),
        }
    }

    fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let Some(function) = &self.functions.derivatives else {
            return Err(Error::unsupported("derivatives", "there is no function for them", "use finite differences"));
        };
        call(|py| {
            let rows = function.bind(py).call1((PyArray1::from_slice(py, b),))?;
            let rows = rows.extract::<PyReadonlyArray2<'_, f64>>()?;
            let rows = rows.as_array();
            Ok(DMatrix::from_fn(wanted.len(), b.len(), |i, k| rows[[self.position(wanted[i]), k]]))
        })
    }

    fn curvatures(&self, b: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<Option<Vec<DMatrix<f64>>>> {
        let Some(function) = &self.functions.second else { return Ok(None) };
        call(|py| {
            let all = function.bind(py).call1((PyArray1::from_slice(py, b),))?;
            let all = all.extract::<PyReadonlyArray3<'_, f64>>()?;
            let (all, n) = (all.as_array(), all.shape()[1]);
            let one = |at: &ResponseAt| DMatrix::from_fn(n, n, |i, k| all[[self.position(*at), i, k]]);
            Ok(Some(wanted.iter().map(one).collect()))
        })
    }
}
