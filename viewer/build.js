// Bundles the viewer into the crate that embeds it (crates/render/viewer), which is committed: Rust embeds it, so building Shellock needs no node.
import { readFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import * as esbuild from "esbuild";

const here = new URL("./", import.meta.url);
const path = (name) => fileURLToPath(new URL(name, here));

/** The bundled files and their texts. */
export async function bundle() {
  // Pages carry the bundle on their own, so three's whole notice goes with it.
  const notice = await readFile(path("node_modules/three/LICENSE"), "utf8");
  const result = await esbuild.build({
    entryPoints: [path("src/viewer.js"), path("src/viewer.css")],
    outdir: path("../crates/render/viewer"),
    banner: { js: `/*! three.js\n${notice.trim()}\n*/` },
    bundle: true,
    minify: true,
    format: "iife",
    target: "es2022",
    write: false,
  });
  return result.outputFiles;
}

/** The studio's script and its text. The page and its style are written by hand, in crates/studio/page. */
export async function studio() {
  const notices = await Promise.all(["three", "three-mesh-bvh"].map(async (name) => `${name}\n${(await readFile(path(`node_modules/${name}/LICENSE`), "utf8")).trim()}`));
  const result = await esbuild.build({
    entryPoints: { studio: path("src/studio/main.js") },
    outdir: path("../crates/studio/page"),
    banner: { js: `/*! ${notices.join("\n\n")}\n*/` },
    bundle: true,
    minify: true,
    format: "iife",
    target: "es2022",
    write: false,
  });
  return result.outputFiles;
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const { mkdir, writeFile } = await import("node:fs/promises");
  await mkdir(path("../crates/render/viewer"), { recursive: true });
  await mkdir(path("../crates/studio/page"), { recursive: true });
  for (const file of [...(await bundle()), ...(await studio())]) {
    await writeFile(file.path, file.text);
    console.log(`${file.path}: ${(file.text.length / 1024).toFixed(0)} kB`);
  }
}
