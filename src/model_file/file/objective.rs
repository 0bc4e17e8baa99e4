//! `[objective]`: the function that is minimized.

use super::event_sides::EventSides;
use super::key::{Accepts, Key, TableKeys, default, optional};
use super::naming;
use super::outputs::{OutputSpec, SHOWN_IN, converted, shown_in};
use super::quantity::{CompiledQuantity, Extreme, QuantityContext};
use super::section::{Read, Section};
use crate::Result;
use crate::model_file::Diagnostic;
use crate::model_file::expression::{ExpressionTree, Names, Node, Reduction};
use crate::model_file::unit::{KnownDimension, Unit};
use crate::problem::{
    Analysis, Constraint, ContinuousTime, DesignVariable, Goal, GradientMethod, Problem, ProblemBuilder, Quantity,
    ResponseAt, ResponseSum, Responses, TimeGrid,
};
use nalgebra::DMatrix;

const KEYS: &[Key] = &[
    default("name", Accepts::Text, "objective", "name, for tables and axes"),
    default("unit", Accepts::Text, "", "unit, for tables and axes"),
    optional(
        "minimize",
        Accepts::Quantities,
        "the quantity to minimize, or a list whose largest number, or with over = \"peak\" largest peak, is minimized",
    )
    .of_any_unit(),
    optional("maximize", Accepts::Quantity, "the quantity to maximize, in place of `minimize`").of_any_unit(),
    SHOWN_IN,
    optional("over", Accepts::Choice(OVER), "reduction of a history to a number"),
    default("rule", Accepts::Choice(&["simpson", "trapezoid"]), "trapezoid", "quadrature of integral and mean"),
    optional(
        "bound",
        Accepts::Table,
        "with over = \"peak\" or a list: the variable that bounds |value|, or the numbers of the list, and is minimized; by default `peak`",
    ),
    optional(
        "scale",
        Accepts::Number,
        "with over = \"peak\" or a list: normalization of the constraints, in the unit of the value; by default the peak at the start design",
    )
    .of_any_unit(),
    default(
        "continuous",
        Accepts::Flag,
        "false",
        "with over = \"peak\": whether the peak is the one between the time points, too",
    ),
    optional("directly_in", Accepts::Intermediate, "approximates the objective itself, linearized in these variables"),
];
const OVER: &[&str] = &["peak", "sum", "integral", "mean"];
const OVER_WORDS: &[(&str, Over)] =
    &[("peak", Over::Peak), ("sum", Over::Sum), ("integral", Over::Integral), ("mean", Over::Mean)];
const BOUND: &[Key] = &[
    default("name", Accepts::Name, "peak", "name of the variable"),
    optional("start", Accepts::Number, "start value; by default the peak at the start design").of_any_unit(),
    optional("lower", Accepts::Number, "lower bound; none by default").of_any_unit(),
    optional("upper", Accepts::Number, "upper bound; none by default").of_any_unit(),
    default("unit", Accepts::Text, "", "unit, for tables and axes; by default that of the objective"),
];

/// Declarations for documentation and schema.
pub const TABLES: &[TableKeys] = &[
    TableKeys { name: "objective", kind: None, about: "the function to minimize", keys: KEYS },
    TableKeys { name: "objective.bound", kind: None, about: "the variable that bounds a peak", keys: BOUND },
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
    Peak(PeakSpec),
}

/// The peak of a history. Members that are `None` are computed from the peak at the start design.
pub struct PeakSpec {
    name: Option<String>,
    bound: DesignVariable,
    has_start: bool,
    /// The histories; the largest of their peaks is minimized.
    histories: Vec<BoundedHistory>,
    scale: Option<f64>,
    /// True if the peaks between the time points count, too.
    is_continuous: bool,
}

/// A history whose peak, or largest value, is minimized; or a number.
struct BoundedHistory {
    quantity: Quantity,
    is_maximum: bool,
    /// First and last time; the whole history without.
    window: Option<[f64; 2]>,
}

