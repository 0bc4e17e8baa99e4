//! Sensitivities by finite differences of whole analyses, for analyses that offer no better ones.

use crate::gradient_check::{DifferenceSamples, FirstStep, ridders};
use crate::problem::{Analysis, DesignVariable, GradientMethod, ResponseAt, Responses};
use error::{Error, Result};
use nalgebra::DMatrix;

/// Designs that are analysed before their responses are reduced to the wanted ones.
const AT_ONCE: usize = 256;

/// An analysis whose sensitivities are replaced by differences of itself, with the step h_i = ε |b_i| of each variable (ε itself
/// where b_i = 0), or steps h_i that are given:
///
/// | constructor | ∂r/∂b_i ≈ | error | analyses |
/// |---|---|---|---|
/// | [`forward`](Self::forward) | D₊(h) = (r(b + h e_i) − r(b)) / h | h | n |
/// | [`central`](Self::central) | D(h) = (r(b + h e_i) − r(b − h e_i)) / 2h | h² | 2 n |
/// | [`richardson`](Self::richardson) | (4 D(h/2) − D(h)) / 3 | h⁴ | 4 n |
/// | [`noise_aware`](Self::noise_aware) | D extrapolated from 11 steps, the best one for curvature and noise | estimated | 22 n |
///
/// With [bounds](Self::with_variables) no design is outside them. If a bound is nearer than a step, all designs of this variable
/// are on the other side, with formulas of the same order and the same number of analyses.
///
/// Responses that are rounded, to single precision or to the digits of a printout, may not change at all along a step. If none of the
/// wanted ones does by any variable, and one of them is not zero, the differences are made again with longer steps, up to 1 % of the
/// typical sizes: ten times the first ones of a sequence of factors of 100 that change a response. Zero differences would indicate that the
/// design is stationary. Differences by a single variable far below its typical size, whose step is very short, are repeated in the same way.
///
/// All analyses of a sensitivity analysis are made by [`Analysis::analyze_many`], by default in parallel; the result has the same
/// bits for any number of threads. For derivatives of the whole analysis in dual numbers use the direct method.
#[derive(Clone, Debug)]
pub struct Differences<A> {
    analysis: A,
    step: DifferenceStep,
    formula: DifferenceFormula,
    /// Typical sizes of the design variables; empty if they are not known.
    sizes: Vec<f64>,
    /// Bounds of the design variables; empty if there are none.
    bounds: Vec<[f64; 2]>,
}

/// Fraction of its typical size below which a design variable counts as a rounding error, so that its own size does not determine a step.
const ROUNDING: f64 = 1e-9;
/// Fraction of the largest start below which another one counts as zero.
const NEGLIGIBLE: f64 = 1e-15;
/// Factor of a step with which no response changes at all; its largest length, relative to the typical size; and factor of the first one
/// with which a response changes, perhaps by a rounding error only.
const LONGER: f64 = 100.0;
const LONGEST: f64 = 0.01;
const CLEAR: f64 = 10.0;
/// Fraction of its typical size below which a variable that seems to have no effect has longer steps.
const SMALL: f64 = 1e-3;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum DifferenceFormula {
    Forward,
    Central,
    Richardson,
    NoiseAware,
}

#[derive(Clone, Debug)]
enum DifferenceStep {
    Relative(f64),
    Absolute(Vec<f64>),
}

impl DifferenceFormula {
    /// Name of the method, for tables and model files.
    fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Central => "central",
            Self::Richardson => "richardson",
            Self::NoiseAware => "noise-aware",
        }
    }

    /// Offsets of the analyses, in steps, and their weights in the difference times the step.
    fn points(self) -> &'static [(f64, f64)] {
        match self {
            Self::Forward => &[(1.0, 1.0)],
            Self::Central => &[(1.0, 0.5), (-1.0, -0.5)],
            Self::Richardson => &[(0.5, 4.0 / 3.0), (-0.5, -4.0 / 3.0), (1.0, -1.0 / 6.0), (-1.0, 1.0 / 6.0)],
            Self::NoiseAware => &[],
        }
    }

    /// Offsets and weights of the formula on one side of the design.
    fn one_sided_points(self) -> &'static [(f64, f64)] {
        match self {
            Self::Forward => self.points(),
            Self::Central => &[(1.0, 2.0), (2.0, -0.5)],
            Self::Richardson => &[(0.5, 8.0), (1.0, -6.0), (1.5, 8.0 / 3.0), (2.0, -0.5)],
            Self::NoiseAware => &[],
        }
    }
}

