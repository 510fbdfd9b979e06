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

const about = JSON.parse($("about").textContent);
let numbers, rows; // ArrayBuffer of all arrays; times of the rows [s]

async function unpack() {
  const packed = Uint8Array.from(atob($("numbers").textContent), (letter) => letter.charCodeAt(0));
  numbers = await new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer();
}

/** The array that a reference [type, offset, length] stands for; h2: a history in whole numbers of a scale, the fourth. */
function array([type, offset, length, scale]) {
  if (type === "h2") return Float32Array.from(new Int16Array(numbers, offset, length), (whole) => whole * scale);
  return new { f4: Float32Array, i2: Int16Array, u4: Uint32Array, u1: Uint8Array }[type](numbers, offset, length);
}

// ---- vectors and matrices (columns one after the other, as WebGL has them) ------------------------------------------------

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
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
const span = () => rows.at(-1) - rows[0];
const camera = { axes: [], target: about.centre.slice(), reach: 1 }; // axes: right, up, towards the eye

/** The row before a time, and how far it is on the way to the next (0 to 1). */
function place(time) {
  const row = Math.max(Math.min(rows.findLastIndex((t) => t <= time), rows.length - 2), 0), next = Math.min(row + 1, rows.length - 1);
  const step = rows[next] - rows[row];
  return { row, next, share: step > 0 ? Math.min(Math.max((time - rows[row]) / step, 0), 1) : 0, step };
}

/** A history (rows, count) between two rows, and its rate there. */
const mixed = (values, count, at, mix) => Array.from({ length: count }, (_, k) => mix(values[at.row * count + k], values[at.next * count + k]));
const between = (values, count, at) => mixed(values, count, at, (a, b) => a + at.share * (b - a));
const rate = (values, count, at) => mixed(values, count, at, (a, b) => (at.step > 0 ? (b - a) / at.step : 0));

/** Place and axes of a body, and their rates. */
function pose(body, at) {
  const now = between(body.pose, 7, at), rateR = rate(body.pose, 7, at).slice(0, 3);
  const [before, after] = [at.row, at.next].map((row) => rotation(Array.from(body.pose.subarray(7 * row + 3, 7 * row + 7))));
  const rateA = before.map((a, k) => (at.step > 0 ? (after[k] - a) / at.step : 0));
  return { R: now.slice(0, 3), A: rotation(now.slice(3)), rateR, rateA };
}
