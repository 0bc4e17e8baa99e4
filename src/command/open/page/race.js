// A race: a second run, with another method, from the start of the run. Run, Pause and Step act on both.

import * as server from "./server.js";
import { button, cells, make, options, table } from "./elements.js";

export class Race {
  // `convergence` is the plot of both, `show(design)` puts a design on the sliders.
  constructor(place, { convergence, show }) {
    Object.assign(this, { place, convergence, show, rival: null, asked: false });
    this.select = place.querySelector("#rival-method");
    this.begin = place.querySelector("#rival-begin");
    this.begin.addEventListener("click", () => this.start());
    this.table = place.querySelector("#rivals");
    this.note = place.querySelector("#rival-note");
  }

  async start() {
    // A rival that is running is not ended without a confirmation.
    if (this.rival?.status === "Running" && !this.asked) return this.ask(true);
    this.ask(false);
    const answer = await server.post("race", { method: this.select.value });
    this.note.textContent = answer.error ?? "";
  }

  ask(asked) {
    this.asked = asked;
    this.begin.textContent = asked ? "Stop it and race anew" : "Race against it";
    if (asked) this.note.textContent = `${this.rival.method ?? "automatic"} still runs. A new rival takes its place; its folder stays.`;
  }

  // Passes run, pause or step to the rival if there is one.
  async act(action) {
    if (this.rival) await server.post("rival", { action });
  }

  update(run, rival) {
    this.rival = rival?.cycles ? rival : null;
    if (this.asked && this.rival?.status !== "Running") {
      this.ask(false);
      this.note.textContent = "";
    }
    const is_there = Boolean(run?.cycles);
    this.place.hidden = !is_there;
    if (!is_there) return;
    options(this.select, run.methods.filter((name) => name !== (run.method ?? "automatic")).map((name) => [name, name]));
    const both = [["run", run], ["rival", this.rival]];
    both.forEach(([key, one]) => this.convergence.set(key, one ? `${one.method ?? "automatic"}${key === "rival" ? " (rival)" : ""}` : key, one?.cycles ?? null));
    if (rival?.fault) this.note.textContent = rival.fault;
    this.place.dataset.status = rival?.status ?? "none";
    if (!this.rival) return this.table.replaceChildren();
    const last = (one) => one.cycles.filter((c) => c.accepted).at(-1);
    this.table.replaceChildren(...table(["method", "status", "trial steps", "analyses", "sensitivity analyses", "objective", "violation %", ""], both.map(([key, one]) => {
      const row = make("tr");
      const acts = make("span", {}, button("Show", () => this.show(one.design), { "aria-label": `Show the design of ${one.method ?? "automatic"}` }));
      if (key === "rival") acts.append(button("Close", () => server.post("rival", { action: "close" }), { "aria-label": "Close the rival" }));
      cells(row, [one.method ?? "automatic", one.status, one.cycles.length - 1, one.analyses, one.sensitivity_analyses, last(one).objective, last(one).violation, acts]);
      return row;
    })));
  }
}
