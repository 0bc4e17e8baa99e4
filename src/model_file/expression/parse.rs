//! Parsing of an expression: from text to tokens, and from these to a tree by precedence climbing.
//!
//! # Sources
//! Pratt, *Proc. ACM Symp. Principles of Programming Languages* (1973) 41–51.

use super::function::{FUNCTIONS, MathFunction};
use super::reduction::{REDUCTIONS, Reduction};
use super::tree::{ExpressionTree, Node, Operator};
use crate::Readable;
use crate::model_file::unit::Unit;
use crate::model_file::{Diagnostic, limits};
use std::ops::Range;

/// Name of the choice between two operands.
const IF: &str = "if";

/// Binding power of a sign before an operand: weaker than a power, stronger than a product.
const SIGN: u8 = 5;

impl Operator {
    /// Binding power to the left and to the right.
    fn binding(self) -> (u8, u8) {
        match self {
            Self::Add | Self::Subtract => (1, 2),
            Self::Multiply | Self::Divide => (3, 4),
            // Right-associative: 2^3^2 is 2^9.
            Self::Power => (8, 7),
        }
    }

    fn of(piece: &Piece) -> Option<Self> {
        match piece {
            Piece::Sign('+') => Some(Self::Add),
            Piece::Sign('-') => Some(Self::Subtract),
            Piece::Sign('*') => Some(Self::Multiply),
            Piece::Sign('/') => Some(Self::Divide),
            Piece::Sign('^') => Some(Self::Power),
            _ => None,
        }
    }
}

impl ExpressionTree {
    /// Parses an expression at `place` of a file.
    ///
    /// # Errors
    /// If the text is not an expression, too long or too deeply nested.
    pub fn parse(text: &str, place: TextPlace) -> Result<Self, Diagnostic> {
        Self::parse_by(text, place, |parser| parser.operand(0, 0))
    }

    /// Parses a comparison such as `a > b`: the difference that is positive where it holds.
    ///
    /// # Errors
    /// As [`ExpressionTree::parse`].
    pub fn parse_condition(text: &str, place: TextPlace) -> Result<Self, Diagnostic> {
        Self::parse_by(text, place, |parser| Ok(parser.comparison(0)?.0))
    }

    fn parse_by(
        text: &str,
        place: TextPlace,
        parse: impl FnOnce(&mut Parser<'_>) -> Result<Self, Diagnostic>,
    ) -> Result<Self, Diagnostic> {
        if text.len() > limits::EXPRESSION {
            let message = format!("an expression of {} characters is too long", text.len());
            let help = format!("at most {} characters; define parts of it in [expressions]", limits::EXPRESSION);
            return Err(Diagnostic::new(place.of(0..text.len()), message).help(help));
        }
        let tokens = tokens(text, &place)?;
        let mut parser = Parser { tokens: &tokens, at: 0 };
        let tree = parse(&mut parser)?;
        match parser.peek() {
            Token { piece: Piece::End, .. } => Ok(tree),
            token => Err(parser.no_unit(token).unwrap_or_else(|| unexpected(token, "an operator or the end"))),
        }
    }
}

struct Parser<'t> {
    tokens: &'t [Token],
    at: usize,
}

