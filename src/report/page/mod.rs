//! A self-contained HTML page: headings, tables, figures, animations; no network, light and dark, for screen and paper.
//!
//! ```
//! use linkwright::report::page::{Page, Section, Tone};
//! use linkwright::report::table::Table;
//!
//! let mut table = Table::new("Two cycles", ["cycle", "objective"]);
//! table.push([0usize.into(), 0.85.into()])?;
//! let page = Page::new("absorber <1>")
//!     .status("Converged", Tone::Good)
//!     .with(Section::new("cycles", "Cycles").paragraph("What happened.").table(table));
//! let html = page.html()?;
//! assert!(html.starts_with("<!DOCTYPE html>") && html.contains("absorber &lt;1&gt;"));
//! # Ok::<(), linkwright::Error>(())
//! ```

mod embed;
mod section;

pub use section::Section;

use crate::Result;
use crate::report::figure::{Figure, markup::escape};
use section::Block;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// How good a piece of news is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// As wished.
    Good,
    /// Worth a look.
    Fair,
    /// Not as wished.
    Bad,
}

impl Tone {
    fn class(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Fair => "fair",
            Self::Bad => "bad",
        }
    }
}

/// A number that matters, with what it is and a remark.
#[derive(Clone, Debug)]
struct Card {
    label: String,
    value: String,
    remark: String,
}

/// A page. All text is escaped; only [`Section::html`] takes HTML as it is.
#[derive(Clone, Debug)]
pub struct Page {
    title: String,
    status: Option<(String, Tone)>,
    lead: String,
    cards: Vec<Card>,
    sections: Vec<Section>,
    foot: String,
}

impl Page {
    /// An empty page.
    pub fn new(title: impl Into<String>) -> Self {
        let (status, lead, foot) = (None, String::new(), String::new());
        Self { title: title.into(), status, lead, cards: vec![], sections: vec![], foot }
    }

    /// The same page with a word beside its title.
    pub fn status(self, word: impl Into<String>, tone: Tone) -> Self {
        Self { status: Some((word.into(), tone)), ..self }
    }

    /// The same page with a sentence below its title.
    pub fn lead(self, text: impl Into<String>) -> Self {
        Self { lead: text.into(), ..self }
    }

    /// The same page with one more number in its head: what it is, the number, and a remark that may be empty.
    pub fn card(mut self, label: impl Into<String>, value: impl Into<String>, remark: impl Into<String>) -> Self {
        self.cards.push(Card { label: label.into(), value: value.into(), remark: remark.into() });
        self
    }

    /// The same page with one more section.
    pub fn with(mut self, section: Section) -> Self {
        self.sections.push(section);
        self
    }

    /// The same page with a line at its foot.
    pub fn foot(self, text: impl Into<String>) -> Self {
        Self { foot: text.into(), ..self }
    }

    /// All figures with their names, for files.
    pub fn figures(&self) -> impl Iterator<Item = (&str, &Figure)> {
        self.sections.iter().flat_map(|section| &section.blocks).filter_map(|block| match block {
            Block::Figure { name, figure, .. } => Some((name.as_str(), &**figure)),
            _ => None,
        })
    }

    /// The page. `data-state` of its root is `ready` once all scripts have run, or says which error stopped one.
    ///
    /// **Errors.** As [`Figure::svg`].
    pub fn html(&self) -> Result<String> {
        let mut figures = 0;
        let sections: Vec<String> = self.sections.iter().map(|s| s.render(&mut figures)).collect::<Result<_>>()?;
        let title = escape(&self.title);
        Ok(format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}</title>\n<style>\n{STYLE}</style>\n\
             <script>\n{SCRIPT}</script>\n</head>\n<body>\n<a class=\"skip\" href=\"#main\">Skip to the content</a>\n\
             {}{}<main id=\"main\">\n{}</main>\n<footer><p>{}</p></footer>\n\
             <script>document.documentElement.dataset.state ||= \"ready\";</script>\n</body>\n</html>\n",
            self.head(),
            self.contents(),
            sections.concat(),
            escape(&self.foot)
        ))
    }

    fn head(&self) -> String {
        let pill =
            |(word, tone): &(String, Tone)| format!(" <span class=\"pill {}\">{}</span>", tone.class(), escape(word));
        let card = |card: &Card| {
            let remark = if card.remark.is_empty() {
                String::new()
            } else {
                format!("<dd class=\"remark\">{}</dd>", escape(&card.remark))
            };
            format!("<div><dt>{}</dt><dd>{}</dd>{remark}</div>\n", escape(&card.label), escape(&card.value))
        };
        let cards: String = self.cards.iter().map(card).collect();
        let cards = if cards.is_empty() { cards } else { format!("<dl class=\"cards\">\n{cards}</dl>\n") };
        let lead = if self.lead.is_empty() {
            String::new()
        } else {
            format!("<p class=\"lead\">{}</p>\n", escape(&self.lead))
        };
        let status = self.status.as_ref().map(pill).unwrap_or_default();
        format!("<header>\n<h1>{}{status}</h1>\n{lead}{cards}</header>\n", escape(&self.title))
    }

    fn contents(&self) -> String {
        let link = |s: &Section| format!("<li><a href=\"#{}\">{}</a></li>\n", escape(&s.id), escape(&s.title));
        let links: String = self.sections.iter().map(link).collect();
        format!("<nav aria-label=\"Contents\"><ul>\n{links}</ul></nav>\n")
    }
}
