//! The study file: its keys and their values.

use super::distribution::Distribution;
use super::model::VariedNumber;
use super::sequence::SequenceKind;
use crate::model_file::expression::{ExpressionTree, Names};
use crate::model_file::{
    Accepts, Diagnostic, DiagnosticReport, FileSource, Key, Read, Section, TableKeys, Word, default, find, number_of,
    optional, ordered, read_document, required, wrong_type,
};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Largest number of runs of a study.
pub const RUNS: usize = 10_000_000;

/// Kind of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StudyKind {
    /// Analyses at all points of a grid.
    Grid,
    /// Analyses at points of a sample.
    Sample,
    /// Optimizations from many starts by several methods.
    MultiStart,
    /// Optimizations for each value of a parameter.
    Sweep,
    /// Scatter of the results for scattered variables.
    Tolerance,
    /// Optimizations for limits on other objectives.
    Pareto,
    /// Sensitivity indices.
    Indices,
}

/// Names of the kinds.
pub const KINDS: [(&str, StudyKind); 7] = [
    ("grid", StudyKind::Grid),
    ("sample", StudyKind::Sample),
    ("multi-start", StudyKind::MultiStart),
    ("sweep", StudyKind::Sweep),
    ("tolerance", StudyKind::Tolerance),
    ("pareto", StudyKind::Pareto),
    ("indices", StudyKind::Indices),
];

const COMMON: &[Key] = &[
    required("version", Accepts::Count, "version of the format: 1"),
    required("model", Accepts::Text, "the model file, relative to the study file"),
    required(
        "kind",
        Accepts::Choice(&["grid", "sample", "multi-start", "sweep", "tolerance", "pareto", "indices"]),
        "what is studied",
    ),
    default("title", Accepts::Text, "", "title of the page; by default that of the model"),
    optional(
        "set",
        Accepts::Table,
        "other settings of the model: \"time.points\" = 51; the empty text leaves one out: \"analysis.step\" = \"\"",
    ),
    required("vary", Accepts::Tables, "what varies, as tables [vary.NAME]"),
];
const QUANTITIES: Key = optional(
    "quantities",
    Accepts::Texts,
    "results of each analysis: the objective, constraints, NAME.margin, violation_pct, outputs as NAME.min, NAME.max, NAME.end; by default objective, constraints and violation",
);
const SEED: Key =
    default("seed", Accepts::Count, "1", "number that selects the random points; 0 leaves a Sobol sequence as it is");
const SEQUENCE: Key = default(
    "sequence",
    Accepts::Choice(&["sobol", "latin-hypercube", "random"]),
    "sobol",
    "how points fill the space: Sobol sequence, Latin hypercube, or independent random points",
);

const GRID: &[Key] = &[QUANTITIES];
const SAMPLE: &[Key] = &[required("count", Accepts::Count, "number of points"), SEQUENCE, SEED, QUANTITIES];
const MULTI_START: &[Key] = &[
    required("count", Accepts::Count, "number of starts; the first one is the start of the model"),
    SEQUENCE,
    SEED,
    optional("methods", Accepts::Texts, "presets of methods, or \"all\"; by default the method of the model"),
];
const SWEEP: &[Key] = &[];
const TOLERANCE: &[Key] = &[
    default("count", Accepts::Count, "1000", "number of analyses that confirm the result (Monte Carlo); 0 for none"),
    SEQUENCE,
    SEED,
    QUANTITIES,
];
const PARETO: &[Key] = &[];
const INDICES: &[Key] = &[
    required(
        "count",
        Accepts::Count,
        "base number N: N·(d + 2) analyses for d variables by `sobol`, N·(d + 1) by `morris`",
    ),
    default("method", Accepts::Choice(&["sobol", "morris"]), "sobol", "Sobol indices, or elementary effects of Morris"),
    SEED,
    QUANTITIES,
];

