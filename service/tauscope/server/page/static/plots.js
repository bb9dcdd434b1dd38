// Plots over uPlot: many samples thinned to what a screen shows, zoomed by mouse, keys or buttons, in step with each other.

import { h, number } from "./dom.js";
import { saveAs } from "./api.js";
import { csvText, fileName, pngBlob, svgText } from "./figure_files.js";
import { nearest, thinned } from "./thinning.js";

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const alive = new Set();

export function recolour() {
  for (const plot of alive) plot.redraw(false, true);
}

/**
 * A plot over a common axis.
 *
 * spec: { label, x: column, xLabel, yLabel, height, group, log, band: [low, high],
 *         onCursor: told the instant under the mouse, series: [{ label, values, colour, width, dash, points: in place of a line, marks: on the line }] }
 */
export function plot(spec) {
  const holder = h("div", { class: `canvas ${spec.tall ? "tall" : ""}`, tabindex: "0", role: "group", "aria-label": `${spec.label}. Arrow keys move, plus and minus zoom, zero shows everything.` });
  const legend = h("div", { class: "legend" });
  const box = h("figure", { class: "plot" }, h("figcaption", {}, h("span", { text: spec.label }), legend, files()), holder);
  let time = spec.x;
  const columns = spec.series.map((each) => each.values);
  const full = [time[0], time[time.length - 1]];
  let chart = null;
  let pending = null;
  let isPointed = false; // whether the cursor is put there by the page, not by the reader

  const width = () => Math.max(Math.floor(holder.clientWidth), 60);
  const height = () => Math.max(Math.floor(holder.clientHeight), 80);
  const data = (from, to) => (spec.raw ? [Array.from(time), ...columns.map((c) => Array.from(c))] : thinned(time, columns, from, to, Math.ceil(width() / 2)));

  function rescaled() {
    const range = pending;
    pending = null;
    if (!chart || !range) return;
    // Everything in one batch: the plot is drawn once.
    chart.batch(() => {
      if (!spec.raw) chart.setData(data(...range), false);
      chart.setScale("x", { min: range[0], max: range[1] });
    });
  }

  /** Draw once in the next frame, however often it is asked for. */
  function later(min, max) {
    if (!pending) requestAnimationFrame(rescaled);
    pending = [min, max];
  }

  function zoom(min, max) {
    const [low, high] = full;
    const span = Math.min(max - min, high - low);
    const start = Math.min(Math.max(min, low), high - span);
    for (const other of spec.group?.members ?? [api]) other.show(start, start + span);
  }

  const api = {
    element: box,
    holder,
    show(min, max) {
      if (chart) later(min, max);
    },
    replace(x, values) {
      time = x;
      spec.series.forEach((each, place) => { columns[place] = values[place]; });
      chart?.setData([x, ...values]);
    },
    /** Put the cursor at an instant. */
    point(at) {
      if (!chart) return;
      isPointed = true;
      chart.setCursor({ left: chart.valToPos(at, "x"), top: 0 });
      isPointed = false;
    },
    redraw: (...args) => chart?.redraw(...args),
    zoom,
    range: () => pending ?? [chart.scales.x.min, chart.scales.x.max],
    full: () => zoom(...full),
  };
  spec.group?.members.add(api);

  const readings = spec.series.map(() => h("output", { class: "reading" }));
  const instant = h("span", { class: "key instant" });

  function read(u) {
    const isThere = u.cursor.left >= 0 && u.cursor.idx !== null;
    const row = isThere ? nearest(time, u.posToVal(u.cursor.left, "x")) : -1;
    readings.forEach((each, place) => { each.textContent = isThere ? number(columns[place][row] ?? NaN, 4) : ""; });
    if (isThere && !isPointed) spec.onCursor?.(time[row]);
    instant.textContent = isThere ? `at ${number(time[row], 5)}` : "";
  }

  function files() {
    const save = {
      PNG: async () => saveAs(await pngBlob(chart, spec, css), `${fileName(spec.label)}.png`),
      SVG: () => saveAs(new Blob([svgText(chart, spec, css)], { type: "image/svg+xml" }), `${fileName(spec.label)}.svg`),
      CSV: () => saveAs(new Blob([csvText(spec.xLabel, spec.series, time, columns, api.range())], { type: "text/csv" }), `${fileName(spec.label)}.csv`),
    };
    return h("span", { class: "files", role: "group", "aria-label": `Save ${spec.label}` },
      Object.entries(save).map(([name, write]) => h("button", { type: "button", class: "link", text: name, onclick: () => { if (chart) write(); } })));
  }

  /** Marks of an axis, written as all other numbers are: not in the manner of the browser's language. */
  const marks = (_, values) => values.map((value) => (value === null ? "" : `${Number(value.toPrecision(10))}`.replace("-", "−")));

  function begin() {
    const text = 0.76 * parseFloat(getComputedStyle(document.documentElement).fontSize);
    const font = `${text.toFixed(1)}px system-ui, sans-serif`;
    const axis = (label, more) => ({
      stroke: () => css("--muted"), font, labelFont: font, label, values: marks, labelSize: 1.6 * text, space: 3.2 * text, grid: { stroke: () => css("--line"), width: 1 }, ticks: { stroke: () => css("--line"), width: 1 }, ...more,
    });
    chart = new window.uPlot({
      width: width(), height: height(), legend: { show: false }, padding: [8, 8, 0, 0],
      cursor: { y: false, drag: { x: true, y: false, setScale: false }, points: { show: false }, sync: spec.group ? { key: spec.group.key, setSeries: false } : undefined },
      scales: { x: { time: false, range: spec.xRange }, y: spec.log ? { distr: 3 } : { range: spec.yRange } },
      axes: [axis(spec.xLabel, { size: 2.8 * text, space: 5 * text }), axis(spec.yLabel, { size: 4.8 * text })],
      series: [{ label: spec.xLabel }, ...spec.series.map((each) => ({
        label: each.label, stroke: () => css(each.colour), width: each.width ?? 1.25, dash: each.dash, show: each.show ?? true,
        spanGaps: false, paths: each.points ? () => null : undefined,
        points: { show: Boolean(each.points || each.marks), size: each.points ? 5 : each.marks ? 8 : 0, fill: () => css(each.colour), stroke: () => css(each.colour) },
      }))],
      bands: (spec.bands ?? []).map((each) => ({ series: each.series, fill: () => css("--band") })),
      hooks: {
        drawClear: [(u) => {
          if (!spec.noise) return;
          const top = u.valToPos(spec.noise, "y", true);
          const bottom = u.valToPos(-spec.noise, "y", true);
          u.ctx.fillStyle = css("--band");
          u.ctx.fillRect(u.bbox.left, Math.max(top, u.bbox.top), u.bbox.width, Math.min(bottom, u.bbox.top + u.bbox.height) - Math.max(top, u.bbox.top));
        }],
        setCursor: [read],
        setSelect: [(u) => {
          if (u.select.width < 4) return;
          zoom(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x"));
          u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
        }],
      },
    }, data(...full), holder);
    holder.ondblclick = () => api.full();
    alive.add(chart);
    api.chart = chart;
    new ResizeObserver(() => {
      if (!holder.isConnected) return;
      chart.setSize({ width: width(), height: height() });
      if (!spec.raw) later(chart.scales.x.min, chart.scales.x.max);
    }).observe(holder);
  }

  holder.addEventListener("keydown", (event) => {
    if (!chart) return;
    const [min, max] = api.range();
    const span = max - min;
    const moves = {
      ArrowLeft: [min - 0.2 * span, max - 0.2 * span], ArrowRight: [min + 0.2 * span, max + 0.2 * span],
      "+": [min + 0.2 * span, max - 0.2 * span], "-": [min - 0.33 * span, max + 0.33 * span], 0: full,
    };
    if (moves[event.key]) { event.preventDefault(); zoom(...moves[event.key]); }
  });

  spec.series.forEach((each, place) => {
    if (each.hidden) return;
    const swatch = h("span", { class: `swatch ${each.points ? "dot" : each.dash ? "dashed" : ""} ${each.colour.slice(2)}`, "aria-hidden": "true" });
    if (spec.series.length === 1) { legend.append(h("span", { class: "key" }, swatch, each.label, readings[place])); return; }
    const button = h("button", { type: "button", class: "key", "aria-pressed": each.show === false ? "false" : "true", onclick: () => {
      const on = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", on ? "true" : "false");
      chart?.setSeries(place + 1, { show: on });
    } }, swatch, each.label, readings[place]);
    legend.append(button);
  });
  if (spec.noise) legend.append(h("span", { class: "key" }, h("span", { class: "swatch band", "aria-hidden": "true" }), "± 2 σ of the noise"));
  legend.append(instant);
  requestAnimationFrame(() => { if (holder.isConnected && window.uPlot && time.length > 1) begin(); });
  return api;
}

export function zoomButtons(group) {
  const any = () => [...group.members][0];
  const by = (factor) => () => {
    const [min, max] = any().range();
    const middle = (min + max) / 2;
    any().zoom(middle - (factor * (max - min)) / 2, middle + (factor * (max - min)) / 2);
  };
  return h("div", { class: "zoom", role: "group", "aria-label": "Zoom" },
    h("button", { type: "button", class: "quiet", onclick: by(0.5), "aria-label": "Zoom in", text: "+" }),
    h("button", { type: "button", class: "quiet", onclick: by(2), "aria-label": "Zoom out", text: "−" }),
    h("button", { type: "button", class: "quiet", onclick: () => any().full(), text: "All" }),
    h("span", { class: "hint", text: "Drag to zoom, double-click for everything." }));
}

let groups = 0;

export function group() {
  groups += 1;
  return { key: `group-${groups}`, members: new Set() };
}

// As many as everyone tells apart; what comes after them has dashes, and dots after those.
const COLOURS = ["--c1", "--c2", "--c3", "--c4"];
const DASHES = [undefined, [7, 4], [2, 3]];

export function jointStyle(place) {
  return { colour: COLOURS[place % COLOURS.length], dash: DASHES[Math.floor(place / COLOURS.length) % DASHES.length] };
}