impl<A: Analysis> Differences<A> {
    /// Forward differences with the relative step ε.
    ///
    /// # Errors
    ///
    /// [`Error::Option`] unless ε is positive and finite.
    pub fn forward(analysis: A, relative_step: f64) -> Result<Self> {
        Self::new(analysis, DifferenceStep::Relative(relative_step), DifferenceFormula::Forward)
    }

    /// Forward differences with the steps h, one for each design variable and in its unit.
    ///
    /// # Errors
    ///
    /// [`Error::Option`] unless every step is positive and finite.
    pub fn forward_by(analysis: A, steps: Vec<f64>) -> Result<Self> {
        Self::new(analysis, DifferenceStep::Absolute(steps), DifferenceFormula::Forward)
    }

    /// Central differences with the relative step ε.
    ///
    /// # Errors
    ///
    /// [`Error::Option`] unless ε is positive and finite.
    pub fn central(analysis: A, relative_step: f64) -> Result<Self> {
        Self::new(analysis, DifferenceStep::Relative(relative_step), DifferenceFormula::Central)
    }

    /// Central differences with the relative steps ε and ε/2, extrapolated to zero (Richardson).
    ///
    /// # Errors
    ///
    /// [`Error::Option`] unless ε is positive and finite.
    pub fn richardson(analysis: A, relative_step: f64) -> Result<Self> {
        Self::new(analysis, DifferenceStep::Relative(relative_step), DifferenceFormula::Richardson)
    }

    /// Central differences with decreasing steps from 1 % of every variable, extrapolated in all possible ways.
    ///
    /// For each response and variable the result with the least error estimate is used, for any noise of the analysis.
    ///
    /// # Sources
    ///
    /// Ridders, *Adv. Eng. Softw.* 4 (1982) 75–76.
    pub fn noise_aware(analysis: A) -> Self {
        Self {
            analysis,
            step: DifferenceStep::Relative(1.0),
            formula: DifferenceFormula::NoiseAware,
            sizes: vec![],
            bounds: vec![],
        }
    }

    /// Sets typical sizes of the design variables, such as their values at the start. A variable that is zero, or smaller than 1e-9 of its
    /// typical size, has steps relative to that; a typical size of zero counts as 1. Without typical sizes the steps of a variable of
    /// zero are relative to 1.
    #[must_use]
    pub fn with_typical_sizes(self, sizes: Vec<f64>) -> Self {
        Self { sizes, ..self }
    }

    /// Sets typical sizes of the design variables, their starts, and bounds that no analysed design leaves. A start below 1e-15 of the
    /// largest one counts as zero, and a variable that starts at zero has the size 1, at most that of its range. A variable with two equal
    /// bounds is varied nevertheless: its derivative has no meaning otherwise.
    #[must_use]
    pub fn with_variables(self, variables: &[DesignVariable]) -> Self {
        let largest = variables.iter().fold(0.0, |a: f64, v| a.max(v.start.abs()));
        let size = |v: &DesignVariable| {
            let range = v.upper - v.lower;
            let of_zero = if range > 0.0 { range.min(1.0) } else { 1.0 };
            if v.start.abs() <= NEGLIGIBLE * largest { of_zero } else { v.start }
        };
        let bounds = variables.iter().map(|v| [v.lower, v.upper]).collect();
        Self { bounds, ..self.with_typical_sizes(variables.iter().map(size).collect()) }
    }

