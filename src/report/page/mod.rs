//! Self-contained HTML pages with headings, tables, figures and animations, in light and dark colours, for screen and paper.
//!
//! ```
//! use linkwright::report::page::{Badge, Page, PageSection};
//! use linkwright::report::table::Table;
//!
//! let mut table = Table::new("Two cycles", ["cycle", "objective"]);
//! table.push([0usize.into(), 0.85.into()])?;
//! let page = Page::new("absorber <1>")
//!     .status("Converged", Badge::Good)
//!     .with(PageSection::new("cycles", "Cycles").paragraph("All cycles of the run.").table(table));
//! let html = page.html()?;
//! assert!(html.starts_with("<!DOCTYPE html>") && html.contains("absorber &lt;1&gt;"));
//! # Ok::<(), linkwright::Error>(())
//! ```

use super::figure::Figure;
use super::table::Table;
use crate::Result;
use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Colour of the badge after the title.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Badge {
    /// A success.
    Good,
    /// A warning.
    Fair,
    /// A failure.
    Bad,
}

impl Badge {
    fn class(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Fair => "fair",
            Self::Bad => "bad",
        }
    }
}

/// A number in the head of a page, with a label and a remark.
#[derive(Clone, Debug)]
struct Card {
    label: String,
    value: String,
    remark: String,
}

/// A page. All text is escaped, except [`PageSection::html`].
#[derive(Clone, Debug)]
pub struct Page {
    title: String,
    status: Option<(String, Badge)>,
    lead: String,
    cards: Vec<Card>,
    sections: Vec<PageSection>,
    foot: String,
    choices: Vec<PageChoice>,
}

/// A cycle that a reader can choose: its number, its numbers in words, and its curves by the names of figures.
#[derive(Clone, Debug)]
pub struct PageChoice {
    /// Number of the cycle.
    pub number: usize,
    /// Objective, violation and design.
    pub text: String,
    /// Lists of points by names of figures.
    pub curves: serde_json::Value,
}

impl Page {
    /// An empty page.
    pub fn new(title: impl Into<String>) -> Self {
        let (status, lead, foot) = (None, String::new(), String::new());
        Self { title: title.into(), status, lead, cards: vec![], sections: vec![], foot, choices: vec![] }
    }

    /// Adds a badge with the status after the title.
    pub fn status(self, word: impl Into<String>, badge: Badge) -> Self {
        Self { status: Some((word.into(), badge)), ..self }
    }

    /// Sets the sentence below the title.
    pub fn lead(self, text: impl Into<String>) -> Self {
        Self { lead: text.into(), ..self }
    }

    /// Appends a number to the head, with a label and a remark that may be empty.
    pub fn card(mut self, label: impl Into<String>, value: impl Into<String>, remark: impl Into<String>) -> Self {
        self.cards.push(Card { label: label.into(), value: value.into(), remark: remark.into() });
        self
    }

    /// Appends a section.
    pub fn with(mut self, section: PageSection) -> Self {
        self.sections.push(section);
        self
    }

    /// Sets the cycles that a reader can choose.
    pub fn choices(self, choices: Vec<PageChoice>) -> Self {
        Self { choices, ..self }
    }

    /// Sets the line at the foot of the page.
    pub fn foot(self, text: impl Into<String>) -> Self {
        Self { foot: text.into(), ..self }
    }

    /// All figures with their file names.
    pub fn figures(&self) -> impl Iterator<Item = (&str, &Figure)> {
        self.sections.iter().flat_map(|section| &section.blocks).filter_map(|block| match block {
            Content::Figure { name, figure, .. } => Some((name.as_str(), &**figure)),
            _ => None,
        })
    }

