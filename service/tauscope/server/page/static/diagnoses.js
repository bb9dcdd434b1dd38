// A diagnosis as a story: where, what, how much, the proof, what next.

import { download, formOf, getJson, post, query, reportOf } from "./api.js";
import { attempt, chance, figures, h, named, number, parameterName, percent, render, s, section, table, tabs, title, unit, unitsOf, verdict, withError } from "./dom.js";
import { VARIABLES, heatMap } from "./heat.js";
import { linesOf, waiting } from "./identifications.js";
import { move } from "./leases.js";
import { jobList } from "./lists.js";
import { motionSection } from "./motion.js";
import { group, plot, zoomButtons } from "./plots.js";

export const showDiagnoses = jobList("diagnoses", "diagnosis", "Diagnoses", "Physics that models lack, and how certain each finding is.",
  (each) => (each.recordings ?? []).map((entry) => entry.name).join(", "));

export const HEADLINES = {
  consistent: "The model explains the recordings: only noise is left.",
  explained: "The findings explain the whole residual.",
  partly_explained: "The findings explain a part of the residual; a significant rest remains.",
  unexplained: "The model misses something that no effect of the catalogue explains.",
  inconclusive: "These recordings cannot decide.",
  wrong_values: "No physics is missing, but stated values are wrong.",
};
const AGAINST = { identified: "compared with the best model that the data allow", model: "compared with the robot file's model", simulation: "compared with the simulator's recordings" };
const CONFIRMED = new Map([[true, "confirmed"], [false, "not confirmed"], [null, "no recording was held out"]]);

const MOST_FINDINGS = 5;

export async function showDiagnosis(root, { id, signal, show }) {
  const job = await getJson(`diagnoses/${id}`, signal);
  const [eyebrow, meta] = linesOf("Diagnosis", job);
  if (job.state !== "succeeded") return waiting(root, [eyebrow, meta], job, signal, show);
  const [result, plots, report] = await Promise.all([getJson(job.links.result, signal), getJson(job.links.plots, signal), reportOf(`diagnoses/${id}`, signal)]);
  const earlier = query("before");
  const previous = earlier && (await getJson(`diagnoses/${encodeURIComponent(earlier)}/result`, signal).catch(() => null));
  const fit = result.fit.held_out ?? result.fit.train;
  const ratio = (values) => values.map((rms, place) => rms / result.noise_std[place]);
  const [before, after] = [ratio(fit.rms_before), ratio(fit.rms_after)];
  const most = before.indexOf(Math.max(...before));
  render(root, eyebrow, h("h1", { class: "headline", text: unbroken(result.headline) || HEADLINES[result.verdict] }),
    h("p", { class: "verdict" }, verdict(result.verdict), ` · ${HEADLINES[result.verdict]}`), meta,
    previous ? changeList(previous, result) : null,
    warningList(result.warnings ?? []),
    figures([
      ["Findings", `${result.findings.length}`, result.tentative?.length ? `and ${result.tentative.length} tentative` : AGAINST[result.against]],
      ["Residual / noise", `${number(before[most], 3)} → ${number(after[most], 3)}`, result.fit.held_out ? `${result.joints[most]}, held-out motion` : `${result.joints[most]}, its own motion`],
      ["Noise known from", result.noise_method === "periods" ? "repetition" : "the residual", `band ${number(result.cutoff_hz, 3)} Hz`],
    ]),
    h("div", { class: "row" }, h("button", { type: "button", class: "primary", onclick: () => download(job.links.report, `diagnosis-${id}.html`), text: "Download the proof" }),
      h("button", { type: "button", onclick: () => download(job.links.model, `model-${id}.json`), text: "Model with findings" }),
      h("button", { type: "button", onclick: () => download(job.links.result, `diagnosis-${id}.json`), text: "JSON" })),
    report ? motionSection(report, result, plots) : null, findingsSection(result), nextSection(job, result, signal), whereSection(result, plots), proofSection(plots), howMuchSection(result), detectableSection(result));
  return null;
}

