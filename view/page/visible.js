// What is visible in a state: faces, edges of curves, vertices.

/** Whether each tet is shown: its part, body, quality, and whether its centre is behind all planes, if there are any. */
function shownTets(mesh, state, planes) {
  const shown = new Uint8Array(mesh.tetCount);
  const which = state.measure === "ratio" ? 1 : 0, { range } = state;
  for (let t = 0; t < shown.length; t++) {
    if (state.partsOff.has(mesh.tetPart[t]) || state.bodiesOff.has(mesh.tetBodies[t])) continue;
    if (planes && !planes.every((plane) => heightAt(mesh.centers, 3 * t, plane) < 0)) continue;
    if (range && !(mesh.quality[2 * t + which] >= range[0] && mesh.quality[2 * t + which] <= range[1])) continue;
    shown[t] = 1;
  }
  return shown;
}

/** How far a part is moved from the middle. */
const exploded = (mesh, state, part) => scaled(mesh.partCenters[part], state.explode);

const INSIDE = [214, 219, 224];

/** The colour of a face of a tet; ghosts have a light colour of the part that they belong to. */
function faceColor(mesh, state, t, patch) {
  if (mesh.owners.length && !(state.color in QUALITY)) return colorOf(mesh.owners[t]).map((c) => Math.round(0.6 * c + 0.4 * 255));
  switch (state.color) {
    case "part": return colorOf(mesh.tetPart[t]);
    case "body": return colorOf(mesh.tetBodies[t]);
    case "angle": return rampAt(mesh.quality[2 * t] / QUALITY.angle.best);
    case "ratio": return rampAt(mesh.quality[2 * t + 1]);
    case "periodic": {
      const pair = mesh.periodic.findIndex((pair) => pair.includes(patch));
      return pair < 0 ? INSIDE : colorOf(pair);
    }
    default: {
      if (patch >= 0) return colorOf(patch);
      const body = colorOf(mesh.tetBodies[t]);
      return INSIDE.map((c, i) => Math.round(0.72 * c + 0.28 * body[i]));
    }
  }
}

const CORNERS = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

/** How often an edge of a curved face is divided for drawing. */
const DIVIDED = 4;
// The small triangles of a curved face, as weights of its corners.
const SMALL = (() => {
  const at = (i, j) => [1 - (i + j) / DIVIDED, i / DIVIDED, j / DIVIDED], all = [];
  for (let j = 0; j < DIVIDED; j++) {
    for (let i = 0; i + j < DIVIDED; i++) {
      all.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
      if (i + j + 1 < DIVIDED) all.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
    }
  }
  return all;
})();

const mixed = (points, weights) => [0, 1, 2].map((i) => points.reduce((sum, p, k) => sum + weights[k] * p[i], 0));

/** The place on a face of second order: corners, then the nodes on the edges 01, 12, 20. */
function curvedPlace(points, [a, b, c]) {
  return mixed(points, [a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * c * a]);
}

/** The node on the edge between two corners of a tet. */
const nodeOf = (mesh, t, i, j) => mesh.nodes[6 * t + TET_EDGES.findIndex((edge) => edge.includes(i) && edge.includes(j))];

/** The corners of a face and, if an edge of it is curved, the nodes on its edges. */
function placesOf(mesh, f) {
  const t = f >> 2, face = FACES[f & 3], corners = face.map((k) => pointOf(mesh, mesh.tets[4 * t + k]));
  if (!mesh.nodes.length) return corners;
  const nodes = [[0, 1], [1, 2], [2, 0]].map(([i, j]) => pointOf(mesh, nodeOf(mesh, t, face[i], face[j])));
  const bends = nodes.some((node, k) => isBent(corners[k], node, corners[(k + 1) % 3]));
  return bends ? [...corners, ...nodes] : corners;
}

/** Whether a node is visibly off the middle of its edge. */
const isBent = (a, node, b) => norm(sub(node, scaled(add(a, b), 0.5))) > 0.002 * norm(sub(b, a));

