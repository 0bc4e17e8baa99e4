//! The table of docs/sensitivities.md: every part × analysis × method × order, by what the analyses offer and compute.
//!
//! `UPDATE_DOCS=1 cargo test --test model combinations` rewrites it.

use crate::kinds::{BASE, Observed, typical};
use linkwright::Error;
use linkwright::autodiff::differences::{StepValues, ridders};
use linkwright::mechanics::elements::kinds;
use linkwright::mechanics::motion::Fixed;
use linkwright::model_file::{read, tables};
use linkwright::problem::{GradientMethod, Problem, ResponseAt, Responses};
use nalgebra::DMatrix;
use std::fmt::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread;

/// Steps of the differences, each half as long as the one before, and the first one by the size of a variable.
const STEPS: i32 = 7;
const FIRST: f64 = 1e-2;

/// Allowed deviation, as a fraction of the largest derivative of the same response.
const ALLOWED: f64 = 1e-4;

/// Analyses of a column: all of them must have the same outcome.
struct Column {
    name: &'static str,
    analyses: &'static [&'static str],
    /// Parts that the column adds to the base: drives for kinematics, springs for equilibria.
    added: Added,
}

#[derive(Clone, Copy, PartialEq)]
enum Added {
    Nothing,
    Drives,
    Springs,
}

const COLUMNS: [Column; 4] = [
    Column {
        name: "implicit steps",
        analyses: &[
            "kind = 'dynamics'\nstep = 2e-3\n",
            "kind = 'dynamics'\nscheme = 'hht'\ndamping = 0.1\nstep = 2e-3\n",
            "kind = 'dynamics'\ntolerance = 1e-6\n",
        ],
        added: Added::Nothing,
    },
    Column {
        name: "explicit steps",
        analyses: &[
            "kind = 'dynamics'\nscheme = 'rk5'\nstep = 1e-3\n",
            "kind = 'dynamics'\nscheme = 'rk8'\nstep = 1e-3\n",
            "kind = 'dynamics'\nscheme = 'rk5'\ntolerance = 1e-8\n",
            "kind = 'dynamics'\nscheme = 'rk8'\ntolerance = 1e-10\n",
        ],
        added: Added::Nothing,
    },
    Column { name: "kinematics", analyses: &["kind = 'kinematics'\n"], added: Added::Drives },
    Column { name: "statics", analyses: &["kind = 'statics'\n"], added: Added::Springs },
];

/// A row: a part of the base mechanism, with the design variables that belong to it.
struct CombinedPart {
    name: String,
    text: String,
    outputs: Vec<String>,
}

/// The base mechanism with a part; its bodies are driven or held by springs where a column asks for that.
fn model(part: &CombinedPart, added: Added, driven: &[&str], analysis: &str) -> String {
    let mut text = BASE.to_owned() + &part.text;
    match added {
        Added::Nothing => {}
        Added::Drives => {
            for (k, coordinate) in driven.iter().enumerate() {
                let start = if *coordinate == "two.x" { 1 } else { 0 };
                let motion = format!("{start} + p*time*(0.2 + 0.1*{k})");
                write!(text, "[[driver]]\nname = 'drive{k}'\ncoordinate = '{coordinate}'\nmotion = '{motion}'\n")
                    .unwrap();
            }
        }
        Added::Springs => {
            for (k, coordinate) in ALL.iter().enumerate() {
                let rest = if *coordinate == "two.x" { 1 } else { 0 };
                let keys = format!("b = '{coordinate}'\nstiffness = '{}*p'\nunloaded = {rest}\n", 300 + 10 * k);
                write!(text, "[[force]]\nname = 'spring{k}'\nkind = 'coordinate-spring'\n{keys}").unwrap();
            }
        }
    }
    for (k, output) in part.outputs.iter().enumerate() {
        write!(text, "[[output]]\nname = 'o{k}'\nvalue = '{output}'\n").unwrap();
    }
    text + "[analysis]\n" + analysis
}

const ALL: [&str; 6] = ["one.x", "one.y", "one.theta", "two.x", "two.y", "two.theta"];

