// The page: sliders, the approximation that is shown at once, and the results that follow after the analysis.

import * as server from "./server.js";
import { effects, predict, predictFrame } from "./predict.js";
import { Mechanism } from "./mechanism.js";
import { Plot, short, withUnit } from "./plots.js";
import { inNextFrame, soon, whenDrawn } from "./frames.js";
import { Numbers, say } from "./numbers.js";
import { draggable } from "./point.js";
import { zoomable } from "./zoom.js";
import { Run } from "./run.js";
import { Editor, limitText } from "./editor.js";
import { Completer } from "./complete.js";
import { button, cells, make, table } from "./elements.js";
import { connection } from "./connection.js";

const root = document.documentElement;
window.addEventListener("error", (event) => { root.dataset.state = `error: ${event.message}`; });
window.addEventListener("unhandledrejection", (event) => { root.dataset.state = `error: ${event.reason}`; });

const by = (id) => document.getElementById(id);

// Time after which the server stops an analysis for a newer request; up to then one request at a time is sent.
const SUPERSEDE_AFTER = 110;
// Time without a change of a slider after which derivatives are computed.
const PAUSE = 60;
// Largest number of pinned designs.
const PINS = 4;

const mechanism = new Mechanism(by("stage"));
zoomable(mechanism, by("stage"), by("zoom"));
mechanism.view.append(by("zoom"));
const numbers = new Numbers(by("objective"), by("margins"));
let model = null;       // the description of the model in force
let revision = 0;
let design = [];        // the design of the sliders
let shown = null;       // the record that was analysed last
let base = null;        // the last record with derivatives
let pins = [];
let controls = [];
let plots = [];
let sequence = 0;       // number of the newest design
let answered = 0;       // number of the design of `shown`
let pending = null;     // { number, since } of the request that was sent last
let timers = { next: 0, rest: 0, clock: 0 };
let last_seconds = null;

// ---- Status

function status(word, kind, note = "") {
  by("status").textContent = word;
  by("status").className = `pill ${kind}`;
  by("note").textContent = note;
}

// Errors of the file, and of the present design; each stays until its own reason is gone. Those of the design lie over the drawing of the
// mechanism, or below the sliders of a model without one: they hide no control, and the sliders do not shift while one of them or a point is
// dragged. They can be closed.
const places = { file: "fault", design: "design-fault", drag: "drag-note" };
function fault(kind, text) {
  const place = by(places[kind]);
  // A message that was closed stays closed until there is another one.
  if ((text ?? "") === place.dataset.text) return;
  place.dataset.text = text ?? "";
  place.hidden = !text;
  place.replaceChildren(...(text && kind !== "file" ? [button("Close", () => { place.hidden = true; })] : []), text ?? "");
}

// ---- Sliders

// Bounds of a variable: those of the file, and closer ones that were set in the run.
let of_run = null;
function bounds(k) {
  const { lower, upper } = model.variables[k];
  const closest = (pick, all) => { const known = all.filter((v) => v !== null && v !== undefined); return known.length ? pick(...known) : null; };
  return { lower: closest(Math.max, [lower, of_run?.lower[k]]), upper: closest(Math.min, [upper, of_run?.upper[k]]) };
}

function boundsOfRun(found) {
  const is_same = JSON.stringify(found) === JSON.stringify(of_run);
  const fits = !found || String(found.names) === String(model.variables.map(({ name }) => name));
  if (is_same || !fits) return;
  of_run = found;
  buildSliders();
}

function range(k) {
  const variable = { ...model.variables[k], ...bounds(k) };
  const size = Math.max(Math.abs(variable.start), 1);
  return [variable.lower ?? Math.min(variable.start - size, (variable.upper ?? Infinity) - size), variable.upper ?? variable.start + size];
}

