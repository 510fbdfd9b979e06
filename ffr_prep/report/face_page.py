"""A page that shows the faces of a part and tells what to type for the one that is clicked.

One file without any request: points and triangles are in it as base64, drawn by WebGL2. A click casts a ray through the
triangles. Flat shading takes the normals of the triangles from the derivatives of the position.
"""

from __future__ import annotations

import base64
import json
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.outputs import replacing
from ffr_prep.mesh.geometry.faces import Faces, feature_in_words
from ffr_prep.mesh.geometry.regions import query_for


def face_page(faces: Faces, path: str | Path, title: str = "faces") -> Path:
    """Write the page; returns its path. A click picks a feature, with Alt one face; Shift adds to what is picked.

    Raises InputError for a path that is a folder or a link, ComputationError where the file cannot be written.

    >>> fp.face_page(fp.faces("plate.step"), "faces.html")
    """
    path = Path(path)
    with replacing(path) as part:
        part.write_text(page_of(faces, title), encoding="utf-8")
    return path


def page_of(faces: Faces, title: str) -> str:
    """The page as a text."""
    data = json.dumps(_data(faces)).replace("</", "<\\/")
    return _PAGE.replace("@TITLE@", escape(title)).replace("@DATA@", data)


def _data(faces: Faces) -> dict[str, Any]:
    triangles = np.concatenate(faces.triangles)
    used, places = np.unique(triangles, return_inverse=True)
    middle = (faces.points[used].max(axis=0) + faces.points[used].min(axis=0)) / 2
    scaled = (faces.points[used] - middle) / (faces.size / 2)
    owner = np.repeat(np.arange(len(faces)), [len(t) for t in faces.triangles])
    return {
        "points": _packed(scaled.astype("<f4")),
        "triangles": _packed(places.astype("<u4")),
        "owner": _packed(owner.astype("<u4")),
        "borders": _packed(np.searchsorted(used, _borders(faces)).astype("<u4")),
        "faces": [{"name": face.name, "colour": face.colour} for face in faces.faces],
        "features": [
            {"faces": list(of), "type": query_for(faces, of), "what": feature_in_words(faces, of)}
            for of in faces.features
        ],
    }


def _borders(faces: Faces) -> Array:
    """(B, 2) edges that belong to one triangle of a face only."""
    found = [np.zeros((0, 2), np.int64)]
    for triangles in faces.triangles:
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, counts = np.unique(edges, axis=0, return_counts=True)
        found.append(unique[counts == 1])
    return np.unique(np.concatenate(found), axis=0)


