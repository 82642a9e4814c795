import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import test from "node:test";
import { bundle } from "../build.js";
import { shadedCorners } from "../src/data.js";
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
  const { normals } = shadedCorners(positions, Uint16Array.of(0, 1, 2, 0, 2, 3, 1, 0, 4));
  assert.deepEqual([...normals.subarray(0, 3)], [0, 0, 1]);
  assert.deepEqual([...normals.subarray(18, 21)].map(Math.round), [0, 1, 0].map((x, i) => normals[18 + i] < 0 ? -x : x));
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
    assert.match(dom, /<h1>Two cubes &lt;\/script&gt;<\/h1>/);
  } finally {
    await rm(folder, { recursive: true, force: true, maxRetries: 5 });
  }
});
