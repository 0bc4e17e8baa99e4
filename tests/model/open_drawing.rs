//! The page of `linkwright open`: the drawing of the mechanism and its zoom, values of histories, bars of a variable, and dragged points.

use crate::devtools::Page;
use crate::open::SETTLED;
use crate::open_page::{numbers, opened};
use serde_json::json;

/// Presses and releases a key.
fn press(page: &mut Page, key: &str, code: u32) {
    for kind in ["keyDown", "keyUp"] {
        let text = if kind == "keyDown" && key.len() == 1 { key } else { "" };
        let event = json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code, "text": text });
        page.call("Input.dispatchKeyEvent", event);
    }
}

/// Where nothing has the focus, Space plays and pauses, and does not scroll the page; the drawing has keys for the time.
#[test]
fn space_plays_and_home_and_end_go_to_the_ends() {
    let Some((_place, _server, mut page)) = opened("open-space", "shaper", [1280, 700]) else { return };
    let label = "document.querySelector('#stage .controls button').textContent";
    page.value("(() => { document.activeElement.blur(); scrollTo({ top: 0, behavior: 'instant' }); return 0; })()");
    press(&mut page, " ", 32);
    page.wait(&format!("{label} === 'Pause'"));
    press(&mut page, " ", 32);
    page.wait(&format!("{label} === 'Play'"));
    let frame = "Number(document.querySelector('#stage svg').dataset.frame)";
    let at = page.value(frame).as_u64().unwrap();
    press(&mut page, "ArrowRight", 39);
    press(&mut page, "ArrowLeft", 37);
    assert_eq!(page.value(frame), at);
    assert_eq!(page.value("scrollY"), 0);
    page.value("document.getElementById('stage').focus({ preventScroll: true })");
    press(&mut page, "End", 35);
    assert_eq!(page.value(&format!("{frame} === Number(document.querySelector('#stage .controls input').max)")), true);
    press(&mut page, "Home", 36);
    assert_eq!(page.value(frame), 0);
    assert_eq!(page.value("scrollY"), 0);
}

/// The drawing is zoomed by wheel, double click, buttons and keys, about the pointer; it stays zoomed while a slider moves, and fits again.
#[test]
fn the_drawing_is_zoomed() {
    let Some((_place, _server, mut page)) = opened("open-zoom", "shaper", [1280, 900]) else { return };
    let zoom =
        |page: &mut Page| page.value("Number(document.querySelector('#stage svg').dataset.zoom)").as_f64().unwrap();
    let joint = "(() => { const b = [...document.querySelectorAll('#stage .linkage .joints circle')].pop().getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; })()";
    page.value("scrollTo({ top: 0, behavior: 'instant' })");
    let at: [f64; 2] = numbers(&mut page, joint);
    // Mouse events have whole pixels: the joint is up to 0.7 pixels beside the pointer, a distance that grows with the zoom.
    let pointer = at.map(f64::round);
    let wheel = |page: &mut Page, up: i32, modifiers: u32| {
        let event = json!({ "type": "mouseWheel", "x": pointer[0], "y": pointer[1], "deltaX": 0, "deltaY": -up, "modifiers": modifiers });
        page.call("Input.dispatchMouseEvent", event);
    };
    // Without Ctrl, and without the focus on the drawing, the wheel scrolls the page.
    wheel(&mut page, -200, 0);
    page.wait("scrollY > 150");
    assert_eq!(zoom(&mut page), 1.0);
    page.value("scrollTo({ top: 0, behavior: 'instant' })");
    page.wait("scrollY === 0");
    wheel(&mut page, 200, 2);
    page.wait("Number(document.querySelector('#stage svg').dataset.zoom) > 1.2");
    let near = |page: &mut Page| {
        let now: [f64; 2] = numbers(page, joint);
        assert!((now[0] - at[0]).hypot(now[1] - at[1]) < 1.5, "{now:?} and {at:?}");
    };
    near(&mut page);
    page.value(&format!(
        "(() => {{ document.querySelector('#stage svg').dispatchEvent(new MouseEvent('dblclick', {{ clientX: {}, clientY: {} }})); return 0; }})()",
        pointer[0], pointer[1]
    ));
    assert!(zoom(&mut page) > 2.4);
    near(&mut page);
    // A change of a variable does not change the view; a drag beside the points moves it.
    let big = zoom(&mut page);
    page.value("(() => { const e = document.querySelector('#sliders input[type=range]'); e.value = e.max; e.dispatchEvent(new Event('input')); return 0; })()");
    page.wait(SETTLED);
    assert_eq!(zoom(&mut page), big);
    page.views("zoom", "#picture");
    page.value("document.querySelector('#zoom button:last-child').click()");
    assert_eq!(zoom(&mut page), 1.0);
    page.value("document.getElementById('stage').focus({ preventScroll: true })");
    press(&mut page, "+", 187);
    assert!(zoom(&mut page) > 1.4);
    press(&mut page, "-", 189);
    assert!((zoom(&mut page) - 1.0).abs() < 0.01);
    press(&mut page, "+", 187);
    press(&mut page, "0", 48);
    assert_eq!(zoom(&mut page), 1.0);
    page.click("#zoom button");
    let [left, top, x, y]: [f64; 4] = numbers(
        &mut page,
        &format!(
            "(() => {{ const b = document.querySelector('#stage svg').getBoundingClientRect(); return [b.left + 20, b.bottom - 20, ...{joint}]; }})()"
        ),
    );
    page.drag([left, top], [left + 30.0, top - 20.0]);
    let now: [f64; 2] = numbers(&mut page, joint);
    assert!((now[0] - x - 30.0).hypot(now[1] - y + 20.0) < 3.0, "{now:?} and {x} {y}");
}

