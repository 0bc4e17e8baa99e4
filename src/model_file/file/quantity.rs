//! Objective and constraint quantities as formulas of outputs, and `[series]`.

use super::label::Labels;
use super::outputs::{OutputSpec, intermediates};
use super::section::{Read, Section, ordered, tree, wrong_type};
use crate::model_file::Diagnostic;
use crate::model_file::expression::{
    CompiledExpression, DesignDependence, ExpressionTree, Inputs, Names, Node, OtherUnit, Reduction, Scope,
};
use crate::model_file::unit::{KnownDimension, Unit};
use crate::problem::{DesignVariable, Function, Functional, Goal, Point, Quantity, TimeGrid};
use autodiff::Scalar;
use std::sync::Arc;

/// A series: one number for each time point.
#[derive(Clone, Debug)]
pub struct Series {
    name: String,
    times: Arc<Vec<f64>>,
    values: Arc<Vec<f64>>,
}

impl Series {
    /// The number at the time point nearest to `t`.
    fn at(&self, t: f64) -> f64 {
        let after = self.times.partition_point(|&time| time < t).min(self.times.len() - 1);
        let before = after.saturating_sub(1);
        let nearest = if t - self.times[before] < self.times[after] - t { before } else { after };
        self.values[nearest]
    }
}

/// Reads `[series]`.
pub fn series(file: &Section<'_>, names: &Names, grid: Option<&TimeGrid>) -> Read<Vec<Series>> {
    let Some(value) = file.get("series") else { return Ok(vec![]) };
    let Some(table) = value.get_ref().as_table() else { return Err(wrong_type(value, "`series`", "a table of lists")) };
    let Some(grid) = grid else {
        return Err(file.error_at("series", "a series needs time points").help("add [time] or [sweep]"));
    };
    let times = Arc::new(grid.points.clone());
    let mut all: Vec<Series> = vec![];
    for (word, value) in ordered(table) {
        names.check(&word.text, word.span.clone())?;
        let list =
            value.get_ref().as_array().ok_or_else(|| wrong_type(value, &format!("`{}`", word.text), "a list"))?;
        let number = |item| names.evaluate(&tree(item, &word.text, file.source())?, &word.text, "");
        let values = list.iter().map(number).collect::<Read<Vec<f64>>>()?;
        if values.len() != times.len() {
            let message =
                format!("the series `{}` has {} values for {} time points", word.text, values.len(), times.len());
            return Err(Diagnostic::new(value.span(), message));
        }
        all.push(Series { name: word.text, times: times.clone(), values: Arc::new(values) });
    }
    Ok(all)
}

/// Parts of a file to which objective and constraints refer.
pub struct QuantityContext<'a> {
    pub names: &'a Names,
    pub outputs: &'a [OutputSpec],
    pub series: &'a [Series],
    pub grid: Option<&'a TimeGrid>,
    /// Design variables, with the bound of a peak if the objective has one.
    pub variables: &'a [DesignVariable],
    pub labels: &'a Labels,
    /// True if the mechanism has events, rigid contacts or dry friction, at which outputs may jump.
    pub has_events: bool,
}

/// A formula of outputs, series, design variables and time.
#[derive(Clone, Debug)]
pub struct OutputFormula {
    expression: CompiledExpression,
    series: Vec<Series>,
}

/// The largest magnitude, largest or smallest value of a history.
pub struct Extreme {
    pub reduction: Reduction,
    pub history: ExpressionTree,
    /// First and last time; the whole history without.
    pub interval: Option<[f64; 2]>,
}

/// A compiled formula with the outputs that it uses, in the order of its inputs.
#[derive(Clone, Debug)]
pub struct CompiledQuantity {
    pub function: OutputFormula,
    pub uses: Vec<usize>,
    /// `true` if the quantity has a value at each time point.
    pub is_transient: bool,
    /// `true` if the formula is the name of an output.
    is_output: bool,
    /// The reductions of the formula, if it has some.
    reduced: Option<ReducedFormula>,
    change: DesignDependence,
}

