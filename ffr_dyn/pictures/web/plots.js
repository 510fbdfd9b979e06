// Histories beside the motion.

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
  Object.assign(pen, { strokeStyle: "#cccccc", fillStyle: INK, textAlign: "right" });
  pen.strokeRect(LEFT, top, width - LEFT - 12, tall);
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
