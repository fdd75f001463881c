// The report of a run as tables, and the help.

const KEYS = [["drag", "turn"], ["right drag, Shift + drag, two fingers", "move"], ["wheel, pinch, + −", "zoom"], ["click", "what is there"], ["1 … 6", "view along an axis"], ["0", "standard view"],
  ["c", "cut on or off"], ["b", "cut by a box"], ["[ ]", "move the plane of the cut, make its box smaller or larger"], ["f", "filled, grid, transparent"], ["v s e k", "vertices, shared vertices, curves, corners"], ["m", "measure between two vertices"], ["d", "dark or light"], ["r", "report, if there is one"], ["Esc", "nothing selected"], ["?", "this help"]];

function closing(dialog) {
  return element("p", {}, element("button", { onclick: () => dialog.close(), autofocus: true }, "Close"));
}

function buildHelp(dialog) {
  dialog.replaceChildren(element("h2", {}, "Keys and mouse"),
    element("table", {}, ...KEYS.map(([keys, what]) => element("tr", {}, element("th", {}, element("kbd", {}, keys)), element("td", {}, what)))),
    element("p", {}, "The address contains the view and all choices: a copied link shows the same."), closing(dialog));
}

const words = (key) => key.replaceAll("_", " ");

/** A value of the report: objects and lists of objects become tables; bytes are in MB. */
function reported(value, key = "") {
  if (typeof value === "number" && /memory|^bytes$/.test(key)) return document.createTextNode(`${short(value / 1e6, 4)} MB`);
  if (value === null || value === undefined) return document.createTextNode("–");
  if (Array.isArray(value)) {
    if (value.length && value.every((row) => row && typeof row === "object" && !Array.isArray(row))) {
      const keys = [...new Set(value.flatMap((row) => Object.keys(row)))];
      return element("table", {}, element("tr", {}, ...keys.map((key) => element("th", {}, words(key)))),
        ...value.map((row) => element("tr", {}, ...keys.map((key) => element("td", {}, reported(row[key], key))))));
    }
    return document.createTextNode(value.map((x) => (typeof x === "object" ? JSON.stringify(x) : typeof x === "number" ? short(x) : String(x))).join(", ") || "none");
  }
  if (typeof value === "object") {
    return element("table", {}, ...Object.entries(value).map(([key, inner]) => element("tr", {}, element("th", {}, words(key)), element("td", {}, reported(inner, key)))));
  }
  return document.createTextNode(typeof value === "number" ? (Number.isInteger(value) ? grouped(value) : short(value)) : String(value));
}

// The sections that are read most come first, and are open.
const FIRST = ["mesh", "quality_by_level", "stages", "partition"];

/** A histogram of the whole mesh; heights are square roots, so that few bad tets are seen beside many good ones. */
function bars(title, counts, top, unit) {
  const [wide, high] = [340, 120], most = Math.max(...counts, 1), used = counts.length - [...counts].reverse().findIndex((n) => n > 0);
  const shown = counts.slice(0, Math.max(1, used)), end = top * shown.length / counts.length;
  const picture = element("div", { className: "figure" }), drawn = svg(picture, "svg", { viewBox: `0 0 ${wide} ${high + 18}`, width: wide, height: high + 18, role: "img", "aria-label": title });
  shown.forEach((n, k) => {
    const tall = n ? Math.max(1.5, Math.sqrt(n / most) * high) : 0, step = wide / shown.length;
    const bar = svg(drawn, "rect", { x: k * step + 0.25, y: high - tall, width: Math.max(0.5, step - 0.5), height: tall, fill: css(rampAt(k / Math.max(1, shown.length - 1))) });
    svg(bar, "title", {}, `${short(k * top / counts.length, 3)}${unit} to ${short((k + 1) * top / counts.length, 3)}${unit}: ${grouped(n)} tets`);
  });
  svg(drawn, "line", { x1: 0, x2: wide, y1: high, y2: high, stroke: "var(--soft)" });
  svg(drawn, "text", { x: 0, y: high + 14, fill: "var(--soft)", "font-size": 12 }, `0${unit}`);
  svg(drawn, "text", { x: wide, y: high + 14, fill: "var(--soft)", "font-size": 12, "text-anchor": "end" }, `${short(end, 3)}${unit}`);
  picture.append(element("div", {}, title));
  return picture;
}

/** Pictures, histograms and the table of parts, which a report page has beside the numbers. */
function beside(page) {
  const pictures = page.pictures.map(({ title, png }) => element("div", { className: "figure" }, element("img", { src: `data:image/png;base64,${png}`, alt: title, width: 360 }), element("div", {}, title)));
  const histograms = [
    ...(page.angles ? [bars("Tets by smallest dihedral angle (heights: square roots)", page.angles.slice(0, 72), 72, "°")] : []),
    ...(page.ratios ? [bars("Tets by mean ratio (heights: square roots)", page.ratios, 1, "")] : []),
  ];
  return [element("div", { className: "figures" }, ...pictures, ...histograms),
    ...(page.parts.length > 1 ? [element("details", { open: true }, element("summary", {}, "parts"), element("div", { className: "body wide" }, reported(page.parts.map(({ part, tets, vertices, shared_vertices, boundary }) => ({ part, tets, vertices, shared_vertices, boundary })))))] : [])];
}

function buildReport(dialog, { page, ...report }) {
  const entries = Object.entries(report).filter(([, value]) => value !== null), isPart = ([, value]) => typeof value === "object";
  const place = ([key]) => (FIRST.includes(key) ? FIRST.indexOf(key) : FIRST.length);
  const parts = entries.filter(isPart).sort((a, b) => place(a) - place(b));
  dialog.replaceChildren(element("h2", {}, "Report"), closing(dialog), ...(page ? beside(page) : []), reported(Object.fromEntries(entries.filter((entry) => !isPart(entry)))),
    ...parts.map(([key, value]) => element("details", { open: FIRST.includes(key) }, element("summary", {}, words(key)), element("div", { className: "body wide" }, reported(value)))));
}
