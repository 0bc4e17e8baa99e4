//! Everyday use: edit a model, run it again, look at the results.
#![cfg(feature = "cli")]

use crate::shell::{TempFolder, linkwright, text};

fn summary(place: &TempFolder, folder: &str) -> serde_json::Value {
    serde_json::from_str(&place.read(&format!("{folder}/summary.json"))).unwrap()
}

#[test]
fn a_second_run_goes_to_the_next_folder() {
    let place = TempFolder::new("numbered");
    place.example("two-bar-truss");
    place.run(&["optimize", "two-bar-truss", "-q"], 0);
    assert!(place.run(&["optimize", "two-bar-truss.toml"], 0).contains("Results are in out/two-bar-truss-2"));
    place.run(&["optimize", "two-bar-truss.toml", "-q"], 0);
    assert_eq!(place.read("out/two-bar-truss/cycles.csv"), place.read("out/two-bar-truss-3/cycles.csv"));
    place.run(&["optimize", "two-bar-truss.toml", "-q", "--force"], 0);
    assert!(!place.0.join("out/two-bar-truss-4").exists());
    // A folder that is given explicitly is not replaced by a numbered one.
    assert!(place.run(&["optimize", "two-bar-truss.toml", "-o", "out/two-bar-truss"], 1).contains("--force"));
}

#[test]
fn settings_are_changed_for_a_quick_try() {
    let place = TempFolder::new("set");
    place.example("impact-absorber");
    let before = place.read("impact-absorber.toml");
    place.run(&["optimize", "impact-absorber", "-q", "--max-cycles", "1", "--start", "k=0.5,c=0.4", "-o", "short"], 3);
    let cycles = place.read("short/cycles.csv");
    assert!(cycles.lines().nth(1).unwrap().contains(",0.5,0.4,"), "{cycles}");
    assert_eq!(summary(&place, "short")["tries"], 1);
    place.run(
        &[
            "optimize",
            "impact-absorber",
            "-q",
            "--method",
            "mma",
            "--set",
            "constraint.displacement.at_most=0.9",
            "-o",
            "tight",
        ],
        0,
    );
    let copy = place.read("tight/model.toml");
    assert!(copy.contains("preset = \"mma\"") && copy.contains("at_most = 0.9"), "{copy}");
    assert_eq!(summary(&place, "tight")["constraints"][0]["limit"], 0.9);
    assert_eq!(place.read("impact-absorber.toml"), before);
    for (arguments, message) in [
        (["--set", "k"], "KEY=VALUE"),
        (["--set", "design.q.start=1"], "there is no `design.q`"),
        (["--method", "newton"], "newton"),
    ] {
        let all = [["optimize", "impact-absorber"].as_slice(), &arguments].concat();
        assert!(place.run(&all, 1).contains(message), "{arguments:?}");
    }
}

#[test]
fn resume_says_what_differs_and_continues_or_starts_over() {
    let place = TempFolder::new("resume-edited");
    place.example("cantilever");
    let good = place.read("cantilever.toml");
    place.run(&["optimize", "cantilever", "-q", "--max-cycles", "3"], 3);
    std::fs::write(place.0.join("cantilever.toml"), good.clone() + "max_cycles = 90\n").unwrap();
    let shown = place.run(&["resume", "cantilever", "cantilever.toml"], 0);
    assert!(
        shown.contains("Changed method.max_cycles: 3 → 90") && shown.contains("Results are in out/cantilever\n"),
        "{shown}"
    );
    place.run(&["optimize", "cantilever", "-q", "-o", "whole"], 0);
    assert_eq!(place.read("out/cantilever/cycles.csv"), place.read("whole/cycles.csv"));
    std::fs::write(place.0.join("cantilever.toml"), good.replace("61/x1", "62/x1")).unwrap();
    let shown = place.run(&["resume", "cantilever", "cantilever.toml"], 0);
    assert!(shown.contains("a new run begins") && shown.contains("62/x1"), "{shown}");
    assert!(shown.contains("Results are in out/cantilever-2"), "{shown}");
}