function buildSliders() {
  controls = model.variables.map((variable, k) => {
    const [low, high] = range(k);
    const label = make("label", { for: `value-${k}` }, variable.name, " ", make("small", { text: variable.unit }));
    const number = make("input", { type: "number", id: `value-${k}`, step: "any", value: design[k] });
    const slider = make("input", { type: "range", min: low, max: high, step: "any", value: design[k], "aria-label": `${variable.name} in ${variable.unit || "no unit"}`, "data-variable": variable.name });
    const ends = make("div", { class: "ends" }, make("span", { text: short(low) }), make("span", { text: short(high) }));
    const box = make("div", { class: "box", title: "move limits of the last step" });
    const row = make("div", { class: "variable" }, label, number, slider, box, ends);
    slider.addEventListener("input", () => move(k, Number(slider.value)));
    // Arrow keys move by a hundredth of the range; with `step="any"` browsers differ.
    slider.addEventListener("keydown", (event) => {
      const steps = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 };
      if (!(event.key in steps)) return;
      event.preventDefault();
      move(k, design[k] + (steps[event.key] * (high - low)) / 100);
    });
    number.addEventListener("change", () => { if (number.value !== "" && Number.isFinite(Number(number.value))) move(k, Number(number.value)); else number.value = design[k]; });
    ["pointerenter", "focusin"].forEach((kind) => row.addEventListener(kind, () => choose(k)));
    row.addEventListener("pointerleave", () => { if (!row.contains(document.activeElement)) choose(null); });
    row.addEventListener("focusout", () => choose(null));
    return { row, slider, number, box, ends };
  });
  by("sliders").replaceChildren(...controls.map((control) => control.row));
  controls.forEach((_, k) => markBounds(k));
}

function clamp(k, value) {
  const { lower, upper } = bounds(k);
  return Math.min(Math.max(value, lower ?? -Infinity), upper ?? Infinity);
}

// Marks the end of a slider where the variable is at its bound.
function markBounds(k) {
  const { lower, upper } = bounds(k);
  const near = (bound) => bound !== null && Math.abs(design[k] - bound) <= 1e-9 * Math.max(Math.abs(bound), (upper ?? 0) - (lower ?? 0));
  [lower, upper].forEach((bound, end) => {
    const mark = controls[k].ends.children[end];
    say(mark, near(bound) ? `at its bound, ${short(bound)}` : short(range(k)[end]));
    mark.classList.toggle("reached", near(bound));
  });
}

function place(k, value) {
  design[k] = clamp(k, value);
  const { slider, number } = controls[k];
  if (Number(slider.value) !== design[k]) slider.value = design[k];
  number.value = Number(design[k].toPrecision(8));
  markBounds(k);
  slider.setAttribute("aria-valuetext", withUnit(design[k], model.variables[k].unit));
}

function move(k, value) {
  place(k, value);
  changed();
}

// The move limits of a step on the sliders; null for none.
function showBox(region) {
  controls.forEach(({ box }, k) => {
    if (!region) return box.replaceChildren();
    const [low, high] = range(k);
    const part = (v) => 100 * Math.min(Math.max((v - low) / (high - low), 0), 1);
    const mark = make("i");
    Object.assign(mark.style, { left: `${part(region.lower[k])}%`, width: `${part(region.upper[k]) - part(region.lower[k])}%` });
    box.replaceChildren(mark);
  });
}

function moveTo(values) {
  values.forEach((value, k) => place(k, value));
  changed();
}

// ---- Approximation at once, then the analysis

function changed() {
  sequence += 1;
  inNextFrame("approximation", approximate);
  schedule();
}

function schedule() {
  // One request at a time, until the server would stop it for a newer one.
  clearTimeout(timers.next);
  clearTimeout(timers.rest);
  if (!pending) return send(false);
  timers.next = setTimeout(() => { if (answered < sequence) send(false); }, Math.max(0, SUPERSEDE_AFTER - (performance.now() - pending.since)));
}