/// The variable that bounds a peak, and whether the file has its start. It is a design variable like any other.
pub struct BoundVariable {
    pub variable: DesignVariable,
    unit: Option<Unit>,
    has_start: bool,
}

/// Reads the variable that bounds a peak, or makes the default one.
pub fn read_bound(file: &Section<'_>, names: &mut Names, outputs: &[OutputSpec]) -> Read<Option<BoundVariable>> {
    let Some(section) = file.inner("objective", &[KEYS])? else { return Ok(None) };
    let unit = stored_unit(&section, outputs)?;
    let bound = section.inner("bound", &[BOUND])?;
    let minimized = section.trees("minimize")?;
    let is_largest = is_largest(&minimized, section.has("over"));
    let is_peak = section.word("over")?.is_some_and(|word| word.text == "peak")
        || is_largest
        || minimized.iter().any(|tree| bounded(tree).is_some());
    let may_be_negative = |tree: &ExpressionTree| match bounded(tree) {
        Some((reduction, _)) => reduction == Reduction::Max,
        None => is_largest,
    };
    let lower = if minimized.iter().any(may_be_negative) { f64::NEG_INFINITY } else { 0.0 };
    let (variable, has_start) = match &bound {
        Some(bound) => {
            let word = bound.need_word("name")?;
            names.check(&word.text, word.span)?;
            let start = bound.number("start", names)?;
            let variable = match start {
                Some(start) => naming::variable_from(start, &word.text, bound, names, None)?,
                // Any number inside the bounds; it is replaced when the start design is analysed.
                None => {
                    let inside = bound.number("lower", names)?.or(bound.number("upper", names)?).unwrap_or(0.0);
                    naming::variable_from(inside, &word.text, bound, names, None)?
                }
            };
            (variable, start.is_some())
        }
        None if is_peak => {
            let help = "name the variable that bounds the peak: bound = { name = \"largest\" }";
            names.check(PEAK, section.span.clone()).map_err(|error| error.help(help))?;
            (DesignVariable::new(PEAK, "", 0.0).within(lower, f64::INFINITY), false)
        }
        None => return Ok(None),
    };
    let Some(unit) = unit else {
        names.design(&variable.name);
        return Ok(Some(BoundVariable { variable, unit, has_start }));
    };
    names.design_in(&variable.name, unit.clone());
    let variable = DesignVariable {
        start: unit.of_si(variable.start),
        lower: unit.of_si(variable.lower),
        upper: unit.of_si(variable.upper),
        unit: unit.text.clone(),
        ..variable
    };
    Ok(Some(BoundVariable { variable, unit: Some(unit), has_start }))
}

/// The unit in which the objective is stored: `shown_in`, or that of the outputs that it consists of. `None` for SI.
fn stored_unit(section: &Section<'_>, outputs: &[OutputSpec]) -> Read<Option<Unit>> {
    if let Some(unit) = shown_in(section)? {
        return Ok(Some(unit));
    }
    let key = if section.has("minimize") { "minimize" } else { "maximize" };
    let is_reduced = section.word("over")?.is_some_and(|word| word.text != "peak");
    let of_tree = |tree: &ExpressionTree| match &bounded(tree).map_or(tree, |(_, history)| history).node {
        Node::Name(name) if !is_reduced => outputs.iter().find(|output| output.name == *name)?.shown_in.clone(),
        _ => None,
    };
    let units: Vec<Option<Unit>> = section.trees(key)?.iter().map(of_tree).collect();
    if units.iter().any(|unit| *unit != units[0]) {
        return Err(section.error_at(key, "these quantities are shown in different units").help("add `shown_in`"));
    }
    Ok(units.into_iter().next().flatten())
}