#[test]
fn numbers_are_written_as_people_write_them() {
    let place = TempFolder::new("digits");
    place.example("impact-absorber");
    let shown = place.run(&["optimize", "impact-absorber"], 0);
    assert!(shown.contains("0.52029 m/s²") && shown.contains("     0.36276      0.48231"), "{shown}");
    // The constraint as it is written, and its state. Two time points beside the maximum are at the limit.
    assert!(shown.contains("1 ≤ 1 m at 2."), "{shown}");
    let shown = place.run(&["analyze", "impact-absorber", "--digits", "9"], 0);
    assert!(shown.contains("minimum") && shown.contains("at the end"), "{shown}");
    let lines: Vec<serde_json::Value> = place
        .run(&["analyze", "impact-absorber", "--json"], 0)
        .lines()
        .map(|l| serde_json::from_str(l).unwrap())
        .collect();
    let one = &lines[0];
    assert_eq!((&one["event"], &one["version"], lines.len()), (&"analysis".into(), &1.into(), 1));
    // The acceleration at the start is −c v = −0.3 m/s², and its largest magnitude is the objective.
    let of = |k: usize, what: &str| one["outputs"][k][what]["value"].as_f64().unwrap();
    let peak = of(1, "maximum").abs().max(of(1, "minimum").abs());
    assert!((one["objective"]["value"].as_f64().unwrap() - peak).abs() < 1e-12);
    assert_eq!(place.run(&["analyze", "impact-absorber", "-q"], 0), "");
}

#[test]
fn a_maximum_is_shown_as_it_is_written() {
    let place = TempFolder::new("maximum");
    std::fs::write(
        place.0.join("gain.toml"),
        "version = 2\n[design]\nx = { start = 1.0, lower = 0.5, upper = 2.0 }\n[[output]]\nname = \"gain\"\nvalue = \"x*(5 - x)\"\nunit = \"W\"\n\
         [objective]\nname = \"gain\"\nunit = \"W\"\nmaximize = \"gain\"\n",
    )
    .unwrap();
    let shown = place.run(&["optimize", "gain"], 0);
    assert!(shown.contains("6 W") && !shown.contains("-6") && shown.contains("x is at its upper bound"), "{shown}");
    assert_eq!(summary(&place, "out/gain")["objective"]["value"], 6.0);
    let objective = |line: &str| line.split(',').nth(2).unwrap().parse::<f64>().unwrap();
    assert!(place.read("out/gain/cycles.csv").lines().skip(1).all(|line| objective(line) > 0.0));
    let shown = place.run(&["optimize", "gain", "--json"], 0);
    assert!(shown.lines().filter(|l| l.contains("\"cycle\"")).all(|l| !l.contains("\"objective\":-")), "{shown}");
    place.run(&["report", "gain", "--page-only"], 0);
    let page = place.read("out/gain/report.html");
    assert!(page.contains("is maximized over") && !page.contains("gain is minimized"));
    assert!(place.run(&["sensitivities", "gain"], 0).contains(" 3 W\n"), "d(5x − x²)/dx at 1 is 3");
}

#[test]
fn a_file_without_an_objective_is_a_simulation() {
    let place = TempFolder::new("simulation");
    place.example("slider-crank");
    let whole = place.read("slider-crank.toml");
    let start = whole.find("[objective]").unwrap();
    std::fs::write(place.0.join("only.toml"), &whole[..start]).unwrap();
    let shown = place.run(&["analyze", "only", "-o", "here"], 0);
    assert!(shown.contains("minimum") && place.read("here/responses.csv").lines().count() > 2, "{shown}");
    let shown = text(&linkwright(&["optimize", "only"], &place.0).stderr);
    assert!(shown.contains("no objective") && shown.contains("analyze"), "{shown}");
    std::fs::write(
        place.0.join("wave.toml"),
        "version = 2\n[time]\nto = 1\npoints = 5\n[[output]]\nname = \"y\"\nvalue = \"time^2\"\n",
    )
    .unwrap();
    assert!(place.run(&["analyze", "wave"], 0).contains('y'));
}

/// A mechanism without a driver, with one coordinate driven twice, and with a ramp that goes back in time.
#[test]
fn wrong_drives_are_errors_with_the_place_in_the_file() {
    let place = TempFolder::new("drives");
    place.example("shaper");
    let good = place.read("shaper.toml");
    let start = good.find("[[driver]]").unwrap();
    let end = start + good[start..].find("\n\n").unwrap();
    let driver = &good[start..end];
    let line = |text: &str, part: &str| 1 + text[..text.find(part).unwrap()].matches('\n').count();
    let rejected = |model: &str| {
        std::fs::write(place.0.join("wrong.toml"), model).unwrap();
        let output = linkwright(&["analyze", "wrong"], &place.0);
        assert_eq!(output.status.code(), Some(1));
        text(&output.stderr)
    };

    let torque = "[[output]]\nname = \"torque\"\nvalue = \"-motor.driving_force\"\nunit = \"N·m\"\n";
    assert!(good.contains(torque));
    let free = good.replace(driver, "").replace(torque, "").replace("minimize = \"torque\"", "minimize = \"velocity\"");
    let shown = rejected(&free);
    let place_in_file = format!("wrong.toml:{}:", line(&free, "name = \"disc\""));
    assert!(
        shown.contains("disc.theta: a degree of freedom is not driven") && shown.contains(&place_in_file),
        "{shown}"
    );

    let twice = good.replace(driver, &format!("{driver}\n\n{}", driver.replace("motor", "second")));
    let shown = rejected(&twice);
    let second = line(&twice, "name = \"second\"") + 1;
    assert!(shown.contains("prescribed twice, by `motor` and `second`"), "{shown}");
    assert!(shown.contains(&format!("wrong.toml:{second}:")), "{shown}");

    let motion = driver.split("motion = ").nth(1).unwrap();
    let ramp = good.replace(motion, "{ kind = \"ramp\", from = 0, to = 1, duration = -1 }");
    let shown = rejected(&ramp);
    assert!(
        shown.contains("duration") && shown.contains(&format!("wrong.toml:{}:", line(&ramp, "[[driver]]") + 3)),
        "{shown}"
    );
}

