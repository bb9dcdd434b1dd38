// Which column of a file is which, and in which unit: a table of choices.

import { h } from "./dom.js";

const TIME = [["s", "s"], ["ms", "ms"], ["us", "µs"], ["ns", "ns"], ["index", "samples"]];
const EFFORT = [["A", "A"], ["mA", "mA"], ["drive", "drive units"]];
const REVOLUTE = { q: [["rad", "rad"], ["deg", "°"]], qd: [["rad", "rad/s"], ["deg", "°/s"], ["rpm", "rpm"]], tau: [["Nm", "Nm"], ...EFFORT] };
const PRISMATIC = { q: [["m", "m"], ["mm", "mm"]], qd: [["m", "m/s"], ["mm", "mm/s"]], tau: [["N", "N"], ...EFFORT] };
const MIXED = { q: [["rad", "rad, m"], ["deg", "°, m"], ["mm", "rad, mm"]], qd: [["rad", "rad/s, m/s"], ["deg", "°/s, m/s"], ["mm", "rad/s, mm/s"]], tau: [["Nm", "Nm, N"], ...EFFORT] };
const SI = { rad: "m", Nm: "N" };

const isPrismatic = (joint) => joint.type === "prismatic";

/** A column's choices; `change(reading)` is told what a user chose. */
export function mappingForm(mapping, joints, reading, change) {
  const units = unitsOf(joints);
  const allSlide = units === PRISMATIC;
  const chosen = { ...mapping.units, ...reading.units };
  if (allSlide) for (const group of ["q", "qd", "tau"]) chosen[group] = SI[chosen[group]] ?? chosen[group];
  const columns = asTorque(reading.columns ?? mapping.columns);
  const tell = (more) => change({ columns, units: chosen, ...more });

  const column = (target, label) => h("select", { "aria-label": label, onchange: (event) => {
    const name = event.target.value;
    const other = Object.keys(columns).find((each) => name && columns[each] === name);
    const next = { ...columns, ...(other ? { [other]: columns[target] } : {}), [target]: name }; // two columns change places
    tell({ columns: Object.fromEntries(Object.entries(next).filter(([, each]) => each)) });
  } }, h("option", { value: "", text: "–" }), mapping.header.map((name) => h("option", { value: name, text: name, selected: columns[target] === name })));
  const unit = (group, label, choices) => h("select", { "aria-label": label, onchange: (event) => {
    chosen[group] = event.target.value;
    tell({ rate_hz: chosen.t === "index" ? reading.rate_hz ?? 100 : null });
  } }, choices.map(([value, text]) => h("option", { value, text, selected: chosen[group] === value })));

  const head = (group, name) => h("th", { scope: "col", class: "word" }, name, " ", unit(group, `Unit of ${name.toLowerCase()}`, units[group]));
  return h("div", {},
    h("div", { class: "row" }, h("span", { text: "Time" }), column("t", "Column of the time"), unit("t", "Unit of time", TIME),
      chosen.t === "index" ? h("label", { class: "inline", for: "rate" }, "Samples a second ", h("input", { id: "rate", type: "number", min: "0.1", step: "any", value: reading.rate_hz ?? 100, onchange: (event) => tell({ rate_hz: Number(event.target.value) }) })) : null),
    h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Columns of every joint" },
      h("table", { class: "mapping" }, h("thead", {}, h("tr", {}, h("th", { scope: "col", class: "word", text: "Joint" }), head("q", "Position"), head("tau", "Torque or current"), head("qd", "Velocity"))),
        h("tbody", {}, joints.map((joint, place) => h("tr", {}, h("th", { scope: "row", class: "word", text: joint.name }),
          [["q", "Position"], ["tau", "Torque or current"], ["qd", "Velocity"]].map(([group, name]) => h("td", { class: "word" }, column(`${group}${place + 1}`, `${name} of ${joint.name}`)))))))));
}

const unitsOf = (joints) => (joints.every(isPrismatic) ? PRISMATIC : joints.some(isPrismatic) ? MIXED : REVOLUTE);

/** Currents as columns of torque: their unit says that they are currents. */
function asTorque(columns) {
  return Object.fromEntries(Object.entries(columns).map(([target, name]) => [target.replace(/^i(?=\d)/, "tau"), name]));
}