/// A history shows the value at the pointer, and while the motion rests that at its time; screen readers have it, too.
#[test]
fn histories_show_values() {
    let Some((_place, _server, mut page)) = opened("open-values", "shaper", [1400, 1000]) else { return };
    page.wait(SETTLED);
    let text = "document.querySelector('.plot .reading text')?.textContent ?? ''";
    let start = "(() => { const s = document.querySelector('#stage .controls input'); s.value = 0; s.dispatchEvent(new Event('input')); return 0; })()";
    page.value(start);
    page.middle(".plot svg");
    page.wait(&format!("({text}).includes(' at 0 ')"));
    let at_start = page.text(text);
    assert!(page.text("document.querySelector('.plot svg').getAttribute('aria-label')").contains(&at_start));
    let [x, y] = page.middle(".plot svg");
    page.mouse("mouseMoved", [x, y]);
    page.wait(&format!("{text} !== {at_start:?}"));
    page.value("document.querySelector('#stage .controls button').click()");
    page.mouse("mouseMoved", [5.0, 5.0]);
    page.wait(&format!("{text} === ''"));
}

/// The bar of the change that a variable causes begins at the end of the bar of the margin, has its scale, and is marked as an approximation.
#[test]
fn bars_of_a_variable_have_the_scale_of_the_margins() {
    let Some((_place, _server, mut page)) = opened("open-bars", "shaper", [1400, 1000]) else { return };
    page.wait(SETTLED);
    page.value("document.querySelector('#sliders input[type=range]').focus()");
    let numbers =
        "[...document.querySelectorAll('.margin output, #objective output')].map((e) => e.textContent).join('|')";
    page.wait(&format!("({numbers}).split('|').every((number) => number.startsWith('Δ ≈ '))"));
    assert!(page.text("document.getElementById('moves').textContent").contains("about Δ"));
    let bars = "[...document.querySelectorAll('.margin')].map((e) => { const of = (q) => e.querySelector(q)?.getBoundingClientRect(); \
        const [t, i, u] = ['.track', 'i', 'u:not([hidden])'].map(of); if (!u || u.width < 4 || i.width < 2) return null; const ends = [u.left, u.right]; \
        const tip = e.querySelector('i').classList.contains('over') ? i.left : i.right; \
        const number = Number(e.querySelector('output').textContent.replace('Δ ≈ ', '').split(' ')[0].replace('\\u2212', '-')); \
        return [Math.min(...ends.map((x) => Math.abs(x - tip))), Number(e.dataset.margin) / (tip - t.left - t.width / 2), number / u.width]; }).filter(Boolean)";
    let found: Vec<[f64; 3]> = serde_json::from_value(page.value(bars)).unwrap();
    assert!(found.len() > 2);
    for [gap, scale, moved] in found {
        assert!(gap < 1.5, "the bar begins {gap} pixels from the end of that of the margin");
        assert!((moved.abs() / scale.abs() - 1.0).abs() < 0.3, "{moved} and {scale} for a pixel");
    }
}

