// The page of the laboratory: controls, pictures, saving. It draws what it is given and computes no touch.
// `start(root, spec, ask)`: ask({state, exact}) resolves to {error}, {making} or {view}.

const STYLE = `
.lab { font: 15px/1.4 system-ui, sans-serif; color: #111; max-width: 1500px; margin: 0 auto; padding: 8px; }
.lab h1 { font-size: 1.3em; margin: 0 0 6px; }
.lab .columns { display: grid; grid-template-columns: minmax(250px, 300px) 1fr; gap: 14px; }
.lab .pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 330px), 1fr)); gap: 10px; }
.lab figure { margin: 0; min-width: 0; }
.lab figcaption { font-weight: 600; font-size: .93em; }
.lab canvas { width: 100%; display: block; background: #fff; }
.lab canvas[tabindex] { touch-action: none; cursor: crosshair; }
.lab canvas:focus-visible, .lab :is(button, input, select, summary):focus-visible { outline: 3px solid #0050b0; }
.lab label { display: grid; grid-template-columns: 1fr 5.4em; gap: 0 6px; margin-bottom: 5px; font-size: .93em; }
.lab label > span { grid-column: 1 / 3; }
.lab label > select { grid-column: 1 / 3; font: inherit; }
.lab input[type=number] { font: inherit; width: 100%; box-sizing: border-box; }
.lab input[type=range] { width: 100%; min-width: 0; }
.lab .said { min-height: 1.5em; padding: 4px 8px; margin: 0 0 8px; border-left: 4px solid #999; background: #f4f4f4; }
.lab .said.wrong { border-color: #000; background: #ffe9d6; font-weight: 600; }
.lab .row { display: flex; flex-wrap: wrap; gap: 6px; align-items: center; margin: 8px 0; }
.lab .row input[type=range] { flex: 1 1 160px; }
.lab button { font: inherit; padding: 4px 10px; }
.lab pre { overflow-x: auto; background: #f4f4f4; padding: 8px; font-size: .85em; }
@media (max-width: 700px) { .lab .columns { grid-template-columns: 1fr; } .lab .shown { order: -1; } }
`;

// Light to dark, so that the order survives in greys.
const STOPS = [[255, 255, 255], [254, 217, 142], [245, 140, 60], [200, 60, 40], [130, 20, 50], [50, 0, 35]];
const colour = share => {
  const at = Math.min(Math.max(share, 0), 1) * (STOPS.length - 1), n = Math.min(Math.floor(at), STOPS.length - 2);
  return STOPS[n].map((low, i) => low + (at - n) * (STOPS[n + 1][i] - low));
};
const BLUE = "#0050b0", ORANGE = "#c45a00", FONT = "13px system-ui, sans-serif";
const make = (tag, parent, props = {}) => parent.appendChild(Object.assign(document.createElement(tag), props));
const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
const round = (value, digits = 3) => Number(value.toPrecision(digits)).toString();
const before = (times, time) => { let n = times.length - 1; while (n > 0 && times[n] > time + 1e-6) n--; return n; };

