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
  return Boolean(index && index.cuts && state.cut.on && state.cut.fine && !state.range && (mesh.hollow || (mesh.pieces && mesh.pieces[1] < mesh.pieces[0])));
}

/** The box around the visible piece of the cut, relative to the centre: its lowest and highest corner. */
function visibleBox(app, margin) {
  const { mesh, state, canvas } = app, { normal, offset } = planeOf(mesh, state.cut);
  const half = scaled(sub(mesh.high, mesh.low), 0.5 * 1.01), all = [scaled(half, -1), half];
  const across = dot(normal, state.turn[2]);
  // Seen from the side, or with moved parts, any piece can be visible.
  if (Math.abs(across) < 0.15 || state.explode) return all;
  const middle = add(state.focus, scaled(state.turn[2], (offset - dot(normal, state.focus)) / across));
  const wide = state.zoom * Math.hypot(1, canvas.clientWidth / Math.max(1, canvas.clientHeight)) / Math.abs(across) * margin;
  // A disk in the plane.
  const reach = normal.map((n) => wide * Math.sqrt(Math.max(0, 1 - n * n)));
  return [-1, 1].map((side) => middle.map((x, i) => Math.max(all[0][i], Math.min(all[1][i], x + side * reach[i]))));
}

const sizeOf = ([low, high]) => norm(sub(high, low));
const covers = ([a, b], [low, high]) => low.every((x, i) => a[i] <= x && high[i] <= b[i]);

/** Whether the layer is of the plane of the cut, so that it can be drawn. */
const isCurrent = (app) => Boolean(app.cut && canCutFiner(app) && app.cut.plane === planeKey(app));
const planeKey = (app) => [...app.state.cut.normal, app.state.cut.at, app.mesh.center].join();

/** Asks for the tets near the cut if those that are here are of another plane, too few or too coarse. */
function askForCut(app) {
  if (!canCutFiner(app)) {
    app.cut = null;
    return sayOfCut(app);
  }
  const { cut, mesh } = app, box = visibleBox(app, 1);
  const finest = mesh.pieces ? mesh.pieces[0] : 1;
  const plane = planeKey(app);
  const tried = app.refused === plane + sizeOf(box).toPrecision(2);
  if (tried || (cut && cut.plane === plane && covers(cut.box, box) && (cut.pieces >= finest || sizeOf(box) > 0.6 * cut.wanted))) return undefined;
  clearTimeout(app.asking);
  // One at a time: the next one is asked when this one is here.
  if (!app.fetching) app.asking = setTimeout(() => fetchCut(app).catch(failed), 150);
  return undefined;
}

async function fetchCut(app) {
  if (!canCutFiner(app)) return;
  const { mesh, state } = app, plane = planeKey(app), seen = visibleBox(app, 1), box = visibleBox(app, 1.25);
  const { normal, offset } = planeOf(mesh, state.cut), pieces = mesh.pieces ? mesh.pieces[0] : 1;
  const placed = box.map((corner) => add(corner, mesh.center).map((x) => short(x, 12)).join(","));
  const moved = short(offset + dot(normal, mesh.center), 14);
  app.fetching = true;
  sayOfCut(app, "The finest tets at the cut are on their way …");
  try {
    const answer = await fetch(`mesh/cut/${pieces}/${normal.map((x) => short(x, 14)).join(",")},${moved}/${placed[0]},${placed[1]}`);
    if (answer.ok) {
      const layer = adopted(decode(await answer.arrayBuffer()), mesh);
      // Another level may be shown by now.
      if (app.mesh === mesh) app.cut = { plane, box, wanted: sizeOf(seen), pieces: layer.pieces ? layer.pieces[1] : 1, mesh: layer };
      sayOfCut(app);
    } else {
      app.refused = plane + sizeOf(seen).toPrecision(2);
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
function sayOfCut(app, text) {
  const { cut, mesh } = app;
  if (text === undefined && cut) {
    const finest = mesh.pieces ? mesh.pieces[0] : 1, count = grouped(cut.mesh.tetCount);
    text = cut.pieces < finest ? `At the cut are ${count} tets of the level with coarse edges in ${cut.pieces}, not ${finest}: zoom in for finer ones.` : `At the cut are ${count} tets of the mesh itself.`;
  }
  app.cutNote = text || "";
  const note = document.getElementById("cut-note");
  if (note) note.textContent = app.cutNote;
}
