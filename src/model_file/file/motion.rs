//! Functions of time: prescribed positions, forces and torques.

use super::key::{Accepts, Key, TableKeys, default, required};
use super::section::{Read, Section, tree, wrong_type};
use crate::model_file::Diagnostic;
use crate::model_file::expression::{CompiledExpression, Inputs, Names, Scope};
use autodiff::Scalar;
use mechanics::mechanism::scalars::MOST_MOTION_PARAMETERS;
use mechanics::motion::{ConstantSpeed, Harmonic, Motion, Ramp, StartUp, TabulatedMotion};
use toml::de::DeValue;

const KIND: Key = required("kind", Accepts::Choice(KINDS), "kind of motion");
const KINDS: &[&str] = &["constant-speed", "start-up", "harmonic", "ramp", "table"];
const CONSTANT_SPEED: &[Key] = &[
    default("position", Accepts::Expression, "0", "position at time 0, m or rad").of("m or rad"),
    required("speed", Accepts::Expression, "speed, m/s or rad/s").of("m/s or rad/s"),
];
const START_UP: &[Key] = &[
    default("position", Accepts::Expression, "0", "position at time 0, m or rad").of("m or rad"),
    required("speed", Accepts::Expression, "final speed, m/s or rad/s").of("m/s or rad/s"),
    required("duration", Accepts::Expression, "duration of the rise, s").of("s"),
    default("profile", Accepts::Choice(PROFILES), "half-cosine", "rise of the speed from zero"),
];
const PROFILES: &[&str] = &["sudden", "linear", "cubic", "half-cosine", "cycloid", "polynomial"];
const HARMONIC: &[Key] = &[
    default("mean", Accepts::Expression, "0", "mean value, m or rad, N or N·m").of("m or rad or N or N·m"),
    required("amplitude", Accepts::Expression, "amplitude, m or rad, N or N·m").of("m or rad or N or N·m"),
    required("frequency", Accepts::Expression, "angular frequency, rad/s").of("rad/s"),
    default("phase", Accepts::Expression, "0", "phase angle, rad").of("rad"),
];
const RAMP: &[Key] = &[
    required("from", Accepts::Expression, "value before the ramp").of_any_unit(),
    required("to", Accepts::Expression, "value after the ramp").of_any_unit(),
    default("begin", Accepts::Expression, "0", "start of the ramp, s").of("s"),
    required("duration", Accepts::Expression, "duration of the ramp, s").of("s"),
    default("profile", Accepts::Choice(&["smooth", "linear"]), "smooth", "smooth: the 3-4-5 polynomial"),
];
const TABLE: &[Key] = &[
    required("times", Accepts::Numbers, "increasing times, s").of("s"),
    required("values", Accepts::Numbers, "values at these times, interpolated by a natural cubic spline").of_any_unit(),
    default("scale", Accepts::Expression, "1", "factor of all values").of_any_unit(),
];

/// Declarations for documentation and schema.
pub const TABLES: &[TableKeys] = &[
    TableKeys {
        name: "motion",
        kind: None,
        about: "a function of time as a table; an expression of `time` is possible, too",
        keys: &[KIND],
    },
    TableKeys { name: "motion", kind: Some("constant-speed"), about: "position + speed·time", keys: CONSTANT_SPEED },
    TableKeys { name: "motion", kind: Some("start-up"), about: "from rest to a constant speed", keys: START_UP },
    TableKeys {
        name: "motion",
        kind: Some("harmonic"),
        about: "mean + amplitude·sin(frequency·time + phase)",
        keys: HARMONIC,
    },
    TableKeys { name: "motion", kind: Some("ramp"), about: "from one value to another", keys: RAMP },
    TableKeys { name: "motion", kind: Some("table"), about: "a spline through given values", keys: TABLE },
];

/// The form of a function of time, without its parameters.
#[derive(Clone, Debug)]
pub enum MotionLaw {
    /// A formula of time whose design variables are the parameters.
    Formula(CompiledExpression),
    ConstantSpeed,
    StartUp(StartUp),
    Harmonic,
    Ramp(Ramp),
    Table(TabulatedMotion),
}