function whereSection(result, plots) {
  const place = h("div", {});
  const joint = h("select", { id: "where-joint" }, result.joints.map((name) => h("option", { value: name, text: name })));
  const variable = h("select", { id: "where-state" }, VARIABLES.map((name) => h("option", { value: name, text: named(name) })));
  const start = result.mismatch.findIndex((each) => each.significant);
  joint.value = result.joints[Math.max(start, 0)];
  variable.value = result.mismatch[Math.max(start, 0)]?.where?.variable ?? "velocity";
  if (!variable.value) variable.value = "velocity";
  const map = h("div", {});
  const told = h("p", { class: "note told", role: "status" });
  const draw = (key) => {
    told.textContent = "";
    render(map, heatMap(plots, result.joints, key, (name, state, bin, words) => {
      joint.value = name;
      variable.value = state;
      told.textContent = words;
      look(bin);
    }));
  };
  function look(bin = null) {
    const own = plots.histograms.find((each) => each.joint === joint.value && each.variable === variable.value);
    if (!own) { render(place, h("p", { class: "note", text: "It does not vary there." })); return; }
    const middle = own.before.map((_, k) => (own.edges[k] + own.edges[k + 1]) / 2);
    const curve = plots.curves.find((each) => each.joint === joint.value);
    const units = unitsOf(plots.joint_types?.[joint.value]);
    const range = bin === null ? null : [own.edges[bin], own.edges[bin + 1]];
    const inside = (k) => {
      const value = variable.value === "time" ? curve.time[k] : curve.states[variable.value]?.[k];
      return range !== null && value >= range[0] && value <= range[1];
    };
    const series = [{ label: "without the findings", values: curve.before, colour: "--before" }, { label: "with them", values: curve.after, colour: "--after" }];
    if (range) series.push({ label: `${named(variable.value)} ${number(range[0], 3)} … ${number(range[1], 3)}`, values: curve.before.map((value, k) => (inside(k) ? value : null)), colour: "--c4", points: true });
    render(place, 
      plot({ label: `Rms of the residual of ${joint.value} by ${named(variable.value)}`, raw: true, x: middle, xLabel: `${named(variable.value)} [${units[variable.value]}]`, yLabel: units.torque, series: [
        { label: "without the findings", values: own.before, colour: "--before", width: 2 }, { label: "with them", values: own.after, colour: "--after", width: 2 },
        { label: "noise", values: own.before.map(() => own.noise), colour: "--muted", dash: [5, 4] }] }).element,
      plot({ label: range ? `Residual of ${joint.value} over time, the chosen part marked` : `Residual of ${joint.value} over time`, raw: true, x: curve.time, xLabel: `time in ${curve.recording} [s]`, yLabel: units.torque, noise: 2 * own.noise, series }).element);
  }
  joint.onchange = variable.onchange = () => { told.textContent = ""; look(); };
  draw("before");
  look();
  const significant = result.mismatch.filter((each) => each.significant);
  return section("where", "Residual by state",
    significant.length ? h("ul", { class: "plain" }, significant.map((each) => h("li", { text: located(each, unitsOf(plots.joint_types?.[each.joint])) }))) : h("p", { text: "At no joint is there more than noise." }),
    result.findings.length ? tabs("Map", ["Without the findings", "With them"], 0, (chosen) => draw(chosen ? "after" : "before")) : null,
    map, told, h("p", { class: "note", text: "Each cell holds as many samples as any other of its row and group. Click one, or go there with the arrow keys, to see the residual there; or choose:" }),
    h("form", { class: "sheet" }, h("label", { for: "where-joint" }, "Joint", joint), h("label", { for: "where-state" }, "State", variable)), place);
}

function located(entry, units) {
  const where = entry.where ? `, ${(100 * entry.where.share).toFixed(0)} % of it at a ${named(entry.where.variable)} of ${number(entry.where.range[0], 2)} to ${number(entry.where.range[1], 2)}${unitBehind(units, entry.where.variable)}` : "";
  const when = entry.time ? `, ${(100 * entry.time.share).toFixed(0)} % between ${number(entry.time.range[0], 3)} and ${number(entry.time.range[1], 3)} s` : "";
  return `${entry.joint}: ${number(entry.excess_rms, 3)} ${units.torque} rms beyond the noise${where}${when}.`;
}

const unitBehind = (units, variable) => (units[variable] ? ` ${units[variable]}` : "");

/** An effect and its place, such as cable_force@joint1, in words. */
function placed(name) {
  const at = name.indexOf("@");
  return at < 0 ? title(name) : `${title(name.slice(0, at))} at ${name.slice(at + 1)}`;
}

/** A sentence whose numbers stay with their units. */
const unbroken = (text) => text?.replace(/(\d) (?=[A-Za-zµ°%])/g, "$1\u00a0");

