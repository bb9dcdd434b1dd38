// The button that stops every arm. It needs no lease, and any key will do, an expired one too; it is tried until the service has heard.

import { ENDS, getJson, post } from "./api.js";

const ATTEMPTS = 60;
const AGAIN_MS = 500;
const PATIENCE_MS = 3000;

/** Ask once; refusals are answers, a lost connection is none. */
async function asked(path) {
  try {
    return { told: await post(path, undefined, { keepalive: true, signal: AbortSignal.timeout(PATIENCE_MS) }) };
  } catch (error) {
    if (error.status === undefined || error.status >= 500) throw error;
    return { refused: error };
  }
}

/** What goes on behind the stop, as a fresh list says; nothing where the key does for a stop only. */
async function stillGoing() {
  try {
    const fresh = AbortSignal.timeout(PATIENCE_MS);
    const [{ runs }, { campaigns }] = await Promise.all([getJson("runs?limit=20", fresh), getJson("campaigns?limit=20", fresh)]);
    return [...campaigns, ...runs].filter((each) => !ENDS.includes(each.state)).map((each) => each.links.stop);
  } catch (error) {
    if (error.status === undefined) throw error;
    return [];
  }
}

/**
 * Stop everything that moves: all at once, what is `known` by name, and what a fresh list says. Returns the service's refusal, or null.
 */
export async function stopEverything(known, say) {
  for (let attempt = 0; attempt < ATTEMPTS; attempt += 1) {
    try {
      const [all] = await Promise.all(["stop", ...known].map(asked));
      if (all.refused) {
        say(`Stop was refused: ${all.refused.message}. Use the arm's own emergency stop now.`);
        return all.refused;
      }
      const more = await stillGoing();
      await Promise.all(more.map(asked));
      const stopped = [...all.told.runs, ...all.told.campaigns, ...known, ...more];
      say(stopped.length ? "Stop was sent, and the service has taken it." : "Nothing was moving.");
      return null;
    } catch {
      say("Stop could not be sent. It is tried again. Use the arm's own emergency stop now.");
      await new Promise((done) => setTimeout(done, AGAIN_MS));
    }
  }
  return null;
}
