"use strict";

const UNKNOWN = 0, FREE = 1, OCCUPIED = 2;
const KEPT_EVERY = 64; // steps between the maps that are kept, for going back

/** One policy's episode, as forestrl/pages/encoding.py writes it. */
class Episode {
  constructor(data) {
    Object.assign(this, data);
    this.steps = data.agent.length - 1;
    this.trunks = new Uint8Array(this.rows * this.columns);
    let at = 0;
    data.trees.forEach((run, i) => { this.trunks.fill(i % 2, at, at + run); at += run; });
    this.map = new Uint8Array(this.trunks.length);
    this.kept = [this.map.slice()];
    this.at = -1;
    this.events = data.agent.flatMap((_, step) => (this.intervened(step) || data.collided[step] ? [step] : []));
  }

  /** Gives the robot's map after so many steps; the same array every time. */
  mapAt(step) {
    if (step < this.at || step - this.at > KEPT_EVERY) {
      const kept = Math.min(Math.floor((step + 1) / KEPT_EVERY), this.kept.length - 1);
      if (step < this.at || kept * KEPT_EVERY - 1 > this.at) {
        this.map.set(this.kept[kept]);
        this.at = kept * KEPT_EVERY - 1;
      }
    }
    while (this.at < step) {
      this.at += 1;
      this.changed(this.at).forEach(([cell, value]) => { this.map[cell] = value; });
      if (this.at + 1 === this.kept.length * KEPT_EVERY) this.kept.push(this.map.slice());
    }
    return this.map;
  }

  /** Lists what became known at a step: [cell, value]. */
  changed(step) {
    let cell = -1;
    return this.changes[step].map((code) => [(cell += code >> 2), code & 3]);
  }

  /** Lists the frontier on the map of a step, in row-major order. */
  frontierAt(step) {
    const map = this.mapAt(step), { rows, columns } = this, found = [];
    for (let row = 0, cell = 0; row < rows; row++) {
      for (let col = 0; col < columns; col++, cell++) {
        if (map[cell] === FREE && this.touchesUnknown(map, row, col)) found.push(cell);
      }
    }
    return found;
  }

  touchesUnknown(map, row, col) {
    const { rows, columns } = this;
    for (let r = Math.max(0, row - 1); r <= Math.min(rows - 1, row + 1); r++) {
      for (let c = Math.max(0, col - 1); c <= Math.min(columns - 1, col + 1); c++) {
        if (map[r * columns + c] === UNKNOWN) return true;
      }
    }
    return false;
  }

  place(cell) {
    return [Math.floor(cell / this.columns), cell % this.columns];
  }

  /** Gives the cell that an action leads to; null outside the arena. */
  target(step, action) {
    const [row, col] = this.place(this.agent[step]), [down, right] = DISPLACEMENTS[action];
    const inside = row + down >= 0 && row + down < this.rows && col + right >= 0 && col + right < this.columns;
    return inside ? (row + down) * this.columns + col + right : null;
  }

  isFeasible(step, action) {
    return Boolean((this.feasible[step] >> action) & 1);
  }

  intervened(step) {
    return this.proposed[step] !== this.executed[step];
  }

  decides(step) {
    return step < this.steps && this.proposed[step] >= 0;
  }

  /** Counts the steps before one at which the filter stepped in, and those with a collision. */
  counts(step) {
    const before = this.events.filter((event) => event < step);
    return [before.filter((event) => this.intervened(event)).length, before.filter((event) => this.collided[event]).length];
  }

  endsAtGoal() {
    return this.coverage[this.steps] >= this.coverage_goal;
  }
}

/** Table I: (row, col) of the actions. */
const DISPLACEMENTS = [[0, 0], [-1, -1], [-1, 0], [-1, 1], [0, -1], [0, 1], [1, -1], [1, 0], [1, 1]];