/// The unit to which the values of the objective are converted: `shown_in`, or that of a design variable that is minimized itself.
/// `None` for outputs that are stored in this unit.
fn conversion(section: &Section<'_>, known: &QuantityContext<'_>, trees: &[ExpressionTree]) -> Read<Option<Unit>> {
    let shown = shown_in(section)?;
    let is_stored = |tree: &ExpressionTree| {
        let Node::Name(name) = &tree.node else { return false };
        shown.is_some() && known.outputs.iter().any(|output| output.name == *name && output.shown_in == shown)
    };
    if trees.iter().all(is_stored) {
        return Ok(None);
    }
    let [ExpressionTree { node: Node::Name(name), .. }] = trees else { return shown_in(section) };
    let is_variable = known.variables.iter().any(|variable| variable.name == *name);
    let own = known.names.unit_of(name).filter(|_| is_variable && !section.has("unit")).cloned();
    Ok(shown_in(section)?.or(own))
}

/// Name of the variable that bounds a peak, unless the file names it.
const PEAK: &str = "peak";

/// The key of the quantity, and whether it is minimized.
fn goal_of(section: &Section<'_>) -> Read<(&'static str, Goal)> {
    match (section.has("minimize"), section.has("maximize")) {
        (true, false) => Ok(("minimize", Goal::Minimize)),
        (false, true) => Ok(("maximize", Goal::Maximize)),
        (true, true) => Err(section.error_at("maximize", "`minimize` and `maximize` exclude each other")),
        (false, false) => Err(section.error_at("minimize", "[objective] lacks `minimize` or `maximize`")),
    }
}

/// The quantities of the objective and its goal, as they are written in the file.
struct StatedObjective {
    key: &'static str,
    goal: Goal,
    /// The quantities; in place of an extreme that a variable bounds, its history.
    trees: Vec<ExpressionTree>,
    over: Option<Over>,
    /// The extremes that a variable bounds, one for each quantity; `None` for numbers, and for histories with `over`.
    extremes: Vec<Option<Extreme>>,
    /// True for several numbers, of which the largest is minimized.
    is_largest: bool,
}

impl StatedObjective {
    fn read(section: &Section<'_>, known: &QuantityContext<'_>) -> Read<Self> {
        let (key, goal) = goal_of(section)?;
        let over = match section.word("over")? {
            Some(_) => Some(section.choice("over", OVER_WORDS)?),
            None => None,
        };
        let mut trees = section.trees(key)?;
        let is_largest = goal == Goal::Minimize && is_largest(&trees, over.is_some());
        let are_bounded = trees.iter().all(|tree| bounded(tree).is_some());
        if goal != Goal::Minimize || over.is_some() || !(is_largest || are_bounded) {
            let extremes = trees.iter().map(|_| None).collect();
            return Ok(Self { key, goal, trees, over, extremes, is_largest });
        }
        let mut extremes = vec![];
        for tree in &mut trees {
            // Of a number in `peak` or `max`, the error follows later.
            let extreme = if bounded(tree).is_some() { known.extreme(tree, key)? } else { None };
            if let Some(extreme) = &extreme {
                *tree = extreme.history.clone();
            }
            extremes.push(extreme);
        }
        Ok(Self { key, goal, trees, over: Some(Over::Peak), extremes, is_largest })
    }

    /// Converts the quantities to the unit in which the objective is stored. Returns their dimension before, and this unit.
    fn convert(
        &mut self,
        section: &Section<'_>,
        known: &QuantityContext<'_>,
    ) -> Read<(Option<KnownDimension>, Option<Unit>)> {
        let dimension = self.trees.first().and_then(|tree| known.dimension(tree).ok().flatten());
        let Some(unit) = conversion(section, known, &self.trees)? else {
            return Ok((dimension, stored_unit(section, known.outputs)?));
        };
        for tree in &mut self.trees {
            let own = known.dimension(tree)?;
            *tree = converted(tree.clone(), own, &unit)?;
        }
        Ok((dimension, Some(unit)))
    }

