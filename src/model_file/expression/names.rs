//! Names in expressions: design variables, constants and named expressions.

use super::axis::Axis;
use super::function::FUNCTIONS;
use super::table::TableFunction;
use super::{ExpressionTree, Node};
use crate::model_file::unit::{KnownDimension, Unit};
use crate::model_file::{Diagnostic, limits};
use std::cell::{Cell, RefCell};
use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::sync::Arc;

/// Definition of a name.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Meaning {
    Design(usize),
    Constant(f64),
    /// Number of a named expression.
    Expression(usize),
}

/// Design variables, constants and named expressions.
#[derive(Clone, Debug, Default)]
pub struct Names {
    pub(super) meanings: HashMap<String, Meaning>,
    /// Names in the order of their definition.
    pub(super) order: Vec<String>,
    pub(super) expressions: Vec<ExpressionTree>,
    designs: usize,
    /// Units of the values of design variables; SI without one.
    pub(super) units: HashMap<String, Unit>,
    /// Functions through given points.
    pub(super) tables: HashMap<String, Arc<TableFunction>>,
    /// Units with which constants are written; their values are in SI.
    constant_units: HashMap<String, Unit>,
    /// Dimensions of constants.
    pub(super) dimensions: HashMap<String, KnownDimension>,
    /// The independent variable of histories.
    pub(super) axis: Axis,
    /// Operations of all expressions compiled so far.
    pub(super) compiled: Cell<usize>,
    /// Numbers of the design variables that an expression uses.
    pub(super) designs_in_use: RefCell<HashSet<usize>>,
}

/// Evaluation order of named expressions: each follows all that it uses.
#[derive(Default)]
pub(super) struct Order {
    pub list: Vec<usize>,
    seen: HashSet<usize>,
}

/// Reserved names.
const RESERVED: &[&str] = &["time", "pi", "if", "ground", "kinetic_energy", "potential_energy"];

/// Returns `true` if `text` can be a name: a letter or underscore, then letters, digits and underscores.
fn is_name(text: &str) -> bool {
    let mut letters = text.chars();
    letters.next().is_some_and(|c| c.is_alphabetic() || c == '_') && letters.all(|c| c.is_alphanumeric() || c == '_')
}

impl Names {
    /// Adds a design variable; the first one is number 0.
    pub fn design(&mut self, name: &str) {
        self.add(name, Meaning::Design(self.designs));
        self.designs += 1;
    }

    /// Adds a design variable whose values are in a unit. Expressions take them in SI.
    pub fn design_in(&mut self, name: &str, unit: Unit) {
        self.design(name);
        self.set_unit(name, unit);
    }

    /// Sets the unit of the values of a design variable. Expressions take them in SI.
    pub fn set_unit(&mut self, design: &str, unit: Unit) {
        self.units.insert(design.to_owned(), unit);
    }

    /// The unit of the values of a design variable; `None` if they are in SI.
    pub fn unit_of(&self, design: &str) -> Option<&Unit> {
        self.units.get(design)
    }

    /// The unit with which a number is written: its own, or that of the constant that it is.
    pub fn written_unit<'a>(&'a self, tree: &'a ExpressionTree) -> Option<&'a Unit> {
        tree.unit().or_else(|| match &tree.node {
            Node::Name(name) => self.constant_units.get(name),
            _ => None,
        })
    }

    /// Returns `true` if an expression that was compiled, or a named one that it uses, contains this design variable.
    pub fn is_in_use(&self, design: &str) -> bool {
        matches!(self.meanings.get(design), Some(Meaning::Design(k)) if self.designs_in_use.borrow().contains(k))
    }

    /// Sets the independent variable of histories.
    pub fn set_axis(&mut self, axis: Axis) {
        self.axis = axis;
    }

    /// The independent variable of histories.
    pub fn axis(&self) -> &Axis {
        &self.axis
    }

    /// Adds a table, which expressions call as a function.
    pub fn table(&mut self, name: &str, table: TableFunction) {
        self.tables.insert(name.to_owned(), Arc::new(table));
    }

    /// Adds a constant.
    pub fn constant(&mut self, name: &str, value: f64) {
        self.add(name, Meaning::Constant(value));
    }

