import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import test from "node:test";
import { bundle, studio } from "../build.js";
import { shaded, shades } from "../src/data.js";
import { duration, momentAt, Player, poseAt } from "../src/motion.js";
import { poseMatrix } from "../src/stage.js";
import { beatAt, carriedBy, carriedMoves, nearestOn } from "../src/sway.js";
import { samplePage, scripts } from "./page.js";

/** SHELLOCK_CHROMIUM, or chromium on the path; undefined where neither runs. */
const browser = [process.env.SHELLOCK_CHROMIUM, "chromium"].find((b) => b && spawnSync(b, ["--version"]).status === 0);
const withoutBrowser = browser ? false : "NOT TESTED IN A BROWSER: set SHELLOCK_CHROMIUM or install chromium";
if (withoutBrowser) console.warn(`\n*** ${withoutBrowser} ***\n`);

test("the committed bundle is what the sources give", async () => {
  for (const file of [...(await bundle()), ...(await studio())]) {
    assert.equal(await readFile(file.path, "utf8"), file.text, `${file.path} is stale: npm run build`);
  }
});

test("normals break at right angles and are smooth on a plane", () => {
  // Two triangles in z = 0 and one that stands on their common border.
  const positions = Float32Array.of(0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1);
  const { points, normals, indices } = shaded(positions, Uint16Array.of(0, 1, 2, 0, 2, 3, 1, 0, 4));
  const at = (array, corner) => [...array.subarray(3 * indices[corner], 3 * indices[corner] + 3)];
  assert.equal(points.length, 3 * 7, "the two points of the crease are there twice, the others once");
  assert.deepEqual([0, 2, 6, 7].map((corner) => at(points, corner)), [[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 0, 0]]);
  assert.deepEqual(at(normals, 0), [0, 0, 1]);
  assert.deepEqual(at(normals, 6).map(Math.abs), [0, 1, 0]);
});

test("shades go from the least value to the greatest and leave out what has none", () => {
  const { low, high, hasGaps, colors } = shades({ values: [2, null, 1, 3] });
  assert.deepEqual([low, high, hasGaps], [1, 3, true]);
  const light = colors.map(([r, g, b]) => 0.2126 * r + 0.7152 * g + 0.0722 * b);
  assert.ok(light[2] < light[0] && light[0] < light[3], "lightness follows the value");
  assert.ok(Math.max(...colors[1]) - Math.min(...colors[1]) < 16, "no value is grey");
  assert.ok(shades({ values: [5, 5] }).colors.flat().every(Number.isFinite));
});

/** Opens a page in the browser and gives its text once its script is done, and what it says of itself. */
async function opened(text, ...flags) {
  const folder = await mkdtemp(join(tmpdir(), "viewer-"));
  try {
    const page = join(folder, "page.html");
    await writeFile(page, text);
    const all = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", ...flags];
    all.push("--window-size=900,600", "--virtual-time-budget=8000", `--user-data-dir=${folder}/profile`, "--dump-dom");
    const dom = execFileSync(browser, [...all, `file://${page}`], { encoding: "utf8", stdio: ["ignore", "pipe", "ignore"], maxBuffer: 1e8, timeout: 120_000 });
    const data = (name) => dom.match(new RegExp(`<html[^>]* data-${name}="([^"]*)"`))?.[1];
    assert.equal(data("error"), undefined);
    assert.equal(data("ready"), "true");
    return { dom, data };
  } finally {
    await rm(folder, { recursive: true, force: true, maxRetries: 5 });
  }
}

test("the page draws, answers every control and reports no error", { skip: withoutBrowser }, async () => {
  const { dom, data } = await opened(await samplePage());
  assert.ok(Number(data("covered")) > 0.05, `the canvas is blank: ${data("covered")} of it is covered`);
  assert.ok(Number(data("clicked")) > 10);
  const own = "rgb(60, 120, 200) rgb(180, 120, 80)";
  const [nothing, size, back] = data("painted").split("|").map((text) => text.trim());
  assert.ok(nothing.startsWith(own) && back.startsWith(own));
  assert.match(size, /^rgb\(96, 80, 160\) rgb\(150, 147, 156\) 10\.0010\.00 mmgrey: no value$/);
  assert.deepEqual(data("moments").replaceAll("&lt;", "<").replaceAll("&gt;", ">").split("|"), ["1 / 2  mesh 0 <b>", "2 / 2  mesh 1 <b>", "2 / 2  mesh 1 <b>"]);
  assert.match(dom, /<h1>Two cubes &lt;\/script&gt;<\/h1>/);
  assert.ok(!dom.includes('class="modes motions"'), "no motions, no buttons");
  assert.ok(!dom.includes('class="loads"'), "no loads, no list");
});

