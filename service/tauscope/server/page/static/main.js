// The shell: which view is shown, whether the service can be reached, and the button that stops every arm.

import { ENDS, getJson, hasKey, useKey } from "./api.js";
import { explained, h, render } from "./dom.js";
import { recolour } from "./plots.js";
import { showCampaign, showCampaigns, showNewCampaign } from "./campaigns.js";
import { showDiagnoses, showDiagnosis } from "./diagnoses.js";
import { keepLeases } from "./leases.js";
import { showHome } from "./home.js";
import { showHistory } from "./history.js";
import { showIdentification, showIdentifications } from "./identifications.js";
import { showRecording, showRecordings } from "./recordings.js";
import { showRobot, showRobots } from "./robots.js";
import { showRun, showRuns } from "./runs.js";
import { stopEverything } from "./stop.js";

const VIEWS = [
  [/^\/$/, showHome], [/^\/campaigns$/, showCampaigns], [/^\/new$/, showNewCampaign], [/^\/campaigns\/([^/]+)$/, showCampaign],
  [/^\/robots$/, showRobots], [/^\/robots\/([^/]+)$/, showRobot],
  [/^\/runs$/, showRuns], [/^\/runs\/([^/]+)$/, showRun],
  [/^\/recordings$/, showRecordings], [/^\/recordings\/([^/]+)$/, showRecording],
  [/^\/identifications$/, showIdentifications], [/^\/identifications\/([^/]+)$/, showIdentification],
  [/^\/history$/, showHistory], [/^\/diagnoses$/, showDiagnoses], [/^\/diagnoses\/([^/]+)$/, showDiagnosis],
];
const MENU = [["/", "Home"], ["/campaigns", "Campaigns"], ["/robots", "Robots"], ["/runs", "Runs"], ["/recordings", "Recordings"], ["/identifications", "Identifications"], ["/diagnoses", "Diagnoses"], ["/history", "Over time"]];
const PULSE_MS = 2000;
const THEMES = ["auto", "light", "dark"];

const content = document.getElementById("content");
const stopButton = document.getElementById("stop");
let leaving = new AbortController();
let live = { runs: [], campaigns: [] };
let reached = true;

let panel = null; // asks for a key

function needKey(problem) {
  if (panel) return;
  const input = h("input", { type: "password", autocomplete: "off", required: true, autofocus: true, id: "key" });
  const close = () => { panel.remove(); panel = null; };
  panel = h("dialog", { "aria-labelledby": "key-title" },
    h("h2", { id: "key-title", text: "An API key is needed" }), h("p", { class: "note" }, explained(problem)),
    h("form", { onsubmit: (event) => { event.preventDefault(); useKey(input.value.trim()); close(); show(); } },
      h("label", { for: "key" }, "Key", input), h("p", { class: "note", text: "It is kept until this tab is closed, and nowhere else." }),
      h("div", { class: "row" }, h("button", { type: "submit", class: "primary", text: "Go on" }),
        hasKey() ? h("button", { type: "button", text: "Keep the one I have", onclick: close }) : null)));
  content.before(panel); // below what is said of a stop, and never over it
  panel.show(); // not as a modal: nothing may shut Stop away
  panel.scrollIntoView({ block: "nearest" });
}

function offerKeyChange() {
  const change = () => needKey({ message: "The key of this tab is replaced." });
  render(document.getElementById("key-change"), hasKey() ? h("button", { type: "button", class: "link", text: "Use another key", onclick: change }) : null);
}

async function show() {
  leaving.abort();
  leaving = new AbortController();
  const { signal } = leaving;
  const path = location.hash.slice(1).split("?")[0] || "/";
  for (const link of document.querySelectorAll("#navigation a")) {
    const target = link.getAttribute("href").slice(1);
    const here = target === "/" ? path === "/" : path.startsWith(target) || (target === "/campaigns" && path === "/new");
    if (here) {
      link.setAttribute("aria-current", "page");
      link.scrollIntoView({ block: "nearest", inline: "nearest" }); // on a narrow screen the menu is longer than its line
    } else link.removeAttribute("aria-current");
  }
  const found = VIEWS.map(([pattern, view]) => [pattern.exec(path), view]).find(([match]) => match);
  render(content, h("div", { class: "placeholder", "aria-busy": "true" }));
  if (!found) {
    render(content, h("h1", { text: "There is no such page" }), h("p", {}, h("a", { href: "#/", text: "Go home" })));
    return;
  }
  try {
    await found[1](content, { id: found[0][1] && decodeURIComponent(found[0][1]), signal, show });
  } catch (error) {
    if (signal.aborted) return;
    if (error.status === 401) needKey(error);
    else render(content, h("h1", { text: "This cannot be shown" }), h("p", { role: "alert" }, explained(error)),
      h("button", { type: "button", onclick: show, text: "Try again" }));
  }
}

