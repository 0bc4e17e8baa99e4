//! Every function of the page of `linkwright open`, in a browser, on the slider-crank, the four-bar and the shaper.

use crate::browser::browser;
use crate::devtools::Page;
use crate::open::{SETTLED, Server};
use crate::shell::{TempFolder, linkwright};
use serde_json::json;

const DESIGN: &str = "[...document.querySelectorAll('#sliders input[type=range]')].map((e) => Number(e.value))";
const MARGINS: &str = "[...document.querySelectorAll('.margin')].map((e) => Number(e.dataset.margin))";
const ENDED: &str =
    "['Converged', 'CycleLimit', 'Infeasible', 'Stalled'].includes(document.getElementById('run').dataset.status)";

fn numbers(page: &mut Page, expression: &str) -> Vec<f64> {
    serde_json::from_value(page.value(expression)).unwrap()
}

/// Holds the first slider with the mouse and moves it: the approximation is shown first, then the analysis.
fn drags_a_slider(page: &mut Page) {
    let [margins, design] = [MARGINS, DESIGN].map(|expression| numbers(page, expression));
    let [_, y] = page.middle("#sliders input[type=range]");
    let thumb = "(() => { const e = document.querySelector('#sliders input[type=range]'); const b = e.getBoundingClientRect(); \
        return b.left + 8 + (e.value - e.min) / (e.max - e.min) * (b.width - 16); })()";
    let x = page.value(thumb).as_f64().unwrap();
    page.mouse("mousePressed", [x, y]);
    page.mouse("mouseMoved", [x - 9.0, y]);
    page.wait("document.querySelector('.margin[data-predicted]')");
    page.mouse("mouseReleased", [x - 9.0, y]);
    page.wait(&format!("{SETTLED} && !document.querySelector('.margin[data-predicted]')"));
    assert_ne!(numbers(page, DESIGN), design);
    assert_ne!(numbers(page, MARGINS), margins);
}

/// Drags joints of the mechanism until one of them moves variables. The page says which ones no variable moves.
fn drags_a_point(page: &mut Page) {
    page.value("(() => { const b = document.querySelector('#stage .controls button'); if (b.textContent === 'Pause') b.click(); \
        document.querySelector('#stage').scrollIntoView({ block: 'center', behavior: 'instant' }); return 0; })()");
    page.drawn();
    let before = numbers(page, DESIGN);
    let points = "[...document.querySelectorAll('#stage .linkage .joints circle')].map((e) => { const b = e.getBoundingClientRect(); \
        return [b.left + b.width / 2, b.top + b.height / 2]; })";
    let joints: Vec<[f64; 2]> = serde_json::from_value(page.value(points)).unwrap();
    let mut fixed = 0;
    let is_dragged = joints.iter().any(|[x, y]| {
        page.mouse("mousePressed", [*x, *y]);
        page.mouse("mouseMoved", [x + 6.0, y - 4.0]);
        fixed += usize::from(page.value("!document.getElementById('drag-note').hidden") == true);
        page.mouse("mouseReleased", [x + 6.0, y - 4.0]);
        numbers(page, DESIGN) != before
    });
    assert!(is_dragged || fixed == joints.len(), "no joint of {} can be dragged", joints.len());
    page.wait(&format!("{SETTLED} || !document.getElementById('design-fault').hidden"));
    page.click("#reset");
    page.wait(SETTLED);
}

/// Draws a limit on the first history and saves it; then the file is written as before by another editor.
fn draws_a_limit(page: &mut Page, place: &TempFolder, file: &str) {
    let text = place.read(file);
    let limits = numbers(page, MARGINS).len();
    let count = |n: usize| format!("document.querySelectorAll('.margin').length === {n}");
    page.click(".plot .tools button");
    let [x, y] = page.middle(".plot svg");
    page.drag([x - 60.0, y], [x + 60.0, y]);
    page.wait(&count(limits + 1));
    page.click("#save");
    page.wait("document.getElementById('save').disabled");
    assert!(place.read(file).contains("drawn limit 1"));
    std::fs::write(place.0.join(file), text).unwrap();
    page.wait(&count(limits));
    page.wait(SETTLED);
}