const REST = [0, 0, 0, 0, 0, 0];
const OUT = { name: "take out", title: "How it comes out <b>.", is_loop: false, moves: [{ mesh: 1, about: [6, 0, 5], poses: [REST, [1, 0, 0, 0, 0, 0], [2, 0, 1, 0, 0, 0.1]] }] };
const SHAKE = { name: "shake", title: "How it rattles.", is_loop: true, moves: [{ mesh: 1, about: [6, 0, 5], poses: [[0.1, 0, 0, 0, 0, 0], [-0.1, 0, 0, 0, 0, 0]] }] };

test("motions go evenly from pose to pose, loops back to the first", () => {
  assert.equal(duration(SHAKE), 2.4);
  assert.equal(duration(OUT), 2.4);
  assert.equal(duration({ moves: [{ poses: Array(40).fill(REST) }], is_loop: true }), 6);
  assert.deepEqual(poseAt(OUT.moves[0], 0.75, false), [1.5, 0, 0.5, 0, 0, 0.05]);
  assert.deepEqual(poseAt(OUT.moves[0], 1, false), OUT.moves[0].poses[2]);
  assert.ok(Math.abs(poseAt(SHAKE.moves[0], 0.75, true)[0]) < 1e-12, "half the way back to the first");
  assert.deepEqual(momentAt(SHAKE, 0.3), { share: 0, part: 0.25, isOver: false }, "from the assembled pose to the first");
  assert.equal(momentAt(SHAKE, 1.2 + 2.4 + 0.6).share.toFixed(6), "0.250000");
  assert.deepEqual(momentAt(OUT, 9), { share: 1, part: 1, isOver: true });
});

test("motions of one pose or of none move nothing they should not", () => {
  for (const poses of [[], [REST], [[1, 0, 0, 0, 0, 0]]]) {
    for (const is_loop of [true, false]) {
      const player = new Player([{ name: "", title: "", is_loop, moves: [{ mesh: 0, about: [0, 0, 0], poses }] }], () => {});
      player.step(0);
      assert.deepEqual(player.places().get(0).pose, poses[0] ?? REST);
      const { share, part } = momentAt(player.motion, 2);
      assert.ok(share >= 0 && share <= 1 && part === 1);
    }
  }
});

test("a pose displaces its point and turns about it", () => {
  const m = poseMatrix([6, 0, 5], [1, 2, 3, 0, 0, Math.PI / 2]);
  const at = (x, y, z) => [0, 1, 2].map((k) => +(m.elements[k] * x + m.elements[4 + k] * y + m.elements[8 + k] * z + m.elements[12 + k]).toFixed(9));
  assert.deepEqual(at(6, 0, 5), [7, 2, 8]);
  assert.deepEqual(at(7, 0, 5), [7, 3, 8], "x turns towards y");
});

/** What the page noted of its moments, by name. */
const moments = (data) => Object.fromEntries(JSON.parse(atob(data("moments"))).map((m) => [m.name, m]));
const isClose = (a, b) => a.every((x, i) => Math.abs(x - b[i]) < 1e-6);
const posed = (pose, scale) => poseMatrix([6, 0, 5], pose.map((x) => scale * x)).elements;
const ASSEMBLED = posed(REST, 1);

