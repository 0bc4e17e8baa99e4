//! A table as HTML.

use super::{Cell, Table, readable};
use crate::report::figure::markup::escape;

impl Table {
    /// A `<table>` with its title as caption, which stands above it in a line of its own so that it does not scroll; a heading for every column and, in the first column, for every row; numbers
    /// stand on the right. All text is escaped.
    pub fn html(&self) -> String {
        let numeric: Vec<bool> = (0..self.columns.len()).map(|c| self.is_numeric(c)).collect();
        let heading =
            |(name, numeric): (&String, &bool)| format!("<th scope=\"col\"{}>{}</th>", class(*numeric), escape(name));
        let headings: String = self.headings().iter().zip(&numeric).map(heading).collect();
        let rows: String = self.rows.iter().map(|row| html_row(row, &numeric)).collect();
        format!(
            "<div class=\"table\"><p aria-hidden=\"true\">{0}</p><div tabindex=\"0\" role=\"group\" aria-label=\"{0}\">\
             <table>\n<caption>{0}</caption>\n\
             <thead><tr>{headings}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table></div></div>\n",
            escape(&self.title)
        )
    }

    /// Whether a column holds no words.
    fn is_numeric(&self, column: usize) -> bool {
        self.rows.iter().all(|row| !matches!(row[column], Cell::Text(_)))
    }
}

fn html_row(row: &[Cell], numeric: &[bool]) -> String {
    let cell = |(k, (cell, numeric)): (usize, (&Cell, &bool))| {
        let (tag, text) =
            (if k == 0 { "th scope=\"row\"" } else { "td" }, escape(&readable(cell).replace('-', "\u{2212}")));
        let text = if matches!(cell, Cell::Text(_)) { escape(&readable(cell)) } else { text };
        format!("<{tag}{}>{text}</{}>", class(*numeric), &tag[..2])
    };
    let cells: String = row.iter().zip(numeric).enumerate().map(cell).collect();
    format!("<tr>{cells}</tr>\n")
}

fn class(numeric: bool) -> &'static str {
    if numeric { " class=\"number\"" } else { "" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped_and_numbers_stand_on_the_right() {
        let mut table = Table::new("<b>", ["name", "value"]);
        table.push(["<script>".into(), (-0.5).into()]).unwrap();
        let html = table.html();
        assert!(
            html.contains("<th scope=\"row\">&lt;script&gt;</th><td class=\"number\">\u{2212}0.50000</td>"),
            "{html}"
        );
        assert!(
            html.contains("<caption>&lt;b&gt;</caption>")
                && html.contains("<th scope=\"col\" class=\"number\">value</th>")
        );
    }
}