/** Picture with axes; `draw(pen, toX, toY)` draws in units of the axes. */
function plot(canvas, x, y, height, draw, keepShape = false) {
  const ratio = window.devicePixelRatio || 1, wide = Math.max(canvas.clientWidth, 200);
  let left = 52, right = 12, top = 8, bottom = 36;
  const tall = keepShape
    ? Math.min((wide - left - right) * (y.high - y.low) / (x.high - x.low) + top + bottom, 600) : height;
  canvas.width = wide * ratio; canvas.height = tall * ratio; canvas.style.height = tall + "px";
  const pen = canvas.getContext("2d");
  pen.scale(ratio, ratio); pen.font = FONT; pen.fillStyle = "#fff"; pen.fillRect(0, 0, wide, tall);
  const toX = value => left + (value - x.low) / (x.high - x.low) * (wide - left - right);
  const toY = value => tall - bottom - (value - y.low) / (y.high - y.low) * (tall - top - bottom);
  pen.save(); pen.beginPath(); pen.rect(left, top, wide - left - right, tall - top - bottom); pen.clip();
  draw(pen, toX, toY);
  pen.restore();
  pen.strokeStyle = pen.fillStyle = "#111"; pen.lineWidth = 1;
  pen.strokeRect(left, top, wide - left - right, tall - top - bottom);
  for (const [axis, across] of [[x, true], [y, false]]) {
    const step = tick((axis.high - axis.low) / (across ? Math.max(wide / 90, 2) : 4));
    for (let n = Math.ceil(axis.low / step - 1e-9); n * step <= axis.high * (1 + 1e-9); n++) {
      const text = String(Number((n * step).toFixed(6)));
      pen.textAlign = across ? "center" : "right";
      if (across) pen.fillText(text, toX(n * step), tall - bottom + 15);
      else pen.fillText(text, left - 5, toY(n * step) + 4);
    }
  }
  pen.textAlign = "center"; pen.fillText(x.label, (left + wide - right) / 2, tall - 4);
  pen.save(); pen.translate(12, (top + tall - bottom) / 2); pen.rotate(-Math.PI / 2); pen.fillText(y.label, 0, 0);
  pen.restore();
  canvas.from = (px, py) => [x.low + (px - left) / (wide - left - right) * (x.high - x.low),
    y.low + (tall - bottom - py) / (tall - top - bottom) * (y.high - y.low)];
}
function tick(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * [1, 2, 5, 10].find(factor => factor * power >= least * 0.999);
}
function line(pen, points, style, width = 2, dash = []) {
  pen.strokeStyle = style; pen.lineWidth = width; pen.setLineDash(dash); pen.beginPath();
  points.forEach(([x, y], n) => n ? pen.lineTo(x, y) : pen.moveTo(x, y));
  pen.stroke(); pen.setLineDash([]);
}

