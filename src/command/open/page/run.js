// The optimization: controls, its cycles, move limits on the sliders, predicted and computed responses.

import * as server from "./server.js";
import { cells, make, options, table } from "./elements.js";
import { short } from "./plots.js";
import { Convergence } from "./convergence.js";
import { Race } from "./race.js";
import { Stored } from "./stored.js";
import { StudyPicture } from "./study.js";

// A text with its numbers written as elsewhere in the page.
const readable = (text) => text?.replace(/\d\.\de-?\d+/g, (number) => short(Number(number)));

// Actions that a race passes to both runs.
const OF_BOTH = ["run", "pause", "stop", "step"];
// Statuses of a run that is running, or of which one action is being executed.
const BUSY = ["Running", "Working", "Starting"];

export class Run {
  // `design()` is that of the sliders, `show(design)` puts one on them, `pin(design, name)` pins one, `box(region)` draws the move
  // limits, `bounds(found)` takes the bounds of the run.
  constructor(place, { design, show, pin, box, bounds }) {
    Object.assign(this, { place, design, show, box, bounds, record: null, shown: null, asked: false });
    this.buttons = Object.fromEntries(["start", "run", "pause", "stop", "step", "back", "accept", "refuse", "close"].map((action) => {
      const button = place.querySelector(`[data-action=${action}]`);
      button.addEventListener("click", () => this.act(action === "start" ? { action, design: design() } : { action }));
      return [action, button];
    }));
    const convergence = new Convergence(place.querySelector("#convergence"));
    this.convergence = convergence;
    this.race = new Race(place.querySelector("#race"), { convergence, show });
    const study = new StudyPicture(place.querySelector("#study"), { show });
    const resume = (folder) => this.act({ action: "resume", folder });
    this.stored = new Stored(place.querySelector("#stored-runs"), { convergence, show, pin, resume, study });
    setInterval(() => this.elapsed(), 1000);
    this.method = place.querySelector("#method");
    this.method.addEventListener("change", () => this.act({ action: "set", key: "method.preset", value: this.method.value }));
    place.querySelector("#setting").addEventListener("submit", (event) => {
      event.preventDefault();
      const [key, value] = ["key", "value"].map((name) => event.target.elements[name].value.trim());
      if (key && value) this.act({ action: "set", key, value });
    });
  }

  async act(action) {
    if (action.action === "start" && !this.may_begin()) return;
    if (action.action === "pause") this.pausing();
    try {
      await server.post("run", action);
    } catch (error) {
      return this.fault(`not done: ${error.message}`);
    }
    if (OF_BOTH.includes(action.action)) await this.race.act(action.action);
  }

  fault(text) {
    const place = this.place.querySelector("#run-fault");
    place.hidden = !text;
    place.textContent = text ?? "";
  }

  // A run that is running is not ended without a confirmation.
  may_begin() {
    const is_asked = this.asked || !BUSY.includes(this.place.dataset.status);
    this.ask(!is_asked);
    return is_asked;
  }

  ask(asked) {
    this.asked = asked;
    this.buttons.start.textContent = asked ? "Stop it and begin here" : "Begin here";
  }

  // A pause does not interrupt a trial step: until it is done, the page says that it was asked to pause.
  pausing() {
    const pill = this.place.querySelector("#run-status");
    if (this.place.dataset.status === "Running") pill.textContent = "Pausing after this trial step";
    this.buttons.pause.disabled = true;
  }

  // The time that the present trial step takes, once it is long.
  elapsed() {
    const seconds = Math.floor((performance.now() - this.since) / 1000);
    const is_long = BUSY.includes(this.place.dataset.status) && seconds >= 2;
    this.place.querySelector("#run-elapsed").textContent = is_long ? `this trial step takes ${seconds} s so far` : "";
  }

  // Without an answer of the server nothing is known of the run.
  lost() {
    this.place.inert = true;
    const pill = this.place.querySelector("#run-status");
    if (this.place.dataset.status === "none") return;
    pill.textContent = "no connection";
    pill.className = "pill bad";
  }

  // The name and the unit of the objective, for the plot of convergence.
  objective({ name, unit, is_peak }) {
    this.place.querySelector("#cycle-words").textContent = `E_f and E_g are errors of the approximation in percent: predicted values are compared with those of the analysis of the step. ${is_peak
      ? "The objective is a peak, whose errors count in E_g; E_f is zero." : "E_f is the error of the objective."} E_g is the largest error of the retained rows of the constraints near their limits.`;
    this.convergence.label = { name, unit };
    this.convergence.draw();
  }

