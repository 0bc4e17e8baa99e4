//! From text to tree, by precedence climbing.
//!
//! **Source.** Pratt, *Proc. ACM Symp. Principles of Programming Languages* (1973) 41–51.

use super::function::{FUNCTIONS, Function};
use super::token::{Piece, TextPlace, Token, tokens};
use super::tree::{Node, Operator, Tree};
use crate::model_file::{Diagnostic, limits};

/// How tightly a sign before an operand binds: looser than a power, tighter than a product.
const SIGN: u8 = 5;

impl Operator {
    /// How tightly it binds to the left and to the right.
    fn binding(self) -> (u8, u8) {
        match self {
            Self::Add | Self::Subtract => (1, 2),
            Self::Multiply | Self::Divide => (3, 4),
            // To the right: 2^3^2 is 2^9.
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

impl Tree {
    /// Parses an expression that stands at `place` of a file.
    pub fn parse(text: &str, place: TextPlace) -> Result<Self, Diagnostic> {
        if text.len() > limits::EXPRESSION {
            let message = format!("an expression of {} characters is too long", text.len());
            let help = format!("at most {} characters; give its parts names in [expressions]", limits::EXPRESSION);
            return Err(Diagnostic::new(place.of(0..text.len()), message).help(help));
        }
        let tokens = tokens(text, &place)?;
        let mut parser = Parser { tokens: &tokens, at: 0 };
        let tree = parser.operand(0, 0)?;
        match parser.peek() {
            Token { piece: Piece::End, .. } => Ok(tree),
            token => Err(unexpected(token, "an operator or the end")),
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
        // The end stays the end.
        self.at = (self.at + 1).min(self.tokens.len() - 1);
        token
    }

    fn take(&mut self, sign: char, otherwise: &str) -> Result<&'t Token, Diagnostic> {
        let token = self.next();
        if token.piece == Piece::Sign(sign) { Ok(token) } else { Err(unexpected(token, otherwise)) }
    }

    /// An operand with everything behind it that binds more tightly than `least`.
    fn operand(&mut self, least: u8, depth: usize) -> Result<Tree, Diagnostic> {
        let mut left = self.prefix(depth)?;
        while let Some(operator) = Operator::of(&self.peek().piece) {
            let (to_left, to_right) = operator.binding();
            if to_left < least {
                break;
            }
            self.next();
            let right = self.operand(to_right, depth + usize::from(operator == Operator::Power))?;
            let span = left.span.start..right.span.end.max(left.span.end);
            left = Tree { node: Node::Binary(operator, Box::new([left, right])), span };
        }
        Ok(left)
    }

    /// A number, a name, a call, something in parentheses, or one of these behind a sign.
    fn prefix(&mut self, depth: usize) -> Result<Tree, Diagnostic> {
        let token = self.next();
        if depth > limits::NESTING {
            let message = format!("more than {} levels inside each other", limits::NESTING);
            return Err(Diagnostic::new(token.span.clone(), message).help("give inner parts names in [expressions]"));
        }
        match &token.piece {
            Piece::Number(value) => Ok(Tree::number(*value, token.span.clone())),
            Piece::Name(name) if self.peek().piece == Piece::Sign('(') => self.call(name, token, depth),
            Piece::Name(name) if name == "pi" => Ok(Tree::number(std::f64::consts::PI, token.span.clone())),
            Piece::Name(name) => Ok(Tree { node: Node::Name(name.clone()), span: token.span.clone() }),
            Piece::Sign('(') => {
                let inner = self.operand(0, depth + 1)?;
                let close = self.take(')', "`)`")?;
                Ok(Tree { span: token.span.start..close.span.end, ..inner })
            }
            Piece::Sign('-') => {
                let inner = self.operand(SIGN, depth + 1)?;
                let span = token.span.start..inner.span.end;
                Ok(Tree { node: Node::Negative(Box::new(inner)), span })
            }
            Piece::Sign('+') => self.operand(SIGN, depth + 1),
            _ => Err(unexpected(token, "a number, a name or `(`")),
        }
    }

    /// The arguments of a function, and the call.
    fn call(&mut self, name: &str, token: &Token, depth: usize) -> Result<Tree, Diagnostic> {
        let Some(function) = Function::named(name) else {
            return Err(Diagnostic::unknown(token.span.clone(), "function", name, FUNCTIONS.iter().map(|f| f.0)));
        };
        self.next();
        let mut arguments = vec![self.operand(0, depth + 1)?];
        while self.peek().piece == Piece::Sign(',') {
            self.next();
            arguments.push(self.operand(0, depth + 1)?);
        }
        let close = self.take(')', "`,` or `)`")?;
        let span = token.span.start..close.span.end;
        if arguments.len() != function.arguments() {
            let message = format!("`{name}` takes {} arguments, got {}", function.arguments(), arguments.len());
            return Err(Diagnostic::new(span, message.replace("1 arguments", "1 argument")));
        }
        Ok(Tree { node: Node::Call(function, arguments), span })
    }
}

fn unexpected(token: &Token, wanted: &str) -> Diagnostic {
    let got = match &token.piece {
        Piece::Number(value) => format!("the number {value}"),
        Piece::Name(name) => format!("the name `{name}`"),
        Piece::Sign(sign) => format!("`{sign}`"),
        Piece::End => "the end of the expression".to_owned(),
    };
    Diagnostic::new(token.span.clone(), format!("expected {wanted}, got {got}")).label(format!("expected {wanted}"))
}
