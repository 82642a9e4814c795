// The studio's page: what is open, what is chosen, and what the server is asked for. One state; screens and canvas are drawn from it.

import { api, kitUrl, listen } from "./api.js";
import { button, element, slider } from "./dom.js";
import { History } from "./history.js";
import * as screens from "./screens.js";
import { readCut, readMesh, unused } from "./surface.js";
import { Tools } from "./tools.js";
import { View } from "./view.js";
import { words } from "./words.js";

const STEPS = ["open", "pieces", "key", "make", "kit"];
const SCREENS = { open: screens.openScreen, pieces: screens.piecesScreen, key: screens.keyScreen, make: screens.makeScreen, kit: screens.kitScreen };
const OF_MODEL = new Set(["size", "height", "scale", "unit", "up", "no-repair", "largest", "object", "plate", "fill", "inside-out", "resolution", "labels-from", "thickness"]);
const OF_DIVISION = new Set(["keep-whole", "seed"]);
const $ = (id) => document.getElementById(id);

const state = { step: "open", project: { model: null, division: null, kit: null, figures: [] }, options: [], judged: null, isJudging: false, pieces: [], piece: 0, job: null };
let [surface, history, base, view, tools] = [null, null, null, null, null];
let [judging, saving] = [null, Promise.resolve()];

// What goes wrong is said on the page, whatever asked for it.
const guarded = (work) => async (...args) => {
  try { return await work(...args); } catch (e) { if (e.name !== "AbortError" && e.status !== 409) say(e.message, true); return undefined; }
};

// What came too late since something else changed meanwhile (409) is asked again, as long as it is wanted.
async function insist(work, isWanted = () => true) {
  for (let i = 0; ; i++) {
    try { return await work(); } catch (e) {
      if (e.status !== 409 || i === 20 || !isWanted()) throw e;
      await new Promise((done) => setTimeout(done, 100));
    }
  }
}

function say(text, isBad = false) {
  const line = $("told");
  line.textContent = text;
  line.className = isBad ? "bad" : "";
  line.hidden = !text;
}

function busy(text) {
  $("busy").textContent = text;
  $("busy").hidden = !text;
}

// Everything of the page that follows from the state.
function draw() {
  for (const b of $("steps").children) b.setAttribute("aria-current", b.dataset.step === state.step ? "step" : "false");
  const sheet = $("sheet");
  const [focus, top] = [document.activeElement?.name, sheet.scrollTop];
  const open = new Set([...sheet.querySelectorAll("details[open] > summary")].map((s) => s.textContent));
  sheet.replaceChildren(...SCREENS[state.step](state, act));
  for (const s of sheet.querySelectorAll("details > summary")) if (open.has(s.textContent)) s.parentElement.open = true;
  sheet.scrollTop = top;
  if (focus) sheet.querySelector(`[name="${focus}"]`)?.focus();
  $("tools").hidden = state.step !== "pieces" || !history;
  $("kit").hidden = !(state.step === "kit" && state.project.kit);
  $("canvas").inert = !$("kit").hidden;
  for (const b of $("tools").querySelectorAll("[data-tool]")) b.setAttribute("aria-pressed", String(b.dataset.tool === tools.tool));
  for (const [name, can] of [["undo", history?.canUndo], ["redo", history?.canRedo]]) $(`do-${name}`).disabled = !can;
  drawCanvas();
}

function drawCanvas() {
  if (!surface) return;
  view.stripes(state.step === "open");
  view.showKeys(state.step === "key" && state.judged ? state.judged.keys : []);
  const size = state.project.model?.size_mm.map((x) => x.toFixed(0)).join(" × ");
  view.renderer.domElement.setAttribute("aria-label", `${state.project.model?.name}, ${size} mm, ${words.pieces.count(state.pieces.length)}`);
}

function step(name) {
  if (name !== "pieces") choose("turn");
  state.step = name;
  if (name === "kit" && state.project.kit) showKit();
  say("");
  draw();
}

