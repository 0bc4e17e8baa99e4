//! Compiled expressions: operations on a stack, over any scalar.

use super::function::{MathFunction, kinked, power};
use super::table::TableFunction;
use crate::Readable;
use autodiff::Scalar;
use std::sync::Arc;

/// Inputs of a compiled expression.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a, S> {
    /// Design variables.
    pub design: &'a [S],
    /// The time.
    pub time: S,
    /// Values of other names, such as outputs, by their indices.
    pub others: &'a [S],
}

impl<'a, S: Scalar> Inputs<'a, S> {
    /// Design variables alone.
    pub fn design(design: &'a [S]) -> Self {
        Self { design, time: S::from(f64::NAN), others: &[] }
    }

    /// Design variables and the time.
    pub fn at(design: &'a [S], time: S) -> Self {
        Self { design, time, others: &[] }
    }
}

/// An operation on the stack: it replaces the operands at the top by its result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum StackOperation {
    Constant(f64),
    Design(usize),
    Time,
    Other(usize),
    /// A copy of the value of a named expression, which is at this position of the stack.
    Copy(usize),
    Negate,
    Reciprocal,
    Add,
    Subtract,
    Multiply,
    Divide,
    AddConstant(f64),
    Scale(f64),
    DivideBy(f64),
    WholePower(i32),
    Power(f64),
    Of(MathFunction),
    OfTwo(MathFunction),
    /// A table by its number.
    Table(usize),
    /// The second operand where the first one is positive, or zero if the flag is set; otherwise the third one.
    Choose(bool),
}

use StackOperation::*;

/// Dependence of a value on time, the design and other names.
#[derive(Clone, Copy, Debug, Default)]
struct Dependence {
    /// It changes with time or with other names.
    moves: bool,
    /// It depends on the design or on other names.
    depends: bool,
    /// It jumps while it moves.
    jumps: bool,
    /// It changes its form while it moves.
    bends: bool,
}

impl Dependence {
    /// That of a function of both.
    fn joined(self, other: Self) -> Self {
        Self {
            moves: self.moves || other.moves,
            depends: self.depends || other.depends,
            jumps: self.jumps || other.jumps,
            bends: self.bends || other.bends,
        }
    }
}

/// A compiled expression. Derivatives are those of the scalar with which it is evaluated.
#[derive(Clone, Debug, PartialEq)]
pub struct CompiledExpression {
    pub(super) operations: Vec<StackOperation>,
    pub(super) tables: Vec<Arc<TableFunction>>,
    pub(super) height: usize,
}

/// Dependence of a value on the design.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DesignDependence {
    /// Not at all.
    Constant,
    /// In steps: the derivative is zero where there is one.
    Steps,
    /// With a derivative that is not zero in general.
    Slopes,
}

/// Stack height up to which no heap allocation is needed.
const LOW: usize = 16;

/// Second difference of an argument, relative to the first one, below which the argument counts as linear.
const LINEAR: f64 = 1e-9;

impl CompiledExpression {
    /// A number.
    pub fn constant(value: f64) -> Self {
        Self { operations: vec![Constant(value)], tables: vec![], height: 1 }
    }

    /// Design variable number `i`.
    pub fn variable(i: usize) -> Self {
        Self { operations: vec![Design(i)], tables: vec![], height: 1 }
    }

    /// The time, or the quantity of a sweep.
    pub fn time() -> Self {
        Self { operations: vec![Time], tables: vec![], height: 1 }
    }

    /// Other name number `i`.
    pub fn other(i: usize) -> Self {
        Self { operations: vec![Other(i)], tables: vec![], height: 1 }
    }

    /// The value for these inputs.
    pub fn value<S: Scalar>(&self, inputs: &Inputs<S>) -> S {
        if self.height <= LOW {
            self.run(inputs, &mut [S::from(0.0); LOW])
        } else {
            self.run(inputs, &mut vec![S::from(0.0); self.height])
        }
    }

    fn run<S: Scalar>(&self, inputs: &Inputs<S>, stack: &mut [S]) -> S {
        self.run_observed(inputs, stack, |_, _| {})
    }

