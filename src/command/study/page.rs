//! The page of a study.

use super::folder::{ROWS, SUMMARY, runnable};
use linkwright::report::page::{Badge, Page, PageSection};
use linkwright::report::table::Table;
use linkwright::study::{Conclusion, Rows, Study};

/// Most failed runs in the table of the page.
const FAILURES: usize = 50;

/// The page: what the study answers, tables, failures, and the files.
pub fn page(study: &Study, rows: &Rows, conclusion: &Conclusion) -> Page {
    let failed = rows.all().filter(|row| row.has_failed()).count();
    let (word, badge) =
        if failed == 0 { ("complete".to_owned(), Badge::Good) } else { (format!("{failed} runs failed"), Badge::Fair) };
    let mut answer =
        conclusion.sentences.iter().fold(PageSection::new("answer", "Result"), |section, text| section.paragraph(text));
    for (name, caption, figure) in &conclusion.figures {
        answer = answer.figure(name, caption, figure.clone());
    }
    for (_, table) in &conclusion.tables {
        answer = answer.table(table.clone());
    }
    let mut page = Page::new(study.title()).status(word, badge).card("runs", rows.len().to_string(), "").with(answer);
    if failed > 0 {
        page = page.with(failures(study, rows));
    }
    let tables = study.phases().iter().map(|phase| (format!("{}.csv", phase.name), "rows as a table".to_owned()));
    let files = tables.chain([
        (ROWS.to_owned(), "rows as they are stored".to_owned()),
        (SUMMARY.to_owned(), "the result as JSON".to_owned()),
        ("study.toml".to_owned(), "the study file".to_owned()),
        ("model.toml".to_owned(), "the model".to_owned()),
    ]);
    let listing = PageSection::new("files", "Files").links(files).listing("the study file", runnable(study));
    page.with(listing).foot(format!(
        "Written by linkwright {}. The page is self-contained: it can be sent and stored as one file.",
        env!("CARGO_PKG_VERSION")
    ))
}

fn failures(study: &Study, rows: &Rows) -> PageSection {
    let mut table = Table::new("Failed runs", ["phase", "run", "reason"]);
    for row in rows.all().filter(|row| row.has_failed()).take(FAILURES) {
        let cells = [study.phases()[row.phase].name.into(), row.run.into(), row.failure.as_str().into()];
        table.push(cells).expect("the row has three cells");
    }
    PageSection::new("failures", "Failures").table(table)
}
