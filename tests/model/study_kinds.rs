//! Kinds of studies against exact solutions and published values.

use linkwright::study::{ModelSource, Part, Rows, Study, StudyFile};
use std::f64::consts::PI;

fn study(model: &str, file: &str) -> Study {
    let source = ModelSource { name: "model.toml".into(), text: format!("version = 2\n{model}"), programs: None };
    let file = StudyFile::read("study.toml", &format!("version = 1\nmodel = \"model.toml\"\n{file}"))
        .unwrap_or_else(|e| panic!("{e}"));
    Study::new(file, &source).unwrap_or_else(|e| panic!("{e}"))
}

fn rows(study: &Study) -> Rows {
    let rows = study.run(study.no_rows(), Part::WHOLE, &|_| true).unwrap();
    assert_eq!(study.missing(&rows, Part::WHOLE), 0);
    rows
}

/// A table of the conclusions as records by the names of the columns.
fn table(study: &Study, rows: &Rows, name: &str) -> Vec<serde_json::Value> {
    let conclusion = study.conclude(rows).unwrap();
    for (_, _, figure) in &conclusion.figures {
        assert!(figure.svg().unwrap().contains("</svg>"));
    }
    let (_, table) = conclusion.tables.iter().find(|(known, _)| known == name).unwrap();
    table.json_lines().iter().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn number(record: &serde_json::Value, key: &str) -> f64 {
    record[key].as_f64().unwrap_or_else(|| panic!("{key} of {record}"))
}

/// Ishigami's function sin x₁ + 7 sin² x₂ + 0.1 x₃⁴ sin x₁, whose indices are known in closed form: Ishigami and Homma (1990), with the
/// numbers of Saltelli et al., *Global Sensitivity Analysis* (2008), section 4.
const ISHIGAMI: &str = r#"
[design]
x1 = { start = 0 }
x2 = { start = 0 }
x3 = { start = 0 }
[[output]]
name = "f"
value = "sin(x1) + 7*sin(x2)^2 + 0.1*x3^4*sin(x1)"
"#;

#[test]
fn sobol_indices_of_ishigamis_function_are_the_exact_ones() {
    let vary = |name: &str| format!("[vary.{name}]\nfrom = \"-pi\"\nto = \"pi\"\n");
    let file = format!("kind = \"indices\"\ncount = 4096\n{}{}{}", vary("x1"), vary("x2"), vary("x3"));
    let study = study(ISHIGAMI, &file);
    let found = table(&study, &rows(&study), "indices");
    let (a, b): (f64, f64) = (7.0, 0.1);
    let [v1, v2, v13] = [0.5 * (1.0 + b * PI.powi(4) / 5.0).powi(2), a * a / 8.0, 8.0 * b * b * PI.powi(8) / 225.0];
    let v = v1 + v2 + v13;
    let exact = [[v1 / v, (v1 + v13) / v], [v2 / v, v2 / v], [0.0, v13 / v]];
    // The published values.
    assert!(
        (exact[0][0] - 0.3139).abs() < 1e-4
            && (exact[1][0] - 0.4424).abs() < 1e-4
            && (exact[2][1] - 0.2437).abs() < 1e-4
    );
    for (record, [first, total]) in found.iter().zip(exact) {
        assert!((number(record, "first") - first).abs() < 0.01, "{record}, exact {first}");
        assert!((number(record, "total") - total).abs() < 0.01, "{record}, exact {total}");
        assert!(number(record, "first_width") < 0.08 && number(record, "total_width") < 0.08, "{record}");
    }
}

/// The elementary effects of a linear function are its coefficients times the ranges.
#[test]
fn elementary_effects_of_a_linear_function_are_exact() {
    let model = "[design]\nx = { start = 0 }\ny = { start = 0 }\n[constants]\nc = 5\n[[output]]\nname = \"f\"\nvalue = \"3*x - 4*y + 0*c\"\n";
    let file = "kind = \"indices\"\nmethod = \"morris\"\ncount = 6\n[vary.x]\nfrom = 0\nto = 2\n[vary.y]\nfrom = -1\nto = 0\n[vary.c]\nfrom = 0\nto = 1\n";
    let study = study(model, file);
    for (record, effect) in table(&study, &rows(&study), "indices").iter().zip([6.0, -4.0, 0.0]) {
        assert!((number(record, "mean") - effect).abs() < 1e-12, "{record}");
        assert!(
            (number(record, "mean_absolute") - f64::abs(effect)).abs() < 1e-12 && number(record, "deviation") < 1e-12,
            "{record}"
        );
    }
}

/// A linear margin c·load − x of normal variables: moments, worst case and reliability index in closed form. The load is a constant.
#[test]
fn tolerances_of_a_linear_function_are_exact() {
    let model = r#"
[design]
x = { start = 3.0 }
y = { start = 1.0 }
[constants]
load = 10.0
[[output]]
name = "stress"
value = "2*x + y"
[objective]
name = "cost"
minimize = "x + y"
[[constraint]]
name = "strength"
value = "stress - load"
at_most = 0
"#;
    let file = "kind = \"tolerance\"\ncount = 20000\n[vary.x]\ndeviation = 0.3\n[vary.y]\ndeviation = 0.4\n[vary.load]\ndeviation = 1.2\n";
    let study = study(model, file);
    let rows = rows(&study);
    let moments = table(&study, &rows, "moments");
    let (cost, strength) = (&moments[0], &moments[1]);
    assert!((number(cost, "linear_deviation") - 0.5).abs() < 1e-9 && (number(cost, "nominal") - 4.0).abs() < 1e-12);
    let deviation = (0.36 + 0.16 + 1.44f64).sqrt();
    assert!((number(strength, "linear_deviation") - deviation).abs() < 1e-9, "{strength}");
    assert!((number(strength, "second_order_mean") + 3.0).abs() < 1e-7, "{strength}");
    assert!((number(strength, "second_order_deviation") - deviation).abs() < 1e-7, "{strength}");
    // Three standard deviations of each variable: 2·0.9 + 1.2 + 3.6.
    assert!(
        (number(strength, "worst_high") - (-3.0 + 6.6)).abs() < 1e-9
            && (number(strength, "worst_low") - (-3.0 - 6.6)).abs() < 1e-9
    );
    // Sobol points integrate better than the 0.7 % of independent ones.
    assert!((number(strength, "sample_deviation") / deviation - 1.0).abs() < 5e-3, "{strength}");
    let reliability = table(&study, &rows, "reliability");
    let beta = 3.0 / deviation;
    assert!((number(&reliability[0], "beta") - beta).abs() < 1e-9, "{}", reliability[0]);
    let exact = linkwright::study::normal_probability(-beta);
    assert!((number(&reliability[0], "probability") / exact - 1.0).abs() < 1e-8);
    assert!(
        (number(&reliability[0], "sample_probability") - exact).abs() < 4.0 * number(&reliability[0], "standard_error"),
        "{}",
        reliability[0]
    );
}

/// The peak of x sin(t + y) over all times is x, whatever y is, although the nearest of the few time points is not at the peak.
#[test]
fn tolerances_of_a_peak_between_time_points_are_those_of_the_peak() {
    let model = r#"
[design]
x = { start = 3.0 }
y = { start = 0.1 }
[time]
to = 3.0
points = 6
[[output]]
name = "signal"
value = "x*sin(time + y)"
[objective]
name = "cost"
minimize = "x"
[[constraint]]
name = "level"
value = "signal"
at_most = 5
continuous = true
"#;
    let study =
        study(model, "kind = \"tolerance\"\ncount = 100\n[vary.x]\ndeviation = 0.3\n[vary.y]\ndeviation = 0.1\n");
    let moments = table(&study, &rows(&study), "moments");
    let level = moments.iter().find(|row| row["quantity"] == "level").unwrap_or_else(|| panic!("{moments:?}"));
    assert!((number(level, "nominal") - 3.0).abs() < 1e-9, "{level}");
    assert!((number(level, "linear_deviation") - 0.3).abs() < 1e-6, "{level}");
}

/// The study of tolerances of a constraint `limit` of standard normal x and y: the row of its reliability, and the sentences about it.
fn reliability(limit: &str, count: usize) -> (serde_json::Value, String) {
    let model = format!(
        "[design]\nx = {{ start = 0.0 }}\ny = {{ start = 0.0 }}\n[[output]]\nname = \"g\"\nvalue = \"{limit}\"\n[objective]\nminimize = \"x\"\n\
         [[constraint]]\nname = \"c\"\nvalue = \"g\"\nat_most = 0\n"
    );
    let file = format!("kind = \"tolerance\"\ncount = {count}\n[vary.x]\ndeviation = 1.0\n[vary.y]\ndeviation = 1.0\n");
    let study = study(&model, &file);
    let rows = rows(&study);
    let sentences = study.conclude(&rows).unwrap().sentences;
    let is_about = |sentence: &&String| {
        sentence.starts_with("c ") && !sentence.contains("scatters") && !sentence.contains("second-order")
    };
    let about = sentences.iter().filter(is_about).cloned().collect::<Vec<_>>().join(" ");
    (table(&study, &rows, "reliability")[0].clone(), about)
}

/// x² + 0.3y ≤ 5 has two nearest points, at the distance √(5 − 0.15²) of a circle that touches the parabola: 0.3y = 0.3·0.15, x² = 5 − 0.045. Both
/// count in the sample, one in the index.
#[test]
fn the_reliability_index_of_a_limit_with_curvature_is_its_distance() {
    let (row, about) = reliability("x^2 + 0.3*y - 5", 4000);
    let distance = (5.0f64 - 0.3 * 0.15 + 0.15 * 0.15).sqrt();
    assert!((number(&row, "beta") - distance).abs() < 1e-6, "{row}, {distance}");
    assert!(number(&row, "sample_probability") > 1.6 * number(&row, "probability"), "{row}");
    assert!(about.contains("several points near the means. Use the probability of the sample."), "{about}");
    // Of a straight limit both probabilities agree.
    let (row, about) = reliability("0.6*x + 0.8*y - 2", 4000);
    assert!((number(&row, "beta") - 2.0).abs() < 1e-9 && about.is_empty(), "{row}: {about}");
    let (row, about) = reliability("tanh(x) + tanh(y) - 3", 100);
    assert!(row["beta"].is_null() && number(&row, "probability") == 0.0, "{row}");
    assert!(about.contains("is met for all values within 8 standard deviations"), "{about}");
}

/// A small region of violations that no search finds, but the sample does: no index, and nothing is said of all values.
#[test]
fn an_index_that_the_sample_contradicts_is_left_out() {
    let (row, about) = reliability("2*exp(-((x - 1.37)^2 + (y - 1.71)^2)/0.005) - 1", 20000);
    assert!(number(&row, "sample_probability") > 0.0, "{row}");
    assert!(row["beta"].is_null() && row["probability"].is_null(), "{row}");
    assert!(about.contains("has no reliability index") && !about.contains("all values"), "{about}");
}

/// A constant that another constant uses cannot become a design variable: the file is read again for each value, and derivatives are central differences.
#[test]
fn a_constant_of_which_others_depend_has_derivatives_too() {
    let model = "[design]\nx = { start = 2.0 }\n[constants]\na = 3\nb = \"a^2\"\n[[output]]\nname = \"f\"\nvalue = \"b*x\"\n[objective]\nminimize = \"f\"\n";
    let study =
        study(model, "kind = \"tolerance\"\ncount = 0\n[vary.a]\ndeviation = 0.1\n[vary.x]\nplus_minus = 0.3\n");
    let found = table(&study, &rows(&study), "moments");
    // df/da = 2ax = 12, df/dx = 9, for a uniform x with deviation 0.3/√3; d²f/da² = 4, d²f/dadx = 6.
    let (a, x) = (0.01, 0.03);
    let linear = 144.0 * a + 81.0 * x;
    assert!((number(&found[0], "linear_deviation") - f64::sqrt(linear)).abs() < 1e-6, "{}", found[0]);
    assert!((number(&found[0], "second_order_mean") - (18.0 + 0.5 * 4.0 * a)).abs() < 1e-5, "{}", found[0]);
    let second = linear + 0.5 * (4.0 * a) * (4.0 * a) + 36.0 * a * x;
    assert!((number(&found[0], "second_order_deviation") - second.sqrt()).abs() < 1e-5, "{}", found[0]);
}

/// Minimize x² + y² and (x − 1)² + y², the latter at most ε: the front is √F + √ε = 1, and dF/dε = −√F/√ε.
#[test]
fn a_convex_pareto_front_is_the_exact_curve() {
    let model = r#"
[design]
x = { start = 0.5, lower = -2, upper = 2 }
y = { start = 0.5, lower = -2, upper = 2 }
[objective]
name = "F"
minimize = "x^2 + y^2"
[[constraint]]
name = "distance"
value = "(x - 1)^2 + y^2"
at_most = 0.5
"#;
    let study = study(model, "kind = \"pareto\"\n[vary.distance]\nfrom = 0.04\nto = 0.81\npoints = 9\n");
    let found = rows(&study);
    let front = table(&study, &found, "front");
    assert_eq!(front.len(), 9);
    for record in &front {
        let (f, e) = (number(record, "F"), number(record, "distance"));
        assert!((f.sqrt() + e.sqrt() - 1.0).abs() < 1e-4, "{record}");
        assert!(
            (number(record, "d F/d distance") + f.sqrt() / e.sqrt()).abs() < 2e-3 * (1.0 + f.sqrt() / e.sqrt()),
            "{record}"
        );
    }
    // Fronts have no parts; the rows are the same for one thread.
    assert!(study.run(study.no_rows(), Part { number: 1, of: 2 }, &|_| true).is_err());
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(one.install(|| rows(&study)), found);
    // An interrupted study is continued to the same rows.
    let stop = std::sync::atomic::AtomicUsize::new(0);
    let part = study
        .run(study.no_rows(), Part::WHOLE, &|_| stop.fetch_add(1, std::sync::atomic::Ordering::SeqCst) < 3)
        .unwrap();
    assert!(study.missing(&part, Part::WHOLE) > 0);
    assert_eq!(study.run(part, Part::WHOLE, &|_| true).unwrap(), found);
}

/// Squared distances from the corners of a triangle: with limits e₁, e₂ below 1 both constraints are active, so that the optimum is the
/// intersection of two circles that is nearer to the third corner.
#[test]
fn a_pareto_front_of_three_objectives_is_the_exact_surface() {
    let model = r#"
[design]
x = { start = 0.3, lower = -2, upper = 2 }
y = { start = 0.3, lower = -2, upper = 2 }
[objective]
name = "F"
minimize = "x^2 + y^2"
[[constraint]]
name = "first"
value = "(x - 1)^2 + y^2"
at_most = 0.8
[[constraint]]
name = "second"
value = "x^2 + (y - 1)^2"
at_most = 0.8
"#;
    let range = "from = 0.6\nto = 0.9\npoints = 4\n";
    let study = study(model, &format!("kind = \"pareto\"\n[vary.first]\n{range}[vary.second]\n{range}"));
    let found = rows(&study);
    let front = table(&study, &found, "front");
    assert_eq!(front.len(), 16, "no point dominates another one");
    for record in &front {
        let [f, e1, e2] = ["F", "first", "second"].map(|key| number(record, key));
        let k = (e1 - e2) / 2.0;
        let x = ((1.0 - k) - ((1.0 - k).powi(2) - 2.0 * (1.0 + k * k - e1)).sqrt()) / 2.0;
        let exact = x * x + (x + k).powi(2);
        assert!((f - exact).abs() < 1e-4, "{exact} {record}");
    }
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(one.install(|| rows(&study)), found);
}

/// Runs that reach their limit of cycles in the deeper well are named beside the run that converged in the other one.
#[test]
fn better_designs_of_runs_that_have_not_converged_are_named() {
    let model = "[design]\nx = { start = 0.9601495555191055, lower = -3, upper = 3 }\n[objective]\nname = \"F\"\nminimize = \"x^4 - 2*x^2 + 0.3*x\"\n\
                 [method]\nmax_cycles = 1\n";
    let study = study(model, "kind = \"multi-start\"\ncount = 4\n[vary.x]\nfrom = -2\nto = -1.5\n");
    let conclusion = study.conclude(&rows(&study)).unwrap();
    let text = conclusion.sentences.join(" ");
    assert!(
        text.starts_with("1 of 4 runs converged")
            && text.contains("ended at a better feasible design, F = -")
            && text.ends_with("without convergence (cycle limit)."),
        "{text}"
    );
}

/// Minimize x² + p/x over x: x* = (p/2)^(1/3), for a constant p, and with x fixed.
#[test]
fn a_sweep_follows_the_exact_optimum() {
    let model = "[design]\nx = { start = 1.0, lower = 0.1, upper = 5 }\ny = { start = 0.5, lower = -3, upper = 3 }\n[constants]\np = 2.0\n[objective]\nname = \"F\"\nminimize = \"x^2 + p/x + (y - x)^2\"\n";
    let of_constant =
        study(model, "kind = \"sweep\"\n[vary.p]\nfrom = 0.1\nto = 20\npoints = 8\nscale = \"logarithmic\"\n");
    let optima = table(&of_constant, &rows(&of_constant), "optima");
    assert_eq!(optima.len(), 8);
    for record in &optima {
        let x = (number(record, "p") / 2.0).cbrt();
        assert!((number(record, "F") / (3.0 * x * x) - 1.0).abs() < 1e-5, "{record}, exact {}", 3.0 * x * x);
        assert!((number(record, "x") / x - 1.0).abs() < 5e-3, "{record}");
    }
    let fixed = study(model, "kind = \"sweep\"\n[vary.x]\nfrom = 0.5\nto = 2\npoints = 4\n");
    let rows = rows(&fixed);
    for row in rows.of(0) {
        let x = row.value(0);
        assert!((row.value(1) - (x * x + 2.0 / x)).abs() < 1e-4 && row.status == "Converged", "{row:?}");
    }
    // Any setting can be swept.
    let cycles = study(model, "kind = \"sweep\"\n[vary.\"design.x.upper\"]\nfrom = 1.5\nto = 4\npoints = 3\n");
    assert_eq!(table(&cycles, &self::rows(&cycles), "optima").len(), 3);
}

/// (x² − 1)² + x/10 has a minimum near −1.01 and one near 0.99; starts below 0.025 lead to the better one.
#[test]
fn many_starts_find_both_minima() {
    let model = "[design]\nx = { start = 1.0, lower = -2, upper = 2 }\n[objective]\nname = \"F\"\nminimize = \"(x^2 - 1)^2 + 0.1*x\"\n";
    let study = study(model, "kind = \"multi-start\"\ncount = 9\nmethods = [\"automatic\", \"gcmma\"]\n[vary.x]\n");
    let rows = rows(&study);
    assert_eq!((rows.len(), rows.get(0, 0).unwrap().value(1)), (18, 1.0));
    let optima = table(&study, &rows, "optima");
    // The roots of 4x³ − 4x + 1/10.
    let exact = [-1.0122, 0.9871];
    assert!((number(&optima[0], "x") - exact[0]).abs() < 5e-3, "{optima:?}");
    assert!(optima.iter().any(|o| (number(o, "x") - exact[1]).abs() < 5e-3), "{optima:?}");
    let methods = table(&study, &rows, "methods");
    assert_eq!((&methods[0]["method"], &methods[1]["runs"]), (&"automatic".into(), &9.into()));
}

#[test]
fn every_example_is_a_study() {
    let folder = format!("{}/examples/studies", env!("CARGO_MANIFEST_DIR"));
    let mut count = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let file = StudyFile::read(&path.display().to_string(), &std::fs::read_to_string(&path).unwrap())
            .unwrap_or_else(|e| panic!("{e}"));
        let model = path.parent().unwrap().join(&file.model);
        let text = std::fs::read_to_string(&model).unwrap();
        let study = Study::new(file, &ModelSource { name: model.display().to_string(), text, programs: None })
            .unwrap_or_else(|e| panic!("{e}"));
        let row = study.row(0, 0, &study.no_rows()).unwrap();
        assert!(!row.has_failed(), "{}: {row:?}", path.display());
        count += 1;
    }
    assert!(count >= 7, "{count} examples");
}

