// The model file beside the picture: edited text goes to FILE.unsaved at once, and to the file when it is saved.

import * as server from "./server.js";

// Rest of the keyboard after which the text is sent.
const REST = 250;

export class Editor {
  constructor({ text, marks, save, discard, state, errors }) {
    Object.assign(this, { area: text, marks, save, discard, state, errors, timer: 0, hash: "", sent: null });
    text.addEventListener("input", () => {
      this.number();
      clearTimeout(this.timer);
      this.timer = setTimeout(() => this.send(), REST);
    });
    text.addEventListener("scroll", () => { marks.scrollTop = text.scrollTop; });
    text.addEventListener("keydown", (event) => {
      if (event.key === "s" && (event.ctrlKey || event.metaKey)) { event.preventDefault(); this.write(); }
    });
    save.addEventListener("click", () => this.write());
    discard.addEventListener("click", async () => {
      clearTimeout(this.timer);
      this.sent = null;
      this.area.blur();
      await server.post("discard", {});
    });
  }

  async send() {
    clearTimeout(this.timer);
    this.timer = 0;
    this.sent = this.area.value;
    const answer = await server.post("edit", { text: this.sent, base: this.hash });
    if (answer.error) this.state.textContent = answer.error;
  }

  async write() {
    await this.send();
    try {
      const answer = await server.post("save", { over: this.save.dataset.over === "true" });
      if (answer.error) this.state.textContent = answer.error;
    } catch (error) {
      if (!(error instanceof server.Outdated)) throw error;
      this.save.dataset.over = "true";
      this.save.textContent = "Replace the changed file";
      this.state.textContent = "The file has changed on disk. Saving again replaces it; Discard shows the file.";
    }
  }

  // Replaces the text as an edit of the user, such as a limit that was drawn.
  async replace(text) {
    this.area.value = text;
    this.number();
    await this.send();
  }

  // Shows the text of the server, unless it is being edited here.
  show(answer) {
    // Text that is not sent yet was edited from the text before.
    if (this.timer === 0) this.hash = answer.base;
    if (this.timer === 0 && this.area.value !== answer.text) this.area.value = answer.text;
    this.save.disabled = this.discard.disabled = !answer.is_unsaved;
    this.save.dataset.over = "false";
    this.save.textContent = "Save";
    this.state.textContent = !answer.is_unsaved ? "saved"
      : `not saved: kept in ${answer.file}.unsaved${answer.has_changed ? "; the file has changed on disk" : ""}`;
    this.lines = new Set(answer.errors.map((e) => e.line));
    this.number();
    this.errors.replaceChildren(...answer.errors.map((e) => {
      const item = document.createElement("li");
      const go = document.createElement("button");
      go.type = "button";
      go.textContent = `line ${e.line}`;
      go.addEventListener("click", () => {
        this.area.focus();
        this.area.setSelectionRange(e.from, e.to);
        this.area.scrollTop = (e.line - 4) * (this.area.scrollHeight / Math.max(this.area.value.split("\n").length, 1));
      });
      item.append(go, ` ${e.message}${e.label ? `: ${e.label}` : ""}${e.help ? ` (${e.help})` : ""}`);
      return item;
    }));
  }

  // Numbers of the lines, those with errors marked.
  number() {
    const count = this.area.value.split("\n").length;
    this.marks.replaceChildren(...Array.from({ length: count }, (_, k) => {
      const line = document.createElement("span");
      line.textContent = k + 1;
      if (this.lines?.has(k + 1)) line.className = "wrong";
      return line;
    }));
    this.marks.scrollTop = this.area.scrollTop;
  }
}

// The text of a constraint that keeps an output on one side of a line through points (t, v) of increasing t, in the units of
// the plot. A plain number of `at_most` is in the unit of the output; formulas are in SI units.
export function limitText(text, { name: output, factor: unit }, relation, drawn, digits, { variable, factor }) {
  const round = (v) => Number(v.toPrecision(digits));
  const points = drawn.map(([t, v]) => [t * factor, v * unit]);
  const names = new Set([...text.matchAll(/name\s*=\s*"([^"]*)"/g)].map((found) => found[1]));
  let k = 1;
  while (names.has(`drawn limit ${k}`)) k += 1;
  const key = relation === "≤" ? "at_most" : "at_least";
  const values = points.map(([, v]) => v);
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const [[t0, v0], [t1, v1]] = [points[0], points[points.length - 1]];
  const head = (value, limit) => `${text.trimEnd()}\n\n[[constraint]]\nname = "drawn limit ${k}"\nvalue = "${value}"\n${key} = ${limit}\nfrom = ${round(t0)}\nto = ${round(t1)}\n`;
  if (high - low < 0.02 * Math.max(Math.abs(low), Math.abs(high))) return head(output, round((low + high) / 2 / unit));
  if (points.length === 2) {
    const slope = (v1 - v0) / (t1 - t0);
    return head(`${output} - (${round(v0)} + ${round(slope)}*(${variable} - ${round(t0)}))`.replaceAll("+ -", "- ").replaceAll("- -", "+ "), 0);
  }
  let n = k;
  while (text.includes(`[table.drawn_${n}]`)) n += 1;
  const list = (numbers) => `[${numbers.map(round).join(", ")}]`;
  return `${head(`${output} - drawn_${n}(${variable})`, 0)}\n[table.drawn_${n}]\nx = ${list(points.map(([t]) => t))}\ny = ${list(values)}\ninterpolation = "linear"\n`;
}