const RANGE: &[Key] = &[
    required("from", Accepts::Number, "first value"),
    required("to", Accepts::Number, "last value"),
    required("points", Accepts::Count, "number of values, at least 2"),
    default("scale", Accepts::Choice(&["linear", "logarithmic"]), "linear", "equal differences or equal ratios"),
];
const SPREAD: &[Key] = &[
    optional("from", Accepts::Number, "smallest value of a uniform variable; the lower bound by default"),
    optional("to", Accepts::Number, "largest value of a uniform variable; the upper bound by default"),
    optional("mean", Accepts::Number, "mean; the value in the model by default"),
    optional("deviation", Accepts::Number, "standard deviation"),
    optional(
        "plus_minus",
        Accepts::Number,
        "half width of a uniform variable, or three standard deviations of a normal one",
    ),
    optional(
        "distribution",
        Accepts::Choice(&["normal", "uniform"]),
        "`normal` by default if there is a deviation, `uniform` otherwise",
    ),
];
const START: &[Key] = &[
    optional("from", Accepts::Number, "smallest start; the lower bound by default"),
    optional("to", Accepts::Number, "largest start; the upper bound by default"),
];

/// The tables of a study file, for the documentation.
pub fn study_tables() -> Vec<TableKeys> {
    let table = |name, kind, about, keys| TableKeys { name, kind, about, keys };
    vec![
        table("", None, "all studies", COMMON),
        table("", Some("grid"), "analyses at all points of a grid", GRID),
        table("", Some("sample"), "analyses at the points of a sample", SAMPLE),
        table("", Some("multi-start"), "optimizations from many starts by several methods", MULTI_START),
        table("", Some("sweep"), "the optimum for each value of one parameter", SWEEP),
        table("", Some("tolerance"), "scatter of results for scattered variables", TOLERANCE),
        table("", Some("pareto"), "optima for limits on other objectives", PARETO),
        table("", Some("indices"), "which variable matters", INDICES),
        table("vary.NAME", Some("grid, sweep, pareto"), "values of a variable", RANGE),
        table("vary.NAME", Some("sample, tolerance, indices"), "distribution of a variable", SPREAD),
        table("vary.NAME", Some("multi-start"), "range of starts of a design variable", START),
    ]
}

/// A varied quantity: its name, and numbers in the unit that it has in the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Vary {
    /// Its name, with its place.
    pub(super) name: Word,
    from: Option<ExpressionTree>,
    to: Option<ExpressionTree>,
    points: usize,
    pub(super) is_logarithmic: bool,
    mean: Option<ExpressionTree>,
    deviation: Option<ExpressionTree>,
    plus_minus: Option<ExpressionTree>,
    is_normal: Option<bool>,
}

impl Vary {
    /// A number of the file in a unit or label, see [`number_of`].
    fn number(&self, tree: &Option<ExpressionTree>, unit: &str) -> Read<Option<f64>> {
        tree.as_ref().map(|tree| number_of(tree, unit, &self.name.text)).transpose()
    }

    /// The ends of a range in this unit, as far as they are given.
    ///
    /// # Errors
    /// If a number has a unit of another dimension, or a range that decreases has a unit at one end only.
    pub(super) fn ends(&self, unit: &str) -> Read<[Option<f64>; 2]> {
        let ends = [self.number(&self.from, unit)?, self.number(&self.to, unit)?];
        // A plain number beside one with a unit may have been meant in that unit.
        let has_unit = |tree: &Option<ExpressionTree>| tree.as_ref().is_some_and(|tree| tree.unit().is_some());
        if let ([Some(from), Some(to)], true) = (ends, has_unit(&self.from) != has_unit(&self.to))
            && from > to
        {
            let message = format!(
                "the range of `{}` is {from} to {to} {unit}: one end has a unit, and the other has that of the model",
                self.name.text
            );
            return Err(
                Diagnostic::new(self.name.span.clone(), message).help("write both with their units, or both without")
            );
        }
        Ok(ends)
    }

