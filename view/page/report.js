// The report of a run as tables, and the help.

const KEYS = [["drag", "turn"], ["right drag, Shift + drag, two fingers", "move"], ["wheel, pinch, + −", "zoom"], ["click", "what is there"], ["1 … 6", "view along an axis"], ["0", "standard view"],
  ["c", "cut on or off"], ["[ ]", "move the cut"], ["f", "filled, grid, transparent"], ["v s e k", "vertices, shared vertices, curves, corners"], ["m", "measure between two vertices"], ["d", "dark or light"], ["r", "report, if there is one"], ["Esc", "nothing selected"], ["?", "this help"]];

function closing(dialog) {
  return element("p", {}, element("button", { onclick: () => dialog.close(), autofocus: true }, "Close"));
}

function buildHelp(dialog) {
  dialog.replaceChildren(element("h2", {}, "Keys and mouse"),
    element("table", {}, ...KEYS.map(([keys, what]) => element("tr", {}, element("th", {}, element("kbd", {}, keys)), element("td", {}, what)))),
    element("p", {}, "The address contains the view and all choices: a copied link shows the same."), closing(dialog));
}

const words = (key) => key.replaceAll("_", " ");

/** A value of the report: objects and lists of objects become tables. */
function reported(value) {
  if (value === null || value === undefined) return document.createTextNode("–");
  if (Array.isArray(value)) {
    if (value.length && value.every((row) => row && typeof row === "object" && !Array.isArray(row))) {
      const keys = [...new Set(value.flatMap((row) => Object.keys(row)))];
      return element("table", {}, element("tr", {}, ...keys.map((key) => element("th", {}, words(key)))),
        ...value.map((row) => element("tr", {}, ...keys.map((key) => element("td", {}, reported(row[key]))))));
    }
    return document.createTextNode(value.map((x) => (typeof x === "object" ? JSON.stringify(x) : typeof x === "number" ? short(x) : String(x))).join(", ") || "none");
  }
  if (typeof value === "object") {
    return element("table", {}, ...Object.entries(value).map(([key, inner]) => element("tr", {}, element("th", {}, words(key)), element("td", {}, reported(inner)))));
  }
  return document.createTextNode(typeof value === "number" ? (Number.isInteger(value) ? grouped(value) : short(value)) : String(value));
}

// The sections that are read most come first, and are open.
const FIRST = ["mesh", "quality_by_level", "stages", "partition"];

function buildReport(dialog, report) {
  const entries = Object.entries(report).filter(([, value]) => value !== null), isPart = ([, value]) => typeof value === "object";
  const place = ([key]) => (FIRST.includes(key) ? FIRST.indexOf(key) : FIRST.length);
  const parts = entries.filter(isPart).sort((a, b) => place(a) - place(b));
  dialog.replaceChildren(element("h2", {}, "Report"), closing(dialog), reported(Object.fromEntries(entries.filter((entry) => !isPart(entry)))),
    ...parts.map(([key, value]) => element("details", { open: FIRST.includes(key) }, element("summary", {}, words(key)), element("div", { className: "body wide" }, reported(value)))));
}
