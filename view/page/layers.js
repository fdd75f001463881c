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
  const { mesh, state, canvas } = app, { normal, offset } = planeOf(mesh, state.cut), [right, up, toward] = state.turn;
  const half = scaled(sub(mesh.high, mesh.low), 0.5 * 1.01), all = [scaled(half, -1), half];
  const across = dot(normal, toward);
  // Seen from the side, or with moved parts, any piece can be visible.
  if (Math.abs(across) < 0.15 || state.explode) return all;
  const high = state.zoom * margin, wide = high * canvas.clientWidth / Math.max(1, canvas.clientHeight);
  const corners = [[1, 1], [1, -1], [-1, 1], [-1, -1]].map(([x, y]) => {
    const p = add(state.focus, add(scaled(right, x * wide), scaled(up, y * high)));
    return add(p, scaled(toward, (offset - dot(normal, p)) / across));
  });
  // The piece of a level plane has no thickness, so rounding needs some.
  const thick = 1e-3 * mesh.radius * (margin - 1), inside = (x, i) => Math.max(all[0][i], Math.min(all[1][i], x));
  return [[Math.min, -thick], [Math.max, thick]].map(([pick, more]) => [0, 1, 2].map((i) => inside(pick(...corners.map((p) => p[i])) + more, i)));
}

const sizeOf = ([low, high]) => norm(sub(high, low));
const covers = ([a, b], [low, high]) => low.every((x, i) => a[i] <= x && high[i] <= b[i]);

/** Whether the layer is of the plane of the cut, so that it can be drawn. */
const isCurrent = (app) => Boolean(app.cut && canCutFiner(app) && app.cut.plane === planeKey(app));
const planeKey = (app) => [...app.state.cut.normal, app.state.cut.at, app.mesh.center].join();

/** What was asked for, roughly: what was refused once is not asked for again. */
const askedKey = (app, box) => `${planeKey(app)} ${sizeOf(box).toPrecision(2)}`;

/** Whether the tets near the cut that are here cover the visible piece and are fine enough for it. */
function isEnough(app) {
  const { cut, mesh } = app, box = visibleBox(app, 1);
  if (app.refused === askedKey(app, box)) return true;
  if (!cut || cut.plane !== planeKey(app) || !covers(cut.box, box)) return false;
  return cut.pieces >= finestOf(mesh) || sizeOf(box) > 0.6 * cut.wanted;
}

/** Asks for the tets near the cut if those that are here do not suffice. */
function askForCut(app) {
  if (!canCutFiner(app)) {
    app.cut = null;
    sayOfCut(app);
  } else if (!app.fetching && !isEnough(app)) {
    // One at a time, and none while the slider moves.
    clearTimeout(app.asking);
    app.asking = setTimeout(() => fetchCut(app).catch(failed), 150);
  }
}

/** Subdivisions of coarse edges of the mesh itself. */
const finestOf = (mesh) => (mesh.pieces ? mesh.pieces[0] : 1);

async function fetchCut(app) {
  if (!canCutFiner(app)) return;
  const { mesh, state } = app, plane = planeKey(app), seen = visibleBox(app, 1), box = visibleBox(app, 1.25);
  const { normal, offset } = planeOf(mesh, state.cut);
  const placed = box.map((corner) => add(corner, mesh.center).map((x) => short(x, 12)).join(","));
  const moved = short(offset + dot(normal, mesh.center), 14);
  app.fetching = true;
  sayOfCut(app, "The finest tets at the cut are on their way …");
  try {
    const answer = await fetch(`mesh/cut/${finestOf(mesh)}/${normal.map((x) => short(x, 14)).join(",")},${moved}/${placed[0]},${placed[1]}`);
    if (answer.ok) {
      const layer = adopted(decode(await answer.arrayBuffer()), mesh);
      // Another level may be shown by now.
      if (app.mesh === mesh) app.cut = { plane, box, wanted: sizeOf(seen), pieces: layer.pieces ? layer.pieces[1] : 1, mesh: layer };
      sayOfCut(app);
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
function sayOfCut(app, text) {
  const { cut, mesh } = app;
  if (text === undefined && cut) {
    const finest = finestOf(mesh), count = grouped(cut.mesh.tetCount);
    text = cut.pieces < finest ? `At the cut are ${count} tets of the level with coarse edges in ${cut.pieces}, not ${finest}: zoom in for finer ones.` : `At the cut are ${count} tets of the mesh itself.`;
  }
  app.cutNote = text || "";
  const note = document.getElementById("cut-note");
  if (note) note.textContent = app.cutNote;
}
