//! What names mean.

use super::Tree;
use super::function::FUNCTIONS;
use crate::model_file::{Diagnostic, limits};
use std::cell::Cell;
use std::collections::{HashMap, HashSet};
use std::ops::Range;

/// What a name stands for.
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
    /// Names in the order in which they came.
    pub(super) order: Vec<String>,
    pub(super) expressions: Vec<Tree>,
    designs: usize,
    /// Operations of all programs so far.
    pub(super) compiled: Cell<usize>,
}

/// Named expressions in an order in which each comes behind all that it uses.
#[derive(Default)]
pub(super) struct Order {
    pub list: Vec<usize>,
    seen: HashSet<usize>,
}

/// Names that mean something everywhere.
const RESERVED: &[&str] = &["time", "pi", "ground", "kinetic_energy", "potential_energy"];

/// Whether `text` can be a name: a letter or underscore, then letters, digits and underscores.
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

    /// Adds a constant.
    pub fn constant(&mut self, name: &str, value: f64) {
        self.add(name, Meaning::Constant(value));
    }

    /// Adds named expressions, which may use each other in any order but not in a circle.
    pub fn expressions(&mut self, named: Vec<(String, Tree)>) -> Result<(), Diagnostic> {
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

    /// Makes a named expression the constant that it is.
    pub fn settle(&mut self, name: &str, value: f64) {
        self.meanings.insert(name.to_owned(), Meaning::Constant(value));
    }

    fn add(&mut self, name: &str, meaning: Meaning) {
        self.meanings.insert(name.to_owned(), meaning);
        self.order.push(name.to_owned());
    }

    /// Refuses a name that cannot be one or means something else already.
    pub fn check(&self, name: &str, span: Range<usize>) -> Result<(), Diagnostic> {
        check_name(name, span.clone())?;
        if !self.meanings.contains_key(name) {
            return Ok(());
        }
        Err(Diagnostic::new(span, format!("the name `{name}` is taken twice")).label("second use"))
    }

    /// Appends expression `k` to `done` behind all that it uses. `way` is how it was reached.
    pub(super) fn visit(&self, k: usize, way: &mut Vec<usize>, done: &mut Order) -> Result<(), Diagnostic> {
        if done.seen.contains(&k) {
            return Ok(());
        }
        if way.contains(&k) || way.len() > limits::NESTING {
            let tree = &self.expressions[k];
            let circle: Vec<&str> = way.iter().chain([&k]).map(|&k| self.name_of(k)).collect();
            return Err(if way.contains(&k) {
                let message = format!("`{}` is defined by itself", self.name_of(k));
                Diagnostic::new(tree.span.clone(), message).help(format!("the circle is {}", circle.join(" → ")))
            } else {
                Diagnostic::new(tree.span.clone(), format!("more than {} expressions upon each other", limits::NESTING))
            });
        }
        way.push(k);
        for other in self.used(&self.expressions[k]) {
            self.visit(other, way, done)?;
        }
        way.pop();
        done.seen.insert(k);
        done.list.push(k);
        Ok(())
    }

    /// Named expressions that a tree uses directly, each once.
    pub(super) fn used(&self, tree: &Tree) -> Vec<usize> {
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

/// Refuses what cannot be a name, or means something everywhere.
pub(crate) fn check_name(name: &str, span: Range<usize>) -> Result<(), Diagnostic> {
    if !is_name(name) {
        let help = "a name starts with a letter and goes on with letters, digits and underscores";
        return Err(Diagnostic::new(span, format!("`{name}` cannot be a name")).help(help));
    }
    if RESERVED.contains(&name) || FUNCTIONS.iter().any(|f| f.0 == name) {
        return Err(Diagnostic::new(span, format!("`{name}` means something else already")).help("choose another name"));
    }
    Ok(())
}
