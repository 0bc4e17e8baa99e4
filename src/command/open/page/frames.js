// Drawing in the frames of the screen: what has changed is drawn once in a frame. Where frames are late, the mechanism is still drawn in each of
// them, and fewer of the histories and numbers, in turn.

// Time between frames in ms above which one was late, and above which the page was at rest.
const [LATE, REST] = [20, 400];
// Smallest and largest number of histories and numbers in a frame. After a late frame it is halved, and then grows slowly: each trial of more may
// cost another late frame.
const [LEAST, MOST, GROWTH] = [4, 64, 0.1];

const [always, inTurn] = [new Map(), new Map()];
let [count, before, is_asked] = [MOST, 0, false];

function ask() {
  if (!is_asked) requestAnimationFrame(paint);
  is_asked = true;
}

function paint(now) {
  const passed = now - before;
  before = now;
  count = passed > LATE && passed < REST ? Math.max(LEAST, count / 2) : Math.min(count + GROWTH, MOST);
  try {
    // What is added meanwhile is a part of this frame.
    for (const [key, draw] of always) { always.delete(key); draw(); }
    for (const [key, draw] of [...inTurn].slice(0, count)) { inTurn.delete(key); draw(); }
  } finally {
    is_asked = false;
    if (always.size || inTurn.size) ask();
  }
}

// Draws in the next frame; a later call with the same key takes the place of an earlier one.
export function inNextFrame(key, draw) {
  always.set(key, draw);
  ask();
}

// Draws in one of the next frames.
export function soon(key, draw) {
  inTurn.set(key, draw);
  ask();
}

// Acts once all that has changed by now is drawn; a later call takes the place of an earlier one.
export function whenDrawn(act) {
  always.delete(whenDrawn);
  inNextFrame(whenDrawn, () => { inTurn.delete(whenDrawn); soon(whenDrawn, act); });
}
