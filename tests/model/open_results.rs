//! `linkwright open`: races of two methods, stored runs and studies, completion.

use crate::browser::browser;
use crate::devtools::Page;
use crate::open::{SETTLED, Server, draw_limit, rests, start_design, wait};
use crate::shell::{TempFolder, linkwright};
use serde_json::{Value, json};

const STUDY: &str = "version = 1\nmodel = \"absorber.toml\"\nkind = \"sample\"\ncount = 24\n\
    [vary.k]\nfrom = 0.2\nto = 0.9\n[vary.c]\nfrom = 0.2\nto = 0.9\n";

/// A folder with the impact absorber under a short name.
fn absorber(name: &str) -> TempFolder {
    let place = TempFolder::new(name);
    place.example("impact-absorber");
    std::fs::rename(place.0.join("impact-absorber.toml"), place.0.join("absorber.toml")).unwrap();
    place
}

/// A rival has the start and the settings of the run, a method and a folder of its own, and ends as the command does with this method.
#[test]
fn two_methods_race_on_the_same_problem() {
    let place = absorber("open-race");
    let server = Server::start(&place.0, "absorber.toml");
    let act = |route: &str, action: Value| assert_eq!(server.post(route, &action).0, 200);
    let early = server.post("race", &json!({ "method": "gcmma" })).1;
    assert!(early["error"].as_str().unwrap().contains("begin a run first"), "{early}");
    act("run", json!({ "action": "start", "design": start_design(&server.get("model")) }));
    rests(&server, "Paused", |tries| tries == 0);
    // An edit of the run holds for its rival, too.
    act("run", json!({ "action": "set", "key": "design.c.upper", "value": "0.8" }));
    wait(&server, "run", "edited", |value| value["run"]["edits"].to_string().contains("design.c.upper"));
    act("race", json!({ "method": "gcmma" }));
    let begun = wait(&server, "run", "a rival", |value| value["rival"]["cycles"].is_array());
    assert_eq!((&begun["rival"]["method"], &begun["rival"]["status"]), (&json!("gcmma"), &json!("Paused")));
    assert_eq!(begun["rival"]["cycles"][0]["design"], begun["run"]["cycles"][0]["design"]);
    assert_ne!(begun["rival"]["folder"], begun["run"]["folder"]);
    act("run", json!({ "action": "run" }));
    act("rival", json!({ "action": "run" }));
    let is_done = |one: &Value| one["status"] == "Converged";
    let end = wait(&server, "run", "both have ended", |value| is_done(&value["run"]) && is_done(&value["rival"]));
    let last = |one: &Value| one["cycles"].as_array().unwrap().last().unwrap()["objective"].as_f64().unwrap();
    let (run, rival) = (last(&end["run"]), last(&end["rival"]));
    assert!((run - rival).abs() < 1e-2 * run, "{run} and {rival}");
    let text = place.read("out/absorber-2/model.toml");
    assert!(text.contains("gcmma") && text.contains("0.8"), "{text}");
    // A method that does not exist is refused with a reason; the run stays.
    act("race", json!({ "method": "gcma" }));
    let failed = wait(&server, "run", "refused", |value| value["rival"]["status"] == "Failed");
    assert!(failed["rival"]["fault"].as_str().unwrap().contains("gcmma"), "{failed}");
    assert_eq!(failed["run"]["status"], "Converged");
    act("rival", json!({ "action": "close" }));
    wait(&server, "run", "closed", |value| value["rival"] == Value::Null);
    // A new run has no rival with another start.
    act("race", json!({ "method": "mma" }));
    wait(&server, "run", "another rival", |value| value["rival"]["cycles"].is_array());
    act("run", json!({ "action": "start", "design": [0.5, 0.5] }));
    let next = rests(&server, "Paused", |tries| tries == 0);
    assert_eq!((&next["design"], &server.get("run")["rival"]), (&json!([0.5, 0.5]), &Value::Null));
}

