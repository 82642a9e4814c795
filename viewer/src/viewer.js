// A page with meshes to look at: together, apart, or arriving one after the other; with lists of facts, checks and notes.

import { Vector3 } from "three";
import { readPage, shades } from "./data.js";
import { Player } from "./motion.js";
import { buildPanel, element } from "./panel.js";
import { Stage } from "./stage.js";
import { Swayer } from "./sway.js";

const FLIGHT_MS = 1100;
const REST_MS = 350;
const LARGE = 5;
const LOAD_AIR = 1.12;
const TURN_MS = 700;
// How far a mesh comes, in sizes of the whole.
const WAY = 0.55;
// What is in place already, while one goes in.
const THERE = [190, 190, 188];
const HOVER_MS = 90;

function start() {
  const { header, meshes, carriers, loads } = readPage(document);
  const holder = document.getElementById("stage");
  let stage;
  try {
    stage = new Stage(holder, meshes, carriers);
  } catch (error) {
    holder.append(element("p", "failure", `This browser cannot show 3D (${error.message}). The lists in the panel still work.`));
  }
  const order = meshes.map((_, i) => i).sort((a, b) => meshes[a].step - meshes[b].step);
  // apart: 0 … 1 · step: how many have arrived, with the share of the one on its way
  const state = { mode: "together", apart: 0.8, step: meshes.length, playing: false, hidden: new Set(), alone: false, chosen: -1, cutAxis: 1, cut: 0, paint: -1, shades: null, turning: false, motion: -1, magnified: false, load: -1, isWeakest: false, numbers: false, measuring: false, measured: [], hovered: -1, seen: -1 };
  const player = new Player(header.motions ?? [], () => update());
  const swayer = new Swayer(loads, () => update());
  const caption = element("p", "caption");
  caption.setAttribute("role", "status");
  const panel = buildPanel(header, meshes, order, {
    mode: (mode) => { setMode(mode); },
    apart: (share) => { state.apart = share; update(); },
    step: (by) => { goTo(Math.ceil(state.step) + by); },
    goTo,
    scrub: (step) => { stop(); enterSteps(); state.step = step; update(); },
    play: () => { state.playing ? stop() : play(); },
    cut: (axis, share) => { Object.assign(state, { cutAxis: axis, cut: share }); stage?.cutAt(axis, share); },
    paint,
    motion,
    magnify,
    load,
    weakest,
    pause: () => { swayer.isPlaying ? swayer.pause() : swayer.play(); update(); },
    amount: (share) => { swayer.show(share); update(); },
    choose,
    toggle: (i) => { state.hidden.has(i) ? state.hidden.delete(i) : state.hidden.add(i); update(); },
    inside,
    numbers: () => { Object.assign(state, { numbers: !state.numbers, seenNumbers: null }); stage?.draw(); update(); },
    measure: () => { Object.assign(state, { measuring: !state.measuring, measured: [] }); stage?.draw(); update(); },
    hover: (i) => { if (state.hovered !== i) { state.hovered = i; update(); } },
    turn: () => { state.turning = !state.turning; stage?.turn(state.turning); update(); },
    alone: () => { state.alone = !state.alone && state.chosen >= 0; update(); },
    showAll: () => { state.hidden.clear(); state.alone = false; choose(-1); },
    home: () => { if (state.isWeakest) stop(); stage?.mark(null); state.note = null; stage?.lookFrom(new Vector3(0.62, -0.95, 0.42)); fit(); },
    note: (note) => { stop(); state.note = note; lookAtNote(); },
  });

  function setMode(mode) {
    stop();
    state.mode = mode;
    if (mode === "steps") state.step = 1;
    fit();
    update();
  }

  const isStill = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

  // Turns to where the mesh that goes in, its place and its way are seen; what is hidden there shows from the other side, too.
  function lookAtStep(i) {
    const look = meshes[i]?.look;
    if (!stage || state.seen === i) return;
    state.seen = i;
    const before = state.below;
    state.below = Boolean(look && look[2] > 0.05);
    state.isTurned = before !== undefined && before !== state.below;
    const there = order.slice(0, order.indexOf(i));
    if (look) stage.turnTo(new Vector3(...look), stage.around(there, i, there.length ? 0.5 * WAY * stage.size : 0), isStill() ? 0 : TURN_MS);
    clearTimeout(state.later);
    state.later = setTimeout(() => {
      const isHidden = state.mode === "steps" && state.seen === i && stage.isHidden(i);
      stage.inset(isHidden ? Math.min(260, 0.3 * holder.clientWidth) : 0, caption.offsetTop + caption.offsetHeight + 8);
    }, isStill() ? 0 : TURN_MS + 60);
  }

  // What to read while a mesh goes in.
  function stepCaption(i) {
    if (i === undefined) return "";
    const { name, step, badge } = meshes[i];
    const what = step === 0 ? `Start with ${name}` : `Slide ${name} in along the arrow${badge ? `: it is the ${badge} and locks all pieces` : ""}`;
    const turn = state.isTurned ? (state.below ? " – turn it over: seen from below" : " – turn it back: seen from above") : state.below ? " – seen from below" : "";
    return `Step ${step + 1} of ${meshes.length}: ${what}${turn}`;
  }

  function fit() {
    stage?.fit(state.mode === "apart" ? state.apart : 0, state.mode === "steps" ? 1.3 : 1);
  }

  // Of two clicks on what shows: how far apart they are.
  function measure({ point }) {
    if (!point) return;
    state.measured = state.measured.length === 2 ? [point] : [...state.measured, point];
    stage.mark(point);
    update();
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
    update();
  }

  // Colours: of a quantity, or its own; grey for what is in place while another goes in.
  function paintAll(flying) {
    const isThere = (i) => state.mode === "steps" && flying !== undefined && i !== flying && meshes[i].look;
    meshes.forEach((m, i) => stage.paint(i, state.shades?.colors[i] ?? (isThere(i) ? THERE : m.color)));
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

  // Shows what a load does, or puts everything back.
  function load(i) {
    if (!stage || !loads[i]) return;
    const isBack = swayer.index === i;
    stop();
    if (!isBack) {
      assemble();
      swayer.choose(i, matchMedia("(prefers-reduced-motion: reduce)").matches);
      stage.sign(swayer.load, swayer.load.moved);
      // Room for arrows, and for what is read above.
      const { place } = swayer.load;
      place ? stage.showPlace(place, stage.center, LOAD_AIR * stage.size) : stage.fit(0, LOAD_AIR);
    }
    update();
  }

  // Shows where it gives way before all else, or no more.
  function weakest() {
    const isBack = state.isWeakest;
    stop();
    if (stage && header.loads?.weakest && !isBack) {
      assemble();
      state.isWeakest = true;
      stage.sign({ place: header.loads.weakest.place });
      const { place } = header.loads.weakest;
      stage.showPlace(place, new Vector3(...place.at), 0.7 * stage.size);
    }
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

  // Steps begin with the first, and go on from where they were.
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
    if (state.isWeakest || swayer.load) { stage?.sign(null); stage?.mark(null); state.note = null; }
    state.isWeakest = false;
    swayer.stop();
    if (state.isFar) { state.isFar = false; fit(); }
    update();
  }

  function update() {
    Object.assign(state, { motion: player.index, load: swayer.index, amount: swayer.amount, swaying: swayer.isPlaying });
    const flying = state.mode === "steps" ? order[Math.ceil(state.step) - 1] : undefined;
    if (stage) {
      paintAll(flying);
      arrange(flying);
      if (flying !== undefined) lookAtStep(flying);
      else if (state.seen >= 0) { Object.assign(state, { seen: -1, below: undefined, isTurned: false }); stage.inset(0); }
    }
    panel.update(state, flying);
    const text = player.caption() || swayer.caption() || (state.measuring ? measureCaption() : "") || stepCaption(flying);
    // Said once, not with every frame.
    if (caption.textContent !== text) caption.textContent = text;
    const { classList } = document.getElementById("tools");
    classList.toggle("loaded", state.load >= 0 || state.isWeakest);
    classList.toggle("stepping", state.mode === "steps");
  }

  function arrange(flying) {
    const travelled = state.step - Math.ceil(state.step) + 1;
    const way = WAY * stage.size;
    const places = player.places();
    meshes.forEach((m, i) => {
      const arrived = state.mode !== "steps" || order.indexOf(i) < Math.ceil(state.step);
      const offset = new Vector3();
      if (state.mode === "apart") offset.set(...m.shift).multiplyScalar(state.apart);
      if (i === flying) offset.set(...m.travel).multiplyScalar(-(1 - eased(travelled)) * way);
      places.has(i) ? stage.pose(i, places.get(i)) : stage.place(i, offset);
      const hidden = !arrived || state.hidden.has(i) || (state.alone && state.chosen !== i);
      stage.show(i, { hidden, faint: places.size > 0 && !places.has(i), lit: (state.chosen === i || state.hovered === i) && !state.alone });
      stage.showWay(i, state.mode === "apart" && !hidden ? offset : null);
    });
    if (flying !== undefined && travelled < 1) stage.showArrow(flying, way);
    else if (state.mode === "together" && state.chosen >= 0 && !state.alone && !places.size && !swayer.load) stage.showArrow(state.chosen, 0.7 * way);
    else stage.arrow.visible = false;
    stage.sway(swayer.load?.moved ?? null, swayer.amount);
  }

  function measureCaption() {
    const [a, b] = state.measured;
    if (b) return `${a.distanceTo(b).toFixed(1)} mm between the two points`;
    return a ? "Click a second point" : "Click two points to measure the distance between them";
  }

  const isShown = (i) => !state.hidden.has(i) && !(state.alone && state.chosen !== i) && (state.mode !== "steps" || order.indexOf(i) < Math.ceil(state.step));

  // Numbers on meshes, the name of what is pointed at, and words at places: of what a load is, and where it gives way.
  function labels() {
    const own = placeLabels();
    if (own.length) return own;
    if (state.measured.length === 2) {
      const [a, b] = state.measured;
      return [{ text: `${a.distanceTo(b).toFixed(1)} mm`, at: a.clone().add(b).multiplyScalar(0.5).toArray() }];
    }
    if (state.numbers && state.seenNumbers) return meshes.map((m, i) => ({ text: m.name.replace(/^\D+/, "") || m.name, at: stage.middle(i).toArray(), i })).filter(({ i }) => isShown(i) && state.seenNumbers.has(i));
    if (state.hovered >= 0 && isShown(state.hovered)) return [{ text: meshes[state.hovered].name, at: stage.middle(state.hovered).toArray() }];
    return [];
  }

  function placeLabels() {
    if (state.isWeakest) return [{ text: header.loads.weakest.place.name, at: header.loads.weakest.place.at }];
    if (state.note?.at) return [{ text: state.note.title, at: state.note.at }];
    const { arrows = [], place = null } = swayer.load ?? {};
    const tail = ({ tip, along }) => tip.map((x, k) => x - 0.17 * stage.size * along[k]);
    const named = arrows.filter((a) => a.name).map((a) => ({ text: a.name, at: tail(a), tip: a.tip }));
    return place ? [{ text: place.name, at: place.at }, ...named] : named;
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
    holder.append(caption);
    const shown = [];
    stage.afterRest = () => {
      if (!state.numbers) return;
      // Of what is seen; what hides it has its own.
      state.seenNumbers = new Set(meshes.map((_, i) => i).filter((i) => isShown(i) && !stage.isHidden(i)));
      stage.afterDraw();
    };
    stage.afterDraw = () => {
      const wanted = labels();
      while (shown.length < wanted.length) { shown.push(element("div", "label")); holder.append(shown.at(-1)); }
      const taken = [];
      const room = { top: caption.offsetHeight ? caption.offsetTop + caption.offsetHeight : 0, right: holder.clientWidth, bottom: holder.clientHeight - tools.offsetHeight - 20 };
      shown.forEach((label, i) => {
        const at = wanted[i] && stage.onScreen(new Vector3(...wanted[i].at));
        label.hidden = !at;
        if (!at) return;
        if (label.textContent !== wanted[i].text) label.textContent = wanted[i].text;
        const tip = wanted[i].tip && stage.onScreen(new Vector3(...wanted[i].tip));
        label.style.transform = `translate(${placed(at, tip, label, room, taken).map((x) => `${x}px`)})`;
      });
    };
    const canvas = holder.querySelector("canvas");
    clicks(canvas, (x, y) => (state.measuring ? measure(stage.hit(x, y)) : choose(stage.pick(x, y))));
    hovers(canvas, (x, y) => {
      const i = x === null ? -1 : stage.pick(x, y);
      if (state.hovered !== i) { state.hovered = i; update(); }
    });
  }
  keys({ next: () => goTo(state.mode === "steps" ? Math.ceil(state.step) + 1 : 1), back: () => goTo(Math.ceil(state.step) - 1), play: () => { if (swayer.load) { swayer.isPlaying ? swayer.pause() : swayer.play(); update(); } else state.playing ? stop() : play(); }, escape: () => { if (player.motion || swayer.load || state.isWeakest) stop(); choose(-1); } });
  fromAddress(location.hash, { panel, state, setMode, update, choose, inside, paint, motion, load: (i) => load(i), weakest, amount: (share) => { swayer.show(share); update(); }, note: (i) => { state.note = header.notes[i]; lookAtNote(); }, cut: (share) => stage?.cutAt(1, share) });
  update();
  document.documentElement.dataset.ready = "true";
}

// Where a label stands: beyond the tail of an arrow; of a place right of it, or left, above or below where there is more room. Over no other label, nor over what is at the top and at the bottom.
function placed([x, y], tip, { offsetWidth: width, offsetHeight: height }, { top, right, bottom }, taken) {
  const inside = ([left, up]) => [Math.min(Math.max(left, 4), right - 4 - width), Math.min(Math.max(up, top + 4), bottom - 4 - height)];
  const overlap = ([left, up]) => taken.some((t) => left < t.left + t.width + 3 && t.left < left + width + 3 && up < t.up + t.height + 3 && t.up < up + height + 3);
  const ways = [[x + 14, y - 0.5 * height], [x - 14 - width, y - 0.5 * height], [x - 0.5 * width, y - 14 - height], [x - 0.5 * width, y + 14]];
  const away = tip ? [x - tip[0], y - tip[1]] : [0, 0];
  const far = Math.hypot(...away);
  if (far > 1) ways.unshift([x + (away[0] / far) * (0.5 * width + 6) - 0.5 * width, y + (away[1] / far) * (0.5 * height + 6) - 0.5 * height]);
  const fits = (way) => inside(way).every((v, k) => Math.abs(v - way[k]) < 1) && !overlap(way);
  const [left, up] = ways.find(fits) ?? ways.slice().reverse().map(inside).find((way) => !overlap(way)) ?? inside(ways[0]);
  taken.push({ left, up, width, height });
  return [left, up];
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

// Where a mouse rests, now and then; null once it leaves or turns the camera.
function hovers(canvas, then) {
  let timer = 0;
  canvas.addEventListener("pointermove", (e) => {
    clearTimeout(timer);
    if (e.pointerType !== "mouse" || e.buttons) return;
    timer = setTimeout(() => then(e.clientX, e.clientY), HOVER_MS);
  });
  canvas.addEventListener("pointerleave", () => { clearTimeout(timer); then(null); });
}

function keys({ next, back, play, escape }) {
  const actions = { ArrowRight: next, ArrowLeft: back, " ": play, Escape: escape };
  addEventListener("keydown", (e) => {
    // A button that has the focus keeps the space bar, and what has a value its arrows.
    const holds = e.key === " " ? /INPUT|BUTTON|SELECT|SUMMARY/ : /INPUT|SELECT/;
    if (holds.test(e.target.tagName) || !actions[e.key]) return;
    e.preventDefault();
    actions[e.key]();
  });
}

// #apart, #apart=0.5, #step=3.4, #choose=2, #inside=2, #cut=0.5, #note=0, #paint=1, #motion=0, #load=0, #load=0&amount=1, #weakest, #numbers, #tab=2 show that view at once: for links and for pictures.
function fromAddress(hash, { state, setMode, update, choose, inside, paint, motion, load, weakest, amount, note, cut, panel }) {
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
    if (key === "load") load(value);
    if (key === "amount") amount(value);
    if (key === "weakest") weakest();
    if (key === "numbers") state.numbers = true;
    if (key === "tab") panel.open(value);
  }
  state.step = Math.min(state.step, document.querySelectorAll(".mesh").length);
  update();
}

start();
