//! The report in a real browser: it renders, its scripts run without an error, the mechanism moves.
//!
//! Needs Chromium: without one the tests say so and pass, unless `REQUIRE_BROWSER=1` is set. `.ci/browser` installs it.

use crate::shell::TempFolder;
use resvg::tiny_skia::Pixmap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The browser, if one is installed: `$CHROMIUM`, or one of the usual names.
pub fn browser() -> Option<PathBuf> {
    let names = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let in_path = std::env::split_paths(&folders).flat_map(|folder| names.map(|name| folder.join(name)));
    let found = std::env::var_os("CHROMIUM").map(PathBuf::from).or_else(|| in_path.into_iter().find(|p| p.is_file()));
    if found.is_none() {
        assert!(std::env::var_os("REQUIRE_BROWSER").is_none_or(|v| v != "1"), "no Chromium; .ci/browser installs it");
        eprintln!("skipped: no Chromium in PATH; .ci/browser installs it");
    }
    found
}

struct Browser<'p> {
    program: PathBuf,
    place: &'p TempFolder,
}

impl Browser<'_> {
    /// Shows an address for two virtual seconds and returns what the browser prints.
    fn show(&self, address: &str, size: [u32; 2], wanted: &str) -> String {
        let profile = self.place.0.join(format!("profile-{}", address.len() + wanted.len() + size[0] as usize));
        let output = Command::new(&self.program)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run"])
            .args(["--disable-component-update", "--disable-dev-shm-usage", "--hide-scrollbars", "--mute-audio"])
            // A picture is taken only after its frame is finished, even on a busy machine.
            .args(["--run-all-compositor-stages-before-draw", "--disable-new-content-rendering-timeout"])
            .args(["--disable-checker-imaging", "--disable-threaded-animation", "--disable-threaded-scrolling"])
            .args([
                "--host-resolver-rules=MAP * ~NOTFOUND",
                "--virtual-time-budget=2000",
                "--force-device-scale-factor=1",
            ])
            .arg(format!("--user-data-dir={}", profile.display()))
            .arg(format!("--window-size={},{}", size[0], size[1]))
            .args([wanted, address])
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    fn screenshot(&self, address: &str, size: [u32; 2], name: &str) -> Pixmap {
        let file = self.place.0.join(name);
        self.show(address, size, &format!("--screenshot={}", file.display()));
        Pixmap::decode_png(&std::fs::read(file).unwrap()).unwrap()
    }
}

fn address(path: &Path) -> String {
    format!("file://{}", path.display())
}

/// The value of an attribute of the page as it is after its scripts have run.
fn attribute<'d>(dom: &'d str, name: &str) -> &'d str {
    let (_, rest) = dom.split_once(&format!("{name}=\"")).unwrap_or_else(|| panic!("the page has no {name}"));
    rest.split('"').next().unwrap()
}

/// Pixels that differ by more than the smoothing of round corners, with the rows of the first and last of them.
fn differences(a: &Pixmap, b: &Pixmap) -> (usize, u32, u32) {
    assert_eq!((a.width(), a.height()), (b.width(), b.height()));
    let far = |a: u8, b: u8| a.abs_diff(b) > 48;
    let differ = a
        .pixels()
        .iter()
        .zip(b.pixels())
        .enumerate()
        .filter(|(_, (a, b))| far(a.red(), b.red()) || far(a.green(), b.green()) || far(a.blue(), b.blue()));
    let rows: Vec<u32> = differ.map(|(k, _)| k as u32 / a.width()).collect();
    (rows.len(), rows.first().copied().unwrap_or(0), rows.last().copied().unwrap_or(0))
}

