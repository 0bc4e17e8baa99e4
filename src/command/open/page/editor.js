// The model file beside the picture: edited text goes to FILE.unsaved at once, and to the file when it is saved.

import * as server from "./server.js";

// Pause in typing after which the text is sent.
const PAUSE = 250;
// Time after which a text that could not be sent is sent again.
const AGAIN = 1000;

// The part in which a text differs from an older one: its place in the older text, and the words that are there now.
function difference(old, text) {
  const most = Math.min(old.length, text.length);
  let [from, same] = [0, 0];
  while (from < most && old[from] === text[from]) from += 1;
  while (same < most - from && old[old.length - 1 - same] === text[text.length - 1 - same]) same += 1;
  return [text.slice(from, text.length - same), from, old.length - same];
}

// Writes words in place of a part of a text as if they were typed: Ctrl-Z undoes them, and then what was typed before.
export function type(area, words, from, to) {
  const focused = document.activeElement;
  area.focus({ preventScroll: true });
  area.setSelectionRange(from, to);
  // Obsolete, and the only way that keeps the list of edits of a text area.
  if (!document.execCommand(words ? "insertText" : "delete", false, words)) area.setRangeText(words, from, to, "end");
  if (focused !== area) focused?.focus({ preventScroll: true });
}

export class Editor {
  constructor({ text, marks, save, discard, state, errors }) {
    // `base`, `known`: hashes of the text on disk and of the text of the server that are edited here; `unsent`: the text differs from that
    // of the server; `asked`: hash of the changed file about which the user was asked; `other`: that of the text of another page, likewise.
    Object.assign(this, { area: text, marks, save, discard, state, errors, timer: 0, base: "", known: "", unsent: false, asked: null, other: null, last: Promise.resolve() });
    text.addEventListener("input", () => this.edited(PAUSE));
    text.addEventListener("scroll", () => { marks.scrollTop = text.scrollTop; });
    text.addEventListener("keydown", (event) => {
      if (event.key === "s" && (event.ctrlKey || event.metaKey)) { event.preventDefault(); this.write(); }
    });
    save.addEventListener("click", () => this.write());
    discard.addEventListener("click", async () => {
      // The text of the other page stays.
      if (this.other === null && !(await this.post("discard", {}))) return;
      clearTimeout(this.timer);
      [this.unsent, this.other] = [false, null];
      this.area.blur();
      this.show(await server.model());
    });
    window.addEventListener("beforeunload", (event) => { if (this.unsent) event.preventDefault(); });
  }

  // The answer to a request, or null; then the reason is shown.
  async post(route, body) {
    try {
      const answer = await server.post(route, body);
      if (!answer.error) return answer;
      this.state.textContent = `not saved: ${answer.error}`;
    } catch (error) {
      if (error instanceof server.Outdated) throw error;
      this.state.textContent = `not sent: ${error.message}. It is sent when the server answers; keep this page open.`;
    }
    return null;
  }

  // Puts the text on the clipboard. Without the permission, it is selected, and the answer is false.
  async copy() {
    try {
      await navigator.clipboard.writeText(this.area.value);
      return true;
    } catch {
      this.area.focus();
      this.area.select();
      return false;
    }
  }