/// Sets of driven coordinates that may leave no degree of freedom, the largest first.
fn driven_sets() -> Vec<Vec<&'static str>> {
    let mut sets: Vec<Vec<&str>> = (1..1 << ALL.len())
        .map(|set: usize| (0..ALL.len()).filter(|k| set >> k & 1 == 1).map(|k| ALL[k]).collect())
        .collect();
    sets.sort_by_key(|set| std::cmp::Reverse(set.len()));
    sets
}

/// An analysed model.
struct Analysed {
    problem: Problem,
    b: Vec<f64>,
    responses: Responses,
    wanted: Vec<ResponseAt>,
}

/// Analyses a model at its start; the error if it cannot be analysed.
fn analyse(text: &str) -> Result<Analysed, Error> {
    let model = read("m.toml", text).map_err(|report| Error::definition("model", report.to_string(), ""))?;
    let problem = model.problem()?;
    let b = problem.start();
    let responses = problem.analyze(&b)?;
    let of = |(h, values): (usize, &Vec<f64>)| (0..values.len()).map(move |p| ResponseAt { response: h, point: p });
    let wanted = responses.values.iter().enumerate().flat_map(of).collect();
    Ok(Analysed { problem, b, responses, wanted })
}

impl Analysed {
    /// Largest difference of two sets of gradients, all scaled by the variables, relative to the size of each response.
    fn difference(&self, a: &DMatrix<f64>, b: &DMatrix<f64>) -> f64 {
        let scale = |k: usize| self.size(k);
        let mut worst = 0.0f64;
        for response in 0..self.responses.values.len() {
            let rows = || (0..self.wanted.len()).filter(|&i| self.wanted[i].response == response);
            let entries = || rows().flat_map(|i| (0..self.b.len()).map(move |k| (i, k)));
            let value = rows().map(|i| self.responses.at(self.wanted[i]).abs()).fold(0.0, f64::max);
            let size = entries().map(|(i, k)| (a[(i, k)] * scale(k)).abs()).fold(1e-3 * (1.0 + value), f64::max);
            worst = entries().map(|(i, k)| ((a[(i, k)] - b[(i, k)]) * scale(k)).abs() / size).fold(worst, f64::max);
        }
        worst
    }

    fn by(&self, method: &GradientMethod<'_>) -> Result<DMatrix<f64>, Error> {
        method.sensitivities(&self.b, &self.responses, &self.wanted)
    }

    /// Letters of the methods that are offered, each checked against the direct method, and that against differences.
    fn letters(&self, is_adaptive: bool, what: &str) -> String {
        let methods = self.problem.analysis.gradient_methods();
        let named = |name: &str| methods.iter().find(|method| method.name == name);
        let direct = self.by(named("direct").unwrap()).unwrap_or_else(|e| panic!("{what}: {e}"));
        self.check_values(&direct, what);
        let mut letters = vec!["d"];
        for (name, letter, allowed) in [("adjoint", "a", 1e-6), ("semi-analytical", "s", 1e-2)] {
            match named(name).map(|method| self.by(method)) {
                None | Some(Err(Error::Unsupported { .. })) => {}
                Some(Err(error)) => panic!("{what}, {name}: {error}"),
                Some(Ok(found)) => {
                    let off = self.difference(&direct, &found);
                    assert!(off < allowed, "{what}, {name}: {off:.1e}");
                    letters.push(letter);
                }
            }
        }
        if let Some(hessians) = self.problem.analysis.curvatures(&self.b, &self.responses, &self.wanted).unwrap() {
            self.check_hessians(&hessians, is_adaptive, what);
            letters.push("2");
        }
        letters.join(" ")
    }

    /// Size of a design variable.
    fn size(&self, k: usize) -> f64 {
        self.b[k].abs().max(0.1)
    }

    /// The wanted values at a design near the start, by the steps of the start.
    fn values(&self, b: &[f64]) -> Option<Vec<f64>> {
        let responses = self.problem.analysis.analyze_around(&self.b, &[b.to_vec()]).pop()?.ok()?;
        Some(self.wanted.iter().map(|at| responses.at(*at)).collect())
    }

