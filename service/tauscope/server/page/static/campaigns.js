// Campaigns: begun from a robot file, followed step by step, and read.

import { ENDS, fetchRaw, follow, formOf, getJson, post, query, reportOf } from "./api.js";
import { attempt, cautions, explained, h, moment, render, section, state, title, verdict, dropHandlers } from "./dom.js";
import { HEADLINES, robotFiles } from "./diagnoses.js";
import { DRIVERS } from "./drivers.js";
import { move } from "./leases.js";
import { figuresOf, outcome, searchable } from "./lists.js";
import { robotSheet } from "./robots.js";
import { liveMonitor } from "./runs.js";

const STEPS = { design: "Design motion", run: "Run motion", "held-out design": "Design held-out motion", "held-out run": "Run held-out motion", identify: "Identify", diagnose: "Diagnose" };
const isOver = (step) => step.state === "waiting" || ENDS.includes(step.state);
const ROBOT_OF = /^(campaigns|runs|identifications|diagnoses)\/[\w-]+$/; // where the robot of a new campaign may be taken from

export async function showCampaigns(root, { signal }) {
  const [{ campaigns }, verdicts] = await Promise.all([getJson("campaigns?limit=1000", signal), figuresOf("diagnosis", signal)]);
  const outcomeFor = (each) => outcome(each, verdicts.get(each.links.diagnosis?.split("/").pop()));
  render(root, h("h1", { text: "Campaigns" }),
    h("p", { class: "lead", text: "Design a motion, drive the arm, identify it, and diagnose its model." }),
    h("div", { class: "row" }, h("a", { class: "button primary", href: "#/new", text: "New campaign" })),
    searchable(campaigns.map((each) => ({ href: `#/campaigns/${each.id}`, name: each.robot ?? each.id, detail: each.backend?.name, outcome: outcomeFor(each), created: each.created })),
      "No campaign yet. Begin with a robot file."));
}

export async function showCampaign(root, { id, signal, show }) {
  // All that is there already comes first: what is put in later would push away what is being read.
  const [begun, report] = await Promise.all([getJson(`campaigns/${id}`, signal), reportOf(`campaigns/${id}`, signal)]);
  let campaign = begun;
  const result = campaign.state === "succeeded" ? await getJson(campaign.links.result, signal) : null;
  const steps = h("ol", { class: "steps" });
  const status = h("p", { role: "status" });
  const arm = h("div", {}, report ? section("arm", "The arm", robotSheet(report)) : null);
  const live = h("div", {});
  const outcome = h("div", {}, result ? outcomeOf(campaign, result) : null);
  render(root, h("p", { class: "eyebrow", text: `Campaign · ${campaign.backend?.name ?? ""}` }), h("h1", { text: campaign.robot ?? id }), h("p", { class: "meta", text: moment(campaign.created) }),
    status, steps, outcome, live, arm);
  let watched = null;
  let leaving = null;
  function update() {
    render(status, state(campaign.state), campaign.problem ? h("span", { role: "alert" }, " ", explained(campaign.problem)) : "");
    render(steps, campaign.steps.map((step) => h("li", { "data-state": step.state, "data-live": !isOver(step) },
      h("b", {}, step.link && !step.link.includes("/excitations/") ? h("a", { href: linked(step.link), text: STEPS[step.name] }) : STEPS[step.name]), state(step.state))));
    const moving = campaign.steps.find((step) => step.link?.includes("/runs/") && !isOver(step));
    if ((moving?.link ?? null) !== watched) {
      watched = moving?.link ?? null;
      leaving?.abort();
      if (watched) {
        leaving = new AbortController();
        signal.addEventListener("abort", () => leaving.abort(), { once: true });
        const monitor = liveMonitor(watched.split("/").pop());
        render(live, monitor.element);
        follow(`${watched}/events`, leaving.signal, monitor.take);
      }
    }
    if (ENDS.includes(campaign.state)) render(live);
    arm.hidden = live.hasChildNodes();
  }
  const refresh = async () => { campaign = await getJson(`campaigns/${id}`, signal); update(); };
  update();
  if (ENDS.includes(campaign.state)) return null;
  const timer = setInterval(() => refresh().catch(() => {}), 1000);
  signal.addEventListener("abort", () => clearInterval(timer), { once: true });
  await follow(campaign.links.events, signal, (event) => { if (event.kind === "ended") { clearInterval(timer); show(); } });
  return null;
}

