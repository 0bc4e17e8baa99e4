//! `[[constraint]]`: limits of a value, at all time points, on an interval, or in continuous time.

use super::axis::on_axis;
use super::key::{Accepts, EACH, Key, TableKeys, default, optional, required};
use super::quantity::{CompiledQuantity, Extreme, QuantityContext};
use super::section::{Read, Section};
use crate::model_file::expression::{CYCLES, ExpressionTree, MathFunction, Node, Reduction, Scope};
use crate::model_file::unit::Unit;
use crate::model_file::{Diagnostic, limits};
use crate::problem::{Constraint, Selection, TimeGrid};

/// The key of [`neighbours`].
pub const NEIGHBOURS: Key =
    optional("neighbours", Accepts::NumberOr(&["all"]), "time points that are retained before and after each maximum");
const KEYS: &[Key] = &[
    required("name", Accepts::Text, "name, unique in the file"),
    required("value", Accepts::Quantity, "the constrained quantity").of_any_unit(),
    optional("at_most", Accepts::Number, "upper limit, in SI or with a unit, in which the value is shown")
        .of_any_unit(),
    optional("at_least", Accepts::Number, "lower limit; with `at_most` there are two constraints").of_any_unit(),
    optional("equals", Accepts::Number, "the value that must be met").of_any_unit(),
    optional(
        "scale",
        Accepts::Number,
        "normalization, in the unit of the value; by default |limit|, or 1 if that is zero",
    )
    .of_any_unit(),
    optional(
        "from",
        Accepts::Number,
        "first time, or point of a sweep, at which the constraint must hold; by default the first point",
    )
    .of("s"),
    optional(
        "to",
        Accepts::Number,
        "last time, or point of a sweep, at which the constraint must hold; by default the last point",
    )
    .of("s"),
    default(
        "continuous",
        Accepts::Flag,
        "false",
        "whether the constraint must hold between the time points, too; not with `from`, `to`, `equals` or `directly_in`",
    ),
    NEIGHBOURS,
    optional("directly_in", Accepts::Intermediate, "approximates the value itself, linearized in these variables"),
    EACH,
];

/// Declarations for documentation and schema.
pub const TABLES: &[TableKeys] =
    &[TableKeys { name: "constraint", kind: None, about: "limits of a quantity", keys: KEYS }];

/// Reads the constraints.
pub fn read(file: &Section<'_>, known: &QuantityContext<'_>) -> Read<Vec<Constraint>> {
    let (mut all, mut rows): (Vec<Constraint>, usize) = (vec![], 0);
    file.read_each("constraint", |table, span| {
        let section = Section::of(table, span, "constraint", &[KEYS], file.source())?;
        for constraint in one(&section, known)? {
            if all.iter().any(|c| c.name == constraint.name) {
                let span = section.error_at("name", "").span;
                return Err(Diagnostic::used_again(span, &constraint.name));
            }
            rows += if constraint.quantity.is_transient() { known.grid.map_or(1, TimeGrid::len) } else { 1 };
            if rows > limits::ROWS {
                let message = format!("constraints and time points make more than {} values", limits::ROWS);
                return Err(section.error_at("name", message));
            }
            all.push(constraint);
        }
        Ok(())
    })?;
    Ok(all)
}

fn one(section: &Section<'_>, known: &QuantityContext<'_>) -> Read<Vec<Constraint>> {
    let name = section.text("name")?;
    let tree = section.tree("value")?.expect("the key is required");
    let (tree, interval) = as_history(section, tree, known)?;
    let (unit, is_formula) = unit(section, &tree, known)?;
    let tree = if let (Some(unit), true) = (&unit, is_formula) { tree.per(unit) } else { tree };
    let value = known.compile(&tree, "value")?;
    known.remark_derivative(section, &tree, &value);
    let limit = |key| limit(section, key, unit.as_ref(), known);
    let quantity = known.linearized(section, value.clone().quantity())?;
    let sides = match (limit("at_least")?, limit("at_most")?, limit("equals")?) {
        (None, Some(most), None) => vec![Constraint::at_most(name, most, quantity)],
        (Some(least), None, None) => vec![Constraint::at_least(name, least, quantity)],
        (None, None, Some(exactly)) => vec![Constraint::equal(name, exactly, quantity)],
        (Some(least), Some(most), None) if least <= most => Constraint::between(&name, [least, most], quantity).into(),
        (Some(least), Some(most), None) => {
            return Err(section.error_at("at_least", format!("no value is at least {least} and at most {most}")));
        }
        (None, None, None) => {
            let help = "add `at_most`, `at_least` or `equals`";
            return Err(section.error_at("at_most", format!("{} has no limit", section.title)).help(help));
        }
        _ => return Err(section.error_at("equals", "`equals` excludes other limits")),
    };
    let (scale, window, selection) =
        (scale(limit("scale")?, section)?, window(section, known, &value)?.or(interval), neighbours(section)?);
    let made = sides.into_iter().map(|mut constraint| {
        constraint.scale = scale.unwrap_or(constraint.scale);
        constraint.unit = unit.as_ref().map(|unit| unit.text.clone()).unwrap_or_default();
        (constraint.window, constraint.selection) = (window, selection);
        constraint
    });
    continuous(section, &value, made.collect(), window.is_some())
}

