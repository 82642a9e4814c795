// Reads what the page carries: a JSON header, and one block of base64 with all arrays.
//
// header.meshes[i].points    = { offset, count, min, max }: 3 × uint16 a point, 0 … 65535 from min to max
// header.meshes[i].triangles = { offset, count, bytes }: 3 × uint16 or uint32 a triangle
// header.quantities[j]       = { name, unit, values }: one number or null a mesh, to colour meshes by
// Offsets count bytes. Everything else in the header is text and numbers to show.

export function readPage(document) {
  const header = JSON.parse(document.getElementById("header").textContent);
  const buffer = bytesFromBase64(document.getElementById("arrays").textContent.trim()).buffer;
  return { header, meshes: header.meshes.map((m) => ({ ...m, ...arrays(m, buffer) })) };
}

function bytesFromBase64(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
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

/** Positions and normals, three corners a triangle; normals are smooth up to 40° and break at creases. */
export function shadedCorners(positions, indices) {
  const nFaces = indices.length / 3;
  const area = new Float32Array(3 * nFaces); // face normal × twice the area
  const unit = new Float32Array(3 * nFaces);
  const corners = new Float32Array(9 * nFaces);
  for (let i = 0; i < indices.length; i++) {
    for (let k = 0; k < 3; k++) corners[3 * i + k] = positions[3 * indices[i] + k];
  }
  for (let f = 0; f < nFaces; f++) {
    const c = corners.subarray(9 * f, 9 * f + 9);
    const [ux, uy, uz] = [c[3] - c[0], c[4] - c[1], c[5] - c[2]];
    const [vx, vy, vz] = [c[6] - c[0], c[7] - c[1], c[8] - c[2]];
    const n = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    const length = Math.hypot(...n) || 1;
    for (let k = 0; k < 3; k++) {
      area[3 * f + k] = n[k];
      unit[3 * f + k] = n[k] / length;
    }
  }
  return { corners, normals: creaseNormals(positions.length / 3, indices, area, unit) };
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
    const length = Math.hypot(x, y, z) || 1;
    normals.set([x / length, y / length, z / length], 3 * i);
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
