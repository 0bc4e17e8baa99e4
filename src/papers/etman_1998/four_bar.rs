//! Tables V and VI: the stress-constrained flexible four-bar mechanism.

use super::printed_rows::{PrintedRow, printed_rows};
use crate::approximation::{
    ApproximateProblem, ApproximationOptions, CycleData, DesignHistory, LinearizationPoint, SubproblemBox,
};
use crate::cases::four_bar::{DerivativeMethod, FourBar, StressConstrained, method};
use crate::papers::paper::{Observer, ReproducedRun, ReproducedTable};
use crate::problem::{AnalyzedDesign, Problem};
use crate::report::table::{Cell, Printed, Table};
use crate::sao::{Cycle, Method, Outcome, RelativeLimits};
use error::Result;
use nlp::Program;

const TABLE5: &str = include_str!("../../../papers/etman-1998/table5.csv");
const TABLE6: &str = include_str!("../../../papers/etman-1998/table6.csv");

/// Start that leads to optimum I, in mm; the paper's start leads to optimum II.
pub const START_OF_OPTIMUM_I: [f64; 3] = [50.0, 50.0, 50.0];
/// The design that Table V cites from Sohoni & Haug (1982), in mm.
const SOHONI_HAUG: [f64; 3] = [36.2, 28.1, 12.2];
/// The step in m of the paper's forward differences, inferred from the printed errors and designs.
///
/// No relative step fits: the thick designs need at most 4e-4, the thin ones at least 7e-4.
pub const PAPER_STEP: f64 = 2.3e-5;

/// The problem of the paper's tables, with the paper's forward differences.
pub fn as_printed() -> StressConstrained {
    StressConstrained { derivatives: DerivativeMethod::ForwardBy(PAPER_STEP), ..StressConstrained::as_published() }
}

fn solve(name: &str, setup: &StressConstrained, observe: &mut Observer) -> Result<ReproducedRun> {
    let problem = setup.problem()?;
    let state = method().solve(&problem, |s| observe(name, s))?;
    Ok(ReproducedRun { label: None, problem, state })
}

/// Table V (the start, the optima and a design of the literature), and the runs that end at the optima I, II and III.
pub fn table5(observe: &mut Observer) -> Result<(ReproducedTable, [ReproducedRun; 3])> {
    let published = StressConstrained::as_published();
    let mechanism = published.mechanism;
    let runs = [
        solve("table5", &published.clone().from_mm(START_OF_OPTIMUM_I), observe)?,
        solve("table5", &published, observe)?,
        solve("table5", &published.clone().stiffened(10.0), observe)?,
    ];
    let columns = ["design", "youngs_modulus_pa", "d1_mm", "d2_mm", "d3_mm", "mass_kg"];
    let mut table = Table::new("Table V. Flexible four-bar mechanism, optima", columns)
        .headed(["design", "E [Pa]", "d1 [mm]", "d2 [mm]", "d3 [mm]", "F [kg]"])?;
    let mut push = |name: &str, young: f64, d: &[f64]| {
        let numbers = [young, d[0] * 1e3, d[1] * 1e3, d[2] * 1e3, mechanism.mass(d)];
        table.push(std::iter::once(name.into()).chain(numbers.map(Cell::from)))
    };
    push("initial", mechanism.young, &published.start)?;
    for (name, run, factor) in [("I", &runs[0], 1.0), ("II", &runs[1], 1.0), ("III", &runs[2], 10.0)] {
        push(name, mechanism.young * factor, &run.state.design)?;
    }
    push("sohoni_haug_1982", mechanism.young, &SOHONI_HAUG.map(|d| d * 1e-3))?;
    let notes = vec![
        "I is found from 50 mm, II and III from the paper's 356.8 mm; both I and II are local optima of one model.",
        "The printed 546.0 kg and 2.89 kg are not those of the printed diameters (546.1 and 2.896 kg) to the last digit.",
    ];
    let printed = Printed::from_csv("table5.csv", TABLE5)?;
    Ok((ReproducedTable { name: "table5", table, printed: Some(printed), keys: 1, notes, runs: vec![] }, runs))
}

