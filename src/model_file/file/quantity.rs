//! Objective and constraint quantities as formulas of outputs, and `[series]`.

use super::outputs::{OutputSpec, intermediates};
use super::section::{Read, Section, constant, ordered, tree, wrong_type};
use crate::model_file::Diagnostic;
use crate::model_file::expression::{CompiledExpression, Inputs, Names, Node, Scope, Tree};
use crate::problem::{DesignVariable, Function, Point, Quantity, TimeGrid};
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
        return Err(file.error_at("series", "a series needs time points").help("add [time]"));
    };
    let times = Arc::new(grid.points.clone());
    let mut all: Vec<Series> = vec![];
    for (word, value) in ordered(table) {
        names.check(&word.text, word.span.clone())?;
        let list =
            value.get_ref().as_array().ok_or_else(|| wrong_type(value, &format!("`{}`", word.text), "a list"))?;
        let number = |item| constant(&tree(item, &word.text, file.source())?, &word.text, names);
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
}

/// A formula of outputs, series, design variables and time.
#[derive(Clone, Debug)]
pub struct OutputFormula {
    expression: CompiledExpression,
    series: Vec<Series>,
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
}

impl CompiledQuantity {
    /// The quantity of a problem: a number, or a value at each time point.
    pub fn quantity(self) -> Quantity {
        let grid = self.is_transient.then_some(0);
        match grid {
            _ if self.is_output => Quantity::response(grid, self.uses[0]),
            Some(grid) => Quantity::each_point(grid, self.function).of(&self.uses),
            None => Quantity::plain(self.function).of(&self.uses),
        }
    }
}

impl QuantityContext<'_> {
    /// The formula of a parsed expression.
    pub fn compile(&self, tree: &Tree, key: &str) -> Read<CompiledQuantity> {
        let output = |name: &str| self.outputs.iter().position(|o| o.name == name);
        let series = |name: &str| self.series.iter().position(|s| s.name == name).map(|k| self.outputs.len() + k);
        let others = |name: &str| output(name).or_else(|| series(name));
        let suggestions = || {
            let outputs = self.outputs.iter().map(|o| o.name.clone());
            outputs.chain(self.series.iter().map(|s| s.name.clone())).collect()
        };
        let place = format!("`{key}`");
        let scope = Scope { place: &place, others: &others, suggestions: &suggestions, ..Scope::MOTION };
        let expression = self.names.compile(tree, &scope)?;
        let used = expression.others();
        let split = used.partition_point(|&k| k < self.outputs.len());
        let (uses, rows) = (used[..split].to_vec(), &used[split..]);
        let series: Vec<Series> = rows.iter().map(|k| self.series[k - self.outputs.len()].clone()).collect();
        let is_transient =
            expression.uses_time() || !series.is_empty() || uses.iter().any(|&h| self.outputs[h].is_transient);
        let is_output = matches!(&tree.node, Node::Name(name) if output(name).is_some());
        Ok(CompiledQuantity {
            function: OutputFormula { expression: expression.with_others(&used), series },
            uses,
            is_transient,
            is_output,
        })
    }

    /// The quantity, linearized directly in the variables of the key `directly_in` if the section has it.
    pub fn linearized(&self, section: &Section<'_>, quantity: Quantity) -> Read<Quantity> {
        if !section.has("directly_in") {
            return Ok(quantity);
        }
        Ok(quantity.directly(intermediates(section, "directly_in", self.names, self.variables)?))
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
