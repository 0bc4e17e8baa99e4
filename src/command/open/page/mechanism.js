// The mechanism in motion as SVG: the analysed design, its linear approximation, pinned designs, and arrows of sensitivities.

import { inNextFrame } from "./frames.js";

const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 640;
const MARGIN = 34;
// Smallest and largest scale, relative to that which fits the motion.
const [LEAST, MOST] = [0.25, 100];
// Factor of a zoom by a button or a key.
export const STEP = 1.5;

export function element(name, attributes = {}, ...children) {
  const made = document.createElementNS(SVG, name);
  Object.entries(attributes).forEach(([key, value]) => made.setAttribute(key, value));
  made.append(...children);
  return made;
}

// The parts of a frame in the order of its numbers: name, number of numbers, and whether each is a point.
export function layout(parts) {
  const all = [];
  let at = 0;
  const add = (name, count, length) => {
    for (let k = 0; k < count; k++, at += length) all.push({ name, at, length });
  };
  add("guides", parts.guides, 4);
  parts.plates.forEach((points) => add("plates", 1, 2 * points));
  parts.bars.forEach((points) => add("bars", 1, 2 * points));
  add("beams", parts.beams, 8);
  add("springs", parts.springs, 4);
  parts.lines.forEach((points) => add("lines", 1, 2 * points));
  add("masses", parts.masses, 2);
  add("sliders", parts.sliders, 3);
  add("ground", parts.ground, 2);
  add("joints", parts.joints, 2);
  return all;
}

// Points of joints, masses and sliders, which a user can drag.
export const handles = (parts) => layout(parts).filter(({ name }) => ["masses", "sliders", "joints"].includes(name));

const path = (at, closed) => {
  let d = "M";
  for (let k = 0; k < at.length; k += 2) d += `${k ? "L" : ""}${at[k].toFixed(1)} ${at[k + 1].toFixed(1)}`;
  return closed ? d + "Z" : d;
};

// A zigzag of six strokes between straight ends, as in the report.
function spring([x, y, u, v]) {
  const [dx, dy] = [u - x, v - y];
  const length = Math.hypot(dx, dy) || 1;
  const [nx, ny] = [(-dy / length) * 7, (dx / length) * 7];
  const at = [x, y, x + 0.2 * dx, y + 0.2 * dy];
  for (let k = 0; k < 6; k++) at.push(x + (0.25 + 0.1 * k) * dx + (k % 2 ? -nx : nx), y + (0.25 + 0.1 * k) * dy + (k % 2 ? -ny : ny));
  return path([...at, x + 0.8 * dx, y + 0.8 * dy, u, v], false);
}

const made = {
  guides: () => element("path"),
  plates: () => element("path"),
  bars: () => element("path"),
  beams: () => element("path"),
  springs: () => element("path"),
  lines: () => element("path"),
  masses: () => element("circle", { r: 9 }),
  sliders: () => element("g", {}, element("rect", { x: -13, y: -8, width: 26, height: 16, rx: 2 }), element("circle", { r: 3.5 })),
  ground: () => element("g", {}, element("path", { d: "M0 0L-9 15H9ZM-14 15H14" }), element("circle", { r: 4 })),
  joints: () => element("circle", { r: 4 }),
};

export class Mechanism {
  constructor(place) {
    this.svg = element("svg", { role: "img", "aria-label": "the mechanism in motion" });
    this.controls = document.createElement("div");
    this.controls.className = "controls";
    this.button = Object.assign(document.createElement("button"), { type: "button" });
    this.slider = Object.assign(document.createElement("input"), { type: "range", min: 0, step: 1, value: 0, ariaLabel: "time" });
    this.readout = document.createElement("output");
    this.controls.append(this.button, this.slider, this.readout);
    this.view = document.createElement("div");
    this.view.className = "view";
    this.view.append(this.svg);
    place.replaceChildren(this.view, this.controls);
    this.groups = new Map();
    this.is_held = false;
    this.is_zoomed = false;
    this.window = null;
    this.frame = 0;
    this.playing = !window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.before = null;
    this.listeners = [];
    this.button.addEventListener("click", () => this.play(!this.playing));
    this.slider.addEventListener("input", () => { this.play(false); this.show(Number(this.slider.value)); });
    place.addEventListener("keydown", (event) => {
      if (event.target === place && this.key(event)) event.preventDefault();
    });
    this.play(this.playing);
    requestAnimationFrame((now) => this.step(now));
  }

  // The times of the frames, with their name and unit.
  begin(times, name, unit) {
    Object.assign(this, { times, name, unit, window: null, height: null, time: times[0] });
    this.slider.max = times.length - 1;
    this.seconds = Math.min(Math.max(times[times.length - 1] - times[0], 2), 12);
    this.show(0);
  }

  play(playing) {
    this.playing = playing;
    this.button.textContent = playing ? "Pause" : "Play";
    this.tell();
  }

