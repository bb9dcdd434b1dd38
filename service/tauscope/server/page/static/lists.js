// Lists of what is kept, the newest first.

import { getJson } from "./api.js";
import { h, moment, render, state } from "./dom.js";

/** A list of links. */
export function items(entries, empty) {
  if (!entries.length) return h("p", { class: "lead", text: empty });
  return h("ul", { class: "list" }, entries.map((each) => h("li", {}, h("a", { class: "item", href: each.href },
    h("span", {}, h("strong", { text: each.name }), each.detail ? h("span", { class: "meta", text: ` ${each.detail}` }) : null),
    each.state ? state(each.state) : h("span", { text: each.middle ?? "" }),
    h("span", { class: "when", text: each.when })))));
}

/** A view that is one list of jobs. */
export function jobList(kind, heading, lead, detail) {
  return async (root, { signal }) => {
    const found = (await getJson(`${kind}?limit=200`, signal))[kind];
    render(root, h("h1", { text: heading }), h("p", { class: "lead", text: lead }), items(found.map((each) => ({
      href: `#/${kind}/${each.id}`, name: each.robot ?? each.id, detail: detail(each), state: each.state, when: moment(each.created),
    })), "Nothing yet."));
  };
}