#[test]
fn an_analysis_makes_a_page_with_the_mechanism_and_its_histories() {
    let place = TempFolder::new("analysis-page");
    place.run(&["new", "lift"], 0);
    let said = place.run(&["analyze", "lift", "--out", "here"], 0);
    assert!(said.contains("report.html"), "{said}");
    let page = place.read("here/report.html");
    for part in ["linkwright-animation", "Histories over time", "<caption>Constraints", "Analysis at "] {
        assert!(page.contains(part), "{part}");
    }
    for address in ["http:", "https:", "src=", "@import", "url(h"] {
        assert!(!page.contains(address), "{address}");
    }
    assert!(page.len() < 1 << 20, "{} bytes", page.len());

    // A file without an objective is a simulation, and has a page, too.
    let text = place.read("lift.toml");
    let end = text.find("[objective]").unwrap();
    std::fs::write(place.0.join("still.toml"), &text[..end]).unwrap();
    place.run(&["analyze", "still", "--out", "still", "--quiet"], 0);
    let page = place.read("still/report.html");
    assert!(page.contains("linkwright-animation") && !page.contains("<caption>Constraints"));
}

/// Values of design variables have units as in the file, by both names of the option, in every command that takes them.
#[test]
fn designs_on_the_command_line_have_units() {
    let place = TempFolder::new("design-units");
    let text = "version = 2\n[design.length]\nstart = \"400 mm\"\nlower = \"100 mm\"\n[design.width]\nstart = 0.5\nunit = \"m\"\n\
        [[output]]\nname = \"area\"\nvalue = \"length*width\"\nunit = \"m^2\"\n[objective]\nminimize = \"area\"\n[[constraint]]\n\
        name = \"large enough\"\nvalue = \"area\"\nat_least = 0.03\n";
    std::fs::write(place.0.join("sheet.toml"), text).unwrap();
    let area = |arguments: &[&str]| -> f64 {
        let shown = place.run(&[&["analyze", "sheet", "--json"][..], arguments].concat(), 0);
        serde_json::from_str::<serde_json::Value>(&shown).unwrap()["objective"]["value"].as_f64().unwrap()
    };
    for same in ["length=0.3 m,width=200 mm", "length=300,width=0.2", "length=30 cm,width=2*0.1"] {
        assert!((area(&["--at", same]) - 0.06).abs() < 1e-12, "{same}");
        assert!((area(&["--start", same]) - 0.06).abs() < 1e-12, "{same}");
    }
    place.run(&["check", "sheet", "--at", "length=0.3 m", "-q"], 0);
    place.run(&["sensitivities", "sheet", "--at", "length=0.3 m", "--json", "-q"], 2);
    for option in ["--at", "--start"] {
        // However it ends: the copy of the model has the start.
        let start = "length=0.3 m,width=200 mm";
        drop(linkwright(&["optimize", "sheet", "-q", "--max-cycles", "1", option, start, "--force"], &place.0));
        assert!(place.read("out/sheet/model.toml").contains("start = \"300 mm\""));
        assert!(place.read("out/sheet/model.toml").contains("start = 0.2"));
    }
    assert!(place.run(&["analyze", "sheet", "--at", "length=3 s"], 1).contains("`length` takes a value in mm"));
    let shown = place.run(&["analyze", "sheet", "--set", "constraint.\"large enough\".at_least=0.3"], 0);
    assert!(shown.contains("≥ 0.3") && shown.contains("violated"), "{shown}");
}

