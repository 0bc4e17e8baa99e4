//! Studies of models whose numbers have units: the study gives its numbers in the unit of what varies, or with one of the same kind.

use linkwright::study::{ModelSource, Part, Row, Study, StudyError, StudyFile};

/// Least x + y with x·y ≥ 0.09 m²: x in mm, y a plain number of metres. The constant is 2π rad/s.
const MODEL: &str = r#"
version = 2
[constants]
w = "60 rpm"
wide = "900 mm"
[design.x]
start = "300 mm"
lower = "100 mm"
upper = "wide"
[design.y]
start = 0.4
lower = 0.1
upper = 1.0
unit = "m"
[[output]]
name = "speed"
value = "w*x"
[[output]]
name = "area"
value = "x*y"
[objective]
name = "edge"
minimize = "x + y"
[[constraint]]
name = "room"
value = "area"
at_least = 0.09
[[constraint]]
name = "reach"
value = "abs(x)"
at_most = "0.8 m"
[[constraint]]
name = "pace"
value = "speed"
at_most = 100
"#;

fn source(model: &str) -> ModelSource {
    ModelSource { name: "model.toml".into(), text: model.into(), programs: None }
}

fn made(model: &str, file: &str) -> Result<Study, StudyError> {
    let file = StudyFile::read("study.toml", &format!("version = 1\nmodel = \"model.toml\"\n{file}"))?;
    Study::new(file, &source(model))
}

fn study(model: &str, file: &str) -> Study {
    made(model, file).unwrap_or_else(|e| panic!("{file}\n{e}"))
}

/// The rows of the first phase; none has failed.
fn rows(study: &Study) -> Vec<Row> {
    let rows = study.run(study.no_rows(), Part::WHOLE, &|_| true).unwrap();
    let failed: Vec<&Row> = rows.of(0).filter(|row| row.has_failed()).collect();
    assert!(failed.is_empty(), "{failed:?}");
    rows.of(0).cloned().collect()
}

/// The values of a column.
fn column(study: &Study, rows: &[Row], name: &str) -> Vec<f64> {
    let columns = &study.phases()[0].columns;
    let k = columns.iter().position(|column| column.name == name).unwrap_or_else(|| panic!("no column {name}"));
    rows.iter().map(|row| row.value(k)).collect()
}

fn unit(study: &Study, name: &str) -> String {
    study.phases()[0].columns.iter().find(|column| column.name == name).unwrap().unit.clone()
}

fn near(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    let is_near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-9 * b.abs();
    assert!(found.iter().zip(expected).all(is_near), "{found:?}, expected {expected:?}");
}

/// The mean of a constant is its value in the model, in its unit.
#[test]
fn a_constant_has_its_value_as_mean() {
    for (kind, more) in [("tolerance", "count = 0\n"), ("sample", "count = 8\nquantities = [\"speed\"]\n")] {
        let study = study(MODEL, &format!("kind = \"{kind}\"\n{more}[vary.w]\nplus_minus = 1e-6\n"));
        let rows = rows(&study);
        assert_eq!(unit(&study, "w"), "rpm");
        for (w, speed) in column(&study, &rows, "w").into_iter().zip(column(
            &study,
            &rows,
            if kind == "sample" { "speed" } else { "pace" },
        )) {
            assert!((w - 60.0).abs() <= 1e-6, "{w} rpm");
            assert!((speed - 2.0 * std::f64::consts::PI * 0.3).abs() < 1e-6, "{speed} m/s");
        }
    }
    let tolerance =
        study(MODEL, "kind = \"tolerance\"\ncount = 0\n[vary.w]\ndeviation = \"1 rad/s\"\n[vary.x]\ndeviation = 1\n");
    near(&column(&tolerance, &rows(&tolerance)[..1], "d pace/d w"), &[0.3 * std::f64::consts::PI / 30.0]);
}