async function send(derivatives) {
  const mine = { number: sequence, since: performance.now(), derivatives };
  const at = [...design];
  let again = 0; // time after which a newer design is sent; null after an error of the connection
  pending = mine;
  status(derivatives ? "differentiating" : "analysing", "fair");
  by("cancel").disabled = false;
  clearInterval(timers.clock);
  timers.clock = setInterval(() => {
    const seconds = (performance.now() - mine.since) / 1000;
    if (seconds > 0.5) status("analysing", "fair", `${seconds.toFixed(1)} s${last_seconds > Math.max(0.5, seconds) ? ` of about ${short(last_seconds)} s` : ""}`);
  }, 200);
  try {
    const record = await server.analyze(revision, at, derivatives);
    if (mine.number < answered) return;
    answered = mine.number;
    if (record.error) {
      fault("design", record.error);
      status("no analysis here", "bad", shown ? "the picture is that of the last good design" : "there is no picture yet");
      showFailure();
      root.dataset.answered = mine.number;
      follow(null, at);
      return;
    }
    fault("design", null);
    record.number = mine.number;
    last_seconds = (performance.now() - mine.since) / 1000;
    take(record);
  } catch (error) {
    again = error instanceof server.Outdated ? 30 : null;
    if (again === null) status("no connection", "bad", String(error.message));
  } finally {
    if (pending === mine) {
      pending = null;
      clearInterval(timers.clock);
      by("cancel").disabled = true;
      if (answered < sequence && again !== null) timers.next = setTimeout(() => { if (!pending && answered < sequence) send(false); }, again);
      else if (shown && shown.number === sequence && !shown.derivatives && model.objective) timers.rest = setTimeout(() => { if (!pending) send(true); }, PAUSE);
    }
  }
}

// Shows the difference between approximation and analysis of the same design.
let prediction = null;
function approximate() {
  const is_known = shown?.derivatives && shown.number === sequence;
  prediction = base && !is_known ? { number: sequence, ...predict(base, design, model.constraints) } : null;
  showPrediction();
}

function take(record) {
  shown = record;
  if (record.derivatives) base = record;
  root.dataset.answered = record.number;
  delete root.dataset.failed;
  by("design-state").hidden = true;
  status("analysed", "good", record.seconds > 0 ? `in ${short(record.seconds * 1000)} ms` : "");
  if (record.warnings.length) by("note").textContent += `; ${record.warnings.join("; ")}`;
  mechanism.set("analysed", record.motion?.parts, record.motion ? (frame) => record.motion.frames[frame] : null, "linkage");
  mechanism.keepInside();
  showNumbers();
  showValues();
  if (record.derivatives) prediction = null;
  if (!prediction) showPrediction();
  if (record.derivatives && chosen !== null) choose(chosen);
  plots.forEach(({ plot, output, constraint }) => {
    plot.set("analysed", "line", historyOf(record, output, constraint));
    plot.limit(limitsOf(output, constraint));
    plot.draw();
  });
  follow(record, record.design);
  const settled = `${record.number}${record.derivatives || !model.objective ? " differentiated" : ""}`;
  whenDrawn(() => { if (record.number === sequence) root.dataset.settled = settled; });
}

// The values of the output, or without one of the constraint, of a plot.
const historyOf = (record, output, constraint) => ({ values: output === undefined ? record.constraints[constraint].values : record.outputs[output] });

// True for a constraint that is drawn as a curve with the history of an output.
const isCurve = (c, output) => c.output === null && c.follows === output;

function limitsOf(output, constraint) {
  const all = model.constraints.map((c, j) => ({ ...c, value: shown.constraints[j].limit, j }));
  if (output === undefined) return all.filter((c) => c.j === constraint);
  // The limit of x(t) − f(t) is the curve f(t) + limit, drawn with x(t).
  const curve = (c) => shown.constraints[c.j].values.map((v, p) => (v === null ? null : shown.outputs[output][p] - v + c.value));
  return all.filter((c) => c.output === output || isCurve(c, output)).map((c) => (c.output === output ? c : { ...c, curve: curve(c) }));
}

