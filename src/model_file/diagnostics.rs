//! Diagnostics of a model file: their content, collection and display.

use super::{limits, text_parts};
use crate::Error;
use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet, normalize_untrusted_str};
use std::cell::{Cell, RefCell};
use std::collections::{HashMap, HashSet};
use std::fmt;
use std::ops::Range;

/// Severity of a [`Diagnostic`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Severity {
    /// The file is rejected.
    #[default]
    Error,
    /// The file is read.
    Note,
}

/// A message about a part of a model file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostic {
    /// Error or note.
    pub severity: Severity,
    /// The error or note in one line.
    pub message: String,
    /// The bytes to underline.
    pub span: Range<usize>,
    /// Text after the underlined bytes; may be empty.
    pub label: String,
    /// The remedy.
    pub help: Option<String>,
    /// The unknown name, if the diagnostic is about one.
    pub(super) unknown_name: Option<Box<str>>,
    /// The name or key of which the underlined bytes are a second use, if the diagnostic is about that.
    pub(super) second_use: Option<Box<SecondUse>>,
}

/// A second use of a name or a key.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct SecondUse {
    /// Name of the part; empty for a key.
    pub name: String,
    /// The bytes of the first use, if they are known.
    pub first: Option<Range<usize>>,
}

impl Diagnostic {
    /// An error about these bytes.
    pub fn new(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { message: message.into(), span, ..Self::default() }
    }

    /// An error about a name that is used again.
    pub fn used_again(span: Range<usize>, name: &str) -> Self {
        let diagnostic = Self::new(span, format!("the name `{name}` is taken twice")).label("second use");
        Self { second_use: Some(Box::new(SecondUse { name: name.to_owned(), first: None })), ..diagnostic }
    }

    /// Sets the text after the underlined bytes.
    #[must_use]
    pub fn label(self, label: impl Into<String>) -> Self {
        Self { label: label.into(), ..self }
    }

    /// Sets the remedy.
    #[must_use]
    pub fn help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }

    /// An error about an unknown name; the help suggests the nearest known one.
    pub fn unknown<'k>(span: Range<usize>, kind: &str, asked: &str, known: impl IntoIterator<Item = &'k str>) -> Self {
        // The comparison of very long names would take too long.
        let known: Vec<&str> = known.into_iter().filter(|name| name.len() <= limits::NAME).collect();
        let shown: String = asked.chars().take(limits::NAME).collect();
        let diagnostic = Self::new(span, format!("there is no {kind} `{shown}`"));
        let diagnostic = Self { unknown_name: Some(asked.into()), ..diagnostic };
        if shown.len() < asked.len() {
            return diagnostic.label("not known");
        }
        if let Some(best) = synonym(asked, &known) {
            return diagnostic.label("not known").help(format!("did you mean `{best}`?"));
        }
        match error::nearest(asked, known.iter().copied()).first() {
            None => diagnostic,
            Some((best, steps)) if *steps <= 1 + asked.chars().count() / 3 => {
                diagnostic.label("not known").help(format!("did you mean `{best}`?"))
            }
            Some(_) => {
                let known = of_same_owner(asked, known);
                let list: Vec<String> = known.iter().take(12).map(|k| format!("`{k}`")).collect();
                let more = if known.len() > 12 { ", …" } else { "" };
                diagnostic.label("not known").help(format!("known: {}{more}", list.join(", ")))
            }
        }
    }
}

/// A text with visible control characters, as `\u001b`; also those that change the direction of writing.
///
/// Ends of lines stay. The form is that of JSON, so that JSON stays valid.
pub fn visible(text: &str) -> String {
    let is_sent = |c: char| {
        (c.is_control() && c != '\n')
            || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if is_sent(c) { shown += &format!("\\u{:04x}", u32::from(c)) } else { shown.push(c) }
    }
    shown
}

/// The known names of the part that `asked` names before its last dot, if there are any; otherwise all of them.
fn of_same_owner<'k>(asked: &str, known: Vec<&'k str>) -> Vec<&'k str> {
    let owner = |name: &str| name.rsplit_once('.').map(|(owner, _)| owner.to_owned());
    let same = |name: &&&str| owner(name).is_some() && owner(name) == owner(asked);
    let own: Vec<&str> = known.iter().filter(same).copied().collect();
    if own.is_empty() { known } else { own }
}

