//! The page of an analysis: the mechanism in motion, the histories of all outputs, and tables.

use super::report::mechanism;
use linkwright::model_file::Model;
use linkwright::report::figure::{QuantityLabel, literal};
use linkwright::report::page::{Page, PageSection};
use linkwright::report::plots::{ResponseHistory, TimeHistory, time_history};
use linkwright::report::table::Table;

/// Largest number of histories.
const MOST: usize = 24;

/// The page of a model at a design, as HTML. `values` are those of the outputs, in the order of the model.
pub fn analysis_page(
    model: &Model,
    design: &[f64],
    values: &[Vec<f64>],
    lead: &str,
    tables: Vec<Table>,
) -> anyhow::Result<String> {
    let (moving, _) = mechanism(model, &[("mechanism", design)], &[])?;
    let mut results = PageSection::new("results", "Results");
    for table in tables {
        results = results.table(table);
    }
    let sections = [moving, Some(results), Some(histories(model, values)?)];
    let page = sections
        .into_iter()
        .flatten()
        .filter(|section| !section.is_empty())
        .fold(Page::new(model.title()).lead(lead), Page::with);
    let foot = format!("Written by linkwright {}. The page is self-contained.", env!("CARGO_PKG_VERSION"));
    Ok(page.foot(foot).html()?)
}

/// The history of each output that changes with time.
fn histories(model: &Model, values: &[Vec<f64>]) -> anyhow::Result<PageSection> {
    let over = model.grid().map_or("time", |grid| grid.name.as_str());
    let mut section = PageSection::new("histories", format!("Histories over {over}"));
    let Some(grid) = model.grid().filter(|grid| grid.len() > 1) else { return Ok(section) };
    let all = model.output_names().zip(values).filter(|((.., time), _)| time.is_some());
    let all: Vec<_> = all.map(|((name, unit, _), values)| (name, unit, values)).collect();
    for (k, (name, unit, values)) in all.iter().take(MOST).enumerate() {
        let figure = time_history(&TimeHistory {
            time: QuantityLabel::literal(&grid.name, &grid.unit),
            response: QuantityLabel::literal(name, unit),
            times: &grid.shown_points(),
            histories: &[ResponseHistory { name: &literal(name), values }],
            bounds: &[],
            kept: &[],
            active: &[],
        })?;
        section = section.figure(format!("history-{}", k + 1), format!("{name}."), figure.sized(100.0, 70.0));
    }
    if all.len() > MOST {
        section = section.paragraph(format!("{} more histories are in responses.csv.", all.len() - MOST));
    }
    Ok(section)
}
