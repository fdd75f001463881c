// The cut: a plane or a box, as the planes that what is shown is behind.

const BOX_EDGES = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((from) => [1, 2, 4].filter((bit) => !(from & bit)).map((bit) => [from, from | bit]));

const halfOf = (mesh) => scaled(sub(mesh.high, mesh.low), 0.5);

/** The plane of a cut: its position goes from -1 to 1 across the whole mesh. */
function planeOf(mesh, cut) {
  const normal = unit(cut.normal), half = halfOf(mesh);
  const reach = Math.abs(normal[0]) * half[0] + Math.abs(normal[1]) * half[1] + Math.abs(normal[2]) * half[2];
  return { normal, offset: cut.at * reach };
}

/** The lowest and the highest corner of the box of a cut, whose positions go from -1 to 1 across the whole mesh. */
const boxOf = (mesh, cut) => cut.box.map((corner) => corner.map((at, i) => at * halfOf(mesh)[i]));

/** The planes of a cut: what is behind all of them is shown. */
function planesOf(mesh, cut) {
  if (cut.shape === "plane") return [planeOf(mesh, cut)];
  const [low, high] = boxOf(mesh, cut);
  return [0, 1, 2].flatMap((i) => [-1, 1].map((sign) => ({ normal: [0, 1, 2].map((k) => (k === i ? sign : 0)), offset: sign < 0 ? -low[i] : high[i] })));
}

/** How far a point is in front of a plane. */
const heightOver = ({ normal, offset }, p) => dot(p, normal) - offset;
/** The same for the point at an index of an array of coordinates. */
const heightAt = (points, at, { normal, offset }) => points[at] * normal[0] + points[at + 1] * normal[1] + points[at + 2] * normal[2] - offset;

/** The piece of a polygon where a linear function is not positive. */
function cutOff(polygon, height) {
  const heights = polygon.map(height), kept = [];
  polygon.forEach((corner, k) => {
    const next = (k + 1) % polygon.length;
    if (heights[k] <= 0) kept.push(corner);
    if (heights[k] * heights[next] < 0) {
      const s = heights[k] / (heights[k] - heights[next]);
      kept.push(add(scaled(corner, 1 - s), scaled(polygon[next], s)));
    }
  });
  return kept;
}

const cornersOf = ([low, high]) => [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [0, 1, 2].map((i) => (k >> i & 1 ? high : low)[i]));

/** The edges of the box of a cut, from and to each. */
function boxEdges(mesh, cut) {
  const corners = cornersOf(boxOf(mesh, cut));
  return new Float32Array(BOX_EDGES.flatMap((ends) => ends.flatMap((k) => corners[k])));
}

/** The faces of the box that are seen from a direction as polygons, or the plane as a large one. */
function polygonsOf(mesh, cut, toward) {
  if (cut.shape === "box") {
    const corners = cornersOf(boxOf(mesh, cut));
    return [0, 1, 2].filter((i) => toward[i] !== 0).map((i) => {
      const at = toward[i] > 0 ? 1 << i : 0, [u, v] = [1 << (i + 1) % 3, 1 << (i + 2) % 3];
      return [at, at | u, at | u | v, at | v].map((k) => corners[k]);
    });
  }
  const { normal, offset } = planeOf(mesh, cut), size = 4 * mesh.radius;
  const first = unit(cross(normal, Math.abs(normal[0]) < 0.6 ? [1, 0, 0] : [0, 1, 0])), second = cross(normal, first), middle = scaled(normal, offset);
  return [[[1, 1], [-1, 1], [-1, -1], [1, -1]].map(([x, y]) => add(middle, add(scaled(first, size * x), scaled(second, size * y))))];
}

/** Moves the plane of a cut, or all faces of its box outwards. */
function moveCut(cut, step) {
  const within = (at) => Math.min(1.02, Math.max(-1.02, at));
  if (cut.shape === "plane") cut.at = within(cut.at + step);
  else if ([0, 1, 2].every((i) => cut.box[1][i] - cut.box[0][i] + 2 * step >= THINNEST)) cut.box = cut.box.map((corner, k) => corner.map((at) => within(at + (k ? step : -step))));
}

/** The least distance of opposite faces of the box, of 2 across the whole mesh. */
const THINNEST = 0.01;
