// The root element holds the first error of a script.
window.addEventListener("error", (event) => {
  document.documentElement.dataset.state = `error: ${event.message}`;
});
window.addEventListener("DOMContentLoaded", () => {
  "use strict";
  const button = (text, act) => {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = text;
    made.addEventListener("click", () => act(made));
    return made;
  };
  const tools = (...buttons) => {
    const place = document.createElement("div");
    place.className = "tools";
    place.append(...buttons);
    return place;
  };
  const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  const csv = (rows) => rows.map((row) => row.map((cell) => quoted(String(cell))).join(",") + "\n").join("");
  // A file is offered under a name; its text stays in the page for tests.
  const save = (place, name, text) => {
    place.dataset.saved = text;
    const link = document.createElement("a");
    link.download = name;
    link.href = "data:text/csv;charset=utf-8," + encodeURIComponent(text);
    link.click();
  };
  const named = (text) => text.trim().toLowerCase().replace(/[^a-z0-9]+/g, "-").slice(0, 60) || "data";

  // Tables: a click on a heading sorts, a second one reverses.
  const plain = (cell) => cell.textContent.replaceAll("\u2212", "-");
  const value = (cell) => {
    const text = plain(cell);
    return text !== "" && Number.isFinite(Number(text)) ? Number(text) : text;
  };
  document.querySelectorAll(".table").forEach((box) => {
    const [table, body] = [box.querySelector("table"), box.querySelector("tbody")];
    const headings = [...table.querySelectorAll("thead th")];
    headings.forEach((heading, column) => {
      const sort = button(heading.textContent, () => {
        const down = heading.getAttribute("aria-sort") === "ascending";
        const rows = [...body.rows];
        rows.sort((a, b) => {
          const [x, y] = [value(a.cells[column]), value(b.cells[column])];
          const order = typeof x === "number" && typeof y === "number" ? x - y : String(x).localeCompare(String(y));
          return down ? -order : order;
        });
        body.append(...rows);
        headings.forEach((other) => other.removeAttribute("aria-sort"));
        heading.setAttribute("aria-sort", down ? "descending" : "ascending");
      });
      heading.replaceChildren(sort);
    });
    const cells = () => [...table.rows].map((row) => [...row.cells].map(plain));
    const copy = button("Copy", async (made) => {
      const text = cells().map((row) => row.join("\t")).join("\n");
      box.dataset.copied = text;
      try {
        await navigator.clipboard.writeText(text);
        made.textContent = "Copied";
      } catch {
        const range = document.createRange();
        range.selectNodeContents(table);
        window.getSelection().removeAllRanges();
        window.getSelection().addRange(range);
        made.textContent = "Selected";
      }
      setTimeout(() => { made.textContent = "Copy"; }, 2000);
    });
    box.prepend(tools(copy, button("CSV", () => save(box, named(table.caption.textContent) + ".csv", csv(cells())))));
  });

  // Figures: the values at the plotted abscissa next to the pointer, in all histories over the same time at once; in a plane of two
  // quantities, the nearest mark.
  const figures = [...document.querySelectorAll("figure.plotted")].map((figure) => ({
    figure, svg: figure.querySelector("svg"), panels: JSON.parse(figure.querySelector("script[type='application/json']").textContent), marks: [],
  }));
  const scale = (x, [low, high], logarithmic) => {
    const of = (v) => (logarithmic ? Math.log10(v) : v);
    return (of(x) - of(low)) / (of(high) - of(low));
  };
  const back = (part, [low, high], logarithmic) =>
    logarithmic ? low * Math.pow(high / low, part) : low + part * (high - low);
  const short = (v) => String(Number(v.toPrecision(5))).replace("-", "\u2212");
  function clear(one) {
    one.marks.forEach((mark) => mark.remove());
    one.marks = [];
    one.readout.textContent = "";
  }
  function mark(one, name, attributes) {
    const made = document.createElementNS(one.svg.namespaceURI, name);
    Object.entries(attributes).forEach(([k, v]) => made.setAttribute(k, v));
    one.svg.append(made);
    one.marks.push(made);
  }
  // The abscissa of a plotted point that is nearest to a value; null without functions.
  function sample(panel, x) {
    const all = panel.series.filter(({ kind }) => kind === "function").flatMap(({ points }) => points.map(([at]) => at));
    const far = (at) => Math.abs(scale(at, panel.x, panel.log[0]) - scale(x, panel.x, panel.log[0]));
    return all.reduce((best, at) => (best === null || far(at) < far(best) ? at : best), null);
  }
  // Values of a series at an abscissa: on the line of a function, or of the points that have it.
  function valuesAt({ kind, points }, x) {
    if (kind === "points") return points.filter(([at]) => at === x).map(([, y]) => y);
    const k = kind === "function" ? points.findLastIndex(([at]) => at <= x) : -1;
    if (k < 0 || (k === points.length - 1 && points[k][0] < x)) return [];
    const [[x0, y0], [x1, y1]] = [points[k], points[k + 1] ?? points[k]];
    return [x1 > x0 ? y0 + ((x - x0) / (x1 - x0)) * (y1 - y0) : y0];
  }
  function show(one, panel, x) {
    clear(one);
    const [left, top, width, height] = panel.frame;
    const part = scale(x, panel.x, panel.log[0]);
    if (!(part >= 0 && part <= 1)) return;
    const at = left + part * width;
    mark(one, "line", { x1: at, x2: at, y1: top, y2: top + height, class: "cursor" });
    const values = new Set(panel.series.flatMap((s) => valuesAt(s, x).map((y) => `${s.name} ${short(y)}`)));
    one.readout.textContent = `${panel.label[0]} ${short(x)}: ${[...values].join(", ")}`;
  }
  // The mark of a plane that is nearest to a place, in points on paper; nothing beyond the reach of the pointer.
  const REACH = 12;
  function showNearest(one, panel, [u, v]) {
    clear(one);
    const [left, top, width, height] = panel.frame;
    const place = ([x, y]) => [left + scale(x, panel.x, panel.log[0]) * width, top + (1 - scale(y, panel.y, panel.log[1])) * height];
    let best = { far: REACH };
    // Points are read before the lines on which they lie.
    const offer = (name, [a, b], handicap = 0) => {
      const far = Math.hypot(a - u, b - v) + handicap;
      if (far < best.far) best = { far, name, at: [a, b] };
    };
    panel.series.forEach(({ name, kind, points }) => {
      const at = points.map(place);
      at.forEach((here, k) => {
        if (kind === "points") return offer(name, here);
        if (k === 0) return undefined;
        const [[a, b], [c, d]] = [at[k - 1], here];
        const along = ((u - a) * (c - a) + (v - b) * (d - b)) / ((c - a) ** 2 + (d - b) ** 2 || 1);
        const part = Math.min(Math.max(along, 0), 1);
        return offer(name, [a + part * (c - a), b + part * (d - b)], REACH / 4);
      });
    });
    const [a, b] = best.at ?? [u, v];
    if (best.at) mark(one, "circle", { cx: a, cy: b, r: 3, class: "cursor" });
    const [x, y] = [back((a - left) / width, panel.x, panel.log[0]), back(1 - (b - top) / height, panel.y, panel.log[1])];
    one.readout.textContent = `${best.name ? `${best.name}: ` : ""}${panel.label[0]} ${short(x)}, ${panel.label[1]} ${short(y)}`;
  }
  // The design of a chosen cycle: its numbers, its curves, its row, and, by the event `cycle`, its motion.
  const chooser = document.getElementById("chooser");
  const choices = chooser ? JSON.parse(chooser.querySelector("script").textContent) : [];
  const rows = [...document.querySelectorAll("#convergence .table tbody tr")].filter(({ cells }) => /^(start|accepted)$/.test(cells[1].textContent));
  const cycleOf = (row) => Number(row.cells[0].textContent);
  function choose(number) {
    const found = choices.find(([cycle]) => cycle === number);
    const [select, output] = [chooser.querySelector("select"), chooser.querySelector("output")];
    select.value = found ? number : "";
    output.textContent = found ? found[1] : "";
    chooser.dataset.cycle = found ? number : "";
    const row = found && rows.find((one) => cycleOf(one) === number);
    document.querySelectorAll("tr.chosen").forEach((one) => one.classList.remove("chosen"));
    if (row) row.classList.add("chosen");
    figures.forEach((one) => {
      one.svg.querySelectorAll(".chosen").forEach((old) => old.remove());
      one.panels.forEach((panel) => { panel.series = panel.series.filter(({ chosen }) => !chosen); });
      const [panel] = one.panels;
      const points = found && found[2][one.figure.dataset.name];
      if (points) panel.series.push({ name: `cycle ${number}`, kind: "function", points, chosen: true });
      const [left, top, width, height] = panel.frame;
      const at = ([x, y]) => [left + scale(x, panel.x, panel.log[0]) * width,
        top + (1 - Math.min(Math.max(scale(y, panel.y, panel.log[1]), 0), 1)) * height].map((v) => v.toFixed(1)).join(" ");
      const draw = (shape) => {
        const line = document.createElementNS(one.svg.namespaceURI, "path");
        line.setAttribute("class", "chosen");
        line.setAttribute("d", "M" + shape.join("L"));
        one.svg.append(line);
      };
      if (points) draw(points.map(at));
      if (found && panel.label[0] === "cycle") one.panels.forEach(({ frame: [l, t, w, h], x }) => {
        const place = (l + scale(number, x, false) * w).toFixed(1);
        draw([`${place} ${t}`, `${place} ${t + h}`]);
      });
    });
    window.dispatchEvent(new CustomEvent("cycle", { detail: { cycle: found ? number : null } }));
  }
  // The shown cycle that is nearest to a number.
  const near = (number) => choices.reduce((best, [cycle]) => (Math.abs(cycle - number) < Math.abs(best - number) ? cycle : best), choices[0][0]);
  if (chooser) {
    const [earlier, later] = chooser.querySelectorAll("button");
    const select = chooser.querySelector("select");
    select.add(new Option("the run", ""));
    choices.forEach(([cycle]) => select.add(new Option(cycle ? `cycle ${cycle}` : "cycle 0, the start", cycle)));
    select.addEventListener("change", () => choose(select.value === "" ? null : Number(select.value)));
    const step = (by) => {
      select.selectedIndex = (select.selectedIndex + by + select.options.length) % select.options.length;
      select.dispatchEvent(new Event("change"));
    };
    earlier.addEventListener("click", () => step(-1));
    later.addEventListener("click", () => step(1));
    rows.forEach((row) => {
      row.classList.add("choice");
      row.addEventListener("click", () => choose(near(cycleOf(row))));
    });
    chooser.hidden = false;
  }
  figures.forEach((one) => {
    one.readout = document.createElement("p");
    one.readout.className = "readout";
    one.readout.setAttribute("aria-live", "polite");
    one.svg.after(one.readout);
    const rows = () => [["panel", "series", "x", "y"], ...one.panels.flatMap((panel) =>
      panel.series.flatMap((s) => s.points.map(([x, y]) => [panel.label[1], s.name, x, y])))];
    const name = named(one.figure.querySelector("figcaption").textContent) + ".csv";
    one.figure.append(tools(button("CSV", () => save(one.figure, name, csv(rows())))));
    const move = (event) => {
      const box = one.svg.getBoundingClientRect();
      const view = one.svg.viewBox.baseVal;
      const x = view.x + ((event.clientX - box.left) / box.width) * view.width;
      const y = view.y + ((event.clientY - box.top) / box.height) * view.height;
      const panel = one.panels.find(({ frame: [left, top, width, height] }) => x >= left && x <= left + width && y >= top && y <= top + height);
      if (!panel) return figures.forEach(clear);
      const value = panel.plane ? null : sample(panel, back((x - panel.frame[0]) / panel.frame[2], panel.x, panel.log[0]));
      if (value === null) {
        figures.forEach(clear);
        return showNearest(one, panel, [x, y]);
      }
      figures.forEach((other) => {
        const same = other === one ? panel : other.panels.find((p) => !p.plane && p.label[0] === panel.label[0]);
        if (same) show(other, same, value); else clear(other);
      });
      window.dispatchEvent(new CustomEvent("moment", { detail: { label: panel.label[0], value } }));
    };
    if (chooser && one.panels[0].label[0] === "cycle") {
      one.svg.classList.add("choice");
      one.svg.addEventListener("click", (event) => {
        const [box, view] = [one.svg.getBoundingClientRect(), one.svg.viewBox.baseVal];
        const [left, , width] = one.panels[0].frame;
        const part = (view.x + ((event.clientX - box.left) / box.width) * view.width - left) / width;
        if (part >= 0 && part <= 1) choose(near(back(part, one.panels[0].x, false)));
      });
    }
    one.svg.addEventListener("pointermove", move);
    one.svg.addEventListener("pointerleave", () => figures.forEach(clear));
  });

  // Axes of the visible part of an enlarged figure: round numbers along its lower and left edges.
  function roundSteps([low, high], most, least = 0) {
    const raw = Math.max((high - low) / Math.max(most, 1), least);
    const power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= raw * (1 - 1e-9));
    const [first, last] = [Math.ceil(low / step - 1e-6), Math.floor(high / step + 1e-6)];
    return { step, values: Array.from({ length: Math.max(last - first + 1, 0) }, (_, k) => (first + k) * step) };
  }
  // Round numbers and their texts, and the factor that the texts omit.
  function ticksOf(ends, logarithmic, most, isWhole = false) {
    const powers = logarithmic ? roundSteps(ends.map(Math.log10), most) : null;
    if (powers && powers.step >= 1) {
      const values = powers.values.map((power) => 10 ** power);
      return { values, texts: values.map((v) => String(Number(v.toPrecision(1)))), factor: "" };
    }
    const { step, values } = roundSteps(ends, most, isWhole ? 1 : 0);
    const largest = Math.max(...ends.map(Math.abs));
    const exponent = largest < 1e-2 || largest >= 1e5 ? 3 * Math.floor(Math.log10(largest) / 3) : 0;
    const decimals = Math.min(Math.max(Math.ceil(exponent - Math.log10(step) - 1e-9), 0), 12);
    const raised = [...String(exponent)].map((c) => "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"[c] ?? "\u207b").join("");
    const text = (v) => (v / 10 ** exponent).toFixed(decimals).replace(/^-(?=.*[1-9])/, "\u2212").replace("-", "");
    return { values, texts: values.map(text), factor: exponent ? `10${raised}` : "" };
  }
  // A label with the factor before its unit.
  const withFactor = (label, factor) =>
    !factor ? label : label.endsWith("]") ? label.replace(/\[(?=[^[]*$)/, `[${factor} `) : `${label} [${factor}]`;
  function drawAxes(svg, part) {
    svg.querySelectorAll(":scope > .axes").forEach((old) => old.remove());
    const one = figures.find((figure) => figure.svg === svg);
    if (!one || part >= 1) return;
    const view = svg.viewBox.baseVal;
    const group = document.createElementNS(svg.namespaceURI, "g");
    group.setAttribute("class", "axes");
    group.setAttribute("font-size", 7 * part);
    const add = (name, attributes, text) => {
      const made = document.createElementNS(svg.namespaceURI, name);
      Object.entries(attributes).forEach(([k, v]) => made.setAttribute(k, v));
      if (text !== undefined) made.textContent = text;
      group.append(made);
      return made;
    };
    svg.append(group);
    one.panels.forEach((panel) => {
      const [left, top, width, height] = panel.frame;
      const [l, r] = [Math.max(left, view.x), Math.min(left + width, view.x + view.width)];
      const [t, b] = [Math.max(top, view.y), Math.min(top + height, view.y + view.height)];
      if (r - l < 20 * part || b - t < 15 * part) return;
      const across = [l, r].map((u) => back((u - left) / width, panel.x, panel.log[0]));
      const along = [b, t].map((v) => back(1 - (v - top) / height, panel.y, panel.log[1]));
      const isWhole = panel.series.every(({ points }) => points.every(([at]) => Number.isInteger(at)));
      const [x, y] = [ticksOf(across, panel.log[0], (r - l) / part / 45, isWhole), ticksOf(along, panel.log[1], (b - t) / part / 24)];
      add("path", { d: `M${l} ${t}V${b}H${r}`, "stroke-width": 0.6 * part });
      const [gap, size] = [3 * part, 7 * part];
      // The numbers of the vertical axis keep clear of the corners, in which the label and the numbers of the other axis are.
      y.values.forEach((value, k) => {
        const at = top + (1 - scale(value, panel.y, panel.log[1])) * height;
        if (at > b - 2.2 * size || at < t + 1.8 * size) return;
        add("path", { d: `M${l} ${at}h${gap}`, "stroke-width": 0.6 * part });
        add("text", { x: l + 1.5 * gap, y: at + 0.36 * size }, y.texts[k]);
      });
      add("text", { x: r - gap, y: b - 1.5 * gap - size, "text-anchor": "end" }, withFactor(panel.label[0], x.factor));
      add("text", { x: l + gap, y: t + size }, withFactor(panel.label[1], y.factor));
      x.values.forEach((value, k) => {
        const at = left + scale(value, panel.x, panel.log[0]) * width;
        const text = add("text", { x: at, y: b - 1.5 * gap, "text-anchor": "middle" }, x.texts[k]);
        const half = text.getComputedTextLength() / 2;
        if (at - half < l + gap || at + half > r) return text.remove();
        return add("path", { d: `M${at} ${b}v${-gap}`, "stroke-width": 0.6 * part });
      });
    });
  }

  // Figures and mechanisms: buttons, the keys + - 0 and the wheel with Ctrl zoom; the pointer drags, and Shift with arrows moves.
  document.querySelectorAll("figure svg").forEach((svg) => {
    const view = svg.viewBox.baseVal;
    const whole = [view.x, view.y, view.width, view.height];
    const set = ([x, y, width, height]) => {
      const part = width / whole[2];
      const inside = (at, low, size, own) => Math.min(Math.max(at, low), low + size - own);
      const at = [inside(x, whole[0], whole[2], width), inside(y, whole[1], whole[3], height), width, height];
      svg.setAttribute("viewBox", (part >= 1 ? whole : at).join(" "));
      svg.dataset.zoom = (1 / Math.min(part, 1)).toPrecision(3);
      svg.classList.toggle("zoomed", part < 1);
      drawAxes(svg, part);
    };
    const zoom = (factor, [u, v] = [0.5, 0.5]) => {
      const [width, height] = [view.width / factor, view.height / factor];
      if (whole[2] / width > 64) return;
      set([view.x + u * (view.width - width), view.y + v * (view.height - height), width, height]);
    };
    const pan = (dx, dy) => set([view.x + dx * view.width, view.y + dy * view.height, view.width, view.height]);
    const keys = (event) => {
      const by = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
      if (by && event.shiftKey) pan(...by);
      else if (event.key === "+" || event.key === "=") zoom(1.5);
      else if (event.key === "-") zoom(1 / 1.5);
      else if (event.key === "0") set(whole);
      else return;
      event.preventDefault();
      event.stopPropagation();
    };
    svg.setAttribute("tabindex", "0");
    svg.addEventListener("keydown", keys);
    svg.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey) return;
      const box = svg.getBoundingClientRect();
      zoom(Math.exp(-event.deltaY / 300), [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height]);
      event.preventDefault();
    }, { passive: false });
    let from = null;
    svg.addEventListener("pointerdown", (event) => { from = svg.classList.contains("zoomed") ? [event.clientX, event.clientY] : null; });
    svg.addEventListener("pointermove", (event) => {
      if (!from || event.buttons === 0) return;
      const box = svg.getBoundingClientRect();
      pan((from[0] - event.clientX) / box.width, (from[1] - event.clientY) / box.height);
      from = [event.clientX, event.clientY];
    });
    window.addEventListener("pointerup", () => { from = null; });
    window.addEventListener("beforeprint", () => set(whole));
    const labelled = (text, label, act) => {
      const made = button(text, act);
      made.setAttribute("aria-label", label);
      made.title = label;
      return made;
    };
    const place = tools(
      labelled("+", "Zoom in", () => zoom(1.5)),
      labelled("\u2212", "Zoom out", () => zoom(1 / 1.5)),
      labelled("1:1", "Show the whole figure", () => set(whole)),
    );
    place.classList.add("zoom");
    svg.after(place);
  });

  // A printed page shows its collapsed parts, and whole figures.
  let closed = [];
  window.addEventListener("beforeprint", () => {
    closed = [...document.querySelectorAll("details:not([open])")];
    closed.forEach((part) => { part.open = true; });
  });
  window.addEventListener("afterprint", () => closed.forEach((part) => { part.open = false; }));
});
