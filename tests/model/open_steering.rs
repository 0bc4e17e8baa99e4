//! `linkwright open`: sliders, runs that are steered, and edits of the model file, in a real browser.

use crate::browser::browser;
use crate::devtools::Page;
use crate::open::{SETTLED, Server, analyzed, draw_limit, rests, served, shown, start_design, wait};
use crate::shell::TempFolder;
use serde_json::{Value, json};

/// Drags a slider: the margin changes, first the approximation, then the analysis; both agree for a small step.
#[test]
fn a_slider_moves_the_mechanism_and_its_margins() {
    let Some((place, _server, mut page)) = shown("open-play", "shaper", [1400, 1000]) else { return };
    assert_eq!(page.text("document.documentElement.dataset.state"), "ready");
    let margins = "[...document.querySelectorAll('.margin')].map((e) => Number(e.dataset.margin))";
    let read = |page: &mut Page| -> Vec<f64> { serde_json::from_value(page.value(margins)).unwrap() };
    let before = read(&mut page);
    assert!(!before.is_empty());
    let height = page.value("document.documentElement.scrollHeight");

    // The mechanism moves by itself, and the keyboard steps it.
    let frame = page.text("document.querySelector('#stage svg').dataset.frame");
    page.wait(&format!("document.querySelector('#stage svg').dataset.frame != {frame:?}"));

    // While the slider is dragged, the approximation is marked as one.
    let sliders = page.value("document.querySelectorAll('#sliders input[type=range]').length").as_u64().unwrap();
    assert!(sliders > 1);
    let from = page.middle("#sliders input[type=range]");
    page.value("(() => { const e = document.querySelector('#sliders input[type=range]'); const b = e.getBoundingClientRect(); \
        const part = (e.value - e.min) / (e.max - e.min); window.thumb = b.left + 8 + part * (b.width - 16); return 0; })()");
    let thumb = [page.value("window.thumb").as_f64().unwrap(), from[1]];
    let value = "Number(document.querySelector('#sliders input[type=range]').value)";
    let old = page.value(value).as_f64().unwrap();
    page.mouse("mousePressed", thumb);
    page.mouse("mouseMoved", [thumb[0] + 12.0, thumb[1]]);
    page.wait("document.querySelector('.margin[data-predicted]')");
    assert!(page.text("document.getElementById('legend').textContent").contains("approximation"));
    assert!(page.text("document.querySelector('.margin[data-predicted] output').textContent").contains('≈'));
    assert_eq!(page.value("document.documentElement.scrollHeight"), height);
    page.mouse("mouseReleased", [thumb[0] + 12.0, thumb[1]]);
    let moved = page.value(value).as_f64().unwrap();
    assert_ne!(moved, old);
    page.wait(&format!("{SETTLED} && Number(document.documentElement.dataset.answered) > 1"));
    page.wait("!document.querySelector('.margin[data-predicted]')");
    let after = read(&mut page);
    assert!(before.iter().zip(&after).any(|(a, b)| a != b), "{before:?} and {after:?}");
    // The margins are those that the command computes.
    let name = page.text("document.querySelector('#sliders input[type=range]').dataset.variable");
    let at: f64 = page.value("Number(document.querySelector('#sliders input[type=number]').value)").as_f64().unwrap();
    let printed = analyzed(&place, &["shaper", "--at", &format!("{name}={at}")]);
    for (k, margin) in after.iter().enumerate() {
        let exact = printed["constraints"][k]["margin"].as_f64().unwrap();
        assert!((margin - exact).abs() <= 1e-5 * exact.abs().max(1e-3), "{margin} and {exact}");
    }

    // What the variable moves, with the keyboard; a pinned design stays in the table.
    page.value("document.querySelector('#sliders input[type=range]').focus()");
    page.wait(
        "document.querySelector('.margin .track u:not([hidden])') && document.querySelector('#stage .arrows path')",
    );
    assert_eq!(page.value("document.documentElement.scrollHeight"), height);
    page.click("#pin");
    assert_eq!(page.value("document.querySelectorAll('#pins tbody tr').length"), 1);
    page.click("#reset");
    page.wait(&format!("{value} === {old}"));
    page.wait(SETTLED);
    assert_eq!(page.text("document.documentElement.dataset.state"), "ready");

    // A file with an error, and the design on the sliders stays.
    let text = place.read("shaper.toml");
    std::fs::write(place.0.join("shaper.toml"), text.replacen("[design]", "[desing]", 1)).unwrap();
    page.wait("!document.getElementById('fault').hidden");
    assert!(page.text("document.getElementById('fault').textContent").contains("shaper.toml:"));
    std::fs::write(place.0.join("shaper.toml"), &text).unwrap();
    page.wait("document.getElementById('fault').hidden");

    // After an edit of the model, the pinned design is analysed anew.
    let pinned = "[...document.querySelectorAll('#pins tbody td.number')].map((e) => e.textContent).join(' ')";
    let old = page.text(pinned);
    std::fs::write(place.0.join("shaper.toml"), text.replacen("at_least = 0.4\n", "at_least = 0.5\n", 1)).unwrap();
    page.wait(&format!("{pinned} !== {old:?} && !{pinned}.includes('–')"));
    assert_eq!(page.text(pinned).split(' ').next(), old.split(' ').next());
    std::fs::write(place.0.join("shaper.toml"), &text).unwrap();
    page.wait(&format!("{pinned} === {old:?}"));
    page.wait(SETTLED);

    page.value("document.querySelector('#sliders input[type=range]').focus()");
    page.views("play", "body");
}