/// A formula of reductions of histories, such as `range(x)/final(x)`.
#[derive(Clone, Debug)]
pub struct ReducedFormula {
    histories: Vec<ReducedHistory>,
    /// Its other names are the outputs in use, then the reductions.
    formula: CompiledExpression,
    points: usize,
}

/// A history and its reduction over the time points of an interval.
#[derive(Clone, Debug)]
struct ReducedHistory {
    reduction: Reduction,
    number: f64,
    points: std::ops::Range<usize>,
    history: OutputFormula,
}

impl Functional for ReducedFormula {
    fn over<S: Scalar>(&self, history: &[Point<S>]) -> S {
        let reduced = self.histories.iter().map(|one| {
            let points = &history[one.points.clone()];
            let values: Vec<S> = points.iter().map(|point| one.history.at(point)).collect();
            let times: Vec<f64> = points.iter().map(|point| point.time.re()).collect();
            one.reduction.over(&values, &times, one.number)
        });
        let others: Vec<S> = history[0].response.iter().copied().chain(reduced).collect();
        self.formula.value(&Inputs { design: history[0].design, time: S::from(f64::NAN), others: &others })
    }

    fn points(&self) -> Option<usize> {
        Some(self.points)
    }
}

impl CompiledQuantity {
    /// The quantity of a problem: a number, or a value at each time point.
    pub fn quantity(self) -> Quantity {
        let grid = self.is_transient.then_some(0);
        if let Some(reduced) = self.reduced {
            return Quantity::whole(0, reduced).of(&self.uses);
        }
        match grid {
            _ if self.is_output => Quantity::response(grid, self.uses[0]),
            Some(grid) => Quantity::each_point(grid, self.function).of(&self.uses),
            None => Quantity::plain(self.function).of(&self.uses),
        }
    }
}

