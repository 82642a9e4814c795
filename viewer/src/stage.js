// The 3D half: meshes, arrows and marks on a canvas. Knows nothing of the panel beside it.

import {
  Box3, BufferAttribute, BufferGeometry, Color, ConeGeometry, CylinderGeometry, DirectionalLight, DoubleSide, BackSide, FrontSide,
  CatmullRomCurve3, CircleGeometry, Group, HemisphereLight, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera, Plane, Quaternion,
  Raycaster, Scene, SphereGeometry, TubeGeometry, Vector2, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { shaded } from "./data.js";
import { carriedBy, carriedMoves, moveAt } from "./sway.js";

const UP = new Vector3(0, 0, 1);
// Frames that follow each other more slowly than this, ms, show drafts.
const SLOW_MS = 30;
// What has not moved for so long, ms, rests.
const REST_MS = 200;
// How much of what is seen through is seen.
const FAINT = 0.3;
// Of what is pointed at.
const SIGN = 0xd33c2f;

// A shaft and a head, unlit, from the origin along +y before it is turned.
class Arrow extends Group {
  constructor(color, isOnTop) {
    super();
    const material = new MeshBasicMaterial({ color, depthTest: !isOnTop, transparent: isOnTop });
    this.shaft = new Mesh(new CylinderGeometry(1, 1, 1, 20).translate(0, 0.5, 0), material);
    this.head = new Mesh(new ConeGeometry(1, 1, 28).translate(0, 0.5, 0), material);
    this.add(this.shaft, this.head);
    if (isOnTop) this.shaft.renderOrder = this.head.renderOrder = 9;
    this.visible = false;
  }

  point(from, direction, length, width) {
    const head = Math.min(2.6 * width, 0.6 * length);
    this.position.copy(from);
    this.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), direction));
    this.shaft.scale.set(0.36 * width, length - head, 0.36 * width);
    this.head.scale.set(width, head, width);
    this.head.position.set(0, length - head, 0);
  }
}

/** Where a pose of a motion puts points: x goes to about + t + R(w) (x − about). */
export function poseMatrix(about, [tx, ty, tz, ...w]) {
  const axis = new Vector3(...w);
  const angle = axis.length();
  const turn = new Matrix4();
  if (angle > 0) turn.makeRotationAxis(axis.divideScalar(angle), angle);
  const center = new Vector3(...about);
  return turn.setPosition(center.clone().add(new Vector3(tx, ty, tz)).sub(center.applyMatrix4(turn)));
}

function shape({ positions, indices }) {
  const { points, normals, indices: corners } = shaded(positions, indices);
  const geometry = new BufferGeometry();
  geometry.setIndex(new BufferAttribute(corners, 1));
  geometry.setAttribute("position", new BufferAttribute(points, 3));
  geometry.setAttribute("normal", new BufferAttribute(normals, 3));
  geometry.computeBoundingBox();
  geometry.computeBoundingSphere();
  return geometry;
}

// Points at rest and a share of their moves.
function bendTo(geometry, amount) {
  const { rest, moves } = geometry.userData;
  if (!moves || geometry.userData.amount === amount) return;
  geometry.userData.amount = amount;
  const { position } = geometry.attributes;
  for (let k = 0; k < rest.length; k++) position.array[k] = rest[k] + amount * moves[k];
  position.needsUpdate = true;
}