const linked = (path) => `#/${path.replace(/^\/api\/v1\//, "")}`;

function outcomeOf(campaign, { diagnosis }) {
  const id = (path) => path.split("/").pop();
  return [
    h("p", { class: "headline", text: diagnosis ? diagnosis.headline || HEADLINES[diagnosis.verdict] : "The arm is identified." }),
    diagnosis ? h("p", { class: "verdict" }, verdict(diagnosis.verdict), ` · ${HEADLINES[diagnosis.verdict]}`) : null,
    diagnosis?.findings.map((each) => h("p", {}, h("strong", { text: each.joint ? `${title(each.effect)} at ${each.joint}` : title(each.effect) }), ". ", h("span", { text: each.statement }))),
    h("div", { class: "row" },
      campaign.links.diagnosis ? h("a", { class: "button primary", href: `#/diagnoses/${id(campaign.links.diagnosis)}`, text: "Read the diagnosis" }) : null,
      h("a", { class: "button", href: `#/identifications/${id(campaign.links.identification)}`, text: "Read the identification" }),
      campaign.links.recordings.map((path) => h("a", { class: "button", href: linked(path), text: "Recording" })),
      campaign.links.held_out.map((path) => h("a", { class: "button", href: linked(path), text: "Held-out recording" })),
      h("a", { class: "button", href: `#/new?robot=campaigns/${campaign.id}`, text: "Once more" })),
  ];
}

/** What the simulated arm may conceal at a joint: how the page calls it, and the effect. */
const CONCEALED = {
  nothing: ["nothing", null],
  spring: ["a spring", { effect: "joint_spring", stiffness: 2.0 }],
  load: ["friction that grows with the load", { effect: "load_dependent_friction", mu: 0.1 }],
  bristles: ["bristles: friction that rises over a distance", { effect: "presliding_hysteresis", distance: 0.02 }],
};

const LENGTHS = {
  usual: {},
  short: { excitation: { starts: 1, periods: 2, slow_postures: 1, closing_period: false }, held_out: { periods: 1 } },
  thorough: { excitation: { periods: 10, slow_postures: 6 }, held_out: { periods: 4 } },
};

const TIMES = { virtual: "as fast as it computes", real: "by the clock" };

const choice = (id, table, wordsOf) => h("select", { id }, Object.entries(table).map(([value, each]) => h("option", { value, text: wordsOf(each, value) })));

