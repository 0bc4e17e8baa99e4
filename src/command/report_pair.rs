//! `linkwright report A B`: two runs on one page.

use super::budget::Budget;
use super::run_directory::RunDirectory;
use super::runs::RunComparison;
use linkwright::model_file::Model;
use linkwright::problem::Problem;
use linkwright::report::animation::{Animation, Scene};
use linkwright::report::figure::{
    Colour, Dash, Figure, Legend, Mark, MarkerShape, Panel, PlotAxis, QuantityLabel, Stroke, literal,
};
use linkwright::report::outcome;
use linkwright::report::page::{Page, PageSection};
use linkwright::sao::RunState;
use std::path::Path;

/// Largest number of histories.
const MOST: usize = 24;

/// A run with its last state.
struct LastRun {
    name: String,
    model: Model,
    problem: Problem,
    state: RunState,
}

impl LastRun {
    fn open(folder: &Path, name: &str, budget: &Budget) -> anyhow::Result<Self> {
        let (folder, model, _) = RunDirectory::open(folder)?;
        let problem = model.problem()?;
        budget.check_analysis(&problem, model.method())?;
        let Some(last) = folder.last(&model, &problem)? else {
            anyhow::bail!("run {name} has no analysed design; continue it with `linkwright resume`")
        };
        Ok(Self { name: format!("{name}: {}", model.title()), model, problem, state: last.state })
    }

    fn objective(&self) -> f64 {
        outcome::objective(&self.problem, &self.state.design, &self.state.evaluation)
    }
}

/// The page of two runs, as HTML.
pub fn page_of_two(a: &Path, b: &Path, budget: &Budget) -> anyhow::Result<String> {
    let comparison = RunComparison::new(a, b)?;
    let runs = [LastRun::open(a, "A", budget)?, LastRun::open(b, "B", budget)?];
    let lead = match comparison.is_of_one_problem() {
        true => "Two runs of one problem: A and B.",
        false => "Two runs of different problems: A and B.",
    };
    let title = match runs[0].model.title() == runs[1].model.title() {
        true => format!("{}: two runs", runs[0].model.title()),
        false => format!("{} and {}", runs[0].model.title(), runs[1].model.title()),
    };
    let mut page = Page::new(title).lead(lead);
    for ((run, folder), status) in runs.iter().zip([a, b]).zip(comparison.statuses()) {
        let unit = &run.problem.objective.unit;
        let value = format!("{} {unit}", linkwright::Readable(rounded(run.objective())));
        let remark = format!("{}: {status}, {} analyses", folder.display(), run.state.counters.analyses);
        page = page.card(format!("{}, {}", &run.name[..1], run.problem.objective.name), value.trim_end(), remark);
    }
    let results = comparison.tables()?.into_iter().fold(PageSection::new("results", "Results"), PageSection::table);
    let sections = [mechanisms(&runs)?, Some(results), Some(convergence(&runs)), Some(histories(&runs))];
    let page = sections.into_iter().flatten().filter(|section| !section.is_empty()).fold(page, Page::with);
    let foot = format!("Written by linkwright {}. The page is self-contained.", env!("CARGO_PKG_VERSION"));
    Ok(page.foot(foot).html()?)
}

/// Five digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// The times of the first run, or those of the part of them that both runs have; `None` if they have none in common.
fn common_times([first, second]: [Vec<f64>; 2]) -> Option<Vec<f64>> {
    let ends = |times: &[f64]| Some([*times.first()?, *times.last()?]);
    let ([a, b], [c, d]) = (ends(&first)?, ends(&second)?);
    if [a, b] == [c, d] {
        return Some(first);
    }
    let (from, to) = (a.max(c), b.min(d));
    let last = (first.len() - 1).max(1) as f64;
    (from < to).then(|| (0..first.len()).map(|k| from + (to - from) * k as f64 / last).collect())
}

/// The last designs side by side over the times that both runs have; `None` if a model has no mechanism.
fn mechanisms(runs: &[LastRun; 2]) -> anyhow::Result<Option<PageSection>> {
    let [first, second] = runs.each_ref().map(|run| run.model.drawing_times().zip(run.model.grid()));
    let (Some((first, grid)), Some((second, other))) = (first, second) else { return Ok(None) };
    let apart = |why: String| {
        let text = format!("The motions cannot be shown side by side: {why}.");
        Ok(Some(PageSection::new("mechanism", "Mechanisms").paragraph(text)))
    };
    if grid.unit != other.unit {
        return apart(format!(
            "one is over {} in {}, the other over {} in {}",
            grid.name, grid.unit, other.name, other.unit
        ));
    }
    let Some(times) = common_times([first, second]) else {
        return apart(format!("they have no value of {} in common", grid.name));
    };
    let mut scenes = vec![];
    for run in runs {
        match run.model.drawings(&[&run.state.design], &times) {
            Ok(Some(mut drawn)) => scenes.push(Scene::new(run.name.clone(), drawn.remove(0))),
            Ok(None) => return Ok(None),
            Err(error) => {
                let text = format!("The motion of {} cannot be shown: {error}.", run.name);
                return Ok(Some(PageSection::new("mechanism", "Mechanisms").paragraph(text)));
            }
        }
    }
    let axes = [QuantityLabel::new("*x*", "m"), QuantityLabel::new("*y*", "m")];
    let span = times[times.len() - 1] - times[0];
    let shown = if grid.unit == "s" { span.clamp(3.0, 10.0) } else { 5.0 };
    let times = times.iter().map(|&t| grid.shown(t)).collect();
    let Ok(motion) = Animation::new("The last designs of both runs.", axes, times, scenes) else { return Ok(None) };
    let motion = motion.lasting(shown)?.over(QuantityLabel::literal(&grid.name, &grid.unit));
    Ok(Some(PageSection::new("mechanism", "Mechanisms").html(motion.fragment())))
}

