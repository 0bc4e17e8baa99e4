//! Etman, van Campen & Schoofs, *Design optimization of multibody systems by sequential approximation*,
//! Multibody System Dynamics 2 (1998) 393–415: its tables and figures, regenerated.

mod figures;
pub mod four_bar;
mod four_bar_figures;
mod printed_rows;
mod tables;

use super::paper::{Paper, PaperTable, ReproducedTable};
use crate::cases::impact_absorber;
use crate::report::figure::Figure;
use error::Result;

pub use figures::slider_crank_at;
pub use four_bar_figures::{four_bar_animation, four_bar_figures};
pub use printed_rows::{PrintedRow, printed_rows};
pub use tables::table1;

/// The paper.
pub struct Etman1998;

impl Paper for Etman1998 {
    fn name(&self) -> &'static str {
        "etman-1998"
    }

    fn reference(&self) -> &'static str {
        "Etman, van Campen & Schoofs, Multibody System Dynamics 2 (1998) 393-415, doi:10.1023/A:1009780119839"
    }

    fn description(&self) -> &'static str {
        "sequential approximation of an impact absorber, a slider-crank and a flexible four-bar mechanism"
    }

    fn tables(&self) -> &'static [PaperTable] {
        &TABLES
    }

    fn figures(&self, table: &ReproducedTable) -> Result<Vec<(String, Figure)>> {
        figures::figures(table)
    }

    fn animations(&self, table: &ReproducedTable) -> Result<Vec<(String, Vec<u8>)>> {
        figures::animations(table)
    }
}

static TABLES: [PaperTable; 6] = [
    PaperTable {
        name: "table1",
        regenerate: |observe| Ok(vec![tables::table1(impact_absorber::peak_acceleration()?, observe)?]),
    },
    PaperTable { name: "table2", regenerate: |observe| Ok(vec![tables::table2(observe)?]) },
    PaperTable { name: "table3", regenerate: |_| Ok(vec![tables::table3()?]) },
    PaperTable { name: "table4", regenerate: |observe| Ok(vec![tables::table4(observe)?]) },
    PaperTable {
        name: "table5",
        regenerate: |observe| {
            let (table, [first, ..]) = four_bar::table5(observe)?;
            Ok(vec![ReproducedTable { runs: vec![first], ..table }])
        },
    },
    // The run from the paper's start, its continuation from the printed cycle 4, and the printed rows one by one.
    PaperTable {
        name: "table6",
        regenerate: |observe| {
            let rows = four_bar::row_by_row()?;
            Ok(vec![four_bar::table6(observe)?, four_bar::table6_from_cycle_4(observe)?, rows])
        },
    },
];