export function start(root, spec, ask) {
  make("style", root, { textContent: STYLE });
  const lab = make("main", root, { className: "lab" });
  make("h1", lab, { textContent: "fingerpad laboratory" });
  const said = make("p", lab, { className: "said" });
  said.setAttribute("role", "status");
  const columns = make("div", lab, { className: "columns" });
  const side = make("form", columns), shown = make("div", columns, { className: "shown" });
  side.onsubmit = event => event.preventDefault();
  const state = { ...spec.start }, inputs = {};
  let view = null, time = null, exact = false, busy = false, wanted = false, playing = false, keeping = 0;

  // Controls.
  const range = name => {
    if (name === "size" || name === "other_size") return spec.objects[name === "size" ? state.object : state.other]?.values ?? [0, 0];
    return spec.objects[state.object]?.[name] ?? spec.bounds[name];
  };
  for (const [name, text, unit, step] of spec.controls) {
    const label = make("label", side), caption = make("span", label, { textContent: unit ? `${text} [${unit}]` : text });
    if (spec.choices[name]) {
      const select = make("select", label, { name });
      spec.choices[name].forEach(each => make("option", select, { value: each, textContent: each || spec.empty[name] }));
      select.onchange = () => set({ [name]: select.value });
      inputs[name] = { label, caption, fill: () => { select.value = state[name]; } };
    } else {
      const slider = make("input", label, { type: "range", name, step });
      const number = make("input", label, { type: "number", name: name + "_number", step: "any" });
      number.setAttribute("aria-label", caption.textContent);
      slider.oninput = () => set({ [name]: Number(slider.value) });
      number.onchange = () => set({ [name]: number.value === "" ? NaN : Number(number.value) });
      inputs[name] = { label, caption, text, fill: () => {
        const [low, high] = range(name);
        label.hidden = low === high;
        label.style.display = low === high ? "none" : "";
        Object.assign(slider, { min: low, max: high, value: state[name] });
        if (document.activeElement !== number || Number(number.value) !== state[name]) number.value = state[name];
        if (name.endsWith("size")) {
          const key = spec.objects[name === "size" ? state.object : state.other]?.parameter;
          caption.textContent = key ? `${name === "size" ? "" : "other "}${key.replaceAll("_", " ")}` : text;
        }
      } };
    }
  }
  const buttons = make("div", side, { className: "row" });
  const button = (text, action) => make("button", buttons, { type: "button", textContent: text, onclick: action });
  if (spec.exact) button("Solve exactly", () => { exact = true; update(); });
  button("Copy link", () => navigator.clipboard?.writeText(location.href).then(() => tell("The link is copied."),
    () => tell(`The link is the address of this page: ${location.href}`)));
  button("Save figure", saveFigure);
  button("Save data", () => view && save("touch.json", new Blob([JSON.stringify({ state, ...view })])));
  button("Save Python", () => view && save("touch.py", new Blob([view.python])));

  // Pictures.
  const row = make("div", shown, { className: "row" });
  const play = make("button", row, { type: "button", textContent: "Play", onclick: () => { playing = !playing; run(); } });
  const clock = make("input", row, { type: "range", name: "time", min: 0, step: 1 });
  clock.setAttribute("aria-label", "time of the pictures [ms]");
  const clockText = make("output", row);
  clock.oninput = () => { playing = false; time = Number(clock.value); keep(); draw(); };
  const pictures = make("div", shown, { className: "pictures" }), canvases = {};
  const traces = document.createElement("div");
  for (const [name, text] of [
    ["skin", "Strain energy density and contact"], ["full", "The same, solved exactly"],
    ["map", "Spikes so far"], ["force", "Force"], ["raster", "Spikes of the population, nearest to the contact on top"]]) {
    const figure = make("figure", name === "force" || name === "raster" ? traces : pictures), caption = make("figcaption", figure, { textContent: text });
    canvases[name] = Object.assign(make("canvas", figure), { caption, figure });
    canvases[name].setAttribute("role", "img");
  }
  pictures.append(traces);
  const words = make("div", shown), lines = make("details", shown);
  words.setAttribute("role", "status");
  make("summary", lines, { textContent: "Python lines that reproduce this view" });
  const python = make("pre", lines);

  // Mouse and keys on the skin.
  const skin = canvases.skin;
  skin.tabIndex = 0;
  skin.setAttribute("aria-label", "Skin: arrow keys move the object, Page Up and Page Down change the depth");
  const moveTo = event => {
    if (!skin.from || !view) return;
    const box = skin.getBoundingClientRect(), [x, z] = skin.from(event.clientX - box.left, event.clientY - box.top);
    move(x - view.pad_mm[0], z - view.pad_mm[1]);
  };
  const clip = (name, value) => Number(Math.min(Math.max(value, range(name)[0]), range(name)[1]).toFixed(3));
  const step = name => spec.controls.find(each => each[0] === name)?.[3] ?? 0;
  const snap = (name, value) => clip(name, step(name) ? Math.round(value / step(name)) * step(name) : value);
  const move = (x, z) => set({ x_mm: snap("x_mm", x), z_mm: snap("z_mm", z) });
  skin.onpointerdown = event => { skin.setPointerCapture(event.pointerId); moveTo(event); };
  skin.onpointermove = event => { if (event.buttons) moveTo(event); };
  skin.addEventListener("wheel", event => {
    event.preventDefault();
    set({ depth_mm: snap("depth_mm", state.depth_mm - Math.sign(event.deltaY) * step("depth_mm")) });
  }, { passive: false });
  skin.onkeydown = event => {
    const [x, z, depth] = { ArrowRight: [1, 0, 0], ArrowLeft: [-1, 0, 0], ArrowUp: [0, 1, 0], ArrowDown: [0, -1, 0],
      PageDown: [0, 0, 1], PageUp: [0, 0, -1] }[event.key] ?? [0, 0, 0];
    if (!x && !z && !depth) return;
    event.preventDefault();
    set({ x_mm: snap("x_mm", state.x_mm + x * step("x_mm")), z_mm: snap("z_mm", state.z_mm + z * step("z_mm")),
      depth_mm: snap("depth_mm", state.depth_mm + depth * step("depth_mm")) });
  };

  function set(changed) {
    Object.assign(state, changed);
    // What another object cannot do is set to what it can.
    for (const name of ["size", "other_size"]) {
      const of = name === "size" ? "object" : "other";
      if (of in changed && !(name in changed)) state[name] = spec.objects[state[of]]?.size ?? 0;
    }
    if ("object" in changed) for (const name of ["depth_mm", "x_mm", "z_mm", "tilt_deg", "slide_mm"]) state[name] = clip(name, state[name]);
    exact = false; keep(); fill(); update();
  }
  function fill() { Object.values(inputs).forEach(each => each.fill()); }
  // Browsers refuse to write the address many times a second.
  function keep() {
    clearTimeout(keeping);
    keeping = setTimeout(() => {
      const words = Object.entries(state).filter(([name, value]) => value !== spec.start[name]);
      if (time !== null) words.push(["time", Math.round(time)]);
      history.replaceState(null, "", "#" + new URLSearchParams(words));
    }, 200);
  }
  function restore() {
    for (const [name, value] of new URLSearchParams(location.hash.slice(1))) {
      if (name === "time") time = Number(value) || 0;
      else state[name] = typeof spec.start[name] === "number" ? Number(value) : value;
    }
    fill(); update();
  }
  function tell(text, wrong = false) { said.textContent = text; said.className = wrong ? "said wrong" : "said"; }

  let first = null; // when presses for what is made now were first seen, and how many were done
  function progressOf({ what, done, total }) {
    if (!first || first.what !== what || first.total !== total) first = { what, done, total, at: Date.now() };
    if (!total) return `Pressing for ${what}: begins. This is needed once.`;
    const pressed = done - first.done, minutes = (Date.now() - first.at) / 60000 / pressed * (total - done);
    const left = pressed < 2 ? "" : `, about ${Math.max(1, Math.round(minutes))} min left`;
    return `Pressing for ${what}: ${done} of ${total} done${left}. This is needed once.`;
  }

  async function update() {
    wanted = true;
    if (busy) return;
    busy = true;
    while (wanted) {
      wanted = false;
      const late = setTimeout(() => tell("No answer yet: is `fingerpad lab` still running?", true), 10000);
      const reply = await ask({ state: { ...state }, exact });
      clearTimeout(late);
      if (reply.error) tell(reply.error, true);
      if (reply.view) { view = reply.view; tell(view.said); python.textContent = view.python; draw(); }
      const making = reply.making ?? reply.view?.making;
      if (making && !wanted) {
        // Until there is a reduced touch, each place is solved in full.
        tell(progressOf(making) + (reply.view ? " Meanwhile you see the full solution." : ""));
        await new Promise(resolve => setTimeout(resolve, reply.view ? 1500 : 400));
        wanted = true;
      }
    }
    busy = false;
  }

  function run() {
    play.textContent = playing ? "Stop" : "Play";
    if (!playing || !view) return;
    const end = view.answer.times_ms.at(-1);
    time = (time ?? end) + end / 150 > end ? 0 : (time ?? 0) + end / 150;
    draw();
    requestAnimationFrame(() => setTimeout(run, 30));
  }

  // Drawing.
  function draw() {
    if (!view) return;
    const end = view.answer.times_ms.at(-1);
    if (time === null || time > end) time = view.shown_ms;
    Object.assign(clock, { max: Math.round(end), value: time });
    clockText.textContent = `${Math.round(time)} of ${Math.round(end)} ms`;
    const top = Math.max(view.answer.peak_kpa, view.exact?.peak_kpa ?? 0);
    drawSkin(canvases.skin, view.answer, top);
    canvases.full.figure.style.display = view.exact ? "" : "none";
    if (view.exact) drawSkin(canvases.full, view.exact, top);
    drawMap(); drawForce(); drawRaster();
    const n = before(view.answer.times_ms, time);
    skin.title = `force ${round(view.answer.force_mn[n])} mN`;
    words.replaceChildren();
    for (const text of [
      `At ${Math.round(time)} ms: ${round(view.answer.force_mn[n])} mN${view.answer.error_mn[n] ? ` ± ${round(view.answer.error_mn[n], 2)}` : ""}, ` +
      `${round(view.answer.area_mm2[n])} mm² in contact, largest strain energy density ${round(view.answer.largest_kpa[n])} kPa. ` +
      `${view.answer.spikes.filter(train => train.length).length} of ${view.answer.spikes.length} afferents fire.`,
      view.difference, view.compared]) if (text) make("p", words, { textContent: text });
  }
  const axes = () => ({ x: { low: view.x_mm[0], high: view.x_mm.at(-1), label: "along the finger, tip to the right [mm]" },
    z: { low: view.z_mm[0], high: view.z_mm.at(-1), label: "across [mm]" } });
  function drawSkin(canvas, of, top) {
    const { x, z } = axes(), n = before(of.times_ms, time), frame = before(of.frames_ms, time), nx = view.x_mm.length, nz = view.z_mm.length;
    of.bytes ??= bytes(of.frames);
    Object.defineProperty(of, "bytes", { enumerable: false });
    const image = new ImageData(nx, nz);
    for (let i = 0; i < nx; i++) for (let j = 0; j < nz; j++) {
      const value = of.bytes[(frame * nx + i) * nz + j];
      const rgb = value === 255 ? [225, 225, 225] : colour(value / 254 * of.peak_kpa / (top || 1));
      image.data.set([...rgb, 255], 4 * ((nz - 1 - j) * nx + i));
    }
    const small = Object.assign(document.createElement("canvas"), { width: nx, height: nz });
    small.getContext("2d").putImageData(image, 0, 0);
    plot(canvas, x, z, 0, (pen, toX, toY) => {
      pen.drawImage(small, toX(x.low), toY(z.high), toX(x.high) - toX(x.low), toY(z.low) - toY(z.high));
      for (const sign of [-1, 1]) line(pen, view.outline_mm.map(([a, b]) => [toX(a), toY(sign * b)]), "#111", 1);
      const [cx, cz, a, b, angle] = of.contact_mm[n], scale = (toX(1) - toX(0));
      if (a > 0) for (const [style, width, dash] of [["#fff", 4, []], ["#000", 2, [5, 4]]]) {
        pen.strokeStyle = style; pen.lineWidth = width; pen.setLineDash(dash); pen.beginPath();
        pen.ellipse(toX(cx), toY(cz), a * scale, b * scale, -angle, 0, 2 * Math.PI); pen.stroke(); pen.setLineDash([]);
      }
      for (let k = 0; k <= 60; k++) {
        pen.fillStyle = `rgb(${colour(k / 60)})`;
        pen.fillRect(toX(x.low) + 8 + k * 1.5, toY(z.high) + 22, 2, 9);
      }
      pen.fillStyle = "#000"; pen.textAlign = "left";
      pen.fillText(`0 to ${round(top)} kPa`, toX(x.low) + 8, toY(z.high) + 16);
    }, true);
  }
  function drawMap() {
    const { x, z } = axes();
    plot(canvases.map, x, z, 0, (pen, toX, toY) => {
      for (const sign of [-1, 1]) line(pen, view.outline_mm.map(([a, b]) => [toX(a), toY(sign * b)]), "#111", 1);
      const most = Math.max(1, ...view.answer.spikes.map(train => train.length)), largest = 0.48 * (toX(1) - toX(0));
      view.positions_mm.forEach(([px, pz], n) => {
        const count = view.answer.spikes[n].filter(at => at <= time).length;
        pen.beginPath(); pen.arc(toX(px), toY(pz), count ? Math.max(largest * Math.sqrt(count / most), 1.5) : 1, 0, 7);
        pen.fillStyle = count ? BLUE : "#999"; pen.fill();
      });
    }, true);
    canvases.map.caption.textContent = `Spikes so far, area by number, at most ${Math.max(0, ...view.answer.spikes.map(train => train.length))}`;
  }
  const now = (pen, toX, toY, y) => line(pen, [[toX(time), toY(y.low)], [toX(time), toY(y.high)]], "#666", 1, [2, 3]);
  function drawForce() {
    const end = view.answer.times_ms.at(-1), x = { low: 0, high: end, label: "time [ms]" };
    const most = Math.max(...view.answer.force_mn, ...(view.exact?.force_mn ?? []), ...(view.other?.force_mn ?? []), 1e-6);
    const y = { low: 0, high: 1.12 * most, label: "force [mN]" };
    plot(canvases.force, x, y, 240, (pen, toX, toY) => {
      const points = (times, forces) => times.map((at, n) => [toX(at), toY(forces[n])]);
      pen.fillStyle = "#0050b033"; pen.beginPath();
      points(view.answer.times_ms, view.answer.force_mn.map((f, n) => f + view.answer.error_mn[n])).forEach(([a, b]) => pen.lineTo(a, b));
      points(view.answer.times_ms, view.answer.force_mn.map((f, n) => f - view.answer.error_mn[n])).reverse().forEach(([a, b]) => pen.lineTo(a, b));
      pen.fill();
      line(pen, points(view.answer.times_ms, view.answer.force_mn), BLUE);
      if (view.other) line(pen, points(view.other.times_ms, view.other.force_mn), ORANGE, 2, [7, 4]);
      if (view.exact) for (const [a, b] of points(view.exact.times_ms, view.exact.force_mn)) {
        pen.strokeStyle = "#000"; pen.lineWidth = 1.5; pen.beginPath(); pen.arc(a, b, 4, 0, 7); pen.stroke();
      }
      now(pen, toX, toY, y);
    });
    const named = (name, size) => size ? `${name} ${size}` : name;
    canvases.force.caption.textContent = "Force: " + ["line " + named(state.object, state.size),
      view.other && "dashes " + named(state.other, state.other_size),
      view.exact && "circles solved exactly"].filter(Boolean).join(", ");
  }
  function drawRaster() {
    const order = view.order.filter(site => view.answer.spikes[site].length);
    const y = { low: 0, high: Math.max(order.length, 1), label: "afferents that fire" };
    plot(canvases.raster, { low: 0, high: view.answer.times_ms.at(-1), label: "time [ms]" }, y, 240, (pen, toX, toY) => {
      const tall = Math.max(0.8 * (toY(0) - toY(1)), 1);
      pen.fillStyle = "#000";
      order.forEach((site, n) => view.answer.spikes[site].forEach(at => pen.fillRect(toX(at) - 0.6, toY(y.high - n - 0.1), 1.2, tall)));
      now(pen, toX, toY, y);
    });
  }

  // Saving.
  function save(name, blob) {
    const link = make("a", root, { href: URL.createObjectURL(blob), download: name });
    link.click(); link.remove(); setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }
  function saveFigure() {
    if (!view) return;
    const each = Object.values(canvases).filter(canvas => canvas.clientWidth), gap = 30;
    const whole = document.createElement("canvas"), wide = Math.max(...each.map(canvas => canvas.width));
    whole.width = 2 * wide;
    const places = []; let top = 0;
    for (let n = 0; n < each.length; n += 2) {
      each.slice(n, n + 2).forEach((canvas, k) => places.push([canvas, k * wide, top + gap]));
      top += gap + Math.max(...each.slice(n, n + 2).map(canvas => canvas.height));
    }
    whole.height = top;
    const pen = whole.getContext("2d");
    pen.fillStyle = "#fff"; pen.fillRect(0, 0, whole.width, whole.height); pen.fillStyle = "#000"; pen.font = "bold 18px system-ui, sans-serif";
    for (const [canvas, x, y] of places) { pen.drawImage(canvas, x, y); pen.fillText(canvas.caption.textContent, x + 10, y - 9); }
    whole.toBlob(blob => save("touch.png", blob));
  }

  window.addEventListener("hashchange", restore);
  new ResizeObserver(() => draw()).observe(shown);
  restore();
}

/** The component of Panel: messages to and from the server. */
export function render({ model, el }) {
  const waiting = new Map();
  let count = 0;
  model.on("msg:custom", event => {
    const reply = JSON.parse(event.data ?? event);
    waiting.get(reply.id)?.(reply);
    waiting.delete(reply.id);
  });
  start(el, JSON.parse(model.spec), request => new Promise(resolve => {
    const id = ++count;
    waiting.set(id, resolve);
    model.send_msg({ id, ...request });
  }));
}
