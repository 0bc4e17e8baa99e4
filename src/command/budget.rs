//! Memory and time of a problem, estimated from its sizes before any work is done.

use super::output::{brief, complain};
use anyhow::bail;
use clap::Args;
use linkwright::approximation::CycleData;
use linkwright::problem::{Problem, RowId, Selection};
use linkwright::sao::Method;
use std::time::Duration;

/// The budget of a command.
#[derive(Args)]
pub struct Budget {
    /// Memory that responses, derivatives and the approximate problem may need, such as 500M or 8G
    #[arg(long, value_name = "SIZE", default_value = "2G", value_parser = size)]
    memory: u64,
}

/// Sizes of a problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// Number of design variables n.
    variables: u64,
    /// Numbers of all responses at all time points.
    values: u64,
    /// Constraints at all time points.
    rows: u64,
    /// Numbers of a response that are differentiated in a cycle, at most.
    needed: u64,
    /// Rows of an approximate problem, at most.
    retained: u64,
    /// Earlier designs that are stored with their derivatives.
    memory: u64,
    /// True if second derivatives are computed.
    is_second_order: bool,
}

/// Rows that a constraint with a selection near its maxima retains, at most: more maxima are unusual.
const ROWS_NEAR_MAXIMA: u64 = 100;
/// Bytes of a number in memory, as text in a file, and as a cell of a table.
const NUMBER: u64 = 8;
const TEXT: u64 = 25;
const CELL: u64 = 64;
/// Estimated time of a number of a derivative, by forward differentiation of a formula.
const DERIVATIVE: Duration = Duration::from_nanos(20);
/// Time of a cycle beyond which it is stated.
const LONG: Duration = Duration::from_secs(60);

impl Sizes {
    /// The sizes of a problem and of its approximations by a method.
    pub fn of(problem: &Problem, method: &Method) -> Self {
        let points = |grid: Option<usize>| grid.map_or(1, |grid| problem.grids[grid].len() as u64);
        let values = problem.responses.iter().map(|response| points(response.grid)).sum();
        let all = |j: usize| problem.points_of(&problem.constraints[j].quantity) as u64;
        let few = |j: usize| {
            let constraint = &problem.constraints[j];
            let selects = constraint.selection.unwrap_or(method.screening.selection) != Selection::All;
            let is_few = selects && !constraint.is_equality();
            if is_few { all(j).min(ROWS_NEAR_MAXIMA) } else { all(j) }
        };
        let constraints = 0..problem.constraints.len();
        let of_objective = CycleData::needed(problem, &[]).len() as u64;
        // Every retained row needs the responses that it uses; of a functional all of its points.
        let of_row = |j: usize| {
            let first = [RowId { constraint: j, point: 0 }];
            let one = CycleData::needed(problem, &first).len() as u64;
            few(j).saturating_mul(one.saturating_sub(of_objective).max(1))
        };
        let retained = constraints.clone().map(few).sum();
        let needed: u64 = constraints.clone().map(of_row).sum();
        let memory = method.approximation.memory().max(method.curvature.map_or(0, |curvature| curvature.steps));
        Self {
            variables: problem.n() as u64,
            values,
            rows: constraints.map(all).sum(),
            needed: (needed + of_objective).min(values),
            retained,
            memory: memory as u64,
            is_second_order: method.approximation.wants_curvature(),
        }
    }

    /// Numbers of the derivatives that are stored at a time, if `needed` responses are differentiated.
    fn derivatives(&self, needed: u64) -> u64 {
        let first = needed.saturating_mul(self.variables);
        let second = if self.is_second_order { first.saturating_mul(self.variables) } else { 0 };
        first.saturating_mul(1 + self.memory).saturating_add(second)
    }

    /// Largest size of a state file in bytes.
    pub fn state_limit(&self) -> u64 {
        let numbers =
            (self.values + self.rows).saturating_add(self.derivatives(self.values)).saturating_add(self.variables);
        (64 << 20) + numbers.saturating_mul(4 * TEXT)
    }

    /// Estimated memory of a cycle in bytes: derivatives during and after the analysis, the approximate problem with two copies of its
    /// rows, and the text of the state.
    fn of_cycle(&self) -> u64 {
        let (derivatives, rows) = (self.derivatives(self.needed), self.retained.saturating_mul(self.variables));
        let numbers = self.values + self.rows + 2 * self.variables.saturating_mul(self.variables);
        let stored = NUMBER.saturating_mul(
            numbers.saturating_add(derivatives.saturating_mul(2)).saturating_add(rows.saturating_mul(2)),
        );
        stored.saturating_add(derivatives.saturating_mul(TEXT))
    }

    /// Estimated memory of the responses and constraints of an analysis with their tables, in bytes.
    fn of_analysis(&self) -> u64 {
        (self.values + self.rows).saturating_mul(NUMBER + CELL + TEXT)
    }

    /// Estimated memory of a table of the derivatives of all responses, in bytes.
    fn of_table(&self) -> u64 {
        self.values.saturating_mul(self.variables).saturating_mul(2 * NUMBER + CELL + TEXT)
    }

    fn in_words(&self) -> String {
        let Self { variables, values, retained, .. } = self;
        format!(
            "{variables} design variables, {values} values of responses, about {retained} rows of the approximate problem"
        )
    }
}

impl Budget {
    /// Rejects a run that needs more memory; states the time of long cycles.
    pub fn check(&self, problem: &Problem, method: &Method) -> anyhow::Result<()> {
        let sizes = Sizes::of(problem, method);
        self.allow(sizes.of_cycle(), &sizes)?;
        let count = u32::try_from(sizes.derivatives(sizes.needed)).unwrap_or(u32::MAX);
        let time = DERIVATIVE.saturating_mul(count);
        if time > LONG {
            let time = brief(time);
            complain(&format!(
                "note: a cycle differentiates at least {count} numbers, which takes about {time} or more"
            ));
        }
        Ok(())
    }

    /// Rejects an analysis that needs more memory.
    pub fn check_analysis(&self, problem: &Problem, method: &Method) -> anyhow::Result<()> {
        let sizes = Sizes::of(problem, method);
        self.allow(sizes.of_analysis(), &sizes)
    }

    /// Rejects a table of all derivatives that needs more memory.
    pub fn check_table(&self, problem: &Problem, method: &Method) -> anyhow::Result<()> {
        let sizes = Sizes::of(problem, method);
        self.allow(sizes.of_table(), &sizes)
    }

    fn allow(&self, bytes: u64, sizes: &Sizes) -> anyhow::Result<()> {
        if bytes <= self.memory {
            return Ok(());
        }
        bail!(
            "about {} of memory are needed ({}), more than the budget of {}; use fewer time points, outputs or design variables, or \
             give --memory {}",
            in_words(bytes),
            sizes.in_words(),
            in_words(self.memory),
            in_words(bytes).replace([' ', 'B'], "")
        )
    }
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