#[test]
fn from_nothing_to_a_page_whose_mechanism_moves() {
    let Some(program) = browser() else { return };
    let place = TempFolder::new("browser");
    place.run(&["new", "lift"], 0);
    place.run(&["optimize", "lift.toml", "--quiet"], 0);
    place.run(&["report", "out/lift", "--slice", "5", "--page-only"], 0);
    let page = place.0.join("out/lift/report.html");
    let browser = Browser { program, place: &place };

    let size = [1200, 1400];
    let shown =
        ["#t=0.0", "#t=0.5"].map(|t| browser.screenshot(&(address(&page) + t), size, &format!("{}.png", &t[3..])));
    // The mechanism has moved, and nothing else.
    let (count, first, last) = differences(&shown[0], &shown[1]);
    assert!(count > 2000 && first > 500 && last < 1300, "{count} pixels differ in rows {first} to {last}");

    // It renders: many shades, not one colour.
    let mut shades: Vec<[u8; 3]> = shown[0].pixels().iter().map(|p| [p.red(), p.green(), p.blue()]).collect();
    shades.sort_unstable();
    shades.dedup();
    assert!(shades.len() > 50, "{} shades", shades.len());

    // It moves by itself, and no script has failed.
    let dom = browser.show(&address(&page), size, "--dump-dom");
    assert_eq!(attribute(&dom, "data-state"), "ready");
    assert!(attribute(&dom, "data-frame").parse::<usize>().unwrap() > 0);

    // Keys, slider, button and the size of the page on a phone.
    let probe = "<script>
      const stage = document.querySelector('.scenes'), figure = stage.closest('figure');
      const slider = figure.querySelector('input[type=range]'), button = figure.querySelector('button');
      const seen = [];
      const press = (key) => { stage.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true })); seen.push(figure.dataset.frame); };
      ['Home', 'ArrowRight', 'PageDown', 'ArrowLeft', 'End'].forEach(press);
      slider.value = 42; slider.dispatchEvent(new Event('input')); seen.push(figure.dataset.frame);
      seen.push(button.textContent); button.click(); seen.push(button.textContent); button.click();
      const wide = [...document.querySelectorAll('main *')].filter((e) => !e.closest('.table, pre') && e.getBoundingClientRect().right > innerWidth + 1);
      document.documentElement.dataset.seen = seen.join(' ');
      document.documentElement.dataset.wide = wide.length + ' of ' + (document.documentElement.scrollWidth > innerWidth);
    </script></body>";
    let probed = place.0.join("probed.html");
    std::fs::write(&probed, place.read("out/lift/report.html").replace("</body>", probe)).unwrap();
    let dom = browser.show(&address(&probed), [390, 800], "--dump-dom");
    assert_eq!(attribute(&dom, "data-state"), "ready");
    assert_eq!(attribute(&dom, "data-seen"), "0 1 11 10 150 42 Play Pause");
    assert_eq!(attribute(&dom, "data-wide"), "0 of false");
}

