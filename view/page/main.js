// The page: loads the mesh, and connects state, panel, drawing, mouse, touch and keys.

const byId = (id) => document.getElementById(id);

/** All that the parts of the page share. `tetmillApp` is for tests and the browser's console. */
const app = {
  canvas: byId("canvas"), overlay: byId("overlay"), panel: byId("panel"), legend: byId("legend"), info: byId("info"),
  mesh: null, state: null, drawing: null, drawn: [], index: null, level: 0, cut: null, ghosts: null, cutNote: "", measuring: false, measured: [], selected: null,

  view() {
    const { state, mesh } = this;
    return { turn: state.turn, focus: state.focus, zoom: state.zoom, reach: (2.2 + 4 * state.explode) * mesh.radius + norm(state.focus) };
  },
  placeOf(v, mesh = this.mesh) { return add(pointOf(mesh, v), exploded(mesh, this.state, mesh.vertexPart[v])); },
  /** The mesh and the face of a triangle, in the order of drawing. */
  triangle(at) {
    for (const { mesh, faces } of this.drawn) {
      if (at < faces.length) return { mesh, face: faces[at] };
      at -= faces.length;
    }
    return null;
  },
  get faces() { return this.drawn[0].faces; },
  toScreen(p) {
    const q = turned(this.state.turn, sub(p, this.state.focus)), half = this.canvas.clientHeight / 2;
    return [this.canvas.clientWidth / 2 + q[0] / this.state.zoom * half, half - q[1] / this.state.zoom * half];
  },

  /** After a change of what is visible. */
  update() {
    this.changed = true;
    this.redraw();
  },
  /** After a change that the panel shows. */
  rebuild() {
    buildPanel(this);
    this.update();
  },
  redraw() {
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => { this.waiting = 0; this.paint(); });
  },
  paint() {
    const { mesh, state, drawing } = this;
    document.documentElement.dataset.theme = state.dark ? "dark" : "light";
    if (this.changed) {
      this.changed = false;
      const planes = state.cut.on ? planesOf(mesh, state.cut) : null, finer = isCurrent(this);
      const visible = (mesh, cutAt, options) => ({ mesh, ...visibleFaces(mesh, state, shownTets(mesh, state, cutAt), options) });
      this.drawn = [visible(mesh, finer ? null : planes, { clip: finer ? planes : null })];
      if (finer) this.drawn.push(visible(this.cut.mesh, null, { layer: true }));
      if (this.ghosts) this.drawn.push(visible(this.ghosts, planes, { layer: true }));
      const [shown, ...layers] = this.drawn;
      fill(drawing, "faces", shown.buffer);
      fill(drawing, "near", joined(layers.map(({ buffer }) => buffer)));
      fill(drawing, "points", visiblePoints(mesh, state, shown.faces).buffer);
      fill(drawing, "curves", visibleCurves(mesh, state, finer ? planes : null).buffer);
      fill(drawing, "frame", state.cut.on && state.cut.shape === "box" ? boxEdges(mesh, state.cut).buffer : new ArrayBuffer(0));
      buildLegend(this);
    }
    this.mark();
    draw(drawing, this.view(), state.style, state.dark);
    drawOverlay(this);
    askForCut(this);
    clearTimeout(this.saving);
    this.saving = setTimeout(() => {
      this.saved = `#${writeState(state)}`;
      history.replaceState(null, "", this.saved);
    }, 150);
  },
  /** Marks what is selected and measured, in front of everything. */
  mark() {
    const { selected, measured } = this;
    const placed = (list) => list.map((v) => this.placeOf(v, selected.mesh)), ends = measured.map(({ v, mesh }) => this.placeOf(v, mesh));
    const lines = [...(selected ? placed(selected.edges.flat()) : []), ...(ends.length === 2 ? ends : [])];
    fill(this.drawing, "marks", new Float32Array(lines.flat()).buffer);
    const points = [...(selected ? placed(selected.vertices) : []), ...ends];
    const buffer = new ArrayBuffer(20 * points.length), numbers = new Float32Array(buffer), colors = new Uint8Array(buffer);
    points.forEach((p, k) => { numbers.set([...p, 13], 5 * k); colors.set([220, 26, 90, 255], 20 * k + 16); });
    fill(this.drawing, "marked", buffer);
  },
  select(about, look) {
    this.selected = about;
    showInfo(this, about);
    const ends = about ? [...about.vertices, ...about.edges.flat()] : [];
    if (look && ends.length) {
      const places = ends.map((v) => this.placeOf(v, about.mesh));
      this.state.focus = scaled(places.reduce(add), 1 / places.length);
      const size = Math.max(...places.map((p) => norm(sub(p, this.state.focus))));
      this.state.zoom = Math.min(this.state.zoom, size > 0 ? 9 * size : 0.25 * this.mesh.radius);
    }
    this.redraw();
  },
  find(text) {
    const about = search(this.mesh, text);
    if (about) return this.select(about, true);
    this.select({ title: "Not found", rows: [["Find", text], ["", "Take t and the id of a tet, v and that of a vertex, or the number or a part of the name of a boundary."]], vertices: [], edges: [] });
  },
  turn(dx, dy) {
    const s = 0.0075, r = this.state.turn;
    const spun = (row, axis, angle) => add(add(scaled(row, Math.cos(angle)), scaled(cross(axis, row), Math.sin(angle))), scaled(axis, dot(axis, row) * (1 - Math.cos(angle))));
    // Sideways about the z axis of the mesh, up and down about the axis to the right.
    const level = r.map((row) => spun(row, [0, 0, 1], -dx * s));
    this.state.turn = straightened(level.map((row) => spun(row, level[0], -dy * s)));
    this.redraw();
  },
  move(dx, dy) {
    const s = 2 * this.state.zoom / this.canvas.clientHeight, r = this.state.turn;
    this.state.focus = add(this.state.focus, add(scaled(r[0], -dx * s), scaled(r[1], dy * s)));
    this.redraw();
  },
  zoom(factor) {
    this.state.zoom = Math.min(50 * this.mesh.radius, Math.max(1e-5 * this.mesh.radius, this.state.zoom * factor));
    this.redraw();
  },
  measure() {
    this.measuring = !this.measuring;
    this.measured = [];
    byId("measure-button").setAttribute("aria-pressed", this.measuring);
    this.redraw();
  },
  click(x, y) {
    if (!this.measuring) return this.select(pick(this, x, y));
    const end = nearestVertex(this, x, y);
    if (!end) return;
    if (this.measured.length === 2) this.measured = [];
    this.measured.push(end);
    if (this.measured.length === 2) {
      const along = apart(this.measured);
      showInfo(this, { title: "Distance", rows: [["Length", short(norm(along))], ["x, y, z", along.map((d) => short(d, 5)).join(", ")], ["Vertices", this.measured.map(({ mesh, v }) => mesh.ids[v]).join(", ")]] });
    }
    this.redraw();
  },
  clear() {
    this.measured = [];
    if (this.measuring) this.measure();
    this.state.range = null;
    this.select(null);
    this.rebuild();
  },
  /** Loads a level by its place in the list. */
  async load(level) {
    byId("message").textContent = this.mesh ? "Loading the level …" : "Loading the mesh …";
    this.loading = level;
    const answer = await fetch(`mesh/level/${this.index.levels[level][0]}`);
    if (!answer.ok) throw new Error(await answer.text());
    const mesh = decode(await answer.arrayBuffer());
    // Another level may have been chosen meanwhile.
    if (this.loading !== level) return;
    this.level = level;
    this.show(mesh);
  },
  /** Loads the coarsest level, and then the one of the address or the first choice. */
  async begin() {
    await this.load(0);
    const { levels, start } = this.index, chosen = levels.findIndex(([pieces]) => pieces === this.state.level);
    const level = chosen < 0 ? start : chosen;
    if (level > 0) await this.load(level);
  },
  show(mesh) {
    const first = !this.state;
    this.mesh = mesh;
    if (first) {
      this.state = standardState(mesh);
      if (location.hash.length > 1) readState(this.state, location.hash.slice(1));
    }
    document.title = `${mesh.title} – tetmill view`;
    byId("message").textContent = "";
    [this.selected, this.measured, this.cut, this.ghosts] = [null, [], null, null];
    buildTop(this);
    this.rebuild();
    if (mesh.report) buildReport(byId("report"), mesh.report);
    const { ghosts } = this.state;
    if (this.index && this.index.ghosts && ghosts >= 0 && ghosts < mesh.parts && !mesh.hollow) showGhosts(this, ghosts).catch(failed);
  },
};
window.tetmillApp = app;

