"use strict";

const DASHES = [[], [9, 4], [2, 3], [9, 3, 2, 3]]; // lines differ in more than their colours

/** Gives the smallest of 1, 2, 5, 10, ... times a power of ten that needs at most `most` ticks. */
function tickSpacing(range, most) {
  const unit = 10 ** Math.floor(Math.log10(range / most));
  return [1, 2, 5, 10].map((digit) => digit * unit).find((spacing) => range <= most * spacing * (1 + 1e-9));
}

/**
 * Draws axes on a canvas and gives what draws inside them.
 *
 * x and y: {low, high, say: number => text}; margins are pixels.
 */
function chart(canvas, x, y, margins) {
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const pen = penOf(canvas, width, height);
  const box = { left: margins.left, right: width - margins.right, top: margins.top, bottom: height - margins.bottom };
  const across = (value) => box.left + ((box.right - box.left) * (value - x.low)) / (x.high - x.low || 1);
  const down = (value) => box.bottom - ((box.bottom - box.top) * (value - y.low)) / (y.high - y.low || 1);
  pen.font = "12px system-ui, sans-serif";
  axes();
  return { line, dot, upright, level };

  function axes() {
    pen.lineWidth = 1;
    pen.fillStyle = colour("soft");
    pen.strokeStyle = colour("rule");
    for (const value of ticks(y, (box.bottom - box.top) / 34)) {
      stroke([[box.left, down(value)], [box.right, down(value)]]);
      write(y.say(value), box.left - 8, down(value), "right", "middle");
    }
    for (const value of ticks(x, (box.right - box.left) / 76)) {
      write(x.say(value), across(value), box.bottom + 6, "center", "top");
    }
  }

  function ticks(axis, most) {
    const spacing = tickSpacing(axis.high - axis.low || 1, Math.max(1, most));
    const first = Math.ceil(axis.low / spacing - 1e-9);
    const count = Math.floor(axis.high / spacing + 1e-9) - first;
    return Array.from({ length: count + 1 }, (_, i) => (first + i) * spacing);
  }

  function write(text, left, top, align, baseline) {
    [pen.textAlign, pen.textBaseline] = [align, baseline];
    pen.fillText(text, left, top);
  }

  function stroke(points) {
    pen.beginPath();
    points.forEach(([left, top], i) => (i ? pen.lineTo(left, top) : pen.moveTo(left, top)));
    pen.stroke();
  }

  function line(xs, ys, ink, { width = 2, dash = [], alpha = 1 } = {}) {
    Object.assign(pen, { strokeStyle: ink, lineWidth: width, globalAlpha: alpha, lineJoin: "round" });
    pen.setLineDash(dash);
    stroke(xs.map((value, i) => [across(value), down(ys[i])]));
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }

  function dot(left, top, ink, radius = 4.5) {
    Object.assign(pen, { fillStyle: ink, strokeStyle: colour("card"), lineWidth: 2 });
    pen.beginPath();
    pen.arc(across(left), down(top), radius, 0, 2 * Math.PI);
    pen.fill();
    pen.stroke();
  }

  function upright(value, ink, dash = []) {
    line([value, value], [y.low, y.high], ink, { width: 1, dash });
  }

  function level(value) {
    line([x.low, x.high], [value, value], colour("soft"), { width: 1, dash: [4, 4] });
  }
}