/// Proposals of the automatic method are refused and accepted by hand, too; the run that was steered goes on with `resume`.
#[test]
fn proposals_of_the_automatic_method_are_decided_by_hand() {
    let place = absorber("open-by-hand");
    let text = place.read("absorber.toml");
    let text = text.lines().filter(|line| !line.starts_with("preset")).collect::<Vec<_>>().join("\n");
    std::fs::write(place.0.join("absorber.toml"), text).unwrap();
    let server = Server::start(&place.0, "absorber.toml");
    let act = |action: &str| assert_eq!(server.post("run", &json!({ "action": action })).0, 200);
    let design = start_design(&server.get("model"));
    server.post("run", &json!({ "action": "start", "design": design }));
    rests(&server, "Paused", |tries| tries == 0);
    act("step");
    let one = rests(&server, "Paused", |tries| tries == 1);
    assert_eq!(one["method"], Value::Null, "{one}");
    let accepted = one["cycles"][1]["accepted"] == true;
    assert!(accepted, "{one}");
    act("refuse");
    let refused = wait(&server, "run", "refused", |value| value["run"]["cycles"][1]["accepted"] == false);
    assert_eq!((&refused["run"]["design"], &refused["run"]["fault"]), (&json!(design), &Value::Null));
    act("accept");
    let again = wait(&server, "run", "accepted", |value| value["run"]["cycles"][1]["accepted"] == true);
    assert_eq!(again["run"]["design"], one["design"]);
    act("step");
    rests(&server, "Paused", |tries| tries == 2);
    drop(server);
    let end = place.run(&["resume", "absorber"], 0);
    assert!(end.contains("Converged"), "{end}");
}