/// A run at its limit of cycles goes on with another limit, without an edit of a file.
#[test]
fn settings_of_a_run_are_changed_when_it_is_resumed() {
    let place = TempFolder::new("resume-set");
    place.example("impact-absorber-formula");
    place.run(&["optimize", "impact-absorber-formula", "-q", "-o", "run", "--max-cycles", "2"], 3);
    assert!(place.run(&["resume", "run", "--max-cycles", "60"], 0).contains("Converged"));
    let shown = place.run(&["report", "run", "-o", "page", "--json", "--slice", "0", "--page-only"], 0);
    let record: serde_json::Value = serde_json::from_str(&shown).unwrap();
    assert_eq!((&record["event"], &record["page"]), (&"report".into(), &"page/report.html".into()));
    assert!(place.read("page/report.html").starts_with("<!DOCTYPE html>"));
    assert!(!place.0.join("run/report.html").exists());
}

/// A formula that is undefined names its function, the argument and the time, with and without a mechanism.
#[test]
fn undefined_formulas_name_function_and_argument() {
    let place = TempFolder::new("undefined");
    place.example("impact-absorber");
    for (formula, why) in [
        ("asin(2 + time)", "asin(2) is not defined: asin takes −1 to 1"),
        ("1/time", "1/0 is not finite"),
        ("sqrt(time - 1)", "sqrt(-1)"),
        ("ln(0*time)", "ln(0)"),
    ] {
        let output =
            format!("version = 2\n[time]\nto = 2\npoints = 5\n[[output]]\nname = \"bad\"\nvalue = \"{formula}\"\n");
        let plain = output.clone() + "[design]\nk = { start = 1 }\n[objective]\nminimize = \"k\"\n";
        std::fs::write(place.0.join("plain.toml"), plain).unwrap();
        let shown = place.run(&["analyze", "plain"], 1);
        assert!(shown.contains(why) && shown.contains("time 0 s"), "{formula}: {shown}");
        let moving = output.replace("time", "block.x").replace("[block.x]", "[time]")
            + "[[body]]\nname = \"block\"\nposition = [0, 0]\nmass = 1\ninertia = 1\n[analysis]\nkind = \"dynamics\"\nstep = 0.1\n";
        std::fs::write(place.0.join("moving.toml"), moving).unwrap();
        let shown = place.run(&["analyze", "moving"], 1);
        assert!(shown.contains(why) && shown.contains("at t = 0 s"), "{formula}: {shown}");
    }
}

/// With one time point, the history of an output is a number, which can be minimized as it is.
#[test]
fn a_history_of_one_time_point_is_a_number() {
    let place = TempFolder::new("instant");
    let text = "version = 2\ngravity = [9.81, 0]\n[design]\nk = { start = 1000.0, lower = 500.0, upper = 2000.0 }\n[[body]]\nname = \"load\"\n\
        position = [0, 0]\nmass = 2\ninertia = 0.1\n[[joint]]\nname = \"guide\"\nkind = \"prismatic\"\na = \"ground\"\nb = \"load\"\n[[force]]\n\
        name = \"spring\"\nkind = \"spring\"\na = { body = \"ground\", at = [-1, 0] }\nb = \"load\"\nstiffness = \"k\"\nlength = 1\n[time]\n\
        at = [1]\n[analysis]\nkind = \"statics\"\n[[output]]\nname = \"sag\"\nvalue = \"load.x\"\nunit = \"m\"\n[objective]\nminimize = \"OBJECTIVE\"\n";
    for (name, objective) in [("plain", "sag"), ("reduced", "final(sag)"), ("formula", "sag^2 + 0*k")] {
        std::fs::write(place.0.join(format!("{name}.toml")), text.replace("OBJECTIVE", objective)).unwrap();
        place.run(&["optimize", name, "-q"], 0);
        let stiffness = summary(&place, &format!("out/{name}"))["design"][0]["value"].as_f64().unwrap();
        assert!((stiffness - 2000.0).abs() < 1e-6, "{name}: {stiffness}");
    }
}

/// A motion without a step has one that suits its time points.
#[test]
fn dynamics_have_a_default_step() {
    let place = TempFolder::new("default-step");
    place.run(&["new", "lift"], 0);
    let text = place.read("lift.toml");
    let line = text.lines().find(|line| line.starts_with("step") || line.starts_with("tolerance")).unwrap().to_owned();
    std::fs::write(place.0.join("plain.toml"), text.replace(&line, "")).unwrap();
    let number = |file: &str| -> f64 {
        let model = linkwright::model_file::read(file, &place.read(file)).unwrap();
        let problem = model.problem().unwrap();
        let responses = problem.analyze(&problem.start()).unwrap();
        responses.values.iter().flatten().sum()
    };
    let (given, default) = (number("lift.toml"), number("plain.toml"));
    assert!((given / default - 1.0).abs() < 1e-3, "{given} {default}");
}

