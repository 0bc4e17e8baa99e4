//! `linkwright report DIR`: a run as one page for a browser, and its figures as files.

use super::budget::Budget;
use super::output::say;
use super::output_folder::{OutputFolder, has};
use super::progress::{Show, working};
use super::run_directory::{PAGE, RunDirectory, SettingChange, fingerprint};
use anyhow::Context;
use clap::Args;
use linkwright::model_file::Model;
use linkwright::problem::Problem;
use linkwright::report::animation::{Animation, Scene};
use linkwright::report::figure::{Figure, QuantityLabel, literal};
use linkwright::report::page::{Badge, Page, PageSection};
use linkwright::report::run::{OptimizationReport, Slice};
use linkwright::report::table::{Cell, Table};
use linkwright::sao::RunState;
use linkwright::storage::Directory;
use rayon::prelude::*;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The page of two runs.
const COMPARED: &str = "compared.html";
/// Folder of the figures.
const FIGURES: &str = "figures";
/// Numbers of points along each side of the design-space slice, and its largest estimated time.
const SLICES: [usize; 4] = [21, 15, 11, 7];
const SLICE_TIME: Duration = Duration::from_secs(5);
/// Largest number of cycles that a reader can choose, and the estimated time of their analyses.
const CYCLES: usize = 24;
const CYCLE_TIME: Duration = Duration::from_secs(5);
/// Pixels per inch of PNG files and of the animated file.
const PRINT: f64 = 300.0;
const SCREEN: f64 = 96.0;

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright report out/lift
  linkwright report out/four-bar --slice 9
  linkwright report lift lift-2 -o both

Writes DIR/report.html, a page without external files, and every figure as SVG and PNG to DIR/figures, with an animation of
the mechanism as mechanism.gif. Works for unfinished runs, too. With two runs the page is compared.html in the folder of the
first one, or report.html in DIR of --out.")]
pub struct Report {
    /// The folder of the run, or its name in the folder of results
    folder: PathBuf,
    /// A second run: one page with both
    other: Option<PathBuf>,
    /// Points along each side of the design-space slice; each point is an analysis, 0 for no slice [default: as many as fit into 5 seconds]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=101))]
    slice: Option<u16>,
    /// Write only the page, no figure files
    #[arg(long)]
    page_only: bool,
    /// Folder for the page and its figures [default: the folder of the run]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one line of JSON with the path of the page
    #[arg(long)]
    json: bool,
    /// Print nothing on standard output
    #[arg(short, long, conflicts_with = "json")]
    quiet: bool,
    #[command(flatten)]
    budget: Budget,
}

impl Report {
    pub fn run(&self) -> anyhow::Result<()> {
        let folder = super::output_folder::stored(&self.folder);
        if let Some(other) = &self.other {
            return self.compare(&folder, &super::output_folder::stored(other));
        }
        let place = write_report(&folder, self.slice, !self.page_only, self.out.as_deref(), self.show(), &self.budget)?;
        self.tell(&place)
    }

    fn compare(&self, a: &Path, b: &Path) -> anyhow::Result<()> {
        anyhow::ensure!(self.slice.is_none(), "a page of two runs has no slice of the design space; leave --slice out");
        let work = working("drawing the page", self.show(), None);
        let page = super::report_pair::page_of_two(a, b, &self.budget)?;
        drop(work);
        let place = match &self.out {
            Some(out) => OutputFolder::create(out)?.write(PAGE, page.as_bytes())?,
            None => RunDirectory::open(a)?.0.folder().write(COMPARED, page.as_bytes())?,
        };
        self.tell(&place)
    }

    fn tell(&self, place: &Path) -> anyhow::Result<()> {
        match self.show() {
            Show::Nothing => Ok(()),
            Show::JsonLines => say(&json!({ "event": "report", "version": 1, "page": place }).to_string()),
            Show::Table => say(&format!("Wrote {}", place.display())),
        }
    }

    fn show(&self) -> Show {
        Show::of(self.json, self.quiet)
    }
}

