//! Properties of a mechanism: derivatives, conservation laws, agreement of schemes.

use crate::differences::differences;
use crate::random::{Class, RandomModel};
use linkwright_mechanics::analyses::dynamics::{simulate, simulate_explicitly};
use linkwright_mechanics::analyses::kinematics::kinematics;
use linkwright_mechanics::analyses::statics::equilibria;
use linkwright_mechanics::derivatives::adjoint::{
    AdjointFunctional, differentiate_backwards, differentiate_equilibria_backwards, differentiate_explicitly_backwards,
    differentiate_kinematics_backwards,
};
use linkwright_mechanics::derivatives::forward::dynamics::differentiate;
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::derivatives::forward::instants::{differentiate_equilibria, differentiate_kinematics};
use linkwright_mechanics::derivatives::history::SensitiveHistory;
use linkwright_mechanics::derivatives::second_order::{
    HessianHistory, HessianPart, differentiate_equilibria_twice, differentiate_kinematics_twice, differentiate_twice,
};
use linkwright_mechanics::derivatives::semi_analytical::{
    STEP, difference_equilibria, difference_kinematics, differentiate_semi_analytically,
};
use linkwright_mechanics::integrators::explicit::{Coordinates, Explicit, StepControl};
use linkwright_mechanics::{Assembly, Dynamics, Error, GeneralizedAlpha, Mechanism, Newton, Result, Statics};
use nalgebra::DMatrix;
use std::fmt;

/// Counts and contradictions of the checks of many mechanisms.
#[derive(Default)]
pub struct Findings {
    pub wrong: Vec<String>,
    /// Mechanisms that could not be generated, and those that no analysis could simulate.
    pub not_made: usize,
    pub not_analysed: usize,
    pub mechanisms: usize,
    /// Derivatives compared, and those whose differences are too inaccurate for a comparison.
    pub compared: usize,
    pub unclear: usize,
    /// Comparisons of motions, energies and momenta.
    pub laws: usize,
    /// Trees, simulated in relative coordinates as well.
    pub trees: usize,
}

impl Findings {
    pub fn and(mut self, mut other: Self) -> Self {
        self.wrong.append(&mut other.wrong);
        self.not_made += other.not_made;
        self.not_analysed += other.not_analysed;
        self.mechanisms += other.mechanisms;
        self.compared += other.compared;
        self.unclear += other.unclear;
        self.laws += other.laws;
        self.trees += other.trees;
        self
    }

    /// The result, unless it is an error, which is a finding.
    pub fn keep<T>(&mut self, label: &str, result: Result<T>) -> Option<T> {
        result.map_err(|error| self.wrong.push(format!("{label}: {error}"))).ok()
    }

    /// Share of the derivatives that could be compared.
    pub fn informative(&self) -> f64 {
        1.0 - self.unclear as f64 / (self.compared + self.unclear).max(1) as f64
    }

    /// Share of the seeds that led to a mechanism that moves.
    pub fn made(&self) -> f64 {
        (self.mechanisms - self.not_analysed) as f64 / (self.mechanisms + self.not_made).max(1) as f64
    }
}

impl fmt::Display for Findings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} mechanisms ({} not made, {} cannot be analysed, {} trees): {} derivatives compared, {} unclear, {} laws, {} wrong",
            self.mechanisms,
            self.not_made,
            self.not_analysed,
            self.trees,
            self.compared,
            self.unclear,
            self.laws,
            self.wrong.len()
        )
    }
}

/// Derivatives of a row of numbers with respect to the design, [number][variable].
type Rows = Vec<Vec<f64>>;

/// A comparison of derivatives: the mechanism, its label and its findings.
struct Comparison<'a> {
    label: String,
    b: &'a [f64],
    findings: &'a mut Findings,
}

