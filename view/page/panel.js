// The panel at the side: what is shown, colours, cut, quality. Text of the mesh is set as text, never as HTML.

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (key in made && key !== "list") made[key] = value;
    else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

function section(title, open, ...children) {
  return element("details", { open }, element("summary", {}, title), element("div", { className: "body" }, ...children));
}

/** A checkbox with a colour, a name and a count. */
function toggle(name, on, change, { id, color, more } = {}) {
  return element("label", { className: "row", title: name },
    element("input", { type: "checkbox", checked: on, ...(id ? { id } : {}), onchange: (event) => change(event.target.checked) }),
    ...(color ? [element("span", { className: "swatch", style: `background:${css(color)}` })] : []),
    element("span", { className: "name" }, name), ...(more ? [element("span", { className: "more" }, more)] : []));
}

/** Checkboxes of a set of numbers that are off, with buttons for all and none. */
function list(app, entries, off, kind) {
  const { state } = app;
  if (entries.length === 0) return element("div", {}, "none");
  const set = (numbers) => { off.clear(); numbers.forEach((n) => off.add(n)); app.rebuild(); };
  return element("div", {},
    ...(entries.length > 1 ? [element("div", { className: "buttons" },
      element("button", { onclick: () => set([]) }, "All"), element("button", { onclick: () => set(entries.map((e) => e.index)) }, "None"))] : []),
    element("div", { className: "scroll" }, ...entries.map(({ index, name, more }) =>
      toggle(name, !off.has(index), (on) => { on ? off.delete(index) : off.add(index); app.update(); }, { id: `${kind}-${index}`, color: state.color === kind ? colorOf(index) : undefined, more }))));
}

function choice(id, label, value, options, change) {
  return element("div", { className: "field" }, element("label", { htmlFor: id }, label),
    element("select", { id, onchange: (event) => change(event.target.value) },
      ...options.map(([key, text]) => element("option", { value: key, selected: key === value }, text))));
}

function slider(id, label, value, [low, high], change) {
  return element("div", { className: "field" }, element("label", { htmlFor: id }, label),
    element("input", { id, type: "range", min: low, max: high, step: (high - low) / 400, value, oninput: (event) => change(Number(event.target.value)) }));
}

/** A slider with two thumbs, for the ends of a range. */
function rangeSlider(id, label, ends, [low, high], change) {
  const thumbs = [0, 1].map((k) => element("input", { id: `${id}-${k ? "high" : "low"}`, type: "range", min: low, max: high, step: (high - low) / 408, value: ends[k], "aria-label": `${label}, ${k ? "highest" : "lowest"}` }));
  const track = element("div", { className: "span" }, ...thumbs);
  const fill = () => {
    const [from, to] = thumbs.map((thumb) => (Number(thumb.value) - low) / (high - low));
    track.style.setProperty("--from", from);
    track.style.setProperty("--to", to);
    // Thumbs at one place: the one that can move away is in front.
    thumbs[0].style.zIndex = from + to > 1 ? 1 : 0;
  };
  thumbs.forEach((thumb, k) => thumb.addEventListener("input", () => {
    // A thumb stops at the other one.
    const other = Number(thumbs[1 - k].value), value = Number(thumb.value);
    thumb.value = k ? Math.max(value, other + THINNEST) : Math.min(value, other - THINNEST);
    fill();
    change(thumbs.map((thumb) => Number(thumb.value)));
  }));
  fill();
  return element("div", { className: "field" }, element("span", {}, label), track);
}

const COLORS = [["patch", "boundary"], ["part", "part"], ["body", "body"], ["angle", "smallest angle"], ["ratio", "mean ratio"]];
const NORMALS = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };

/** What the numbers at the top say. */
function facts(app) {
  const { mesh } = app, { totals } = mesh, some = mesh.tetCount < totals.tets;
  const lines = [`${grouped(totals.tets)} tets, ${grouped(totals.vertices)} vertices, ${mesh.parts} ${mesh.parts === 1 ? "part" : "parts"}`];
  const notes = [];
  if (mesh.pieces && mesh.pieces[0] !== mesh.pieces[1]) {
    notes.push(`Shown is a coarser level of the mesh${mesh.hollow ? "" : ` with ${grouped(mesh.tetCount)} tets`}: coarse edges in ${mesh.pieces[1]} instead of ${mesh.pieces[0]}. Ids, sizes and quality are those of this level.`);
  }
  if (mesh.hollow && some) {
    notes.push(`The mesh is large: only the ${grouped(mesh.tetCount)} tets at its surface and between parts are here. ${app.index && app.index.cuts ? "" : " Cuts show it hollow."}`);
  }
  return { lines, notes };
}

function buildPanel(app) {
  const { mesh, state, panel } = app, { lines, notes } = facts(app), levels = app.index ? app.index.levels : [];
  const show = (key, name, more) => toggle(name, state[key], (on) => { state[key] = on; app.update(); }, { id: `show-${key}`, more });
  const patches = mesh.patches.map((label, index) => ({ index, name: labelOf(label, index, "patch"), more: grouped(mesh.patchFaces[index]) })).filter((e) => mesh.patchFaces[e.index] > 0);
  const parts = mesh.tets.length && mesh.parts > 1 ? mesh.partCenters.map((_, index) => ({ index, name: `Part ${index + 1}` })) : [];
  const bodies = mesh.bodies.map((label, index) => ({ index, name: labelOf(label, index, "body") }));
  const colors = mesh.periodic.length ? [...COLORS, ["periodic", "periodic pair"]] : COLORS;
  const shared = mesh.holders.reduce((sum, h) => sum + (h > 1), 0);
  panel.replaceChildren(
    element("h1", {}, mesh.title), ...lines.map((line) => element("p", { className: "facts" }, line)), ...notes.map((note) => element("p", { className: "note", id: "note" }, note)),
    ...(levels.length > 1 ? [choice("level", "Level", String(app.level), levels.map(([pieces, hollow], k) => [String(k), `${pieces === 1 ? "coarse mesh" : `edges in ${pieces}`}${hollow ? ", surface" : ""}`]), (k) => { [state.level] = levels[k]; app.load(Number(k)).catch(failed); })] : []),
    element("input", { id: "search", type: "text", placeholder: "Find t12, v34, or a boundary name", "aria-label": "Find", onkeydown: (event) => event.key === "Enter" && app.find(event.target.value) }),
    section("Shown", true,
      choice("color", "Colour by", state.color, colors, (key) => { state.color = key; if (key in QUALITY) state.measure = key; app.rebuild(); }),
      choice("style", "Faces", state.style, [["both", "filled, with grid"], ["filled", "filled"], ["grid", "grid"], ["transparent", "transparent"]], (key) => { state.style = key; app.redraw(); }),
      show("boundary", "Boundary"), ...(parts.length ? [show("interfaces", "Faces between parts")] : []), show("volume", "Tets at the cut"),
      show("curves", "Curves", grouped(mesh.curves.length)), show("corners", "Corners", grouped(mesh.corners.length)), show("vertices", "Vertices"),
      ...(shared ? [show("shared", "Shared vertices", grouped(shared))] : [])),
    section("Cut", true, ...cutControls(app)),
    section(`Boundaries (${patches.length})`, true, list(app, patches, state.patchesOff, "patch")),
    ...(parts.length ? [section(`Parts (${parts.length})`, true, slider("explode", "Exploded", state.explode, [0, 1.5], (x) => { state.explode = x; app.update(); }),
      ...(app.index && app.index.ghosts && !mesh.hollow ? [choice("ghosts", "Ghosts of", String(state.ghosts), [["-1", "no part"], ...parts.map(({ index, name }) => [String(index), name])], (part) => showGhosts(app, Number(part)).catch(failed))] : []), list(app, parts, state.partsOff, "part"))] : []),
    ...(bodies.length > 1 ? [section(`Bodies (${bodies.length})`, false, list(app, bodies, state.bodiesOff, "body"))] : []),
    ...(mesh.periodic.length ? [section(`Periodic pairs (${mesh.periodic.length})`, false, ...mesh.periodic.map(([a, b], k) => element("div", { className: "legend-row" },
      element("span", { className: "swatch", style: `background:${css(colorOf(k))}` }), `${labelOf(mesh.patches[a], a, "patch")} ↔ ${labelOf(mesh.patches[b], b, "patch")}`)))] : []),
    section("Quality", true, element("div", { id: "quality" }, ...qualityControls(app))));
}