/// Every key is in docs/studies.md.
#[test]
fn every_key_is_documented() {
    let text = include_str!("../../docs/studies.md");
    for table in linkwright::study::study_tables() {
        for key in table.keys {
            assert!(
                text.contains(&format!("`{}`", key.name)),
                "`{}` of {:?} is not in docs/studies.md",
                key.name,
                table.kind
            );
        }
    }
    for (kind, _) in linkwright::study::KINDS {
        assert!(text.contains(&format!("`{kind}`")), "{kind} is not in docs/studies.md");
    }
}

/// A fifth of the designs cannot be analysed: the sentences say so, and do not call the sample the better one.
#[test]
fn failed_analyses_are_told_with_the_conclusions() {
    let model = "[design]\nx = { start = 0.3, lower = 0, upper = 1 }\ny = { start = 0.3, lower = 0, upper = 1 }\n\
        [[output]]\nname = \"f\"\nvalue = \"x + 2*y\"\n[[output]]\nname = \"g\"\nvalue = \"sqrt(0.8 - x)\"\n\
        [objective]\nminimize = \"f\"\n[[constraint]]\nname = \"f\"\nvalue = \"f\"\nat_most = 2\n\
        [[constraint]]\nname = \"g\"\nvalue = \"g\"\nat_most = 2\n";
    for kind in ["tolerance", "indices", "sample"] {
        let study = study(model, &format!("kind = \"{kind}\"\ncount = 1024\n[vary.x]\n[vary.y]\n"));
        let rows = rows(&study);
        let sentences = study.conclude(&rows).unwrap().sentences.join(" ");
        assert!(sentences.contains("failed, and the results are those of the others only"), "{kind}: {sentences}");
        assert!(!sentences.contains("Use the probability of the sample"), "{kind}: {sentences}");
    }
}

