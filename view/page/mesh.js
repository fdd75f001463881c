// The mesh: decoding of the message, and what is derived from it once.

const KINDS = { f32: Float32Array, f64: Float64Array, u32: Uint32Array, i32: Int32Array, i16: Int16Array, u16: Uint16Array };
const MOST_U16 = 65535;
const OUTSIDE = -1, UNKNOWN = -2;
// The corners of the face opposite each corner of a tet; normals point outwards.
const FACES = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/** Reads a message: its head, arrays, and the part of each tet and vertex. */
function decode(buffer) {
  if (buffer.byteLength < 4) throw new Error("the message with the mesh is empty");
  const length = new DataView(buffer).getUint32(0, true);
  const mesh = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const counts = { tets: mesh.tets, vertices: mesh.vertices };
  mesh.parts = counts.tets.length;
  for (const { name, type, offset, count } of mesh.arrays) {
    const Kind = KINDS[type];
    const wide = { points: 3, tets: 4, neighbours: 4, patches: 4, quality: 2, nodes: 6 }[name] || 1;
    const first = 4 + length + offset;
    // Counts are of the numbers that the writer pushed, one each.
    mesh[name === "patches" ? "facePatches" : name === "bodies" ? "tetBodies" : name] = new Kind(buffer, first, count);
    if (count % wide) throw new Error(`the message with the mesh is damaged: ${name}`);
  }
  mesh.tetCount = mesh.tets.length / 4;
  mesh.firstTet = firsts(counts.tets);
  mesh.firstVertex = firsts(counts.vertices);
  mesh.tetPart = partOf(counts.tets, mesh.tetCount);
  mesh.vertexPart = partOf(counts.vertices, mesh.ids.length);
  // From indices in a part to indices in the arrays.
  for (let t = 0; t < mesh.tetCount; t++) {
    const p = mesh.tetPart[t];
    for (let k = 4 * t; k < 4 * t + 4; k++) {
      mesh.tets[k] += mesh.firstVertex[p];
      if (mesh.neighbours[k] >= 0) mesh.neighbours[k] += mesh.firstTet[p];
    }
    for (let k = 6 * t; mesh.nodes.length && k < 6 * t + 6; k++) mesh.nodes[k] += mesh.firstVertex[p];
  }
  return derive(mesh);
}

function firsts(counts) {
  let sum = 0;
  return counts.map((count) => (sum += count) - count);
}

function partOf(counts, total) {
  const parts = counts.length > MOST_U16 ? new Uint32Array(total) : new Uint16Array(total);
  let at = 0;
  counts.forEach((count, part) => parts.fill(part, at, at += count));
  return parts;
}

/** Centres of tets and parts, one index for all copies of a vertex, holders, curves and corners. */
function derive(mesh) {
  const { points, tets, ids } = mesh;
  const centers = mesh.centers = new Float32Array(3 * mesh.tetCount);
  const middle = mesh.partCenters = Array.from({ length: mesh.parts }, () => [0, 0, 0, 0]);
  for (let t = 0; t < mesh.tetCount; t++) {
    const sum = middle[mesh.tetPart[t]];
    for (let i = 0; i < 3; i++) {
      let x = 0;
      for (let k = 0; k < 4; k++) x += points[3 * tets[4 * t + k] + i];
      centers[3 * t + i] = x / 4;
      sum[i] += x / 4;
    }
    sum[3]++;
  }
  mesh.partCenters = middle.map((m) => [0, 1, 2].map((i) => m[i] / (m[3] || 1)));
  mesh.radius = 0.5 * norm(sub(mesh.high, mesh.low)) || 1;
  const first = new Map();
  mesh.same = new Uint32Array(ids.length);
  for (let v = 0; v < ids.length; v++) {
    if (!first.has(ids[v])) first.set(ids[v], v);
    mesh.same[v] = first.get(ids[v]);
  }
  mesh.holders = new Uint8Array(ids.length);
  for (let v = 0; v < ids.length; v++) mesh.holders[mesh.same[v]] = Math.min(255, mesh.holders[mesh.same[v]] + 1);
  mesh.vertexOfId = first;
  findCurves(mesh);
  return mesh;
}

const pointOf = (mesh, v) => [mesh.points[3 * v], mesh.points[3 * v + 1], mesh.points[3 * v + 2]];

/** Curves are the edges between faces of different patches; corners, where not two of them meet. */
function findCurves(mesh) {
  const { same, tets, facePatches } = mesh, count = mesh.ids.length;
  const edges = new Map();
  mesh.patchFaces = new Uint32Array(mesh.patches.length);
  for (let f = 0; f < facePatches.length; f++) {
    const patch = facePatches[f];
    if (patch < 0) continue;
    const t = f >> 2, face = FACES[f & 3].map((k) => tets[4 * t + k]);
    if (mesh.neighbours[f] < f >> 2) mesh.patchFaces[patch]++;
    for (let k = 0; k < 3; k++) {
      const [a, b] = [face[k], face[(k + 1) % 3]];
      const key = Math.min(same[a], same[b]) * count + Math.max(same[a], same[b]);
      const edge = edges.get(key);
      if (!edge) edges.set(key, { a, b, patch, sharp: false, node: mesh.nodes.length ? nodeOf(mesh, t, FACES[f & 3][k], FACES[f & 3][(k + 1) % 3]) : undefined });
      else if (edge.patch !== patch) edge.sharp = true;
    }
  }
  mesh.curves = [];
  const degree = new Map();
  for (const { a, b, node, sharp } of edges.values()) {
    if (!sharp) continue;
    mesh.curves.push([a, b, node]);
    for (const v of [a, b]) degree.set(same[v], (degree.get(same[v]) || 0) + 1);
  }
  mesh.corners = [...degree].filter(([, d]) => d !== 2).map(([v]) => v);
}