function showPrediction() {
  const is_new = prediction && (!shown || prediction.number !== shown.number);
  const motion = prediction && base?.derivatives.motion && base.motion;
  const at = [...design];
  mechanism.set("predicted", motion?.parts, motion ? (frame) => predictFrame(base, at, frame) : null);
  // The numbers of frames belong to the same parts.
  const is_undrawn = shown && model.drawing_times && !shown.motion;
  by("legend").textContent = is_undrawn ? "Not drawn here: the parts of the mechanism change during the motion. The page that analyze --out writes shows it."
    : prediction ? "dashed: approximation; solid: analysed" : "";
  plots.forEach(({ plot, output, constraint }) => {
    const rows = prediction && (output === undefined ? prediction.constraints[constraint] : prediction.outputs[output]);
    plot.set("predicted", "predicted", rows);
    if (shown) plot.draw();
  });
  if (is_new || !prediction) { showNumbers(); showValues(); }
  showMoves();
}

// ---- Objective and margins

// Numbers of the last good design are pale while the present one has none; those of another model are removed.
function showFailure() {
  root.dataset.failed = "";
  by("design-state").hidden = false;
  if (shown) return;
  numbers.none("This design has not been analysed.");
}

// Outputs without a history, such as times of events and values at them.
const showValues = () => soon("values", drawValues);

function drawValues() {
  const all = model.outputs.flatMap((output, h) => (output.changes ? [] : [{ ...output, h }]));
  by("values").hidden = all.length === 0;
  by("histories").hidden = plots.length === 0 && all.length === 0;
  if (!shown) return by("value-table").replaceChildren();
  by("value-table").replaceChildren(...table(["output", "unit", "value", "≈ approximation"], all.map(({ name, unit, h }) => {
    const row = make("tr", { "data-output": name });
    cells(row, [name, unit, shown.outputs[h][0], prediction?.outputs[h].values[0] ?? ""]);
    return row;
  })));
}

const showNumbers = () => inNextFrame("numbers", drawNumbers);

function drawNumbers() {
  if (shown) numbers.show(shown, prediction, moved().of);
}

// ---- What a variable moves

let chosen = null;
function choose(k) {
  chosen = k;
  controls.forEach(({ row }, i) => row.classList.toggle("chosen", i === k));
  showNumbers();
  const { step } = moved();
  const motion = step ? base.derivatives.motion : null;
  mechanism.arrows(base?.motion?.parts, motion ? (frame) => motion[k][frame] : null, step / 2);
  showMoves();
}

// What the numbers beside the bars mean.
function showMoves() {
  const { step } = moved();
  by("moves").textContent = prediction ? "Numbers with ≈ are approximations at this design, until it has been analysed."
    : step ? `${model.variables[chosen].name} + ${withUnit(step, model.variables[chosen].unit)}, a tenth of its range, moves them by about Δ (orange bars).`
    : "Point at a variable, touch it, or move to it with the keyboard, to see what it moves.";
}

// A tenth of the range of the chosen variable, and what it moves to first order: by constraint, and under null the objective.
function moved() {
  if (chosen === null || !base?.derivatives) return { step: 0, of: new Map() };
  const [low, high] = range(chosen);
  const step = (high - low) / 10;
  return { step, of: new Map(effects(base, chosen, model).map((one) => [one.constraint, { change: one.slope * step, size: one.size }])) };
}

// ---- Pinned designs

const PIN_NAMES = ["A", "B", "C", "D"];
function pin(record, name = "") {
  const free = [0, 1, 2, 3].find((slot) => !pins.some((one) => one.slot === slot));
  if (!record || free === undefined || pins.length >= PINS) return;
  pins.push({ slot: free, design: record.design, record, name });
  showPins();
}

// Analyses the pinned designs anew after an edit of the model. `before` has the variables of the edited model; a new variable has its start
// value. A design that cannot be analysed stays, without numbers.
async function renewPins(before) {
  const mine = revision;
  pins = pins.map((one) => ({ ...one, record: null, fault: null, design: model.variables.map(({ name, start }) => {
    const k = before.findIndex((old) => old.name === name);
    return k >= 0 ? one.design[k] : start;
  }) }));
  showPins();
  for (const one of [...pins]) {
    const record = await server.analyzeBeside(mine, one.design).catch((error) => ({ error: error.message }));
    // The next model does the same.
    if (mine !== revision) return;
    if (record.error) one.fault = record.error; else one.record = record;
    showPins();
  }
}

