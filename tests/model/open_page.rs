//! The page of `linkwright open`: what is drawn, where it stays, and what keys do.

use crate::devtools::Page;
use crate::open::{SETTLED, Server, shown};
use crate::shell::TempFolder;
use serde_json::json;

const STOP: &str = "(() => { const b = document.querySelector('#stage .controls button'); if (b.textContent === 'Pause') b.click(); return 0; })()";

/// The page of an example, at rest.
pub fn opened(name: &str, example: &str, size: [u32; 2]) -> Option<(TempFolder, Server, Page)> {
    let (place, server, mut page) = shown(name, example, size)?;
    page.value(STOP);
    Some((place, server, page))
}

pub fn numbers<const N: usize>(page: &mut Page, expression: &str) -> [f64; N] {
    // What has changed is drawn in the next frames.
    page.drawn();
    let found: Vec<f64> = serde_json::from_value(page.value(expression)).unwrap();
    found.try_into().unwrap()
}

/// Beams with a cross-section are drawn element by element.
#[test]
fn beams_are_drawn() {
    let Some((_place, _server, mut page)) = opened("open-beams", "slider-crank-flexible", [1400, 1000]) else { return };
    let drawn = "[...document.querySelectorAll('#stage .linkage .beams path')].filter((e) => e.getBBox().width + e.getBBox().height > 5).length";
    assert!(page.value(drawn).as_u64().unwrap() >= 2);
    page.views("beams", "#picture");
}