/// Hover shows values in all histories and moves the mechanism; tables sort, copy and save; plots save; a printed page is complete.
#[test]
fn the_page_answers_the_pointer_and_prints_whole() {
    let Some(program) = browser() else { return };
    let place = TempFolder::new("pointer");
    place.run(&["new", "lift"], 0);
    place.run(&["optimize", "lift", "--quiet"], 0);
    place.run(&["report", "lift", "--slice", "0", "--page-only"], 0);
    let probe = "<script>window.addEventListener('load', () => {
      const root = document.documentElement.dataset;
      const figure = document.querySelector('#histories figure.plotted'), svg = figure.querySelector('svg');
      const panel = JSON.parse(figure.querySelector('script').textContent)[0], box = svg.getBoundingClientRect(), view = svg.viewBox.baseVal;
      const [left, top, width, height] = panel.frame;
      const at = (part) => ({ clientX: box.left + (left + part * width) / view.width * box.width, clientY: box.top + (top + height / 2) / view.height * box.height, bubbles: true });
      svg.dispatchEvent(new PointerEvent('pointermove', at(0.5)));
      root.readout = figure.querySelector('.readout').textContent;
      root.cursors = document.querySelectorAll('#histories .cursor').length + ' of ' + document.querySelectorAll('#histories figure.plotted').length;
      root.frame = document.querySelector('figure[data-frame]').dataset.frame;
      svg.dispatchEvent(new PointerEvent('pointerleave', {}));
      root.left = document.querySelectorAll('.cursor').length;
      const table = document.querySelector('#design .table'), heads = table.querySelectorAll('thead th button');
      const column = (k) => [...table.querySelectorAll('tbody tr')].map((row) => row.cells[k].textContent).join(' ');
      heads[3].click(); root.up = column(0);
      heads[3].click(); root.down = column(0);
      [...table.querySelectorAll('.tools button')].forEach((button) => button.click());
      root.copied = table.dataset.copied.split('\\n')[0].split('\\t').length + ' columns';
      root.table = table.dataset.saved.split('\\n')[0];
      figure.querySelector('.tools:not(.zoom) button').click();
      const press = (node, key, shiftKey) => node.dispatchEvent(new KeyboardEvent('keydown', { key, shiftKey, bubbles: true }));
      const drawing = document.querySelector('.scenes svg'), seen = [], frame = document.querySelector('figure[data-frame]');
      const still = frame.dataset.frame;
      [['+'], ['+'], ['ArrowRight', true], ['-'], ['0']].forEach(([key, shift]) => { press(drawing, key, shift); seen.push(drawing.dataset.zoom); });
      root.zoom = seen.join(' ');
      figure.querySelector('.zoom button').click();
      root.magnified = svg.dataset.zoom + ' ' + svg.classList.contains('zoomed') + ' ' + (frame.dataset.frame === still);
      const visible = svg.viewBox.baseVal;
      const numbers = [...svg.querySelectorAll('.axes text')].filter((text) => {
        const box = text.getBBox();
        return box.x >= visible.x && box.x + box.width <= visible.x + visible.width && box.y + box.height <= visible.y + visible.height;
      });
      root.axes = [numbers.length === svg.querySelectorAll('.axes text').length, numbers.length > 5].join(' ');
      const inside = svg.viewBox.baseVal, small = svg.getBoundingClientRect();
      const place = (x, y) => ({ clientX: small.left + (x - inside.x) / inside.width * small.width, clientY: small.top + (y - inside.y) / inside.height * small.height, bubbles: true });
      svg.dispatchEvent(new PointerEvent('pointermove', place(left + 0.5 * width, top + 0.5 * height)));
      root.again = figure.querySelector('.readout').textContent.slice(0, 12);
      const before = svg.viewBox.baseVal.x;
      svg.dispatchEvent(new PointerEvent('pointerdown', place(left + 0.5 * width, top)));
      svg.dispatchEvent(new PointerEvent('pointermove', { ...place(left + 0.6 * width, top), buttons: 1 }));
      root.dragged = svg.viewBox.baseVal.x < before;
      root.plot = figure.dataset.saved.split('\\n').length;
      window.dispatchEvent(new Event('beforeprint'));
      root.closed = document.querySelectorAll('details:not([open])').length;
      root.whole = document.querySelectorAll('.axes').length;
    });</script></body>";
    let page = place.read("out/lift/report.html").replace("</body>", probe);
    let probed = place.0.join("probed.html");
    std::fs::write(&probed, page).unwrap();
    let browser = Browser { program, place: &place };
    let dom = browser.show(&address(&probed), [1200, 900], "--dump-dom");
    assert_eq!(attribute(&dom, "data-state"), "ready");
    let readout = attribute(&dom, "data-readout");
    assert!(
        readout.contains("first design") && readout.contains("last design") && readout.contains("1.5"),
        "{readout}"
    );
    let (shown, all) = attribute(&dom, "data-cursors").split_once(" of ").unwrap();
    // The third history begins at 2 s, after the time of the pointer.
    assert_eq!((shown, all), ("2", "3"));
    assert_eq!(attribute(&dom, "data-left"), "0");
    // Half of three seconds is frame 75 of 150, up to a pixel.
    let frame: i32 = attribute(&dom, "data-frame").parse().unwrap();
    assert!((frame - 75).abs() <= 1, "{frame}");
    assert_eq!(attribute(&dom, "data-up"), "peak stiffness damping");
    assert_eq!(attribute(&dom, "data-down"), "damping stiffness peak");
    assert_eq!(attribute(&dom, "data-copied"), "8 columns");
    assert_eq!(attribute(&dom, "data-table"), "variable,unit,first,last,change in %,lower bound,upper bound,remark");
    assert!(attribute(&dom, "data-plot").parse::<usize>().unwrap() > 2 * 151);
    // The keys zoom by 1.5, Shift with an arrow moves, 0 shows all; neither disturbs the animation.
    assert_eq!(attribute(&dom, "data-zoom"), "1.50 2.25 2.25 1.50 1.00");
    assert_eq!(attribute(&dom, "data-magnified"), "1.50 true true");
    // An enlarged figure has axes of its visible part, a whole one has its own.
    assert_eq!(attribute(&dom, "data-axes"), "true true");
    assert_eq!(attribute(&dom, "data-whole"), "0");
    // The pointer reads the same value in the enlarged figure, and drags it.
    assert_eq!(attribute(&dom, "data-again"), readout.chars().take(12).collect::<String>());
    assert_eq!(attribute(&dom, "data-dragged"), "true");
    assert_eq!(attribute(&dom, "data-closed"), "0");
}

