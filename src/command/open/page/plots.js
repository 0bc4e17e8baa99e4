// Histories over time as SVG, with limits, the approximation, pinned designs and the time of the picture.

import { element } from "./mechanism.js";

const [WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM] = [480, 220, 58, 10, 8, 30];

export const short = (value) => (value === null || value === undefined || !Number.isFinite(value) ? "–"
  : String(Number(value.toPrecision(5))).replace("-", "\u2212"));
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

export class Plot {
  constructor(place, { name, unit, time }) {
    const figure = document.createElement("figure");
    figure.className = "plot";
    const caption = document.createElement("figcaption");
    const small = document.createElement("small");
    caption.append(name, " ", small);
    small.textContent = unit;
    this.svg = element("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": `${name} over ${time.name}` });
    figure.append(caption, this.svg);
    place.append(figure);
    Object.assign(this, { figure, name, time, series: new Map(), limits: [], range: null });
  }

  // Points of a series under a key; null removes it.
  set(key, className, points, values) {
    if (!values) this.series.delete(key); else this.series.set(key, { className, points, values });
  }

  // Limits: relation, value, and the window of time in which they hold.
  limit(limits) {
    this.limits = limits;
  }

  x(t) {
    const points = this.time.points;
    return LEFT + ((t - points[0]) / (points[points.length - 1] - points[0])) * (WIDTH - LEFT - RIGHT);
  }

  y(v) {
    return TOP + ((this.range[1] - v) / (this.range[1] - this.range[0])) * (HEIGHT - TOP - BOTTOM);
  }

  // Widens the range for all series and limits. It shrinks only if most of it is empty, so that axes do not jump while one drags.
  scale() {
    let [low, high] = [Infinity, -Infinity];
    const add = (v) => { if (v !== null && Number.isFinite(v)) { low = Math.min(low, v); high = Math.max(high, v); } };
    this.series.forEach(({ values }) => values.forEach(add));
    const [bottom, top] = [low, high];
    // A limit far away would flatten the history.
    this.limits.forEach(({ value }) => { if (Math.abs(value - (bottom + top) / 2) <= 3 * (top - bottom)) add(value); });
    if (!(low <= high)) [low, high] = [0, 1];
    const pad = 0.06 * (high - low) || 0.1 * Math.abs(high) || 1;
    const wanted = [low - pad, high + pad];
    const now = this.range;
    const fits = now && low >= now[0] && high <= now[1] && high - low > 0.45 * (now[1] - now[0]);
    if (!fits) this.range = wanted;
  }

  draw() {
    this.scale();
    const { points } = this.time;
    const [first, last, bottom] = [points[0], points[points.length - 1], HEIGHT - BOTTOM];
    const parts = [];
    const text = (x, y, anchor, content) => element("text", { x, y, "text-anchor": anchor }, content);
    ticks(...this.range).forEach((v) => {
      const y = this.y(v);
      parts.push(element("path", { class: "grid", d: `M${LEFT} ${y}H${WIDTH - RIGHT}` }), text(LEFT - 6, y + 4, "end", short(v)));
    });
    ticks(first, last, 6).forEach((t) => {
      const x = this.x(t);
      parts.push(element("path", { class: "grid", d: `M${x} ${TOP}V${bottom}` }), text(x, bottom + 14, "middle", short(t)));
    });
    parts.push(text(WIDTH - RIGHT, HEIGHT - 3, "end", `${this.time.name} / ${this.time.unit}`));
    this.limits.forEach(({ relation, value, window }) => {
      const [from, to] = (window ?? [first, last]).map((t) => this.x(Math.min(Math.max(t, first), last)));
      if (value < this.range[0] || value > this.range[1]) return;
      const y = this.y(value);
      const side = { "≤": TOP, "≥": bottom }[relation];
      if (side !== undefined) parts.push(element("path", { class: "beyond", d: `M${from} ${y}H${to}V${side}H${from}Z` }));
      parts.push(element("path", { class: "limit", d: `M${from} ${y}H${to}` }));
    });
    parts.push(element("rect", { class: "frame", x: LEFT, y: TOP, width: WIDTH - LEFT - RIGHT, height: bottom - TOP }));
    this.series.forEach(({ className, points: at, values }, key) => {
      let [d, pen] = ["", "M"];
      values.forEach((v, i) => {
        if (v === null || !Number.isFinite(v)) { pen = "M"; return; }
        d += `${pen}${this.x(points[at ? at[i] : i]).toFixed(1)} ${this.y(v).toFixed(1)}`;
        pen = "L";
      });
      parts.push(element("path", { class: className, d, "data-series": key }));
    });
    this.cursor = element("path", { class: "now" });
    parts.push(this.cursor);
    this.svg.replaceChildren(...parts);
    if (this.moment !== undefined) this.now(this.moment);
  }

  // The time of the picture.
  now(time) {
    this.moment = time;
    const x = this.x(time).toFixed(1);
    this.cursor?.setAttribute("d", `M${x} ${TOP}V${HEIGHT - BOTTOM}`);
  }
}