function warningList(warnings) {
  if (!warnings.length) return null;
  const entries = warnings.map((each) => h("li", {}, each.joint ? `${each.joint}: ` : "", `${each.text}; ${each.remedy}.`));
  return h("details", { class: "cautions" }, h("summary", { text: entries.length === 1 ? "1 warning" : `${entries.length} warnings` }), h("ul", { class: "plain" }, entries));
}

function changeList(before, result) {
  const place = (each) => (each.joint ? `${title(each.effect)} at ${each.joint}` : title(each.effect));
  const chances = (found) => new Map(found.findings.map((each) => [place(each), chance(each.probability)]));
  const [old, now] = [chances(before), chances(result)];
  const lines = [...new Set([...old.keys(), ...now.keys()])].map((name) => {
    if (!now.has(name)) return `${name}: no longer found`;
    return old.has(name) ? `${name}: ${old.get(name)} → ${now.get(name)}` : `${name}: new, ${now.get(name)}`;
  });
  return h("div", { class: "change" }, h("p", {}, h("strong", { text: "Since the experiment" }), `: ${named(before.verdict)} → ${named(result.verdict)}`),
    lines.length ? h("ul", { class: "plain" }, lines.map((text) => h("li", { text }))) : null);
}

/** Diagnose again with a run that was made for a diagnosis; all other recordings have to lie on the service. */
export async function diagnoseAgain(id, recording) {
  const [job, robot] = await Promise.all([getJson(`diagnoses/${encodeURIComponent(id)}`), getJson(`diagnoses/${encodeURIComponent(id)}/robot`)]);
  const kept = (role) => job[role].filter((each) => each.origin === "server").map((each) => each.name);
  const request = { recordings: [...kept("recordings"), recording], held_out: kept("held_out"), options: { ...job.options, next_trajectory: false } };
  return post("diagnoses", formOf(request, robotFiles(robot)));
}

function findingsSection(result) {
  const cards = (findings, kind) => findings.map((each, place) => findingCard(each, place, result.joints, kind));
  const confirmed = cards(result.findings, "");
  const tentative = cards(result.tentative ?? [], "tentative");
  const isJudged = Boolean(result.fit.held_out);
  return [
    section("findings", isJudged ? "Confirmed findings" : "Findings",
      confirmed.length ? null : h("p", { text: isJudged ? "Held-out motion confirms no effect of the catalogue." : "No effect of the catalogue is named." }),
      confirmed.length && !isJudged ? h("p", { class: "note", text: "No recording was held out: add one to confirm these." }) : null, folded(confirmed)),
    tentative.length ? section("tentative", "Tentative findings", h("p", { class: "note", text: "These would explain a part of the residual. Held-out motion does not confirm them." }), folded(tentative)) : null,
  ];
}

function folded(cards) {
  return [cards.slice(0, MOST_FINDINGS), cards.length > MOST_FINDINGS ? h("details", {}, h("summary", { text: `${cards.length - MOST_FINDINGS} more` }), cards.slice(MOST_FINDINGS)) : null];
}

function findingCard(each, place, joints, kind) {
  return h("article", { class: `card ${kind}` },
    h("p", { class: "rank", "aria-hidden": "true", text: `${place + 1}` }),
    h("div", {}, h("h3", {}, title(each.effect), h("span", { text: each.joint ? ` at ${each.joint}` : " of the whole arm" })), h("p", { text: each.statement }),
      h("dl", {}, each.parameters.flatMap((q) => [h("dt", { text: q.name }), h("dd", { text: `${withError(q.value, 1.96 * q.std)}${unit(q.unit)} (95 %)` })]),
        each.equation ? [h("dt", { text: "Torque" }), h("dd", { text: each.equation })] : null,
        Number.isFinite(each.share) ? [h("dt", { text: "Explains" }), h("dd", { text: `${percent(each.share)} of the explained energy there` })] : null,
        h("dt", { text: "Held out" }), h("dd", { text: heldOut(each, joints) }),
        h("dt", { text: "Could also be" }), h("dd", { text: each.equivalent.map(placed).join(", ") || "No competing explanation" }))),
    h("div", { class: "chance" }, h("strong", { text: chance(each.probability) }), "probable", h("div", { class: "meter", "aria-hidden": "true" }, h("span", { "width%": 100 * each.probability }))));
}

