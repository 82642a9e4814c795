// What the pointer does on the canvas: strokes of the tools on the labels. Everything else it turns the view with.

import { unused } from "./surface.js";
import { words } from "./words.js";

const PAINTS = new Set(["brush", "eraser"]);
// Places along a stroke are so many radii apart.
const STEP = 0.4;

export class Tools {
  /**
   * `on` has `changed(faces)` while something is drawn, `done()` at the end of a step, `chose(piece)` and `hint(text)`; `of()` gives the
   * surface, the history, the labels that the eraser brings back, and the chosen piece.
   */
  constructor(view, sketch, of, on) {
    Object.assign(this, { view, sketch, of, on, tool: "turn", radius: 6, angle: 25, stroke: null, first: null });
    const canvas = view.renderer.domElement;
    // Before the camera's own listeners: they do what is set here.
    canvas.addEventListener("pointerdown", (e) => this.#down(e), { capture: true });
    canvas.addEventListener("pointermove", (e) => this.#move(e));
    addEventListener("pointerup", () => this.#up());
    addEventListener("pointercancel", () => this.#up());
    canvas.addEventListener("pointerleave", () => view.cursor(null, 0));
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    this.fingers = 0;
    this.choose("turn");
  }

  choose(tool) {
    this.tool = tool;
    this.first = null;
    this.view.cursor(null, 0);
    this.view.turns(tool === "turn");
    this.view.renderer.domElement.style.cursor = tool === "turn" ? "grab" : "crosshair";
    this.on.hint(tool === "merge" ? words.hints.mergeFirst : "");
  }

  /** Space held: the view turns, whatever the tool. */
  hold(isHeld) {
    this.isHeld = isHeld;
    if (!this.stroke) this.view.turns(isHeld || this.tool === "turn");
  }

  #down(e) {
    this.fingers += e.pointerType === "touch" ? 1 : 0;
    if (this.tool === "turn" || this.isHeld || !this.of().history) return;
    if (e.button !== 0) return;
    // A second finger: the first one's stroke was meant to turn the view.
    if (this.fingers > 1) { this.#drop(); return; }
    const hit = this.view.pick(e.clientX, e.clientY);
    const isLine = this.tool === "lasso" || this.tool === "knife";
    if (!hit && !isLine) { this.view.turns(true); this.wasOutside = true; return; }
    e.preventDefault();
    this.view.renderer.domElement.setPointerCapture(e.pointerId);
    this.stroke = { points: [[e.clientX, e.clientY]], last: hit };
    if (PAINTS.has(this.tool)) this.#dab(hit);
  }

  #move(e) {
    const hit = PAINTS.has(this.tool) && e.pointerType !== "touch" ? this.view.pick(e.clientX, e.clientY) : null;
    if (PAINTS.has(this.tool)) this.view.cursor(hit, this.radius);
    if (!this.stroke) return;
    const points = this.stroke.points;
    if (PAINTS.has(this.tool)) this.#along(points[points.length - 1], [e.clientX, e.clientY]);
    points.push([e.clientX, e.clientY]);
    if (this.tool === "lasso") this.sketch(points, true);
    if (this.tool === "knife") this.sketch([points[0], [e.clientX, e.clientY]], false);
  }

  #up() {
    this.fingers = 0;
    if (this.wasOutside) { this.wasOutside = false; this.view.turns(this.isHeld || this.tool === "turn"); }
    const { stroke } = this;
    if (!stroke) return;
    this.stroke = null;
    this.sketch(null);
    const act = { lasso: () => this.#lasso(stroke), knife: () => this.#knife(stroke), fill: () => this.#fill(stroke.last), merge: () => this.#merge(stroke.last), pick: () => this.#pick(stroke.last) };
    act[this.tool]?.();
    if (this.of().history.close()) this.on.done();
  }

  // What was drawn by a finger that wanted to turn the view is taken back.
  #drop() {
    if (!this.stroke) return;
    this.stroke = null;
    this.sketch(null);
    const { history } = this.of();
    if (history.close()) { this.on.changed(history.undo()); history.steps.length = history.done; }
  }

  #set(faces, label) {
    const { history } = this.of();
    const changed = history.set(faces.map((f) => [f, typeof label === "function" ? label(f) : label]));
    if (changed.length) this.on.changed(changed);
  }

  #dab(hit) {
    if (!hit) return;
    const { surface, piece, base } = this.of();
    const faces = surface.disk(hit.face, hit.at, this.radius);
    this.#set(faces, this.tool === "eraser" ? (f) => base[f] : piece);
  }