impl Comparison<'_> {
    /// Compares the derivatives by some methods, each with its relative tolerance, with differences of `values`. One that is given more than
    /// once, with different settings, must be right with one of them.
    ///
    /// All numbers of one output belong together: `group(i)` is the output of number i. A deviation is relative to the
    /// largest derivative of the same output with respect to any variable, both by the size of the variable.
    fn compare(
        &mut self,
        methods: &[(&str, f64, Rows)],
        group: impl Fn(usize) -> usize,
        values: impl Fn(&[f64]) -> Option<Vec<f64>>,
    ) {
        let (b, values) = (self.b, &values);
        let size = |k: usize| b[k].abs().max(1e-2);
        let along = |k: usize| {
            let at = move |h: f64| {
                let mut moved = b.to_vec();
                moved[k] += h;
                values(&moved)
            };
            differences(2e-2 * size(k), at)
        };
        let all: Vec<_> = (0..b.len()).map(along).collect();
        let Some(count) = all.iter().flatten().map(|found| found.wide.len()).next() else {
            self.findings.unclear += 1;
            return;
        };
        let groups = (0..count).map(&group).max().map_or(0, |last| last + 1);
        let here = values(b).unwrap_or_default();
        let mut largest = vec![FLOOR; groups];
        here.iter().enumerate().for_each(|(i, x)| largest[group(i)] = largest[group(i)].max(FLOOR * x.abs()));
        for (k, row) in all.iter().enumerate() {
            for (i, difference) in row.iter().flat_map(|found| &found.wide).enumerate() {
                largest[group(i)] = largest[group(i)].max((difference.value * size(k)).abs());
            }
        }
        let of_all = largest.iter().fold(0.0f64, |a, x| a.max(*x));
        largest.iter_mut().for_each(|largest| *largest = largest.max(LOST * of_all));
        for (k, found) in all.iter().enumerate().filter_map(|(k, found)| Some((k, found.as_ref()?))) {
            for (i, difference) in found.wide.iter().enumerate() {
                let unit = largest[group(i)] / size(k);
                if !(difference.error < ACCURATE * unit) {
                    self.findings.unclear += 1;
                    continue;
                }
                self.findings.compared += 1;
                let off = |(_, tolerance, rows): &(&str, f64, Rows)| {
                    found.contradict(i, rows[i][k], tolerance * unit, ACCURATE * unit)
                };
                for (name, _, rows) in methods.iter().filter(|method| off(method)) {
                    if methods.iter().filter(|(other, ..)| other == name).all(off) {
                        self.findings.wrong.push(format!(
                            "{}: {name} derivative of number {i} (output {}) by variable {k} is {:.9e}, differences {:.9e} ± {:.1e}, unit {unit:.2e}",
                            self.label, group(i), rows[i][k], difference.value, difference.error
                        ));
                    }
                }
            }
        }
    }
}

/// Gradients by output and time, as rows.
fn rows_of(history: &SensitiveHistory) -> Rows {
    history.gradients.iter().flatten().cloned().collect()
}