    /// The values of a range in this unit.
    ///
    /// # Errors
    /// As [`ends`](Self::ends), and if both are equal.
    pub(super) fn values(&self, unit: &str) -> Read<Vec<f64>> {
        let [from, to] = self.ends(unit)?.map(|end| end.expect("the key is required"));
        if from == to {
            let place = self.to.as_ref().map_or_else(|| self.name.span.clone(), |to| to.span.clone());
            return Err(Diagnostic::new(place, "the range is empty").help("give `to` other than `from`"));
        }
        let value = |k: usize| match k {
            0 => from,
            k if k + 1 == self.points => to,
            k => {
                let part = k as f64 / (self.points - 1) as f64;
                if self.is_logarithmic { from * (to / from).powf(part) } else { from + (to - from) * part }
            }
        };
        Ok((0..self.points).map(value).collect())
    }

    /// The distribution of a number of the model.
    ///
    /// # Errors
    /// If the keys do not determine a distribution, or a number has a unit of another dimension.
    pub(super) fn distribution(&self, of: &VariedNumber) -> Read<Distribution> {
        let error =
            |message: String, help: &str| Err(Diagnostic::new(self.name.span.clone(), message).help(help.to_owned()));
        let number = |tree: &Option<ExpressionTree>| self.number(tree, &of.unit);
        let [from, to] = self.ends(&of.unit)?;
        let mean = number(&self.mean)?.unwrap_or(of.start);
        let is_normal = self.is_normal.unwrap_or(self.deviation.is_some());
        let half = match (number(&self.deviation)?, number(&self.plus_minus)?) {
            (Some(_), Some(_)) => {
                return error(
                    format!("`{}` has both `deviation` and `plus_minus`", self.name.text),
                    "give one of them",
                );
            }
            (Some(deviation), None) if is_normal => Some(deviation),
            (Some(deviation), None) => Some(3f64.sqrt() * deviation),
            (None, Some(half)) if is_normal => Some(half / 3.0),
            (None, half) => half,
        };
        if half.is_some_and(|half| !(half > 0.0)) {
            return error(
                format!("the spread of `{}` is not positive", self.name.text),
                "give a positive number, or remove the variable",
            );
        }
        if is_normal {
            return match half {
                Some(deviation) if from.is_none() && to.is_none() => Ok(Distribution::Normal { mean, deviation }),
                Some(_) => error(format!("`{}` is normal and has a range", self.name.text), "remove `from` and `to`"),
                None => error(format!("`{}` lacks `deviation`", self.name.text), "give `deviation` or `plus_minus`"),
            };
        }
        let [lower, upper] = of.bounds;
        let (from, to) = match half {
            Some(half) => (mean - half, mean + half),
            None => (from.unwrap_or(lower), to.unwrap_or(upper)),
        };
        if !(from.is_finite() && to.is_finite()) {
            return error(
                format!("`{}` has no finite range", self.name.text),
                "give `from` and `to`, or bounds in the model",
            );
        }
        if !(from < to) {
            return error(
                format!("the range of `{}` is empty: {from} to {to} {}", self.name.text, of.unit).trim_end().to_owned(),
                "give `from` below `to`",
            );
        }
        Ok(Distribution::Uniform { from, to })
    }
}

/// A study file.
#[derive(Clone, Debug)]
pub struct StudyFile {
    /// Name of the file, for messages.
    pub file: String,
    /// Its text.
    pub text: String,
    /// The kind.
    pub kind: StudyKind,
    /// The title; may be empty.
    pub title: String,
    /// The model file, relative to the study file.
    pub model: String,
    pub(super) settings: Vec<(Word, String)>,
    pub(super) vary: Vec<Vary>,
    pub(super) quantities: Vec<Word>,
    pub(super) methods: Vec<Word>,
    pub(super) count: usize,
    pub(super) sequence: SequenceKind,
    pub(super) seed: u64,
    pub(super) is_morris: bool,
}

