// A robot over time: which model is in use, how its parameters move, and what is done by itself.

import { getJson, post } from "./api.js";
import { h, moment, number, render, section, table, tabs } from "./dom.js";
import { plot } from "./plots.js";

const STATES = { active: "in use", kept: "was in use", refused: "refused", unreadable: "damaged" };
const DAY_MS = 86_400_000;

export async function showHistory(root, { signal, show }) {
  const [{ models }, { events }, { schedules }] = await Promise.all([
    getJson("models?limit=200", signal), getJson("events?open=true", signal), getJson("schedules", signal)]);
  const robots = [...new Set(models.map((each) => each.robot))];
  const place = h("div", {});
  const choose = (chosen) => showRobot(place, robots[chosen], models.filter((each) => each.robot === robots[chosen]), signal);
  render(root, h("h1", { text: "Over time" }), h("p", { class: "lead", text: "Models that were judged, the drift of their parameters, and what is done by itself." }),
    events.length ? h("ul", { class: "cautions" }, events.map((event) => h("li", {}, `${event.robot}: ${event.text} `,
      h("button", { type: "button", class: "quiet", text: "Take note", onclick: async (click) => {
        const reason = prompt("What is it about? The answer is kept with the event.");
        if (!reason) return;
        click.target.disabled = true;
        await post(`events/${event.number}/acknowledge`, { reason });
        show();
      } })))) : h("p", { class: "note", text: "No drift that nobody has taken note of." }),
    robots.length > 1 ? tabs("Robot", robots, 0, choose) : null, place, scheduleSection(schedules));
  if (robots.length) await choose(0);
  else render(place, h("p", { class: "lead", text: "No model has been judged yet: identify an arm first." }));
}

async function showRobot(place, robot, models, signal) {
  const trend = await getJson(`trend?robot=${encodeURIComponent(robot)}`, signal).catch(() => ({ parameters: [] }));
  const drawn = h("div", {});
  const moved = [...trend.parameters].sort((a, b) => Math.abs(b.line?.in_std ?? 0) - Math.abs(a.line?.in_std ?? 0));
  const select = h("select", { id: "trend", onchange: () => draw() }, moved.map((each) => h("option", { value: each.name, text: each.name })));
  function draw() {
    const chosen = moved.find((each) => each.name === select.value);
    if (!chosen || chosen.points.length < 2) { render(drawn, h("p", { class: "note", text: "Drawn from two models on." })); return; }
    const start = Date.parse(chosen.points[0].time);
    const days = chosen.points.map((each) => (Date.parse(each.time) - start) / DAY_MS);
    const end = (sign) => chosen.points.map((each) => each.value + sign * 1.96 * each.std);
    const line = chosen.line;
    render(drawn,
      plot({ label: chosen.name, raw: true, tall: true, x: days, xLabel: `days since ${moment(chosen.points[0].time)}`, yLabel: "SI", bands: [{ series: [1, 2] }], series: [
        { label: "high", values: end(1), colour: "--band", hidden: true }, { label: "low", values: end(-1), colour: "--band", hidden: true },
        { label: "estimate, with its 95 % band", values: chosen.points.map((each) => each.value), colour: "--after", width: 2 }] }).element,
      line ? h("p", { class: "note", text: `${number(line.slope, 3)} ± ${number(line.slope_std, 2)} a week, ${number(line.in_std, 3)} standard errors from standing still.` }) : null);
  }
  render(place, section("models", `Models of ${robot}`,
    table("Models", ["model", "state", "source", "judged", "why"], models.map((each) => [
      h("a", { href: `#/identifications/${encodeURIComponent(each.id)}`, text: moment(each.created) }), `${STATES[each.state] ?? each.state}${each.is_reference ? ", reference" : ""}`, each.source, moment(each.considered),
      each.gates.filter((gate) => !gate.passed).map((gate) => gate.reason).join("; ") || "passed every gate"]), 5)),
  trend.parameters.length ? section("trend-of", "Parameters", h("form", { class: "sheet" }, h("label", { for: "trend" }, "Parameter, the most moved first", select)), drawn) : null);
  if (moved.length) draw();
}

function scheduleSection(schedules) {
  if (!schedules.length) return section("schedules", "Schedules", h("p", { class: "lead", text: "Nothing is done by itself." }));
  const when = (definition) => definition.cron ?? (definition.every_s ? `every ${number(definition.every_s / 3600, 3)} h` : "–");
  return section("schedules", "Schedules", table("Schedules", ["name", "robot", "what", "when", "due next"], schedules.map((each) =>
    [each.name, each.robot ?? "–", each.definition.kind ?? "–", when(each.definition), each.next_due ? moment(each.next_due) : "not enabled"]), 5));
}