export async function showNewCampaign(root, { signal }) {
  const again = query("robot");
  const chosen = { files: null, report: null };
  const sheet = h("div", {});
  const said = h("p", { role: "status", class: "note" });
  const begin = h("button", { type: "submit", class: "primary", disabled: true, text: "Begin" });
  const input = h("input", { type: "file", id: "robot", multiple: true, accept: ".yaml,.yml,.json,.urdf,.xml", onchange: () => take([...input.files]) });
  const drop = h("div", { class: "drop", ...dropHandlers(() => drop, (transfer) => take([...transfer.files])) },
    h("label", { for: "robot" }, "Robot file: URDF, MJCF or YAML, with the URDF that it names", input));

  async function take(files) {
    const robot = files.find((file) => /\.(ya?ml|json)$/i.test(file.name)) ?? files[0];
    const urdf = files.find((file) => file !== robot);
    said.textContent = "Checking …";
    begin.disabled = true;
    const isUsable = await attempt(said, async () => {
      const report = await post("robots/check", formOf(null, [["robot", robot], ["urdf", urdf]]));
      chosen.files = [robot, urdf];
      chosen.report = report;
      said.textContent = "";
      render(sheet, h("h2", { text: report.name }), robotSheet(report), cautions(report.findings));
      await offerModel();
      render(joints, ...report.joints.map((joint) => h("option", { value: joint.number, text: joint.name })));
    });
    if (!isUsable) render(sheet);
  }

  /** A simulated arm needs a model: say so before anything begins, and offer the last one that was found. */
  async function offerModel() {
    const isMissing = chosen.report?.total_mass === null && DRIVERS[backend.value].is_simulated;
    begin.disabled = !chosen.report || isMissing;
    render(lacking);
    if (!isMissing) return;
    const found = await getJson(`items?kind=diagnosis&state=succeeded&robot=${encodeURIComponent(chosen.report.name)}&limit=1`, signal);
    const last = found.items.find((each) => each.is_here);
    render(lacking, h("p", { text: "The robot file states no model: the simulated arm needs mass, first moment and inertia of every link." }),
      last ? h("p", {}, h("button", { type: "button", text: `Use the model of its diagnosis of ${moment(last.created)}`, onclick: () => useModelOf(last.id) })) : null);
  }

  const useModelOf = (id) => attempt(said, async () => {
    const [text, robot] = await Promise.all([fetchRaw(`diagnoses/${id}/improved-robot`).then((answer) => answer.text()), getJson(`diagnoses/${id}/robot`)]);
    const beside = robot.files.filter((file) => file.name !== robot.robot_file).map((file) => new File([file.content], file.name));
    await take([new File([text], "improved-robot.yaml"), ...beside]);
  });

  const lacking = h("div", { class: "lacking", role: "status" });
  const backend = choice("backend", DRIVERS, (driver) => driver.title);
  const time = choice("time", TIMES, (words) => words);
  const conceal = choice("conceal", CONCEALED, ([words]) => words);
  const joints = h("select", { id: "conceal-joint" });
  const length = choice("length", LENGTHS, (_, name) => name);
  const clear = h("input", { type: "checkbox", id: "clear" });
  const clearLabel = h("label", { class: "check", for: "clear", hidden: true }, clear, "The arm's whole reach is clear, and the emergency stop is at hand.");
  const plan = h("input", { type: "checkbox", id: "plan" });
  const simulated = [time, conceal, joints];
  backend.onchange = () => {
    const real = !DRIVERS[backend.value].is_simulated;
    clearLabel.hidden = !real;
    clear.required = real;
    simulated.forEach((each) => { each.disabled = real; });
    offerModel();
  };
  const form = h("form", { class: "sheet", onsubmit: async (event) => {
    event.preventDefault();
    begin.disabled = true;
    said.textContent = "Handing in …";
    const isSim = DRIVERS[backend.value].is_simulated;
    const concealed = isSim ? CONCEALED[conceal.value][1] : null;
    const request = { backend: { name: backend.value, ...(isSim ? { time: time.value } : {}), ...(concealed ? { scenario: { torque_noise_std: 0.1, seed: 1, effects: [{ ...concealed, joint: Number(joints.value) }] } } : {}) }, diagnosis: { next_trajectory: plan.checked }, ...LENGTHS[length.value] };
    if (isSim) request.run = { feed_forward: false, rate_hz: 200 };
    const body = formOf(request, [["robot", chosen.files[0]], ["urdf", chosen.files[1]]]);
    begin.disabled = await attempt(said, async () => {
      const campaign = await move("campaigns", body, chosen.report.name, backend.value);
      location.hash = `#/campaigns/${campaign.id}`;
    });
  } },
  h("label", { for: "backend" }, "Arm", backend), h("label", { for: "length" }, "Motion", length), h("label", { for: "time" }, "Time of the simulated arm", time),
  h("label", { for: "conceal" }, "The simulated arm conceals", conceal), h("label", { for: "conceal-joint" }, "at joint", joints),
  h("label", { class: "check", for: "plan" }, plan, "Plan a further motion even where the diagnosis leaves nothing open."), clearLabel, h("div", { class: "row" }, begin));
  if (ROBOT_OF.test(again)) {
    await take(robotFiles(await getJson(`${again}/robot`, signal)).map(([, file]) => file));
  }
  render(root, h("h1", { text: "New campaign" }), h("p", { class: "lead", text: "A motion is designed, driven twice, and the arm identified and diagnosed. Stop, above, ends it at any moment." }), drop, said, sheet, lacking, form);
}