/// The pointer reads the plotted values next to it: at a time point of a history, the nearest mark of a plane. The numbers of a plot are
/// complete, and contents and choice of a cycle do not cover each other.
#[test]
fn the_pointer_reads_plotted_values() {
    let Some(program) = browser() else { return };
    let place = TempFolder::new("readout");
    place.example("shaper");
    place.run(&["optimize", "shaper", "--quiet"], 0);
    place.run(&["report", "shaper", "--slice", "5", "--page-only"], 0);
    let probe = "<script>window.addEventListener('load', () => {
      const root = document.documentElement.dataset;
      const of = (name) => {
        const figure = document.querySelector(`figure[data-name^=${name}]`), svg = figure.querySelector('svg');
        const panel = JSON.parse(figure.querySelector('script').textContent)[0], [left, top, width, height] = panel.frame;
        const part = (v, [low, high]) => (v - low) / (high - low);
        const point = ([x, y], dx = 0) => {
          const box = svg.getBoundingClientRect(), view = svg.viewBox.baseVal;
          svg.dispatchEvent(new PointerEvent('pointermove', { bubbles: true,
            clientX: box.left + (left + dx + part(x, panel.x) * width) / view.width * box.width,
            clientY: box.top + (top + (1 - part(y, panel.y)) * height) / view.height * box.height }));
          return figure.querySelector('.readout').textContent;
        };
        return { figure, panel, point };
      };
      const short = (v) => String(Number(v.toPrecision(5))).replace('-', '\u{2212}');
      const history = of('history'), [first] = history.panel.series, k = 20;
      const [[t, v], [next]] = [first.points[k], first.points[k + 1]];
      root.history = history.point([t + 0.3 * (next - t), v]);
      root.expected = `${history.panel.label[0]} ${short(t)}: ${first.name} ${short(v)}`;
      const plane = of('design-plane'), contour = plane.panel.series.find(({ name }) => name.includes(' = '));
      root.contour = plane.point(contour.points[1]);
      root.level = contour.name;
      root.contours = new Set(plane.panel.series.filter(({ name }) => name.includes(' = ')).map(({ name }) => name.replace(/, part.*/, ''))).size;
      const rows = of('predicted-constraints'), last = rows.panel.series.find(({ name }) => name === 'last cycle');
      root.rows = rows.point(last.points[0], 0.5);
      rows.figure.querySelector('.tools:not(.zoom) button').click();
      root.saved = rows.figure.dataset.saved.split('\\n').filter((line) => line.includes('last cycle')).length - last.points.length;
      const variable = of('variable');
      variable.figure.querySelector('.tools:not(.zoom) button').click();
      root.regions = variable.figure.dataset.saved.includes('subregion of cycle 1');
      scrollTo(0, 3000);
      const [nav, bar] = [document.querySelector('nav'), document.getElementById('chooser')].map((e) => e.getBoundingClientRect());
      root.bars = [nav.top >= 0, bar.top >= nav.bottom].join(' ');
    });</script></body>";
    let page = place.read("out/shaper/report.html").replace("</body>", probe).replace("scroll-behavior: smooth", "");
    std::fs::write(place.0.join("probed.html"), page).unwrap();
    let browser = Browser { program, place: &place };
    let dom = browser.show(&address(&place.0.join("probed.html")), [1280, 900], "--dump-dom");
    assert_eq!(attribute(&dom, "data-state"), "ready");
    let (shown, expected) = (attribute(&dom, "data-history"), attribute(&dom, "data-expected"));
    assert!(shown.starts_with(expected), "{shown} and {expected}");
    let level = attribute(&dom, "data-level");
    assert!(attribute(&dom, "data-contour").starts_with(&format!("{level}: ")), "{level}");
    assert!(attribute(&dom, "data-contours").parse::<usize>().unwrap() > 2);
    let rows = attribute(&dom, "data-rows");
    // Points of other cycles may lie there, too.
    let is_point = ["last cycle: computed ", "earlier cycles: computed "].iter().any(|begin| rows.starts_with(begin));
    assert!(is_point && rows.contains(", predicted "), "{rows}");
    assert_eq!(attribute(&dom, "data-saved"), "0");
    assert_eq!(attribute(&dom, "data-regions"), "true");
    assert_eq!(attribute(&dom, "data-bars"), "true true");
}