    /// The page as HTML. After all scripts have run, `data-state` of the root element is `ready` or holds the first error.
    ///
    /// # Errors
    /// Those of [`Figure::svg`].
    pub fn html(&self) -> Result<String> {
        let mut figures = 0;
        let sections: Vec<Markup> = self.sections.iter().map(|s| s.render(&mut figures)).collect::<Result<_>>()?;
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    title { (self.title) }
                    style { (PreEscaped(STYLE)) }
                    script { (PreEscaped(SCRIPT)) }
                }
                body {
                    a class="skip" href="#main" { "Skip to the content" }
                    (self.head())
                    div class="bars" {
                        nav aria-label="Contents" {
                            ul {
                                @for section in &self.sections {
                                    li { a href={ "#" (section.id) } { (section.title) } }
                                }
                            }
                        }
                        (self.chooser())
                    }
                    main id="main" {
                        @for section in &sections { (section) }
                    }
                    footer { p { (self.foot) } }
                    script { (PreEscaped("document.documentElement.dataset.state ||= \"ready\";")) }
                }
            }
        };
        Ok(page.into_string())
    }

    /// The choice of a cycle; without scripts it is not shown.
    fn chooser(&self) -> Markup {
        if self.choices.is_empty() {
            return html! {};
        }
        let data: Vec<_> = self.choices.iter().map(|c| serde_json::json!([c.number, c.text, c.curves])).collect();
        let data = serde_json::Value::from(data).to_string().replace('<', "\\u003c");
        html! {
            aside id="chooser" aria-label="Design of a cycle" hidden {
                button type="button" aria-label="Earlier cycle" { "\u{2039}" }
                label { "design of " select {} }
                button type="button" aria-label="Later cycle" { "\u{203a}" }
                output {}
                script type="application/json" { (PreEscaped(data)) }
            }
        }
    }

    fn head(&self) -> Markup {
        html! {
            header {
                h1 {
                    (self.title)
                    @if let Some((word, badge)) = &self.status {
                        " " span class={ "pill " (badge.class()) } { (word) }
                    }
                }
                @if !self.lead.is_empty() { p class="lead" { (self.lead) } }
                @if !self.cards.is_empty() {
                    dl class="cards" {
                        @for card in &self.cards {
                            div {
                                dt { (card.label) }
                                dd { (card.value) }
                                @if !card.remark.is_empty() { dd class="remark" { (card.remark) } }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A part of a section.
#[derive(Clone, Debug)]
enum Content {
    Paragraph(String),
    Table(Table),
    Figure { name: String, caption: String, figure: Box<Figure> },
    Links(Vec<(String, String)>),
    Listing { summary: String, text: String },
    Html(String),
}

/// A part of a page with a heading.
#[derive(Clone, Debug)]
pub struct PageSection {
    id: String,
    title: String,
    blocks: Vec<Content>,
}

impl PageSection {
    /// An empty section; `id` is the fragment of links to it.
    pub fn new(id: impl Into<String>, title: impl Into<String>) -> Self {
        Self { id: id.into(), title: title.into(), blocks: vec![] }
    }

    fn and(mut self, block: Content) -> Self {
        self.blocks.push(block);
        self
    }

    /// Appends a paragraph.
    pub fn paragraph(self, text: impl Into<String>) -> Self {
        self.and(Content::Paragraph(text.into()))
    }

    /// Appends a table.
    pub fn table(self, table: Table) -> Self {
        self.and(Content::Table(table))
    }

    /// Appends a figure; `name` is that of its files.
    pub fn figure(self, name: impl Into<String>, caption: impl Into<String>, figure: Figure) -> Self {
        self.and(Content::Figure { name: name.into(), caption: caption.into(), figure: Box::new(figure) })
    }

    /// Appends links to files in the folder of the page: addresses and descriptions.
    pub fn links(self, links: impl IntoIterator<Item = (String, String)>) -> Self {
        self.and(Content::Links(links.into_iter().collect()))
    }

    /// Appends a text that is collapsed at first.
    pub fn listing(self, summary: impl Into<String>, text: impl Into<String>) -> Self {
        self.and(Content::Listing { summary: summary.into(), text: text.into() })
    }

    /// Appends HTML without escaping it.
    pub fn html(self, html: impl Into<String>) -> Self {
        self.and(Content::Html(html.into()))
    }

    /// Returns `true` if the section has no content.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// The section as HTML; `figures` counts those of the page.
    fn render(&self, figures: &mut usize) -> Result<Markup> {
        let is_figure = |block: &Content| matches!(block, Content::Figure { .. });
        let mut groups: Vec<(bool, Vec<Markup>)> = vec![];
        // Consecutive figures share a grid.
        for group in self.blocks.chunk_by(|a, b| is_figure(a) && is_figure(b)) {
            let blocks = group.iter().map(|block| block.render(figures)).collect::<Result<_>>()?;
            groups.push((is_figure(&group[0]), blocks));
        }
        Ok(html! {
            section id=(self.id) aria-labelledby={ (self.id) "-title" } {
                h2 id={ (self.id) "-title" } { (self.title) }
                @for (are_figures, blocks) in &groups {
                    @if *are_figures {
                        div class="figures" { @for block in blocks { (block) } }
                    } @else {
                        @for block in blocks { (block) }
                    }
                }
            }
        })
    }
}

impl Content {
    fn render(&self, figures: &mut usize) -> Result<Markup> {
        Ok(match self {
            Self::Paragraph(text) => html! { p { (text) } },
            Self::Table(table) => table.markup(),
            Self::Figure { name, caption, figure } => {
                *figures += 1;
                let svg = figure.inline_svg(&format!("f{figures}"))?;
                // A `<` inside the data could end the script element or begin another one.
                let series = figure.series().map(|series| series.replace('<', "\\u003c"));
                html! {
                    figure class=[series.is_some().then_some("plotted")] data-name=(name) {
                        (PreEscaped(svg))
                        figcaption { (caption) }
                        @if let Some(series) = &series { script type="application/json" { (PreEscaped(series)) } }
                    }
                }
            }
            Self::Links(links) => html! {
                ul class="files" {
                    @for (address, text) in links {
                        li { a href=(address) { code { (address) } } " " (text) }
                    }
                }
            },
            Self::Listing { summary, text } => html! {
                details { summary { (summary) } pre tabindex="0" { (text) } }
            },
            Self::Html(html) => PreEscaped(html.clone()),
        })
    }
}