/// A point that is dragged stays at the pointer, however far; nothing moves under it, also where a design cannot be analysed.
#[test]
fn a_dragged_point_stays_at_the_pointer() {
    let Some((_place, _server, mut page)) = opened("open-drag", "shaper", [1280, 900]) else { return };
    page.value("(() => { const s = document.querySelector('#stage .controls input'); s.value = 30; s.dispatchEvent(new Event('input')); scrollTo(0, 0); return 0; })()");
    let joint = "(() => { const b = [...document.querySelectorAll('#stage .linkage .joints circle')].pop().getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; })()";
    let top = "[document.getElementById('stage').getBoundingClientRect().top]";
    let [x, y] = numbers(&mut page, joint);
    let [before] = numbers(&mut page, top);
    let designs = "[...document.querySelectorAll('#sliders input[type=range]')].map((e) => e.value).join(' ')";
    let start = page.text(designs);
    page.mouse("mousePressed", [x, y]);
    for far in [4.0, 8.0, 12.0, 16.0, 20.0, 24.0] {
        page.mouse("mouseMoved", [x + far, y]);
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    page.wait(&format!("(([u, v]) => Math.hypot(u - {}, v - {y}) < 2)({joint})", x + 24.0));
    // Back where it was pressed, the design is the one that was there.
    page.mouse("mouseMoved", [x, y]);
    page.wait(&format!("{designs} === {start:?}"));
    page.mouse("mouseReleased", [x, y]);

    // Far beyond what the mechanism can do, the page stays in place.
    page.click("#reset");
    page.wait(SETTLED);
    page.value("scrollTo({ top: 0, behavior: 'instant' })");
    let [x, y] = numbers(&mut page, joint);
    page.drag([x, y], [x + 300.0, y]);
    page.value("(() => { const s = [...document.querySelectorAll('#sliders input[type=range]')]; s.forEach((e, k) => { e.value = k % 2 ? e.max : e.min; e.dispatchEvent(new Event('input')); }); return 0; })()");
    page.wait(&format!("{SETTLED} || !document.getElementById('design-fault').hidden"));
    assert_eq!(numbers(&mut page, top), [before]);
}

/// A finger drags a point; the page scrolled in its place. Beside the points it scrolls the page.
#[test]
fn a_finger_drags_a_point_and_scrolls_beside_it() {
    let Some((_place, _server, mut page)) = opened("open-finger", "shaper", [390, 844]) else { return };
    page.call("Emulation.setTouchEmulationEnabled", json!({ "enabled": true }));
    page.value("(() => { window.dropped = 0; document.querySelector('#stage svg').addEventListener('pointercancel', () => { window.dropped += 1; }); return 0; })()");
    let joint = "(() => { const b = [...document.querySelectorAll('#stage .linkage .joints circle')].pop().getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; })()";
    let drag = |page: &mut Page, from: [f64; 2]| -> [f64; 2] {
        for step in 0..=8 {
            let kind = if step == 0 { "touchStart" } else { "touchMove" };
            let at = json!([{ "x": from[0] + 2.0 * f64::from(step), "y": from[1] - 5.0 * f64::from(step) }]);
            page.call("Input.dispatchTouchEvent", json!({ "type": kind, "touchPoints": at }));
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
        page.call("Input.dispatchTouchEvent", json!({ "type": "touchEnd", "touchPoints": [] }));
        numbers(page, "[scrollY, window.dropped]")
    };
    let [x, y] = numbers(&mut page, joint);
    assert_eq!(drag(&mut page, [x, y]), [0.0, 0.0]);
    let [left, bottom] = numbers(
        &mut page,
        "(() => { const b = document.querySelector('#stage svg').getBoundingClientRect(); return [b.left + 12, b.bottom - 12]; })()",
    );
    let [scrolled, dropped] = drag(&mut page, [left, bottom]);
    assert!(scrolled > 5.0 && dropped == 1.0, "{scrolled} {dropped}");
}

/// No page is wider than the screen of a phone, also with long names of the axis: the readout of the time made it wider.
#[test]
fn the_page_fits_on_a_phone() {
    for example in ["slider-crank-assembled", "rssr", "four-bar"] {
        let Some((_place, _server, mut page)) = opened("open-narrow", example, [360, 740]) else { return };
        let last = "(() => { const s = document.querySelector('#stage .controls input'); s.value = s.max; s.dispatchEvent(new Event('input')); return 0; })()";
        page.value(last);
        assert_eq!(page.value("document.documentElement.scrollWidth"), 360, "{example}");
    }
}

/// A limit that is drawn ends with Enter and is dropped by Escape, also while the focus is on its button.
#[test]
fn enter_ends_a_drawn_limit_and_escape_drops_it() {
    let Some((place, _server, mut page)) = opened("open-keys", "shaper", [1400, 1000]) else { return };
    let limits = "document.querySelectorAll('.margin').length";
    let count = page.value(limits).as_u64().unwrap();
    let points = |page: &mut Page| {
        page.click(".plot .tools button");
        let [x, y] = page.middle(".plot svg");
        for (dx, dy) in [(-80.0, -30.0), (0.0, -10.0), (80.0, -40.0)] {
            page.mouse("mousePressed", [x + dx, y + dy]);
            page.mouse("mouseReleased", [x + dx, y + dy]);
        }
    };
    let key = |page: &mut Page, key: &str| {
        for kind in ["keyDown", "keyUp"] {
            let code = if key == "Enter" { 13 } else { 27 };
            let text = if key == "Enter" && kind == "keyDown" { "\r" } else { "" };
            page.call(
                "Input.dispatchKeyEvent",
                json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code, "text": text }),
            );
        }
    };
    points(&mut page);
    key(&mut page, "Escape");
    assert_eq!(page.value("document.querySelectorAll('.drawn, .drawing').length"), 0);
    let [x, y] = page.middle(".plot svg");
    page.mouse("mousePressed", [x, y]);
    page.mouse("mouseReleased", [x, y]);
    points(&mut page);
    page.value("document.querySelector('.plot .tools button').focus()");
    key(&mut page, "Enter");
    page.wait(&format!("{limits} === {}", count + 1));
    assert_eq!(page.value("document.querySelectorAll('.drawn, .drawing').length"), 0);
    // Its margin is in the unit of the history.
    page.wait(SETTLED);
    let unit = page.text("document.querySelector('.plot figcaption small').textContent");
    let margin = page.text("[...document.querySelectorAll('.margin')].pop().querySelector('p').textContent");
    assert!(unit.is_empty() || margin.contains(&unit), "{margin}");
    // The text is beside the mechanism if that is wanted, and Ctrl-Z undoes the limit as if it had been typed.
    page.value("scrollTo({ top: 0, behavior: 'instant' })");
    page.click("#beside");
    let [bottom, height] =
        numbers(&mut page, "[document.getElementById('text').getBoundingClientRect().bottom, innerHeight]");
    assert!(bottom < height, "{bottom} {height}");
    let undone = "(() => { const e = document.getElementById('text'); e.focus(); document.execCommand('undo'); return e.value; })()";
    let text = page.text(undone);
    assert_eq!(text, place.read("shaper.toml"));
}

