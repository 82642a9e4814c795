// A page as the Rust side writes it, with two small meshes: so the viewer can be tested on its own.
import { readFile } from "node:fs/promises";
import { deflateSync } from "node:zlib";

// Coordinates and corners as differences, low bytes before high ones: see src/data.js.
function packed(corners, triangles) {
  const points = corners.map((x, i) => (x - (i < 3 ? 0 : corners[i - 3])) & 65535);
  const turned = [...Array(triangles.length / 3).keys()].map((i) => {
    const t = [...triangles.subarray(3 * i, 3 * i + 3)];
    const lowest = t.indexOf(Math.min(...t));
    return [...t.slice(lowest), ...t.slice(0, lowest)];
  }).sort((s, t) => s[0] - t[0]);
  const differences = turned.flatMap(([a, b, c], i) => [a - (i ? turned[i - 1][0] : 0), b - a, c - a]);
  const planes = (values) => [...[...values].map((v) => v & 255), ...[...values].map((v) => v >> 8)];
  return Uint8Array.from([...planes(points), ...planes(differences)]);
}

function cube(center, half) {
  const corners = [...Array(8).keys()].map((c) => [0, 1, 2].map((a) => (c >> a & 1 ? 65535 : 0)));
  const quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
  const triangles = quads.flatMap(([a, b, c, d]) => [a, b, c, a, c, d]);
  return { corners: Uint16Array.from(corners.flat()), triangles: Uint16Array.from(triangles), min: center.map((x) => x - half), max: center.map((x) => x + half) };
}

// Counts what the canvas shows and clicks through every control.
const CLICKS = `
setTimeout(() => {
  wait(40);
  const canvas = document.querySelector("canvas");
  const copy = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height }).getContext("2d");
  copy.drawImage(canvas, 0, 0);
  const pixels = copy.getImageData(0, 0, canvas.width, canvas.height).data;
  let covered = 0;
  for (let i = 3; i < pixels.length; i += 4) covered += pixels[i] > 127;
  document.documentElement.dataset.covered = (covered / (pixels.length / 4)).toFixed(4);
  for (const b of document.querySelectorAll("button")) b.click();
  const select = document.querySelector(".paint select");
  const dots = () => [...document.querySelectorAll(".mesh .dot")].map((d) => d.style.background).join(" ");
  const painted = ["1", "0", "-1"].map((value) => { select.value = value; select.dispatchEvent(new Event("change")); return dots() + " " + document.querySelector(".legend").textContent; });
  document.documentElement.dataset.painted = painted.join("|");
  for (const key of ["ArrowRight", "ArrowLeft", " ", "Escape"]) dispatchEvent(new KeyboardEvent("keydown", { key }));
  const scrub = document.querySelector(".steps input");
  const moments = ["0.5", "1.25", "2"].map((value) => { scrub.value = value; scrub.dispatchEvent(new Event("input")); return document.querySelector(".steps .count").textContent; });
  document.documentElement.dataset.moments = moments.join("|");
  document.documentElement.dataset.clicked = document.querySelectorAll("button").length;
}, 1500);`;

const CLOCK = `
// Frames come when the script says so: a browser without a window draws few of them, and when it likes.
let [clock, id] = [performance.now(), 0];
const later = (then) => setTimeout(then, 1000);
const asked = new Map();
performance.now = () => clock;
window.requestAnimationFrame = (then) => (asked.set(++id, then), id);
window.cancelAnimationFrame = (i) => asked.delete(i);
const wait = (ms) => {
  for (const end = clock + ms; clock < end;) {
    clock += 20;
    const frame = [...asked.values()];
    asked.clear();
    for (const then of frame) then(clock);
  }
};`;

// Plays the first motion, large and as it is, and puts it back; says where the second mesh is, and what shows besides.
const MOTIONS = `
const [first, second, large] = document.querySelectorAll(".motions button");
const moments = [];
const note = (name) => {
  scene.updateMatrixWorld();
  const [still, moving] = scene.children.filter((c) => c.type === "Group");
  const opacity = (group) => group.children[0].material.opacity;
  moments.push({
    name, matrix: [...moving.matrixWorld.elements], still: [...still.matrixWorld.elements], faint: [opacity(still), opacity(moving)],
    caption: document.querySelector(".caption").textContent, pressed: [first, second, large].map((b) => b.getAttribute("aria-pressed")),
    isAssembled: document.querySelector(".modes button").getAttribute("aria-pressed"), label: first.getAttribute("aria-label"),
  });
};
later(() => {
  note("before");
  document.querySelectorAll(".modes button")[1].click();
  note("apart");
  first.click();
  wait(300);
  note("under way");
  wait(2200);
  note("end");
  large.click();
  note("large");
  large.click();
  first.click();
  note("back");
  second.click();
  wait(900);
  note("loop");
  wait(900);
  note("loop later");
  dispatchEvent(new KeyboardEvent("keydown", { key: "Escape" }));
  note("escaped");
  document.documentElement.dataset.moments = btoa(JSON.stringify(moments));
});`;

