// The server: every request carries the token that came with the page's address, which then leaves the address bar.

const KEPT = "shellock-token";

function takeToken() {
  const given = new URLSearchParams(location.search).get("token");
  if (given) {
    sessionStorage.setItem(KEPT, given);
    history.replaceState(null, "", location.pathname);
  }
  return given ?? sessionStorage.getItem(KEPT) ?? "";
}

const token = takeToken();
// Pages hear of every change; by its name a page knows its own.
const pageName = Math.random().toString(36).slice(2);

/** What the server refused, in its words. */
export class Refused extends Error {
  constructor(status, words) {
    super(words);
    this.status = status;
  }
}

async function ask(method, path, { body, type, signal } = {}) {
  const headers = { Authorization: `Bearer ${token}`, "X-Shellock-Page": pageName };
  if (type) headers["Content-Type"] = type;
  const answer = await fetch(`/api/${path}`, { method, headers, body, signal });
  if (answer.ok) return answer;
  const told = await answer.json().catch(() => ({}));
  throw new Refused(answer.status, told.error ?? `${answer.status} ${answer.statusText}`);
}

// Something else came in between: asked again, it will do.
const OVERTAKEN = 409;
async function json(answer) {
  const told = await (await answer).json();
  if (told.overtaken) throw new Refused(OVERTAKEN, "");
  return told;
}
async function bytes(answer) {
  const got = await answer;
  if (got.headers.get("Content-Type") !== "application/octet-stream") throw new Refused(OVERTAKEN, "");
  return got.arrayBuffer();
}
const send = (method, path, value = {}, signal) => json(ask(method, path, { body: JSON.stringify(value), type: "application/json", signal }));

export const api = {
  project: () => json(ask("GET", "project")),
  options: () => json(ask("GET", "options")),
  choose: (changes) => send("PUT", "options", changes),
  open: (file) => json(ask("POST", `model?name=${encodeURIComponent(file.name)}`, { body: file, type: "application/octet-stream" })),
  figure: (name) => send("POST", "figure", { name }),
  mesh: () => bytes(ask("GET", "mesh")),
  labels: async () => new Uint32Array(await bytes(ask("GET", "labels"))),
  paint: (labels) => json(ask("PUT", "labels", { body: labels, type: "application/octet-stream" })),
  divide: () => send("POST", "divide"),
  judge: (signal) => send("POST", "judge", {}, signal),
  cut: (signal) => bytes(ask("GET", "cut", { signal })),
  mend: () => send("POST", "mend"),
  mirror: () => send("POST", "mirror"),
  placeKey: (at) => send("POST", "key", { at }),
  make: () => send("POST", "make"),
  stop: (id) => send("DELETE", `jobs/${id}`),
};

/** Where a file of the kit is; links within it work. */
export const kitUrl = (name) => `/kit/${token}/${name.split("/").map(encodeURIComponent).join("/")}`;
export const zipUrl = () => `/api/kit.zip?token=${token}`;

/** Calls `on.job` and `on.project` with what happens, the latter also with whether this page caused it, and `on.lost` or `on.found` where the server goes or comes back. */
export function listen(on) {
  const events = new EventSource(`/api/events?token=${token}`);
  events.addEventListener("job", (e) => on.job(JSON.parse(e.data)));
  events.addEventListener("project", (e) => on.project(JSON.parse(e.data).by === pageName));
  events.addEventListener("open", () => on.found());
  events.addEventListener("error", () => on.lost());
}