/// A constant on which a bound depends cannot become a design variable: the model is read again with its number and unit.
#[test]
fn a_constant_that_is_a_bound_varies_in_its_unit() {
    let study = study(
        MODEL,
        "kind = \"grid\"\n[vary.wide]\nfrom = 400\nto = \"50 cm\"\npoints = 2\n[vary.x]\nfrom = 200\nto = 1000\npoints = 2\n",
    );
    let rows = rows(&study);
    near(&column(&study, &rows, "wide"), &[400.0, 400.0, 500.0, 500.0]);
    // A value outside the bounds moves them.
    near(&column(&study, &rows, "edge"), &[0.6, 1.4, 0.6, 1.4]);
}

/// Plain numbers are in the unit of the variable, and others are converted to it, in every kind of study.
#[test]
fn every_kind_takes_numbers_in_the_unit_of_the_variable() {
    for (from, to) in [("200", "400"), ("\"0.2 m\"", "\"40 cm\""), ("\"100 mm + 10 cm\"", "400")] {
        for kind in ["grid", "sweep"] {
            let study = study(MODEL, &format!("kind = \"{kind}\"\n[vary.x]\nfrom = {from}\nto = {to}\npoints = 3\n"));
            let rows = rows(&study);
            let k = study.phases()[0].columns.iter().position(|column| column.name == "x").unwrap();
            assert_eq!((k, unit(&study, "x").as_str()), (0, "mm"));
            near(&column(&study, &rows, "x"), &[200.0, 300.0, 400.0]);
            if kind == "sweep" {
                // The least y is 0.09 m² / x.
                let edges: Vec<f64> = column(&study, &rows, "edge");
                let exact = [0.2 + 0.45, 0.3 + 0.3, 0.4 + 0.225];
                assert!(edges.iter().zip(exact).all(|(a, b)| (a - b).abs() < 1e-3), "{edges:?}");
            }
        }
        let keys = format!("[vary.x]\nfrom = {from}\nto = {to}\n[vary.y]\nfrom = \"200 mm\"\nto = 0.5\n");
        let sample = study(MODEL, &format!("kind = \"sample\"\ncount = 16\n{keys}"));
        let sampled = rows(&sample);
        assert!(column(&sample, &sampled, "x").iter().all(|x| (200.0..=400.0).contains(x)));
        assert!(column(&sample, &sampled, "y").iter().all(|y| (0.2..=0.5).contains(y)));
        let starts = study(MODEL, &format!("kind = \"multi-start\"\ncount = 3\n{keys}"));
        let started = rows(&starts);
        assert!(column(&starts, &started, "start x").iter().all(|x| (200.0..=400.0).contains(x)));
        assert!(column(&starts, &started, "edge").iter().all(|edge| (edge - 0.6).abs() < 1e-3));
        let indices = study(MODEL, &format!("kind = \"indices\"\nmethod = \"morris\"\ncount = 2\n{keys}"));
        assert!(column(&indices, &rows(&indices), "x").iter().all(|x| (200.0..=400.0).contains(x)));
    }
}

/// Limits are in the unit in which the constraint is shown; settings in that with which they are written.
#[test]
fn limits_and_settings_keep_their_unit() {
    let pareto = |from: &str, to: &str| {
        let study = study(MODEL, &format!("kind = \"pareto\"\n[vary.reach]\nfrom = {from}\nto = {to}\npoints = 2\n"));
        assert_eq!(unit(&study, "limit of reach"), "m");
        column(&study, &rows(&study), "limit of reach")
    };
    near(&pareto("0.15", "0.6"), &[0.15, 0.6]);
    near(&pareto("\"150 mm\"", "\"60 cm\""), &[0.15, 0.6]);
    let area = study(MODEL, "kind = \"pareto\"\n[vary.room]\nfrom = 0.04\nto = 0.09\npoints = 2\n");
    near(&column(&area, &rows(&area), "limit of room"), &[0.04, 0.09]);
    for (key, [from, to], values) in [
        ("constraint.reach.at_most", ["\"150 mm\"", "0.2"], [0.15, 0.2]),
        ("design.x.lower", ["200", "\"25 cm\""], [200.0, 250.0]),
        ("wide", ["500", "\"0.7 m\""], [500.0, 700.0]),
    ] {
        let text = format!("kind = \"sweep\"\n[vary.\"{key}\"]\nfrom = {from}\nto = {to}\npoints = 2\n");
        let sweep = study(MODEL, &text);
        near(&column(&sweep, &rows(&sweep), key), &values);
    }
}