impl Motion for MotionLaw {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        match self {
            Self::Formula(expression) => expression.value(&Inputs::at(p, t)),
            Self::ConstantSpeed => ConstantSpeed.position(p, t),
            Self::StartUp(profile) => profile.position(p, t),
            Self::Harmonic => Harmonic.position(p, t),
            Self::Ramp(ramp) => ramp.position(p, t),
            Self::Table(table) => table.position(p, t),
        }
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        match self {
            Self::StartUp(profile) => Motion::validate_parameters(profile, p),
            Self::Ramp(ramp) => Motion::validate_parameters(ramp, p),
            Self::Formula(_) | Self::ConstantSpeed | Self::Harmonic | Self::Table(_) => None,
        }
    }

    fn breaks(&self, p: &[f64]) -> Vec<f64> {
        match self {
            Self::Formula(expression) => expression.breaks(p),
            Self::ConstantSpeed | Self::Harmonic => vec![],
            Self::StartUp(profile) => Motion::breaks(profile, p),
            Self::Ramp(ramp) => Motion::breaks(ramp, p),
            Self::Table(table) => Motion::breaks(table, p),
        }
    }
}

/// A function of time whose parameters are expressions of the design variables.
#[derive(Clone, Debug)]
pub struct TimeFunction {
    pub law: MotionLaw,
    pub parameters: Vec<CompiledExpression>,
}

/// The key of a prescribed position, as against a force.
const MOTION: &str = "motion";

impl TimeFunction {
    /// Returns whether the time at which the acceleration jumps depends on the design.
    fn has_moving_end(&self) -> bool {
        // Its parameters are position, speed and duration.
        matches!(self.law, MotionLaw::StartUp(StartUp::Linear))
            && self.parameters.last().is_some_and(|duration| !duration.uses().is_empty())
    }
}

/// The function of time at `key` of a part.
pub fn read(section: &Section<'_>, key: &str, names: &Names) -> Read<TimeFunction> {
    let value = section.get(key).expect("the key is required");
    if let DeValue::Table(table) = value.get_ref() {
        let kind = Section::kind(table, "motion", "", KINDS.iter().map(|k| (*k, *k)))?;
        let keys = TABLES.iter().find(|t| t.kind == Some(kind)).expect("every kind is declared").keys;
        let inner = Section::open(value, &format!("`{key}`"), &[&[KIND], keys], section.source())?;
        let function = of_kind(kind, keys, &inner, names)?;
        if key == MOTION && function.has_moving_end() {
            remark_acceleration(section, &value.span());
        }
        return Ok(function);
    }
    if matches!(value.get_ref(), DeValue::Array(_) | DeValue::Boolean(_) | DeValue::Datetime(_)) {
        return Err(wrong_type(value, &format!("`{key}`"), "an expression of time, or a motion"));
    }
    let tree = tree(value, key, section.source())?;
    let scope = Scope { place: &format!("`{key}`"), units: section.unit_of(key), ..Scope::MOTION };
    let expression = names.compile(&tree, &scope).map_err(|error| of_time_only(error, key))?;
    match key == MOTION && expression.has_moving_condition() {
        true => remark_acceleration(section, &tree.span),
        false => remark_jumps(section, &expression, &tree.span, JumpsAt::Time),
    }
    let used = expression.uses();
    if used.len() > MOST_MOTION_PARAMETERS {
        let message =
            format!("a motion may use {MOST_MOTION_PARAMETERS} design variables, this one uses {}", used.len());
        return Err(Diagnostic::new(tree.span, message));
    }
    let parameters = used.iter().map(|&i| CompiledExpression::variable(i)).collect();
    Ok(TimeFunction { law: MotionLaw::Formula(expression.with_design(&used)), parameters })
}