    /// The step of a variable of the length `h`, or shorter, that stays inside the bounds.
    fn inside(&self, b: &[f64], i: usize, h: f64) -> FirstStep {
        let both = FirstStep { h, is_one_sided: false };
        let Some(&[lower, upper]) = self.bounds.get(i).filter(|[lower, upper]| lower < upper) else { return both };
        let (below, above) = (b[i] - lower, upper - b[i]);
        let is_forward = self.formula == DifferenceFormula::Forward;
        if above >= h && (below >= h || is_forward) {
            return both;
        }
        let (side, room) = if above >= below { (1.0, above) } else { (-1.0, below) };
        let longest = if is_forward { room } else { room / 2.0 };
        FirstStep { h: side * h.min(longest), is_one_sided: true }
    }

    /// The size of a design variable, to which its steps are relative.
    fn size(&self, b: &[f64], i: usize) -> f64 {
        let typical = self.sizes.get(i).map(|size| if *size == 0.0 { 1.0 } else { size.abs() });
        let is_rounding = b[i].abs() <= ROUNDING * typical.unwrap_or(0.0);
        if is_rounding { typical.unwrap_or(1.0) } else { b[i].abs() }
    }

    /// The typical size of a design variable, or its own size where that is larger or nothing else is known.
    fn typical(&self, b: &[f64], i: usize) -> f64 {
        self.sizes.get(i).map_or(0.0, |size| size.abs()).max(self.size(b, i))
    }

    /// The step by a design variable.
    fn step(&self, b: &[f64], i: usize) -> f64 {
        match &self.step {
            DifferenceStep::Relative(step) => step * self.size(b, i),
            DifferenceStep::Absolute(steps) => steps[i],
        }
    }

    fn new(analysis: A, step: DifferenceStep, formula: DifferenceFormula) -> Result<Self> {
        let (what, steps) = match &step {
            DifferenceStep::Relative(step) => ("relative step of differences", std::slice::from_ref(step)),
            DifferenceStep::Absolute(steps) => ("step of differences", &steps[..]),
        };
        for &step in steps {
            Error::check_option(what, "positive and finite", step, step > 0.0 && step.is_finite())?;
        }
        Ok(Self { analysis, step, formula, sizes: vec![], bounds: vec![] })
    }

    /// Sensitivities with steps `factor` times as long.
    fn with_factor(
        &self,
        factor: f64,
        b: &[f64],
        responses: &Responses,
        wanted: &[ResponseAt],
    ) -> Result<DMatrix<f64>> {
        if let DifferenceStep::Absolute(steps) = &self.step {
            Error::check_length("steps of differences", b.len(), steps.len())?;
        }
        if self.formula == DifferenceFormula::NoiseAware {
            return self.noise_aware_at(b, responses, wanted);
        }
        let all: Vec<usize> = (0..b.len()).collect();
        self.with_steps(&all, &|i| factor * self.step(b, i), b, responses, wanted)
    }

    /// Sensitivities by some variables with these steps, or shorter ones inside the bounds.
    fn with_steps(
        &self,
        variables: &[usize],
        step: &dyn Fn(usize) -> f64,
        b: &[f64],
        responses: &Responses,
        wanted: &[ResponseAt],
    ) -> Result<DMatrix<f64>> {
        let steps: Vec<FirstStep> = variables.iter().map(|&i| self.inside(b, i, step(i))).collect();
        let points = |k: usize| match steps[k].is_one_sided {
            false => self.formula.points(),
            true => self.formula.one_sided_points(),
        };
        let count = self.formula.points().len();
        let moved = |task: usize| {
            let (k, (offset, _)) = (task / count, points(task / count)[task % count]);
            let (i, mut moved) = (variables[k], b.to_vec());
            moved[i] += offset * steps[k].h;
            if let Some([lower, upper]) = self.bounds.get(i).filter(|_| steps[k].is_one_sided) {
                // The sum may be rounded to the wrong side of a bound.
                moved[i] = moved[i].max(*lower).min(*upper);
            }
            moved
        };
        let designs: Vec<Vec<f64>> = (0..count * variables.len()).map(moved).collect();
        let mut samples: Vec<(f64, Vec<f64>)> = Vec::with_capacity(designs.len());
        for chunk in designs.chunks(AT_ONCE) {
            for responses in self.analysis.analyze_many(chunk) {
                let (responses, task) = (responses?, samples.len());
                let values = wanted.iter().map(|&at| responses.at(at)).collect();
                samples.push((designs[task][variables[task / count]], values));
            }
        }
        let derivative = |row: usize, k: usize| {
            let value = responses.at(wanted[row]);
            // The distance in floating point replaces the step.
            let share = |(p, (offset, weight)): (usize, &(f64, f64))| {
                let (at, values) = &samples[k * count + p];
                weight * (values[row] - value) * offset / (at - b[variables[k]])
            };
            points(k).iter().enumerate().map(share).sum()
        };
        Ok(DMatrix::from_fn(wanted.len(), variables.len(), derivative))
    }