// The same where people want no animation: each click shows the next pose.
const STEPS = `${MOTIONS.split("later(() => {")[0]}
later(() => {
  for (const name of ["first", "second", "back"]) { first.click(); note(name); }
  document.documentElement.dataset.moments = btoa(JSON.stringify(moments));
});`;

// Chooses loads by pointer and keyboard; says where the first point of each mesh is, and what shows besides.
const LOADS = `const [press, nothing] = document.querySelectorAll(".loads button");
const weakest = document.querySelector(".weakest");
const sway = document.querySelector(".sway");
const moments = [];
const note = (name) => {
  const groups = scene.children.filter((c) => c.type === "Group");
  const at = (group) => [...group.children[0].geometry.attributes.position.array.slice(0, 3)];
  const signs = groups.filter((g) => g.visible).flatMap((g) => g.children).filter((c) => c.type === "Group" && c.visible || c.geometry?.type === "TubeGeometry" || c.geometry?.type === "CircleGeometry");
  moments.push({
    name, points: groups.slice(0, 2).map(at), signs: signs.map((c) => c.geometry?.type ?? "Arrow").sort(), caption: document.querySelector(".caption").textContent,
    pressed: [press, nothing, weakest].map((b) => b.getAttribute("aria-pressed")), hasSlider: !sway.hidden, amount: Number(sway.querySelector("input").value), isPlaying: sway.querySelector("button").textContent === "❚❚",
    labels: [...document.querySelectorAll(".label")].filter((l) => !l.hidden).map((l) => l.textContent),
  });
};
const key = (name) => dispatchEvent(new KeyboardEvent("keydown", { key: name }));
later(() => {
  wait(40);
  note("before");
  document.querySelectorAll(".modes button")[1].click();
  press.click();
  wait(1720);
  note("full");
  wait(1680);
  note("back at rest");
  key(" ");
  wait(400);
  note("paused");
  const slider = sway.querySelector("input");
  slider.value = "0.5";
  slider.dispatchEvent(new Event("input"));
  wait(400);
  note("half");
  nothing.click();
  wait(1720);
  note("nothing");
  key("Escape");
  wait(40);
  note("escaped");
  weakest.click();
  wait(40);
  note("weakest");
  document.querySelectorAll(".modes button")[2].click();
  wait(40);
  note("steps");
  document.documentElement.dataset.moments = btoa(JSON.stringify(moments));
});`;

// Goes through the steps without a clock, then numbers, measures and points at a row.
const WALK = `const buttons = (text) => [...document.querySelectorAll("button")].find((b) => b.textContent === text);
const camera = () => { scene.updateMatrixWorld(); return scene.children.find((c) => c.isCamera); };
const look = () => { const e = camera().matrixWorld.elements; return [-e[8], -e[9], -e[10]]; };
const colors = () => scene.children.filter((c) => c.type === "Group").slice(0, 2).map((g) => g.children[0].material.color.toArray());
const caption = () => document.querySelector(".caption").textContent;
const labels = () => [...document.querySelectorAll(".label")].filter((l) => !l.hidden).map((l) => l.textContent);
later(() => {
  const steps = [];
  const step = () => { wait(3000); steps.push({ look: look(), caption: caption(), colors: colors() }); };
  buttons("Step by step").click();
  step();
  dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
  step();
  buttons("Assembled").click();
  buttons("Reset").click();
  buttons("Numbers").click();
  wait(400);
  // Numbers come once nothing moves.
  const until = (left) => setTimeout(() => { wait(40); labels().length || !left ? go() : until(left - 1); }, 200);
  until(20);
  const go = () => {
    const numbers = labels().sort();
    buttons("Numbers").click();
    buttons("Measure").click();
    const canvas = document.querySelector("canvas");
    const box = canvas.getBoundingClientRect();
    const press = (...place) => {
      const at = camera().position.clone().set(...place).project(camera());
      const where = { clientX: box.left + ((at.x + 1) / 2) * box.width, clientY: box.top + ((1 - at.y) / 2) * box.height };
      for (const type of ["pointerdown", "pointerup"]) canvas.dispatchEvent(new PointerEvent(type, { ...where, pointerId: 1, isPrimary: true }));
    };
    // The middles of the cubes' front faces.
    press(-6, -5, 5);
    press(6, -5, 5);
    wait(40);
    const measured = caption();
    const row = document.querySelector(".mesh");
    row.dispatchEvent(new PointerEvent("pointerenter"));
    const sheets = [...document.querySelectorAll(".tabs button")].map((b) => { b.click(); return b.textContent; });
    document.documentElement.dataset.walk = btoa(encodeURIComponent(JSON.stringify({ steps, numbers, measured, hovered: row.className, sheets })));
  };
});`;