/// Table VI: the run from the paper's start with exact derivatives. It ends at optimum II, the paper's run at optimum I.
pub fn table6(observe: &mut Observer) -> Result<ReproducedTable> {
    let run = solve("table6", &StressConstrained::as_published(), observe)?;
    let title = "Table VI. Flexible four-bar mechanism, from 356.8 mm with exact derivatives";
    let notes = vec![
        "The path is sensitive: 0.1 mm in cycle 3 changes all cycles after cycle 5. table6_rows compares row by row.",
    ];
    history("table6", title, 0, run, notes)
}

/// Table VI from its cycle 4 on, with forward differences from the printed design of cycle 4.
pub fn table6_from_cycle_4(observe: &mut Observer) -> Result<ReproducedTable> {
    let rows = printed_rows(TABLE6, &RelativeLimits::default())?;
    let problem = as_printed().problem()?;
    let method = method();
    let mut state = method.start_at(&problem, rows[4].design.clone())?;
    state.factors.clone_from(&rows[5].factors);
    let state = method.resume(&problem, state, |s| observe("table6_from_cycle_4", s))?;
    let title = "Table VI. Flexible four-bar mechanism, continued from the printed cycle 4 with forward differences";
    let notes = vec![
        "Row 4 is the printed design, with the digits that its move limits determine; its E_g belongs to the step before.",
    ];
    history("table6_from_cycle_4", title, rows[4].cycle, ReproducedRun { label: None, problem, state }, notes)
}

fn history(
    name: &'static str,
    title: &str,
    first: usize,
    run: ReproducedRun,
    notes: Vec<&'static str>,
) -> Result<ReproducedTable> {
    let columns = [
        "cycle",
        "accepted",
        "active_move_limits",
        "b1_mm",
        "b2_mm",
        "b3_mm",
        "max_approximation_error_pct",
        "max_violation_pct",
        "mass_kg",
    ];
    let mut table = Table::new(title, columns)
        .headed(["cycle", "ok", "mvlm", "b1 [mm]", "b2 [mm]", "b3 [mm]", "Eg [%]", "V [%]", "F [kg]"])?;
    for c in &run.state.history {
        table.push(row(first, c))?;
    }
    let printed = Printed::from_csv("table6.csv", TABLE6)?;
    Ok(ReproducedTable { name, table, printed: Some(printed), keys: 2, notes, runs: vec![run] })
}

fn row(first: usize, c: &Cycle) -> Vec<Cell> {
    let words = [(first + c.cycle).into(), word(c.accepted), c.active_limits.into()];
    let design = c.design.iter().map(|d| d * 1e3);
    let numbers = design.chain([c.constraint_error_pct, c.violation_pct, c.objective]);
    words.into_iter().chain(numbers.map(Cell::from)).collect()
}

fn word(accepted: bool) -> Cell {
    if accepted { "y" } else { "n" }.into()
}

/// Computed values at one printed row of Table VI.
#[derive(Clone, Debug, PartialEq)]
pub struct RowCheck {
    /// The printed row.
    pub printed: PrintedRow,
    /// V at the printed design, in percent.
    pub violation_pct: f64,
    /// E_g in percent at the printed design, of the approximations made at the last accepted row before it.
    pub error_pct: f64,
    /// Diameters in m proposed by one cycle from that row, with the paper's move-limit factors.
    pub proposed: Vec<f64>,
}

/// Checks every printed row of Table VI separately, so that differences do not accumulate along the path.
///
/// `setup` gives the mechanism and the method for derivatives.
///
/// # Errors
/// If an analysis or a subproblem fails.
pub fn check_rows(setup: &StressConstrained) -> Result<Vec<RowCheck>> {
    let rows = printed_rows(TABLE6, &RelativeLimits::default())?;
    let (problem, method) = (setup.problem()?, method());
    let mut start = CycleStart::at(&problem, &method, &rows[0].design)?;
    let mut base = 0;
    let mut checks = vec![];
    for (k, printed) in rows.into_iter().enumerate() {
        if k == 0 {
            let (violation_pct, proposed) = (start.analyzed.evaluation.max_violation_pct(), printed.design.clone());
            checks.push(RowCheck { printed, violation_pct, error_pct: 0.0, proposed });
            continue;
        }
        if printed.from != base {
            base = printed.from;
            let from: &RowCheck = &checks[base];
            start = CycleStart::at(&problem, &method, &from.printed.design)?;
        }
        checks.push(start.check(&problem, &method, printed)?);
    }
    Ok(checks)
}

