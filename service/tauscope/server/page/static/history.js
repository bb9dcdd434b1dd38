// A robot over time: which model is in use, how its parameters move, and what somebody should know.

import { getJson, post } from "./api.js";
import { attempt, h, moment, named, number, percent, render, section, state, table, tabs } from "./dom.js";
import { plot } from "./plots.js";

const STATES = { active: "in use", kept: "was in use", refused: "refused", unreadable: "damaged" };
const DAY_MS = 86_400_000;

export async function showHistory(root, { signal, show }) {
  const [{ models }, { events }, schedules] = await Promise.all([
    getJson("models?limit=200", signal), getJson("events?open=true", signal), scheduleSection(signal)]);
  const robots = [...new Set(models.map((each) => each.robot))];
  const place = h("div", {});
  const choose = (chosen) => showRobot(place, robots[chosen], models.filter((each) => each.robot === robots[chosen]), signal);
  if (robots.length) await choose(0);
  render(root, h("h1", { text: "Over time" }), h("p", { class: "lead", text: "Models and their gates, the drift of their parameters, and schedules." }),
    events.length ? h("ul", { class: "cautions" }, events.map((event) => noteForm(event, show))) : h("p", { class: "note", text: "No open drift alerts." }),
    robots.length > 1 ? tabs("Robot", robots, 0, choose) : null, place, schedules);
  if (!robots.length) render(place, h("p", { class: "lead", text: "No model has been judged yet: identify an arm first." }));
}

/** An event, and where its cause is written down: in the page, so that Stop stays within reach. */
function noteForm(event, show) {
  const said = h("span", { role: "status" });
  const reason = h("input", { id: `why-${event.number}`, required: true, maxlength: "1000", autocomplete: "off" });
  const form = h("form", { class: "row", onsubmit: async (submitted) => {
    submitted.preventDefault();
    if (await attempt(said, () => post(`events/${event.number}/acknowledge`, { reason: reason.value }))) show();
  } }, h("label", { for: reason.id }, "What is it about? Kept with the event", reason), h("button", { type: "submit", text: "Take note" }), said);
  return h("li", {}, h("span", { text: `${event.robot}: ${event.text}` }), form);
}

async function showRobot(place, robot, models, signal) {
  const { parameters } = await getJson(`trend?robot=${encodeURIComponent(robot)}`, signal);
  const reference = models.find((each) => each.is_reference)?.id;
  const drawn = h("div", {});
  const moved = [...parameters].sort((a, b) => Math.abs(b.line?.in_std ?? 0) - Math.abs(a.line?.in_std ?? 0));
  const select = h("select", { id: "trend", onchange: () => draw() }, moved.map((each) => h("option", { value: each.name, text: each.name })));
  const draw = () => render(drawn, trendOf(moved.find((each) => each.name === select.value), reference));
  render(place, section("models", `Models of ${robot}`,
    table("Models", ["model", "state", "source", "judged", "why"], models.map((each) => [
      h("a", { href: `#/identifications/${encodeURIComponent(each.id)}`, text: moment(each.created) }), each.is_reference ? `${STATES[each.state] ?? each.state}, reference` : STATES[each.state] ?? each.state, named(each.source), moment(each.considered),
      each.gates.filter((gate) => !gate.passed).map((gate) => gate.reason).join("; ") || "passed every gate"]), 5)),
  moved.length ? section("trend-of", "Parameters", h("form", { class: "sheet" }, h("label", { for: "trend" }, "Parameter, the most moved first", select)), drawn) : null);
  if (moved.length) draw();
}

function trendOf({ name, points, line }, reference) {
  if (points.length < 2) return h("p", { class: "note", text: "Drawn from two models on." });
  const start = Date.parse(points[0].time);
  const end = (sign) => points.map((each) => each.value + sign * 1.96 * each.std);
  return [
    plot({ label: name, raw: true, tall: true, x: points.map((each) => (Date.parse(each.time) - start) / DAY_MS), xLabel: `days since ${moment(points[0].time)}`, yLabel: "SI", bands: [{ series: [1, 2] }], series: [
      { label: "high", values: end(1), colour: "--band", hidden: true }, { label: "low", values: end(-1), colour: "--band", hidden: true },
      { label: "estimate, with its 95 % band", values: points.map((each) => each.value), colour: "--after", width: 2, marks: true }] }).element,
    h("p", { id: "trend-words", text: changeOf(points, reference) }),
    line ? h("p", { class: "note", text: `The line through all ${line.count}: ${number(line.slope, 3)} ± ${number(line.slope_std, 2)} a week, ${number(Math.abs(line.in_std), 3)} standard errors from standing still.` }) : null,
  ];
}

function changeOf(points, reference) {
  const from = points.find((each) => each.model === reference) ?? points[0];
  const to = points[points.length - 1];
  const std = Math.hypot(from.std, to.std);
  const share = from.value ? ` (${to.value > from.value ? "+" : "−"}${percent(Math.abs((to.value - from.value) / from.value))})` : "";
  return `From ${number(from.value, 3)} to ${number(to.value, 3)}${share} since the reference: ${number(Math.abs(to.value - from.value) / std, 2)} standard errors of the difference.`;
}

const NOTHING_STARTED = ["skipped", "missed", "failed", "interrupted", "withdrawn"];

async function scheduleSection(signal) {
  const { schedules } = await getJson("schedules", signal);
  if (!schedules.length) return section("schedules", "Schedules", h("p", { class: "lead", text: "Nothing is done by itself." }));
  const last = await Promise.all(schedules.map(async (each) => (await getJson(`${each.firings}?limit=1`, signal)).firings[0]));
  return section("schedules", "Schedules", schedules.map((each, place) => h("article", { class: "card plain-card", "aria-label": each.name },
    h("h3", {}, each.name, h("span", { text: each.robot ? ` ${named(each.definition.kind)} of ${each.robot}` : ` ${named(each.definition.kind)} of an arm` })),
    h("dl", {}, [["When", whenDue(each.definition)], ["Due next", each.next_due ? moment(each.next_due) : "not enabled"], ["Last time", outcome(last[place])]].map(
      ([name, value]) => [h("dt", { text: name }), h("dd", {}, value)])))));
}

function whenDue({ cron, every_s: seconds, timezone, window }) {
  const due = cron ? `${cron} (${timezone})` : `every ${duration(seconds)}`;
  return window ? `${due}, from ${window.start} to ${window.end} only` : due;
}

function duration(seconds) {
  if (seconds < 3600) return `${number(seconds / 60, 3)} min`;
  return seconds < 86_400 ? `${number(seconds / 3600, 3)} h` : `${number(seconds / 86_400, 3)} days`;
}

function outcome(firing) {
  if (!firing) return "not due yet";
  const when = moment(firing.due);
  if (NOTHING_STARTED.includes(firing.state)) return h("span", {}, `${when}: ${named(firing.state)}, `, firing.reason ? h("span", { text: firing.reason }) : "no reason was kept");
  if (!firing.item) return `${when}: ${named(firing.state)}`;
  return h("span", {}, h("a", { href: `#/${firing.item.replace(/^\/api\/v1\//, "")}`, text: when }), " ", state(firing.item_state ?? firing.state));
}