/// A point whose place depends strongly on the design comes nearer to the pointer step by step: by the derivatives alone it jumped away, and
/// stayed where a design could not be analysed.
#[test]
fn a_dragged_point_does_not_jump_away() {
    let Some((_place, _server, mut page)) = opened("open-strong", "two-bar-truss", [1400, 1000]) else { return };
    // Drags a point at f(b) by five movements of the pointer and then lets it come to rest, as the page does with its analyses.
    let drag = "async (f, move) => { \
        const { draggable } = await import('./point.js'); \
        const [heard, lower, upper] = [{}, [0, 0], [1, 1]]; \
        const svg = { addEventListener: (kind, act) => { (heard[kind] ??= []).push(act); }, setPointerCapture() {}, getScreenCTM: () => new DOMMatrix(), style: {} }; \
        const mechanism = { svg, window: {}, frame: 0, place: (x, y) => [100 * x, 100 * y], unplace: (x, y) => [x / 100, y / 100], size: () => 2, hold() {}, play() {} }; \
        const parts = { guides: 0, plates: [], bars: [], beams: 0, springs: 0, lines: [], masses: 0, sliders: 0, ground: 0, joints: 1 }; \
        const slopes = (b) => b.map((_, k) => { const c = [...b]; c[k] += 1e-6; const [p, q] = [f(b), f(c)]; return [[0, 1].map((i) => (q[i] - p[i]) / 1e-6)]; }); \
        const record = (b, is_whole) => ({ design: [...b], motion: { parts, frames: [f(b)] }, derivatives: is_whole ? { motion: slopes(b) } : null }); \
        let [design, is_new] = [[0.5, 0.5], false]; \
        let base = record(design, true); \
        const propose = (values) => { design = values.map((v, k) => Math.min(Math.max(v, lower[k]), upper[k])); is_new = true; }; \
        const analysed = draggable(mechanism, () => ({ base, design, ranges: [1, 1], lower, upper }), propose, () => 0); \
        const [start, distances] = [f(design), []]; \
        const act = (kind, part) => heard[kind].forEach((one) => one({ clientX: 100 * (start[0] + part * move[0]), clientY: 100 * (start[1] + part * move[1]), preventDefault() {}, pointerId: 1 })); \
        const analyse = (is_whole) => { \
          is_new = false; \
          const [found, at] = [record(design, false), [...design]]; \
          if (!found.motion.frames[0].every(Number.isFinite)) return analysed(null, at); \
          distances.push(Math.hypot(...[0, 1].map((i) => found.motion.frames[0][i] - start[i] - move[i]))); \
          analysed(found, at); \
          if (is_whole && !is_new) { base = record(design, true); analysed(base, at); } \
        }; \
        act('pointerdown', 0); \
        for (let k = 1; k <= 5; k++) { act('pointermove', k / 5); analyse(false); analyse(false); } \
        for (let k = 0; k < 40; k++) { analyse(true); if (!is_new) break; } \
        return distances; \
      }";
    let distances = |page: &mut Page, f: &str, to: [f64; 2]| -> Vec<f64> {
        serde_json::from_value(page.value(&format!("({drag})({f}, {})", json!(to)))).unwrap()
    };
    let far = |d: &[f64]| d.iter().copied().fold(0.0, f64::max);
    // A point that depends weakly on the design, and one that flies, reach the pointer.
    for (f, to) in [
        ("([a, b]) => [a + 0.2 * b, b - 0.3 * a * a]", [0.3, 0.2]),
        ("([a, b]) => [3 * a * Math.cos(3 * (b - 0.2)), 3 * a * Math.sin(3 * (b - 0.2)) - 0.9]", [0.8, -1.0]),
    ] {
        let found = distances(&mut page, f, to);
        assert!(found.last().unwrap() < &1e-2 && far(&found) <= 1.01 * found[0], "{f}: {found:?}");
    }
    // One that cannot reach it, and one with designs without an analysis, stay near, and end nearer than they began.
    for lost in ["false", "b < 0.45"] {
        let f = format!("([a, b]) => ({lost} ? [NaN, NaN] : [Math.sin(9 * a) + 0.3 * b, Math.cos(7 * a * b + a)])");
        let found = distances(&mut page, &f, [-0.5, 0.4]);
        assert!(found.last().unwrap() < &found[0] && far(&found) < 1.5 * found[0], "{f}: {found:?}");
    }
}