/// The line of the first or the second run, the same in all plots.
fn stroke(run: usize) -> Stroke {
    let solid = Stroke::solid(Colour::of_series(run), 1.0);
    if run == 0 { solid } else { solid.dash(Dash::Dashed) }
}

/// Objective and largest violation of the accepted designs.
fn convergence(runs: &[LastRun; 2]) -> PageSection {
    let section = PageSection::new("convergence", "Convergence");
    let last = runs.iter().filter_map(|run| run.state.history.last()).map(|cycle| cycle.cycle).max().unwrap_or(0);
    let axis = || PlotAxis::new("cycle", "").limits(-0.3, last.max(1) as f64 + 0.3).whole();
    let plot = |name: &str, label: QuantityLabel, values: &dyn Fn(&LastRun) -> Vec<[f64; 2]>| {
        let mut panel = Panel::new(axis(), PlotAxis::of(&label)).legend(Legend::Below);
        for (k, run) in runs.iter().enumerate() {
            let points = values(run);
            panel.add(Mark::curve(points.clone(), stroke(k)).named(literal(&run.name[..1])));
            panel.add(Mark::points(points, MarkerShape::Disc, Colour::of_series(k), 3.0));
        }
        Figure::new(name, 100.0, 70.0).with(panel)
    };
    let accepted = |run: &LastRun, value: &dyn Fn(usize) -> f64| -> Vec<[f64; 2]> {
        let steps = run.state.history.iter().enumerate().filter(|(_, cycle)| cycle.accepted);
        steps.map(|(k, cycle)| [cycle.cycle as f64, value(k)]).collect()
    };
    let objectives = runs.each_ref().map(|run| outcome::objectives(&run.problem, &run.state).unwrap_or_default());
    let objective = |run: &LastRun| {
        let own = &objectives[usize::from(run.name.starts_with('B'))];
        accepted(run, &|k| own.get(k).copied().unwrap_or(f64::NAN))
    };
    let violation = |run: &LastRun| accepted(run, &|k| run.state.history[k].violation_pct.max(0.0));
    let label = QuantityLabel::literal(&runs[0].problem.objective.name, &runs[0].problem.objective.unit);
    section
        .figure("objective", "Objective of both runs over the accepted designs.", plot("Objective", label, &objective))
        .figure(
            "violation",
            "Largest violation of both runs over the accepted designs.",
            plot("Violation", QuantityLabel::new("violation", "%"), &violation),
        )
}

/// Histories that both runs have, at the same time points and in the same unit.
fn histories(runs: &[LastRun; 2]) -> PageSection {
    let mut section = PageSection::new("histories", "Histories of the last designs");
    let [a, b] = runs;
    let (mut shown, mut left) = (0, vec![]);
    for (h, response) in a.problem.responses.iter().enumerate() {
        let Some(grid) = response.grid.map(|g| &a.problem.grids[g]).filter(|grid| grid.len() > 1) else { continue };
        let other = b.problem.responses.iter().position(|other| other.name == response.name);
        let fits = other.filter(|&k| {
            let other = &b.problem.responses[k];
            other.unit == response.unit && other.grid.is_some_and(|g| b.problem.grids[g].points == grid.points)
        });
        let Some(k) = fits.filter(|_| shown < MOST) else {
            left.push(response.name.clone());
            continue;
        };
        shown += 1;
        let times = grid.shown_points();
        let ends = [times[0], times[times.len() - 1]];
        let axes = [(&grid.name, &grid.unit), (&response.name, &response.unit)];
        let [x, y] = axes.map(|(name, unit)| PlotAxis::of(&QuantityLabel::literal(name, unit)));
        let mut panel = Panel::new(x.limits(ends[0], ends[1]), y).legend(Legend::Below);
        for (r, (run, h)) in [(a, h), (b, k)].into_iter().enumerate() {
            let points = times.iter().zip(&run.state.responses.values[h]).map(|(t, value)| [*t, *value]);
            panel.add(Mark::curve(points.collect::<Vec<_>>(), stroke(r)).named(&run.name[..1]));
        }
        let figure = Figure::new(format!("{} of both runs", literal(&response.name)), 100.0, 70.0).with(panel);
        section = section.figure(format!("history-{}", h + 1), format!("{}.", response.name), figure);
    }
    if !left.is_empty() {
        let text =
            format!("Not shown, as B has no such history at the same times, or for brevity: {}.", left.join(", "));
        section = section.paragraph(text);
    }
    section
}
