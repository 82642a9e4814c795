// Meshes that move from where they stand and come back: the poses of a motion, one after the other.
//
// header.motions[k] = { name, title, is_loop, moves }; may be missing
// moves[j]          = { mesh, about, poses }: each pose is [tx, ty, tz, wx, wy, wz], a displacement of the point `about` and
//                     a rotation vector, radians: x goes to about + t + R(w) (x − about)
// Poses are played evenly in time, and t and w go straight from one to the next. A loop goes on from the last to the first.

const POSE_S = 1.2;
// Motions of so many poses are paths, not single places to be seen: they last so long as a whole.
const LONG_POSES = 10;
const LONG_S = 6;
const REST = [0, 0, 0, 0, 0, 0];

const isRest = (pose) => pose.every((x) => x === 0);

export const poseCount = ({ moves }) => Math.max(0, ...moves.map(({ poses }) => poses.length));

/** Ways between poses, the one back to the first of a loop included. */
const wayCount = (motion) => Math.max(0, motion.is_loop ? poseCount(motion) : poseCount(motion) - 1);

/** How long a motion takes once, in seconds. */
export function duration(motion) {
  return poseCount(motion) < LONG_POSES ? POSE_S * wayCount(motion) : LONG_S;
}

const startsAtRest = ({ moves }) => moves.every(({ poses }) => !poses.length || isRest(poses[0]));

/**
 * What shows so many seconds after the start: the share of the motion that is over, and how much of its poses is seen.
 * Where the first pose is not the assembled one, its part grows first, so that nothing jumps.
 */
export function momentAt(motion, seconds) {
  const once = duration(motion);
  const lead = startsAtRest(motion) ? 0 : once / wayCount(motion) || POSE_S;
  if (seconds < lead) return { share: 0, part: Math.max(0, seconds / lead), isOver: false };
  const share = once > 0 ? (seconds - lead) / once : 1;
  if (motion.is_loop && once > 0) return { share: share % 1, part: 1, isOver: false };
  return { share: Math.min(1, share), part: 1, isOver: share >= 1 };
}

/** The pose of a move when this share of its motion is over. */
export function poseAt({ poses }, share, isLoop) {
  if (!poses.length) return REST;
  const at = share * (isLoop ? poses.length : poses.length - 1);
  const i = Math.min(Math.floor(at), poses.length - 1);
  const next = poses[(i + 1) % poses.length];
  return poses[i].map((x, k) => x + (at - i) * (next[k] - x));
}

/** Plays one motion at a time, and calls `changed` whenever there is something new to see. */
export class Player {
  constructor(motions, changed) {
    this.motions = motions;
    this.changed = changed;
    this.index = -1;
    this.moment = { share: 0, part: 1, isOver: true };
    // How many times as large as they are moves show.
    this.scale = 1;
  }

  get motion() {
    return this.motions[this.index];
  }

  play(index) {
    this.index = index;
    this.stepped = -1;
    const { motion } = this;
    const begin = performance.now();
    const frame = (now) => {
      this.moment = momentAt(motion, (now - begin) / 1000);
      if (!this.moment.isOver) this.frame = requestAnimationFrame(frame);
      this.changed();
    };
    this.moment = momentAt(motion, 0);
    this.frame = requestAnimationFrame(frame);
  }

  /** The next pose of a motion, at once; `false` after the last. For those who do not want to see things move by themselves. */
  step(index) {
    // Where the first pose is the assembled one, it has just been seen.
    const first = startsAtRest(this.motions[index]) && poseCount(this.motions[index]) > 1 ? 1 : 0;
    this.stepped = this.index === index ? this.stepped + 1 : first;
    this.index = index;
    if (this.stepped >= poseCount(this.motion)) return false;
    this.moment = { share: this.stepped / (wayCount(this.motion) || 1), part: 1, isOver: true };
    return true;
  }

  stop() {
    cancelAnimationFrame(this.frame);
    this.index = -1;
  }

  /** Where meshes are now: `{ about, pose }` by mesh, none where nothing plays. */
  places() {
    if (!this.motion) return new Map();
    const { share, part } = this.moment;
    const now = (move) => poseAt(move, share, this.motion.is_loop).map((x) => this.scale * part * x);
    return new Map(this.motion.moves.map((move) => [move.mesh, { about: move.about, pose: now(move) }]));
  }

  /** What is to be read while it plays. */
  caption() {
    if (!this.motion) return "";
    const notes = [];
    if (this.stepped >= 0) notes.push(`pose ${this.stepped + 1} of ${poseCount(this.motion)}`);
    if (this.scale !== 1) notes.push(`shown ${this.scale} times larger`);
    return notes.length ? `${this.motion.title} (${notes.join(", ")})` : this.motion.title;
  }
}
