//! `--where`: an expression of SQL over the columns of the list of runs.
//!
//! The expression is evaluated by SQLite in a table in memory, which has nothing but the list. It may read this table and call
//! functions of numbers and texts; everything else is rejected before it is evaluated.

use crate::command::run_directory::Summary;
use crate::command::run_entry::RunEntry;
use anyhow::{anyhow, bail};
use rusqlite::config::DbConfig;
use rusqlite::hooks::{AuthAction, AuthContext, Authorization};
use rusqlite::types::Value;
use rusqlite::{Connection, params_from_iter};
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Columns before those of design variables.
const COLUMNS: [&str; 15] = [
    "folder",
    "begun",
    "kind",
    "model",
    "method",
    "status",
    "fingerprint",
    "cycles",
    "analyses",
    "sensitivity_analyses",
    "objective",
    "violation_pct",
    "runs",
    "done",
    "failed",
];

/// Functions that an expression may call.
const FUNCTIONS: [&str; 14] = [
    "abs", "coalesce", "glob", "ifnull", "iif", "instr", "length", "like", "lower", "max", "min", "round", "substr",
    "upper",
];

/// Largest number of design variables with a column of their own.
const WIDEST: usize = 1900;

/// The runs for which an expression is true.
pub fn filtered(runs: Vec<RunEntry>, expression: &str) -> anyhow::Result<Vec<RunEntry>> {
    let names = design_variables(&runs);
    let rejected = |why: &dyn std::fmt::Display| {
        let design: Vec<&str> = names.iter().map(String::as_str).collect();
        anyhow!(
            "--where `{expression}`: {why}. Columns are {}{}{}; compare them with =, <, >, like, and, or; texts are in single quotes",
            COLUMNS.join(", "),
            if design.is_empty() { "" } else { ", and design variables: " },
            design.join(", ")
        )
    };
    let wanted = selected(&runs, &names, expression).map_err(|why| match why.downcast_ref() {
        Some(rusqlite::Error::MultipleStatement) => rejected(&"it is more than one expression"),
        Some(rusqlite::Error::SqlInputError { msg, .. }) => rejected(msg),
        Some(rusqlite::Error::SqliteFailure(_, Some(text))) => rejected(text),
        _ => rejected(&why),
    })?;
    Ok(runs.into_iter().enumerate().filter(|(k, _)| wanted.contains(k)).map(|(_, run)| run).collect())
}

/// Names of all design variables that are not names of other columns; SQL ignores upper and lower case in names.
fn design_variables(runs: &[RunEntry]) -> Vec<String> {
    let mut taken: BTreeSet<String> = COLUMNS.iter().map(|name| (*name).to_owned()).collect();
    let all = runs.iter().filter_map(|run| run.result.as_ref()).flat_map(|result| &result.design);
    let mut names: Vec<String> =
        all.map(|variable| variable.name.clone()).filter(|name| taken.insert(name.to_lowercase())).collect();
    names.truncate(WIDEST);
    names
}

fn selected(runs: &[RunEntry], names: &[String], expression: &str) -> anyhow::Result<BTreeSet<usize>> {
    if expression.contains('\0') {
        bail!("it has a character that is not text");
    }
    let mut connection = Connection::open_in_memory()?;
    let quoted = |name: &str| format!("\"{}\"", name.replace('"', "\"\""));
    let columns: Vec<String> = COLUMNS.iter().copied().chain(names.iter().map(String::as_str)).map(quoted).collect();
    connection.execute_batch(&format!("CREATE TABLE list (number INTEGER PRIMARY KEY, {})", columns.join(", ")))?;
    let change = connection.transaction()?;
    {
        let places = vec!["?"; columns.len() + 1].join(", ");
        let mut insert = change.prepare(&format!("INSERT INTO list VALUES ({places})"))?;
        for (k, run) in runs.iter().enumerate() {
            insert.execute(params_from_iter(std::iter::once(Value::from(k as i64)).chain(values(run, names))))?;
        }
    }
    change.commit()?;
    // As in the standard, double quotes enclose the name of a column, not a text.
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_DQS_DML, false)?;
    let selects = AtomicUsize::new(0);
    connection.authorizer(Some(move |context: AuthContext<'_>| {
        let is_allowed = match context.action {
            // The query around the expression: the expression itself must not contain a query.
            AuthAction::Select => selects.fetch_add(1, Ordering::Relaxed) == 0,
            AuthAction::Read { table_name, .. } => table_name == "list",
            AuthAction::Function { function_name } => {
                FUNCTIONS.iter().any(|known| function_name.eq_ignore_ascii_case(known))
            }
            _ => false,
        };
        if is_allowed { Authorization::Allow } else { Authorization::Deny }
    }))?;
    // The newline terminates a comment at the end of the expression.
    let mut select = connection.prepare(&format!("SELECT number FROM list WHERE ({expression}\n)"))?;
    if select.parameter_count() > 0 {
        bail!("it has a parameter without a value");
    }
    let found = select.query_map([], |row| row.get::<_, i64>(0))?;
    Ok(found.map(|k| k.map(|k| k as usize)).collect::<rusqlite::Result<_>>()?)
}

