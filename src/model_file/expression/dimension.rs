//! Dimensions of expressions: a check of units before anything is compiled.
//!
//! A plain number may stand for a value of any unit, so its dimension is unknown, and so is that of products with it. A product of numbers with an angular
//! velocity is still no frequency.

use super::names::Meaning;
use super::tree::{ExpressionTree, Node, Operator};
use super::{MathFunction, Names, Scope};
use crate::model_file::Diagnostic;
use crate::model_file::unit::{Dimension, KnownDimension, Unit, alternatives};
use std::collections::HashMap;

/// The dimension of an expression, if it is known.
pub type Inferred = Result<Option<KnownDimension>, Diagnostic>;

impl Names {
    /// The dimension of an expression whose other names have the units of `scope`.
    ///
    /// # Errors
    /// If quantities of different dimensions are added or compared, or a function takes a number and gets another one.
    pub fn dimension(&self, tree: &ExpressionTree, scope: &Scope<'_>) -> Inferred {
        Inference { names: self, scope, number: None, divides: false, known: HashMap::new() }.of(tree)
    }

    /// The dimension of a product whose plain numbers are numbers, if that is an angular velocity and one of the `units` is a frequency. A quotient
    /// may be a conversion, by 2π.
    fn mixed_with_cycles(&self, tree: &ExpressionTree, scope: &Scope<'_>, units: &[Unit]) -> Option<KnownDimension> {
        let number = KnownDimension::loose(Dimension::NUMBER);
        let mut inference = Inference { names: self, scope, number, divides: false, known: HashMap::new() };
        let found = inference.of(tree).ok()??;
        let is_frequency = |unit: &Unit| unit.dimension.counts_cycles() && found.dimension.is_like(unit.dimension);
        let fits = |unit: &Unit| found.dimension.fits(unit.dimension);
        let is_mixed = units.iter().any(is_frequency) && !units.iter().any(fits);
        (found.is_firm && !inference.divides && is_mixed).then_some(found)
    }

    /// Checks that the expression of a key has one of its units, such as "N/m or N·m/rad"; no check if these are empty.
    pub(super) fn check_units(&self, tree: &ExpressionTree, scope: &Scope<'_>) -> Result<(), Diagnostic> {
        let found = self.dimension(tree, scope)?.filter(|found| found.is_firm);
        let units = alternatives(scope.units);
        let found = found.or_else(|| self.mixed_with_cycles(tree, scope, &units));
        let (Some(found), false) = (found, units.is_empty()) else { return Ok(()) };
        let literal = tree.unit();
        let fits = |unit: &Unit| match literal {
            Some(_) => found.dimension.is_written_like(unit.dimension),
            None => found.dimension.fits(unit.dimension),
        };
        if units.iter().any(fits) {
            return Ok(());
        }
        let is_number = units.iter().all(|unit| unit.dimension == Dimension::NUMBER);
        let wanted =
            if is_number { "a number without a unit".to_owned() } else { format!("a value in {}", scope.units) };
        let this = literal.map_or("this expression".to_owned(), |unit| format!("`{}`", unit.text));
        let message = format!("{} takes {wanted}, and {this} is {}", scope.place, of_kind(found.dimension, literal));
        let error = Diagnostic::new(tree.span.clone(), message)
            .label(format!("expected {}", wanted.trim_start_matches("a value in ")));
        let usual: Vec<&str> = units.iter().flat_map(|unit| Unit::symbols(unit.dimension)).collect();
        // Equal up to cycles and angles, but not the same.
        let like = units.iter().find(|unit| unit.dimension.is_like(found.dimension));
        Err(match usual[..] {
            _ if like.is_some() => error.help(CYCLES),
            _ if uses_time(tree)
                && units.iter().any(|unit| unit.dimension.times(Dimension::TIME, 1.0) == Some(found.dimension)) =>
            {
                error.help("`time` is in s: multiply it by a rate, as in \"30 deg/s\" or \"0.2 m/s\"")
            }
            [] => error,
            _ => error.help(format!("units of this kind: {}", usual.join(", "))),
        })
    }
}

/// Remedy if a frequency stands for an angular velocity, or the other way round.
pub const CYCLES: &str = "1 Hz is 2*pi rad/s: write 60 rpm or 2*pi rad/s for one revolution per second; of a frequency f, 2*pi*f is the angular \
                          velocity";

/// Returns whether an expression uses the time.
fn uses_time(tree: &ExpressionTree) -> bool {
    let mut is_used = false;
    tree.names(&mut |name, _| is_used |= name == "time");
    is_used
}

/// The dimension in words. For a literal with a unit, a dimension without a name is given in base units.
fn of_kind(dimension: Dimension, literal: Option<&Unit>) -> String {
    match (dimension.to_string(), literal) {
        (words, Some(_)) if words.starts_with("a value in") => format!("one in {}", dimension.base_units()),
        (words, _) => words,
    }
}

struct Inference<'a> {
    names: &'a Names,
    scope: &'a Scope<'a>,
    /// The dimension of plain numbers.
    number: Option<KnownDimension>,
    /// True if a quotient or a power was found.
    divides: bool,
    /// Dimensions of named expressions.
    known: HashMap<usize, Option<KnownDimension>>,
}

