//! The tables of the benchmark page of mechanics: model files analysed and compared with `references.csv`.

use linkwright::model_file::read;
use linkwright::problem::ResponseAt;
use std::collections::BTreeMap;
use std::fmt::Write;

/// One row of `references.csv`: a number of an analysis, and the reference that it is compared with.
pub struct Reference {
    /// Model file below `examples/models`, without its extension.
    pub model: String,
    /// Edit of the file, `OLD => NEW`; empty for none.
    pub change: String,
    /// Output of the file.
    pub output: String,
    /// Time point.
    pub time: f64,
    /// Design variable with respect to which the output is differentiated; empty for the output itself.
    pub by: String,
    /// The reference.
    pub value: f64,
    /// Largest difference that the test allows.
    pub limit: f64,
    /// Where the reference comes from.
    pub source: String,
}

/// A series of analyses with decreasing step or element length, from which the order of convergence is measured.
pub struct Series {
    /// Name of the scheme, for the table.
    pub scheme: &'static str,
    /// Model file below `examples/models`, without its extension.
    pub model: &'static str,
    /// Output and time point.
    pub output: (&'static str, f64),
    /// Edits `OLD => NEW`; `{}` is replaced by each of the sizes.
    pub change: &'static str,
    /// Steps in s, or numbers of elements.
    pub sizes: [f64; 3],
    /// The exact value.
    pub exact: f64,
    /// Order in theory.
    pub order: f64,
}

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// The rows of `references.csv`.
pub fn references(csv: &str) -> Vec<Reference> {
    let rows = csv.lines().skip(1).map(|line| {
        let cells = cells(line);
        let number = |k: usize| cells[k].parse().expect("a number");
        let [model, change, output, by, source] = [0, 1, 2, 4, 7].map(|k: usize| cells[k].clone());
        Reference { model, change, output, time: number(3), by, value: number(5), limit: number(6), source }
    });
    rows.collect()
}

/// Cells of a line of CSV; a quoted cell may contain commas, and quotes as `""`.
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut quoted) = (vec![String::new()], false);
    let mut letters = line.chars().peekable();
    while let Some(letter) = letters.next() {
        let cell = cells.last_mut().expect("starts with one cell");
        match letter {
            '"' if quoted && letters.peek() == Some(&'"') => cell.extend(letters.next()),
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            other => cell.push(other),
        }
    }
    cells
}

/// Replaces each `OLD => NEW` of `change` in `text`; edits are separated by ` | `, and `\n` is a new line.
fn edited(text: &str, change: &str) -> Outcome<String> {
    let edits = change.split(" | ").filter(|edit| !edit.is_empty());
    edits.map(|edit| edit.split_once(" => ").ok_or_else(|| format!("no edit: {edit}"))).try_fold(
        text.to_owned(),
        |text, edit| {
            let (old, new) = edit?;
            let found = text.contains(old);
            found
                .then(|| text.replace(old, &new.replace("\\n", "\n")))
                .ok_or_else(|| format!("not found: {old}").into())
        },
    )
}

/// Values of all requested numbers of one model.
fn analyse(models: &str, model: &str, change: &str, asked: &[(&str, f64, &str)]) -> Outcome<Vec<f64>> {
    let text = edited(&std::fs::read_to_string(format!("{models}/{model}.toml"))?, change)?;
    let problem = read(model, &text)?.problem()?;
    let start = problem.start();
    let responses = problem.analyze(&start)?;
    let at = asked.iter().map(|&(output, time, _)| {
        let response = problem.responses.iter().position(|r| r.name == output).ok_or(format!("no output {output}"))?;
        let times = &problem.grids[problem.responses[response].grid.ok_or(format!("{output} has no times"))?].points;
        let point = times.iter().position(|t| (t - time).abs() < 1e-9).ok_or(format!("{model} has no time {time}"))?;
        Ok(ResponseAt { response, point })
    });
    let at: Vec<ResponseAt> = at.collect::<Result<_, String>>()?;
    let differentiated = asked.iter().any(|(_, _, by)| !by.is_empty());
    let gradients = if differentiated { Some(problem.sensitivities(&start, &responses, &at)?) } else { None };
    let value = |(k, &(_, _, by)): (usize, &(&str, f64, &str))| match &gradients {
        Some(rows) if !by.is_empty() => {
            let variable = problem.variables.iter().position(|v| v.name == by).ok_or(format!("no variable {by}"))?;
            Ok(rows[(k, variable)])
        }
        _ => Ok(responses.values[at[k].response][at[k].point]),
    };
    Ok(asked.iter().enumerate().map(value).collect::<Result<_, String>>()?)
}