/// 3f beside an objective with the same name.
#[test]
fn a_constraint_with_the_name_of_the_objective_has_a_column() {
    let model = "[design]\nx = { start = 1, lower = 0, upper = 3 }\n[[output]]\nname = \"f\"\nvalue = \"x^2\"\n\
        [objective]\nname = \"same\"\nminimize = \"f\"\n[[constraint]]\nname = \"same\"\nvalue = \"3*f\"\nat_most = 5\n";
    let study = study(model, "kind = \"grid\"\n[vary.x]\nfrom = 1\nto = 2\npoints = 2\n");
    let found = table(&study, &rows(&study), "summary");
    let maximum = |name: &str| number(found.iter().find(|row| row["quantity"] == name).unwrap(), "maximum");
    assert_eq!([maximum("same"), maximum("same constraint")], [4.0, 12.0]);
}

/// x² at the mean 0 of a uniform x in ±1: the derivative is zero there, and the quantity scatters.
#[test]
fn a_quantity_without_slope_at_the_means_is_not_called_certain() {
    let model = "[design]\nx = { start = 0, lower = -1, upper = 1 }\n[[output]]\nname = \"f\"\nvalue = \"x^2\"\n[objective]\nminimize = \"f\"\n";
    let study = study(model, "kind = \"tolerance\"\ncount = 4096\n[vary.x]\n");
    let rows = rows(&study);
    let row = &table(&study, &rows, "moments")[0];
    assert!(number(row, "worst_low") >= 0.0 && number(row, "worst_low") < 1e-6, "{row}");
    assert!(number(row, "worst_high") > 0.999, "{row}");
    let sentences = study.conclude(&rows).unwrap().sentences.join(" ");
    // √(1/5 − 1/9)
    assert!(sentences.contains("its standard deviation in the sample is 0.298"), "{sentences}");
}

