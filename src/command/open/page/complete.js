// Completion in the editor: tables, keys, words and names that are valid at the cursor, from the declarations of the model file.

import * as server from "./server.js";
import { type } from "./editor.js";
import { make } from "./elements.js";

// Pause in typing after which words are offered.
const PAUSE = 120;

export class Completer {
  // `replaced()` is called after the text has changed.
  constructor(area, list, replaced) {
    Object.assign(this, { area, list, replaced, timer: 0, words: [], from: 0, at: -1, asked: 0, is_wanted: false });
    area.setAttribute("aria-autocomplete", "list");
    area.setAttribute("aria-controls", list.id);
    area.addEventListener("input", (event) => {
      if (!event.inputType) return;
      clearTimeout(this.timer);
      // A blank closes the list, unless it follows `=`.
      const typed = area.value.slice(0, area.selectionStart);
      if (/[\w[."-]$|= $/.test(typed)) this.timer = setTimeout(() => this.ask(false), PAUSE); else this.close();
    });
    area.addEventListener("keydown", (event) => this.key(event));
    ["blur", "scroll", "pointerdown"].forEach((kind) => area.addEventListener(kind, () => this.close()));
    list.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      const item = event.target.closest("li");
      if (item) this.take(Number(item.dataset.number));
    });
  }

  // Asks the server; `is_wanted` after Ctrl-Space, where Enter takes the first word.
  async ask(is_wanted) {
    const at = this.area.selectionStart;
    if (at !== this.area.selectionEnd) return;
    this.asked += 1;
    const [text, mine] = [this.area.value, this.asked];
    const { from, words } = await server.post("complete", { text, at });
    if (mine !== this.asked || this.area.value !== text || this.area.selectionStart !== at) return;
    Object.assign(this, { words, from, at: is_wanted ? 0 : -1, is_wanted });
    this.show();
  }

  key(event) {
    if (event.key === " " && event.ctrlKey) { event.preventDefault(); this.ask(true); return; }
    if (this.list.hidden) return;
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (step) this.at = (this.at + step + this.words.length) % this.words.length;
    else if (event.key === "Escape") { event.preventDefault(); return this.close(); }
    // Enter is a new line as long as no word is chosen.
    else if (event.key === "Tab" || (event.key === "Enter" && this.at >= 0)) { event.preventDefault(); return this.take(Math.max(this.at, 0)); }
    else { if (event.key === "Enter" || event.key.startsWith("Arrow")) this.close(); return; }
    event.preventDefault();
    this.show();
  }

  take(number) {
    const { text } = this.words[number];
    type(this.area, text, this.from, this.area.selectionStart);
    this.close();
    this.replaced();
  }

  show() {
    this.list.hidden = this.words.length === 0;
    if (this.list.hidden) return;
    this.list.replaceChildren(...this.words.map(({ text, about }, number) =>
      make("li", { role: "option", id: `word-${number}`, "data-number": number, "aria-selected": String(number === this.at) }, make("b", { text }), ` ${about}`)));
    if (this.at >= 0) {
      this.area.setAttribute("aria-activedescendant", `word-${this.at}`);
      this.list.children[this.at].scrollIntoView({ block: "nearest" });
    } else this.area.removeAttribute("aria-activedescendant");
    // Below the line of the word; above it where there is more room.
    const style = getComputedStyle(this.area);
    const [line, pad] = [parseFloat(style.lineHeight), parseFloat(style.paddingTop)];
    const before = this.area.value.slice(0, this.from).split("\n");
    const context = document.createElement("canvas").getContext("2d");
    context.font = `${style.fontSize} ${style.fontFamily}`;
    const left = this.area.offsetLeft + pad + context.measureText(before[before.length - 1]).width - this.area.scrollLeft;
    const top = this.area.offsetTop + pad + before.length * line - this.area.scrollTop;
    const most = this.list.offsetParent.clientWidth - this.list.offsetWidth;
    const [height, room] = [this.list.offsetHeight, this.list.offsetParent.clientHeight - top];
    const shown = height <= room || room > top - line ? top : Math.max(top - line - height, 0);
    Object.assign(this.list.style, { left: `${Math.max(Math.min(left, most), 0)}px`, top: `${shown}px` });
  }

  close() {
    clearTimeout(this.timer);
    this.asked += 1;
    this.list.hidden = true;
    this.area.removeAttribute("aria-activedescendant");
  }
}
