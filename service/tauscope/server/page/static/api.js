// Talking to the service: one place for keys, problems and streams.

const ROOT = "/api/v1";
const KEY = "tauscope-key";
/** States in which nothing goes on any more, of jobs and of runs. */
export const ENDS = ["succeeded", "failed", "cancelled", "finished", "degraded", "stopped", "interrupted", "damaged"];

export class Problem extends Error {
  constructor(status, detail, code) {
    super(detail);
    this.status = status;
    this.code = code;
  }
}

function headers(more) {
  const key = sessionStorage.getItem(KEY);
  return key ? { ...more, Authorization: `Bearer ${key}` } : { ...more };
}

/** Keep a key for as long as this tab is open. */
export function useKey(key) {
  sessionStorage.setItem(KEY, key);
  window.dispatchEvent(new Event("tauscope:key"));
}

export const hasKey = () => sessionStorage.getItem(KEY) !== null;

async function answered(response) {
  if (response.ok) return response;
  let content = {};
  try {
    content = await response.json();
  } catch {
    // A proxy's own page, perhaps: the status has to do.
  }
  throw new Problem(response.status, content.detail ?? `${response.status} ${response.statusText}`, content.code);
}

export function url(path) {
  return path.startsWith("/") ? path : `${ROOT}/${path}`;
}

export async function fetchRaw(path, options = {}) {
  let response;
  try {
    response = await fetch(url(path), { ...options, headers: headers(options.headers) });
  } catch (error) {
    throw error instanceof TypeError ? new Problem(undefined, "The service does not answer. Check the connection, and try again.") : error;
  }
  return answered(response);
}

export async function getJson(path, signal) {
  return (await fetchRaw(path, { signal })).json();
}

export async function post(path, body, options = {}) {
  const isForm = body instanceof FormData;
  const more = body === undefined || isForm ? {} : { "Content-Type": "application/json" };
  const response = await fetchRaw(path, {
    ...options,
    method: "POST",
    body: body === undefined || isForm ? body : JSON.stringify(body),
    headers: { ...more, "Idempotency-Key": crypto.randomUUID?.() ?? `${Date.now()}-${Math.random()}`, ...options.headers },
  });
  return response.status === 204 ? null : response.json();
}

export const remove = (path, options = {}) => fetchRaw(path, { ...options, method: "DELETE" });

/** A form: the request as JSON, where there is one, and files under the names of their parts. */
export function formOf(request, files) {
  const form = new FormData();
  if (request) form.append("request", new Blob([JSON.stringify(request)], { type: "application/json" }));
  for (const [part, file] of files) if (file) form.append(part, file, file.name);
  return form;
}

/** The robot of an item at a glance; null where there is none to be had. */
export const reportOf = (path, signal) => getJson(`${path}/robot`, signal).then((robot) => robot.report, () => null);

/** A parameter behind the hash. */
export const query = (name) => new URLSearchParams(location.hash.split("?")[1] ?? "").get(name);

/** Save a file that the service sends; a link alone could bring no key. */
export async function download(path, name) {
  saveAs(await (await fetchRaw(path)).blob(), name);
}

export function saveAs(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** Columns of a recording: Float32Arrays by name. */
export async function getSamples(name, signal) {
  const path = `recordings/${encodeURIComponent(name)}/samples`;
  const content = await (await fetchRaw(path, { signal })).arrayBuffer();
  const length = new DataView(content).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(content, 4, length)));
  const columns = {};
  header.columns.forEach((column, place) => {
    columns[column] = new Float32Array(content, 4 + length + 4 * place * header.shown, header.shown);
  });
  return { ...header, columns };
}

const sleep = (ms, signal) => new Promise((done) => {
  const timer = setTimeout(done, ms);
  signal.addEventListener("abort", () => { clearTimeout(timer); done(); }, { once: true });
});

/** Follow a job's events until its end; after a lost connection it goes on behind the last event that came. */
export async function follow(path, signal, tell) {
  let last = 0;
  while (!signal.aborted) {
    try {
      const response = await fetchRaw(path, { signal, headers: last ? { "Last-Event-ID": String(last) } : {} });
      if (response.status === 204) return;
      for await (const event of parsed(response.body)) {
        if (event.id) last = Number(event.id);
        if (event.data) tell(JSON.parse(event.data));
        if (event.event === "ended") return;
      }
    } catch (error) {
      if (signal.aborted || error.status === 404) return;
    }
    await sleep(1000, signal);
  }
}

async function* parsed(body) {
  const reader = body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    text += value.replaceAll("\r", "");
    let end;
    while ((end = text.indexOf("\n\n")) >= 0) {
      const event = {};
      for (const line of text.slice(0, end).split("\n")) {
        const colon = line.indexOf(":");
        if (colon > 0) event[line.slice(0, colon)] = line.slice(colon + 1).trimStart();
      }
      text = text.slice(end + 2);
      yield event;
    }
  }
}
