//! Memory and time of a problem, estimated from its sizes before any work is done.

use super::output::{brief, complain};
use anyhow::bail;
use clap::Args;
use linkwright::approximation::CycleData;
use linkwright::model_file::Model;
use linkwright::problem::{Problem, RowId};
use linkwright::sao::Method;
use linkwright::study::{Part, Phase, Study, StudyKind};
use std::time::Duration;

/// Memory of a command without `--memory`.
const DEFAULT: &str = "2G";

/// The budget of a command.
#[derive(Args, Clone, Copy, Debug)]
pub struct Budget {
    /// Memory that the analyses, derivatives and approximate problems of a run may need, such as 500M or 8G
    #[arg(long, value_name = "SIZE", default_value = DEFAULT, value_parser = size)]
    memory: u64,
}

impl Default for Budget {
    fn default() -> Self {
        Self { memory: size(DEFAULT).expect("it is a size") }
    }
}

/// Sizes of a problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// Number of design variables n.
    variables: u64,
    /// Number of values of all responses at all time points.
    values: u64,
    /// Constraints at all time points.
    rows: u64,
    /// Largest number of values of responses that are differentiated in a cycle.
    needed: u64,
    /// Number of values of responses that are differentiated for the objective and every constraint at one time point.
    instant: u64,
    /// Largest number of rows of an approximate problem.
    retained: u64,
    /// Earlier designs whose derivatives the approximation uses.
    earlier: u64,
    /// Designs whose numbers are stored for the automatic method, which also confirms the ends of other methods.
    stored: u64,
    /// True if second derivatives are computed.
    is_second_order: bool,
}

/// Designs that a confirmed run stores for its confirmation, with those that the confirmation adds.
const CONFIRMED: u64 = 12;
/// Bytes of a number in memory, as text in a file, and as a cell of a table.
const NUMBER: u64 = 8;
const TEXT: u64 = 25;
const CELL: u64 = 64;
/// Bytes of the value of a response or constraint, including its places in tables and pages.
const VALUE: u64 = 2 * (NUMBER + CELL + TEXT);
/// Bytes of a first derivative: in the analysis, in the cycle, in the approximate problem, and as text of the state.
const DERIVATIVE: u64 = 6 * NUMBER + 2 * TEXT;
/// Bytes of a stored number apart from its gradient, and for each derivative: in the state, as samples, and as text of the state.
const STORED: [u64; 2] = [500, 4 * NUMBER + 2 * TEXT];
/// Bytes of a row of an approximate problem, and for each of its derivatives.
const ROW: [u64; 2] = [500, 8 * NUMBER];
/// Full matrices of each number in the automatic method.
const MATRICES: u64 = 2;
/// Bytes of a row of a study, and of each of its numbers.
const STUDY_ROW: [u64; 2] = [200, 100];
/// Estimated times of a derivative, by forward differentiation of a formula, and of an entry of a full matrix.
const TIMES: [Duration; 2] = [Duration::from_nanos(20), Duration::from_nanos(100)];
/// Time of a cycle above which a note states it.
const LONG: Duration = Duration::from_secs(60);

impl Sizes {
    /// The sizes of a problem and of its approximations by a method.
    pub fn of(problem: &Problem, method: &Method) -> Self {
        let points = |grid: Option<usize>| grid.map_or(1, |grid| problem.grids[grid].len() as u64);
        let values = problem.responses.iter().map(|response| points(response.grid)).sum();
        let all = |j: usize| problem.points_of(&problem.constraints[j].quantity) as u64;
        let few = |j: usize| method.most_rows(problem, j) as u64;
        let constraints = 0..problem.constraints.len();
        let of_objective = CycleData::needed(problem, &[]).len() as u64;
        // Every retained row needs the responses that it uses; of a functional all of its points.
        let of_instant = |j: usize| {
            let first = [RowId { constraint: j, point: 0 }];
            (CycleData::needed(problem, &first).len() as u64).saturating_sub(of_objective).max(1)
        };
        let of_row = |j: usize| few(j).saturating_mul(of_instant(j));
        let instant = constraints.clone().map(of_instant).sum::<u64>().saturating_add(of_objective);
        let retained = constraints.clone().map(few).sum();
        let needed: u64 = constraints.clone().map(of_row).sum();
        let earlier = method.approximation.memory().max(method.curvature.map_or(0, |curvature| curvature.steps));
        let stored = match method.automatic {
            Some(automatic) => automatic.memory as u64 + 1,
            None if method.stop.confirm => CONFIRMED,
            None => 0,
        };
        Self {
            variables: problem.n() as u64,
            values,
            rows: constraints.map(all).sum(),
            needed: (needed + of_objective).min(values),
            instant: instant.min(values),
            retained,
            earlier: earlier as u64,
            stored: stored.min(method.stop.max_cycles as u64 + 1),
            is_second_order: method.approximation.wants_curvature(),
        }
    }

