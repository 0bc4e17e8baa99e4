// Histories over time as SVG, with limits, the approximation, pinned designs and the time of the picture.

import { soon } from "./frames.js";
import { element } from "./mechanism.js";

export const phone = window.matchMedia("(max-width: 40rem)");
const [LEFT, RIGHT, TOP, BOTTOM] = [58, 10, 8, 30];

// The width of a drawing in pixels of the page: its letters then have the size of the style sheet. `otherwise` is that of a hidden one.
export const measured = (svg, otherwise) => Math.round(svg.clientWidth) || otherwise;

// Draws again when the width of a drawing changes.
export const onWidth = (svg, draw) => {
  let last = 0;
  // In the next frame, because a drawing changes its own height, which the observer must not see in its callback.
  new ResizeObserver(() => requestAnimationFrame(() => {
    if (svg.clientWidth === last) return;
    last = svg.clientWidth;
    draw();
  })).observe(svg);
};

// A number with five digits; small ones as 5.4781e−6.
export const short = (value) => {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const text = String(value !== 0 && Math.abs(value) < 1e-4 ? Number(value.toPrecision(5)).toExponential() : Number(value.toPrecision(5)));
  return text.replaceAll("-", "\u2212");
};
export const withUnit = (value, unit) => (unit ? `${short(value)} ${unit}` : short(value));

// Round numbers in an interval, about `count` of them.
export function ticks(low, high, count = 5) {
  const raw = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= raw) ?? power;
  const all = [];
  for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k++) all.push(k * step);
  return all;
}

const SUPERSCRIPTS = "⁰¹²³⁴⁵⁶⁷⁸⁹";
const minus = (text) => text.replaceAll("-", "\u2212");

// Labels of the ticks of an axis in at most seven characters, and the power of ten and the offset that they leave out, such as
// "×10⁶ + 1000".
export function labels(values) {
  if (values.length < 2) return { texts: values.map(short), note: "" };
  const step = Math.abs(values[1] - values[0]);
  const largest = (all) => Math.max(...all.map(Math.abs));
  const offset = largest(values) / step > 1e5 ? values[0] : 0;
  const rest = values.map((v) => v - offset);
  const order = Math.floor(Math.log10(largest(rest) || 1));
  const power = order >= 5 || order < -3 ? 3 * Math.floor(order / 3) : 0;
  const factor = 10 ** power;
  const decimals = Math.max(0, -Math.floor(Math.log10(step / factor) + 1e-9));
  const raised = `${power < 0 ? "⁻" : ""}${[...String(Math.abs(power))].map((digit) => SUPERSCRIPTS[digit]).join("")}`;
  const shift = offset ? `${offset < 0 ? "\u2212" : "+"} ${Number(Math.abs(offset).toPrecision(12))}` : "";
  return {
    texts: rest.map((v) => minus((v / factor).toFixed(decimals)).replace(/^\u2212(0(\.0*)?)$/, "$1")),
    note: [power ? `×10${raised}` : "", shift].filter(Boolean).join(" "),
  };
}

// The place of the point of a sorted list that is nearest to a time.
const nearest = (points, time) => {
  let [low, high] = [0, points.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (points[middle] <= time) low = middle; else high = middle;
  }
  return Math.abs(points[high] - time) < Math.abs(points[low] - time) ? high : low;
};

export class Plot {
  constructor(place, { name, unit, time }) {
    const figure = document.createElement("figure");
    figure.className = "plot";
    const caption = document.createElement("figcaption");
    const small = document.createElement("small");
    caption.append(name, " ", small);
    small.textContent = unit;
    this.svg = element("svg", { role: "img", "aria-label": `${name} over ${time.name}` });
    this.tools = document.createElement("div");
    this.tools.className = "tools";
    figure.append(this.tools, caption, this.svg);
    place.append(figure);
    this.measure();
    Object.assign(this, { figure, name, unit, time, series: new Map(), limits: [], range: null, lines: element("g"), buttons: [], seen: true, stale: false });
    // The values at the pointer or, while the picture rests, at its time.
    Object.assign(this, { reading: element("g", { class: "reading" }), pointed: null, rests: false });
    this.svg.addEventListener("pointermove", (event) => {
      const box = this.svg.getBoundingClientRect();
      const [x, { points }] = [((event.clientX - box.left) / box.width) * this.width, this.time];
      const part = Math.min(Math.max((x - LEFT) / (this.width - LEFT - RIGHT), 0), 1);
      this.pointed = figure.classList.contains("drawing") ? null : points[0] + part * (points[points.length - 1] - points[0]);
      this.read();
    });
    ["pointerleave", "pointercancel"].forEach((kind) => this.svg.addEventListener(kind, () => { this.pointed = null; this.read(); }));
    // Plots outside the screen are drawn when they come near it.
    new IntersectionObserver((entries) => {
      this.seen = entries.at(-1).isIntersecting;
      if (this.seen && this.stale) this.render();
      else if (this.moment !== undefined) this.now(this.moment);
    }, { rootMargin: "200px" }).observe(figure);
    onWidth(this.svg, () => { this.measure(); this.draw(); });
  }