/// A mechanism in space turns with the pointer, with keys and by the choice of a view, and fits on a phone.
#[test]
fn a_mechanism_in_space_turns() {
    let Some(program) = browser() else { return };
    let place = TempFolder::new("turns");
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/models/double-wishbone-space.toml");
    place.run(&["analyze", model, "--out", "out"], 0);
    let probe = "<script>window.addEventListener('load', () => {
      const root = document.documentElement.dataset, figure = document.querySelector('figure[data-frame]');
      const stage = figure.querySelector('.scenes'), svg = stage.querySelector('svg'), view = figure.querySelector('select.view');
      const press = (key, shiftKey) => stage.dispatchEvent(new KeyboardEvent('keydown', { key, shiftKey, bubbles: true }));
      const drawn = () => [...svg.querySelectorAll('.linkage path, .linkage circle')].map((node) => node.getAttribute('d') || node.getAttribute('transform')).join();
      const trace = () => svg.querySelector('.trace').getAttribute('d');
      press('Home');
      const first = drawn(), path = trace();
      press('ArrowLeft', true);
      root.keys = [drawn() !== first, trace() !== path, figure.dataset.frame, view.value].join(' ');
      press('ArrowRight', true);
      root.back = drawn() === first;
      svg.dispatchEvent(new PointerEvent('pointerdown', { clientX: 100, clientY: 100, bubbles: true }));
      svg.dispatchEvent(new PointerEvent('pointermove', { clientX: 150, clientY: 120, buttons: 1, bubbles: true }));
      root.dragged = drawn() !== first;
      view.selectedIndex = 1; view.dispatchEvent(new Event('change'));
      // From the front, y is along the view: the ends of its axis coincide, and x is to the right.
      root.axes = [...svg.querySelectorAll('.triad path')].map((node) => node.getAttribute('d')).join(' ');
      view.selectedIndex = 0; view.dispatchEvent(new Event('change'));
      root.again = drawn() === first;
      root.wide = document.documentElement.scrollWidth > innerWidth;
    });</script></body>";
    let page = place.read("out/report.html");
    assert!(page.len() < 1_000_000, "{} bytes", page.len());
    let probed = place.0.join("probed.html");
    std::fs::write(&probed, page.replace("</body>", probe)).unwrap();
    let dom = Browser { program, place: &place }.show(&address(&probed), [390, 800], "--dump-dom");
    assert_eq!(attribute(&dom, "data-state"), "ready");
    assert_eq!(attribute(&dom, "data-keys"), "true true 0 turned");
    for name in ["back", "dragged", "again"] {
        assert_eq!(attribute(&dom, &format!("data-{name}")), "true", "{name}");
    }
    assert_eq!(attribute(&dom, "data-axes"), "M0 0L24 0 M0 0L0 0 M0 0L0 -24");
    assert_eq!(attribute(&dom, "data-wide"), "false");
}