/// Common words for measures, with their names in model files.
const SYNONYMS: &[(&[&str], &[&str])] = &[
    (&["angle", "rotation", "orientation", "phi", "psi", "rot"], &["theta"]),
    (&["angular_velocity", "angular_speed", "rate", "theta_dot", "dtheta", "thetad", "w"], &["omega"]),
    (&["angular_acceleration", "omega_dot", "domega", "theta_ddot"], &["alpha"]),
    (&["torque", "couple"], &["moment", "driving_force"]),
];

/// Common words for keys, with their names in model files.
const KEYS: &[(&[&str], &[&str])] = &[
    (
        &["length", "rest", "rest_length", "free_length", "natural_length", "unloaded_length", "unloaded"],
        &["unloaded", "length"],
    ),
    (&["b", "at", "on", "target", "dof"], &["coordinate", "at", "b"]),
    (&["upper", "max", "maximum", "upper_limit", "upper_bound", "below", "less_than", "le"], &["at_most", "upper"]),
    (&["lower", "min", "minimum", "lower_limit", "lower_bound", "above", "greater_than", "ge"], &["at_least", "lower"]),
    (&["equal", "equal_to", "equality", "eq"], &["equals"]),
    (&["k", "spring", "spring_constant", "rate"], &["stiffness"]),
    (&["c", "damper", "damping_constant"], &["damping"]),
    (&["torque", "effort", "value"], &["generalized_force", "force"]),
    (&["ks", "kreisselmeier_steinhauser", "logsumexp", "softmax"], &["smooth_max"]),
    (&["p_norm", "pnorm", "lp_norm"], &["norm"]),
    (&["crossing_time", "time_of_crossing", "first_crossing"], &["crossing"]),
    (&["argmax", "time_at_max"], &["time_of_max"]),
    (&["argmin", "time_at_min"], &["time_of_min"]),
    (&["value", "value_at", "interpolate"], &["at"]),
    (&["average", "avg"], &["mean"]),
    (&["rotation", "theta", "orientation", "phi"], &["angle"]),
    (&["mu", "friction"], &["coulomb_force", "coefficient"]),
    (&["link", "bar", "rod", "part", "mass", "slider", "rigid_body"], &["body"]),
    (&["marker", "frame", "hardpoint"], &["point"]),
    (&["hinge", "pin", "revolute", "prismatic", "weld", "connection"], &["joint"]),
    (&["motor", "drive", "motion", "actuator"], &["driver"]),
    (&["spring", "damper", "load", "torque", "contact", "friction", "gear", "rope", "bushing", "stop"], &["force"]),
    (&["variable", "variables", "design_variable", "design_variables", "parameter", "parameters"], &["design"]),
    (&["response", "responses", "measure", "sensor", "result"], &["output"]),
    (&["minimize", "goal", "cost", "target"], &["objective"]),
    (&["limit", "limits", "subject_to"], &["constraint"]),
    (&["solver", "simulation", "integrator", "dynamics"], &["analysis"]),
    (&["optimizer", "optimization", "algorithm"], &["method"]),
];

/// The known name of the same part whose measure is commonly called by the last word of `asked`, or the key that is commonly called `asked`.
fn synonym<'k>(asked: &str, known: &[&'k str]) -> Option<&'k str> {
    let Some((owner, word)) = asked.rsplit_once('.') else {
        let mut names = KEYS.iter().filter(|(usual, _)| usual.contains(&asked)).flat_map(|(_, names)| names.iter());
        return names.find_map(|name| known.iter().find(|known| *known == name)).copied();
    };
    let names = SYNONYMS.iter().find(|(usual, _)| usual.contains(&word))?.1;
    let is_it = |known: &&&str, name: &str| known.rsplit_once('.') == Some((owner, name));
    names.iter().find_map(|name| known.iter().find(|known| is_it(known, name)).copied())
}

/// [`Diagnostic`]s with the file that they are about.
///
/// Shown in the layout of the Rust compiler. The first one has no `error:` before it, because commands print this word:
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
    /// The diagnostics, at least one, in the order of the file.
    pub diagnostics: Vec<Diagnostic>,
}

impl std::error::Error for DiagnosticReport {}

