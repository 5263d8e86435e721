"use strict";

const CAPTIONS = { map: "What the robot knows", forest: "The forest" };

const CURVES = { left: 52, right: 14, top: 8, bottom: 22 };

const words = (name) => name.replaceAll("_", " ");

/** One policy on the page: its arena, its coverage and its decision. */
class Card {
  constructor(episode, index, behind) {
    this.episode = episode;
    this.paint = `policy-${index % DASHES.length}`;
    this.canvases = ["map", "forest"].map((view) => make("canvas", { role: "img", "data-view": view }));
    this.figures = this.canvases.map((canvas) => make("figure", {}, canvas, make("figcaption", {}, CAPTIONS[canvas.dataset.view])));
    this.covered = make("span", { class: "covered" });
    this.decision = new Decision(episode);
    this.sample = make("canvas", { "aria-hidden": "true" });
    this.dash = DASHES[index % DASHES.length];
    const name = make("div", { class: "name" }, this.sample, make("h2", {}, words(episode.name)), this.covered);
    const body = make("div", { class: "body" }, make("div", { class: "views" }, ...this.figures), this.decision.element);
    this.element = make("article", { class: "card", style: `--mine: var(--${this.paint})` }, name, moments(episode, behind), body);
    this.canvases.forEach((canvas) => { canvas.style.aspectRatio = `${episode.columns} / ${episode.rows}`; });
  }

  choose(view) {
    this.figures.forEach((figure, i) => { figure.hidden = view !== "both" && view !== this.canvases[i].dataset.view; });
  }

  draw(step, view) {
    const at = Math.min(step, this.episode.steps);
    this.drawSample();
    this.canvases.forEach((canvas) => {
      if (view !== "both" && view !== canvas.dataset.view) return;
      drawArena(canvas, this.episode, at, canvas.dataset.view, colour(this.paint));
      canvas.setAttribute("aria-label", `${CAPTIONS[canvas.dataset.view]}, ${words(this.episode.name)}, step ${at}`);
    });
    this.covered.textContent = percent(this.episode.coverage[at]);
    this.decision.show(at);
  }

  /** Draws a piece of the policy's line. */
  drawSample() {
    const pen = penOf(this.sample, 30, 12);
    Object.assign(pen, { strokeStyle: colour(this.paint), fillStyle: colour(this.paint), lineWidth: 2.4 });
    pen.setLineDash(this.dash);
    pen.beginPath();
    pen.moveTo(0, 6);
    pen.lineTo(24, 6);
    pen.stroke();
    pen.setLineDash([]);
    pen.beginPath();
    pen.arc(25, 6, 5, 0, 2 * Math.PI);
    pen.fill();
  }

  spoken(step) {
    const at = Math.min(step, this.episode.steps);
    return `${words(this.episode.name)}, step ${at}: ${percent(this.episode.coverage[at])} covered. ${this.decision.why.textContent}`;
  }
}

/** Gives links to where a policy falls behind the best of the others for good, and to its end. */
function moments(episode, behind) {
  const { steps } = episode, link = (step, text) => make("a", { href: `#step=${step}` }, `${text} ${step}`);
  const end = link(steps, episode.endsAtGoal() ? "at the goal at step" : "ends at step");
  return make("p", { class: "small" }, ...(behind === null ? [end] : [link(behind, "behind for good from step"), " · ", end]));
}

/** Draws the coverage of all policies, with a cursor at the present step. */
function drawCurves(canvas, { episodes, last, step, data }) {
  const goal = episodes[0].coverage_goal, plot = curvesOf(canvas, last);
  plot.level(goal);
  data.behind.forEach((moment, i) => {
    if (moment === null) return;
    plot.upright(moment, colour(`policy-${i % DASHES.length}`), [2, 3]);
  });
  plot.upright(step, colour("ink"));
  episodes.forEach((episode, i) => {
    const ink = colour(`policy-${i % DASHES.length}`), dash = DASHES[i % DASHES.length];
    const xs = episode.coverage.map((_, x) => x), at = Math.min(step, episode.steps);
    plot.line(xs, episode.coverage, ink, { dash, alpha: 0.35 });
    plot.line(xs.slice(0, at + 1), episode.coverage.slice(0, at + 1), ink, { dash, width: 2.4 });
    if (data.behind[i] !== null) plot.dot(data.behind[i], episode.coverage[data.behind[i]], colour("card"), 3);
    plot.dot(at, episode.coverage[at], ink);
    episode.events.forEach((event) => {
      const name = episode.collided[event] ? "collision" : "intervention";
      plot.line([event, event], [0, 0.035], colour(name), { width: 1.2 });
    });
  });
}

function curvesOf(canvas, last) {
  const x = { low: 0, high: last || 1, say: (value) => (value ? `${value}` : "step 0") };
  const y = { low: 0, high: 1, say: (value) => percent(value, 0) };
  return chart(canvas, x, y, CURVES);
}

/** Gives the step under the pointer. */
function stepAt(canvas, { last }, event) {
  const { left, width } = canvas.getBoundingClientRect();
  return (last * (event.clientX - left - CURVES.left)) / (width - CURVES.left - CURVES.right);
}

/** Draws the signs that can occur in the pictures, with their meanings. */
function drawLegend(list, episodes, view) {
  const any = (name) => episodes.some((episode) => episode[name]);
  const map = view !== "forest", forest = view !== "map";
  const inside = (paint) => (pen) => { pen.fillStyle = colour(paint); pen.fillRect(0, 0, 18, 18); };
  const dot = (paint, radius) => (pen) => { pen.fillStyle = colour(paint); pen.beginPath(); pen.arc(9, 9, radius, 0, 7); pen.fill(); };
  const stroke = (paint, width, dash = []) => (pen) => {
    Object.assign(pen, { strokeStyle: colour(paint), lineWidth: width, lineCap: "round" });
    pen.setLineDash(dash);
    pen.beginPath();
    pen.moveTo(2, 15);
    pen.lineTo(16, 3);
    pen.stroke();
  };
  const marked = (shape, paint) => (pen) => { pen.strokeStyle = colour("card"); shape(pen, 9, 9, 6, colour(paint)); };
  const signs = [
    ["way so far", stroke("policy-0", 2.4)],
    ["trunk", inside("trunk")],
    [map && "known to be free", inside("free")],
    [map && "seen at this step", inside("new")],
    [map && "unknown", inside("unknown")],
    [map && "frontier", inside("frontier")],
    [map && any("graph") && "graph edge", stroke("edge", 1)],
    [map && episodes.some((each) => each.viewpoints.some((cells) => cells.length)) && "viewpoint, larger the better", dot("viewpoint", 5)],
    [forest && "not seen yet", inside("veil")],
    [forest && "trunk, not seen yet", inside("hidden")],
    [any("filter") && "filter stepped in", marked(diamond, "intervention")],
    [episodes.some((each) => each.collided.some(Boolean)) && "collision", marked(cross, "collision")],
  ];
  list.replaceChildren(...signs.filter(([meaning]) => meaning).map(([meaning, draw]) => {
    const canvas = make("canvas", { "aria-hidden": "true" });
    draw(penOf(canvas, 18, 18));
    return make("li", {}, canvas, meaning);
  }));
}
