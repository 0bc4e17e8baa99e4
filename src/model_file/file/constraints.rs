//! `[[constraint]]`: limits of a value, at all time points, on an interval, or in continuous time.

use super::key::{Accepts, EACH, Key, Table, default, optional, required};
use super::outputs::intermediates;
use super::quantity::{Explicit, Quantified, QuantityContext, Times};
use super::section::{Read, Section};
use crate::model_file::limits;
use crate::problem::{Constraint, DesignVariable, Quantity, Selection, TimeGrid};

const KEYS: &[Key] = &[
    required("name", Accepts::Text, "name, unique in the file"),
    required("value", Accepts::Quantity, "the constrained quantity"),
    optional("at_most", Accepts::Number, "upper limit, in the unit of the value"),
    optional("at_least", Accepts::Number, "lower limit; with `at_most` there are two constraints"),
    optional("equals", Accepts::Number, "the value that must be met"),
    optional(
        "scale",
        Accepts::Number,
        "normalisation, in the unit of the value; by default |limit|, or 1 if that is zero",
    ),
    optional("from", Accepts::Number, "first time at which the constraint must hold; by default the first time point"),
    optional("to", Accepts::Number, "last time at which the constraint must hold; by default the last time point"),
    default("continuous", Accepts::Flag, "false", "whether the constraint must hold between the time points, too"),
    optional("neighbours", Accepts::NumberOr(&["all"]), "time points that are retained before and after each maximum"),
    optional("directly_in", Accepts::Intermediate, "approximates the value itself, linearized in these variables"),
    EACH,
];

/// Declarations for documentation and schema.
pub const TABLES: &[Table] = &[Table { name: "constraint", kind: None, about: "limits of a quantity", keys: KEYS }];

/// Reads the constraints.
pub fn read(
    file: &Section<'_>,
    known: &QuantityContext<'_>,
    grid: Option<&TimeGrid>,
    variables: &[DesignVariable],
) -> Read<Vec<Constraint>> {
    let (mut all, mut rows): (Vec<Constraint>, usize) = (vec![], 0);
    file.each("constraint", |table, span| {
        let section = Section::of(table, span, "constraint", &[KEYS], file.source())?;
        for constraint in one(&section, known, grid, variables)? {
            if all.iter().any(|c| c.name == constraint.name) {
                return Err(section.complain("name", format!("the name `{}` is taken twice", constraint.name)));
            }
            rows += if constraint.quantity.is_transient() { grid.map_or(1, TimeGrid::len) } else { 1 };
            if rows > limits::ROWS {
                let message = format!("constraints and time points make more than {} values", limits::ROWS);
                return Err(section.complain("name", message));
            }
            all.push(constraint);
        }
        Ok(())
    })?;
    Ok(all)
}

fn one(
    section: &Section<'_>,
    known: &QuantityContext<'_>,
    grid: Option<&TimeGrid>,
    variables: &[DesignVariable],
) -> Read<Vec<Constraint>> {
    let name = section.text("name")?;
    let tree = section.tree("value")?.expect("the key is required");
    let value = known.compile(&tree, "value")?;
    let limit = |key| section.number(key, known.names);
    let sides = match (limit("at_least")?, limit("at_most")?, limit("equals")?) {
        (None, Some(most), None) => vec![(name, 1.0, most, false)],
        (Some(least), None, None) => vec![(name, -1.0, -least, false)],
        (None, None, Some(exactly)) => vec![(name, 1.0, exactly, true)],
        (Some(least), Some(most), None) if least <= most => {
            vec![(format!("{name} upper"), 1.0, most, false), (format!("{name} lower"), -1.0, -least, false)]
        }
        (Some(least), Some(most), None) => {
            return Err(section.complain("at_least", format!("no value is at least {least} and at most {most}")));
        }
        (None, None, None) => {
            let help = "add `at_most`, `at_least` or `equals`";
            return Err(section.complain("at_most", format!("{} has no limit", section.title)).help(help));
        }
        _ => return Err(section.complain("equals", "`equals` excludes other limits")),
    };
    let scale = scale(section, known)?;
    let window = window(section, known, grid, &value)?;
    let mut constraints = vec![];
    for (name, sign, limit, is_equality) in sides {
        // Outside of the interval the normalised value is zero, far from critical.
        let own = scale.unwrap_or(if limit == 0.0 { 1.0 } else { limit.abs() });
        let function = match window {
            Some(interval) => value.function.clone().within(interval, sign * (limit - own)),
            None => value.function.clone(),
        };
        let quantity = quantity(section, known, &value, Times(function, sign), variables)?;
        let made = if is_equality {
            Constraint::equal(name, limit, quantity)
        } else {
            Constraint::at_most(name, limit, quantity)
        };
        constraints.push(selected(section, made.scaled_by(own))?);
    }
    continuous(section, &value, constraints, window.is_some())
}

fn scale(section: &Section<'_>, known: &QuantityContext<'_>) -> Read<Option<f64>> {
    match section.number("scale", known.names)? {
        Some(scale) if scale <= 0.0 => Err(section.complain("scale", "`scale` must be positive")),
        scale => Ok(scale),
    }
}

/// The interval on which the constraint holds, if it is not the whole one.
fn window(
    section: &Section<'_>,
    known: &QuantityContext<'_>,
    grid: Option<&TimeGrid>,
    value: &Quantified,
) -> Read<Option<[f64; 2]>> {
    let (from, to) = (section.number("from", known.names)?, section.number("to", known.names)?);
    let key = if from.is_some() { "from" } else { "to" };
    if from.is_none() && to.is_none() {
        return Ok(None);
    }
    let Some(grid) = grid.filter(|_| value.is_transient) else {
        return Err(section.complain(key, "an interval needs a value that changes with time"));
    };
    if section.has("equals") {
        return Err(section.complain(key, "an equality holds at every time point, not on an interval"));
    }
    let interval = [from.unwrap_or(grid.points[0]), to.unwrap_or(grid.points[grid.len() - 1])];
    if grid.points.iter().any(|t| (interval[0]..=interval[1]).contains(t)) {
        return Ok(Some(interval));
    }
    Err(section.complain(key, format!("no time point is between {} and {}", interval[0], interval[1])))
}

fn quantity(
    section: &Section<'_>,
    known: &QuantityContext<'_>,
    value: &Quantified,
    function: Times,
    variables: &[DesignVariable],
) -> Read<Quantity> {
    let made = if value.is_transient { Quantity::each_point(0, function) } else { Quantity::plain(function) };
    let made = made.of(&value.uses);
    if !section.has("directly_in") {
        return Ok(made);
    }
    Ok(made.directly(intermediates(section, "directly_in", known.names, variables)?))
}

fn selected(section: &Section<'_>, constraint: Constraint) -> Read<Constraint> {
    Ok(match neighbours(section)? {
        Some(selection) => constraint.selecting(selection),
        None => constraint,
    })
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
    value: &Quantified,
    constraints: Vec<Constraint>,
    has_window: bool,
) -> Read<Vec<Constraint>> {
    if !section.flag("continuous")? {
        return Ok(constraints);
    }
    let function: &Explicit = &value.function;
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
    Err(section.complain("continuous", format!("{obstacle} cannot hold in continuous time")))
}
