//! `[method]`: the optimization method.

use super::constraints::{NEIGHBOURS, neighbours};
use super::key::{Accepts, Key, TableKeys, default, optional};
use super::section::{Read, Section};
use crate::model_file::Diagnostic;
use crate::model_file::expression::Names;
use crate::sao::{
    AcceptAlways, DEFAULT_PRESET, ErrorBased, Filter, FixedLimits, Globalization, Method, MoveLimits, RelativeLimits,
    StayFeasible, TrustRegion, preset, presets,
};

const KEYS: &[Key] = &[
    default("preset", Accepts::Text, DEFAULT_PRESET, "a method by name; `linkwright compare --list` lists all"),
    optional(
        "accuracy",
        Accepts::Number,
        "relative change of the objective, and violation, below which the run ends; `automatic` has a stop test of its own and does not use it",
    ),
    optional("residual", Accepts::Number, "residual of the optimality conditions below which the run may end"),
    optional("confirm", Accepts::Flag, "whether the automatic method confirms the end of a run; yes by default"),
    optional("max_cycles", Accepts::Count, "largest number of cycles; 500 by default for `automatic`, 100 for others"),
    optional("smallest_factor", Accepts::Number, "move-limit factor below which the run has stalled"),
    optional(
        "cutoff",
        Accepts::NumberOr(&["none"]),
        "normalized value up to which constraints are omitted from the subproblem",
    ),
    NEIGHBOURS,
    optional("moving_peaks", Accepts::Flag, "whether peaks in continuous time move in the approximate problem"),
    optional("move_limits", Accepts::Table, "move limits other than those of the preset"),
    optional("acceptance", Accepts::Table, "acceptance rule other than that of the preset"),
];
const LIMITS: &[Key] =
    &[default("kind", Accepts::Choice(&["relative", "fixed", "trust-region"]), "relative", "the strategy")];
const RELATIVE: &[Key] = &[
    optional("initial", Accepts::Number, "first factor"),
    optional("cap", Accepts::Number, "largest factor"),
    optional("on_rejection", Accepts::Number, "multiplier after a rejected cycle"),
    optional("reduce_above_pct", Accepts::Number, "error in % above which the factors shrink"),
    optional("reduction", Accepts::Number, "multiplier of factors that shrink"),
    optional("increase_below_pct", Accepts::Number, "error in % up to which active limits widen"),
    optional("increase_violation_pct", Accepts::Number, "violation in % up to which active limits widen"),
    optional("increase", Accepts::Number, "multiplier of factors that widen"),
    optional("on_reversal", Accepts::Number, "multiplier where a step has changed its sign"),
    optional("reversal_violation_pct", Accepts::Number, "violation in % above which `on_reversal` applies"),
    optional("floor", Accepts::Number, "smallest width, as a fraction of the range"),
];
const FIXED: &[Key] = &[default("width", Accepts::Number, "1", "half width, as a fraction of the range")];
const ACCEPTANCE: &[Key] =
    &[default("kind", Accepts::Choice(&["errors", "feasible", "always", "filter"]), "errors", "the rule")];
const ERRORS: &[Key] = &[optional("reject_above_pct", Accepts::Number, "error in % above which a cycle is rejected")];
const FEASIBLE: &[Key] =
    &[optional("violation_pct", Accepts::Number, "violation in % up to which every design is accepted")];

/// Declarations for documentation and schema.
pub const TABLES: &[TableKeys] = &[
    TableKeys { name: "method", kind: None, about: "optimization method", keys: KEYS },
    TableKeys { name: "method.move_limits", kind: None, about: "the search subregion", keys: LIMITS },
    TableKeys {
        name: "method.move_limits",
        kind: Some("relative"),
        about: "relative to the range of each variable (Etman et al. 1998)",
        keys: RELATIVE,
    },
    TableKeys { name: "method.move_limits", kind: Some("fixed"), about: "constant width", keys: FIXED },
    TableKeys {
        name: "method.move_limits",
        kind: Some("trust-region"),
        about: "wider after good steps, narrower after bad ones",
        keys: &[],
    },
    TableKeys { name: "method.acceptance", kind: None, about: "acceptance rule", keys: ACCEPTANCE },
    TableKeys {
        name: "method.acceptance",
        kind: Some("errors"),
        about: "designs with small approximation errors (Etman et al. 1998)",
        keys: ERRORS,
    },
    TableKeys {
        name: "method.acceptance",
        kind: Some("feasible"),
        about: "designs with a small violation",
        keys: FEASIBLE,
    },
    TableKeys { name: "method.acceptance", kind: Some("always"), about: "all designs", keys: &[] },
    TableKeys {
        name: "method.acceptance",
        kind: Some("filter"),
        about: "designs that a filter of objective and violation accepts",
        keys: &[],
    },
];

