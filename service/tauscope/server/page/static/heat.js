// Where the residual is: joints × state, each cell the residual in it as a multiple of the noise.

import { h, named, number, s } from "./dom.js";

const LEVELS = [1.1, 1.3, 1.6, 2, 3, 5, 10];
export const VARIABLES = ["velocity", "position", "load", "acceleration", "time"];
export const LEVEL_WORDS = ["noise", ...LEVELS.map((edge) => `> ${edge} ×`)];
const ROW = 24;
const LABELS = 96;
const GAP = 14;
const WIDTH = 960;
const TOP = 24;

export const level = (ratio) => LEVELS.filter((edge) => ratio > edge).length;

/** The map; `choose(joint, variable, bin, words)` is told which cell was clicked, or reached with the arrow keys. */
export function heatMap(plots, joints, key, choose) {
  const group = (WIDTH - LABELS - GAP * (VARIABLES.length - 1)) / VARIABLES.length;
  const height = TOP + ROW * joints.length + 40;
  const parts = [];
  const rows = joints.map(() => []);
  let chosen = null;
  function take(cell) {
    chosen?.element.classList.remove("chosen");
    chosen = cell;
    cell.element.classList.add("chosen");
    choose(joints[cell.row], cell.variable, cell.bin, cell.words);
  }
  VARIABLES.forEach((variable, place) => {
    const left = LABELS + place * (group + GAP);
    parts.push(s("text", { x: left, y: TOP - 8, text: named(variable) }));
    const words = variable === "time" ? ["start", "end"] : ["lowest", "highest"];
    parts.push(s("text", { class: "small", x: left, y: height - 26, text: words[0] }));
    parts.push(s("text", { class: "small", x: left + group, y: height - 26, "text-anchor": "end", text: words[1] }));
    joints.forEach((joint, row) => {
      const own = plots.histograms.find((each) => each.joint === joint && each.variable === variable);
      if (!own) return;
      const step = group / own[key].length;
      own[key].forEach((value, bin) => {
        const ratio = value / own.noise;
        const words = `${joint}, ${named(variable)} ${number(own.edges[bin], 3)} … ${number(own.edges[bin + 1], 3)}: ${number(ratio, 3)} × noise`;
        const cell = { row, place: rows[row].length, variable, bin, words };
        cell.element = s("rect", { class: `h${level(ratio)}`, x: left + bin * step, y: TOP + row * ROW, width: step, height: ROW - 3,
          "data-cell": `${row}-${variable}-${bin}`, onclick: () => take(cell) }, s("title", { text: words }));
        rows[row].push(cell);
        parts.push(cell.element);
      });
    });
  });
  joints.forEach((joint, row) => parts.push(s("text", { x: 0, y: TOP + row * ROW + 15, text: joint.length > 14 ? `${joint.slice(0, 13)}…` : joint })));
  LEVEL_WORDS.forEach((word, place) => {
    const x = LABELS + 84 * place;
    parts.push(s("rect", { class: `h${place}`, x, y: height - 14, width: 16, height: 11 }));
    parts.push(s("text", { class: "small", x: x + 21, y: height - 5, text: word }));
  });
  const label = key === "before" ? "Residual by joint and state as a multiple of the noise, without the findings" : "Residual by joint and state as a multiple of the noise, with the findings";
  return h("div", { class: "wide", tabindex: "0", role: "region", "aria-label": label, onkeydown: (event) => {
    const next = neighbour(rows, chosen, event.key);
    if (!next) return;
    event.preventDefault();
    take(next);
    next.element.scrollIntoView({ block: "nearest", inline: "nearest" });
  } },
    s("svg", { class: "heat", viewBox: `0 0 ${WIDTH} ${height}`, role: "img", "aria-label": label }, parts));
}

function neighbour(rows, from, key) {
  const [down, right] = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] }[key] ?? [0, 0];
  if (!down && !right) return null;
  if (!from) return rows.find((row) => row.length)?.[0];
  const row = rows[from.row + down];
  return row?.[Math.min(from.place + right, row.length - (right ? 0 : 1))];
}
