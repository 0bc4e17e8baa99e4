// Elements of the page, and tables of numbers.

import { short } from "./plots.js";

export const make = (name, attributes = {}, ...children) => {
  const made = document.createElement(name);
  Object.entries(attributes).forEach(([key, value]) => (key === "text" ? (made.textContent = value) : made.setAttribute(key, value)));
  made.append(...children);
  return made;
};

export const button = (text, act, attributes = {}) => {
  const made = make("button", { type: "button", text, ...attributes });
  made.addEventListener("click", act);
  return made;
};

// Cells of a row: numbers, texts, or elements.
export const cells = (row, values) => row.append(...values.map((v) => (v instanceof Node ? make("td", {}, v)
  : make("td", typeof v === "number" || v === null || v === undefined ? { class: "number", text: short(v) } : { text: v }))));

// A table; the heading of a column of numbers is aligned as they are. A heading is a text, or a text with its explanation.
export const table = (heads, rows) => {
  const head = (one, k) => make("th", { scope: "col", ...(typeof one === "string" ? { text: one } : one), ...(rows.length && rows.every((row) => row.cells[k]?.classList.contains("number")) ? { class: "number" } : {}) });
  return [make("thead", {}, make("tr", {}, ...heads.map(head))), make("tbody", {}, ...rows)];
};

// Options of a selection; the chosen one stays if it is still there.
export function options(select, choices) {
  const before = select.value;
  select.replaceChildren(...choices.map(([value, text]) => make("option", { value, text })));
  if (choices.some(([value]) => String(value) === before)) select.value = before;
}
