// A page with meshes to look at: together, apart, or arriving one after the other; with lists of facts, checks and notes.

import { Vector3 } from "three";
import { readPage, shades } from "./data.js";
import { Player } from "./motion.js";
import { buildPanel, element } from "./panel.js";
import { Stage } from "./stage.js";

const FLIGHT_MS = 1100;
const REST_MS = 350;
const LARGE = 5;

function start() {
  const { header, meshes } = readPage(document);
  const holder = document.getElementById("stage");
  let stage;
  try {
    stage = new Stage(holder, meshes);
  } catch (error) {
    holder.append(element("p", "failure", `This browser cannot show 3D (${error.message}). The lists beside still hold.`));
  }
  const order = meshes.map((_, i) => i).sort((a, b) => meshes[a].step - meshes[b].step);
  // apart: 0 … 1 · step: how many have arrived, with the share of the one on its way
  const state = { mode: "together", apart: 0.8, step: meshes.length, playing: false, hidden: new Set(), alone: false, chosen: -1, cutAxis: 1, cut: 0, paint: -1, shades: null, turning: false, motion: -1, magnified: false };
  const player = new Player(header.motions ?? [], () => update());
  const caption = element("p", "caption");
  caption.setAttribute("role", "status");
  const panel = buildPanel(header, meshes, order, {
    mode: (mode) => { setMode(mode); },
    apart: (share) => { state.apart = share; update(); },
    step: (by) => { goTo(Math.round(state.step) + by); },
    goTo,
    scrub: (step) => { stop(); enterSteps(); state.step = step; update(); },
    play: () => { state.playing ? stop() : play(); },
    cut: (axis, share) => { Object.assign(state, { cutAxis: axis, cut: share }); stage?.cutAt(axis, share); },
    paint,
    motion,
    magnify,
    choose,
    toggle: (i) => { state.hidden.has(i) ? state.hidden.delete(i) : state.hidden.add(i); update(); },
    inside,
    turn: () => { state.turning = !state.turning; stage?.turn(state.turning); update(); },
    alone: () => { state.alone = !state.alone && state.chosen >= 0; update(); },
    showAll: () => { state.hidden.clear(); state.alone = false; choose(-1); },
    home: () => { stage?.mark(null); state.note = null; stage?.lookFrom(new Vector3(0.62, -0.95, 0.42)); fit(); },
    note: (note) => { state.note = note; lookAtNote(); },
  });

  function setMode(mode) {
    stop();
    state.mode = mode;
    if (mode === "steps") state.step = 1;
    fit();
    update();
  }

  function fit() {
    stage?.fit(state.mode === "apart" ? state.apart : 0, state.mode === "steps" ? 1.3 : 1);
  }

  function choose(i) {
    state.chosen = meshes[i] ? i : -1;
    if (state.chosen < 0) state.alone = false;
    update();
  }

  // The chosen mesh alone, seen from the middle of the scene.
  function inside() {
    stop();
    Object.assign(state, { mode: "together", alone: state.chosen >= 0 });
    if (state.chosen >= 0) stage?.lookFromInside(state.chosen);
    update();
  }

  // By a quantity, or −1: each mesh in its own colour.
  function paint(quantity) {
    const chosen = header.quantities?.[quantity];
    Object.assign(state, { paint: chosen ? quantity : -1, shades: chosen?.values.some((v) => v !== null) ? shades(chosen) : null });
    meshes.forEach((m, i) => stage?.paint(i, state.shades?.colors[i] ?? m.color));
    update();
  }

  // Plays a motion of assembled meshes, or puts them back; shows its next pose instead to who wants no animation.
  function motion(i) {
    if (!stage || !player.motions[i]) return;
    const isStepped = matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (player.index === i) {
      if (!isStepped || !player.step(i)) stop();
      return update();
    }
    stop();
    assemble();
    isStepped ? player.step(i) : player.play(i);
    fitMotion();
    update();
  }

  function assemble() {
    const isWhole = state.mode === "together" && !state.alone;
    Object.assign(state, { mode: "together", alone: false, step: meshes.length });
    // Who looks at a seam from near by wants to see it there.
    if (!isWhole) fit();
  }

  function magnify() {
    state.magnified = !state.magnified;
    player.scale = state.magnified ? LARGE : 1;
    fitMotion();
    update();
  }

  function fitMotion() {
    if (!player.motion) return;
    const isFar = stage.fitMoves(player.motion.moves, player.scale);
    if (state.isFar && !isFar) fit();
    state.isFar = isFar;
  }

  function goTo(step) {
    stop();
    const from = Math.max(0, Math.min(meshes.length, step) - 1);
    const forwards = step > state.step && step <= meshes.length;
    enterSteps();
    if (forwards) fly(from, () => {});
    else { state.step = Math.max(0, Math.min(meshes.length, step)); update(); }
  }

  function enterSteps() {
    if (state.mode === "steps") return;
    state.mode = "steps";
    fit();
  }

  // One mesh comes in: state.step goes from `from` to `from + 1`.
  function fly(from, then) {
    const begin = performance.now();
    const frame = (now) => {
      const share = Math.min(1, Math.max(0, (now - begin) / FLIGHT_MS));
      state.step = from + share;
      update();
      state.flight = share < 1 ? requestAnimationFrame(frame) : (then(), state.flight);
    };
    state.flight = requestAnimationFrame(frame);
  }

  function play() {
    stop();
    enterSteps();
    state.playing = true;
    const next = (from) => {
      if (from >= meshes.length) return stop();
      fly(from, () => { if (state.playing) state.pause = setTimeout(() => next(from + 1), REST_MS); });
    };
    next(state.step >= meshes.length ? 0 : Math.floor(state.step));
    update();
  }

  function stop() {
    cancelAnimationFrame(state.flight);
    clearTimeout(state.pause);
    state.playing = false;
    player.stop();
    if (state.isFar) { state.isFar = false; fit(); }
    update();
  }

  function update() {
    state.motion = player.index;
    const flying = state.mode === "steps" ? order[Math.ceil(state.step) - 1] : undefined;
    if (stage) arrange(flying);
    panel.update(state, flying);
    const text = player.caption();
    // Said once, not with every frame.
    if (caption.textContent !== text) caption.textContent = text;
  }

  function arrange(flying) {
    const travelled = state.step - Math.ceil(state.step) + 1;
    const way = 0.55 * stage.size;
    const places = player.places();
    meshes.forEach((m, i) => {
      const arrived = state.mode !== "steps" || order.indexOf(i) < Math.ceil(state.step);
      const offset = new Vector3();
      if (state.mode === "apart") offset.set(...m.shift).multiplyScalar(state.apart);
      if (i === flying) offset.set(...m.travel).multiplyScalar(-(1 - eased(travelled)) * way);
      places.has(i) ? stage.pose(i, places.get(i)) : stage.place(i, offset);
      const hidden = !arrived || state.hidden.has(i) || (state.alone && state.chosen !== i);
      stage.show(i, { hidden, faint: places.size > 0 && !places.has(i), lit: state.chosen === i && !state.alone });
      stage.showWay(i, state.mode === "apart" && !hidden ? offset : null);
    });
    if (flying !== undefined && travelled < 1) stage.showArrow(flying, way);
    else if (state.mode === "together" && state.chosen >= 0 && !state.alone && !places.size) stage.showArrow(state.chosen, 0.7 * way);
    else stage.arrow.visible = false;
    stage.draw();
  }

  function lookAtNote() {
    if (!state.note?.at || !stage) return;
    const place = new Vector3(...state.note.at);
    stage.mark(place);
    stage.lookAt(place);
  }

  if (stage) {
    const tools = document.getElementById("tools");
    new ResizeObserver(() => stage.leaveRoom(tools.offsetHeight + 16)).observe(tools);
    stage.leaveRoom(tools.offsetHeight + 16);
    fit();
    const label = element("div", "label");
    holder.append(label, caption);
    stage.afterDraw = () => {
      const at = state.note?.at && stage.onScreen(new Vector3(...state.note.at));
      label.hidden = !at;
      if (at) { label.textContent = state.note.title; label.style.transform = `translate(${at[0] + 12}px, ${at[1] - 14}px)`; }
    };
    clicks(holder.querySelector("canvas"), (x, y) => choose(stage.pick(x, y)));
  }
  keys({ next: () => goTo(Math.floor(state.step) + 1), back: () => goTo(Math.ceil(state.step) - 1), play: () => (state.playing ? stop() : play()), escape: () => { if (player.motion) stop(); choose(-1); } });
  fromAddress(location.hash, { state, setMode, update, choose, inside, paint, motion, note: (i) => { state.note = header.notes[i]; lookAtNote(); }, cut: (share) => stage?.cutAt(1, share) });
  update();
  document.documentElement.dataset.ready = "true";
}

