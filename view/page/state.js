// The state of the page, and its form in the address.

function standardState(mesh) {
  return {
    turn: looking(-60, 25), focus: [0, 0, 0], zoom: 0.95 * mesh.radius,
    color: mesh.parts > 1 ? "part" : "patch", style: "both", measure: "angle", range: null, histogram: "level",
    boundary: true, interfaces: true, volume: true, curves: true, corners: false, vertices: false, shared: false,
    cut: { on: false, fine: true, shape: "plane", normal: [0, -1, 0], at: 0, box: [[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]] }, explode: 0, ghosts: -1,
    patchesOff: new Set(), partsOff: new Set(), bodiesOff: new Set(), dark: matchMedia("(prefers-color-scheme: dark)").matches,
  };
}

const FLAGS = ["boundary", "interfaces", "volume", "curves", "corners", "vertices", "shared", "dark"];
const SETS = ["patchesOff", "partsOff", "bodiesOff"];
const STYLES = ["both", "filled", "grid", "transparent"];

function writeState(state) {
  const q = new URLSearchParams(), numbers = (list) => list.map((x) => short(x, 5)).join(",");
  q.set("turn", numbers(state.turn.flat()));
  q.set("focus", numbers(state.focus));
  q.set("zoom", short(state.zoom, 5));
  for (const key of ["color", "style", "measure"]) q.set(key, state[key]);
  q.set("on", FLAGS.filter((key) => state[key]).join(","));
  if (state.cut.on && state.cut.shape === "plane") q.set("cut", numbers([...state.cut.normal, state.cut.at]));
  if (state.cut.on && state.cut.shape === "box") q.set("box", numbers(state.cut.box.flat()));
  if (!state.cut.fine) q.set("fine", "0");
  if (state.level) q.set("level", state.level);
  if (state.ghosts >= 0) q.set("ghosts", state.ghosts);
  if (state.explode) q.set("explode", short(state.explode, 4));
  if (state.histogram === "cut") q.set("histogram", "cut");
  if (state.range) q.set("range", state.range.join(","));
  for (const key of SETS) if (state[key].size) q.set(key, [...state[key]].join(","));
  return q.toString().replaceAll("%2C", ",");
}

/** Takes from an address what is valid there, and keeps the rest as it is. */
function readState(state, text) {
  const q = new URLSearchParams(text);
  const numbers = (key, count) => {
    const list = (q.get(key) || "").split(",").filter(Boolean).map(Number);
    return list.length === count && list.every((x) => Number.isFinite(x)) ? list : null;
  };
  const turn = numbers("turn", 9), focus = numbers("focus", 3), zoom = numbers("zoom", 1), cut = numbers("cut", 4), box = numbers("box", 6), explode = numbers("explode", 1);
  if (turn) state.turn = straightened([turn.slice(0, 3), turn.slice(3, 6), turn.slice(6)]);
  if (focus) state.focus = focus;
  if (zoom && zoom[0] > 0) [state.zoom] = zoom;
  if (COLORS.some(([key]) => key === q.get("color")) || q.get("color") === "periodic") state.color = q.get("color");
  if (STYLES.includes(q.get("style"))) state.style = q.get("style");
  if (q.get("measure") in QUALITY) state.measure = q.get("measure");
  if (q.has("on")) FLAGS.forEach((key) => { state[key] = q.get("on").split(",").includes(key); });
  state.cut = { ...state.cut, on: false, fine: q.get("fine") !== "0" };
  if (cut && norm(cut.slice(0, 3)) > 0) Object.assign(state.cut, { on: true, shape: "plane", normal: cut.slice(0, 3), at: cut[3] });
  else if (box && [0, 1, 2].every((i) => box[i] < box[i + 3])) Object.assign(state.cut, { on: true, shape: "box", box: [box.slice(0, 3), box.slice(3)] });
  const level = numbers("level", 1);
  if (level) [state.level] = level;
  const ghosts = numbers("ghosts", 1);
  state.ghosts = ghosts && Number.isInteger(ghosts[0]) ? ghosts[0] : -1;
  state.explode = explode ? Math.min(5, Math.max(0, explode[0])) : 0;
  state.histogram = q.get("histogram") === "cut" ? "cut" : "level";
  const range = (q.get("range") || "").split(",").map(Number);
  state.range = range.length === 2 && range[0] < range[1] ? range : null;
  for (const key of SETS) state[key] = new Set((q.get(key) || "").split(",").filter(Boolean).map(Number).filter(Number.isInteger));
}

/** The nearest rotation, after rounding or many small turns. */
function straightened([right, up]) {
  const toward = unit(cross(right, up)), first = unit(right);
  return [first, cross(toward, first), toward];
}
