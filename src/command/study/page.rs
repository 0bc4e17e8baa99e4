//! The page of a study with the files of its folder.

use super::study_folder::{ROWS, SUMMARY, runnable};
use linkwright::report::page::{Page, PageSection};
use linkwright::study::{Conclusions, Rows, Study};

/// The page: what the study answers, tables, failures, and the files.
pub fn page(study: &Study, rows: &Rows, conclusion: &Conclusions) -> Page {
    let tables = study.phases().iter().map(|phase| (format!("{}.csv", phase.name), "rows as a table".to_owned()));
    let files = tables.chain([
        (ROWS.to_owned(), "rows as they are stored".to_owned()),
        (SUMMARY.to_owned(), "the result as JSON".to_owned()),
        ("study.toml".to_owned(), "the study file".to_owned()),
        ("model.toml".to_owned(), "the model".to_owned()),
    ]);
    let listing = PageSection::new("files", "Files").links(files).listing("the study file", runnable(study));
    study.page(rows, conclusion).with(listing).foot(format!(
        "Written by linkwright {}. The page is self-contained: it can be sent and stored as one file.",
        env!("CARGO_PKG_VERSION")
    ))
}