/// The letters of histories have 11 pixels, however wide the page is: it was 8 on a desktop.
#[test]
fn letters_of_histories_have_one_size() {
    for width in [1280, 1920, 375] {
        let Some((_place, _server, mut page)) = opened("open-letters", "shaper", [width, 900]) else { return };
        page.wait(SETTLED);
        let size = page.value(
            "Math.min(...[...document.querySelectorAll('#plots svg')].map((s) => 11 * s.clientWidth / s.viewBox.baseVal.width))",
        );
        assert!(size.as_f64().unwrap() > 10.9, "{width}: {size}");
    }
}

/// A limit by the keyboard alone: a level line that the arrow keys move.
#[test]
fn a_limit_is_drawn_with_the_keyboard() {
    let Some((_place, _server, mut page)) = opened("open-arrows", "shaper", [1400, 1000]) else { return };
    page.wait(SETTLED);
    let limits = "document.querySelectorAll('.margin').length";
    let count = page.value(limits).as_u64().unwrap();
    page.value("document.querySelector('.plot .tools button').focus()");
    let mut key = |key: &str, code: u32| {
        for kind in ["keyDown", "keyUp"] {
            let text = if key == "Enter" && kind == "keyDown" { "\r" } else { "" };
            let event = json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code, "text": text });
            page.call("Input.dispatchKeyEvent", event);
        }
    };
    key("Enter", 13);
    (0..4).for_each(|_| key("ArrowUp", 38));
    key("ArrowDown", 40);
    key("Enter", 13);
    page.wait(&format!("{limits} === {}", count + 1));
    page.wait(SETTLED);
    let text = page.text("document.getElementById('text').value");
    let limit = text.rsplit("at_most = ").next().unwrap().lines().next().unwrap();
    assert!(!limit.contains("time") && !limit.is_empty(), "a level limit is a number: {limit}");
}

/// Tick labels have at most seven characters and differ from each other, for any size and offset of the values.
#[test]
fn tick_labels_are_short_and_differ() {
    let Some((_place, _server, mut page)) = opened("open-ticks", "two-bar-truss", [1400, 1000]) else { return };
    let labels = |page: &mut Page, low: f64, high: f64| -> (Vec<String>, String) {
        let found = page.value(&format!(
            "import('./plots.js').then(({{ ticks, labels }}) => {{ const {{ texts, note }} = labels(ticks({low:e}, {high:e})); return [texts, note]; }})"
        ));
        serde_json::from_value(found).unwrap()
    };
    for (low, high) in
        [(-1e9, 1e9), (0.0, 3.2e8), (1e6, 1e6 + 1e-3), (-2e-7, 3e-7), (0.1, 0.6), (-350.0, 120.0), (99999.0, 100001.0)]
    {
        let (texts, note) = labels(&mut page, low, high);
        assert!(
            texts.len() > 2 && texts.iter().all(|text| text.chars().count() <= 7),
            "{low} {high}: {texts:?} {note}"
        );
        let mut different = texts.clone();
        different.dedup();
        assert_eq!(different, texts, "{low} {high}");
    }
    assert_eq!(
        labels(&mut page, 0.0, 2e9),
        (["0.0", "0.5", "1.0", "1.5", "2.0"].map(str::to_owned).to_vec(), "×10⁹".to_owned())
    );
    assert_eq!(labels(&mut page, -0.5, 0.5).0[0], "\u{2212}0.4");
    assert_eq!(
        page.text(
            "import('./plots.js').then(({ short }) => [-5.47812e-6, 0.00013068, 26330000, 0].map(short).join(' '))"
        ),
        "\u{2212}5.4781e\u{2212}6 0.00013068 26330000 0"
    );
    // Without a history there are no labels, and no limit can be drawn.
    let empty = "import('./plots.js').then(({ Plot }) => { const place = document.createElement('div'); \
        new Plot(place, { name: 'x', unit: '', time: { name: 't', points: [0, 1] } }).drawable(() => 0); return place.querySelector('button').disabled; })";
    assert_eq!(page.value(empty), true);
}