/// The run of a page is that of the command, step by step; it can be steered, is stored, and goes on after a kill.
#[test]
fn a_run_is_steered_and_goes_on_after_a_kill() {
    let place = TempFolder::new("open-run");
    place.example("impact-absorber");
    place.run(&["optimize", "impact-absorber", "--quiet", "--out", "whole"], 0);
    std::fs::write(place.0.join("absorber.toml"), place.read("impact-absorber.toml")).unwrap();
    let server = Server::start(&place.0, "absorber.toml");
    let design = start_design(&server.get("model"));
    server.act(&json!({ "action": "start", "design": design }));
    let run = rests(&server, "Paused", |tries| tries == 0);
    assert_eq!(run["fault"], Value::Null, "{run}");
    server.act(&json!({ "action": "step" }));
    let one = rests(&server, "Paused", |tries| tries == 1);
    assert!(one["region"]["lower"].is_array() && !one["rows"].as_array().unwrap().is_empty());

    // Taken back and done again, the step is the same.
    server.act(&json!({ "action": "back" }));
    rests(&server, "Paused", |tries| tries == 0);
    server.act(&json!({ "action": "step" }));
    let again = rests(&server, "Paused", |tries| tries == 1);
    assert_eq!(one["cycles"], again["cycles"]);

    // A refused proposal leaves the design and halves the move limits; an accepted one is the design.
    server.act(&json!({ "action": "refuse" }));
    let refused =
        wait(&server, "run", "refused", |value| value["run"]["cycles"][1]["accepted"] == false)["run"].clone();
    assert_eq!(refused["design"], json!(design));
    let half = |key: usize| 0.5 * run["factors"][key].as_f64().unwrap();
    assert_eq!(refused["factors"], json!([half(0), half(1)]));
    server.act(&json!({ "action": "accept" }));
    let accepted =
        wait(&server, "run", "accepted", |value| value["run"]["cycles"][1]["accepted"] == true)["run"].clone();
    assert_eq!(accepted["design"], one["design"]);

    // A bound is changed in mid-run; a key of the problem, and a bound that excludes the design, are refused.
    server.act(&json!({ "action": "set", "key": "analysis.tolerance", "value": "1e-9" }));
    let fault = wait(&server, "run", "refused key", |value| value["run"]["fault"].is_string());
    assert!(fault["run"]["fault"].as_str().unwrap().contains("only bounds, limits and the method"));
    // That the file states another problem is told; start values, bounds and the method are those of the run.
    let text = place.read("absorber.toml");
    let write = |text: &str| std::fs::write(place.0.join("absorber.toml"), text).unwrap();
    write(&text.replace("at_most = 1.0", "at_most = 0.9").replacen("start = 1.0", "start = 0.9", 1));
    let differing = wait(&server, "run", "another problem", |value| value["differing"] != json!([]));
    assert_eq!(differing["differing"].as_array().unwrap().len(), 1, "{differing}");
    assert!(differing["differing"][0].as_str().unwrap().contains("at_most"), "{differing}");
    write(&text);
    wait(&server, "run", "the problem of the run", |value| value["differing"] == json!([]));
    server.act(&json!({ "action": "set", "key": "design.k.upper", "value": "1e-5" }));
    let fault = wait(&server, "run", "refused bound", |value| {
        value["run"]["fault"].as_str().is_some_and(|f| !f.contains("only bounds"))
    });
    assert_eq!(fault["run"]["status"], "Paused", "{fault}");
    server.act(&json!({ "action": "set", "key": "design.c.upper", "value": "0.9" }));
    let edits = |value: &Value| value["run"]["edits"].to_string();
    let edited = wait(&server, "run", "edited bound", |value| edits(value).contains("design.c.upper"));
    assert!(
        ["taken back", "refused by hand", "accepted by hand"].iter().all(|text| edits(&edited).contains(text)),
        "{edited}"
    );

    // Two steps more, then the server is killed. The command lists the run, and another server goes on with it to the end.
    server.act(&json!({ "action": "step" }));
    server.act(&json!({ "action": "step" }));
    let before = rests(&server, "Paused", |tries| tries == 3);
    drop(server);
    assert!(place.run(&["runs"], 0).contains("out/absorber"));
    let server = Server::start(&place.0, "absorber.toml");
    assert_eq!(server.get("stored")["stored"][0]["folder"], "out/absorber");
    server.act(&json!({ "action": "resume", "folder": "../secret" }));
    wait(&server, "run", "another folder is refused", |value| value["run"]["status"] == "Failed");
    server.act(&json!({ "action": "resume", "folder": "out/absorber" }));
    let resumed = rests(&server, "Paused", |tries| tries == 3);
    assert_eq!(resumed["cycles"], before["cycles"]);
    server.act(&json!({ "action": "run" }));
    let end = rests(&server, "Converged", |_| true);
    drop(server);
    // Another limit begins a run of its own at this design.
    let server = Server::start(&place.0, "absorber.toml");
    server.act(&json!({ "action": "resume", "folder": "out/absorber" }));
    rests(&server, "Converged", |_| true);
    server.act(&json!({ "action": "set", "key": "constraint.1.at_most", "value": "0.9" }));
    let next = rests(&server, "Paused", |tries| tries == 0);
    assert_eq!((&next["design"], &next["fault"]), (&end["design"], &Value::Null));
    assert_eq!(server.get("run")["differing"].as_array().unwrap().len(), 1);
    assert!(place.read("out/absorber-2/note.txt").contains("at_most: 1.0 → 0.9"));
    drop(server);
    let objective = |value: &Value| value["objective"].as_f64().unwrap();
    let last = objective(end["cycles"].as_array().unwrap().last().unwrap());
    let summary: Value = serde_json::from_str(&place.read("whole/summary.json")).unwrap();
    let whole = summary["objective"]["value"].as_f64().unwrap();
    assert!((last - whole).abs() < 1e-3 * whole, "{last} and {whole}");
    place.run(&["resume", "absorber", "--quiet"], 0);
    place.run(&["report", "absorber", "--slice", "0", "--page-only"], 0);
    let history = place.read("out/absorber/history.jsonl");
    assert!(history.contains("accepted by hand") && history.contains("design.c.upper"), "{history}");
}

