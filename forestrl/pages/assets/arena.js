"use strict";

/**
 * Draws an arena at a step of an episode: the robot's map ("map"), or the forest itself with a veil
 * over what is not known yet ("forest").
 */
function drawArena(canvas, episode, step, view, ink) {
  const unit = canvas.clientWidth / episode.columns;
  const height = unit * episode.rows;
  const pen = penOf(canvas, canvas.clientWidth, height);
  const frontier = view === "map" ? episode.frontierAt(step) : [];
  pen.imageSmoothingEnabled = false;
  pen.drawImage(cellsOf(episode, step, view, frontier), 0, 0, canvas.clientWidth, height);
  const sheet = new Sheet(pen, unit, episode, step, ink);
  sheet.sensor();
  if (view === "map") sheet.graph(frontier);
  sheet.way();
  sheet.marks();
  if (view === "map") sheet.viewpoints();
  sheet.robot();
}

/** Draws one pixel a cell. */
function cellsOf(episode, step, view, frontier) {
  const { rows, columns, trunks } = episode, map = episode.mapAt(step);
  const image = new ImageData(columns, rows), pixels = new Uint32Array(image.data.buffer);
  if (view === "map") {
    const known = ["unknown", "free", "trunk"].map(pixel);
    map.forEach((value, cell) => { pixels[cell] = known[value]; });
    if (step > 0) {
      const fresh = pixel("new");
      episode.changed(step).forEach(([cell, value]) => { if (value === FREE) pixels[cell] = fresh; });
    }
    const border = pixel("frontier");
    frontier.forEach((cell) => { pixels[cell] = border; });
  } else {
    const [ground, trunk, veil, hidden] = ["ground", "trunk", "veil", "hidden"].map(pixel);
    map.forEach((value, cell) => {
      pixels[cell] = value === UNKNOWN ? (trunks[cell] ? hidden : veil) : trunks[cell] ? trunk : ground;
    });
  }
  const canvas = cellsOf.canvas ??= document.createElement("canvas");
  [canvas.width, canvas.height] = [columns, rows];
  canvas.getContext("2d").putImageData(image, 0, 0);
  return canvas;
}

/** What is drawn over the cells of one arena. */
class Sheet {
  constructor(pen, unit, episode, step, ink) {
    Object.assign(this, { pen, unit, episode, step, ink });
    this.agent = episode.agent[step];
    this.thick = clamp(unit / 5, 1.6, 2.6);
  }

  /** Gives the middle of a cell on the screen: [left, top]. */
  middle(cell) {
    const [row, col] = this.episode.place(cell);
    return [(col + 0.5) * this.unit, (row + 0.5) * this.unit];
  }

  through(cells, style) {
    const { pen } = this;
    pen.save();
    Object.assign(pen, { lineJoin: "round", lineCap: "round", ...style });
    pen.setLineDash(style.dash ?? []);
    pen.beginPath();
    cells.forEach((cell) => pen.lineTo(...this.middle(cell)));
    pen.stroke();
    pen.restore();
  }

  disc(cell, radius, fill, stroke, width = 1.5) {
    const { pen } = this;
    pen.beginPath();
    pen.arc(...this.middle(cell), radius, 0, 2 * Math.PI);
    if (fill) { pen.fillStyle = fill; pen.fill(); }
    if (stroke) { Object.assign(pen, { strokeStyle: stroke, lineWidth: width }); pen.stroke(); }
  }

  sensor() {
    const radius = this.episode.lidar_range * this.unit;
    this.disc(this.agent, radius, `${this.ink}1c`, `${this.ink}99`, 1.2);
  }

  /** Draws Eq. 2's edges, each frontier cell to its waypoint, and Eq. 1's waypoints. */
  graph(frontier) {
    const { pen, episode, step } = this;
    if (!episode.graph || !episode.decides(step)) return;
    pen.save();
    Object.assign(pen, { strokeStyle: colour("edge"), globalAlpha: 0.32, lineWidth: 0.8 });
    pen.beginPath();
    frontier.forEach((cell, i) => {
      const action = Number(episode.waypoints[step][i] ?? 0), [row, col] = episode.place(this.agent);
      if (!action) return;
      const [down, right] = DISPLACEMENTS[action];
      pen.moveTo(...this.middle(cell));
      pen.lineTo((col + right + 0.5) * this.unit, (row + down + 0.5) * this.unit);
    });
    pen.stroke();
    pen.restore();
  }