// The frame is loaded anew only where the kit is another.
function showKit() {
  const { kit } = state.project;
  const version = kit.files.reduce((sum, f) => sum + f.bytes, 0);
  const url = `${kitUrl("report.html")}?${version}-${state.job?.id ?? 0}`;
  if ($("kit").getAttribute("src") !== url) $("kit").setAttribute("src", url);
}

function choose(tool) {
  tools.choose(tool);
  $("radius").hidden = tool !== "brush" && tool !== "eraser";
  $("angle").hidden = tool !== "fill";
}

/** Pieces are counted and outlined anew. */
function counted() {
  state.pieces = history ? surface.pieces(history.labels) : [];
  if (history && !state.pieces.some((p) => p.piece === state.piece) && !state.isFresh) state.piece = state.pieces[0]?.piece ?? 0;
  view.outline(history?.labels ?? null);
}

async function refresh() {
  state.project = await api.project();
  state.job = state.project.job;
}

// The model as the server has it, with its pieces; divided where it is not yet.
async function load() {
  await refresh();
  state.options = await api.options();
  while (state.project.is_opening) {
    busy(words.working.opening);
    await new Promise((done) => setTimeout(done, 200));
    await refresh();
  }
  busy("");
  if (state.project.problem) say(state.project.problem, true);
  if (!state.project.model) { draw(); return; }
  surface = readMesh(await api.mesh());
  [history, base, state.judged] = [null, null, null];
  view.show(surface);
  if (state.project.division) await takeLabels();
  else await divide();
  draw();
  judge();
}

async function takeLabels() {
  const labels = await api.labels();
  if (history) view.paint(history.labels, history.replace(labels) ? undefined : []);
  else history = new History(labels);
  base ??= labels.slice();
  view.paint(history.labels);
  view.smoothSeams([]);
  counted();
}

async function divide() {
  busy(words.working.dividing);
  draw();
  try {
    await insist(api.divide);
    base = null;
    await takeLabels();
    await refresh();
  } finally {
    busy("");
  }
}

/** What was painted goes to the server, one after the other; then it is judged. */
function save() {
  counted();
  view.smoothSeams([]);
  state.isJudging = true;
  draw();
  const labels = history.labels.slice();
  saving = saving.then(guarded(async () => {
    const { is_changed: isChanged, n_pieces: n } = await insist(() => api.paint(labels));
    state.project.division = { ...state.project.division, n_pieces: n, origin: "painted" };
    if (isChanged) { history.labels.set(await api.labels()); view.paint(history.labels); counted(); }
    await judge();
  }));
}

const judge = guarded(async () => {
  judging?.abort();
  const mine = new AbortController();
  judging = mine;
  if (!history) return;
  state.isJudging = true;
  draw();
  try {
    // Both of the same state.
    const both = async () => [await api.judge(mine.signal), readCut(await api.cut(mine.signal))];
    const [judged, cut] = await insist(both, () => judging === mine);
    if (judging !== mine || tools.stroke) return;
    state.judged = judged;
    view.showCut(cut);
    view.smoothSeams(judged.seams);
  } finally {
    if (judging === mine) { state.isJudging = false; draw(); }
  }
});