/// The error of a setting that is typed in the page names the field, and no line of the stored model, which the user has not written.
#[test]
fn errors_of_settings_name_their_field() {
    let (_place, server) = served("open-fields", "impact-absorber");
    server.act(&json!({ "action": "start", "design": start_design(&server.get("model")) }));
    rests(&server, "Paused", |tries| tries == 0);
    for (key, value, field, why) in [
        ("method.max_cycles", "many", "Setting", ""),
        ("method.cycles", "3", "Setting", "cycles"),
        ("method.move_limits.factor", "-1", "Setting", "move_limits"),
        ("method.preset", "no-such", "Method", "no-such"),
        ("design.k.upper", "1 +", "Setting", ""),
        ("constraint.displacement.at_most", "wide", "Setting", "wide"),
        ("constraint.nothing.at_most", "1", "Setting", "nothing"),
        ("force.absorber.stiffness", "2", "Setting", "only bounds"),
    ] {
        server.act(&json!({ "action": "set", "key": key, "value": value }));
        let found = wait(&server, "run", key, |run| {
            run["run"]["status"] == "Paused" && run["run"]["fault"].as_str().is_some_and(|fault| fault.contains(key))
        });
        let fault = found["run"]["fault"].as_str().unwrap();
        assert!(fault.starts_with(&format!("field {field}, `{key}` = {value}: ")), "{fault}");
        assert!(fault.contains(why) && !fault.contains(".toml") && !fault.contains("-->"), "{fault}");
    }
}

