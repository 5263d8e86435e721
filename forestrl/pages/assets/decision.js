"use strict";

const ROUND = [1, 2, 3, 4, 0, 5, 6, 7, 8]; // actions by their places around the robot
const NAMES = ["stay", "north-west", "north", "north-east", "west", "east", "south-west", "south", "south-east"];
const ARROWS = ["•", "↖", "↑", "↗", "←", "→", "↙", "↓", "↘"];
const LISTED = 5; // viewpoints that are listed

/** What one policy decides at a step, and why: in a compass, in words and as a list of viewpoints. */
class Decision {
  constructor(episode, ink) {
    this.episode = episode;
    this.squares = ROUND.map(() => make("div"));
    this.compass = make("div", { class: "compass", role: "img" }, ...this.squares);
    this.why = make("p", { class: "why" });
    this.sum = make("p", { class: "sum" });
    this.list = make("ol", { class: "viewpoints" });
    const words = make("div", {}, this.sum, this.why);
    if (episode.viewpoints.some((cells) => cells.length)) words.append(this.list);
    this.element = make("div", { class: "decision" }, this.compass, words);
  }

  show(step) {
    const { episode } = this;
    this.squares.forEach((square, i) => this.fill(square, ROUND[i], step));
    this.compass.setAttribute("aria-label", this.spoken(step));
    this.why.replaceChildren(...reason(episode, step));
    const [interventions, collisions] = episode.counts(step);
    const safety = episode.filter ? counted(interventions, "intervention") : "no filter";
    this.sum.textContent = `${safety}, ${counted(collisions, "collision")}`;
    this.listViewpoints(step);
  }

  fill(square, action, step) {
    const { episode } = this, shares = episode.probability[step];
    const decides = episode.decides(step);
    const refused = decides && episode.intervened(step) && episode.proposed[step] === action;
    square.className = [
      episode.isFeasible(step, action) ? "" : "barred",
      refused ? "refused" : decides && episode.executed[step] === action ? "taken" : "",
    ].join(" ");
    square.style.setProperty("--share", shares ? `${shares[action] / 10}%` : "0%");
    square.textContent = shares ? said(shares[action]) : ARROWS[action];
  }

  spoken(step) {
    const shares = this.episode.probability[step];
    const free = NAMES.filter((_, action) => this.episode.isFeasible(step, action)).join(", ");
    if (!shares) return `Feasible: ${free}`;
    return `Probabilities: ${NAMES.map((name, i) => `${name} ${said(shares[i])} %`).join(", ")}. Feasible: ${free}`;
  }

  listViewpoints(step) {
    const { viewpoints, scores, way } = this.episode, lengths = relative(scores[step]);
    this.list.replaceChildren(...viewpoints[step].slice(0, LISTED).map((cell, i) => {
      const bar = make("span", { class: "bar", style: `width:${8 + 92 * lengths[i]}%` });
      const isGoal = cell === way[step].at(-1);
      const place = make("span", {}, `(${this.episode.place(cell).join(", ")})`);
      return make("li", { class: isGoal ? "goal" : "", title: `score ${scores[step][i]}` }, `${i + 1}`, place, bar);
    }));
  }
}

function counted(number, what) {
  return `${number} ${what}${number === 1 ? "" : "s"}`;
}

/** Writes thousandths as whole per cent. */
function said(thousandths) {
  return thousandths > 0 && thousandths < 10 ? "<1" : `${Math.round(thousandths / 10)}`;
}

/** Says in words what happens at a step; strings and elements. */
function reason(episode, step) {
  if (step >= episode.steps) return [ending(episode)];
  const [proposed, executed] = [episode.proposed[step], episode.executed[step]];
  const stays = episode.status[step];
  if (stays) return [`Stays: ${STATUSES[stays]}.`];
  const words = [];
  if (proposed !== executed) {
    const rule = executed ? "the feasible move with the nearest number" : "as no move is feasible";
    words.push(make("b", {}, "The filter steps in: "), `${named(proposed)} leads ${obstacle(episode, step, proposed)}; it takes ${named(executed)}, ${rule}.`);
  } else {
    const shares = episode.probability[step], sure = shares ? `, with ${said(shares[executed])} %` : "";
    words.push(`${executed ? `Goes ${named(executed)}` : "Stays (a⁰)"}${sure}.`);
  }
  if (episode.collided[step]) words.push(make("b", {}, " It collides."));
  if (episode.way[step].length) words.push(` ${counted(episode.way[step].length, "step")} to its goal.`);
  return words;
}

function named(action) {
  return `${NAMES[action]} (a${"⁰¹²³⁴⁵⁶⁷⁸"[action]})`;
}

function obstacle(episode, step, action) {
  const cell = episode.target(step, action);
  if (cell === null) return "out of the arena";
  return episode.mapAt(step)[cell] === OCCUPIED ? "into a trunk" : "where nothing is known yet";
}

function ending(episode) {
  const covered = percent(episode.coverage[episode.steps]);
  if (episode.endsAtGoal()) return `Done: ${covered} covered after ${counted(episode.steps, "step")}.`;
  const stays = episode.status[Math.max(0, episode.steps - 1)];
  return `Ended after ${episode.steps} steps with ${covered} covered${stays ? `: ${STATUSES[stays]}` : ""}.`;
}

/** In the order of forestrl/status.py. */
const STATUSES = ["exploring", "everything is covered", "no frontier that it can reach", "it would go round for ever", "it stands on its goal", "its goal is not free"];
