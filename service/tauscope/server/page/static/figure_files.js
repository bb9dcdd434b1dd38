// A plot as a file: PNG as it is on the screen, SVG redrawn, CSV with every sample of the range that is shown.

import { s } from "./dom.js";

const WIDTH = 960;
const HEIGHT = 420;
const ROOM = { left: 78, right: 16, top: 40, bottom: 56 };
const TEXT = 13;

export const fileName = (label) => label.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "") || "plot";

export function csvText(xLabel, series, x, columns, [from, to]) {
  const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  const rows = [[xLabel, ...series.map((each) => each.label)].map(quoted).join(",")];
  for (let row = 0; row < x.length; row += 1) {
    if (x[row] >= from && x[row] <= to) rows.push([x[row], ...columns.map((column) => (Number.isFinite(column[row]) ? column[row] : ""))].join(","));
  }
  return `${rows.join("\n")}\n`;
}

export function pngBlob(chart, spec, css) {
  const source = chart.ctx.canvas;
  const ratio = source.width / chart.width;
  const room = 2 * 22 * ratio;
  const canvas = document.createElement("canvas");
  canvas.width = source.width;
  canvas.height = source.height + room;
  const ctx = canvas.getContext("2d");
  ctx.fillStyle = css("--paper");
  ctx.fillRect(0, 0, canvas.width, canvas.height);
  ctx.font = `600 ${TEXT * ratio}px system-ui, sans-serif`;
  ctx.fillStyle = css("--ink");
  ctx.fillText(spec.label, 8 * ratio, 17 * ratio);
  ctx.font = `${TEXT * ratio}px system-ui, sans-serif`;
  let left = 8 * ratio;
  for (const each of spec.series.filter((one) => !one.hidden)) {
    ctx.fillStyle = css(each.colour);
    ctx.fillRect(left, 33 * ratio, 14 * ratio, 3 * ratio);
    ctx.fillStyle = css("--ink");
    ctx.fillText(each.label, left + 19 * ratio, 38 * ratio);
    left += ctx.measureText(each.label).width + 38 * ratio;
  }
  ctx.drawImage(source, 0, room);
  return new Promise((done) => { canvas.toBlob(done, "image/png"); });
}

function ticks(low, high, most) {
  const rough = (high - low) / most || 1;
  const unit = 10 ** Math.floor(Math.log10(rough));
  const step = unit * [1, 2, 5, 10].find((each) => each * unit >= rough);
  const found = [];
  for (let value = Math.ceil(low / step) * step; value <= high + 1e-9 * step; value += step) found.push(Number(value.toPrecision(10)));
  return found;
}

export function svgText(chart, spec, css) {
  const [x, ...columns] = chart.data;
  const range = (scale) => [chart.scales[scale].min, chart.scales[scale].max];
  const [from, to] = range("x");
  const straight = (value) => (spec.log ? Math.log10(value) : value);
  const [low, high] = range("y").map(straight);
  const across = (value) => ROOM.left + ((value - from) / (to - from)) * (WIDTH - ROOM.left - ROOM.right);
  const up = (value) => HEIGHT - ROOM.bottom - ((value - low) / (high - low)) * (HEIGHT - ROOM.top - ROOM.bottom);
  const line = (x1, y1, x2, y2) => s("line", { x1, y1, x2, y2, stroke: css("--line") });
  const word = (at, y, text, more) => s("text", { x: at, y, fill: css("--ink"), "font-family": "sans-serif", "font-size": TEXT, text, ...more });
  const named = (value) => `${spec.log ? Number((10 ** value).toPrecision(3)) : value}`.replace("-", "−");
  const shown = spec.series.map((each, place) => [each, columns[place]]).filter(([each], place) => !each.hidden && chart.series[place + 1].show);
  let left = ROOM.left;
  const keys = shown.map(([each]) => {
    const key = [s("line", { x1: left, x2: left + 14, y1: 30, y2: 30, stroke: css(each.colour), "stroke-width": 3 }), word(left + 19, 34, each.label)];
    left += 34 + 0.58 * TEXT * each.label.length;
    return key;
  });
  const svg = s("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, width: WIDTH, height: HEIGHT },
    s("rect", { width: WIDTH, height: HEIGHT, fill: css("--paper") }), word(ROOM.left, 17, spec.label, { "font-weight": 600 }), keys,
    s("clipPath", { id: "inside" }, s("rect", { x: ROOM.left, y: ROOM.top, width: WIDTH - ROOM.left - ROOM.right, height: HEIGHT - ROOM.top - ROOM.bottom })),
    ticks(from, to, 9).map((value) => [line(across(value), ROOM.top, across(value), HEIGHT - ROOM.bottom), word(across(value), HEIGHT - ROOM.bottom + 18, `${value}`.replace("-", "−"), { "text-anchor": "middle" })]),
    ticks(low, high, 6).map((value) => [line(ROOM.left, up(value), WIDTH - ROOM.right, up(value)), word(ROOM.left - 8, up(value) + 4, named(value), { "text-anchor": "end" })]),
    word((WIDTH + ROOM.left) / 2, HEIGHT - 12, spec.xLabel, { "text-anchor": "middle" }),
    word(0, 0, spec.yLabel, { transform: `translate(18 ${(HEIGHT + ROOM.top - ROOM.bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }),
    s("g", { "clip-path": "url(#inside)" }, shown.map(([each, values]) => curve(each, x, values, across, (value) => up(straight(value)), css))));
  return new XMLSerializer().serializeToString(svg);
}

function curve(each, x, values, across, up, css) {
  const places = Array.from(x, (value, k) => (values[k] === null || values[k] === undefined || !Number.isFinite(up(values[k])) ? null : [across(value), up(values[k])]));
  if (each.points) return places.filter(Boolean).map(([cx, cy]) => s("circle", { cx: cx.toFixed(2), cy: cy.toFixed(2), r: 2.5, fill: css(each.colour) }));
  let isOpen = false;
  const path = places.map((at) => {
    const step = at ? `${isOpen ? "L" : "M"}${at[0].toFixed(2)} ${at[1].toFixed(2)}` : "";
    isOpen = Boolean(at);
    return step;
  }).join("");
  return s("path", { d: path, fill: "none", stroke: css(each.colour), "stroke-width": each.width ?? 1.25, "stroke-dasharray": each.dash?.join(" "), "stroke-linejoin": "round" });
}