impl QuantityContext<'_> {
    /// The formula of a parsed expression.
    pub fn compile(&self, tree: &ExpressionTree, key: &str) -> Read<CompiledQuantity> {
        let mut outer = tree.clone();
        let reductions = outer.take_reductions();
        if !reductions.is_empty() {
            return self.reduced(&outer, &reductions, key);
        }
        let expression = self.expression(tree, key)?;
        let (uses, series) = self.used(&expression);
        let is_transient = self.is_history(&expression);
        let is_output = matches!(&tree.node, Node::Name(name) if self.outputs.iter().any(|o| o.name == *name));
        let change = expression.change(|other| self.change_of(other));
        let function = self.formula(expression, &uses, &series);
        Ok(CompiledQuantity { function, uses, is_transient, is_output, reduced: None, change })
    }

    /// An expression whose other names are the outputs, then the series, then the reductions.
    fn expression(&self, tree: &ExpressionTree, key: &str) -> Read<CompiledExpression> {
        let output = |name: &str| self.outputs.iter().position(|o| o.name == name);
        let series = |name: &str| self.series.iter().position(|s| s.name == name).map(|k| self.outputs.len() + k);
        let others = |name: &str| output(name).or_else(|| series(name));
        let reduced = |number: usize| Some(self.outputs.len() + self.series.len() + number);
        let suggestions = || {
            let outputs = self.outputs.iter().map(|o| o.name.clone());
            outputs.chain(self.series.iter().map(|s| s.name.clone())).collect()
        };
        let place = format!("`{key}`");
        let scope = Scope {
            place: &place,
            others: &others,
            reduced: &reduced,
            suggestions: &suggestions,
            other_units: &|name| self.other_unit(name),
            ..Scope::MOTION
        };
        self.names.compile(tree, &scope)
    }

    /// Dependence of an output or a series on the design: in steps, or in any other way.
    fn change_of(&self, other: usize) -> DesignDependence {
        let output = self.outputs.get(other).filter(|output| output.is_plain());
        match output.map(|output| output.formula.expression.change(|_| DesignDependence::Slopes)) {
            Some(DesignDependence::Steps) => DesignDependence::Steps,
            _ => DesignDependence::Slopes,
        }
    }

    /// Adds a note if the derivative of a value is zero everywhere, or neglects a part of the change.
    pub fn remark_derivative(&self, section: &Section<'_>, tree: &ExpressionTree, value: &CompiledQuantity) {
        let of_histories = value.reduced.iter().flat_map(|reduced| &reduced.histories).map(|one| one.reduction);
        if let Some(reduction) = of_histories.into_iter().find(|reduction| reduction.is_integral()) {
            self.remark_integral(section, &tree.span, reduction.name());
        }
        if value.change == DesignDependence::Steps {
            let message =
                "this value changes in steps: its derivative is zero, and no method can tell how to change the design";
            let help = "use a smooth function, such as `smooth_step(x, a, b)` in place of `sign(x)` or `if`";
            section.source().log.remark(Diagnostic::new(tree.span.clone(), message).help(help));
        }
    }

    /// Notes that an objective may have its best value at a kink, at which a run may stall.
    pub fn remark_kinks(&self, section: &Section<'_>, tree: &ExpressionTree, value: &CompiledQuantity, goal: Goal) {
        let mut of_histories = value.reduced.iter().flat_map(|reduced| &reduced.histories).map(|one| one.reduction);
        let Some(reduction) = of_histories.find(|one| one.is_extreme() || *one == Reduction::Range) else { return };
        // A smallest value that is minimized has its kinks elsewhere, and so has a largest one that is maximized.
        if matches!(tree.node, Node::Reduce(..)) && (reduction == Reduction::Min) == (goal == Goal::Minimize) {
            return;
        }
        let message = format!(
            "`{}` has a kink where another time point takes over, and the best value often is at one: a run may stall before it",
            reduction.name()
        );
        let help = match (reduction, goal) {
            (Reduction::Range, _) => {
                "half of `range(x)` is the peak about a design variable: minimize = \"peak(x - middle)\" with [design.middle]"
            }
            (Reduction::Min, Goal::Maximize) => {
                "minimize the largest value of the negative history, which a variable bounds: minimize = \"max(-x)\""
            }
            _ => "minimize a design variable that a constraint makes larger, or smaller, than the history",
        };
        section.source().log.remark(Diagnostic::new(tree.span.clone(), message).help(help));
    }

    /// Adds a note about what the derivative of the integral of a history neglects if the history jumps at an event.
    pub fn remark_integral(&self, section: &Section<'_>, at: &std::ops::Range<usize>, name: &str) {
        if self.has_events {
            let message = format!(
                "if its history jumps at an event, `{name}` has an error of the order of the distance of the time points there, and its \
                 derivative lacks the effect of the time of the event"
            );
            let help = "reduce a quantity that does not jump, such as the kinetic energy in place of the power, or integrate with the motion: a \
                        slider of mass 1 under the force x has the velocity ∫ x dt (docs/howto/rms.md)";
            section.source().log.remark(Diagnostic::new(at.clone(), message).help(help));
        }
    }

    /// The dimension of an output, as far as it is known.
    fn other_unit(&self, name: &str) -> Option<OtherUnit> {
        self.outputs.iter().find(|output| output.name == name)?.other_unit()
    }

    /// The dimension of a formula of outputs, if it is known.
    pub fn dimension(&self, tree: &ExpressionTree) -> Read<Option<KnownDimension>> {
        self.names.dimension(tree, &Scope { other_units: &|name| self.other_unit(name), ..Scope::MOTION })
    }

    /// Indices of the outputs and of the series that an expression uses.
    fn used(&self, expression: &CompiledExpression) -> (Vec<usize>, Vec<usize>) {
        let [outputs, all] = [self.outputs.len(), self.outputs.len() + self.series.len()];
        let used = expression.others().into_iter().filter(|k| *k < all);
        used.partition(|k| *k < outputs)
    }

    fn is_history(&self, expression: &CompiledExpression) -> bool {
        let (outputs, series) = self.used(expression);
        expression.uses_time() || !series.is_empty() || outputs.iter().any(|&h| self.outputs[h].is_transient)
    }

    /// The formula of the outputs `uses` and of `series`.
    fn formula(&self, expression: CompiledExpression, uses: &[usize], series: &[usize]) -> OutputFormula {
        let kept: Vec<usize> = uses.iter().chain(series).copied().collect();
        let series = series.iter().map(|k| self.series[k - self.outputs.len()].clone()).collect();
        OutputFormula { expression: expression.with_others(&kept), series }
    }

    /// A formula of reductions: each history is compiled on its own.
    fn reduced(&self, outer: &ExpressionTree, reductions: &[ExpressionTree], key: &str) -> Read<CompiledQuantity> {
        let whole = self.expression(outer, key)?;
        if self.is_history(&whole) {
            let message = "a formula of reductions cannot use a history beside them";
            return Err(Diagnostic::new(outer.span.clone(), message).help("reduce every history to a number"));
        }
        let Some(grid) = self.grid else {
            let message = "a reduction needs time points";
            return Err(Diagnostic::new(outer.span.clone(), message).help("add [time] or [sweep]"));
        };
        let mut parts = vec![];
        let mut uses = self.used(&whole).0;
        for tree in reductions {
            let Node::Reduce(reduction, arguments) = &tree.node else { continue };
            let (history, numbers) = arguments.split_first().expect("a reduction has a history");
            let expression = self.expression(history, key)?;
            if !self.is_history(&expression) {
                let message = format!("`{}` reduces a history, and this is a number", reduction.name());
                return Err(Diagnostic::new(history.span.clone(), message));
            }
            let axis = self.names.axis().units();
            let is_point = |k: usize| *reduction == Reduction::At || k >= usize::from(reduction.has_number());
            let number = |(k, tree)| self.names.evaluate(tree, key, if is_point(k) { &axis } else { "" });
            let numbers: Vec<f64> = numbers.iter().enumerate().map(number).collect::<Read<_>>()?;
            let (number, interval) = numbers.split_at(usize::from(reduction.has_number()));
            let points = points_of(grid, interval, tree)?;
            let number = number.first().copied().unwrap_or(0.0);
            let number = checked_number(*reduction, number, (grid, &points), tree)?;
            uses.extend(self.used(&expression).0);
            parts.push((*reduction, number, points, expression));
        }
        uses.sort_unstable();
        uses.dedup();
        let first = self.outputs.len() + self.series.len();
        let of_history = |k: usize| parts[k].3.change(|other| self.change_of(other));
        let change = whole.change(|k| if k < first { self.change_of(k) } else { of_history(k - first) });
        let kept: Vec<usize> = uses.iter().copied().chain((0..parts.len()).map(|k| first + k)).collect();
        let histories = parts.into_iter().map(|(reduction, number, points, expression)| {
            let series = self.used(&expression).1;
            ReducedHistory { reduction, number, points, history: self.formula(expression, &uses, &series) }
        });
        let histories = histories.collect();
        let formula = whole.with_others(&kept);
        let function = OutputFormula { expression: CompiledExpression::constant(0.0), series: vec![] };
        let reduced = Some(ReducedFormula { histories, formula, points: grid.len() });
        Ok(CompiledQuantity { function, uses, is_transient: false, is_output: false, reduced, change })
    }

    /// The history and the interval of `peak(x)`, `max(x)` or `min(x)`, of which a limit is a limit of all values; `None` for other trees.
    pub fn extreme(&self, tree: &ExpressionTree, key: &str) -> Read<Option<Extreme>> {
        let (Node::Reduce(reduction, arguments), Some(grid)) = (&tree.node, self.grid) else { return Ok(None) };
        let Some((history, numbers)) = arguments.split_first() else { return Ok(None) };
        if !reduction.is_extreme() || !self.compile(history, key)?.is_transient {
            return Ok(None);
        }
        let axis = self.names.axis().units();
        let ends: Vec<f64> = numbers.iter().map(|end| self.names.evaluate(end, key, &axis)).collect::<Read<_>>()?;
        points_of(grid, &ends, tree)?;
        Ok(Some(Extreme { reduction: *reduction, history: history.clone(), interval: ends.try_into().ok() }))
    }

    /// The unit in which the values of a quantity are stored, if it is an output that is shown in a unit; otherwise they are in SI.
    pub fn shown_in(&self, quantity: &CompiledQuantity) -> Option<&Unit> {
        if quantity.is_output { self.outputs[quantity.uses[0]].shown_in.as_ref() } else { None }
    }

    /// Returns `true` if a quantity is an output, without a formula.
    pub fn is_output(&self, quantity: &CompiledQuantity) -> bool {
        quantity.is_output
    }

    /// The unit of a quantity that is an output; empty for a formula.
    pub fn unit_of(&self, quantity: &CompiledQuantity) -> &str {
        if quantity.is_output { &self.outputs[quantity.uses[0]].unit } else { "" }
    }

    /// The quantity, linearized directly in the variables of the key `directly_in` if the section has it.
    pub fn linearized(&self, section: &Section<'_>, quantity: Quantity) -> Read<Quantity> {
        if !section.has("directly_in") {
            return Ok(quantity);
        }
        Ok(quantity.directly(intermediates(section, "directly_in", self.names, self.variables)?))
    }
}

