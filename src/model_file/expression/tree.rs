//! A parsed expression.

use super::function::Function;
use std::ops::Range;

/// The signs between two operands.
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

/// What stands at a place of an expression.
#[derive(Clone, Debug, PartialEq)]
pub enum Node {
    /// A number.
    Number(f64),
    /// A name, dots included.
    Name(String),
    /// A sign before an operand.
    Negative(Box<Tree>),
    /// A sign between two operands.
    Binary(Operator, Box<[Tree; 2]>),
    /// A function of arguments, as many as it takes.
    Call(Function, Vec<Tree>),
}

/// An expression with its place in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Tree {
    /// What it is.
    pub node: Node,
    /// The bytes of the file that it was read from.
    pub span: Range<usize>,
}

impl Tree {
    /// A number that stands in the file as such.
    pub fn number(value: f64, span: Range<usize>) -> Self {
        Self { node: Node::Number(value), span }
    }

    /// Shows every name with its place to `see`, in the order of reading.
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