def _packed(values: Array) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>@TITLE@</title>
<style>
body { margin: 0; display: flex; height: 100vh; font: 14px/1.4 system-ui, sans-serif; color: #222; background: #fff; }
#left { flex: 1; min-width: 0; position: relative; }
canvas { width: 100%; height: 100%; display: block; cursor: crosshair; }
#right { width: 27rem; overflow: auto; border-left: 1px solid #ccc; padding: 0.8rem; }
#hint { position: absolute; left: 0.8rem; bottom: 0.6rem; color: #666; font-size: 12px; pointer-events: none; }
h1 { font-size: 16px; margin: 0 0 0.5rem; }
#type { width: 100%; box-sizing: border-box; font: 13px/1.4 monospace; padding: 0.4rem; resize: vertical; }
#name { width: 8rem; font: 13px monospace; }
li { cursor: pointer; padding: 0.15rem 0.3rem; list-style: none; border-radius: 3px; }
li:hover { background: #eef2f7; } li.on { background: #ffe3b0; }
ul { padding: 0; margin: 0.6rem 0 0; } small { color: #666; display: block; }
</style></head><body>
<div id="left"><canvas id="view" tabindex="0"></canvas>
<div id="hint">click: a surface (Alt: one face of it, Shift: add) &middot; drag: turn &middot; right drag: move &middot;
wheel: zoom</div></div>
<div id="right"><h1>@TITLE@</h1>
<label>interface <input id="name" value="NAME" spellcheck="false"></label> <button id="copy">copy</button>
<textarea id="type" rows="3" readonly>click a face</textarea>
<ul id="list"></ul></div>
<script>
"use strict";
const D = @DATA@;
const unpack = (text, Kind) => new Kind(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);
const P = unpack(D.points, Float32Array), T = unpack(D.triangles, Uint32Array);
const owner = unpack(D.owner, Uint32Array), borders = unpack(D.borders, Uint32Array);
const featureOf = []; D.features.forEach((f, k) => f.faces.forEach(i => featureOf[i] = k));
const $ = id => document.getElementById(id), canvas = $("view");
const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
if (!gl) $("hint").textContent = "this browser has no WebGL2: pick in the list";
let picked = new Set();  // of faces
let R = [0.85, 0.53, 0, -0.23, 0.37, 0.9, 0.47, -0.76, 0.43], zoom = 1, shift = [0, 0];

// ---- drawing: rows of R are right, up and towards the viewer
const SHADE = `#version 300 es
in vec3 p; in vec3 c; uniform mat3 R; uniform vec4 s; out vec3 q; out vec3 colour;
void main() { q = R * p; colour = c; gl_Position = vec4((q.xy - s.zw) * s.xy, -q.z * 0.4, 1.0); }`;
const LIT = `#version 300 es
precision highp float; in vec3 q; in vec3 colour; uniform float lines; out vec4 o;
void main() { vec3 n = normalize(cross(dFdx(q), dFdy(q)));
  float l = 0.45 + 0.4 * abs(n.z) + 0.15 * max(dot(n, vec3(-0.4, 0.8, 0.45)), 0.0);
  o = vec4(lines > 0.5 ? vec3(0.15) : colour * l, 1.0); }`;
const COLOURS = ["#c3d7e8", "#dfe3c6", "#d9cfe6", "#cfe5da", "#ead9c9", "#d4dbe0"];
const rgb = hex => [1, 3, 5].map(k => parseInt(hex.slice(k, k + 2), 16) / 255);
let program, corner, tint, edges, at = {};
function make(kind, text) { const s = gl.createShader(kind); gl.shaderSource(s, text); gl.compileShader(s); return s; }
function prepare() {
  program = gl.createProgram();
  gl.attachShader(program, make(gl.VERTEX_SHADER, SHADE)); gl.attachShader(program, make(gl.FRAGMENT_SHADER, LIT));
  gl.linkProgram(program); gl.useProgram(program);
  for (const u of ["R", "s", "lines"]) at[u] = gl.getUniformLocation(program, u);
  const own = new Float32Array(3 * T.length);  // corners of their own for each triangle, so that colours do not run
  T.forEach((v, k) => own.set(P.subarray(3 * v, 3 * v + 3), 3 * k));
  const ends = new Float32Array(3 * borders.length);
  borders.forEach((v, k) => ends.set(P.subarray(3 * v, 3 * v + 3), 3 * k));
  [corner, tint, edges] = [own, new Float32Array(3 * T.length), ends].map(values => {
    const b = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, b); gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW); return b; });
}
function paint() {
  const c = new Float32Array(3 * T.length);
  owner.forEach((face, k) => {
    const colour = rgb(picked.has(face) ? "#ff9f1c" : D.faces[face].colour || COLOURS[featureOf[face] % COLOURS.length]);
    for (let j = 0; j < 3; j++) c.set(colour, 9 * k + 3 * j); });
  if (gl) { gl.bindBuffer(gl.ARRAY_BUFFER, tint); gl.bufferData(gl.ARRAY_BUFFER, c, gl.DYNAMIC_DRAW); draw(); }
}
function scales() {
  const w = canvas.clientWidth || 1, h = canvas.clientHeight || 1, k = zoom * 0.95;
  return w > h ? [k * h / w, k] : [k, k * w / h];
}
function draw() {
  const ratio = window.devicePixelRatio || 1;
  canvas.width = canvas.clientWidth * ratio; canvas.height = canvas.clientHeight * ratio;
  gl.viewport(0, 0, canvas.width, canvas.height); gl.clearColor(1, 1, 1, 1); gl.enable(gl.DEPTH_TEST);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.uniformMatrix3fv(at.R, true, R); gl.uniform4f(at.s, ...scales(), ...shift);
  const bind = (name, buffer) => { const a = gl.getAttribLocation(program, name); if (a < 0) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.enableVertexAttribArray(a);
    gl.vertexAttribPointer(a, 3, gl.FLOAT, false, 0, 0); };
  gl.enable(gl.POLYGON_OFFSET_FILL); gl.polygonOffset(1, 1);
  gl.uniform1f(at.lines, 0); bind("p", corner); bind("c", tint); gl.drawArrays(gl.TRIANGLES, 0, T.length);
  gl.disable(gl.POLYGON_OFFSET_FILL);
  gl.uniform1f(at.lines, 1); gl.disableVertexAttribArray(gl.getAttribLocation(program, "c"));
  bind("p", edges); gl.drawArrays(gl.LINES, 0, borders.length);
}

// ---- picking: the triangle nearest to the viewer at a point of the canvas
const seen = v => [0, 3, 6].map(r => R[r] * P[3 * v] + R[r + 1] * P[3 * v + 1] + R[r + 2] * P[3 * v + 2]);
function faceAt(x, y) {
  const [sx, sy] = scales();
  const px = (2 * x / canvas.clientWidth - 1) / sx + shift[0], py = (1 - 2 * y / canvas.clientHeight) / sy + shift[1];
  const Q = []; for (let v = 0; 3 * v < P.length; v++) Q.push(seen(v));
  let best = -Infinity, face = -1;
  for (let k = 0; k < T.length; k += 3) {
    const [a, b, c] = [Q[T[k]], Q[T[k + 1]], Q[T[k + 2]]];
    const d = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
    if (Math.abs(d) < 1e-14) continue;
    const u = ((px - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (py - a[1])) / d;
    const w = ((b[0] - a[0]) * (py - a[1]) - (px - a[0]) * (b[1] - a[1])) / d;
    if (u < 0 || w < 0 || u + w > 1) continue;
    const z = a[2] + u * (b[2] - a[2]) + w * (c[2] - a[2]);
    if (z > best) { best = z; face = owner[k / 3]; }
  }
  return face;
}
function choose(faces, add) {
  if (!add) picked = new Set();
  const all = faces.every(f => picked.has(f));
  faces.forEach(f => add && all ? picked.delete(f) : picked.add(f));
  tell(); paint();
}
function typed() {
  const words = [], left = new Set(picked);
  for (const f of D.features)
    if (f.faces.every(k => left.has(k))) { words.push(f.type); f.faces.forEach(k => left.delete(k)); }
  left.forEach(k => words.push(D.faces[k].name));
  return words.join(" + ");
}
function tell() {
  const text = typed();
  $("type").value = text ? `--interface "${$("name").value}=${text}"` : "click a face";
  [...$("list").children].forEach((li, k) => li.classList.toggle("on", D.features[k].faces.some(f => picked.has(f))));
}
D.features.forEach((f, k) => {
  const li = document.createElement("li"), small = document.createElement("small");
  li.textContent = f.type;
  small.textContent = f.faces.map(i => D.faces[i].name).join("+") + ": " + f.what.split(";")[0];
  li.append(small); li.onclick = e => choose(f.faces, e.shiftKey); $("list").append(li); });
$("name").oninput = tell;
$("copy").onclick = () => { $("type").select(); document.execCommand("copy"); };

// ---- mouse
let from = null, moved = 0;
canvas.onpointerdown = e => {
  from = [e.clientX, e.clientY, e.button]; moved = 0;
  if (e.isTrusted) canvas.setPointerCapture(e.pointerId);
};
canvas.onpointermove = e => {
  if (!from) return;
  const dx = e.clientX - from[0], dy = e.clientY - from[1];
  moved += Math.abs(dx) + Math.abs(dy); from[0] = e.clientX; from[1] = e.clientY;
  if (from[2] || e.ctrlKey) {
    const [sx, sy] = scales();
    shift = [shift[0] - 2 * dx / canvas.clientWidth / sx, shift[1] + 2 * dy / canvas.clientHeight / sy];
  } else { turn(0, 2, dx * 0.008); turn(1, 2, -dy * 0.008); }
  if (gl) draw();
};
canvas.onpointerup = e => {
  if (from && moved < 4 && !from[2]) {
    const box = canvas.getBoundingClientRect(), face = faceAt(e.clientX - box.left, e.clientY - box.top);
    if (face >= 0) choose(e.altKey ? [face] : D.features[featureOf[face]].faces, e.shiftKey);
    else if (!e.shiftKey) choose([], false);
  }
  from = null;
};
canvas.oncontextmenu = e => e.preventDefault();
canvas.onwheel = e => { e.preventDefault(); zoom *= Math.exp(-e.deltaY * 0.001); if (gl) draw(); };
function turn(i, j, angle) {  // two rows of R about the third
  const c = Math.cos(angle), s = Math.sin(angle);
  for (let k = 0; k < 3; k++) {
    const a = R[3 * i + k], b = R[3 * j + k];
    R[3 * i + k] = c * a + s * b; R[3 * j + k] = c * b - s * a;
  }
}
(function square() {  // R exactly orthonormal
  const n = v => { const l = Math.hypot(...v); return v.map(x => x / l); };
  const x = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const t = n(R.slice(6)), r = n(x([0, 0, 1], t)); R = [...r, ...x(t, r), ...t]; })();
if (gl) { prepare(); new ResizeObserver(draw).observe(canvas); }
paint();
</script></body></html>
"""
