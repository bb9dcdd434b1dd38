// The API key of this tab: asked for where the service wants one, in a panel that leaves Stop within reach.

import { explained, h, render } from "./dom.js";
import { hasKey, useKey } from "./api.js";

let panel = null;

/** Whether a key is being asked for: until then, every request would only be refused. */
export const isAsked = () => panel !== null;

/** Ask for a key; `go` is called as soon as there is one. */
export function askForKey(problem, go) {
  if (panel) return;
  const input = h("input", { type: "password", autocomplete: "off", required: true, autofocus: true, id: "key" });
  const close = () => { panel.remove(); panel = null; };
  panel = h("dialog", { "aria-labelledby": "key-title" },
    h("h2", { id: "key-title", text: "An API key is needed" }), h("p", { class: "note" }, explained(problem)),
    h("form", { onsubmit: (event) => { event.preventDefault(); useKey(input.value.trim()); close(); go(); } },
      h("label", { for: "key" }, "Key", input), h("p", { class: "note", text: "It is kept until this tab is closed, and nowhere else." }),
      h("div", { class: "row" }, h("button", { type: "submit", class: "primary", text: "Go on" }),
        hasKey() ? h("button", { type: "button", text: "Keep the one I have", onclick: close }) : null)));
  document.getElementById("content").before(panel); // below what is said of a stop, and never over it
  panel.show(); // not as a modal: nothing may shut Stop away
  panel.scrollIntoView({ block: "nearest" });
}

/** The button in the foot of the page by which another key is entered. */
export function keyButton(place, change) {
  const draw = () => render(place, hasKey() ? h("button", { type: "button", class: "link", text: "Use another key", onclick: change }) : null);
  window.addEventListener("tauscope:key", draw);
  draw();
}
