// Files that were dropped or chosen, or those of the example: which is the robot, which are recordings.

import { fetchRaw } from "./api.js";

const RECORDING = /\.(csv|tsv|txt|parquet|mcap|db3|bag|npz)$/i;
const DESCRIPTION = /\.(urdf|xml|mjcf|xacro)$/i;
const MAPPING = /\.(ya?ml|json)$/i;

export async function droppedFiles(transfer) {
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

export async function sortFiles(files) {
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

export const exampleFiles = () => Promise.all(EXAMPLE.map(async (name) => new File([await (await fetchRaw(`/example/${name}`)).blob()], name)));
