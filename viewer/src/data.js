// Reads what the page carries: a JSON header, and one block of base64 with all arrays, deflated (zlib).
//
// header.meshes[i].packed    = { offset, points, triangles, bytes, min, max }: coordinates 0 … 65535 from min to max, each less that of the
//                              point before; then corners of `bytes` bytes: the first less that of the triangle before, the others less the
//                              first. Of all these numbers the lowest byte of each, then the next of each.
// header.meshes[i].draft     = the same, coarser, for what moves on slow machines; may be missing
// header.meshes[i].look      = from where it is seen as it arrives, from the viewer to the scene; may be missing
// header.tabs                = pages of tables, texts, pictures and files: see panel.js; may be missing
// carriers: points           = { offset, count, min, max }: 3 × uint16 a point, 0 … 65535 from min to max
//           triangles        = { offset, count, bytes }: 3 × uint16 or uint32 a triangle
// header.quantities[j]       = { name, unit, values }: one number or null a mesh, to colour meshes by
// header.motions             = what moves how: see motion.js; may be missing
// header.loads              = what loads do to meshes: see sway.js; may be missing
// Offsets count bytes. Everything else in the header is text and numbers to show.

import { unzlibSync } from "fflate";

export function readPage(document) {
  const header = JSON.parse(document.getElementById("header").textContent);
  const bytes = unzlibSync(bytesFromBase64(document.getElementById("arrays").textContent.trim()));
  // A copy, so that arrays begin where the offsets say.
  const buffer = bytes.slice().buffer;
  const meshes = header.meshes.map((m) => ({ ...m, ...unpacked(m.packed, buffer), draft: m.draft && unpacked(m.draft, buffer) }));
  return { header, meshes, ...loadArrays(header.loads, buffer) };
}

// How far the points of carriers go shows as large as the load is to show.
function loadArrays(all, buffer) {
  const moved = ({ moved, step_mm, scale }) => moved.map(({ offset, count }) => Float32Array.from(new Int16Array(buffer, offset, 3 * count), (x) => x * step_mm * scale));
  return {
    carriers: (all?.carriers ?? []).map((c) => arrays(c, buffer)),
    loads: (all?.loads ?? []).map((l) => ({ ...l, moved: moved(l) })),
  };
}

function bytesFromBase64(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

/** A packed mesh: positions and indices. */
export function unpacked({ offset, points, triangles, bytes, min, max }, buffer) {
  const [n, m] = [3 * points, 3 * triangles];
  const low = new Uint8Array(buffer, offset, n);
  const high = new Uint8Array(buffer, offset + n, n);
  const positions = new Float32Array(n);
  const step = [0, 0, 0];
  for (let i = 0; i < n; i++) {
    const axis = i % 3;
    step[axis] = (step[axis] + low[i] + 256 * high[i]) & 65535;
    positions[i] = min[axis] + (step[axis] / 65535) * (max[axis] - min[axis]);
  }
  const corners = new Uint8Array(buffer, offset + 2 * n, bytes * m);
  const indices = bytes === 2 ? new Uint16Array(m) : new Uint32Array(m);
  let first = 0;
  for (let i = 0; i < m; i++) {
    let value = 0;
    for (let b = 0; b < bytes; b++) value += corners[b * m + i] * 2 ** (8 * b);
    if (i % 3 === 0) { first += value; indices[i] = first; } else indices[i] = first + value;
  }
  return { positions, indices };
}

function arrays({ points, triangles }, buffer) {
  const steps = new Uint16Array(buffer, points.offset, 3 * points.count);
  const positions = new Float32Array(steps.length);
  for (let i = 0; i < steps.length; i++) {
    const axis = i % 3;
    positions[i] = points.min[axis] + (steps[i] / 65535) * (points.max[axis] - points.min[axis]);
  }
  const Index = triangles.bytes === 2 ? Uint16Array : Uint32Array;
  return { positions, indices: new Index(buffer, triangles.offset, 3 * triangles.count) };
}

/** Points with normals, and the triangles between them: normals are smooth up to 40°, and a point on a crease is there more than once. */
export function shaded(positions, indices) {
  const corners = cornerNormals(positions, indices);
  // The points that stand for each given one: `first`, then `next` after `next`.
  const first = new Int32Array(positions.length / 3).fill(-1);
  const next = new Int32Array(indices.length).fill(-1);
  const points = new Float32Array(3 * indices.length);
  const normals = new Float32Array(3 * indices.length);
  const triangles = new Uint32Array(indices.length);
  let n = 0;
  for (let i = 0; i < indices.length; i++) {
    const [x, y, z] = [corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]];
    let at = first[indices[i]];
    while (at >= 0 && (normals[3 * at] !== x || normals[3 * at + 1] !== y || normals[3 * at + 2] !== z)) at = next[at];
    if (at < 0) {
      at = n++;
      next[at] = first[indices[i]];
      first[indices[i]] = at;
      normals.set([x, y, z], 3 * at);
      for (let k = 0; k < 3; k++) points[3 * at + k] = positions[3 * indices[i] + k];
    }
    triangles[i] = at;
  }
  return { points: points.slice(0, 3 * n), normals: normals.slice(0, 3 * n), indices: triangles };
}

