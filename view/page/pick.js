// What is known of a picked vertex, edge, face or tet: a title, rows of a table, points and lines to mark.

const QUALITY = { angle: { title: "Smallest dihedral angle", unit: "°", best: 70.53 }, ratio: { title: "Mean ratio", unit: "", best: 1 } };

function labelOf(label, index, what) {
  if (!label) return `${what} index ${index}`;
  return label.names.length ? `${label.number}  ${label.names.join(", ")}` : `${what === "patch" ? "boundary" : what} ${label.number}`;
}

/** The coordinates in the mesh, with the digits that single precision has. */
function coordinates(mesh, v) {
  return [0, 1, 2].map((i) => short(mesh.points[3 * v + i] + mesh.center[i], 7)).join(", ");
}

/** From the first to the second of two measured vertices. */
const apart = ([a, b]) => sub(pointOf(b.mesh, b.v), pointOf(a.mesh, a.v));

const lengthBetween = (mesh, a, b) => norm(sub(pointOf(mesh, a), pointOf(mesh, b)));

/** The parts that have a vertex. */
function holdersOf(mesh, v) {
  const parts = [];
  for (let w = 0; w < mesh.same.length; w++) if (mesh.same[w] === mesh.same[v]) parts.push(mesh.vertexPart[w]);
  return parts.map((part) => part + 1).join(", ");
}

/** The boundaries and bodies of the faces and tets that have all these vertices, each once. */
function placeRows(mesh, vertices) {
  const wanted = vertices.map((v) => mesh.same[v]), patches = new Set(), bodies = new Set();
  for (let t = 0; t < mesh.tetCount; t++) {
    // The places of the vertices among the corners of the tet, as bits.
    let places = 0, found = 0;
    for (let k = 0; k < 4; k++) {
      if (wanted.includes(mesh.same[mesh.tets[4 * t + k]])) { places |= 1 << k; found++; }
    }
    if (found < wanted.length) continue;
    bodies.add(labelOf(mesh.bodies[mesh.tetBodies[t]], mesh.tetBodies[t], "body"));
    for (let k = 0; k < 4; k++) {
      const patch = mesh.facePatches[4 * t + k];
      if (patch >= 0 && !(places >> k & 1)) patches.add(labelOf(mesh.patches[patch], patch, "patch"));
    }
  }
  const row = (one, several, names) => (names.size ? [[names.size === 1 ? one : several, [...names].join("\n")]] : []);
  return [...row("Boundary", "Boundaries", patches), ...row("Body", "Bodies", bodies)];
}

function aboutVertex(mesh, v) {
  return {
    mesh, kind: "vertex", id: mesh.ids[v], title: `Vertex ${mesh.ids[v]}`, vertices: [v], edges: [],
    rows: [["Coordinates", coordinates(mesh, v)], ...placeRows(mesh, [v]), ["Parts", holdersOf(mesh, v)]],
  };
}

function aboutEdge(mesh, a, b) {
  const [p, q] = [mesh.ids[a], mesh.ids[b]].sort((x, y) => x - y);
  return {
    mesh, kind: "edge", id: [p, q], title: `Edge ${p} – ${q}`, vertices: [], edges: [[a, b]],
    rows: [["Length", short(lengthBetween(mesh, a, b))], ["Ends", `${coordinates(mesh, a)}\n${coordinates(mesh, b)}`], ...placeRows(mesh, [a, b])],
  };
}

function qualityRows(mesh, t) {
  return [["Smallest angle", `${short(mesh.quality[2 * t], 4)}°`], ["Mean ratio", short(mesh.quality[2 * t + 1], 4)]];
}

function aboutFace(mesh, f) {
  const t = f >> 2, corners = FACES[f & 3].map((k) => mesh.tets[4 * t + k]), patch = mesh.facePatches[f];
  const [a, b, c] = corners.map((v) => pointOf(mesh, v));
  const area = 0.5 * norm(cross(sub(b, a), sub(c, a)));
  const edges = [0, 1, 2].map((k) => [corners[k], corners[(k + 1) % 3]]);
  const where = patch >= 0 ? "Boundary face" : mesh.neighbours[f] === OUTSIDE ? "Face between parts" : "Face inside";
  return {
    mesh, kind: "face", id: corners.map((v) => mesh.ids[v]), tet: mesh.tetIds[t], patch, title: where, vertices: [], edges,
    rows: [
      ...(patch >= 0 ? [["Boundary", labelOf(mesh.patches[patch], patch, "patch")]] : []),
      ["Body", labelOf(mesh.bodies[mesh.tetBodies[t]], mesh.tetBodies[t], "body")],
      partRow(mesh, t), ["Tet", String(mesh.tetIds[t])],
      ["Vertices", corners.map((v) => mesh.ids[v]).join(", ")], ["Area", short(area)],
      ["Edges", edges.map(([a, b]) => short(lengthBetween(mesh, a, b), 4)).join(", ")], ...qualityRows(mesh, t),
    ],
  };
}

