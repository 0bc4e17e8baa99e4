//! Compilation of parsed expressions to operations on a stack.

use super::compiled::{CompiledExpression, StackOperation};
use super::function::FUNCTIONS;
use super::names::{Meaning, Order};
use super::reduction::REDUCTIONS;
use super::table::TableFunction;
use super::tree::{ExpressionTree, Node, Operator};
use super::{MathFunction, Names};
use crate::model_file::unit::{KnownDimension, Unit};
use crate::model_file::{Diagnostic, limits};
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// Names that an expression may use besides constants.
pub struct Scope<'a> {
    /// The quantity that the expression defines, for messages: "a mass".
    pub place: &'a str,
    /// `true` if design variables may be used.
    pub design: bool,
    /// `true` if the time may be used.
    pub time: bool,
    /// Indices of other names.
    pub others: &'a dyn Fn(&str) -> Option<usize>,
    /// Indices of the values of reductions.
    pub reduced: &'a dyn Fn(usize) -> Option<usize>,
    /// All other names, for suggestions.
    pub suggestions: &'a dyn Fn() -> Vec<String>,
    /// Units that the expression may have, as in "N/m or N·m/rad"; no check if empty.
    pub units: &'a str,
    /// Known units of other names.
    pub other_units: &'a dyn Fn(&str) -> Option<OtherUnit>,
}

/// The unit of a name that is neither a design variable nor a constant, such as a measure or an output.
#[derive(Clone, Debug)]
pub struct OtherUnit {
    /// Its dimension in expressions.
    pub known: KnownDimension,
    /// The unit of its values, if it is not the SI unit.
    pub shown: Option<Unit>,
}

impl Scope<'_> {
    /// Constants alone.
    pub const NUMBER: Self = Self { design: false, ..Self::DESIGN };
    /// Design variables.
    pub const DESIGN: Self = Self {
        place: "this number",
        design: true,
        time: false,
        others: &|_| None,
        reduced: &|_| None,
        suggestions: &Vec::new,
        units: "",
        other_units: &|_| None,
    };
    /// Design variables and the time.
    pub const MOTION: Self = Self { time: true, ..Self::DESIGN };
}

impl Names {
    /// Compiles an expression.
    ///
    /// # Errors
    /// If a name is unknown or may not be used here, a constant part is not finite, or the operations are too many.
    pub fn compile(&self, tree: &ExpressionTree, scope: &Scope) -> Result<CompiledExpression, Diagnostic> {
        let mut order = Order::default();
        for k in self.used(tree) {
            self.visit(k, &mut vec![], &mut order)?;
        }
        self.check_units(tree, scope)?;
        let mut code =
            Code { names: self, scope, known: HashMap::new(), operations: vec![], tables: vec![], top: 0, height: 0 };
        for k in order.list {
            let value = match code.tree(&self.expressions[k]) {
                // The error is in the expression that uses the name, not in the named one.
                Err(error) if error.message.contains(CANNOT) => {
                    return Err(Diagnostic { span: tree.span.clone(), ..error });
                }
                result => result?,
            };
            let named = value.map_or(Definition::Stack(code.top.saturating_sub(1)), Definition::Constant);
            code.known.insert(k, named);
        }
        if let Some(value) = code.tree(tree)? {
            code.push(StackOperation::Constant(value), &tree.span)?;
        }
        let all = self.compiled.get() + code.operations.len();
        self.compiled.set(all);
        if all > limits::ALL_OPERATIONS {
            let message = format!("all expressions together take more than {} operations", limits::ALL_OPERATIONS);
            return Err(Diagnostic::new(tree.span.clone(), message));
        }
        Ok(CompiledExpression { operations: code.operations, tables: code.tables, height: code.height })
    }

    /// Evaluates an expression of constants with one of these units; any unit if they are empty. `key` is its place in messages.
    pub(crate) fn evaluate(&self, tree: &ExpressionTree, key: &str, units: &str) -> Result<f64, Diagnostic> {
        let expression = self.compile(tree, &Scope { place: &format!("`{key}`"), units, ..Scope::NUMBER })?;
        Ok(expression.as_constant().expect("an expression of constants is folded"))
    }

    /// Evaluates an expression of constants as a number of a unit, whose dimension it must have.
    pub(crate) fn evaluate_in(&self, tree: &ExpressionTree, key: &str, unit: &Unit) -> Result<f64, Diagnostic> {
        Ok(tree.number_of(unit, self.evaluate(tree, key, &unit.text)?))
    }
}

const CANNOT: &str = "cannot be used here";

/// A compiled named expression.
#[derive(Clone, Copy)]
enum Definition {
    Constant(f64),
    /// Position of its value on the stack.
    Stack(usize),
}

