// Identifications: how well the model explains the torque, its parameters, and its friction.

import { ENDS, download, follow, getJson, remove } from "./api.js";
import { attempt, explained, figures, h, moment, number, parameterName, percent, render, s, section, state, table, tabs, unitsOf, withError } from "./dom.js";
import { jobList } from "./lists.js";
import { group, plot, zoomButtons } from "./plots.js";
import { interpolate } from "./thinning.js";

export const showIdentifications = jobList("identifications", "identification", "Identifications", "Parameters and friction from recordings.",
  (each) => (each.recordings ?? []).map((entry) => entry.name).join(", "));

const CONDITION = [[30, "well excited"], [100, "acceptable"], [1000, "poor: some parameters lean on few samples"], [Infinity, "very poor: excite the joints more"]];

const power = (fit) => percent(1 - fit.relative_error ** 2);

export async function showIdentification(root, { id, signal, show }) {
  const job = await getJson(`identifications/${id}`, signal);
  const [eyebrow, meta] = linesOf("Identification", job);
  if (job.state !== "succeeded") return waiting(root, [eyebrow, meta], job, signal, show);
  const [result, plots] = await Promise.all([getJson(job.links.result, signal), getJson(job.links.plots, signal)]);
  const { train, held_out: heldOut } = result.fit;
  const ratios = (heldOut ?? train).rms.map((rms, place) => rms / result.noise_std[place]);
  const worst = ratios.indexOf(Math.max(...ratios));
  const words = CONDITION.find(([most]) => result.condition_number < most)[1];
  render(root, eyebrow,
    h("h1", { class: "headline", text: `The model explains ${power(heldOut ?? train)} of the power of ${heldOut ? "held-out torque" : "its own recordings' torque"}.` }), meta,
    figures([
      ["Relative error", percent((heldOut ?? train).relative_error), heldOut ? `held out; ${percent(train.relative_error)} on its own` : "on its own recordings"],
      ["Residual / noise", number(ratios[worst], 3), `${result.joints[worst]}, the largest`],
      ["Condition number", number(result.condition_number, 3), words],
      ["Noise known from", result.noise_method === "periods" ? "repetition" : "the residual", result.joints.map((name, place) => `${name} ${number(result.noise_std[place], 2)}`).join(", ")],
    ]),
    h("div", { class: "row" }, h("button", { type: "button", class: "primary", onclick: () => download(job.links.report, `identification-${id}.html`), text: "Download the report" }),
      Object.entries(job.links.exports).map(([format, path]) => h("button", { type: "button", onclick: () => download(path, exportName(result.robot, format)), text: EXPORT_WORDS[format] ?? format }))),
    result.unidentifiable?.length ? h("p", { class: "note", text: `No motion of this arm shows ${result.unidentifiable.join(", ")}.` }) : null,
    torqueSection(result, plots), frictionSection(plots), parameterSection(result));
  return null;
}

/** The lines above and below the heading of a job: what it is, of which robot; when it was handed in, with which recordings. */
export function linesOf(noun, job) {
  const of = [...(job.recordings ?? []), ...(job.held_out ?? [])].map((each) => each.name).join(", ");
  return [h("p", { class: "eyebrow" }, `${noun} · `, job.robot ? h("a", { href: `#/robots/${encodeURIComponent(job.robot)}`, text: job.robot }) : job.id),
    h("p", { class: "meta", text: `${moment(job.created)} · ${of}` })];
}

/** A job that has not succeeded: its steps and its time as it goes on, and the way to cancel it; or its problem. */
export function waiting(root, [eyebrow, meta], job, signal, show) {
  const head = [eyebrow, h("h1", { text: job.robot ?? job.id }), meta];
  const isOver = job.problem || ENDS.includes(job.state);
  const now = h("p", { role: "status" }, state(job.state));
  if (isOver) {
    render(root, ...head, now, job.problem ? h("p", { role: "alert" }, explained(job.problem)) : null);
    return null;
  }
  const elapsed = h("span", { class: "note" });
  const steps = h("ol", { class: "plain done" });
  const said = h("span", { role: "alert" });
  const begun = Date.parse(job.started ?? job.created);
  const tick = () => { elapsed.textContent = `${Math.max(0, Math.round((Date.now() - begun) / 1000))} s`; };
  const timer = setInterval(tick, 1000);
  signal.addEventListener("abort", () => clearInterval(timer), { once: true });
  tick();
  let step = null; // as the events tell it, from the first one on
  const readable = (words) => words.replaceAll("_", " ").replace("@", " at ");
  const draw = (name, words) => render(now, state(name), words ? ` ${readable(words)}` : "");
  draw(job.state, job.step);
  const cancel = h("button", { type: "button", class: "quiet", text: "Cancel", onclick: async () => {
    cancel.disabled = true;
    cancel.disabled = await attempt(said, () => remove(job.links.self));
  } });
  render(root, ...head, now, h("progress", { "aria-label": "Progress" }), h("div", { class: "row" }, elapsed, cancel, said), steps);
  return follow(job.links.events, signal, (event) => {
    if (event.step && event.step !== step) {
      if (step) steps.prepend(h("li", { text: `✓ ${readable(step)}` }));
      step = event.step;
      draw("running", step);
    }
    if (event.kind === "ended") show();
  });
}