fn rows_of_matrix(matrix: &DMatrix<f64>) -> Rows {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn functionals(outputs: usize, times: usize) -> Vec<AdjointFunctional> {
    (0..outputs).flat_map(|output| (0..times).map(move |p| AdjointFunctional::at(output, p))).collect()
}

/// Largest error of differences that are compared, in units of a derivative.
const ACCURATE: f64 = 1e-4;

const TIMES: [f64; 2] = [0.09, 0.16];
const EXACT: f64 = 1e-6;
/// Smallest unit of a derivative: by the size of its variable, a fraction of the value (or of 1 m, rad, N, J).
const FLOOR: f64 = 0.1;

/// Fraction of the largest derivative of all outputs that is lost to rounding in stiff mechanisms.
const LOST: f64 = 1e-6;

/// Fraction of the largest second derivative of all outputs that is lost to rounding, divided by the tolerance. In mechanism 2812 the
/// largest is 9e9 1/s², and a second derivative of zero varies from −2 to −5 1/s² if the design changes by 1e-13.
const LOST_TWICE: f64 = 1e-4;

/// The differences of the residual lose digits where large terms cancel, see docs/sensitivities.md.
const SEMI: f64 = 2e-3;

/// Stages of fixed steps enter a contact, whose stiffness has a vertical tangent there: differences are inaccurate, those of
/// whole analyses and those of the residual.
const KINKED: f64 = 2e-2;

fn implicit(h: f64, scheme: GeneralizedAlpha) -> Dynamics {
    Dynamics { scheme, newton: Newton { tolerance: 1e-13, iterations: 30 }, ..Dynamics::fixed(h) }
}

/// Checks a mechanism of seed `seed` by everything that applies to its class.
pub fn check(model: &impl RandomModel, seed: u64, findings: &mut Findings) {
    findings.mechanisms += 1;
    let b = model.design();
    let Ok(plain) = model.build(&b) else { return };
    let label = format!("{:?} {seed}", model.class());
    if !moves(&plain) {
        findings.not_analysed += 1;
        return;
    }
    match model.class() {
        Class::Driven => check_kinematics(model, &b, &label, findings),
        Class::Static => check_statics(model, &b, &label, findings),
        _ => {}
    }
    if model.is_for_explicit_steps() {
        check_explicit(model, &b, &label, findings);
    }
    check_implicit(model, &b, &label, findings);
    check_laws(model, &plain, &label, findings);
}

/// Returns whether the motion can be simulated and stays bounded.
fn moves(plain: &Mechanism<f64>) -> bool {
    let settings = implicit(0.01, GeneralizedAlpha::chung_hulbert(0.8).unwrap());
    simulate(plain, &settings, &TIMES)
        .is_ok_and(|history| is_bounded(&history.values) && history.work.failed_steps == 0)
}

/// Returns `false` for a motion that has grown without limit, as along explicit steps that are too long for a stiff mechanism.
fn is_bounded(values: &[Vec<f64>]) -> bool {
    values.iter().flatten().all(|x| x.abs() < 1e3)
}

fn check_explicit(model: &impl RandomModel, b: &[f64], label: &str, findings: &mut Findings) {
    let plain = model.build(b).expect("it was built before");
    let is_tree = check_relative(&plain, label, findings);
    let methods = [Explicit::adaptive(1.0), Explicit::eighth_order(1.0)];
    let choices = [Coordinates::Absolute, Coordinates::Relative];
    let chosen = methods.iter().enumerate().filter(|(k, _)| model.is_for_scheme(*k)).map(|(_, method)| method);
    let all = chosen.flat_map(|method| choices.map(|choice| method.clone().with_coordinates(choice)));
    for settings in all.filter(|settings| is_tree || settings.coordinates == Coordinates::Absolute) {
        let settings = settings.with_step_control(StepControl::Fixed(0.02));
        let is_stable = simulate_explicitly(&plain, &settings, &TIMES).is_ok_and(|motion| is_bounded(&motion.values));
        let direct = is_stable.then(|| differentiate_explicitly(model, b, &settings, &TIMES).ok()).flatten();
        let Some(direct) = direct else {
            findings.not_analysed += 1;
            return;
        };
        let all = functionals(direct.names.len(), TIMES.len());
        let Some(adjoint) =
            findings.keep(label.as_ref(), differentiate_explicitly_backwards(model, b, &settings, &TIMES, &all))
        else {
            return;
        };
        let tolerance = if model.class() == Class::Contact { KINKED } else { EXACT };
        let methods = [("direct", tolerance, rows_of(&direct)), ("adjoint", tolerance, rows_of_matrix(&adjoint))];
        let label = format!("{label}, {}, {} coordinates", settings.method.name, settings.coordinates.name());
        Comparison { label, b, findings }.compare(
            &methods,
            |i| i / TIMES.len(),
            |b| Some(simulate_explicitly(&model.build(b).ok()?, &settings, &TIMES).ok()?.values.concat()),
        );
    }
}

/// Compares the motions in absolute and relative coordinates. Returns whether the mechanism is a tree.
fn check_relative(plain: &Mechanism<f64>, label: &str, findings: &mut Findings) -> bool {
    let run = |coordinates| {
        let settings = Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(2e-3));
        simulate_explicitly(plain, &settings.with_coordinates(coordinates), &TIMES)
    };
    let relative = match run(Coordinates::Relative) {
        Ok(relative) => relative,
        Err(Error::Unsupported { .. }) => return false,
        Err(error) => {
            findings.wrong.extend(run(Coordinates::Absolute).is_ok().then(|| format!("{label}, relative: {error}")));
            return false;
        }
    };
    let Ok(absolute) = run(Coordinates::Absolute) else { return true };
    findings.trees += 1;
    for (name, [a, r]) in absolute.names.iter().zip(absolute.values.iter().zip(&relative.values).map(|(a, r)| [a, r])) {
        findings.laws += 1;
        let size = a.iter().fold(1.0, |size: f64, x| size.max(x.abs()));
        let error = a.iter().zip(r).fold(0.0, |error: f64, (a, r)| error.max((a - r).abs()));
        if !(error <= 1e-6 * size) {
            findings.wrong.push(format!("{label}, {name}: relative coordinates differ by {error:.1e} of {size:.1e}"));
        }
    }
    true
}

