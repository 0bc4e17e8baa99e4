//! Parsed expressions.

use super::function::MathFunction;
use super::reduction::Reduction;
use crate::model_file::unit::Unit;
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
    /// A number with a unit.
    Quantity(f64, Unit),
    /// A name, dots included.
    Name(String),
    /// A sign before an operand.
    Negative(Box<ExpressionTree>),
    /// An operator between two operands.
    Binary(Operator, Box<[ExpressionTree; 2]>),
    /// A function of arguments, as many as it takes.
    Call(MathFunction, Vec<ExpressionTree>),
    /// The second tree where the first one is positive, otherwise the third one; also where the first one is zero, if the flag is set.
    If(bool, Box<[ExpressionTree; 3]>),
    /// A table by its name, at a value.
    Table(String, Box<ExpressionTree>),
    /// A reduction of a history, with its numbers.
    Reduce(Reduction, Vec<ExpressionTree>),
    /// The value of a reduction, by its number in [`ExpressionTree::take_reductions`].
    Reduced(usize),
}

impl Node {
    /// The operands or arguments.
    pub fn parts(&self) -> &[ExpressionTree] {
        match self {
            Self::Number(_) | Self::Quantity(..) | Self::Name(_) | Self::Reduced(_) => &[],
            Self::Negative(inner) | Self::Table(_, inner) => std::slice::from_ref(&**inner),
            Self::Binary(_, both) => &both[..],
            Self::If(_, parts) => &parts[..],
            Self::Call(_, arguments) | Self::Reduce(_, arguments) => arguments,
        }
    }
}

/// A parsed expression with its location in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpressionTree {
    /// The root of the expression.
    pub node: Node,
    /// The bytes of the file that it was read from.
    pub span: Range<usize>,
}

impl ExpressionTree {
    /// A number without quotes.
    pub fn number(value: f64, span: Range<usize>) -> Self {
        Self { node: Node::Number(value), span }
    }

    /// The unit, if the expression is a number with one, or such a number after a sign.
    pub fn unit(&self) -> Option<&Unit> {
        self.quantity().map(|(_, unit)| unit)
    }

    /// The number and its unit, if the expression is a number with one, or such a number after a sign.
    pub fn quantity(&self) -> Option<(f64, &Unit)> {
        match &self.node {
            Node::Quantity(number, unit) => Some((*number, unit)),
            Node::Negative(inner) => inner.quantity().map(|(number, unit)| (-number, unit)),
            _ => None,
        }
    }

    /// The number, if the expression is one without a unit, or such a number after a sign.
    pub fn as_number(&self) -> Option<f64> {
        match &self.node {
            Node::Number(number) => Some(*number),
            Node::Negative(inner) => inner.as_number().map(|number| -number),
            _ => None,
        }
    }

    /// The value `si` of the expression as a number of a unit: exactly the written number, if it is written in that unit.
    pub fn number_of(&self, unit: &Unit, si: f64) -> f64 {
        match self.quantity() {
            Some((number, own)) if own == unit => number,
            _ => unit.of_si(si),
        }
    }

    /// All units in the expression, from left to right.
    pub fn units(&self) -> Vec<Unit> {
        match &self.node {
            Node::Quantity(_, unit) => vec![unit.clone()],
            node => node.parts().iter().flat_map(Self::units).collect(),
        }
    }

    /// Returns `true` if the expression has a name or a unit in it: it is more than plain numbers.
    pub fn is_formula(&self) -> bool {
        let mut has_name = false;
        self.names(&mut |_, _| has_name = true);
        has_name || !self.units().is_empty()
    }

    /// The expression as a number of this unit: divided by the unit.
    #[must_use]
    pub fn per(self, unit: &Unit) -> Self {
        let span = self.span.clone();
        let one = Self { node: Node::Quantity(1.0, unit.unnamed()), span: span.clone() };
        Self { node: Node::Binary(Operator::Divide, Box::new([self, one])), span }
    }

    /// Calls `see` with each name and its location, from left to right.
    pub fn names<'t>(&'t self, see: &mut impl FnMut(&'t str, &Range<usize>)) {
        if let Node::Name(name) = &self.node {
            see(name, &self.span);
        }
        self.node.parts().iter().for_each(|tree| tree.names(see));
    }

    /// Replaces each reduction by its number, and returns the reductions with their arguments in this order.
    pub fn take_reductions(&mut self) -> Vec<ExpressionTree> {
        let mut found = vec![];
        self.take_into(&mut found);
        found
    }

    fn take_into(&mut self, found: &mut Vec<ExpressionTree>) {
        match &mut self.node {
            Node::Number(_) | Node::Quantity(..) | Node::Name(_) | Node::Reduced(_) => {}
            Node::Negative(inner) | Node::Table(_, inner) => inner.take_into(found),
            Node::If(_, parts) => parts.iter_mut().for_each(|tree| tree.take_into(found)),
            Node::Binary(_, both) => both.iter_mut().for_each(|tree| tree.take_into(found)),
            Node::Call(_, arguments) => arguments.iter_mut().for_each(|tree| tree.take_into(found)),
            Node::Reduce(..) => {
                let reduced = Node::Reduced(found.len());
                found.push(Self { node: std::mem::replace(&mut self.node, reduced), span: self.span.clone() });
            }
        }
    }
}
