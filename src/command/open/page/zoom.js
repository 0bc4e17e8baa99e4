// Zoom of the drawing of the mechanism: buttons, wheel, pinch and double click; a zoomed drawing can be moved.

import { button } from "./elements.js";
import { STEP } from "./mechanism.js";

// Factor of a double click.
const DOUBLE = 2;
// Change of the logarithm of the scale for each pixel that the wheel turns, and pixels of a line of text.
const WHEEL = 0.002;
const LINE = 16;

// `stage` has the keyboard focus, `tools` receives the buttons.
export function zoomable(mechanism, stage, tools) {
  const { svg } = mechanism;
  tools.replaceChildren(
    button("+", () => mechanism.zoom(STEP), { title: "Zoom in: +, double click, or Ctrl and the wheel", "aria-label": "Zoom in" }),
    button("\u2212", () => mechanism.zoom(1 / STEP), { title: "Zoom out: −, double click with Shift, or Ctrl and the wheel", "aria-label": "Zoom out" }),
    button("Fit", () => mechanism.fit(), { title: "Fit the whole motion: 0", "aria-label": "Fit the whole motion" }),
  );
  const at = (event) => mechanism.inside(event.clientX, event.clientY);
  svg.addEventListener("wheel", (event) => {
    // Without Ctrl, and without the focus on the drawing, the wheel scrolls the page.
    if (!(event.ctrlKey || event.metaKey || document.activeElement === stage) || !mechanism.window) return;
    event.preventDefault();
    mechanism.zoom(Math.exp(-WHEEL * event.deltaY * (event.deltaMode === 1 ? LINE : 1)), at(event));
  }, { passive: false });
  svg.addEventListener("dblclick", (event) => {
    event.preventDefault();
    mechanism.zoom(event.shiftKey ? 1 / DOUBLE : DOUBLE, at(event));
  });

  // Fingers, or the pressed mouse, with their places in the drawing.
  const pressed = new Map();
  const spread = () => {
    const [[a, b], [c, d]] = [...pressed.values()];
    return { distance: Math.max(Math.hypot(a - c, b - d), 1), middle: [(a + c) / 2, (b + d) / 2] };
  };
  svg.addEventListener("pointerdown", (event) => {
    pressed.set(event.pointerId, at(event));
    if (mechanism.is_zoomed) svg.setPointerCapture(event.pointerId);
  });
  svg.addEventListener("pointermove", (event) => {
    if (!pressed.has(event.pointerId)) return;
    const old = pressed.get(event.pointerId);
    const before = pressed.size === 2 ? spread() : null;
    const now = at(event);
    pressed.set(event.pointerId, now);
    // A point that is dragged has the pointer.
    if (mechanism.is_held) return;
    if (before) {
      const after = spread();
      mechanism.shift(after.middle[0] - before.middle[0], after.middle[1] - before.middle[1]);
      mechanism.zoom(after.distance / before.distance, after.middle);
    } else if (mechanism.is_zoomed && pressed.size === 1) mechanism.shift(now[0] - old[0], now[1] - old[1]);
  });
  ["pointerup", "pointercancel", "lostpointercapture"].forEach((kind) => svg.addEventListener(kind, (event) => pressed.delete(event.pointerId)));
  // Two fingers zoom the drawing, not the page.
  svg.addEventListener("touchstart", (event) => { if (event.touches.length === 2 && !mechanism.is_held) event.preventDefault(); }, { passive: false });
}