const act = {
  step,
  look: (at) => view.lookAt(at),
  open: guarded(async (file) => { busy(words.working.opening); try { await api.open(file); await load(); } finally { busy(""); } }),
  figure: guarded(async (name) => { busy(words.working.opening); try { await api.figure(name); await load(); } finally { busy(""); } }),
  choose: guarded(async (changes) => {
    const names = Object.keys(changes);
    try { state.options = await api.choose(changes); } catch (e) { draw(); throw e; }
    say("");
    if (names.some((n) => OF_MODEL.has(n))) await load();
    else if (names.some((n) => OF_DIVISION.has(n)) && state.project.division?.origin === "automatic") { await divide(); judge(); }
    else { await refresh(); draw(); judge(); }
  }),
  chooseDivision: guarded(async (changes) => {
    try { state.options = await api.choose(changes); } catch (e) { draw(); throw e; }
    await divide();
    draw();
    judge();
  }),
  divide: guarded(async () => { await divide(); draw(); judge(); }),
  mend: guarded(async () => {
    state.isJudging = true;
    draw();
    try { await insist(api.mend); await takeLabels(); await refresh(); } catch (e) { state.isJudging = false; draw(); throw e; }
    judge();
  }),
  mirror: guarded(async () => {
    busy(words.working.mirror);
    try { await insist(api.mirror); await takeLabels(); await refresh(); draw(); judge(); } finally { busy(""); }
  }),
  placeKey: guarded(async (at) => { state.options = await api.placeKey(at); draw(); judge(); }),
  make: guarded(async () => { await saving; state.job = await api.make(); draw(); }),
  stop: guarded(async (id) => { state.job = await api.stop(id); draw(); }),
  chose: (piece) => { [state.piece, state.isFresh] = [piece, false]; say(words.hints.chosen(piece + 1)); draw(); },
  fresh: () => {
    if (!history) return;
    [state.piece, state.isFresh] = [unused(history.labels), true];
    say(words.hints.fresh(state.piece + 1));
    if (tools.tool === "turn") choose("brush");
    draw();
  },
  grow: () => change((labels) => surface.ring(labels, state.piece).map((f) => [f, state.piece])),
  shrink: () => change((labels) => surface.edge(labels, state.piece)),
  smooth: () => change((labels) => surface.smoothed(labels, state.piece)),
  undo: () => { if (history?.canUndo) { view.paint(history.labels, history.undo()); save(); } },
  redo: () => { if (history?.canRedo) { view.paint(history.labels, history.redo()); save(); } },
  home: () => view.home(),
};

function change(of) {
  if (!history) return;
  view.paint(history.labels, history.set(of(history.labels)));
  if (history.close()) save();
}

// News of jobs, and of what other pages of this project did.
const heard = {
  job: guarded(async (job) => {
    state.job = job;
    if (["verified", "failed"].includes(job.state)) { await refresh(); if (state.step === "make") step("kit"); }
    if (state.step === "make") draw();
  }),
  project: guarded(async (isMine) => {
    if (isMine) { await refresh(); return; }
    const { revision } = state.project;
    await refresh();
    if (state.project.revision !== revision && !state.isJudging) await load();
  }),
  lost: () => { say(words.lost, true); heard.wasLost = true; },
  found: guarded(async () => { if (heard.wasLost) { heard.wasLost = false; say(""); await load(); } }),
};

function buildTools() {
  const holder = $("tools");
  const group = element("div", "modes");
  for (const [tool, [name, title, key]] of Object.entries(words.tools)) {
    const b = button(name, () => { choose(tool); draw(); }, { title, key });
    b.dataset.tool = tool;
    group.append(b);
  }
  const actions = element("div", "modes");
  for (const [name, [label, title, key]] of Object.entries(words.actions)) {
    const b = button(label, () => act[name](), { title, key });
    b.id = `do-${name}`;
    actions.append(b);
  }
  const size = slider(words.radius, { min: 1, max: 30, step: 0.5, value: tools.radius }, (r) => { tools.radius = r; });
  const angle = slider(words.angle, { min: 5, max: 80, step: 1, value: tools.angle }, (a) => { tools.angle = a; });
  size.holder.id = "radius";
  angle.holder.id = "angle";
  size.holder.hidden = angle.holder.hidden = true;
  holder.append(group, actions, size.holder, angle.holder);
  holder.setRadius = size.set;
}

function buildSteps() {
  for (const [i, name] of STEPS.entries()) {
    const b = button(`${i + 1} ${words.steps[name]}`, () => step(name));
    b.dataset.step = name;
    $("steps").append(b);
  }
}