fn check_implicit(model: &impl RandomModel, b: &[f64], label: &str, findings: &mut Findings) {
    let schemes = [
        ("generalized-α", GeneralizedAlpha::chung_hulbert(0.8).unwrap()),
        ("HHT", GeneralizedAlpha::hht(0.1).unwrap()),
    ];
    for (_, (name, scheme)) in schemes.into_iter().enumerate().filter(|(k, _)| model.is_for_scheme(*k)) {
        let settings = implicit(0.02, scheme);
        let Ok(direct) = differentiate(model, b, &settings, &TIMES) else {
            findings.not_analysed += 1;
            return;
        };
        let all = functionals(direct.names.len(), TIMES.len());
        let Some(adjoint) = findings.keep(label.as_ref(), differentiate_backwards(model, b, &settings, &TIMES, &all))
        else {
            return;
        };
        let mut methods = vec![("direct", EXACT, rows_of(&direct)), ("adjoint", EXACT, rows_of_matrix(&adjoint))];
        // Accelerations lose digits to rounding with a short step of the differences, stiff forces to curvature with a long one.
        for step in [STEP, 10.0 * STEP] {
            // Where the differences of stiff residuals diverge, an error says so.
            if let Ok(semi) = differentiate_semi_analytically(model, b, &settings, &TIMES, step) {
                let tolerance = if model.class() == Class::Contact { KINKED } else { SEMI };
                methods.push(("semi-analytical", tolerance, rows_of(&semi)));
            } else {
                findings.unclear += 1;
            }
        }
        let label = format!("{label}, {name}");
        Comparison { label: label.clone(), b, findings }.compare(
            &methods,
            |i| i / TIMES.len(),
            |b| {
                let history = simulate(&model.build(b).ok()?, &settings, &TIMES).ok()?;
                (history.work.failed_steps == 0).then(|| history.values.concat())
            },
        );
        let v = direction(b);
        let Some(twice) =
            findings.keep(label.as_ref(), differentiate_twice(model, b, &settings, &TIMES, HessianPart::Times(&v)))
        else {
            return;
        };
        check_second(label, b, &v, &twice, findings, |b| differentiate(model, b, &settings, &TIMES).ok());
    }
}

/// A direction in the space of the design variables, by their sizes.
fn direction(b: &[f64]) -> Vec<f64> {
    b.iter().enumerate().map(|(k, x)| x.abs().max(1e-2) * (1.0 - 0.3 * k as f64)).collect()
}