/// Edits the text wrongly and rightly.
fn edits_the_file(page: &mut Page, place: &TempFolder, file: &str) {
    let text = place.read(file);
    let put = |page: &mut Page, text: &str| {
        page.value(&format!(
            "(() => {{ const e = document.getElementById('text'); e.value = {}; e.dispatchEvent(new Event('input')); return 0; }})()",
            json!(text)
        ));
    };
    put(page, &text.replacen("[objective]", "[objektive]", 1));
    page.wait("document.querySelector('#errors button')");
    let line = 1 + text[..text.find("[objective]").unwrap()].matches('\n').count();
    assert_eq!(page.text("document.querySelector('#lines .wrong').textContent"), line.to_string());
    put(page, &text);
    page.wait("!document.querySelector('#errors button') && document.getElementById('save').disabled");
    assert_eq!(place.read(file), text);
    page.wait(SETTLED);
}

/// Begins a run, takes steps until one is accepted, refuses it, and lets the run go on until it is paused or at its end.
fn runs_and_refuses(page: &mut Page) {
    page.click("[data-action=start]");
    page.wait("document.getElementById('run').dataset.status === 'Paused'");
    let is_accepted = "!document.querySelector('[data-action=refuse]').disabled";
    for tries in 1..=6 {
        page.click("[data-action=step]");
        let run = "document.getElementById('run').dataset";
        page.wait(&format!("{run}.tries === '{tries}' && {run}.status === 'Paused'"));
        if page.value(is_accepted) == true {
            break;
        }
    }
    page.click("[data-action=refuse]");
    page.wait("document.querySelectorAll('#edits li').length === 1");
    assert!(page.text("document.getElementById('edits').textContent").contains("refused"));
    let tries: u64 = page.text("document.getElementById('run').dataset.tries").parse().unwrap();
    page.click("[data-action=run]");
    page.wait(&format!("Number(document.getElementById('run').dataset.tries) > {tries} || {ENDED}"));
    page.click("[data-action=pause]");
    page.wait(&format!("document.getElementById('run').dataset.status === 'Paused' || {ENDED}"));
}

fn journey(name: &str) {
    let Some(program) = browser() else { return };
    let place = TempFolder::new(&format!("open-journey-{name}"));
    place.example(name);
    let file = format!("{name}.toml");
    let server = Server::start(&place.0, &file);
    let mut page = Page::open(&program, &place.0, [1400, 1200]);
    page.show(&server.address());
    page.wait(SETTLED);
    drags_a_slider(&mut page);
    drags_a_point(&mut page);
    draws_a_limit(&mut page, &place, &file);
    edits_the_file(&mut page, &place, &file);
    runs_and_refuses(&mut page);

    // The server is killed. Another one lists the run, which goes on to its end, beside a second run from the command line.
    let tries = page.text("document.getElementById('run').dataset.tries");
    drop(server);
    linkwright(
        &["optimize", name, "--method", "slp-filter", "--max-cycles", "3", "--quiet", "--out", "out/other"],
        &place.0,
    );
    let server = Server::start(&place.0, &file);
    page.show(&server.address());
    page.wait(SETTLED);
    page.click("#stored-runs summary");
    page.wait("document.getElementById('stored-runs').dataset.listed === '2 0'");
    let row = |folder: &str| {
        format!(
            "[...document.querySelectorAll('#stored tbody tr')].find((row) => row.children[1].textContent === 'out/{folder}')"
        )
    };
    page.value(&format!("(() => {{ {}.querySelector('.acts button').click(); return 0; }})()", row(name)));
    page.wait(&format!("document.getElementById('run').dataset.tries === '{tries}'"));
    // The run may have ended before it was paused.
    if page.value(ENDED) != true {
        page.click("[data-action=run]");
        page.wait(ENDED);
    }

    for folder in [name, "other"] {
        page.value(&format!(
            "(() => {{ {}.querySelector('input[type=checkbox]').click(); return 0; }})()",
            row(folder)
        ));
        page.wait(&format!(
            "[...document.querySelectorAll('#convergence li')].some((e) => e.textContent.startsWith('out/{folder} '))"
        ));
    }
    page.wait("document.querySelector('#differences table')");
    assert!(page.text("document.getElementById('differences').textContent").contains("slp-filter"));
    assert_eq!(page.text("document.documentElement.dataset.state"), "ready");
}

