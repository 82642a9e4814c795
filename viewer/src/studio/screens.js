// The sheet beside the canvas: one screen a step. Each is made anew from the state; what it can do comes in as `act`.

import { css } from "./colours.js";
import { kitUrl, zipUrl } from "./api.js";
import { button, element } from "./dom.js";
import { allOptions, optionField } from "./options.js";
import { words } from "./words.js";

const paragraph = (words, className = "") => element("p", className, words);
const link = (href, name, isDownload) => {
  const a = element("a", isDownload ? "big" : "", name);
  a.href = href;
  if (isDownload) a.download = "";
  else a.target = "_blank";
  return a;
};
const next = (text, action) => button(text, action, { className: "next" });

// Options that a person meets first.
const MAIN = ["size", "up", "printer", "material"];

/** Screen 1: a file, how it is taken, and how it is to be made. */
export function openScreen({ project, options }, act) {
  const w = words.open;
  const parts = [element("h2", "", w.title)];
  const input = element("input");
  Object.assign(input, { type: "file", accept: ".3mf,.stl,.obj,.ply,.off,.gltf,.glb,.zip", id: "file" });
  input.addEventListener("change", () => { if (input.files[0]) act.open(input.files[0]); });
  const drop = element("label", "drop");
  drop.append(element("strong", "", w.drop), element("span", "file", w.choose), input, element("small", "", w.formats));
  parts.push(drop);
  const { model } = project;
  if (model) {
    parts.push(element("h3", "", model.name), paragraph(w.size(model.size_mm)), paragraph(model.is_exact ? w.exact(model.n_triangles) : w.fewer(model.n_triangles), "soft"));
    if (model.thin_share > 0) parts.push(paragraph(w.thin(model.thin_share), "soft"));
    parts.push(...model.warnings.map((line) => paragraph(line, "warning")), ...model.notes.map((line) => paragraph(line, "soft")));
    const main = MAIN.map((name) => options.find((o) => o.name === name)).filter(Boolean);
    const asItIs = (o) => (o.name === "size" ? { ...o, value_name: Math.max(...model.size_mm).toFixed(0) } : o);
    parts.push(element("h3", "", w.settings), ...main.map((o) => optionField(asItIs(o), act.choose)), allOptions(options, act.choose, MAIN), next(w.next, () => act.step("pieces")));
  }
  const figures = element("details", "figures");
  figures.open = !model;
  const list = element("div", "row");
  list.append(...project.figures.map((name) => button(name, () => act.figure(name))));
  figures.append(element("summary", "", w.figures), list);
  parts.push(figures);
  return parts;
}

/** Screen 2: how it is divided, whether it locks, and what to mend. */
export function piecesScreen(state, act) {
  const w = words.pieces;
  const { project, options } = state;
  const parts = [element("h2", "", w.title)];
  if (!project.model) return [...parts, next(words.open.title, () => act.step("open"))];
  parts.push(verdict(state, act));
  const row = element("div", "row");
  for (const name of ["method", "pieces", "symmetric"]) {
    const option = options.find((o) => o.name === name);
    if (option) row.append(optionField({ ...option, help: "" }, act.chooseDivision));
  }
  const again = button(w.again, act.divide, { title: w.anewHelp });
  parts.push(row, again, paragraph(w.faceHint, "soft"), pieceList(state, act), advice(state, act), next(w.next, () => act.step("key")));
  return parts;
}

function verdict({ judged, isJudging, project }, act) {
  const holder = element("div", `verdict ${isJudging || !judged ? "unknown" : judged.locks ? "good" : "bad"}`);
  holder.setAttribute("role", "status");
  const origin = project.division?.origin === "painted" ? words.pieces.painted : words.pieces.automatic;
  holder.append(element("strong", "", isJudging || !judged ? words.pieces.judging : judged.words));
  holder.append(element("small", "", `${words.pieces.count(project.division?.n_pieces ?? 0)}, ${origin}`));
  for (const b of judged && !isJudging ? judged.blockers.slice(0, 3) : []) holder.append(button(b.words, () => act.look(b.at), { className: "line" }));
  return holder;
}

function pieceList({ pieces, piece, judged }, act) {
  const holder = element("div");
  const list = element("div", "pieces");
  list.setAttribute("role", "group");
  list.setAttribute("aria-label", words.pieces.list);
  for (const { piece: k, area } of pieces) {
    const b = button("", () => act.chose(k));
    b.setAttribute("aria-pressed", String(k === piece));
    const place = judged?.order?.indexOf(k) ?? -1;
    b.title = `${words.pieces.area(area)}${place >= 0 ? `, number ${place + 1} in the order of assembly` : ""}`;
    const swatch = element("i");
    swatch.style.background = css(k);
    b.append(swatch, element("span", "", String(k + 1)));
    list.append(b);
  }
  holder.append(element("h3", "", words.pieces.list), list);
  return holder;
}

