// Lists of what is kept, the newest first: each entry with its outcome, found by words and by kind of outcome.

import { ENDS, getJson, remove } from "./api.js";
import { explained, h, moment, named, percent, render, state, verdict } from "./dom.js";

const UNDO_MS = 6000;
const FEW = 6; // entries that need no search

/** An outcome in words: verdict and headline of a diagnosis, error of an identification; else the state. */
export function outcome(entry, figures = {}) {
  if (figures.verdict) return { tag: named(figures.verdict), content: [verdict(figures.verdict), " ", figures.headline ?? ""], words: figures.headline ?? "" };
  const error = figures.held_out_error ?? figures.relative_error;
  if (entry.state === "succeeded" && typeof error === "number") return { tag: "identified", content: [`Relative error ${percent(error)}`, figures.held_out_error === null ? " on its own recordings" : ", held out"], words: "" };
  const reason = entry.problem?.detail ?? entry.problem ?? "";
  return { tag: named(entry.state), content: [state(entry.state), reason ? h("span", { class: "meta", text: ` ${reason}` }) : ""], words: reason };
}

/** A list of links; entries: { href, name, detail, outcome, when }. */
export function items(entries, empty) {
  if (!entries.length) return h("p", { class: "lead", text: empty });
  return h("ul", { class: "list" }, entries.map(row));
}

function row(each) {
  const link = h("a", { class: "item", href: each.href },
    h("span", {}, h("strong", { text: each.name }), each.detail ? h("span", { class: "meta", text: ` ${each.detail}` }) : null),
    h("span", {}, each.outcome?.content ?? each.middle ?? ""),
    h("span", { class: "when", text: moment(each.created) }));
  if (!each.path) return h("li", {}, link);
  const line = h("li", { class: "removable" });
  const cross = h("button", { type: "button", class: "quiet", "aria-label": `Remove ${each.name}, ${moment(each.created)}`, text: "×", onclick: () => takeAway(line, each, () => render(line, link, cross)) });
  render(line, link, cross);
  return line;
}

/** Remove an entry, but not before there was time to think again; leaving the page counts as thought. */
function takeAway(line, each, restore) {
  const decide = () => {
    clearTimeout(timer);
    window.removeEventListener("hashchange", act);
  };
  const act = async () => {
    decide();
    try {
      await remove(each.path);
      line.remove();
    } catch (error) {
      restore();
      line.append(h("p", { role: "alert" }, explained(error)));
    }
  };
  const timer = setTimeout(act, UNDO_MS);
  window.addEventListener("hashchange", act);
  const undo = h("button", { type: "button", class: "link", text: "Undo", onclick: () => { decide(); restore(); } });
  render(line, h("p", { role: "status" }, `${each.name} is removed. `, undo));
  undo.focus();
}

export function searchable(entries, empty) {
  if (entries.length <= FEW) return items(entries, empty);
  const place = h("div", {});
  const count = h("span", { class: "note", role: "status" });
  const words = h("input", { type: "search", id: "search", placeholder: "Robot, recording, finding", oninput: () => draw() });
  const tags = [...new Set(entries.map((each) => each.outcome?.tag).filter(Boolean))].sort();
  const tag = h("select", { id: "outcome", onchange: () => draw() }, h("option", { value: "", text: "all" }), tags.map((name) => h("option", { value: name, text: name })));
  const order = h("select", { id: "order", onchange: () => draw() }, h("option", { value: "new", text: "newest first" }), h("option", { value: "old", text: "oldest first" }), h("option", { value: "name", text: "by name" }));
  function draw() {
    const sought = words.value.toLowerCase().split(/\s+/).filter(Boolean);
    const found = entries.filter((each) => {
      const text = `${each.name} ${each.detail ?? ""} ${each.outcome?.tag ?? ""} ${each.outcome?.words ?? ""}`.toLowerCase();
      return (!tag.value || each.outcome?.tag === tag.value) && sought.every((word) => text.includes(word));
    });
    if (order.value === "old") found.reverse();
    if (order.value === "name") found.sort((a, b) => a.name.localeCompare(b.name, "en", { numeric: true }));
    count.textContent = `${found.length} of ${entries.length}`;
    render(place, items(found, "Nothing matches."));
  }
  draw();
  return h("div", {}, h("form", { class: "row search", role: "search", onsubmit: (event) => event.preventDefault() },
    h("label", { class: "inline", for: "search" }, "Search", words), tags.length > 1 ? h("label", { class: "inline", for: "outcome" }, "Outcome", tag) : null,
    h("label", { class: "inline", for: "order" }, "Order", order), count), place);
}

export async function figuresOf(kind, signal) {
  const { items: found } = await getJson(`items?kind=${kind}&limit=1000`, signal);
  return new Map(found.filter((each) => each.is_here).map((each) => [each.id, each.figures]));
}

export function jobList(plural, kind, heading, lead, detail) {
  return async (root, { signal }) => {
    const [answer, figures] = await Promise.all([getJson(`${plural}?limit=1000`, signal), figuresOf(kind, signal)]);
    render(root, h("h1", { text: heading }), h("p", { class: "lead", text: lead }), searchable(answer[plural].map((each) => ({
      href: `#/${plural}/${each.id}`, path: ENDS.includes(each.state) ? `${plural}/${each.id}` : null, name: each.robot ?? each.id, detail: detail(each), outcome: outcome(each, figures.get(each.id)), created: each.created,
    })), "Nothing yet."));
  };
}