    /// Compares direct derivatives with differences of the values.
    fn check_values(&self, direct: &DMatrix<f64>, what: &str) {
        self.compare(direct, |row| self.wanted[row].response, |b| self.values(b), &format!("{what}, direct"));
    }

    /// Compares second derivatives with differences of direct derivatives or, with adaptive steps, which differ between designs,
    /// with second differences of the values.
    fn check_hessians(&self, hessians: &[DMatrix<f64>], is_adaptive: bool, what: &str) {
        let what = format!("{what}, second derivatives");
        if is_adaptive {
            return self.check_curvatures(hessians, &what);
        }
        let n = self.b.len();
        let entry = |row: usize, k: usize| hessians[row / n][(row % n, k)] * self.size(row % n);
        let ours = DMatrix::from_fn(hessians.len() * n, n, entry);
        let gradients = |b: &[f64]| {
            let responses = self.problem.analyze(b).ok()?;
            let direct = self.problem.analysis.gradient_methods()[0].sensitivities(b, &responses, &self.wanted).ok()?;
            Some((0..ours.nrows()).map(|row| direct[(row / n, row % n)] * self.size(row % n)).collect())
        };
        self.compare(&ours, |row| self.wanted[row / n].response, gradients, &what);
    }

    /// Compares second derivatives along the variables and along the sums of two of them with second differences of the values.
    fn check_curvatures(&self, hessians: &[DMatrix<f64>], what: &str) {
        let (n, here) = (self.b.len(), self.values(&self.b).unwrap());
        for (j, k) in (0..n).flat_map(|j| (0..=j).map(move |k| (j, k))) {
            let direction: Vec<f64> = (0..n).map(|i| if i == j || i == k { self.size(i) } else { 0.0 }).collect();
            let moved = |h: f64| {
                let b: Vec<f64> = self.b.iter().zip(&direction).map(|(b, d)| b + h * d).collect();
                self.values(&b).unwrap_or_else(|| panic!("{what}: no values by {j} and {k}"))
            };
            let steps: Vec<(f64, [Vec<f64>; 2])> = (0..STEPS)
                .map(|halvings| 8.0 * FIRST * 0.5f64.powi(halvings))
                .map(|h| (h, [moved(h), moved(-h)]))
                .collect();
            for (row, hessian) in hessians.iter().enumerate() {
                // f″h + f⁗h³/12 + …, an odd function.
                let bend = |(h, [ahead, behind]): &(f64, [Vec<f64>; 2])| {
                    let value = (ahead[row] - 2.0 * here[row] + behind[row]) / h;
                    StepValues { h: *h, ahead: value, behind: -value }
                };
                let difference = ridders(0.0, &steps.iter().map(bend).collect::<Vec<_>>()).unwrap();
                let ours: f64 = (0..n)
                    .flat_map(|a| (0..n).map(move |b| (a, b)))
                    .map(|(a, b)| hessian[(a, b)] * direction[a] * direction[b])
                    .sum();
                let unit = ours.abs().max(1e-2 * (1.0 + here[row].abs()));
                assert!(
                    (ours - difference.value).abs() <= 10.0 * difference.error + ALLOWED * unit,
                    "{what}: number {row} along {j} and {k}: {ours} and {difference:?}, unit {unit:.1e}"
                );
            }
        }
    }