/// Point 0 of a Sobol sequence without shift is the corner, which is at −∞ for normal variables.
#[test]
fn the_corner_of_a_sobol_sequence_is_no_outlier_of_a_normal_variable() {
    let model =
        "[design]\nx = { start = 0 }\n[[output]]\nname = \"f\"\nvalue = \"x^2\"\n[objective]\nminimize = \"f\"\n";
    let study = study(model, "kind = \"sample\"\ncount = 1024\nseed = 0\n[vary.x]\ndeviation = 1\n");
    let found = table(&study, &rows(&study), "summary");
    let row = &found[0];
    assert!((number(row, "mean") - 1.0).abs() < 0.02, "{row}");
    assert!(number(row, "maximum") < 15.0, "{row}");
}

/// A function of two variables, minimized from eight starts by two methods.
fn from_eight_starts(function: &str) -> Study {
    let model = format!(
        "[design]\nx = {{ start = -1.2, lower = -5, upper = 5 }}\ny = {{ start = 1, lower = -5, upper = 5 }}\n[objective]\nminimize = \"{function}\"\n"
    );
    let methods = "methods = [\"automatic\", \"gcmma\"]";
    study(&model, &format!("kind = \"multi-start\"\ncount = 8\n{methods}\n[vary.x]\n[vary.y]\n"))
}