/// Writes the page of a run and, with `with_figures`, the files of its figures. Returns the path of the page.
/// The folder is `out`, or that of the run.
pub fn write_report(
    path: &Path,
    slice: Option<u16>,
    with_figures: bool,
    out: Option<&Path>,
    show: Show,
    budget: &Budget,
) -> anyhow::Result<PathBuf> {
    let (folder, model, text) = RunDirectory::open(path)?;
    budget.check_analysis(&model.problem()?, model.method())?;
    let line = working("drawing the report", show, &model);
    let drawn = DrawnReport::new(&folder, &model, slice, with_figures)?;
    drop(line);
    match out {
        Some(out) => drawn.store_in(&mut OutputFolder::create(out)?),
        None => drawn.store(folder, &model, &text),
    }
}

/// A report in memory: the page, without the links to the files of the folder, and the files of its figures.
#[derive(Clone)]
pub struct DrawnReport {
    page: Page,
    figures: Vec<(String, Vec<u8>)>,
}

impl DrawnReport {
    /// Draws the report of the last state of a run.
    pub fn new(folder: &RunDirectory, model: &Model, slice: Option<u16>, with_figures: bool) -> anyhow::Result<Self> {
        let problem = model.problem()?;
        let (page, motion) = match folder.last(model, &problem)? {
            Some(last) => of_run(model, &problem, &last.state, slice)?,
            None => (without_state(model, &problem)?, None),
        };
        let figures = if with_figures { drawn_figures(&page, motion.as_ref())? } else { vec![] };
        Ok(Self { page, figures })
    }

    /// Writes the files. The page is written even if a figure cannot be written. Returns the path of the page.
    pub fn store(mut self, mut folder: RunDirectory, model: &Model, text: &str) -> anyhow::Result<PathBuf> {
        let figures = self.store_figures(folder.folder());
        self.page = self.page.with(listed(model, &mut folder, text));
        self.store_page(folder.folder(), figures)
    }

    /// Writes page and figures into another folder, without links to the files of the run.
    pub fn store_in(self, folder: &mut OutputFolder) -> anyhow::Result<PathBuf> {
        let figures = self.store_figures(folder);
        self.store_page(folder, figures)
    }

    fn store_figures(&self, folder: &OutputFolder) -> anyhow::Result<()> {
        if self.figures.is_empty() { Ok(()) } else { write_figures(folder, &self.figures) }
    }

    fn store_page(self, folder: &mut OutputFolder, figures: anyhow::Result<()>) -> anyhow::Result<PathBuf> {
        let page = self.page.foot(format!(
            "Written by linkwright {}. The page is self-contained: it can be sent and stored as one file.",
            env!("CARGO_PKG_VERSION")
        ));
        let place = folder.write(PAGE, page.html()?.as_bytes())?;
        figures.with_context(|| format!("the page {} is complete, but not its figures as files", place.display()))?;
        Ok(place)
    }
}

fn of_run(
    model: &Model,
    problem: &Problem,
    state: &RunState,
    slice: Option<u16>,
) -> anyhow::Result<(Page, Option<Animation>)> {
    let begun = Instant::now();
    let run = OptimizationReport::new(model.title(), problem, state)?;
    let one = begun.elapsed();
    let fitting = CYCLE_TIME.as_secs_f64() * rayon::current_num_threads() as f64 / one.as_secs_f64().max(1e-6);
    let run = run.with_cycles((fitting as usize).min(CYCLES));
    let slice = sample(problem, state, slice.map(usize::from), one);
    let first = &state.history[0].design;
    let mut designs = vec![("first design", first.as_slice())];
    if *first != state.design {
        designs.push(("last design", &state.design));
    }
    let cycles: Vec<(usize, &[f64])> = run.shown_cycles().collect();
    let (section, motion) = mechanism(model, &designs, &cycles)?;
    Ok((run.page(slice.as_ref(), section.into_iter().collect())?, motion))
}