// Analyses a design in addition to that of the sliders, and pins it.
async function pinDesign(values, name) {
  if (values.length !== design.length) return;
  const record = await server.analyzeBeside(revision, values).catch((error) => ({ error: error.message }));
  if (record.error) fault("design", `${name || "this design"} is not pinned: ${record.error}`); else pin(record, name);
}

function showPins() {
  by("pinned").hidden = pins.length === 0;
  by("pin").disabled = pins.length >= PINS;
  [0, 1, 2, 3].forEach((slot) => {
    const one = pins.find((p) => p.slot === slot);
    const record = one?.record;
    const motion = record?.motion;
    mechanism.set(`pin-${slot}`, motion?.parts, motion ? (frame) => motion.frames[frame] : null, `overlay pin-${slot}`);
    plots.forEach(({ plot, output, constraint }) => {
      plot.set(`pin-${slot}`, `pinned pin-${slot}`, record && historyOf(record, output, constraint));
    });
  });
  plots.forEach(({ plot }) => plot.draw());
  const named = (name, unit) => (unit ? `${name} [${unit}]` : name);
  const limit = (c, j) => named(`margin of ${c.name} ${c.relation} ${short(shown?.constraints[j].limit)}`, c.unit);
  const heads = ["", ...model.variables.map((v) => named(v.name, v.unit)), ...(model.objective ? [named(model.objective.name, model.objective.unit)] : []), ...model.constraints.map(limit), ""];
  const head = make("thead", {}, make("tr", {}, ...heads.map((text) => make("th", { scope: "col", text }))));
  const rows = pins.map((one) => {
    const { record, slot, fault } = one;
    const values = [...one.design, ...(model.objective ? [record?.objective] : []), ...model.constraints.map((_, j) => record?.constraints[j].margin)];
    const go = make("button", { type: "button", text: "Show" });
    go.addEventListener("click", () => moveTo(one.design));
    const remove = make("button", { type: "button", text: "Remove", "aria-label": `Remove design ${PIN_NAMES[slot]}` });
    remove.addEventListener("click", () => { pins = pins.filter((p) => p !== one); showPins(); });
    return make("tr", { class: `pin-${slot}`, title: fault ?? "" }, make("th", { scope: "row" }, make("span", { class: "swatch" }), [PIN_NAMES[slot], one.name, fault && "(no analysis)"].filter(Boolean).join(" ")),
      ...values.map((v) => make("td", { class: "number", text: short(v) })), make("td", {}, go, remove));
  });
  by("pins").replaceChildren(head, make("tbody", {}, ...rows));
}

// ---- The model

function buildPlots() {
  by("plots").replaceChildren();
  const time = model.time;
  const of = (name, unit, rest) => ({ plot: new Plot(by("plots"), { name, unit, time }), ...rest });
  plots = !time || time.points.length < 2 ? [] : [
    ...model.outputs.flatMap((output, h) => {
      if (!output.changes) return [];
      const one = of(output.name, output.unit, { output: h });
      if (model.objective) one.plot.drawable((relation, ends) => editor.replace(limitText(editor.area.value, output, relation, ends, 4, time)));
      return [one];
    }),
    ...model.constraints.flatMap((c, j) => (c.changes && c.output === null && c.follows === null ? [of(`${c.name} (constrained)`, c.unit, { constraint: j })] : [])),
  ];
  showValues();
}

const editor = new Editor({ text: by("text"), marks: by("lines"), save: by("save"), discard: by("discard"), state: by("source-state"), errors: by("errors") });
const run = new Run(by("run"), { design: () => design, show: (values) => { if (model && values.length === design.length) moveTo(values); }, pin: pinDesign, box: showBox, bounds: boundsOfRun });
const failed = connection(by("lost"), editor);
new Completer(by("text"), by("words"), () => editor.edited(0));