  // Sends the text after a pause in typing.
  edited(rest) {
    this.unsent = true;
    if (this.state.textContent === "saved") this.state.textContent = "not saved";
    this.save.disabled = this.discard.disabled = false;
    this.number();
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.send(), rest);
  }

  // Returns whether the server has the text; otherwise it is sent again later. One text is sent after the other, because each names the
  // one before it.
  send() {
    clearTimeout(this.timer);
    const next = () => this.sendNow();
    this.last = this.last.then(next, next);
    return this.last;
  }

  async sendNow() {
    const text = this.area.value;
    try {
      const answer = await this.post("edit", { text, edited: this.known, base: this.base });
      if (answer) [this.known, this.other] = [answer.edited, null];
      if (this.area.value === text) this.unsent = !answer;
      if (!answer) this.edited(AGAIN);
      return Boolean(answer);
    } catch {
      // Another page has edited the text. The user decides which text is kept.
      const answer = await server.model();
      this.other = answer.edited;
      this.state.textContent = "not sent: another page has edited the text. Replace its text, or show it in place of this one.";
      this.show(answer);
      return false;
    }
  }

  async write() {
    const replaces = this.other !== null;
    if (replaces) this.known = this.other;
    // After a replacement, nothing is saved yet, so that the user can inspect the text first.
    if (!(await this.send()) || replaces) return;
    let has_changed = false;
    try {
      if (!(await this.post("save", { over: this.asked }))) return;
    } catch {
      has_changed = true;
    }
    // What was found on disk may be newer than what this page has seen.
    const answer = await server.model();
    this.asked = has_changed ? answer.found : null;
    this.show(answer);
  }

  // Replaces the text as an edit of the user, such as a limit that was drawn.
  replace(text) {
    type(this.area, ...difference(this.area.value, text));
    this.edited(0);
  }

  // Shows the text of the server, unless it is being edited here.
  show(answer) {
    // Text that is not sent yet was edited from the text before.
    if (!this.unsent) {
      [this.base, this.known] = [answer.base, answer.edited];
      // The caret stays where it is.
      if (this.area.value !== answer.text) this.area.setRangeText(...difference(this.area.value, answer.text), "preserve");
      this.save.disabled = this.discard.disabled = !answer.is_unsaved;
      this.state.textContent = this.words(answer);
    }
    // The question is about the file that was found then.
    if (!answer.is_unsaved || answer.found !== this.asked) this.asked = null;
    this.save.textContent = this.other !== null ? "Replace the other text" : this.asked === null ? "Save" : "Replace the changed file";
    this.discard.textContent = this.other === null ? "Discard" : "Show the other text";
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

  // What is known of the text, in words.
  words(answer) {
    const kept = `not saved: kept in ${answer.file}.unsaved`;
    if (answer.failure) return `${answer.failure}. Save writes the text to ${answer.file}.`;
    if (!answer.is_unsaved) return "saved";
    if (!answer.has_changed) return kept;
    if (!answer.base) return `${kept} by an earlier version; the file may have changed since`;
    return this.asked !== null && answer.found === this.asked ? "The file has changed on disk. Saving again replaces it; Discard shows the file."
      : `${kept}; the file has changed on disk`;
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

// The text of a constraint that keeps an output on one side of a line through points (t, v) of increasing t, in the units of the plot.
// Formulas have the SI values of an output that is `shown_in` a unit, and its limits name the unit; without one (`of_si` is null) both
// have the values as they are shown.
export function limitText(text, { name: output, unit, factor: of_si }, relation, drawn, digits, { variable, factor }) {
  const round = (v) => Number(v.toPrecision(digits));
  const points = drawn.map(([t, v]) => [t * factor, v * (of_si ?? 1)]);
  const limit = (v) => (of_si === null ? round(v) : JSON.stringify(`${round(v)} ${unit}`));
  const names = new Set([...text.matchAll(/name\s*=\s*"([^"]*)"/g)].map((found) => found[1]));
  let k = 1;
  while (names.has(`drawn limit ${k}`)) k += 1;
  const key = relation === "≤" ? "at_most" : "at_least";
  const values = points.map(([, v]) => v);
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const [[t0, v0], [t1, v1]] = [points[0], points[points.length - 1]];
  const head = (value, most) => `${text.trimEnd()}\n\n[[constraint]]\nname = "drawn limit ${k}"\nvalue = "${value}"\n${key} = ${most}\nfrom = ${round(t0)}\nto = ${round(t1)}\n`;
  if (high - low < 0.02 * Math.max(Math.abs(low), Math.abs(high))) return head(output, limit((low + high) / 2 / (of_si ?? 1)));
  if (points.length === 2) {
    const slope = (v1 - v0) / (t1 - t0);
    return head(`${output} - (${round(v0)} + ${round(slope)}*(${variable} - ${round(t0)}))`.replaceAll("+ -", "- ").replaceAll("- -", "+ "), limit(0));
  }
  let n = k;
  while (text.includes(`[table.drawn_${n}]`)) n += 1;
  const list = (numbers) => `[${numbers.map(round).join(", ")}]`;
  return `${head(`${output} - drawn_${n}(${variable})`, limit(0))}\n[table.drawn_${n}]\nx = ${list(points.map(([t]) => t))}\ny = ${list(values)}\ninterpolation = "linear"\n`;
}