    /// Calls `observe` with each operation that has operands, and these, at the end of the stack.
    #[inline(always)]
    fn run_observed<S: Scalar>(
        &self,
        inputs: &Inputs<S>,
        stack: &mut [S],
        mut observe: impl FnMut(StackOperation, &[S]),
    ) -> S {
        let mut top = 0;
        for operation in &self.operations {
            observe(*operation, &stack[..top]);
            let pushed = match *operation {
                Constant(value) => S::from(value),
                Design(i) => inputs.design[i],
                Time => inputs.time,
                Other(i) => inputs.others[i],
                Copy(place) => stack[place],
                Add | Subtract | Multiply | Divide | OfTwo(_) => {
                    top -= 1;
                    stack[top - 1] = two(*operation, stack[top - 1], stack[top]);
                    continue;
                }
                Table(k) => {
                    stack[top - 1] = self.tables[k].at(stack[top - 1]);
                    continue;
                }
                Choose(with_equal) => {
                    top -= 2;
                    let [test, yes, no] = [stack[top - 1], stack[top], stack[top + 1]];
                    let holds = test.re() > 0.0 || with_equal && test.re() == 0.0;
                    stack[top - 1] = kinked(if holds { yes } else { no }, test);
                    continue;
                }
                _ => {
                    stack[top - 1] = one(*operation, stack[top - 1]);
                    continue;
                }
            };
            stack[top] = pushed;
            top += 1;
        }
        stack[top - 1]
    }

    /// Times at which the function of time with these parameters changes its form: where a table is at one of its points, or an
    /// `abs`, `sign`, `min`, `max`, `smooth_step` or a condition at its kink; as far as its argument is linear in time.
    pub fn breaks(&self, parameters: &[f64]) -> Vec<f64> {
        let [zero, one, two] = [0.0, 1.0, 2.0].map(|t| self.distances_to_kinks(&Inputs::at(parameters, t)));
        let root = |((a, b), c): ((&f64, &f64), &f64)| {
            let (rate, curvature) = (b - a, (c - b) - (b - a));
            let is_linear = curvature.abs() <= LINEAR * rate.abs();
            (is_linear && rate != 0.0).then(|| -a / rate)
        };
        zero.iter().zip(&one).zip(&two).filter_map(root).collect()
    }

    /// The arguments of functions with kinks, minus the positions of the kinks.
    fn distances_to_kinks(&self, inputs: &Inputs<f64>) -> Vec<f64> {
        let mut distances = vec![];
        self.run_observed(inputs, &mut vec![0.0; self.height], |operation, operands| match (operation, operands) {
            (Table(k), [.., x]) => distances.extend(self.tables[k].points().iter().map(|point| x - point)),
            (Of(MathFunction::Abs | MathFunction::Sign), [.., x]) => distances.push(*x),
            (Of(MathFunction::SmoothStep), [.., x]) => distances.extend([*x, x - 1.0]),
            (OfTwo(MathFunction::Min | MathFunction::Max), [.., x, y]) => distances.push(x - y),
            (Choose(_), [.., test, _, _]) => distances.push(*test),
            _ => {}
        });
        distances
    }

    /// The first operation whose result is not finite although its operands are, as in `asin(1.2) is not defined: asin takes −1 to 1`.
    pub fn undefined(&self, inputs: &Inputs<f64>) -> Option<String> {
        let mut stack = vec![0.0; self.height];
        let mut top = 0usize;
        for (k, operation) in self.operations.iter().enumerate() {
            let operands = stack[top.saturating_sub(2)..top].to_vec();
            let prefix = Self { operations: self.operations[..=k].to_vec(), ..self.clone() };
            let value = prefix.run(inputs, &mut stack);
            if !value.is_finite() {
                return operation.in_words(&operands, value);
            }
            top = (top + operation.pushes()) - operation.pops();
        }
        None
    }

