//! `[analysis]`: the analysis of the mechanism.

use super::key::{Accepts, Key, TableKeys, default, optional, required};
use super::mechanism::{MechanismSpec, MechanismTemplate};
use super::section::{Read, Section};
use crate::Readable;
use crate::Result;
use crate::model_file::expression::Names;
use crate::model_file::{Diagnostic, limits};
#[cfg(feature = "report")]
use crate::problem::Responses;
use crate::problem::{Analysis, Differentiated, Problem, ProblemBuilder, TimeGrid};
use crate::responses::Differences;
use crate::responses::mechanism::{Integration, KinematicResponses, ModalResponses, StaticResponses, Transient};
use mechanics::analyses::dynamics::{Dynamics, InitialAcceleration, InitialConfiguration, StepSize};
use mechanics::analyses::statics::Statics;
use mechanics::initial_conditions::Assembly;
use mechanics::integrators::explicit::{Coordinates, Explicit, StepControl};
use mechanics::integrators::generalized_alpha::{GeneralizedAlpha, Prescribed};

pub const KEYS: &[Key] = &[
    required("kind", Accepts::Choice(&["dynamics", "kinematics", "statics", "program"]), "kind of analysis"),
    default(
        "derivatives",
        Accepts::Choice(&[
            "automatic",
            "direct",
            "adjoint",
            "semi-analytical",
            "program",
            "forward",
            "central",
            "richardson",
            "noise-aware",
        ]),
        "automatic",
        "automatic chooses between direct and adjoint, which are exact, and for a program uses forward differences; program: \
         those in the answers of the program; the last four are finite differences of whole analyses",
    ),
    optional(
        "difference",
        Accepts::Number,
        "relative step of differences; by default 1e-5 semi-analytical, 1e-6 forward and central (of a program: 1e-4), 1e-3 richardson",
    ),
];
const DYNAMICS: &[Key] = &[
    default("start", Accepts::Number, "0", "time at which the motion starts, s").of("s"),
    default(
        "scheme",
        Accepts::Choice(&["generalized-alpha", "hht", "rk5", "rk8"]),
        "generalized-alpha",
        "integration method",
    ),
    optional(
        "step",
        Accepts::Number,
        "fixed time step, s; by default the distance of the time points, divided for 1000 steps at least",
    )
    .of("s"),
    optional(
        "tolerance",
        Accepts::Number,
        "tolerated local error, in place of a fixed step; 1e-9 by default for rk5 and rk8",
    ),
    optional(
        "longest_step",
        Accepts::Number,
        "longest step with a tolerance, s; without it, the tolerance alone decides",
    )
    .of("s"),
    default(
        "coordinates",
        Accepts::Choice(&["automatic", "absolute", "relative"]),
        "automatic",
        "unknowns of rk5 and rk8: position and rotation of every body, or joint angles and displacements of open chains and trees; \
         automatic uses these where they are possible",
    ),
    default(
        "spectral_radius",
        Accepts::Number,
        "0.9",
        "spectral radius of generalized-alpha at infinite frequency, 0 to 1",
    ),
    default("damping", Accepts::Number, "0.05", "numerical damping of hht, 0 to 1/3"),
    default(
        "initial_configuration",
        Accepts::Choice(&["built", "equilibrium"]),
        "built",
        "positions at the start: as given, or in static equilibrium without rigid contacts; implicit schemes only",
    ),
    default(
        "initial_acceleration",
        Accepts::Choice(&["consistent", "zero"]),
        "consistent",
        "accelerations at the start",
    ),
    default(
        "prescribed",
        Accepts::Choice(&["exact", "newmark"]),
        "exact",
        "velocity of prescribed coordinates: exact, or by the Newmark formulas of the scheme",
    ),
];

/// Declarations for documentation and schema.
pub const TABLES: &[TableKeys] = &[
    TableKeys { name: "analysis", kind: None, about: "analysis of the mechanism", keys: KEYS },
    TableKeys { name: "analysis", kind: Some("dynamics"), about: "the motion over time", keys: DYNAMICS },
    TableKeys {
        name: "analysis",
        kind: Some("kinematics"),
        about: "prescribed motion of all coordinates, with inverse dynamics",
        keys: &[],
    },
    TableKeys { name: "analysis", kind: Some("statics"), about: "a static equilibrium for each time point", keys: &[] },
];