/// A click on a cycle, in the table or in a plot, and the choice by keyboard show its design: numbers, curves, motion.
#[test]
fn the_page_shows_the_design_of_a_chosen_cycle() {
    let Some(program) = browser() else { return };
    let place = TempFolder::new("cycles");
    place.run(&["new", "lift"], 0);
    place.run(&["optimize", "lift", "--quiet"], 0);
    place.run(&["report", "lift", "--slice", "0", "--page-only"], 0);
    let probe = "<script>window.addEventListener('load', () => {
      const root = document.documentElement.dataset, chooser = document.getElementById('chooser');
      const heading = () => [...document.querySelectorAll('.scenes h3')].pop().textContent;
      const bar = () => [...document.querySelectorAll('.scenes svg')].pop().querySelector('.linkage').outerHTML;
      const output = () => chooser.querySelector('output').textContent;
      const motion = document.querySelector('.scenes'), press = (key) => motion.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }));
      press('End');
      root.hidden = chooser.hidden + ' ' + document.querySelectorAll('path.chosen').length;
      const last = bar();
      const rows = [...document.querySelectorAll('#convergence .table tbody tr')];
      rows.find((row) => row.cells[0].textContent === '1' && row.cells[1].textContent === 'accepted').click();
      root.row = [chooser.dataset.cycle, heading(), document.querySelectorAll('#histories path.chosen').length, document.querySelectorAll('tr.chosen').length].join('|');
      root.moved = bar() !== last;
      root.numbers = output();
      const history = document.querySelector('#histories figure.plotted'), svg = history.querySelector('svg');
      const panel = JSON.parse(history.querySelector('script').textContent)[0], box = svg.getBoundingClientRect(), view = svg.viewBox.baseVal;
      const [left, top, width, height] = panel.frame;
      svg.dispatchEvent(new PointerEvent('pointermove', { clientX: box.left + (left + 0.5 * width) / view.width * box.width, clientY: box.top + (top + height / 2) / view.height * box.height, bubbles: true }));
      root.readout = history.querySelector('.readout').textContent.includes('cycle 1');
      const plot = document.querySelector('#convergence figure.plotted'), drawn = plot.querySelector('svg');
      const first = JSON.parse(plot.querySelector('script').textContent)[0], place = drawn.getBoundingClientRect(), whole = drawn.viewBox.baseVal;
      const part = (0 - first.x[0]) / (first.x[1] - first.x[0]);
      drawn.dispatchEvent(new MouseEvent('click', { clientX: place.left + (first.frame[0] + part * first.frame[2]) / whole.width * place.width, clientY: place.top + 5, bubbles: true }));
      root.plot = chooser.dataset.cycle + '|' + heading();
      chooser.querySelector('button').click();
      press('End');
      root.back = chooser.dataset.cycle + '|' + heading() + '|' + document.querySelectorAll('path.chosen').length + '|' + (bar() === last);
      chooser.querySelectorAll('button')[1].click();
      root.next = chooser.dataset.cycle;
      root.labelled = [...chooser.querySelectorAll('button')].every((b) => b.getAttribute('aria-label')) + ' ' + chooser.getAttribute('aria-label');
    });</script></body>";
    let page = place.read("out/lift/report.html").replace("</body>", probe);
    std::fs::write(place.0.join("probed.html"), page).unwrap();
    let browser = Browser { program, place: &place };
    let dom = browser.show(&address(&place.0.join("probed.html")), [1200, 900], "--dump-dom");
    assert_eq!(attribute(&dom, "data-state"), "ready");
    assert_eq!(attribute(&dom, "data-hidden"), "false 0");
    let histories = place.read("out/lift/report.html").matches("data-name=\"history-").count();
    let others = place.read("out/lift/report.html").matches("data-name=\"response-").count();
    assert_eq!(attribute(&dom, "data-row"), format!("1|design of cycle 1|{}|1", histories + others));
    assert_eq!(attribute(&dom, "data-moved"), "true");
    let numbers = attribute(&dom, "data-numbers");
    assert!(numbers.contains("largest violation") && numbers.contains("stiffness"), "{numbers}");
    assert_eq!(attribute(&dom, "data-readout"), "true");
    assert_eq!(attribute(&dom, "data-plot"), "0|design of cycle 0");
    assert_eq!(attribute(&dom, "data-back"), "|last design|0|true");
    assert_eq!(attribute(&dom, "data-next"), "0");
    assert_eq!(attribute(&dom, "data-labelled"), "true Design of a cycle");
}

