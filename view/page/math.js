// Vectors, rotations and colours.

const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => scaled(a, 1 / (norm(a) || 1));

// A rotation is three rows: right, up, and towards the viewer.
const turned = (r, p) => [dot(r[0], p), dot(r[1], p), dot(r[2], p)];

/** The rotation that looks from an azimuth and elevation in degrees; z points up. */
function looking(azimuth, elevation) {
  const [a, e] = [azimuth * Math.PI / 180, elevation * Math.PI / 180];
  const toward = [Math.cos(a) * Math.cos(e), Math.sin(a) * Math.cos(e), Math.sin(e)];
  const right = [-Math.sin(a), Math.cos(a), 0];
  return [right, cross(toward, right), toward];
}

// Okabe and Ito's colours without black, then lighter and darker ones between them: readers with any
// kind of colour blindness tell neighbours apart.
const PALETTE = [[86, 160, 211], [230, 159, 0], [0, 158, 115], [204, 121, 167], [240, 228, 66], [213, 94, 0], [0, 114, 178],
  [148, 203, 236], [170, 68, 153], [153, 153, 51], [136, 34, 85], [68, 170, 153], [221, 204, 119], [51, 34, 136], [204, 102, 119], [187, 187, 187]];

/** The colour of a number, any from 0. */
function colorOf(number) {
  const color = PALETTE[number % PALETTE.length];
  const round = Math.floor(number / PALETTE.length) % 3;
  return round === 0 ? color : color.map((c) => Math.round(round === 1 ? 0.62 * c : 0.55 * c + 115));
}

// Nodes of the colour map viridis (Smith, van der Walt 2015; CC0): even steps of lightness, for readers
// with any kind of colour blindness.
const RAMP = [[68, 1, 84], [70, 50, 127], [54, 92, 141], [39, 127, 142], [31, 161, 135], [74, 194, 109], [159, 218, 58], [253, 231, 37]];

/** The colour of a fraction from 0 to 1. */
function rampAt(x) {
  const at = Math.min(Math.max(x, 0), 1) * (RAMP.length - 1);
  const k = Math.min(Math.floor(at), RAMP.length - 2);
  return RAMP[k].map((c, i) => Math.round(c + (at - k) * (RAMP[k + 1][i] - c)));
}

const css = (color) => `rgb(${color.join(" ")})`;

/** A number with few digits. */
function short(x, digits = 6) {
  if (!Number.isFinite(x)) return "–";
  return String(Number(x.toPrecision(digits)));
}

const grouped = (n) => n.toLocaleString("en-US");
