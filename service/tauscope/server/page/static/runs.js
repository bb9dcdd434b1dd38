// Runs: one as it goes on, with positions, torques, room to the limits and the loop's jitter.

import { armDrawing } from "./arm.js";
import { ENDS, download, follow, getJson, post, query, reportOf } from "./api.js";
import { explained, figures, h, moment, named, number, render, section, state, table, unitsOf } from "./dom.js";
import { diagnoseAgain } from "./diagnoses.js";
import { jobList } from "./lists.js";
import { group, jointStyle, plot } from "./plots.js";

const KEPT = 1500;
const KEPT_KEYS = ["position", "target", "effort"];
const NEAR = 0.15;

export const showRuns = jobList("runs", "run", "Runs", "Motions that were played on an arm.", (run) => (run.campaign ? "part of a campaign" : run.backend?.name));

export async function showRun(root, { id, signal, show }) {
  const run = await getJson(`runs/${id}`, signal);
  const monitor = ENDS.includes(run.state) ? null : liveMonitor(id);
  const arm = monitor ? [] : (await reportOf(`runs/${id}`))?.joints ?? [];
  const status = h("div", { class: "row", role: "status" }, state(run.state));
  render(root, 
    h("p", { class: "eyebrow", text: `Run · ${run.backend?.name ?? ""}` }), h("h1", { text: run.robot ?? id }), h("p", { class: "meta", text: moment(run.created) }), status,
    run.problem ? h("p", { role: "alert" }, explained(run.problem)) : null,
    monitor?.element,
    monitor ? null : finished(run, arm));
  const after = query("after");
  if (after && run.state === "finished" && run.recording?.name) {
    render(status, state(run.state), h("span", { text: " Handing the diagnosis in …" }));
    try {
      const job = await diagnoseAgain(after, run.recording.name);
      location.replace(`#/diagnoses/${job.id}?before=${encodeURIComponent(after)}`); // the way back hands in no second one
    } catch (error) { render(status, state(run.state), " ", explained(error)); }
  }
  if (monitor) {
    let current = run.state;
    await follow(run.links.events, signal, (event) => {
      monitor.take(event);
      const next = event.state ?? event.step ?? current;
      if (next !== current) { current = next; render(status, state(next)); }
      if (event.kind === "ended") show();
    });
  }
}

function finished(run, arm) {
  const timing = run.timing;
  const sent = h("span", { class: "hint", role: "status", text: " harmless: it has ended" });
  return [
    run.holds && run.backend?.name !== "sim" ? h("p", { role: "alert", text: "The arm is under power where it stopped. Support it, then let go of it with: tauscope release" }) : null,
    timing ? figures([
      ["Rate", `${number(timing.achieved_rate_hz, 4)} Hz`, `of ${number(timing.rate_hz, 4)} Hz`],
      ["Lateness, 99 %", `${number(timing.lateness_us.p99, 3)} µs`, `at most ${number(timing.lateness_us.max, 3)} µs`],
      ["Missed cycles", `${timing.missed_periods}`, `of ${timing.cycles}`],
      ["Samples", `${run.recording?.samples ?? 0}`, run.recording?.partial ? "not played to its end" : "complete"],
    ]) : null,
    run.recording?.name ? h("div", { class: "row" }, h("a", { class: "button primary", href: `#/recordings/${encodeURIComponent(run.recording.name)}`, text: "Look at the recording" }),
      Object.entries(run.links.recordings).map(([format, path]) => h("button", { type: "button", onclick: () => download(path, `run-${run.id}.${format}`), text: format.toUpperCase() }))) : null,
    run.worst_following?.length ? section("following", "Largest distance of arm and target", table("Following", ["joint", "distance"], run.worst_following.map((value, place) => [nameOf(arm, place), `${number(value, 3)} ${unitsOf(arm[place]?.type).position}`]))) : null,
    h("p", {}, h("button", { type: "button", class: "quiet", onclick: () => post(run.links.stop).catch((error) => render(sent, " ", explained(error))), text: "Send stop again" }), sent),
  ];
}