const VIEWS = { 1: [0, 0], 2: [180, 0], 3: [90, 0], 4: [-90, 0], 5: [-90, 90], 6: [-90, -90] };

function buildTop(app) {
  const button = (name, title, act, more = {}) => element("button", { title, onclick: act, ...more }, name);
  byId("topbar").replaceChildren(
    button("Fit", "Standard view (0)", () => key("0")), button("+x", "View from +x (1)", () => key("1")), button("+y", "View from +y (3)", () => key("3")), button("+z", "View from +z (5)", () => key("5")),
    button("Measure", "Measure between two vertices (m)", () => app.measure(), { id: "measure-button" }),
    button("Dark / light", "Dark or light (d)", () => key("d"), { id: "theme" }),
    ...(app.mesh.report ? [button("Report", "Report of the run (r)", () => byId("report").showModal(), { id: "report-button" })] : []),
    button("?", "Help (?)", () => byId("help").showModal(), { id: "help-button" }));
}

/** What a key does; false if nothing. */
function key(name) {
  const { state } = app, flip = (flag, of = state) => { of[flag] = !of[flag]; app.rebuild(); };
  if (name in VIEWS) state.turn = looking(...VIEWS[name]);
  else if (name === "0") Object.assign(state, { turn: looking(-60, 25), focus: [0, 0, 0], zoom: (0.95 + 0.6 * state.explode) * app.mesh.radius });
  else if (name === "+" || name === "=") app.zoom(0.85);
  else if (name === "-") app.zoom(1 / 0.85);
  else if (name === "c") flip("on", state.cut);
  else if (name === "b") cutTo(app, state.cut.on && state.cut.shape === "box" ? "none" : "box");
  else if (name === "[" || name === "]") { moveCut(state.cut, name === "]" ? 0.03 : -0.03); app.rebuild(); }
  else if (name === "f") { state.style = STYLES[(STYLES.indexOf(state.style) + 1) % STYLES.length]; app.rebuild(); }
  else if (name in { v: 0, s: 0, e: 0, k: 0 }) flip({ v: "vertices", s: "shared", e: "curves", k: "corners" }[name]);
  else if (name === "m") app.measure();
  else if (name === "d") flip("dark");
  else if (name === "r" && app.mesh.report) byId("report").showModal();
  else if (name === "Escape") app.clear();
  else if (name === "?") byId("help").showModal();
  else if (name.startsWith("Arrow")) app.turn({ ArrowLeft: -20, ArrowRight: 20 }[name] || 0, { ArrowUp: -20, ArrowDown: 20 }[name] || 0);
  else return false;
  app.redraw();
  return true;
}