/// Commas inside parentheses belong to a value; `--digits` shortens all numbers of `check`; rounding errors are not shown as values.
#[test]
fn values_with_commas_digits_and_rounding_errors() {
    let place = TempFolder::new("commas");
    let text = "version = 2\n[design.a]\nstart = 1\n[design.b]\nstart = 2\n[[output]]\nname = \"x\"\nunit = \"m\"\nvalue = \"a*b\"\n\
                [[output]]\nname = \"tiny\"\nunit = \"m\"\nvalue = \"a*1e-17\"\n[objective]\nminimize = \"x^2\"\n";
    std::fs::write(place.0.join("m.toml"), text).unwrap();
    let shown = place.run(&["analyze", "m.toml", "--at", "a=max(0.25, 0.5),b=min(3,4)"], 0);
    assert!(shown.contains("a = 0.5, b = 3"), "{shown}");
    assert!(shown.contains("1.5") && !shown.contains("e-1"), "{shown}");
    let shown = place.run(&["check", "m.toml", "--at", "a=0.123456789", "--all", "--digits", "2"], 0);
    assert!(shown.contains("1.2e-1") && !shown.contains("1.23") && !shown.contains("0.00 %"), "{shown}");
    let shown = place.run(&["check", "m.toml", "--at", "a=0.123456789", "--all", "--digits", "7"], 0);
    assert!(shown.contains("1.234568e-1"), "{shown}");
}

/// Settings that allow no further cycle do not change the end of a run.
#[test]
fn a_converged_run_stays_converged_if_nothing_is_done() {
    let place = TempFolder::new("stays");
    place.example("two-bar-truss");
    place.run(&["optimize", "two-bar-truss", "-q"], 0);
    let before = summary(&place, "out/two-bar-truss");
    assert!(before["cycles"].as_u64().unwrap() > 2);
    assert!(place.run(&["resume", "two-bar-truss", "--max-cycles", "2"], 0).contains("Converged"));
    let after = summary(&place, "out/two-bar-truss");
    assert_eq!((&after["status"], &after["cycles"]), (&before["status"], &before["cycles"]));
    assert!(place.run(&["resume", "two-bar-truss"], 0).contains("Converged"));
}

/// Messages about arguments name them: values with units, names that are given twice, lines of the changed text.
#[test]
fn messages_about_arguments_name_them() {
    let place = TempFolder::new("arguments");
    let model = "version = 2\n[design.w]\nstart = '60 mm'\nlower = '20 mm'\nupper = '120 mm'\n[[output]]\nname = 'f'\nvalue = '2*w'\n\
                 [objective]\nminimize = 'f'\n";
    std::fs::write(place.0.join("m.toml"), model).unwrap();
    std::fs::write(place.0.join("s.toml"), "version = 1\nmodel = 'm.toml'\nkind = 'sample'\ncount = 2\n[vary.w]\n")
        .unwrap();
    for (arguments, message) in [
        (vec!["analyze", "m", "--at", "w=0.07"], "w = 0.07 mm is outside its bounds, 20 mm and 120 mm"),
        (vec!["analyze", "m", "--at", "w=70,w=80"], "`w` is given twice"),
        (vec!["optimize", "m", "--start", "w=70", "--start", "w=80"], "`w` is given twice"),
        (
            vec!["analyze", "m", "--set", "design.w.start=70", "--set", "design.w.start=80"],
            "`design.w.start` is given twice",
        ),
        (vec!["analyze", "m", "--set", "design.w.start=70"], "`design.w.start` is \"60 mm\", and 70 has no unit"),
        (vec!["optimize", "m", "--max-cycles", "0"], "with method.max_cycles = 0, from the command line"),
        (vec!["study", "m.toml"], "m.toml is a model file, and a study is needed"),
        (vec!["analyze", "s.toml"], "s.toml is a study, and a model file is needed; `linkwright study s.toml`"),
        (vec!["optimize", "s"], "s.toml is a study"),
    ] {
        let shown = place.run(&arguments, 1);
        assert!(shown.contains(message), "{arguments:?}: {shown}");
    }
}