/// Names of bodies and points do not cover each other at any time, and stay in the drawing.
#[test]
fn names_in_the_drawing_avoid_each_other() {
    let Some(program) = browser() else { return };
    let place = TempFolder::new("names");
    place.example("trebuchet");
    place.run(&["analyze", "trebuchet", "--out", "a", "--quiet"], 0);
    let probe = "<script>window.addEventListener('load', () => {
      const figure = document.querySelector('.linkwright-animation'), slider = figure.querySelector('input[type=range]');
      const naming = figure.querySelector('input.naming');
      if (naming && !naming.checked) { naming.checked = true; naming.dispatchEvent(new Event('change')); }
      let [most, covered, outside] = [0, 0, 0];
      const svg = figure.querySelector('svg'), stage = svg.getBoundingClientRect();
      for (let k = 0; k <= Number(slider.max); k += 5) {
        slider.value = k; slider.dispatchEvent(new Event('input'));
        const boxes = [...svg.querySelectorAll('.linkage > .names text')].filter((text) => text.style.display !== 'none').map((text) => text.getBoundingClientRect());
        most = Math.max(most, boxes.length);
        boxes.forEach((a, i) => {
          covered += boxes.slice(0, i).filter((b) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 3 && b.top < a.bottom - 3).length;
          outside += a.left < stage.left - 1 || a.right > stage.right + 1 || a.top < stage.top - 1 || a.bottom > stage.bottom + 1;
        });
      }
      Object.assign(document.documentElement.dataset, { names: most, covered, outside });
    });</script></body>";
    let page = place.read("a/report.html").replace("</body>", probe);
    std::fs::write(place.0.join("probed.html"), page).unwrap();
    let browser = Browser { program, place: &place };
    let dom = browser.show(&address(&place.0.join("probed.html")), [1200, 900], "--dump-dom");
    assert_eq!(attribute(&dom, "data-state"), "ready");
    assert!(attribute(&dom, "data-names").parse::<usize>().unwrap() > 2);
    assert_eq!((attribute(&dom, "data-covered"), attribute(&dom, "data-outside")), ("0", "0"));
}