  // Takes the size of the drawing from the page.
  measure() {
    this.width = measured(this.svg, 330);
    this.height = phone.matches ? 220 : Math.min(Math.max(0.46 * this.width, 165), 220);
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${this.height}`);
  }

  // Values of a series under a key, at all time points or at some `points` of them; null removes it.
  set(key, className, rows) {
    if (!rows) this.series.delete(key); else this.series.set(key, { className, rows });
  }

  // Limits: relation, value, and the window of time in which they hold.
  limit(limits) {
    this.limits = limits;
  }

  // Lets a limit be drawn: `drawn` gets its relation and its points. A drag makes a straight line; clicks make a line of several pieces, which a
  // double click or Enter ends. The arrow keys ↑ and ↓ draw a level line and move it, with Shift its right end.
  drawable(drawn) {
    let [relation, points, from] = [null, [], null];
    const line = element("path", { class: "drawn" });
    this.buttons = [["≤", "Draw an upper limit"], ["≥", "Draw a lower limit"]].map(([sign, text]) => {
      const button = document.createElement("button");
      // Without a history the axes have no numbers.
      Object.assign(button, { type: "button", disabled: true, textContent: sign, title: `${text}: drag a line, or click points and end with a double click; or move a line with ↑ and ↓ and end with Enter`, ariaLabel: `${text} of ${this.name}`, ariaPressed: "false" });
      button.dataset.relation = sign;
      button.addEventListener("click", () => arm(relation === sign ? null : sign));
      return button;
    });
    const said = document.createElement("output");
    // The focus is on the button: Enter would press it again.
    const keys = (event) => {
      if (!this.figure.isConnected) return arm(null);
      if (!["Enter", "Escape", "ArrowUp", "ArrowDown"].includes(event.key)) return undefined;
      event.preventDefault();
      if (event.key === "Enter") return end();
      return event.key === "Escape" ? arm(null) : move(event.key === "ArrowUp" ? 1 : -1, event.shiftKey);
    };
    // Moves a line by a fiftieth of the axis, or its right end only. The first one is level, in the middle.
    const move = (sign, is_end) => {
      const step = (sign * (this.range[1] - this.range[0])) / 50;
      const is_moved = (k) => (is_end ? k === points.length - 1 : true);
      const middle = (this.range[0] + this.range[1]) / 2;
      points = points.length ? points.map(([t, v], k) => [t, is_moved(k) ? v + step : v]) : [[all()[0], middle], [all().at(-1), middle]];
      show();
      said.textContent = `${relation} ${[...new Set(points.map(([, v]) => short(Number(v.toPrecision(4)))))].join(" to ")}`;
    };
    const arm = (sign) => {
      window[sign === null ? "removeEventListener" : "addEventListener"]("keydown", keys, { capture: true });
      // It may not have been drawn yet.
      if (this.stale) this.render();
      [relation, points, from] = [sign, [], null];
      said.textContent = sign === null ? "" : "↑ ↓ move, Enter takes, Escape drops";
      line.remove();
      this.figure.classList.toggle("drawing", sign !== null);
      this.buttons.forEach((button) => { button.ariaPressed = String(button.dataset.relation === sign); });
    };
    const all = () => this.time.points;
    const least = () => 0.01 * (all().at(-1) - all()[0]);
    const point = (event) => {
      const box = this.svg.getBoundingClientRect();
      const [x, y] = [((event.clientX - box.left) / box.width) * this.width, ((event.clientY - box.top) / box.height) * this.height];
      const t = all()[0] + ((x - LEFT) / (this.width - LEFT - RIGHT)) * (all().at(-1) - all()[0]);
      return [Math.min(Math.max(t, all()[0]), all().at(-1)), this.range[1] - ((y - TOP) / (this.height - TOP - BOTTOM)) * (this.range[1] - this.range[0])];
    };
    // A point at the time of another one takes its place.
    const add = (next) => { points = [...points.filter(([t]) => Math.abs(t - next[0]) >= least()), next].sort((a, b) => a[0] - b[0]); };
    const show = (next) => {
      const shown = next ? [...points, next].sort((a, b) => a[0] - b[0]) : points;
      line.setAttribute("d", shown.map(([t, v], k) => `${k ? "L" : "M"}${this.x(t)} ${this.y(v)}`).join(""));
      this.svg.append(line);
    };
    const end = () => {
      const [sign, ends] = [relation, points];
      arm(null);
      if (ends.length > 1) drawn(sign, ends);
    };
    this.svg.addEventListener("pointerdown", (event) => {
      if (!relation) return;
      event.preventDefault();
      from = point(event);
      add(from);
      this.svg.setPointerCapture(event.pointerId);
    });
    this.svg.addEventListener("pointermove", (event) => { if (relation && points.length) show(point(event)); });
    this.svg.addEventListener("pointerup", (event) => {
      if (!relation || !from) return;
      const to = point(event);
      const is_drag = Math.abs(to[0] - from[0]) > 3 * least();
      from = null;
      if (!is_drag) return show();
      add(to);
      if (points.length === 2) end(); else show();
    });
    this.svg.addEventListener("dblclick", () => { if (relation) end(); });
    this.tools.replaceChildren(said, ...this.buttons);
  }

  x(t) {
    const points = this.time.points;
    return LEFT + ((t - points[0]) / (points[points.length - 1] - points[0])) * (this.width - LEFT - RIGHT);
  }

  y(v) {
    return TOP + ((this.range[1] - v) / (this.range[1] - this.range[0])) * (this.height - TOP - BOTTOM);
  }

  // Widens the range for all series and limits. It shrinks only if most of it is empty, so that axes do not jump during a drag.
  scale() {
    let [low, high] = [Infinity, -Infinity];
    const add = (v) => { if (v !== null && Number.isFinite(v)) { low = Math.min(low, v); high = Math.max(high, v); } };
    this.series.forEach(({ rows }) => rows.values.forEach(add));
    const [bottom, top] = [low, high];
    // A distant limit would flatten the history.
    const near = (value) => { if (value !== null && Math.abs(value - (bottom + top) / 2) <= 3 * (top - bottom)) add(value); };
    this.limits.forEach(({ value, curve }) => (curve ?? [value]).forEach(near));
    if (!(low <= high)) [low, high] = [0, 1];
    const pad = 0.06 * (high - low) || 0.1 * Math.abs(high) || 1;
    const wanted = [low - pad, high + pad];
    const now = this.range;
    const fits = now && low >= now[0] && high <= now[1] && high - low > 0.45 * (now[1] - now[0]);
    if (!fits) this.range = wanted;
  }

  // Draws the series anew if the plot is near the screen.
  draw() {
    this.buttons.forEach((button) => { button.disabled = !this.series.has("analysed"); });
    this.stale = true;
    if (this.seen) soon(this, () => { if (this.stale) this.render(); });
  }

  // Draws the series, and the axes if they have changed.
  render() {
    this.stale = false;
    this.scale();
    const axes = JSON.stringify([this.range, this.limits, this.width, this.height]);
    if (axes !== this.axes) {
      this.axes = axes;
      this.drawAxes();
    }
    const { points } = this.time;
    this.lines.replaceChildren(...[...this.series].map(([key, { className, rows: { points: at, values } }]) => {
      let [d, pen] = ["", "M"];
      values.forEach((v, i) => {
        if (v === null || !Number.isFinite(v)) { pen = "M"; return; }
        d += `${pen}${this.x(points[at ? at[i] : i]).toFixed(1)} ${this.y(v).toFixed(1)}`;
        pen = "L";
      });
      return element("path", { class: className, d, "data-series": key });
    }));
    this.showTime();
  }

  drawAxes() {
    const { points } = this.time;
    const [first, last, bottom] = [points[0], points[points.length - 1], this.height - BOTTOM];
    const parts = [];
    const text = (x, y, anchor, content) => element("text", { x, y, "text-anchor": anchor }, content);
    const [up, across] = [ticks(...this.range), ticks(first, last, phone.matches ? 4 : 6)];
    const [value, time] = [labels(up), labels(across)];
    up.forEach((v, k) => {
      const y = this.y(v);
      parts.push(element("path", { class: "grid", d: `M${LEFT} ${y}H${this.width - RIGHT}` }), text(LEFT - 6, y + 4, "end", value.texts[k]));
    });
    across.forEach((t, k) => {
      const x = this.x(t);
      parts.push(element("path", { class: "grid", d: `M${x} ${TOP}V${bottom}` }), text(x, bottom + 14, "middle", time.texts[k]));
    });
    parts.push(text(this.width - RIGHT, this.height - 3, "end", [time.note, `${this.time.name} / ${this.time.unit}`].filter(Boolean).join(" ")));
    if (value.note) parts.push(text(LEFT + 4, TOP + 12, "start", value.note));
    this.limits.forEach(({ relation, value, window, curve }) => {
      if (curve) return parts.push(...this.curvedLimit(relation, curve, bottom));
      const [from, to] = (window ?? [first, last]).map((t) => this.x(Math.min(Math.max(t, first), last)));
      if (value < this.range[0] || value > this.range[1]) return;
      const y = this.y(value);
      const side = { "≤": TOP, "≥": bottom }[relation];
      if (side !== undefined) parts.push(element("path", { class: "beyond", d: `M${from} ${y}H${to}V${side}H${from}Z` }));
      parts.push(element("path", { class: "limit", d: `M${from} ${y}H${to}` }));
    });
    parts.push(element("rect", { class: "frame", x: LEFT, y: TOP, width: this.width - LEFT - RIGHT, height: bottom - TOP }));
    this.cursor = element("path", { class: "now" });
    this.svg.replaceChildren(...parts, this.lines, this.cursor, this.reading);
  }

  // A limit that changes with time, and the side that it forbids.
  curvedLimit(relation, curve, bottom) {
    const { points } = this.time;
    const inside = (y) => Math.min(Math.max(y, TOP), bottom);
    const at = curve.flatMap((v, p) => (v === null || !Number.isFinite(v) ? [] : [[this.x(points[p]).toFixed(1), inside(this.y(v)).toFixed(1)]]));
    if (at.length < 2) return [];
    const line = `M${at.map((one) => one.join(" ")).join("L")}`;
    const side = { "≤": TOP, "≥": bottom }[relation];
    const beyond = side === undefined ? [] : [element("path", { class: "beyond", d: `${line}V${side}H${at[0][0]}Z` })];
    return [...beyond, element("path", { class: "limit", d: line })];
  }

  // The time of the picture, and whether the picture rests there.
  now(time, rests = this.rests) {
    Object.assign(this, { moment: time, rests });
    if (this.seen) soon(this.reading, () => this.showTime());
  }

  showTime() {
    if (this.moment === undefined || !this.cursor) return;
    const x = this.x(this.moment).toFixed(1);
    this.cursor.setAttribute("d", `M${x} ${TOP}V${this.height - BOTTOM}`);
    this.read();
  }

  // Shows the analysed value at the time point next to the pointer or, without it, to the time of the picture; of an approximation, too.
  read() {
    const time = this.pointed ?? (this.rests ? this.moment : undefined);
    const values = this.series.get("analysed")?.rows.values;
    if (time === undefined || !values || !this.range || this.stale || this.figure.classList.contains("drawing")) {
      if (this.reading.firstChild) {
        this.reading.replaceChildren();
        this.svg.setAttribute("aria-label", `${this.name} over ${this.time.name}`);
      }
      return;
    }
    const { points, name, unit } = this.time;
    const p = nearest(points, time);
    const [value, x] = [values[p], this.x(points[p])];
    const predicted = this.series.get("predicted")?.rows;
    const of_predicted = predicted ? predicted.values[nearest(predicted.points.map((i) => points[i]), points[p])] : null;
    const words = `${withUnit(value, this.unit)}${of_predicted === null ? "" : `, ≈ ${short(of_predicted)}`} at ${withUnit(points[p], unit)}`;
    const is_right = x > (LEFT + this.width - RIGHT) / 2;
    const text = element("text", { x: is_right ? x - 6 : x + 6, y: TOP + 12, "text-anchor": is_right ? "end" : "start" }, words);
    const is_seen = value !== null && Number.isFinite(value);
    this.reading.replaceChildren(...(this.pointed === null ? [] : [element("path", { d: `M${x} ${TOP}V${this.height - BOTTOM}` })]),
      ...(is_seen ? [element("circle", { cx: x, cy: this.y(value), r: 3 })] : []), text);
    this.svg.setAttribute("aria-label", `${this.name} over ${this.time.name}: ${words} of ${name}`);
  }
}
