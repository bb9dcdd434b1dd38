// Robots: each arm that something is kept about, what it does at this moment, and what is known of it.

import { armDrawing, jointRows } from "./arm.js";
import { ENDS, getJson, reportOf } from "./api.js";
import { cautions, figures, h, moment, named, number, percent, render, section, table, title } from "./dom.js";
import { items, outcome, searchable } from "./lists.js";

const KINDS = { run: "runs", identification: "identifications", diagnosis: "diagnoses", campaign: "campaigns" };
const DONE = ["succeeded", "finished"];
const LATELY = 12;

export async function showRobots(root, { signal }) {
  const [{ robots }, { leases }, { items: kept }] = await Promise.all([getJson("robots", signal), getJson("leases", signal), getJson("items?limit=1000", signal)]);
  const last = (robot) => {
    const own = kept.filter((each) => each.robot === robot);
    const told = ["diagnosis", "identification"].map((kind) => own.find((each) => each.kind === kind && each.state === "succeeded")).find(Boolean) ?? own[0];
    return told && outcome(told, told.figures);
  };
  const newest = [...robots].sort((a, b) => b.last_seen.localeCompare(a.last_seen));
  render(root, h("h1", { text: "Robots" }), h("p", { class: "lead", text: "Most recent first, each with its last verdict." }),
    searchable(newest.map((each) => ({ href: pageOf(each.name), name: each.name, detail: holderOf(leases, each.name), outcome: last(each.name), created: each.last_seen })),
      "No robot yet: begin a campaign with its file."));
}

const pageOf = (robot) => `#/robots/${encodeURIComponent(robot)}`;

function holderOf(leases, robot) {
  const held = leases.filter(({ arm }) => arm.slice(0, arm.lastIndexOf(" on ")) === robot);
  return held.map(({ holder, armed }) => (armed ? `${holder} has its lease, and it may move` : `${holder} has its lease`)).join("; ");
}

export async function showRobot(root, { id: robot, signal }) {
  const of = `robot=${encodeURIComponent(robot)}`;
  const [{ items: all }, { models }, { leases }] = await Promise.all([getJson(`items?${of}&limit=200`, signal), getJson(`models?${of}&limit=200`, signal), getJson("leases", signal)]);
  const here = all.filter((each) => each.is_here && each.kind in KINDS);
  const moving = here.find((each) => each.kind === "run" && each.state !== "created" && !ENDS.includes(each.state));
  const used = here.find((each) => each.kind === "run" && each.state !== "created");
  const model = models.find((each) => each.state === "active");
  const error = here.find((each) => each.kind === "identification" && each.id === model?.id)?.figures;
  const diagnosis = here.find((each) => each.kind === "diagnosis" && each.state === "succeeded");
  const source = here.find((each) => DONE.includes(each.state)) ?? here.find((each) => each.state !== "damaged"); // what failed may have failed for its robot file
  const path = source && `${KINDS[source.kind]}/${source.id}`;
  const report = path ? await reportOf(path, signal) : null;
  const linkTo = (kind, id, words) => h("a", { href: `#/${KINDS[kind]}/${id}`, text: words });
  render(root, h("p", { class: "eyebrow", text: "Robot" }), h("h1", { text: robot }), h("p", { class: "meta", text: holderOf(leases, robot) || "No lease is open." }),
    figures([
      ["Now", moving ? linkTo("run", moving.id, named(moving.state)) : "at rest", moving ? "open it to watch" : "no run of this service moves it"],
      ["Last run", used ? linkTo("run", used.id, named(used.state)) : "–", used ? moment(used.created) : "none yet"],
      ["Model in use", model ? linkTo("identification", model.id, moment(model.created)) : "–", model ? explainedShare(error) : "none has passed every gate"],
      ["Last verdict", diagnosis ? linkTo("diagnosis", diagnosis.id, named(`${diagnosis.figures.verdict}`)) : "–", diagnosis ? moment(diagnosis.created) : "none yet"],
    ]),
    report ? [
      h("div", { class: "row" }, h("a", { class: "button primary", href: `#/new?robot=${path}`, text: "New campaign with it" }), h("a", { class: "button", href: "#/history", text: "Over time" })),
      section("arm", "The arm", robotSheet(report), cautions(report.findings)),
    ] : null,
    section("lately", "Lately", items(here.slice(0, LATELY).map((each) => ({
      href: `#/${KINDS[each.kind]}/${each.id}`, name: title(each.kind), outcome: outcome(each, each.figures), created: each.created })), "Nothing yet.")));
}

function explainedShare(error) {
  const relative = error?.held_out_error ?? error?.relative_error;
  return typeof relative === "number" ? `relative error ${percent(relative)}` : "passed every gate";
}

export function robotSheet(report) {
  return h("div", { class: "split" }, armDrawing(report).element,
    table("Joints", ["", "joint", "type", "position", "velocity", "torque"], jointRows(report, number), 3));
}
