(() => {
  "use strict";
  const figure = document.currentScript.closest("figure");
  const data = JSON.parse(figure.querySelector("script[type='application/json']").textContent);
  const [button, slider, readout, speed] = ["button", "input", "output", "select"].map((name) => figure.querySelector(name));
  const [first, last] = [data.times[0], data.times[data.times.length - 1]];
  const dark = "#464646";

  const canvases = data.scenes.map((scene) => {
    const [section, title, canvas] = ["section", "h3", "canvas"].map((name) => document.createElement(name));
    title.textContent = scene.title;
    const [width, height] = data.window.map(([low, high]) => high - low);
    canvas.style.aspectRatio = Math.min(Math.max(width / height, 0.6), 2.5);
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", scene.title);
    section.append(title, canvas);
    figure.querySelector(".scenes").append(section);
    return canvas;
  });

  // One unit is as long on both axes, and the window stands in the middle of the canvas.
  function transform(canvas) {
    const [[x0, x1], [y0, y1]] = data.window;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    const unit = Math.min((width - 24) / (x1 - x0), (height - 24) / (y1 - y0));
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const place = ([x, y]) => [width / 2 + unit * (x - (x0 + x1) / 2), height / 2 - unit * (y - (y0 + y1) / 2)];
    return { pen, place, unit, width, height };
  }

  function polyline({ pen, place }, points, width, colour, dash = [], closed = false) {
    pen.beginPath();
    points.map(place).forEach(([x, y]) => pen.lineTo(x, y));
    if (closed) pen.closePath();
    [pen.lineWidth, pen.strokeStyle, pen.lineJoin, pen.lineCap] = [width, colour, "round", dash.length ? "butt" : "round"];
    pen.setLineDash(dash);
    if (closed) { pen.fillStyle = "rgba(205, 205, 205, 0.6)"; pen.fill(); }
    pen.stroke();
  }

  function ring({ pen, place }, point) {
    const [x, y] = place(point);
    pen.beginPath();
    pen.arc(x, y, 4, 0, 2 * Math.PI);
    [pen.fillStyle, pen.strokeStyle, pen.lineWidth] = ["#fff", "#000", 1.4];
    pen.setLineDash([]);
    pen.fill();
    pen.stroke();
  }

  function ground(view, point) {
    const [x, y] = view.place(point);
    const pen = view.pen;
    pen.setLineDash([]);
    [pen.lineWidth, pen.strokeStyle, pen.fillStyle] = [1.4, "#000", "#fff"];
    pen.beginPath();
    [[x, y], [x - 9, y + 15], [x + 9, y + 15]].forEach(([u, v]) => pen.lineTo(u, v));
    pen.closePath();
    pen.fill();
    pen.moveTo(x - 14, y + 15);
    pen.lineTo(x + 14, y + 15);
    for (let k = -10; k <= 14; k += 5) { pen.moveTo(x + k, y + 15); pen.lineTo(x + k - 4, y + 20); }
    pen.stroke();
    ring(view, point);
  }

  function block(view, [x, y, angle]) {
    const [u, v] = view.place([x, y]);
    const pen = view.pen;
    pen.save();
    pen.translate(u, v);
    pen.rotate(-angle);
    pen.setLineDash([]);
    [pen.lineWidth, pen.strokeStyle, pen.fillStyle] = [1.4, "#000", "#ebebeb"];
    pen.fillRect(-13, -8, 26, 16);
    pen.strokeRect(-13, -8, 26, 16);
    pen.restore();
    ring(view, [x, y]);
  }

  // A bar of round length in the lower left corner.
  function scale({ pen, unit, height }) {
    const power = 10 ** Math.floor(Math.log10(80 / unit));
    const length = [5, 2, 1].map((factor) => factor * power).find((l) => l * unit <= 90);
    pen.setLineDash([]);
    [pen.lineWidth, pen.strokeStyle, pen.fillStyle, pen.font] = [1.2, "#000", "#000", "12px sans-serif"];
    pen.beginPath();
    [[12, -16], [12, -12], [12 + length * unit, -12], [12 + length * unit, -16]].forEach(([x, y]) => pen.lineTo(x, height + y));
    pen.stroke();
    const name = (data.labels[0].match(/\[(.*)\]/) || ["", ""])[1];
    pen.fillText(`${Number(length.toPrecision(1))} ${name}`, 14, height - 20);
  }

  function draw(k) {
    data.scenes.forEach((scene, s) => {
      const view = transform(canvases[s]);
      const frame = scene.frames[k];
      scene.traces.forEach((trace) => polyline(view, trace, 1.2, "#0072b2"));
      frame.guides.forEach((guide) => polyline(view, guide, 1.2, "#808080", [10, 4, 2, 4]));
      frame.plates.forEach((plate) => polyline(view, plate, 1.6, dark, [], true));
      frame.bars.forEach((bar) => polyline(view, bar, 4, dark));
      frame.sliders.forEach((slider) => block(view, slider));
      frame.ground.forEach((joint) => ground(view, joint));
      frame.joints.forEach((joint) => ring(view, joint));
      scale(view);
    });
    slider.value = k;
    readout.textContent = `t = ${data.times[k].toPrecision(4)} s`;
    figure.dataset.frame = k;
  }

  // The time points need not be equally spaced: the frame is the last one that has begun.
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
  function step(now) {
    if (before !== null && playing) {
      time += ((now - before) / 1000) * Number(speed.value) * ((last - first) / data.seconds);
      if (time > last) time = first + ((time - first) % (last - first));
      draw(frameAt(time));
    }
    before = now;
    window.requestAnimationFrame(step);
  }
  button.addEventListener("click", () => { playing = !playing; show(); });
  slider.addEventListener("input", () => { playing = false; time = data.times[Number(slider.value)]; show(); });
  window.addEventListener("resize", show);
  show();
  window.requestAnimationFrame(step);
})();