impl StudyFile {
    /// Reads a study file; `file` is its name in messages.
    ///
    /// # Errors
    /// The first errors of the file with their locations.
    pub fn read(file: &str, text: &str) -> Result<Self, Box<DiagnosticReport>> {
        let read = read_document(file, text, of_table)?;
        Ok(Self { file: file.to_owned(), text: text.to_owned(), ..read })
    }

    /// A report of one diagnostic of this file.
    pub(super) fn report(&self, diagnostic: Diagnostic) -> Box<DiagnosticReport> {
        Box::new(DiagnosticReport { file: self.file.clone(), text: self.text.clone(), diagnostics: vec![diagnostic] })
    }
}

fn of_table(table: &DeTable<'_>, source: FileSource<'_>) -> Read<StudyFile> {
    let kind = Section::kind(table, "study", "", KINDS.into_iter())?;
    let own = match kind {
        StudyKind::Grid => GRID,
        StudyKind::Sample => SAMPLE,
        StudyKind::MultiStart => MULTI_START,
        StudyKind::Sweep => SWEEP,
        StudyKind::Tolerance => TOLERANCE,
        StudyKind::Pareto => PARETO,
        StudyKind::Indices => INDICES,
    };
    let section = Section::of(table.clone(), 0..source.text.len(), "the study", &[COMMON, own], source)?;
    source.log.check()?;
    if section.count("version", usize::MAX)? != Some(1) {
        return Err(section.error_at("version", "this program reads version 1 of study files").label("expected 1"));
    }
    let has = |key: &str| own.iter().any(|known| known.name == key);
    let count = if has("count") { section.count("count", RUNS)? } else { None };
    let sequences = [
        ("sobol", SequenceKind::Sobol),
        ("latin-hypercube", SequenceKind::LatinHypercube),
        ("random", SequenceKind::Random),
    ];
    let sequence = if has("sequence") { section.choice("sequence", &sequences)? } else { SequenceKind::Sobol };
    let seed = if has("seed") { section.count("seed", usize::MAX)? } else { None };
    let read = StudyFile {
        file: String::new(),
        text: String::new(),
        kind,
        title: section.text("title")?,
        model: section.need_word("model")?.text,
        settings: settings(&section)?,
        vary: varied(&section, kind)?,
        quantities: if has("quantities") { words(&section, "quantities")? } else { vec![] },
        methods: if has("methods") { words(&section, "methods")? } else { vec![] },
        count: count.unwrap_or(if kind == StudyKind::Tolerance { 1000 } else { 0 }),
        sequence,
        seed: seed.unwrap_or(1) as u64,
        is_morris: has("method") && section.choice("method", &[("sobol", false), ("morris", true)])?,
    };
    let least = match kind {
        StudyKind::Sample | StudyKind::MultiStart => 1,
        StudyKind::Indices => 2,
        _ => 0,
    };
    if read.count < least {
        return Err(section.error_at("count", format!("`count` must be at least {least}")));
    }
    Ok(read)
}

/// The settings of the model, as written in the file.
fn settings(section: &Section<'_>) -> Read<Vec<(Word, String)>> {
    let Some(value) = section.get("set") else { return Ok(vec![]) };
    let Some(table) = value.get_ref().as_table() else { return Err(wrong_type(value, "`set`", "a table")) };
    let one = |(key, value): (Word, &Spanned<DeValue<'_>>)| match value.get_ref() {
        DeValue::Table(_) => {
            let help = format!("put the whole key in quotes: \"{}.KEY\" = …", key.text);
            Err(Diagnostic::new(key.span, format!("`{}` is a table", key.text)).help(help))
        }
        // Removed, as by `--set KEY=`.
        DeValue::String(text) if text.is_empty() => Ok((key, String::new())),
        _ => Ok((key, section.source().text[value.span()].to_owned())),
    };
    ordered(table).into_iter().map(one).collect()
}

