// Home: drop a robot file and recordings, see them as they are understood, mend them, and read the verdict.

import { fetchRaw, formOf, getJson, post } from "./api.js";
import { attempt, cautions, h, moment, named, number, percent, render, section, state, verdict, dropHandlers } from "./dom.js";

const MOST_ROBOTS = 12;
const OPTIONS = /; read it with --units.*|,? or go on with --trust-units.*/; // the page has buttons for these options
const HELD_OUT = /held|test|valid/i; // names that people give to recordings that judge a model

/** What was dropped; it outlives the view, so that the way back leads to it. */
const dropped = { robot: [], report: null, recordings: [], unused: [], reading: {}, isGuessed: false };

export async function showHome(root, { signal }) {
  const [{ robots }, { items }] = await Promise.all([getJson("robots", signal), getJson("items?limit=300", signal)]);
  const diagnoses = items.filter((each) => each.is_here && each.kind === "diagnosis" && each.state === "succeeded");
  const said = h("p", { role: "status", class: "note" });
  const sheet = h("div", {});
  const working = { turn: 0 };
  const redraw = () => {
    drop.classList.toggle("filled", Boolean(dropped.robot.length || dropped.recordings.length));
    render(sheet, dropped.robot.length || dropped.recordings.length ? understood(dropped, { redraw, recheck, said, diagnoses }) : null);
  };

  async function take(files) {
    const sorted = await sortFiles(files);
    if (sorted.robot.length) {
      dropped.robot = sorted.robot;
      dropped.report = null;
    }
    const names = new Set(sorted.recordings.map((file) => file.name));
    dropped.recordings = [...dropped.recordings.filter((each) => !names.has(each.file.name)), ...sorted.recordings.map((file) => ({ file, role: "", found: null }))];
    dropped.unused = sorted.unused;
    giveRoles(dropped.recordings);
    dropped.reading = {};
    await recheck();
  }

  /** Ask the service how it understands each file; a later call ends an earlier one. */
  async function recheck() {
    working.turn += 1;
    const { turn } = working;
    render(said);
    if (dropped.robot.length && !dropped.report) await attempt(said, async () => { dropped.report = await post("robots/check", formOf(null, robotParts())); });
    for (const each of dropped.recordings) each.found = null;
    redraw();
    for (const each of dropped.recordings) {
      if (turn !== working.turn) return;
      each.found = await understand(each.file);
      const { mapping } = each.found;
      if (mapping?.is_guessed && !dropped.reading.columns) {
        dropped.reading = { ...dropped.reading, columns: mapping.columns, units: mapping.units };
        dropped.isGuessed = true;
      }
      if (turn === working.turn) redraw();
    }
  }

  const files = h("input", { type: "file", id: "files", multiple: true, class: "unseen", onchange: () => take([...files.files]) });
  const folder = h("input", { type: "file", id: "folder", webkitdirectory: true, class: "unseen", onchange: () => take([...folder.files]) });
  const drop = h("div", { class: "drop home" },
    h("p", { class: "call", text: "Drop a robot file and its recordings, or a folder" }),
    h("p", { class: "note", text: "Robot: URDF, MJCF or YAML. Recordings: CSV, Parquet, MCAP, a ROS bag or NPZ." }),
    h("div", { class: "row" },
      h("label", { class: "button primary", for: "files" }, "Choose files", files), h("label", { class: "button", for: "folder" }, "Choose a folder", folder),
      h("button", { type: "button", class: "link", text: "Try the example", onclick: async () => {
        clear();
        await take(await exampleFiles());
      } })));
  render(root, h("div", dropHandlers(() => drop, async (transfer) => take(await droppedFiles(transfer))),
    h("h1", { text: "Find the physics that your robot model lacks" }), drop, said, sheet, section("recent", "Recent robots", recent(robots, items))));
  redraw();
}

function clear() {
  Object.assign(dropped, { robot: [], report: null, recordings: [], unused: [], reading: {}, isGuessed: false });
}

/** Held-out recordings by their names; else the last of several. */
function giveRoles(recordings) {
  for (const each of recordings) each.role ||= HELD_OUT.test(each.file.name) ? "held_out" : "recordings";
  const isJudged = recordings.some((each) => each.role === "held_out");
  if (recordings.length > 1 && !isJudged) recordings[recordings.length - 1].role = "held_out";
  if (recordings.length && recordings.every((each) => each.role === "held_out")) recordings[0].role = "recordings";
}

const robotParts = () => dropped.robot.map((file, place) => [place ? "urdf" : "robot", file]);

async function understand(file) {
  try {
    return await post("mappings/check", formOf(dropped.reading, [...(dropped.report ? robotParts() : []), ["file", file]]));
  } catch (error) { return { mapping: null, report: null, problem: error.message }; }
}

function fault(found) {
  if (!found) return null;
  const error = found.report?.findings.find((each) => each.severity === "error");
  return found.problem ?? (error ? `column ${error.where}: ${error.text}` : null);
}

