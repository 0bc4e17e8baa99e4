// Drags a point of the mechanism: the least change of the design variables that moves the point as far as the pointer.
//
// A step is limited to a part of the ranges (a trust region): the part grows where the analysis agrees with the derivatives, and shrinks where
// it does not, as in a motion that depends strongly on the design. A step that takes the point away from the pointer is taken back.
//
// Minimizes |J Δ − d|² + ε Σ (Δ_k / s_k)², with J = ∂x/∂b of the point at the frame of the picture, d the distance of the target from the
// point of the differentiated design, and s_k the range of variable k. A variable beyond its bound is set to it, and the others are computed
// again.

import { handles } from "./mechanism.js";

// Regularization, relative to the largest diagonal entry of J S² Jᵀ.
const EPSILON = 1e-6;
// Least step, relative to the range, that is worth an analysis; largest number of corrections while the pointer does not move.
const LEAST = 1e-4;
const CORRECTIONS = 16;
// Largest step at first, relative to the range.
const FIRST = 0.1;
// Errors of a predicted movement, relative to the movement, below which steps may be twice as long, and above which they are shortened.
const [GOOD, POOR] = [0.25, 0.75];
// Number of steps that are remembered until they are analysed.
const STEPS = 16;
// A variable that moves the point by less than this part of the view over its whole range, which is less than a pixel, does not move it:
// its derivative is zero or rounding.
const SEEN = 1e-3;
// Distance in pixels within which the pointer grabs a point.
const REACH = 24;

export function leastSquares(columns, ranges, distance, low, high) {
  const n = columns.length;
  const step = new Array(n).fill(0);
  const free = new Set(Array.from({ length: n }, (_, k) => k));
  for (;;) {
    const rest = [0, 1].map((i) => distance[i] - columns.reduce((sum, c, k) => sum + (free.has(k) ? 0 : c[i] * step[k]), 0));
    let [a, b, c] = [0, 0, 0];
    free.forEach((k) => {
      const [x, y] = columns[k].map((v) => v * ranges[k]);
      a += x * x; b += x * y; c += y * y;
    });
    const mu = EPSILON * Math.max(a, c);
    const det = (a + mu) * (c + mu) - b * b;
    if (!(det > 0)) break;
    const w = [((c + mu) * rest[0] - b * rest[1]) / det, ((a + mu) * rest[1] - b * rest[0]) / det];
    let fixed = false;
    [...free].forEach((k) => { step[k] = ranges[k] ** 2 * (columns[k][0] * w[0] + columns[k][1] * w[1]); });
    [...free].forEach((k) => {
      const inside = Math.min(Math.max(step[k], low[k]), high[k]);
      if (inside !== step[k]) { step[k] = inside; free.delete(k); fixed = true; }
    });
    if (!fixed || free.size === 0) break;
  }
  return step;
}