    /// The quantities as functions. Those that have no derivatives are noted.
    fn compile(&self, section: &Section<'_>, known: &QuantityContext<'_>) -> Read<Vec<CompiledQuantity>> {
        let is_instant = (self.over.is_none() || self.is_largest) && known.grid.is_some_and(|grid| grid.len() == 1);
        let compiled = |(tree, extreme): (&ExpressionTree, &Option<Extreme>)| {
            let value = known.compile(tree, self.key)?;
            known.remark_derivative(section, tree, &value);
            if !(is_instant && value.is_transient && extreme.is_none()) {
                return Ok(value);
            }
            // A history of one time point is a number.
            let node = Node::Reduce(Reduction::Final, vec![tree.clone()]);
            known.compile(&ExpressionTree { node, span: tree.span.clone() }, self.key)
        };
        self.trees.iter().zip(&self.extremes).map(compiled).collect()
    }

    /// Checks that several quantities can be compared, as far as their dimensions are known.
    fn check_dimensions(&self, known: &QuantityContext<'_>) -> Read<()> {
        if self.trees.len() < 2 {
            return Ok(());
        }
        let mut first: Option<KnownDimension> = None;
        for tree in &self.trees {
            let Some(own) = known.dimension(tree)? else { continue };
            if first.is_some_and(|first| first.contradicts(own)) {
                let help = "divide each by a value of its kind, such as its limit";
                let message = "quantities of different kinds have no largest one";
                return Err(Diagnostic::new(tree.span.clone(), message).help(help));
            }
            first = first.or(Some(own));
        }
        Ok(())
    }
}

/// Reads `[objective]`.
pub fn read(file: &Section<'_>, known: &QuantityContext<'_>, bound: Option<BoundVariable>) -> Read<ObjectiveSpec> {
    let Some(section) = file.inner("objective", &[KEYS])? else {
        let help = "add [objective] with minimize = \"…\"";
        return Err(Diagnostic::new(file.span.start..file.span.start, "there is no objective").help(help));
    };
    let mut statement = StatedObjective::read(&section, known)?;
    statement.check_dimensions(known)?;
    let written = section.trees(statement.key)?;
    let (dimension, unit) = statement.convert(&section, known)?;
    let values = statement.compile(&section, known)?;
    let StatedObjective { key, goal, trees, over, extremes, is_largest } = statement;
    let Some(value) = values.first().cloned() else {
        return Err(section.error_at(key, "the list is empty"));
    };
    if values.len() > 1 && over != Some(Over::Peak) {
        let help = match goal {
            Goal::Maximize => {
                "to maximize the smallest of several numbers, minimize the largest of their negatives: minimize = [\"-a\", \"-b\"]"
            }
            _ => {
                "leave `over` out for numbers, whose largest is then minimized, or write one formula such as \"a + b\""
            }
        };
        let message = "of several quantities, the largest number or the largest peak can be minimized";
        return Err(section.error_at(key, message).help(help));
    }
    let history = values.iter().zip(&extremes).position(|(value, extreme)| value.is_transient && extreme.is_none());
    if let (true, Some(k)) = (is_largest, history) {
        let help = "write \"peak(…)\" for its largest magnitude or \"max(…)\" for its largest value; over = \"peak\" takes the peaks of all";
        return Err(Diagnostic::new(trees[k].span.clone(), "this quantity is a history, not a number").help(help));
    }
    match (over, bound) {
        (None, _) if value.is_transient => {
            let help = "reduce it to a number: over = \"peak\", \"sum\", \"integral\" or \"mean\", or a function such as `range(x)`";
            Err(section.error_at(key, "the objective is a history, not a number").help(help))
        }
        (Some(_), _) if !is_largest && values.iter().any(|value| !value.is_transient) => {
            let message = "`over` applies to histories, and the objective is a number";
            Err(section
                .error_at("over", message)
                .help("leave `over` out; of a list of numbers, the largest is minimized"))
        }
        (Some(Over::Peak), Some(bound)) if goal == Goal::Minimize => {
            let histories = values.into_iter().zip(extremes.iter().map(Option::as_ref)).collect();
            peak(&section, known, histories, dimension, bound)
        }
        (Some(Over::Peak), _) => {
            let help = "leave `over` out, and maximize a number: maximize = \"peak(…)\"";
            Err(section.error_at("maximize", "a peak can only be minimized").help(help))
        }
        _ if section.flag("continuous")? => {
            Err(section.error_at("continuous", "`continuous` belongs to over = \"peak\""))
        }
        (_, Some(_)) => Err(section.error_at("bound", "`bound` belongs to over = \"peak\"")),
        (over, None) => {
            if let (Some(Over::Integral | Over::Mean), Some(tree)) = (over, trees.first()) {
                known.remark_integral(&section, &tree.span, "over");
            }
            if let ([tree], None) = (&written[..], over) {
                known.remark_kinks(&section, tree, &value, goal);
            }
            let dimension = dimension.filter(|_| !matches!(over, Some(Over::Sum | Over::Integral)));
            let of_output = if over.is_none() { known.unit_of(&value).to_owned() } else { String::new() };
            let quantity = number(&section, known, value, over)?;
            let label = known.labels.read(&section, dimension, unit.as_ref())?;
            let unit = unit.filter(|_| label.is_empty()).map_or(label, |unit| unit.text);
            let unit = if unit.is_empty() { of_output } else { unit };
            Ok(ObjectiveSpec::Number { name: section.text("name")?, unit, quantity, goal })
        }
    }
}

