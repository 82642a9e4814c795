// The model's surface as a graph of triangles, and what tools do to the pieces on it. Knows no canvas and no server: labels go in,
// a list of triangles to change comes out.

const MAGIC = 0x564d4853;

/** The surface that the server sends: points, corners, and which triangles are too thin to be hollow. */
export function readMesh(buffer) {
  const [magic, version, nPoints, nFaces] = new Uint32Array(buffer, 0, 4);
  if (magic !== MAGIC || version !== 1) throw new Error("this is no surface of the studio");
  const points = new Float32Array(buffer, 16, 3 * nPoints);
  const corners = new Uint32Array(buffer, 16 + 12 * nPoints, 3 * nFaces);
  const thin = new Uint8Array(buffer, 16 + 12 * (nPoints + nFaces), nFaces);
  return new Surface(points, corners, thin);
}

/** The surface as it will be cut, and a piece for each of its triangles. */
export function readCut(buffer) {
  const [, , nPoints, nFaces] = new Uint32Array(buffer, 0, 4);
  const points = new Float32Array(buffer, 16, 3 * nPoints);
  const corners = new Uint32Array(buffer, 16 + 12 * nPoints, 3 * nFaces);
  const labels = new Uint32Array(buffer, buffer.byteLength - 4 * nFaces, nFaces);
  return { points, corners, labels };
}

export class Surface {
  constructor(points, corners, thin = new Uint8Array(corners.length / 3)) {
    this.points = points;
    this.corners = corners;
    this.thin = thin;
    this.n = corners.length / 3;
    this.#measure();
    this.beside = neighbours(corners);
  }

  #measure() {
    Object.assign(this, measured(this.points, this.corners));
  }

  /** Squared distance of the middle of triangle `f` from a place. */
  squared(f, [x, y, z]) {
    const m = this.middles;
    return (m[3 * f] - x) ** 2 + (m[3 * f + 1] - y) ** 2 + (m[3 * f + 2] - z) ** 2;
  }

  /** All triangles that can be reached from `start` over edges for which `passes(from, to, edge)`, itself included. */
  reach(start, passes) {
    const seen = new Uint8Array(this.n);
    const found = [start];
    seen[start] = 1;
    for (let i = 0; i < found.length; i++) {
      const f = found[i];
      for (let k = 0; k < 3; k++) {
        const g = this.beside[3 * f + k];
        if (g >= 0 && !seen[g] && passes(f, g, k)) { seen[g] = 1; found.push(g); }
      }
    }
    return found;
  }

  /** What a brush of `radius` touches at `place` on triangle `f`: along the surface, so that nothing leaks to another side. */
  disk(f, place, radius) {
    const limit = radius * radius;
    return this.reach(f, (_, g) => this.squared(g, place) < limit);
  }

  /** The angle between two triangles, degrees: negative in a crease. */
  fold(f, g) {
    const [m, n] = [this.middles, this.normals];
    const dot = n[3 * f] * n[3 * g] + n[3 * f + 1] * n[3 * g + 1] + n[3 * f + 2] * n[3 * g + 2];
    const out = [0, 1, 2].reduce((sum, k) => sum + (m[3 * g + k] - m[3 * f + k]) * n[3 * f + k], 0);
    const angle = (Math.acos(Math.max(-1, Math.min(1, dot))) * 180) / Math.PI;
    return out > 0 ? -angle : angle;
  }

  /** Everything up to creases sharper than `degrees`. */
  fill(f, degrees) {
    return this.reach(f, (a, b) => this.fold(a, b) > -degrees);
  }

  /** The triangles of a piece, or of all where none is named. */
  of(labels, piece) {
    const found = [];
    for (let f = 0; f < this.n; f++) if (labels[f] === piece) found.push(f);
    return found;
  }

  /** Triangles of other pieces that touch `piece` at a corner of the graph: one ring. */
  ring(labels, piece) {
    const ring = new Set();
    for (let f = 0; f < this.n; f++) {
      if (labels[f] !== piece) continue;
      for (let k = 0; k < 3; k++) { const g = this.beside[3 * f + k]; if (g >= 0 && labels[g] !== piece) ring.add(g); }
    }
    return [...ring];
  }

  /** The outermost triangles of `piece`, each with the piece beside it. */
  edge(labels, piece) {
    const edge = [];
    for (let f = 0; f < this.n; f++) {
      if (labels[f] !== piece) continue;
      for (let k = 0; k < 3; k++) { const g = this.beside[3 * f + k]; if (g >= 0 && labels[g] !== piece) { edge.push([f, labels[g]]); break; } }
    }
    return edge;
  }

  /** New labels beside the seams of `piece`: each triangle gets what most of its surroundings have, `rounds` times. */
  smoothed(labels, piece, rounds = 4) {
    let now = labels.slice();
    const near = new Set();
    for (const f of this.ring(labels, piece)) for (const g of this.#around(f, rounds)) near.add(g);
    for (let round = 0; round < rounds; round++) {
      const next = now.slice();
      for (const f of near) next[f] = this.#most(now, f);
      now = next;
    }
    return [...near].filter((f) => now[f] !== labels[f]).map((f) => [f, now[f]]);
  }

  #around(f, rings) {
    let [all, last] = [new Set([f]), [f]];
    for (let k = 0; k < rings; k++) {
      const next = [];
      for (const g of last) for (let e = 0; e < 3; e++) { const h = this.beside[3 * g + e]; if (h >= 0 && !all.has(h)) { all.add(h); next.push(h); } }
      last = next;
    }
    return all;
  }

  // By area, within two rings.
  #most(labels, f) {
    const share = new Map();
    for (const g of this.#around(f, 2)) share.set(labels[g], (share.get(labels[g]) ?? 0) + this.areas[g]);
    let best = labels[f];
    for (const [label, area] of share) if (area > share.get(best)) best = label;
    return best;
  }

  /** The smaller side of `piece` where a plane (normal, offset) cuts the connected part of it that holds `start`; nothing where it does not. */
  cut(labels, piece, start, [nx, ny, nz, offset]) {
    const m = this.middles;
    const part = this.reach(start, (_, g) => labels[g] === piece);
    const side = (f) => nx * m[3 * f] + ny * m[3 * f + 1] + nz * m[3 * f + 2] > offset;
    const above = part.filter(side);
    const below = part.filter((f) => !side(f));
    const area = (list) => list.reduce((sum, f) => sum + this.areas[f], 0);
    if (!above.length || !below.length) return [];
    return area(above) <= area(below) ? above : below;
  }

  /** Edges between triangles of different pieces, as pairs of points. */
  seams(labels) {
    const { corners, beside, points } = this;
    const lines = [];
    for (let f = 0; f < this.n; f++) {
      for (let k = 0; k < 3; k++) {
        const g = beside[3 * f + k];
        if (g <= f || labels[g] === labels[f]) continue;
        const [a, b] = [3 * corners[3 * f + k], 3 * corners[3 * f + ((k + 1) % 3)]];
        lines.push(points[a], points[a + 1], points[a + 2], points[b], points[b + 1], points[b + 2]);
      }
    }
    return new Float32Array(lines);
  }

  /** For each piece: its area and the triangle nearest to its middle. */
  pieces(labels) {
    const sums = new Map();
    for (let f = 0; f < this.n; f++) {
      const sum = sums.get(labels[f]) ?? { piece: labels[f], area: 0, at: [0, 0, 0], n: 0 };
      sum.area += this.areas[f];
      sum.n += 1;
      for (let k = 0; k < 3; k++) sum.at[k] += this.areas[f] * this.middles[3 * f + k];
      sums.set(labels[f], sum);
    }
    const nearest = new Map([...sums.keys()].map((piece) => [piece, [Infinity, -1]]));
    for (const sum of sums.values()) sum.at = sum.at.map((x) => x / (sum.area || 1));
    for (let f = 0; f < this.n; f++) {
      const d = this.squared(f, sums.get(labels[f]).at);
      if (d < nearest.get(labels[f])[0]) nearest.set(labels[f], [d, f]);
    }
    return [...sums.values()].map((sum) => ({ ...sum, face: nearest.get(sum.piece)[1] })).sort((a, b) => a.piece - b.piece);
  }

  /** The box around all points: least, greatest. */
  box() {
    const [least, greatest] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
    this.points.forEach((x, i) => { least[i % 3] = Math.min(least[i % 3], x); greatest[i % 3] = Math.max(greatest[i % 3], x); });
    return [least, greatest];
  }
}

