/**
 * Clip box of the scene and the scan: six sliders for its sides, and presets. Emits "change" when the box changes.
 */

import { h } from "../dom.js";

/** @typedef {import("../api-types").ViewerClip} ViewerClip */
/** @typedef {[number, number, number]} Three */

const AXES = ["Width", "Depth", "Height"];
const ENDS = [
  ["left", "right"],
  ["front", "back"],
  ["bottom", "top"],
];
const STEPS = 100;
const ABOUT = 0.02; // margin around the chosen object, as a fraction of the scene
const HALF = 0.5;

export class ClipPanel extends EventTarget {
  on = false;
  /** @type {number[] | null} width, depth and height of the clipped content, metres */
  #span = null;
  /** @type {ViewerClip | null} extent of the chosen object */
  #part = null;
  #sides = AXES.map((name, axis) =>
    [0, 1].map((end) => {
      const label = `${name} from the ${ENDS[axis]?.[end]}`;
      const input = h("input", { type: "range", min: "0", max: String(STEPS), step: "1", "aria-label": label });
      input.addEventListener("input", () => this.#moved(axis, end));
      return input;
    }),
  );
  #said = AXES.map(() => h("output", { class: "muted" }));
  #around = h(
    "button",
    { type: "button", onClick: () => this.#part && this.#put(widened(this.#part)) },
    "Around the object",
  );
  #reset = h("button", { type: "button", onClick: () => this.#put(all()) }, "Show all");
  element = h(
    "div",
    { class: "clip", role: "group", "aria-label": "Section" },
    h(
      "div",
      { class: "row" },
      this.#preset("Cut the front off", { low: [0, HALF, 0], high: [1, 1, 1] }),
      this.#preset("Cut the left half off", { low: [HALF, 0, 0], high: [1, 1, 1] }),
      this.#preset("Top off", { low: [0, 0, 0], high: [1, 1, HALF] }),
      this.#around,
      this.#reset,
    ),
    h(
      "div",
      { class: "axes" },
      ...AXES.map((name, axis) =>
        h("div", { class: "axis" }, h("span", {}, name, " ", this.#said[axis]), ...(this.#sides[axis] ?? [])),
      ),
    ),
  );

  constructor() {
    super();
    this.#set(all());
    this.#draw();
  }

  /** Clip box to request from the 3D view, in fractions of the scene; null shows all. @returns {ViewerClip | null} */
  get wish() {
    const box = this.#box;
    return this.on && (box.low.some((side) => side > 0) || box.high.some((side) => side < 1)) ? box : null;
  }

  /** Turn clipping on or off; a box that clips nothing is first set to cut off the front half. */
  toggle() {
    this.on = !this.on;
    if (this.on && !this.wish) this.#set({ low: [0, HALF, 0], high: [1, 1, 1] });
    this.#changed();
  }

  /** Restore a stored clip box. @param {ViewerClip | null | undefined} box */
  restore(box) {
    this.on = Boolean(box);
    if (box) this.#set(box);
    this.#draw();
  }

  /** @param {import("../api-types").ViewerShown} shown */
  told({ span_m: span, part }) {
    this.#span = span ?? null;
    this.#part = part ?? null;
    this.#draw();
  }

  get #box() {
    const ends = [0, 1].map((end) => this.#sides.map((pair) => Number(pair[end]?.value) / STEPS));
    return { low: /** @type {Three} */ (ends[0]), high: /** @type {Three} */ (ends[1]) };
  }

  /** @param {string} text @param {ViewerClip} box */
  #preset(text, box) {
    return h("button", { type: "button", onClick: () => this.#put(box) }, text);
  }

  /** @param {ViewerClip} box */
  #put(box) {
    this.#set(box);
    this.#changed();
  }

  /** @param {ViewerClip} box */
  #set({ low, high }) {
    for (const [axis, pair] of this.#sides.entries())
      for (const [end, input] of pair.entries())
        input.value = String(Math.round(STEPS * ((end ? high : low)[axis] ?? end)));
  }

  /** Keep opposite sides from crossing. @param {number} axis @param {number} end */
  #moved(axis, end) {
    const [low, high] = this.#sides[axis] ?? [];
    if (!low || !high) return;
    if (end) high.value = String(Math.max(Number(high.value), Number(low.value) + 1));
    else low.value = String(Math.min(Number(low.value), Number(high.value) - 1));
    this.#changed();
  }

  #changed() {
    this.#draw();
    this.dispatchEvent(new Event("change"));
  }

  #draw() {
    const { low, high } = this.#box;
    this.#around.disabled = !this.#part;
    this.#around.title = this.#part ? "" : "choose an object of the scene";
    for (const [axis, output] of this.#said.entries()) {
      const side = this.#span?.[axis];
      const [from, to] = [low[axis] ?? 0, high[axis] ?? 1];
      const [begins, ends] = side === undefined ? ["", ""] : [from, to].map((share) => metres(share * side));
      output.textContent =
        side === undefined ? "" : `${begins} to ${ends} from the ${ENDS[axis]?.[0]}, of ${metres(side)}`;
      for (const [end, input] of (this.#sides[axis] ?? []).entries())
        input.setAttribute("aria-valuetext", (end ? ends : begins) || `${input.value} %`);
    }
  }
}

/** @returns {ViewerClip} */
function all() {
  return { low: [0, 0, 0], high: [1, 1, 1] };
}

/** @param {ViewerClip} box @returns {ViewerClip} */
function widened({ low, high }) {
  const down = /** @type {Three} */ (low.map((side) => Math.max(side - ABOUT, 0)));
  return { low: down, high: /** @type {Three} */ (high.map((side) => Math.min(side + ABOUT, 1))) };
}

/** @param {number} length */
function metres(length) {
  return `${length.toFixed(2)} m`;
}
