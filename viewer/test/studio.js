// The studio, from an empty folder to a kit, in a real browser and through the real server.
//
//   node test/studio.js SHELLOCK SHELLOCK-CHECK PICTURES
//
// Two figures: opened, divided, painted, merged, cut, mended, key placed, made, taken home. Then what should not work: strangers, garbage, files
// that are too large, a server that goes away.
import assert from "node:assert/strict";
import { execFileSync, spawn, spawnSync } from "node:child_process";
import { mkdir, mkdtemp, readFile, readdir, rm, writeFile } from "node:fs/promises";
import http from "node:http";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import puppeteer from "puppeteer-core";

const [program, checker, pictures] = process.argv.slice(2).map((p) => resolve(p));
const executablePath = process.env.SHELLOCK_CHROMIUM ?? "/usr/bin/chromium";
const rest = (ms) => new Promise((done) => setTimeout(done, ms));
const MAKING_MS = 150_000;

const work = await mkdtemp(join(tmpdir(), "studio-"));
await mkdir(pictures, { recursive: true });
const browser = await puppeteer.launch({ executablePath, protocolTimeout: 2 * MAKING_MS, args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"] });
let served = [];

/** A server of its own for the project in `folder`: its address, port and token. */
async function serve(folder, ...more) {
  const server = spawn(program, ["studio", ...more, "--project", folder, "--no-open", "--json"], { cwd: work });
  served.push(server);
  const line = await new Promise((done, fail) => { server.stdout.once("data", done); server.once("exit", (code) => fail(new Error(`the studio ended with ${code}`))); });
  const { address } = JSON.parse(line);
  const url = new URL(address);
  return { server, address, port: url.port, token: url.searchParams.get("token") };
}

async function pageAt(address, size = { width: 1440, height: 900 }) {
  const page = await browser.newPage();
  page.faults = [];
  page.on("console", (m) => page.faults.push(m.text()));
  page.on("pageerror", (e) => page.faults.push(e.message));
  page.on("request", (r) => { if (!r.url().startsWith(new URL(address).origin) && !/^(data|blob):/.test(r.url())) page.faults.push(`asks for ${r.url()}`); });
  await page.setViewport(size);
  await page.goto(address);
  await page.waitForSelector("html[data-ready]", { timeout: 60_000 });
  return page;
}

const press = async (page, text) => {
  const found = await page.evaluate((t) => { const b = [...document.querySelectorAll("button")].find((x) => x.textContent === t && x.offsetParent); b?.click(); return Boolean(b); }, text);
  assert.ok(found, `there is a button "${text}"`);
};
async function settled(page) {
  const isSettled = () => window.studio.history && !window.studio.state.isJudging && window.studio.state.judged;
  await page.waitForFunction(isSettled, { timeout: 60_000 }).catch(async () => {
    const { judged, ...state } = await page.evaluate(() => window.studio.state);
    assert.fail(`no verdict: ${JSON.stringify({ ...state, options: undefined, hasVerdict: Boolean(judged) })}; ${page.faults.join("; ")}`);
  });
}
const shot = async (page, name) => { await rest(400); await page.screenshot({ path: join(pictures, `${name}.png`) }); };
const labels = (page) => page.evaluate(() => Array.from(window.studio.history.labels));
const counts = async (page) => { const all = await labels(page); return new Map([...new Set(all)].map((l) => [l, all.filter((x) => x === l).length])); };

/** Places on the canvas where pieces are seen: one of each, in the window's pixels, those that are seen most first. */
const places = (page) => page.evaluate(() => {
  const box = window.studio.view.renderer.domElement.getBoundingClientRect();
  return [...window.studio.view.seen()].sort((a, b) => b[1].length - a[1].length).map(([piece, spots]) => {
    const mean = [0, 1].map((k) => spots.reduce((sum, s) => sum + s.xy[k], 0) / spots.length);
    const best = spots.reduce((a, b) => (Math.hypot(b.xy[0] - mean[0], b.xy[1] - mean[1]) < Math.hypot(a.xy[0] - mean[0], a.xy[1] - mean[1]) ? b : a));
    return { piece, x: box.left + best.xy[0], y: box.top + best.xy[1] };
  });
});

async function drag(page, from, to, steps = 24) {
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
  await page.mouse.move(to.x, to.y, { steps });
  await page.mouse.up();
}

/** Sets options as a person does, field by field. */
async function set(page, name, value) {
  await page.evaluate((n) => { let e = document.querySelector(`#sheet [name="${n}"]`); while (e) { if (e.tagName === "DETAILS") e.open = true; e = e.parentElement; } }, name);
  const before = await page.evaluate(() => window.studio.state.project.revision);
  await page.$eval(`#sheet [name="${name}"]`, (e, v) => { e.value = v; e.dispatchEvent(new Event("change", { bubbles: true })); }, value);
  await page.waitForFunction((b) => window.studio.state.project.revision > b, { timeout: 60_000 }, before);
  await settled(page);
}

async function figure(name, options, division) {
  const folder = join(work, name);
  const { server, address } = await serve(folder);
  const began = Date.now();
  const page = await pageAt(address);
  const ready = Date.now() - began;
  await shot(page, `${name}-1-empty`);
  await press(page, name);
  await page.waitForFunction((n) => window.studio.state.project.model?.name === `${n}.stl`, { timeout: 60_000 }, name);
  await settled(page);
  for (const [option, value] of Object.entries(options)) await set(page, option, value);
  await shot(page, `${name}-2-open`);
  await press(page, "2 Pieces");
  for (const [option, value] of Object.entries(division)) await set(page, option, value);
  await settled(page);
  await shot(page, `${name}-3-automatic`);
  await paint(page, name);
  await key(page, name);
  await make(page, name, server, address, folder);
  console.log(`ok    ${name}: ready after ${ready} ms`);
}

async function paint(page, name) {
  const [a, b] = await places(page);
  const first = await labels(page);
  // The brush takes from one piece for the other, from the middle of the one to that of the other.
  await page.keyboard.press("p");
  await page.mouse.click(a.x, a.y);
  await page.keyboard.press("b");
  const n = (await counts(page)).get(a.piece);
  await drag(page, a, b);
  const began = Date.now();
  await settled(page);
  const verdict = Date.now() - began;
  assert.ok((await counts(page)).get(a.piece) > n, `${name}: the brush paints`);
  await shot(page, `${name}-4-brushed`);
  // Undo brings every triangle back, redo paints it again.
  const painted = await labels(page);
  await page.keyboard.down("Control"); await page.keyboard.press("z"); await page.keyboard.up("Control");
  await settled(page);
  assert.deepEqual(await labels(page), first, `${name}: undo`);
  await page.keyboard.down("Control"); await page.keyboard.press("y"); await page.keyboard.up("Control");
  await settled(page);
  assert.deepEqual(await labels(page), painted, `${name}: redo`);
  // The eraser gives back; the knife makes one more; merging makes one less.
  await page.keyboard.press("e");
  await drag(page, a, b);
  await settled(page);
  assert.deepEqual(await labels(page), first, `${name}: the eraser`);
  const before = (await counts(page)).size;
  await page.keyboard.press("k");
  const [c] = await places(page);
  await drag(page, { x: Math.max(20, c.x - 400), y: c.y + 7 }, { x: c.x + 400, y: c.y - 3 });
  await settled(page);
  assert.equal((await counts(page)).size, before + 1, `${name}: the knife`);
  await shot(page, `${name}-5-cut`);
  const fresh = await page.evaluate(() => window.studio.state.piece);
  const [cut, other] = [(await places(page)).find((p) => p.piece === fresh), (await places(page)).find((p) => p.piece === c.piece)];
  await page.keyboard.press("m");
  await page.mouse.click(cut.x, cut.y);
  await page.mouse.click(other.x, other.y);
  await settled(page);
  assert.equal((await counts(page)).size, before, `${name}: merging`);
  // An island is told of, and mended.
  await page.keyboard.press("p");
  await page.mouse.click(b.x, b.y);
  await page.keyboard.press("b");
  await page.evaluate(() => { document.querySelector("#radius input").value = 3; document.querySelector("#radius input").dispatchEvent(new Event("input")); });
  await page.mouse.click(a.x, a.y);
  await settled(page);
  const told = await page.$$eval(".advice", (all) => all.map((e) => e.textContent).join(" "));
  assert.match(told, /island|joined|apart|piece/i, `${name}: what is wrong is told: ${told}`);
  await shot(page, `${name}-6-island`);
  if (await page.$(".mend")) { await press(page, "Fix"); await settled(page); await rest(300); await settled(page); }
  const judged = await page.evaluate(() => window.studio.state.judged);
  assert.ok(judged.locks, `${name}: mended, it locks: ${judged.words}`);
  console.log(`      ${name}: a verdict ${verdict} ms after the stroke`);
}

async function key(page, name) {
  await press(page, "3 Key");
  await settled(page);
  await shot(page, `${name}-7-key`);
  const n = await page.$$eval("#sheet .choice", (all) => all.length);
  if (n > 3) {
    await page.$$eval("#sheet .choice", (all) => all[all.length - 1].click());
    await page.waitForFunction(() => window.studio.state.options.find((o) => o.name === "key").value !== null);
    await settled(page);
  }
}

async function make(page, name, server, address, folder) {
  await press(page, "4 Make");
  await press(page, "Make the kit");
  await page.waitForFunction(() => window.studio.state.job?.state === "running", { timeout: 20_000 });
  await rest(1500);
  await shot(page, `${name}-8-making`);
  // The page is closed and opened again while the job runs; another looks on.
  await page.reload();
  await page.waitForSelector("html[data-ready]", { timeout: 60_000 });
  assert.equal(await page.evaluate(() => window.studio.state.step), "make");
  const second = await pageAt(address);
  // Pages in the background are not drawn, and what waits for frames would wait.
  await page.bringToFront();
  await page.waitForFunction(() => ["verified", "failed", "error"].includes(window.studio.state.job?.state), { timeout: MAKING_MS }).catch(() => {});
  const job = await page.evaluate(() => window.studio.state.job);
  assert.equal(job.state, "verified", `${name}: ${JSON.stringify(job)}`);
  await second.waitForFunction(() => window.studio.state.project.kit, { timeout: 10_000, polling: 200 });
  await page.waitForSelector("#kit:not([hidden])", { timeout: 10_000 });
  const frame = await (await page.$("#kit")).contentFrame();
  await frame.waitForSelector("html[data-ready]", { timeout: 60_000 });
  await shot(page, `${name}-9-kit`);
  const checked = spawnSync(checker, [join(folder, "kit")], { encoding: "utf8" });
  assert.equal(checked.status, 0, `${name}: ${checked.stdout.split("\n").filter((l) => !l.startsWith("confirmed")).join("\n")}`);
  await same(folder, name);
  await zipped(page, folder, name);
  assert.deepEqual([...page.faults, ...second.faults], [], name);
  await second.close();
  // The server is killed and comes again: all is there.
  const before = await page.evaluate(() => ({ n: window.studio.state.project.division.n_pieces, kit: window.studio.state.project.kit.files.length, isCurrent: window.studio.state.project.kit.is_current, labels: Array.from(window.studio.history.labels) }));
  assert.ok(before.isCurrent, `${name}: the kit is of what is shown`);
  await page.close();
  server.kill("SIGKILL");
  const again = await serve(folder);
  const back = await pageAt(again.address);
  const after = await back.evaluate(() => ({ n: window.studio.state.project.division.n_pieces, kit: window.studio.state.project.kit.files.length, isCurrent: window.studio.state.project.kit.is_current, labels: Array.from(window.studio.history.labels) }));
  assert.deepEqual(after, before, `${name}: killed and begun again`);
  await back.close();
  again.server.kill("SIGINT");
}

/** The command line makes the same bytes of the project file. */
async function same(folder, name) {
  const out = join(work, `${name}-again`);
  execFileSync(program, ["build", join(folder, "figure.shellock.toml"), "-o", out, "--quiet"], { stdio: "pipe" });
  const [mine, theirs] = [await tree(join(folder, "kit")), await tree(out)];
  assert.deepEqual(mine, theirs, `${name}: the same files`);
  for (const file of mine) assert.ok((await readFile(join(folder, "kit", file))).equals(await readFile(join(out, file))), `${name}: ${file} has the same bytes`);
}

const tree = async (folder) => (await readdir(folder, { recursive: true, withFileTypes: true })).filter((e) => e.isFile()).map((e) => join(e.parentPath, e.name).slice(folder.length + 1)).sort();

async function zipped(page, folder, name) {
  const size = await page.evaluate(async () => { const a = [...document.querySelectorAll("a.big")].find((x) => x.href.includes("kit.zip")); const bytes = new Uint8Array(await (await fetch(a.href)).arrayBuffer()); return [bytes.length, bytes[0], bytes[1]]; });
  assert.deepEqual(size.slice(1), [0x50, 0x4b], `${name}: a zip`);
  assert.ok(size[0] > 10_000 && (await tree(join(folder, "kit"))).length > 5);
}

async function phone() {
  const { server, address } = await serve(join(work, "vase"));
  const page = await pageAt(address, { width: 390, height: 844, isMobile: true, hasTouch: true });
  for (const step of ["1 Open", "2 Pieces", "3 Key", "4 Make", "5 Kit"]) {
    await press(page, step);
    await rest(600);
    await shot(page, `phone-${step[0]}`);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    assert.ok(wide <= 1, `${step}: ${wide} px wider than the window`);
    const small = await page.evaluate(() => [...document.querySelectorAll("button")].filter((b) => b.offsetParent && !b.classList.contains("line")).filter((b) => b.getBoundingClientRect().height < 43).map((b) => b.textContent));
    assert.deepEqual(small, [], `${step}: too small to touch`);
  }
  assert.deepEqual(page.faults, [], "phone");
  await page.close();
  server.kill("SIGINT");
  console.log("ok    a phone's window, 390 px wide");
}

/** Asks without a browser, which would not let some of it through. */
function ask(port, method, path, headers = {}, body = undefined) {
  return new Promise((done, fail) => {
    const request = http.request({ host: "127.0.0.1", port, method, path, headers }, (answer) => {
      let text = "";
      answer.on("data", (d) => { text += d; });
      answer.on("end", () => done({ status: answer.statusCode, text }));
    });
    request.on("error", fail);
    if (typeof body === "function") body(request);
    else request.end(body);
  });
}

async function strangers() {
  const folder = join(work, "strangers");
  const { server, port, token } = await serve(folder);
  const auth = { Authorization: `Bearer ${token}` };
  const status = async (expected, ...request) => { const { status: s, text } = await ask(port, ...request); assert.equal(s, expected, `${request.slice(0, 2).join(" ")}: ${text.slice(0, 200)}`); return text; };
  await status(401, "GET", "/api/project");
  await status(401, "GET", "/api/project", { Authorization: "Bearer 0" });
  await status(401, "GET", `/api/kit.zip?token=${"0".repeat(64)}`);
  await status(403, "GET", "/api/project", { ...auth, Origin: "http://evil.example" });
  await status(403, "GET", "/", { Host: "evil.example" });
  for (const path of ["../figure.shellock.toml", "%2e%2e/figure.shellock.toml", "..%2ffigure.shellock.toml", "/etc/passwd", "%2fetc%2fpasswd"]) await status(404, "GET", `/kit/${token}/${path}`);
  await status(401, "GET", `/kit/${"0".repeat(64)}/plan.json`);
  const words = JSON.parse(await status(422, "POST", "/api/model?name=..%2f..%2fevil.stl", auth, Buffer.from(Array.from({ length: 5000 }, (_, i) => (i * 7919) % 251)))).error;
  assert.ok(words.length > 20 && !words.includes(work), words);
  await status(422, "POST", "/api/model?name=empty.stl", auth, "");
  const size = 500 * 2 ** 20 + 1;
  const large = await new Promise((done) => {
    const request = http.request({ host: "127.0.0.1", port, method: "POST", path: "/api/model?name=large.stl", headers: { ...auth, "Content-Length": size } }, (answer) => done(answer.statusCode));
    request.on("error", () => {});
    const block = Buffer.alloc(1 << 20);
    let left = size;
    const more = () => { while (left > 0 && request.write(block.subarray(0, Math.min(left, block.length)))) left -= block.length; if (left > 0) { left -= block.length; request.once("drain", more); } else request.end(); };
    more();
  });
  assert.equal(large, 413);
  assert.deepEqual((await readdir(folder)).filter((f) => !f.startsWith("figure.")), [], "nothing is left of what was refused");
  await status(422, "PUT", "/api/options", { ...auth, "Content-Type": "application/json" }, JSON.stringify({ size: "huge" }));
  await status(422, "PUT", "/api/options", { ...auth, "Content-Type": "application/json" }, JSON.stringify({ labels: "/etc/passwd" }));
  await status(404, "POST", "/api/make", auth);
  await status(404, "GET", "/api/mesh", auth);
  // A path that is no file of the page.
  await status(404, "GET", "/main.js");
  const statuses = await Promise.all(Array.from({ length: 400 }, () => ask(port, "GET", "/api/options", auth).then(({ status: s }) => s)));
  assert.ok(statuses.includes(429) && statuses.includes(200), "a flood is dammed");
  const memory = Number((await readFile(`/proc/${server.pid}/status`, "utf8")).match(/VmRSS:\s+(\d+)/)[1]) / 1024;
  assert.ok(memory < 100, `the server takes ${memory.toFixed(0)} MB`);
  const code = await new Promise((done) => { server.once("exit", done); server.kill("SIGINT"); });
  assert.equal(code, 0, "Ctrl-C ends it well");
  // A project that is broken is told of.
  await writeFile(join(folder, "figure.shellock.toml"), "size = [");
  assert.throws(() => execFileSync(program, ["studio", "--project", folder, "--no-open"], { stdio: "pipe" }), /figure\.shellock\.toml/);
  console.log(`ok    strangers, garbage, floods; ${memory.toFixed(0)} MB`);
}

try {
  await figure("vase", { size: "80mm", time: "0" }, { method: "creases", pieces: "7" });
  await figure("torus", { size: "90mm", time: "0", printer: "fdm" }, { method: "creases", pieces: "6" });
  await phone();
  await strangers();
} finally {
  await browser.close();
  for (const server of served) server.kill("SIGKILL");
  if (!process.env.SHELLOCK_KEEP) await rm(work, { recursive: true, force: true });
}
