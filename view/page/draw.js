// Drawing with WebGL 2: faces with their edges, thick lines, round points, and an image of face numbers.

const COMMON = `#version 300 es
precision highp float; precision highp int;
uniform mat3 turn; uniform vec3 focus; uniform vec2 scale; uniform float depth;
vec4 placed(vec3 p, float nearer) {
  vec3 q = turn * (p - focus);
  return vec4(q.xy * scale, -q.z * depth - nearer, 1.0);
}`;

const FACE_VERTEX = COMMON + `
in vec3 position; in vec4 color; in vec4 corner; out vec3 place; out vec3 tint; out vec3 weight; flat out uint face;
void main() {
  face = uint(gl_VertexID / 3);
  weight = corner.xyz;
  place = turn * (position - focus);
  tint = color.rgb;
  gl_Position = placed(position, 0.0);
}`;

// Light comes from the upper left of the viewer; both sides are lit. Edges fade where faces are
// smaller than a few pixels, so that fine meshes do not become black.
const FACE_FRAGMENT = `#version 300 es
precision highp float; precision highp int;
uniform int mode; uniform float alpha; uniform vec3 ink;
in vec3 place; in vec3 tint; in vec3 weight; flat in uint face; out vec4 result;
void main() {
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  if (normal.z < 0.0) normal = -normal;
  float light = 0.60 + 0.38 * max(dot(normal, normalize(vec3(-0.35, 0.55, 0.76))), 0.0) + 0.07 * normal.z;
  vec3 width = fwidth(weight);
  vec3 near = weight / max(width, vec3(1e-9));
  float distance = min(near.x, min(near.y, near.z));
  float room = 1.0 / max(max(width.x, max(width.y, width.z)), 1e-9);
  float line = (1.0 - smoothstep(0.35, 1.25, distance)) * clamp(room / 9.0, 0.0, 1.0);
  if (mode == 1) {
    if (line < 0.08) discard;
    result = vec4(mix(tint * 0.55, ink, 0.45), 1.0);
    return;
  }
  vec3 lit = tint * min(light, 1.0);
  if (mode >= 2) lit = mix(lit, ink, 0.62 * line);
  result = vec4(lit, mode == 3 ? alpha + 0.5 * line : 1.0);
}`;

const NUMBER_FRAGMENT = `#version 300 es
precision highp float; precision highp int;
uniform uint before;
in vec3 place; in vec3 tint; in vec3 weight; flat in uint face; out vec4 result;
void main() {
  uint n = before + face + 1u;
  result = vec4(n & 255u, (n >> 8) & 255u, (n >> 16) & 255u, (n >> 24) & 255u) / 255.0;
}`;

const LINE_VERTEX = COMMON + `
in vec3 from; in vec3 to; uniform vec2 pixel; uniform float wide; uniform float nearer;
void main() {
  vec4 a = placed(from, nearer), b = placed(to, nearer);
  vec2 along = (b.xy - a.xy) / pixel;
  vec2 aside = normalize(vec2(-along.y, along.x) + vec2(1e-9, 0.0)) * wide * pixel;
  gl_Position = (gl_VertexID & 1) == 0 ? a : b;
  gl_Position.xy += gl_VertexID < 2 ? aside : -aside;
}`;
const LINE_FRAGMENT = `#version 300 es
precision highp float; uniform vec3 ink; out vec4 result;
void main() { result = vec4(ink, 1.0); }`;

const POINT_VERTEX = COMMON + `
in vec3 position; in float size; in vec4 color; uniform float ratio; out vec3 tint;
void main() { gl_Position = placed(position, 0.004); gl_PointSize = size * ratio; tint = color.rgb; }`;
const POINT_FRAGMENT = `#version 300 es
precision highp float; in vec3 tint; out vec4 result;
void main() {
  float r = length(gl_PointCoord - 0.5);
  if (r > 0.5) discard;
  result = vec4(r > 0.38 ? vec3(1.0) : tint, 1.0);
}`;

