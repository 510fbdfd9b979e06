"use strict";
// The viewer of a film: bodies that move and deform, what joins and loads them, and histories beside them.
//
// A surface is stored once. Its points x move to  R + A (x + sum_k w_k(t) S_k(x)):  the shapes S_k lie in a texture of whole
// numbers, the weights w_k, with their scale, are uniforms of the vertex shader. What is linear in the deformation is exaggerated
// by the scale, what is quadratic by its square. Bodies in parts are drawn between their undeformed whole and where they are.
// Stress is a sum of tensors in the same way. ffr_dyn/pictures/page.py writes the numbers.

const $ = (id) => document.getElementById(id);
const WIDTH = 2048; // of the textures, in texels
const MOST_SHAPES = 60, MOST_TENSORS = 40; // as in ffr_dyn/pictures/morphs.py
const INK = "#222222";

// ---- the numbers -------------------------------------------------------------------------------------------------------

const about = JSON.parse($("about").textContent);
let numbers; // ArrayBuffer of all arrays

async function unpack() {
  const packed = Uint8Array.from(atob($("numbers").textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  numbers = await new Response(stream).arrayBuffer();
}

/** The array that a reference [type, offset, length] stands for; h2: a history in whole numbers of a scale, the fourth. */
function array([type, offset, length, scale]) {
  if (type === "h2") return Float32Array.from(new Int16Array(numbers, offset, length), (whole) => whole * scale);
  return new { f4: Float32Array, i2: Int16Array, u4: Uint32Array, u1: Uint8Array }[type](numbers, offset, length);
}

// ---- vectors and matrices (columns one after the other, as WebGL has them) ------------------------------------------------

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const times = (A, v) => [0, 1, 2].map((r) => A[r] * v[0] + A[3 + r] * v[1] + A[6 + r] * v[2]);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((c) => c / (Math.hypot(...a) || 1));

/** Rotation matrix of Euler parameters, scalar first, of any length. */
function rotation(p) {
  const [a, b, c, d] = p.map((e) => e / Math.hypot(...p));
  return [
    a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c),
    2 * (b * c - a * d), a * a - b * b + c * c - d * d, 2 * (c * d + a * b),
    2 * (b * d + a * c), 2 * (c * d - a * b), a * a - b * b - c * c + d * d,
  ];
}

// ---- what is shown, and when ------------------------------------------------------------------------------------------

const state = { time: 0, playing: false, loop: true, speed: 1, scale: about.scale, colour: 0, limits: [], drawn: 0 };
let rows; // times of the rows [s]
const span = () => rows.at(-1) - rows[0];
const camera = { axes: [], target: about.centre.slice(), reach: 1 }; // axes: right, up, towards the eye

/** The row before a time, and how far it is on the way to the next (0 to 1). */
function place(time) {
  let low = 0, high = rows.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (rows[middle] <= time) low = middle; else high = middle;
  }
  const step = rows[high] - rows[low];
  return { row: low, next: high, share: step > 0 ? Math.min(Math.max((time - rows[low]) / step, 0), 1) : 0, step };
}

/** A history (rows, count) between two rows. */
function between(values, count, at) {
  const a = at.row * count, b = at.next * count;
  return Array.from({ length: count }, (_, k) => values[a + k] + at.share * (values[b + k] - values[a + k]));
}

/** Its rate there. */
function rate(values, count, at) {
  const a = at.row * count, b = at.next * count;
  return Array.from({ length: count }, (_, k) => (at.step > 0 ? (values[b + k] - values[a + k]) / at.step : 0));
}

/** Place and axes of a body, and their rates. */
function pose(body, at) {
  const now = between(body.pose, 7, at);
  const [before, after] = [at.row, at.next].map((row) => rotation(Array.from(body.pose.subarray(7 * row + 3, 7 * row + 7))));
  return {
    R: now.slice(0, 3), A: rotation(now.slice(3)), rateR: rate(body.pose, 7, at).slice(0, 3),
    rateA: before.map((a, k) => (at.step > 0 ? (after[k] - a) / at.step : 0)),
  };
}

// ---- WebGL ------------------------------------------------------------------------------------------------------------