/// Reads `[method]`.
pub fn read(file: &Section<'_>, names: &Names) -> Read<Method> {
    let Some(section) = file.inner("method", &[KEYS])? else { return Ok(Method::default()) };
    let word = section.need_word("preset")?;
    let found = preset(&word.text);
    let found =
        found.map_err(|_| Diagnostic::unknown(word.span, "method", &word.text, presets().iter().map(|p| p.name)))?;
    let mut method = (found.method)();
    let number = |key, field: &mut f64| -> Read<()> {
        section.number(key, names)?.into_iter().for_each(|value| *field = value);
        Ok(())
    };
    number("accuracy", &mut method.stop.accuracy)?;
    number("residual", &mut method.stop.residual)?;
    number("smallest_factor", &mut method.stop.smallest_factor)?;
    if section.has("confirm") {
        method.stop.confirm = section.flag("confirm")?;
    }
    if let Some(count) = section.count("max_cycles", 1_000_000)? {
        method.stop.max_cycles = count;
    }
    method.stop.check().map_err(|e| section.error_at(&key_of_error(&section, &e.to_string()), e.to_string()))?;
    screening(&section, names, &mut method)?;
    if method.automatic.is_some()
        && let Some(key) = ["move_limits", "acceptance", "moving_peaks"].into_iter().find(|key| section.has(key))
    {
        let why = format!("the method `automatic` has no `{key}`; write `preset = \"slp\"` or another preset with it");
        return Err(section.error_at(key, why));
    }
    if section.has("moving_peaks") {
        method.moving_peaks = section.flag("moving_peaks")?;
    }
    if let Some(limits) = move_limits(&section, names)? {
        limits.check().map_err(|e| section.error_at("move_limits", e.to_string()))?;
        method.move_limits = limits;
    }
    if let Some(rule) = acceptance(&section, names)? {
        rule.check().map_err(|e| section.error_at("acceptance", e.to_string()))?;
        method.globalization = rule;
    }
    Ok(method)
}

/// The key to which an error of the stop test refers.
fn key_of_error(section: &Section<'_>, message: &str) -> String {
    let words =
        [("accuracy", "accuracy"), ("residual", "residual"), ("smallest", "smallest_factor"), ("cycles", "max_cycles")];
    let found = words.iter().find(|(word, key)| message.contains(word) && section.has(key));
    found.map_or("accuracy", |(_, key)| key).to_owned()
}

fn screening(section: &Section<'_>, names: &Names, method: &mut Method) -> Read<()> {
    match section.get("cutoff").map(|value| value.get_ref().as_str() == Some("none")) {
        Some(true) => method.screening.cutoff = None,
        Some(false) => method.screening.cutoff = section.number("cutoff", names)?,
        None => {}
    }
    method.screening.check().map_err(|e| section.error_at("cutoff", e.to_string()))?;
    if let Some(selection) = neighbours(section)? {
        method.screening.selection = selection;
    }
    Ok(())
}

fn move_limits(section: &Section<'_>, names: &Names) -> Read<Option<Box<dyn MoveLimits>>> {
    let kinds = [("relative", RELATIVE), ("fixed", FIXED), ("trust-region", &[][..])];
    let Some((kind, inner)) = of_kind(section, "move_limits", LIMITS, "relative", &kinds)? else { return Ok(None) };
    Ok(Some(match kind {
        "relative" => {
            let mut limits = RelativeLimits::default();
            for (key, field) in [
                ("initial", &mut limits.initial),
                ("cap", &mut limits.cap),
                ("on_rejection", &mut limits.on_rejection),
                ("reduce_above_pct", &mut limits.reduce_above_pct),
                ("reduction", &mut limits.reduction),
                ("increase_below_pct", &mut limits.increase_below_pct),
                ("increase_violation_pct", &mut limits.increase_violation_pct),
                ("increase", &mut limits.increase),
                ("on_reversal", &mut limits.on_reversal),
                ("reversal_violation_pct", &mut limits.reversal_violation_pct),
                ("floor", &mut limits.floor),
            ] {
                inner.number(key, names)?.into_iter().for_each(|value| *field = value);
            }
            if inner.has("initial") && !inner.has("cap") {
                limits.cap = limits.cap.max(limits.initial);
            }
            Box::new(limits)
        }
        "fixed" => Box::new(FixedLimits { width: inner.number("width", names)?.unwrap_or(1.0) }),
        _ => Box::new(TrustRegion::default()),
    }))
}

fn acceptance(section: &Section<'_>, names: &Names) -> Read<Option<Box<dyn Globalization>>> {
    let kinds = [("errors", ERRORS), ("feasible", FEASIBLE), ("always", &[][..]), ("filter", &[][..])];
    let Some((kind, inner)) = of_kind(section, "acceptance", ACCEPTANCE, "errors", &kinds)? else { return Ok(None) };
    Ok(Some(match kind {
        "errors" => {
            let mut rule = ErrorBased::default();
            inner.number("reject_above_pct", names)?.into_iter().for_each(|v| rule.reject_above_pct = v);
            Box::new(rule)
        }
        "feasible" => {
            let mut rule = StayFeasible::default();
            inner.number("violation_pct", names)?.into_iter().for_each(|v| rule.violation_pct = v);
            Box::new(rule)
        }
        "always" => Box::new(AcceptAlways),
        _ => Box::new(Filter::default()),
    }))
}

/// A table with `kind` inside [method], with its kind.
fn of_kind<'a>(
    section: &Section<'a>,
    key: &str,
    common: &'static [Key],
    usual: &str,
    kinds: &[(&'static str, &'static [Key])],
) -> Read<Option<(&'static str, Section<'a>)>> {
    let Some(value) = section.get(key) else { return Ok(None) };
    let (kind, keys) = match value.get_ref().as_table() {
        Some(table) => Section::kind(table, key, usual, kinds.iter().map(|(name, keys)| (*name, (*name, *keys))))?,
        None => ("", &[][..]),
    };
    let inner = Section::open(value, &format!("[method.{key}]"), &[common, keys], section.source())?;
    Ok(Some((kind, inner)))
}