/// A list of texts with their places.
fn words(section: &Section<'_>, key: &str) -> Read<Vec<Word>> {
    let Some(value) = section.get(key) else { return Ok(vec![]) };
    let wrong = |value: &Spanned<DeValue<'_>>| wrong_type(value, &format!("`{key}`"), "a list of texts in quotes");
    let list = value.get_ref().as_array().ok_or_else(|| wrong(value))?;
    let word = |item: &Spanned<DeValue<'_>>| {
        let text = item.get_ref().as_str().ok_or_else(|| wrong(item))?;
        Ok(Word { text: text.to_owned(), span: item.span() })
    };
    list.iter().map(word).collect()
}

/// The tables [vary.NAME].
fn varied(section: &Section<'_>, kind: StudyKind) -> Read<Vec<Vary>> {
    let value = section.get("vary").expect("the key is required");
    let Some(table) = value.get_ref().as_table() else { return Err(wrong_type(value, "`vary`", "tables [vary.NAME]")) };
    let keys = match kind {
        StudyKind::Grid | StudyKind::Sweep | StudyKind::Pareto => RANGE,
        StudyKind::Sample | StudyKind::Tolerance | StudyKind::Indices => SPREAD,
        StudyKind::MultiStart => START,
    };
    let mut all = vec![];
    for (name, value) in ordered(table) {
        let title = format!("[vary.{}]", name.text);
        let read = Section::open(value, &title, &[keys], section.source()).and_then(|table| vary(name, &table, keys));
        all.extend(section.source().log.keep(read));
    }
    section.source().log.check()?;
    let most = if kind == StudyKind::Sweep { 1 } else { usize::MAX };
    if all.is_empty() {
        return Err(section.error_at("vary", "nothing varies").help("give a table [vary.NAME] for each variable"));
    }
    if all.len() > most {
        let help = "remove the other tables [vary.NAME], or make a study for each of them";
        return Err(section.error_at("vary", "a sweep has one parameter").help(help));
    }
    Ok(all)
}