/// Method of the derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DerivativeSetting {
    /// The analysis chooses the method.
    Automatic,
    /// A method of the analysis, with the step of its differences.
    By(&'static str, Option<f64>),
    Forward(f64),
    Central(f64),
    Richardson(f64),
    NoiseAware,
}

/// Kind and derivatives of the analysis.
#[derive(Clone, Debug)]
pub struct Settings {
    kind: AnalysisKind,
    derivatives: DerivativeSetting,
    start: f64,
    /// The points of a sweep; `None` if histories are over the time.
    sweep: Option<TimeGrid>,
}

#[derive(Clone, Debug)]
enum AnalysisKind {
    Dynamics(Integration),
    Kinematics,
    Statics,
}

/// Reads `[analysis]`.
pub fn read(file: &Section<'_>, names: &Names, grid: &TimeGrid, mechanism: &MechanismSpec) -> Read<Settings> {
    let Some(value) = file.get("analysis") else {
        let help = "for instance [analysis] with kind = \"dynamics\" and step = 1e-3";
        return Err(file.error_at("analysis", "a mechanism needs [analysis]").help(help));
    };
    let kinds = [("dynamics", (0, DYNAMICS)), ("kinematics", (1, &[][..])), ("statics", (2, &[][..]))];
    let kind = match value.get_ref().as_table() {
        Some(table) => Section::kind(table, "analysis", "", kinds.into_iter())?,
        None => (0, DYNAMICS),
    };
    let section = Section::open(value, "[analysis]", &[KEYS, kind.1], file.source())?;
    if kind.0 == 0
        && let Some(sweep) = names.axis().sweep()
    {
        let message = format!("a motion over time needs [time], and this file sweeps `{sweep}`");
        return Err(section.error_at("kind", message).help("use kind = \"kinematics\" or \"statics\", or [time]"));
    }
    let start = if kind.0 == 0 { section.number("start", names)?.unwrap_or(0.0) } else { grid.points[0] };
    let kind = match kind.0 {
        0 => AnalysisKind::Dynamics(dynamics(&section, names, grid, mechanism.coordinates())?),
        1 => AnalysisKind::Kinematics,
        _ => AnalysisKind::Statics,
    };
    let derivatives = derivatives(&section, names, &kind)?;
    if !mechanism.events.is_empty() {
        check_events(&section, &kind)?;
    }
    let sweep = names.axis().sweep().map(|_| grid.clone());
    Ok(Settings { kind, derivatives, start, sweep })
}

/// Checks that the analysis of a mechanism with events has them.
fn check_events(section: &Section<'_>, kind: &AnalysisKind) -> Read<()> {
    if matches!(kind, AnalysisKind::Dynamics(_)) {
        return Ok(());
    }
    Err(section.error_at("kind", "events belong to a motion over time").help("use kind = \"dynamics\""))
}

fn difference(section: &Section<'_>, names: &Names) -> Read<Option<f64>> {
    let step = section.number("difference", names)?;
    match step {
        Some(step) if step <= 0.0 || step >= 1.0 => {
            Err(section.error_at("difference", "`difference` must be between 0 and 1"))
        }
        _ => Ok(step),
    }
}

fn unused_step(section: &Section<'_>) -> Diagnostic {
    let message = "`difference` is the step of finite differences, and these derivatives use none";
    section.error_at("difference", message).help("leave it out, or choose other `derivatives`")
}

fn derivatives(section: &Section<'_>, names: &Names, kind: &AnalysisKind) -> Read<DerivativeSetting> {
    let step = difference(section, names)?;
    let choices = [
        ("automatic", DerivativeSetting::Automatic),
        ("direct", DerivativeSetting::By("direct", None)),
        ("adjoint", DerivativeSetting::By("adjoint", None)),
        ("semi-analytical", DerivativeSetting::By("semi-analytical", step)),
        ("forward", DerivativeSetting::Forward(step.unwrap_or(1e-6))),
        ("central", DerivativeSetting::Central(step.unwrap_or(1e-6))),
        ("richardson", DerivativeSetting::Richardson(step.unwrap_or(1e-3))),
        ("noise-aware", DerivativeSetting::NoiseAware),
    ];
    let chosen = section.choice("derivatives", &choices)?;
    let is_exact = matches!(chosen, DerivativeSetting::Automatic | DerivativeSetting::By("direct" | "adjoint", _));
    if step.is_some() && (is_exact || chosen == DerivativeSetting::NoiseAware) {
        return Err(unused_step(section));
    }
    if matches!(chosen, DerivativeSetting::By("semi-analytical", _))
        && matches!(kind, AnalysisKind::Dynamics(Integration::Explicit(_)))
    {
        let message = "explicit schemes have no semi-analytical derivatives";
        return Err(section
            .error_at("derivatives", message)
            .help("use derivatives = \"direct\", or an implicit scheme"));
    }
    Ok(chosen)
}

