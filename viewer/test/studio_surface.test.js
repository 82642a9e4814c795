// What the studio's tools do to the pieces of a surface, without a page: on a closed band of known triangles.
import assert from "node:assert/strict";
import test from "node:test";
import { History } from "../src/studio/history.js";
import { Surface, unused } from "../src/studio/surface.js";

const [ROUND, ALONG] = [24, 10];

/** A torus of 2 × ROUND × ALONG triangles; triangle 2 (i · ALONG + j) and the next are cell (i, j). */
function torus(pinch = () => 1) {
  const points = new Float32Array(3 * ROUND * ALONG);
  const corners = [];
  for (let i = 0; i < ROUND; i++) {
    for (let j = 0; j < ALONG; j++) {
      const [u, v] = [(2 * Math.PI * i) / ROUND, (2 * Math.PI * j) / ALONG];
      const tube = 10 * pinch(i);
      points.set([(30 + tube * Math.cos(v)) * Math.cos(u), (30 + tube * Math.cos(v)) * Math.sin(u), tube * Math.sin(v)], 3 * (i * ALONG + j));
      const at = (a, b) => ((i + a) % ROUND) * ALONG + ((j + b) % ALONG);
      corners.push(at(0, 0), at(1, 0), at(1, 1), at(0, 0), at(1, 1), at(0, 1));
    }
  }
  return new Surface(points, Uint32Array.from(corners));
}
const ring = (f) => Math.floor(f / (2 * ALONG));
const halves = (s) => Uint32Array.from({ length: s.n }, (_, f) => Number(ring(f) >= ROUND / 2));

test("each triangle of a closed surface has three others beside it, and each of them has it", () => {
  const s = torus();
  for (let h = 0; h < 3 * s.n; h++) {
    const g = s.beside[h];
    assert.ok(g >= 0);
    assert.ok([0, 1, 2].some((k) => s.beside[3 * g + k] === Math.floor(h / 3)));
  }
});

test("the brush paints what is near along the surface, and nothing on the other side of it", () => {
  const s = torus();
  const place = s.middles.slice(0, 3);
  const disk = s.disk(0, place, 8);
  const near = Array.from({ length: s.n }, (_, g) => g).filter((g) => s.squared(g, place) < 64);
  assert.deepEqual([...disk].sort((a, b) => a - b), near);
  // Two flat sheets 1 mm apart: the brush on one leaves the other alone.
  const quad = (z) => [[0, 0, z], [9, 0, z], [9, 9, z], [0, 9, z]];
  const sheets = new Surface(Float32Array.from([...quad(0), ...quad(1)].flat()), Uint32Array.from([0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7]));
  assert.deepEqual(sheets.disk(0, [5, 4, 0], 20), [0, 1]);
});

test("filling stops at creases", () => {
  // The tube is pinched to half at two places of the ring: sharp valleys all around it.
  const s = torus((i) => (i === 0 || i === ROUND / 2 ? 0.4 : 1));
  const filled = s.fill(2 * ALONG * 3, 25);
  assert.ok(filled.length > s.n / 4 && filled.length < 0.6 * s.n, `${filled.length} of ${s.n}`);
  assert.ok(filled.every((f) => ring(f) < ROUND / 2), "nothing beyond the valley");
  assert.equal(torus().fill(0, 80).length, s.n, "all where there is no crease");
});

test("growing takes exactly what touches, shrinking gives exactly the outermost away", () => {
  const s = torus();
  const labels = halves(s);
  const taken = s.ring(labels, 0);
  assert.ok(taken.length > 0 && taken.every((f) => labels[f] === 1 && [0, 1, 2].some((k) => labels[s.beside[3 * f + k]] === 0)));
  const given = s.edge(labels, 0);
  assert.ok(given.length > 0 && given.every(([f, to]) => labels[f] === 0 && to === 1));
});

test("smoothing takes single teeth out of a seam and leaves a straight one as it is", () => {
  const s = torus();
  const straight = halves(s);
  assert.deepEqual(s.smoothed(straight, 0).filter(([f]) => Math.min(Math.abs(ring(f) - 12), ring(f), Math.abs(ring(f) - 24)) > 1), []);
  const toothed = straight.slice();
  toothed[2 * (12 * ALONG + 4)] = 0;
  toothed[2 * (13 * ALONG + 4)] = 0;
  const after = toothed.slice();
  for (const [f, label] of s.smoothed(toothed, 0)) after[f] = label;
  assert.equal(after[2 * (13 * ALONG + 4)], 1, "a tooth two cells out is gone");
});

test("the knife cuts the piece that it is given, the smaller side, and only where it crosses it", () => {
  const s = torus();
  const labels = halves(s);
  const start = 2 * ALONG * 3;
  // The plane x = 10 through the half y > 0.
  const cut = s.cut(labels, 0, start, [1, 0, 0, 10]);
  assert.ok(cut.length > 0 && cut.length <= s.n / 4);
  assert.ok(cut.every((f) => labels[f] === 0 && s.middles[3 * f] > 10));
  assert.deepEqual(s.cut(labels, 0, start, [1, 0, 0, 1000]), []);
});

test("seams are the edges between pieces, pieces are counted with their areas", () => {
  const s = torus();
  const labels = halves(s);
  assert.equal(s.seams(labels).length, 6 * 2 * ALONG, "two closed lines of ten edges");
  assert.equal(s.seams(new Uint32Array(s.n)).length, 0);
  const pieces = s.pieces(labels);
  assert.deepEqual(pieces.map((p) => p.piece), [0, 1]);
  assert.ok(Math.abs(pieces[0].area - pieces[1].area) < 1e-3 * pieces[0].area);
  assert.equal(unused(labels), 2);
  assert.equal(unused(Uint32Array.of(0, 2)), 1);
});

test("whatever was painted, undo brings back and redo paints again; a new stroke forgets what was taken back", () => {
  let random = 7;
  const next = (n) => (random = (random * 48271) % 2147483647) % n;
  const history = new History(Uint32Array.from({ length: 50 }, () => next(4)));
  const states = [history.labels.slice()];
  for (let k = 0; k < 100; k++) {
    for (let i = 0; i < 5; i++) history.set([[next(50), next(4)], [next(50), next(4)]]);
    if (history.close()) states.push(history.labels.slice());
  }
  const last = states.length - 1;
  for (let k = last; k > 0; k--) { assert.deepEqual(history.labels, states[k]); history.undo(); }
  assert.deepEqual(history.labels, states[0]);
  assert.ok(!history.canUndo && history.undo().length === 0);
  for (let k = 1; k <= last; k++) { history.redo(); assert.deepEqual(history.labels, states[k]); }
  assert.ok(!history.canRedo);
  history.undo();
  history.set([[0, 9]]);
  history.close();
  assert.ok(!history.canRedo);
  // A stroke that ends where it began is no step.
  const before = history.done;
  const was = history.labels[1];
  history.set([[1, was + 1]]);
  history.set([[1, was]]);
  assert.ok(!history.close() && history.done === before);
});