/// The values of a run in the order of the columns.
fn values(run: &RunEntry, names: &[String]) -> Vec<Value> {
    let texts = [&run.folder, &run.begun, &run.kind, &run.model, &run.method, &run.status, &run.fingerprint];
    let result = run.result.as_ref();
    let whole = |n: Option<usize>| n.map_or(Value::Null, |n| Value::from(n as i64));
    let number = |x: Option<f64>| x.map_or(Value::Null, Value::from);
    let study = run.study.as_ref();
    let mut all: Vec<Value> = texts.into_iter().map(|text| Value::from(text.clone())).collect();
    all.extend([
        whole(result.map(|r| r.cycles)),
        whole(result.map(|r| r.analyses)),
        whole(result.map(|r| r.sensitivity_analyses)),
        number(result.map(|r| r.objective.value)),
        number(result.and_then(Summary::violation_pct)),
        whole(study.map(|s| s.runs)),
        whole(study.map(|s| s.done)),
        whole(study.map(|s| s.failed)),
    ]);
    let design = result.map_or(&[][..], |r| &r.design);
    all.extend(names.iter().map(|name| number(design.iter().find(|b| b.name == *name).map(|b| b.value))));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn runs() -> Vec<RunEntry> {
        let run = |folder: &str, objective: f64| {
            let result = serde_json::json!({
                "event": "end", "version": 1, "program": "0", "title": "arm", "fingerprint": "0", "status": "Converged", "reason": "",
                "cycles": 3, "analyses": 5, "sensitivity_analyses": 4, "subproblem_iterations": 1, "violation_pct": -1.0,
                "objective": {"name": "mass", "unit": "kg", "value": objective}, "constraints": [], "edits": [],
                "design": [{"name": "k", "unit": "", "value": 2.0 * objective}, {"name": "status", "unit": "", "value": 1.0}],
            });
            let result = Some(serde_json::from_value(result).unwrap());
            RunEntry {
                folder: folder.into(),
                status: "Converged".into(),
                kind: "run".into(),
                result,
                ..RunEntry::default()
            }
        };
        let study = RunEntry { folder: "c".into(), kind: "study".into(), ..RunEntry::default() };
        vec![run("a", 1.5), run("b", 2.5), study]
    }

    fn found(expression: &str) -> String {
        filtered(runs(), expression).unwrap().iter().map(|run| run.folder.clone()).collect()
    }

    #[test]
    fn expressions_choose_runs() {
        for (expression, expected) in [
            ("objective < 2.5", "a"),
            ("objective <= 2.5 and k > 3", "b"),
            ("kind = 'study' or abs(objective - 1.5) < 1e-9", "ac"),
            ("status = 'Converged' -- the text, not the variable of that name", "ab"),
            ("objective is null", "c"),
            ("folder in ('a', 'c')", "ac"),
            ("1", "abc"),
        ] {
            assert_eq!(found(expression), expected, "{expression}");
        }
    }

    #[test]
    fn what_is_no_expression_over_the_columns_is_rejected() {
        let wrong = [
            ("objektive < 2", "no such column: objektive"),
            ("status = \"Converged\" and objective <", "syntax error"),
            ("status = \"good\"", "no such column"),
            ("", "syntax error"),
            ("1); DROP TABLE list; --", "authorized"),
            ("1; DELETE FROM list", "syntax error"),
            ("1) UNION SELECT 1 --", "syntax error"),
            ("exists (SELECT 1 FROM sqlite_master)", "authorized"),
            ("(SELECT count(*) FROM list) > 0", "authorized"),
            ("load_extension('x')", "authorized"),
            ("zeroblob(1000000000) = 1", "authorized"),
            ("k = ?", "parameter"),
            ("ATTACH 'x' AS y", "syntax error"),
            ("1\0", "not text"),
        ]
        .into_iter()
        .filter_map(|(expression, why)| {
            let error = filtered(runs(), expression).map(|runs| runs.len()).expect_err(expression).to_string();
            (!error.contains(why) || !error.contains("Columns are folder")).then_some((expression, error))
        });
        assert_eq!(wrong.collect::<Vec<_>>(), []);
    }
}