async function pulse() {
  const quick = AbortSignal.timeout(PULSE_MS * 1.5);
  if (panel) { setTimeout(pulse, PULSE_MS); return; } // until there is a key, every request would only be refused
  try {
    const [runs, campaigns] = await Promise.all([getJson("runs?limit=8", quick), getJson("campaigns?limit=8", quick)]);
    const goesOn = (each) => !ENDS.includes(each.state);
    live = { runs: runs.runs.filter(goesOn), campaigns: campaigns.campaigns.filter(goesOn) };
    connection(true);
  } catch (error) {
    if (error.status === 401) {
      connection(true);
      needKey(error);
    } else connection(error.status !== undefined);
  }
  setTimeout(pulse, PULSE_MS);
}

function connection(now) {
  const shown = document.getElementById("link-state");
  const moving = live.runs.length + live.campaigns.length;
  shown.classList.toggle("lost", !now);
  shown.textContent = now ? (moving ? "An arm is in use" : "Connected") : "Not connected";
  if (now !== reached) {
    notice(now ? "" : "The connection to the service is lost. The page may show old values. Stop is tried again and again when pressed; to be sure, use the arm's own emergency stop.");
    reached = now;
    if (now) window.dispatchEvent(new Event("tauscope:back"));
  }
}

function notice(text) {
  document.getElementById("notice").textContent = text;
}

async function stopAll() {
  stopButton.classList.add("pressed");
  stopButton.textContent = "Stopping";
  const known = [...live.campaigns, ...live.runs].map((each) => each.links.stop);
  const refused = await stopEverything(known, notice);
  stopButton.classList.remove("pressed");
  stopButton.textContent = "Stop";
  if (refused?.status === 401) needKey(refused);
  if (!refused) setTimeout(() => { if (reached) notice(""); }, 6000);
}

function tellLeases(arms, lost) {
  const shown = document.getElementById("lease");
  shown.textContent = arms.length ? `This tab has the lease of ${arms.join(" and ")}: where it is closed, or its connection is gone for ten seconds, the arm stops.` : "";
  if (lost) notice(lost);
}

function theme(choice) {
  localStorage.setItem("tauscope-theme", choice);
  if (choice === "auto") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = choice;
  const button = document.getElementById("theme");
  const [mark, word] = { auto: ["◐", "Auto"], light: ["○", "Light"], dark: ["●", "Dark"] }[choice];
  render(button, mark, h("span", { class: "word", text: ` ${word}` }));
  button.setAttribute("aria-label", `Colours: ${word}`);
  recolour();
}

document.getElementById("navigation").append(...MENU.map(([path, name]) => h("a", { href: `#${path}`, text: name })));
document.getElementById("theme").addEventListener("click", () => {
  theme(THEMES[(THEMES.indexOf(localStorage.getItem("tauscope-theme") ?? "auto") + 1) % THEMES.length]);
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", recolour);
stopButton.addEventListener("click", stopAll);
window.addEventListener("hashchange", async () => { await show(); content.focus({ preventScroll: true }); window.scrollTo(0, 0); });
window.addEventListener("tauscope:back", show);
window.addEventListener("tauscope:ask-key", (event) => needKey(event.detail));
window.addEventListener("tauscope:key", offerKeyChange);
offerKeyChange();
keepLeases(tellLeases);
theme(localStorage.getItem("tauscope-theme") ?? "auto");
getJson("/healthz").then(({ version }) => { document.getElementById("version").textContent = `Tauscope ${version}`; }).catch(() => {});
show();
pulse();