/** The triangles of a face as weights of its corners, with their places; only their pieces behind all planes, if there are any. */
function trianglesOf(places, planes) {
  const found = [], placed = (weights) => (places.length === 3 ? mixed(places, weights) : curvedPlace(places, weights));
  for (const triangle of places.length === 3 ? [CORNERS] : SMALL) {
    const corners = triangle.map(placed);
    const kept = (planes || []).reduce((piece, plane) => cutOff(piece, (weights) => heightOver(plane, mixed(corners, weights))), CORNERS);
    for (let k = 2; k < kept.length; k++) {
      found.push([kept[0], kept[k - 1], kept[k]].map((weights) => ({ weights: mixed(triangle, weights), place: mixed(corners, weights) })));
    }
  }
  return found;
}

/** Where the corners of a face are: -1 if all are behind all planes, 1 if all are in front of one, otherwise 0. */
function sideOf(mesh, f, planes) {
  let side = -1;
  for (const plane of planes) {
    let front = 0;
    for (const corner of FACES[f & 3]) front += heightAt(mesh.points, 3 * mesh.tets[(f & ~3) + corner], plane) > 0;
    if (front === 3) return 1;
    if (front > 0) side = 0;
  }
  return side;
}

/** Whether a face without visible tets on both sides is to be drawn. */
function isVisible(state, patch, other, volume) {
  if (patch >= 0) return state.boundary && !state.patchesOff.has(patch);
  return other === OUTSIDE ? state.interfaces : volume;
}

/**
 * The faces to be drawn; those of a `layer` also if their other tet is not here. A mesh that is cut off has faces inside only
 * around the tets of a selected quality.
 */
function facesOf(mesh, state, shown, clip, layer) {
  const faces = [], volume = state.volume && (!clip || state.range);
  for (let f = 0; f < mesh.neighbours.length; f++) {
    if (!shown[f >> 2]) continue;
    const other = mesh.neighbours[f];
    if ((other === UNKNOWN && !layer) || (other >= 0 && shown[other])) continue;
    if (isVisible(state, mesh.facePatches[f], other, volume)) faces.push(f);
  }
  return faces;
}

/**
 * The visible faces as triangles: a buffer of x, y, z, colour and weights for each corner, and the face of each triangle.
 * `clip` has planes: then faces are cut off there.
 */
function visibleFaces(mesh, state, shown, { clip = null, layer = false } = {}) {
  // Most faces are whole and flat: they have no list of pieces, which would take most of the time.
  const faces = [], pieces = [];
  for (const f of facesOf(mesh, state, shown, clip, layer)) {
    const side = clip ? sideOf(mesh, f, clip) : -1;
    if (side > 0) continue;
    const places = side === 0 || mesh.nodes.length ? placesOf(mesh, f) : null;
    if (!places || (side < 0 && places.length === 3)) {
      faces.push(f);
      pieces.push(null);
      continue;
    }
    for (const piece of trianglesOf(places, side < 0 ? null : clip)) {
      faces.push(f);
      pieces.push(piece);
    }
  }
  const buffer = new ArrayBuffer(60 * faces.length), numbers = new Float32Array(buffer), bytes = new Uint8Array(buffer);
  const moves = mesh.partCenters.map((_, part) => exploded(mesh, state, part));
  for (let at = 0; at < faces.length; at++) {
    const f = faces[at], t = f >> 2, color = faceColor(mesh, state, t, mesh.facePatches[f]), move = moves[mesh.tetPart[t]];
    for (let k = 0; k < 3; k++) {
      const to = 5 * (3 * at + k), byte = 4 * (to + 3);
      if (pieces[at]) {
        const { weights, place } = pieces[at][k];
        for (let i = 0; i < 3; i++) { numbers[to + i] = place[i] + move[i]; bytes[byte + 4 + i] = Math.round(255 * weights[i]); }
      } else {
        const v = 3 * mesh.tets[4 * t + FACES[f & 3][k]];
        for (let i = 0; i < 3; i++) numbers[to + i] = mesh.points[v + i] + move[i];
        bytes[byte + 4 + k] = 255;
      }
      for (let i = 0; i < 3; i++) bytes[byte + i] = color[i];
      bytes[byte + 3] = 255;
    }
  }
  return { faces: Uint32Array.from(faces), buffer };
}