    /// Compares the derivatives `ours` of the numbers `f`, of which `response` returns the number of the response, with
    /// extrapolated differences.
    ///
    /// A derivative may deviate by ten times the error that the differences estimate, plus [`ALLOWED`] of the largest derivative of
    /// the same response. At least half of the differences must be better than that.
    fn compare(
        &self,
        ours: &DMatrix<f64>,
        response: impl Fn(usize) -> usize,
        f: impl Fn(&[f64]) -> Option<Vec<f64>>,
        what: &str,
    ) {
        let here = f(&self.b).unwrap();
        let mut units: Vec<f64> = self.responses.values.iter().map(|_| 0.0).collect();
        for row in 0..ours.nrows() {
            let unit = &mut units[response(row)];
            let largest = (0..self.b.len()).map(|k| (ours[(row, k)] * self.size(k)).abs()).fold(0.0, f64::max);
            *unit = unit.max(largest).max(1e-3 * (1.0 + here[row].abs()));
        }
        let (mut clear, mut all) = (0, 0);
        for k in 0..self.b.len() {
            let steps: Vec<(f64, Vec<f64>, Vec<f64>)> = (0..STEPS)
                .filter_map(|halvings| {
                    let h = FIRST * self.size(k) * 0.5f64.powi(halvings);
                    let moved = |by: f64| {
                        let mut b = self.b.clone();
                        b[k] += by;
                        f(&b)
                    };
                    Some((h, moved(h)?, moved(-h)?))
                })
                .collect();
            for row in 0..ours.nrows() {
                let values: Vec<StepValues> = steps
                    .iter()
                    .map(|(h, ahead, behind)| StepValues { h: *h, ahead: ahead[row], behind: behind[row] })
                    .collect();
                let difference = ridders(here[row], &values).unwrap_or_else(|| panic!("{what}: no differences by {k}"));
                let unit = units[response(row)] / self.size(k);
                let off = (ours[(row, k)] - difference.value).abs();
                assert!(
                    off <= 10.0 * difference.error + ALLOWED * unit,
                    "{what}: number {row} by {k}: {} and {difference:?}, unit {unit:.1e}",
                    ours[(row, k)]
                );
                clear += usize::from(difference.error < ALLOWED * unit);
                all += 1;
            }
        }
        assert!(2 * clear >= all, "{what}: only {clear} of {all} differences are accurate");
    }

    /// True if no response depends on the design variables of the part.
    fn is_without_effect(&self) -> bool {
        let direct = self.by(&self.problem.analysis.gradient_methods()[0]).unwrap();
        let own: Vec<usize> =
            (0..self.b.len()).filter(|&k| self.problem.variables[k].name.starts_with("of_")).collect();
        !own.is_empty() && own.iter().all(|&k| direct.column(k).amax() == 0.0)
    }
}

/// The cell of a part and a column.
fn cell(part: &CombinedPart, column: &Column) -> String {
    let mut cells: Vec<String> = Vec::new();
    for analysis in column.analyses {
        let what = format!("{}, {}, {analysis}", part.name, column.name);
        let sets = if column.added == Added::Drives { driven_sets() } else { vec![vec![]] };
        let outcomes = sets.iter().map(|driven| analyse(&model(part, column.added, driven, analysis)));
        let mut errors = Vec::new();
        let analysed = outcomes.filter_map(|outcome| outcome.map_err(|error| errors.push(error)).ok()).next();
        cells.push(match analysed {
            Some(analysed) if analysed.is_without_effect() => "no effect".to_owned(),
            Some(analysed) => analysed.letters(analysis.contains("tolerance"), &what),
            None if errors.iter().any(|error| matches!(error, Error::Unsupported { .. })) => "not offered".to_owned(),
            None if column.added == Added::Drives && part.name == "beam" => "not possible".to_owned(),
            None => panic!("{what}: {:?}", errors.first()),
        });
    }
    assert!(cells.windows(2).all(|pair| pair[0] == pair[1]), "{}, {}: {cells:?}", part.name, column.name);
    cells.swap_remove(0)
}

