// The objective and the margins of constraints: analysed, approximated, and as the chosen variable moves them. Only what has changed is written,
// because a written text is a new layout of the page.

import { soon } from "./frames.js";
import { make } from "./elements.js";
import { withUnit } from "./plots.js";

export const say = (node, text) => { if (node.textContent !== text) node.textContent = text; };

const mark = (node, name, value) => {
  if (value === undefined) node.removeAttribute(name);
  else if (node.getAttribute(name) !== String(value)) node.setAttribute(name, value);
};

// A bar of a track between two places in percent; its smallest width does not shift its beginning.
const stretch = (bar, from, to) => Object.assign(bar.style, to < from
  ? { left: "auto", right: `${100 - from}%`, width: `${from - to}%` } : { left: `${from}%`, right: "auto", width: `${to - from}%` });

const inside = (place) => Math.min(Math.max(place, 0), 100);

// A track with a bar of what the chosen variable moves, and the number of the approximation or, without one, of the bar. Their space is
// always reserved, so that the layout does not shift under the pointer.
function changes(unit, ...marks) {
  const [bar, number] = [make("u"), make("output")];
  const node = make("span", { class: "changes" }, make("span", { class: "track" }, ...marks, bar), number);
  // `moved` is a change and the size of its scale; the bar begins where that of the value ends, `part` from the middle in percent.
  const show = (moved, part, predicted) => {
    bar.hidden = !moved?.change;
    if (moved) stretch(bar, inside(50 + part), inside(50 + part + (50 * moved.change) / (moved.size || 1)));
    const change = moved ? `Δ ≈ ${moved.change > 0 ? "+" : ""}${withUnit(Number(moved.change.toPrecision(3)), unit)}` : "";
    say(number, predicted === undefined || predicted === null ? change : `≈ ${withUnit(predicted, unit)}`);
    mark(number, "title", number.textContent);
  };
  return { node, show };
}

function objectiveRow({ name, unit, goal }) {
  const value = make("dd", { id: "objective-value" });
  const moved = changes(unit);
  const node = make("div", {}, make("dt", { text: `${name}, ${goal}` }), value, make("dd", { class: "remark" }, moved.node));
  return { node, show: ({ shown, prediction, of }) => {
    say(value, withUnit(shown.objective, unit));
    moved.show(of.get(null), 0, prediction?.objective);
  } };
}

const KINDS = { violated: "bad", active: "fair", satisfied: "good" };

function marginRow({ name, unit, relation }, j, time) {
  const [title, pill, words, bar, approximation] = [make("span"), make("span"), make("p"), make("i"), make("b", { title: "approximation" })];
  const moved = changes(unit, bar, approximation);
  const node = make("div", { class: "margin", "data-constraint": name }, make("header", {}, title, pill), moved.node, words);
  return { node, show: ({ shown, prediction, of }) => {
    const now = shown.constraints[j];
    const predicted = prediction?.constraints[j].margin;
    now.size ??= Math.max(Math.abs(now.limit), ...now.values.filter((v) => v !== null).map(Math.abs), 1e-300);
    const part = (margin) => 50 * Math.max(-1, Math.min(1, margin / now.size));
    const when = now.time === null || !time ? "" : ` at ${time.name} ${withUnit(now.time, time.unit)}`;
    mark(node, "data-margin", now.margin);
    mark(node, "data-predicted", predicted);
    say(title, `${name} ${relation} ${withUnit(now.limit, unit)}`);
    say(pill, now.status);
    mark(pill, "class", `pill ${KINDS[now.status]}`);
    say(words, `margin ${withUnit(now.margin, unit)}${when}`);
    mark(bar, "class", now.margin < 0 ? "over" : "");
    stretch(bar, 50, 50 + part(now.margin));
    approximation.hidden = predicted === undefined;
    if (predicted !== undefined) approximation.style.left = `${50 + part(predicted)}%`;
    const effect = of.get(j);
    moved.show(effect && { ...effect, size: now.size }, part(now.margin), predicted);
  } };
}

export class Numbers {
  constructor(objective, margins) {
    Object.assign(this, { places: [objective, margins], rows: [[], []], is_shown: false });
  }

  // The rows of a model; they appear with their first numbers.
  begin(model) {
    this.rows = [model.objective ? [objectiveRow(model.objective)] : [], model.constraints.map((constraint, j) => marginRow(constraint, j, model.time))];
    this.is_shown = false;
  }

  // Shows the record of a design, its approximation, and what the chosen variable moves: by constraint, and under null the objective.
  show(shown, prediction, of) {
    const draw = (row) => row.show({ shown, prediction, of });
    if (this.is_shown) return this.rows.flat().forEach((row) => soon(row, () => draw(row)));
    this.rows.flat().forEach(draw);
    this.places.forEach((place, k) => place.replaceChildren(...this.rows[k].map(({ node }) => node)));
    this.is_shown = true;
  }

  // A design without numbers.
  none(text) {
    this.places[0].replaceChildren();
    this.places[1].replaceChildren(make("p", { text }));
    this.is_shown = false;
  }
}
