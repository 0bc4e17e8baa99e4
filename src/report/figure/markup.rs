//! Markup of labels: `*b*_1` is an italic b with index 1, `10^{-3}` a power.
//!
//! `*…*` sets italics, `_` and `^` lower or raise the letters and digits after them or a group in braces, and a
//! backslash shows the next character literally.

use std::fmt::Write;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Level {
    Base,
    Sub,
    Super,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct TextRun {
    text: String,
    italic: bool,
    level: Level,
}

/// Size of an index relative to the text.
const INDEX_SIZE: f64 = 0.72;

/// The text without its markup, for descriptions.
pub(crate) fn plain(markup: &str) -> String {
    runs(markup).into_iter().map(|run| run.text).collect()
}

/// Markup that shows `text` literally.
pub fn literal(text: &str) -> String {
    text.chars().fold(String::with_capacity(text.len()), |mut out, c| {
        if matches!(c, '*' | '_' | '^' | '\\') {
            out.push('\\');
        }
        out.push(c);
        out
    })
}

/// Width in points when set in `size` points, estimated from the advance widths of the font.
pub(crate) fn width(markup: &str, size: f64) -> f64 {
    runs(markup)
        .iter()
        .map(|run| {
            let scale = if run.level == Level::Base { 1.0 } else { INDEX_SIZE };
            scale * size * run.text.chars().map(advance).sum::<f64>()
        })
        .sum()
}

/// Content of an SVG `<text>` element.
pub(crate) fn tspans(markup: &str, size: f64) -> String {
    let mut out = String::new();
    let mut lowered = 0.0;
    for run in runs(markup) {
        let wanted = match run.level {
            Level::Base => 0.0,
            Level::Sub => 0.22 * size,
            Level::Super => -0.36 * size,
        };
        let style = if run.italic { " font-style=\"italic\"" } else { "" };
        let scaled = match run.level {
            Level::Base => String::new(),
            _ => format!(" font-size=\"{:.2}\"", INDEX_SIZE * size),
        };
        let dy = wanted - lowered;
        let moved = if dy == 0.0 { String::new() } else { format!(" dy=\"{dy:.2}\"") };
        let text = escape(&run.text);
        if style.is_empty() && scaled.is_empty() && moved.is_empty() {
            out.push_str(&text);
        } else {
            let _ = write!(out, "<tspan{style}{scaled}{moved}>{text}</tspan>");
        }
        lowered = wanted;
    }
    out
}

/// Escapes text for XML and drops control characters.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() => {}
            c => out.push(c),
        }
    }
    out
}

fn runs(markup: &str) -> Vec<TextRun> {
    let chars: Vec<char> = markup.chars().collect();
    let mut runs: Vec<TextRun> = Vec::new();
    let mut italic = false;
    let mut k = 0;
    while k < chars.len() {
        match chars[k] {
            '\\' if k + 1 < chars.len() => {
                push(&mut runs, &chars[k + 1..k + 2], italic, Level::Base);
                k += 2;
            }
            '*' if italic || chars[k + 1..].contains(&'*') => {
                italic = !italic;
                k += 1;
            }
            sign @ ('_' | '^') if index_length(&chars[k + 1..]) > 0 => {
                let level = if sign == '_' { Level::Sub } else { Level::Super };
                let length = index_length(&chars[k + 1..]);
                let group = &chars[k + 1..k + 1 + length];
                let inside = if group[0] == '{' { &group[1..length - 1] } else { group };
                push(&mut runs, inside, false, level);
                k += 1 + length;
            }
            _ => {
                push(&mut runs, &chars[k..=k], italic, Level::Base);
                k += 1;
            }
        }
    }
    runs
}

/// Number of characters that `_` or `^` applies to: a group in braces, or a sign with letters and digits.
fn index_length(rest: &[char]) -> usize {
    if rest.first() == Some(&'{') {
        return rest.iter().position(|&c| c == '}').map_or(0, |end| end + 1);
    }
    let sign = usize::from(rest.first().is_some_and(|c| matches!(c, '-' | '+' | '−')));
    let length = rest[sign..].iter().take_while(|c| c.is_alphanumeric()).count();
    if length == 0 { 0 } else { sign + length }
}

fn push(runs: &mut Vec<TextRun>, chars: &[char], italic: bool, level: Level) {
    let text = chars.iter().map(|&c| if c == '-' && level != Level::Base { '−' } else { c });
    match runs.last_mut() {
        Some(last) if last.italic == italic && last.level == level => last.text.extend(text),
        _ => runs.push(TextRun { text: text.collect(), italic, level }),
    }
}

/// Advance width in units of the font size, by class of character (DejaVu Sans Condensed).
fn advance(c: char) -> f64 {
    match c {
        'i' | 'j' | 'l' | '\'' => 0.25,
        ' ' | '.' | ',' | '|' | ':' | ';' | 'I' => 0.30,
        'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '/' | '!' | '-' => 0.36,
        'm' | 'w' | 'W' | 'M' | '%' => 0.85,
        '−' | '+' | '=' | '<' | '>' | '≤' | '≥' | '≠' | '·' | '×' => 0.75,
        c if c.is_uppercase() => 0.63,
        c if c.is_ascii_digit() => 0.573,
        _ => 0.56,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_becomes_tspans() {
        assert_eq!(plain("*b*_1 [N/m]"), "b1 [N/m]");
        assert_eq!(plain("10^{-3}"), "10−3");
        assert_eq!(
            tspans("*b*_1", 10.0),
            "<tspan font-style=\"italic\">b</tspan><tspan font-size=\"7.20\" dy=\"2.20\">1</tspan>"
        );
        assert!(tspans("a_i b", 10.0).ends_with("<tspan dy=\"-2.20\"> b</tspan>"));
    }

    #[test]
    fn odd_markup_is_shown_literally() {
        for odd in ["5 * 3", "a_", "x^", "_{open", "\\", "*"] {
            assert_eq!(plain(odd), odd, "{odd}");
        }
        assert_eq!(plain(&literal("a_b*c^2\\")), "a_b*c^2\\");
        assert_eq!(escape("a<b & \"c\"\u{7}"), "a&lt;b &amp; &quot;c&quot;");
    }
}