/// Indices of the time points of an interval; all of them if none is given.
fn points_of(grid: &TimeGrid, interval: &[f64], tree: &ExpressionTree) -> Read<std::ops::Range<usize>> {
    let [from, to] = interval else { return Ok(0..grid.len()) };
    let points = grid.points_between(*from, *to);
    if points.len() >= 2 {
        return Ok(points);
    }
    let [from, to] = [*from, *to].map(|t| grid.shown(t));
    let message = format!("fewer than two points are between {from} and {to} {}", grid.unit);
    Err(Diagnostic::new(tree.span.clone(), message.trim_end()))
}

/// The second number of a reduction, if it is allowed.
fn checked_number(
    reduction: Reduction,
    number: f64,
    (grid, points): (&TimeGrid, &std::ops::Range<usize>),
    tree: &ExpressionTree,
) -> Read<f64> {
    let wrong = |message: String| Err(Diagnostic::new(tree.span.clone(), message));
    match reduction {
        Reduction::At => {
            let [first, last] = [grid.points[points.start], grid.points[points.end - 1]];
            if let Some(inside) = grid.inside(number).filter(|t| (first..=last).contains(t)) {
                return Ok(inside);
            }
            let [first, last, number] = [first, last, number].map(|t| grid.shown(t));
            let (name, unit) = (&grid.name, &grid.unit);
            wrong(format!("the {name} {number} is not between the first and the last point, {first} and {last} {unit}"))
        }
        Reduction::Norm if number < 1.0 => wrong("the exponent of a norm must be at least 1".to_owned()),
        Reduction::Smooth if number <= 0.0 => wrong("the sharpness must be positive".to_owned()),
        _ => Ok(number),
    }
}

impl OutputFormula {
    /// Returns `true` if the formula uses a series.
    pub fn uses_series(&self) -> bool {
        !self.series.is_empty()
    }
}

impl Function for OutputFormula {
    fn at<S: Scalar>(&self, point: &Point<S>) -> S {
        let (design, time, t) = (point.design, point.time, point.time.re());
        if self.series.is_empty() {
            return self.expression.value(&Inputs { design, time, others: point.response });
        }
        let rows = self.series.iter().map(|series| S::from(series.at(t)));
        let others: Vec<S> = point.response.iter().copied().chain(rows).collect();
        self.expression.value(&Inputs { design, time, others: &others })
    }
}
