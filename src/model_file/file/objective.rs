//! `[objective]`: the function that is minimized.

use super::key::{Accepts, Key, TableKeys, default, optional};
use super::naming;
use super::quantity::{CompiledQuantity, QuantityContext};
use super::section::{Read, Section};
use crate::model_file::Diagnostic;
use crate::model_file::expression::Names;
use crate::problem::{DesignVariable, Goal, ProblemBuilder, Quantity, TimeGrid};

const KEYS: &[Key] = &[
    default("name", Accepts::Text, "objective", "name, for tables and axes"),
    default("unit", Accepts::Text, "", "unit, for tables and axes"),
    optional("minimize", Accepts::Quantity, "the quantity to minimize"),
    optional("maximize", Accepts::Quantity, "the quantity to maximize, in place of `minimize`"),
    optional("over", Accepts::Choice(OVER), "reduction of a history to a number"),
    default("rule", Accepts::Choice(&["simpson", "trapezoid"]), "trapezoid", "quadrature of integral and mean"),
    optional("bound", Accepts::Table, "with over = \"peak\": the variable that bounds |value| and is minimized"),
    default(
        "scale",
        Accepts::Number,
        "1",
        "with over = \"peak\": normalization of the two constraints, in the unit of the value",
    ),
    optional("directly_in", Accepts::Intermediate, "approximates the objective itself, linearized in these variables"),
];
const OVER: &[&str] = &["peak", "sum", "integral", "mean"];
const REDUCTIONS: &[(&str, Over)] =
    &[("peak", Over::Peak), ("sum", Over::Sum), ("integral", Over::Integral), ("mean", Over::Mean)];
const BOUND: &[Key] = &[default("name", Accepts::Name, "peak", "name of the variable")];

/// Declarations for documentation and schema.
pub const TABLES: &[TableKeys] = &[
    TableKeys { name: "objective", kind: None, about: "the function to minimize", keys: KEYS },
    TableKeys { name: "objective.bound", kind: None, about: "the variable that bounds a peak", keys: BOUND },
    TableKeys { name: "objective.bound", kind: None, about: "the variable that bounds a peak", keys: naming::DESIGN },
];

/// Reduction of a history to a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Over {
    Peak,
    Sum,
    Integral,
    Mean,
}

/// The objective.
pub enum ObjectiveSpec {
    /// A number.
    Number { name: String, unit: String, quantity: Quantity, goal: Goal },
    /// The peak of a history, bounded by a variable.
    Peak { bound: DesignVariable, quantity: Quantity, scale: f64 },
}

/// The variable that bounds a peak. It is a design variable like any other.
pub fn read_bound(file: &Section<'_>, names: &mut Names) -> Read<Option<DesignVariable>> {
    let Some(section) = file.inner("objective", &[KEYS])? else { return Ok(None) };
    let Some(bound) = section.inner("bound", &[BOUND, naming::DESIGN])? else { return Ok(None) };
    let word = bound.need_word("name")?;
    names.check(&word.text, word.span)?;
    let variable = naming::variable(&word.text, &bound, names)?;
    names.design(&word.text);
    Ok(Some(variable))
}

/// Reads `[objective]`.
pub fn read(file: &Section<'_>, known: &QuantityContext<'_>, bound: Option<DesignVariable>) -> Read<ObjectiveSpec> {
    let Some(section) = file.inner("objective", &[KEYS])? else {
        let help = "add [objective] with minimize = \"…\"";
        return Err(Diagnostic::new(file.span.start..file.span.start, "there is no objective").help(help));
    };
    let (key, goal) = match (section.has("minimize"), section.has("maximize")) {
        (true, false) => ("minimize", Goal::Minimize),
        (false, true) => ("maximize", Goal::Maximize),
        (true, true) => return Err(section.error_at("maximize", "`minimize` and `maximize` exclude each other")),
        (false, false) => return Err(section.error_at("minimize", "[objective] lacks `minimize` or `maximize`")),
    };
    let tree = section.tree(key)?.expect("the key is there");
    let value = known.compile(&tree, key)?;
    let over = match section.word("over")? {
        Some(_) => Some(section.choice("over", REDUCTIONS)?),
        None => None,
    };
    match (over, bound) {
        (None, _) if value.is_transient => {
            let help = "reduce it to a number: over = \"peak\", \"sum\", \"integral\" or \"mean\"";
            Err(section.error_at(key, "the objective is a history, not a number").help(help))
        }
        (Some(_), _) if !value.is_transient => {
            Err(section.error_at("over", "`over` applies to histories, and the objective is a number"))
        }
        (Some(Over::Peak), Some(bound)) if goal == Goal::Minimize => peak(&section, known, value, bound),
        (Some(Over::Peak), None) => {
            let help = "for instance bound = { name = \"peak\", start = 1.0, lower = 0.0 }";
            Err(section.error_at("over", "over = \"peak\" needs a variable that bounds the peak").help(help))
        }
        (Some(Over::Peak), _) => Err(section.error_at("maximize", "a peak can only be minimized")),
        (_, Some(_)) => Err(section.error_at("bound", "`bound` belongs to over = \"peak\"")),
        (over, None) => number(&section, known, value, goal, over),
    }
}

fn peak(
    section: &Section<'_>,
    known: &QuantityContext<'_>,
    value: CompiledQuantity,
    bound: DesignVariable,
) -> Read<ObjectiveSpec> {
    let scale = section.number("scale", known.names)?.unwrap_or(1.0);
    if scale <= 0.0 {
        return Err(section.error_at("scale", "`scale` must be positive"));
    }
    Ok(ObjectiveSpec::Peak { bound, quantity: value.quantity(), scale })
}

fn number(
    section: &Section<'_>,
    known: &QuantityContext<'_>,
    value: CompiledQuantity,
    goal: Goal,
    over: Option<Over>,
) -> Read<ObjectiveSpec> {
    let quantity = match (over, known.grid) {
        (Some(over), Some(grid)) => Quantity::sum(0, weights(section, over, grid)?, value.function).of(&value.uses),
        _ => value.quantity(),
    };
    let quantity = known.linearized(section, quantity)?;
    Ok(ObjectiveSpec::Number { name: section.text("name")?, unit: section.text("unit")?, quantity, goal })
}

/// Weights of a sum, an integral or a mean.
fn weights(section: &Section<'_>, over: Over, grid: &TimeGrid) -> Read<Vec<f64>> {
    if over == Over::Sum {
        return Ok(vec![1.0; grid.len()]);
    }
    let is_simpson = section.choice("rule", &[("simpson", true), ("trapezoid", false)])?;
    let simpson = || grid.simpson().map_err(|e| section.error_at("rule", e.to_string()));
    let weights = if is_simpson { simpson()? } else { grid.trapezoid() };
    let whole = if over == Over::Mean { grid.span() } else { 1.0 };
    Ok(weights.into_iter().map(|w| w / whole).collect())
}

impl ObjectiveSpec {
    /// Adds the objective to a problem.
    pub fn build(&self, parts: &mut ProblemBuilder) {
        match self {
            Self::Number { name, unit, quantity, goal: Goal::Maximize } => parts.maximize(name, unit, quantity.clone()),
            Self::Number { name, unit, quantity, .. } => parts.minimize(name, unit, quantity.clone()),
            Self::Peak { bound, quantity, scale } => {
                parts.minimize_peak(bound.clone(), quantity.clone(), *scale);
            }
        }
    }
}