export class Stage {
  constructor(holder, meshes, carriers = []) {
    this.holder = holder;
    this.carriers = carriers;
    this.room = 0;
    this.renderer = new WebGLRenderer({ alpha: true, preserveDrawingBuffer: true });
    // Four samples a pixel on plain screens: edges are smooth without the library's own way, which cannot be turned off in motion.
    this.renderer.setPixelRatio(2);
    this.isDraft = false;
    this.isSlow = false;
    this.gaps = [];
    this.last = -Infinity;
    holder.prepend(this.renderer.domElement);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(32, 1, 1, 1e5);
    this.camera.up.copy(UP);
    this.scene.add(new HemisphereLight(0xffffff, 0x9a97a2, 1.8), this.camera);
    // Lights hang on the camera: the side one looks at is always lit.
    for (const [at, strength] of [[[-1.2, 1.4, 1], 1.9], [[1.5, -0.3, 0.6], 0.5]]) {
      const light = new DirectionalLight(0xffffff, strength);
      light.position.set(...at);
      this.camera.add(light, light.target);
    }
    this.clip = new Plane(new Vector3(0, -1, 0), Infinity);
    this.items = meshes.map((m) => this.#add(m));
    this.box = new Box3();
    for (const item of this.items) this.box.union(item.box);
    this.center = this.box.getCenter(new Vector3());
    this.size = this.box.getSize(new Vector3()).length() || 1;
    this.marks = new Group();
    this.signs = new Group();
    this.scene.add(this.marks, this.signs);
    this.bent = { moved: null, amount: 0 };
    this.arrow = new Arrow(SIGN, true);
    this.ways = meshes.map((m) => new Arrow(new Color(...m.color.map((c) => (0.7 * c) / 255)).convertSRGBToLinear(), false));
    this.scene.add(this.arrow, ...this.ways);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.draw());
    new ResizeObserver(() => this.#resize()).observe(holder);
    this.#resize();
    this.lookFrom(new Vector3(0.62, -0.95, 0.42));
  }

  #add(m) {
    const geometry = shape(m);
    const draft = m.draft ? shape(m.draft) : geometry;
    const color = new Color(...m.color.map((c) => c / 255)).convertSRGBToLinear();
    const clippingPlanes = [this.clip];
    const skin = new MeshLambertMaterial({ color, side: FrontSide, clippingPlanes });
    // The back of a closed surface shows only where a plane cuts it; unlit, it looks like the face of the cut.
    const cut = new MeshBasicMaterial({ color: color.clone().multiplyScalar(0.55), side: BackSide, clippingPlanes });
    const group = new Group();
    const inner = new Mesh(geometry, cut);
    inner.visible = false;
    group.add(new Mesh(geometry, skin), inner);
    this.scene.add(group);
    const box = geometry.boundingBox.clone();
    return { group, fine: geometry, draft, skin, cut, inner, box, center: box.getCenter(new Vector3()), shift: new Vector3(...m.shift), travel: new Vector3(...m.travel) };
  }

