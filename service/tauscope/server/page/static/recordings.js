// Recordings: what lies on the server, and what one of them holds.

import { download, getJson, getSamples, post } from "./api.js";
import { bytes, cautions, explained, figures, h, moment, number, render, section, table } from "./dom.js";
import { searchable } from "./lists.js";
import { replay } from "./motion.js";
import { group, jointStyle, plot, zoomButtons } from "./plots.js";

export async function showRecordings(root, { signal, show }) {
  const { recordings } = await getJson("recordings", signal);
  const said = h("p", { role: "status", class: "note" });
  const input = h("input", { type: "file", id: "upload", accept: ".csv,.parquet,.mcap,.db3", onchange: async () => {
    const form = new FormData();
    form.append("file", input.files[0]);
    said.textContent = "Sending …";
    try {
      await post("recordings", form);
      show();
    } catch (error) { render(said, explained(error)); }
  } });
  const newest = [...recordings].sort((a, b) => b.modified.localeCompare(a.modified));
  render(root, h("h1", { text: "Recordings" }), h("p", { class: "lead", text: "CSV, Parquet or MCAP; each one continuous motion." }),
    h("form", { class: "sheet" }, h("label", { for: "upload" }, "Keep a recording on the server", input)), said,
    searchable(newest.map((each) => ({ href: `#/recordings/${encodeURIComponent(each.name)}`, name: each.name, middle: bytes(each.size), created: each.modified })), "Nothing yet."));
}

export async function showRecording(root, { id, signal }) {
  const path = `recordings/${encodeURIComponent(id)}`;
  const head = [h("p", { class: "eyebrow", text: "Recording" }), h("h1", { text: id }),
    h("div", { class: "row" }, h("button", { type: "button", onclick: () => download(`${path}/content`, id), text: "Download" }))];
  render(root, ...head, h("div", { class: "placeholder", "aria-busy": "true" }));
  const run = /^run-(.+)\.csv$/.exec(id)?.[1]; // only of runs it is known what moved
  const [report, samples, robot] = await Promise.all([getJson(`${path}/report`, signal), getSamples(id, signal),
    run ? getJson(`runs/${encodeURIComponent(run)}/robot`, signal).then((answer) => answer.report, () => null) : null]);
  const together = group();
  const time = samples.columns.t;
  const joints = Array.from({ length: samples.joint_count }, (_, place) => place + 1);
  const motion = robot?.joints.length === joints.length ? replay(robot, time, joints.map((joint) => samples.columns[`q${joint}`]), null, (row, isPlayed) => { if (isPlayed) charts.forEach((each) => each.point(time[row])); }) : null;
  const make = (label, prefix, unit) => plot({ label, onCursor: motion?.seek, x: time, xLabel: "time [s]", yLabel: unit, group: together, tall: true,
    series: joints.map((joint) => ({ label: `${prefix}${joint}`, values: samples.columns[`${prefix}${joint}`], ...jointStyle(joint - 1) })) });
  const charts = [make("Position", "q", "rad or m"), make(samples.effort === "tau" ? "Torque" : "Current or drive units", samples.effort, samples.effort === "tau" ? "Nm or N" : "drive units")];
  render(root, ...head,
    figures([["Samples", `${report.samples}`, `${number(report.duration_s, 4)} s`], ["Rate", `${number(report.rate_hz, 4)} Hz`, `${report.gaps.count} gaps`],
      ["Periods", report.periods ? `${report.periods.count}` : "–", report.periods ? "repeated motion" : "none marked"],
      ["Missing", `${missing(report)}`, "of time, position and effort"]]),
    cautions(report.findings),
    motion ? section("replay", "Replay", motion.element) : null,
    zoomButtons(together),
    charts.map((each) => each.element),
    samples.shown < samples.samples ? h("p", { class: "note", text: `${samples.shown} of ${samples.samples} samples are shown: those that keep every curve's peaks.` }) : null,
    section("channels", "Channels", table("Channels", ["joint", "position from", "to", "effort from", "to"], report.joints.map((each, place) =>
      [`${place + 1}`, ...each.position.map((v) => number(v, 4)), ...each.effort.map((v) => number(v, 4))]))));
}

/** Values that are missing where every sample has one: other columns, such as the period, may stay empty. */
function missing(report) {
  return Object.entries(report.missed).filter(([name]) => /^(t|(q|tau|i)\d+)$/.test(name)).reduce((sum, [, count]) => sum + count, 0);
}