/** The part of a tet, or the part that has it as a ghost too. */
function partRow(mesh, t) {
  const part = mesh.tetPart[t] + 1;
  return mesh.owners.length ? ["Part", `${mesh.owners[t] + 1}, a ghost of part ${part}`] : ["Part", `${part} of ${mesh.parts}`];
}

const TET_EDGES = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

function aboutTet(mesh, t) {
  const corners = [0, 1, 2, 3].map((k) => mesh.tets[4 * t + k]);
  const edges = TET_EDGES.map(([i, j]) => [corners[i], corners[j]]);
  const [a, b, c, d] = corners.map((v) => pointOf(mesh, v));
  const lengths = edges.map(([a, b]) => lengthBetween(mesh, a, b));
  return {
    mesh, kind: "tet", id: mesh.tetIds[t], title: `Tet ${mesh.tetIds[t]}`, vertices: [], edges, tetIndex: t,
    rows: [
      ["Body", labelOf(mesh.bodies[mesh.tetBodies[t]], mesh.tetBodies[t], "body")], partRow(mesh, t),
      ["Vertices", corners.map((v) => mesh.ids[v]).join(", ")],
      ["Volume", short(dot(cross(sub(b, a), sub(c, a)), sub(d, a)) / 6)],
      ["Edges", `${short(Math.min(...lengths), 4)} to ${short(Math.max(...lengths), 4)}`], ...qualityRows(mesh, t),
    ],
  };
}

/** What is at a pixel of the page: a vertex or an edge of the face there if it is close, or the face. */
function pick(app, x, y) {
  const ratio = ratioOf(), at = faceAt(app.drawing, app.view(), x * ratio, y * ratio);
  if (at < 0) return null;
  const { mesh, face: f } = app.triangle(at), t = f >> 2;
  const corners = FACES[f & 3].map((k) => mesh.tets[4 * t + k]);
  const screen = corners.map((v) => app.toScreen(add(pointOf(mesh, v), exploded(mesh, app.state, mesh.tetPart[t]))));
  const size = Math.max(...[0, 1, 2].map((k) => Math.hypot(screen[k][0] - screen[(k + 1) % 3][0], screen[k][1] - screen[(k + 1) % 3][1])));
  const nearVertex = Math.min(9, 0.22 * size), nearEdge = Math.min(5, 0.08 * size);
  const distances = screen.map(([u, v]) => Math.hypot(u - x, v - y));
  const closest = distances.indexOf(Math.min(...distances));
  if (distances[closest] <= nearVertex) return aboutVertex(mesh, corners[closest]);
  for (let k = 0; k < 3; k++) {
    const [[ax, ay], [bx, by]] = [screen[k], screen[(k + 1) % 3]];
    const length = Math.hypot(bx - ax, by - ay) || 1;
    if (Math.abs((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / length <= nearEdge) return aboutEdge(mesh, corners[k], corners[(k + 1) % 3]);
  }
  return aboutFace(mesh, f);
}

/** The corner of the face at a pixel that is closest to it, for measuring. */
function nearestVertex(app, x, y) {
  const ratio = ratioOf(), at = faceAt(app.drawing, app.view(), x * ratio, y * ratio);
  if (at < 0) return null;
  const { mesh, face: f } = app.triangle(at), move = exploded(mesh, app.state, mesh.tetPart[f >> 2]);
  const distance = (v) => { const [u, w] = app.toScreen(add(pointOf(mesh, v), move)); return Math.hypot(u - x, w - y); };
  return { mesh, v: FACES[f & 3].map((k) => mesh.tets[4 * (f >> 2) + k]).sort((a, b) => distance(a) - distance(b))[0] };
}

/** Finds `t12`, `v34`, or the number or name of a boundary or body. */
function search(mesh, text) {
  const wanted = text.trim(), match = /^([tv])\s*(\d+)$/i.exec(wanted);
  if (match) {
    const id = Number(match[2]);
    if (match[1].toLowerCase() === "v") {
      const v = mesh.vertexOfId.get(id);
      return v === undefined ? null : aboutVertex(mesh, v);
    }
    const t = mesh.tetIds.indexOf(id);
    return t < 0 ? null : aboutTet(mesh, t);
  }
  const lower = wanted.toLowerCase();
  const fits = (label) => String(label.number) === lower || label.names.some((name) => name.toLowerCase().includes(lower));
  const patch = wanted ? mesh.patches.findIndex(fits) : -1;
  if (patch < 0) return null;
  const f = mesh.facePatches.indexOf(patch);
  return f < 0 ? null : aboutFace(mesh, f);
}

/** The ten worst tets. */
function worstTets(mesh, which) {
  const at = which === "ratio" ? 1 : 0, worst = [];
  for (let t = 0; t < mesh.tetCount; t++) {
    const value = mesh.quality[2 * t + at];
    if (worst.length < 10 || value < worst[9][1]) {
      worst.push([t, value]);
      worst.sort((a, b) => a[1] - b[1]);
      worst.length = Math.min(worst.length, 10);
    }
  }
  return worst;
}