/// The history in place of its largest or smallest value, if the limit holds for all values then, and its interval.
///
/// The limit of a history has no kink where another time point takes over.
fn as_history(
    section: &Section<'_>,
    tree: ExpressionTree,
    known: &QuantityContext<'_>,
) -> Read<(ExpressionTree, Option<[f64; 2]>)> {
    if ["equals", "from", "to", "continuous", "directly_in"].into_iter().any(|key| section.has(key)) {
        return Ok((tree, None));
    }
    let Some(Extreme { reduction, history, interval }) = known.extreme(&tree, "value")? else {
        return Ok((tree, None));
    };
    let history = match (reduction, section.has("at_least"), section.has("at_most")) {
        (Reduction::Max, false, true) | (Reduction::Min, true, false) => history,
        (Reduction::Peak, false, true) => {
            ExpressionTree { span: tree.span, node: Node::Call(MathFunction::Abs, vec![history]) }
        }
        _ => return Ok((tree, None)),
    };
    Ok((history, interval))
}

/// The unit in which value and limits are stored, and whether the value is a formula that must be converted to it: that of the output, or
/// that of the first limit with a unit, which may be the label of the output. `None` for SI, or for numbers as they are.
fn unit(section: &Section<'_>, tree: &ExpressionTree, known: &QuantityContext<'_>) -> Read<(Option<Unit>, bool)> {
    let value = known.compile(tree, "value")?;
    let dimension = known.dimension(tree)?;
    let mut first = None;
    for key in ["at_least", "at_most", "equals", "scale"] {
        let Some(limit) = section.tree(key)? else { continue };
        let own = known.names.dimension(&limit, &Scope::NUMBER)?;
        if let (Some(own), Some(dimension)) = (own, dimension)
            && own.contradicts(dimension)
        {
            let message = format!("`{key}` is {}, and the value is {}", own.dimension, dimension.dimension);
            let error = Diagnostic::new(limit.span, message).label(format!("expected {}", dimension.dimension));
            return Err(if own.dimension.is_like(dimension.dimension) { error.help(CYCLES) } else { error });
        }
        if let (None, Some(unit)) = (&first, known.names.written_unit(&limit)) {
            // A unit whose symbol is a name of the file is an error here, not in the value.
            known.names.evaluate_in(&limit, key, unit)?;
            first = Some(unit.clone());
        }
    }
    if let Some(unit) = known.shown_in(&value) {
        return Ok((Some(unit.clone()), false));
    }
    let is_own = |unit: &Unit| unit.text == known.unit_of(&value);
    Ok(if known.is_output(&value) && first.as_ref().is_none_or(is_own) { (first, false) } else { (first, true) })
}

/// The number of a key in the unit of the value.
fn limit(section: &Section<'_>, key: &str, unit: Option<&Unit>, known: &QuantityContext<'_>) -> Read<Option<f64>> {
    match (unit, section.tree(key)?) {
        (Some(unit), Some(tree)) => known.names.evaluate_in(&tree, key, unit).map(Some),
        _ => section.number(key, known.names),
    }
}

fn scale(scale: Option<f64>, section: &Section<'_>) -> Read<Option<f64>> {
    match scale {
        Some(scale) if scale <= 0.0 => Err(section.error_at("scale", "`scale` must be positive")),
        scale => Ok(scale),
    }
}

/// The interval on which the constraint holds, if it is not the whole one.
fn window(section: &Section<'_>, known: &QuantityContext<'_>, value: &CompiledQuantity) -> Read<Option<[f64; 2]>> {
    let [from, to] = ["from", "to"].map(|key| on_axis(section, key, known.names));
    let (from, to) = (from?, to?);
    let key = if from.is_some() { "from" } else { "to" };
    if from.is_none() && to.is_none() {
        return Ok(None);
    }
    let Some(grid) = known.grid.filter(|_| value.is_transient) else {
        return Err(section.error_at(key, "an interval needs a value that changes with time"));
    };
    let interval = [from.unwrap_or(grid.points[0]), to.unwrap_or(grid.points[grid.len() - 1])];
    if !grid.points_between(interval[0], interval[1]).is_empty() {
        return Ok(Some(interval));
    }
    let [from, to] = interval.map(|t| grid.shown(t));
    Err(section.error_at(key, format!("no point is between {from} and {to} {}", grid.unit).trim_end().to_owned()))
}

/// Time points that are retained around each maximum: a number of neighbours, or all.
pub fn neighbours(section: &Section<'_>) -> Read<Option<Selection>> {
    match section.get("neighbours").map(|value| value.get_ref().is_str()) {
        None => Ok(None),
        Some(true) => section.choice("neighbours", &[("all", Selection::All)]).map(Some),
        Some(false) => Ok(section.count("neighbours", limits::POINTS)?.map(Selection::NearMaxima)),
    }
}

/// The constraints in continuous time, if the section has `continuous = true`.
fn continuous(
    section: &Section<'_>,
    value: &CompiledQuantity,
    constraints: Vec<Constraint>,
    has_window: bool,
) -> Read<Vec<Constraint>> {
    if !section.flag("continuous")? {
        return Ok(constraints);
    }
    let function = &value.function;
    let obstacle = if !value.is_transient {
        "a value that does not change with time"
    } else if section.has("equals") {
        "an equality"
    } else if section.has("directly_in") {
        "a value that is approximated directly"
    } else if has_window {
        "a constraint on an interval"
    } else if function.uses_series() {
        "a value made of a series"
    } else {
        return Ok(constraints.into_iter().map(Constraint::in_continuous_time).collect());
    };
    let error = section.error_at("continuous", format!("{obstacle} cannot hold in continuous time"));
    Err(error.help("leave `continuous` out: it then holds at the time points, of which there may be more"))
}
