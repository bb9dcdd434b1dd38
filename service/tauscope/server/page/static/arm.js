// The kinematic chain in space, drawn by a projection of our own: nearest last, in any pose, from any side.

import { h, named, s, unitsOf } from "./dom.js";

/** A transform from its rows, as the service tells it; the browser's own matrices are told by columns. */
const matrixOf = (rows) => new DOMMatrix(rows.map((_, k) => rows[4 * (k % 4) + (k >> 2)]));

const origin = (frame) => [frame.m41, frame.m42, frame.m43];

/** Places of joints and link ends: T_j = T_{j-1} · before_j · motion_z(q_j) · after_j. */
export function chain(joints, q) {
  let frame = new DOMMatrix();
  const points = [[0, 0, 0]];
  const axes = [];
  joints.forEach((joint, place) => {
    const value = q[place] ?? 0;
    frame = frame.multiply(matrixOf(joint.before));
    points.push(origin(frame));
    axes.push({ at: origin(frame), along: [frame.m31, frame.m32, frame.m33], type: joint.type });
    frame = joint.type === "prismatic" ? frame.translate(0, 0, value) : frame.rotate(0, 0, (value * 180) / Math.PI);
    frame = frame.multiply(matrixOf(joint.after));
    points.push(origin(frame));
  });
  return { points, axes };
}

const WIDTH = 400;
const HEIGHT = 320;
const DISTANCE = 6; // of the eye, in radii of what is seen: a gentle perspective
const THICKNESS = 0.09; // half the length of a joint's body, in radii of what is seen
const STEP = 0.12; // a key turns the view by [rad]
const GRID = 4; // lines of the ground to each side

/** Rows of the rotation that turns a direction upright; the identity without one. */
function rotationTo(up) {
  const size = Math.hypot(...up);
  const [x, y, z] = size ? up.map((value) => value / size) : [0, 0, 1];
  if (z < -0.999999) return [[1, 0, 0], [0, -1, 0], [0, 0, -1]];
  const share = 1 / (1 + z);
  return [[1 - share * x * x, -share * x * y, -x], [-share * x * y, 1 - share * y * y, -y], [x, y, z]];
}