/// True for a list of quantities without `over`: the largest of these numbers is minimized.
fn is_largest(trees: &[ExpressionTree], has_over: bool) -> bool {
    trees.len() > 1 && !has_over
}

/// The reduction and the history of `peak(history)` or `max(history)`, over an interval or not, which a variable bounds.
fn bounded(tree: &ExpressionTree) -> Option<(Reduction, &ExpressionTree)> {
    match &tree.node {
        Node::Reduce(reduction @ (Reduction::Peak | Reduction::Max), arguments) => {
            Some((*reduction, arguments.first()?))
        }
        _ => None,
    }
}

fn peak(
    section: &Section<'_>,
    known: &QuantityContext<'_>,
    values: Vec<(CompiledQuantity, Option<&Extreme>)>,
    dimension: Option<KnownDimension>,
    BoundVariable { variable: mut bound, unit: stored, has_start }: BoundVariable,
) -> Read<ObjectiveSpec> {
    let scale = match (&stored, section.tree("scale")?) {
        (Some(unit), Some(tree)) => Some(known.names.evaluate_in(&tree, "scale", unit)?),
        _ => section.number("scale", known.names)?,
    };
    if scale.is_some_and(|scale| scale <= 0.0) {
        return Err(section.error_at("scale", "`scale` must be positive"));
    }
    let unit = known.labels.read(section, dimension, stored.as_ref())?;
    if let (Some(inner), None) = (section.inner("bound", &[BOUND])?, &stored) {
        bound.unit = known.labels.read(&inner, dimension, None)?;
    }
    if bound.unit.is_empty() {
        bound.unit = if unit.is_empty() { known.unit_of(&values[0].0).to_owned() } else { unit };
    }
    let name = if section.has("name") { Some(section.text("name")?) } else { None };
    let history = |(value, extreme): (CompiledQuantity, Option<&Extreme>)| BoundedHistory {
        is_maximum: !value.is_transient || extreme.is_some_and(|extreme| extreme.reduction == Reduction::Max),
        quantity: value.quantity(),
        window: extreme.and_then(|extreme| extreme.interval),
    };
    let is_continuous = section.flag("continuous")?;
    if let Some(why) = values.iter().find_map(discrete).filter(|_| is_continuous) {
        return Err(section.error_at("continuous", format!("{why} has no peak in continuous time")).help(CONTINUOUS));
    }
    let histories = values.into_iter().map(history).collect();
    Ok(ObjectiveSpec::Peak(PeakSpec { name, bound, has_start, histories, scale, is_continuous }))
}

/// The remedy where a peak in continuous time is not available.
const CONTINUOUS: &str = "leave `continuous` out: the peak is then that of the time points, of which there may be more";