  way() {
    const cells = this.episode.agent.slice(0, this.step + 1), recent = Math.max(0, this.step - 40);
    const style = { strokeStyle: this.ink, lineWidth: this.thick };
    this.through(cells.slice(0, recent + 1), { ...style, globalAlpha: 0.45 });
    this.through(cells.slice(recent), style);
  }

  marks() {
    const { pen, episode } = this, size = clamp(0.42 * this.unit, 3.2, 6);
    for (const step of episode.events) {
      if (step > this.step) break;
      const [left, top] = this.middle(episode.agent[step]);
      Object.assign(pen, { strokeStyle: colour("card"), lineWidth: 1 });
      if (episode.intervened(step)) diamond(pen, left, top, size, colour("intervention"));
      if (episode.collided[step]) cross(pen, left, top, size, colour("collision"));
    }
  }

  /** Draws the viewpoints that were compared, larger the better, and the way to the goal. */
  viewpoints() {
    const { episode, step, pen } = this, cells = episode.viewpoints[step], way = episode.way[step];
    if (way.length) {
      const style = { strokeStyle: colour("viewpoint"), lineWidth: this.thick, dash: [1, 5] };
      this.through([this.agent, ...way], style);
    }
    relative(episode.scores[step]).map((score, i) => [score, i]).reverse().forEach(([score, i]) => {
      this.disc(cells[i], 2.5 + 4 * score, `${colour("viewpoint")}${i ? "99" : "ff"}`, colour("card"), 1);
    });
    if (way.length) this.disc(way.at(-1), 8.5, null, colour("viewpoint"), 2);
  }

  /** Draws the robot, where it goes, and where it wanted to go if the filter stepped in. */
  robot() {
    const { episode, step } = this;
    if (episode.decides(step)) {
      if (episode.intervened(step)) this.arrow(episode.proposed[step], colour("intervention"));
      this.arrow(episode.executed[step], this.ink);
    }
    this.disc(this.agent, clamp(0.5 * this.unit, 4.5, 8), this.ink, colour("card"), 2);
  }

  arrow(action, ink) {
    const { pen } = this, [down, right] = DISPLACEMENTS[action], [left, top] = this.middle(this.agent);
    const far = Math.max(1.15 * this.unit, 12) / (Math.hypot(down, right) || 1);
    const tip = [left + right * far, top + down * far];
    for (const [style, width] of [[colour("card"), this.thick + 3], [ink, this.thick + 0.6]]) {
      Object.assign(pen, { strokeStyle: style, lineWidth: width, lineCap: "round" });
      pen.beginPath();
      pen.moveTo(left, top);
      pen.lineTo(...tip);
      pen.stroke();
    }
  }
}

/** Puts scores between 0, the worst, and 1, the best. */
function relative(scores) {
  const low = Math.min(...scores), high = Math.max(...scores);
  return scores.map((score) => (high > low ? (score - low) / (high - low) : 1));
}

function diamond(pen, left, top, size, ink) {
  pen.beginPath();
  [[0, -1], [1, 0], [0, 1], [-1, 0]].forEach(([x, y]) => pen.lineTo(left + size * x, top + size * y));
  pen.closePath();
  pen.fillStyle = ink;
  pen.fill();
  pen.stroke();
}

function cross(pen, left, top, size, ink) {
  pen.save();
  Object.assign(pen, { strokeStyle: ink, lineWidth: size / 1.6, lineCap: "round" });
  pen.beginPath();
  for (const turn of [-1, 1]) {
    pen.moveTo(left - size * 0.8, top - turn * size * 0.8);
    pen.lineTo(left + size * 0.8, top + turn * size * 0.8);
  }
  pen.stroke();
  pen.restore();
}
