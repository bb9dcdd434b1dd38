// Elements made from text only: whatever a name holds, it is never read as markup.

const LONG = 60; // letters of a cell that may fill several lines
const SVG = "http://www.w3.org/2000/svg";

function filled(element, properties, children) {
  for (const [name, value] of Object.entries(properties ?? {})) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "text") element.textContent = value;
    else if (name === "width%") element.style.setProperty("width", `${value}%`); // the one style that data decide
    else element.setAttribute(name, value === true ? "" : value);
  }
  for (const child of children.flat(Infinity)) {
    if (child !== null && child !== undefined && child !== false) element.append(child);
  }
  return element;
}

export function h(tag, properties, ...children) {
  return filled(document.createElement(tag), properties, children);
}

/** Put elements or text in place of what an element held; what is not there leaves nothing. */
export function render(element, ...children) {
  element.replaceChildren();
  filled(element, {}, children);
}

export function s(tag, properties, ...children) {
  return filled(document.createElementNS(SVG, tag), properties, children);
}

export function number(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size < 1e-4 || size >= 1e7) return value.toExponential(digits - 1).replace("-", "−");
  const decimals = Math.max(digits - 1 - Math.floor(Math.log10(size)), 0);
  return value.toFixed(Math.min(decimals, 9)).replace("-", "−");
}

export const unit = (name) => (name === "1" ? "" : ` ${name}`);

const OF_ANY = { time: "s", temperature: "°C", motor_position: "rad" };
const REVOLUTE = { ...OF_ANY, position: "rad", velocity: "rad/s", acceleration: "rad/s²", load: "Nm", torque: "Nm", spectrum: "(Nm)²/Hz" };
const PRISMATIC = { ...OF_ANY, position: "m", velocity: "m/s", acceleration: "m/s²", load: "N", torque: "N", spectrum: "N²/Hz" };

/** Units of a joint that moves in this way; both where nobody has said. */
export function unitsOf(type) {
  if (type === "prismatic") return PRISMATIC;
  if (type === "revolute") return REVOLUTE;
  return Object.fromEntries(Object.entries(REVOLUTE).map(([name, own]) => [name, own === PRISMATIC[name] ? own : `${own} or ${PRISMATIC[name]}`]));
}

const QUANTITIES = { m: "mass", ms: "first moment", I: "inertia" };

/** A base parameter by its leading term, such as "first moment x of link 2"; the whole expression on demand. */
export function parameterName(name) {
  const terms = name.split(/ [+-] /);
  const [, quantity, axes, link] = /^(?:[\d.e-]+\*)?(ms|m|I)([xyz]*)(\d+)$/.exec(terms[0]) ?? [];
  if (!quantity) return name;
  const lead = `${QUANTITIES[quantity]}${axes ? ` ${axes}` : ""} of link ${link}`;
  if (terms.length === 1) return h("span", { title: name, text: lead });
  return h("details", { class: "parameter" }, h("summary", { text: `${lead}, and ${terms.length - 1} more` }), h("code", { text: name }));
}

/** A value and its standard error, to the error's second digit. */
export function withError(value, std) {
  if (!Number.isFinite(std) || std <= 0) return number(value);
  const decimals = Math.min(Math.max(1 - Math.floor(Math.log10(std)), 0), 9);
  return `${value.toFixed(decimals)} ± ${std.toFixed(decimals)}`.replaceAll("-", "−");
}

/** A chance in words: what is not certain is never said to be. */
export function chance(value) {
  return value > 0.99 && value < 1 ? "> 99 %" : `${(100 * value).toFixed(0)} %`;
}

export function percent(share) {
  if (!Number.isFinite(share)) return "–";
  const percents = 100 * share;
  return `${Math.abs(percents) < 99.5 ? percents.toPrecision(2) : percents.toFixed(0)} %`;
}

// English in the reader's own manner, as of Britain or of America.
const LOCALE = navigator.languages.find((each) => each.startsWith("en")) ?? "en";

export function moment(text) {
  if (!text) return "–";
  return new Date(text).toLocaleString(LOCALE, { dateStyle: "medium", timeStyle: "short" });
}

export const named = (id) => id.replaceAll("_", " ");