  // Tells the time of the picture, and whether it runs.
  tell() {
    if (this.times) this.listeners.forEach((listener) => listener(this.times[this.frame], this.playing));
  }

  // Does what a key means; returns false if it means nothing.
  key({ key, ctrlKey, metaKey, altKey }) {
    if (ctrlKey || metaKey || altKey || !this.times) return false;
    const steps = { ArrowRight: 1, ArrowLeft: -1, PageDown: 10, PageUp: -10, Home: -Infinity, End: Infinity };
    if (key === " ") this.play(!this.playing);
    else if (key in steps) { this.play(false); this.show(this.frame + steps[key]); }
    else if (["+", "="].includes(key)) this.zoom(STEP);
    else if (["-", "\u2212"].includes(key)) this.zoom(1 / STEP);
    else if (key === "0") this.fit();
    else return false;
    return true;
  }

  step(now) {
    if (this.playing && this.before !== null && this.times && this.groups.size) {
      const [first, last] = [this.times[0], this.times[this.times.length - 1]];
      this.time += ((now - this.before) / 1000) * ((last - first) / this.seconds);
      if (this.time > last || !(this.time >= first)) this.time = first;
      let k = this.times.findIndex((t) => t > this.time) - 1;
      this.show(k < 0 ? this.times.length - 1 : k, true);
    }
    this.before = now;
    requestAnimationFrame((next) => this.step(next));
  }

  show(frame, is_playing = false) {
    if (!this.times) return;
    this.frame = Math.min(Math.max(frame, 0), this.times.length - 1);
    if (!is_playing) this.time = this.times[this.frame];
    this.slider.value = this.frame;
    this.readout.textContent = `${this.name} = ${this.times[this.frame].toPrecision(4)} ${this.unit}`;
    this.slider.setAttribute("aria-valuetext", this.readout.textContent);
    this.svg.dataset.frame = this.frame;
    this.groups.forEach((group) => this.draw(group));
    this.tell();
  }

  // Sets what is drawn under a name: the parts, and a function that gives the numbers of a frame, or null for nothing.
  set(key, parts, numbers, className = key) {
    const old = this.groups.get(key);
    const shape = JSON.stringify(parts);
    if (old && numbers && old.shape === shape) {
      old.numbers = numbers;
      return this.draw(old);
    }
    old?.node.remove();
    this.groups.delete(key);
    if (!numbers) return;
    const order = layout(parts);
    const node = element("g", { class: className });
    const named = Object.fromEntries(Object.keys(made).map((name) => [name, element("g", { class: name })]));
    node.append(...Object.values(named));
    const nodes = order.map(({ name }) => named[name].appendChild(made[name]()));
    this.groups.set(key, { node, nodes, order, numbers, shape });
    if (!this.window) this.fit();
    if (key === "analysed") this.svg.append(node); else this.svg.prepend(node);
    this.draw(this.groups.get(key));
  }

