/**
 * Form to move and resize an object: by numbers, by keys, or by the handles in the 3D view. Changes are shown at once and
 * stored on submit. Emits "moved" (after a number, a key or a reset), "shown" (after any change), "store" patch.
 */

import { h, numberField } from "../dom.js";
import { moved, NOWHERE, shiftBetween } from "../lib/moved.js";

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").OverridePatch} OverridePatch */
/** @typedef {import("../lib/moved.js").Shift} Shift */
/** @typedef {{ pose: number[][], size: number[] }} Box */

const DEGREES = Math.PI / 180;
const FIELDS = /** @type {const} */ ([
  ["right", "Right (mm)", 1e-3],
  ["back", "Back (mm)", 1e-3],
  ["up", "Up (mm)", 1e-3],
  ["turn", "Turn (°)", DEGREES],
]);
/** Step of each key, in metres and radians. @type {Record<string, Partial<Shift>>} */
const STEPS = {
  j: { right: -0.005 },
  l: { right: 0.005 },
  i: { up: 0.005 },
  k: { up: -0.005 },
  u: { back: -0.005 },
  m: { back: 0.005 },
  "[": { turn: -DEGREES },
  "]": { turn: DEGREES },
};

export class Mover extends EventTarget {
  element = h("form", { class: "nudge", hidden: true, "aria-label": "Move and resize" });
  #moves = FIELDS.map(([, text]) => numberField(text, 0, { step: "any" }));
  #sides = ["Width", "Depth", "Height"].map((name) => numberField(`${name} (cm)`, 0, { min: "1", step: "any" }));
  #use = h("button", { type: "submit", class: "primary" }, "Use this place and size");
  #drop = h("button", { type: "button" }, "Put it back");
  #again = h("button", { type: "button", class: "quiet" }, "Compute it again");
  /** @type {Box | null} box in the finished scene */
  box = null;
  #object = -1;
  #shift = NOWHERE;
  #size = [0, 0, 0];

  constructor() {
    super();
    const fields = [...this.#moves, ...this.#sides].map(({ label }) => label);
    this.element.append(...fields, h("div", { class: "row ends" }, this.#use, this.#drop, this.#again));
    this.element.addEventListener("input", () => this.#typed());
    this.element.addEventListener("submit", (event) => (event.preventDefault(), this.store()));
    this.#drop.addEventListener("click", () => this.drop());
    this.#again.addEventListener("click", () => this.#say("store", { pose: null, dimensions_m: null }));
  }

  /**
   * Set the object and its box; unsaved changes are kept if both are the same.
   * @param {CandidateGroup | undefined} group
   * @param {Box | null} box
   */
  about(group, box) {
    const same = group?.object === this.#object && JSON.stringify(box) === JSON.stringify(this.box);
    this.#object = group?.object ?? -1;
    this.box = box;
    this.#again.hidden = !group?.override.pose && !group?.override.dimensions_m;
    if (!same) this.#set(NOWHERE, box?.size ?? [0, 0, 0]);
  }

  /** Box with the unsaved changes; null if there are none. @returns {Box | null} */
  get wanted() {
    if (!this.box || !this.open) return null;
    return { pose: moved(this.box.pose, this.#shift), size: this.#size };
  }

  /** Whether there are unsaved changes. */
  get open() {
    return this.#isMoved || this.#isResized;
  }

  get #isMoved() {
    return Object.values(this.#shift).some((value) => Math.abs(value) > 5e-5);
  }

  get #isResized() {
    return this.#size.some((side, k) => Math.abs(side - (this.box?.size[k] ?? side)) > 5e-4);
  }

  /**
   * Move the object by a key's step, or a fifth of it with Shift.
   * @param {string} key
   * @param {boolean} fine
   */
  nudge(key, fine) {
    const step = STEPS[key.toLowerCase()];
    if (!step || !this.box) return;
    const share = fine ? 0.2 : 1;
    const shift = { ...this.#shift };
    for (const [name, by] of Object.entries(step)) shift[/** @type {keyof Shift} */ (name)] += by * share;
    this.#set(shift, this.#size);
    this.#say("moved");
  }

  /** Apply a drag of the handles in the 3D view. @param {number[][]} pose world_from_object */
  dragged(pose) {
    if (this.box) this.#set(shiftBetween(this.box.pose, pose), this.#size);
  }

  drop() {
    this.#set(NOWHERE, this.box?.size ?? [0, 0, 0]);
    this.#say("moved");
  }

  store() {
    const wanted = this.wanted;
    if (!wanted) return;
    this.#say("store", {
      ...(this.#isMoved ? { pose: wanted.pose } : {}),
      ...(this.#isResized ? { dimensions_m: /** @type {[number, number, number]} */ (wanted.size) } : {}),
    });
  }

  #typed() {
    const values = this.#moves.map(({ input }, k) => (input.valueAsNumber || 0) * (FIELDS[k]?.[2] ?? 0));
    const [right = 0, back = 0, up = 0, turn = 0] = values;
    this.#shift = { right, back, up, turn };
    this.#size = this.#sides.map(({ input }, k) => input.valueAsNumber / 100 || (this.box?.size[k] ?? 0));
    this.#tell();
    this.#say("moved");
  }

  /**
   * @param {Shift} shift
   * @param {number[]} size
   */
  #set(shift, size) {
    this.#shift = shift;
    this.#size = size;
    this.#moves.forEach(({ input }, k) => {
      const [name, , unit] = FIELDS[k] ?? ["right", "", 1];
      input.value = tenths(shift[name] / unit);
    });
    this.#sides.forEach(({ input }, k) => (input.value = tenths(100 * (size[k] ?? 0))));
    this.#tell();
  }

  #tell() {
    this.#use.disabled = this.#drop.disabled = !this.open;
    this.#say("shown");
  }

  /**
   * @param {string} type
   * @param {Partial<OverridePatch>} [patch]
   */
  #say(type, patch) {
    this.dispatchEvent(new CustomEvent(type, { detail: patch }));
  }
}

/** @param {number} value */
function tenths(value) {
  return String(Math.round(10 * value) / 10 || 0);
}
