// Drawn over the picture: axes, scale, and the measured distance.

const AXES = [["x", "#c8372d", "#ff8077"], ["y", "#1f7a3d", "#6fd391"], ["z", "#1c5fb8", "#7db5ff"]];

function svg(parent, name, attributes, text) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  parent.append(made);
  return made;
}

/** The largest of 1, 2 and 5 times a power of ten that is at most x. */
function roundLength(x) {
  const power = 10 ** Math.floor(Math.log10(x));
  return power * [5, 2, 1].find((k) => k * power <= x * (1 + 1e-9));
}

function drawOverlay(app) {
  const { canvas, overlay, state } = app, h = canvas.clientHeight, w = canvas.clientWidth;
  overlay.replaceChildren();
  overlay.setAttribute("viewBox", `0 0 ${w} ${h}`);
  const dark = document.documentElement.dataset.theme === "dark";
  const center = [52, h - 52];
  AXES.map(([name, light, bright], k) => ({ name, color: dark ? bright : light, to: [0, 1, 2].map((row) => state.turn[row][k]) }))
    .sort((a, b) => a.to[2] - b.to[2])
    .forEach(({ name, color, to }) => {
      const [x, y] = [center[0] + 32 * to[0], center[1] - 32 * to[1]];
      svg(overlay, "line", { x1: center[0], y1: center[1], x2: x, y2: y, stroke: color, "stroke-width": 2.5, "stroke-linecap": "round" });
      svg(overlay, "text", { x: center[0] + 42 * to[0], y: center[1] - 42 * to[1] + 4, "text-anchor": "middle", "font-weight": 600 }, name);
    });
  const perPixel = 2 * state.zoom / h, length = roundLength(160 * perPixel), wide = length / perPixel;
  const [right, low] = [w - 22, h - 20];
  svg(overlay, "path", { d: `M${right - wide} ${low - 6}v6h${wide}v-6`, fill: "none", stroke: "var(--text)", "stroke-width": 1.5 });
  svg(overlay, "text", { x: right - wide / 2, y: low - 6, "text-anchor": "middle" }, short(length));
  if (app.measured.length === 2) {
    const [p, q] = app.measured.map(({ v, mesh }) => app.toScreen(app.placeOf(v, mesh)));
    svg(overlay, "text", { x: (p[0] + q[0]) / 2 + 8, y: (p[1] + q[1]) / 2 - 8, "font-weight": 600, "font-size": 14 }, short(norm(apart(app.measured))));
  }
}
