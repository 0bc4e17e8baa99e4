//! `[analysis]`: how the mechanism is analysed.

use super::key::{Accepts, Key, Table, default, optional, required};
use super::mechanism::Blueprint;
use super::section::{Read, Section};
use crate::Result;
use crate::analysis::dynamics::{Dynamics, InitialAcceleration, StepSize};
use crate::analysis::explicit::{Explicit, Pace};
use crate::analysis::generalized_alpha::{GeneralizedAlpha, Prescribed};
use crate::analysis::start::Assembly;
use crate::analysis::statics::Statics;
use crate::model::expression::Names;
use crate::model::limits;
use crate::problem::{Differences, Problem, ProblemBuilder, TimeGrid};
use crate::sensitivity::{Balanced, Differentiation, Driven, Integration, Transient};

const KEYS: &[Key] = &[required("kind", Accepts::Choice(&["dynamics", "kinematics", "statics"]), "what is computed")];
const DYNAMICS: &[Key] = &[
    default("start", Accepts::Number, "0", "time at which the motion starts, s"),
    default(
        "scheme",
        Accepts::Choice(&["generalized-alpha", "hht", "rk5", "rk8"]),
        "generalized-alpha",
        "integration method",
    ),
    optional("step", Accepts::Number, "fixed time step, s"),
    optional("tolerance", Accepts::Number, "tolerated local error, in place of a fixed step"),
    default("spectral_radius", Accepts::Number, "0.9", "of generalized-alpha at infinite frequency, 0 to 1"),
    default("damping", Accepts::Number, "0.05", "numerical damping of hht, 0 to 1/3"),
    default(
        "initial_acceleration",
        Accepts::Choice(&["consistent", "zero"]),
        "consistent",
        "accelerations at the start",
    ),
    default(
        "prescribed",
        Accepts::Choice(&["exact", "steps"]),
        "exact",
        "velocity of prescribed coordinates: exact, or from the steps",
    ),
    default(
        "derivatives",
        Accepts::Choice(&["automatic", "direct", "adjoint", "forward", "central"]),
        "automatic",
        "direct or adjoint differentiation, whichever costs less, or differences",
    ),
    default("difference", Accepts::Number, "1e-6", "relative step of differences"),
];

/// Declarations for documentation and schema.
pub const TABLES: &[Table] = &[
    Table { name: "analysis", kind: None, about: "how the mechanism is analysed", keys: KEYS },
    Table { name: "analysis", kind: Some("dynamics"), about: "the motion over time", keys: DYNAMICS },
    Table {
        name: "analysis",
        kind: Some("kinematics"),
        about: "a mechanism whose every motion is prescribed, with its inverse dynamics",
        keys: &[],
    },
    Table { name: "analysis", kind: Some("statics"), about: "static equilibria, one for every time point", keys: &[] },
];

/// How derivatives of a motion are had.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Derivatives {
    Exact(Differentiation),
    Forward(f64),
    Central(f64),
}

/// The analysis of a mechanism.
#[derive(Clone, Debug)]
pub struct Settings(Kind);

#[derive(Clone, Debug)]
enum Kind {
    Dynamics(Integration, Derivatives),
    Kinematics,
    Statics,
}

/// Reads the section.
pub fn read(file: &Section<'_>, names: &Names, grid: &TimeGrid) -> Read<Settings> {
    let Some(value) = file.get("analysis") else {
        let help = "for instance [analysis] with kind = \"dynamics\" and step = 1e-3";
        return Err(file.complain("analysis", "a mechanism needs [analysis]").help(help));
    };
    let kinds = [("dynamics", (0, DYNAMICS)), ("kinematics", (1, &[][..])), ("statics", (2, &[][..]))];
    let kind = match value.get_ref().as_table() {
        Some(table) => Section::kind(table, "analysis", "", kinds.into_iter())?,
        None => (0, DYNAMICS),
    };
    let section = Section::open(value, "[analysis]", &[KEYS, kind.1], file.source())?;
    match kind.0 {
        0 => dynamics(&section, names, grid).map(Settings),
        1 => Ok(Settings(Kind::Kinematics)),
        _ => Ok(Settings(Kind::Statics)),
    }
}

