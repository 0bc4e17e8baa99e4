(() => {
  "use strict";
  const figure = document.currentScript.closest("figure");
  const data = JSON.parse(figure.querySelector("script[type='application/json']").textContent);
  const [button, slider, readout, speed] = ["button", "input[type=range]", "output", "select.speed"].map((name) => figure.querySelector(name));
  const [overlay, naming] = [".overlay", ".naming"].map((name) => figure.querySelector(`input${name}`));
  const stage = figure.querySelector(".scenes");
  const [first, last] = [data.times[0], data.times[data.times.length - 1]];
  const drawings = [...figure.querySelectorAll(".scenes svg")];

  function path(at, closed) {
    let d = "M";
    for (let k = 0; k < at.length; k += 2) d += (k ? "L" : "") + at[k] + " " + at[k + 1];
    return closed ? d + "Z" : d;
  }

  // A zigzag of six strokes between straight ends.
  function spring([x, y, u, v]) {
    const [dx, dy] = [u - x, v - y];
    const length = Math.hypot(dx, dy) || 1;
    const [nx, ny] = [(-dy / length) * 7, (dx / length) * 7];
    const at = [x, y, x + 0.2 * dx, y + 0.2 * dy];
    for (let k = 0; k < 6; k++) {
      const [part, side] = [0.25 + 0.1 * k, k % 2 ? -1 : 1];
      at.push(x + part * dx + side * nx, y + part * dy + side * ny);
    }
    at.push(x + 0.8 * dx, y + 0.8 * dy, u, v);
    return path(at.map((c) => Math.round(10 * c) / 10), false);
  }

  const move = (node, [x, y, turn]) =>
    node.setAttribute("transform", `translate(${x} ${y})` + (turn === undefined ? "" : ` rotate(${turn})`));
  const curve = (node, at) => node.setAttribute("d", path(at, false));
  // The colour of a share of the largest stress.
  function shade(share) {
    const ends = [[255, 247, 188], [254, 153, 41], [140, 20, 20]];
    const at = 2 * Math.min(Math.max(share, 0), 1);
    const k = at < 1 ? 0 : 1;
    return `rgb(${ends[k].map((c, i) => Math.round(c + (at - k) * (ends[k + 1][i] - c))).join(" ")})`;
  }
  // The parts in the order of the frames.
  const parts = [
    ["guides", curve],
    ["plates", (node, at) => node.setAttribute("d", path(at, true))],
    ["bars", curve],
    ["stressed", (node, at) => {
      node.setAttribute("d", path(at.slice(0, 8), true));
      node.style.fill = shade(at[8] / 100);
    }],
    ["lines", curve],
    ["springs", (node, at) => node.setAttribute("d", spring(at))],
    ["masses", move],
    ["sliders", move],
    ["ground", move],
    ["joints", move],
    ["arrows", curve],
    ["names", move],
  ];
  // Names avoid each other: each keeps its place near its point while that is free, and else takes the free place that comes first, or
  // the one with the least overlap.
  const corners = [[7, -7, 0], [7, 15, 0], [-7, -7, 1], [-7, 15, 1], [0, -13, 0.5], [0, 22, 0.5], [12, 4, 0], [-12, 4, 1], [0, -26, 0.5], [0, 35, 0.5]];
  const lengths = new Map();
  const sizes = drawings.map((svg) => [svg.viewBox.baseVal.width, svg.viewBox.baseVal.height]);
  function separate(group, whole) {
    const written = [];
    const overlap = (a, b) =>
      Math.max(Math.min(a.right, b.right) - Math.max(a.left, b.left), 0) * Math.max(Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top), 0);
    [...group.children].filter((node) => node.style.display !== "none").forEach((node) => {
      const [x, y] = node.getAttribute("transform").match(/-?[\d.]+/g).map(Number);
      if (!lengths.get(node)) lengths.set(node, node.getComputedTextLength());
      const length = lengths.get(node) || 7 * node.textContent.length;
      const place = (k) => {
        const [dx, dy, part] = corners[k];
        const left = x + dx - part * length;
        return { left: left - 2, right: left + length + 2, top: y + dy - 11, bottom: y + dy + 3 };
      };
      const cost = (k) => {
        const own = place(k);
        const outside = own.left < 0 || own.right > whole[0] || own.top < 0 || own.bottom > whole[1];
        return written.reduce((sum, other) => sum + overlap(own, other), outside ? 200 : 0);
      };
      const before = Number(node.dataset.corner ?? 0);
      const order = [before, ...corners.keys()];
      const best = order.reduce((least, k) => (cost(k) < cost(least) ? k : least), order[0]);
      const [dx, dy, part] = corners[best];
      node.dataset.corner = best;
      node.setAttribute("x", dx);
      node.setAttribute("y", dy);
      node.setAttribute("text-anchor", ["start", "middle", "end"][2 * part]);
      written.push(place(best));
    });
  }
  // The motion of the design of a cycle, if one is chosen.
  let chosen = null;

  // Mechanisms in space are turned about their middle: a parallel projection with the axis z upwards.
  const space = data.space;
  const view = figure.querySelector("select.view");
  let project = null;
  function look(azimuth, elevation) {
    const [s, c, se, ce] = [Math.sin(azimuth), Math.cos(azimuth), Math.sin(elevation), Math.cos(elevation)];
    Object.assign(space, { azimuth, elevation });
    project = (x, y, z) => [c * y - s * x, -(ce * z - se * (c * x + s * y))];
  }
  const tenths = (value) => Math.round(10 * value) / 10;
  function seen(at) {
    const flat = [];
    for (let k = 0; k + 2 < at.length; k += 3) {
      const [x, y] = project(at[k], at[k + 1], at[k + 2]);
      flat.push(tenths(240 + x), tenths(space.height / 2 + y));
    }
    return flat;
  }
  function headed(line) {
    const [x, y, u, v] = line.slice(-4);
    let length = 0;
    for (let k = 2; k < line.length; k += 2) length += Math.hypot(line[k] - line[k - 2], line[k + 1] - line[k - 1]);
    const angle = Math.atan2(v - y, u - x);
    const side = (turn) => [u - (length / 6) * Math.cos(angle + turn), v - (length / 6) * Math.sin(angle + turn)].map(tenths);
    return [...line, ...side(0.45), u, v, ...side(-0.45)];
  }
  function flat(name, at) {
    if (!space) return at;
    if (name === "arrows") return headed(seen(at));
    if (name !== "sliders") return seen(at);
    const [x, y] = project(at[3], at[4], at[5]);
    return [...seen(at.slice(0, 3)), tenths((Math.atan2(y, x) * 180) / Math.PI)];
  }
  // The paths of named points, and the axes of the world.
  function surround(svg, s) {
    const traces = svg.querySelector(".traces");
    [...traces.children].forEach((node, k) => curve(node, seen(data.scenes[s].flatMap((frame) => frame[parts.length][k]))));
    const [lines, names] = ["path", "text"].map((name) => svg.querySelectorAll(`.triad ${name}`));
    [[1, 0, 0], [0, 1, 0], [0, 0, 1]].forEach((axis, k) => {
      const [x, y] = project(...axis);
      curve(lines[k], [0, 0, tenths(24 * x), tenths(24 * y)]);
      names[k].setAttribute("x", tenths(32 * x));
      names[k].setAttribute("y", tenths(4 + 32 * y));
    });
  }
  function turn(azimuth, elevation, choice) {
    look(azimuth, Math.min(Math.max(elevation, -Math.PI / 2), Math.PI / 2));
    view.selectedIndex = choice;
    drawings.forEach(surround);
    draw(Number(slider.value));
  }

  function arrange(group, frame) {
    parts.forEach(([name, set], p) => {
      const nodes = group.querySelector(`:scope > .${name}`).children;
      for (let k = 0; k < nodes.length; k++) {
        nodes[k].style.display = k < frame[p].length ? "" : "none";
        if (k < frame[p].length) set(nodes[k], flat(name, frame[p][k]));
      }
    });
  }

  function draw(k) {
    drawings.forEach((svg, s) => {
      const behind = svg.querySelector(".behind");
      const own = chosen && s === drawings.length - 1;
      arrange(svg.querySelector(".linkage"), own ? chosen[Math.min(Math.floor(k / data.stride), chosen.length - 1)] : data.scenes[s][k]);
      if (behind) arrange(behind, data.scenes[0][k]);
      if (!figure.classList.contains("nameless")) separate(svg.querySelector(".linkage > .names"), sizes[s]);
    });
    slider.value = k;
    readout.textContent = `${data.time[0]} = ${data.times[k].toPrecision(4)} ${data.time[1]}`;
    slider.setAttribute("aria-valuetext", readout.textContent);
    figure.dataset.frame = k;
  }

  // Time points need not be equally spaced: the frame is the last one that is not later.
  function frameAt(time) {
    let [low, high] = [0, data.times.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (data.times[middle] <= time) low = middle; else high = middle - 1;
    }
    return low;
  }

  [0.1, 0.25, 0.5, 1, 2, 4].forEach((factor) => speed.add(new Option(`${factor}×`, factor, factor === 1, factor === 1)));
  slider.max = data.times.length - 1;
  let time = first;
  let before = null;
  let playing = !window.matchMedia("(prefers-reduced-motion: reduce)").matches;

  function show() { button.textContent = playing ? "Pause" : "Play"; draw(frameAt(time)); }
  function stop(at) { playing = false; time = Math.min(Math.max(at, first), last); show(); }
  function toggle() { playing = !playing; show(); }
  function step(now) {
    if (before !== null && playing) {
      time += ((now - before) / 1000) * Number(speed.value) * ((last - first) / data.seconds);
      if (time > last) time = first + ((time - first) % (last - first));
      draw(frameAt(time));
    }
    before = now;
    window.requestAnimationFrame(step);
  }
  // If the address ends with #t=0.3, that time is shown.
  function follow() {
    const wanted = /[#&]t=([-+.\deE]+)/.exec(window.location.hash);
    if (wanted && Number.isFinite(Number(wanted[1]))) stop(Number(wanted[1]));
  }
  button.addEventListener("click", toggle);
  slider.addEventListener("input", () => stop(data.times[Number(slider.value)]));
  if (space) {
    const own = [space.azimuth, space.elevation];
    const views = [own, [-Math.PI / 2, 0], [0, 0], [-Math.PI / 2, Math.PI / 2]];
    look(...own);
    drawings.forEach(surround);
    view.addEventListener("change", () => turn(...views[view.selectedIndex], view.selectedIndex));
    drawings.forEach((svg) => {
      svg.classList.add("turns");
      let held = null;
      svg.addEventListener("pointerdown", (event) => {
        held = [event.clientX, event.clientY];
        if (event.isTrusted) svg.setPointerCapture(event.pointerId);
      });
      svg.addEventListener("pointermove", (event) => {
        if (!held || !event.buttons || svg.classList.contains("zoomed")) return;
        const [x, y] = [event.clientX, event.clientY];
        turn(space.azimuth - 0.01 * (x - held[0]), space.elevation + 0.01 * (y - held[1]), 4);
        held = [x, y];
      });
    });
    stage.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!by || !event.shiftKey || stage.querySelector(".zoomed")) return;
      turn(space.azimuth + 0.1 * by[0], space.elevation + 0.1 * by[1], 4);
      event.preventDefault();
      event.stopImmediatePropagation();
    });
  }
  stage.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10 }[event.key];
    const frame = Number(slider.value);
    if (by) stop(data.times[Math.min(Math.max(frame + by, 0), data.times.length - 1)]);
    else if (event.key === "Home") stop(first);
    else if (event.key === "End") stop(last);
    else if (event.key === " ") toggle();
    else return;
    event.preventDefault();
  });
  if (naming) naming.addEventListener("change", () => {
    figure.classList.toggle("nameless", !naming.checked);
    draw(Number(slider.value));
  });
  // The design of a chosen cycle takes the place of the last one.
  const heading = [...figure.querySelectorAll(".scenes h3")].pop();
  const lastTitle = heading.textContent;
  window.addEventListener("cycle", ({ detail: { cycle } }) => {
    const motion = data.cycles.find(([number]) => number === cycle);
    chosen = motion ? motion[1] : null;
    heading.textContent = motion ? `design of cycle ${cycle}` : lastTitle;
    drawings[drawings.length - 1].classList.toggle("chosen", Boolean(motion));
    show();
  });
  if (overlay) overlay.addEventListener("change", () => figure.classList.toggle("alone", !overlay.checked));
  window.addEventListener("hashchange", follow);
  // The pointer on a history shows the mechanism at this time.
  window.addEventListener("moment", ({ detail: { label, value } }) => {
    if (label.startsWith(data.time[0])) stop(value);
  });
  figure.querySelector(".controls").hidden = false;
  show();
  follow();
  window.requestAnimationFrame(step);
})();
