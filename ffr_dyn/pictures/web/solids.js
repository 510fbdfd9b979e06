// Bodies, drawn by WebGL.

// Where there is no graphics card smooth edges cost half the time, and a film is drawn with three quarters of the pixels.
const smooth = $("solid").getContext("webgl2", { antialias: true, failIfMajorPerformanceCaveat: true });
const gl = smooth || $("solid").getContext("webgl2", { antialias: false });
const sharpness = () => (smooth || !state.playing ? 1 : 0.75);
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