/// All elements that model files can name, in the order of the reference, and bodies and beams.
fn parts() -> Vec<CombinedPart> {
    let motion = ["one.x", "one.vy", "two.x + two.y", "two.theta"].map(str::to_owned).to_vec();
    let mut parts = vec![
        CombinedPart { name: "rigid body".to_owned(), text: String::new(), outputs: motion.clone() },
        CombinedPart {
            name: "beam".to_owned(),
            text: "[design.of_bending]\nstart = 20\n[[beam]]\nname = 'rod'\nkind = 'section'\nfrom = [0, 1]\nto = [1, 1]\n\
                   elements = 2\naxial = 1e5\ntransverse = 4e4\nbending = 'of_bending'\nmass = 0.5\ninertia = 1e-2\n\
                   [[joint]]\nname = 'clamp'\nkind = 'fixed'\na = { body = 'ground', at = [0, 1] }\nb = 'rod.first'\n"
                .to_owned(),
            outputs: ["rod.last.y", "rod.2.theta"].map(str::to_owned).to_vec(),
        },
        CombinedPart {
            name: "redundant constraints".to_owned(),
            text: [[0.0, 0.0], [0.0, 1.0], [0.0, 2.0]]
                .iter()
                .enumerate()
                .map(|(k, [x, y])| {
                    format!(
                        "[[joint]]\nname = 'crank{k}'\nkind = 'distance'\na = {{ body = 'one', at = [{x}, {y}] }}\n\
                         b = {{ body = 'two', at = [0, {y}] }}\nlength = 1\n"
                    )
                })
                .collect(),
            outputs: motion.clone(),
        },
    ];
    let kinds = kinds::<Fixed, Observed>();
    for table in tables() {
        let Some(kind) = kinds.iter().find(|kind| Some(kind.descriptor.kind) == table.kind) else { continue };
        if ["joint", "driver", "force"].contains(&table.name) {
            let mut outputs = motion.clone();
            outputs.extend(kind.descriptor.measures.iter().map(|measure| format!("part.{}", measure.name)));
            let name = format!("{} (`{}`)", table.name, kind.descriptor.kind);
            let mut text = typical(table.name, kind.descriptor);
            if kind.is_rigid_contact() {
                text = rigid_contact(kind.descriptor.kind);
            } else if kind.has_modes() {
                // It slides under the loads of the base.
                text =
                    "[design.of_friction]\nstart = 0.3\n[[force]]\nname = 'part'\nkind = 'dry-friction'\nb = 'one.x'\n\
                        coulomb_force = 'of_friction'\n"
                        .to_owned();
            }
            parts.push(CombinedPart { name, text, outputs });
        }
    }
    parts
}

/// A rigid contact below the first body, which closes once within the motion.
fn rigid_contact(kind: &str) -> String {
    let sides = match kind {
        "rigid-stop" => "a = 'ground.y'\nb = 'one.y'\nclearance = -3.1e-4",
        _ => "a = { body = 'ground', at = [0, -3.1e-4] }\nb = 'one'",
    };
    let restitution = "[design.of_restitution]\nstart = 0.8\n";
    format!("{restitution}[[force]]\nname = 'part'\nkind = '{kind}'\n{sides}\nrestitution = 'of_restitution'\n")
}

const BEGIN: &str = "<!-- table of combinations: made by tests/model/combinations.rs -->\n";
const END: &str = "<!-- end of the table of combinations -->";

#[test]
fn the_table_of_combinations_in_the_docs_is_what_the_analyses_offer() {
    let mut found = "| part |".to_owned();
    COLUMNS.iter().for_each(|column| write!(found, " {} |", column.name).unwrap());
    found += &format!("\n|---|{}\n", "---|".repeat(COLUMNS.len()));
    let parts = parts();
    let row = |part: &CombinedPart| {
        // Every cell that fails prints its reason, not the first one only.
        let outcome = |column| catch_unwind(AssertUnwindSafe(|| cell(part, column))).unwrap_or("FAILS".to_owned());
        let cells: Vec<String> = COLUMNS.iter().map(outcome).collect();
        format!("| {} | {} |\n", part.name, cells.join(" | "))
    };
    let rows = thread::scope(|scope| {
        let halves: Vec<_> = parts
            .chunks(parts.len().div_ceil(2))
            .map(|half| scope.spawn(move || half.iter().map(row).collect::<String>()))
            .collect();
        halves.into_iter().map(|half| half.join().unwrap()).collect::<String>()
    });
    found += &rows;
    assert!(!found.contains("FAILS"), "{found}");
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/sensitivities.md");
    let page = std::fs::read_to_string(path).unwrap();
    let (before, rest) = page.split_once(BEGIN).unwrap();
    let (listed, after) = rest.split_once(END).unwrap();
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(path, format!("{before}{BEGIN}{found}{END}{after}")).unwrap();
    } else {
        assert!(listed == found, "run this test with UPDATE_DOCS=1 to bring the page up to date; computed:\n{found}");
    }
}