function listen() {
  const { canvas } = app, fingers = new Map();
  let travelled = 0;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    if (fingers.size === 0) travelled = 0;
    fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before || !app.mesh) return;
    const now = [event.offsetX, event.offsetY], [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    travelled += Math.abs(dx) + Math.abs(dy);
    if (fingers.size === 2) {
      const other = [...fingers].find(([id]) => id !== event.pointerId)[1];
      const apart = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
      app.zoom(apart(before) / apart(now));
      app.move(dx / 2, dy / 2);
    } else if (event.buttons & 6 || event.shiftKey) app.move(dx, dy);
    else if (travelled > 3) app.turn(dx, dy);
    fingers.set(event.pointerId, now);
  });
  const up = (event) => {
    const was = fingers.delete(event.pointerId);
    if (event.type === "pointerup" && was && travelled <= 3 && event.button === 0 && app.mesh) app.click(event.offsetX, event.offsetY);
  };
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", up);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); if (app.mesh) app.zoom(Math.exp(Math.max(-1, Math.min(1, event.deltaY * 0.0015)))); }, { passive: false });
  document.addEventListener("keydown", (event) => {
    const typing = event.target instanceof HTMLInputElement && event.target.type === "text";
    if (!app.mesh || typing || event.target instanceof HTMLSelectElement || event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (event.target instanceof HTMLInputElement && event.key.startsWith("Arrow")) return;
    if (key(event.key)) event.preventDefault();
  });
  addEventListener("resize", () => app.mesh && app.redraw());
  addEventListener("hashchange", () => {
    if (!app.mesh || location.hash === app.saved) return;
    readState(app.state, location.hash.slice(1));
    app.rebuild();
  });
}

/** The bytes of a text in base64. */
function bytesOf(text) {
  const binary = atob(text), bytes = new Uint8Array(binary.length);
  for (let k = 0; k < binary.length; k++) bytes[k] = binary.charCodeAt(k);
  return bytes.buffer;
}

async function start() {
  buildHelp(byId("help"));
  listen();
  app.drawing = makeDrawing(app.canvas);
  const data = byId("data");
  if (data.type === "text/plain") return app.show(decode(bytesOf(data.textContent)));
  app.index = JSON.parse(data.textContent);
  await app.begin();
}

const failed = (error) => { byId("message").textContent = `The mesh cannot be shown: ${error.message || error}`; };
start().catch(failed);