impl fmt::Display for DiagnosticReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, diagnostic) in self.diagnostics.iter().enumerate() {
            let level = match diagnostic.severity {
                Severity::Error if k == 0 => Level::ERROR.no_name(),
                Severity::Error => Level::ERROR,
                Severity::Note => Level::NOTE,
            };
            f.write_str(if k == 0 { "" } else { "\n\n" })?;
            f.write_str(&self.rendered(diagnostic, level))?;
        }
        Ok(())
    }
}

impl DiagnosticReport {
    fn rendered(&self, diagnostic: &Diagnostic, level: Level<'_>) -> String {
        let label = Some(diagnostic.label.as_str()).filter(|label| !label.is_empty());
        let span = self.first_line(&diagnostic.span);
        let (name, part) = text_parts::part_at(&self.text, span.start);
        let own = |byte: usize| byte.clamp(part.start, part.end) - part.start;
        let underlined = AnnotationKind::Primary.span(own(span.start)..own(span.end)).label(label);
        let path = name.map_or(self.file.clone(), |name| in_folder_of(&self.file, name));
        let mut snippet = Snippet::source(&self.text[part.clone()]).path(path).annotation(underlined);
        let first =
            diagnostic.second_use.as_ref().and_then(|second| second.first.as_ref()).map(|first| self.first_line(first));
        if let Some(first) = first.filter(|first| part.start <= first.start && first.end <= part.end && *first != span)
        {
            let first = AnnotationKind::Context.span(own(first.start)..own(first.end)).label("first use");
            snippet = snippet.annotation(first);
        }
        let help = diagnostic.help.as_deref().map(|help| {
            let lines: Vec<String> = help.lines().map(normalize_untrusted_str).collect();
            Level::HELP.message(lines.join("\n"))
        });
        Renderer::plain().render(&[level.primary_title(&diagnostic.message).element(snippet).elements(help)])
    }

    /// The attached file in which a diagnostic is, and its line from 1; `None` for the own text of the model.
    pub fn attached_place(&self, diagnostic: &Diagnostic) -> Option<(&str, usize)> {
        let start = self.first_line(&diagnostic.span).start;
        let (name, part) = text_parts::part_at(&self.text, start);
        Some((name?, self.text[part.start..start].matches('\n').count() + 1))
    }

    /// The part of a span in its first line, on boundaries of characters.
    fn first_line(&self, span: &Range<usize>) -> Range<usize> {
        let is_boundary = |byte: &usize| self.text.is_char_boundary(*byte);
        let boundary = |byte: usize| (0..=byte.min(self.text.len())).rev().find(is_boundary).unwrap_or(0);
        let (start, end) = (boundary(span.start), boundary(span.end));
        let line = self.text[start..].find('\n').map_or(self.text.len(), |length| start + length);
        start..end.clamp(start, line)
    }
}

/// The path of a file in the folder of another one.
fn in_folder_of(file: &str, name: &str) -> String {
    file.rfind('/').map_or(name.to_owned(), |end| format!("{}/{name}", &file[..end]))
}

/// Largest number of errors that are shown at once.
const MOST_SHOWN: usize = 10;

/// Diagnostics of a file that is being read, and the locations of its parts.
#[derive(Debug, Default)]
pub(crate) struct DiagnosticLog {
    errors: RefCell<Vec<Diagnostic>>,
    /// Notes about a file that is read.
    remarks: RefCell<Vec<Diagnostic>>,
    /// Names whose definition is wrong.
    poisoned: RefCell<HashSet<String>>,
    all_poisoned: Cell<bool>,
    locations: RefCell<HashMap<String, Range<usize>>>,
}

impl DiagnosticLog {
    /// Adds an error, unless it is a consequence of an earlier one.
    pub fn note(&self, error: Diagnostic) {
        let mut errors = self.errors.borrow_mut();
        let follows = error.unknown_name.as_deref().is_some_and(|name| self.is_poisoned(name));
        let is_known = errors.iter().any(|e| e.span == error.span && e.message == error.message);
        if errors.is_empty() || !(follows || is_known || errors.len() >= MOST_SHOWN) {
            errors.push(error);
        }
    }

    /// Adds a note; the file is read nevertheless.
    pub fn remark(&self, note: Diagnostic) {
        let mut remarks = self.remarks.borrow_mut();
        // Copies by `each` share their place.
        if remarks.len() < MOST_SHOWN && remarks.iter().all(|known| known.span != note.span) {
            remarks.push(Diagnostic { severity: Severity::Note, ..note });
        }
    }

