//! Parsed expressions.

use super::function::MathFunction;
use std::ops::Range;

/// An operator between two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    /// `+`
    Add,
    /// `-`
    Subtract,
    /// `*`
    Multiply,
    /// `/`
    Divide,
    /// `^`
    Power,
}

/// A node of an expression.
#[derive(Clone, Debug, PartialEq)]
pub enum Node {
    /// A number.
    Number(f64),
    /// A name, dots included.
    Name(String),
    /// A sign before an operand.
    Negative(Box<Tree>),
    /// An operator between two operands.
    Binary(Operator, Box<[Tree; 2]>),
    /// A function of arguments, as many as it takes.
    Call(MathFunction, Vec<Tree>),
}

/// A parsed expression with its location in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Tree {
    /// The root of the expression.
    pub node: Node,
    /// The bytes of the file that it was read from.
    pub span: Range<usize>,
}

impl Tree {
    /// A number without quotes.
    pub fn number(value: f64, span: Range<usize>) -> Self {
        Self { node: Node::Number(value), span }
    }

    /// Calls `see` with each name and its location, from left to right.
    pub fn names<'t>(&'t self, see: &mut impl FnMut(&'t str, &Range<usize>)) {
        match &self.node {
            Node::Number(_) => {}
            Node::Name(name) => see(name, &self.span),
            Node::Negative(inner) => inner.names(see),
            Node::Binary(_, both) => both.iter().for_each(|tree| tree.names(see)),
            Node::Call(_, arguments) => arguments.iter().for_each(|tree| tree.names(see)),
        }
    }
}