/// The step of implicit schemes where the file gives neither step nor tolerance: the shortest distance of the time points, divided so that
/// there are 1000 steps at least; at most 100 000. Steps of fixed length, because the error of adaptive ones jumps with the design.
fn default_step(start: f64, grid: &TimeGrid) -> f64 {
    const FEWEST: f64 = 1e3;
    const MOST: f64 = 1e5;
    let span = grid.points[grid.len() - 1] - start;
    if span <= 0.0 {
        // The only time point is the start.
        return 1.0;
    }
    let shortest = grid.points.windows(2).map(|pair| pair[1] - pair[0]).fold(span, f64::min);
    (shortest / (FEWEST * shortest / span).ceil().max(1.0)).max(span / MOST)
}

fn dynamics(section: &Section<'_>, names: &Names, grid: &TimeGrid, coordinates: usize) -> Read<Integration> {
    let number = |key| section.number(key, names);
    let start = number("start")?.unwrap_or(0.0);
    if grid.points[0] < start {
        let [start, first] = [start, grid.points[0]].map(Readable);
        let message = format!("the motion starts at {start}, after the first time point {first}");
        return Err(section.error_at("start", message));
    }
    let (step, tolerance) = (number("step")?, number("tolerance")?);
    if tolerance.is_some_and(|t| t > 0.0 && t < limits::TOLERANCE) {
        let message = format!("`tolerance` must be at least {:e}", limits::TOLERANCE);
        return Err(section.error_at("tolerance", message).help("rounding errors are larger than this"));
    }
    let longest = number("longest_step")?;
    for (key, value) in [("step", step), ("tolerance", tolerance), ("longest_step", longest)] {
        if value.is_some_and(|v| v <= 0.0) {
            return Err(section.error_at(key, format!("`{key}` must be positive")));
        }
    }
    if let Some(h) = step {
        let steps = (grid.points[grid.len() - 1] - start) / h;
        let (most, of) = if steps > limits::STEPS {
            (limits::STEPS, "time steps".to_owned())
        } else {
            (limits::MOTION, format!("time steps times coordinates, of which there are {coordinates}"))
        };
        if steps > limits::STEPS || steps * coordinates as f64 > limits::MOTION {
            let message = format!("a step of {h} makes more than {most:e} {of}");
            return Err(section.error_at("step", message).help("use a longer step or an earlier last time point"));
        }
    }
    let is_explicit =
        section.choice("scheme", &[("generalized-alpha", false), ("hht", false), ("rk5", true), ("rk8", true)])?;
    if longest.is_some() && (step.is_some() || (!is_explicit && tolerance.is_none())) {
        let message = "`longest_step` is for steps with a `tolerance`";
        return Err(section.error_at("longest_step", message).help("give a `tolerance`, or a `step` alone"));
    }
    let longest = longest.unwrap_or(f64::INFINITY);
    match (step, tolerance) {
        (Some(_), Some(_)) => Err(section.error_at("tolerance", "`step` and `tolerance` exclude each other")),
        _ if is_explicit => explicit(section, start, (step, longest), tolerance),
        (None, None) => {
            let ends = [start, grid.points[grid.len() - 1]];
            implicit(section, names, ends, (Some(default_step(start, grid)), longest), None)
        }
        _ => implicit(section, names, [start, grid.points[grid.len() - 1]], (step, longest), tolerance),
    }
}