struct Code<'a> {
    names: &'a Names,
    scope: &'a Scope<'a>,
    known: HashMap<usize, Definition>,
    operations: Vec<StackOperation>,
    tables: Vec<Arc<TableFunction>>,
    top: usize,
    height: usize,
}

impl Code<'_> {
    /// Emits operations that leave the value on the stack. A constant is returned, without operations.
    fn tree(&mut self, tree: &ExpressionTree) -> Result<Option<f64>, Diagnostic> {
        let constant = match &tree.node {
            Node::Number(value) => Some(*value),
            Node::Quantity(number, unit) => Some(self.quantity(*number, unit, &tree.span)?),
            Node::Name(name) => self.name(name, &tree.span)?,
            Node::Negative(inner) => match self.tree(inner)? {
                Some(value) => Some(-value),
                None => self.apply(StackOperation::Negate, &tree.span)?,
            },
            Node::Binary(..) => return self.chain(tree),
            Node::Call(MathFunction::Pow, both) => {
                let base = self.tree(&both[0])?;
                self.binary(Operator::Power, base, &both[1], &tree.span)?
            }
            Node::Call(function, arguments) => self.call(*function, arguments, &tree.span)?,
            Node::If(with_equal, parts) => self.choice(*with_equal, parts, &tree.span)?,
            Node::Table(name, argument) => self.table(name, argument, &tree.span)?,
            Node::Reduced(number) => match (self.scope.reduced)(*number) {
                Some(index) => self.push(StackOperation::Other(index), &tree.span)?,
                None => return Err(misplaced(&tree.span)),
            },
            Node::Reduce(..) => return Err(misplaced(&tree.span)),
        };
        finite(constant, &tree.span)
    }

    /// Operands with operators between them, from left to right, without recursion: a sum may have a thousand terms.
    fn chain(&mut self, tree: &ExpressionTree) -> Result<Option<f64>, Diagnostic> {
        let (mut links, mut first) = (vec![], tree);
        while let Node::Binary(operator, both) = &first.node {
            links.push((*operator, &both[1], &first.span));
            first = &both[0];
        }
        let mut left = self.tree(first)?;
        for (operator, right, span) in links.into_iter().rev() {
            left = finite(self.binary(operator, left, right, span)?, span)?;
        }
        Ok(left)
    }

    fn name(&mut self, name: &str, span: &Range<usize>) -> Result<Option<f64>, Diagnostic> {
        let Scope { place, design, time, others, .. } = self.scope;
        let cannot = |what: &str| {
            let message = format!("{what}`{name}` {CANNOT}");
            Err(Diagnostic::new(span.clone(), message).help(format!("{place} may use {}", self.scope.words())))
        };
        let axis = &self.names.axis;
        if name == axis.name() {
            return if *time { self.push(StackOperation::Time, span) } else { cannot("") };
        }
        if let ("time", Some(sweep)) = (name, axis.sweep()) {
            let message = format!("`time` has no meaning in this file, whose [sweep] is over `{sweep}`");
            return Err(Diagnostic::new(span.clone(), message).help(format!("write `{sweep}`, or use [time]")));
        }
        match self.names.meanings.get(name) {
            Some(Meaning::Constant(value)) => Ok(Some(*value)),
            Some(Meaning::Design(_)) if !design => cannot("the design variable "),
            Some(Meaning::Design(i)) => {
                self.names.designs_in_use.borrow_mut().insert(*i);
                self.push(StackOperation::Design(*i), span)?;
                self.convert(self.names.unit_of(name), span)
            }
            Some(Meaning::Expression(k)) => match self.known[k] {
                Definition::Constant(value) => Ok(Some(value)),
                Definition::Stack(place) => self.push(StackOperation::Copy(place), span),
            },
            None => match others(name) {
                Some(i) => {
                    self.push(StackOperation::Other(i), span)?;
                    self.convert((self.scope.other_units)(name).and_then(|other| other.shown).as_ref(), span)
                }
                None => Err(self.unknown(name, span)),
            },
        }
    }

    /// The value of a number with a unit.
    fn quantity(&self, number: f64, unit: &Unit, span: &Range<usize>) -> Result<f64, Diagnostic> {
        let is_name =
            |symbol: &&str| self.names.meanings.contains_key(*symbol) || (self.scope.others)(symbol).is_some();
        match unit.later_symbols().find(is_name) {
            None => Ok(unit.to_si(number)),
            Some(symbol) => {
                let message = format!("`{symbol}` is a unit here, and a name of this file");
                let error = Diagnostic::new(span.clone(), message).label("a unit or a name?");
                Err(error.help(format!(
                    "if it is the unit, choose another name for `{symbol}` in this file; if it is the name, put the number and the unit \
                     before it in parentheses"
                )))
            }
        }
    }

    /// Converts the value at the top of the stack to SI.
    fn convert(&mut self, unit: Option<&Unit>, span: &Range<usize>) -> Result<Option<f64>, Diagnostic> {
        let Some([above, below]) = unit.map(Unit::factors) else { return Ok(None) };
        if above != 1.0 {
            self.apply(StackOperation::Scale(above), span)?;
        }
        if below != 1.0 {
            self.apply(StackOperation::DivideBy(below), span)?;
        }
        Ok(None)
    }

    fn unknown(&self, name: &str, span: &Range<usize>) -> Diagnostic {
        if MathFunction::named(name).is_some() {
            return Diagnostic::new(span.clone(), format!("the function `{name}` has no arguments"))
                .label("expected `(`");
        }
        let time = self.scope.time.then_some(self.names.axis.name());
        let design = |n: &&str| self.scope.design || !matches!(self.names.meanings.get(*n), Some(Meaning::Design(_)));
        let known = self.names.order.iter().map(String::as_str).filter(design).chain(["pi"]).chain(time);
        let more = (self.scope.suggestions)();
        let known: Vec<&str> = known.chain(more.iter().map(String::as_str)).collect();
        let has_measures = known.iter().any(|name| name.contains('.'));
        let unknown = Diagnostic::unknown(span.clone(), "name", name, known);
        if name.contains('.') && !has_measures {
            return unknown.help(format!(
                "measures of the mechanism, such as `{name}`, can stand in the `value` of an [[output]]; use the name of the output here, \
                 or write the formula there"
            ));
        }
        // As in `2/s`, which divides by the name `s`.
        match Unit::parse(name) {
            // A similar name is not suggested for a name of one letter.
            Some(_) if unknown.help.is_none() || name.chars().count() == 1 => {
                unknown.help(format!("a unit stands behind its number, as in `2 {name}` or `2 1/{name}`"))
            }
            _ => unknown,
        }
    }

    /// The left operand is a constant, or on the stack.
    fn binary(
        &mut self,
        operator: Operator,
        left: Option<f64>,
        right: &ExpressionTree,
        span: &Range<usize>,
    ) -> Result<Option<f64>, Diagnostic> {
        let right = self.tree(right)?;
        let operation = match (operator, left, right) {
            (_, Some(a), Some(b)) => return Ok(Some(fold(operator, a, b))),
            (Operator::Add, Some(c), None) | (Operator::Add, None, Some(c)) => StackOperation::AddConstant(c),
            (Operator::Multiply, Some(c), None) | (Operator::Multiply, None, Some(c)) => StackOperation::Scale(c),
            (Operator::Subtract, None, Some(c)) => StackOperation::AddConstant(-c),
            (Operator::Divide, None, Some(c)) => StackOperation::DivideBy(c),
            (Operator::Power, None, Some(c)) if c.fract() == 0.0 && c.abs() <= 64.0 => {
                StackOperation::WholePower(c as i32)
            }
            (Operator::Power, None, Some(c)) => StackOperation::Power(c),
            (Operator::Subtract, Some(c), None) => {
                self.apply(StackOperation::Negate, span)?;
                StackOperation::AddConstant(c)
            }
            (Operator::Divide, Some(c), None) => {
                self.apply(StackOperation::Reciprocal, span)?;
                StackOperation::Scale(c)
            }
            (Operator::Power, Some(c), None) if c <= 0.0 => {
                let message = format!("powers of {c} are not defined for most exponents");
                return Err(Diagnostic::new(span.clone(), message).help("the base must be positive"));
            }
            (Operator::Power, Some(c), None) => {
                self.apply(StackOperation::Scale(c.ln()), span)?;
                StackOperation::Of(MathFunction::Exp)
            }
            (Operator::Add, None, None) => StackOperation::Add,
            (Operator::Subtract, None, None) => StackOperation::Subtract,
            (Operator::Multiply, None, None) => StackOperation::Multiply,
            (Operator::Divide, None, None) => StackOperation::Divide,
            (Operator::Power, None, None) => StackOperation::OfTwo(MathFunction::Pow),
        };
        self.apply(operation, span)
    }

    fn call(
        &mut self,
        function: MathFunction,
        arguments: &[ExpressionTree],
        span: &Range<usize>,
    ) -> Result<Option<f64>, Diagnostic> {
        let [first, rest @ ..] = arguments else { return Ok(None) };
        let x = self.tree(first)?;
        let Some(second) = rest.first() else {
            return match x {
                Some(x) => Ok(Some(function.of(x))),
                None => self.apply(StackOperation::Of(function), span),
            };
        };
        // A constant first operand must be below the second.
        let before = self.operations.len();
        if let Some(x) = x {
            self.push(StackOperation::Constant(x), span)?;
        }
        match (x, self.tree(second)?) {
            (Some(x), Some(y)) => {
                self.operations.truncate(before);
                self.top -= 1;
                Ok(Some(function.of_two(x, y)))
            }
            (None, Some(y)) => {
                self.push(StackOperation::Constant(y), span)?;
                self.apply(StackOperation::OfTwo(function), span)
            }
            _ => self.apply(StackOperation::OfTwo(function), span),
        }
    }

    /// A choice between two operands; if the condition is constant, only the chosen one is compiled.
    fn choice(
        &mut self,
        with_equal: bool,
        [test, yes, no]: &[ExpressionTree; 3],
        span: &Range<usize>,
    ) -> Result<Option<f64>, Diagnostic> {
        if let Some(test) = self.tree(test)? {
            let holds = test > 0.0 || with_equal && test == 0.0;
            return self.tree(if holds { yes } else { no });
        }
        for part in [yes, no] {
            if let Some(value) = self.tree(part)? {
                self.push(StackOperation::Constant(value), span)?;
            }
        }
        self.top -= 2;
        self.emit(StackOperation::Choose(with_equal), span)
    }

    fn table(&mut self, name: &str, argument: &ExpressionTree, span: &Range<usize>) -> Result<Option<f64>, Diagnostic> {
        let Some(table) = self.names.tables.get(name) else {
            let place = span.start..span.start + name.len();
            let known = FUNCTIONS.iter().map(|f| f.0).chain(REDUCTIONS.iter().map(|r| r.0)).chain(["if"]);
            let known = known.chain(self.names.tables.keys().map(String::as_str));
            // The exact place in an expression with escapes is unknown.
            let place = if place.end <= span.end { place } else { span.clone() };
            return Err(Diagnostic::unknown(place, "function", name, known));
        };
        if let Some(x) = self.tree(argument)? {
            return Ok(Some(table.at(x)));
        }
        let known = self.tables.iter().position(|known| Arc::ptr_eq(known, table));
        let k = known.unwrap_or_else(|| {
            self.tables.push(table.clone());
            self.tables.len() - 1
        });
        self.apply(StackOperation::Table(k), span)
    }

    fn push(&mut self, operation: StackOperation, span: &Range<usize>) -> Result<Option<f64>, Diagnostic> {
        self.top += 1;
        self.height = self.height.max(self.top);
        self.emit(operation, span)
    }

    fn apply(&mut self, operation: StackOperation, span: &Range<usize>) -> Result<Option<f64>, Diagnostic> {
        use StackOperation::{Add, Divide, Multiply, OfTwo, Subtract};
        self.top -= usize::from(matches!(operation, Add | Subtract | Multiply | Divide | OfTwo(_)));
        self.emit(operation, span)
    }

    fn emit(&mut self, operation: StackOperation, span: &Range<usize>) -> Result<Option<f64>, Diagnostic> {
        if self.operations.len() >= limits::OPERATIONS {
            let message = format!("this expression takes more than {} operations", limits::OPERATIONS);
            return Err(Diagnostic::new(span.clone(), message));
        }
        self.operations.push(operation);
        Ok(None)
    }
}

