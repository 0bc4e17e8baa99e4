//! The report of a run: one page that is well formed, complete and loads nothing.

use super::page::{assert_self_contained, check, outline};
use crate::shell::{TempFolder, linkwright, sealed};

/// Optimizes an example and writes its report.
fn reported(name: &str, example: &str, code: i32) -> (TempFolder, String) {
    let place = TempFolder::new(name);
    place.example(example);
    place.run(&["optimize", &format!("{example}.toml"), "--quiet", "--out", "run"], code);
    let page = report(&place);
    (place, page)
}

fn report(place: &TempFolder) -> String {
    assert!(place.run(&["report", "run", "--slice", "5", "--page-only"], 0).contains("Wrote run/report.html"));
    let page = place.read("run/report.html");
    check(&page);
    assert_self_contained(&page);
    page
}

#[test]
fn the_page_of_a_mechanism_has_everything() {
    let (_place, page) = reported("report", "impact-absorber", 0);
    insta::assert_snapshot!(outline(&page));
    assert!(page.contains(">converged</span>") && page.contains("<g class=\"springs\"><path"));
    assert!(page.contains("analyses of 5 × 5 designs"));
}

#[test]
fn a_closed_form_without_time_has_no_mechanism_and_no_histories() {
    let (_place, page) = reported("report-static", "cantilever", 0);
    insta::assert_snapshot!(outline(&page));
}

