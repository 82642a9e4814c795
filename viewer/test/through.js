// Clicks through the pages of finished kits in a real browser, on a desk and on a phone, and keeps pictures.
//
//   node test/through.js PICTURES REPORT.html ...
//
// Fails where a page throws, says something on the console, asks for anything beside itself, hides a control, or tells another number of steps than
// there are pieces.
import assert from "node:assert/strict";
import { mkdir } from "node:fs/promises";
import { basename, dirname, join, resolve } from "node:path";
import puppeteer from "puppeteer-core";

const SIZES = [{ name: "desk", width: 1440, height: 900 }, { name: "phone", width: 390, height: 844, isMobile: true, hasTouch: true }];
const executablePath = process.env.SHELLOCK_CHROMIUM ?? "/usr/bin/chromium";
const [pictures, ...files] = process.argv.slice(2);
const rest = (ms) => new Promise((done) => setTimeout(done, ms));

const browser = await puppeteer.launch({ executablePath, args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"] });
await mkdir(pictures, { recursive: true });
try {
  for (const file of files) for (const size of SIZES) await through(file, size);
} finally {
  await browser.close();
}

async function through(file, size) {
  const page = await browser.newPage();
  const faults = [];
  page.on("console", (m) => faults.push(m.text()));
  page.on("pageerror", (e) => faults.push(e.message));
  page.on("request", (r) => { if (!/^(file|data|blob):/.test(r.url())) faults.push(`asks for ${r.url()}`); });
  await page.setViewport(size);
  const began = Date.now();
  await page.goto(`file://${resolve(file)}`);
  await page.waitForSelector("html[data-ready]", { timeout: 60_000 });
  const ready = Date.now() - began;
  const name = `${basename(dirname(resolve(file)))}-${size.name}`;
  const shot = async (what) => { await rest(900); await page.screenshot({ path: join(pictures, `${name}-${what}.png`) }); };
  const press = (text) => page.evaluate((t) => { const b = [...document.querySelectorAll("button")].find((x) => x.textContent === t); b?.click(); return Boolean(b); }, text);
  const caption = () => page.$eval(".caption", (c) => c.textContent);
  await shot("assembled");
  await press("Exploded");
  await press("Numbers");
  await shot("exploded");
  await press("Numbers");
  await press("Assembled");
  const n = await page.$$eval(".mesh", (rows) => rows.length);
  assert.ok(await press("Step by step"));
  for (let i = 1; i <= n; i++) {
    await rest(80);
    assert.match(await caption(), new RegExp(`^Step ${i} of ${n}: `), `${name}, step ${i}`);
    if (i === 1 || i === Math.ceil(n / 2) || i === n) await shot(`step-${i}`);
    if (i < n) await page.evaluate(() => document.querySelector('[aria-label="Next step"]').click());
  }
  await press("Assembled");
  const tabs = await page.$$eval('[role="tab"]', (all) => all.map((b) => b.textContent));
  for (const tab of tabs) { await press(tab); await shot(`tab-${tab.toLowerCase()}`); }
  // Everything else once, twice for what stays pressed.
  for (let k = 0; k < 2; k++) await page.evaluate(() => { for (const b of document.querySelectorAll("button")) b.click(); });
  await page.keyboard.press("Escape");
  await rest(300);
  const small = await page.evaluate(() => [...document.querySelectorAll("#tools button, .tabs button")].filter((b) => b.offsetParent).filter((b) => b.getBoundingClientRect().height < (innerWidth < 500 ? 44 : 30)).map((b) => b.textContent));
  assert.deepEqual(small, [], `${name}: too small to touch`);
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  assert.ok(wide <= 1, `${name}: ${wide} px wider than the window`);
  assert.deepEqual(faults, [], name);
  console.log(`ok    ${name}: ${n} steps, ${tabs.length} tabs, ready after ${ready} ms`);
  await page.close();
}