/// The message lists the forbidden changes only, and then a start that the bounds exclude.
#[test]
fn forbidden_changes_are_told_without_the_allowed_ones() {
    let place = TempFolder::new("forbidden");
    let model = "version = 2\n[constants]\nF = 2\n[design.w]\nstart = '60 mm'\nlower = '20 mm'\nupper = '120 mm'\n[[output]]\nname = 'f'\n\
                 value = 'F*w'\n[objective]\nminimize = 'f'\n";
    std::fs::write(place.0.join("m.toml"), model).unwrap();
    place.run(&["optimize", "m", "-q", "-o", "run"], 0);
    place.run(&["resume", "run", "-q", "--set", "design.w.upper=\"30 mm\""], 0);
    let shown = place.run(&["resume", "run", "--set", "constants.F=3"], 1);
    assert!(shown.contains("constants.F: 2 → 3") && shown.contains("run/model.toml:"), "{shown}");
    let edited = model.replace("F = 2", "F = 3").replace("20 mm", "2 cm");
    std::fs::write(place.0.join("run/model.toml"), edited).unwrap();
    let shown = place.run(&["resume", "run"], 1);
    assert!(shown.contains("What differs: constants.F") && !shown.contains("lower"), "{shown}");
}

/// A model without a title has the name of its file, wherever it is and whatever copy is read.
#[test]
fn a_model_without_a_title_has_the_name_of_its_file() {
    let place = TempFolder::new("untitled");
    std::fs::create_dir(place.0.join("models")).unwrap();
    let model = "version = 2\n[design.w]\nstart = 1\nlower = 0\nupper = 2\n[[output]]\nname = 'f'\nvalue = 'ln(w - 5)'\n[objective]\nminimize = 'f'\n";
    std::fs::write(place.0.join("models/bad.toml"), model).unwrap();
    std::fs::write(
        place.0.join("s.toml"),
        "version = 1\nmodel = 'models/bad.toml'\nkind = 'sample'\ncount = 4\n[vary.w]\n",
    )
    .unwrap();
    for part in ["1/2", "2/2"] {
        place.run(&["study", "s", "-q", "--part", part], 1);
    }
    place.run(&["study", "merge", "out/s-part-1-of-2", "out/s-part-2-of-2", "-q"], 1);
    let listed = place.run(&["runs", "--json"], 0);
    let all: Vec<serde_json::Value> = listed.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(all.len(), 3);
    for entry in all {
        assert_eq!((&entry["model"], &entry["kind"]), (&"bad.toml".into(), &"study".into()));
        let is_whole = !entry["folder"].as_str().unwrap().contains("part");
        assert!(!is_whole || entry["status"] == "Failed", "{entry}");
    }
    let path = place.0.join("models/bad.toml");
    let read = ::linkwright::model_file::read(path.to_str().unwrap(), model).unwrap();
    assert_eq!(read.title(), "bad.toml");
    assert_eq!(read.copied_from("a/b/c.toml").title(), "c.toml");
}

/// A cantilever whose limit is given in a unit of its own, and the width of which is minimized.
const BEAM: &str = r#"
version = 2
title = "beam"
[design.w]
start = "60 mm"
lower = "20 mm"
upper = "120 mm"
[design.h]
start = "90 mm"
lower = "20 mm"
upper = "200 mm"
[time]
to = 0.7
points = 13
[[output]]
name = "force_at_tip"
value = "200 kN/m * w*(1 + time/(1 s))"
[[output]]
name = "labelled"
value = "200 kN/m * (w + 0*h)"
unit = "N"
[objective]
minimize = "w"
[[constraint]]
name = "strength"
value = "force_at_tip"
at_least = "9 kN"
[[constraint]]
name = "stiffness"
value = "labelled"
at_least = "4 kN"
"#;

#[test]
fn every_number_has_its_unit() {
    let place = TempFolder::new("everyday-units");
    std::fs::write(place.0.join("beam.toml"), BEAM).unwrap();
    let shown = place.run(&["analyze", "beam", "--out", "a"], 0);
    for part in ["60 mm, minimized", "12 ≥ 9 kN at 0 s", "12 ≥ 4 kN", "[s]"] {
        assert!(shown.contains(part), "{part}: {shown}");
    }
    let page = place.read("a/report.html");
    for part in ["<caption>Objective</caption>", "minimized", "margin", "at time [s]", "force_at_tip"] {
        assert!(page.contains(part), "{part}");
    }
    // A legend shows the underscores of a name.
    assert!(
        !page.contains("baseline-shift") && !page.contains(">force</tspan>") && !page.contains("at</tspan>"),
        "subscripts"
    );
    let shown = place.run(&["sensitivities", "beam"], 0);
    let lines: Vec<&str> = shown.lines().collect();
    let strength =
        lines.iter().find(|line| line.contains("strength ≥ 9 kN at time 0 s")).unwrap_or_else(|| panic!("{shown}"));
    assert!(strength.contains("0.2 kN/mm"), "{shown}");
    let ends: Vec<usize> = lines[2..].iter().map(|line| line.chars().count()).collect();
    assert!(ends.windows(2).all(|pair| pair[0] == pair[1]), "the columns are aligned: {shown}");
    let shown = place.run(&["analyze", "beam", "--set", "design.w.start=60 ft"], 1);
    assert!(
        shown.contains("the start 60 ft of `w` is outside its bounds, 0.0656167979 ft to 0.393700787 ft"),
        "{shown}"
    );
    // Times have as many digits as are needed to distinguish the points.
    let shown = place.run(&["sensitivities", "beam", "--set", "constraint.strength.at_most=20 kN"], 0);
    assert!(shown.contains("at time 0.7 s"), "{shown}");
}