/** A normal for each corner of each triangle. */
export function cornerNormals(positions, indices) {
  const nFaces = indices.length / 3;
  const area = new Float32Array(3 * nFaces); // face normal × twice the area
  const unit = new Float32Array(3 * nFaces);
  for (let f = 0; f < nFaces; f++) {
    const [a, b, c] = [3 * indices[3 * f], 3 * indices[3 * f + 1], 3 * indices[3 * f + 2]];
    const [ux, uy, uz] = [positions[b] - positions[a], positions[b + 1] - positions[a + 1], positions[b + 2] - positions[a + 2]];
    const [vx, vy, vz] = [positions[c] - positions[a], positions[c + 1] - positions[a + 1], positions[c + 2] - positions[a + 2]];
    const [x, y, z] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    const length = Math.sqrt(x * x + y * y + z * z) || 1;
    area[3 * f] = x;
    area[3 * f + 1] = y;
    area[3 * f + 2] = z;
    unit[3 * f] = x / length;
    unit[3 * f + 1] = y / length;
    unit[3 * f + 2] = z / length;
  }
  return creaseNormals(positions.length / 3, indices, area, unit);
}

function creaseNormals(nPoints, indices, area, unit) {
  const first = new Uint32Array(nPoints + 1);
  for (const v of indices) first[v + 1]++;
  for (let v = 0; v < nPoints; v++) first[v + 1] += first[v];
  const faces = new Uint32Array(indices.length);
  const fill = first.slice();
  for (let i = 0; i < indices.length; i++) faces[fill[indices[i]]++] = (i / 3) | 0;
  const normals = new Float32Array(3 * indices.length);
  for (let i = 0; i < indices.length; i++) {
    const own = 3 * ((i / 3) | 0);
    let [x, y, z] = [0, 0, 0];
    for (let at = first[indices[i]]; at < first[indices[i] + 1]; at++) {
      const other = 3 * faces[at];
      const cos = unit[own] * unit[other] + unit[own + 1] * unit[other + 1] + unit[own + 2] * unit[other + 2];
      if (cos > 0.766) {
        x += area[other];
        y += area[other + 1];
        z += area[other + 2];
      }
    }
    const length = Math.sqrt(x * x + y * y + z * z) || 1;
    normals[3 * i] = x / length;
    normals[3 * i + 1] = y / length;
    normals[3 * i + 2] = z / length;
  }
  return normals;
}

// Violet to yellow, even in lightness, and light enough for a dark ground: the order shows without hue, too.
const RAMP = [[96, 80, 160], [72, 106, 172], [54, 133, 172], [42, 157, 162], [52, 180, 140], [98, 201, 110], [150, 216, 80], [200, 226, 70], [244, 232, 84]];
export const RAMP_CSS = `linear-gradient(to right, ${RAMP.map((c) => `rgb(${c.join(",")})`).join(",")})`;
const NO_VALUE = [150, 147, 156];

/** The colour of each mesh by a quantity, sRGB; grey where it has no value. And the least and the greatest value. */
export function shades({ values }) {
  const known = values.filter((v) => v !== null);
  const [low, high] = [Math.min(...known), Math.max(...known)];
  const color = (value) => {
    const at = ((value - low) / (high - low || 1)) * (RAMP.length - 1);
    const i = Math.min(Math.floor(at), RAMP.length - 2);
    return RAMP[i].map((c, k) => Math.round(c + (at - i) * (RAMP[i + 1][k] - c)));
  };
  return { low, high, hasGaps: known.length < values.length, colors: values.map((v) => (v === null ? NO_VALUE : color(v))) };
}
