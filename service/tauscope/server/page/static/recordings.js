// Recordings: what lies on the server, and what one of them holds.

import { download, formOf, getJson, getSamples, post, reportOf } from "./api.js";
import { attempt, bytes, cautions, figures, h, number, render, section, table } from "./dom.js";
import { searchable } from "./lists.js";
import { replay } from "./motion.js";
import { group, jointStyle, plot, zoomButtons } from "./plots.js";
import { interpolate } from "./thinning.js";

const EFFORTS = { tau: ["Torque", "tau", "Nm or N"], i: ["Current or drive units", "i", "drive units"], qref: ["Commanded position", "qref", "rad or m"] };

export async function showRecordings(root, { signal, show }) {
  const { recordings } = await getJson("recordings", signal);
  const said = h("p", { role: "status", class: "note" });
  const input = h("input", { type: "file", id: "upload", accept: ".csv,.parquet,.mcap,.db3", onchange: async () => {
    said.textContent = "Sending …";
    if (await attempt(said, () => post("recordings", formOf(null, [["file", input.files[0]]])))) show();
  } });
  const newest = [...recordings].sort((a, b) => b.modified.localeCompare(a.modified));
  render(root, h("h1", { text: "Recordings" }), h("p", { class: "lead", text: "CSV, Parquet or MCAP; each one continuous motion." }),
    h("form", { class: "sheet" }, h("label", { for: "upload" }, "Keep a recording on the server", input)), said,
    searchable(newest.map((each) => ({ href: `#/recordings/${encodeURIComponent(each.name)}`, name: each.name, path: `recordings/${encodeURIComponent(each.name)}`, middle: bytes(each.size), created: each.modified })), "Nothing yet."));
}

export async function showRecording(root, { id, signal }) {
  const path = `recordings/${encodeURIComponent(id)}`;
  const head = [h("p", { class: "eyebrow", text: "Recording" }), h("h1", { text: id }),
    h("div", { class: "row" }, h("button", { type: "button", onclick: () => download(`${path}/content`, id), text: "Download" }))];
  render(root, ...head, h("div", { class: "placeholder", "aria-busy": "true" }));
  const run = /^run-(.+)\.csv$/.exec(id)?.[1]; // only of runs it is known what moved
  const [report, samples, robot, { recordings }] = await Promise.all([getJson(`${path}/report`, signal), getSamples(id, signal),
    run ? reportOf(`runs/${encodeURIComponent(run)}`, signal) : null, getJson("recordings", signal)]);
  const time = samples.columns.t;
  const joints = Array.from({ length: samples.joint_count }, (_, place) => place + 1);
  const motion = robot?.joints.length === joints.length ? replay(robot, time, joints.map((joint) => samples.columns[`q${joint}`]), null, (row, isPlayed) => { if (isPlayed) charts.forEach((each) => each.point(time[row])); }) : null;
  const curves = h("div", {});
  let charts = [];

  function draw(other = null, isDifference = false) {
    const together = group();
    const make = (label, prefix, unit) => {
      const own = (joint) => samples.columns[`${prefix}${joint}`];
      const theirs = other && joints.map((joint) => resampled(other.columns.t, other.columns[`${prefix}${joint}`], time));
      const series = joints.flatMap((joint) => {
        const [name, style] = [`${prefix}${joint}`, jointStyle(joint - 1)];
        if (theirs && isDifference) return [{ label: name, values: own(joint).map((value, row) => value - theirs[joint - 1][row]), ...style }];
        return [{ label: name, values: own(joint), ...style }, ...(theirs ? [{ label: `${name}, other`, values: theirs[joint - 1], colour: style.colour, dash: [6, 4] }] : [])];
      });
      return plot({ label: other && isDifference ? `${label}, difference` : label, onCursor: motion?.seek, x: time, xLabel: "time [s]", yLabel: unit, group: together, tall: true, series });
    };
    charts = [make("Position", "q", "rad or m"), make(...EFFORTS[samples.effort])];
    render(curves, zoomButtons(together), charts.map((each) => each.element));
  }
  draw();
  render(root, ...head,
    figures([["Samples", `${report.samples}`, `${number(report.duration_s, 4)} s`], ["Rate", `${number(report.rate_hz, 4)} Hz`, `${report.gaps.count} gaps`],
      ["Periods", report.periods ? `${report.periods.count}` : "–", report.periods ? "repeated motion" : "none marked"],
      ["Missing", `${missing(report)}`, "of time, position and effort"]]),
    cautions(report.findings),
    motion ? section("replay", "Replay", motion.element) : null,
    overlayForm(samples, recordings.map((each) => each.name).filter((name) => name !== id), draw, signal), curves,
    samples.shown < samples.samples ? h("p", { class: "note", text: `${samples.shown} of ${samples.samples} samples are shown: those that keep every curve's peaks.` }) : null,
    section("channels", "Channels", table("Channels", ["joint", "position from", "to", "effort from", "to"], report.joints.map((each, place) =>
      [`${place + 1}`, ...each.position.map((v) => number(v, 4)), ...each.effort.map((v) => number(v, 4))]))));
}

/** Values that are missing where every sample has one: other columns, such as the period, may stay empty. */
function missing(report) {
  return Object.entries(report.missed).filter(([name]) => /^(t|(q|tau|i|qref)\d+)$/.test(name)).reduce((sum, [, count]) => sum + count, 0);
}

function overlayForm(samples, names, draw, signal) {
  if (!names.length) return null;
  const said = h("span", { role: "alert" });
  const other = h("select", { id: "overlay", onchange: () => change() }, h("option", { value: "", text: "none" }), names.map((name) => h("option", { value: name, text: name })));
  const difference = h("input", { type: "checkbox", id: "difference", onchange: () => change() });
  const change = () => attempt(said, async () => {
    render(said);
    const found = other.value ? await getSamples(other.value, signal) : null;
    const isLike = !found || (found.joint_count === samples.joint_count && found.effort === samples.effort);
    if (!isLike) render(said, `${other.value} has other joints, or another kind of effort.`);
    draw(isLike ? found : null, difference.checked);
  });
  return h("div", { class: "row" }, h("label", { for: "overlay", class: "inline" }, "Overlay", other), h("label", { for: "difference", class: "inline" }, difference, "Difference"), said);
}

/** A column at other instants; none beyond its ends. */
function resampled(time, column, instants) {
  return instants.map((at) => (at < time[0] || at > time[time.length - 1] ? NaN : interpolate(time, column, at)));
}