/** The drawing side of the page; `canvas` keeps the picture for tests and screenshots. */
function makeDrawing(canvas) {
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true, alpha: true, premultipliedAlpha: false });
  if (!gl) throw new Error("this browser has no WebGL 2: update it, or allow hardware acceleration in its settings");
  const programs = {
    face: program(gl, FACE_VERTEX, FACE_FRAGMENT), number: program(gl, FACE_VERTEX, NUMBER_FRAGMENT),
    line: program(gl, LINE_VERTEX, LINE_FRAGMENT), point: program(gl, POINT_VERTEX, POINT_FRAGMENT),
  };
  // Corners have the weights of the corners of their face, from which the grid is drawn.
  const faces = () => layer(gl, [["position", 3, gl.FLOAT, 0], ["color", 4, gl.UNSIGNED_BYTE, 12], ["corner", 4, gl.UNSIGNED_BYTE, 16]], 20, 0);
  const lines = () => layer(gl, [["from", 3, gl.FLOAT, 0], ["to", 3, gl.FLOAT, 12]], 24, 1);
  const points = layer(gl, [["position", 3, gl.FLOAT, 0], ["size", 1, gl.FLOAT, 12], ["color", 4, gl.UNSIGNED_BYTE, 16]], 20, 0);
  return { gl, canvas, programs, faces: faces(), near: faces(), curves: lines(), frame: lines(), marks: lines(), points, marked: layer(gl, [["position", 3, gl.FLOAT, 0], ["size", 1, gl.FLOAT, 12], ["color", 4, gl.UNSIGNED_BYTE, 16]], 20, 0), target: null };
}

const NAMES = ["position", "color", "from", "to", "size", "corner"];

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(`shader: ${gl.getShaderInfoLog(shader)}`);
    gl.attachShader(made, shader);
  }
  NAMES.forEach((name, at) => gl.bindAttribLocation(made, at, name));
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(`shader: ${gl.getProgramInfoLog(made)}`);
  const at = {};
  for (let k = gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS) - 1; k >= 0; k--) {
    const { name } = gl.getActiveUniform(made, k);
    at[name] = gl.getUniformLocation(made, name);
  }
  return { made, at };
}

/** A buffer with its attributes; `divisor` 1 takes one record for each instance. */
function layer(gl, attributes, stride, divisor) {
  const array = gl.createVertexArray(), buffer = gl.createBuffer();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  for (const [name, size, kind, offset] of attributes) {
    const at = NAMES.indexOf(name);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, kind, kind === gl.UNSIGNED_BYTE, stride, offset);
    gl.vertexAttribDivisor(at, divisor);
  }
  return { array, buffer, count: 0, stride };
}

function fill(drawing, name, bytes) {
  const { gl } = drawing, to = drawing[name];
  gl.bindBuffer(gl.ARRAY_BUFFER, to.buffer);
  gl.bufferData(gl.ARRAY_BUFFER, bytes, gl.DYNAMIC_DRAW);
  to.count = bytes.byteLength / to.stride;
}

/** The bytes of several buffers in one. */
function joined(buffers) {
  const all = new Uint8Array(buffers.reduce((sum, { byteLength }) => sum + byteLength, 0));
  let at = 0;
  for (const buffer of buffers) {
    all.set(new Uint8Array(buffer), at);
    at += buffer.byteLength;
  }
  return all;
}

/** Pixels of the canvas per pixel of the page. */
const ratioOf = () => Math.min(window.devicePixelRatio || 1, 2);

function resize(drawing) {
  const { canvas } = drawing, ratio = ratioOf();
  const [w, h] = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.max(1, Math.round(x * ratio)));
  if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
}

/** Sets the view on a program. `state.zoom` is half the height of the picture, in units of the mesh. */
function setView(drawing, { made, at }, view) {
  const { gl, canvas } = drawing, r = view.turn;
  gl.useProgram(made);
  gl.uniformMatrix3fv(at.turn, false, [r[0][0], r[1][0], r[2][0], r[0][1], r[1][1], r[2][1], r[0][2], r[1][2], r[2][2]]);
  gl.uniform3fv(at.focus, view.focus);
  gl.uniform2f(at.scale, canvas.height / canvas.width / view.zoom, 1 / view.zoom);
  gl.uniform1f(at.depth, 1 / view.reach);
}

