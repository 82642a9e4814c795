// The canvas: the surface with its pieces, seams, numbers, ghosts of keys, and where the pointer is. Draws only when something changes.

import {
  BufferAttribute, BufferGeometry, DirectionalLight, DoubleSide, Group, HemisphereLight, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial,
  MeshLambertMaterial, MOUSE, PerspectiveCamera, Raycaster, RingGeometry, Scene, TOUCH, Vector2, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { MeshBVH } from "three-mesh-bvh";
import { colour } from "./colours.js";
import { cornerNormals } from "../data.js";
import { element } from "./dom.js";

const BODY = [188, 184, 178];
const INK = 0x1e1c24;
const GHOST = 0x2f6fdb;
const CHOSEN = 0xd33c2f;
const HALF_FOV = (16 * Math.PI) / 180;
const REST_MS = 250;
// Where frames take longer than this, the picture is coarser as long as it changes.
const SLOW_MS = 55;
const COARSE = 0.6;
// Smooth edges by the renderer cost a software renderer half of its frames: it draws still pictures finer instead.
const FINER = 1.5;
// Rays that look for where numbers are seen.
const GRID_RAYS = 2500;

export class View {
  constructor(holder) {
    this.holder = holder;
    const isSoftware = rendersInSoftware();
    this.renderer = new WebGLRenderer({ antialias: !isSoftware, alpha: true });
    this.fine = isSoftware ? FINER : Math.min(2, devicePixelRatio);
    this.renderer.setPixelRatio(this.fine);
    this.renderer.domElement.tabIndex = 0;
    this.renderer.domElement.setAttribute("role", "img");
    holder.prepend(this.renderer.domElement);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera((HALF_FOV * 360) / Math.PI, 1, 1, 1e5);
    this.camera.up.set(0, 0, 1);
    this.scene.add(new HemisphereLight(0xffffff, 0x9a97a2, 1.9), this.camera);
    for (const [at, strength] of [[[-1.2, 1.4, 1], 1.7], [[1.5, -0.3, 0.6], 0.5]]) {
      const light = new DirectionalLight(0xffffff, strength);
      light.position.set(...at);
      this.camera.add(light, light.target);
    }
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.draw());
    this.ray = new Raycaster();
    this.ray.firstHitOnly = true;
    this.seams = lines(INK, 1);
    this.smooth = lines(INK, 1);
    this.keys = new Group();
    this.ring = new Mesh(new RingGeometry(0.96, 1, 64), new MeshBasicMaterial({ color: INK, side: DoubleSide, depthTest: false, transparent: true, opacity: 0.8 }));
    this.ring.visible = false;
    this.scene.add(this.seams, this.smooth, this.keys, this.ring);
    this.tags = element("div", "tags");
    this.tags.setAttribute("aria-hidden", "true");
    holder.append(this.tags);
    new ResizeObserver(() => this.#resize()).observe(holder);
    this.#resize();
  }

  /** Shows a surface; the camera goes around where it is another size. */
  show(surface) {
    this.surface = surface;
    if (this.mesh) { this.scene.remove(this.mesh); this.mesh.geometry.dispose(); this.mesh.material.dispose(); }
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(spread(surface.points, surface.corners), 3));
    geometry.setAttribute("normal", new BufferAttribute(cornerNormals(surface.points, surface.corners), 3));
    this.colours = new BufferAttribute(new Uint8Array(9 * surface.n), 3, true);
    geometry.setAttribute("color", this.colours);
    geometry.setAttribute("thin", new BufferAttribute(Float32Array.from({ length: 3 * surface.n }, (_, v) => surface.thin[Math.floor(v / 3)]), 1));
    // The tree keeps triangles in their order.
    this.tree = new MeshBVH(geometry, { indirect: true });
    this.mesh = new Mesh(geometry, skin((shader) => { this.shader = shader; shader.uniforms.showsThin.value = this.showsThin ? 1 : 0; }));
    this.scene.add(this.mesh);
    const [least, greatest] = surface.box().map((p) => new Vector3(...p));
    this.center = least.clone().add(greatest).multiplyScalar(0.5);
    const size = greatest.distanceTo(least);
    if (Math.abs(size - (this.size ?? 0)) > 1e-3 * size) { this.size = size; this.home(); }
    this.paint(null);
  }

  /** Shows the surface as it will be cut instead, until something is painted; nothing for null. */
  showCut(cut) {
    if (this.cut) { this.scene.remove(this.cut); this.cut.geometry.dispose(); this.cut.material.dispose(); this.cut = null; }
    if (cut) {
      const geometry = new BufferGeometry();
      const { points, corners, labels } = cut;
      geometry.setAttribute("position", new BufferAttribute(spread(points, corners), 3));
      geometry.setAttribute("normal", new BufferAttribute(cornerNormals(points, corners), 3));
      const colours = new Uint8Array(9 * labels.length);
      labels.forEach((label, f) => { const c = colour(label); for (let k = 0; k < 9; k++) colours[9 * f + k] = c[k % 3]; });
      geometry.setAttribute("color", new BufferAttribute(colours, 3, true));
      this.cut = new Mesh(geometry, new MeshLambertMaterial({ vertexColors: true, polygonOffset: true, polygonOffsetFactor: 1.5, polygonOffsetUnits: 1.5 }));
      this.scene.add(this.cut);
    }
    this.#choose();
  }

  // Where the cut surface is known it is shown, but for stripes and strokes.
  #choose() {
    if (!this.mesh) return;
    const isCut = Boolean(this.cut) && !this.showsThin;
    this.mesh.visible = !isCut;
    if (this.cut) this.cut.visible = isCut;
    this.seams.visible = !isCut && this.seams.geometry.attributes.position?.count > 0;
    this.draw();
  }

  /** Colours triangles by their pieces: `faces`, or all. Without labels all is one body. */
  paint(labels, faces) {
    if (!this.surface) return;
    this.labels = labels;
    if (this.cut) this.showCut(null);
    const colours = this.colours.array;
    const one = (f) => { const c = labels ? colour(labels[f]) : BODY; for (let k = 0; k < 9; k++) colours[9 * f + k] = c[k % 3]; };
    let [first, last] = [0, this.surface.n - 1];
    if (faces) {
      [first, last] = [Infinity, -1];
      for (const f of faces) { one(f); first = Math.min(first, f); last = Math.max(last, f); }
      if (last < 0) return;
    } else {
      for (let f = 0; f <= last; f++) one(f);
    }
    this.colours.addUpdateRange(9 * first, 9 * (last - first + 1));
    this.colours.needsUpdate = true;
    this.draw();
  }

  /** Draws the seams between triangles as they are labelled, and the pieces' numbers. */
  outline(labels) {
    const edges = labels ? this.surface.seams(labels) : new Float32Array();
    setLines(this.seams, edges);
    this.#tag(labels ? this.surface.pieces(labels) : []);
    this.#choose();
  }

  /** Smooth seams as they will be cut. */
  smoothSeams(seams) {
    const pairs = seams.flatMap((line) => {
      const out = [];
      for (let i = 0; i + 5 < line.length; i += 3) out.push(...line.slice(i, i + 6));
      return out;
    });
    setLines(this.smooth, new Float32Array(pairs));
    this.draw();
  }

  /** Stripes where the model is too thin to be hollow. */
  stripes(isOn) {
    this.showsThin = isOn;
    if (this.shader) this.shader.uniforms.showsThin.value = isOn ? 1 : 0;
    this.#choose();
  }

  /** Places for a key as ghosts that slide out along arrows. */
  showKeys(keys) {
    this.keys.clear();
    keys.forEach((key, i) => this.keys.add(ghost(key, i, 0.004 * this.size)));
    this.draw();
  }

  /** What lies below a place of the window, CSS pixels: triangle and place; null where nothing does. */
  pick(x, y) {
    if (!this.tree) return null;
    this.#aim(x, y);
    const hit = this.tree.raycastFirst(this.ray.ray, DoubleSide);
    return hit ? { face: hit.faceIndex, at: hit.point.toArray(), normal: hit.face.normal.toArray() } : null;
  }

  /** The number of the ghost below a place of the window; -1 where there is none. */
  pickKey(x, y) {
    this.#aim(x, y);
    this.ray.firstHitOnly = false;
    const hit = this.ray.intersectObjects(this.keys.children, true)[0];
    return hit ? hit.object.parent.userData.number : -1;
  }

  #aim(x, y) {
    const box = this.renderer.domElement.getBoundingClientRect();
    this.ray.setFromCamera(new Vector2((2 * (x - box.left)) / box.width - 1, 1 - (2 * (y - box.top)) / box.height), this.camera);
  }

  /** The plane through the eye and two places of the window: normal, offset. */
  plane([x0, y0], [x1, y1]) {
    this.#aim(x0, y0);
    const [eye, a] = [this.ray.ray.origin.clone(), this.ray.ray.direction.clone()];
    this.#aim(x1, y1);
    const normal = a.cross(this.ray.ray.direction).normalize();
    return [...normal.toArray(), normal.dot(eye)];
  }

  /** Where a place of the model is in the canvas, CSS pixels, and whether it is in front. */
  project(at) {
    const p = new Vector3(...at).project(this.camera);
    const { clientWidth: w, clientHeight: h } = this.holder;
    return { x: ((p.x + 1) / 2) * w, y: ((1 - p.y) / 2) * h, isAhead: p.z < 1 };
  }

  /** Whether nothing of the model hides the middle of a triangle. */
  isSeen(f) {
    const at = new Vector3(...this.surface.middles.slice(3 * f, 3 * f + 3));
    const eye = this.camera.position;
    const way = at.clone().sub(eye);
    if (way.dot(new Vector3(...this.surface.normals.slice(3 * f, 3 * f + 3))) >= 0) return false;
    this.ray.set(eye.clone(), way.clone().normalize());
    const hit = this.tree.raycastFirst(this.ray.ray, DoubleSide);
    return !hit || hit.faceIndex === f || hit.distance > way.length() - 1e-3 * this.size;
  }

  /** A ring where the brush touches. */
  cursor(hit, radius) {
    this.ring.visible = Boolean(hit) && radius > 0;
    if (this.ring.visible) {
      const normal = new Vector3(...hit.normal);
      this.ring.position.set(...hit.at).addScaledVector(normal, 0.002 * this.size);
      this.ring.quaternion.setFromUnitVectors(new Vector3(0, 0, 1), normal);
      this.ring.scale.setScalar(radius);
    }
    this.draw();
  }

  /** What the left button or one finger does: turns the model, or not. */
  turns(isOn) {
    this.controls.mouseButtons = { LEFT: isOn ? MOUSE.ROTATE : null, MIDDLE: MOUSE.DOLLY, RIGHT: isOn ? MOUSE.PAN : MOUSE.ROTATE };
    this.controls.touches = { ONE: isOn ? TOUCH.ROTATE : null, TWO: isOn ? TOUCH.DOLLY_PAN : TOUCH.DOLLY_ROTATE };
  }

  home() {
    this.look(new Vector3(0.62, -0.95, 0.42), this.center);
  }

  /** Looks at a place from outside. */
  lookAt(at) {
    const place = new Vector3(...at);
    const away = place.clone().sub(this.center);
    this.look(away.length() > 0.05 * this.size ? away : new Vector3(0.62, -0.95, 0.42), this.center);
  }

  look(direction, target) {
    const distance = (0.52 * this.size) / Math.sin(HALF_FOV) / Math.min(1, this.camera.aspect);
    const way = direction.clone().normalize();
    // Straight from above or below the camera would not know where up is.
    if (Math.abs(way.z) > 0.98) way.set(0.1, -0.17, way.z).normalize();
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(way, distance);
    this.camera.near = this.size / 200;
    this.camera.far = this.size * 40;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.draw();
  }

  draw() {
    this.pending ??= requestAnimationFrame((now) => {
      this.pending = undefined;
      this.#pace(now);
      this.renderer.render(this.scene, this.camera);
      this.frames = (this.frames ?? 0) + 1;
      this.#placeTags();
      clearTimeout(this.rest);
      this.rest = setTimeout(() => this.#settle(), REST_MS);
    });
  }

  // Frames that follow one another tell how long one takes.
  #pace(now) {
    const gap = now - (this.last ?? -Infinity);
    this.last = now;
    if (gap > 2 * REST_MS) this.slow = 0;
    else if (gap > SLOW_MS) this.slow += 1;
    if (this.slow > 2) this.#coarsen(COARSE);
  }

  // At rest the picture is as fine as it can be, and numbers stand where they are seen best.
  #settle() {
    if (this.#coarsen(1)) this.renderer.render(this.scene, this.camera);
    this.#seekTags();
  }

  #coarsen(factor) {
    const ratio = factor * this.fine;
    if (this.renderer.getPixelRatio() === ratio) return false;
    this.renderer.setPixelRatio(ratio);
    return true;
  }

  #resize() {
    const { clientWidth: w, clientHeight: h } = this.holder;
    if (!w || !h) return;
    this.renderer.setSize(w, h);
    this.camera.aspect = w / h;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  #tag(pieces) {
    this.tags.replaceChildren(...pieces.map(({ piece }) => {
      const tag = element("span", "tag", String(piece + 1));
      [tag.piece, tag.hidden] = [piece, true];
      return tag;
    }));
  }

  // Numbers go with their places at once.
  #placeTags() {
    for (const tag of this.tags.children) {
      if (!tag.at) continue;
      const { x, y } = this.project(tag.at);
      tag.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -50%)`;
    }
  }

  // Rays on a grid find what is seen of each piece; its number stands on the one nearest to their middle.
  #seekTags() {
    if (!this.labels || !this.tags.children.length) return;
    const seen = this.seen();
    for (const tag of this.tags.children) {
      const spots = seen.get(tag.piece);
      tag.hidden = !spots;
      if (!spots) continue;
      const mean = [0, 1].map((k) => spots.reduce((sum, s) => sum + s.xy[k], 0) / spots.length);
      const off = (s) => (s.xy[0] - mean[0]) ** 2 + (s.xy[1] - mean[1]) ** 2;
      const best = spots.reduce((a, b) => (off(b) < off(a) ? b : a));
      tag.at = best.at;
      tag.style.transform = `translate(${best.xy[0]}px, ${best.xy[1]}px) translate(-50%, -50%)`;
    }
  }

  /** For each piece that is seen: places of it on a grid of the canvas, with their triangles. */
  seen() {
    const box = this.renderer.domElement.getBoundingClientRect();
    const step = Math.max(8, Math.sqrt((box.width * box.height) / GRID_RAYS));
    const found = new Map();
    for (let y = step / 2; y < box.height; y += step) {
      for (let x = step / 2; x < box.width; x += step) {
        const hit = this.pick(box.left + x, box.top + y);
        if (!hit) continue;
        const piece = this.labels[hit.face];
        if (!found.has(piece)) found.set(piece, []);
        found.get(piece).push({ xy: [x, y], at: hit.at, face: hit.face });
      }
    }
    return found;
  }
}

function rendersInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const info = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

// A value of each corner of each triangle, three after another.
function spread(values, corners) {
  const out = new Float32Array(3 * corners.length);
  for (let v = 0; v < corners.length; v++) for (let k = 0; k < 3; k++) out[3 * v + k] = values[3 * corners[v] + k];
  return out;
}

// Lit, with stripes where triangles are thin.
function skin(onShader) {
  const material = new MeshLambertMaterial({ vertexColors: true, polygonOffset: true, polygonOffsetFactor: 1.5, polygonOffsetUnits: 1.5 });
  material.onBeforeCompile = (shader) => {
    shader.uniforms.showsThin = { value: 0 };
    shader.vertexShader = `attribute float thin;\nvarying float vThin;\n${shader.vertexShader}`.replace("#include <begin_vertex>", "#include <begin_vertex>\nvThin = thin;");
    shader.fragmentShader = `uniform float showsThin;\nvarying float vThin;\n${shader.fragmentShader}`.replace(
      "#include <color_fragment>",
      "#include <color_fragment>\nif (showsThin > 0.5 && vThin > 0.5) diffuseColor.rgb = mod(gl_FragCoord.x + gl_FragCoord.y, 12.0) < 6.0 ? vec3(0.62, 0.05, 0.03) : vec3(0.95, 0.55, 0.45);",
    );
    onShader(shader);
  };
  return material;
}

function lines(color) {
  return new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color }));
}

function setLines(object, positions) {
  object.geometry.dispose();
  object.geometry = new BufferGeometry();
  object.geometry.setAttribute("position", new BufferAttribute(positions, 3));
  object.visible = positions.length > 0;
}

// The outline of a key on the surface, and an arrow along which it slides out.
function ghost({ outline, at, slide, normal, is_chosen: isChosen }, number, width) {
  const group = new Group();
  group.userData.number = number;
  const color = isChosen ? CHOSEN : GHOST;
  const [a, b, c, d] = outline;
  const sheet = new BufferGeometry();
  sheet.setAttribute("position", new BufferAttribute(new Float32Array([...a, ...b, ...c, ...a, ...c, ...d]), 3));
  group.add(new Mesh(sheet, new MeshBasicMaterial({ color, side: DoubleSide, transparent: true, opacity: isChosen ? 0.75 : 0.4, depthWrite: false })));
  const [from, way, up] = [at, slide, normal].map((v) => new Vector3(...v));
  const length = new Vector3(...a).distanceTo(new Vector3(...d));
  const arrow = new BufferGeometry();
  const across = way.clone().cross(up).normalize();
  const point = (along, side) => from.clone().addScaledVector(up, 3 * width).addScaledVector(way, along * length).addScaledVector(across, side * length);
  const corners = [[0, 0.05], [0, -0.05], [0.6, 0.05], [0.6, 0.05], [0, -0.05], [0.6, -0.05], [0.6, 0.16], [0.6, -0.16], [0.95, 0]].map(([x, y]) => point(x, y));
  arrow.setAttribute("position", new BufferAttribute(new Float32Array(corners.flatMap((p) => p.toArray())), 3));
  group.add(new Mesh(arrow, new MeshBasicMaterial({ color, side: DoubleSide, depthTest: false })));
  return group;
}
