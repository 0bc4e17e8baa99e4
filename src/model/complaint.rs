//! What is wrong with a model file, and where.

use super::limits;
use std::fmt;
use std::ops::Range;

/// One mistake: what is wrong, which bytes of the file are to blame, what was expected, what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Complaint {
    /// What is wrong, in a line.
    pub message: String,
    /// The bytes to underline.
    pub span: Range<usize>,
    /// What to write beside them; may be empty.
    pub label: String,
    /// A remedy.
    pub help: Option<String>,
}

impl Complaint {
    /// A complaint about these bytes.
    pub fn new(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { message: message.into(), span, label: String::new(), help: None }
    }

    /// The same with words beside the underlined text.
    #[must_use]
    pub fn label(self, label: impl Into<String>) -> Self {
        Self { label: label.into(), ..self }
    }

    /// The same with a remedy.
    #[must_use]
    pub fn help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }

    /// A complaint about a name that is not among the known ones; the help names the nearest of them.
    pub fn unknown<'k>(span: Range<usize>, kind: &str, asked: &str, known: impl IntoIterator<Item = &'k str>) -> Self {
        // Names of a megabyte are not worth comparing.
        let known: Vec<&str> = known.into_iter().filter(|name| name.len() <= limits::NAME).collect();
        let shown: String = asked.chars().take(limits::NAME).collect();
        let complaint = Self::new(span, format!("there is no {kind} `{shown}`"));
        if shown.len() < asked.len() {
            return complaint.label("not known");
        }
        match crate::error::nearest(asked, known.iter().copied()).first() {
            None => complaint,
            Some((best, steps)) if *steps <= 1 + asked.chars().count() / 3 => {
                complaint.label("not known").help(format!("did you mean `{best}`?"))
            }
            Some(_) => {
                let list: Vec<String> = known.iter().take(12).map(|k| format!("`{k}`")).collect();
                let more = if known.len() > 12 { ", …" } else { "" };
                complaint.label("not known").help(format!("known: {}{more}", list.join(", ")))
            }
        }
    }
}

/// A [`Complaint`] with the file that it is about. Shown as a compiler shows it:
///
/// ```text
/// there is no body `crnk`
///  --> model.toml:9:5
///   |
/// 9 | b = "crnk"
///   |     ^^^^^^ not known
///   |
///   = help: did you mean `crank`?
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Name of the file.
    pub file: String,
    /// Its text.
    pub text: String,
    /// What is wrong.
    pub complaint: Complaint,
}

impl std::error::Error for Fault {}

/// Most characters of a line that are shown.
const SHOWN: usize = 160;

impl Fault {
    /// Line and column of the first underlined character, counted from one; columns count characters.
    pub fn position(&self) -> (usize, usize) {
        let (line, start) = self.line();
        (line, self.text[start..self.at()].chars().count() + 1)
    }

    /// The first underlined byte, moved to the boundary of a character.
    fn at(&self) -> usize {
        (0..=self.complaint.span.start.min(self.text.len())).rev().find(|&i| self.text.is_char_boundary(i)).unwrap_or(0)
    }

    /// Number of the line that is shown, and its first byte.
    fn line(&self) -> (usize, usize) {
        let before = &self.text[..self.at()];
        (before.matches('\n').count() + 1, before.rfind('\n').map_or(0, |i| i + 1))
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (line, column) = self.position();
        let start = self.line().1;
        let shown: String = self.text[start..].lines().next().unwrap_or("").chars().take(SHOWN).collect();
        let room = shown.chars().count() + 1 - (column - 1).min(shown.chars().count());
        let end =
            (self.at()..=self.complaint.span.end.min(self.text.len())).rev().find(|&i| self.text.is_char_boundary(i));
        let width = self.text[self.at()..end.unwrap_or(self.at())].chars().count().clamp(1, room.max(1));
        let margin = " ".repeat(line.to_string().len());
        writeln!(f, "{}", self.complaint.message)?;
        writeln!(f, "{margin}--> {}:{line}:{column}", self.file)?;
        writeln!(f, "{margin} |")?;
        writeln!(f, "{line} | {}", shown.replace('\t', " "))?;
        let mark = format!("{margin} | {}{} {}", " ".repeat(column - 1), "^".repeat(width), self.complaint.label);
        write!(f, "{}", mark.trim_end())?;
        match &self.complaint.help {
            Some(help) => write!(f, "\n{margin} |\n{margin} = help: {help}"),
            None => Ok(()),
        }
    }
}
