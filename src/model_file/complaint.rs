//! What is wrong with a model file, and where.

use super::limits;
use std::fmt;
use std::ops::Range;

/// One mistake: what is wrong, which bytes of the file are to blame, what was expected, what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// What is wrong, in a line.
    pub message: String,
    /// The bytes to underline.
    pub span: Range<usize>,
    /// What to write beside them; may be empty.
    pub label: String,
    /// A remedy.
    pub help: Option<String>,
    /// The name that is not known, if that is the mistake.
    pub(super) asked: Option<String>,
}

impl Diagnostic {
    /// A complaint about these bytes.
    pub fn new(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { message: message.into(), span, label: String::new(), help: None, asked: None }
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
        let complaint = Self { asked: Some(asked.to_owned()), ..complaint };
        if shown.len() < asked.len() {
            return complaint.label("not known");
        }
        match error::nearest(asked, known.iter().copied()).first() {
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

/// [`Diagnostic`]s with the file that they are about. Shown as a compiler shows it:
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
pub struct DiagnosticReport {
    /// Name of the file.
    pub file: String,
    /// Its text.
    pub text: String,
    /// What is wrong: the first mistake.
    pub complaint: Diagnostic,
    /// Further mistakes, in the order of the file.
    pub others: Vec<Diagnostic>,
}

impl std::error::Error for DiagnosticReport {}

/// Most characters of a line that are shown.
const SHOWN: usize = 160;

impl DiagnosticReport {
    /// Line and column of the first underlined character, counted from one; columns count characters.
    pub fn position(&self) -> (usize, usize) {
        let (line, start) = self.line(self.boundary(self.complaint.span.start));
        (line, self.text[start..self.boundary(self.complaint.span.start)].chars().count() + 1)
    }

    /// A byte, moved back to the boundary of a character.
    fn boundary(&self, byte: usize) -> usize {
        (0..=byte.min(self.text.len())).rev().find(|&i| self.text.is_char_boundary(i)).unwrap_or(0)
    }

    /// Number of the line in which this byte is, and its first byte.
    fn line(&self, byte: usize) -> (usize, usize) {
        let before = &self.text[..byte];
        (before.matches('\n').count() + 1, before.rfind('\n').map_or(0, |i| i + 1))
    }

    fn show(&self, complaint: &Diagnostic, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [at, end] = [complaint.span.start, complaint.span.end].map(|byte| self.boundary(byte));
        let (line, start) = self.line(at);
        let column = self.text[start..at].chars().count() + 1;
        let shown: String = self.text[start..].lines().next().unwrap_or("").chars().take(SHOWN).collect();
        let room = shown.chars().count() + 1 - (column - 1).min(shown.chars().count());
        let width = self.text[at..end.max(at)].chars().count().clamp(1, room.max(1));
        let margin = " ".repeat(line.to_string().len());
        writeln!(f, "{}", complaint.message)?;
        writeln!(f, "{margin}--> {}:{line}:{column}", self.file)?;
        writeln!(f, "{margin} |")?;
        writeln!(f, "{line} | {}", shown.replace('\t', " "))?;
        let mark = format!("{margin} | {}{} {}", " ".repeat(column - 1), "^".repeat(width), complaint.label);
        write!(f, "{}", mark.trim_end())?;
        match &complaint.help {
            Some(help) => write!(f, "\n{margin} |\n{margin} = help: {help}"),
            None => Ok(()),
        }
    }
}

impl fmt::Display for DiagnosticReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.show(&self.complaint, f)?;
        for other in &self.others {
            write!(f, "\n\nerror: ")?;
            self.show(other, f)?;
        }
        Ok(())
    }
}
