// Lines and words over the bodies: joints, forces, markers, paths, the colour bar.

const over = $("over").getContext("2d");
let taken = [], pixels; // places and widths of words in a picture; point in space -> point on the screen

function line(points, colour, width = 1.5, dash = []) {
  Object.assign(over, { strokeStyle: colour, lineWidth: width });
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
  Object.assign(over, { textAlign: align, lineWidth: 3, strokeStyle: "rgba(255,255,255,0.85)", fillStyle: colour });
  over.strokeText(text, x, y);
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
  const axis = joint.axis && between(joint.axis, 3, at);
  if (axis) line([add(R, axis, -size), add(R, axis, size)], "#8B1A8B", 2, [8, 3, 2, 3]);
  Object.assign(over, { fillStyle: "white", strokeStyle: "#8B1A8B", lineWidth: 2 });
  over.beginPath();
  if (joint.kind === "fixed") over.rect(x - 5, y - 5, 10, 10); else over.arc(x, y, 5, 0, 2 * Math.PI);
  over.fill();
  over.stroke();
  if (named) label(joint.label, [x + 8, y - 8], "#8B1A8B");
}

/** Places and vectors of a load, the strongest first, and whether its arrow ends there; one on a surface moves with its body. */
function exerted(load, at) {
  if (!load.pose) return [[between(load.at, 3, at), between(load.vector, 3, at), false]];
  const { R, A } = pose(load, at), moved = between(load.moved, load.at.length, at), [factor] = between(load.factor, 1, at);
  const turned = (v) => [0, 1, 2].map((r) => A[r] * v[0] + A[3 + r] * v[1] + A[6 + r] * v[2]);
  return Array.from(load.inward, (side, k) => {
    const [u, d, f] = [load.at, moved, load.vector].map((of) => of.slice(3 * k, 3 * k + 3));
    return [add(R, turned(add(u, d, state.scale))), (load.turns ? turned(f) : [...f]).map((c) => factor * c), side * factor > 0];
  });
}

function drawOver(at, width, height) {
  const half = 0.5 * height / camera.reach, [right, up] = camera.axes, named = $("names").checked;
  const seen = (axis, point) => half * (dot(axis, point) - dot(axis, camera.target));
  pixels = (point) => [width / 2 + seen(right, point), height / 2 - seen(up, point)];
  taken = [];
  over.clearRect(0, 0, width, height);
  over.font = "13px system-ui, sans-serif";
  for (const { points, colour } of about.traces.filter((one) => one.shown))
    line(Array.from({ length: points.length / 3 }, (_, k) => points.subarray(3 * k, 3 * k + 3)), colour);
  frame(about.triad.at, IDENTITY, 0.1 * about.size, true);
  if ($("frames").checked)
    for (const body of about.bodies.filter((one) => one.shown)) {
      const { R, A } = pose(body, at);
      frame(R, A, 0.06 * about.size, false);
      if (named) label(body.name, pixels(R).map((c, k) => c + [6, -6][k]));
    }
  about.joints.filter((one) => one.shown).forEach((joint) => drawJoint(joint, at, named));
  for (const marker of about.markers.filter((one) => one.shown)) {
    const [x, y] = pixels(between(marker.at, 3, at));
    over.fillStyle = INK;
    over.fillRect(x - 2, y - 2, 4, 4);
    if (named) label(marker.name, [x + 5, y + 12]);
  }
  const loads = about.arrows.filter((one) => one.shown);
  for (const load of loads) {
    const alike = load.pose ? [load] : loads.filter((one) => one.unit === load.unit && !one.pose), moment = load.unit === "N m";
    const length = (load.pose ? 0.12 : 0.25) * about.size / (Math.max(...alike.map((one) => one.largest)) || 1);
    exerted(load, at).forEach(([place, vector, inward], k) => {
      const from = inward ? add(place, vector, -length) : place, to = add(from, vector, length), colour = moment ? "#0072B2" : "#D55E00";
      arrow(from, to, colour, moment ? 2 : 1);
      if (named && !k) label(`${load.name} ${short(Math.hypot(...vector))} ${load.unit}`, pixels(inward ? from : to).map((c) => c + 5), colour);
    });
  }
  drawBar(width, height);
}

const short = (x) => (Math.abs(x) < 1e-3 && x ? x.toExponential(2) : String(Number(x.toPrecision(4))));

function drawBar(width, height) {
  const colour = about.colours[state.colour], high = state.limits[state.colour], low = colour.low < 0 ? -high : 0;
  if (!colour.map) return;
  const x = width - 74, y = 0.28 * height, tall = 0.46 * height, shades = array(colour.map), count = shades.length / 3;
  for (let k = 0; k < count; k++) {
    over.fillStyle = `rgb(${shades.subarray(3 * k, 3 * k + 3)})`;
    over.fillRect(x, y + tall * (1 - (k + 1) / count), 16, tall / count + 1);
  }
  for (let k = 0; k < 5; k++) words(short((low + 0.25 * k * (high - low)) * colour.factor), [x + 20, y + tall * (1 - k / 4) + 4]);
  const title = [...colour.words.split(" "), colour.unit && `[${colour.unit}]`].filter(Boolean);
  title.forEach((word, k) => words(word, [x + 16, y - 12 - 16 * (title.length - 1 - k)], INK, "center"));
}