    /// All notes.
    pub fn remarks(&self) -> Vec<Diagnostic> {
        self.remarks.borrow().clone()
    }

    /// Returns the value of a result, or logs its error and returns `None`.
    pub fn keep<T>(&self, read: Result<T, Diagnostic>) -> Option<T> {
        read.map_err(|error| self.note(error)).ok()
    }

    /// Poisons a name: references to it raise no follow-up errors.
    pub fn poison(&self, name: &str) {
        self.poisoned.borrow_mut().insert(name.to_owned());
    }

    /// Poisons all names, after a wrong definition without a readable name.
    pub fn poison_all(&self) {
        self.all_poisoned.set(true);
    }

    /// Returns `true` if a name or its owner is poisoned: `pin` poisons `pin.force_x`.
    fn is_poisoned(&self, name: &str) -> bool {
        let poisoned = self.poisoned.borrow();
        let ends = name.match_indices('.').map(|(k, _)| k).chain([name.len()]);
        self.all_poisoned.get() || ends.into_iter().any(|end| poisoned.contains(&name[..end]))
    }

    /// Stores the location of a named part; the first one counts.
    pub fn locate(&self, name: &str, span: Range<usize>) {
        self.locations.borrow_mut().entry(name.to_owned()).or_insert(span);
    }

    /// Fails if an error has been logged.
    ///
    /// # Errors
    /// The first error, if the log has any.
    pub fn check(&self) -> Result<(), Diagnostic> {
        self.errors.borrow().first().map_or(Ok(()), |error| Err(error.clone()))
    }

    /// All errors in the order of the file, and the locations of parts.
    pub fn into_parts(self) -> (Vec<Diagnostic>, HashMap<String, Range<usize>>) {
        let (mut errors, locations) = (self.errors.into_inner(), self.locations.into_inner());
        errors.sort_by_key(|e| e.span.start);
        for error in &mut errors {
            if let Some(second) = &mut error.second_use {
                second.first = locations.get(&second.name).cloned().or(second.first.take());
            }
        }
        (errors, locations)
    }
}

/// A file that has been read, with the locations of its named parts.
#[derive(Clone, Debug, Default)]
pub(super) struct SourceMap {
    pub file: String,
    pub text: String,
    pub locations: HashMap<String, Range<usize>>,
}

impl SourceMap {
    /// A report of diagnostics with the file.
    pub fn report(&self, diagnostics: Vec<Diagnostic>) -> DiagnosticReport {
        DiagnosticReport { file: self.file.clone(), text: self.text.clone(), diagnostics }
    }

    /// Converts an error of an analysis to a diagnostic at the part that it names; `None` if it names no part of the file.
    pub fn locate(&self, error: &Error) -> Option<DiagnosticReport> {
        let (what, message, remedy) = match error {
            Error::Analysis { what, why, remedy } => {
                (what, format!("analysis failed in {what}: {why}"), remedy.clone())
            }
            Error::Definition { what, why, remedy } | Error::Unsupported { what, why, remedy } => {
                (what, format!("{what}: {why}"), remedy.clone())
            }
            Error::NotFinite { what, value, place, remedy } => {
                (what, format!("{what} is {value} at {place}"), (*remedy).to_owned())
            }
            _ => return None,
        };
        let span = self.location_of_first_name(what)?.clone();
        Some(self.report(vec![Diagnostic::new(span, message).label("here").help(remedy)]))
    }

    /// The location of the first part that a text names.
    fn location_of_first_name(&self, text: &str) -> Option<&Range<usize>> {
        if let Some(span) = self.locations.get(text) {
            return Some(span);
        }
        let words = text.split(|c: char| !(c.is_alphanumeric() || c == '_')).filter(|word| !word.is_empty());
        words.into_iter().find_map(|word| self.locations.get(word))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_visible_and_other_ones_stay() {
        assert_eq!(visible("46 N·m\n²β✓"), "46 N·m\n²β✓");
        assert_eq!(visible("\u{1b}[2J\r\t\u{7f}\u{9b}1m\u{202e}"), "\\u001b[2J\\u000d\\u0009\\u007f\\u009b1m\\u202e");
    }
}