/// The reason why a history has values at the time points only; `None` if it can be evaluated between them.
fn discrete((value, extreme): &(CompiledQuantity, Option<&Extreme>)) -> Option<&'static str> {
    if !value.is_transient {
        return Some("a number");
    }
    if extreme.is_some_and(|extreme| extreme.interval.is_some()) {
        return Some("a part of a history");
    }
    value.function.uses_series().then_some("a value made of a series")
}

fn number(
    section: &Section<'_>,
    known: &QuantityContext<'_>,
    value: CompiledQuantity,
    over: Option<Over>,
) -> Read<Quantity> {
    let quantity = match (over, known.grid) {
        (Some(over), Some(grid)) => Quantity::sum(0, weights(section, over, grid)?, value.function).of(&value.uses),
        _ => value.quantity(),
    };
    known.linearized(section, quantity)
}

/// Weights of a sum, an integral or a mean.
fn weights(section: &Section<'_>, over: Over, grid: &TimeGrid) -> Read<Vec<f64>> {
    if over == Over::Sum || (over == Over::Mean && grid.len() == 1) {
        return Ok(vec![1.0; grid.len()]);
    }
    let is_simpson = section.choice("rule", &[("simpson", true), ("trapezoid", false)])?;
    let simpson = || grid.simpson().map_err(|e| section.error_at("rule", e.to_string()));
    let weights = if is_simpson { simpson()? } else { grid.trapezoid() };
    let whole = if over == Over::Mean { grid.span() } else { 1.0 };
    Ok(weights.into_iter().map(|w| w / whole).collect())
}

impl BoundedHistory {
    /// f ≤ β, and f ≥ −β for a peak, for the variable β that is not yet a part of them.
    fn sides(&self, name: &str, scale: f64, is_continuous: bool) -> Vec<Constraint> {
        let sides = match self.is_maximum {
            true => vec![Constraint::at_most(name, 0.0, self.quantity.clone())],
            // The fingerprint contains minus the lower limit: −0 gives the 0 of an upper limit of −f.
            false => Constraint::between(name, [-0.0, 0.0], self.quantity.clone()).into(),
        };
        let held = |side: Constraint| match self.window {
            Some([from, to]) => side.during(from, to),
            None => side,
        };
        let is_continuous = is_continuous && self.quantity.is_transient();
        let continued = |side: Constraint| if is_continuous { side.in_continuous_time() } else { side };
        sides.into_iter().map(|side| continued(held(side.scaled_by(scale)))).collect()
    }
}

impl PeakSpec {
    /// Adds the values of histories on both sides of each event.
    fn add_sides(&mut self, sides: &mut EventSides<'_>) {
        let at_events = |history: &BoundedHistory| -> Vec<BoundedHistory> {
            let values = sides.values(&history.quantity, history.window);
            let of_value = |(_, quantity)| BoundedHistory { quantity, is_maximum: history.is_maximum, window: None };
            values.into_iter().map(of_value).collect()
        };
        let added: Vec<BoundedHistory> = self.histories.iter().flat_map(at_events).collect();
        self.histories.extend(added);
    }

    fn build(&self, parts: &mut ProblemBuilder) {
        let scale = self.scale.unwrap_or(1.0);
        let Some((first, others)) = self.histories.split_first() else { return };
        let variable =
            parts.minimize_bound(self.bound.clone(), first.sides(&self.bound.name, scale, self.is_continuous));
        for (k, history) in others.iter().enumerate() {
            let sides = history.sides(&format!("{} {}", self.bound.name, k + 2), scale, self.is_continuous);
            for side in sides {
                parts.subject_to(side.bounded_by(variable));
            }
        }
    }
}

impl ObjectiveSpec {
    /// Adds the objective to a problem.
    pub fn build(&self, parts: &mut ProblemBuilder) {
        match self {
            Self::Number { name, unit, quantity, goal: Goal::Maximize } => parts.maximize(name, unit, quantity.clone()),
            Self::Number { name, unit, quantity, .. } => parts.minimize(name, unit, quantity.clone()),
            Self::Peak(peak) => peak.build(parts),
        }
    }