fn explicit(
    section: &Section<'_>,
    start: f64,
    (step, longest): (Option<f64>, f64),
    tolerance: Option<f64>,
) -> Read<Integration> {
    let implicit_only = [
        ("initial_configuration", "built", "equilibrium"),
        ("initial_acceleration", "consistent", "zero"),
        ("prescribed", "exact", "newmark"),
    ];
    for (key, other, word) in implicit_only {
        if section.choice(key, &[(other, false), (word, true)])? {
            let message = format!("`{key} = \"{word}\"` is for implicit schemes only");
            return Err(section
                .error_at(key, message)
                .help("use scheme = \"generalized-alpha\", or leave the key out"));
        }
    }
    let make: fn(f64) -> Explicit =
        section.choice("scheme", &[("rk5", Explicit::adaptive as fn(f64) -> _), ("rk8", Explicit::eighth_order)])?;
    let coordinates = section.choice(
        "coordinates",
        &[
            ("automatic", Coordinates::Automatic),
            ("absolute", Coordinates::Absolute),
            ("relative", Coordinates::Relative),
        ],
    )?;
    let settings = Explicit { start, coordinates, ..make(tolerance.unwrap_or(1e-9)) };
    Ok(Integration::Explicit(match step {
        Some(h) => settings.with_step_control(StepControl::Fixed(h)),
        None => settings.with_longest_step(longest),
    }))
}

fn implicit(
    section: &Section<'_>,
    names: &Names,
    [start, end]: [f64; 2],
    (step, longest): (Option<f64>, f64),
    tolerance: Option<f64>,
) -> Read<Integration> {
    if section.choice("coordinates", &[("automatic", false), ("absolute", false), ("relative", true)])? {
        let message = "implicit schemes have absolute coordinates";
        return Err(section.error_at("coordinates", message).help("use scheme = \"rk8\", or leave the key out"));
    }
    let number = |key| Ok(section.number(key, names)?.unwrap_or(0.0));
    let is_hht = section.choice("scheme", &[("generalized-alpha", false), ("hht", true)])?;
    let (key, made) = if is_hht {
        ("damping", GeneralizedAlpha::hht(number("damping")?))
    } else {
        ("spectral_radius", GeneralizedAlpha::chung_hulbert(number("spectral_radius")?))
    };
    let scheme = made.map_err(|e| section.error_at(key, e.to_string()))?;
    let step = match tolerance {
        Some(tolerance) => Dynamics::adaptive(tolerance).step.with_longest(longest).for_span(end - start),
        None => StepSize::Fixed(step.unwrap_or(1e-3)),
    };
    let configurations = [
        ("built", InitialConfiguration::Built),
        ("equilibrium", InitialConfiguration::Equilibrium(Statics::default())),
    ];
    let initials = [("consistent", InitialAcceleration::Consistent), ("zero", InitialAcceleration::Zero)];
    Ok(Integration::Implicit(Dynamics {
        initial_configuration: section.choice("initial_configuration", &configurations)?,
        start,
        scheme,
        step,
        initial_acceleration: section.choice("initial_acceleration", &initials)?,
        prescribed: section.choice("prescribed", &[("exact", Prescribed::Exact), ("newmark", Prescribed::Newmark)])?,
        ..Dynamics::fixed(1e-3)
    }))
}

impl Settings {
    /// Time at which the motion starts: the first time point, unless `start` of dynamics says otherwise.
    pub fn start(&self) -> f64 {
        self.start
    }

    /// Returns `true` if the equations of motion are integrated.
    pub fn is_simulation(&self) -> bool {
        matches!(self.kind, AnalysisKind::Dynamics(_))
    }

    /// Returns `true` if the time points are times of a motion, not load cases of statics.
    #[cfg(feature = "report")]
    pub fn is_motion(&self) -> bool {
        !matches!(self.kind, AnalysisKind::Statics)
    }

    /// The outputs of a mechanism at design `b`, with all warnings.
    #[cfg(feature = "report")]
    pub fn analyze(&self, model: MechanismTemplate, times: &[f64], b: &[f64]) -> Result<Responses> {
        let analysis = self.analysis_of(model, times)?;
        let responses = analysis.analyze(b)?;
        let warnings = analysis.warnings(b, &responses);
        Ok(Responses { warnings, ..responses })
    }

