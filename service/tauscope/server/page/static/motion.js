// A recorded motion of the arm, in space: played, scrubbed, and coloured by the residual of each joint.

import { armDrawing, chain } from "./arm.js";
import { h, number, section, tabs, unitsOf } from "./dom.js";
import { LEVEL_WORDS, level } from "./heat.js";
import { jointStyle, plot } from "./plots.js";
import { nearest } from "./thinning.js";

const WINDOW_S = 0.25; // residuals are told as rms over this much to each side: single samples flicker with the noise
const TRACE = 400; // points of the tool's path

/** An arm that plays a motion. `columns` holds a position column a joint; `levels(row)` gives the colours; `told(row)` hears. */
export function replay(report, time, columns, levels, told) {
  const arm = armDrawing(report);
  const at = (row) => columns.map((column) => column[row] ?? 0);
  const every = Math.max(1, Math.ceil(time.length / TRACE));
  arm.trace(Array.from({ length: Math.ceil(time.length / every) }, (_, k) => chain(report.joints, at(k * every)).points.at(-1)));
  const [begin, end] = [time[0], time[time.length - 1]];
  const slider = h("input", { type: "range", min: begin, max: end, step: "any", value: begin, "aria-label": "Time of the motion", oninput: () => { stop(); seek(Number(slider.value)); } });
  const clock = h("output", { class: "reading", for: "motion-time" });
  const button = h("button", { type: "button", text: "Play", onclick: () => (frame ? stop() : play()) });
  let frame = 0;
  let now = begin;

  function seek(instant) {
    now = instant;
    const row = nearest(time, instant);
    slider.value = instant;
    slider.setAttribute("aria-valuetext", `${number(instant, 3)} s`);
    clock.textContent = `${instant.toFixed(2)} s`;
    arm.show(at(row), levels?.(row) ?? null);
    told?.(row, Boolean(frame));
  }

  function play() {
    if (now >= end) now = begin;
    button.textContent = "Pause";
    let last = performance.now();
    const step = (stamp) => {
      if (!slider.isConnected) return stop();
      now = Math.min(now + (stamp - last) / 1000, end);
      last = stamp;
      seek(now);
      if (now >= end) return stop();
      frame = requestAnimationFrame(step);
      return null;
    };
    frame = requestAnimationFrame(step);
  }

  function stop() {
    cancelAnimationFrame(frame);
    frame = 0;
    button.textContent = "Play";
  }

  seek(begin);
  return { element: h("div", { class: "replay" }, arm.element, h("div", { class: "row" }, button, slider, clock)), seek: (instant) => { if (!frame) seek(instant); }, again: () => seek(now) };
}

/** The motion of a diagnosis, its joints coloured by what the model leaves: without the findings, and with them. */
export function motionSection(report, result, plots) {
  const name = plots.curves[0]?.recording;
  const curves = report.joints.map((joint) => plots.curves.find((each) => each.joint === joint.name && each.recording === name));
  if (!name || curves.some((each) => !each?.states.position)) return null;
  const { time } = curves[0];
  const own = (column, curve) => (curve.time === time ? column : time.map((instant) => column[nearest(curve.time, instant)]));
  const noise = curves.map((curve) => plots.histograms.find((each) => each.joint === curve.joint)?.noise ?? 1);
  const ratios = Object.fromEntries(["before", "after"].map((key) => [key, curves.map((curve, place) => rolling(time, own(curve[key], curve)).map((rms) => rms / noise[place]))]));
  let key = "before";
  const rows = report.joints.map((joint, place) => {
    const value = h("span", {});
    const bar = h("span", {});
    return { element: h("li", {}, h("span", { text: `${place + 1} ${joint.name}` }), h("span", { class: "gauge", "aria-hidden": "true" }, bar), value), value, bar };
  });
  const chart = plot({ label: `Residual in ${name}`, x: time, xLabel: "time [s]", yLabel: unitsOf(sameType(report.joints)).torque, onCursor: (instant) => motion.seek(instant),
    series: curves.map((curve, place) => ({ label: curve.joint, values: own(curve.before, curve), ...jointStyle(place) })) });
  const motion = replay(report, time, curves.map((curve) => own(curve.states.position, curve)), (row) => ratios[key].map((each) => level(each[row])), (row, isPlayed) => {
    rows.forEach((each, place) => {
      const ratio = ratios[key][place][row];
      each.value.textContent = `${number(ratio, 2)} × noise`;
      each.bar.style.setProperty("width", `${Math.min(100, 10 * ratio)}%`);
      each.bar.className = `h${level(ratio)}`;
    });
    if (isPlayed) chart.point(time[row]);
  });
  return section("motion", "Residual over the motion",
    result.findings.length ? tabs("Model", ["Without the findings", "With them"], 0, (chosen) => {
      key = chosen ? "after" : "before";
      chart.replace(time, curves.map((curve) => own(curve[key], curve)));
      motion.again();
    }) : null,
    h("div", { class: "split motion" }, motion.element, h("div", {}, h("ul", { class: "now plain" }, rows.map((each) => each.element)),
      h("p", { class: "levels note" }, LEVEL_WORDS.map((word, place) => h("span", {}, h("span", { class: `swatch level h${place}`, "aria-hidden": "true" }), word))), chart.element)));
}

const sameType = (joints) => (joints.every((each) => each.type === joints[0].type) ? joints[0].type : undefined);

function rolling(time, column) {
  const sums = [0];
  for (const value of column) sums.push(sums[sums.length - 1] + (value ?? 0) ** 2);
  let low = 0;
  let high = 0;
  return time.map((instant) => {
    while (time[low] < instant - WINDOW_S) low += 1;
    while (high < time.length && time[high] <= instant + WINDOW_S) high += 1;
    return Math.sqrt((sums[high] - sums[low]) / (high - low));
  });
}