/// Edited text is kept beside the file until it is saved, also over a restart; a file that was changed by another program is not overwritten without a confirmation.
#[test]
fn edited_text_is_kept_until_it_is_saved() {
    let (place, server) = served("open-edit", "impact-absorber");
    let file = "impact-absorber.toml";
    let before = server.get("model");
    let text = before["text"].as_str().unwrap().to_owned();
    let post_edit = |server: &Server, text: &str, edited: &Value, base: &Value| {
        server.post("edit", &json!({ "text": text, "edited": edited, "base": base }))
    };
    let edit = |server: &Server, text: &str, base: &Value| {
        let edited = server.get("model")["edited"].clone();
        assert_eq!(post_edit(server, text, &edited, base).0, 200)
    };
    let tight = text.replace("at_most = 1.0", "at_most = 0.9");
    edit(&server, &tight, &before["base"]);
    // The picture follows the text, the file does not.
    let now = server.get("model");
    assert_eq!((&now["is_unsaved"], now["text"].as_str()), (&json!(true), Some(&*tight)));
    assert_ne!(now["revision"], before["revision"]);
    assert_eq!(place.read(file), text);
    assert!(place.read("impact-absorber.toml.unsaved").starts_with(&tight));
    // A page that has not seen this edit does not replace it.
    let other = text.replace("at_most = 1.0", "at_most = 0.7");
    assert_eq!(post_edit(&server, &other, &before["edited"], &before["base"]).0, 409);
    assert_eq!(server.get("model")["text"], tight);
    // A wrong edit has an error at its line, and the model in force stays.
    edit(&server, &tight.replace("at_most = 0.9", "at_most ="), &before["base"]);
    let wrong = server.get("model");
    assert_eq!(wrong["revision"], now["revision"]);
    let line = 1 + tight[..tight.find("at_most = 0.9").unwrap()].matches('\n').count();
    assert_eq!(wrong["errors"][0]["line"], line);
    edit(&server, &tight, &before["base"]);
    drop(server);

    // Another session continues with the edited text. A file that has changed meanwhile is not replaced without a confirmation.
    std::fs::write(place.0.join(file), &other).unwrap();
    let server = Server::start(&place.0, file);
    let found = server.get("model");
    assert_eq!((&found["text"], &found["has_changed"]), (&json!(tight), &json!(true)));
    assert_eq!(server.post("save", &json!({ "over": null })).0, 409);
    drop(server);
    std::fs::write(place.0.join(file), &text).unwrap();
    let server = Server::start(&place.0, file);
    assert_eq!(server.get("model")["has_changed"], false);
    assert_eq!(server.post("save", &json!({ "over": null })), (200, json!({})));
    assert_eq!(place.read(file), tight);
    assert!(!place.0.join("impact-absorber.toml.unsaved").exists());
    let saved = server.get("model");
    assert_eq!((&saved["is_unsaved"], saved["errors"].as_array().unwrap().len()), (&json!(false), 0));

    // The file changes during the edit.
    edit(&server, &text, &saved["base"]);
    let other = tight.replace("at_most = 0.9", "at_most = 0.8");
    std::fs::write(place.0.join(file), &other).unwrap();
    wait(&server, "model", "the change is noticed", |value| value["has_changed"] == true);
    assert_eq!(server.post("save", &json!({ "over": null })).0, 409);
    assert_eq!(place.read(file), other);
    assert_eq!(server.post("discard", &json!({})).0, 200);
    assert_eq!(server.get("model")["text"], other);
    edit(&server, &text, &saved["base"]);
    let found = server.get("model")["found"].clone();
    assert_eq!(server.post("save", &json!({ "over": "another text" })).0, 409);
    assert_eq!(server.post("save", &json!({ "over": found })).0, 200);
    assert_eq!(place.read(file), text);
}