/// Compares Hessians times `v` with differences of gradients along `v`.
fn check_second(
    label: String,
    b: &[f64],
    v: &[f64],
    twice: &HessianHistory,
    findings: &mut Findings,
    gradients: impl Fn(&[f64]) -> Option<SensitiveHistory>,
) {
    let along = |h: f64| {
        let moved: Vec<f64> = b.iter().zip(v).map(|(b, v)| b + h * v).collect();
        Some(rows_of(&gradients(&moved)?).concat())
    };
    let Some(found) = differences(1e-2, along) else {
        findings.unclear += 1;
        return;
    };
    let all = &found.wide;
    let (n, points) = (b.len(), twice.times.len());
    let scaled = all.iter().enumerate().map(|(i, entry)| (entry.value * b[i % n].abs().max(1e-2)).abs());
    let tolerance = if label.starts_with("Flexible") { 1e-4 } else { 1e-5 };
    let floor = FLOOR.max(LOST_TWICE * scaled.fold(0.0, f64::max));
    for output in 0..twice.names.len() {
        let entries = (0..points).flat_map(|p| (0..n).map(move |k| (p, k)));
        let at = |p: usize, k: usize| (output * points + p) * n + k;
        let size = |k: usize| b[k].abs().max(1e-2);
        let largest = entries.clone().map(|(p, k)| (all[at(p, k)].value * size(k)).abs()).fold(floor, f64::max);
        for (p, k) in entries {
            let (difference, unit) = (all[at(p, k)], largest / size(k));
            if !(difference.error < ACCURATE * unit) {
                findings.unclear += 1;
                continue;
            }
            findings.compared += 1;
            let exact = twice.second_derivatives(output, p)[k];
            if found.contradict(at(p, k), exact, tolerance * unit, ACCURATE * unit) {
                findings.wrong.push(format!(
                    "{label}: second derivative of output {output} ({}) at point {p} by variable {k} is {exact:.9e}, differences {:.9e} ± {:.1e}, unit {unit:.2e}",
                    twice.names[output], difference.value, difference.error
                ));
            }
        }
    }
}

fn check_kinematics(model: &impl RandomModel, b: &[f64], label: &str, findings: &mut Findings) {
    let assembly = Assembly::default();
    let Ok(direct) = differentiate_kinematics(model, b, assembly, &TIMES) else {
        findings.not_analysed += 1;
        return;
    };
    let all = functionals(direct.names.len(), TIMES.len());
    let Some(adjoint) =
        findings.keep(label.as_ref(), differentiate_kinematics_backwards(model, b, assembly, &TIMES, &by_time(&all)))
    else {
        return;
    };
    let Some(semi) = findings.keep(label.as_ref(), difference_kinematics(model, b, assembly, &TIMES, STEP)) else {
        return;
    };
    let adjoint = in_order(&rows_of_matrix(&adjoint), direct.names.len());
    let methods =
        [("direct", EXACT, rows_of(&direct)), ("adjoint", EXACT, adjoint), ("semi-analytical", SEMI, rows_of(&semi))];
    let label = format!("{label}, kinematics");
    Comparison { label: label.clone(), b, findings }.compare(
        &methods,
        |i| i / TIMES.len(),
        |b| Some(kinematics(&model.build(b).ok()?, assembly, &TIMES).ok()?.concat()),
    );
    let v = direction(b);
    let Some(twice) = findings
        .keep(label.as_ref(), differentiate_kinematics_twice(model, b, assembly, &TIMES, HessianPart::Times(&v)))
    else {
        return;
    };
    check_second(label, b, &v, &twice, findings, |b| differentiate_kinematics(model, b, assembly, &TIMES).ok());
}