#[test]
fn everything_works_on_the_slider_crank() {
    journey("slider-crank-assembled");
}

#[test]
fn everything_works_on_the_four_bar() {
    journey("four-bar");
}

#[test]
fn everything_works_on_the_shaper() {
    journey("shaper");
}

/// Where the mechanism does not assemble, the last good picture stays, with the reason.
#[test]
fn a_design_that_does_not_assemble_keeps_the_last_picture() {
    let Some(program) = browser() else { return };
    let place = TempFolder::new("open-apart");
    place.example("slider-crank-assembled");
    let server = Server::start(&place.0, "slider-crank-assembled.toml");
    let mut page = Page::open(&program, &place.0, [1400, 1200]);
    page.show(&server.address());
    page.wait(SETTLED);
    let objective = page.text("document.getElementById('objective-value').textContent");
    let put = |page: &mut Page, value: f64| {
        page.value(&format!("(() => {{ const e = document.getElementById('value-0'); e.value = '{value}'; e.dispatchEvent(new Event('change')); return 0; }})()"));
    };
    // The crank is longer than the connecting rod.
    put(&mut page, 29.0);
    page.wait("document.getElementById('status').textContent === 'no analysis here'");
    assert!(!page.text("document.getElementById('design-fault').textContent").is_empty());
    assert!(page.value("document.querySelectorAll('#stage .linkage .joints circle').length").as_u64().unwrap() > 0);
    assert!(page.text("document.getElementById('note').textContent").contains("last good design"));
    page.wait("document.documentElement.dataset.failed === ''");
    // It cannot be pinned, and the last good design is not pinned in its place. The message can be closed.
    page.click("#pin");
    page.wait("document.getElementById('design-fault').textContent.includes('is not pinned')");
    assert_eq!(page.value("document.querySelectorAll('#pins tbody tr').length"), 0);
    page.click("#design-fault button");
    assert_eq!(page.value("document.getElementById('design-fault').hidden"), true);
    put(&mut page, 7.6);
    page.wait(&format!("!document.getElementById('design-fault').textContent && {SETTLED}"));
    assert_eq!(page.text("document.getElementById('objective-value').textContent"), objective);
}

/// A page whose connection is cut, as by the sleep of a computer, shows on its return what has changed meanwhile.
#[test]
fn a_page_that_was_asleep_catches_up() {
    let Some(program) = browser() else { return };
    let place = TempFolder::new("open-sleep");
    place.example("impact-absorber");
    let server = Server::start(&place.0, "impact-absorber.toml");
    let mut page = Page::open(&program, &place.0, [1400, 1200]);
    page.show(&server.address());
    page.wait(SETTLED);
    let is_offline = |page: &mut Page, offline: bool| {
        let network = json!({ "offline": offline, "latency": 0, "downloadThroughput": -1, "uploadThroughput": -1 });
        page.call("Network.enable", json!({}));
        page.call("Network.emulateNetworkConditions", network);
    };
    is_offline(&mut page, true);
    page.value("(() => { const e = document.querySelector('#sliders input[type=range]'); e.value = 0.5; e.dispatchEvent(new Event('input')); return 0; })()");
    page.wait("document.getElementById('status').textContent === 'no connection'");
    page.call("Page.setWebLifecycleState", json!({ "state": "frozen" }));
    let text = place.read("impact-absorber.toml");
    std::fs::write(place.0.join("impact-absorber.toml"), text.replace("at_most = 1.0", "at_most = 0.9")).unwrap();
    std::thread::sleep(std::time::Duration::from_millis(500));
    page.call("Page.setWebLifecycleState", json!({ "state": "active" }));
    is_offline(&mut page, false);
    page.wait("document.getElementById('text').value.includes('at_most = 0.9')");
    page.wait(SETTLED);
    assert_eq!(page.text("document.documentElement.dataset.state"), "ready");
}
