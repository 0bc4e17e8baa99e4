//! The printed rows of Table VI, with more digits where the move limits determine them.

use crate::sao::{MoveLimits, Outcome, RelativeLimits, StepVerdict, Trial};
use error::{Error, Result};

/// A printed row of Table VI, with its move-limit factors.
#[derive(Clone, Debug, PartialEq)]
pub struct PrintedRow {
    /// Number of the cycle.
    pub cycle: usize,
    /// `true` if the design was accepted.
    pub accepted: bool,
    /// Diameters in m: in full where a move limit determines them, otherwise as printed.
    pub design: Vec<f64>,
    /// Move-limit factors of its trial step.
    pub factors: Vec<f64>,
    /// Index of the accepted row from which its cycle starts.
    pub from: usize,
    /// E_g in percent, as printed.
    pub error_pct: f64,
    /// V in percent, as printed.
    pub violation_pct: f64,
}

/// Distance in m below which a printed diameter is at its move limit: slightly more than half a unit of the last digit.
const NEAR: f64 = 6e-5;

/// Rows of Table VI from its CSV text, with the factors that `limits` computes from the printed errors.
///
/// The paper prints no factors, and diameters to 0.1 mm only. The first factors are 40 %, and all later ones follow from the
/// printed errors. A diameter that was at a move limit in every cycle is therefore known to all digits.
///
/// # Errors
/// [`Error::File`] or [`Error::Length`] if the text is not the table.
pub fn printed_rows(csv: &str, limits: &RelativeLimits) -> Result<Vec<PrintedRow>> {
    let mut rows: Vec<PrintedRow> = vec![];
    let mut exact = vec![true; 3];
    let mut factors = limits.start(3);
    let mut last_step: Option<Vec<f64>> = None;
    for line in csv.lines().skip(1).filter(|line| !line.trim().is_empty()) {
        let (mut row, printed) = parse(line)?;
        let Some(from) = rows.iter().rposition(|r| r.accepted) else {
            rows.push(PrintedRow { design: printed, factors: factors.clone(), ..row });
            continue;
        };
        let base = rows[from].clone();
        let limit = |k: usize| base.design[k] * (1.0 + factors[k].copysign(printed[k] - base.design[k]));
        let at_limit: Vec<bool> = (0..3).map(|k| (limit(k) - printed[k]).abs() < NEAR).collect();
        let known: Vec<bool> = (0..3).map(|k| at_limit[k] && exact[k]).collect();
        let design: Vec<f64> = (0..3).map(|k| if known[k] { limit(k) } else { printed[k] }).collect();
        (row.from, row.factors, row.design) = (from, factors.clone(), design);
        let verdict = if row.accepted { StepVerdict::Accept } else { StepVerdict::Reject };
        limits.update(&mut factors, &trial(&row, &base, last_step.as_deref(), &at_limit), verdict);
        if row.accepted {
            last_step = Some(row.design.iter().zip(&base.design).map(|(to, from)| to - from).collect());
            exact = known;
        }
        rows.push(row);
    }
    Ok(rows)
}

/// A printed step as input of the move-limit rule, which does not use the objective.
fn trial<'a>(
    row: &'a PrintedRow,
    base: &'a PrintedRow,
    last_step: Option<&'a [f64]>,
    at_limit: &'a [bool],
) -> Trial<'a> {
    let outcome = Outcome {
        objective: 0.0,
        objective_error_pct: 0.0,
        constraint_error_pct: row.error_pct,
        violation_pct: row.violation_pct,
        // A constraint was approximated if a stress was above half its limit.
        is_approximate: base.violation_pct > -50.0,
        shortfall: vec![],
    };
    let (from, to) = (base.design.as_slice(), row.design.as_slice());
    Trial {
        lagrangian: None,
        from,
        to,
        last_step,
        at_limit,
        is_bounded: vec![true; base.design.len()],
        objective_before: 0.0,
        violation_before: base.violation_pct.max(0.0) / 100.0,
        approximate_violation: 0.0,
        multipliers: 0.0,
        distance: 0.0,
        approximate_objective: 0.0,
        outcome: Some(outcome),
    }
}

fn parse(line: &str) -> Result<(PrintedRow, Vec<f64>)> {
    let cells: Vec<&str> = line.split(',').map(str::trim).collect();
    Error::check_length("cells of a row of table6.csv", 9, cells.len())?;
    let number = |c: usize| {
        cells[c].parse::<f64>().map_err(|_| Error::File {
            file: "table6.csv".to_owned(),
            why: format!("`{}` is not a number", cells[c]),
            remedy: "restore the printed table".to_owned(),
        })
    };
    let printed = (3..6).map(|c| Ok(number(c)? * 1e-3)).collect::<Result<Vec<_>>>()?;
    let row = PrintedRow {
        cycle: number(0)? as usize,
        accepted: cells[1] == "y",
        design: vec![],
        factors: vec![],
        from: 0,
        error_pct: number(6)?,
        violation_pct: number(7)?,
    };
    Ok((row, printed))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chain_of_move_limits_comes_out_of_the_printed_errors() {
        let csv = include_str!("../../../papers/etman-1998/table6.csv");
        let rows = printed_rows(csv, &RelativeLimits::default()).unwrap();
        let expected = [
            (3, [84.7, 77.0688, 77.0688], [0.4, 0.4, 0.4]),
            (4, [52.2, 35.96544, 35.96544], [0.4, 0.53333, 0.53333]),
            (5, [42.2, 28.8, 23.0], [0.3, 0.4, 0.4]),
            (7, [48.3, 32.3689, 32.3689], [0.075, 0.1, 0.1]),
            (9, [43.1, 26.9471, 26.9471], [0.05625, 0.1, 0.1]),
            (14, [39.1, 25.2, 21.1851], [0.0375, 0.05, 0.06667]),
            (15, [38.5, 25.4, 19.7728], [0.0375, 0.05, 0.06667]),
        ];
        for (k, design, factors) in expected {
            for i in 0..3 {
                assert!((rows[k].design[i] * 1e3 - design[i]).abs() < 1e-3, "{k}: {:?}", rows[k].design);
                assert!((rows[k].factors[i] - factors[i]).abs() < 1e-5, "{k}: {:?}", rows[k].factors);
            }
        }
        assert!(printed_rows("header\n0,y,3,a,b,c,0,0,0\n", &RelativeLimits::default()).is_err());
    }
}