/// Cycles, designs, differences and notes of stored runs, rows of studies with their designs; other folders are unknown.
#[test]
fn stored_runs_and_studies_are_listed_and_opened() {
    let place = absorber("open-stored");
    place.run(&["optimize", "absorber", "--quiet"], 0);
    place.run(&["optimize", "absorber", "--quiet", "--method", "gcmma"], 0);
    std::fs::write(place.0.join("points.toml"), STUDY).unwrap();
    place.run(&["study", "points", "--quiet"], 0);
    // A run of another model is not listed.
    place.example("two-bar-truss");
    place.run(&["optimize", "two-bar-truss", "--quiet"], 0);
    let server = Server::start(&place.0, "absorber.toml");
    let post = |route: &str, body: Value| {
        let (status, answer) = server.post(route, &body);
        assert_eq!(status, 200, "{route} {body}");
        answer
    };
    let all = server.get("stored");
    assert_eq!(all["others"], 1);
    let names = |key: &str| -> Vec<&str> {
        all[key].as_array().unwrap().iter().map(|one| one["folder"].as_str().unwrap()).collect()
    };
    assert_eq!(names("stored"), ["out/absorber-2", "out/absorber"]);
    assert_eq!(names("studies"), ["out/points"]);

    let run = post("stored-run", json!({ "folder": "out/absorber" }));
    let summary: Value = serde_json::from_str(&place.read("out/absorber/summary.json")).unwrap();
    assert_eq!(run["cycles"].as_array().unwrap().len() as u64 - 1, summary["tries"].as_u64().unwrap());
    let design: Vec<&Value> = summary["design"].as_array().unwrap().iter().map(|one| &one["value"]).collect();
    assert_eq!(run["design"].as_array().unwrap().iter().collect::<Vec<_>>(), design[..2]);

    let differences = post("differences", json!({ "folders": ["out/absorber", "out/absorber-2"] }));
    assert!(differences["settings"].to_string().contains("gcmma"), "{differences}");
    let of = |name: &str| differences["quantities"].as_array().unwrap().iter().find(|q| q["name"] == name).unwrap();
    assert_eq!(of("objective")["values"][0], summary["objective"]["value"]);

    // A note is a file of the run, which the command lists, and which an empty text removes.
    assert_eq!(post("note", json!({ "folder": "out/absorber", "text": " the good one\n" })), json!({}));
    assert_eq!(place.read("out/absorber/note.txt"), "the good one");
    assert_eq!(server.get("stored")["stored"][1]["note"], "the good one");
    assert!(place.run(&["runs"], 0).contains("the good one"));
    assert!(place.run(&["runs", "--json"], 0).contains("\"note\":\"the good one\""));
    post("note", json!({ "folder": "out/absorber", "text": "" }));
    assert!(!place.0.join("out/absorber/note.txt").exists());
    let long = post("note", json!({ "folder": "out/absorber", "text": "x".repeat(70_000) }));
    assert!(long["error"].as_str().unwrap().contains("bytes"), "{long}");

    let study = post("study", json!({ "folder": "out/points" }));
    let phase = &study["phases"][0];
    assert_eq!(phase["rows"].as_array().unwrap().len(), 24);
    let [k, c] = [0, 1].map(|i| phase["design"][i].as_u64().unwrap() as usize);
    assert_eq!((&phase["columns"][k]["name"], &phase["columns"][c]["name"]), (&json!("k"), &json!("c")));
    assert_eq!(study["others"], json!([]));
    // The design of a row alone does not have its results if the study changes other numbers, too.
    std::fs::write(place.0.join("coarse.toml"), STUDY.replacen("[vary", "set = { \"time.points\" = 51 }\n[vary", 1))
        .unwrap();
    place.run(&["study", "coarse", "--quiet"], 0);
    assert_eq!(post("study", json!({ "folder": "out/coarse" }))["others"], json!(["time.points"]));

    for folder in ["../secret", "/etc", "out", "out/two-bar-truss/..", "points.toml", ""] {
        for route in ["stored-run", "study", "note"] {
            let body =
                if route == "note" { json!({ "folder": folder, "text": "x" }) } else { json!({ "folder": folder }) };
            assert!(post(route, body)["error"].is_string(), "{route} {folder}");
        }
    }
    assert!(post("study", json!({ "folder": "out/absorber" }))["error"].is_string());
    assert!(post("stored-run", json!({ "folder": "out/points" }))["error"].is_string());
    assert!(post("differences", json!({ "folders": ["out/absorber", "out/points"] }))["error"].is_string());
    assert_eq!(server.post("differences", &json!({ "folders": ["out/absorber"] })).0, 400);

    // Words at a place, counted in UTF-16 units.
    let text = "title = \"ä😀\"\n[[bo";
    let found = post("complete", json!({ "text": text, "at": text.encode_utf16().count() }));
    assert_eq!(found["from"], text.encode_utf16().count() - 4);
    assert!(found["words"].to_string().contains("[[body]]"), "{found}");
    assert_eq!(post("complete", json!({ "text": "", "at": 1_000_000 }))["words"][0]["text"], "version = ");
}