/** A drawing of an arm in space: `pose(q)` moves it, `show(q, levels)` colours its joints too, `trace(points)` draws a path. */
export function armDrawing(report) {
  const joints = report.joints;
  const view = { azimuth: 0.7, elevation: 0.42, q: joints.map(() => 0), levels: null, path: [] };
  const svg = s("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "arm", role: "img", tabindex: "0",
    "aria-label": `Kinematic chain of ${report.name}: ${joints.length} joints. Arrow keys turn it.` });
  const reach = Math.max(0.1, joints.reduce((sum, joint) =>
    sum + Math.hypot(joint.before[3], joint.before[7], joint.before[11]) + Math.hypot(joint.after[3], joint.after[7], joint.after[11]), 0));
  const upright = rotationTo(report.gravity.map((value) => -value));
  const raised = (point) => upright.map((row) => row[0] * point[0] + row[1] * point[1] + row[2] * point[2]);
  const rest = chain(joints, view.q).points.map(raised);
  const middle = [0, 1, 2].map((k) => (Math.max(...rest.map((p) => p[k])) + Math.min(...rest.map((p) => p[k]))) / 2);
  let radius = 0.2 * reach; // of what has to be seen around the middle; it grows with the motion

  /** Place on the paper, and depth: greater is nearer. */
  function project(point) {
    const [x, y, z] = raised(point).map((value, k) => (value - middle[k]) / radius);
    const [ca, sa, ce, se] = [Math.cos(view.azimuth), Math.sin(view.azimuth), Math.cos(view.elevation), Math.sin(view.elevation)];
    const across = x * ca - y * sa;
    const away = x * sa + y * ca;
    const depth = z * se - away * ce;
    const scale = (0.4 * HEIGHT * DISTANCE) / (DISTANCE - depth);
    return { x: WIDTH / 2 + scale * across, y: HEIGHT / 2 - scale * (z * ce + away * se), depth, scale };
  }

  const pathOf = (points) => points.map((p, k) => `${k ? "L" : "M"}${p.x.toFixed(1)} ${p.y.toFixed(1)}`).join("");
  const stroke = (name, [a, b], width) => s("path", { class: name, d: pathOf([a, b]), "stroke-width": width.toFixed(1) });

  /** A solid along an axis: its far end, its body, and the end that is seen. */
  function cylinder(one, other, width, half) {
    const [far, near] = one.depth < other.depth ? [one, other] : [other, one];
    const tilt = Math.min(Math.abs(far.depth - near.depth) / (2 * half), 1);
    const angle = (Math.atan2(near.y - far.y, near.x - far.x) * 180) / Math.PI;
    const end = (name, at, more) => s("ellipse", { class: name, rx: (tilt * width + more) / 2, ry: (width + more) / 2, transform: `translate(${at.x.toFixed(1)} ${at.y.toFixed(1)}) rotate(${angle.toFixed(1)})` });
    return [end("joint-edge", far, 2), end("joint-edge", near, 2), stroke("joint-shadow", [far, near], width + 2), end("joint-end", far, 0), stroke("joint-body", [far, near], width), end("joint-end", near, 0)];
  }

  function ground() {
    const lines = [];
    const end = 1.1 * radius;
    for (let k = -GRID; k <= GRID; k += 1) {
      const at = (k / GRID) * end;
      lines.push([[at, -end, 0], [at, end, 0]], [[-end, at, 0], [end, at, 0]]);
    }
    const lowered = (point) => [0, 1, 2].map((k) => upright[0][k] * point[0] + upright[1][k] * point[1] + upright[2][k] * point[2]);
    return s("path", { class: "ground", d: lines.map((line) => pathOf(line.map((point) => project(lowered(point))))).join("") });
  }

  function draw() {
    const { points, axes } = chain(joints, view.q);
    for (const point of [...points, ...view.path]) radius = Math.max(radius, Math.hypot(...raised(point).map((value, k) => value - middle[k])));
    const places = points.map(project);
    const size = THICKNESS * radius;
    const solids = [];
    for (let k = 1; k < places.length; k += 1) {
      const ends = [places[k - 1], places[k]];
      if (Math.hypot(...points[k].map((value, axis) => value - points[k - 1][axis])) < 1e-6 * reach) continue;
      const width = 0.85 * THICKNESS * ((ends[0].scale + ends[1].scale) / 2);
      const lit = ends.map((end) => ({ x: end.x - 0.16 * width, y: end.y - 0.16 * width }));
      solids.push({ depth: (ends[0].depth + ends[1].depth) / 2, element: s("g", {}, stroke("link-shadow", ends, width + 3), stroke("link", ends, width), stroke("link-light", lit, 0.34 * width)) });
    }
    axes.forEach(({ at, along, type }, place) => {
      const tip = (sign) => project(at.map((value, k) => value + sign * size * along[k]));
      const centre = project(at);
      const width = 1.5 * THICKNESS * centre.scale;
      const level = view.levels ? ` h${view.levels[place]}` : "";
      solids.push({ depth: centre.depth + 0.01, element: s("g", { class: `joint ${type}${level}`, "data-joint": place + 1 },
        cylinder(tip(-1), tip(1), width, THICKNESS)) });
    });
    // Joints that sit in one place share a label.
    const labels = [];
    axes.forEach(({ at }, number) => {
      const { x, y } = project(at);
      const near = labels.find((each) => Math.hypot(each.x - x, each.y - y) < 16);
      if (near) near.text += ` · ${number + 1}`;
      else labels.push({ x, y, text: `${number + 1}` });
    });
    const tool = places[places.length - 1];
    svg.replaceChildren(
      ground(), view.path.length ? s("path", { class: "trace", d: pathOf(view.path.map(project)) }) : s("g"),
      ...solids.sort((a, b) => a.depth - b.depth).map((each) => each.element),
      ...labels.map(({ x, y, text }) => s("text", { class: "label", x: x + 22, y: y + 5, text })),
      s("circle", { class: "tool", cx: tool.x, cy: tool.y, r: 5 }));
  }

  function turn(about, up) {
    view.azimuth += about;
    view.elevation = Math.min(Math.max(view.elevation + up, -0.2), 1.5);
    draw();
  }
  svg.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, STEP], ArrowDown: [0, -STEP] }[event.key];
    if (by) { event.preventDefault(); turn(...by); }
  });
  svg.addEventListener("pointerdown", (event) => svg.setPointerCapture(event.pointerId));
  svg.addEventListener("pointermove", (event) => { if (event.buttons) turn(0.012 * event.movementX, 0.01 * event.movementY); });
  draw();
  const change = (more) => { Object.assign(view, more); draw(); };
  return {
    element: h("figure", { class: "arm-figure" }, svg),
    pose(values) { change({ q: values.map((v) => v ?? 0) }); },
    show(values, levels) { change({ q: values, levels }); },
    trace(path) { change({ path }); },
  };
}

export function jointRows(report, number) {
  return report.joints.map((joint) => [
    `${joint.number}`, joint.name, named(joint.type),
    joint.limits.position ? `${joint.limits.position.map((v) => number(v, 3)).join(" … ")} ${unitsOf(joint.type).position}` : "–",
    joint.limits.velocity ? `${number(joint.limits.velocity, 3)} ${unitsOf(joint.type).velocity}` : "–",
    joint.limits.torque ? `${number(joint.limits.torque, 3)} ${unitsOf(joint.type).torque}` : "–",
  ]);
}
