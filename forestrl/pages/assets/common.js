"use strict";

/** Makes an element: make("p", {class: "soft"}, "words", another). */
function make(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

const byId = (id) => document.getElementById(id);
const percent = (share, digits = 1) => `${(100 * share).toFixed(digits)} %`;
const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

/** Reads the data of the page: JSON, deflated, in base 64. */
async function readData() {
  const bytes = Uint8Array.from(atob(byId("data").textContent), (letter) => letter.charCodeAt(0));
  const inflated = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return JSON.parse(await new Response(inflated).text());
}

/** Gives a colour of the present scheme, as CSS writes it: "#rrggbb". */
function colour(name) {
  if (!colour.known) {
    colour.style = getComputedStyle(document.documentElement);
    colour.known = new Map();
  }
  if (!colour.known.has(name)) colour.known.set(name, colour.style.getPropertyValue(`--${name}`).trim());
  return colour.known.get(name);
}

/** Gives a colour as a number that an ImageData takes, little endian. */
function pixel(name) {
  const value = parseInt(colour(name).slice(1, 7), 16);
  return (0xff000000 | ((value & 0xff) << 16) | (value & 0xff00) | (value >> 16)) >>> 0;
}

/** Fits a canvas to its place on the screen, pixel for pixel, and gives a pen in CSS pixels. */
function penOf(canvas, width = canvas.clientWidth, height = canvas.clientHeight) {
  const ratio = window.devicePixelRatio || 1;
  const [across, down] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== across || canvas.height !== down) [canvas.width, canvas.height] = [across, down];
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  return pen;
}

/** Calls back when sizes or colours change. */
function onNewLook(canvases, redraw) {
  const anew = () => { colour.known = null; redraw(); };
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", anew);
  const watcher = new ResizeObserver(() => redraw());
  canvases.forEach((canvas) => watcher.observe(canvas));
}
