//! Svanberg, *The method of moving asymptotes – a new method for structural optimization*, International Journal for
//! Numerical Methods in Engineering 24 (1987) 359–373: the iterates of its examples, regenerated.

mod figures;
mod method;
mod tables;

use super::paper::{Paper, PaperTable, ReproducedTable};
use crate::report::figure::Figure;
use error::Result;

pub use method::{HalfToDouble, iterate_with, with_approximated_objective};

/// The paper.
pub struct Svanberg1987;

impl Paper for Svanberg1987 {
    fn name(&self) -> &'static str {
        "svanberg-1987"
    }

    fn reference(&self) -> &'static str {
        "Svanberg, International Journal for Numerical Methods in Engineering 24 (1987) 359-373, \
         doi:10.1002/nme.1620240207"
    }

    fn description(&self) -> &'static str {
        "moving asymptotes, CONLIN and linear approximations on a cantilever, a two-bar and an eight-bar truss"
    }

    fn tables(&self) -> &'static [PaperTable] {
        &TABLES
    }

    fn figures(&self, table: &ReproducedTable) -> Result<Vec<(String, Figure)>> {
        figures::figures(table)
    }
}

static TABLES: [PaperTable; 4] = [
    PaperTable { name: "cantilever", regenerate: |observe| Ok(vec![tables::cantilever(observe)?]) },
    PaperTable { name: "two_bar_truss", regenerate: |observe| Ok(vec![tables::two_bar_truss(observe)?]) },
    PaperTable { name: "eight_bar_truss", regenerate: |observe| Ok(vec![tables::eight_bar_truss(observe)?]) },
    PaperTable { name: "optima", regenerate: |observe| Ok(vec![tables::optima(observe)?]) },
];