/** Shows all, or cuts by a plane across an axis or the view, or by a box. */
function cutTo(app, name) {
  const { cut, turn } = app.state;
  cut.on = name !== "none";
  if (name === "box") cut.shape = "box";
  else if (cut.on) {
    cut.shape = "plane";
    // The side towards the viewer is hidden, so that the cut is seen.
    const normal = name === "view" ? turn[2] : NORMALS[name];
    cut.normal = dot(normal, turn[2]) < 0 ? scaled(normal, -1) : normal;
  }
  app.rebuild();
}

/** The choice that made the cut. */
function cutName({ on, shape, normal }) {
  if (!on) return "none";
  return shape === "box" ? "box" : Object.keys(NORMALS).find((name) => Math.abs(dot(NORMALS[name], normal)) === 1) || "view";
}

const CUTS = [["none", "None"], ["x", "x"], ["y", "y"], ["z", "z"], ["view", "View"], ["box", "Box"]];

function cutControls(app) {
  const { cut } = app.state, chosen = cutName(cut), note = app.index && app.index.cuts;
  const titles = { none: "Show all", view: "A plane across the view", box: "The tets in a box (b)" };
  const choices = CUTS.map(([name, text]) => element("button", { id: `cut-${name}`, title: titles[name] || `A plane across ${name}`, "aria-pressed": String(name === chosen), onclick: () => cutTo(app, name) }, text));
  const flip = () => { cut.normal = scaled(cut.normal, -1); cut.at *= -1; app.rebuild(); };
  const plane = () => [
    slider("cut-at", "Position", cut.at, [-1.02, 1.02], (x) => { cut.at = x; app.update(); }),
    element("div", { className: "buttons" }, element("button", { id: "cut-flip", onclick: flip }, "Other side")),
  ];
  const box = () => ["x", "y", "z"].map((name, i) => rangeSlider(`box-${name}`, name, cut.box.map((corner) => corner[i]), [-1.02, 1.02], (ends) => {
    cut.box = cut.box.map((corner, k) => corner.map((at, j) => (j === i ? ends[k] : at)));
    app.update();
  }));
  return [
    element("div", { className: "choices", role: "group", "aria-label": "Cut" }, ...choices), ...(cut.on ? (cut.shape === "box" ? box() : plane()) : []),
    ...(cut.on && note ? [toggle("Finest tets at the cut", cut.fine, (on) => { cut.fine = on; app.update(); }, { id: "cut-fine" }), element("p", { className: "facts", id: "cut-note" }, app.cutNote)] : []),
  ];
}

const BINS = 36;

/** The number of tets in each bin, and the upper end of the last. */
function histogram(mesh, which) {
  const at = which === "ratio" ? 1 : 0, top = QUALITY[which].best, bins = new Array(BINS).fill(0);
  for (let t = 0; t < mesh.tetCount; t++) bins[Math.min(BINS - 1, Math.max(0, Math.floor(mesh.quality[2 * t + at] / top * BINS)))]++;
  return bins;
}

/** Makes the controls of the quality again: the tets that the histogram counts are others. */
function buildQuality(app) {
  const place = document.getElementById("quality");
  if (place) place.replaceChildren(...qualityControls(app));
}

/** The mesh that the histogram counts. */
const countedMesh = ({ mesh, cut, state }) => (cut && state.histogram === "cut" ? cut.mesh : mesh);