/** Points with colours and sizes: vertices of visible faces, shared ones larger, and corners. */
function visiblePoints(mesh, state, faces) {
  const list = [];
  const push = (v, color, size) => {
    const p = add(pointOf(mesh, v), exploded(mesh, state, mesh.vertexPart[v]));
    list.push([...p, size, color]);
  };
  if (state.vertices || state.shared) {
    const seen = new Uint8Array(mesh.ids.length);
    for (const f of faces) {
      for (const k of FACES[f & 3]) {
        const v = mesh.tets[4 * (f >> 2) + k], holders = mesh.holders[mesh.same[v]];
        if (seen[v]) continue;
        seen[v] = 1;
        if (holders > 1 && state.shared) push(v, HOLDERS[Math.min(holders, 5) - 2], 9);
        else if (state.vertices) push(v, [40, 52, 64], 4.5);
      }
    }
  }
  if (state.corners) mesh.corners.filter((v) => isBehind(mesh, state, [v])).forEach((v) => push(v, [200, 30, 40], 10));
  const buffer = new ArrayBuffer(20 * list.length), numbers = new Float32Array(buffer), colors = new Uint8Array(buffer);
  list.forEach(([x, y, z, size, color], at) => {
    numbers.set([x, y, z, size], 5 * at);
    colors.set([...color, 255], 20 * at + 16);
  });
  return { count: list.length, buffer };
}

// The colours of vertices with 2, 3, 4, and 5 or more holders.
const HOLDERS = [[0, 114, 178], [230, 159, 0], [204, 121, 167], [213, 94, 0]];

/** Whether vertices are behind the cut, and in a part that is shown. */
function isBehind(mesh, state, vertices) {
  if (state.partsOff.has(mesh.vertexPart[vertices[0]])) return false;
  const planes = state.cut.on ? planesOf(mesh, state.cut) : [], slack = 1e-6 * mesh.radius;
  return planes.every((plane) => vertices.every((v) => heightAt(mesh.points, 3 * v, plane) <= slack));
}

/** The ends of visible lines of curves, x, y, z each: edges behind the cut, or cut off at `clip`. */
function visibleCurves(mesh, state, clip) {
  const ends = [];
  if (!state.curves) return new Float32Array();
  mesh.curves.forEach(([a, b, node]) => {
    const part = mesh.vertexPart[a];
    if (clip ? state.partsOff.has(part) : !isBehind(mesh, state, [a, b])) return;
    const move = exploded(mesh, state, part), [p, q] = [pointOf(mesh, a), pointOf(mesh, b)];
    const bent = node !== undefined && isBent(p, pointOf(mesh, node), q), steps = bent ? DIVIDED : 1;
    // On an edge of a face of second order the third weight is zero.
    const at = (s) => (bent ? curvedPlace([p, q, p, pointOf(mesh, node), p, p], [1 - s, s, 0]) : mixed([p, q], [1 - s, s]));
    for (let k = 0; k < steps; k++) {
      const piece = behind(at(k / steps), at((k + 1) / steps), clip);
      if (piece) for (const end of piece) ends.push(...add(end, move));
    }
  });
  return new Float32Array(ends);
}

/** The piece of a line behind all planes, if there are any. */
function behind(p, q, planes) {
  let ends = [p, q];
  for (const plane of planes || []) {
    const [a, b] = ends.map((x) => heightOver(plane, x));
    if (a > 0 && b > 0) return null;
    const at = mixed(ends, [b / (b - a), a / (a - b)]);
    if (a > 0) ends = [at, ends[1]];
    else if (b > 0) ends = [ends[0], at];
  }
  return ends;
}
