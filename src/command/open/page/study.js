// The picture of a study: two columns of its rows against each other. A click, or Enter, shows the design of a row in motion.

import { element } from "./mechanism.js";
import { options } from "./elements.js";
import { labels, measured, onWidth, phone, short, ticks, withUnit } from "./plots.js";

const [HEIGHT, LEFT, RIGHT, TOP, BOTTOM] = [312, 70, 12, 22, 40];
// Distance in the units of the picture within which a click finds a point.
const REACH = 24;

export class StudyPicture {
  constructor(place, { show }) {
    Object.assign(this, { place, show, study: null, at: null });
    const find = (id) => place.querySelector(id);
    [this.phase, this.x, this.y, this.note, this.title] = ["#study-phase", "#study-x", "#study-y", "#study-row", "#study-title"].map(find);
    this.svg = element("svg", { tabindex: "0", role: "img" });
    find("#study-picture").append(this.svg);
    this.phase.addEventListener("change", () => this.choosePhase());
    onWidth(this.svg, () => { if (this.study) this.draw(); });
    [this.x, this.y].forEach((select) => select.addEventListener("change", () => this.draw()));
    this.svg.addEventListener("click", (event) => this.select(this.nearest(event)));
    this.svg.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (step === undefined || !this.points.length) return;
      event.preventDefault();
      const now = this.points.findIndex((point) => point.row === this.at);
      this.select(this.points[Math.min(Math.max(now + step, 0), this.points.length - 1)]);
    });
  }

  open(study) {
    this.study = study;
    this.place.hidden = false;
    this.title.textContent = study.title;
    options(this.phase, study.phases.map((phase, k) => [k, `${phase.name} (${phase.rows.length})`]));
    this.phase.value = 0;
    this.phase.parentElement.hidden = study.phases.length < 2;
    this.choosePhase();
    this.place.scrollIntoView({ block: "nearest" });
  }

  choosePhase() {
    this.now = this.study.phases[Number(this.phase.value)];
    this.at = null;
    const { columns, design } = this.now;
    const choices = columns.map((column, k) => [k, column.name]);
    [this.x, this.y].forEach((select) => options(select, choices));
    // The first result over what was varied. Columns of an optimum begin with the objective and its violation, and what was varied is before
    // them; its design is a result.
    const varies = (k) => new Set(this.now.rows.slice(0, 200).map((row) => row.values[k])).size > 1;
    const optimum = columns.findIndex(({ name }, k) => name === "violation_pct" && columns[k + 1]?.name === "cycles") - 1;
    const is_input = (k) => (optimum >= 0 ? k < optimum : design.includes(k));
    const all = columns.map((_, k) => k).filter(varies);
    const first = all.find(is_input) ?? all[0] ?? 0;
    const results = all.filter((k) => k !== first && !is_input(k) && !columns[k].words.length);
    [this.x.value, this.y.value] = [first, results[0] ?? 0];
    this.draw();
  }

  draw() {
    this.width = measured(this.svg, phone.matches ? 350 : 640);
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${HEIGHT}`);
    const [i, j] = [this.x, this.y].map((select) => Number(select.value));
    const { columns, rows } = this.now;
    const own = rows.filter((row) => Number.isFinite(row.values[i] ?? NaN) && Number.isFinite(row.values[j] ?? NaN));
    const failed = rows.filter((row) => row.failure).length;
    const span = (k) => {
      const values = own.map((row) => row.values[k]);
      const [low, high] = [Math.min(...values), Math.max(...values)];
      const pad = 0.05 * (high - low) || 0.1 * Math.abs(high) || 1;
      return [low - pad, high + pad];
    };
    this.points = [];
    if (!own.length) {
      this.note.textContent = `no rows with these columns${failed ? `; ${failed} runs failed` : ""}`;
      return this.svg.replaceChildren();
    }
    const [[x0, x1], [y0, y1]] = [span(i), span(j)];
    const x = (v) => LEFT + ((v - x0) / (x1 - x0)) * (this.width - LEFT - RIGHT);
    const y = (v) => TOP + ((y1 - v) / (y1 - y0)) * (HEIGHT - TOP - BOTTOM);
    const text = (at, up, anchor, content) => element("text", { x: at, y: up, "text-anchor": anchor }, content);
    const named = (k, at) => (columns[k].words.length ? { texts: at.map((v) => columns[k].words[v] ?? ""), note: "" } : labels(at));
    const parts = [];
    const [up, across] = [ticks(y0, y1), ticks(x0, x1, phone.matches ? 3 : 6)];
    const [left, below] = [named(j, up), named(i, across)];
    up.forEach((v, k) => parts.push(element("path", { class: "grid", d: `M${LEFT} ${y(v)}H${this.width - RIGHT}` }), text(LEFT - 6, y(v) + 4, "end", left.texts[k])));
    across.forEach((v, k) => parts.push(element("path", { class: "grid", d: `M${x(v)} ${TOP}V${HEIGHT - BOTTOM}` }), text(x(v), HEIGHT - BOTTOM + 15, "middle", below.texts[k])));
    const label = (k, note) => [this.label(k), note].filter(Boolean).join(", ");
    parts.push(text(this.width - RIGHT, HEIGHT - 5, "end", label(i, below.note)), text(LEFT, TOP - 8, "start", label(j, left.note)));
    parts.push(element("rect", { class: "frame", x: LEFT, y: TOP, width: this.width - LEFT - RIGHT, height: HEIGHT - TOP - BOTTOM }));
    this.points = own.map((row) => ({ row, x: x(row.values[i]), y: y(row.values[j]) })).sort((a, b) => a.x - b.x);
    const dots = this.points.map((point) => {
      point.dot = element("circle", { cx: point.x.toFixed(1), cy: point.y.toFixed(1), r: 3.2, class: point.row === this.at ? "chosen" : "" });
      return point.dot;
    });
    this.svg.setAttribute("aria-label", `${this.label(j)} over ${this.label(i)}, ${own.length} runs; arrow keys choose a run`);
    this.svg.replaceChildren(...parts, element("g", { class: "rows" }, ...dots));
    if (!this.at) this.note.textContent = `${own.length} runs${failed ? `, ${failed} failed` : ""}. Click a point, or move with the arrow keys, to see its design.`;
  }

  label(k) {
    const { name, unit } = this.now.columns[k];
    return unit ? `${name} / ${unit}` : name;
  }

  nearest(event) {
    const box = this.svg.getBoundingClientRect();
    const [x, y] = [((event.clientX - box.left) / box.width) * this.width, ((event.clientY - box.top) / box.height) * HEIGHT];
    const far = (point) => Math.hypot(point.x - x, point.y - y);
    const best = this.points.reduce((found, point) => (!found || far(point) < far(found) ? point : found), null);
    return best && far(best) <= REACH ? best : null;
  }

  // Shows the design of a row. Variables without a column have their start values, and all other numbers those of the model.
  select(point) {
    if (!point) return;
    this.at = point.row;
    this.points.forEach(({ dot, row }) => dot.setAttribute("class", row === this.at ? "chosen" : ""));
    const { columns, design } = this.now;
    const values = design.map((column, k) => (column === null ? this.study.start[k] : point.row.values[column]));
    const shown = (k) => columns[k].words[point.row.values[k]] ?? withUnit(point.row.values[k], columns[k].unit);
    const numbers = [this.x, this.y].map((select) => Number(select.value)).map((k) => `${columns[k].name} ${shown(k)}`);
    this.place.dataset.row = point.row.run;
    this.note.textContent = `run ${point.row.run}, ${point.row.status}: ${numbers.join(", ")}`;
    if (values.every((v) => Number.isFinite(v ?? NaN))) {
      const { others } = this.study;
      if (others.length) this.note.textContent += `. Motion and margins have the model's own ${others.join(", ")}, not those of this run`;
      this.show(values);
    } else this.note.textContent += "; it has no design of this model";
  }
}