fn vary(name: Word, table: &Section<'_>, keys: &[Key]) -> Read<Vary> {
    let has = |key: &str| keys.iter().any(|known| known.name == key);
    let number = |key: &str| if has(key) { table.tree(key) } else { Ok(None) };
    let (from, to) = (number("from")?, number("to")?);
    let is_logarithmic = has("scale") && table.choice("scale", &[("linear", false), ("logarithmic", true)])?;
    let points = if has("points") { table.count("points", RUNS)?.unwrap_or(0) } else { 0 };
    if has("points") && points < 2 {
        return Err(table.error_at("points", "`points` must be at least 2"));
    }
    let [mean, deviation, plus_minus] = [number("mean")?, number("deviation")?, number("plus_minus")?];
    // The values are known only with the unit of the model, their signs and mistakes already now.
    let value = |tree: &Option<ExpressionTree>| {
        tree.as_ref().map(|tree| Names::default().evaluate(tree, &name.text, "")).transpose()
    };
    let signs = [&from, &to, &mean, &deviation, &plus_minus].map(value).into_iter().collect::<Read<Vec<_>>>()?;
    if is_logarithmic && !signs[..2].iter().all(|end| end.is_some_and(|end| end > 0.0)) {
        return Err(table.error_at("scale", "the ends of a logarithmic range must be positive"));
    }
    let is_normal = match table.table.contains_key("distribution") {
        true => {
            let word = table.need_word("distribution")?;
            Some(find(&word, "distribution", &[("normal", true), ("uniform", false)])?)
        }
        false => None,
    };
    Ok(Vary { name, from, to, points, is_logarithmic, mean, deviation, plus_minus, is_normal })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLE: &str = "version = 1\nmodel = \"m.toml\"\nkind = \"sample\"\ncount = 8\n";

    fn message(text: &str) -> String {
        StudyFile::read("s.toml", text).unwrap_err().to_string()
    }

    #[test]
    fn a_mistake_has_its_line_and_a_caret() {
        for (text, line, says) in [
            ("version = 1\nmodel = \"m\"\nkind = \"sampel\"\n", "s.toml:3:8", "did you mean `sample`?"),
            (&format!("{SAMPLE}sead = 3\n[vary.k]\n"), "s.toml:5:1", "did you mean `seed`?"),
            (&format!("{SAMPLE}[vary.k]\nfro = 3\n"), "s.toml:6:1", "did you mean `from`?"),
            (&format!("{SAMPLE}[vary.k]\nfrom = \"x\"\n"), "s.toml:6:9", "x"),
            (SAMPLE, "s.toml:1:1", "lacks `vary`"),
            (&SAMPLE.replace("count = 8", "count = 0\n[vary.k]"), "s.toml:4:9", "at least 1"),
            (&SAMPLE.replace("version = 1", "version = 2\nvary = { k = { } }"), "s.toml:1:11", "expected 1"),
            (
                "version = 1\nmodel = \"m\"\nkind = \"grid\"\n[vary.k]\nfrom = 0\nto = 1\npoints = 1\n",
                "s.toml:7:10",
                "at least 2",
            ),
            (
                "version = 1\nmodel = \"m\"\nkind = \"grid\"\n[vary.k]\nfrom = 0\nto = 1\npoints = 3\nscale = \"logarithmic\"\n",
                "s.toml:8:9",
                "positive",
            ),
            (
                "version = 1\nmodel = \"m\"\nkind = \"sweep\"\n[vary.k]\nfrom = 0\nto = 1\npoints = 3\n[vary.c]\nfrom = 0\nto = 1\npoints = 3\n",
                "s.toml:4:",
                "one parameter",
            ),
        ] {
            let message = message(text);
            assert!(message.contains(line) && message.contains(says) && message.contains('^'), "{text}\n{message}");
        }
    }

    #[test]
    fn keys_give_a_distribution() {
        let text = "version = 2\n[design.k]\nstart = \"2 mm\"\nlower = \"1 mm\"\nupper = \"4 mm\"\n";
        let model = crate::model_file::read("m", text).unwrap();
        let of = |keys: &str| {
            let file = StudyFile::read("s", &format!("{SAMPLE}[vary.k]\n{keys}")).unwrap();
            file.vary[0].distribution(&VariedNumber::of(&model, "k").unwrap())
        };
        assert_eq!(of(""), Ok(Distribution::Uniform { from: 1.0, to: 4.0 }));
        assert_eq!(of("from = 0"), Ok(Distribution::Uniform { from: 0.0, to: 4.0 }));
        assert_eq!(of("from = \"3 mm\"\nto = \"0.5 cm\""), Ok(Distribution::Uniform { from: 3.0, to: 5.0 }));
        assert_eq!(of("deviation = \"500 um\""), Ok(Distribution::Normal { mean: 2.0, deviation: 0.5 }));
        assert_eq!(of("deviation = 0.5"), Ok(Distribution::Normal { mean: 2.0, deviation: 0.5 }));
        assert_eq!(of("plus_minus = 0.5\nmean = 3"), Ok(Distribution::Uniform { from: 2.5, to: 3.5 }));
        assert_eq!(of("plus_minus = 0.6\ndistribution = \"normal\"").unwrap().deviation(), 0.6 / 3.0);
        assert!((of("deviation = 0.5\ndistribution = \"uniform\"").unwrap().deviation() - 0.5).abs() < 1e-15);
        for wrong in [
            "from = 5",
            "deviation = -1",
            "deviation = 1\nplus_minus = 1",
            "deviation = 1\nfrom = 0",
            "distribution = \"normal\"",
            "mean = \"2 kg\"\ndeviation = 1",
        ] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_range_has_its_ends_exactly() {
        let text = "version = 1\nmodel = \"m\"\nkind = \"grid\"\n[vary.k]\nfrom = 0.1\nto = 10\npoints = 3\nscale = \"logarithmic\"\n";
        let values = StudyFile::read("s", text).unwrap().vary[0].values("mm").unwrap();
        assert_eq!((values[0], values[2]), (0.1, 10.0));
        assert!((values[1] - 1.0).abs() < 1e-15);
    }
}