impl<'t> Parser<'t> {
    fn peek(&self) -> &'t Token {
        &self.tokens[self.at]
    }

    fn next(&mut self) -> &'t Token {
        let token = self.peek();
        // The last token is the end; the position never goes beyond it.
        self.at = (self.at + 1).min(self.tokens.len() - 1);
        token
    }

    /// The error about a name after a number, which is not a unit.
    fn no_unit(&self, token: &Token) -> Option<Diagnostic> {
        let is_after_number = matches!(self.tokens.get(self.at.checked_sub(1)?)?.piece, Piece::Number(_, None));
        let (true, Piece::Name(name)) = (is_after_number, &token.piece) else { return None };
        let nearest = Diagnostic::unknown(token.span.clone(), "unit", name, Unit::known());
        let is_near = nearest.help.as_deref().is_some_and(|help| help.starts_with("did you mean"));
        let is_typo = is_near && name.len() > 1 && combined(name).is_none();
        Some(if is_typo { nearest } else { unexpected(token, "an operator, a unit or the end") })
    }

    fn take(&mut self, sign: char, otherwise: &str) -> Result<&'t Token, Diagnostic> {
        let token = self.next();
        if token.piece == Piece::Sign(sign) { Ok(token) } else { Err(unexpected(token, otherwise)) }
    }

    /// An operand with all operators after it whose binding power is at least `least`.
    fn operand(&mut self, least: u8, depth: usize) -> Result<ExpressionTree, Diagnostic> {
        let mut left = self.prefix(depth)?;
        while let Some(operator) = Operator::of(&self.peek().piece) {
            let (to_left, to_right) = operator.binding();
            if to_left < least {
                break;
            }
            self.next();
            let right = self.operand(to_right, depth + usize::from(operator == Operator::Power))?;
            let span = left.span.start..right.span.end.max(left.span.end);
            left = ExpressionTree { node: Node::Binary(operator, Box::new([left, right])), span };
        }
        Ok(left)
    }

    /// A number, a name, a call, an expression in parentheses, or one of these after a sign.
    fn prefix(&mut self, depth: usize) -> Result<ExpressionTree, Diagnostic> {
        let token = self.next();
        if depth > limits::NESTING {
            let message = format!("more than {} nested levels", limits::NESTING);
            return Err(Diagnostic::new(token.span.clone(), message).help("define inner parts in [expressions]"));
        }
        match &token.piece {
            Piece::Number(value, None) => Ok(ExpressionTree::number(*value, token.span.clone())),
            Piece::Number(value, Some(unit)) => {
                Ok(ExpressionTree { node: Node::Quantity(*value, unit.clone()), span: token.span.clone() })
            }
            Piece::Name(name) if self.peek().piece == Piece::Sign('(') => self.call(name, token, depth),
            Piece::Name(name) if name == "pi" => Ok(ExpressionTree::number(std::f64::consts::PI, token.span.clone())),
            Piece::Name(name) => Ok(ExpressionTree { node: Node::Name(name.clone()), span: token.span.clone() }),
            Piece::Sign('(') => {
                let inner = self.operand(0, depth + 1)?;
                let close = self.take(')', "`)`")?;
                Ok(ExpressionTree { span: token.span.start..close.span.end, ..inner })
            }
            Piece::Sign('-') => {
                let inner = self.operand(SIGN, depth + 1)?;
                let span = token.span.start..inner.span.end;
                Ok(ExpressionTree { node: Node::Negative(Box::new(inner)), span })
            }
            Piece::Sign('+') => self.operand(SIGN, depth + 1),
            _ => Err(unexpected(token, "a number, a name or `(`")),
        }
    }

    /// `a > b`: the difference that is positive where it holds, and whether it holds where they are equal.
    fn comparison(&mut self, depth: usize) -> Result<(ExpressionTree, bool), Diagnostic> {
        let left = self.operand(0, depth + 1)?;
        let token = self.next();
        let (is_less, with_equal) = match token.piece {
            Piece::Compare(is_less, with_equal) => (is_less, with_equal),
            _ => return Err(unexpected(token, "one of < <= > >=")),
        };
        let right = self.operand(0, depth + 1)?;
        if let Piece::Compare(..) = self.peek().piece {
            return Err(Diagnostic::new(self.peek().span.clone(), "a condition has one comparison").help(BOTH));
        }
        let span = left.span.start..right.span.end.max(left.span.end);
        let both = if is_less { [right, left] } else { [left, right] };
        Ok((ExpressionTree { node: Node::Binary(Operator::Subtract, Box::new(both)), span }, with_equal))
    }

    /// `if(a > b, x, y)`, after its name.
    fn choice(&mut self, start: usize, depth: usize) -> Result<ExpressionTree, Diagnostic> {
        let (difference, with_equal) = self.comparison(depth)?;
        self.take(',', "`,`")?;
        let yes = self.operand(0, depth + 1)?;
        self.take(',', "`,`")?;
        let no = self.operand(0, depth + 1)?;
        let close = self.take(')', "`)`")?;
        let node = Node::If(with_equal, Box::new([difference, yes, no]));
        Ok(ExpressionTree { node, span: start..close.span.end })
    }

    /// The arguments of a function, and the call.
    fn call(&mut self, name: &str, token: &Token, depth: usize) -> Result<ExpressionTree, Diagnostic> {
        let function = MathFunction::named(name);
        let is_reduction = REDUCTIONS.iter().any(|(known, ..)| *known == name);
        self.next();
        if name == IF {
            return self.choice(token.span.start, depth);
        }
        let mut arguments = vec![self.operand(0, depth + 1)?];
        while self.peek().piece == Piece::Sign(',') {
            self.next();
            arguments.push(self.operand(0, depth + 1)?);
        }
        let close = self.take(')', "`,` or `)`")?;
        let span = token.span.start..close.span.end;
        if let Some(reduction) = Reduction::named(name, arguments.len()) {
            return Ok(ExpressionTree { node: Node::Reduce(reduction, arguments), span });
        }
        if function.is_none() && !is_reduction {
            let Ok([argument]) = <[ExpressionTree; 1]>::try_from(arguments) else {
                let known = FUNCTIONS.iter().map(|f| f.0).chain(REDUCTIONS.iter().map(|r| r.0)).chain(["if"]);
                let error = Diagnostic::unknown(token.span.clone(), "function", name, known);
                let message = format!("`{name}` is not a function of several arguments");
                return Err(Diagnostic { message, unknown_name: None, ..error });
            };
            // The name of a table, which is looked up when the expression is compiled.
            return Ok(ExpressionTree { node: Node::Table(name.to_owned(), Box::new(argument)), span });
        }
        let Some(function) = function else {
            let message = format!("`{name}` takes a history{}, got {} arguments", takes(name), arguments.len());
            return Err(Diagnostic::new(span, message.replace("1 arguments", "1 argument")));
        };
        if arguments.len() != function.arguments() {
            let message = format!("`{name}` takes {} arguments, got {}", function.arguments(), arguments.len());
            return Err(Diagnostic::new(span, message.replace("1 arguments", "1 argument")));
        }
        if function == MathFunction::SmoothStep {
            return Ok(smooth_step(arguments, span));
        }
        Ok(ExpressionTree { node: Node::Call(function, arguments), span })
    }
}