function advice({ judged, isJudging }, act) {
  const holder = element("div", "advice");
  if (!judged || isJudging) return holder;
  for (const a of judged.advice) {
    const line = element("div", a.severity);
    const told = button("", () => a.at && act.look(a.at), { className: "line" });
    told.append(element("strong", "", `${words.pieces.ask[a.severity]}: `), a.words);
    line.append(told);
    holder.append(line);
  }
  if (judged.is_mended) holder.append(button(words.pieces.mend, act.mend, { title: words.pieces.mendHelp, className: "mend" }));
  if (!judged.advice.length) holder.append(paragraph(words.pieces.sound, "soft"));
  return holder;
}

/** Screen 3: where the key is. */
export function keyScreen({ judged, options, isJudging }, act) {
  const w = words.key;
  const chosen = options.find((o) => o.name === "key")?.value ?? "auto";
  const parts = [element("h2", "", w.title), paragraph(w.what, "soft")];
  const auto = button(w.auto, () => act.choose({ key: null }), { className: "choice" });
  const piece = button(w.piece, () => act.choose({ key: "piece" }), { className: "choice" });
  auto.setAttribute("aria-pressed", String(chosen === "auto"));
  piece.setAttribute("aria-pressed", String(chosen === "piece"));
  parts.push(auto, piece, element("h3", "", w.place));
  const keys = judged && !isJudging ? judged.keys : [];
  keys.forEach((key, i) => {
    const b = button(`${i + 1}. ${key.words}`, () => act.placeKey(key.at), { className: "choice" });
    b.setAttribute("aria-pressed", String(key.is_chosen));
    parts.push(b);
  });
  if (isJudging) parts.push(paragraph(words.pieces.judging, "soft"));
  else if (!keys.length) parts.push(paragraph(w.none, "warning"));
  if (judged && !isJudging) parts.push(paragraph(judged.words, judged.locks ? "good" : "bad"));
  return [...parts, next(w.next, () => act.step("make"))];
}

/** Screen 4: the kit in the making. */
export function makeScreen({ project, judged, job }, act) {
  const w = words.make;
  const parts = [element("h2", "", w.title), paragraph(w.what, "soft")];
  if (judged && !judged.locks) parts.push(paragraph(w.doubtful, "warning"));
  const isBusy = job && (job.state === "running" || job.state === "waiting");
  if (!isBusy && project.model) parts.push(next(project.kit ? w.again : w.start, act.make));
  if (job) parts.push(...jobParts(job, isBusy, act));
  if (project.kit && !isBusy) parts.push(button(w.next, () => act.step("kit"), { className: "choice" }));
  return parts;
}

function jobParts(job, isBusy, act) {
  const w = words.make;
  const state = element("p", `state ${job.state}`, w.state[job.state]);
  state.setAttribute("role", "status");
  const parts = [state];
  if (isBusy) {
    const bar = element("progress");
    Object.assign(bar, { max: job.n_stages || 1, value: job.number });
    bar.setAttribute("aria-label", w.stage(job));
    const left = job.seconds_left === null ? "" : `, ${w.left(job.seconds_left)}`;
    parts.push(bar, paragraph(`${w.stage(job)}${left}`), paragraph(w.took(job.seconds), "soft seconds"), button(w.stop, () => act.stop(job.id)));
  } else {
    parts.push(paragraph(w.took(job.seconds), "soft"));
  }
  if (job.error) parts.push(paragraph(job.error, "bad"));
  if (job.notes.length) {
    const list = element("ol", "notes");
    list.append(...job.notes.map((note) => element("li", "", note)));
    parts.push(element("h3", "", w.notes), list);
  }
  return parts;
}

/** Screen 5: what came of it. */
export function kitScreen({ project }, act) {
  const w = words.kit;
  const { kit } = project;
  const parts = [element("h2", "", w.title)];
  if (!kit) return [...parts, paragraph(w.none), next(words.make.title, () => act.step("make"))];
  parts.push(paragraph(kit.passed ? w.passed : w.failed, kit.passed ? "good" : "bad"));
  if (!kit.is_current) parts.push(paragraph(w.old, "warning"));
  const has = (name) => kit.files.some((f) => f.name === name);
  parts.push(link(zipUrl(), w.zip, true));
  if (kit.passed && has("plates.3mf")) parts.push(link(kitUrl("plates.3mf"), w.plates, true));
  if (has("instructions.pdf")) parts.push(link(kitUrl("instructions.pdf"), w.booklet));
  parts.push(button(w.change, () => act.step("pieces"), { className: "choice" }));
  const files = element("details");
  const list = element("ul", "files");
  for (const { name, bytes } of kit.files) {
    const line = element("li");
    line.append(link(kitUrl(name), name), element("span", "", bytes > 1e6 ? `${(bytes / 1e6).toFixed(1)} MB` : `${Math.ceil(bytes / 1e3)} kB`));
    list.append(line);
  }
  files.append(element("summary", "", `${w.files} (${kit.files.length})`), list);
  parts.push(files);
  return parts;
}