// Where there is no graphics card smooth edges cost half the time, and a film is drawn with three quarters of the pixels.
const smooth = $("solid").getContext("webgl2", { antialias: true, failIfMajorPerformanceCaveat: true });
const gl = smooth || $("solid").getContext("webgl2", { antialias: false });
const sharpness = () => (smooth || !state.playing ? 1 : 0.75);
// Where the points are and what colours them, once for each point of a body: written to a buffer, from which it is drawn.
const MOTION = `#version 300 es
precision highp float; precision highp int; precision highp isampler2D;
in vec3 point; in vec2 moduli;
uniform isampler2D shapes, tensors;
uniform int shapeCount, tensorCount, kind, measure; // kind: 0 plain, 1 displacement, 2 speed, 3 stress, 4 strain
uniform vec3 weights[${MOST_SHAPES}]; // as drawn, as it is, its rate
uniform float stresses[${MOST_TENSORS}];
uniform mat3 A, A0, rateA;
uniform vec3 R, R0, rateR;
uniform float blend;
uniform vec2 range; uniform sampler2D map;
out vec3 place; out float value, shade; // red, green and blue as one whole number

vec3 texel(isampler2D of, int k) { return vec3(texelFetch(of, ivec2(k % ${WIDTH}, k / ${WIDTH}), 0).xyz); }

float von_mises(vec3 n, vec3 s) {
  vec3 d = n - n.yzx;
  return sqrt(0.5 * dot(d, d) + 3.0 * dot(s, s));
}
vec2 principal(vec3 n, vec3 s) { // the largest and the smallest value of a tensor xx, yy, zz; xy, xz, yz
  float mean = (n.x + n.y + n.z) / 3.0;
  vec3 d = n - mean;
  float p = sqrt((dot(d, d) + 2.0 * dot(s, s)) / 6.0);
  if (p == 0.0) return vec2(mean);
  d /= p; s /= p;
  float det = d.x * (d.y * d.z - s.z * s.z) - s.x * (s.x * d.z - s.z * s.y) + s.y * (s.x * s.z - d.y * s.y);
  float angle = acos(clamp(0.5 * det, -1.0, 1.0)) / 3.0;
  return mean + 2.0 * p * cos(vec2(angle, angle + 2.0943951));
}
float measured(vec3 n, vec3 s) {
  if (measure == 0) return von_mises(n, s);
  if (measure > 4) return measure < 8 ? n[measure - 5] : s[measure - 8];
  vec2 ends = principal(n, s);
  if (measure == 1) return ends.x - ends.y;
  if (measure == 2) return abs(ends.x) >= abs(ends.y) ? ends.x : ends.y;
  return measure == 3 ? ends.x : ends.y;
}
void main() {
  vec3 drawn = point, real = point, speed = vec3(0.0);
  for (int k = 0; k < shapeCount; k++) {
    vec3 shape = texel(shapes, gl_VertexID * shapeCount + k);
    drawn += weights[k].x * shape; real += weights[k].y * shape; speed += weights[k].z * shape;
  }
  vec3 rest = R0 + A0 * point;
  value = 0.0;
  if (kind == 1) value = length(R + A * real - rest);
  if (kind == 2) value = length(rateR + rateA * real + A * speed);
  if (kind > 2) {
    vec3 n = vec3(0.0), s = vec3(0.0);
    for (int k = 0; k < tensorCount; k++) {
      int at = 2 * (gl_VertexID * tensorCount + k);
      n += stresses[k] * texel(tensors, at); s += stresses[k] * texel(tensors, at + 1);
    }
    if (kind == 4) { n = ((1.0 + moduli.y) * n - moduli.y * (n.x + n.y + n.z)) / moduli.x; s *= (1.0 + moduli.y) / moduli.x; }
    value = measured(n, s);
  }
  place = mix(rest, R + A * drawn, blend);
  vec3 colour = textureLod(map, vec2(clamp((value - range.x) / (range.y - range.x), 0.0, 1.0), 0.5), 0.0).rgb;
  shade = dot(floor(255.0 * colour + 0.5), vec3(65536.0, 256.0, 1.0));
}`;
const VERTEX = `#version 300 es
precision highp float;
in vec3 point; in float shade;
uniform mat3 A, view; uniform vec3 R, target, zoom, colour; uniform float lift;
uniform bool mapped;
out vec3 eye, base;
void main() {
  eye = view * (R + A * point - target);
  base = mapped ? floor(mod(shade / vec3(65536.0, 256.0, 1.0), 256.0)) / 255.0 : colour;
  gl_Position = vec4(eye.xy * zoom.xy, -eye.z * zoom.z - lift, 1.0);
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 eye, base;
uniform bool shaded; uniform float opacity;
out vec4 pixel;
void main() {
  float light = 1.0;
  if (shaded) {
    vec3 normal = normalize(cross(dFdx(eye), dFdy(eye)));
    light = 0.45 + 0.35 * abs(normal.z) + 0.25 * max(0.0, dot(normal, vec3(-0.41, 0.61, 0.68)));
  }
  pixel = vec4(base * light, opacity);
}`;
let blank; // a texture where no colour map is needed
let motion, drawing; // programs, each with its uniforms