    /// Dependence of the value on the design, from that of the other names.
    pub fn change(&self, other: impl Fn(usize) -> DesignDependence) -> DesignDependence {
        let mut stack: Vec<DesignDependence> = vec![];
        for operation in &self.operations {
            let pushed = match *operation {
                Constant(_) | Time => DesignDependence::Constant,
                Design(_) => DesignDependence::Slopes,
                Other(i) => other(i),
                Copy(place) => stack[place],
                Of(MathFunction::Sign) => {
                    stack.pop().unwrap_or(DesignDependence::Constant).min(DesignDependence::Steps)
                }
                Choose(_) => {
                    let [test, yes, no] = [0, 1, 2].map(|k| stack[stack.len() - 3 + k]);
                    stack.truncate(stack.len() - 3);
                    yes.max(no).max(test.min(DesignDependence::Steps))
                }
                other => {
                    let operands = stack.split_off(stack.len() - 1 - other.pops());
                    operands.into_iter().max().unwrap_or(DesignDependence::Constant)
                }
            };
            stack.push(pushed);
        }
        stack.pop().unwrap_or(DesignDependence::Constant)
    }

    /// Returns `true` if the value is certain to jump during a motion, at a time that depends on the design or on other names: by `sign`, or by a
    /// condition between values that do not move. Where a factor may vanish at the jump, the answer is `false`.
    pub fn has_moving_jump(&self) -> bool {
        self.dependence().jumps
    }

    /// Returns `true` if the form of the value changes during a motion at a time that depends on the design or on other names, by a condition, or
    /// by `abs`, `sign`, `min` or `max`: its derivatives may jump there.
    pub fn has_moving_condition(&self) -> bool {
        self.dependence().bends
    }

    /// Dependence of the value on time, the design and other names.
    fn dependence(&self) -> Dependence {
        let mut stack: Vec<Dependence> = vec![];
        for operation in &self.operations {
            let pushed = match *operation {
                Constant(_) => Dependence::default(),
                Time => Dependence { moves: true, ..Dependence::default() },
                Design(_) => Dependence { depends: true, ..Dependence::default() },
                Other(_) => Dependence { moves: true, depends: true, ..Dependence::default() },
                Copy(place) => stack[place],
                operation => {
                    let operands = stack.split_off(stack.len() - 1 - operation.pops());
                    let joined = operands.iter().fold(Dependence::default(), |all, one| all.joined(*one));
                    let jumps = match (operation, &operands[..]) {
                        (Of(MathFunction::Sign), [x]) => x.moves && x.depends,
                        (Choose(_), [test, yes, no]) => {
                            yes.jumps || no.jumps || test.moves && test.depends && !yes.moves && !no.moves
                        }
                        (Multiply | Divide, [x, y]) => x.jumps && !y.moves || y.jumps && !x.moves,
                        (Add | Subtract | Negate | AddConstant(_) | Scale(_) | DivideBy(_), _) => joined.jumps,
                        _ => false,
                    };
                    let bends = match (operation, &operands[..]) {
                        (Of(MathFunction::Abs | MathFunction::Sign), [x]) => x.moves && x.depends,
                        (OfTwo(MathFunction::Min | MathFunction::Max), _) => joined.moves && joined.depends,
                        (Choose(_), [test, ..]) => test.moves && test.depends,
                        _ => false,
                    };
                    Dependence { jumps, bends: bends || joined.bends, ..joined }
                }
            };
            stack.push(pushed);
        }
        stack.pop().unwrap_or_default()
    }

    /// The number, if the expression is a constant.
    pub fn as_constant(&self) -> Option<f64> {
        match self.operations[..] {
            [Constant(value)] => Some(value),
            _ => None,
        }
    }

    /// Returns `true` if the expression is nothing but other name number `i`.
    pub fn is_other(&self, i: usize) -> bool {
        self.operations == [Other(i)]
    }

    /// Returns `true` if the expression uses the time.
    pub fn uses_time(&self) -> bool {
        self.operations.contains(&Time)
    }

    /// Indices of the design variables that the expression uses, increasing.
    pub fn uses(&self) -> Vec<usize> {
        self.indices(|operation| if let Design(i) = operation { Some(*i) } else { None })
    }