/// No method can improve a value that changes in steps, and a run says so before it begins.
#[test]
fn values_in_steps_are_told_before_a_run() {
    let place = TempFolder::new("everyday-steps");
    let model = |objective: &str| {
        format!(
            "version = 2\n[design.a]\nstart = 2\nlower = 0.5\nupper = 3\n[time]\nto = 2\npoints = 21\n[[output]]\nname = \"y\"\n\
             value = \"a*sin(3*time)\"\n[[output]]\nname = \"s\"\nvalue = \"sign(a - 1)\"\n[objective]\nminimize = \"{objective}\"\n"
        )
    };
    for objective in ["if(a > 1, 1, 2)", "sign(a)", "2*s + 3", "max(sign(y)*2)"] {
        std::fs::write(place.0.join("m.toml"), model(objective)).unwrap();
        for command in ["optimize", "check"] {
            let shown = place.run(&[command, "m", "-q"], 0);
            assert!(
                shown.contains("this value changes in steps") && shown.contains("m.toml:16:1"),
                "{objective}: {shown}"
            );
        }
    }
    for objective in ["a", "if(a > 1, a, 2)", "sign(a)*a", "max(y)", "rms(y) + sign(a)", "3", "time_of_max(y)"] {
        std::fs::write(place.0.join("m.toml"), model(objective)).unwrap();
        assert!(!place.run(&["check", "m", "-q"], 0).contains("changes in steps"), "{objective}");
    }
    // A derivative that does not exist is an error with the variable and the place.
    for objective in ["sqrt(a - 2)", "atan2(a - 2, 0*a)"] {
        std::fs::write(place.0.join("m.toml"), model(objective)).unwrap();
        let shown = place.run(&["optimize", "m", "-q"], 1);
        assert!(shown.contains("derivative of objective `objective` to `a` is NaN at a = 2"), "{shown}");
        assert!(shown.contains("m.toml:") && !shown.contains("the program"), "{shown}");
    }
}

/// Derivatives neglect how the time of a jump changes with the design: of a force that jumps by a formula, and of a history under an integral.
#[test]
fn jumps_that_move_with_the_design_are_told_before_a_run() {
    let place = TempFolder::new("everyday-jumps");
    let model = |force: &str, event: &str, objective: &str| {
        format!(
            "version = 2\n[design.a]\nstart = 0.5\nlower = 0.1\nupper = 0.9\n[[body]]\nname = \"s\"\nkind = \"slider\"\nmass = 1\n\
             velocity = 1\n[[force]]\nname = \"f\"\n{force}\n{event}[time]\nto = 1\npoints = 21\n[analysis]\nkind = \"dynamics\"\n\
             scheme = \"rk8\"\n[[output]]\nname = \"x\"\nvalue = \"s.position\"\n[objective]\nminimize = \"{objective}\"\n"
        )
    };
    let load = |value: &str| format!("kind = \"load\"\nb = \"s\"\ngeneralized_force = \"{value}\"");
    let feedback = |value: &str| format!("kind = \"feedback\"\ncoordinate = \"s\"\ngeneralized_force = \"{value}\"");
    let shown = |force: &str, event: &str, objective: &str| {
        std::fs::write(place.0.join("m.toml"), model(force, event, objective)).unwrap();
        place.run(&["analyze", "m"], 0)
    };
    let jumps = "its value jumps where a condition changes";
    let laws = ["if(time > a, 2, 0)", "a*if(time > a, 2, 1) + 1", "sign(time - a)", "if(time > a, 2, 0)/a"];
    for value in laws {
        let note = shown(&load(value), "", "final(x)");
        assert!(note.contains(jumps) && note.contains("unless an `[[event]]` happens then"), "{value}: {note}");
    }
    for value in ["if(s.position > 0.3, -1, 0)", "-sign(s.velocity)", "3*sign(s.position - a)"] {
        let note = shown(&feedback(value), "", "final(x)");
        assert!(note.contains(jumps) && note.contains("switch a force on or off"), "{value}: {note}");
    }
    let without =
        ["if(time > 0.5, a, 0)", "if(time > a, time - a, 0)", "(time - a)*if(time > a, 1, 0)", "if(a > 0.3, 1, 2)"];
    for value in without {
        assert!(!shown(&load(value), "", "final(x)").contains(jumps), "{value}");
    }
    assert!(!shown(&feedback("-sign(s.velocity)*s.velocity^2"), "", "final(x)").contains(jumps));
    let integral = "if its history jumps at an event";
    let off = "[[event]]\nname = \"off\"\nwhen = \"s.position > a\"\nswitch_off = \"f\"\n";
    for objective in ["integral(x)", "mean(x)", "1 + rms(x)", "norm(x, 8)"] {
        assert!(shown(&load("2"), off, objective).contains(integral), "{objective}");
        assert!(!shown(&load("2"), "", objective).contains(integral), "{objective}");
    }
    assert!(!shown(&load("2"), off, "max(x)").contains(integral));
}