/// The slice with the given number of points per side, or with as many as fit into the time if an analysis takes `one`.
fn sample(problem: &Problem, state: &RunState, wanted: Option<usize>, one: Duration) -> Option<Slice> {
    let time = |n: &usize| one.as_secs_f64() * (n * n) as f64 / rayon::current_num_threads() as f64;
    let fits = || SLICES.into_iter().find(|n| time(n) <= SLICE_TIME.as_secs_f64());
    let count = wanted.or_else(fits)?;
    // The report is written without the slice if no design of the plane can be analysed.
    Slice::sample(problem, state, count).ok().flatten()
}

/// The animated mechanism at titled designs, and at those of numbered cycles; `None` for a model without a mechanism.
pub fn mechanism(
    model: &Model,
    designs: &[(&str, &[f64])],
    cycles: &[(usize, &[f64])],
) -> anyhow::Result<(Option<PageSection>, Option<Animation>)> {
    let (Some(times), Some(grid)) = (model.drawing_times(), model.grid()) else { return Ok((None, None)) };
    let of = |cycles: &[(usize, &[f64])]| {
        let all = designs.iter().map(|(_, b)| *b).chain(cycles.iter().map(|(_, b)| *b));
        model.drawings(&all.collect::<Vec<_>>(), &times)
    };
    // If the design of a cycle cannot be drawn, the titled designs are drawn without the cycles.
    let (drawn, cycles) = match of(cycles) {
        Err(_) if !cycles.is_empty() => (of(&[]), &[][..]),
        drawn => (drawn, cycles),
    };
    let mut drawn = match drawn {
        Ok(Some(drawn)) => drawn,
        Ok(None) => return Ok((None, None)),
        Err(error) => {
            let text = format!("The motion cannot be shown: {error}.");
            return Ok((Some(PageSection::new("mechanism", "Mechanism").paragraph(text)), None));
        }
    };
    let of_cycles = drawn.split_off(designs.len());
    let is_view = drawn.iter().flatten().any(|linkage| linkage.space.is_some());
    let names = if is_view { ["horizontal in the view", "vertical in the view"] } else { ["*x*", "*y*"] };
    let titles = designs.iter().map(|(title, _)| (*title).to_owned());
    let scenes = titles.zip(drawn).map(|(title, frames)| Scene::new(title, frames)).collect();
    let real = times[times.len() - 1] - times[0];
    let shown = if grid.unit == "s" { real.clamp(3.0, 10.0) } else { 5.0 };
    let axes = names.map(|name| QuantityLabel::new(name, "m"));
    let description = match shown / real {
        _ if !model.draws_motion() => format!("The mechanism in equilibrium over the {}.", grid.name),
        _ if grid.unit != "s" => format!("The mechanism over the {}.", grid.name),
        r if r > 1.05 => format!("The mechanism in motion, {r:.1} times slower than in reality."),
        r if r < 0.95 => format!("The mechanism in motion, {:.1} times faster than in reality.", 1.0 / r),
        _ => "The mechanism in motion, as fast as in reality.".to_owned(),
    };
    let time = QuantityLabel::literal(&grid.name, &grid.unit);
    // A mechanism without a visible body has no animation.
    let times = times.iter().map(|&t| grid.shown(t)).collect();
    let Ok(motion) = Animation::new(literal(&description), axes, times, scenes) else { return Ok((None, None)) };
    let motion = motion.lasting(shown)?.over(time);
    let motion = if designs.len() > 1 { motion.compared() } else { motion };
    let motion =
        cycles.iter().zip(of_cycles).try_fold(motion, |motion, ((k, _), frames)| motion.with_cycle(*k, frames))?;
    Ok((Some(PageSection::new("mechanism", "Mechanism").html(motion.fragment())), Some(motion)))
}

