// Campaigns: begun from a robot file, followed step by step, and read.

import { armDrawing, jointRows } from "./arm.js";
import { follow, getJson, post } from "./api.js";
import { chance, explained, h, moment, number, render, section, state, table, title } from "./dom.js";
import { HEADLINES, appendRobot } from "./diagnoses.js";
import { move } from "./leases.js";
import { items } from "./lists.js";
import { liveMonitor } from "./runs.js";

const NAMES = { design: "Design the motion", run: "Run it", "held-out design": "Design a second one", "held-out run": "Run that", identify: "Identify", diagnose: "Diagnose" };
const ENDS = ["succeeded", "failed", "cancelled", "interrupted", "damaged"];
const RUN_ENDS = ["finished", "stopped", "failed", "interrupted", "damaged", "waiting"];

export async function showCampaigns(root, { signal }) {
  const { campaigns } = await getJson("campaigns?limit=200", signal);
  render(root, h("h1", { text: "Campaigns" }),
    h("p", { class: "lead", text: "Design a motion, drive the arm, identify it, and say what its model leaves out." }),
    h("div", { class: "row" }, h("a", { class: "button primary", href: "#/new", text: "New campaign" })),
    items(campaigns.map((each) => ({ href: `#/campaigns/${each.id}`, name: each.robot ?? each.id, detail: each.backend?.name, state: each.state, when: moment(each.created) })),
      "No campaign yet. Begin with a robot file."));
}

