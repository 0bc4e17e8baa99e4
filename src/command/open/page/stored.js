// Stored runs of the model: overlay in the plot of convergence, differences of two, notes; and the list of its studies.

import * as server from "./server.js";
import { button, cells, make, table } from "./elements.js";

// Largest number of runs in the plot; each has a colour.
const OVERLAYS = 4;

// The folder of a run or study, and the limits in which it differs from the model.
const named = ({ folder, limits }) => (limits?.length ? make("span", {}, folder, make("small", { class: "limits", text: `other limits: ${limits.join("; ")}` })) : folder);

export class Stored {
  // `show(design)` puts a design on the sliders, `pin(design, name)` pins it, `resume(folder)` continues a run.
  constructor(place, { convergence, show, pin, resume, study }) {
    Object.assign(this, { place, convergence, show, pin, resume, study, chosen: [], seen: "" });
    this.find = (id) => place.querySelector(id);
    place.addEventListener("toggle", () => { if (place.open) this.list(); });
  }

  // What a request answers; an error is shown.
  async ask(route, body) {
    const answer = body === undefined ? await server.get(route) : await server.post(route, body);
    this.find("#stored-note").textContent = answer.error ?? "";
    return answer.error ? null : answer;
  }

  // Reads the lists again after a change of the model or of a run, unless a note is being written. `state` names both.
  refresh(state) {
    const is_changed = state !== this.seen;
    this.seen = state;
    if (is_changed && this.place.open && !this.place.contains(document.activeElement?.closest("input[type=text]"))) this.list();
  }

  // Reads the lists; there may be many folders.
  async list() {
    const answer = await this.ask("stored");
    if (!answer) return;
    const { stored, studies, others } = answer;
    this.find("#stored-others").textContent = others ? `${others} runs and studies of other problems are not listed. Those with other limits are; any other edit of the problem makes it another one.` : "";
    this.find("#stored").replaceChildren(...table(["plot", "folder", "begun", "method", "status", "analyses", "objective", "note", ""], stored.map((one) => this.row(one))));
    this.find("#studies").replaceChildren(...table(["folder", "begun", "kind", "status", "runs", "failed", ""], studies.map((one) => {
      const row = make("tr");
      const open = button("Open", async () => { const rows = await this.ask("study", { folder: one.folder }); if (rows) this.study.open(rows); });
      open.disabled = one.status === "Damaged";
      cells(row, [named(one), one.begun.replace("T", " ").replace("Z", ""), one.kind, one.status, one.done === null ? null : `${one.done} of ${one.runs}`, one.failed, open]);
      return row;
    })));
    this.place.dataset.listed = `${stored.length} ${studies.length}`;
  }

  row(one) {
    const row = make("tr", one.fault ? { title: one.fault } : {});
    const plot = make("input", { type: "checkbox", "aria-label": `Plot ${one.folder}` });
    plot.checked = this.chosen.some((chosen) => chosen?.folder === one.folder);
    plot.addEventListener("change", () => this.choose(one, plot));
    const note = make("input", { type: "text", value: one.note ?? "", placeholder: "note", "aria-label": `Note on ${one.folder}` });
    note.addEventListener("change", () => this.ask("note", { folder: one.folder, text: note.value }));
    const resume = button("Resume", () => this.resume(one.folder));
    const with_design = (act) => async () => { const run = await this.ask("stored-run", { folder: one.folder }); if (run?.design) act(run.design, one.folder); };
    const acts = make("span", { class: "acts" }, resume, button("Show", with_design(this.show)), button("Pin", with_design(this.pin)));
    resume.disabled = one.status === "Running";
    if (one.status === "Damaged") [plot, note, ...acts.children].forEach((control) => { control.disabled = true; });
    cells(row, [plot, named(one), one.begun.replace("T", " ").replace("Z", ""), one.method, one.status, one.analyses, one.objective, note, acts]);
    return row;
  }

  async choose(one, box) {
    const key = (slot) => `stored-${slot}`;
    const known = this.chosen.findIndex((chosen) => chosen?.folder === one.folder);
    if (known >= 0) {
      this.convergence.set(key(known), "", null);
      this.chosen[known] = null;
    } else {
      const slot = Array.from({ length: OVERLAYS }, (_, k) => k).find((k) => !this.chosen[k]);
      const run = slot === undefined ? null : await this.ask("stored-run", { folder: one.folder });
      if (slot === undefined) this.find("#stored-note").textContent = `the plot shows at most ${OVERLAYS} stored runs`;
      if (!run) { box.checked = false; return; }
      this.chosen[slot] = one;
      this.convergence.set(key(slot), `${one.folder} (${one.method})`, run.cycles);
    }
    await this.compare();
  }

  // Settings and results in which the two chosen runs differ.
  async compare() {
    const folders = this.chosen.filter(Boolean).map((one) => one.folder);
    const place = this.find("#differences");
    const answer = folders.length === 2 ? await this.ask("differences", { folders }) : null;
    if (!answer) return place.replaceChildren();
    const of = (heads, rows) => make("div", { class: "table" }, make("div", { tabindex: "0" }, make("table", {}, ...table(heads, rows.map((values) => { const row = make("tr"); cells(row, values); return row; })))));
    const changed = answer.quantities.filter(({ values: [a, b] }) => a !== b);
    place.replaceChildren(make("h3", { text: `Differences of ${folders[0]} and ${folders[1]}` }),
      ...(answer.one_problem ? [] : [make("p", { class: "soft", text: "They solve different problems." })]),
      of(["setting", folders[0], folders[1]], answer.settings.map((c) => [c.key, c.before ?? "default", c.after ?? "default"])),
      of(["result", "unit", folders[0], folders[1], "difference"], changed.map(({ name, unit, values: [a, b] }) => [name, unit, a, b, a === null || b === null ? null : b - a])));
  }
}