/// A limit in mm of an output that is shown in mm, written as a plain number of metres.
#[test]
fn a_plain_limit_of_a_shown_output_is_swept_in_its_unit() {
    let model = "version = 2\n[design.x]\nstart = \"300 mm\"\nlower = \"1 mm\"\n[[output]]\nname = \"f\"\nvalue = \"x\"\nshown_in = \"cm\"\n\
        [objective]\nminimize = \"x\"\n[[constraint]]\nname = \"far\"\nvalue = \"f\"\nat_least = 0.2\n";
    for (kind, key, name) in
        [("pareto", "far", "limit of far"), ("sweep", "\"constraint.far.at_least\"", "constraint.far.at_least")]
    {
        let study = study(model, &format!("kind = \"{kind}\"\n[vary.{key}]\nfrom = 10\nto = \"150 mm\"\npoints = 2\n"));
        let rows = rows(&study);
        near(&column(&study, &rows, name), &[10.0, 15.0]);
        assert_eq!(unit(&study, name), "cm");
        let design = column(&study, &rows, "x");
        assert!((design[0] - 100.0).abs() < 0.1 && (design[1] - 150.0).abs() < 0.1, "{design:?}");
    }
}

#[test]
fn a_number_of_another_kind_has_its_place() {
    for (file, place, why) in [
        ("kind = \"grid\"\n[vary.x]\nfrom = \"2 kg\"\nto = 3\npoints = 2\n", "study.toml:5:9", "mass"),
        ("kind = \"sweep\"\n[vary.x]\nfrom = 1\nto = \"3 s\"\npoints = 2\n", "study.toml:6:7", "time"),
        ("kind = \"grid\"\n[vary.x]\nfrom = 200\nto = \"20 cm\"\npoints = 2\n", "study.toml:6:7", "empty"),
        ("kind = \"sample\"\ncount = 4\n[vary.w]\ndeviation = \"1 Hz\"\n", "study.toml:6:14", "rpm"),
        ("kind = \"multi-start\"\ncount = 4\n[vary.y]\nfrom = \"1 rad/s\"\n", "study.toml:6:9", "`y`"),
        ("kind = \"pareto\"\n[vary.reach]\nfrom = \"1 kg\"\nto = 1\npoints = 2\n", "study.toml:5:9", "mass"),
    ] {
        let error = made(MODEL, file).err().unwrap_or_else(|| panic!("{file}")).to_string();
        assert!(error.contains(place) && error.contains(why) && error.contains('^'), "{file}\n{error}");
    }
}

/// A start that is a formula of numbers with units has the unit of the formula, or of a bound, or the SI unit.
#[test]
fn a_start_may_be_a_formula_with_units() {
    let constants = "[constants]\nl0 = \"120 mm\"\nn = 3\n";
    for (keys, start, unit) in [
        ("start = \"l0\"", 0.12, "m"),
        ("start = \"l0\"\nlower = \"1 cm\"", 12.0, "cm"),
        ("start = \"l0\"\nunit = \"mm\"\nupper = \"1 m\"", 120.0, "mm"),
        ("start = \"300 mm + 2 cm\"", 320.0, "mm"),
        ("start = \"2*l0\"\nlower = \"100 mm\"", 240.0, "mm"),
        ("start = \"l0 - 2 cm\"\nlower = 0", 10.0, "cm"),
        ("start = \"n\"\nlower = 1", 3.0, ""),
        ("start = \"10 deg + 20 deg\"\nlower = 0.1", std::f64::consts::PI / 6.0, ""),
    ] {
        let text = format!("version = 2\n{constants}[design.x]\n{keys}\n[[output]]\nname = \"f\"\nvalue = \"x\"\n");
        let model = linkwright::model_file::read("m", &text).unwrap_or_else(|e| panic!("{keys}\n{e}"));
        let x = &model.variables()[0];
        assert!((x.start - start).abs() < 1e-12 * start && x.unit == unit, "{keys}: {} {}", x.start, x.unit);
    }
    for (keys, why) in [
        ("start = 120\nlower = \"100 mm\"", "the start has none"),
        ("start = \"60 + 60\"\nlower = \"100 mm\"", "the start has none"),
        ("start = \"l0\"\nlower = \"1 kg\"", "mass"),
        ("start = \"l0\"\nlower = 1", "the start has the unit m"),
        ("start = \"l0\"\nunit = \"kg\"", "`unit` is a mass"),
    ] {
        let text = format!("version = 2\n{constants}[design.x]\n{keys}\n[[output]]\nname = \"f\"\nvalue = \"x\"\n");
        let error = linkwright::model_file::read("m", &text).err().unwrap_or_else(|| panic!("{keys}")).to_string();
        assert!(error.contains(why), "{keys}\n{error}");
    }
}