  // Dabs from one place of the window to another, so near to each other that they overlap.
  #along([x0, y0], [x1, y1]) {
    const hit = this.view.pick(x1, y1);
    const last = this.stroke.last;
    const far = hit && last ? Math.hypot(...hit.at.map((x, k) => x - last.at[k])) : 0;
    const n = Math.max(1, Math.min(40, Math.ceil(far / (STEP * this.radius))));
    for (let i = 1; i < n; i++) this.#dab(this.view.pick(x0 + ((x1 - x0) * i) / n, y0 + ((y1 - y0) * i) / n));
    this.#dab(hit);
    if (hit) this.stroke.last = hit;
  }

  #fill(hit) {
    const { surface, piece } = this.of();
    this.#set(surface.fill(hit.face, this.angle), piece);
  }

  #pick(hit) {
    this.on.chose(this.of().history.labels[hit.face]);
  }

  #merge(hit) {
    const { surface, history } = this.of();
    const piece = history.labels[hit.face];
    if (this.first === null) {
      this.first = piece;
      this.on.hint(words.hints.mergeSecond(piece + 1));
      return;
    }
    if (piece !== this.first) {
      this.#set(surface.of(history.labels, this.first), piece);
      this.on.chose(piece);
    }
    this.first = null;
    this.on.hint(words.hints.mergeFirst);
  }

  // Triangles in sight whose middles lie within the line.
  #lasso({ points }) {
    const { surface, piece } = this.of();
    const box = this.view.renderer.domElement.getBoundingClientRect();
    const polygon = points.map(([x, y]) => [x - box.left, y - box.top]);
    if (polygon.length < 3) return;
    const m = surface.middles;
    const within = [];
    for (let f = 0; f < surface.n; f++) {
      const { x, y, isAhead } = this.view.project([m[3 * f], m[3 * f + 1], m[3 * f + 2]]);
      if (isAhead && isInside(polygon, x, y) && this.view.isSeen(f)) within.push(f);
    }
    this.#set(within, piece);
  }

  // The piece that most of the line lies on is cut by the plane through it and the eye.
  #knife({ points }) {
    const { surface, history } = this.of();
    const [from, to] = [points[0], points[points.length - 1]];
    const hits = Array.from({ length: 41 }, (_, i) => this.view.pick(from[0] + ((to[0] - from[0]) * i) / 40, from[1] + ((to[1] - from[1]) * i) / 40)).filter(Boolean);
    const counts = new Map();
    for (const { face } of hits) counts.set(history.labels[face], (counts.get(history.labels[face]) ?? 0) + 1);
    const piece = [...counts].sort((a, b) => b[1] - a[1])[0]?.[0];
    const start = hits.find(({ face }) => history.labels[face] === piece);
    const cut = start && Math.hypot(to[0] - from[0], to[1] - from[1]) > 8 ? surface.cut(history.labels, piece, start.face, this.view.plane(from, to)) : [];
    if (!cut.length) { this.on.hint(words.hints.noCut); return; }
    const fresh = unused(history.labels);
    this.#set(cut, fresh);
    this.on.chose(fresh);
  }
}

function isInside(polygon, x, y) {
  let inside = false;
  for (let i = 0, j = polygon.length - 1; i < polygon.length; j = i++) {
    const [[xi, yi], [xj, yj]] = [polygon[i], polygon[j]];
    if (yi > y !== yj > y && x < ((xj - xi) * (y - yi)) / (yj - yi) + xi) inside = !inside;
  }
  return inside;
}
