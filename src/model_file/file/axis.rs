//! `[time]` and `[sweep]`: the points at which all histories are computed, over time or over another quantity, such as a travel.

use super::key::{Accepts, Key, TableKeys, default, optional, required};
use super::label::{self, Labels};
use super::section::{Read, Section};
use super::value::tree;
use crate::Readable;
use crate::model_file::expression::{Axis, ExpressionTree, Names, Scope};
use crate::model_file::limits;
use crate::model_file::unit::{KnownDimension, Unit};
use crate::problem::TimeGrid;

const TIME: &[Key] = &[
    default("name", Accepts::Text, "time", "name of the time, for axes"),
    default("unit", Accepts::Text, "s", "unit of the time, for axes"),
    default("from", Accepts::Number, "0", "first time point").of("s"),
    optional("to", Accepts::Number, "last time point").of("s"),
    optional("points", Accepts::Count, "number of equally spaced time points, both ends included"),
    optional("at", Accepts::Numbers, "list of all time points, in place of the three keys above").of("s"),
];

const SWEEP: &[Key] = &[
    required("variable", Accepts::Name, "name of the quantity in expressions, such as `travel`, in place of `time`"),
    optional("name", Accepts::Text, "its name for axes; by default that of the variable"),
    optional("unit", Accepts::Text, "unit of axes and tables; by default that of the points"),
    default("from", Accepts::Number, "0", "first point").of_any_unit(),
    optional("to", Accepts::Number, "last point").of_any_unit(),
    optional("points", Accepts::Count, "number of equally spaced points, both ends included"),
    optional("at", Accepts::Numbers, "list of all points, in place of the three keys above").of_any_unit(),
];

/// Declarations for documentation and schema.
pub const TABLES: &[TableKeys] = &[
    TableKeys { name: "time", kind: None, about: "the time points of all histories", keys: TIME },
    TableKeys {
        name: "sweep",
        kind: None,
        about: "points of another quantity than the time, such as a travel, for kinematics, statics and formulas",
        keys: SWEEP,
    },
];

/// Reads the name and the dimension of the independent variable of histories.
pub fn read_name(file: &Section<'_>, names: &Names) -> Read<Axis> {
    let Some(section) = file.inner("sweep", &[SWEEP])? else { return Ok(Axis::default()) };
    if file.has("time") {
        return Err(file.error_at("time", "[time] and [sweep] exclude each other").help("leave one of them out"));
    }
    let word = section.need_word("variable")?;
    if word.text.is_empty() {
        return Err(section
            .error_at("variable", "[sweep] lacks `variable`")
            .help("for instance variable = \"travel\""));
    }
    names.check(&word.text, word.span)?;
    Ok(Axis::of_sweep(word.text, known(&section, names)?))
}

/// The dimension of the points of a sweep, if one of them has a unit.
fn known(section: &Section<'_>, names: &Names) -> Read<Option<KnownDimension>> {
    let mut trees: Vec<ExpressionTree> =
        ["to", "from"].into_iter().filter_map(|key| section.tree(key).transpose()).collect::<Read<_>>()?;
    if let Some(list) = section.get("at").and_then(|value| value.get_ref().as_array()) {
        trees.extend(list.iter().map(|item| tree(item, "at", section.source())).collect::<Read<Vec<_>>>()?);
    }
    for tree in &trees {
        if let Some(known) = names.dimension(tree, &Scope::NUMBER)?.filter(|known| known.is_firm) {
            return Ok(Some(known));
        }
    }
    Ok(None)
}

/// Reads the points, if there are any.
pub fn read(file: &Section<'_>, names: &Names, labels: &Labels) -> Read<Option<TimeGrid>> {
    if let Some(section) = file.inner("sweep", &[SWEEP])? {
        let grid = grid(&section, names, "")?;
        let name = section.word("name")?.map_or_else(|| names.axis().name().to_owned(), |word| word.text);
        return Ok(Some(shown(TimeGrid { name, ..grid }, &section, names)?));
    }
    let Some(section) = file.inner("time", &[TIME])? else { return Ok(None) };
    let grid = grid(&section, names, "time ")?;
    // The parameter of a motion may be another quantity than the time.
    let time = label::time();
    let label = Unit::parse(&section.text("unit")?).map(|unit| unit.dimension);
    let time = time.filter(|time| label == Some(time.dimension));
    Ok(Some(TimeGrid { name: section.text("name")?, ..grid }.shown_in(&labels.read(&section, time, None)?, [1.0; 2])))
}