    /// The sizes of a simulation: outputs without an objective.
    fn of_simulation(variables: usize, values: usize) -> Self {
        let (variables, values) = (variables as u64, values as u64);
        Self {
            variables,
            values,
            rows: 0,
            needed: 0,
            instant: 0,
            retained: 0,
            earlier: 0,
            stored: 0,
            is_second_order: false,
        }
    }

    /// Numbers of the derivatives of `needed` responses.
    fn derivatives(&self, needed: u64) -> u64 {
        let first = needed.saturating_mul(self.variables);
        let second = if self.is_second_order { first.saturating_mul(self.variables) } else { 0 };
        first.saturating_mul(1 + self.earlier).saturating_add(second)
    }

    /// Numbers of the full matrices of a cycle of the automatic method.
    fn matrices(&self) -> u64 {
        let square = self.variables.saturating_mul(self.variables);
        if self.stored > 0 { self.needed.saturating_mul(MATRICES * square) } else { 0 }
    }

    /// Largest size of a state file in bytes.
    pub fn state_limit(&self) -> u64 {
        let numbers =
            (self.values + self.rows).saturating_add(self.derivatives(self.values)).saturating_add(self.variables);
        let stored = self.values.saturating_mul(self.variables + 4).saturating_mul(self.stored);
        (64 << 20) + numbers.saturating_add(stored).saturating_mul(4 * TEXT)
    }

    /// Estimated memory of a cycle in bytes. `tests/model/budget.rs` compares it with measured peaks.
    fn of_cycle(&self) -> u64 {
        let of = |count: u64, [one, derivative]: [u64; 2]| {
            count.saturating_mul(one.saturating_add(derivative.saturating_mul(self.variables)))
        };
        let parts = [
            self.of_analysis(),
            self.derivatives(self.needed).saturating_mul(DERIVATIVE),
            of(self.needed.saturating_mul(self.stored), STORED),
            of(self.retained, ROW),
            self.matrices().saturating_mul(NUMBER),
            self.variables.saturating_mul(self.variables).saturating_mul(4 * NUMBER),
        ];
        parts.into_iter().fold(0, u64::saturating_add)
    }

    /// Estimated memory of the responses and constraints of an analysis with their tables, in bytes.
    fn of_analysis(&self) -> u64 {
        (self.values + self.rows).saturating_mul(VALUE)
    }

    /// Estimated memory of an analysis with the derivatives of the objective and of every constraint at one time point, in bytes.
    fn of_gradients(&self) -> u64 {
        let derivatives = self.instant.saturating_mul(self.variables).saturating_mul(DERIVATIVE);
        self.of_analysis().saturating_add(derivatives)
    }

    /// Estimated memory of a table of the derivatives of all responses, in bytes.
    fn of_table(&self) -> u64 {
        let derivatives = self.values.saturating_mul(self.variables).saturating_mul(2 * NUMBER + 2 * TEXT);
        self.of_analysis().saturating_add(derivatives)
    }

    /// Least estimated time of a cycle.
    fn time(&self) -> Duration {
        let of = |one: Duration, count: u64| one.saturating_mul(u32::try_from(count).unwrap_or(u32::MAX));
        of(TIMES[0], self.derivatives(self.needed)).saturating_add(of(TIMES[1], self.matrices()))
    }

    fn in_words(&self) -> String {
        let Self { variables, values, retained, .. } = self;
        format!(
            "{variables} design variables, {values} values of responses, about {retained} rows of the approximate problem"
        )
    }
}

impl Budget {
    /// The size in bytes.
    #[cfg(feature = "app")]
    pub fn bytes(&self) -> u64 {
        self.memory
    }

    /// Rejects a run that needs more memory; states the time of long cycles.
    pub fn check(&self, problem: &Problem, method: &Method) -> anyhow::Result<()> {
        let sizes = Sizes::of(problem, method);
        self.allow(sizes.of_cycle(), &sizes.in_words())?;
        if sizes.time() > LONG {
            let (time, words) = (brief(sizes.time()), sizes.in_words());
            complain(&format!("note: by its sizes, a cycle takes about {time} or more ({words})"));
        }
        Ok(())
    }