function qualityControls(app) {
  const { state } = app, mesh = countedMesh(app), top = QUALITY[state.measure].best, unit = QUALITY[state.measure].unit;
  const picture = element("canvas", { width: 516, height: 168, id: "histogram", style: "width:258px;height:84px;touch-action:none;cursor:crosshair", title: "Drag to show only tets of this quality" });
  const said = element("div", { className: "facts", id: "range" });
  const bins = histogram(mesh, state.measure), most = Math.max(...bins, 1);
  const paint = () => {
    const pen = picture.getContext("2d");
    pen.clearRect(0, 0, picture.width, picture.height);
    bins.forEach((count, k) => {
      const [low, high] = [k * top / BINS, (k + 1) * top / BINS], chosen = !state.range || (high > state.range[0] && low < state.range[1]);
      // The square root lets few bad tets be seen beside many good ones.
      const tall = count ? Math.max(3, Math.sqrt(count / most) * 160) : 0;
      pen.globalAlpha = chosen ? 1 : 0.25;
      pen.fillStyle = css(rampAt((k + 0.5) / BINS));
      pen.fillRect(k * 516 / BINS + 1, 166 - tall, 516 / BINS - 2, tall);
    });
    pen.globalAlpha = 1;
    pen.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--soft");
    pen.fillRect(0, 166, 516, 2);
    said.textContent = state.range ? `${short(state.range[0], 3)}${unit} to ${short(state.range[1], 3)}${unit}; Esc shows all` : `0 to ${short(top, 4)}${unit}; heights are square roots; drag to select`;
  };
  let from = null;
  const at = (event) => Math.min(1, Math.max(0, event.offsetX / 258)) * top;
  const drag = (event) => {
    if (from === null) return;
    const to = at(event), [low, high] = [Math.min(from, to), Math.max(from, to)];
    const wide = top / BINS;
    // Inverted tets are in the first bin, rounding above the best in the last.
    state.range = [low < wide ? -Infinity : Math.floor(low / wide) * wide, high > top - wide ? Infinity : Math.ceil(high / wide) * wide];
    paint();
    app.update();
  };
  picture.addEventListener("pointerdown", (event) => { picture.setPointerCapture(event.pointerId); from = at(event); drag(event); });
  picture.addEventListener("pointermove", drag);
  picture.addEventListener("pointerup", () => { from = null; });
  paint();
  const worst = worstTets(mesh, state.measure);
  return [
    choice("measure", "Measure", state.measure, Object.entries(QUALITY).map(([key, q]) => [key, q.title.toLowerCase()]), (key) => { state.measure = key; state.range = null; app.rebuild(); }),
    ...(app.cut ? [choice("counted", "Tets", state.histogram, [["level", "of the shown level"], ["cut", "at the cut"]], (key) => { state.histogram = key; app.rebuild(); })] : []),
    picture, said, element("div", { className: "facts" }, "The worst tets:"),
    element("div", { className: "worst" }, ...worst.map(([t, value], k) => element("button", { id: `worst-${k}`, onclick: () => app.select(aboutTet(mesh, t), true) },
      element("span", {}, `Tet ${mesh.tetIds[t]}`), element("span", {}, `${short(value, 3)}${unit}`)))),
  ];
}

/** The legend at the upper right. */
function buildLegend(app) {
  const { mesh, state, legend } = app;
  legend.replaceChildren();
  const rows = [];
  if (state.color in QUALITY) {
    const bar = element("canvas", { width: 220, height: 14 }), pen = bar.getContext("2d");
    for (let x = 0; x < 220; x++) { pen.fillStyle = css(rampAt(x / 219)); pen.fillRect(x, 0, 1, 14); }
    rows.push(element("h2", {}, QUALITY[state.color].title), bar, element("div", { className: "ends" }, element("span", {}, `0${QUALITY[state.color].unit}`),
      element("span", {}, `${short(QUALITY[state.color].best, 3)}${QUALITY[state.color].unit}, regular tet`)));
  }
  if (state.shared && mesh.holders.some((h) => h > 1)) {
    rows.push(element("h2", {}, "Shared vertices"), ...HOLDERS.map((color, k) => element("div", { className: "legend-row" },
      element("span", { className: "swatch", style: `background:${css(color)};border-radius:50%` }), `in ${k + 2}${k === 3 ? " or more" : ""} parts`)));
  }
  legend.append(...rows);
  legend.hidden = rows.length === 0;
}

function showInfo(app, about) {
  app.info.hidden = !about;
  if (!about) return app.info.replaceChildren();
  app.info.replaceChildren(element("h2", {}, about.title),
    element("table", {}, ...about.rows.map(([name, value]) => element("tr", {}, element("th", {}, name), element("td", {}, value)))));
}