/// Two runs on one page: both mechanisms move, tables and curves name both runs, nothing is loaded.
#[test]
fn two_runs_are_shown_on_one_page() {
    let place = TempFolder::new("two-runs");
    place.run(&["new", "lift"], 0);
    place.run(&["optimize", "lift", "--quiet"], 0);
    place.run(&["optimize", "lift", "--quiet", "--method", "mma", "--max-cycles", "3"], 3);
    let wrote = place.run(&["report", "lift", "lift-2"], 0);
    assert!(wrote.contains("compared.html"), "{wrote:?}");
    let page = place.read("out/lift/compared.html");
    for text in ["Settings that differ", "B − A", "A: ", "B: ", "data-name=\"objective\"", "data-name=\"history-1\""]
    {
        assert!(page.contains(text) || page.contains(&text.replace('−', "-")), "{text} is missing");
    }
    for address in ["http:", "https:", "src=", "@import", "url("] {
        assert!(!page.replace("url(#", "").contains(address), "{address}");
    }
    assert!(page.len() < 1_000_000);
    // Each run has one line in all plots.
    for name in ["objective", "violation", "history-1"] {
        let figure = page.split(&format!("data-name=\"{name}\"")).nth(1).unwrap().split("</figure>").next().unwrap();
        let line = |colour: &str, is_dashed: bool| {
            let lines = figure.lines().filter(|line| line.contains(&format!("stroke=\"{colour}\" stroke-width=\"1\"")));
            lines.clone().count() > 0 && lines.clone().all(|line| line.contains("stroke-dasharray") == is_dashed)
        };
        assert!(line("#000000", false) && line("#0072b2", true), "{name}");
    }
    place.run(&["report", "lift", "lift-2", "-o", "both", "--quiet"], 0);
    assert_eq!(place.read("both/report.html"), page);
    // Both mechanisms move over the times that both runs have.
    place
        .run(&["optimize", "lift", "--quiet", "--set", "time.to=2.5", "--set", "time.points=126", "--out", "short"], 0);
    for (pair, out) in [(["lift", "short"], "one"), (["short", "lift"], "other")] {
        place.run(&["report", pair[0], pair[1], "-o", out, "--quiet"], 0);
        let page = place.read(&format!("{out}/report.html"));
        assert!(!page.contains("cannot be shown") && page.contains("The last designs of both runs."), "{pair:?}");
    }
    let Some(program) = browser() else { return };
    let browser = Browser { program, place: &place };
    let dom = browser.show(&(address(&place.0.join("both/report.html")) + "#t=1.0"), [1200, 900], "--dump-dom");
    assert_eq!(attribute(&dom, "data-state"), "ready");
    assert!(attribute(&dom, "data-frame").parse::<usize>().unwrap() > 0);
}

/// The book draws its formulas without the network: each becomes MathML, and no command is unknown.
#[test]
fn formulas_of_the_book_need_no_network() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let folders = [docs.clone(), docs.join("theory"), docs.join("models"), docs.join("howto")];
    let mut formulas: Vec<String> = vec![];
    for folder in folders {
        let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        for file in files.iter().filter(|file| file.extension().is_some_and(|e| e == "md")) {
            let text = std::fs::read_to_string(file).unwrap();
            let blocks = text.split("```math\n").skip(1).map(|block| block.split("```").next().unwrap().to_owned());
            formulas.extend(blocks);
        }
    }
    assert!(formulas.len() > 10);
    let script = std::fs::read_to_string(docs.join("math.js")).unwrap();
    for address in ["http:", "https:", "import", "src"] {
        assert!(!script.replace("http://www.w3.org/1998/Math/MathML", "").contains(address), "{address}");
    }
    assert!(!std::fs::read_to_string(docs.join("book.toml")).unwrap().contains("mathjax"));
    let Some(program) = browser() else { return };
    let escaped = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;");
    let blocks = formulas.iter().map(|f| format!("<pre><code class=\"language-math\">{}</code></pre>", escaped(f)));
    let page = format!(
        "<!DOCTYPE html><html data-state=\"no error\"><meta charset=utf-8><body>{}\
         <script>addEventListener('error', (e) => {{ document.documentElement.dataset.state = e.message; }})</script>\
         <script>{script}</script><script>\
         const of = (text) => [...document.querySelectorAll('math')].filter((m) => m.textContent.includes(text)).length;\
         document.documentElement.dataset.drawn = document.querySelectorAll('math').length;\
         document.documentElement.dataset.halves = [...document.querySelectorAll('mfrac')].filter((m) => m.textContent === '12').length;\
         document.documentElement.dataset.left = of('\\\\') + document.querySelectorAll('code').length;</script></body></html>",
        blocks.collect::<String>()
    );
    let place = TempFolder::new("formulas");
    std::fs::write(place.0.join("formulas.html"), page).unwrap();
    let browser = Browser { program, place: &place };
    let dom = browser.show(&address(&place.0.join("formulas.html")), [1000, 900], "--dump-dom");
    assert_eq!(attribute(&dom, "data-state"), "no error");
    assert_eq!(attribute(&dom, "data-drawn"), formulas.len().to_string());
    assert_eq!((attribute(&dom, "data-halves"), attribute(&dom, "data-left")), ("3", "0"));
}
