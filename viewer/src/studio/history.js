// Labels that can be changed, taken back and done again, without limit: each step keeps the triangles that it changed and both their labels.

export class History {
  constructor(labels) {
    this.labels = labels;
    this.steps = [];
    this.done = 0;
    this.open = null;
  }

  /** Sets triangles to labels, `[face, label]` each, as part of the step that is open; says which changed. */
  set(pairs) {
    this.open ??= new Map();
    const changed = [];
    for (const [f, label] of pairs) {
      const before = this.labels[f];
      if (before === label) continue;
      if (!this.open.has(f)) this.open.set(f, before);
      this.labels[f] = label;
      changed.push(f);
    }
    return changed;
  }

  /** Ends the step; false where nothing changed. What had been taken back is forgotten. */
  close() {
    const faces = [...(this.open ?? [])].filter(([f, before]) => this.labels[f] !== before);
    this.open = null;
    if (!faces.length) return false;
    const step = { faces: Uint32Array.from(faces, ([f]) => f), before: Uint32Array.from(faces, ([, label]) => label), after: Uint32Array.from(faces, ([f]) => this.labels[f]) };
    this.steps.length = this.done;
    this.steps.push(step);
    this.done += 1;
    return true;
  }

  /** Takes `labels` as one step. */
  replace(labels) {
    this.set(Array.from(labels, (label, f) => [f, label]));
    return this.close();
  }

  get canUndo() { return this.done > 0; }
  get canRedo() { return this.done < this.steps.length; }

  undo() {
    if (!this.canUndo) return [];
    const { faces, before } = this.steps[--this.done];
    faces.forEach((f, i) => { this.labels[f] = before[i]; });
    return [...faces];
  }

  redo() {
    if (!this.canRedo) return [];
    const { faces, after } = this.steps[this.done++];
    faces.forEach((f, i) => { this.labels[f] = after[i]; });
    return [...faces];
  }
}
