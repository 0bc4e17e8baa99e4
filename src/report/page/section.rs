//! A part of a page.

use super::embed::embedded;
use crate::Result;
use crate::report::figure::{Figure, markup::escape};
use crate::report::table::Table;

/// What a section is made of.
#[derive(Clone, Debug)]
pub(super) enum Block {
    Paragraph(String),
    Table(Table),
    Figure { name: String, caption: String, figure: Box<Figure> },
    Links(Vec<(String, String)>),
    Listing { summary: String, text: String },
    Html(String),
}

/// A part of a page with a heading.
#[derive(Clone, Debug)]
pub struct Section {
    pub(super) id: String,
    pub(super) title: String,
    pub(super) blocks: Vec<Block>,
}

impl Section {
    /// An empty section; its id is what links to it end with.
    pub fn new(id: impl Into<String>, title: impl Into<String>) -> Self {
        Self { id: id.into(), title: title.into(), blocks: vec![] }
    }

    fn and(mut self, block: Block) -> Self {
        self.blocks.push(block);
        self
    }

    /// The same section with one more paragraph.
    pub fn paragraph(self, text: impl Into<String>) -> Self {
        self.and(Block::Paragraph(text.into()))
    }

    /// The same section with one more table.
    pub fn table(self, table: Table) -> Self {
        self.and(Block::Table(table))
    }

    /// The same section with one more figure; its name is that of its files.
    pub fn figure(self, name: impl Into<String>, caption: impl Into<String>, figure: Figure) -> Self {
        self.and(Block::Figure { name: name.into(), caption: caption.into(), figure: Box::new(figure) })
    }

    /// The same section with links to files beside the page: addresses, and what is there.
    pub fn links(self, links: impl IntoIterator<Item = (String, String)>) -> Self {
        self.and(Block::Links(links.into_iter().collect()))
    }

    /// The same section with a text that can be unfolded.
    pub fn listing(self, summary: impl Into<String>, text: impl Into<String>) -> Self {
        self.and(Block::Listing { summary: summary.into(), text: text.into() })
    }

    /// The same section with HTML as it is.
    pub fn html(self, html: impl Into<String>) -> Self {
        self.and(Block::Html(html.into()))
    }

    /// Whether nothing is in it.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// The section as HTML; `figures` counts those of the page.
    pub(super) fn render(&self, figures: &mut usize) -> Result<String> {
        let (id, title) = (escape(&self.id), escape(&self.title));
        let mut html =
            format!("<section id=\"{id}\" aria-labelledby=\"{id}-title\">\n<h2 id=\"{id}-title\">{title}</h2>\n");
        let is_figure = |block: &Block| matches!(block, Block::Figure { .. });
        // Figures that follow each other share a grid.
        for run in self.blocks.chunk_by(|a, b| is_figure(a) && is_figure(b)) {
            let blocks: Vec<String> = run.iter().map(|block| render(block, figures)).collect::<Result<_>>()?;
            let blocks = blocks.concat();
            html += &if is_figure(&run[0]) { format!("<div class=\"figures\">\n{blocks}</div>\n") } else { blocks };
        }
        Ok(html + "</section>\n")
    }
}

fn render(block: &Block, figures: &mut usize) -> Result<String> {
    Ok(match block {
        Block::Paragraph(text) => format!("<p>{}</p>\n", escape(text)),
        Block::Table(table) => table.html(),
        Block::Figure { caption, figure, .. } => {
            *figures += 1;
            let svg = embedded(&figure.svg()?, *figures);
            format!("<figure>\n{svg}<figcaption>{}</figcaption>\n</figure>\n", escape(caption))
        }
        Block::Links(links) => {
            let link = |(address, text): &(String, String)| {
                format!("<li><a href=\"{0}\"><code>{0}</code></a> {1}</li>\n", escape(address), escape(text))
            };
            format!("<ul class=\"files\">\n{}</ul>\n", links.iter().map(link).collect::<String>())
        }
        Block::Listing { summary, text } => {
            format!(
                "<details><summary>{}</summary>\n<pre tabindex=\"0\">{}</pre>\n</details>\n",
                escape(summary),
                escape(text)
            )
        }
        Block::Html(html) => html.clone(),
    })
}