test("a motion plays, shows five times as large, and is put back", { skip: withoutBrowser }, async () => {
  const { dom, data } = await opened(await samplePage({ motions: [OUT, SHAKE], script: scripts.motions }));
  const m = moments(data);
  assert.ok(isClose(m.before.matrix, ASSEMBLED) && !isClose(m.apart.matrix, ASSEMBLED));
  assert.equal(m.before.label, OUT.title);
  const way = m["under way"];
  assert.ok(Math.abs(way.matrix[12] - 0.25) < 0.02, `a quarter of the first way: ${way.matrix[12]}`);
  assert.ok(isClose(way.still, ASSEMBLED), "the motion starts from what is assembled");
  assert.deepEqual([way.isAssembled, way.pressed, way.caption], ["true", ["true", "false", "false"], OUT.title]);
  assert.ok(way.faint[0] < 0.6 && way.faint[1] === 1, "what moves is seen through what stays");
  assert.ok(isClose(m.end.matrix, posed(OUT.moves[0].poses[2], 1)));
  assert.ok(isClose(m.large.matrix, posed(OUT.moves[0].poses[2], 5)));
  assert.deepEqual([m.large.pressed, m.large.caption], [["true", "false", "true"], `${OUT.title} (shown 5 times larger)`]);
  for (const back of [m.back, m.escaped]) {
    assert.ok(isClose(back.matrix, ASSEMBLED));
    assert.deepEqual([back.pressed, back.caption, back.faint], [["false", "false", "false"], "", [1, 1]]);
  }
  assert.ok(!isClose(m.loop.matrix, ASSEMBLED) && !isClose(m.loop.matrix, m["loop later"].matrix), "a loop goes on");
  assert.ok(!dom.includes("<b>"), "text stays text");
});

test("who wants no animation sees pose after pose", { skip: withoutBrowser }, async () => {
  const { data } = await opened(await samplePage({ motions: [OUT, SHAKE], script: scripts.steps }), "--force-prefers-reduced-motion");
  const m = moments(data);
  assert.ok(isClose(m.first.matrix, posed(OUT.moves[0].poses[1], 1)) && isClose(m.second.matrix, posed(OUT.moves[0].poses[2], 1)));
  assert.equal(m.second.caption, `${OUT.title} (pose 3 of 3)`);
  assert.ok(isClose(m.back.matrix, ASSEMBLED));
  assert.deepEqual(m.back.pressed, ["false", "false", "false"]);
});

test("the nearest point of a triangle is inside it, on an edge or a corner", () => {
  const [a, b, c] = [[0, 0, 0], [4, 0, 0], [0, 4, 0]];
  for (const [p, u, v, distance] of [[[1, 1, 3], 0.25, 0.25, 9], [[-1, -1, 0], 0, 0, 2], [[6, 0, 0], 1, 0, 4], [[2, -3, 0], 0.5, 0, 9], [[4, 4, 0], 0.5, 0.5, 8], [[0, 9, 0], 0, 1, 25], [[-2, 1, 0], 0, 0.25, 4]]) {
    assert.deepEqual(nearestOn(a, b, c, p), { u, v, distance }, `${p}`);
  }
  assert.equal(nearestOn(a, a, a, [0, 0, 2]).distance, 4, "a triangle without area is a point");
});

test("points go with a carrier as a rigid body does, and with what is nearest to them", () => {
  const carrier = { positions: Float32Array.of(0, 0, 0, 4, 0, 0, 0, 4, 0, 4, 4, 0), indices: Uint16Array.of(0, 1, 2, 1, 3, 2) };
  const points = Float32Array.of(1, 1, 0.5, 3, 3, -1, 9, 9, 0);
  const bound = carriedBy(carrier, points);
  const shifted = carriedMoves(bound, Float32Array.from({ length: 12 }, (_, k) => [1, 2, 3][k % 3]));
  assert.deepEqual([...shifted], [1, 2, 3, 1, 2, 3, 1, 2, 3]);
  // Only the last corner moves: it takes along what is near it.
  const lifted = carriedMoves(bound, Float32Array.of(0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 8));
  assert.deepEqual([lifted[2], lifted[5], lifted[8]], [0, 4, 8]);
  assert.equal(carriedBy({ positions: new Float32Array(), indices: new Uint16Array() }, points), null);
});

test("a load comes and goes smoothly", () => {
  assert.deepEqual([0, 1.7, 3.4].map((s) => +beatAt(s).toFixed(12)), [0, 1, 0]);
  assert.ok(beatAt(0.05) < 0.005 && Math.abs(beatAt(0.85) - 0.5) < 1e-12);
});

const near = (points, expected) => points.flat().every((x, k) => Math.abs(x - expected.flat()[k]) < 0.02);