  // Reads the run; called after each change on the server. `revision` is that of the model.
  async update(revision) {
    const { run, rival, differing } = await server.get("run");
    this.place.inert = false;
    this.record = run;
    const find = (id) => this.place.querySelector(id);
    const is_there = Boolean(run?.cycles);
    const { status } = run ?? { status: "none" };
    const pill = find("#run-status");
    pill.textContent = { none: "no run", CycleLimit: "Cycle limit", Working: "At work" }[status] ?? status;
    pill.className = `pill ${status === "Converged" ? "good" : ["Failed", "Infeasible", "Stalled"].includes(status) ? "bad" : "fair"}`;
    const step = `${status} ${run?.folder} ${run?.cycles?.length}`;
    if (step !== this.step) [this.step, this.since] = [step, performance.now()];
    this.place.dataset.status = status;
    this.elapsed();
    this.place.dataset.tries = is_there ? run.cycles.length - 1 : "";
    find("#run-note").textContent = run ? [run.folder && `in ${run.folder}`, readable(run.reason)].filter(Boolean).join("; ") : "Starts at the design on the sliders.";
    this.fault(run?.fault);
    const other = find("#run-differing");
    other.hidden = !is_there || differing.length === 0;
    other.textContent = `The run continues with the problem with which it began. The model differs: ${readable(differing.join("; "))}. Begin here starts a run of the model at the design on the sliders.`;
    const last = is_there ? run.cycles[run.cycles.length - 1] : null;
    this.race.update(run, rival);
    const pressed = Object.values(this.buttons).find((button) => button === document.activeElement);
    const either = (wanted) => status === wanted || rival?.status === wanted;
    this.buttons.run.disabled = this.buttons.step.disabled = !either("Paused");
    this.buttons.pause.disabled = !either("Running");
    this.buttons.stop.disabled = !BUSY.some(either);
    const is_busy = BUSY.includes(status);
    if (!is_busy) this.ask(false);
    this.buttons.back.disabled = !run?.can_go_back || is_busy;
    this.buttons.accept.disabled = !(last && last.cycle > 0 && !last.accepted && !last.failure) || is_busy;
    this.buttons.refuse.disabled = !(last && last.cycle > 0 && last.accepted && run.can_go_back) || is_busy;
    this.buttons.close.disabled = !run;
    this.reasons(status, is_busy, run);
    // The focus of a button that can no longer be pressed goes to the one that can be pressed next.
    if (pressed?.disabled) ["pause", "run", "step", "start"].map((action) => this.buttons[action]).find((button) => !button.disabled)?.focus({ preventScroll: true });
    this.method.disabled = !is_there || is_busy;
    if (is_there) {
      options(this.method, run.methods.map((name) => [name, name]));
      this.method.value = run.method ?? "automatic";
    }
    find("#run-tables").hidden = !is_there;
    if (is_there) this.tables(run);
    this.bounds(is_there ? run.bounds : null);
    this.box(is_there && status !== "Converged" ? run.region : null);
    this.stored.refresh([revision, status, rival?.status, run?.folder, rival?.folder].join(" "));
    // The sliders follow the accepted design of the run.
    const key = is_there ? `${run.folder} ${run.cycles.length} ${run.design}` : null;
    if (key && key !== this.shown) { this.shown = key; this.show(run.design); }
  }

  // Why buttons cannot be pressed: in words below them, and for each one as its title.
  reasons(status, is_busy, run) {
    const none = status === "none" ? "there is no run: Begin here starts one" : null;
    const ended = none ?? (is_busy ? "the run is running" : "the run has ended");
    const step = none ?? (is_busy ? "pause the run first" : null);
    const reasons = {
      run: ended, step: ended, pause: none ?? "nothing is running", stop: none ?? "nothing is running", close: none,
      back: step ?? "there is no trial step of this page to take back",
      accept: step ?? "the last trial step has no rejected proposal",
      refuse: step ?? "the last trial step of this page has no accepted proposal",
    };
    Object.entries(this.buttons).forEach(([action, button]) => { button.title = button.disabled ? reasons[action] ?? "" : ""; });
    this.place.querySelector("#run-why").textContent = none ? "Begin here starts a run; the other buttons act on it."
      : is_busy ? "While the run is running, it can be paused or stopped; pause it for settings and decisions by hand."
      : status !== "Paused" ? "The run has ended: change a setting or take a step back to continue, or begin another run."
      : run?.can_go_back ? "" : "Take back, accept and refuse act on trial steps that are done in this page.";
  }

  tables(run) {
    const find = (id) => this.place.querySelector(id);
    const scrolled = find("#cycles").parentElement;
    // The newest row stays in sight, unless the user has scrolled up in the table of this run.
    const is_at_end = run.folder !== this.listed || scrolled.scrollHeight - scrolled.scrollTop - scrolled.clientHeight < 8;
    this.listed = run.folder;
    const explained = (text, title) => ({ text, title });
    const verdict = (c) => (c.failure ? "analysis failed" : c.cycle === 0 ? "start" : c.accepted ? "accepted" : "rejected");
    find("#cycles").replaceChildren(...table(["cycle", "step", "objective", "predicted", "violation %", explained("E_f %", "Error of the approximation of the objective"),
      explained("E_g %", "Largest error of the approximation of constraints"), "retained rows", "active"], run.cycles.map((c) => {
      const row = make("tr");
      const go = make("button", { type: "button", text: c.cycle, "aria-label": `cycle ${c.cycle}: show its design on the sliders` });
      cells(row, [go, verdict(c), c.objective, c.predicted, c.violation, c.objective_error, c.constraint_error, c.retained, c.active]);
      // A click on the button is one on its row.
      row.addEventListener("click", () => this.show(c.design));
      return row;
    })));
    if (is_at_end) scrolled.scrollTop = scrolled.scrollHeight;
    const rows = (run.rows ?? []).filter((r) => r.multiplier || r.predicted > 0.9 || r.computed > 0.9).sort((a, b) => (b.multiplier ?? 0) - (a.multiplier ?? 0)).slice(0, 40);
    find("#rows").replaceChildren(...table(["constraint", "predicted ĝ", "computed ĝ", "multiplier"], rows.map((r) => {
      const row = make("tr");
      cells(row, [r.row, r.predicted ?? null, r.computed ?? null, r.multiplier ?? null]);
      return row;
    })));
    find("#edits").replaceChildren(...run.edits.map((edit) => make("li", { text:
      `after ${edit.after_tries} trial steps: ${edit.changes.map((c) => (c.after === null ? `${c.key} (${c.before})` : `${c.key}: ${c.before ?? "default"} → ${c.after}`)).join(", ")}` })));
  }
}