function understood(all, { redraw, recheck, said, diagnoses }) {
  const { report, recordings } = all;
  const shown = recordings.find((each) => each.found?.mapping)?.found.mapping;
  const used = recordings.filter((each) => each.role);
  const hasError = used.some((each) => fault(each.found));
  const isReady = report && used.some((each) => each.role === "recordings") && used.every((each) => each.found) && !hasError;
  const count = report?.joints.length ?? recordings.find((each) => each.found?.report)?.found.report.joints.length ?? 0;
  const change = (more) => {
    all.reading = { ...all.reading, ...more, units: { ...all.reading.units, ...more.units } };
    all.isGuessed = false;
    recheck();
  };
  return [
    section("robot", "Robot", report ? [
      h("p", { class: "whole" }, h("strong", { text: report.name }), ` · ${report.joints.length === 1 ? "1 joint" : `${report.joints.length} joints`}: ${report.joints.map((each) => each.name).join(", ")}`,
        report.total_mass === null ? " · no masses stated" : ` · ${number(report.total_mass, 3)} kg stated`),
      cautions(report.findings),
    ] : h("p", { class: "note", text: all.robot.length ? "The robot file cannot be used; drop another one." : "Add the robot file: URDF, MJCF or YAML." })),
    section("dropped", "Recordings", recordings.length ? h("ul", { class: "list dropped" }, recordings.map((each) => recordingRow(each, change, redraw))) : h("p", { class: "note", text: "Add at least one recording. A second one confirms the findings of the first." }),
      all.unused.length ? h("p", { class: "note", text: `Not used: ${all.unused.map((file) => file.name).join(", ")}` }) : null),
    shown ? section("columns", "Columns and units", h("p", { class: "note", text: all.isGuessed ? "Guessed from the names of the columns. Check each one, and change any that are wrong." : "As the service reads them. Change any that are wrong." }),
      mappingForm(shown, report?.joints ?? Array.from({ length: count }, (_, place) => ({ name: `joint ${place + 1}` })), all.reading, change)) : null,
    hasError && recordings.some((each) => each.found?.report && fault(each.found)) ? h("label", { class: "check", for: "trust" },
      h("input", { type: "checkbox", id: "trust", checked: Boolean(all.reading.trust_units), onchange: (event) => change({ trust_units: event.target.checked }) }), "Use these values as they are.") : null,
    startRow(all, isReady, said, diagnoses.filter((each) => each.robot === report?.name)),
  ];
}

function recordingRow(each, change, redraw) {
  const { found, file } = each;
  const report = found?.report;
  const problem = fault(found);
  const units = /--units ([a-z0-9]+)=([a-zA-Z]+)/.exec(problem ?? "");
  const remedy = units && h("button", { type: "button", class: "link", text: `Read ${units[1]} in ${units[2]}`, onclick: () => change({ units: { [units[1]]: units[2] } }) });
  const doubts = report?.findings.filter((one) => one.severity === "warning") ?? [];
  const role = h("select", { "aria-label": `Use of ${file.name}`, onchange: () => { each.role = role.value; redraw(); } },
    [["recordings", "explain"], ["held_out", "confirm (held out)"], ["", "leave out"]].map(([value, text]) => h("option", { value, text, selected: each.role === value })));
  return h("li", {}, h("div", { class: "line" }, h("strong", { text: file.name }),
    h("span", { class: "meta", text: report ? `${report.samples} samples · ${number(report.duration_s, 3)} s · ${number(report.rate_hz, 3)} Hz` : found ? "" : "Reading …" }), role,
    h("button", { type: "button", class: "quiet", "aria-label": `Remove ${file.name}`, text: "×", onclick: () => {
      dropped.recordings = dropped.recordings.filter((one) => one !== each);
      redraw();
    } })),
  problem ? h("p", { class: "fault", role: "alert" }, problem.replace(OPTIONS, "."), remedy ? [" ", remedy] : null) : null,
  doubts.length ? h("details", {}, h("summary", { text: doubts.length === 1 ? "1 remark" : `${doubts.length} remarks` }), h("ul", { class: "plain" }, doubts.map((one) => h("li", { class: "note", text: `${one.where}: ${one.text}` })))) : null);
}

function startRow(all, isReady, said, earlier) {
  const against = h("select", { id: "against" }, h("option", { value: "identified", text: "the best model that the data allow" }),
    all.report?.total_mass ? h("option", { value: "model", text: "the masses and friction that the robot file states" }) : null,
    earlier.map((each) => h("option", { value: each.id, text: `its diagnosis of ${moment(each.created)}: what has changed` })));
  /** A request that compares with a model of the file, of the data, or of an earlier diagnosis. */
  const compared = () => (against.value.includes("-") ? { model: against.value, options: { against: "saved" } } : { options: { against: against.value } });
  const start = (kind, more) => async (event) => {
    const buttons = event.target.parentElement.querySelectorAll("button");
    buttons.forEach((each) => { each.disabled = true; });
    render(said, "Sending …");
    const used = all.recordings.filter(({ role }) => role).map(({ role, file }) => [role, file]);
    const isSent = await attempt(said, async () => {
      const job = await post(kind, formOf({ ...more(), options: { ...all.reading, ...more().options } }, [...robotParts(), ...used]));
      location.hash = `#/${kind}/${job.id}`;
    });
    buttons.forEach((each) => { each.disabled = isSent; });
  };
  return h("div", { class: "row start" },
    h("button", { type: "button", class: "primary", disabled: !isReady, text: "Diagnose", onclick: start("diagnoses", compared) }),
    h("button", { type: "button", disabled: !isReady, text: "Identify only", onclick: start("identifications", () => ({})) }),
    against.length > 1 ? h("label", { for: "against", class: "inline" }, "Compare with ", against) : null,
    h("button", { type: "button", class: "quiet", text: "Clear", onclick: () => { clear(); window.dispatchEvent(new Event("hashchange")); } }));
}