test("choosing a load moves points, tells the factor and shows where it acts", { skip: withoutBrowser }, async () => {
  const { dom, data } = await opened(await samplePage({ hasLoads: true, script: scripts.loads }));
  const m = moments(data);
  const rest = m.before.points;
  const down = (mm) => [rest[0], [rest[1][0], rest[1][1], rest[1][2] - mm]];
  assert.deepEqual([m.before.hasSlider, m.before.signs, m.before.labels], [false, [], []]);
  assert.ok(near(m.full.points, down(2)), `0.5 mm, four times: ${m.full.points}`);
  assert.equal(m.full.caption, "Pressed <b> (exaggerated 4 times)");
  assert.deepEqual(m.full.signs, ["Arrow", "CircleGeometry", "TubeGeometry", "TubeGeometry"]);
  assert.deepEqual([m.full.pressed, m.full.labels, m.full.hasSlider, m.full.isPlaying], [["true", "false", "false"], ["opens here <b>", "70 N"], true, true]);
  assert.ok(near(m["back at rest"].points, rest));
  assert.deepEqual([m.paused.isPlaying, near(m.paused.points, m["back at rest"].points)], [false, true], "space pauses");
  assert.ok(near(m.half.points, down(1)) && m.half.amount === 0.5 && !m.half.isPlaying);
  assert.ok(near(m.nothing.points, rest));
  assert.deepEqual([m.nothing.caption, m.nothing.signs, m.nothing.labels, m.nothing.pressed], ["Nothing gives way", [], [], ["false", "true", "false"]]);
  for (const back of [m.escaped, m.steps]) {
    assert.ok(near(back.points, rest));
    assert.deepEqual([back.signs, back.labels, back.hasSlider, back.pressed], [[], [], false, ["false", "false", "false"]]);
  }
  assert.deepEqual([m.escaped.caption, m.steps.caption], ["", "Step 1 of 2: Start with mesh 0 <b>"]);
  assert.deepEqual([m.weakest.signs, m.weakest.labels, m.weakest.pressed], [["TubeGeometry", "TubeGeometry"], ["opens here <b>"], ["false", "false", "true"]]);
  assert.ok(!dom.includes("<b>"), "text stays text");
});

test("who wants no animation sees a load at its full, still, and has the slider", { skip: withoutBrowser }, async () => {
  const { data } = await opened(await samplePage({ hasLoads: true, script: scripts.loads }), "--force-prefers-reduced-motion");
  const m = moments(data);
  const [still, [x, y, z]] = m.before.points;
  const full = [still, [x, y, z - 2]];
  assert.ok(near(m.full.points, full) && near(m["back at rest"].points, full), "nothing moves by itself");
  assert.deepEqual([m.full.isPlaying, m.full.amount, m.full.caption], [false, 1, "Pressed <b> (exaggerated 4 times)"]);
  assert.ok(near(m.half.points, [still, [x, y, z - 1]]));
});

test("a step turns the camera to where it is seen, in grey what is there; numbers, names and places are told", { skip: withoutBrowser }, async () => {
  const { dom, data } = await opened(await samplePage({ script: scripts.walk }));
  const { steps, numbers, measured, hovered, sheets } = JSON.parse(decodeURIComponent(atob(data("walk"))));
  // mesh 0 is looked at from above, mesh 1 from below: [0, 1, ∓0.5].
  const close = (a, b) => a.every((x, k) => Math.abs(x - b[k]) < 0.02);
  const unit = (v) => v.map((x) => x / Math.hypot(...v));
  assert.ok(close(steps[0].look, unit([0, 1, -0.5])) && close(steps[1].look, unit([0, 1, 0.5])), JSON.stringify(steps));
  assert.deepEqual(steps.map((s) => s.caption), ["Step 1 of 2: Start with mesh 0 <b>", "Step 2 of 2: Slide mesh 1 <b> in along the arrow: it is the last and locks all pieces – turn it over: seen from below"]);
  const [red, green, blue] = steps[1].colors[0];
  assert.ok(Math.abs(red - green) < 0.02 && Math.abs(green - blue) < 0.03, "what is there is grey");
  assert.deepEqual(numbers, ["0 <b>", "1 <b>"]);
  assert.match(measured, /^1[12]\.\d mm between the two points$/, "12 mm, as near as a pixel is");
  assert.equal(hovered, "mesh hovered");
  assert.deepEqual(sheets, ["Meshes", "Print <b>", "Checks"]);
  assert.match(dom, /<a href="a%20b.3mf" download="">a b.3mf<\/a>/);
});