/// The error about a reduction of a history where none is allowed.
fn misplaced(span: &Range<usize>) -> Diagnostic {
    let message = "a reduction of a history can be used in `minimize`, `maximize` and the `value` of a constraint only";
    Diagnostic::new(span.clone(), message)
        .help("write it there, not in another reduction, an output or a named expression")
}

impl Scope<'_> {
    fn words(&self) -> &'static str {
        match (self.design, self.time) {
            (false, false) => "numbers and constants",
            (true, false) => "numbers, constants and design variables",
            (false, true) => "numbers, constants and the time",
            (true, true) => "numbers, constants, design variables and the time",
        }
    }
}

/// Rejects a constant that is not finite.
fn finite(constant: Option<f64>, span: &Range<usize>) -> Result<Option<f64>, Diagnostic> {
    match constant {
        Some(value) if !value.is_finite() => {
            Err(Diagnostic::new(span.clone(), format!("the value is {value}, not a finite number")))
        }
        constant => Ok(constant),
    }
}

fn fold(operator: Operator, a: f64, b: f64) -> f64 {
    match operator {
        Operator::Add => a + b,
        Operator::Subtract => a - b,
        Operator::Multiply => a * b,
        Operator::Divide => a / b,
        Operator::Power => a.powf(b),
    }
}