function heldOut(each, joints) {
  const change = each.held_out_change;
  if (!change) return CONFIRMED.get(each.confirmed);
  const sizes = change.relative.map(Math.abs);
  const at = each.joint ? joints.indexOf(each.joint) : sizes.indexOf(Math.max(...sizes));
  const changes = `the rms of ${joints[at]} changes by ${withError(100 * change.relative[at], 196 * (change.std[at] ?? 0))} % (95 %)`;
  return each.confirmed === null ? changes : `${CONFIRMED.get(each.confirmed)}: ${changes}`;
}

function howMuchSection(result) {
  const { train, held_out: heldOut } = result.fit;
  const columns = ["joint", "without the findings", "with them", ...(heldOut ? ["held out, without", "held out, with"] : [])];
  const rows = result.joints.map((name, place) => [name, ...[train.rms_before, train.rms_after, ...(heldOut ? [heldOut.rms_before, heldOut.rms_after] : [])].map((each) => number(each[place], 3))]);
  const p = result.constancy.p_value;
  return section("how-much", "Residual and parameters",
    h("h3", { text: "Residual rms at the recorded rate" }), table("Residual rms", columns, rows),
    result.parameter_differences.length ? [h("h3", { text: "Wrong values of the simulation" }), h("ul", { class: "plain" }, (result.wrong_values ?? []).map((each) => h("li", { text: `${each}.` }))), bars(result.parameter_differences.map((each) => [each.parameter, each.difference_in_std, `${number(each.simulation)} → ${number(each.real)}`]))] : null,
    result.parameter_shifts.length ? [h("h3", { text: "Parameter shifts" }), h("p", { class: "note", text: "How far estimates moved when the findings were added, in standard errors; within the shaded part nothing has moved." }),
      bars(result.parameter_shifts.slice(0, 14).map((each) => [each.parameter, each.shift_in_std, `${number(each.before)} → ${number(each.after)}`]))] : null,
    h("p", { class: "note", text: result.constancy.moved.length ? `Parameters do not all hold from one recording to the next: ${result.constancy.moved.map((each) => each.parameter).join(", ")} (p = ${number(p, 2)}).` : `The parameters hold from one recording to the next (p = ${number(p, 2)}).` }));
}

function bars(entries) {
  const scale = (value) => Math.sign(value) * Math.log1p(Math.abs(value));
  const reach = Math.max(...entries.map(([, value]) => Math.abs(scale(value))), scale(4));
  const at = (value) => 100 + (98 * scale(value)) / reach;
  return h("div", { class: "bars" }, entries.map(([name, value, words]) => [h("span", {}, parameterName(name)),
    s("svg", { viewBox: "0 0 200 16", preserveAspectRatio: "none", role: "img", "aria-label": `${number(value, 3)} standard errors, ${words}` },
      s("rect", { class: "zone", x: at(-1.96), width: at(1.96) - at(-1.96), y: 0, height: 16 }),
      s("rect", { x: Math.min(at(value), 100), width: Math.abs(at(value) - 100), y: 4, height: 8 }), s("title", { text: words })), h("span", { text: number(value, 3) })]));
}

function proofSection(plots) {
  const place = h("div", {});
  function choose(joint) {
    const curve = plots.overlays[joint];
    const spectrum = plots.spectra.find((each) => each.joint === curve.joint);
    const together = group();
    const units = unitsOf(plots.joint_types?.[curve.joint]);
    const left = (values) => curve.measured.map((value, k) => value - values[k]);
    render(place, zoomButtons(together),
      plot({ label: `Torque of ${curve.joint}`, x: curve.time, xLabel: "time [s]", yLabel: units.torque, group: together, tall: true, series: [
        { label: "measured", values: curve.measured, colour: "--measured", width: 4 }, { label: "model without the findings", values: curve.before, colour: "--before" }, { label: "with them", values: curve.after, colour: "--after" }] }).element,
      plot({ label: "Residual", x: curve.time, xLabel: "time [s]", yLabel: units.torque, group: together, noise: 2 * curve.noise, series: [
        { label: "without the findings", values: left(curve.before), colour: "--before" }, { label: "with them", values: left(curve.after), colour: "--after" }] }).element,
      spectrum ? plot({ label: "Spectrum of the residual", raw: true, log: true, x: spectrum.frequency, xLabel: "frequency [Hz]", yLabel: units.spectrum, series: [
        { label: "without the findings", values: spectrum.before, colour: "--before" }, { label: "with them", values: spectrum.after, colour: "--after" }, { label: "noise", values: spectrum.noise, colour: "--muted", dash: [5, 4] }] }).element : null);
  }
  if (!plots.overlays.length) return section("proof", "Proof", h("p", { text: "This diagnosis was made before proofs were kept." }));
  const gains = plots.overlays.map((curve) => curve.measured.reduce((sum, value, k) => sum + (value - curve.before[k]) ** 2 - (value - curve.after[k]) ** 2, 0) / curve.noise ** 2);
  const best = gains.indexOf(Math.max(...gains));
  choose(best);
  const unseen = plots.overlays[0].held_out;
  return section("proof", "Proof", h("p", { class: "lead", text: unseen ? "On held-out motion, from which neither model was made; the stretch in which the findings help most." : "No recording was held out: this is the motion that the models were made from." }),
    tabs("Joint", plots.overlays.map((each) => each.joint), best, choose), place);
}

