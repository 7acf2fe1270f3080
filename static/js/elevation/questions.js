/**
 * Edges of found fronts that hardly show: each is asked about, and a key answers. A front whose questions are all answered is
 * drawn by that; before, nothing of it is stored.
 */

import { middleOf, nextLine, overlap, withEdge } from "../lib/elevation.js";

/** @typedef {import("./fronts.js").Front} Front */
/** @typedef {import("../lib/elevation.js").Rect} Rect */
/** @typedef {import("../lib/elevation.js").Side} Side */
/** @typedef {import("../lib/elevation.js").Profile} Profile */
/** @typedef {Front & { rect: Rect }} Placed */
/** @typedef {{ key: string, side: Side, sure: number }} Question */

const UNSURE = 0.3; // as the run asks: Params.unsure_edge of r2c2r_core/segment/contradictions.py
const NEAR_M = 0.03; // of a neighbour's edge that is the same seam
/** @type {Side[]} in the order of FoundFront.edges */
const SIDES = ["left", "right", "top", "bottom"];

export class Questions {
  /** @type {Map<string, Map<Side, boolean>>} whether there is a seam, by front */
  #answers = new Map();

  /** Those still to be answered. @param {Placed[]} here @returns {Question[]} */
  open(here) {
    return here.flatMap((front) => this.about(front));
  }

  /** @param {Front} front @returns {Question[]} */
  about({ key, drawn, edges }) {
    if (drawn) return [];
    const answered = this.#answers.get(key);
    return SIDES.flatMap((side, k) => {
      const sure = edges[k] ?? 1;
      return sure < UNSURE && !answered?.has(side) ? [{ key, side, sure }] : [];
    });
  }

  /**
   * Note an answer; all of the front's answers once none is missing.
   * @param {Front} front
   * @param {Side} side
   * @param {boolean} isSeam
   * @returns {Map<Side, boolean> | null}
   */
  answer(front, side, isSeam) {
    const answers = this.#answers.get(front.key) ?? new Map();
    this.#answers.set(front.key, answers.set(side, isSeam));
    if (this.about(front).length) return null;
    this.#answers.delete(front.key); // undone, it is asked about again
    return answers;
  }
}

/**
 * The front without a seam at one of its edges: it goes on to the far edge of the front beyond, else to the next clear line; null
 * where there is neither.
 * @param {Rect} rect
 * @param {Side} side
 * @param {Rect[]} others
 * @param {Profile | null} profile of lines of that direction beside it
 * @returns {Rect | null}
 */
export function without(rect, side, others, profile) {
  const way = side === "right" || side === "bottom" ? 1 : -1;
  const facing = /** @type {Side} */ ({ left: "right", right: "left", top: "bottom", bottom: "top" }[side]);
  const beyond = others.find((other) => Math.abs(other[facing] - rect[side]) < NEAR_M && beside(rect, other, side));
  const at = beyond ? beyond[side] : profile && nextLine(rect[side] + way * NEAR_M, way, profile);
  return at === null ? null : withEdge(rect, side, at);
}

/** Whether another front stands level with one, or in its column. @param {Rect} rect @param {Rect} other @param {Side} side */
function beside(rect, other, side) {
  const { x, y } = middleOf(other);
  return side === "left" || side === "right" ? y > rect.top && y < rect.bottom : x > rect.left && x < rect.right;
}

/** The fronts that lie in a rectangle. @template {{ rect: Rect }} T @param {T[]} fronts @param {Rect} rect @returns {T[]} */
export function swallowed(fronts, rect) {
  return fronts.filter((front) => {
    const { x, y } = middleOf(front.rect);
    return overlap(front.rect, rect) && x > rect.left && x < rect.right && y > rect.top && y < rect.bottom;
  });
}
