// What a load does to meshes: the points of a coarse carrier go somewhere, and the points of the mesh near it go with them.
//
// header.loads             = { title, note, carriers, loads, weakest }; may be missing
// carriers[i]              = { points, triangles }, arrays as those of meshes[i]
// loads[k]                 = { name, figure, title, arrows, floor, place, scale, step_mm, moved }
//   moved[i]               = { offset, count }: 3 × int16 a point of carrier i, in step_mm
//   scale                    by how many times more than that it shows
//   arrows[j]              = { name, tip, along }: a force
//   floor                  = [point, normal] or null
//   place                  = { name, at, lines, mesh } or null: where it gives way, with lines of points
// weakest                  = { text, place } or null: the same of all loads

/** The share and the two weights [u, v] of the point of triangle abc nearest to p: a + u (b − a) + v (c − a), and its distance squared. */
export function nearestOn(a, b, c, p) {
  const sub = (x, y) => [x[0] - y[0], x[1] - y[1], x[2] - y[2]];
  const dot = (x, y) => x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
  const [ab, ac, ap] = [sub(b, a), sub(c, a), sub(p, a)];
  const [d1, d2] = [dot(ab, ap), dot(ac, ap)];
  const at = (u, v) => {
    const r = [0, 1, 2].map((k) => ap[k] - u * ab[k] - v * ac[k]);
    return { u, v, distance: dot(r, r) };
  };
  if (d1 <= 0 && d2 <= 0) return at(0, 0);
  const bp = sub(p, b);
  const [d3, d4] = [dot(ab, bp), dot(ac, bp)];
  if (d3 >= 0 && d4 <= d3) return at(1, 0);
  const vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return at(d1 / (d1 - d3) || 0, 0);
  const cp = sub(p, c);
  const [d5, d6] = [dot(ab, cp), dot(ac, cp)];
  if (d6 >= 0 && d5 <= d6) return at(0, 1);
  const vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return at(0, d2 / (d2 - d6) || 0);
  const va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const w = (d4 - d3) / (d4 - d3 + (d5 - d6)) || 0;
    return at(1 - w, w);
  }
  const whole = va + vb + vc;
  return whole > 0 ? at(vb / whole, vc / whole) : at(0, 0);
}

/** For each of some points, the corners of the nearest triangle of a carrier and the weights of the last two. */
export function carriedBy({ positions, indices }, points) {
  const nFaces = indices.length / 3;
  const corner = (i) => [positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]];
  // A ball around each triangle: most are too far to be looked at.
  const faces = Array.from({ length: nFaces }, (_, f) => {
    const corners = [0, 1, 2].map((k) => corner(indices[3 * f + k]));
    const middle = [0, 1, 2].map((k) => (corners[0][k] + corners[1][k] + corners[2][k]) / 3);
    const radius = Math.max(...corners.map((c) => Math.hypot(...c.map((x, k) => x - middle[k]))));
    return { corners, middle, radius };
  });
  const n = points.length / 3;
  const bound = { corners: new Uint16Array(3 * n), weights: new Float32Array(2 * n) };
  if (!nFaces) return null;
  let last = 0;
  for (let i = 0; i < n; i++) {
    const p = [points[3 * i], points[3 * i + 1], points[3 * i + 2]];
    // What was nearest to the point before is so near that hardly any other is looked at.
    let best = { f: last, ...nearestOn(...faces[last].corners, p) };
    let reach = Math.sqrt(best.distance);
    for (let f = 0; f < nFaces; f++) {
      const { middle, radius, corners } = faces[f];
      const [x, y, z] = [p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]];
      const limit = radius + reach;
      if (x * x + y * y + z * z >= limit * limit) continue;
      const found = nearestOn(...corners, p);
      if (found.distance < best.distance) {
        best = { f, ...found };
        reach = Math.sqrt(best.distance);
      }
    }
    last = best.f;
    for (let k = 0; k < 3; k++) bound.corners[3 * i + k] = indices[3 * best.f + k];
    bound.weights[2 * i] = best.u;
    bound.weights[2 * i + 1] = best.v;
  }
  return bound;
}

/** How far points go that are carried, where the carrier's go so far. */
export function carriedMoves({ corners, weights }, moved) {
  const n = weights.length / 2;
  const moves = new Float32Array(3 * n);
  for (let i = 0; i < n; i++) {
    const [u, v] = [weights[2 * i], weights[2 * i + 1]];
    const shares = [1 - u - v, u, v];
    for (let c = 0; c < 3; c++) {
      const at = 3 * corners[3 * i + c];
      for (let k = 0; k < 3; k++) moves[3 * i + k] += shares[c] * moved[at + k];
    }
  }
  return moves;
}

/** How far the point of all carriers goes that is nearest to a place. */
export function moveAt(carriers, moved, place) {
  let best = { distance: Infinity, move: [0, 0, 0] };
  carriers.forEach(({ positions }, i) => {
    for (let at = 0; at < positions.length; at += 3) {
      const distance = Math.hypot(positions[at] - place[0], positions[at + 1] - place[1], positions[at + 2] - place[2]);
      if (distance < best.distance) best = { distance, move: [...moved[i].subarray(at, at + 3)] };
    }
  });
  return best.move;
}

const BEAT_S = 3.4;

/** How much of a load is seen so many seconds after it began: up and down, smoothly. */
export const beatAt = (seconds) => 0.5 - 0.5 * Math.cos((2 * Math.PI * seconds) / BEAT_S);

/** Shows one load at a time, and calls `changed` whenever there is something new to see. */
export class Swayer {
  constructor(loads, changed) {
    this.loads = loads;
    this.changed = changed;
    this.index = -1;
    this.amount = 0;
    this.isPlaying = false;
  }

  get load() {
    return this.loads[this.index];
  }

  /** Chooses a load; it plays, or shows at its full for those who do not want to see things move by themselves. */
  choose(index, isStill) {
    this.stop();
    this.index = index;
    this.amount = isStill ? 1 : 0;
    if (!isStill) this.play();
  }

  play() {
    if (!this.load) return;
    cancelAnimationFrame(this.frame);
    this.isPlaying = true;
    // Goes on upwards from what is seen.
    const from = (Math.acos(1 - 2 * this.amount) / (2 * Math.PI)) * BEAT_S;
    const begin = performance.now();
    const frame = (now) => {
      this.amount = beatAt(from + Math.max(0, now - begin) / 1000);
      this.frame = requestAnimationFrame(frame);
      this.changed();
    };
    this.frame = requestAnimationFrame(frame);
  }

  pause() {
    cancelAnimationFrame(this.frame);
    this.isPlaying = false;
  }

  /** Shows so much of it, and stays there. */
  show(amount) {
    this.pause();
    this.amount = amount;
  }

  stop() {
    this.pause();
    this.index = -1;
    this.amount = 0;
  }

  /** What is to be read while it shows. */
  caption() {
    if (!this.load) return "";
    const { title, scale } = this.load;
    const times = scale >= 1 ? `exaggerated ${scale} times` : `shown at ${scale} times its real size`;
    return scale === 1 ? title : `${title} (${times})`;
  }
}