const eased = (share) => 1 - (1 - share) ** 3;

// A click is a press that hardly moves: a drag turns the camera.
function clicks(canvas, then) {
  let from = null;
  canvas.addEventListener("pointerdown", (e) => { from = [e.clientX, e.clientY]; });
  canvas.addEventListener("pointerup", (e) => {
    if (from && Math.hypot(e.clientX - from[0], e.clientY - from[1]) < 5) then(e.clientX, e.clientY);
    from = null;
  });
}

function keys({ next, back, play, escape }) {
  const actions = { ArrowRight: next, ArrowLeft: back, " ": play, Escape: escape };
  addEventListener("keydown", (e) => {
    if (/INPUT|BUTTON|SELECT/.test(e.target.tagName) || !actions[e.key]) return;
    e.preventDefault();
    actions[e.key]();
  });
}

// #apart, #apart=0.5, #step=3.4, #choose=2, #inside=2, #cut=0.5, #note=0, #paint=1, #motion=0 show that view at once: for links and for pictures.
function fromAddress(hash, { state, setMode, update, choose, inside, paint, motion, note, cut }) {
  for (const [key, text] of new URLSearchParams(hash.slice(1))) {
    const value = Number(text);
    if (!Number.isFinite(value)) continue;
    if (key === "apart") { setMode("apart"); if (text) state.apart = value; }
    if (key === "step") { setMode("steps"); state.step = Math.max(0, value); }
    if (key === "choose") choose(value);
    if (key === "inside") { choose(value); inside(); }
    if (key === "cut") { state.cut = value; cut(value); }
    if (key === "note") note(value);
    if (key === "paint") paint(value);
    if (key === "motion") motion(value);
  }
  state.step = Math.min(state.step, document.querySelectorAll(".mesh").length);
  update();
}

start();
