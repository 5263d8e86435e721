"use strict";

const SPEEDS = [2, 5, 12, 30, 60, 120]; // steps a second
const VIEWS = ["map", "forest", "both"];

/** Plays the episodes of the page, in step. */
class Player {
  constructor(data) {
    this.data = data;
    this.episodes = data.episodes.map((each) => new Episode(each));
    this.last = Math.max(...this.episodes.map((episode) => episode.steps));
    this.step = 0;
    this.playing = false;
    this.view = this.episodes.length === 1 && innerWidth > 560 ? "both" : "map";
    this.cards = this.episodes.map((episode, i) => new Card(episode, i, data.behind[i]));
    byId("episodes").append(...this.cards.map((card) => card.element));
    byId("episodes").classList.toggle("alone", this.episodes.length === 1);
    this.curve = byId("curves");
    this.listFacts();
    this.listen();
    this.choose(this.view);
    onNewLook([this.curve, ...this.cards.flatMap((card) => card.canvases)], () => this.draw());
    this.follow() || (matchMedia("(prefers-reduced-motion: reduce)").matches || this.play());
  }

  /** Goes to a step; every episode that has ended stays at its end. */
  go(step) {
    this.step = clamp(Math.round(step), 0, this.last);
    this.draw();
    if (!this.playing) this.settle();
  }

  draw() {
    this.cards.forEach((card) => card.draw(this.step, this.view));
    drawCurves(this.curve, this);
    byId("scrub").value = this.step;
    byId("scrub").setAttribute("aria-valuetext", `step ${this.step} of ${this.last}`);
    byId("moment").textContent = `${this.step} / ${this.last}`;
  }

  /** Writes the step into the address, and says it. */
  settle() {
    try { history.replaceState(null, "", `#step=${this.step}`); } catch { /* a notebook's frame has no address */ }
    byId("spoken").textContent = this.cards.map((card) => card.spoken(this.step)).join(" ");
  }

  /** Goes where the address says; tells whether it says anything. */
  follow() {
    const found = /^#step=(\d+)$/.exec(location.hash);
    if (found) { this.pause(); this.go(Number(found[1])); }
    return Boolean(found);
  }

  play() {
    if (this.step >= this.last) this.step = 0;
    this.playing = true;
    this.mark();
    let before = performance.now(), due = 0;
    const tick = (now) => {
      if (!this.playing) return;
      due += ((now - before) / 1000) * Number(byId("speed").value);
      before = now;
      const steps = Math.floor(due);
      due -= steps;
      if (steps) this.go(this.step + steps);
      if (this.step >= this.last) this.pause();
      else this.frame = requestAnimationFrame(tick);
    };
    this.frame = requestAnimationFrame(tick);
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    cancelAnimationFrame(this.frame);
    this.mark();
    this.settle();
  }

  mark() {
    byId("play").setAttribute("aria-label", this.playing ? "Pause" : "Play");
    byId("play").querySelector("path").setAttribute("d", this.playing ? "M3 2h4v12H3zM9 2h4v12H9z" : "M3 1v14l11-7z");
  }

  toggle() { this.playing ? this.pause() : this.play(); }

  jump(steps) { this.pause(); this.go(this.step + steps); }

  /** Goes to the next (1) or the previous (-1) intervention or collision of any policy. */
  event(direction) {
    const steps = this.episodes.flatMap((episode) => episode.events).filter((step) => direction * (step - this.step) > 0);
    if (steps.length) { this.pause(); this.go(direction > 0 ? Math.min(...steps) : Math.max(...steps)); }
  }

  choose(view) {
    this.view = view;
    VIEWS.forEach((each) => byId(`view-${each}`).setAttribute("aria-pressed", String(each === view)));
    byId("episodes").classList.toggle("both", view === "both");
    this.cards.forEach((card) => card.choose(view));
    drawLegend(byId("legend"), this.episodes, view);
    this.draw();
  }

  faster(by) {
    const select = byId("speed");
    select.selectedIndex = clamp(select.selectedIndex + by, 0, SPEEDS.length - 1);
  }

  listFacts() {
    const [first] = this.episodes, { about } = this.data;
    byId("about").textContent = `${first.rows} × ${first.columns} cells, sensor range ${first.lidar_range} cells, goal ${percent(first.coverage_goal, 0)}`;
    byId("facts").append(...about.flatMap(([name, value]) => [make("dt", {}, name), make("dd", { class: "code" }, value)]));
    byId("curves-say").textContent = `coverage over the steps; dashed: the goal of ${percent(first.coverage_goal, 0)}`;
  }

  listen() {
    const press = { first: () => this.jump(-this.last), back: () => this.jump(-1), play: () => this.toggle(), on: () => this.jump(1), last: () => this.jump(this.last) };
    for (const [id, act] of Object.entries(press)) byId(id).addEventListener("click", act);
    VIEWS.forEach((view) => byId(`view-${view}`).addEventListener("click", () => this.choose(view)));
    byId("scrub").max = this.last;
    byId("scrub").addEventListener("input", (event) => { this.pause(); this.go(Number(event.target.value)); });
    byId("speed").append(...SPEEDS.map((speed) => make("option", { value: speed }, `${speed} /s`)));
    byId("speed").value = this.last > 250 ? 30 : 12;
    const scrub = (event) => { this.pause(); this.go(stepAt(this.curve, this, event)); };
    this.curve.addEventListener("pointerdown", (event) => { this.curve.setPointerCapture(event.pointerId); scrub(event); });
    this.curve.addEventListener("pointermove", (event) => { if (event.buttons) scrub(event); });
    addEventListener("hashchange", () => this.follow());
    addEventListener("keydown", (event) => this.key(event));
  }

  key(event) {
    const { key, target, shiftKey } = event, far = shiftKey ? 10 : 1;
    const own = target.tagName === "SELECT" || (target.tagName === "BUTTON" || target.tagName === "SUMMARY" || target.tagName === "A") && (key === " " || key === "Enter");
    if (own || event.ctrlKey || event.metaKey || event.altKey) return;
    const acts = {
      " ": () => this.toggle(), ArrowLeft: () => this.jump(-far), ArrowRight: () => this.jump(far),
      Home: () => this.jump(-this.last), End: () => this.jump(this.last), n: () => this.event(1), p: () => this.event(-1),
      "+": () => this.faster(1), "=": () => this.faster(1), "-": () => this.faster(-1),
      v: () => this.choose(VIEWS[(VIEWS.indexOf(this.view) + 1) % VIEWS.length]),
    };
    if (acts[key]) { event.preventDefault(); acts[key](); }
  }
}

const player = readData().then((data) => {
  const shown = new Player(data);
  document.body.dataset.ready = "true";
  return shown;
});