export function title(id) {
  const words = named(id);
  return words.charAt(0).toUpperCase() + words.slice(1);
}

export function bytes(count) {
  return count < 1e6 ? `${(count / 1e3).toFixed(0)} kB` : `${(count / 1e6).toFixed(1)} MB`;
}

/** A table that scrolls by itself; `words` leading columns hold words, the others numbers. */
export function table(caption, columns, rows, words = 1) {
  const cell = (tag, place, content, scope) =>
    h(tag, { class: place < words ? (content.length > LONG ? "word long" : "word") : null, scope }, content);
  return h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": caption },
    h("table", {},
      h("thead", {}, h("tr", {}, columns.map((name, place) => cell("th", place, name, "col")))),
      h("tbody", {}, rows.map((row) => h("tr", {}, row.map((content, place) => cell("td", place, content)))))));
}

/** A state as a word with a mark of its own shape, for those who tell no colours apart. */
export function state(name) {
  const marks = { succeeded: "●", finished: "●", degraded: "✕", failed: "✕", damaged: "✕", interrupted: "✕", cancelled: "■", stopped: "■" };
  const kind = ["succeeded", "finished"].includes(name) ? "good" : marks[name] ? "bad" : "live";
  return h("span", { class: `state ${kind}` }, h("span", { "aria-hidden": "true" }, marks[name] ?? "◐"), ` ${named(name)}`);
}

export function verdict(name) {
  const [mark, kind] = { consistent: ["●", "good"], explained: ["◆", "good"], partly_explained: ["◈", "live"], unexplained: ["✕", "bad"], inconclusive: ["?", "muted"], wrong_values: ["≠", "bad"] }[name] ?? ["–", "muted"];
  return h("span", { class: `state ${kind}` }, h("span", { "aria-hidden": "true" }, mark), ` ${named(`${name ?? "no verdict"}`)}`);
}

/** What went wrong, and the page that explains its code: in a tab of its own, since this one may be watching an arm. */
export function explained(problem) {
  const { code } = problem;
  const other = code === "forbidden" ? [" · ", h("button", { type: "button", class: "link", text: "Use another key", onclick: () => window.dispatchEvent(new CustomEvent("tauscope:ask-key", { detail: problem })) })] : null;
  const more = code ? h("a", { href: `/docs/errors/${encodeURIComponent(code)}`, target: "_blank", rel: "noopener", text: `What ${code} means` }) : null;
  return [h("span", { text: problem.detail ?? problem.message }), more ? [" · ", more] : null, other];
}

/** Do something; whether it was done. What went wrong is said in place of `said`. */
export async function attempt(said, act) {
  try {
    await act();
    return true;
  } catch (error) {
    render(said, explained(error));
    return false;
  }
}

/** Handlers of an element onto which files may be dropped; `target()` shows that they are over it. */
export const dropHandlers = (target, take) => ({
  ondragover: (event) => { event.preventDefault(); target().classList.add("over"); },
  ondragleave: () => target().classList.remove("over"),
  ondrop: (event) => { event.preventDefault(); target().classList.remove("over"); return take(event.dataTransfer); },
});

export function cautions(findings) {
  const doubts = findings.filter((each) => each.severity !== "info");
  return doubts.length ? h("ul", { class: "cautions" }, doubts.map((each) => h("li", { text: `${each.where}: ${each.text}` }))) : null;
}

export function figures(entries) {
  return h("dl", { class: "figures" }, entries.map(([name, value, remark]) =>
    h("div", {}, h("dt", { text: name }), h("dd", {}, value, remark ? h("small", { text: remark }) : null))));
}

export function section(id, heading, ...children) {
  return h("section", { id, "aria-labelledby": `${id}-title` }, h("h2", { id: `${id}-title`, text: heading }), children);
}

export function tabs(label, names, chosen, choose) {
  const buttons = names.map((name, place) => h("button", {
    type: "button", class: "quiet", "aria-pressed": place === chosen ? "true" : "false",
    onclick: () => {
      buttons.forEach((each, other) => each.setAttribute("aria-pressed", other === place ? "true" : "false"));
      choose(place);
    },
  }, name));
  return h("div", { class: "tabs", role: "group", "aria-label": label }, buttons);
}