/** Middles, unit normals and areas of all triangles. */
export function measured(points, corners) {
  const n = corners.length / 3;
  const middles = new Float32Array(3 * n);
  const normals = new Float32Array(3 * n);
  const areas = new Float32Array(n);
  for (let f = 0; f < n; f++) {
    const [a, b, c] = [3 * corners[3 * f], 3 * corners[3 * f + 1], 3 * corners[3 * f + 2]];
    for (let k = 0; k < 3; k++) middles[3 * f + k] = (points[a + k] + points[b + k] + points[c + k]) / 3;
    const [ux, uy, uz] = [points[b] - points[a], points[b + 1] - points[a + 1], points[b + 2] - points[a + 2]];
    const [vx, vy, vz] = [points[c] - points[a], points[c + 1] - points[a + 1], points[c + 2] - points[a + 2]];
    const [x, y, z] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    const length = Math.hypot(x, y, z);
    areas[f] = length / 2;
    if (length > 0) normals.set([x / length, y / length, z / length], 3 * f);
  }
  return { middles, normals, areas };
}

// For each edge of each triangle (corner k to k + 1) the triangle beyond it; -1 where there is none. Edges are sorted by their lower point,
// which is quicker than a map of a million pairs.
function neighbours(corners) {
  const n = corners.length;
  const nPoints = corners.reduce((most, v) => Math.max(most, v + 1), 0);
  const low = new Uint32Array(n);
  const high = new Uint32Array(n);
  const start = new Uint32Array(nPoints + 1);
  for (let h = 0; h < n; h++) {
    const [a, b] = [corners[h], corners[h % 3 === 2 ? h - 2 : h + 1]];
    [low[h], high[h]] = a < b ? [a, b] : [b, a];
    start[low[h] + 1] += 1;
  }
  for (let v = 0; v < nPoints; v++) start[v + 1] += start[v];
  const next = start.slice();
  const order = new Uint32Array(n);
  for (let h = 0; h < n; h++) order[next[low[h]]++] = h;
  const beside = new Int32Array(n).fill(-1);
  for (let v = 0; v < nPoints; v++) {
    for (let i = start[v]; i < start[v + 1]; i++) {
      for (let j = i + 1; j < start[v + 1]; j++) {
        const [g, h] = [order[i], order[j]];
        if (high[g] !== high[h] || beside[g] >= 0 || beside[h] >= 0) continue;
        beside[g] = Math.floor(h / 3);
        beside[h] = Math.floor(g / 3);
      }
    }
  }
  return beside;
}

/** The lowest number that no piece has. */
export function unused(labels) {
  const used = new Set(labels);
  let next = 0;
  while (used.has(next)) next += 1;
  return next;
}