function compiled(vertex, fragment, attributes, written) {
  const program = gl.createProgram(), uniforms = {};
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  attributes.forEach((name, k) => gl.bindAttribLocation(program, k, name));
  if (written) gl.transformFeedbackVaryings(program, written, gl.INTERLEAVED_ATTRIBS);
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); k++) {
    const name = gl.getActiveUniform(program, k).name;
    uniforms[name.replace("[0]", "")] = gl.getUniformLocation(program, name);
  }
  return { program, uniforms };
}

function texture(inner, format, type, width, height, data, filter) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texImage2D(gl.TEXTURE_2D, 0, inner, width, height, 0, format, type, data);
  for (const [key, how] of [["MIN_FILTER", filter], ["MAG_FILTER", filter], ["WRAP_S", gl.CLAMP_TO_EDGE], ["WRAP_T", gl.CLAMP_TO_EDGE]])
    gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${key}`], how);
  return made;
}

/** Triples of whole numbers as a texture, in rows of WIDTH. */
function shapesTexture(values) {
  const height = Math.max(1, Math.ceil(values.length / (3 * WIDTH))), padded = new Int16Array(3 * WIDTH * height);
  padded.set(values);
  return texture(gl.RGB16I, gl.RGB_INTEGER, gl.SHORT, WIDTH, height, padded, gl.NEAREST);
}

function buffer(target, data) {
  const made = gl.createBuffer();
  gl.bindBuffer(target, made);
  gl.bufferData(target, data, gl.STATIC_DRAW);
  return made;
}

/** Vertices with attributes [buffer, count, stride, offset], and the numbers of corners. */
function vertices(attributes, corners) {
  const made = gl.createVertexArray();
  gl.bindVertexArray(made);
  attributes.forEach(([source, count, stride, offset], k) => {
    if (!source) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, source);
    gl.enableVertexAttribArray(k);
    gl.vertexAttribPointer(k, count, gl.FLOAT, false, stride, offset);
  });
  if (corners) gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, corners);
  gl.bindVertexArray(null);
  gl.bindBuffer(gl.ARRAY_BUFFER, null); // a buffer that is written to may be bound nowhere else
  return made;
}

function loadSurface(surface) {
  const points = buffer(gl.ARRAY_BUFFER, array(surface.points)), moduli = surface.moduli && buffer(gl.ARRAY_BUFFER, array(surface.moduli));
  Object.assign(surface, { size: surface.points[2] / 3, count: surface.triangles[2], lines: surface.edges[2] });
  const corners = new Uint32Array(surface.count + surface.lines);
  corners.set(array(surface.triangles));
  corners.set(array(surface.edges), surface.count);
  surface.corners = buffer(gl.ELEMENT_ARRAY_BUFFER, corners);
  surface.still = vertices([[points, 3, 0, 0], [moduli, 2, 0, 0]]);
  surface.undeformed = vertices([[points, 3, 0, 0]], surface.corners);
  surface.shapeTexture = shapesTexture(array(surface.shapes));
  surface.tensorTexture = shapesTexture(array(surface.tensors));
}

/** Where a body's points are written to, five numbers each: place, what colours it, and the colour. */
function loadBody(body) {
  const surface = about.surfaces[body.surface];
  Object.assign(body, {
    shown: true, pose: array(body.pose), weights: array(body.weights), tensors: array(body.tensors),
    shade: [1, 3, 5].map((k) => parseInt(body.colour.slice(k, k + 2), 16) / 255),
    moved: buffer(gl.ARRAY_BUFFER, new Float32Array(5 * surface.size)),
  });
  body.vertices = vertices([[body.moved, 3, 20, 0], [body.moved, 1, 20, 16]], surface.corners);
}

function load() {
  rows = array(about.times);
  blank = texture(gl.RGB8, gl.RGB, gl.UNSIGNED_BYTE, 1, 1, new Uint8Array(3), gl.NEAREST);
  motion = compiled(MOTION, "#version 300 es\nvoid main() {}", ["point", "moduli"], ["place", "value", "shade"]);
  drawing = compiled(VERTEX, FRAGMENT, ["point", "shade"]);
  about.surfaces.forEach(loadSurface);
  about.bodies.forEach(loadBody);
  for (const colour of about.colours)
    if (colour.map) colour.texture = texture(gl.RGB8, gl.RGB, gl.UNSIGNED_BYTE, colour.map[2] / 3, 1, array(colour.map), gl.LINEAR);
  for (const thing of [...about.joints, ...about.markers, ...about.arrows]) thing.at = array(thing.at);
  for (const joint of about.joints) joint.axis = joint.axis && array(joint.axis);
  for (const arrow of about.arrows) arrow.vector = array(arrow.vector);
  for (const trace of about.traces) trace.points = array(trace.points);
  for (const series of about.series) series.values = array(series.values);
}

/** The points of a body at a time. */
function move(body, at) {
  const surface = about.surfaces[body.surface], here = pose(body, at), there = pose(about.bodies[body.frame], at);
  const { uniforms } = motion, count = surface.scales.length, tensors = surface.tensorScales, colour = colourOf(body);
  for (const key of ["A", "rateA"]) gl.uniformMatrix3fv(uniforms[key], false, here[key]);
  gl.uniformMatrix3fv(uniforms.A0, false, there.A);
  for (const [key, vector] of [["R", here.R], ["R0", there.R], ["rateR", here.rateR]]) gl.uniform3fv(uniforms[key], vector);
  const now = between(body.weights, count, at), rates = rate(body.weights, count, at), weights = new Float32Array(3 * MOST_SHAPES);
  surface.scales.forEach((scale, k) => {
    const drawn = body.parted ? 1 : k < surface.linear ? state.scale : state.scale * state.scale;
    weights.set([scale * now[k] * drawn, scale * now[k], scale * rates[k]], 3 * k);
  });
  gl.uniform3fv(uniforms.weights, weights);
  gl.uniform1i(uniforms.shapeCount, count);
  if (tensors.length) gl.uniform1fv(uniforms.stresses, between(body.tensors, tensors.length, at).map((w, k) => w * tensors[k]));
  gl.uniform1i(uniforms.tensorCount, tensors.length);
  gl.uniform1f(uniforms.blend, body.parted ? state.scale : 1);
  gl.uniform1i(uniforms.kind, colour ? colour.kind : 0);
  gl.uniform1i(uniforms.measure, colour ? colour.measure : 0);
  gl.uniform2f(uniforms.range, colour && colour.low < 0 ? -state.limits[state.colour] : 0, state.limits[state.colour]);
  [surface.shapeTexture, surface.tensorTexture, colour ? colour.texture : blank].forEach((of, k) => { gl.activeTexture(gl.TEXTURE0 + k); gl.bindTexture(gl.TEXTURE_2D, of); });
  gl.bindVertexArray(surface.still);
  gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, body.moved);
  gl.beginTransformFeedback(gl.POINTS);
  gl.drawArrays(gl.POINTS, 0, surface.size);
  gl.endTransformFeedback();
  body.rest = there;
}

function moveAll(at) {
  gl.useProgram(motion.program);
  gl.uniform1i(motion.uniforms.shapes, 0);
  gl.uniform1i(motion.uniforms.tensors, 1);
  gl.uniform1i(motion.uniforms.map, 2);
  gl.enable(gl.RASTERIZER_DISCARD);
  about.bodies.filter((body) => body.shown).forEach((body) => move(body, at));
  gl.disable(gl.RASTERIZER_DISCARD);
  gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, null);
}

/** What a body is coloured by; nothing where it has a colour of its own. */
function colourOf(body) {
  const colour = about.colours[state.colour];
  return colour.kind === 2 || (colour.kind && colour.bodies.includes(body.name)) ? colour : null;
}

const IDENTITY = [1, 0, 0, 0, 1, 0, 0, 0, 1];

/** One thing drawn: rest, where it is drawn undeformed; lift, towards the eye; mapped, by the colour of each point. */
function paint(from, what, { rest, lift = 0, colour, opacity = 1, mapped = false, shaded = true }) {
  const { uniforms } = drawing, translucent = opacity < 1;
  gl[translucent ? "enable" : "disable"](gl.BLEND);
  gl.depthMask(!translucent);
  gl.uniformMatrix3fv(uniforms.A, false, rest ? rest.A : IDENTITY);
  gl.uniform3fv(uniforms.R, rest ? rest.R : [0, 0, 0]);
  gl.uniform1f(uniforms.lift, lift);
  gl.uniform1i(uniforms.shaded, shaded);
  gl.uniform1i(uniforms.mapped, mapped);
  gl.uniform3fv(uniforms.colour, colour);
  gl.uniform1f(uniforms.opacity, opacity);
  gl.bindVertexArray(from);
  gl.drawElements(...what);
}

function drawSolids(at, width, height) {
  moveAll(at);
  gl.viewport(0, 0, width, height);
  gl.clearColor(1, 1, 1, 1);
  gl.depthMask(true);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  gl.useProgram(drawing.program);
  const { uniforms } = drawing, [right, up, towards] = camera.axes;
  gl.uniformMatrix3fv(uniforms.view, false, [0, 1, 2].flatMap((c) => [right[c], up[c], towards[c]]));
  gl.uniform3fv(uniforms.target, camera.target);
  gl.uniform3f(uniforms.zoom, height / width / camera.reach, 1 / camera.reach, 1 / (2 * about.size + camera.reach));
  for (const body of about.bodies.filter((one) => one.shown).sort((a, b) => a.faint - b.faint)) {
    const surface = about.surfaces[body.surface], opacity = body.faint ? 0.3 : 1;
    gl[surface.closed ? "enable" : "disable"](gl.CULL_FACE); // nobody sees the inside
    const faces = [gl.TRIANGLES, surface.count, gl.UNSIGNED_INT, 0], lines = [gl.LINES, surface.lines, gl.UNSIGNED_INT, 4 * surface.count];
    paint(body.vertices, faces, { colour: body.shade, opacity, mapped: Boolean(colourOf(body)) });
    if ($("edges").checked) paint(body.vertices, lines, { lift: 5e-4, colour: [0.13, 0.13, 0.13], opacity, shaded: false });
    if ($("ghost").checked && surface.scales.length)
      paint(surface.undeformed, faces, { rest: body.rest, lift: -1e-3, colour: [0.5, 0.5, 0.5], opacity: 0.2 });
  }
}

// ---- lines and words over the bodies --------------------------------------------------------------------------------------

const over = $("over").getContext("2d");
let taken = []; // places and widths of words in a picture
let pixels; // point in space -> point on the screen

function line(points, colour, width = 1.5, dash = []) {
  over.strokeStyle = colour;
  over.lineWidth = width;
  over.setLineDash(dash);
  over.beginPath();
  points.forEach((point, k) => over[k ? "lineTo" : "moveTo"](...pixels(point)));
  over.stroke();
  over.setLineDash([]);
}

/** Words beside a place, below those that stand there already. */
function label(text, [x, y], colour = INK) {
  const width = over.measureText(text).width;
  while (taken.some(([a, b, wide]) => a < x + width && x < a + wide && Math.abs(b - y) < 13)) y += 13;
  taken.push([x, y, width]);
  words(text, [x, y], colour);
}

function words(text, [x, y], colour = INK, align = "left") {
  over.textAlign = align;
  over.lineWidth = 3;
  over.strokeStyle = "rgba(255,255,255,0.85)";
  over.strokeText(text, x, y);
  over.fillStyle = colour;
  over.fillText(text, x, y);
}

function arrow(from, to, colour, heads = 1) {
  line([from, to], colour, 2.2);
  const [a, b] = [pixels(from), pixels(to)], length = Math.hypot(b[0] - a[0], b[1] - a[1]);
  if (length < 2) return;
  const [dx, dy] = [(b[0] - a[0]) / length, (b[1] - a[1]) / length], size = Math.min(10, 0.6 * length);
  over.fillStyle = colour;
  for (let k = 0; k < heads; k++) {
    const x = b[0] - 0.8 * k * size * dx, y = b[1] - 0.8 * k * size * dy;
    over.beginPath();
    over.moveTo(x, y);
    for (const side of [0.4, -0.4]) over.lineTo(x - size * (dx + side * dy), y - size * (dy - side * dx));
    over.fill();
  }
}

function frame(R, A, length, letters) {
  ["#D62728", "#2CA02C", "#1F77B4"].forEach((colour, k) => {
    const tip = add(R, [A[3 * k], A[3 * k + 1], A[3 * k + 2]], length);
    line([R, tip], colour, 2);
    if (letters) words("xyz"[k], pixels(tip).map((c) => c + 3), colour);
  });
}

/** A joint: a ring at its place, its axis through it. */
function drawJoint(joint, at, named) {
  const R = between(joint.at, 3, at), [x, y] = pixels(R), size = 0.06 * about.size;
  if (joint.axis) {
    const axis = between(joint.axis, 3, at);
    line([add(R, axis, -size), add(R, axis, size)], "#8B1A8B", 2, [8, 3, 2, 3]);
  }
  over.fillStyle = "white";
  over.strokeStyle = "#8B1A8B";
  over.lineWidth = 2;
  over.beginPath();
  if (joint.kind === "fixed") over.rect(x - 5, y - 5, 10, 10); else over.arc(x, y, 5, 0, 2 * Math.PI);
  over.fill();
  over.stroke();
  if (named) label(joint.label, [x + 8, y - 8], "#8B1A8B");
}

function drawOver(at, width, height) {
  const half = 0.5 * height / camera.reach, [right, up] = camera.axes, named = $("names").checked;
  pixels = (point) => {
    const from = add(point, camera.target, -1);
    return [width / 2 + half * dot(right, from), height / 2 - half * dot(up, from)];
  };
  taken = [];
  over.clearRect(0, 0, width, height);
  over.font = "13px system-ui, sans-serif";
  for (const trace of about.traces) {
    if (trace.shown === false) continue;
    line(Array.from({ length: trace.points.length / 3 }, (_, k) => trace.points.subarray(3 * k, 3 * k + 3)), trace.colour);
  }
  const ground = about.triad;
  frame(ground.at, IDENTITY, 0.1 * about.size, true);
  if ($("frames").checked)
    for (const body of about.bodies.filter((one) => one.shown)) {
      const { R, A } = pose(body, at);
      frame(R, A, 0.06 * about.size, false);
      if (named) label(body.name, pixels(R).map((c, k) => c + [6, -6][k]));
    }
  for (const joint of about.joints) if (joint.shown) drawJoint(joint, at, named);
  for (const marker of about.markers) {
    if (!marker.shown) continue;
    const [x, y] = pixels(between(marker.at, 3, at));
    over.fillStyle = INK;
    over.fillRect(x - 2, y - 2, 4, 4);
    if (named) label(marker.name, [x + 5, y + 12]);
  }
  for (const load of about.arrows) {
    if (!load.shown) continue;
    const from = between(load.at, 3, at), vector = between(load.vector, 3, at);
    const largest = Math.max(...about.arrows.filter((o) => o.shown && o.unit === load.unit).map((o) => o.largest)) || 1;
    const to = add(from, vector, 0.25 * about.size / largest), colour = load.unit === "N" ? "#D55E00" : "#0072B2";
    arrow(from, to, colour, load.unit === "N" ? 1 : 2);
    if (named) label(`${load.name} ${short(Math.hypot(...vector))} ${load.unit}`, pixels(to).map((c) => c + 5), colour);
  }
  drawBar(width, height);
}

const short = (x) => (Math.abs(x) < 1e-3 && x ? x.toExponential(2) : String(Number(x.toPrecision(4))));

function drawBar(width, height) {
  const colour = about.colours[state.colour];
  if (!colour.map) return;
  const x = width - 74, y = 0.28 * height, tall = 0.46 * height, shades = array(colour.map), count = shades.length / 3;
  for (let k = 0; k < count; k++) {
    over.fillStyle = `rgb(${shades[3 * k]},${shades[3 * k + 1]},${shades[3 * k + 2]})`;
    over.fillRect(x, y + tall * (1 - (k + 1) / count), 16, tall / count + 1);
  }
  const high = state.limits[state.colour], low = colour.low < 0 ? -high : 0;
  for (let k = 0; k < 5; k++) words(short((low + 0.25 * k * (high - low)) * colour.factor), [x + 20, y + tall * (1 - k / 4) + 4]);
  const title = [...colour.words.split(" "), colour.unit && `[${colour.unit}]`].filter(Boolean);
  title.forEach((word, k) => words(word, [x + 16, y - 12 - 16 * (title.length - 1 - k)], INK, "center"));
}

// ---- histories ----------------------------------------------------------------------------------------------------------

const SHADES = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"];
const chosen = () => [...$("series").selectedOptions].map((option) => about.series[option.value]);
const LEFT = 74; // room for numbers beside a plot

const across = (time) => LEFT + ($("plots").clientWidth - LEFT - 12) * (time - rows[0]) / (span() || 1);

/** The chosen histories, a panel for each unit. They do not change with time: a line over them tells it. */
function drawPlots() {
  const canvas = $("plots"), series = chosen();
  $("histories").style.display = series.length ? "block" : "none";
  if (!series.length) return;
  const ratio = devicePixelRatio, width = canvas.clientWidth, height = canvas.clientHeight, pen = canvas.getContext("2d");
  [canvas.width, canvas.height] = [width * ratio, height * ratio];
  pen.scale(ratio, ratio);
  pen.font = "12px system-ui, sans-serif";
  const units = [...new Set(series.map((one) => one.unit))], each = (height - 8) / units.length;
  units.forEach((unit, k) => drawPanel(pen, series.filter((one) => one.unit === unit), 20 + k * each, each - 28, width));
}

function drawPanel(pen, group, top, tall, width) {
  const histories = group.map((one) => Array.from(rows, (_, k) => one.values[k * one.of + one.column]));
  let [low, high] = [Math.min, Math.max].map((end) => histories.flat().reduce((a, b) => end(a, b)));
  if (!(high > low)) [low, high] = [low - 1, high + 1];
  const y = (v) => top + tall * (1 - (v - low) / (high - low));
  pen.strokeStyle = "#cccccc";
  pen.strokeRect(LEFT, top, width - LEFT - 12, tall);
  pen.fillStyle = INK;
  pen.textAlign = "right";
  for (const v of [low, high]) pen.fillText(short(v), LEFT - 5, y(v) + 4);
  pen.fillText(`[${group[0].unit}]`, LEFT - 5, top + tall / 2 + 4);
  pen.textAlign = "left";
  let at = LEFT;
  histories.forEach((values, k) => {
    pen.strokeStyle = pen.fillStyle = SHADES[k % SHADES.length];
    pen.fillText(group[k].name, at, top - 5);
    at += pen.measureText(group[k].name).width + 14;
    pen.beginPath();
    values.forEach((v, row) => pen[row ? "lineTo" : "moveTo"](across(rows[row]), y(v)));
    pen.stroke();
  });
}

// ---- one picture ----------------------------------------------------------------------------------------------------------

let wanted = false;
const redraw = () => { if (!wanted) { wanted = true; requestAnimationFrame(() => { wanted = false; draw(); }); } };

function draw() {
  const stage = $("stage"), ratio = devicePixelRatio, width = stage.clientWidth, height = stage.clientHeight, at = place(state.time);
  for (const [canvas, share] of [[$("solid"), ratio * sharpness()], [$("over"), ratio]]) {
    const size = [Math.round(width * share), Math.round(height * share)];
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
  }
  drawSolids(at, $("solid").width, $("solid").height);
  over.setTransform(ratio, 0, 0, ratio, 0, 0);
  drawOver(at, width, height);
  $("now").style.left = `${across(state.time)}px`;
  $("time").value = state.time;
  $("clock").textContent = about.moments[Math.round(at.row + at.share * (at.next - at.row))] || `${short(about.clock.factor * state.time)} ${about.clock.unit}`;
  state.drawn += 1;
}

function look(direction, up) {
  const towards = unit(direction), right = unit(cross(up, towards));
  camera.axes = [right, cross(towards, right), towards];
  camera.target = about.centre.slice();
  const stage = $("stage"), reach = (axis) => 0.5 * dot(axis.map(Math.abs), about.extent) / 0.84;
  camera.reach = Math.max(reach(camera.axes[1]), reach(right) * stage.clientHeight / Math.max(stage.clientWidth, 1)) || 1;
  redraw();
}

function turn(dx, dy) {
  const [right, up, towards] = camera.axes;
  const by = (a, b, angle) => [add(a.map((c) => c * Math.cos(angle)), b, Math.sin(angle)), add(b.map((c) => c * Math.cos(angle)), a, -Math.sin(angle))];
  const [right2, towards2] = by(right, towards, 0.008 * dx), [up2, towards3] = by(up, towards2, -0.008 * dy);
  camera.axes = [unit(right2), unit(up2), unit(towards3)];
  redraw();
}

// ---- controls -----------------------------------------------------------------------------------------------------------

const VIEWS = { start: [about.camera.direction, about.camera.up], x: [[1, 0, 0], [0, 0, 1]], y: [[0, -1, 0], [0, 0, 1]], z: [[0, 0, 1], [0, 1, 0]], corner: [[0.75, -1, 0.6], [0, 0, 1]] };
function seek(time) {
  state.time = Math.min(Math.max(time, rows[0]), rows.at(-1));
  redraw();
}

function step(by) {
  play(false);
  const at = place(state.time), row = at.share >= 1 ? at.next : at.row;
  seek(rows[Math.min(Math.max(row + (by < 0 && at.share > 0 && at.share < 1 ? 0 : by), 0), rows.length - 1)]);
}

let last;
function play(on) {
  state.playing = on && span() > 0;
  if (state.playing && state.time >= rows.at(-1)) state.time = rows[0];
  $("play").textContent = state.playing ? "❚❚" : "▶";
  last = undefined;
  if (state.playing) requestAnimationFrame(tick); else redraw();
}

function tick(now) {
  if (!state.playing) return;
  if (last !== undefined) {
    state.time += ((now - last) / 1000) * state.speed * span() / about.seconds;
    if (state.time > rows.at(-1)) {
      if (state.loop) state.time = rows[0] + ((state.time - rows[0]) % span());
      else { state.time = rows.at(-1); play(false); }
    }
  }
  last = now;
  draw();
  if (state.playing) requestAnimationFrame(tick);
}

function setScale(scale) {
  if (!(scale >= 0)) return;
  state.scale = scale;
  $("scale").value = short(scale);
  $("scaling").value = scale < 0.1 ? 0 : 100 * Math.log(scale / 0.1) / Math.log(about.most / 0.1);
  redraw();
}

function setColouring(k) {
  const colour = about.colours[k];
  state.colour = k;
  $("limit").disabled = !colour.map;
  $("limit").value = colour.map ? short(state.limits[k] * colour.factor) : "";
  $("unit").textContent = colour.unit || "";
  redraw();
}

/** A list of things with a box each, and one for all. */
function list(title, things, open) {
  if (!things.length) return;
  const whole = document.createElement("details"), head = document.createElement("summary"), all = document.createElement("input");
  whole.open = open;
  all.type = "checkbox";
  all.checked = things.every((thing) => thing.shown !== false && thing.shown !== undefined);
  head.append(all, ` ${title} (${things.length})`);
  whole.append(head);
  const boxes = things.map((thing) => {
    const label = document.createElement("label"), box = document.createElement("input"), swatch = document.createElement("i");
    box.type = "checkbox";
    box.checked = thing.shown === true;
    box.dataset.name = thing.name;
    box.onchange = () => { thing.shown = box.checked; redraw(); };
    swatch.className = "swatch";
    swatch.style.background = thing.colour || "transparent";
    label.append(box, " ", ...(thing.colour ? [swatch] : []), thing.label || thing.name);
    label.title = thing.label || thing.name;
    whole.append(label);
    return box;
  });
  all.onclick = (event) => event.stopPropagation();
  all.onchange = () => boxes.forEach((box) => { box.checked = all.checked; box.onchange(); });
  $("lists").append(whole);
}

function lists() {
  list("Bodies", about.bodies, true);
  list("Joints", about.joints, about.joints.length < 20);
  list("Forces, moments", about.arrows, false);
  list("Markers", about.markers, false);
  list("Paths", about.traces, true);
  const whole = document.createElement("details"), select = document.createElement("select");
  whole.open = true;
  whole.innerHTML = "<summary>Plots</summary>";
  select.id = "series";
  select.multiple = true;
  about.series.forEach((one, k) => select.add(new Option(`${one.name} [${one.unit}]`, k, false, one.chosen)));
  select.onchange = () => { drawPlots(); redraw(); };
  whole.append(select);
  whole.hidden = !about.series.length || rows.length < 2;
  $("lists").append(whole);
}

function connect() {
  about.colours.forEach((colour, k) => $("colour").add(new Option(colour.words, k)));
  for (const speed of [0.05, 0.1, 0.25, 0.5, 1, 2, 4, 8]) $("speed").add(new Option(speed, speed, speed === 1, speed === 1));
  [$("time").min, $("time").max] = [rows[0], rows.at(-1)];
  $("play").onclick = () => play(!state.playing);
  $("back").onclick = () => step(-1);
  $("forward").onclick = () => step(1);
  $("loop").onclick = () => { state.loop = !state.loop; $("loop").ariaPressed = String(state.loop); };
  $("speed").onchange = () => { state.speed = Number($("speed").value); };
  $("time").oninput = () => { play(false); seek(Number($("time").value)); };
  $("scale").onchange = () => setScale(Number($("scale").value));
  $("scaling").oninput = () => { const s = Number($("scaling").value); setScale(s > 0 ? 0.1 * (about.most / 0.1) ** (s / 100) : 0); };
  $("colour").onchange = () => setColouring(Number($("colour").value));
  $("limit").onchange = () => { const v = Number($("limit").value) / about.colours[state.colour].factor; if (v > 0) state.limits[state.colour] = v; redraw(); };
  for (const id of ["edges", "ghost", "names", "frames"]) { $(id).checked = about.boxes.includes(id); $(id).onchange = redraw; }
  for (const button of $("views").querySelectorAll("button")) button.onclick = () => look(...VIEWS[button.dataset.view]);
  $("plots").onpointerdown = $("plots").onpointermove = (event) => {
    if (event.buttons) { play(false); seek(rows[0] + span() * (event.offsetX - LEFT) / ($("plots").clientWidth - LEFT - 12)); }
  };
  if (rows.length < 2) document.querySelector("footer").style.display = "none";
  mouse();
  addEventListener("resize", () => { drawPlots(); redraw(); });
  addEventListener("keydown", (event) => {
    if (/INPUT|SELECT|BUTTON/.test(event.target.tagName) && event.target.type !== "range") return;
    const act = { " ": () => play(!state.playing), ArrowLeft: () => step(-1), ArrowRight: () => step(1) }[event.key];
    if (act) { event.preventDefault(); act(); }
  });
}

function mouse() {
  const canvas = $("over");
  canvas.onpointerdown = (event) => canvas.setPointerCapture(event.pointerId);
  canvas.oncontextmenu = (event) => event.preventDefault();
  canvas.onpointermove = (event) => {
    if (!event.buttons) return;
    if (event.buttons === 1 && !event.shiftKey) return turn(event.movementX, event.movementY);
    const metres = 2 * camera.reach / canvas.clientHeight, [right, up] = camera.axes;
    camera.target = add(add(camera.target, right, -metres * event.movementX), up, metres * event.movementY);
    redraw();
  };
  canvas.onwheel = (event) => { event.preventDefault(); camera.reach *= Math.exp(0.001 * event.deltaY); redraw(); };
  canvas.ondblclick = () => look(...VIEWS.start);
}

async function start() {
  if (!gl) throw new Error("this browser draws no WebGL 2");
  await unpack();
  load();
  state.time = rows[0];
  state.limits = about.colours.map((colour) => colour.high);
  connect();
  lists();
  setScale(about.scale);
  $("colour").value = about.colour;
  setColouring(about.colour);
  drawPlots(); // before the view is fitted to what room is left
  look(...VIEWS.start);
  document.body.dataset.ready = "yes";
}

const ready = start().catch((error) => {
  $("stage").textContent = `This film cannot be shown: ${error.message}.`;
  throw error;
});
