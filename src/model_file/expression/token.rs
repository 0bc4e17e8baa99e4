//! Numbers, names and signs of an expression, with their places.

use crate::model_file::Diagnostic;
use std::ops::Range;

/// Where the text of an expression stands in its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TextPlace {
    /// Letter for letter from this byte on.
    From(usize),
    /// Somewhere in these bytes, not letter for letter.
    Within(Range<usize>),
}

impl From<usize> for TextPlace {
    fn from(start: usize) -> Self {
        Self::From(start)
    }
}

impl TextPlace {
    /// The bytes of the file for bytes of the expression.
    pub fn of(&self, span: Range<usize>) -> Range<usize> {
        match self {
            Self::From(start) => start + span.start..start + span.end,
            Self::Within(all) => all.clone(),
        }
    }
}

/// One piece of an expression.
#[derive(Clone, Debug, PartialEq)]
pub enum Piece {
    Number(f64),
    Name(String),
    /// One of `+ - * / ^ ( ) ,`.
    Sign(char),
    End,
}

/// A piece with its bytes in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Token {
    pub piece: Piece,
    pub span: Range<usize>,
}

/// All pieces of `text`, the end included.
pub fn tokens(text: &str, place: &TextPlace) -> Result<Vec<Token>, Diagnostic> {
    let mut found = vec![];
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        let (piece, length) = match c {
            c if c.is_whitespace() => {
                at += c.len_utf8();
                continue;
            }
            '0'..='9' | '.' => number(rest, at, place)?,
            c if c.is_alphabetic() || c == '_' => {
                let length = rest.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == '.')).unwrap_or(rest.len());
                (Piece::Name(rest[..length].to_owned()), length)
            }
            '+' | '-' | '*' | '/' | '^' | '(' | ')' | ',' => (Piece::Sign(c), 1),
            c => {
                let complaint = Diagnostic::new(place.of(at..at + c.len_utf8()), format!("`{c}` means nothing here"));
                return Err(complaint
                    .label("unexpected")
                    .help("an expression has numbers, names, + - * / ^ ( ) and ,"));
            }
        };
        found.push(Token { piece, span: place.of(at..at + length) });
        at += length;
    }
    found.push(Token { piece: Piece::End, span: place.of(at..at) });
    Ok(found)
}

/// A number such as `12`, `.5`, `1e-3` at the start of `rest`, which is at byte `at` of the expression.
fn number(rest: &str, at: usize, place: &TextPlace) -> Result<(Piece, usize), Diagnostic> {
    let bytes = rest.as_bytes();
    let digits = |from: usize| from + bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut end = digits(0);
    if bytes.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let power = digits(end + 1 + sign);
        // `2e` is the number 2 and the start of a name, which the parser refuses.
        end = if power > end + 1 + sign { power } else { end };
    }
    let wrong = |message: String| Diagnostic::new(place.of(at..at + end.max(1)), message).label("expected a number");
    match rest[..end].parse::<f64>() {
        Ok(value) if value.is_finite() => Ok((Piece::Number(value), end)),
        Ok(_) => Err(wrong(format!("`{}` is larger than any number", &rest[..end]))),
        Err(_) => Err(wrong(format!("`{}` is no number", &rest[..end.max(1)]))),
    }
}