/// Analysed design at the start of a cycle, with its derivatives.
struct CycleStart {
    analyzed: AnalyzedDesign,
    data: CycleData,
}

impl CycleStart {
    fn at(problem: &Problem, method: &Method, design: &[f64]) -> Result<Self> {
        let analyzed = problem.analyze_design(design)?;
        let retained = method.screening.retain(problem, &analyzed.evaluation);
        let data = CycleData::first_order(problem, &analyzed, retained)?;
        Ok(Self { analyzed, data })
    }

    fn check(&self, problem: &Problem, method: &Method, printed: PrintedRow) -> Result<RowCheck> {
        let Self { analyzed, data } = self;
        let point = LinearizationPoint::first_order(analyzed, data);
        let design = &analyzed.design;
        let region = method.move_limits.region(problem, design, &printed.factors);
        let subproblem_box =
            SubproblemBox::new(problem, DesignHistory::default().after([&design[..]]), (region.lower, region.upper));
        let around = (subproblem_box, ApproximationOptions::default());
        let approximate = ApproximateProblem::new(problem, &*method.approximation, point, around)?;
        let proposed = method.solver.solve(&approximate, design)?.x;
        let there = problem.evaluate(&printed.design, &problem.analyze(&printed.design)?)?;
        let predicted = approximate.values(&printed.design)?;
        let outcome = Outcome::new(problem, &method.screening, &data.retained, &predicted, &there);
        Ok(RowCheck {
            printed,
            violation_pct: outcome.violation_pct,
            error_pct: outcome.constraint_error_pct,
            proposed,
        })
    }
}

/// The checked rows as a table: errors and violations next to the printed ones, and the proposed designs.
pub fn table6_rows(checks: &[RowCheck]) -> Result<Table> {
    let columns = [
        "cycle",
        "accepted",
        "violation_pct_paper",
        "violation_pct",
        "approximation_error_pct_paper",
        "approximation_error_pct",
        "next_b1_mm",
        "next_b2_mm",
        "next_b3_mm",
    ];
    let title = "Table VI, row by row: each printed design analysed, and proposed from the last accepted row";
    let mut table = Table::new(title, columns).headed([
        "cycle",
        "ok",
        "V paper [%]",
        "V [%]",
        "Eg paper [%]",
        "Eg [%]",
        "next b1 [mm]",
        "next b2 [mm]",
        "next b3 [mm]",
    ])?;
    for c in checks {
        let numbers = [c.printed.violation_pct, c.violation_pct, c.printed.error_pct, c.error_pct];
        let next = c.proposed.iter().map(|d| d * 1e3);
        let cells = numbers.into_iter().chain(next).map(Cell::from);
        table.push([c.printed.cycle.into(), word(c.printed.accepted)].into_iter().chain(cells))?;
    }
    Ok(table)
}

/// Root mean square of V − printed V in percentage points, over all rows but the last and the optima II and III.
pub fn violation_rms(checks: &[RowCheck]) -> Result<f64> {
    let optimum = |young: f64, d: [f64; 3]| -> Result<f64> {
        let setup = StressConstrained { mechanism: FourBar { young, ..FourBar::as_published() }, ..as_printed() };
        let (problem, d) = (setup.problem()?, d.map(|d| d * 1e-3));
        Ok(problem.evaluate(&d, &problem.analyze(&d)?)?.max_violation_pct())
    };
    // The last two rows print the same design.
    let mut misses: Vec<f64> =
        checks[..checks.len() - 1].iter().map(|c| c.violation_pct - c.printed.violation_pct).collect();
    misses.push(optimum(6.895e10, [37.3, 23.6, 19.8])?);
    misses.push(optimum(6.895e11, [35.5, 23.0, 18.0])?);
    Ok((misses.iter().map(|m| m * m).sum::<f64>() / misses.len() as f64).sqrt())
}

/// Table VI row by row, with the paper's forward differences.
pub fn row_by_row() -> Result<ReproducedTable> {
    let checks = check_rows(&as_printed())?;
    let notes = vec![
        "The diameters have the digits that their move limits determine; each row is proposed from the last accepted printed row.",
        "The printed stresses need the rotary inertia m l²/12 counted twice (the as-published preset), see the README.",
    ];
    let table = table6_rows(&checks)?;
    Ok(ReproducedTable { name: "table6_rows", table, printed: None, keys: 2, notes, runs: vec![] })
}