/// Two servers of one file have the same unsaved text: what one of them has not seen, it does not replace.
#[test]
fn two_servers_of_one_file_keep_one_unsaved_text() {
    let (place, first) = served("open-two-servers", "impact-absorber");
    let file = "impact-absorber.toml";
    let second = Server::start(&place.0, file);
    let before = first.get("model");
    let text = before["text"].as_str().unwrap().to_owned();
    let post_edit = |server: &Server, text: &str, seen: &Value| {
        server.post("edit", &json!({ "text": text, "edited": seen["edited"], "base": seen["base"] })).0
    };
    let of_first = text.replace("at_most = 1.0", "at_most = 0.9");
    assert_eq!(post_edit(&first, &of_first, &before), 200);
    assert_eq!(post_edit(&second, &text.replace("at_most = 1.0", "at_most = 0.8"), &before), 409);
    wait(&second, "model", "the text of the other server", |value| value["text"] == *of_first);
    // It has seen the text now, and its own edit reaches the first one, which saves it.
    let of_second = of_first.replace("at_most = 0.9", "at_most = 0.7");
    assert_eq!(post_edit(&second, &of_second, &second.get("model")), 200);
    wait(&first, "model", "the text of the other server", |value| value["text"] == *of_second);
    assert!(place.read("impact-absorber.toml.unsaved").starts_with(&of_second));
    assert_eq!(first.post("save", &json!({ "over": null })).0, 200);
    wait(&second, "model", "saved by the other server", |value| value["is_unsaved"] == false);
    assert_eq!((place.read(file), &second.get("model")["text"]), (of_second.clone(), &json!(of_second)));
    assert!(!place.0.join("impact-absorber.toml.unsaved").exists());
}