/// The page of a run that was stopped before the start design was analysed.
fn without_state(model: &Model, problem: &Problem) -> anyhow::Result<Page> {
    let mut table = Table::new("Design variables", ["variable", "unit", "lower bound", "start", "upper bound"]);
    let bound = |b: f64| if b.is_finite() { Cell::from(b) } else { Cell::Empty };
    for v in &problem.variables {
        let (lower, upper) = (bound(v.lower), bound(v.upper));
        table.push([v.name.as_str().into(), v.unit.as_str().into(), lower, v.start.into(), upper])?;
    }
    let lead = "The run was stopped before its first design was analysed; continue it with `linkwright resume`.";
    let section = PageSection::new("design", "Design").table(table);
    Ok(Page::new(model.title()).status("unfinished", Badge::Fair).lead(lead).with(section))
}

/// Files of the folder with their descriptions.
const FILES: [(&str, &str); 9] = [
    ("cycles.csv", "the history, a row for each trial step"),
    ("responses.csv", "responses of the last design over time"),
    ("constraints.csv", "constrained quantities of the last design over time"),
    ("summary.json", "the result, for programs"),
    ("model.toml", "the model file"),
    ("state.json", "the complete state, read by resume"),
    ("run.json", "versions, fingerprint, edits"),
    ("figures", "every figure of this page as SVG and PNG"),
    ("figures/mechanism.gif", "animation of the mechanism"),
];

fn listed(model: &Model, folder: &mut RunDirectory, text: &str) -> PageSection {
    let directory = folder.folder().directory();
    let is_present = |name: &str| match name.split_once('/') {
        Some((outer, inner)) => {
            has(directory, outer) && Directory::open(&directory.path().join(outer)).is_ok_and(|d| has(&d, inner))
        }
        None => has(directory, name),
    };
    let present: Vec<_> = FILES.into_iter().filter(|(name, _)| is_present(name)).collect();
    let mut section = PageSection::new("data", "Data and settings")
        .links(present.into_iter().map(|(name, what)| (name.to_owned(), what.to_owned())))
        .paragraph(format!(
            "Begun with linkwright {}. Fingerprint of the problem: {}; runs with the same fingerprint differ at most in method, \
             bounds and title.",
            folder.record().versions.program,
            fingerprint(model)
        ));
    for edit in &folder.record().edits {
        let after = edit.after_tries;
        section = if edit.lines.is_empty() {
            // A decision by hand: what, and about which trial step.
            let about =
                |change: &SettingChange| change.before.as_ref().map_or_else(String::new, |step| format!(" ({step})"));
            let decisions: Vec<String> = edit.changes.iter().map(|c| format!("{}{}", c.key, about(c))).collect();
            section.paragraph(format!("After {after} trial steps: {}.", decisions.join(", ")))
        } else {
            section.listing(format!("The model was edited after {after} trial steps; new lines"), edit.lines.join("\n"))
        };
    }
    section.listing("The model file of this run", text)
}

/// Every figure as SVG and PNG, and the mechanism as a figure and as an animated GIF: names and contents of the files.
fn drawn_figures(page: &Page, motion: Option<&Animation>) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let drawn = |name: &str, figure: &Figure| -> anyhow::Result<[(String, Vec<u8>); 2]> {
        Ok([(format!("{name}.svg"), figure.svg()?.into_bytes()), (format!("{name}.png"), figure.png(PRINT)?)])
    };
    let figures: Vec<_> = page.figures().collect();
    let files: Vec<_> = figures.par_iter().map(|(name, figure)| drawn(name, figure)).collect::<Result<_, _>>()?;
    let mut files: Vec<(String, Vec<u8>)> = files.into_iter().flatten().collect();
    if let Some(motion) = motion {
        files.extend(drawn("mechanism", &motion.still(0)?)?);
        files.push(("mechanism.gif".to_owned(), motion.gif(SCREEN)?));
    }
    Ok(files)
}

fn write_figures(folder: &OutputFolder, files: &[(String, Vec<u8>)]) -> anyhow::Result<()> {
    let mut place = folder.subfolder(FIGURES)?;
    place.own(&files.iter().map(|(name, _)| name).collect::<Vec<_>>())?;
    files.iter().try_for_each(|(name, bytes)| place.write(name, bytes).map(drop))
}