/// On a phone, what has the focus is not behind the mechanism, and the mechanism scrolls out of view with the last history.
#[test]
fn the_focus_is_in_sight_on_a_phone() {
    let Some((_place, _server, mut page)) = opened("open-focus", "shaper", [375, 667]) else { return };
    let covered = "(() => { const e = document.activeElement, b = e.getBoundingClientRect(), p = document.getElementById('picture').getBoundingClientRect(); \
        return !document.getElementById('picture').contains(e) && b.bottom <= p.bottom && b.bottom > 0 ? e.id || e.textContent || e.className : ''; })()";
    page.value("document.querySelector('[data-action=start]').focus()");
    for _ in 0..25 {
        for kind in ["keyDown", "keyUp"] {
            page.call(
                "Input.dispatchKeyEvent",
                json!({ "type": kind, "key": "Tab", "code": "Tab", "windowsVirtualKeyCode": 9, "modifiers": 8 }),
            );
        }
        page.value("new Promise((done) => setTimeout(() => done(0), 400))");
        assert_eq!(page.text(covered), "");
    }
    page.value("document.getElementById('source').scrollIntoView({ behavior: 'instant' })");
    page.wait("document.getElementById('picture').getBoundingClientRect().bottom < 0");
}

/// The reason why a design cannot be analysed hides no control, beside the editor, too.
#[test]
fn messages_hide_no_control() {
    for (size, is_beside) in [([1280, 800], false), ([1280, 800], true), ([390, 844], false)] {
        let Some((_place, _server, mut page)) = opened("open-messages", "slider-crank-assembled", size) else { return };
        if is_beside {
            page.click("#beside");
        }
        page.value("(() => { const e = document.getElementById('value-0'); e.value = '29'; e.dispatchEvent(new Event('change')); return 0; })()");
        page.wait("!document.getElementById('design-fault').hidden");
        page.value("scrollTo({ top: 0, behavior: 'instant' })");
        let hidden = "(() => { const m = document.getElementById('design-fault').getBoundingClientRect(); \
            return [...document.querySelectorAll('input, textarea, select, button')].filter((e) => !e.closest('#messages')).filter((e) => { \
            const b = e.getBoundingClientRect(); return b.width && b.left < m.right && m.left < b.right && b.top < m.bottom && m.top < b.bottom; }) \
            .map((e) => e.id || e.textContent || e.ariaLabel); })()";
        assert_eq!(page.value(hidden), json!([]), "{size:?} {is_beside}");
        assert_eq!(page.value("document.getElementById('design-state').hidden"), false);
        if is_beside {
            page.views("message", "body");
        }
        page.click("#design-fault button");
        assert_eq!(page.value("document.getElementById('design-fault').hidden"), true);
    }
}