/// Derivatives along explicit and adaptive steps lack the effect of a design variable on the time at which a driven acceleration jumps.
#[test]
fn driven_accelerations_that_jump_at_a_design_variable_are_told() {
    let shown = |motion: &str| {
        let place = TempFolder::new("everyday-driven");
        let text = format!(
            "version = 2\n[design.a]\nstart = 0.5\nlower = 0.1\nupper = 0.9\n[[body]]\nname = \"s\"\nkind = \"slider\"\nmass = 1\n\
             [[driver]]\nname = \"d\"\ncoordinate = \"s\"\nmotion = {motion}\n[time]\nto = 1\npoints = 3\n[analysis]\nkind = \"dynamics\"\n\
             [[output]]\nname = \"x\"\nvalue = \"s.position\"\n"
        );
        std::fs::write(place.0.join("m.toml"), text).unwrap();
        place.run(&["analyze", "m"], 0)
    };
    let start_up = |duration: &str, profile: &str| {
        format!("{{ kind = \"start-up\", speed = \"a\", duration = {duration}, profile = \"{profile}\" }}")
    };
    let told = "derivatives by explicit and by adaptive steps lack the effect of that time";
    for motion in
        [start_up("\"a\"", "linear"), "\"max(0, time - a)^2\"".into(), "\"if(time > a, (time - a)^2, 0)\"".into()]
    {
        assert!(shown(&motion).contains(told), "{motion}");
    }
    for motion in [
        start_up("0.3", "linear"),
        start_up("\"a\"", "cubic"),
        "\"max(0, time - 0.3)^2*a\"".into(),
        "\"a*time\"".into(),
    ] {
        assert!(!shown(&motion).contains(told), "{motion}");
    }
}

/// A simulation has no objective to be checked, and a study is not a run.
#[test]
fn simulations_are_checked_and_studies_are_no_runs() {
    let place = TempFolder::new("everyday-simulation");
    let model = "version = 2\ntitle = \"free\"\n[constants]\nc = 2.0\n[time]\nto = 1\npoints = 3\n[[output]]\nname = \"y\"\nvalue = \"c*time\"\n";
    std::fs::write(place.0.join("m.toml"), model).unwrap();
    assert!(place.run(&["check", "m"], 0).contains("free: there is no design variable, so there are no derivatives"));
    assert!(
        place.run(&["analyze", "m", "--at", "c=3"], 1).contains("there is no design variable `c`: the model has none")
    );
    std::fs::write(place.0.join("m.toml"), model.replace("[constants]\nc = 2.0", "[design.c]\nstart = 2.0")).unwrap();
    let shown = place.run(&["check", "m"], 0);
    assert!(shown.contains("free: 1 design variable, 1 response,") && !shown.contains("the objective is"), "{shown}");
    std::fs::write(
        place.0.join("s.toml"),
        "version = 1\nmodel = \"m.toml\"\nkind = \"grid\"\n[vary.c]\nfrom = 1\nto = 2\npoints = 3\n",
    )
    .unwrap();
    place.run(&["study", "s", "-q"], 0);
    for command in ["report", "resume"] {
        assert!(place.run(&[command, "out/s"], 1).contains("has a study in it"), "{command}");
    }
    // The copies of a study can be run, and the study goes on with its own file.
    place.run(&["study", "out/s/study.toml", "-q", "-o", "again"], 0);
    assert_eq!(place.read("again/runs.csv"), place.read("out/s/runs.csv"));
    place.run(&["study", "s", "-q"], 0);
    let other = place.read("s.toml").replace("points = 3", "points = 4");
    std::fs::write(place.0.join("s.toml"), other).unwrap();
    let shown = place.run(&["study", "s", "-q", "-o", "out/s"], 1);
    assert!(shown.contains("study: vary.c.points: 3 → 4") && !shown.contains("study: model"), "{shown}");
}