    /// Indices of the other names that the expression uses, increasing.
    pub fn others(&self) -> Vec<usize> {
        self.indices(|operation| if let Other(i) = operation { Some(*i) } else { None })
    }

    fn indices(&self, index: impl Fn(&StackOperation) -> Option<usize>) -> Vec<usize> {
        let mut found: Vec<usize> = self.operations.iter().filter_map(index).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Renumbers other names: the expression reads number `kept[k]` at index `k`.
    #[must_use]
    pub fn with_others(mut self, kept: &[usize]) -> Self {
        for operation in &mut self.operations {
            if let Other(i) = operation {
                *i = kept.iter().position(|k| k == i).expect("every other name in use is kept");
            }
        }
        self
    }

    /// Renumbers design variables: the expression reads variable `kept[k]` at index `k`.
    #[must_use]
    pub fn with_design(mut self, kept: &[usize]) -> Self {
        for operation in &mut self.operations {
            if let Design(i) = operation {
                *i = kept.iter().position(|k| k == i).expect("every design variable in use is kept");
            }
        }
        self
    }
}

impl StackOperation {
    /// Number of operands that are removed from the stack beyond the one that the result replaces.
    fn pops(self) -> usize {
        match self {
            Add | Subtract | Multiply | Divide | OfTwo(_) => 1,
            Choose(_) => 2,
            _ => 0,
        }
    }

    fn pushes(self) -> usize {
        usize::from(matches!(self, Constant(_) | Design(_) | Time | Other(_) | Copy(_)))
    }

    /// The operation on its last operands, and why its value is not finite; `None` for an operand that is not finite itself.
    fn in_words(self, operands: &[f64], value: f64) -> Option<String> {
        let [.., x, y] = [f64::NAN, f64::NAN].iter().chain(operands).copied().collect::<Vec<_>>()[..] else {
            return None;
        };
        let [shown_x, y_text] = [x, y].map(Readable);
        let text = match self {
            Constant(_) | Design(_) | Time | Other(_) | Copy(_) | Choose(_) => return None,
            Add => format!("{shown_x} + {y_text}"),
            Subtract => format!("{shown_x} - {y_text}"),
            Multiply => format!("{shown_x}*{y_text}"),
            Divide => format!("{shown_x}/{y_text}"),
            OfTwo(function) => format!("{}({shown_x}, {y_text})", function.name()),
            Of(function) => format!("{}({y_text})", function.name()),
            Reciprocal => format!("1/{y_text}"),
            WholePower(power) => format!("{y_text}^{power}"),
            Power(power) => format!("{y_text}^{power}"),
            AddConstant(c) => format!("{y_text} + {c}"),
            Scale(c) => format!("{y_text}*{c}"),
            DivideBy(c) => format!("{y_text}/{c}"),
            Negate => format!("-{y_text}"),
            Table(_) => format!("the table at {y_text}"),
        };
        let range = match self {
            Of(function) => function.range().map(|range| format!(": {} takes {range}", function.name())),
            _ => None,
        };
        let what = if value.is_nan() { "not defined" } else { "not finite" };
        Some(format!("{text} is {what}{}", range.unwrap_or_default()))
    }
}

fn one<S: Scalar>(operation: StackOperation, x: S) -> S {
    match operation {
        Negate => -x,
        Reciprocal => x.recip(),
        AddConstant(c) => x + c,
        Scale(c) => x * c,
        DivideBy(c) => x / c,
        WholePower(n) => x.powi(n),
        Power(p) => power(x, p),
        Of(function) => function.of(x),
        _ => unreachable!("an operation of one operand"),
    }
}

fn two<S: Scalar>(operation: StackOperation, x: S, y: S) -> S {
    match operation {
        Add => x + y,
        Subtract => x - y,
        Multiply => x * y,
        Divide => x / y,
        OfTwo(function) => function.of_two(x, y),
        _ => unreachable!("an operation of two operands"),
    }
}