/// Values computed for all references, in their order.
pub fn compute(models: &str, references: &[Reference]) -> Outcome<Vec<f64>> {
    let mut groups: BTreeMap<(&str, &str), Vec<usize>> = BTreeMap::new();
    for (k, row) in references.iter().enumerate() {
        groups.entry((&row.model, &row.change)).or_default().push(k);
    }
    let mut values = vec![f64::NAN; references.len()];
    for ((model, change), rows) in groups {
        let asked: Vec<_> = rows.iter().map(|&k| &references[k]).map(|r| (&*r.output, r.time, &*r.by)).collect();
        let found = analyse(models, model, change, &asked).map_err(|e| format!("{model} with `{change}`: {e}"))?;
        rows.iter().zip(found).for_each(|(&k, value)| values[k] = value);
    }
    Ok(values)
}

/// The values that differ from their references by more than the limit, or are not numbers.
pub fn outside(references: &[Reference], values: &[f64]) -> Vec<String> {
    let message = |(r, value): (&Reference, &f64)| {
        let inside = (value - r.value).abs() <= r.limit;
        let by = if r.by.is_empty() { String::new() } else { format!(", derivative with respect to {}", r.by) };
        let text = format!("{} at {}{by}: {value}, reference {}, limit {:.1e}", r.output, r.time, r.value, r.limit);
        (!inside).then(|| format!("{} (`{}`), {text}", r.model, r.change))
    };
    references.iter().zip(values).filter_map(message).collect()
}

/// A difference, rounded up to a power of ten and at least 1e-12 of the reference.
fn rounded_up(difference: f64, reference: f64) -> String {
    let at_least = difference.abs().max(1e-12 * reference.abs().max(1e-3));
    format!("1e{}", at_least.log10().ceil() as i32)
}

/// A number with ten significant digits, without zeros at its end; 0 for what is only rounding.
fn short(value: f64) -> String {
    if value.abs() < 1e-13 {
        return "0".into();
    }
    let text = format!("{value:.9e}");
    let (digits, power) = text.split_once('e').expect("has an exponent");
    let digits = digits.trim_end_matches('0').trim_end_matches('.');
    match power.parse::<i32>().expect("an integer") {
        0 => digits.to_owned(),
        p if (-3..6).contains(&p) => {
            let text = format!("{value:.*}", (9 - p) as usize);
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        }
        p => format!("{digits}e{p}"),
    }
}

/// The table of references and computed values in Markdown.
pub fn comparison(references: &[Reference], values: &[f64]) -> String {
    let mut table = String::from(
        "| model | number | reference | computed | source | difference below |\n|---|---|---|---|---|---|\n",
    );
    for (row, value) in references.iter().zip(values) {
        let name = row.model.trim_start_matches("benchmarks/");
        let number = if row.by.is_empty() { row.output.clone() } else { format!("d {}/d {}", row.output, row.by) };
        let change = if row.change.is_empty() { String::new() } else { format!(" ({})", in_words(&row.change)) };
        let difference = rounded_up(value - row.value, row.value);
        writeln!(
            table,
            "| `{name}`{change} | {number} ({}) | {} | {} | {} | {difference} |",
            row.time,
            short(row.value),
            short(*value),
            row.source
        )
        .expect("writing to a string");
    }
    table
}

/// The new text of an edit.
fn in_words(change: &str) -> String {
    let new: Vec<&str> = change.split(" | ").filter_map(|edit| Some(edit.split_once(" => ")?.1)).collect();
    new.join(", ").replace("\\n", ", ").replace("..", "N = ").replace('"', "")
}

/// Errors and measured orders of all series in Markdown.
pub fn orders(models: &str, series: &[Series]) -> Outcome<(String, Vec<f64>)> {
    let mut table = String::from(
        "| model | number | scheme | sizes | errors | order measured | order in theory |\n|---|---|---|---|---|---|---|\n",
    );
    let mut measured = vec![];
    for s in series {
        let mut errors = vec![];
        for size in s.sizes {
            let change = s.change.replace("{}", &size.to_string());
            let asked = [(s.output.0, s.output.1, "")];
            let found =
                analyse(models, s.model, &change, &asked).map_err(|e| format!("{} with `{change}`: {e}", s.model))?;
            errors.push((found[0] - s.exact).abs());
        }
        let order = (errors[1] / errors[2]).ln() / (s.sizes[1] / s.sizes[2]).ln().abs();
        measured.push(order);
        let sizes: Vec<String> = s.sizes.iter().map(f64::to_string).collect();
        let errors: Vec<String> = errors.iter().map(|e| format!("{e:.1e}")).collect();
        let name = s.model.trim_start_matches("benchmarks/");
        writeln!(
            table,
            "| `{name}` | {} ({}) | {} | {} | {} | {order:.1} | {} |",
            s.output.0,
            s.output.1,
            s.scheme,
            sizes.join(", "),
            errors.join(", "),
            s.order
        )
        .expect("writing to a string");
    }
    Ok((table, measured))
}