fn check_statics(model: &impl RandomModel, b: &[f64], label: &str, findings: &mut Findings) {
    let (settings, times) = (Statics { tolerance: 1e-12, ..Statics::default() }, [0.0, 0.1]);
    let Ok(direct) = differentiate_equilibria(model, b, &settings, &times) else {
        findings.not_analysed += 1;
        return;
    };
    let all = functionals(direct.names.len(), times.len());
    let Some(adjoint) =
        findings.keep(label.as_ref(), differentiate_equilibria_backwards(model, b, &settings, &times, &by_time(&all)))
    else {
        return;
    };
    let Some(semi) = findings.keep(label.as_ref(), difference_equilibria(model, b, &settings, &times, STEP)) else {
        return;
    };
    let adjoint = in_order(&rows_of_matrix(&adjoint), direct.names.len());
    let methods =
        [("direct", EXACT, rows_of(&direct)), ("adjoint", EXACT, adjoint), ("semi-analytical", SEMI, rows_of(&semi))];
    let label = format!("{label}, statics");
    Comparison { label: label.clone(), b, findings }.compare(
        &methods,
        |i| i / times.len(),
        |b| Some(equilibria(&model.build(b).ok()?, &settings, &times).ok()?.concat()),
    );
    let v = direction(b);
    let Some(twice) = findings
        .keep(label.as_ref(), differentiate_equilibria_twice(model, b, &settings, &times, HessianPart::Times(&v)))
    else {
        return;
    };
    check_second(label, b, &v, &twice, findings, |b| differentiate_equilibria(model, b, &settings, &times).ok());
}

/// The functionals ordered by time point.
fn by_time(all: &[AdjointFunctional]) -> Vec<AdjointFunctional> {
    let mut sorted = all.to_vec();
    sorted.sort_by_key(|functional| functional.terms[0].point);
    sorted
}

/// Rows ordered by time point and output, ordered by output and time point.
fn in_order(rows: &Rows, outputs: usize) -> Rows {
    (0..outputs).flat_map(|o| (0..TIMES.len()).map(move |p| p * outputs + o)).map(|i| rows[i].clone()).collect()
}

/// Checks that schemes agree, and that energy is conserved where it must be.
fn check_laws(model: &impl RandomModel, plain: &Mechanism<f64>, label: &str, findings: &mut Findings) {
    if !model.is_for_explicit_steps() || model.class() == Class::Contact || model.has_events() {
        return;
    }
    let exact = simulate_explicitly(plain, &Explicit::eighth_order(1e-11), &TIMES);
    let Ok(exact) = exact else { return };
    let run = |h: f64| -> Result<Vec<Vec<f64>>> {
        Ok(simulate(plain, &implicit(h, GeneralizedAlpha::chung_hulbert(0.8)?), &TIMES)?.values)
    };
    let (Ok(coarse), Ok(fine)) = (run(2e-3), run(1e-3)) else { return };
    let positions: Vec<usize> = (0..exact.names.len())
        .filter(|&o| exact.names[o].starts_with(['x', 'y', 'z']) || exact.names[o].starts_with("theta"))
        .collect();
    let error = |values: &[Vec<f64>]| {
        let all = positions.iter().flat_map(|&o| values[o].iter().zip(&exact.values[o]));
        all.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    for (scheme, values) in [("explicit", &exact.values), ("implicit", &fine)] {
        for (name, norm) in exact.names.iter().zip(values).filter(|(name, _)| name.starts_with("norm")) {
            findings.laws += 1;
            let off = norm.iter().fold(0.0, |off: f64, x| off.max((x - 1.0).abs()));
            if !(off < 1e-9) {
                findings.wrong.push(format!("{label}: {name} of the Euler parameters is off by {off:.1e}, {scheme}"));
            }
        }
    }
    findings.laws += 1;
    let (coarse, fine) = (error(&coarse), error(&fine));
    if !(fine <= 0.45 * coarse + 1e-7 && fine < 1e-2) {
        findings.wrong.push(format!("{label}: implicit steps differ from explicit ones by {coarse:.2e}, {fine:.2e}"));
    }
    if matches!(model.class(), Class::Conservative | Class::Floating) {
        for (name, values) in exact.names.iter().zip(&exact.values) {
            let is_conserved = name == "energy" || name.starts_with("momentum");
            let (first, last) = (values[0], values[TIMES.len() - 1]);
            findings.laws += usize::from(is_conserved);
            if is_conserved && !((last - first).abs() < 1e-7 * (1.0 + first.abs())) {
                findings.wrong.push(format!("{label}: {name} changes from {first:.9e} to {last:.9e}"));
            }
        }
    }
}