function recent(robots, items) {
  const newest = [...robots].sort((a, b) => b.last_seen.localeCompare(a.last_seen)).slice(0, MOST_ROBOTS);
  if (!newest.length) return h("p", { class: "note", text: "None yet." });
  const here = items.filter((each) => each.is_here);
  return h("ul", { class: "list recent" }, newest.map((robot) => {
    const own = here.filter((each) => each.robot === robot.name);
    const diagnosis = own.find((each) => each.kind === "diagnosis" && each.state === "succeeded");
    const identification = own.find((each) => each.kind === "identification" && each.state === "succeeded");
    return h("li", {}, h("a", { class: "robot", href: `#/robots/${encodeURIComponent(robot.name)}`, text: robot.name }),
      diagnosis ? h("a", { class: "item", href: `#/diagnoses/${diagnosis.id}` }, verdict(diagnosis.figures.verdict), " ", diagnosis.figures.headline ?? "")
        : identification ? h("a", { class: "item", href: `#/identifications/${identification.id}`, text: `Identified: relative error ${percent(identification.figures.held_out_error ?? identification.figures.relative_error)}` })
          : own.length ? h("span", {}, state(own[0].state), ` ${named(own[0].kind)}`) : h("span", { text: "–" }),
      h("span", { class: "when", text: moment(robot.last_seen) }));
  }));
}

const TIME = [["s", "s"], ["ms", "ms"], ["us", "µs"], ["ns", "ns"], ["index", "samples"]];
const EFFORT = [["A", "A"], ["mA", "mA"], ["drive", "drive units"]];
const REVOLUTE = { q: [["rad", "rad"], ["deg", "°"]], qd: [["rad", "rad/s"], ["deg", "°/s"], ["rpm", "rpm"]], tau: [["Nm", "Nm"], ...EFFORT] };
const PRISMATIC = { q: [["m", "m"], ["mm", "mm"]], qd: [["m", "m/s"], ["mm", "mm/s"]], tau: [["N", "N"], ...EFFORT] };
const MIXED = { q: [["rad", "rad, m"], ["deg", "°, m"], ["mm", "rad, mm"]], qd: [["rad", "rad/s, m/s"], ["deg", "°/s, m/s"], ["mm", "rad/s, mm/s"]], tau: [["Nm", "Nm, N"], ...EFFORT] };
const SI = { rad: "m", Nm: "N" };

const isPrismatic = (joint) => joint.type === "prismatic";

function mappingForm(mapping, joints, reading, change) {
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

// Files that were dropped or chosen, or those of the example: which is the robot, which are recordings.

const RECORDING = /\.(csv|tsv|txt|parquet|mcap|db3|bag|npz)$/i;
const DESCRIPTION = /\.(urdf|xml|mjcf|xacro)$/i;
const MAPPING = /\.(ya?ml|json)$/i;

async function droppedFiles(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  return entries.length ? (await Promise.all(entries.map(filesOf))).flat() : [...transfer.files];
}

async function filesOf(entry) {
  if (entry.isFile) return [await new Promise((done, failed) => { entry.file(done, failed); })];
  const reader = entry.createReader();
  const inside = [];
  for (;;) { // a reader gives a hundred entries at a time
    const some = await new Promise((done, failed) => { reader.readEntries(done, failed); });
    if (!some.length) break;
    inside.push(...some);
  }
  return (await Promise.all(inside.map(filesOf))).flat();
}

async function sortFiles(files) {
  const shown = files.filter((file) => !file.name.startsWith("."));
  const recordings = shown.filter((file) => RECORDING.test(file.name)).sort((a, b) => a.name.localeCompare(b.name, "en", { numeric: true }));
  const descriptions = shown.filter((file) => DESCRIPTION.test(file.name));
  const robots = [];
  for (const file of shown.filter((each) => MAPPING.test(each.name))) {
    const text = await file.text();
    if (/["']?kinematics["']?\s*:/.test(text)) robots.push({ file, text });
  }
  const [first] = robots;
  const robot = first ? [first.file, descriptions.find((file) => first.text.includes(file.name))].filter(Boolean) : descriptions.slice(0, 1);
  return { robot, recordings, unused: shown.filter((file) => !robot.includes(file) && !recordings.includes(file)) };
}

const EXAMPLE = ["example-arm.yaml", "example-train.csv", "example-held-out.csv"];

const exampleFiles = () => Promise.all(EXAMPLE.map(async (name) => new File([await (await fetchRaw(`/example/${name}`)).blob()], name)));