/// Rosenbrock's function in several units: all ends are near its least value of zero, some by 1e-30 and some by 1e-19. They are one optimum.
#[test]
fn ends_near_an_objective_of_zero_are_one_optimum() {
    for unit in [1.0, 1e-12, 1e12] {
        let study = from_eight_starts(&format!("{unit:e}*(100*(y - x^2)^2 + (1 - x)^2)"));
        let rows = rows(&study);
        let (methods, optima) = (table(&study, &rows, "methods"), table(&study, &rows, "optima"));
        assert_eq!(optima.len(), 1, "{optima:?}");
        assert!(methods.iter().all(|row| number(row, "best") == 8.0), "{methods:?}");
        let sentences = study.conclude(&rows).unwrap().sentences;
        assert!(sentences[0].contains("16 of them to the best objective"), "{sentences:?}");
    }
    // A second minimum of 1e-3, where starts have 100.
    let study = from_eight_starts("(x^2 - 1)^2 + y^2 + 5e-4*(1 - x)");
    let optima = table(&study, &rows(&study), "optima");
    assert_eq!(optima.len(), 2, "{optima:?}");
    assert!((number(&optima[1], "objective") - 1e-3).abs() < 1e-5, "{optima:?}");
}

/// (x² − 1)² + 1 from eight starts, of which four need more than the cycles that they have: their analyses count as well.
#[test]
fn the_work_of_a_method_is_that_of_all_its_runs() {
    let model = "[design]\nx = { start = 0.9, lower = -2, upper = 2 }\n[[output]]\nname = \"f\"\nvalue = \"(x^2 - 1)^2\"\n\
        [objective]\nminimize = \"f + 1\"\n[method]\nmax_cycles = 8\n";
    let study = study(model, "kind = \"multi-start\"\ncount = 8\nmethods = [\"automatic\"]\n[vary.x]\n");
    let rows = rows(&study);
    let column = |name: &str| study.phases()[0].columns.iter().position(|column| column.name == name).unwrap();
    let (analyses, objective) = (column("analyses"), column("objective"));
    let mean = rows.of(0).map(|row| row.value(analyses)).sum::<f64>() / 8.0;
    let row = &table(&study, &rows, "methods")[0];
    assert!((1.0..8.0).contains(&number(row, "optima")), "{row}");
    assert!((number(row, "mean_analyses") - mean).abs() < 1e-12, "{row}, {mean}");
    // The run of an optimum is that whose objective is shown.
    for optimum in table(&study, &rows, "optima") {
        let best = rows.get(0, number(&optimum, "best_run") as usize).unwrap();
        assert_eq!(best.value(objective), number(&optimum, "objective"), "{optimum}");
    }
}