    fn noise_aware_at(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let first = |i: usize| self.inside(b, i, FirstStep::of_size(self.size(b, i)).h);
        let first: Vec<FirstStep> = (0..b.len()).map(first).collect();
        let samples = DifferenceSamples::along_all(|designs| self.analysis.analyze_many(designs), b, &first);
        let mut rows = DMatrix::zeros(wanted.len(), b.len());
        for (i, samples) in samples.iter().enumerate() {
            for (row, &at) in wanted.iter().enumerate() {
                let derivative = ridders(responses.at(at), &samples.steps(at, responses.at(at))).ok_or_else(|| {
                    let why = "the neighbouring designs cannot be analysed";
                    Error::analysis(
                        format!("differences by design variable {i}"),
                        why,
                        "move the design away from there",
                    )
                })?;
                rows[(row, i)] = derivative.value;
            }
        }
        Ok(rows)
    }
}

impl<A: Analysis> Analysis for Differences<A> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        self.analysis.analyze(b)
    }

    fn analyze_many(&self, designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
        self.analysis.analyze_many(designs)
    }

    fn step_tolerance(&self, b: &[f64]) -> f64 {
        self.analysis.step_tolerance(b)
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let mut rows = self.with_factor(1.0, b, responses, wanted)?;
        if self.formula == DifferenceFormula::NoiseAware || wanted.iter().all(|&at| responses.at(at) == 0.0) {
            return Ok(rows);
        }
        let longest = |i: usize| LONGEST * self.typical(b, i);
        let without_effect = |rows: &DMatrix<f64>, i: usize| rows.column(i).iter().all(|derivative| *derivative == 0.0);
        // A variable that is a bound of a peak has no effect on any response.
        let none_has_effect = (0..b.len()).all(|i| without_effect(&rows, i));
        let is_unseen = |i: &usize| {
            without_effect(&rows, *i) && (none_has_effect || self.size(b, *i) < SMALL * self.typical(b, *i))
        };
        let mut unseen: Vec<usize> = (0..b.len()).filter(is_unseen).collect();
        let mut factor = 1.0;
        while unseen.iter().any(|&i| factor * self.step(b, i) < longest(i)) {
            factor *= LONGER;
            let by = |factor: f64| move |i: usize| (factor * self.step(b, i)).min(longest(i));
            let found = self.with_steps(&unseen, &by(factor), b, responses, wanted)?;
            let is_seen = |k: &usize| !without_effect(&found, *k);
            let seen: Vec<usize> = (0..unseen.len()).filter(is_seen).map(|k| unseen[k]).collect();
            let clear = self.with_steps(&seen, &by(CLEAR * factor), b, responses, wanted)?;
            seen.iter().enumerate().for_each(|(k, &i)| rows.set_column(i, &clear.column(k)));
            unseen.retain(|i| !seen.contains(i));
        }
        Ok(rows)
    }

    /// The differences, and the methods of the analysis itself.
    fn gradient_methods(&self) -> Vec<GradientMethod<'_>> {
        let own = match self.formula {
            DifferenceFormula::NoiseAware => GradientMethod::of(self.formula.name(), self),
            _ => {
                let by = |factor: f64, b: &[f64], r: &Responses, wanted: &[ResponseAt]| {
                    self.with_factor(factor, b, r, wanted)
                };
                GradientMethod::approximate(self.formula.name(), 1.0, by)
            }
        };
        std::iter::once(own).chain(self.analysis.gradient_methods()).collect()
    }

    fn warnings(&self, b: &[f64], responses: &Responses) -> Vec<String> {
        self.analysis.warnings(b, responses)
    }

    fn differentiation(&self, _variables: usize, _wanted: &[ResponseAt]) -> Option<&'static str> {
        Some(self.formula.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::{Analytic, ClosedForm, TimeGrid};
    use autodiff::Scalar;

    struct Cubic;
    impl ClosedForm for Cubic {
        fn response<S: Scalar>(&self, _: usize, b: &[S], t: S) -> S {
            b[0].powi(3) * t + b[1]
        }
    }

    /// A step relative to a variable of 1e-13 that counts as zero would be lost in rounding.
    #[test]
    fn a_rounding_error_is_no_measure_of_a_step() {
        let grid = TimeGrid::uniform(1.0, 2.0, 2).unwrap();
        let analysis = || Analytic::new(Cubic, &[Some(&grid)]);
        let (b, wanted) = ([2.0, 1e-13], [ResponseAt { response: 0, point: 1 }]);
        let derivative = |d: Differences<Analytic<Cubic>>| {
            let d = d.with_typical_sizes(vec![1.0, 1.0]);
            d.sensitivities(&b, &d.analyze(&b).unwrap(), &wanted).unwrap()[(0, 1)]
        };
        for d in [Differences::forward(analysis(), 1e-4).unwrap(), Differences::noise_aware(analysis())] {
            let derivative = derivative(d);
            assert!((derivative - 1.0).abs() < 1e-9, "{derivative}");
        }
    }

    #[test]
    fn a_start_that_stands_for_zero_is_no_measure_of_a_step() {
        let grid = TimeGrid::uniform(1.0, 2.0, 2).unwrap();
        let variables = [2.0, 1e-18].map(|start| DesignVariable::new("b", "", start).within(0.0, f64::INFINITY));
        let d = Differences::noise_aware(Analytic::new(Cubic, &[Some(&grid)])).with_variables(&variables);
        let b = [2.0, 1e-18];
        let wanted = [ResponseAt { response: 0, point: 1 }];
        let derivative = d.sensitivities(&b, &d.analyze(&b).unwrap(), &wanted).unwrap()[(0, 1)];
        assert!((derivative - 1.0).abs() < 1e-9, "{derivative}");
    }

    /// (b₀ − 1)² + 5 (b₁ − 1/2)² + 2 in single precision, or rounded to digits.
    struct Rounded(fn(f64) -> f64);
    impl Analysis for Rounded {
        fn analyze(&self, b: &[f64]) -> Result<Responses> {
            let value = (b[0] - 1.0).powi(2) + 5.0 * (b[1] - 0.5).powi(2) + 2.0;
            Ok(Responses::new(vec![vec![(self.0)(value)]]))
        }

        fn sensitivities(&self, _: &[f64], _: &Responses, _: &[ResponseAt]) -> Result<DMatrix<f64>> {
            unreachable!("it has differences only")
        }
    }

    #[test]
    fn a_rounded_response_is_no_constant() {
        let single = |v: f64| f64::from(v as f32);
        let roundings: [fn(f64) -> f64; 3] = [single, |v| (v * 1e6).round() / 1e6, |v| (v * 1e3).round() / 1e3];
        let wanted = [ResponseAt { response: 0, point: 0 }];
        for rounding in roundings {
            // The second design has a variable near zero, whose own size does not determine a step.
            for b in [[3.0, -2.0], [1e-7, 0.0], [0.9, 0.4]] {
                let exact = [2.0 * (b[0] - 1.0), 10.0 * (b[1] - 0.5)];
                let central = Differences::central(Rounded(rounding), 1e-10).unwrap();
                let forward = Differences::forward(Rounded(rounding), 1e-11).unwrap();
                for d in [central, forward].map(|d| d.with_typical_sizes(vec![3.0, -2.0])) {
                    let found = d.sensitivities(&b, &d.analyze(&b).unwrap(), &wanted).unwrap();
                    let error = (0..2).map(|j| (found[(0, j)] - exact[j]).abs()).fold(0.0, f64::max);
                    assert!(error < 0.3 * exact[0].abs().max(exact[1].abs()), "{b:?}: {found} instead of {exact:?}");
                }
            }
        }
    }

    #[test]
    fn a_constant_costs_few_analyses_more() {
        struct Counted(std::sync::atomic::AtomicUsize, f64);
        impl Analysis for Counted {
            fn analyze(&self, _: &[f64]) -> Result<Responses> {
                self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                Ok(Responses::new(vec![vec![self.1]]))
            }

            fn sensitivities(&self, _: &[f64], _: &Responses, _: &[ResponseAt]) -> Result<DMatrix<f64>> {
                unreachable!("it has differences only")
            }
        }
        for (value, most) in [(0.0, 2), (1.0, 8)] {
            let d = Differences::forward(Counted(0.into(), value), 1e-6).unwrap();
            let b = [1.0, 2.0];
            let found =
                d.sensitivities(&b, &Responses::new(vec![vec![value]]), &[ResponseAt { response: 0, point: 0 }]);
            assert_eq!(found.unwrap().amax(), 0.0);
            assert!(d.analysis.0.load(std::sync::atomic::Ordering::Relaxed) <= most);
        }
    }

    #[test]
    fn forward_is_of_first_and_central_of_second_order() {
        let grid = TimeGrid::uniform(1.0, 2.0, 2).unwrap();
        let analysis = || Analytic::new(Cubic, &[Some(&grid)]);
        let (b, wanted) = ([2.0, 0.0], [ResponseAt { response: 0, point: 1 }]);
        let derivative = |d: &dyn Analysis| {
            let rows = d.sensitivities(&b, &d.analyze(&b).unwrap(), &wanted).unwrap();
            assert!((rows[(0, 1)] - 1.0).abs() < 1e-10);
            rows[(0, 0)]
        };
        // 2 (3b² + 3bh + h²) and 2 (3b² + h²), h = 0.02.
        assert!((derivative(&Differences::forward(analysis(), 0.01).unwrap()) - (24.0 + 0.24 + 0.0008)).abs() < 1e-10);
        assert!((derivative(&Differences::central(analysis(), 0.01).unwrap()) - (24.0 + 0.0008)).abs() < 1e-10);
        assert!(
            (derivative(&Differences::forward_by(analysis(), vec![0.02, 0.3]).unwrap()) - (24.0 + 0.24 + 0.0008)).abs()
                < 1e-10
        );
        // A cubic has no fourth derivative.
        assert!((derivative(&Differences::richardson(analysis(), 0.01).unwrap()) - 24.0).abs() < 1e-9);
        assert!((derivative(&Differences::noise_aware(analysis())) - 24.0).abs() < 1e-9);
        assert!(Differences::forward(analysis(), 0.0).is_err());
        assert!(Differences::forward_by(analysis(), vec![0.1, -0.1]).is_err());
        let short = Differences::forward_by(analysis(), vec![0.1]).unwrap();
        assert!(short.sensitivities(&b, &short.analyze(&b).unwrap(), &wanted).is_err());
    }

    /// ln b₀ + √(1 − b₁) + b₂² between the bounds of the variables, undefined outside.
    struct Inside;
    impl Analysis for Inside {
        fn analyze(&self, b: &[f64]) -> Result<Responses> {
            let is_inside = (1.0..=3.0).contains(&b[0]) && (-2.0..=0.5).contains(&b[1]) && b[2] >= 0.0;
            let value = b[0].ln() + (1.0 - b[1]).sqrt() + b[2] * b[2];
            Ok(Responses::new(vec![vec![if is_inside { value } else { f64::NAN }]]))
        }
        fn sensitivities(&self, _: &[f64], _: &Responses, _: &[ResponseAt]) -> Result<DMatrix<f64>> {
            Ok(DMatrix::zeros(1, 3))
        }
    }

    #[test]
    fn differences_stay_inside_the_bounds() {
        let bounds = [(1.0, 3.0), (-2.0, 0.5), (0.0, f64::INFINITY)];
        let variables = bounds.map(|(lower, upper)| DesignVariable::new("b", "", 1.0).within(lower, upper));
        let all = [
            (Differences::forward(Inside, 1e-7).unwrap(), 1e-6),
            (Differences::central(Inside, 1e-5).unwrap(), 1e-8),
            (Differences::richardson(Inside, 1e-3).unwrap(), 1e-9),
            (Differences::noise_aware(Inside), 1e-7),
        ];
        for (differences, tolerance) in all {
            let name = differences.formula.name();
            let differences = differences.with_variables(&variables);
            // At bounds, within a step of them, and off them.
            for b in [[1.0, 0.5, 0.0], [3.0, -2.0, 0.0], [1.0 + 1e-8, 0.5 - 1e-8, 1.0], [2.0, -1.0, 1.0]] {
                let at = [ResponseAt { response: 0, point: 0 }];
                let rows = differences.sensitivities(&b, &differences.analyze(&b).unwrap(), &at).unwrap();
                for (found, exact) in rows.iter().zip([1.0 / b[0], -0.5 / (1.0 - b[1]).sqrt(), 2.0 * b[2]]) {
                    assert!((found - exact).abs() < tolerance, "{name} at {b:?}: {found} instead of {exact}");
                }
            }
        }
        // Bounds that fix a variable leave no other way.
        let fixed = [(1.0, 3.0), (-1.0, -1.0), (0.0, 9.0)];
        let fixed = fixed.map(|(lower, upper)| DesignVariable::new("b", "", 1.0).within(lower, upper));
        let differences = Differences::central(Inside, 1e-5).unwrap().with_variables(&fixed);
        let (b, at) = ([2.0, -1.0, 1.0], [ResponseAt { response: 0, point: 0 }]);
        let rows = differences.sensitivities(&b, &differences.analyze(&b).unwrap(), &at).unwrap();
        assert!((rows[(0, 1)] + 0.5 / 2.0f64.sqrt()).abs() < 1e-8);
    }

    /// The digits of sin b that a tolerance of 1e-7 leaves.
    struct Noisy;
    impl Analysis for Noisy {
        fn analyze(&self, b: &[f64]) -> Result<Responses> {
            Ok(Responses::new(vec![vec![b[0].sin() + 1e-7 * (1e9 * b[0]).sin()]]))
        }
        fn sensitivities(&self, _: &[f64], _: &Responses, _: &[ResponseAt]) -> Result<DMatrix<f64>> {
            Ok(DMatrix::zeros(1, 1))
        }
    }

    #[test]
    fn noise_makes_steps_long() {
        let (b, wanted) = ([1.2], [ResponseAt { response: 0, point: 0 }]);
        let off = |d: &dyn Analysis| {
            let computed = d.sensitivities(&b, &d.analyze(&b).unwrap(), &wanted).unwrap();
            (computed[(0, 0)] - 1.2f64.cos()).abs()
        };
        assert!(off(&Differences::central(Noisy, 1e-6).unwrap()) > 1e-3);
        assert!(off(&Differences::noise_aware(Noisy)) < 1e-4);
    }

    #[test]
    fn methods_are_the_differences_and_those_of_the_analysis() {
        let differences = Differences::forward(Analytic::new(Cubic, &[None]), 1e-6).unwrap();
        assert_eq!(differences.gradient_methods().iter().map(|a| a.name).collect::<Vec<_>>(), ["forward"]);
    }
}