export const scripts = { walk: WALK, clicks: CLICKS, motions: MOTIONS, steps: STEPS, loads: LOADS };

// Mesh 1 goes down, by 0.5 mm, seen four times as far.
function sampleLoads(meshes, add) {
  const moved = (z) => meshes.map((_, i) => ({ offset: add(Int16Array.from({ length: 24 }, (_, k) => (i === 1 && k % 3 === 2 ? z : 0))), count: 8 }));
  const place = { name: "opens here <b>", at: [1, 0, 5], lines: [[[1, -5, 5], [1, 0, 6], [1, 5, 5]]], mesh: 1 };
  const load = { name: "pressed <b>", figure: "70 N", title: "Pressed <b>", arrows: [{ name: "70 N", tip: [6, 0, 10], along: [0, 0, -1] }], floor: [[0, 0, 0], [0, 0, 1]], place, scale: 4, step_mm: 0.001, moved: moved(-500) };
  const nothing = { name: "held", figure: "more than 9 N", title: "Nothing gives way", arrows: [], floor: null, place: null, scale: 1, step_mm: 0, moved: moved(0) };
  const carriers = meshes.map(({ carrier }) => carrier);
  return { title: "Loads it can take", note: "By simulation.", carriers, loads: [load, nothing], weakest: { text: "pressed: it opens", place } };
}

export async function samplePage({ motions, hasLoads = false, script = CLICKS } = {}) {
  const parts = [];
  let offset = 0;
  const add = (array) => {
    const at = offset;
    const bytes = Buffer.alloc(Math.ceil(array.byteLength / 4) * 4);
    Buffer.from(array.buffer).copy(bytes);
    parts.push(bytes);
    offset += bytes.length;
    return at;
  };
  const meshes = [[-6, 0, 5], [6, 0, 5]].map((center, i) => {
    const { corners, triangles, min, max } = cube(center, 5);
    return {
      name: `mesh ${i} <b>`, badge: i ? "last" : null, color: [60 + 120 * i, 120, 200 - 120 * i], step: i,
      travel: [i ? -1 : 1, 0, 0], shift: [i ? 8 : -8, 0, 0], facts: [["Side", "10 mm"]],
      look: [0, 1, i ? 0.5 : -0.5], packed: { offset: add(packed(corners, triangles)), points: 8, triangles: 12, bytes: 2, min, max },
      carrier: hasLoads && { points: { offset: add(corners), count: 8, min, max }, triangles: { offset: add(triangles), count: 12, bytes: 2 } },
    };
  });
  const header = {
    title: "Two cubes </script>", meshes_title: "Meshes", meshes, facts: [["Count", "2"]],
    checks: [{ name: "closed", ok: true, figure: "2 of 2" }, { name: "apart", ok: false, figure: "2 mm" }],
    notes: [{ severity: "problem", title: "corner", text: "look here", at: [11, 5, 10] }, { title: "general", text: "no place", at: null }],
    quantities: [{ name: "size <i>", unit: "mm", values: [10, null] }, { name: "nothing", unit: "", values: [null, null] }],
    motions,
    tabs: [{ name: "Print <b>", parts: [{ table: ["Plates, time and material", [["plates", "2"]]] }, { text: ["Slicer settings", ["one", "two"]] }, { files: ["Files", [["a b.3mf", "all"]]] }] }],
    loads: hasLoads ? sampleLoads(meshes, add) : undefined,
  };
  const dist = (name) => readFile(new URL(`../../crates/render/viewer/${name}`, import.meta.url), "utf8");
  return `<!doctype html><meta charset="utf-8"><title>t</title><style>${await dist("viewer.css")}</style>
<main id="view"><div id="stage"></div><div id="tools"></div></main><aside id="panel"></aside>
<script type="application/json" id="header">${JSON.stringify(header).replaceAll("<", "\\u003c")}</script>
<script type="text/plain" id="arrays">${deflateSync(Buffer.concat(parts)).toString("base64")}</script>
<script>
addEventListener("error", (e) => { document.documentElement.dataset.error = e.message; });
// three tells who listens here of its scene.
let scene;
window.__THREE_DEVTOOLS__ = new EventTarget();
__THREE_DEVTOOLS__.addEventListener("observe", ({ detail }) => { if (detail.isScene) scene = detail; });
const say = console.error; console.error = (...a) => { document.documentElement.dataset.error = a.join(" "); say(...a); };
</script>
<script>${CLOCK}</script>
<script>${await dist("viewer.js")}</script>
<script>${script}</script>`;
}
