// Pictures, one after the other, and what steers them.

let wanted = false, last; // whether a picture is on its way; when the last one of a film was drawn
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
  const moment = about.moments[Math.round(at.row + at.share * (at.next - at.row))];
  $("clock").textContent = moment || `${short(about.clock.factor * state.time)} ${about.clock.unit}`;
  state.drawn += 1;
}

function look(direction, up) {
  const towards = unit(direction), right = unit(cross(up, towards));
  Object.assign(camera, { axes: [right, cross(towards, right), towards], target: about.centre.slice() });
  const stage = $("stage"), reach = (axis) => 0.5 * dot(axis.map(Math.abs), about.extent) / 0.84;
  camera.reach = Math.max(reach(camera.axes[1]), reach(right) * stage.clientHeight / Math.max(stage.clientWidth, 1)) || 1;
  redraw();
}

function turn(dx, dy) {
  const [right, up, towards] = camera.axes;
  const mix = (a, b, angle) => unit(add(a.map((c) => c * Math.cos(angle)), b, Math.sin(angle)));
  const [x, y] = [0.008 * dx, -0.008 * dy], near = mix(towards, right, -x);
  camera.axes = [mix(right, towards, x), mix(up, near, y), mix(near, up, -y)];
  redraw();
}

// ---- controls -----------------------------------------------------------------------------------------------------------

const [UP, { direction, up }] = [[0, 0, 1], about.camera];
const VIEWS = { start: [direction, up], x: [[1, 0, 0], UP], y: [[0, -1, 0], UP], z: [UP, [0, 1, 0]], corner: [[0.75, -1, 0.6], UP] };
const seek = (time) => { play(false); state.time = Math.min(Math.max(time, rows[0]), rows.at(-1)); redraw(); };

function step(by) {
  const at = place(state.time), row = at.share >= 1 ? at.next : at.row;
  seek(rows[Math.min(Math.max(row + (by < 0 && at.share > 0 && at.share < 1 ? 0 : by), 0), rows.length - 1)]);
}

function play(on) {
  state.playing = on && span() > 0;
  if (state.playing && state.time >= rows.at(-1)) state.time = rows[0];
  $("play").textContent = state.playing ? "❚❚" : "▶";
  last = undefined;
  if (state.playing) requestAnimationFrame(tick); else redraw();
}

function tick(now) {
  if (!state.playing) return;
  const time = state.time + (last === undefined ? 0 : ((now - last) / 1000) * state.speed * span() / about.seconds);
  last = now;
  if (time > rows.at(-1) && !state.loop) { state.time = rows.at(-1); return play(false); }
  state.time = time > rows.at(-1) ? rows[0] + ((time - rows[0]) % span()) : time;
  draw();
  requestAnimationFrame(tick);
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
  Object.assign($("limit"), { disabled: !colour.map, value: colour.map ? short(state.limits[k] * colour.factor) : "" });
  $("unit").textContent = colour.unit || "";
  redraw();
}

/** A list of things with a box each, and one for all. */
function list(title, things, open) {
  if (!things.length) return;
  const [whole, first] = ["list", "item"].map((id) => $(id).content.firstElementChild.cloneNode(true));
  const [all, words] = whole.firstElementChild.children;
  whole.open = open;
  words.textContent = `${title} (${things.length})`;
  all.checked = things.every((thing) => thing.shown);
  const boxes = things.map((thing) => {
    const label = first.cloneNode(true), [box, swatch, name] = label.children;
    Object.assign(box, { checked: thing.shown, onchange: () => { thing.shown = box.checked; redraw(); } });
    box.dataset.name = thing.name;
    Object.assign(swatch, { hidden: !thing.colour, style: `background: ${thing.colour}` });
    label.title = name.textContent = thing.label || thing.name;
    whole.append(label);
    return box;
  });
  all.onclick = (event) => event.stopPropagation();
  all.onchange = () => boxes.forEach((box) => { box.checked = all.checked; box.onchange(); });
  $("lists").append(whole);
}

function lists() {
  const { bodies, joints, arrows, markers, traces } = about, small = joints.length < 20;
  for (const [title, things, open] of [["Bodies", bodies, true], ["Joints", joints, small], ["Forces, moments", arrows, false],
    ["Markers", markers, false], ["Paths", traces, true]]) list(title, things, open);
  about.series.forEach((one, k) => $("series").add(new Option(`${one.name} [${one.unit}]`, k, false, one.chosen)));
  $("series").onchange = () => { drawPlots(); redraw(); };
  $("plotted").hidden = !about.series.length || rows.length < 2;
  $("lists").append($("plotted"));
}

function connect() {
  about.colours.forEach((colour, k) => $("colour").add(new Option(colour.words, k)));
  [$("time").min, $("time").max] = [rows[0], rows.at(-1)];
  $("play").onclick = () => play(!state.playing);
  for (const [id, by] of [["back", -1], ["forward", 1]]) $(id).onclick = () => step(by);
  $("loop").onclick = () => { state.loop = !state.loop; $("loop").ariaPressed = String(state.loop); };
  $("speed").onchange = () => { state.speed = Number($("speed").value); };
  $("time").oninput = () => seek(Number($("time").value));
  $("scale").onchange = () => setScale(Number($("scale").value));
  $("scaling").oninput = () => { const s = Number($("scaling").value); setScale(s > 0 ? 0.1 * (about.most / 0.1) ** (s / 100) : 0); };
  $("colour").onchange = () => setColouring(Number($("colour").value));
  $("limit").onchange = () => {
    const limit = Number($("limit").value) / about.colours[state.colour].factor;
    if (limit > 0) state.limits[state.colour] = limit;
    redraw();
  };
  for (const id of ["edges", "ghost", "names", "frames"]) { $(id).checked = about.boxes.includes(id); $(id).onchange = redraw; }
  for (const button of $("views").querySelectorAll("button")) button.onclick = () => look(...VIEWS[button.dataset.view]);
  $("plots").onpointerdown = $("plots").onpointermove = (event) => {
    if (event.buttons) seek(rows[0] + span() * (event.offsetX - LEFT) / ($("plots").clientWidth - LEFT - 12));
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
  Object.assign(state, { time: rows[0], limits: about.colours.map((colour) => colour.high) });
  connect();
  lists();
  setScale(about.scale);
  $("colour").value = about.colour;
  setColouring(about.colour);
  drawPlots(); // before the view is fitted to what room is left
  look(...VIEWS.start);
  document.body.dataset.ready = "yes";
}

const ready = start().catch((error) => { $("stage").textContent = `This film cannot be shown: ${error.message}.`; throw error; });