/** Draws the faces of the mesh, and those of the layers in front of equal depths. */
function drawFaces(drawing, name, mode, view, ink) {
  const { gl, faces, near } = drawing, used = drawing.programs[name];
  setView(drawing, used, view);
  if (name === "face") {
    gl.uniform1i(used.at.mode, mode);
    gl.uniform1f(used.at.alpha, 0.22);
    gl.uniform3fv(used.at.ink, ink);
  }
  let before = 0;
  for (const layer of [faces, near]) {
    if (name === "number") gl.uniform1ui(used.at.before, before);
    if (layer === faces && near.count) gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 2);
    gl.bindVertexArray(layer.array);
    gl.drawArrays(gl.TRIANGLES, 0, layer.count);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    before += layer.count / 3;
  }
}

function drawLines(drawing, name, view, color, wide, nearer) {
  const { gl, canvas } = drawing, used = drawing.programs.line, lines = drawing[name];
  if (!lines.count) return;
  setView(drawing, used, view);
  gl.uniform2f(used.at.pixel, 2 / canvas.width, 2 / canvas.height);
  gl.uniform1f(used.at.wide, 0.5 * wide * ratioOf());
  gl.uniform1f(used.at.nearer, nearer);
  gl.uniform3fv(used.at.ink, color);
  gl.bindVertexArray(lines.array);
  gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, lines.count);
}

function drawPoints(drawing, name, view) {
  const { gl } = drawing, used = drawing.programs.point, points = drawing[name];
  if (!points.count) return;
  setView(drawing, used, view);
  gl.uniform1f(used.at.ratio, ratioOf());
  gl.bindVertexArray(points.array);
  gl.drawArrays(gl.POINTS, 0, points.count);
}

const MODES = { filled: 0, grid: 1, both: 2, transparent: 3 };

/** Draws the picture. */
function draw(drawing, view, style, dark) {
  const { gl, canvas } = drawing;
  resize(drawing);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.viewport(0, 0, canvas.width, canvas.height);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  const mode = MODES[style], ink = dark && mode === 1 ? [0.9, 0.93, 0.96] : [0.07, 0.1, 0.14];
  if (mode === 3) {
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
  }
  drawFaces(drawing, "face", mode, view, ink);
  gl.depthMask(true);
  gl.disable(gl.BLEND);
  drawLines(drawing, "curves", view, dark && (mode === 1 || mode === 3) ? [0.95, 0.97, 1] : [0.05, 0.08, 0.13], 2.2, 0.002);
  drawLines(drawing, "frame", view, dark ? [0.42, 0.71, 0.96] : [0.04, 0.38, 0.66], 1.4, 0);
  drawPoints(drawing, "points", view);
  gl.disable(gl.DEPTH_TEST);
  drawLines(drawing, "marks", view, [0.86, 0.1, 0.35], 3, 0);
  drawPoints(drawing, "marked", view);
}

/** The number of the triangle, in the order of drawing, under a pixel of the canvas, or -1. */
function faceAt(drawing, view, x, y) {
  const { gl, canvas } = drawing;
  const [w, h] = [canvas.width, canvas.height];
  if (!drawing.target || drawing.target.w !== w || drawing.target.h !== h) {
    const frame = gl.createFramebuffer(), color = gl.createRenderbuffer(), depth = gl.createRenderbuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    for (const [buffer, format, slot] of [[color, gl.RGBA8, gl.COLOR_ATTACHMENT0], [depth, gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]]) {
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, w, h);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, slot, gl.RENDERBUFFER, buffer);
    }
    if (drawing.target) {
      gl.deleteFramebuffer(drawing.target.frame);
      drawing.target.buffers.forEach((buffer) => gl.deleteRenderbuffer(buffer));
    }
    drawing.target = { frame, w, h, buffers: [color, depth] };
  }
  gl.bindFramebuffer(gl.FRAMEBUFFER, drawing.target.frame);
  gl.viewport(0, 0, w, h);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  drawFaces(drawing, "number", 0, view);
  const pixel = new Uint8Array(4);
  gl.readPixels(Math.round(x), h - 1 - Math.round(y), 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  return pixel[0] + 256 * (pixel[1] + 256 * (pixel[2] + 256 * pixel[3])) - 1;
}