/// The points of a sweep in their unit: the key `unit`, or that of a point, or the SI unit.
fn shown(grid: TimeGrid, section: &Section<'_>, names: &Names) -> Read<TimeGrid> {
    let known = names.axis().known().map(|known| known.dimension);
    let Some(word) = section.word("unit")? else {
        let own = ["to", "from"].into_iter().filter_map(|key| section.tree(key).ok().flatten());
        let own = own.filter_map(|tree| tree.unit().cloned()).find(|unit| Some(unit.dimension) == known);
        return Ok(match (own, known) {
            (Some(unit), _) => grid.shown_in(&unit.text, unit.factors()),
            (None, Some(dimension)) => grid.shown_in(&dimension.si_unit(), [1.0; 2]),
            (None, None) => grid.shown_in("", [1.0; 2]),
        });
    };
    match (Unit::parse(&word.text), known) {
        (Some(unit), Some(dimension)) if !unit.dimension.fits(dimension) => {
            let message = format!("`unit` is {}, and the points are {dimension}", unit.dimension);
            let error = crate::model_file::Diagnostic::new(word.span, message);
            Err(error.help("leave `unit` out, or give one of the same kind"))
        }
        (Some(unit), _) => Ok(grid.shown_in(&unit.text, unit.factors())),
        // A label for numbers, such as "steps".
        (None, _) => Ok(grid.shown_in(&word.text, [1.0; 2])),
    }
}

/// The grid of a section; `what` is the kind of its points in messages.
fn grid(section: &Section<'_>, names: &Names, what: &str) -> Read<TimeGrid> {
    let points = match section.get("at") {
        Some(_) => {
            if let Some(key) = ["from", "to", "points"].into_iter().find(|key| section.has(key)) {
                return Err(section.error_at(key, format!("`{key}` and `at` exclude each other")));
            }
            let units = names.axis().units();
            super::value::numbers(section.get("at").expect("there is a list"), "at", &units, names, section.source())?
        }
        None => uniform(section, names, what)?,
    };
    if let Some(p) = (1..points.len()).find(|&p| points[p] <= points[p - 1]) {
        let message = format!("{what}points must increase, but {} follows {}", points[p], points[p - 1]);
        let help = decreasing(names).unwrap_or_else(|| format!("give strictly increasing {what}points"));
        return Err(section.error_at("at", message).help(help));
    }
    TimeGrid::new("", "", points).map_err(|e| section.error_at("at", e.to_string()))
}

/// Remedy for a sweep whose points are to decrease.
fn decreasing(names: &Names) -> Option<String> {
    let sweep = names.axis().sweep()?;
    Some(format!(
        "for a path towards smaller values, sweep the distance from its first point: variable = \"way\", from = 0, and write `first - way` in \
         place of `{sweep}`; if the order does not matter, exchange `from` and `to`"
    ))
}

fn uniform(section: &Section<'_>, names: &Names, what: &str) -> Read<Vec<f64>> {
    let number = |key: &str| on_axis(section, key, names);
    let from = number("from")?.unwrap_or(0.0);
    let (Some(to), Some(count)) = (number("to")?, section.count("points", limits::POINTS)?) else {
        let title = &section.title;
        return Err(section
            .error_at("to", format!("{title} needs `to` and `points`, or `at`"))
            .help("for instance to = 12.0 and points = 101"));
    };
    if !(from < to) {
        let [first, last] = [from, to].map(Readable);
        let error = section.error_at("to", format!("the last {what}point {last} must be after the first one, {first}"));
        let help = decreasing(names).filter(|_| to < from);
        return Err(help.into_iter().fold(error, |error, help| error.help(help)));
    }
    if count < 2 {
        return Err(section.error_at("points", format!("at least two {what}points are needed")));
    }
    let grid = TimeGrid::uniform(from, to, count).map_err(|e| section.error_at("points", e.to_string()))?;
    Ok(grid.points)
}

/// The number of a key that is a point of the time or of the sweep.
pub fn on_axis(section: &Section<'_>, key: &str, names: &Names) -> Read<Option<f64>> {
    let Some(tree) = section.tree(key)? else { return Ok(None) };
    names.evaluate(&tree, key, &names.axis().units()).map(Some)
}
