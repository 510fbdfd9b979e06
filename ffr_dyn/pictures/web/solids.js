// Bodies, drawn by WebGL.

// Where there is no graphics card smooth edges cost half the time, and a film is drawn with three quarters of the pixels.
const smooth = $("solid").getContext("webgl2", { antialias: true, failIfMajorPerformanceCaveat: true });
const gl = smooth || $("solid").getContext("webgl2", { antialias: false });
const sharpness = () => (smooth || !state.playing ? 1 : 0.75);
let blank, motion, drawing; // a texture where no colour map is needed; programs, each with its uniforms

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
    const { name, type } = gl.getActiveUniform(program, k), at = gl.getUniformLocation(program, name);
    const how = { [gl.FLOAT]: "uniform1fv", [gl.FLOAT_VEC2]: "uniform2fv", [gl.FLOAT_VEC3]: "uniform3fv" }[type] || "uniform1iv";
    uniforms[name.replace("[0]", "")] = type === gl.FLOAT_MAT3 ? (A) => gl.uniformMatrix3fv(at, false, A) : (v) => gl[how](at, v.length ? v : [v]);
  }
  return { program, uniforms };
}

/** Set uniforms of the program in use; the compiler leaves out those that change nothing. */
const give = ({ uniforms }, values) => Object.entries(values).forEach(([name, value]) => uniforms[name]?.(value));

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
  surface.corners = buffer(gl.ELEMENT_ARRAY_BUFFER, Uint32Array.from([...array(surface.triangles), ...array(surface.edges)]));
  surface.still = vertices([[points, 3, 0, 0], [moduli, 2, 0, 0]]);
  surface.undeformed = vertices([[points, 3, 0, 0]], surface.corners);
  [surface.shapeTexture, surface.tensorTexture] = [surface.shapes, surface.tensors].map((of) => shapesTexture(array(of)));
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
  for (const thing of [about.joints, about.markers, about.arrows, about.traces, about.series].flat())
    for (const [key, of] of Object.entries(thing)) if (Array.isArray(of)) thing[key] = array(of);
}

/** The points of a body at a time. */
function move(body, at) {
  const surface = about.surfaces[body.surface], here = pose(body, at), there = pose(about.bodies[body.frame], at);
  const count = surface.scales.length, tensors = surface.tensorScales, colour = colourOf(body), limit = state.limits[state.colour];
  const now = between(body.weights, count, at), rates = rate(body.weights, count, at);
  const weights = surface.scales.flatMap((scale, k) => {
    const drawn = body.parted ? 1 : k < surface.linear ? state.scale : state.scale * state.scale;
    return [scale * now[k] * drawn, scale * now[k], scale * rates[k]];
  });
  give(motion, {
    R: here.R, A: here.A, rateR: here.rateR, rateA: here.rateA, R0: there.R, A0: there.A, blend: body.parted ? state.scale : 1,
    shapeCount: count, tensorCount: tensors.length, kind: colour ? colour.kind : 0, measure: colour ? colour.measure : 0,
    range: [colour && colour.low < 0 ? -limit : 0, limit],
  });
  if (count) give(motion, { weights });
  if (tensors.length) give(motion, { stresses: between(body.tensors, tensors.length, at).map((w, k) => w * tensors[k]) });
  [surface.shapeTexture, surface.tensorTexture, colour ? colour.texture : blank].forEach((of, k) => {
    gl.activeTexture(gl.TEXTURE0 + k);
    gl.bindTexture(gl.TEXTURE_2D, of);
  });
  gl.bindVertexArray(surface.still);
  gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, body.moved);
  gl.beginTransformFeedback(gl.POINTS);
  gl.drawArrays(gl.POINTS, 0, surface.size);
  gl.endTransformFeedback();
  body.rest = there;
}

function moveAll(at) {
  gl.useProgram(motion.program);
  give(motion, { shapes: 0, tensors: 1, map: 2 });
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
  gl[opacity < 1 ? "enable" : "disable"](gl.BLEND);
  gl.depthMask(opacity === 1);
  give(drawing, { A: rest ? rest.A : IDENTITY, R: rest ? rest.R : [0, 0, 0], lift, shaded, mapped, colour, opacity });
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
  const zoom = [height / width / camera.reach, 1 / camera.reach, 1 / (2 * about.size + camera.reach)];
  give(drawing, { view: [0, 1, 2].flatMap((c) => camera.axes.map((axis) => axis[c])), target: camera.target, zoom });
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