/// The smooth step of (x − a)/(b − a).
fn smooth_step(arguments: Vec<ExpressionTree>, span: Range<usize>) -> ExpressionTree {
    let of = |node| ExpressionTree { node, span: span.clone() };
    let minus = |left: &ExpressionTree, right: &ExpressionTree| {
        of(Node::Binary(Operator::Subtract, Box::new([left.clone(), right.clone()])))
    };
    let [x, from, to] = [0, 1, 2].map(|k: usize| &arguments[k]);
    let share = of(Node::Binary(Operator::Divide, Box::new([minus(x, from), minus(to, from)])));
    of(Node::Call(MathFunction::SmoothStep, vec![share]))
}

/// Arguments of a reduction besides the history, in words.
fn takes(name: &str) -> &'static str {
    let has_number = REDUCTIONS.iter().any(|(known, _, has_number, _)| *known == name && *has_number);
    if has_number { ", a number, and optionally two times" } else { ", and optionally two times" }
}

fn unexpected(token: &Token, wanted: &str) -> Diagnostic {
    let got = match &token.piece {
        Piece::Number(value, _) => format!("the number {}", Readable(*value)),
        Piece::Name(name) => format!("the name `{name}`"),
        Piece::Sign(sign) => format!("`{sign}`"),
        Piece::Compare(..) => "a comparison, which can be used in `if(a > b, x, y)` and in `when` only".to_owned(),
        Piece::End => "the end of the expression".to_owned(),
    };
    let error = Diagnostic::new(token.span.clone(), format!("expected {wanted}, got {got}"));
    let error = error.label(format!("expected {wanted}"));
    let remedy = if let Piece::Name(name) = &token.piece { combined(name) } else { None };
    match remedy {
        Some(remedy) => error.help(remedy),
        None => error,
    }
}

/// The remedy for two conditions that must both hold.
const BOTH: &str = "two conditions that must both hold are one: `min(x - a, b - x) > 0` for a < x < b";

/// The remedy for conditions that are combined or compared by a word or sign of programming languages.
fn combined(word: &str) -> Option<&'static str> {
    match word {
        "and" | "&" => Some(BOTH),
        "or" | "|" => Some("two conditions of which one must hold are one: `max(a - x, x - b) > 0` for x < a or x > b"),
        "!" => Some("turn the comparison around: `a <= b` for not a > b"),
        "=" => Some("the comparisons are < <= > >="),
        _ => None,
    }
}