function nextSection(job, result, signal) {
  const next = result.next_experiment;
  if (!next) return section("next", "Next experiment", h("p", { text: "No question is open that another motion would decide." }));
  const place = h("div", {});
  const said = h("p", { role: "status", class: "note" });
  // Files that came with the request alone cannot be named in another one.
  const isRepeatable = ["identified", "model"].includes(job.options.against) && [...job.recordings, ...job.held_out].every((each) => each.origin === "server");
  const button = h("button", { type: "button", class: "primary", text: isRepeatable ? "Run it on the simulated arm, and diagnose again" : "Run it on the simulated arm", onclick: async () => {
    button.disabled = true;
    button.disabled = await attempt(said, async () => {
      const run = await move("runs", await nextRun(job), job.robot, "sim");
      location.hash = `#/runs/${run.id}${isRepeatable ? `?after=${job.id}` : ""}`;
    });
  } });
  if (job.links.next_trajectory) {
    getJson(job.links.next_trajectory, signal).then((trajectory) => render(place, h("p", { class: "note", text: `Planned: ${(trajectory.segments ?? []).length} segments, within the robot file's limits.` }))).catch(() => {});
  }
  return section("next", "Next experiment", h("p", { text: `${next.why.charAt(0).toUpperCase()}${next.why.slice(1)}.` }),
    next.separates.length ? h("p", { text: `It separates: ${next.separates.map(placed).join(", ")}.` }) : null, place,
    job.links.next_trajectory ? h("div", { class: "row" }, button, h("button", { type: "button", onclick: () => download(job.links.next_trajectory, `next-${job.id}.json`), text: "Save the motion" })) : null, said);
}

/** How the simulated arm was run that the recordings are of, with what it conceals; a plain one where they are of none. */
async function sameArm(job) {
  for (const { name } of job.recordings) {
    const id = /^run-(.+)\.csv$/.exec(name)?.[1];
    const run = id ? await getJson(`runs/${encodeURIComponent(id)}`).catch(() => null) : null;
    if (run?.backend?.name === "sim") return { ...run.options, backend: run.backend };
  }
  return { backend: { name: "sim" } };
}

async function nextRun(job) {
  const [robot, trajectory, arm] = await Promise.all([getJson(`diagnoses/${job.id}/robot`), getJson(job.links.next_trajectory), sameArm(job)]);
  return formOf({ ...arm, trajectory }, robotFiles(robot));
}

/** The files of a robot, the robot file first, each with the name of its part in a form. */
export const robotFiles = ({ files, robot_file: first }) => files.map((file) => [file.name === first ? "robot" : "urdf", new File([file.content], file.name)])
  .sort(([one], [other]) => one.localeCompare(other));

function detectableSection(result) {
  const places = [...result.joints, null].filter((name) => result.detectable.some((each) => each.joint === name));
  const effects = [...new Set(result.detectable.map((each) => each.effect))];
  const rows = effects.map((effect) => {
    const own = places.map((name) => result.detectable.find((each) => each.effect === effect && each.joint === name));
    return [title(effect), [...new Set(own.filter(Boolean).map((each) => each.unit))].join(", "), ...own.map((each) => (each ? number(each.minimum, 2) : ""))];
  });
  return section("detectable", "Detection limits", h("p", { class: "lead", text: "The smallest size of each effect that nine of ten such data sets show. A smaller effect may exist unnamed." }),
    table("Smallest visible size", ["effect", "unit", ...places.map((name) => name ?? "whole arm")], rows, 2));
}
