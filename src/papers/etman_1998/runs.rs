//! The runs behind the tables.

use super::table::{Cell, Table};
use crate::error::{Error, Result};
use crate::library::{impact_absorber, slider_crank};
use crate::problem::Problem;
use crate::sao::{Cycle, Method, State};

/// A run with the table that it regenerates.
pub struct Run {
    /// The problem.
    pub problem: Problem,
    /// The run, ended.
    pub state: State,
    /// Its table.
    pub table: Table,
}

/// Names of the tables that can be regenerated, in order.
pub const TABLES: [&str; 4] = ["table1", "table2", "table3", "table4"];

/// Told of every state of a run, with the name of its table.
pub type Observer<'a> = dyn FnMut(&str, &State) + 'a;

/// The run of a table, none for Table III, which is data; errors for a name that is no table.
pub fn run(table: &str, observe: &mut Observer) -> Result<Option<Run>> {
    match table {
        "table1" => table1(observe).map(Some),
        "table2" => table2(observe).map(Some),
        "table3" => Ok(None),
        "table4" => table4(observe).map(Some),
        other => {
            let remedy = format!("choose from {}", TABLES.join(", "));
            Err(Error::definition(format!("table `{other}`"), "it is not among the tables of this paper", remedy))
        }
    }
}

/// Table III: the desired path, as the problem uses it.
pub fn table3() -> Result<Table> {
    let point = |k: usize| {
        let [x, y] = slider_crank::DESIRED[k];
        vec![(k + 1).into(), x.into(), y.into(), slider_crank::ROTATIONS_DEG[k].into()]
    };
    let csv = include_str!("../../../papers/etman-1998/table3.csv");
    Table::new("table3", "Table III. Path coordinates and prescribed timing", csv, (0..8).map(point).collect())
}

fn yes(cycle: &Cycle) -> Cell {
    if cycle.accepted { "y" } else { "n" }.into()
}

fn table1(observe: &mut Observer) -> Result<Run> {
    let problem = impact_absorber::peak_acceleration()?;
    let state = Method::default().solve(&problem, |s| observe("table1", s))?;
    let row = |c: &Cycle| {
        let design = c.design.iter().map(|&b| b.into());
        let errors = [c.constraint_error_pct.into(), c.violation_pct.into()];
        [c.cycle.into(), yes(c), c.active_limits.into()].into_iter().chain(design).chain(errors).collect()
    };
    let title = "Table I. Impact absorber, maximum acceleration";
    let csv = include_str!("../../../papers/etman-1998/table1.csv");
    let table = Table::new("table1", title, csv, state.history.iter().map(row).collect())?
        .noting("Errors of cycles 4 and 5 are at the level of rounding and of the solver's tolerance.");
    Ok(Run { problem, state, table })
}

fn table2(observe: &mut Observer) -> Result<Run> {
    let problem = impact_absorber::comfort()?;
    let state = Method::default().solve(&problem, |s| observe("table2", s))?;
    let row = |c: &Cycle| {
        let numbers =
            [c.design[0], c.design[1], c.objective_error_pct, c.constraint_error_pct, c.violation_pct, c.objective];
        [c.cycle.into(), yes(c)].into_iter().chain(numbers.map(Cell::from)).collect()
    };
    let title = "Table II. Impact absorber, comfort criterion";
    let csv = include_str!("../../../papers/etman-1998/table2.csv");
    let table = Table::new("table2", title, csv, state.history.iter().map(row).collect())?
        .noting("Cycle 2: the paper's b2 = 0.6640 is a misprint; its own move limit and F = 0.06949 belong to 0.6440.")
        .noting("Cycles 7 and 8: errors and violations below 1e-6 % are rounding.");
    Ok(Run { problem, state, table })
}

fn table4(observe: &mut Observer) -> Result<Run> {
    let problem = slider_crank::path_generation(slider_crank::STAND_IN_START)?;
    let state = Method::default().solve(&problem, |s| observe("table4", s))?;
    let row = |c: &Cycle| {
        let numbers = [c.max_variable_change_pct, c.objective_error_pct, c.objective];
        [c.cycle.into(), yes(c), c.active_limits.into()].into_iter().chain(numbers.map(Cell::from)).collect()
    };
    let title = "Table IV. Slider-crank mechanism, from a stand-in start";
    let csv = include_str!("../../../papers/etman-1998/table4.csv");
    let table = Table::new("table4", title, csv, state.history.iter().map(row).collect())?.noting(
        "The paper does not print its start. Ours is a stand-in with F = 3505 (paper 3486), so digits cannot agree.",
    );
    Ok(Run { problem, state, table })
}