/// A file without an objective is simulated only, and the page says what it lacks for that.
#[test]
fn a_simulation_says_that_it_has_no_objective() {
    let Some(program) = crate::browser::browser() else { return };
    let place = TempFolder::new("open-simulation");
    place.example("trebuchet");
    let text = place.read("trebuchet.toml");
    let simulation = &text[..text.find("[objective]").unwrap()];
    std::fs::write(place.0.join("throw.toml"), simulation).unwrap();
    let server = Server::start(&place.0, "throw.toml");
    let mut page = Page::open(&program, &place.0, [1400, 1000]);
    page.show(&server.address());
    page.wait("document.documentElement.dataset.settled");
    let seen = "[...document.querySelectorAll('#simulation, #moves, #margins, #run')].filter((e) => e.offsetParent).map((e) => e.id)";
    assert_eq!(page.value(seen), json!(["simulation"]));
    let words = page.text("document.getElementById('simulation').textContent");
    assert!(words.contains("no objective") && words.contains("≤") && words.contains("[objective]"), "{words}");
    page.views("simulation", "body");
    drop(server);

    // Times of events and values at them are those of the command.
    let server = Server::start(&place.0, "trebuchet.toml");
    page.show(&server.address());
    page.wait(SETTLED);
    assert_eq!(page.value("document.getElementById('simulation').hidden"), true);
    let printed = crate::open::analyzed(&place, &["trebuchet"]);
    for name in ["throw_time", "flight_time", "speed", "range"] {
        let shown =
            page.text(&format!("document.querySelector('#value-table [data-output={name}]').children[2].textContent"));
        let outputs = printed["outputs"].as_array().unwrap_or_else(|| panic!("{printed}"));
        let exact = outputs.iter().find(|one| one["name"] == name).unwrap_or_else(|| panic!("{printed}"));
        let exact = exact["end"]["value"].as_f64().unwrap();
        let shown: f64 = shown.parse().unwrap_or_else(|_| panic!("{name}: {shown}"));
        assert!((shown - exact).abs() <= 1e-4 * exact.abs(), "{name}: {shown} and {exact}");
    }
    // The mechanism is drawn, although an event releases the sling: in each frame the counterweight and the stone.
    assert_eq!(page.value("document.querySelectorAll('#stage .linkage .masses circle').length"), 2);
    assert!(!page.text("document.getElementById('legend').textContent").contains("Not drawn"));
    page.views("values", "#values");
}

/// E_f and E_g are explained, the newest cycle is in sight unless the user scrolls up, and disabled buttons say why.
#[test]
fn cycles_are_explained_and_in_sight() {
    let Some((_place, _server, mut page)) = opened("open-cycles", "impact-absorber", [1400, 1000]) else { return };
    let titles = "[...document.querySelectorAll('#run .buttons button:disabled[data-action]')].map((b) => b.title)";
    let titles_of = |page: &mut Page| -> Vec<String> { serde_json::from_value(page.value(titles)).unwrap() };
    assert!(titles_of(&mut page).iter().all(|title| title.contains("no run")));
    assert!(page.text("document.getElementById('run-why').textContent").contains("Begin here"));
    page.click("[data-action=start]");
    page.wait("document.getElementById('run').dataset.status === 'Paused'");
    let words = page.text(
        "document.getElementById(document.getElementById('cycles').getAttribute('aria-describedby')).textContent",
    );
    assert!(words.contains("E_f") && words.contains("E_g") && words.contains("percent"), "{words}");
    assert_eq!(page.value("[...document.querySelectorAll('#cycles th')].filter((e) => e.textContent.startsWith('E_')).every((e) => e.title)"), true);
    page.value("(() => { document.querySelector('#cycles').parentElement.style.maxHeight = '6rem'; return 0; })()");
    let scrolled = "(() => { const e = document.querySelector('#cycles').parentElement; return [e.scrollTop, e.scrollHeight - e.clientHeight]; })()";
    let step = |page: &mut Page, tries: usize| {
        page.click("[data-action=step]");
        page.wait(&format!("document.getElementById('run').dataset.tries === '{tries}'"));
        page.wait("['Paused', 'Converged'].includes(document.getElementById('run').dataset.status)");
        numbers::<2>(page, scrolled)
    };
    let mut last = [0.0, 0.0];
    (1..=4).for_each(|tries| last = step(&mut page, tries));
    assert!(last[1] > 20.0 && last[1] - last[0] < 2.0, "{last:?}");
    page.value("(() => { document.querySelector('#cycles').parentElement.scrollTop = 0; return 0; })()");
    assert_eq!(step(&mut page, 5)[0], 0.0);
    assert!(titles_of(&mut page).iter().all(|title| !title.is_empty()));
    page.views("cycles", "#run-tables");
}