// `at()` gives { base, design, ranges, lower, upper }; `propose(design)` shows a design; `tell(text)` says why none is proposed, null for
// no reason. Returns a function to call after each analysis, with its record, or with null if it has failed, and its design.
export function draggable(mechanism, at, propose, tell) {
  const { svg } = mechanism;
  let held = null;
  const nearest = (event) => {
    const { base } = at();
    if (!base?.derivatives?.motion || !mechanism.window) return null;
    const numbers = base.motion.frames[mechanism.frame];
    const screen = svg.getScreenCTM();
    const all = handles(base.motion.parts).map(({ at: i }) => {
      const [x, y] = mechanism.place(numbers[i], numbers[i + 1]);
      const shown = new DOMPoint(x, y).matrixTransform(screen);
      return { i, far: Math.hypot(shown.x - event.clientX, shown.y - event.clientY) };
    });
    const best = all.sort((a, b) => a.far - b.far)[0];
    return best && best.far <= REACH ? best.i : null;
  };
  // The view does not change while a point is dragged, so that the pointer stays at its point.
  const hold = (point) => {
    held = point;
    mechanism.hold(point !== null);
    tell(null);
  };
  const pointOf = ({ motion }) => [0, 1].map((axis) => motion.frames[held.frame][held.i + axis]);
  const between = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
  // Where the point is wanted.
  const target = () => {
    const [from, to] = [held.pressed, held.pointer].map((place) => mechanism.unplace(...place));
    return [0, 1].map((axis) => held.target[axis] + to[axis] - from[axis]);
  };
  // The step from the best design by its derivatives, as { design, from, to, size } with the predicted place of the point; null if no
  // variable moves it. A pointer that is back where it was pressed wants the design that was there, whatever has been analysed on the way.
  const wanted = ({ ranges, lower, upper }) => {
    const { i, frame, pointer, pressed, design, best } = held;
    if (Math.hypot(pointer[0] - pressed[0], pointer[1] - pressed[1]) < 1) return { design };
    const columns = best.derivatives.motion.map((rows) => [rows[frame][i], rows[frame][i + 1]])
      .map((column, k) => (Math.hypot(...column) * ranges[k] < SEEN * mechanism.size() ? [0, 0] : column));
    if (columns.every(([u, v]) => u === 0 && v === 0)) return null;
    const from = pointOf(best);
    const distance = target().map((v, axis) => v - from[axis]);
    const whole = leastSquares(columns, ranges, distance, best.design.map((b, k) => lower[k] - b), best.design.map((b, k) => upper[k] - b));
    const size = Math.max(...whole.map((v, k) => Math.abs(v) / ranges[k]));
    const step = whole.map((v) => v * Math.min(1, held.reach / (size || 1)));
    const to = from.map((v, axis) => v + columns.reduce((sum, column, k) => sum + column[axis] * step[k], 0));
    return { design: best.design.map((b, k) => b + step[k]), best, from, to, size: Math.min(size, held.reach) };
  };
  const follow = () => {
    const now = at();
    const next = wanted(now);
    tell(next ? null : held.steps.length ? "the point is as near to the pointer as it gets" : "no variable moves this point at this time");
    if (!next?.design.some((value, k) => Math.abs(value - now.design[k]) > LEAST * now.ranges[k])) return;
    propose(next.design);
    held.steps = [...held.steps, { ...next, design: [...at().design] }].slice(-STEPS);
  };
  const is = (one, other) => one.every((b, k) => b === other[k]);
  // Compares an analysed design with its step, and adapts the largest step. Returns true for a step that is kept, false for one that is taken
  // back, null for a design without a step. `record` is null after an analysis that failed.
  const judge = (record, design) => {
    const step = held.steps.find((one) => is(one.design, design));
    if (!step?.best) return null;
    if (step.is_kept !== undefined) return step.is_kept;
    const here = record && pointOf(record);
    const error = record ? between(here, step.to) / (between(step.from, step.to) || 1) : Infinity;
    if (error < GOOD) held.reach = Math.min(1, Math.max(held.reach, 2 * step.size));
    else if (error > POOR) held.reach = 0.25 * step.size;
    step.is_kept = error < GOOD || (Boolean(record) && between(here, target()) < between(step.from, target()));
    if (!step.is_kept) held.reach = Math.min(held.reach, 0.5 * step.size);
    return step.is_kept;
  };
  svg.addEventListener("pointerdown", (event) => {
    const i = nearest(event);
    if (i === null) return;
    event.preventDefault();
    mechanism.play(false);
    svg.setPointerCapture(event.pointerId);
    const { base, design } = at();
    const numbers = base.motion.frames[mechanism.frame];
    hold({
      i, frame: mechanism.frame, pressed: [event.clientX, event.clientY], target: [numbers[i], numbers[i + 1]], design: [...design], pointer: null,
      best: base, reach: FIRST, steps: [], corrections: 0, is_released: false,
    });
  });
  // A finger on a point drags it; elsewhere it scrolls the page.
  svg.addEventListener("touchstart", (event) => { if (held && !held.is_released && event.touches.length === 1) event.preventDefault(); }, { passive: false });
  svg.addEventListener("pointermove", (event) => {
    if (!held || held.is_released) { svg.style.cursor = nearest(event) === null ? "" : "grab"; return; }
    Object.assign(held, { pointer: [event.clientX, event.clientY], corrections: 0 });
    follow();
  });
  // The last step is judged when it has been analysed.
  ["pointerup", "pointercancel"].forEach((kind) => svg.addEventListener(kind, () => {
    if (!held || held.is_released) return;
    const last = held.pointer && held.steps.length ? held : null;
    hold(null);
    held = last;
    if (held) held.is_released = true;
  }));
  return (record, design) => {
    if (!held?.pointer) return;
    const now = at();
    // Another model has other points.
    if (!now.base?.motion || now.base.motion.frames[0].length !== held.best.motion.frames[0].length) return hold(null);
    const is_kept = judge(record, design);
    if (held.is_released) {
      const { best, steps } = held;
      const is_last = is(steps.at(-1).design, now.design);
      if (is_last && !is(design, now.design)) return;
      held = null;
      if (is_last && is_kept === false) propose(best.design);
      return;
    }
    if (is_kept !== false && !record?.derivatives) return;
    const is_nearer = record?.derivatives && between(pointOf(record), target()) <= between(pointOf(held.best), target());
    if (record?.derivatives && (is_kept || (is_kept === null && is_nearer))) held.best = record;
    held.corrections += 1;
    if (held.corrections <= CORRECTIONS) follow(); else if (is_kept === false) propose(held.best.design);
  };
}