const EXPORT_WORDS = { json: "JSON", yaml: "YAML", c: "C header", python: "Python module", urdf: "URDF", mjcf: "MJCF" };
const exportName = (robot, format) => `${robot}.${{ json: "json", yaml: "yaml", c: "h", python: "py", urdf: "urdf", mjcf: "xml" }[format] ?? format}`;

function torqueSection(result, plots) {
  const place = h("div", {});
  function choose(joint) {
    const curve = plots.torque[joint];
    const together = group();
    const units = unitsOf(plots.joint_types?.[curve.joint]);
    const measured = curve.measured.map((value) => value ?? NaN);
    render(place, zoomButtons(together),
      plot({ label: `Torque of ${curve.joint}`, x: curve.time, xLabel: "time [s]", yLabel: units.torque, group: together, tall: true, series: [
        { label: "measured", values: measured, colour: "--measured", width: 2.2 }, { label: "model", values: curve.predicted, colour: "--after" }] }).element,
      plot({ label: "Residual", x: curve.time, xLabel: "time [s]", yLabel: units.torque, group: together, noise: 2 * result.noise_std[joint],
        series: [{ label: "measured − model", values: measured.map((value, k) => value - curve.predicted[k]), colour: "--before" }] }).element);
  }
  choose(0);
  const shown = plots.torque[0];
  return section("torque", "Measured and predicted torque", h("p", { class: "lead", text: shown.held_out ? `${shown.recording}, held out: the model was not made from it.` : `${shown.recording}, one of the model's own recordings.` }),
    tabs("Joint", result.joints, 0, choose), place);
}

function frictionSection(plots) {
  const place = h("div", {});
  function choose(joint) {
    const curve = plots.friction[joint];
    const units = unitsOf(plots.joint_types?.[curve.joint]);
    const velocity = [...curve.velocity, ...curve.measured_velocity];
    const order = velocity.map((_, k) => k).sort((a, b) => velocity[a] - velocity[b]);
    const spread = (values, offset) => order.map((k) => values[k - offset] ?? null);
    const high = curve.friction.map((value, k) => value + 1.96 * curve.std[k]);
    const low = curve.friction.map((value, k) => value - 1.96 * curve.std[k]);
    // Every curve on one axis: where a curve has no point of its own, it is carried on between its neighbours.
    const carried = (values) => order.map((k) => (k < curve.velocity.length ? values[k] : interpolate(curve.velocity, values, velocity[k])));
    render(place, plot({ label: `Friction of ${curve.joint}`, raw: true, tall: true, x: order.map((k) => velocity[k]), xLabel: `velocity [${units.velocity}]`, yLabel: units.torque,
      bands: [{ series: [1, 2] }], series: [
        { label: "95 % high", values: carried(high), colour: "--band", hidden: true }, { label: "95 % low", values: carried(low), colour: "--band", hidden: true },
        { label: "model, with its 95 % band", values: carried(curve.friction), colour: "--after", width: 2 },
        { label: "measured less rigid body, mean a bin", values: spread(curve.measured_friction, curve.velocity.length), colour: "--measured", points: true }] }).element,
    h("p", { class: "note", text: `The recordings reach from ${number(curve.seen[0], 3)} to ${number(curve.seen[1], 3)}; beyond, nothing was seen.` }));
  }
  choose(0);
  return section("friction", "Friction", tabs("Joint", plots.friction.map((each) => each.joint), 0, choose), place);
}

function interval(value, std, low, high) {
  const at = (each) => 4 + (192 * (each - low)) / (high - low || 1);
  const reach = 1.96 * (std ?? 0);
  return s("svg", { class: "interval", viewBox: "0 0 200 16", role: "img", "aria-label": `${number(value - reach)} to ${number(value + reach)}` },
    s("line", { class: "axis", x1: at(0), x2: at(0), y1: 0, y2: 16 }),
    s("line", { x1: at(value - reach), x2: at(value + reach), y1: 8, y2: 8 }), s("circle", { cx: at(value), cy: 8, r: 3 }));
}

function parameterSection(result) {
  const coefficient = (entry, name) => (entry[name] === null || entry[name] === undefined ? "–" : withError(entry[name], entry.std[name] ?? NaN));
  const unit = (entry) => { const first = Object.keys(entry.terms)[0]; return first.startsWith("I") ? "kg m²" : first.startsWith("ms") ? "kg m" : "kg"; };
  const ends = {};
  for (const entry of result.base_parameters) {
    const reach = 1.96 * (entry.std ?? 0);
    const [low, high] = ends[unit(entry)] ?? [0, 0];
    ends[unit(entry)] = [Math.min(low, entry.value - reach), Math.max(high, entry.value + reach)];
  }
  return section("parameters", "Parameters",
    h("h3", { text: "Friction" }),
    table("Friction coefficients", ["joint", "stiction", "Stribeck", "viscous", "offset"], result.friction.map((entry) => [entry.joint, ...["stiction", "stribeck", "viscous", "offset"].map((name) => coefficient(entry, name))])),
    h("h3", { text: "Base parameters" }),
    table("Base parameters", ["parameter", "value ± standard error", "unit", "95 % interval, one axis a unit"], [...result.base_parameters].sort((a, b) => linkOf(a) - linkOf(b)).map((entry) =>
      [parameterName(entry.name), withError(entry.value, entry.std ?? NaN), unit(entry), interval(entry.value, entry.std, ...ends[unit(entry)])])));
}

const linkOf = (entry) => Number(/\d+$/.exec(Object.keys(entry.terms)[0])?.[0] ?? 0);