/// The error about a measure in a function of time, with the part that may depend on measures.
fn of_time_only(error: Diagnostic, key: &str) -> Diagnostic {
    if !error.unknown_name.as_ref().is_some_and(|name| name.contains('.')) {
        return error;
    }
    error.help(match key {
        MOTION => "a motion is a function of time; a force can depend on the motion: kind = \"feedback\"",
        _ => "a force that depends on the motion has kind = \"feedback-force\", at a point, or \"feedback\", of a coordinate",
    })
}

/// Adds a note about derivatives of a motion whose acceleration jumps at a time that depends on the design.
fn remark_acceleration(section: &Section<'_>, at: &std::ops::Range<usize>) {
    let message = "if its acceleration jumps at a time that depends on the design, derivatives by explicit and by adaptive steps lack the effect of that time; \
                   those by fixed implicit steps have it, and all if an `[[event]]` happens at that time";
    let help = "add an event that becomes true there, such as when = \"time > …\", or take a motion with a continuous acceleration, such as \
                profile = \"cubic\" or `smooth_step`";
    section.source().log.remark(Diagnostic::new(at.clone(), message).help(help));
}

/// Variables of the condition at which a function jumps.
pub enum JumpsAt {
    /// The time: an event then ends the steps at the jump.
    Time,
    /// Time and motion: stages of a step that ends at an event may be on the other side of it.
    Motion,
}

/// Adds a note that derivatives neglect how the place of a jump of a force changes with the design.
pub fn remark_jumps(section: &Section<'_>, expression: &CompiledExpression, at: &std::ops::Range<usize>, by: JumpsAt) {
    if expression.has_moving_jump() {
        let (message, help) = match by {
            JumpsAt::Time => (
                "its value jumps where a condition changes, and derivatives lack the effect of the design on that time, unless an `[[event]]` happens then",
                "add an event with this condition, which may have no other effect, or let the value change by `smooth_step`",
            ),
            JumpsAt::Motion => (
                "its value jumps where a condition changes, and derivatives lack the effect of the design on that place",
                "switch a force on or off by an `[[event]]`, or let it change by `smooth_step`",
            ),
        };
        section.source().log.remark(Diagnostic::new(at.clone(), message).help(help));
    }
}

fn of_kind(kind: &str, keys: &[Key], section: &Section<'_>, names: &Names) -> Read<TimeFunction> {
    let numbers = keys.iter().filter(|key| key.accepts == Accepts::Expression);
    let parameters =
        numbers.map(|key| section.expression(key.name, names, &Scope::DESIGN)).collect::<Read<Vec<_>>>()?;
    let law = match kind {
        "constant-speed" => MotionLaw::ConstantSpeed,
        "harmonic" => MotionLaw::Harmonic,
        "ramp" => MotionLaw::Ramp(section.choice("profile", &[("smooth", Ramp::Smooth), ("linear", Ramp::Linear)])?),
        "start-up" => {
            let profiles = [
                StartUp::Sudden,
                StartUp::Linear,
                StartUp::Cubic,
                StartUp::HalfCosine,
                StartUp::Cycloid,
                StartUp::Polynomial,
            ];
            let choices: Vec<_> = PROFILES.iter().copied().zip(profiles).collect();
            MotionLaw::StartUp(section.choice("profile", &choices)?)
        }
        _ => {
            let list = |key| Ok(section.numbers(key, names)?.unwrap_or_default());
            let table = TabulatedMotion::new(&list("times")?, &list("values")?);
            MotionLaw::Table(table.map_err(|e| section.error_at("times", e.to_string()))?)
        }
    };
    if parameters.iter().all(|expression: &CompiledExpression| expression.uses().is_empty()) {
        let values: Vec<f64> = parameters.iter().map(|expression| expression.value(&Inputs::design(&[]))).collect();
        if let Some(why) = Motion::validate_parameters(&law, &values) {
            let key = if section.has("duration") { "duration" } else { "kind" };
            return Err(section.error_at(key, why).help("give a positive duration"));
        }
    }
    Ok(TimeFunction { law, parameters })
}
