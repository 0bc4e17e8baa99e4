//! Parsed expressions.

use super::function::MathFunction;
use super::reduction::Reduction;
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
    /// A reduction of a history, with its numbers.
    Reduce(Reduction, Vec<Tree>),
    /// The value of a reduction, by its number in [`Tree::take_reductions`].
    Reduced(usize),
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
            Node::Number(_) | Node::Reduced(_) => {}
            Node::Name(name) => see(name, &self.span),
            Node::Negative(inner) => inner.names(see),
            Node::Binary(_, both) => both.iter().for_each(|tree| tree.names(see)),
            Node::Call(_, arguments) | Node::Reduce(_, arguments) => arguments.iter().for_each(|tree| tree.names(see)),
        }
    }

    /// Replaces each reduction by its number, and returns the reductions with their arguments in this order.
    pub fn take_reductions(&mut self) -> Vec<Tree> {
        let mut found = vec![];
        self.take_into(&mut found);
        found
    }

    fn take_into(&mut self, found: &mut Vec<Tree>) {
        match &mut self.node {
            Node::Number(_) | Node::Name(_) | Node::Reduced(_) => {}
            Node::Negative(inner) => inner.take_into(found),
            Node::Binary(_, both) => both.iter_mut().for_each(|tree| tree.take_into(found)),
            Node::Call(_, arguments) => arguments.iter_mut().for_each(|tree| tree.take_into(found)),
            Node::Reduce(..) => {
                let reduced = Node::Reduced(found.len());
                found.push(Self { node: std::mem::replace(&mut self.node, reduced), span: self.span.clone() });
            }
        }
    }
}
