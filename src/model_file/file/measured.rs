//! Formulas of measured quantities, of the time and of the design.

use super::measures::{self, MeasureRef, Sensors};
use super::parts::{BuildContext, Parts, position_or_push};
use super::section::Read;
use crate::Result;
use crate::model_file::expression::{CompiledExpression, ExpressionTree, Inputs, Names, Scope};
use crate::model_file::unit::KnownDimension;
use autodiff::Scalar;
use mechanics::mechanism::{Formula, WeightedQuantity};
use std::cell::RefCell;

/// A formula of measures such as `crank.theta`, of the time and of the design; without measures if there is no mechanism.
#[derive(Clone, Debug)]
pub struct MeasuredFormula {
    pub expression: CompiledExpression,
    pub measures: Vec<MeasureRef>,
}

impl MeasuredFormula {
    /// One measure.
    #[cfg(feature = "report")]
    pub fn of_measure(measure: MeasureRef) -> Self {
        Self { expression: CompiledExpression::other(0), measures: vec![measure] }
    }

    /// A number.
    pub fn constant(value: f64) -> Self {
        Self { expression: CompiledExpression::constant(value), measures: vec![] }
    }

    /// The time in s.
    pub fn time() -> Self {
        Self { expression: CompiledExpression::time(), measures: vec![] }
    }

    /// Compiles the formula at `place`, a key in backquotes, after `finish` has seen it and its dimension.
    pub fn compile(
        tree: ExpressionTree,
        place: &str,
        names: &Names,
        parts: Option<&Parts>,
        finish: impl FnOnce(ExpressionTree, Option<KnownDimension>) -> Read<ExpressionTree>,
    ) -> Read<Self> {
        let found = RefCell::new(vec![]);
        let others = |text: &str| {
            let measure = measures::find(text, parts?)?;
            Some(position_or_push(&mut found.borrow_mut(), measure))
        };
        let suggestions = || parts.map(measures::suggestions).unwrap_or_default();
        let other_units = |text: &str| measures::unit(&measures::find(text, parts?)?, parts?);
        let scope =
            Scope { place, others: &others, suggestions: &suggestions, other_units: &other_units, ..Scope::MOTION };
        let known = names.dimension(&tree, &scope)?;
        let expression = names.compile(&finish(tree, known)?, &scope)?;
        Ok(Self { expression, measures: found.into_inner() })
    }

    /// The terms of the formula, and the formula of these; `None` for their sum.
    pub fn build<S: Scalar>(
        &self,
        sensors: &mut Sensors<'_>,
        context: &mut BuildContext<S>,
        b: &[S],
    ) -> Result<(Vec<WeightedQuantity<S>>, Option<FormulaOfTerms>)> {
        let mut terms: Vec<WeightedQuantity<S>> = vec![];
        let mut counts = vec![];
        for measure in &self.measures {
            let of_one = sensors.terms(measure, context, b)?;
            counts.push(of_one.len());
            terms.extend(of_one);
        }
        if self.measures.len() == 1 && self.expression.is_other(0) {
            return Ok((terms, None));
        }
        let used = self.expression.uses();
        for &i in &used {
            terms.push(sensors.design(i, context, b)?);
        }
        Ok((terms, Some(FormulaOfTerms { expression: self.expression.clone().with_design(&used), counts })))
    }
}

/// A formula of quantities, each a sum of `counts` terms, followed by design variables.
pub struct FormulaOfTerms {
    expression: CompiledExpression,
    counts: Vec<usize>,
}

impl Formula for FormulaOfTerms {
    fn value<T: Scalar>(&self, t: T, x: &[T]) -> T {
        let (others, design) = self.sums(x);
        self.expression.value(&Inputs { design, time: t, others: &others })
    }

    fn undefined(&self, t: f64, x: &[f64]) -> Option<String> {
        let (others, design) = self.sums(x);
        self.expression.undefined(&Inputs { design, time: t, others: &others })
    }
}

impl FormulaOfTerms {
    /// The quantities, and the design variables.
    fn sums<'x, T: Scalar>(&self, x: &'x [T]) -> (Vec<T>, &'x [T]) {
        let mut rest = x;
        let sum = |count: &usize| {
            let (terms, remaining) = rest.split_at(*count);
            rest = remaining;
            terms.iter().copied().sum()
        };
        let others = self.counts.iter().map(sum).collect();
        (others, rest)
    }
}