/// A run with another limit, such as one that was drawn and discarded, is listed with it; a run of another mass is not.
#[test]
fn runs_with_other_limits_are_listed_with_them() {
    let place = absorber("open-other-limits");
    let text = place.read("absorber.toml");
    let drawn = "\n[[constraint]]\nname = \"drawn limit 1\"\nvalue = \"displacement - drawn_1(time)\"\nat_most = 0.0\nfrom = 0.0\nto = 6.0\n\n\
        [table.drawn_1]\nx = [0.0, 3.0, 6.0]\ny = [2.0, 3.0, 2.0]\ninterpolation = \"linear\"\n";
    let edits = [
        ("same", text.clone()),
        ("tight", text.replace("at_most = 1.0", "at_most = 0.9")),
        ("drawn", format!("{text}{drawn}")),
        ("heavy", text.replace("mass = 1.0", "mass = 1.1")),
    ];
    for (name, edited) in &edits {
        std::fs::write(place.0.join(format!("{name}.toml")), edited).unwrap();
        linkwright(&["optimize", name, "--quiet", "--max-cycles", "1"], &place.0);
    }
    let server = Server::start(&place.0, "absorber.toml");
    let listed = |server: &Server| {
        let all = server.get("stored");
        let of = |name: &str| {
            let found = all["stored"].as_array().unwrap().iter().find(|one| one["folder"] == format!("out/{name}"));
            found.map(|one| one["limits"].as_array().unwrap().iter().map(|l| l.as_str().unwrap().to_owned()).collect())
        };
        (all["others"].clone(), ["same", "tight", "drawn", "heavy"].map(of))
    };
    let (others, [same, tight, with_drawn, heavy]): (Value, [Option<Vec<String>>; 4]) = listed(&server);
    assert_eq!((others, same, heavy), (json!(1), Some(vec![]), None));
    assert_eq!(tight.unwrap(), ["constraint.displacement.at_most: 1.0 → 0.9"]);
    let with_drawn = with_drawn.unwrap();
    assert!(with_drawn[0].starts_with("with constraint.drawn limit 1: at_most = 0.0, from = 0.0"), "{with_drawn:?}");
    assert!(with_drawn[1].starts_with("with table.drawn_1: interpolation = \"linear\", x = ["), "{with_drawn:?}");
    drop(server);
    // The other way round: the limit is in the model, and not in the run.
    std::fs::write(place.0.join("absorber.toml"), &edits[2].1).unwrap();
    let server = Server::start(&place.0, "absorber.toml");
    let (_, [same, _, with_drawn, _]) = listed(&server);
    assert_eq!(with_drawn, Some(vec![]));
    assert!(same.unwrap()[0].starts_with("without constraint.drawn limit 1: at_most = 0.0"));

    drop(server);

    // In the page: a run with a limit that is drawn and then discarded.
    std::fs::write(place.0.join("absorber.toml"), &text).unwrap();
    let Some(program) = browser() else { return };
    let server = Server::start(&place.0, "absorber.toml");
    let mut page = Page::open(&program, &place.0, [1400, 1200]);
    page.show(&server.address());
    page.wait(SETTLED);
    draw_limit(&mut page);
    page.wait(SETTLED);
    page.click("[data-action=start]");
    page.wait("document.getElementById('run').dataset.status === 'Paused'");
    page.click("#stored-runs summary");
    page.wait("document.querySelectorAll('#stored tbody tr').length === 4");
    let row = "[...document.querySelectorAll('#stored tbody tr')].find((row) => row.children[1].textContent.startsWith('out/absorber'))";
    assert_eq!(page.text(&format!("{row}.querySelector('.limits')")), "null");
    page.click("#discard");
    page.wait(&format!("{row}.querySelector('.limits').textContent.includes('with constraint.drawn limit 1')"));
    page.views("limits-of-runs", "#stored-runs");
}

