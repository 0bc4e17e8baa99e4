// Drags a point of the mechanism: the least change of the design variables that moves the point as far as the pointer.
//
// Minimizes |J Δ − d|² + ε Σ (Δ_k / s_k)², with J = ∂x/∂b of the point at the frame of the picture, d the distance of the target from the
// point of the differentiated design, and s_k the range of variable k. A variable beyond its bound is set to it, and the others are computed
// again.

import { handles } from "./mechanism.js";

// Regularization, relative to the largest diagonal entry of J S² Jᵀ.
const EPSILON = 1e-6;
// Least step, relative to the range, that is worth an analysis; largest number of corrections while the pointer does not move.
const LEAST = 1e-4;
const CORRECTIONS = 8;
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
// no reason. Returns a function to call after new derivatives.
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
  // The design that moves the point by the derivatives; null if no variable moves it. A pointer that is back where it was pressed wants the
  // design that was there, whatever has been analysed on the way.
  const wanted = ({ base, ranges, lower, upper }) => {
    const { i, frame, pointer, pressed, target, design } = held;
    if (Math.hypot(pointer[0] - pressed[0], pointer[1] - pressed[1]) < 1) return design;
    const numbers = base.motion.frames[frame];
    const [from, to] = [pressed, pointer].map((place) => mechanism.unplace(...place));
    const columns = base.derivatives.motion.map((rows) => [rows[frame][i], rows[frame][i + 1]])
      .map((column, k) => (Math.hypot(...column) * ranges[k] < SEEN * mechanism.size() ? [0, 0] : column));
    if (columns.every(([u, v]) => u === 0 && v === 0)) return null;
    const distance = [0, 1].map((axis) => target[axis] + to[axis] - from[axis] - numbers[i + axis]);
    const step = leastSquares(columns, ranges, distance, base.design.map((b, k) => lower[k] - b), base.design.map((b, k) => upper[k] - b));
    return base.design.map((b, k) => b + step[k]);
  };
  const follow = () => {
    const now = at();
    if (!now.base?.derivatives?.motion) return;
    const next = wanted(now);
    tell(next ? null : "no variable moves this point at this time");
    if (next?.some((value, k) => Math.abs(value - now.design[k]) > LEAST * now.ranges[k])) propose(next);
  };
  svg.addEventListener("pointerdown", (event) => {
    const i = nearest(event);
    if (i === null) return;
    event.preventDefault();
    mechanism.play(false);
    svg.setPointerCapture(event.pointerId);
    const { base, design } = at();
    const numbers = base.motion.frames[mechanism.frame];
    hold({ i, frame: mechanism.frame, pressed: [event.clientX, event.clientY], target: [numbers[i], numbers[i + 1]], design: [...design], pointer: null, corrections: 0 });
  });
  // A finger on a point drags it; elsewhere it scrolls the page.
  svg.addEventListener("touchstart", (event) => { if (held && event.touches.length === 1) event.preventDefault(); }, { passive: false });
  svg.addEventListener("pointermove", (event) => {
    if (!held) { svg.style.cursor = nearest(event) === null ? "" : "grab"; return; }
    Object.assign(held, { pointer: [event.clientX, event.clientY], corrections: 0 });
    follow();
  });
  ["pointerup", "pointercancel"].forEach((kind) => svg.addEventListener(kind, () => { if (held) hold(null); }));
  // After new derivatives: corrects the point if the pointer does not move.
  return () => {
    if (!held?.pointer || held.corrections >= CORRECTIONS) return;
    held.corrections += 1;
    follow();
  };
}