fn dynamics(section: &Section<'_>, names: &Names, grid: &TimeGrid) -> Read<Kind> {
    let number = |key| section.number(key, names);
    let start = number("start")?.unwrap_or(0.0);
    if grid.points[0] < start {
        let message = format!("the motion starts at {start}, after the first time point {}", grid.points[0]);
        return Err(section.complain("start", message));
    }
    let (step, tolerance) = (number("step")?, number("tolerance")?);
    for (key, value) in [("step", step), ("tolerance", tolerance)] {
        if value.is_some_and(|v| v <= 0.0) {
            return Err(section.complain(key, format!("`{key}` must be positive")));
        }
    }
    if let Some(h) = step
        && (grid.points[grid.len() - 1] - start) / h > limits::STEPS
    {
        let message = format!("a step of {h} makes more than {:e} time steps", limits::STEPS);
        return Err(section.complain("step", message).help("take a longer step, or end sooner"));
    }
    let is_explicit =
        section.choice("scheme", &[("generalized-alpha", false), ("hht", false), ("rk5", true), ("rk8", true)])?;
    let integration = match (step, tolerance) {
        (Some(_), Some(_)) => return Err(section.complain("tolerance", "`step` and `tolerance` exclude each other")),
        (None, None) => return Err(section.complain("step", "dynamics needs `step` or `tolerance`")),
        _ if is_explicit => explicit(section, start, step, tolerance)?,
        _ => implicit(section, names, start, step, tolerance)?,
    };
    let relative = number("difference")?.unwrap_or(1e-6);
    let choices = [
        ("automatic", Derivatives::Exact(Differentiation::Automatic)),
        ("direct", Derivatives::Exact(Differentiation::Direct)),
        ("adjoint", Derivatives::Exact(Differentiation::Adjoint)),
        ("forward", Derivatives::Forward(relative)),
        ("central", Derivatives::Central(relative)),
    ];
    Ok(Kind::Dynamics(integration, section.choice("derivatives", &choices)?))
}

fn explicit(section: &Section<'_>, start: f64, step: Option<f64>, tolerance: Option<f64>) -> Read<Integration> {
    let make: fn(f64) -> Explicit =
        section.choice("scheme", &[("rk5", Explicit::adaptive as fn(f64) -> _), ("rk8", Explicit::eighth_order)])?;
    let settings = Explicit { start, ..make(tolerance.unwrap_or(1e-9)) };
    Ok(Integration::Explicit(match step {
        Some(h) => settings.with_pace(Pace::Fixed(h)),
        None => settings,
    }))
}

fn implicit(
    section: &Section<'_>,
    names: &Names,
    start: f64,
    step: Option<f64>,
    tolerance: Option<f64>,
) -> Read<Integration> {
    let number = |key| Ok(section.number(key, names)?.unwrap_or(0.0));
    let is_hht = section.choice("scheme", &[("generalized-alpha", false), ("hht", true)])?;
    let (key, made) = if is_hht {
        ("damping", GeneralizedAlpha::hht(number("damping")?))
    } else {
        ("spectral_radius", GeneralizedAlpha::chung_hulbert(number("spectral_radius")?))
    };
    let scheme = made.map_err(|e| section.complain(key, e.to_string()))?;
    let step = match tolerance {
        Some(tolerance) => Dynamics::adaptive(tolerance).step,
        None => StepSize::Fixed(step.unwrap_or(1e-3)),
    };
    let initials = [("consistent", InitialAcceleration::Consistent), ("zero", InitialAcceleration::Zero)];
    Ok(Integration::Implicit(Dynamics {
        start,
        scheme,
        step,
        initial: section.choice("initial_acceleration", &initials)?,
        prescribed: section.choice("prescribed", &[("exact", Prescribed::Exact), ("steps", Prescribed::Newmark)])?,
        ..Dynamics::fixed(1e-3)
    }))
}

impl Settings {
    /// The problem whose responses are the outputs of this mechanism.
    pub fn build(&self, parts: ProblemBuilder, model: Blueprint, times: &[f64]) -> Result<Problem> {
        match &self.0 {
            Kind::Kinematics => parts.build(Driven::new(model, Assembly::default(), times)?),
            Kind::Statics => parts.build(Balanced::new(model, Statics::default(), times)?),
            Kind::Dynamics(integration, derivatives) => {
                let transient = Transient::new(model, integration.clone(), times)?;
                match derivatives {
                    Derivatives::Exact(method) => parts.build(transient.differentiating(*method)?),
                    Derivatives::Forward(step) => parts.build(Differences::forward(transient, *step)?),
                    Derivatives::Central(step) => parts.build(Differences::central(transient, *step)?),
                }
            }
        }
    }
}
