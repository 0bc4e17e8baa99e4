//! The trait of a reproduced paper, and its tables and runs.

use crate::problem::{Problem, RowId};
use crate::report::figure::Figure;
use crate::report::table::{Printed, Table, TableComparison};
use crate::sao::RunState;
use error::{Error, Result};

/// A paper whose tables are regenerated and compared with the printed ones, and whose figures are drawn.
///
/// A paper is a unit struct in its own folder, listed in [`papers`](super::papers). The command `linkwright reproduce NAME` prints
/// its tables and writes tables, figures, animations and a summary of the runs.
pub trait Paper: Send + Sync {
    /// Name on the command line: first author and year, such as `etman-1998`.
    fn name(&self) -> &'static str;
    /// Authors, journal, volume, year, pages and DOI.
    fn reference(&self) -> &'static str;
    /// Methods and problems that are reproduced, in one line.
    fn description(&self) -> &'static str;
    /// The tables that can be regenerated, in order.
    fn tables(&self) -> &'static [PaperTable];
    /// Figures of a regenerated table, by file stem.
    ///
    /// # Errors
    /// If an analysis fails or a figure has no data.
    fn figures(&self, table: &ReproducedTable) -> Result<Vec<(String, Figure)>>;
    /// Animations of a regenerated table, by file name; none unless the paper has a mechanism in motion.
    ///
    /// # Errors
    /// If an analysis fails.
    fn animations(&self, _: &ReproducedTable) -> Result<Vec<(String, Vec<u8>)>> {
        Ok(vec![])
    }
    /// Regenerates the table of that name, and the tables that belong to it.
    ///
    /// # Errors
    /// [`Error::Definition`] with the names of the tables if there is no such table; otherwise if a run fails.
    fn regenerate(&self, table: &str, observe: &mut Observer) -> Result<Vec<ReproducedTable>> {
        if let Some(found) = self.tables().iter().find(|t| t.name == table) {
            return (found.regenerate)(observe);
        }
        let names: Vec<&str> = self.tables().iter().map(|t| t.name).collect();
        let remedy = format!("choose from {}", names.join(", "));
        Err(Error::definition(format!("table `{table}`"), "it is not among the tables of this paper", remedy))
    }
}

/// A table of a paper and the function that regenerates it.
pub struct PaperTable {
    /// Name on the command line: `table1`.
    pub name: &'static str,
    /// Regenerates the table; the first of the results has its name.
    pub regenerate: fn(&mut Observer) -> Result<Vec<ReproducedTable>>,
}

/// Receives every state of a run, with the name of its table.
pub type Observer<'a> = dyn FnMut(&str, &RunState) + 'a;

/// A regenerated table with its printed counterpart.
pub struct ReproducedTable {
    /// File stem: `table1`.
    pub name: &'static str,
    /// Computed table, with the columns of the printed one.
    pub table: Table,
    /// The printed table; `None` if the paper does not have this table in this form.
    pub printed: Option<Printed>,
    /// Number of columns at the left that identify a row.
    pub keys: usize,
    /// Remarks for the reader: substitutes for missing data, misprints, rounding.
    pub notes: Vec<&'static str>,
    /// The runs behind the table; none for a table of data.
    pub runs: Vec<ReproducedRun>,
}

/// A completed run.
pub struct ReproducedRun {
    /// Name among the runs of one table; `None` for the only one.
    pub label: Option<&'static str>,
    /// The problem.
    pub problem: Problem,
    /// The last state, with the whole history.
    pub state: RunState,
}

impl ReproducedRun {
    /// The label; empty for the only run of a table.
    pub fn name(&self) -> &'static str {
        self.label.unwrap_or_default()
    }

    /// Time points of a response that the last cycle retained, and those with an active constraint.
    pub(super) fn marked_points(&self, response: usize) -> [Vec<usize>; 2] {
        let Some(last) = self.state.history.last() else { return Default::default() };
        let of_response =
            |row: &&RowId| self.problem.constraints[row.constraint].quantity.responses().contains(&response);
        let mut retained: Vec<usize> = last.retained.iter().filter(of_response).map(|row| row.point).collect();
        let mut active: Vec<usize> =
            last.active.iter().map(|a| &a.row).filter(of_response).map(|row| row.point).collect();
        retained.dedup();
        active.dedup();
        [retained, active]
    }
}

impl ReproducedTable {
    /// Comparison of the computed table with the printed one; the computed table alone if there is no printed one.
    ///
    /// # Errors
    /// [`Error::Definition`] if the two tables have different columns.
    pub fn comparison(&self) -> Result<TableComparison> {
        match &self.printed {
            Some(printed) => self.table.compare(printed, self.keys),
            None => Ok(TableComparison { text: self.table.text(), compared: 0, differing: 0 }),
        }
    }
}