export function liveMonitor(id) {
  const bar = h("progress", { max: "100", value: "0", "aria-label": "Played" });
  const words = h("p", { class: "meta", text: "Waiting for the arm" });
  const joints = h("div", { class: "joints-now" });
  const jitter = h("p", { class: "meta" });
  const plots = h("div", {});
  const pose = h("div", {});
  const times = [];
  let charts = null;
  let drawing = null;
  let arm = [];
  const rows = { position: [], target: [], effort: [] };

  let isKnown = false; // whether it has been answered what the joints are called
  reportOf(`runs/${id}`).then((report) => { if (report) { arm = report.joints; drawing = armDrawing(report); render(pose, drawing.element); } })
    .catch(() => {}).finally(() => { isKnown = true; });

  function begin(count) {
    const together = group();
    const each = (make) => Array.from({ length: count }, (_, joint) => ({ values: [null, null], ...jointStyle(joint), ...make(joint) }));
    const measured = each((joint) => ({ label: nameOf(arm, joint) }));
    const targets = each((joint) => ({ label: `${nameOf(arm, joint)}, target`, dash: [2, 4], width: 1 }));
    const make = (label, unit, series) => plot({ label, x: [0, 1], xLabel: "time [s]", yLabel: unit, raw: true, group: together, series });
    charts = { position: make("Position", "rad or m", [...measured, ...targets]), effort: make("Torque", "Nm or N", measured) };
    for (const key of KEPT_KEYS) rows[key] = Array.from({ length: count }, () => []);
    render(plots, charts.position.element, charts.effort.element);
  }

  function take(event) {
    const data = event.figures ?? {};
    if (event.step) words.textContent = named(event.step);
    if (event.percent !== undefined && event.percent !== null) bar.value = event.percent;
    if (!data.position) return;
    if (!isKnown) return;
    if (!charts) begin(data.position.length);
    if (times.length && data.time_s <= times[times.length - 1]) return;
    times.push(data.time_s);
    for (const key of KEPT_KEYS) rows[key].forEach((column, joint) => column.push(data[key]?.[joint] ?? null));
    if (times.length > KEPT) { times.shift(); for (const key of KEPT_KEYS) rows[key].forEach((column) => column.shift()); }
    if (times.length > 1) {
      charts.position.replace(times, [...rows.position, ...rows.target]);
      charts.effort.replace(times, rows.effort);
    }
    drawing?.pose(data.position);
    words.textContent = `${number(data.time_s, 3)} of ${number(data.duration_s, 3)} s`;
    jitter.textContent = `Loop: ${number(data.lateness_us?.p99, 3)} µs late at 99 %, ${number(data.lateness_us?.max, 3)} µs at most; ${data.missed_periods} cycles missed, ${data.lost_rows} rows lost.`;
    render(joints, jointTable(data, arm));
  }

  const element = h("section", { "aria-label": "Live" }, bar, words, h("div", { class: "split" }, pose, h("div", {}, joints, jitter)), plots);
  return { element, take };
}

const nameOf = (arm, joint) => arm[joint]?.name ?? `joint ${joint + 1}`;

function jointTable(data, arm) {
  const gauge = (share) => h("span", { class: `gauge ${share > 1 - NEAR ? "near" : ""}`, "aria-hidden": "true" }, h("span", { "width%": Math.min(Math.max(100 * share, 0), 100) }));
  const rows = data.position.map((value, joint) => {
    const [low, high] = data.position_range.map((each) => each[joint]);
    const bounded = low !== null && high !== null;
    const place = bounded ? (value - low) / (high - low) : null;
    const limit = data.torque_limit[joint];
    const load = limit ? Math.abs(data.effort[joint]) / limit : null;
    const unit = unitsOf(arm[joint]?.type);
    return [nameOf(arm, joint), `${number(value, 4)} ${unit.position}`, bounded ? h("span", {}, gauge(2 * Math.abs(place - 0.5)), ` ${`${number(data.position_room[joint], 3)} left`}`) : "no limit",
      `${number(data.effort[joint], 4)} ${unit.torque}`, load === null ? "no limit" : h("span", {}, gauge(load), ` ${(100 * load).toFixed(0)} %`)];
  });
  return table("Joints now", ["joint", "position", "room to the limit", "torque", "of its limit"], rows);
}