    /// Adds the values on both sides of each event to the histories of a peak.
    pub fn add_sides(&mut self, sides: &mut EventSides<'_>) {
        if let Self::Peak(peak) = self {
            peak.add_sides(sides);
        }
    }

    /// The scale of a peak becomes 1 where the file has none, as in version 1.
    pub fn keep_first_scale(&mut self) {
        if let Self::Peak(peak) = self {
            peak.scale.get_or_insert(1.0);
        }
    }

    /// Gives the objective of a problem that was made by [`build`](Self::build) the name of the file if it is a peak.
    pub fn named(&self, mut problem: Problem) -> Problem {
        if let Self::Peak(PeakSpec { name: Some(name), .. }) = self {
            problem.objective.name.clone_from(name);
        }
        problem
    }

    /// Completes a problem that was made by [`build`](Self::build): the name of a peak, and its scale and the start of its bound,
    /// which are the peak at the start design if the file has none. Analyses the start of the `variables` if they are needed. A start that cannot be
    /// analysed leaves them as they are: an optimization stops there, and other designs can be analysed.
    pub fn complete(&self, problem: Problem, variables: &[DesignVariable]) -> Result<Problem> {
        let mut problem = self.named(problem);
        let (Self::Peak(spec), Some(peak)) = (self, problem.objective.peak()) else { return Ok(problem) };
        if spec.scale.is_some() && spec.has_start {
            return Ok(problem);
        }
        // The start in the file of a run may be outside of bounds that were edited later; the problem then has another start.
        let start_of = |problem: &Problem| -> Vec<f64> {
            let bound = problem.start().split_off(variables.len());
            variables.iter().map(|variable| variable.start).chain(bound).collect()
        };
        let start = start_of(&problem);
        let Ok(responses) = problem.analyze(&start) else { return Ok(problem) };
        let evaluation = problem.evaluate(&start, &responses)?;
        let size = problem.peak_objective(&start, &evaluation).unwrap_or(0.0);
        let sides: Vec<usize> = (0..problem.constraints.len()).filter(|&j| problem.bounds_peak(j)).collect();
        let variable = &mut problem.variables[peak.variable];
        if !spec.has_start {
            variable.start = size.clamp(variable.lower, variable.upper);
        }
        if spec.scale.is_none() && size != 0.0 {
            sides.into_iter().for_each(|j| problem.constraints[j].scale = size.abs());
        }
        let design = start_of(&problem);
        problem.analysis = Box::new(RememberedStart { analysis: problem.analysis, design, responses });
        problem.check()?;
        Ok(problem)
    }
}

/// An analysis whose result at the start design is known.
struct RememberedStart {
    analysis: Box<dyn Analysis>,
    design: Vec<f64>,
    responses: Responses,
}

impl Analysis for RememberedStart {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        if b == self.design { Ok(self.responses.clone()) } else { self.analysis.analyze(b) }
    }

    fn analyze_around(&self, b: &[f64], designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
        self.analysis.analyze_around(b, designs)
    }

    fn step_tolerance(&self, b: &[f64]) -> f64 {
        self.analysis.step_tolerance(b)
    }

    fn warnings(&self, b: &[f64], responses: &Responses) -> Vec<String> {
        self.analysis.warnings(b, responses)
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        self.analysis.sensitivities(b, responses, wanted)
    }

    fn sum_sensitivities(&self, b: &[f64], responses: &Responses, sums: &[ResponseSum]) -> Result<DMatrix<f64>> {
        self.analysis.sum_sensitivities(b, responses, sums)
    }

    fn curvatures(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<Option<Vec<DMatrix<f64>>>> {
        self.analysis.curvatures(b, responses, wanted)
    }

    fn gradient_methods(&self) -> Vec<GradientMethod<'_>> {
        self.analysis.gradient_methods()
    }

    fn differentiation(&self, variables: usize, wanted: &[ResponseAt]) -> Option<&'static str> {
        self.analysis.differentiation(variables, wanted)
    }

    fn continuous(&self) -> Option<&dyn ContinuousTime> {
        self.analysis.continuous()
    }
}
