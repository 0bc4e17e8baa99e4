//! `[time]`: the time points at which responses are wanted.

use super::key::{Accepts, Key, Table, default, optional};
use super::section::{Read, Section};
use crate::model_file::expression::Names;
use crate::model_file::limits;
use crate::problem::TimeGrid;

pub const KEYS: &[Key] = &[
    default("name", Accepts::Text, "time", "what it is, for axes"),
    default("unit", Accepts::Text, "s", "its unit, for axes"),
    default("from", Accepts::Number, "0", "first time point"),
    optional("to", Accepts::Number, "last time point"),
    optional("points", Accepts::Count, "number of equally spaced time points, both ends included"),
    optional("at", Accepts::Numbers, "the time points one by one, in place of the three above"),
];

/// Declarations for documentation and schema.
pub const TABLES: &[Table] =
    &[Table { name: "time", kind: None, about: "the time points of all histories", keys: KEYS }];

/// Reads the time points, if there are any.
pub fn read(file: &Section<'_>, names: &Names) -> Read<Option<TimeGrid>> {
    let Some(section) = file.inner("time", &[KEYS])? else { return Ok(None) };
    let points = match section.numbers("at", names)? {
        Some(points) => {
            if let Some(key) = ["from", "to", "points"].into_iter().find(|key| section.has(key)) {
                return Err(section.complain(key, format!("`{key}` and `at` exclude each other")));
            }
            points
        }
        None => uniform(&section, names)?,
    };
    if let Some(p) = (1..points.len()).find(|&p| points[p] <= points[p - 1]) {
        let message = format!("time point {} follows {}, which is no increase", points[p], points[p - 1]);
        return Err(section.complain("at", message).help("give strictly increasing time points"));
    }
    let grid = TimeGrid::new(&section.text("name")?, &section.text("unit")?, points);
    grid.map(Some).map_err(|e| section.complain("at", e.to_string()))
}

fn uniform(section: &Section<'_>, names: &Names) -> Read<Vec<f64>> {
    let from = section.number("from", names)?.unwrap_or(0.0);
    let (Some(to), Some(count)) = (section.number("to", names)?, section.count("points", limits::POINTS)?) else {
        let message = "[time] needs `to` and `points`, or `at`";
        return Err(section.complain("to", message).help("for instance to = 12.0 and points = 101"));
    };
    if !(from < to) {
        return Err(section.complain("to", format!("the last time point {to} must be after the first one, {from}")));
    }
    if count < 2 {
        return Err(section.complain("points", "at least two time points are needed"));
    }
    let grid = TimeGrid::uniform(from, to, count).map_err(|e| section.complain("points", e.to_string()))?;
    Ok(grid.points)
}