  // Fits the view to the motion of the analysed design; its height is that of the first design of a model. It stays while a variable is dragged, unless the mechanism leaves it.
  fit() {
    const group = this.groups.get("analysed");
    if (!group || !this.times) return;
    const [low, high] = [[Infinity, Infinity], [-Infinity, -Infinity]];
    for (let frame = 0; frame < this.times.length; frame++) {
      const numbers = group.numbers(frame);
      group.order.forEach(({ name, at, length }) => {
        for (let i = at; i + 1 < at + length; i += 2) {
          if (name === "sliders" && i > at) break;
          [0, 1].forEach((axis) => {
            low[axis] = Math.min(low[axis], numbers[i + axis]);
            high[axis] = Math.max(high[axis], numbers[i + axis]);
          });
        }
      });
    }
    const size = Math.max(high[0] - low[0], high[1] - low[1], 1e-9);
    const pad = 0.03 * size;
    this.window = { x: [low[0] - pad, high[0] + pad], y: [low[1] - pad, high[1] + pad] };
    const [width, height] = [high[0] - low[0] + 2 * pad, high[1] - low[1] + 2 * pad];
    this.height ??= WIDTH / Math.min(Math.max(width / height, 1.1), 2.6);
    this.scale = Math.min((WIDTH - 2 * MARGIN) / width, (this.height - 2 * MARGIN) / height);
    this.middle = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2];
    this.fitted = this.scale;
    this.zoomed(false);
    this.svg.setAttribute("viewBox", `0 0 ${WIDTH} ${this.height.toFixed(0)}`);
    this.groups.forEach((one) => this.draw(one));
  }

  zoomed(is_zoomed) {
    this.is_zoomed = is_zoomed;
    this.svg.classList.toggle("zoomed", is_zoomed);
    this.svg.dataset.zoom = Number((this.scale / this.fitted).toPrecision(3));
  }

  // Changes the scale by a factor; what is at a place of the drawing stays there.
  zoom(factor, [u, v] = [WIDTH / 2, this.height / 2]) {
    if (!this.window || this.is_held) return;
    const scale = Math.min(Math.max(this.scale * factor, LEAST * this.fitted), MOST * this.fitted);
    const change = 1 / this.scale - 1 / scale;
    this.middle = [this.middle[0] + (u - WIDTH / 2) * change, this.middle[1] - (v - this.height / 2) * change];
    this.scale = scale;
    this.zoomed(true);
    this.groups.forEach((one) => this.draw(one));
  }

  // Moves the drawing.
  shift(du, dv) {
    this.middle = [this.middle[0] - du / this.scale, this.middle[1] + dv / this.scale];
    this.groups.forEach((one) => this.draw(one));
  }

  // Keeps the view while a point is dragged.
  hold(is_held) {
    this.is_held = is_held;
    this.keepInside();
  }

  // Fits the view again if a motion leaves it, unless the user has zoomed it.
  keepInside() {
    if (this.is_held || this.is_zoomed) return;
    const group = this.groups.get("analysed");
    if (!group || !this.window) return;
    const { x, y } = this.window;
    const leaves = this.times.some((_, frame) => {
      const numbers = group.numbers(frame);
      return group.order.some(({ at }) => !(numbers[at] >= x[0] && numbers[at] <= x[1] && numbers[at + 1] >= y[0] && numbers[at + 1] <= y[1]));
    });
    if (leaves) this.fit();
  }

  // Size of the mechanism and its motion in m.
  size() {
    const { x, y } = this.window;
    return Math.max(x[1] - x[0], y[1] - y[0]);
  }

  place(x, y) {
    return [WIDTH / 2 + this.scale * (x - this.middle[0]), this.height / 2 - this.scale * (y - this.middle[1])];
  }

  // A place on the screen in the units of the drawing.
  inside(clientX, clientY) {
    const { x, y } = new DOMPoint(clientX, clientY).matrixTransform(this.svg.getScreenCTM().inverse());
    return [x, y];
  }

  // The point of the mechanism's plane at a place on the screen.
  unplace(clientX, clientY) {
    const [x, y] = this.inside(clientX, clientY);
    return [this.middle[0] + (x - WIDTH / 2) / this.scale, this.middle[1] - (y - this.height / 2) / this.scale];
  }

  draw(group) {
    // It may be removed before it is drawn.
    inNextFrame(group, () => { if (group.node.isConnected) this.render(group); });
  }

  render({ nodes, order, numbers }) {
    if (!this.window) return;
    const all = numbers(this.frame);
    if (!all) return;
    order.forEach(({ name, at, length }, k) => {
      const node = nodes[k];
      if (name === "sliders") {
        const [x, y] = this.place(all[at], all[at + 1]);
        return node.setAttribute("transform", `translate(${x.toFixed(1)} ${y.toFixed(1)}) rotate(${((-all[at + 2] * 180) / Math.PI).toFixed(1)})`);
      }
      const flat = [];
      for (let i = at; i < at + length; i += 2) flat.push(...this.place(all[i], all[i + 1]));
      if (["masses", "ground", "joints"].includes(name)) return node.setAttribute("transform", `translate(${flat[0].toFixed(1)} ${flat[1].toFixed(1)})`);
      node.setAttribute("d", name === "springs" ? spring(flat) : path(flat, ["plates", "beams"].includes(name)));
    });
  }

  // Arrows from the points of the mechanism by the derivative of the frame times `step`; `slopes(frame)` or null for none.
  arrows(parts, slopes, step) {
    this.set("arrows", null, null);
    const base = this.groups.get("analysed");
    if (!slopes || !base) return;
    const points = handles(parts);
    const node = element("g", { class: "arrows" });
    const nodes = points.map(() => node.appendChild(element("path")));
    const arrow = {
      node, nodes: [], order: [],
      numbers: (frame) => {
        const [here, slope] = [base.numbers(frame), slopes(frame)];
        points.forEach(({ at }, k) => {
          const [x, y] = this.place(here[at], here[at + 1]);
          const [u, v] = this.place(here[at] + step * slope[at], here[at + 1] + step * slope[at + 1]);
          const [dx, dy] = [u - x, v - y];
          const length = Math.hypot(dx, dy);
          const head = Math.min(7, length / 2) / (length || 1);
          const [hx, hy] = [dx * head, dy * head];
          const tip = `M${x} ${y}L${u} ${v}M${u - hx - hy / 2} ${v - hy + hx / 2}L${u} ${v}L${u - hx + hy / 2} ${v - hy - hx / 2}`;
          nodes[k].setAttribute("d", length > 1.5 ? tip : "");
        });
        return here;
      },
    };
    this.groups.set("arrows", arrow);
    this.svg.append(node);
    this.draw(arrow);
  }
}
