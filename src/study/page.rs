//! The page of a study.

use super::{Conclusions, Rows, Study};
use crate::report::number::counted;
use crate::report::page::{Badge, Page, PageSection};
use crate::report::table::Table;

/// Largest number of failed runs in the table of the page.
const FAILURES: usize = 50;

impl Study {
    /// The page: what the study answers, figures, tables, and failures.
    pub fn page(&self, rows: &Rows, conclusion: &Conclusions) -> Page {
        let failed = rows.all().filter(|row| row.has_failed()).count();
        let (word, badge) = match failed {
            0 => ("complete".to_owned(), Badge::Good),
            _ => (format!("{} failed", counted(failed, ["run", "runs"])), Badge::Fair),
        };
        let mut answer = conclusion
            .sentences
            .iter()
            .fold(PageSection::new("answer", "Result"), |section, text| section.paragraph(text));
        for (name, caption, figure) in &conclusion.figures {
            answer = answer.figure(name, caption, figure.clone());
        }
        for (_, table) in &conclusion.tables {
            answer = answer.table(table.clone());
        }
        let page = Page::new(self.title()).status(word, badge).card("runs", rows.len().to_string(), "").with(answer);
        if failed > 0 { page.with(self.failures(rows)) } else { page }
    }

    fn failures(&self, rows: &Rows) -> PageSection {
        let mut table = Table::new("Failed runs", ["phase", "run", "reason"]);
        for row in rows.all().filter(|row| row.has_failed()).take(FAILURES) {
            let cells = [self.phases()[row.phase].name.into(), row.run.into(), row.failure.as_str().into()];
            table.push(cells).expect("the row has three cells");
        }
        PageSection::new("failures", "Failures").table(table)
    }
}