    /// The analysis whose responses are the outputs of this mechanism.
    #[cfg(feature = "report")]
    fn analysis_of(&self, model: MechanismTemplate, times: &[f64]) -> Result<Box<dyn Analysis>> {
        Ok(match &self.kind {
            AnalysisKind::Kinematics => {
                Box::new(KinematicResponses::new(model, Assembly::default(), times)?.over(self.sweep.clone()))
            }
            AnalysisKind::Statics => {
                let modal = model.modal_quantities();
                let outputs = StaticResponses::new(model, Statics::default(), times)?.over(self.sweep.clone());
                match modal {
                    Some(modal) => Box::new(ModalResponses::new(outputs, modal)),
                    None => Box::new(outputs),
                }
            }
            AnalysisKind::Dynamics(integration) => {
                let numbers = model.numbers();
                Box::new(Transient::new(model, integration.clone(), times)?.with_numbers(numbers))
            }
        })
    }

    /// The outputs of a mechanism at design `b` at `times`, each a series. Positions that follow from those at the time point before, in statics and
    /// kinematics, are computed along the `grid` of the model, too.
    #[cfg(feature = "report")]
    pub fn sampled(
        &self,
        model: MechanismTemplate,
        grid: Option<&TimeGrid>,
        times: &[f64],
        b: &[f64],
    ) -> Result<Vec<Vec<f64>>> {
        let mut path = match grid {
            Some(grid) if !self.is_simulation() => [&grid.points[..], times].concat(),
            _ => times.to_vec(),
        };
        path.sort_by(f64::total_cmp);
        path.dedup();
        let values = self.analysis_of(model, &path)?.analyze(b)?.values;
        let places: Vec<usize> = times.iter().map(|t| path.partition_point(|at| at < t)).collect();
        Ok(values.iter().map(|series| places.iter().map(|&p| series[p]).collect()).collect())
    }

    /// The problem whose responses are the outputs of this mechanism.
    pub fn build(&self, parts: ProblemBuilder, model: MechanismTemplate, times: &[f64]) -> Result<Problem> {
        match &self.kind {
            AnalysisKind::Kinematics => self
                .derivatives
                .build(parts, KinematicResponses::new(model, Assembly::default(), times)?.over(self.sweep.clone())),
            AnalysisKind::Statics => {
                let modal = model.modal_quantities();
                let outputs = StaticResponses::new(model, Statics::default(), times)?.over(self.sweep.clone());
                match modal {
                    Some(modal) => self.derivatives.build(parts, ModalResponses::new(outputs, modal)),
                    None => self.derivatives.build(parts, outputs),
                }
            }
            AnalysisKind::Dynamics(integration) => {
                let numbers = model.numbers();
                let analysis = Transient::new(model, integration.clone(), times)?.with_numbers(numbers);
                self.derivatives.build(parts, analysis)
            }
        }
    }
}

impl DerivativeSetting {
    /// Reads how the outputs of a program are differentiated; `By("program", _)` stands for its own derivatives.
    pub fn of_program(section: &Section<'_>, names: &Names) -> Read<Self> {
        let step = difference(section, names)?;
        let choices = [
            ("automatic", Self::Forward(step.unwrap_or(1e-4))),
            ("program", Self::By("program", None)),
            ("forward", Self::Forward(step.unwrap_or(1e-4))),
            ("central", Self::Central(step.unwrap_or(1e-4))),
            ("richardson", Self::Richardson(step.unwrap_or(1e-3))),
            ("noise-aware", Self::NoiseAware),
        ];
        let chosen = section.choice("derivatives", &choices)?;
        if step.is_some() && matches!(chosen, Self::By(..) | Self::NoiseAware) {
            return Err(unused_step(section));
        }
        Ok(chosen)
    }

    /// The problem of an analysis with these derivatives.
    fn build(self, parts: ProblemBuilder, analysis: impl Analysis + 'static) -> Result<Problem> {
        let variables = parts.variables().to_vec();
        match self {
            Self::Automatic => parts.build(analysis),
            // A history needs a reverse pass for each time point; its integral or mean needs only one.
            Self::By(method @ "adjoint", step) => {
                Ok(parts.build(Differentiated::by(analysis, method, step)?)?.with_reduced_histories())
            }
            Self::By(method, step) => parts.build(Differentiated::by(analysis, method, step)?),
            Self::Forward(step) => parts.build(Differences::forward(analysis, step)?.with_variables(&variables)),
            Self::Central(step) => parts.build(Differences::central(analysis, step)?.with_variables(&variables)),
            Self::Richardson(step) => parts.build(Differences::richardson(analysis, step)?.with_variables(&variables)),
            Self::NoiseAware => parts.build(Differences::noise_aware(analysis).with_variables(&variables)),
        }
    }
}
