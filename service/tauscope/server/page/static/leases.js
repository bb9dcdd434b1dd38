// The lease of an arm, where the service wants one: taken and armed by whoever begins a motion here, kept as long as this tab lives, given back at its end.

import { ENDS, getJson, post, remove } from "./api.js";

const STORE = "tauscope-leases";
const TTL_S = 10;

let held = JSON.parse(sessionStorage.getItem(STORE) ?? "[]"); // a reload of the page does not stop the arm
let worker = null;

/** Hand in a run or a campaign. Where the service moves an arm by its lease only, that is taken and armed first. */
export async function move(path, form, robot, backend) {
  const mine = held.find((each) => each.robot === robot && each.backend === backend);
  try {
    if (!mine) return await post(path, form);
  } catch (error) {
    if (error.code !== "lease-needed") throw error;
  }
  const lease = mine ?? await take(robot, backend);
  try {
    await post(lease.links.arm, undefined, shown(lease));
    const made = await post(path, form, shown(lease));
    lease.item = made.links.self;
    keep(held);
    return made;
  } catch (error) {
    if (!lease.item) await giveBack(lease);
    throw error;
  }
}

/** Keep what this tab has, from its first moment on; `tell` is told which arms those are, and why one is lost. */
export function keepLeases(tell) {
  worker = new Worker("/page/beat.js");
  worker.onmessage = () => held.forEach((lease) => beat(lease, tell));
  held.forEach((lease) => beat(lease, tell));
  window.addEventListener("tauscope:leases", () => tell(arms()));
  tell(arms());
}

const arms = () => held.map((each) => each.arm);
const shown = (lease) => ({ headers: { "Lease-Token": lease.token } });

function keep(leases) {
  held = leases;
  sessionStorage.setItem(STORE, JSON.stringify(held));
  window.dispatchEvent(new Event("tauscope:leases"));
}

async function take(robot, backend) {
  const taken = await post("leases", { robot, backend, ttl_s: TTL_S });
  const lease = { robot, backend, arm: taken.arm, token: taken.token, links: taken.links };
  keep([...held, lease]);
  return lease;
}

async function giveBack(lease) {
  keep(held.filter((each) => each !== lease));
  await remove(lease.links.self, shown(lease)).catch(() => {}); // else it ends by itself
}

/** A sign of life; the lease is given back once what it was taken for has ended. */
async function beat(lease, tell) {
  try {
    await post(lease.links.heartbeat, undefined, { ...shown(lease), signal: AbortSignal.timeout(2500) });
    if (lease.item && ENDS.includes((await getJson(lease.item)).state)) await giveBack(lease);
  } catch (error) {
    if (error.code !== "lease-lost" || !held.includes(lease)) return; // the next beat may come through
    keep(held.filter((each) => each !== lease));
    tell(arms(), `The lease of ${lease.arm} is lost, and its run was stopped. Look at the arm before you begin again.`);
  }
}
