//! The report of a run: a page, and its figures.

use super::problem::Problem;
use super::state::State;
use super::work::{raise, work_until};
use linkwright::report::animation::{Animation, Scene};
use linkwright::report::figure::{QuantityLabel, literal};
use linkwright::report::page::{Page, PageSection};
use linkwright::report::run::{OptimizationReport, Slice};
use linkwright::sao::RunState;
use linkwright::{Error, Result};
use pyo3::prelude::*;
use std::sync::atomic::Ordering;

/// The report as a page; `slice` is the number of points along each side of the slice of the design space.
#[pyfunction]
pub fn report(py: Python<'_>, state: &State, problem: &Problem, slice: usize) -> PyResult<String> {
    page(py, &state.0, problem, slice, |page| {
        let foot = format!("Written by linkwright {} from Python.", env!("CARGO_PKG_VERSION"));
        page.foot(foot).html()
    })
}

/// Figures of the report: names and SVG.
#[pyfunction]
pub fn figures(py: Python<'_>, state: &State, problem: &Problem) -> PyResult<Vec<(String, String)>> {
    page(py, &state.0, problem, 0, |page| {
        page.figures().map(|(name, figure)| Ok((name.to_owned(), figure.svg()?))).collect()
    })
}

/// Makes the page of the report and converts it.
fn page<T: Send>(
    py: Python<'_>,
    state: &RunState,
    problem: &Problem,
    slice: usize,
    convert: impl FnOnce(Page) -> Result<T> + Send,
) -> PyResult<T> {
    if state.fingerprint != problem.problem.fingerprint() {
        let error = Error::definition("report", "the run belongs to another problem", "give its problem");
        return Err(raise(py, &error));
    }
    let draw = |slice: Option<Slice>| {
        let run = OptimizationReport::new(problem.model.title(), &problem.problem, state)?;
        convert(run.page(slice.as_ref(), mechanism(state, problem).into_iter().collect())?)
    };
    // Designs of a slice are analysed in several threads, which Python functions are not.
    if problem.is_function || slice < 2 {
        return problem.work(py, || draw(None));
    }
    work_until(py, |is_stopped| {
        let is_stopped = || is_stopped.load(Ordering::Relaxed);
        draw(Slice::sample_until(&problem.problem, state, slice, &is_stopped).ok().flatten())
    })
}

/// The mechanism in motion at the first and the last design; `None` if there is none, or if it cannot be drawn.
fn mechanism(state: &RunState, problem: &Problem) -> Option<PageSection> {
    let (times, grid) = (problem.model.drawing_times()?, problem.model.grid()?);
    let mut designs = vec![("first design", &state.history.first()?.design)];
    if *designs[0].1 != state.design {
        designs.push(("last design", &state.design));
    }
    let drawn = problem.model.drawings(&designs.iter().map(|(_, b)| &b[..]).collect::<Vec<_>>(), &times).ok()??;
    let titles = designs.iter().map(|(title, _)| (*title).to_owned());
    let scenes = titles.zip(drawn).map(|(title, frames)| Scene { title, frames, traces: vec![] }).collect();
    let axes = [QuantityLabel::new("*x*", "m"), QuantityLabel::new("*y*", "m")];
    let times = times.iter().map(|&t| grid.shown(t)).collect();
    let time = QuantityLabel::literal(&grid.name, &grid.unit);
    let description = literal(&format!("The mechanism over the {}.", grid.name));
    let motion = Animation::new(description, axes, times, scenes).ok()?.lasting(5.0).ok()?.over(time).compared();
    Some(PageSection::new("mechanism", "Mechanism").html(motion.fragment()))
}