export async function showCampaign(root, { id, signal, show }) {
  let campaign = await getJson(`campaigns/${id}`, signal);
  const steps = h("ol", { class: "steps" });
  const status = h("p", { role: "status" });
  const arm = h("div", {});
  const live = h("div", {});
  const outcome = h("div", {});
  render(root, h("p", { class: "eyebrow", text: `Campaign · ${campaign.backend?.name ?? ""}` }), h("h1", { text: campaign.robot ?? id }), h("p", { class: "meta", text: moment(campaign.created) }),
    status, steps, outcome, live, arm);
  getJson(`campaigns/${id}/robot`, signal).then((robot) => render(arm, section("arm", "The arm", robotSheet(robot.report)))).catch(() => {});
  let watched = null;
  let leaving = null;
  function update() {
    render(status, state(campaign.state), campaign.problem ? h("span", { role: "alert" }, " ", explained(campaign.problem)) : "");
    render(steps, campaign.steps.map((step) => h("li", { "data-state": step.state, "data-live": !ENDS.includes(step.state) && !RUN_ENDS.includes(step.state) },
      h("b", {}, step.link && !step.link.includes("/excitations/") ? h("a", { href: linked(step.link), text: NAMES[step.name] }) : NAMES[step.name]), state(step.state))));
    const moving = campaign.steps.find((step) => step.link?.includes("/runs/") && !RUN_ENDS.includes(step.state));
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
  if (campaign.state === "succeeded") return outcomeOf(campaign, outcome, signal);
  if (ENDS.includes(campaign.state)) return null;
  const timer = setInterval(() => refresh().catch(() => {}), 1000);
  signal.addEventListener("abort", () => clearInterval(timer), { once: true });
  await follow(campaign.links.events, signal, (event) => { if (event.kind === "ended") { clearInterval(timer); show(); } });
  return null;
}

const linked = (path) => `#/${path.replace(/^\/api\/v1\//, "")}`;

async function outcomeOf(campaign, outcome, signal) {
  const result = await getJson(campaign.links.result, signal);
  const { diagnosis } = result;
  const id = (path) => path.split("/").pop();
  render(outcome, 
    h("p", { class: "headline", text: diagnosis ? HEADLINES[diagnosis.verdict] : "The arm is identified." }),
    diagnosis?.findings.map((each) => h("p", {}, h("strong", { text: `${title(each.effect)}${each.joint ? ` at ${each.joint}` : ""}` }), `, ${chance(each.probability)} probable. ${each.statement}.`)),
    h("div", { class: "row" },
      campaign.links.diagnosis ? h("a", { class: "button primary", href: `#/diagnoses/${id(campaign.links.diagnosis)}`, text: "Read the diagnosis" }) : null,
      h("a", { class: "button", href: `#/identifications/${id(campaign.links.identification)}`, text: "Read the identification" }),
      [...campaign.links.recordings, ...campaign.links.held_out].map((path) => h("a", { class: "button", href: linked(path), text: "Recording" })),
      h("a", { class: "button", href: `#/new?again=${campaign.id}`, text: "Once more" })));
}

function robotSheet(report) {
  return h("div", { class: "split" }, armDrawing(report).element,
    table("Joints", ["", "joint", "type", "position", "velocity", "torque"], jointRows(report, number), 3));
}

/** What the simulated arm may conceal, for a first try: a scenario, its joint the last but one. */
const CONCEALED = {
  nothing: () => null,
  "a spring": (joint) => ({ effect: "joint_spring", joint, stiffness: 2.0 }),
  "friction that grows with the load": (joint) => ({ effect: "load_dependent_friction", joint, mu: 0.1 }),
  "bristles: friction that rises over a distance": (joint) => ({ effect: "presliding_hysteresis", joint, distance: 0.02 }),
};

/** How long the arm moves: what is asked of the design. */
const LENGTHS = {
  usual: {},
  short: { excitation: { starts: 1, periods: 2, slow_postures: 1, closing_period: false }, held_out: { periods: 1 } },
  thorough: { excitation: { periods: 10, slow_postures: 6 }, held_out: { periods: 4 } },
};

export async function showNewCampaign(root, { signal }) {
  const again = new URLSearchParams(location.hash.split("?")[1] ?? "").get("again");
  const chosen = { files: null, report: null };
  const sheet = h("div", {});
  const said = h("p", { role: "status", class: "note" });
  const begin = h("button", { type: "submit", class: "primary", disabled: true, text: "Begin" });
  const input = h("input", { type: "file", id: "robot", multiple: true, accept: ".yaml,.yml,.json,.urdf,.xml", onchange: () => take([...input.files]) });
  const drop = h("div", { class: "drop", ondragover: (event) => { event.preventDefault(); drop.classList.add("over"); }, ondragleave: () => drop.classList.remove("over"),
    ondrop: (event) => { event.preventDefault(); drop.classList.remove("over"); take([...event.dataTransfer.files]); } },
  h("label", { for: "robot" }, "Robot file (YAML), and its URDF if it names one", input));

  async function take(files) {
    const robot = files.find((file) => /\.(ya?ml|json)$/i.test(file.name)) ?? files[0];
    const urdf = files.find((file) => file !== robot);
    const form = new FormData();
    form.append("robot", robot);
    if (urdf) form.append("urdf", urdf);
    said.textContent = "Checking …";
    begin.disabled = true;
    try {
      const report = await post("robots/check", form);
      chosen.files = [robot, urdf];
      chosen.report = report;
      said.textContent = "";
      begin.disabled = !report.passed;
      const remarks = report.findings.filter((each) => each.severity !== "info");
      render(sheet, h("h2", { text: report.name }), robotSheet(report), remarks.length ? h("ul", { class: "cautions" }, remarks.map((each) => h("li", { text: `${each.where}: ${each.text}` }))) : "");
      render(joints, ...report.joints.map((joint) => h("option", { value: joint.number, text: joint.name })));
    } catch (error) {
      render(sheet);
      render(said, explained(error));
    }
  }

  const backend = h("select", { id: "backend" }, [["sim", "simulated arm"], ["dynamixel", "Dynamixel servos"], ["canopen", "CANopen drives"]].map(([value, text]) => h("option", { value, text })));
  const time = h("select", { id: "time" }, [["virtual", "as fast as it computes"], ["real", "by the clock"]].map(([value, text]) => h("option", { value, text })));
  const conceal = h("select", { id: "conceal" }, Object.keys(CONCEALED).map((name) => h("option", { value: name, text: name })));
  const joints = h("select", { id: "conceal-joint" });
  const length = h("select", { id: "length" }, Object.keys(LENGTHS).map((name) => h("option", { value: name, text: name })));
  const clear = h("input", { type: "checkbox", id: "clear" });
  const clearLabel = h("label", { class: "check", for: "clear", hidden: true }, clear, "The arm's whole reach is clear, and the emergency stop is at hand.");
  const plan = h("input", { type: "checkbox", id: "plan" });
  const simulated = [time, conceal, joints];
  backend.onchange = () => {
    const real = backend.value !== "sim";
    clearLabel.hidden = !real;
    clear.required = real;
    simulated.forEach((each) => { each.disabled = real; });
  };
  const form = h("form", { class: "sheet", onsubmit: async (event) => {
    event.preventDefault();
    begin.disabled = true;
    said.textContent = "Handing in …";
    const concealed = backend.value === "sim" ? CONCEALED[conceal.value](Number(joints.value)) : null;
    const isSim = backend.value === "sim";
    const request = { backend: { name: backend.value, ...(isSim ? { time: time.value } : {}), ...(concealed ? { scenario: { torque_noise_std: 0.1, seed: 1, effects: [concealed] } } : {}) }, diagnosis: { next_trajectory: plan.checked }, ...LENGTHS[length.value] };
    if (isSim) request.run = { feed_forward: false, rate_hz: 200 };
    const body = new FormData();
    body.append("request", new Blob([JSON.stringify(request)], { type: "application/json" }));
    body.append("robot", chosen.files[0]);
    if (chosen.files[1]) body.append("urdf", chosen.files[1]);
    try {
      const campaign = await move("campaigns", body, chosen.report.name, backend.value);
      location.hash = `#/campaigns/${campaign.id}`;
    } catch (error) { render(said, explained(error)); begin.disabled = false; }
  } },
  h("label", { for: "backend" }, "Arm", backend), h("label", { for: "length" }, "Motion", length), h("label", { for: "time" }, "Time of the simulated arm", time),
  h("label", { for: "conceal" }, "The simulated arm conceals", conceal), h("label", { for: "conceal-joint" }, "at", joints),
  h("label", { class: "check", for: "plan" }, plan, "Plan a further motion even where the diagnosis leaves nothing open."), clearLabel, h("div", { class: "row" }, begin));
  render(root, h("h1", { text: "New campaign" }), h("p", { class: "lead", text: "A motion is designed, driven twice, and the arm identified and diagnosed. Stop, above, ends it at any moment." }), drop, said, sheet, form);
  if (again) {
    const robot = await getJson(`campaigns/${again}/robot`, signal);
    const parts = new FormData();
    appendRobot(parts, robot);
    await take([parts.get("robot"), parts.get("urdf")].filter(Boolean));
  }
}