impl Inference<'_> {
    fn of(&mut self, tree: &ExpressionTree) -> Inferred {
        match &tree.node {
            Node::Number(_) => Ok(self.number),
            Node::Reduced(_) => Ok(None),
            Node::Quantity(_, unit) => Ok(KnownDimension::firm(unit.dimension)),
            Node::Name(name) => self.of_name(name),
            Node::Negative(inner) => self.of(inner),
            Node::Binary(..) => self.of_chain(tree),
            Node::If(_, parts) => {
                self.of(&parts[0])?;
                let (yes, no) = (self.of(&parts[1])?, self.of(&parts[2])?);
                same(yes, no, &parts[2])
            }
            Node::Table(_, argument) => self.of(argument).map(|_| None),
            Node::Call(function, arguments) => self.of_call(*function, arguments),
            Node::Reduce(reduction, arguments) => {
                let history = arguments.first().map_or(Ok(None), |history| self.of(history))?;
                Ok(if reduction.keeps_unit() { history } else { None })
            }
        }
    }

    fn of_name(&mut self, name: &str) -> Inferred {
        if name == self.names.axis.name() {
            return Ok(self.names.axis.known());
        }
        let Some(meaning) = self.names.meanings.get(name) else {
            return Ok((self.scope.other_units)(name).map(|unit| unit.known));
        };
        match meaning {
            Meaning::Constant(_) => Ok(self.names.dimensions.get(name).copied()),
            Meaning::Design(_) => Ok(self.names.units.get(name).and_then(|unit| KnownDimension::firm(unit.dimension))),
            Meaning::Expression(k) => {
                if let Some(known) = self.known.get(k) {
                    return Ok(*known);
                }
                // Circular definitions are rejected elsewhere.
                self.known.insert(*k, None);
                let found = self.of(&self.names.expressions[*k])?;
                self.known.insert(*k, found);
                Ok(found)
            }
        }
    }

    /// Operands with operators between them, without recursion: a sum may have a thousand terms.
    fn of_chain(&mut self, tree: &ExpressionTree) -> Inferred {
        let (mut links, mut first) = (vec![], tree);
        while let Node::Binary(operator, both) = &first.node {
            links.push((*operator, &both[1]));
            first = &both[0];
        }
        let mut left = self.of(first)?;
        for (operator, right) in links.into_iter().rev() {
            self.divides |= matches!(operator, Operator::Divide | Operator::Power);
            left = match operator {
                Operator::Add | Operator::Subtract => {
                    let other = self.of(right)?;
                    same(left, other, right)?
                }
                Operator::Multiply => product(left, self.of(right)?, 1.0),
                Operator::Divide => product(left, self.of(right)?, -1.0),
                Operator::Power => {
                    self.of(right)?;
                    power(left, right)
                }
            };
        }
        Ok(left)
    }

    fn of_call(&mut self, function: MathFunction, arguments: &[ExpressionTree]) -> Inferred {
        use MathFunction::{Abs, Atan2, Cos, Deg, Hypot, Max, Min, Pow, Sin, Sqrt, Tan};
        let found = arguments.iter().map(|argument| self.of(argument)).collect::<Result<Vec<_>, _>>()?;
        let number = KnownDimension::loose(Dimension::NUMBER);
        match (function, &found[..]) {
            (Abs, [x]) => Ok(*x),
            (Sqrt, [x]) => Ok(x.and_then(|x| root(x, 0.5))),
            (Pow, [x, _]) => Ok(power(*x, &arguments[1])),
            (Atan2, [x, y]) => same(*x, *y, &arguments[1]).map(|_| number),
            (Min | Max | Hypot, [x, y]) => same(*x, *y, &arguments[1]),
            (Sin | Cos | Tan, [Some(KnownDimension { dimension, is_firm: true })]) if dimension.counts_cycles() => {
                let message = format!("`{}` takes an angle, and this is {dimension}", function.name());
                Err(Diagnostic::new(arguments[0].span.clone(), message).help("multiply it by 2*pi"))
            }
            (Deg, [Some(KnownDimension { dimension, is_firm: true })]) if dimension.is_angle() => {
                let message = "`deg` takes a number of degrees, and this is an angle already";
                Err(Diagnostic::new(arguments[0].span.clone(), message).help("leave `deg` out"))
            }
            _ => {
                let wrong = |(_, found): &(&ExpressionTree, &Option<KnownDimension>)| {
                    found.is_some_and(|known| known.is_firm && !known.dimension.is_number())
                };
                let Some((argument, Some(known))) = arguments.iter().zip(&found).find(wrong) else { return Ok(number) };
                let message =
                    format!("`{}` takes a number or an angle, and this is {}", function.name(), known.dimension);
                Err(Diagnostic::new(argument.span.clone(), message).help("divide it by a quantity of the same kind"))
            }
        }
    }
}

/// The dimension of a sum, a difference, or the larger of two.
fn same(left: Option<KnownDimension>, right: Option<KnownDimension>, at: &ExpressionTree) -> Inferred {
    match (left, right) {
        (Some(left), Some(right)) if left.contradicts(right) => {
            let message = format!("{} and {} cannot be added or compared", left.dimension, right.dimension);
            let error = Diagnostic::new(at.span.clone(), message).label(format!("this is {}", right.dimension));
            Err(if left.dimension.is_like(right.dimension) { error.help(CYCLES) } else { error })
        }
        (Some(left), _) if left.is_firm => Ok(Some(left)),
        (left, right) => Ok(right.filter(|right| right.is_firm).or(left.filter(|_| right.is_some()))),
    }
}

fn product(left: Option<KnownDimension>, right: Option<KnownDimension>, power: f64) -> Option<KnownDimension> {
    let (left, right) = (left?, right?);
    let dimension = left.dimension.times(right.dimension, power)?;
    Some(KnownDimension { dimension, is_firm: left.is_firm || right.is_firm })
}

fn root(known: KnownDimension, power: f64) -> Option<KnownDimension> {
    let dimension = Dimension::NUMBER.times(known.dimension, power)?;
    Some(KnownDimension { dimension, ..known })
}

fn power(base: Option<KnownDimension>, exponent: &ExpressionTree) -> Option<KnownDimension> {
    root(base?, exponent.as_number()?)
}