/// In the browser: a race, the overlay and the differences of stored runs, a note, a study whose points show their designs, completion.
#[test]
fn the_page_races_compares_and_completes() {
    let Some(program) = browser() else { return };
    let place = absorber("open-compare");
    place.run(&["optimize", "absorber", "--quiet"], 0);
    place.run(&["optimize", "absorber", "--quiet", "--method", "gcmma"], 0);
    std::fs::write(place.0.join("points.toml"), STUDY).unwrap();
    place.run(&["study", "points", "--quiet"], 0);
    let server = Server::start(&place.0, "absorber.toml");
    let mut page = Page::open(&program, &place.0, [1400, 1200]);
    page.show(&server.address());
    page.wait(SETTLED);
    let designs = "[...document.querySelectorAll('#sliders input[type=range]')].map((e) => Number(e.value))";
    let design = |page: &mut Page| -> Vec<f64> { serde_json::from_value(page.value(designs)).unwrap() };

    // A race to the end of both.
    page.click("[data-action=start]");
    page.wait("document.getElementById('run').dataset.status === 'Paused'");
    page.value("(() => { document.getElementById('rival-method').value = 'mma'; return 0; })()");
    page.click("#rival-begin");
    page.wait("document.getElementById('race').dataset.status === 'Paused'");
    page.click("[data-action=run]");
    page.wait("['run', 'race'].every((id) => ['Converged', 'CycleLimit', 'Stalled'].includes(document.getElementById(id).dataset.status))");
    assert_eq!(page.value("document.querySelectorAll('#rivals tbody tr').length"), 2);
    page.wait("document.querySelectorAll('#convergence g.series').length === 2");

    // Two stored runs in the plot, and their differences.
    page.click("#stored-runs summary");
    page.wait("document.getElementById('stored-runs').dataset.listed === '4 1'");
    let row = |name: &str| {
        format!(
            "[...document.querySelectorAll('#stored tbody tr')].find((row) => row.children[1].textContent === '{name}')"
        )
    };
    for name in ["out/absorber", "out/absorber-2"] {
        page.value(&format!("(() => {{ {}.querySelector('input[type=checkbox]').click(); return 0; }})()", row(name)));
        page.wait(&format!(
            "[...document.querySelectorAll('#convergence li')].some((e) => e.textContent.startsWith('{name} '))"
        ));
    }
    page.wait("document.querySelector('#differences table')");
    assert!(page.text("document.getElementById('differences').textContent").contains("gcmma"));
    page.value(&format!("(() => {{ const e = {}.querySelector('input[type=text]'); e.value = 'first try'; e.dispatchEvent(new Event('change')); return 0; }})()", row("out/absorber")));
    for _ in 0..500 {
        if place.0.join("out/absorber/note.txt").exists() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    assert_eq!(place.read("out/absorber/note.txt"), "first try");
    page.value(&format!(
        "(() => {{ {}.querySelectorAll('.acts button')[2].click(); return 0; }})()",
        row("out/absorber-2")
    ));
    page.wait("document.querySelector('#pins tbody th')?.textContent.includes('out/absorber-2')");

    // A point of the study shows its design.
    page.click("#studies tbody button");
    page.wait("document.querySelectorAll('#study .rows circle').length === 24");
    let before = design(&mut page);
    page.click("#study .rows circle");
    page.wait("document.getElementById('study').dataset.row !== undefined");
    let run: usize = page.text("document.getElementById('study').dataset.row").parse().unwrap();
    let rows = server.post("study", &json!({ "folder": "out/points" })).1;
    let values = &rows["phases"][0]["rows"][run]["values"];
    let now = design(&mut page);
    assert_ne!(now, before);
    assert!((now[0] - values[0].as_f64().unwrap()).abs() < 1e-12, "{now:?} and {values}");
    page.wait(SETTLED);
    page.value("(() => { const s = document.querySelector('#study svg'); s.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowRight' })); return 0; })()");
    page.wait(&format!("document.getElementById('study').dataset.row !== '{run}'"));
    page.views("race", "#race");
    page.views("stored", "#stored-runs");
    page.views("study", "#study");

    // Words in the editor, chosen with the keyboard.
    page.middle("#text");
    page.value("(() => { const e = document.getElementById('text'); e.value += '\\n[[cons'; e.focus(); e.setSelectionRange(e.value.length, e.value.length); e.scrollTop = 1e6; return 0; })()");
    page.wait("document.activeElement.id === 'text'");
    // The list is closed by a scroll, whose event comes with the next frame.
    page.value("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(0))))");
    let key = |kind: &str, name: &str| {
        format!(
            "(() => {{ document.getElementById('text').dispatchEvent(new KeyboardEvent('keydown', {{ key: '{name}', ctrlKey: {}, cancelable: true }})); return 0; }})()",
            kind == "ctrl"
        )
    };
    page.value(&key("ctrl", " "));
    page.wait("!document.getElementById('words').hidden");
    assert!(page.text("document.querySelector('#words li b').textContent").starts_with("[[constraint]]"));
    // The last line is at the lower edge of the editor: the list is above it.
    let is_inside = "(() => { const [a, b] = ['#words', '.editor'].map((e) => document.querySelector(e).getBoundingClientRect()); return a.top >= b.top && a.bottom <= b.bottom; })()";
    assert_eq!(page.value(is_inside), true);
    page.views("words", ".editor");
    page.value(&key("", "Enter"));
    page.wait("document.getElementById('text').value.endsWith('[[constraint]]')");
    page.wait("document.getElementById('words').hidden");
    assert_eq!(page.text("document.documentElement.dataset.state"), "ready");
}

/// The numbers of the tour, by its steps.
#[test]
fn the_tour_leads_to_the_optimum_that_it_names() {
    let Some(program) = browser() else { return };
    let tour = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/tour.md")).unwrap();
    let place = TempFolder::new("open-tour");
    place.example("shaper");
    let server = Server::start(&place.0, "shaper.toml");
    let mut page = Page::open(&program, &place.0, [1400, 1200]);
    page.show(&server.address());
    page.wait(SETTLED);
    let objective = |page: &mut Page| page.text("document.getElementById('objective-value').textContent");
    let named = |shown: &str| assert!(tour.contains(shown), "the tour does not name {shown}");
    named(&objective(&mut page));
    assert_eq!(page.value("document.querySelectorAll('.margin .pill.bad').length"), 2);

    // 2: a number is typed, the design pinned.
    page.value("(() => { const e = document.getElementById('value-0'); e.value = '0.13'; e.dispatchEvent(new Event('change')); return 0; })()");
    page.wait(&format!("{SETTLED} && document.getElementById('objective-value').textContent.startsWith('319')"));
    named(&objective(&mut page));
    assert_eq!(page.value("document.querySelectorAll('.margin .pill.bad').length"), 0);
    page.click("#pin");
    assert_eq!(page.value("document.querySelectorAll('#pins tbody tr').length"), 1);

    // 3: a step is refused, accepted, and the run goes on to its end.
    let status = |wanted: &str| format!("document.getElementById('run').dataset.status === '{wanted}'");
    let tries = |count: usize| format!("document.getElementById('run').dataset.tries === '{count}'");
    let edits = |count: usize| format!("document.querySelectorAll('#edits li').length === {count}");
    page.click("[data-action=start]");
    page.wait(&status("Paused"));
    page.click("[data-action=step]");
    page.wait(&tries(1));
    page.click("[data-action=refuse]");
    page.wait(&edits(1));
    page.click("[data-action=accept]");
    page.wait(&edits(2));
    page.click("[data-action=run]");
    page.wait(&status("Converged"));
    page.wait(&format!("{SETTLED} && document.getElementById('objective-value').textContent.startsWith('285')"));
    named(&objective(&mut page));

    // 4: the bound excludes the design; from the start it does not.
    let set = |page: &mut Page| {
        page.value("(() => { const f = document.getElementById('setting'); f.elements.key.value = 'design.link.upper'; f.elements.value.value = '0.3'; f.requestSubmit(); return 0; })()");
    };
    set(&mut page);
    page.wait("document.getElementById('run-fault').textContent.includes('exclude')");
    while page.value("Number(document.getElementById('run').dataset.tries)").as_u64().unwrap() > 0 {
        let before = page.text("document.getElementById('run').dataset.tries");
        page.click("[data-action=back]");
        page.wait(&format!("document.getElementById('run').dataset.tries !== '{before}'"));
    }
    set(&mut page);
    page.wait("document.getElementById('edits').textContent.includes('design.link.upper')");

    // 5: the rival has the bound, too.
    page.value("(() => { document.getElementById('rival-method').value = 'mma'; return 0; })()");
    page.click("#rival-begin");
    page.wait("document.getElementById('race').dataset.status === 'Paused'");
    page.click("[data-action=run]");
    page.wait("['run', 'race'].every((id) => document.getElementById(id).dataset.status === 'Converged')");
    let ends = "[...document.querySelectorAll('#rivals tbody tr')].map((row) => row.children[5].textContent)";
    let ends: Vec<String> = serde_json::from_value(page.value(ends)).unwrap();
    assert_eq!(ends[0], ends[1]);
    named(&format!("{} N·m", ends[0]));
    assert_eq!(page.text("document.documentElement.dataset.state"), "ready");
}

/// Frames in a second while a slider is dragged, and the time from a drag to its analysis, for the example models. The figures
/// depend on the machine and its load, so they are printed only:
/// `cargo test --release --test model frames_and_answers -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement"]
fn frames_and_answers_while_a_slider_is_dragged() {
    let Some(program) = browser() else { return };
    const DRAG: &str = "(async () => {
        const root = document.documentElement.dataset;
        const slider = document.querySelector('#sliders input[type=range]');
        const [low, high] = [Number(slider.min), Number(slider.max)];
        const middle = Number(slider.value);
        const put = (k) => { slider.value = middle + 0.02 * (high - low) * Math.sin(k / 10); slider.dispatchEvent(new Event('input')); };
        let [frames, longest, last, begin] = [0, 0, null, null];
        await new Promise((done) => {
            const step = (now) => {
                begin ??= now;
                if (last !== null) longest = Math.max(longest, now - last);
                last = now;
                frames += 1;
                put(frames);
                if (now - begin < 3000) requestAnimationFrame(step); else done();
            };
            requestAnimationFrame(step);
        });
        const rate = (1000 * (frames - 1)) / (last - begin);
        const times = [];
        for (let k = 0; k < 20; k++) {
            await new Promise((done) => setTimeout(done, 400));
            const [before, since] = [root.answered, performance.now()];
            put(frames + 7 * k);
            await new Promise((done) => { const look = () => (root.answered !== before ? done() : setTimeout(look, 1)); look(); });
            times.push(performance.now() - since);
        }
        times.sort((a, b) => a - b);
        return [rate, longest, times[10], times[18]];
    })()";
    println!("model                   frames/s  longest frame ms  answer ms (median)  (95 %)");
    for name in ["impact-absorber", "slider-crank", "shaper", "four-bar", "two-link-arm", "trebuchet", "walking-leg"] {
        let place = TempFolder::new("open-speed");
        place.example(name);
        let server = Server::start(&place.0, &format!("{name}.toml"));
        let mut page = Page::open(&program, &place.0, [1400, 1000]);
        page.show(&server.address());
        page.wait(SETTLED);
        let [rate, longest, median, most]: [f64; 4] = serde_json::from_value(page.value(DRAG)).unwrap();
        println!("{name:<24}{rate:>8.0}{longest:>18.0}{median:>20.1}{most:>8.1}");
    }
}

/// A run that begins at another design writes its start in the unit of the file.
#[test]
fn a_run_begins_at_a_design_with_units() {
    let place = TempFolder::new("open-units");
    let model = "version = 2\n[constants]\nl0 = \"4 m\"\n[design.x]\nstart = \"300 mm\"\nlower = \"100 mm\"\nupper = \"900 mm\"\n[design.y]\nstart = \"l0\"\nlower = \"50 cm\"\n\
        [[output]]\nname = \"f\"\nvalue = \"x + y\"\n[objective]\nminimize = \"f\"\n";
    std::fs::write(place.0.join("bar.toml"), model).unwrap();
    let server = Server::start(&place.0, "bar.toml");
    assert_eq!(start_design(&server.get("model")), [300.0, 400.0]);
    assert_eq!(server.post("run", &json!({ "action": "start", "design": [250.5, 120] })).0, 200);
    rests(&server, "Paused", |tries| tries == 0);
    let text = place.read("out/bar/model.toml");
    assert!(text.contains("start = \"250.5 mm\"") && text.contains("start = \"120 cm\""), "{text}");
}
