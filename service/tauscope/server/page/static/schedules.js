// What is done by itself: when, whether it may be, and what became of it the last time.

import { getJson } from "./api.js";
import { h, moment, named, number, section, state } from "./dom.js";

const NOTHING_STARTED = ["skipped", "missed", "failed", "interrupted", "withdrawn"];

/** All schedules as a section. */
export async function scheduleSection(signal) {
  const { schedules } = await getJson("schedules", signal);
  if (!schedules.length) return section("schedules", "Schedules", h("p", { class: "lead", text: "Nothing is done by itself." }));
  const last = await Promise.all(schedules.map(async (each) => (await getJson(`${each.firings}?limit=1`, signal)).firings[0]));
  return section("schedules", "Schedules", schedules.map((each, place) => h("article", { class: "card plain-card", "aria-label": each.name },
    h("h3", {}, each.name, h("span", { text: each.robot ? ` ${named(each.definition.kind)} of ${each.robot}` : ` ${named(each.definition.kind)} of an arm` })),
    h("dl", {}, [["When", whenDue(each.definition)], ["Due next", each.next_due ? moment(each.next_due) : "not enabled"], ["Last time", outcome(last[place])]].map(
      ([name, value]) => [h("dt", { text: name }), h("dd", {}, value)])))));
}

/** When a schedule is due, in the time zone that it says. */
function whenDue({ cron, every_s: seconds, timezone, window }) {
  const due = cron ? `${cron} (${timezone})` : `every ${duration(seconds)}`;
  return window ? `${due}, from ${window.start} to ${window.end} only` : due;
}

function duration(seconds) {
  if (seconds < 3600) return `${number(seconds / 60, 3)} min`;
  return seconds < 86_400 ? `${number(seconds / 3600, 3)} h` : `${number(seconds / 86_400, 3)} days`;
}

/** What became of a firing: the item that it started, or why it started none. */
function outcome(firing) {
  if (!firing) return "not due yet";
  const when = moment(firing.due);
  if (NOTHING_STARTED.includes(firing.state)) return h("span", {}, `${when}: ${named(firing.state)}, `, firing.reason ? h("span", { text: firing.reason }) : "no reason was kept");
  if (!firing.item) return `${when}: ${named(firing.state)}`;
  return h("span", {}, h("a", { href: `#/${firing.item.replace(/^\/api\/v1\//, "")}`, text: when }), " ", state(firing.item_state ?? firing.state));
}