/// Location of the text of an expression in its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TextPlace {
    /// The characters of the text, from this byte on.
    From(usize),
    /// Somewhere within these bytes, because the text in the file has escapes.
    Within(Range<usize>),
}

impl From<usize> for TextPlace {
    fn from(start: usize) -> Self {
        Self::From(start)
    }
}

impl TextPlace {
    /// Converts bytes of the expression to bytes of the file.
    pub fn of(&self, span: Range<usize>) -> Range<usize> {
        match self {
            Self::From(start) => start + span.start..start + span.end,
            Self::Within(all) => all.clone(),
        }
    }
}

/// Content of a token.
#[derive(Clone, Debug, PartialEq)]
enum Piece {
    Number(f64, Option<Unit>),
    Name(String),
    /// One of `+ - * / ^ ( ) ,`.
    Sign(char),
    /// A comparison: whether it is less, and whether equal numbers satisfy it.
    Compare(bool, bool),
    End,
}

/// A number, name or sign with its bytes in the file.
#[derive(Clone, Debug, PartialEq)]
struct Token {
    piece: Piece,
    span: Range<usize>,
}

/// All tokens of `text`, with the end as the last one.
fn tokens(text: &str, place: &TextPlace) -> Result<Vec<Token>, Diagnostic> {
    let mut found = vec![];
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        let (piece, length) = match c {
            c if c.is_whitespace() => {
                at += c.len_utf8();
                continue;
            }
            '0'..='9' | '.' => quantity(rest, at, place)?,
            c if c.is_alphabetic() || c == '_' => {
                let length = rest.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == '.')).unwrap_or(rest.len());
                (Piece::Name(rest[..length].to_owned()), length)
            }
            '+' | '-' | '*' | '/' | '^' | '(' | ')' | ',' => (Piece::Sign(c), 1),
            '<' | '>' => {
                let with_equal = rest[1..].starts_with('=');
                (Piece::Compare(c == '<', with_equal), 1 + usize::from(with_equal))
            }
            c => {
                let error = Diagnostic::new(place.of(at..at + c.len_utf8()), format!("unexpected character `{c}`"));
                let all = "an expression consists of numbers, names, + - * / ^ ( ) and ,";
                let remedy = combined(&rest[..c.len_utf8()]).unwrap_or(all);
                return Err(error.label("not part of an expression").help(remedy));
            }
        };
        found.push(Token { piece, span: place.of(at..at + length) });
        at += length;
    }
    found.push(Token { piece: Piece::End, span: place.of(at..at) });
    Ok(found)
}

/// A number with its unit, if one follows, at the start of `rest`.
fn quantity(rest: &str, at: usize, place: &TextPlace) -> Result<(Piece, usize), Diagnostic> {
    let (value, length) = number(rest, at, place)?;
    let behind = rest[length..].trim_start();
    // `2 1/s` has the unit 1/s; a second number is a mistake.
    let unit = Unit::at_start(behind).filter(|(_, length)| !behind.starts_with('1') || behind[..*length].contains('/'));
    let end = |unit: usize| rest.len() - behind.len() + unit;
    Ok(match unit {
        Some((unit, unit_length)) => (Piece::Number(value, Some(unit)), end(unit_length)),
        None => (Piece::Number(value, None), length),
    })
}

/// A number such as `12`, `.5`, `1e-3` at the start of `rest`, which is at byte `at` of the expression.
fn number(rest: &str, at: usize, place: &TextPlace) -> Result<(f64, usize), Diagnostic> {
    let bytes = rest.as_bytes();
    let digits = |from: usize| from + bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut end = digits(0);
    if bytes.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let power = digits(end + 1 + sign);
        // `2e` is the number 2 and the start of a name, which the parser rejects.
        end = if power > end + 1 + sign { power } else { end };
    }
    let wrong = |message: String| Diagnostic::new(place.of(at..at + end.max(1)), message).label("expected a number");
    match rest[..end].parse::<f64>() {
        Ok(value) if value.is_finite() => Ok((value, end)),
        Ok(_) => Err(wrong(format!("`{}` is too large for a number", &rest[..end]))),
        Err(_) => Err(wrong(format!("`{}` is not a number", &rest[..end.max(1)]))),
    }
}