/// In the browser: a point of the mechanism is dragged, a limit is drawn and saved, the text is edited, a run is stepped and paused.
#[test]
fn the_page_steers_edits_and_draws() {
    let Some(program) = browser() else { return };
    let place = TempFolder::new("open-steer");
    place.run(&["new", "lift"], 0);
    let server = Server::start(&place.0, "lift.toml");
    let mut page = Page::open(&program, &place.0, [1400, 1200]);
    page.show(&server.address());
    page.wait(SETTLED);

    // A limit is drawn on the first history: it is a constraint of the edited text, and of the file once it is saved.
    let limits = draw_limit(&mut page);
    assert!(page.text("document.getElementById('text').value").contains("drawn limit 1"));
    assert!(!place.read("lift.toml").contains("drawn limit"));
    page.click("#save");
    page.wait("document.getElementById('save').disabled");
    let text = place.read("lift.toml");
    assert!(text.contains("drawn limit 1") && text.contains("at_most"), "{text}");
    place.run(&["analyze", "lift"], 0);

    // A limit of several pieces: points by clicks, the last one by a double click. It is a curve beside the history.
    page.click(".plot .tools button");
    let [x, y] = page.middle(".plot svg");
    for (dx, dy) in [(-80.0, -30.0), (0.0, -10.0), (80.0, -40.0)] {
        page.mouse("mousePressed", [x + dx, y + dy]);
        page.mouse("mouseReleased", [x + dx, y + dy]);
    }
    page.value(
        "(() => { document.querySelector('.plot svg').dispatchEvent(new MouseEvent('dblclick')); return 0; })()",
    );
    page.wait(&format!("document.querySelectorAll('.margin').length === {}", limits + 1));
    page.wait("document.querySelectorAll('.plot:first-of-type path.limit').length >= 2");
    page.views("limits", ".plot");
    page.click("#save");
    page.wait("document.getElementById('save').disabled");
    let text = place.read("lift.toml");
    assert!(text.contains("drawn_2(time)") && text.contains("interpolation = \"linear\""), "{text}");
    place.run(&["analyze", "lift"], 0);

    // A wrong word in the text: the error has its line, and a button that leads there.
    let type_text = |page: &mut Page, text: &str| {
        page.value(&format!("(() => {{ const e = document.getElementById('text'); e.value = {}; e.dispatchEvent(new Event('input')); return 0; }})()", json!(text)));
    };
    type_text(&mut page, &text.replacen("[[body]]", "[[boddy]]", 1));
    page.wait("document.querySelector('#errors button')");
    assert_eq!(
        page.text("document.querySelector('#lines .wrong').textContent"),
        page.text("document.querySelector('#errors button').textContent.replace('line ', '')")
    );
    page.views("file", "#text");
    // Another page has edited the text meanwhile: it is not replaced without a confirmation.
    let of_other = format!("{text}# of another page\n");
    page.value(&format!(
        "(async () => {{ const {{ edited, base }} = await (await fetch('model')).json(); const e = document.getElementById('text'); e.value = {}; \
         e.dispatchEvent(new Event('input')); await fetch('edit', {{ method: 'POST', headers: {{ 'content-type': 'application/json' }}, \
         body: JSON.stringify({{ text: {}, edited, base }}) }}); return 0; }})()",
        json!(format!("{text}# of this page\n")),
        json!(of_other)
    ));
    page.wait("document.getElementById('save').textContent === 'Replace the other text'");
    assert_eq!(server.get("model")["text"], of_other);
    page.click("#save");
    wait(&server, "model", "replaced", |value| value["text"].as_str().unwrap().ends_with("# of this page\n"));
    page.wait("document.getElementById('save').textContent === 'Save'");
    type_text(&mut page, &text);
    page.wait("!document.querySelector('#errors button') && document.getElementById('save').disabled");
    page.wait(SETTLED);

    // The run: begun, stepped, run to its end, with the move limits on the sliders on the way.
    page.click("[data-action=start]");
    page.wait("document.getElementById('run').dataset.status === 'Paused'");
    page.click("[data-action=step]");
    page.wait("document.getElementById('run').dataset.tries === '1' && document.querySelector('.box i')");
    page.click("[data-action=back]");
    page.wait("document.getElementById('run').dataset.tries === '0'");
    page.click("[data-action=run]");
    page.wait(
        "['Converged', 'CycleLimit', 'Infeasible', 'Stalled'].includes(document.getElementById('run').dataset.status)",
    );
    let cycles = page.value("document.querySelectorAll('#cycles tbody tr').length").as_u64().unwrap();
    assert!(cycles > 2);
    page.views("run", "#run");
    assert_eq!(page.text("document.documentElement.dataset.state"), "ready");

    // A point of the shaper is dragged: variables follow, and the point is where the pointer was.
    place.example("shaper");
    let shaper = Server::start(&place.0, "shaper.toml");
    page.show(&shaper.address());
    page.wait(SETTLED);
    page.value("(() => { const b = document.querySelector('#stage .controls button'); if (b.textContent === 'Pause') b.click(); \
        const s = document.querySelector('#stage .controls input'); s.value = 0; s.dispatchEvent(new Event('input')); scrollTo(0, 0); return 0; })()");
    page.drawn();
    let designs = "[...document.querySelectorAll('#sliders input[type=range]')].map((e) => Number(e.value))";
    let before: Vec<f64> = serde_json::from_value(page.value(designs)).unwrap();
    let points = "[...document.querySelectorAll('#stage .linkage .joints circle')].map((e) => { const b = e.getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; })";
    let joints: Vec<[f64; 2]> = serde_json::from_value(page.value(points)).unwrap();
    let moved = joints.iter().any(|[x, y]| {
        page.drag([*x, *y], [x + 6.0, y - 4.0]);
        let now: Vec<f64> = serde_json::from_value(page.value(designs)).unwrap();
        now != before
    });
    assert!(moved, "no joint can be dragged");
    page.wait(SETTLED);
    assert_eq!(page.text("document.documentElement.dataset.state"), "ready");
    page.views("dragged", "body");
}