    /// Rejects a part of a study whose rows need more memory.
    pub fn check_rows(&self, study: &Study, part: Part) -> anyhow::Result<()> {
        let of_phase = |phase: &Phase| {
            let numbers = phase.columns.len() as u64;
            (phase.runs.div_ceil(part.of) as u64).saturating_mul(STUDY_ROW[0] + STUDY_ROW[1] * numbers)
        };
        let rows = study.phases().iter().map(of_phase).fold(0, u64::saturating_add);
        let runs = study.runs().iter().sum::<usize>().div_ceil(part.of);
        if rows <= self.memory {
            return Ok(());
        }
        let (needed, given) = (in_words(rows), in_words(self.memory));
        bail!(
            "about {needed} of memory are needed for the rows of {runs} runs, more than the budget of {given}; do fewer runs, {}or {}",
            if study.has_parts() { "parts (--part 1/4), " } else { "" },
            larger(rows)
        )
    }

    /// Rejects a study whose runs need more memory: analyses, analyses with derivatives, or optimizations.
    pub fn check_runs(&self, kind: StudyKind, problem: &Problem, method: &Method) -> anyhow::Result<()> {
        match kind {
            StudyKind::Grid | StudyKind::Sample | StudyKind::Indices => self.check_analysis(problem, method),
            StudyKind::Tolerance => {
                let sizes = Sizes::of(problem, method);
                self.allow(sizes.of_gradients(), &sizes.in_words())
            }
            StudyKind::MultiStart | StudyKind::Sweep | StudyKind::Pareto => self.check(problem, method),
        }
    }

    /// Rejects an analysis that needs more memory.
    pub fn check_analysis(&self, problem: &Problem, method: &Method) -> anyhow::Result<()> {
        let sizes = Sizes::of(problem, method);
        self.allow(sizes.of_analysis(), &sizes.in_words())
    }

    /// Rejects a simulation of a file without an objective that needs more memory.
    pub fn check_simulation(&self, model: &Model) -> anyhow::Result<()> {
        let points = model.grid().map_or(1, |grid| grid.len());
        let values = model.output_names().map(|(.., grid)| grid.map_or(1, |_| points)).sum();
        let sizes = Sizes::of_simulation(model.variables().len(), values);
        self.allow(sizes.of_analysis(), &sizes.in_words())
    }

    /// Rejects a table of all derivatives that needs more memory.
    pub fn check_table(&self, problem: &Problem, method: &Method) -> anyhow::Result<()> {
        let sizes = Sizes::of(problem, method);
        self.allow(sizes.of_table(), &sizes.in_words())
    }

    fn allow(&self, bytes: u64, sizes: &str) -> anyhow::Result<()> {
        if bytes <= self.memory {
            return Ok(());
        }
        bail!(
            "about {} of memory are needed ({sizes}), more than the budget of {}; use fewer time points, outputs or design variables, or {}",
            in_words(bytes),
            in_words(self.memory),
            larger(bytes)
        )
    }
}

/// The option that allows so many bytes.
fn larger(bytes: u64) -> String {
    format!("give --memory {}", in_words(bytes).replace([' ', 'B'], ""))
}

/// A size in bytes, with three digits.
fn in_words(bytes: u64) -> String {
    match bytes as f64 {
        b if b < 1e6 => format!("{} kB", (b / 1e3).ceil()),
        b if b < 1e9 => format!("{} MB", (b / 1e6).ceil()),
        b => format!("{} GB", (b / 1e9).ceil()),
    }
}

/// A size such as 500M or 8G.
fn size(text: &str) -> Result<u64, String> {
    let (digits, unit) = text.split_at(text.trim_end_matches(|c: char| c.is_ascii_alphabetic()).len());
    let factor = match unit.trim_end_matches(['B', 'b']).to_ascii_uppercase().as_str() {
        "" => 1.0,
        "K" => 1e3,
        "M" => 1e6,
        "G" => 1e9,
        "T" => 1e12,
        _ => return Err("give a number with k, M, G or T, such as 8G".to_owned()),
    };
    match digits.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok((number * factor) as u64),
        _ => Err("give a positive size such as 500M or 8G".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_shown() {
        assert_eq!(
            ["500M", "8G", "1.5GB", "1000", "2k"].map(|s| size(s).unwrap()),
            [500_000_000, 8_000_000_000, 1_500_000_000, 1000, 2000]
        );
        for bad in ["", "G", "-1G", "1X", "infG", "0"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert_eq!([2_400_000_000, 500_000_000, 999].map(in_words), ["3 GB", "500 MB", "1 kB"]);
    }
}