function keys(e) {
  if (/^(INPUT|SELECT|TEXTAREA)$/.test(e.target.tagName) && e.target.type !== "range") return;
  if (e.code === "Space" && e.target.tagName !== "BUTTON" && e.target.tagName !== "SUMMARY") { tools.hold(e.type === "keydown"); e.preventDefault(); return; }
  if (e.type !== "keydown" || state.step !== "pieces" || !history || e.altKey) return;
  const key = e.key.toUpperCase();
  if (e.ctrlKey || e.metaKey) {
    if (key === "Z") { e.preventDefault(); (e.shiftKey ? act.redo : act.undo)(); }
    if (key === "Y") { e.preventDefault(); act.redo(); }
    return;
  }
  const tool = Object.entries(words.tools).find(([, [, , k]]) => k === key)?.[0];
  const action = Object.entries(words.actions).find(([, [, , k]]) => k === key)?.[0];
  if (tool) { choose(tool); draw(); }
  else if (action) act[action]();
  else if (e.key === "[" || e.key === "]") { tools.radius = Math.max(1, Math.min(30, tools.radius * (e.key === "]" ? 1.25 : 0.8))); $("tools").setRadius(tools.radius.toFixed(1)); }
}

// The line that lasso and knife draw.
function sketch(points, isClosed = false) {
  const line = $("line");
  const box = $("canvas").getBoundingClientRect();
  line.setAttribute("points", (points ?? []).map(([x, y]) => `${x - box.left},${y - box.top}`).join(" "));
  line.classList.toggle("closed", isClosed);
}

function dropping() {
  addEventListener("dragover", (e) => { e.preventDefault(); document.body.classList.add("dragging"); });
  addEventListener("dragleave", (e) => { if (!e.relatedTarget) document.body.classList.remove("dragging"); });
  addEventListener("drop", (e) => {
    e.preventDefault();
    document.body.classList.remove("dragging");
    const file = e.dataTransfer.files[0];
    if (file) { step("open"); act.open(file); }
  });
}

// A press on the surface, on the key's screen: a ghost is taken, or a key is wanted there.
function keyPresses() {
  const canvas = view.renderer.domElement;
  let [from, at] = [null, null];
  canvas.addEventListener("pointerdown", (e) => {
    from = [e.clientX, e.clientY];
    at = state.step === "key" && e.button === 0 && view.pickKey(e.clientX, e.clientY) >= 0 ? view.pickKey(e.clientX, e.clientY) : null;
    if (at !== null) view.controls.enabled = false;
  }, { capture: true });
  canvas.addEventListener("pointerup", (e) => {
    view.controls.enabled = true;
    if (at === null || !state.judged) return;
    const isDrag = Math.hypot(e.clientX - from[0], e.clientY - from[1]) > 8;
    const hit = isDrag ? view.pick(e.clientX, e.clientY) : null;
    const key = state.judged.keys[at];
    at = null;
    if (isDrag && hit) act.placeKey(hit.at);
    else if (!isDrag && key) act.placeKey(key.at);
  });
}

async function begin() {
  $("kit").title = words.kit.frame;
  try { view = new View($("canvas")); } catch { say(words.noWebGl, true); return; }
  tools = new Tools(view, sketch, () => ({ surface, history, base, piece: state.piece }), {
    changed: (faces) => view.paint(history.labels, faces),
    done: () => { state.isFresh = false; save(); },
    chose: act.chose,
    hint: (text) => say(text),
  });
  buildSteps();
  buildTools();
  keyPresses();
  dropping();
  addEventListener("keydown", keys);
  addEventListener("keyup", keys);
  // Seconds of a job go on between its news.
  setInterval(() => { if (state.job?.state === "running" && state.step === "make") { state.job.seconds += 1; $("sheet").querySelector(".seconds")?.replaceChildren(words.make.took(state.job.seconds)); } }, 1000);
  await guarded(load)();
  if (state.project.model) step(state.job && ["running", "waiting"].includes(state.job.state) ? "make" : "pieces");
  listen(heard);
  document.documentElement.dataset.ready = "";
}

begin();
// For tests that look at pixels and numbers.
window.studio = { state, get view() { return view; }, get history() { return history; }, get surface() { return surface; } };
