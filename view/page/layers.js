// Layers over the mesh that is shown, which the server makes: the finest tets near the cut, and the ghosts of a part.

/** Adapts a message to the mesh that it is shown with: the same centre, parts moved alike. */
function adopted(layer, mesh) {
  const shift = sub(layer.center, mesh.center);
  for (let k = 0; k < layer.points.length; k++) layer.points[k] += shift[k % 3];
  layer.center = mesh.center;
  layer.partCenters = mesh.partCenters;
  return layer;
}

/** Whether the server has finer tets for the cut than the mesh that is shown. */
function canCutFiner(app) {
  const { mesh, state, index } = app;
  return Boolean(index && index.cuts && state.cut.on && state.cut.fine && (mesh.hollow || (mesh.pieces && mesh.pieces[1] < mesh.pieces[0])));
}

/** The window around the visible piece of the cut, relative to the centre: its lowest and highest corner; null if none is visible. */
function visibleWindow(app, margin) {
  const { mesh, state, canvas } = app, [right, up, toward] = state.turn, half = scaled(halfOf(mesh), 1.01);
  const around = [0, 1, 2].flatMap((i) => [1, -1].map((sign) => (p) => sign * p[i] - half[i]));
  const high = state.zoom * margin, wide = high * canvas.clientWidth / Math.max(1, canvas.clientHeight);
  const seen = [[right, wide], [up, high]].flatMap(([along, reach]) => [1, -1].map((sign) => (p) => sign * dot(along, sub(p, state.focus)) - reach));
  // Of moved parts any piece can be visible.
  const limits = state.explode ? around : [...around, ...seen];
  const corners = polygonsOf(mesh, state.cut, toward).flatMap((polygon) => limits.reduce(cutOff, polygon));
  if (corners.length === 0) return null;
  // The piece of a level plane has no thickness, so rounding needs some.
  const thick = 1e-3 * mesh.radius * (margin - 1);
  return [[Math.min, -thick], [Math.max, thick]].map(([pick, more]) => [0, 1, 2].map((i) => pick(...corners.map((p) => p[i])) + more));
}

const sizeOf = ([low, high]) => norm(sub(high, low));
const covers = ([a, b], [low, high]) => low.every((x, i) => a[i] <= x && high[i] <= b[i]);

/** Whether the layer is of the present cut, so that it can be drawn. */
const isCurrent = (app) => Boolean(app.cut && canCutFiner(app) && app.cut.key === cutKey(app));

/** What cuts, as numbers with the centre of the mesh. */
function cutKey({ mesh, state: { cut } }) {
  return [cut.shape, ...(cut.shape === "box" ? cut.box.flat() : [...cut.normal, cut.at]), mesh.center].join();
}

/** What was asked for, roughly: what was refused once is not asked for again. */
const askedKey = (app, seen) => `${cutKey(app)} ${sizeOf(seen).toPrecision(2)}`;

/** Whether the tets at the cut that are here cover the visible piece and are fine enough for it. */
function isEnough(app) {
  const { cut, mesh } = app, seen = visibleWindow(app, 1);
  if (!seen || app.refused === askedKey(app, seen)) return true;
  if (!cut || cut.key !== cutKey(app) || !covers(cut.window, seen)) return false;
  return (cut.pieces >= finestOf(mesh) && !cut.mesh.window) || sizeOf(seen) > 0.6 * cut.wanted;
}

/** Asks for the tets at the cut if those that are here do not suffice. */
function askForCut(app) {
  if (!canCutFiner(app)) {
    if (app.cut || app.cutNote) setCut(app, null);
  } else if (!app.fetching && !isEnough(app)) {
    // One at a time, and none while the slider moves.
    clearTimeout(app.asking);
    app.asking = setTimeout(() => fetchCut(app).catch(failed), 150);
  }
}

/** Takes the tets at the cut, or none, which the histogram can be of. */
function setCut(app, cut) {
  app.cut = cut;
  sayOfCut(app);
  buildQuality(app);
}

/** Subdivisions of coarse edges of the mesh itself. */
const finestOf = (mesh) => (mesh.pieces ? mesh.pieces[0] : 1);

/** The query for the tets at the cut in a window. */
function queryOf({ mesh, state: { cut } }, window) {
  const placed = (corners) => corners.flatMap((corner) => add(corner, mesh.center).map((x) => short(x, 12))).join(",");
  if (cut.shape === "box") return `cut/${finestOf(mesh)}/${placed(boxOf(mesh, cut))}/${placed(window)}`;
  const { normal, offset } = planeOf(mesh, cut);
  const plane = [...normal, offset + dot(normal, mesh.center)].map((x) => short(x, 14)).join(",");
  return `cut/${finestOf(mesh)}/${plane}/${placed(window)}`;
}

async function fetchCut(app) {
  const { mesh } = app, seen = canCutFiner(app) && visibleWindow(app, 1);
  if (!seen) return;
  const key = cutKey(app), window = visibleWindow(app, 1.25);
  app.fetching = true;
  sayOfCut(app, "The finest tets at the cut are on their way …");
  try {
    const answer = await fetch(`mesh/${queryOf(app, window)}`);
    if (answer.ok) {
      const layer = adopted(decode(await answer.arrayBuffer()), mesh);
      // Another level may be shown by now.
      if (app.mesh === mesh) setCut(app, { key, window, wanted: sizeOf(seen), pieces: layer.pieces ? layer.pieces[1] : 1, mesh: layer });
    } else {
      app.refused = askedKey(app, seen);
      sayOfCut(app, `Coarser tets are shown at the cut: ${await answer.text()}`);
    }
  } finally {
    app.fetching = false;
  }
  app.update();
}

/** Loads the ghosts of a part, or none for -1, and hides the other parts, which are in the same place. */
async function showGhosts(app, part) {
  const { mesh, state } = app;
  if (part !== state.ghosts) state.partsOff = new Set(part < 0 ? [] : mesh.partCenters.map((_, k) => k).filter((k) => k !== part));
  state.ghosts = part;
  app.ghosts = null;
  if (part >= 0) {
    const answer = await fetch(`mesh/ghosts/${mesh.pieces ? mesh.pieces[1] : 1}/${part}`);
    if (!answer.ok) throw new Error(await answer.text());
    const layer = adopted(decode(await answer.arrayBuffer()), mesh);
    // Ghosts move with the part, whatever part has them.
    layer.tetPart.fill(part);
    layer.vertexPart.fill(part);
    if (app.mesh === mesh && state.ghosts === part) app.ghosts = layer;
  }
  app.rebuild();
}

/** The note about the cut. */
function sayOfCut(app, text = app.cut ? aboutCut(app) : "") {
  app.cutNote = text;
  const note = document.getElementById("cut-note");
  if (note) note.textContent = text;
}

function aboutCut({ cut, mesh }) {
  const finest = finestOf(mesh), count = grouped(cut.mesh.tetCount);
  if (cut.mesh.window) return `At the cut are ${count} tets in the middle of the view: zoom in for the others.`;
  if (cut.pieces < finest) return `At the cut are ${count} tets of the level with coarse edges in ${cut.pieces}, not ${finest}: zoom in for finer ones.`;
  return `At the cut are ${count} tets of the mesh itself.`;
}
