// What is visible in a state: faces, edges of curves, vertices.

/** The number that a plane's offset takes from -1 to 1, across the whole mesh. */
function planeOf(mesh, cut) {
  const normal = unit(cut.normal);
  const half = scaled(sub(mesh.high, mesh.low), 0.5);
  const reach = Math.abs(normal[0]) * half[0] + Math.abs(normal[1]) * half[1] + Math.abs(normal[2]) * half[2];
  return { normal, offset: cut.at * reach };
}

/** Whether each tet is shown: its part, body, quality, and its side of the cut. */
function shownTets(mesh, state) {
  const shown = new Uint8Array(mesh.tetCount);
  const plane = state.cut.on ? planeOf(mesh, state.cut) : null;
  const which = state.measure === "ratio" ? 1 : 0, { range } = state;
  for (let t = 0; t < shown.length; t++) {
    if (state.partsOff.has(mesh.tetPart[t]) || state.bodiesOff.has(mesh.tetBodies[t])) continue;
    if (plane) {
      const c = 3 * t, n = plane.normal;
      if (mesh.centers[c] * n[0] + mesh.centers[c + 1] * n[1] + mesh.centers[c + 2] * n[2] >= plane.offset) continue;
    }
    if (range && !(mesh.quality[2 * t + which] >= range[0] && mesh.quality[2 * t + which] <= range[1])) continue;
    shown[t] = 1;
  }
  return shown;
}

/** How far a part is moved from the middle. */
const exploded = (mesh, state, part) => scaled(mesh.partCenters[part], state.explode);

const INSIDE = [214, 219, 224];

/** The colour of a face of a tet. */
function faceColor(mesh, state, t, patch) {
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

/** The visible faces as triangles: a buffer of x, y, z, colour for each corner, and the face of each. */
function visibleFaces(mesh, state, shown) {
  const faces = [];
  for (let f = 0; f < mesh.neighbours.length; f++) {
    if (!shown[f >> 2]) continue;
    const other = mesh.neighbours[f], patch = mesh.facePatches[f];
    if (other === UNKNOWN || (other >= 0 && shown[other])) continue;
    if (patch >= 0 ? state.patchesOff.has(patch) || !state.boundary : other === OUTSIDE ? !state.interfaces : !state.volume) continue;
    faces.push(f);
  }
  const buffer = new ArrayBuffer(48 * faces.length), numbers = new Float32Array(buffer), colors = new Uint8Array(buffer);
  const moves = mesh.partCenters.map((_, part) => exploded(mesh, state, part));
  faces.forEach((f, at) => {
    const t = f >> 2, color = faceColor(mesh, state, t, mesh.facePatches[f]), move = moves[mesh.tetPart[t]];
    FACES[f & 3].forEach((corner, k) => {
      const v = 3 * mesh.tets[4 * t + corner], to = 4 * (3 * at + k);
      for (let i = 0; i < 3; i++) numbers[to + i] = mesh.points[v + i] + move[i];
      colors.set(color, 4 * (to + 3));
      colors[4 * (to + 3) + 3] = 255;
    });
  });
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
  if (!state.cut.on) return true;
  const plane = planeOf(mesh, state.cut);
  return vertices.every((v) => dot(pointOf(mesh, v), plane.normal) <= plane.offset + 1e-6 * mesh.radius);
}

/** The ends of visible lines of curves, x, y, z each. */
function visibleCurves(mesh, state) {
  const ends = [];
  if (!state.curves) return new Float32Array();
  for (let k = 0; k < mesh.curves.length; k += 2) {
    const [a, b] = [mesh.curves[k], mesh.curves[k + 1]];
    if (!isBehind(mesh, state, [a, b])) continue;
    for (const v of [a, b]) ends.push(...add(pointOf(mesh, v), exploded(mesh, state, mesh.vertexPart[a])));
  }
  return new Float32Array(ends);
}