    /// Adds named expressions, which may use each other in any order.
    ///
    /// # Errors
    /// If definitions are circular, or too many.
    pub fn expressions(&mut self, named: Vec<(String, ExpressionTree)>) -> Result<(), Diagnostic> {
        let first = self.expressions.len();
        for (name, tree) in named {
            if self.expressions.len() >= limits::NAMES {
                let message = format!("more than {} named expressions", limits::NAMES);
                return Err(Diagnostic::new(tree.span, message));
            }
            self.add(&name, Meaning::Expression(self.expressions.len()));
            self.expressions.push(tree);
        }
        let mut order = Order::default();
        (first..self.expressions.len()).try_for_each(|k| self.visit(k, &mut vec![], &mut order).map(drop))
    }

    /// Replaces a named expression by its value, of a known dimension or not.
    pub fn define_constant(&mut self, name: &str, value: f64, known: Option<KnownDimension>) {
        self.dimensions.extend(known.map(|known| (name.to_owned(), known)));
        self.meanings.insert(name.to_owned(), Meaning::Constant(value));
    }

    /// Sets the unit with which a constant is written; its value is in SI.
    pub fn set_constant_unit(&mut self, name: &str, unit: Unit) {
        self.constant_units.insert(name.to_owned(), unit);
    }

    fn add(&mut self, name: &str, meaning: Meaning) {
        self.meanings.insert(name.to_owned(), meaning);
        self.order.push(name.to_owned());
    }

    /// Checks that a name can be defined.
    ///
    /// # Errors
    /// If it is not a valid name, is reserved, or is already defined.
    pub fn check(&self, name: &str, span: Range<usize>) -> Result<(), Diagnostic> {
        check_name(name, span.clone())?;
        let is_axis = self.axis.sweep() == Some(name);
        if !(is_axis || self.meanings.contains_key(name) || self.tables.contains_key(name)) {
            return Ok(());
        }
        Err(Diagnostic::used_again(span, name))
    }

    /// Appends expression `k` to `done` after all that it uses. `path` holds the expressions that led to it.
    pub(super) fn visit(&self, k: usize, path: &mut Vec<usize>, done: &mut Order) -> Result<(), Diagnostic> {
        if done.seen.contains(&k) {
            return Ok(());
        }
        if path.contains(&k) || path.len() > limits::NESTING {
            let tree = &self.expressions[k];
            let circle: Vec<&str> = path.iter().chain([&k]).map(|&k| self.name_of(k)).collect();
            return Err(if path.contains(&k) {
                let message = format!("the definition of `{}` is circular", self.name_of(k));
                Diagnostic::new(tree.span.clone(), message).help(circle.join(" → "))
            } else {
                Diagnostic::new(
                    tree.span.clone(),
                    format!("more than {} nested levels of named expressions", limits::NESTING),
                )
            });
        }
        path.push(k);
        for other in self.used(&self.expressions[k]) {
            self.visit(other, path, done)?;
        }
        path.pop();
        done.seen.insert(k);
        done.list.push(k);
        Ok(())
    }

    /// Named expressions that a tree uses directly, each once.
    pub(super) fn used(&self, tree: &ExpressionTree) -> Vec<usize> {
        let mut found = vec![];
        tree.names(&mut |name, _| {
            if let Some(Meaning::Expression(k)) = self.meanings.get(name)
                && !found.contains(k)
            {
                found.push(*k);
            }
        });
        found
    }

    fn name_of(&self, k: usize) -> &str {
        let is = |name: &&String| self.meanings.get(*name) == Some(&Meaning::Expression(k));
        self.order.iter().find(is).map_or("", String::as_str)
    }
}

/// Checks that a text is a valid name and not reserved.
pub(crate) fn check_name(name: &str, span: Range<usize>) -> Result<(), Diagnostic> {
    if !is_name(name) {
        let help = "a name starts with a letter and continues with letters, digits and underscores";
        return Err(Diagnostic::new(span, format!("`{name}` cannot be a name")).help(help));
    }
    if RESERVED.contains(&name) || FUNCTIONS.iter().any(|f| f.0 == name) {
        let meaning = match name {
            "time" => "the time",
            "ground" => "the body at rest",
            "kinetic_energy" | "potential_energy" => "a measure of the mechanism",
            "pi" => "a number",
            _ => "a function",
        };
        let error = Diagnostic::new(span, format!("the name `{name}` is reserved"));
        return Err(
            error.help(format!("`{name}` is {meaning} in expressions; choose another name, such as `{name}_1`"))
        );
    }
    Ok(())
}
