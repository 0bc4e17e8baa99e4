//! Tables as HTML.

use super::{Cell, Table, text_of};
use maud::{Markup, html};

/// Numbers of columns from which a printed table is in landscape format, and from which its letters are small.
const WIDE: usize = 12;
const WIDEST: usize = 22;

impl Table {
    /// The table as HTML, all text escaped.
    ///
    /// The title is the caption, repeated above the table in a line that does not scroll. Every column has a heading, and the
    /// first cell is the heading of its row. Columns without text are aligned on the right.
    pub fn html(&self) -> String {
        self.markup().into_string()
    }

    pub(crate) fn markup(&self) -> Markup {
        let classes: Vec<Option<&str>> =
            (0..self.columns.len()).map(|c| self.is_numeric(c).then_some("number")).collect();
        let width = match self.columns.len() {
            WIDEST.. => "table wide widest",
            WIDE.. => "table wide",
            _ => "table",
        };
        html! {
            div class=(width) {
                p aria-hidden="true" { (self.title) }
                div tabindex="0" role="group" aria-label=(self.title) {
                    table {
                        caption { (self.title) }
                        thead {
                            tr { @for (name, class) in self.headings().iter().zip(&classes) { th scope="col" class=[class] { (name) } } }
                        }
                        tbody { @for row in &self.rows { (html_row(row, &classes)) } }
                    }
                }
            }
        }
    }

    /// Returns whether a column contains no text.
    fn is_numeric(&self, column: usize) -> bool {
        self.rows.iter().all(|row| !matches!(row[column], Cell::Text(_)))
    }
}

fn html_row(row: &[Cell], classes: &[Option<&str>]) -> Markup {
    let text = |cell: &Cell| match cell {
        Cell::Text(text) => text.clone(),
        number => text_of(number).replace('-', "\u{2212}"),
    };
    html! {
        tr {
            @for (k, (cell, class)) in row.iter().zip(classes).enumerate() {
                @if k == 0 {
                    th scope="row" class=[class] { (text(cell)) }
                } @else {
                    td class=[class] { (text(cell)) }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped_and_numbers_are_aligned_on_the_right() {
        let mut table = Table::new("<b>", ["name", "value"]);
        table.push(["<script>".into(), (-0.5).into()]).unwrap();
        let html = table.html();
        for part in [
            "<th scope=\"row\">&lt;script&gt;</th><td class=\"number\">\u{2212}0.50000</td>",
            "<caption>&lt;b&gt;</caption>",
            "<th scope=\"col\" class=\"number\">value</th>",
        ] {
            assert!(html.contains(part), "{html}");
        }
    }
}
