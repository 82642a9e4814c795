import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import test from "node:test";
import { bundle } from "../build.js";
import { shaded, shades } from "../src/data.js";
import { samplePage } from "./page.js";

/** SHELLOCK_CHROMIUM, or chromium on the path; undefined where neither runs. */
const browser = [process.env.SHELLOCK_CHROMIUM, "chromium"].find((b) => b && spawnSync(b, ["--version"]).status === 0);
const withoutBrowser = browser ? false : "NOT TESTED IN A BROWSER: set SHELLOCK_CHROMIUM or install chromium";
if (withoutBrowser) console.warn(`\n*** ${withoutBrowser} ***\n`);

test("the committed bundle is what the sources give", async () => {
  for (const file of await bundle()) {
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

test("the page draws, answers every control and reports no error", { skip: withoutBrowser }, async () => {
  const folder = await mkdtemp(join(tmpdir(), "viewer-"));
  try {
    const page = join(folder, "page.html");
    await writeFile(page, await samplePage());
    const flags = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
    flags.push("--window-size=900,600", "--virtual-time-budget=8000", `--user-data-dir=${folder}/profile`, "--dump-dom");
    const dom = execFileSync(browser, [...flags, `file://${page}`], { encoding: "utf8", stdio: ["ignore", "pipe", "ignore"], maxBuffer: 1e8, timeout: 120_000 });
    const data = (name) => dom.match(new RegExp(`<html[^>]* data-${name}="([^"]*)"`))?.[1];
    assert.equal(data("error"), undefined);
    assert.equal(data("ready"), "true");
    assert.ok(Number(data("covered")) > 0.05, `the canvas is blank: ${data("covered")} of it is covered`);
    assert.ok(Number(data("clicked")) > 10);
    const own = "rgb(60, 120, 200) rgb(180, 120, 80)";
    const [nothing, size, back] = data("painted").split("|").map((text) => text.trim());
    assert.ok(nothing.startsWith(own) && back.startsWith(own));
    assert.match(size, /^rgb\(96, 80, 160\) rgb\(150, 147, 156\) 10\.0010\.00 mmgrey: none$/);
    assert.deepEqual(data("moments").replaceAll("&lt;", "<").replaceAll("&gt;", ">").split("|"), ["1 / 2  mesh 0 <b>", "2 / 2  mesh 1 <b>", "2 / 2  mesh 1 <b>"]);
    assert.match(dom, /<h1>Two cubes &lt;\/script&gt;<\/h1>/);
  } finally {
    await rm(folder, { recursive: true, force: true, maxRetries: 5 });
  }
});