const follow = draggable(mechanism, () => ({
  base,
  design,
  ranges: model.variables.map((_, k) => range(k)[1] - range(k)[0]),
  lower: model.variables.map((_, k) => bounds(k).lower ?? -Infinity),
  upper: model.variables.map((_, k) => bounds(k).upper ?? Infinity),
}), moveTo, (text) => fault("drag", text));

async function load() {
  const answer = await server.model();
  failed(0, answer.file);
  by("file").textContent = answer.file;
  const report = answer.errors.map((e) => `${answer.file}:${e.line}: ${e.message}${e.help ? `\n  ${e.help}` : ""}`).join("\n");
  if (answer.model && answer.revision !== revision) {
    const before = model;
    model = answer.model;
    revision = answer.revision;
    document.title = `${model.title} – linkwright`;
    by("title").textContent = model.title;
    // The design of the sliders stays, as far as the variables do.
    design = model.variables.map((variable) => {
      const k = before ? before.variables.findIndex((old) => old.name === variable.name && old.start === variable.start) : -1;
      const value = k >= 0 ? design[k] : variable.start;
      return Math.min(Math.max(value, variable.lower ?? -Infinity), variable.upper ?? Infinity);
    });
    [shown, base, prediction, of_run] = [null, null, null, null];
    answered = 0;
    mechanism.groups.forEach((_, key) => mechanism.set(key, null, null));
    if (model.drawing_times) mechanism.begin(model.drawing_times, model.time.name, model.time.unit);
    by("picture").hidden = !model.drawing_times;
    (model.drawing_times ? mechanism.view : by("design")).append(by("messages"));
    buildSliders();
    numbers.begin(model);
    choose(null);
    buildPlots();
    if (model.objective) run.objective(model.objective);
    // A problem that cannot be built has a fault of its own.
    const is_simulation = !model.objective && !model.fault;
    by("run").hidden = !model.objective;
    by("numbers").hidden = !model.objective && !is_simulation;
    by("simulation").hidden = !is_simulation;
    ["moves", "objective", "margins"].forEach((id) => { by(id).hidden = is_simulation; });
    changed();
    if (before) renewPins(before.variables);
  }
  editor.show(answer);
  fault("file", answer.failure || report || model?.fault);
  await run.update(answer.revision);
  if (!answer.model) status("errors in the file", "bad");
  return answer.news;
}

// On a phone, the mechanism stays in sight down to the optimization.
new IntersectionObserver(([{ isIntersecting, boundingClientRect }]) => {
  by("picture").classList.toggle("apart", isIntersecting || boundingClientRect.bottom < 0);
}, { rootMargin: "0px 0px -45% 0px" }).observe(by("run"));

// The analysis of the design on the sliders may still run, or may fail.
by("pin").addEventListener("click", () => (shown?.number === sequence ? pin(shown) : pinDesign([...design], "")));
by("beside").addEventListener("click", () => {
  const is_beside = by("main").classList.toggle("editing");
  by("beside").ariaPressed = String(is_beside);
  if (is_beside) by("text").focus({ preventScroll: true });
});
by("reset").addEventListener("click", () => moveTo(model.variables.map((v) => v.start)));
by("cancel").addEventListener("click", async () => {
  answered = sequence;
  clearTimeout(timers.next);
  await server.cancel();
  status("no analysis here", "fair", "stopped");
});
mechanism.listeners.push((time, is_playing) => plots.forEach(({ plot }) => plot.now(time, !is_playing)));
// Keys that have no other meaning where nothing has the focus.
document.addEventListener("keydown", (event) => {
  const is_free = event.target === document.body || event.target === root;
  if (is_free && !by("picture").hidden && [" ", "ArrowLeft", "ArrowRight"].includes(event.key) && mechanism.key(event)) event.preventDefault();
});

const news = await load();
root.dataset.state ||= "ready";
server.follow(news, load, (error, failures) => {
  status("no connection", "bad", error.message);
  run.lost();
  failed(failures, by("file").textContent);
});