  #resize() {
    const { clientWidth: w, clientHeight: h } = this.holder;
    if (!w || !h) return;
    this.renderer.setSize(w, h);
    this.camera.aspect = w / h;
    // What stands at the bottom of the canvas covers nothing: the picture's middle moves up.
    this.camera.setViewOffset(w, h, 0, this.room / 2, w, h);
    this.draw();
  }

  /** Keeps so many CSS pixels free at the bottom. */
  leaveRoom(pixels) {
    this.room = Math.min(pixels, this.holder.clientHeight / 2);
    this.#resize();
  }

  /** Draws soon; many calls make one frame. */
  draw() {
    if (this.pending) return;
    this.pending = requestAnimationFrame((now) => {
      this.pending = 0;
      this.#pace(now);
      this.#bend();
      this.renderer.render(this.scene, this.camera);
      this.#drawInset();
      this.afterDraw?.();
      // While it turns, this asks for the next frame.
      if (this.controls.autoRotate) this.controls.update();
    });
  }

  // Drafts while frames follow each other too slowly, everything once nothing moves.
  #pace(now) {
    const gap = now - this.last;
    this.last = now;
    this.gaps = gap < 1000 ? [...this.gaps, gap].slice(-3) : [];
    if (this.gaps.length === 3 && this.gaps.every((ms) => ms > SLOW_MS)) this.isSlow = true;
    if (this.isSlow && this.gaps.length) this.#show(true);
    clearTimeout(this.rest);
    const settle = () => {
      if (this.pending) { this.rest = setTimeout(settle, REST_MS); return; }
      this.last = -Infinity;
      if (this.isDraft) { this.#show(false); this.draw(); }
      this.afterRest?.();
    };
    this.rest = setTimeout(settle, REST_MS);
  }

  #show(isDraft) {
    if (this.isDraft === isDraft) return;
    this.isDraft = isDraft;
    this.renderer.setPixelRatio(isDraft ? 1 : 2);
    for (const { group, fine, draft } of this.items) for (const mesh of group.children) mesh.geometry = isDraft ? draft : fine;
  }

  // From how far what is so large fills the free part of the canvas.
  #distance(size) {
    const half = (this.camera.fov * Math.PI) / 360;
    const free = 1 - this.room / (this.holder.clientHeight || 1);
    return (0.49 * size) / Math.sin(half) / Math.min(free, this.camera.aspect);
  }

  lookFrom(direction, center = this.center, size = this.size) {
    cancelAnimationFrame(this.turning);
    this.controls.target.copy(center);
    this.camera.position.copy(center).addScaledVector(direction.clone().normalize(), this.#distance(size));
    this.camera.near = this.size / 500;
    this.camera.far = this.size * 60;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.draw();
  }

  /** What holds meshes where they are assembled, and mesh `i` also `back` along its way: its middle and its size. */
  around(meshes, i, back) {
    const box = new Box3();
    for (const k of meshes) box.union(this.items[k].box);
    box.union(this.items[i].box).union(this.items[i].box.clone().translate(this.items[i].travel.clone().multiplyScalar(-back)));
    return { center: box.getCenter(new Vector3()), size: box.getSize(new Vector3()).length() };
  }

  /** Turns the camera to look along `direction` at `center`, as near as `size` allows, in `ms`; at once for 0. */
  turnTo(direction, { center, size }, ms) {
    cancelAnimationFrame(this.turning);
    const { target } = this.controls;
    const from = this.camera.position.clone().sub(target);
    const [near, far] = [from.length(), this.#distance(size)];
    const start = target.clone();
    const angles = (v) => [Math.atan2(v.y, v.x), Math.asin(Math.max(-0.999, Math.min(0.999, v.z)))];
    const [a0, b0] = angles(from.normalize());
    let [a1, b1] = angles(direction.clone().normalize().negate());
    // The shorter way round.
    a1 = a0 + Math.atan2(Math.sin(a1 - a0), Math.cos(a1 - a0));
    const look = (share) => {
      const [a, b] = [a0 + share * (a1 - a0), b0 + share * (b1 - b0)];
      const distance = near + share * (far - near);
      target.lerpVectors(start, center, share);
      this.camera.position.set(Math.cos(a) * Math.cos(b), Math.sin(a) * Math.cos(b), Math.sin(b)).multiplyScalar(distance).add(target);
      this.controls.update();
      this.draw();
    };
    if (!ms) return look(1);
    const begin = performance.now();
    const frame = (now) => {
      const share = Math.min(1, Math.max(0, (now - begin) / ms));
      look(share * share * (3 - 2 * share));
      if (share < 1) this.turning = requestAnimationFrame(frame);
    };
    this.turning = requestAnimationFrame(frame);
  }

  /** A second, small view from the other side, `width` CSS pixels wide at the right, `top` below the top; none for 0. */
  inset(width, top = 12) {
    this.insetWidth = width;
    this.insetTop = top;
    this.draw();
  }

  #drawInset() {
    const width = this.insetWidth ?? 0;
    if (!width) return;
    const height = Math.round(0.8 * width);
    const { clientWidth: w, clientHeight: h } = this.holder;
    this.other ??= new PerspectiveCamera(32, 1, 1, 1e5);
    const { other, renderer } = this;
    const target = this.controls.target;
    const away = this.camera.position.clone().sub(target);
    other.up.copy(UP);
    other.position.copy(target).add(new Vector3(-away.x, -away.y, away.z).multiplyScalar(Math.min(1, w / h)));
    other.aspect = width / height;
    other.near = this.camera.near;
    other.far = this.camera.far;
    other.lookAt(target);
    other.updateProjectionMatrix();
    // Lights hang on the camera: they go along for this picture.
    const lights = this.camera.children.slice();
    other.add(...lights);
    this.scene.add(other);
    renderer.setScissorTest(true);
    renderer.setScissor(w - width - 12, h - height - this.insetTop, width, height);
    renderer.setViewport(w - width - 12, h - height - this.insetTop, width, height);
    renderer.clear();
    renderer.render(this.scene, other);
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, w, h);
    this.camera.add(...lights);
  }

  /** Whether most of mesh `i` is hidden by what shows, as the camera looks. */
  isHidden(i) {
    const { group, draft } = this.items[i];
    const points = draft.attributes.position;
    const ray = new Raycaster();
    const others = this.items.filter((item, k) => k !== i && item.group.visible).map((item) => new Mesh(item.draft, item.skin));
    this.items.filter((item, k) => k !== i && item.group.visible).forEach((item, k) => { others[k].matrixWorld.copy(item.group.matrixWorld); });
    const some = [...Array(16).keys()].map((k) => new Vector3().fromBufferAttribute(points, Math.floor((k * points.count) / 16)).add(group.position));
    const hidden = some.filter((p) => {
      const way = this.camera.position.clone().sub(p);
      ray.set(p.clone().addScaledVector(way.normalize(), 0.01 * this.size), way);
      return ray.intersectObjects(others).length > 0;
    });
    return hidden.length > 0.6 * some.length;
  }

  /** Turns the scene on and on, or no more. */
  turn(on) {
    this.controls.autoRotate = on;
    this.draw();
  }

  /** Looks at a mesh from the middle of the scene: at its inner side, where it lies around that. */
  lookFromInside(i) {
    const { center, box, travel } = this.items[i];
    const inwards = this.center.clone().sub(center);
    if (inwards.length() < 0.05 * this.size) inwards.copy(travel);
    if (inwards.lengthSq() === 0) inwards.copy(UP);
    this.lookFrom(inwards, center, 1.15 * box.getSize(new Vector3()).length());
  }

  /** Whether nothing of the carriers is in front of a place that is looked at along `direction`. */
  #isSeen(place, direction) {
    this.skins ??= this.carriers.map(({ positions, indices }) => {
      const geometry = new BufferGeometry();
      geometry.setIndex(new BufferAttribute(indices, 1));
      geometry.setAttribute("position", new BufferAttribute(positions, 3));
      return new Mesh(geometry, new MeshBasicMaterial({ side: DoubleSide }));
    });
    const ray = new Raycaster(place.clone().addScaledVector(direction, 0.02 * this.size), direction);
    return !ray.intersectObjects(this.skins).length;
  }

  /** Looks at `center` from where a place and most of its lines are seen: as it is looked at, where that will do, else from near to that. */
  showPlace({ at, lines = [] }, center, size) {
    const place = new Vector3(...at);
    // A dozen of all points will do.
    const points = lines.flat();
    const some = points.filter((_, i) => i % Math.ceil(points.length / 12) === 0).map((p) => new Vector3(...p));
    const now = this.camera.position.clone().sub(this.controls.target).normalize();
    const around = [now];
    for (const height of [0.45, 0, -0.45]) {
      for (let i = 0; i < 16; i++) around.push(new Vector3(Math.cos((i * Math.PI) / 8), Math.sin((i * Math.PI) / 8), height).normalize());
    }
    const outwards = place.clone().sub(this.center).normalize();
    const share = (d) => some.filter((p) => this.#isSeen(p, d)).length / (some.length || 1);
    // Rather a little aside than along the surface.
    const worth = (d) => d.dot(now) + 0.5 * d.dot(outwards) + 1.5 * share(d);
    const seen = around.filter((d) => this.#isSeen(place, d)).map((d) => ({ d, worth: worth(d) })).sort((a, b) => b.worth - a.worth);
    const isFine = seen.some(({ d }) => d === now) && now.dot(outwards) > 0.2 && share(now) > 0.5;
    this.lookFrom(isFine || !seen.length ? now : seen[0].d, center, size);
  }

  /** Turns to a place, from the side of the middle of the scene it lies on. */
  lookAt(place) {
    const side = place.clone().sub(this.center);
    if (side.lengthSq() < 1e-12) side.set(0.6, -1, 0.4);
    this.lookFrom(side.normalize().add(new Vector3(0, 0, 0.25)), place, 0.45 * this.size);
  }

  /** Fits meshes moved by `share` of their shifts, with room around for `air` times their size. */
  fit(share, air = 1) {
    const box = new Box3();
    for (const item of this.items) box.union(item.box.clone().translate(item.shift.clone().multiplyScalar(share)));
    const from = this.camera.position.clone().sub(this.controls.target);
    this.lookFrom(from, box.getCenter(new Vector3()), air * box.getSize(new Vector3()).length());
  }

  /** Fits the view where moves, so many times as large as they are, lead out of the scene; says whether they do. */
  fitMoves(moves, scale) {
    const reach = this.box.clone();
    for (const { mesh, about, poses } of moves) {
      const { box } = this.items[mesh];
      for (const pose of poses) reach.union(box.clone().applyMatrix4(poseMatrix(about, pose.map((x) => scale * x))));
    }
    const leads = !this.box.clone().expandByScalar(0.05 * this.size).containsBox(reach);
    if (leads) this.lookFrom(this.camera.position.clone().sub(this.controls.target), reach.getCenter(new Vector3()), reach.getSize(new Vector3()).length());
    return leads;
  }

  place(i, offset) {
    const { group } = this.items[i];
    group.position.copy(offset);
    group.quaternion.identity();
  }

  /** Puts a mesh where a pose of a motion has it. */
  pose(i, { about, pose }) {
    const { group } = this.items[i];
    poseMatrix(about, pose).decompose(group.position, group.quaternion, new Vector3());
  }

  /** Gives a mesh another colour, sRGB. */
  paint(i, rgb) {
    const { skin, cut } = this.items[i];
    skin.color.setRGB(...rgb.map((c) => c / 255)).convertSRGBToLinear();
    cut.color.copy(skin.color).multiplyScalar(0.55);
  }

  /** How a mesh shows: hidden, faint (seen through), lit up. */
  show(i, { hidden = false, faint = false, lit = false }) {
    const { group, skin, cut } = this.items[i];
    group.visible = !hidden;
    for (const material of [skin, cut]) {
      // The shader of what is opaque ignores opacity.
      if (material.transparent !== faint) material.needsUpdate = true;
      material.transparent = faint;
      material.opacity = faint ? FAINT : 1;
      material.depthWrite = !faint;
    }
    skin.emissive.copy(skin.color).multiplyScalar(lit ? 0.45 : 0);
  }

  /** Cuts away a share of the scene along an axis: x and z from the far end, y from the near end; 0 cuts nothing. */
  cutAt(axis, share) {
    const away = axis === 1 ? -1 : 1;
    const [low, high] = [this.box.min.getComponent(axis), this.box.max.getComponent(axis)];
    const at = away > 0 ? high - share * (high - low) : low + share * (high - low);
    this.clip.normal.set(0, 0, 0).setComponent(axis, -away);
    this.clip.constant = share > 0 ? away * at : 1e9;
    this.renderer.localClippingEnabled = share > 0;
    for (const { inner } of this.items) inner.visible = share > 0;
    this.draw();
  }

  /** Shows where mesh `i` goes from `offset` on, or not. */
  showWay(i, offset) {
    const { travel, center, box } = this.items[i];
    const arrow = this.ways[i];
    arrow.visible = offset !== null && travel.lengthSq() > 0;
    if (!arrow.visible) return;
    const direction = travel.clone().normalize();
    const extent = box.getSize(new Vector3());
    const half = 0.5 * (Math.abs(direction.x) * extent.x + Math.abs(direction.y) * extent.y + Math.abs(direction.z) * extent.z);
    arrow.point(center.clone().add(offset).addScaledVector(direction, half), direction, 0.09 * this.size, 0.012 * this.size);
  }

  showArrow(i, length) {
    const { travel, center } = this.items[i];
    this.arrow.visible = travel.lengthSq() > 0;
    if (!this.arrow.visible) return;
    const direction = travel.clone().normalize();
    this.arrow.point(center.clone().addScaledVector(direction, -length), direction, 0.85 * length, 0.02 * this.size);
  }

  /** Shows arrows, a floor and a place with its lines, none of them where `signs` is null; they go with what `moved` says that carriers do. */
  sign(signs, moved = null) {
    for (const { geometry, material } of this.signs.children.flatMap((c) => (c.isMesh ? [c] : c.children))) { geometry.dispose(); material.dispose(); }
    this.signs.clear();
    const { arrows = [], floor = null, place = null } = signs ?? {};
    for (const { tip, along } of arrows) {
      const length = 0.16 * this.size;
      const way = new Vector3(...along);
      const arrow = new Arrow(SIGN, true);
      arrow.point(new Vector3(...tip).addScaledVector(way, -1.06 * length), way, length, 0.02 * this.size);
      arrow.visible = true;
      arrow.userData = { rest: arrow.position.clone(), move: moved ? moveAt(this.carriers, moved, tip) : [0, 0, 0] };
      this.signs.add(arrow);
    }
    if (place) {
      const ball = new Mesh(new SphereGeometry(0.009 * this.size, 24, 16), new MeshBasicMaterial({ color: SIGN, depthTest: false, transparent: true, opacity: 0.85 }));
      ball.position.set(...place.at);
      ball.renderOrder = 10;
      ball.userData = { rest: ball.position.clone(), move: moved ? moveAt(this.carriers.filter((_, i) => i === place.mesh), [moved[place.mesh]], place.at) : [0, 0, 0] };
      this.signs.add(ball);
    }
    if (floor) this.signs.add(this.#floor(...floor));
    for (const line of place?.lines ?? []) this.#line(line, this.carriers[place.mesh], moved?.[place.mesh]);
    this.draw();
  }

  // What it stands on, seen from above; from below one looks through it.
  #floor(at, normal) {
    const disc = new Mesh(new CircleGeometry(0.3 * this.size, 64), new MeshBasicMaterial({ color: 0x8d8a96, transparent: true, opacity: 0.3, side: FrontSide, depthWrite: false }));
    disc.quaternion.setFromUnitVectors(UP, new Vector3(...normal));
    disc.position.set(...at).addScaledVector(new Vector3(...normal), -0.002 * this.size);
    return disc;
  }

  // A seam: bold where it is seen, faint where something is in front of it.
  #line(points, carrier, moved) {
    if (points.length < 2) return;
    const curve = new CatmullRomCurve3(points.map((p) => new Vector3(...p)), false, "centripetal");
    const geometry = new TubeGeometry(curve, Math.min(600, 4 * points.length), 0.0045 * this.size, 8);
    const bound = carrier && moved ? carriedBy(carrier, geometry.attributes.position.array) : null;
    geometry.userData = { rest: geometry.attributes.position.array.slice(), moves: bound && carriedMoves(bound, moved), amount: 0 };
    for (const [depthTest, opacity] of [[true, 1], [false, 0.28]]) {
      const tube = new Mesh(geometry, new MeshBasicMaterial({ color: SIGN, transparent: true, opacity, depthTest }));
      tube.renderOrder = 8;
      this.signs.add(tube);
    }
  }

  /** Moves the points of all meshes by a share `amount` of what `moved` says of their carriers' points; null puts them back. */
  sway(moved, amount) {
    this.bent = { moved, amount: moved ? amount : 0 };
    this.draw();
  }

  // The geometries that show, as they are to be bent.
  #bend() {
    const { moved, amount } = this.bent;
    this.items.forEach(({ group }, i) => {
      const { geometry } = group.children[0];
      const data = geometry.userData;
      if (!data.rest) {
        if (!amount) return;
        const rest = geometry.attributes.position.array.slice();
        const bound = this.carriers[i] && carriedBy(this.carriers[i], rest);
        Object.assign(data, { rest, bound, amount: 0 });
        // What is bent still counts as seen.
        geometry.boundingSphere.radius += 0.06 * this.size;
      }
      if (moved && data.moved !== moved) Object.assign(data, { moved, moves: data.bound && carriedMoves(data.bound, moved[i]), amount: NaN });
      bendTo(geometry, amount);
    });
    for (const sign of this.signs.children) {
      if (sign.userData.move) sign.position.copy(sign.userData.rest).addScaledVector(new Vector3(...sign.userData.move), amount);
      if (sign.geometry?.userData.moves) bendTo(sign.geometry, amount);
    }
  }

  mark(place) {
    this.marks.clear();
    if (place) {
      const ball = new Mesh(new SphereGeometry(0.006 * this.size, 24, 16), new MeshBasicMaterial({ color: SIGN, depthTest: false, transparent: true, opacity: 0.85, side: DoubleSide }));
      ball.position.copy(place);
      ball.renderOrder = 10;
      this.marks.add(ball);
    }
    this.draw();
  }

  /** The visible mesh under a point of the window, or −1. */
  pick(clientX, clientY) {
    return this.hit(clientX, clientY).i;
  }

  /** The visible mesh and place under a point of the window: `{ i, point }`, i = −1 for none. */
  hit(clientX, clientY) {
    const r = this.renderer.domElement.getBoundingClientRect();
    const at = new Vector2(((clientX - r.left) / r.width) * 2 - 1, 1 - ((clientY - r.top) / r.height) * 2);
    const ray = new Raycaster();
    ray.setFromCamera(at, this.camera);
    let best = { distance: Infinity, i: -1, point: null };
    this.items.forEach(({ group }, i) => {
      if (!group.visible) return;
      for (const hit of ray.intersectObject(group.children[0])) {
        if (hit.distance < best.distance && this.clip.distanceToPoint(hit.point) >= 0) best = { distance: hit.distance, i, point: hit.point };
      }
    });
    return best;
  }

  /** The middle of mesh `i` where it is now. */
  middle(i) {
    return this.items[i].center.clone().add(this.items[i].group.position);
  }

  /** Where a place stands on the canvas, in CSS pixels; `null` behind the viewer. */
  onScreen(place) {
    const p = place.clone().project(this.camera);
    if (p.z > 1) return null;
    return [((p.x + 1) / 2) * this.holder.clientWidth, ((1 - p.y) / 2) * this.holder.clientHeight];
  }
}
