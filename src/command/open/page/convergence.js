// The objective over the trial steps of several runs: the run, its rival, and stored runs.

import { element } from "./mechanism.js";
import { make } from "./elements.js";
import { labels, measured, onWidth, phone, short, ticks, withUnit } from "./plots.js";

const [HEIGHT, LEFT, RIGHT, TOP, BOTTOM] = [240, 64, 12, 10, 34];
// Violation in percent above which a design counts as infeasible in the picture.
const VIOLATED = 0.1;

export class Convergence {
  constructor(place) {
    this.place = place;
    this.series = new Map();
    this.label = { name: "objective", unit: "" };
    this.svg = element("svg", { role: "img" });
    this.legend = make("ul", { class: "keys" });
    place.append(this.svg, this.legend);
    onWidth(this.svg, () => this.draw());
  }

  // The trial steps of a run under a key, with the name for the legend; null removes it.
  set(key, name, cycles) {
    if (cycles) this.series.set(key, { name, cycles }); else this.series.delete(key);
    this.draw();
  }

  draw() {
    this.width = measured(this.svg, phone.matches ? 350 : 640);
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${HEIGHT}`);
    // Accepted steps with an objective; x is the number of the trial step.
    const all = [...this.series].map(([key, { name, cycles }]) => ({ key, name, points: cycles.map((c, k) => ({ ...c, k })).filter((c) => c.accepted && c.objective !== null) }));
    const points = all.flatMap((one) => one.points);
    this.place.hidden = points.length < 2;
    if (points.length < 2) return;
    const values = points.map((c) => c.objective);
    const pad = 0.06 * (Math.max(...values) - Math.min(...values)) || 0.1 * Math.abs(values[0]) || 1;
    const [low, high] = [Math.min(...values) - pad, Math.max(...values) + pad];
    const last = Math.max(1, ...points.map((c) => c.k));
    const x = (k) => LEFT + (k / last) * (this.width - LEFT - RIGHT);
    const y = (v) => TOP + ((high - v) / (high - low)) * (HEIGHT - TOP - BOTTOM);
    const text = (at, up, anchor, content) => element("text", { x: at, y: up, "text-anchor": anchor }, content);
    const up = ticks(low, high);
    const { texts, note } = labels(up);
    const parts = up.flatMap((v, k) => [element("path", { class: "grid", d: `M${LEFT} ${y(v)}H${this.width - RIGHT}` }), text(LEFT - 6, y(v) + 4, "end", texts[k])]);
    if (note) parts.push(text(LEFT + 4, TOP + 12, "start", note));
    ticks(0, last, phone.matches ? 5 : 8).filter(Number.isInteger).forEach((k) => parts.push(text(x(k), HEIGHT - BOTTOM + 15, "middle", short(k))));
    parts.push(text(this.width - RIGHT, HEIGHT - 3, "end", "trial steps"));
    parts.push(element("rect", { class: "frame", x: LEFT, y: TOP, width: this.width - LEFT - RIGHT, height: HEIGHT - TOP - BOTTOM }));
    all.forEach(({ key, name, points: own }) => {
      const line = own.map((c, i) => `${i ? "L" : "M"}${x(c.k).toFixed(1)} ${y(c.objective).toFixed(1)}`).join("");
      const marks = own.map((c) => {
        const mark = element("circle", { cx: x(c.k).toFixed(1), cy: y(c.objective).toFixed(1), r: 3.5, class: c.violation > VIOLATED ? "violated" : "" });
        mark.append(element("title", {}, `${name}, trial step ${c.k}: ${withUnit(c.objective, this.label.unit)}${c.violation === null ? "" : `, largest violation ${short(c.violation)} %`}`));
        return mark;
      });
      parts.push(element("g", { class: `series ${key}` }, element("path", { d: line }), ...marks));
    });
    this.svg.setAttribute("aria-label", `${this.label.name} over the trial steps of ${all.map((one) => one.name).join(", ")}`);
    this.svg.replaceChildren(...parts);
    this.legend.replaceChildren(...all.map(({ key, name }) => make("li", { class: `series ${key}` }, make("span", { class: "swatch" }), name)),
      make("li", { class: "soft", text: `${this.label.name}${this.label.unit ? ` in ${this.label.unit}` : ""}; hollow: a constraint is violated` }));
  }
}