#[test]
fn a_swept_variable_is_one_column() {
    let swept = study(MODEL, "kind = \"sweep\"\n[vary.x]\nfrom = 200\nto = 300\npoints = 2\n");
    let all = swept.run(swept.no_rows(), Part::WHOLE, &|_| true).unwrap();
    let table = swept.table(&all, 0).unwrap();
    assert_eq!(table.columns().iter().filter(|name| *name == "x").count(), 1, "{:?}", table.columns());
    assert!(table.text().contains("[mm]") && table.text().replace('\n', " ").contains("violation"), "{}", table.text());
    assert!(!table.text().contains("pct"), "{}", table.text());
}

#[test]
fn derivatives_of_an_optimum_have_units() {
    let model = MODEL
        .replace("value = \"x*y\"", "value = \"x*y\"\nshown_in = \"cm^2\"")
        .replace("at_least = 0.09", "at_least = \"900 cm^2\"");
    let front = study(&model, "kind = \"pareto\"\n[vary.room]\nfrom = 800\nto = 900\npoints = 2\n");
    assert_eq!(unit(&front, "d x/d room"), "mm/cm²");
    let scattered = study(&model, "kind = \"tolerance\"\ncount = 4\n[vary.x]\ndeviation = 1\n");
    assert_eq!(unit(&scattered, "d room/d x"), "cm²/mm");
}

/// An output with a label, and a limit with the same unit: it can be swept, and limits a Pareto front.
#[test]
fn a_limit_of_an_output_with_a_label_can_be_swept() {
    let model = "version = 2\n[design.b]\nstart = \"30 mm\"\nlower = \"10 mm\"\nupper = \"100 mm\"\n\
        [[output]]\nname = \"area\"\nvalue = \"b*b\"\nunit = \"m²\"\n\
        [[output]]\nname = \"reach\"\nvalue = \"100*b\"\nunit = \"m\"\n\
        [objective]\nminimize = \"area\"\n[[constraint]]\nname = \"long\"\nvalue = \"reach\"\nat_least = \"3 m\"\n";
    for (kind, name) in [("sweep", "\"constraint.long.at_least\""), ("pareto", "long")] {
        for from in ["3", "\"3 m\"", "\"300 cm\""] {
            let file = format!("kind = \"{kind}\"\n[vary.{name}]\nfrom = {from}\nto = \"4 m\"\npoints = 2\n");
            let study = made(model, &file).unwrap_or_else(|error| panic!("{file}\n{error}"));
            let rows = study.run(study.no_rows(), Part::WHOLE, &|_| true).unwrap();
            let columns = &study.phases()[0].columns;
            assert_eq!((columns[0].unit.as_str(), columns[1].unit.as_str()), ("m", "m²"), "{file}");
            for (run, expected) in [(0, 9e-4), (1, 16e-4)] {
                let row = rows.get(0, run).unwrap();
                assert!((row.value(1) - expected).abs() < 1e-9, "{file}: {row:?}");
            }
        }
    }
}
