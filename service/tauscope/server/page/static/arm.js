// The kinematic chain as a drawing that turns: joints along their axes, links between them, in any pose.

import { h, named, s } from "./dom.js";

const multiply = (a, b) => Array.from({ length: 16 }, (_, k) => {
  const row = k >> 2;
  const column = k & 3;
  let sum = 0;
  for (let i = 0; i < 4; i += 1) sum += a[4 * row + i] * b[4 * i + column];
  return sum;
});

function motion(type, q) {
  if (type === "prismatic") return [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, q, 0, 0, 0, 1];
  const c = Math.cos(q);
  const n = Math.sin(q);
  return [c, -n, 0, 0, n, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
}

const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const origin = (frame) => [frame[3], frame[7], frame[11]];

/** Places of joints and link ends: T_j = T_{j-1} · before_j · motion_z(q_j) · after_j. */
export function chain(joints, q) {
  let frame = IDENTITY;
  const points = [[0, 0, 0]];
  const axes = [];
  joints.forEach((joint, place) => {
    frame = multiply(frame, joint.before);
    points.push(origin(frame));
    axes.push({ at: origin(frame), along: [frame[2], frame[6], frame[10]], type: joint.type });
    frame = multiply(multiply(frame, motion(joint.type, q[place] ?? 0)), joint.after);
    points.push(origin(frame));
  });
  return { points, axes };
}

/** A drawing of an arm; `pose(q)` moves it. */
export function armDrawing(report) {
  const joints = report.joints;
  let azimuth = 0.7;
  let q = joints.map(() => 0);
  const svg = s("svg", { viewBox: "0 0 400 320", class: "arm", role: "img", tabindex: "0",
    "aria-label": `Kinematic chain of ${report.name}: ${joints.length} joints. Arrow keys turn it.` });

  const reach = Math.max(0.1, joints.reduce((sum, joint) =>
    sum + Math.hypot(joint.before[3], joint.before[7], joint.before[11]) + Math.hypot(joint.after[3], joint.after[7], joint.after[11]), 0));

  function draw() {
    const c = Math.cos(azimuth);
    const n = Math.sin(azimuth);
    const flat = ([x, y, z]) => [x * c - y * n, 0.42 * (x * n + y * c) - 0.9 * z];
    const { points, axes } = chain(joints, q);
    const size = 0.055 * reach;
    const shown = points.map(flat);
    const xs = shown.map((p) => p[0]);
    const ys = shown.map((p) => p[1]);
    const span = Math.max(Math.max(...xs) - Math.min(...xs), Math.max(...ys) - Math.min(...ys), 0.4 * reach) + 4 * size;
    const scale = Math.min(380 / span, 280 / span);
    const middle = [(Math.max(...xs) + Math.min(...xs)) / 2, (Math.max(...ys) + Math.min(...ys)) / 2];
    const place = (p) => { const [u, v] = flat(p); return [200 + scale * (u - middle[0]), 160 + scale * (v - middle[1])]; };
    const path = points.map((p, k) => `${k ? "L" : "M"}${place(p).map((v) => v.toFixed(1)).join(" ")}`).join("");
    const base = place([0, 0, 0]);
    const ends = place(points[points.length - 1]);
    // Joints that sit in one place share a label.
    const labels = [];
    axes.forEach(({ at }, number) => {
      const [x, y] = place(at);
      const near = labels.find((each) => Math.hypot(each.x - x, each.y - y) < 16);
      if (near) near.text += ` · ${number + 1}`;
      else labels.push({ x, y, text: `${number + 1}` });
    });
    svg.replaceChildren(
      s("ellipse", { class: "ground", cx: base[0], cy: base[1], rx: scale * 2.6 * size, ry: scale * 1.1 * size }),
      s("path", { class: "link-shadow", d: path }), s("path", { class: "link", d: path }),
      ...axes.map(({ at, along, type }) => {
        const tip = (sign) => place(at.map((v, k) => v + sign * size * along[k]));
        const [a, b, centre] = [tip(-1), tip(1), place(at)];
        return s("g", { class: `joint ${type}` },
          s("line", { x1: a[0], y1: a[1], x2: b[0], y2: b[1] }),
          s("circle", { cx: centre[0], cy: centre[1], r: 3.2 }));
      }),
      ...labels.map(({ x, y, text }) => s("text", { class: "label", x: x + 24, y: y + 5, text })),
      s("circle", { class: "tool", cx: ends[0], cy: ends[1], r: 5 }));
  }

  const turn = (angle) => { azimuth += angle; draw(); };
  svg.addEventListener("keydown", (event) => {
    const angle = { ArrowLeft: -0.15, ArrowRight: 0.15 }[event.key];
    if (angle) { event.preventDefault(); turn(angle); }
  });
  svg.addEventListener("pointerdown", (event) => svg.setPointerCapture(event.pointerId));
  svg.addEventListener("pointermove", (event) => { if (event.buttons) turn(0.012 * event.movementX); });
  draw();
  return { element: h("figure", { class: "arm-figure" }, svg), pose(values) { q = values.map((v) => v ?? 0); draw(); } };
}

/** Joints and their limits as rows. */
export function jointRows(report, number) {
  const unit = (joint) => (joint.type === "prismatic" ? "m" : "rad");
  return report.joints.map((joint) => [
    `${joint.number}`, joint.name, named(joint.type),
    joint.limits.position ? `${joint.limits.position.map((v) => number(v, 3)).join(" … ")} ${unit(joint)}` : "–",
    joint.limits.velocity ? `${number(joint.limits.velocity, 3)} ${unit(joint)}/s` : "–",
    joint.limits.torque ? `${number(joint.limits.torque, 3)} ${joint.type === "prismatic" ? "N" : "Nm"}` : "–",
  ]);
}