#[test]
fn every_figure_is_a_file_and_the_mechanism_moves_in_one() {
    let place = TempFolder::new("report-figures");
    place.example("impact-absorber");
    place.run(&["optimize", "impact-absorber.toml", "--quiet", "--report", "--out", "run"], 0);
    let mut names: Vec<String> = std::fs::read_dir(place.0.join("run/figures"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name != "files.json")
        .collect();
    names.sort();
    insta::assert_snapshot!(names.join("\n"));
    for name in &names {
        let bytes = std::fs::read(place.0.join("run/figures").join(name)).unwrap();
        let begins = |with: &[u8]| assert!(bytes.starts_with(with), "{name}");
        match name.rsplit_once('.').unwrap().1 {
            "svg" => begins(b"<svg"),
            "png" => begins(b"\x89PNG"),
            _ => begins(b"GIF89a"),
        }
    }
    // Every link of the page leads to a file in its folder.
    let page = place.read("run/report.html");
    let links = page.split("<a href=\"").skip(1).map(|rest| rest.split('"').next().unwrap());
    for link in links.filter(|link| !link.starts_with('#')) {
        assert!(place.0.join("run").join(link).exists(), "{link}");
    }
}

#[test]
fn hostile_names_are_shown_as_they_are() {
    let place = TempFolder::new("report-hostile");
    place.example("impact-absorber");
    let bad = "</title><script>alert(1)</script><img src=x onerror=alert(2)>";
    let model = place
        .read("impact-absorber.toml")
        .replace("title = \"impact absorber, peak acceleration\"", &format!("title = \"{bad}\""))
        .replace(
            "name = \"displacement\"\nvalue = \"displacement\"",
            &format!("name = \"{bad}\"\nvalue = \"displacement\""),
        )
        .replace("unit = \"N/m\"", "unit = \"<b onclick='x'>&amp;\"")
        .replace("to = 12.0", "to = 12.0\nname = \"</script><svg onload=alert(3)>\"");
    assert_eq!(model.matches("alert").count(), 5);
    std::fs::write(place.0.join("bad.toml"), model).unwrap();
    place.run(&["optimize", "bad.toml", "--quiet", "--out", "run"], 0);
    let page = report(&place);
    for element in ["<script>alert", "<img", "<b ", "<svg onload", "</script><svg"] {
        assert!(!page.contains(element), "{element}");
    }
    assert!(page.contains("&lt;script&gt;alert(1)&lt;/script&gt;"));
    // Two scripts of the page and that of the animation; the data of the animation, of the cycles and of each plot.
    assert_eq!(page.matches("<script>").count(), 3);
    let data = page.matches("<script type=\"application/json\">").count();
    assert_eq!((data, page.matches("<script").count()), (2 + page.matches("class=\"plotted\"").count(), 3 + data));
}

#[test]
fn a_run_that_was_stopped_gives_a_report_too() {
    let place = TempFolder::new("report-stopped");
    place.example("impact-absorber");
    let model = place.read("impact-absorber.toml") + "max_cycles = 3\n";
    std::fs::write(place.0.join("short.toml"), model).unwrap();
    place.run(&["optimize", "short.toml", "--quiet", "--out", "run"], 3);
    assert!(report(&place).contains(">cycle limit</span>"));
    // The folder after a kill: the state of an unfinished run, and no results.
    let state = place.read("run/state.json").replace("\"status\":\"CycleLimit\"", "\"status\":\"Running\"");
    assert!(state.contains("Running"));
    std::fs::write(place.0.join("run/state.json"), sealed(&state)).unwrap();
    for name in ["summary.json", "responses.csv", "constraints.csv"] {
        std::fs::remove_file(place.0.join("run").join(name)).unwrap();
    }
    let page = report(&place);
    assert!(page.contains(">unfinished</span>") && page.contains("the 3 trial steps so far"));
    assert!(!page.contains("href=\"summary.json\"") && page.contains("href=\"cycles.csv\""));
    // Killed before the first design was analysed.
    for name in ["state.json", "state-previous.json", "history.jsonl"] {
        std::fs::remove_file(place.0.join("run").join(name)).unwrap();
    }
    let page = report(&place);
    assert!(page.contains("stopped before its first design") && page.contains("Design variables"));
    assert!(place.run(&["report", "nowhere"], 1).contains("there is no folder nowhere"));
}

/// The predictions that a cycle stores give the errors (14) to (16) that it reports.
#[test]
fn predictions_and_errors_agree() {
    let problem = linkwright::cases::impact_absorber::peak_acceleration().unwrap();
    let end = linkwright::sao::Method::slp().solve(&problem, |_| ()).unwrap();
    for cycle in &end.history[1..] {
        let predicted = cycle.prediction.as_ref().unwrap();
        let error = 100.0 * (predicted.objective - cycle.objective).abs() / cycle.objective;
        assert!((error - cycle.objective_error_pct).abs() < 1e-9);
        assert_eq!((predicted.rows.len(), predicted.analysed.len()), (cycle.retained.len(), cycle.retained.len()));
        let pairs = predicted.rows.iter().zip(&predicted.analysed).filter(|(_, g)| **g >= 0.7);
        let error = pairs.map(|(p, g)| 100.0 * (p - g).abs() / g.abs()).fold(0.0, f64::max);
        assert!((error - cycle.constraint_error_pct).abs() < 1e-6 || error <= cycle.constraint_error_pct, "{cycle:?}");
    }
}

/// The drawing of a chain agrees with its outputs.
#[test]
fn drawings_move_as_the_analysis_says() {
    let text =
        std::fs::read_to_string(format!("{}/examples/models/pendulum-chain.toml", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let model = linkwright::model_file::read("pendulum-chain.toml", &text).unwrap();
    let (problem, times) = (model.problem().unwrap(), model.drawing_times().unwrap());
    assert_eq!(times, model.grid().unwrap().points);
    let heights = &problem.analyze(&[2.0]).unwrap().values[0];
    let frames = model.drawings(&[&[2.0]], &times).unwrap().unwrap().remove(0);
    for (frame, height) in frames.iter().zip(heights) {
        assert_eq!((frame.bars.len(), frame.joints.len(), frame.ground_joints.len()), (5, 4, 1));
        let length = |bar: &Vec<[f64; 2]>| (bar[1][0] - bar[0][0]).hypot(bar[1][1] - bar[0][1]);
        assert!(frame.bars.iter().all(|bar| (length(bar) - 0.2).abs() < 1e-9));
        let tip = frame.bars[4][1][1];
        assert!((tip - height).abs() < 1e-7, "{tip} and {height}");
    }
}

/// The colour of a clamped beam is its normal stress: M/W with the moment F·L at the clamp.
#[test]
fn the_stress_of_a_drawn_beam_is_that_of_the_formula() {
    let text = r#"
version = 2
[[beam]]
name = "bar"
from = [0, 0]
to = [1, 0]
elements = 40
diameter = 0.02
young = 2e11
density = 7800
[[joint]]
name = "clamp"
kind = "fixed"
a = "ground"
b = "bar.first"
[[force]]
name = "tip"
kind = "force"
at = "bar.last"
direction = "-90 deg"
force = "10*time"
[time]
to = 1
points = 2
[analysis]
kind = "statics"
[[output]]
name = "deflection"
value = "bar.last.y"
"#;
    let model = linkwright::model_file::read("beam.toml", text).unwrap();
    let drawn = model.drawings(&[&[]], &[0.5, 1.0]).unwrap().unwrap().remove(0);
    let modulus = std::f64::consts::PI * 0.02f64.powi(3) / 32.0;
    let largest = drawn[1].stress;
    assert!((largest / (10.0 / modulus) - 1.0).abs() < 0.02, "{largest} for {}", 10.0 / modulus);
    // The load of the first frame is half of it, and the moment falls linearly to the free end.
    let shares = |frame: usize| drawn[frame].stressed.iter().map(|(_, share)| *share).collect::<Vec<_>>();
    let (half, whole) = (shares(0), shares(1));
    assert_eq!((half.len(), drawn[1].bars.len()), (40, 0));
    assert!((half[0] / whole[0] - 0.5).abs() < 0.01 && (whole[20] / whole[0] - 0.5).abs() < 0.03 && whole[39] < 0.03);
    // True thickness.
    let [a, .., d] = drawn[0].stressed[0].0;
    assert!(((a[0] - d[0]).hypot(a[1] - d[1]) - 0.02).abs() < 1e-9);
}

/// Every element is drawn, and the page of a large run stays below 1 MB.
#[test]
fn elements_are_drawn_where_they_are() {
    let text = r#"
version = 2
[[body]]
name = "wheel"
mass = 1
inertia = 0.01
position = [0, 0]
[[body]]
name = "pinion"
mass = 0.5
inertia = 0.002
position = [0.3, 0]
[[body]]
name = "bar"
mass = 0.5
inertia = 0.002
position = [0.3, -0.1]
[[body]]
name = "ball"
kind = "point"
mass = 0.2
position = [0.7, 0.4]
[[point]]
name = "mark"
body = "wheel"
at = [0.1, 0]
[[joint]]
name = "axle"
a = "ground"
b = "wheel"
[[joint]]
name = "axle2"
a = { body = "ground", at = [0.3, 0] }
b = "pinion"
[[joint]]
name = "mesh"
kind = "gears"
a = "wheel.theta"
b = "pinion.theta"
radius_a = 0.2
radius_b = 0.1
[[joint]]
name = "teeth"
kind = "rack"
a = "bar"
b = "pinion"
radius = 0.1
[[joint]]
name = "slide"
kind = "prismatic"
a = { body = "ground", at = [0.3, -0.1] }
b = "bar"
[[driver]]
name = "motor"
coordinate = "wheel.theta"
motion = "time"
[[force]]
name = "floor"
kind = "wall"
at = "ball"
wall_x = 0.7
wall_y = 0.1
normal = "90 deg"
stiffness = 1e5
[[force]]
name = "line"
kind = "rope"
a = { body = "ground", at = [0.7, 0.9] }
b = "ball"
stiffness = 1000
length = 0.4
[[force]]
name = "absorber"
kind = "spring"
a = { body = "ground", at = [0.2, 0.4] }
b = "ball"
stiffness = 50
damping = 2
length = 0.4
[time]
to = 1
points = 11
[analysis]
kind = "dynamics"
tolerance = 1e-6
[[output]]
name = "tension"
value = "line.tension"
"#;
    let model = linkwright::model_file::read("all.toml", text).unwrap();
    let drawn = model.drawings(&[&[]], &model.drawing_times().unwrap()).unwrap().unwrap().remove(0);
    let frame = &drawn[0];
    // Two gears, rack with its wheel, wall, rope, damper beside its spring.
    assert_eq!((frame.lines.len(), frame.springs.len(), frame.arrows.len()), (7, 1, 1));
    let names: Vec<&str> = frame.notes.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["wheel", "pinion", "bar", "ball", "mark"]);
    // The rack touches the lower side of its wheel.
    let rack = frame.lines.iter().find(|line| line.iter().all(|p| p[1] <= -0.1 + 1e-9) && line.len() > 10).unwrap();
    assert!(rack.iter().any(|p| (p[1] + 0.1).abs() < 1e-9));
    // The pitch circles touch between the axles.
    let touching = frame.lines.iter().filter(|line| line.iter().any(|p| (p[0] - 0.2).hypot(p[1]) < 1e-9)).count();
    assert_eq!(touching, 3);
    let path: Vec<[f64; 2]> = drawn.iter().map(|frame| frame.traced[0]).collect();
    assert!(path.iter().all(|p| (p[0].hypot(p[1]) - 0.1).abs() < 1e-6));
}

/// A driven arm lets a ball go after a quarter of a turn: the ball is drawn where it flies, with its path, and the joint stays on the arm. All
/// frames have the same parts, as the interactive tool needs.
#[test]
fn released_bodies_are_drawn_after_their_release() {
    let ends = "[time]\nto = 1\npoints = 11\n[analysis]\nkind = \"dynamics\"\n[[event]]\nname = \"go\"\nwhen = \"time > 0.5\"\nrelease = \"grip\"\n\
                [[output]]\nname = \"x\"\nvalue = \"ball.x\"\n[[output]]\nname = \"y\"\nvalue = \"ball.y\"\n";
    let plane = "version = 2\n[[body]]\nname = \"arm\"\nmass = 2\ninertia = 0.1\nposition = [0.5, 0]\n\
                 [[body]]\nname = \"ball\"\nmass = 0.1\ninertia = 1e-3\nposition = [1, 0]\n\
                 [[joint]]\nname = \"h\"\na = \"ground\"\nb = { body = \"arm\", at = [-0.5, 0] }\n\
                 [[joint]]\nname = \"grip\"\nkind = \"KIND\"\na = { body = \"arm\", at = [0.5, 0] }\nb = \"ball\"\n\
                 [[driver]]\nname = \"m\"\nkind = \"relative\"\na = \"ground.theta\"\nb = \"arm.theta\"\nmotion = \"pi*time\"\n";
    let space = "version = 2\nspace = 3\n[[body]]\nname = \"arm\"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\nposition = [0.5, 0, 0]\n\
                 [[body]]\nname = \"ball\"\nmass = 0.1\ninertia = [1e-3, 1e-3, 1e-3]\nposition = [1, 0, 0]\n\
                 [[joint]]\nname = \"h\"\na = \"ground\"\nb = \"arm\"\nat = [0, 0, 0]\naxis = [0, 0, 1]\n\
                 [[joint]]\nname = \"grip\"\nkind = \"KIND\"\na = \"arm\"\nb = \"ball\"\nat = [1, 0, 0]\naxis = [0, 0, 1]\n\
                 [[driver]]\nname = \"m\"\ncoordinate = \"h.angle\"\nmotion = \"pi*time\"\n";
    for (text, kind) in [(plane, "revolute"), (plane, "fixed"), (space, "revolute"), (space, "fixed")] {
        let text = text.replace("KIND", kind) + ends;
        let model = linkwright::model_file::read("throw.toml", &text).unwrap();
        let drawn = model.drawings(&[&[]], &[0.0, 0.4, 1.0]).unwrap().unwrap().remove(0);
        for frame in &drawn {
            assert_eq!(frame.masses.len(), 1, "{kind}");
        }
        // From (0, 1) at half a second with (−π, 0) m/s.
        if !text.contains("space = 3") {
            let [x, y] = drawn[2].masses[0];
            assert!((x + 0.5 * std::f64::consts::PI).abs() < 1e-3 && (y - 1.0).abs() < 1e-3, "{x} {y}");
        }
    }
}

/// A fixed node in space is drawn as the ground, as one in the plane: it is no mass.
#[test]
fn a_fixed_node_in_space_is_drawn_as_the_ground() {
    let text = "version = 2\nspace = 3\n[[body]]\nname = \"wall\"\nkind = \"fixed-node\"\nposition = [0, 0, 0]\n\
                [[body]]\nname = \"arm\"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\nposition = [0.5, 0, 0]\n\
                [[joint]]\nname = \"h\"\na = \"wall\"\nb = \"arm\"\nat = [0, 0, 0]\naxis = [0, 0, 1]\n\
                [[driver]]\nname = \"m\"\ncoordinate = \"h.angle\"\nmotion = \"time\"\n\
                [time]\nto = 1\npoints = 2\n[analysis]\nkind = \"kinematics\"\n[[output]]\nname = \"x\"\nvalue = \"arm.x\"\n";
    let model = linkwright::model_file::read("m.toml", text).unwrap();
    let frame = model.drawings(&[&[]], &[0.0, 1.0]).unwrap().unwrap().remove(0).remove(0);
    assert!(!frame.ground_joints.is_empty() && frame.joints.is_empty());
    assert_eq!(frame.masses.len(), 1, "the arm only");
}

/// The largest distance of a polyline's points from a circle.
fn off_circle(line: &[[f64; 2]], [x, y]: [f64; 2], radius: f64) -> f64 {
    line.iter().map(|p| ((p[0] - x).hypot(p[1] - y) - radius).abs()).fold(0.0, f64::max)
}

#[test]
fn profiles_friction_in_joints_and_distributed_loads_are_drawn() {
    let example = |name: &str| {
        let path = format!("{}/examples/models/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        linkwright::model_file::read(name, &std::fs::read_to_string(path).unwrap()).unwrap()
    };
    let drawn = |model: &linkwright::model_file::Model, design: &[f64]| {
        model.drawings(&[design], &model.drawing_times().unwrap()).unwrap().unwrap().remove(0)
    };
    // The profile touches the roller in all frames, both turn about their own places.
    let (base, lift, roller) = (0.04, 0.02, 0.012);
    let frames = drawn(&example("cam-follower"), &[8000.0, 60.0, base]);
    for frame in &frames {
        let [profile, wheel] = &frame.lines[..] else { panic!("{} lines", frame.lines.len()) };
        let centre = wheel[0];
        assert!(off_circle(&wheel[1..], centre, roller) < 1e-12 && centre[0].abs() < 1e-9);
        let reach = profile.iter().map(|p| p[0].hypot(p[1]));
        assert!((reach.clone().fold(0.0, f64::max) - base - lift).abs() < 1e-6);
        assert!((reach.fold(1.0, f64::min) - base).abs() < 1e-6);
        let gap = profile.iter().map(|p| (p[0] - centre[0]).hypot(p[1] - centre[1]) - roller).fold(1.0, f64::min);
        assert!(gap.abs() < 5e-4, "{gap:e}");
    }
    // Two shoes around the crank pin, two hatched surfaces along the guide.
    let frame = &drawn(&example("press"), &[0.06, 0.25, 0.1])[0];
    let [one, other, below, above] = &frame.lines[..] else { panic!("{} lines", frame.lines.len()) };
    let radius = (one[1][0] - 0.06).hypot(one[1][1]);
    for shoe in [one, other] {
        assert!(off_circle(&shoe[1..shoe.len() - 1], [0.06, 0.0], radius) < 1e-12);
    }
    assert!(below.iter().all(|p| p[1] < 0.0) && above.iter().all(|p| p[1] > 0.0));
    // Arrows that end on the beam, from a line above it.
    let beam = "version = 2\n[time]\nto = 1\npoints = 2\n[[beam]]\nname = 'rod'\nkind = 'section'\nfrom = [0, 0]\nto = [1, 0]\n\
                elements = 12\naxial = 1e6\ntransverse = 1e5\nbending = 250\nmass = 1\ninertia = 1e-3\nload_y = '2*time'\n\
                [[joint]]\nname = 'clamp'\nkind = 'fixed'\na = 'ground'\nb = 'rod.first'\n[analysis]\nkind = 'statics'\n\
                [[output]]\nname = 'y'\nvalue = 'rod.last.y'\n";
    let frame = &drawn(&linkwright::model_file::read("beam", beam).unwrap(), &[])[0];
    let tips: Vec<f64> = frame.arrows.iter().map(|arrow| arrow[1][0]).collect();
    assert_eq!(tips.len(), 7);
    assert!(tips.iter().enumerate().all(|(k, x)| (x - k as f64 / 6.0).abs() < 1e-9), "{tips:?}");
    assert!(frame.arrows.iter().all(|arrow| arrow[0][1] < arrow[1][1] && (arrow[0][0] - arrow[1][0]).abs() < 1e-12));
    assert!(frame.lines.iter().any(|line| line.len() == 7 && line[0] == frame.arrows[0][0]));
}

/// A model without a title has the name of its own file everywhere, not that of the copy in the folder of the run.
#[test]
fn a_model_without_a_title_has_the_name_of_its_file() {
    let place = TempFolder::new("untitled");
    let model = "version = 2\n[design.x]\nstart = 3\nlower = 1\nupper = 4\n[[output]]\nname = \"f\"\nvalue = \"x\"\n[objective]\nminimize = \"f\"\n";
    std::fs::write(place.0.join("bar.toml"), model).unwrap();
    drop(linkwright(&["optimize", "bar.toml", "--quiet", "--max-cycles", "1"], &place.0));
    for command in
        [&["report", "bar"][..], &["resume", "bar", "--quiet"], &["resume", "bar", "--quiet", "--max-cycles", "9"]]
    {
        drop(linkwright(command, &place.0));
        place.run(&["report", "bar", "--quiet"], 0);
        let page = place.read("out/bar/report.html");
        assert!(page.contains("<title>bar.toml") && !page.contains("bar/model.toml</"), "{}", &page[..400]);
        let summary: serde_json::Value = serde_json::from_str(&place.read("out/bar/summary.json")).unwrap();
        assert_eq!(summary["title"], "bar.toml", "{command:?}");
    }
}
