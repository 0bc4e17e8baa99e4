//! The problems of the suites for other programs: JSON lines from standard input are answered on standard output.
//!
//! | request | answer |
//! |---|---|
//! | `{"list": true}` | `{"problems": [{"name", "suite"}, …]}` |
//! | `{"problem": NAME, "transformation": TEXT}` | `{"start", "lower", "upper", "equality"}`; infinite bounds are `null` |
//! | `{"x": […]}` | `{"f", "df", "c", "dc"}` of the last problem: rows c ≤ 0, or c = 0 where `equality` is true |
//!
//! A request that fails is answered with `{"error": …}`. `benches/peers/optimizers.py` uses this program, so that each problem is
//! written once and all optimizers have the same derivatives.

use linkwright_optimization::Result;
use linkwright_optimization::cases::suite::{self, Transformation};
use linkwright_optimization::cases::{CatalogueEntry, find};
use linkwright_optimization::nlp::Program;
use linkwright_optimization::problem::{DirectCoupling, Problem};
use serde_json::{Value, json};
use std::io::{BufRead, Write};

fn main() -> std::io::Result<()> {
    let mut current: Option<Problem> = None;
    for line in std::io::stdin().lock().lines() {
        let answer = answer(&mut current, &line?).unwrap_or_else(|why| json!({ "error": why }));
        let mut out = std::io::stdout().lock();
        writeln!(out, "{answer}")?;
        out.flush()?;
    }
    Ok(())
}

fn answer(current: &mut Option<Problem>, line: &str) -> std::result::Result<Value, String> {
    let request: Value = serde_json::from_str(line).map_err(|e| e.to_string())?;
    if request["list"] == true {
        let entry = |e: &'static CatalogueEntry| json!({ "name": e.name, "suite": format!("{:?}", e.suite), "expensive": e.expensive });
        return Ok(json!({ "problems": suite::problems().map(entry).collect::<Vec<_>>() }));
    }
    if let Some(name) = request["problem"].as_str() {
        let problem = Transformation::parse(request["transformation"].as_str().unwrap_or("standard"))
            .and_then(|transformation| transformation.build(find(name)?))
            .map_err(|e| e.to_string())?;
        let answer = statement(&problem);
        *current = Some(problem);
        return Ok(answer);
    }
    let x: Vec<f64> = serde_json::from_value(request["x"].clone()).map_err(|e| e.to_string())?;
    let problem = current.as_ref().ok_or("name a problem first")?;
    evaluation(problem, &x).map_err(|e| e.to_string())
}

fn statement(problem: &Problem) -> Value {
    let coupling = DirectCoupling::new(problem);
    let equality: Vec<bool> = (0..coupling.rows()).map(|i| coupling.is_equality(i)).collect();
    json!({
        "start": problem.start(),
        "lower": coupling.lower(),
        "upper": coupling.upper(),
        "equality": equality,
    })
}

fn evaluation(problem: &Problem, x: &[f64]) -> Result<Value> {
    let at = DirectCoupling::new(problem).gradients(x)?;
    let rows: Vec<Vec<f64>> = at.rows.row_iter().map(|row| row.iter().copied().collect()).collect();
    Ok(json!({ "f": at.values.objective, "df": at.objective, "c": at.values.rows, "dc": rows }))
}
