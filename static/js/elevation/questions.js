/**
 * Questions about uncertain edges of detected fronts. Nothing is stored until all questions of a front are answered; the front
 * is then drawn.
 */

import { middleOf, nextLine, overlap, withEdge } from "../lib/elevation.js";

/** @typedef {import("./fronts.js").Front} Front */
/** @typedef {import("../lib/elevation.js").Rect} Rect */
/** @typedef {import("../lib/elevation.js").Side} Side */
/** @typedef {import("../lib/elevation.js").Profile} Profile */
/** @typedef {Front & { rect: Rect }} Placed */
/** @typedef {{ key: string, side: Side, sure: number }} Question */

const UNSURE = 0.3; // same as Params.unsure_edge of r2c2r_core/segment/contradictions.py
const NEAR_M = 0.03; // distance of a neighbour's edge at the same seam
/** @type {Side[]} in the order of FoundFront.edges */
const SIDES = ["left", "right", "top", "bottom"];

export class Questions {
  /** @type {Map<string, Map<Side, boolean>>} whether there is a seam, by front and side */
  #answers = new Map();

  /** Open questions. @param {Placed[]} here @returns {Question[]} */
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
   * Record an answer; returns all answers of the front once none is missing, else null.
   * @param {Front} front
   * @param {Side} side
   * @param {boolean} isSeam
   * @returns {Map<Side, boolean> | null}
   */
  answer(front, side, isSeam) {
    const answers = this.#answers.get(front.key) ?? new Map();
    this.#answers.set(front.key, answers.set(side, isSeam));
    if (this.about(front).length) return null;
    this.#answers.delete(front.key); // asked again after an undo
    return answers;
  }
}

/**
 * Front extended across an edge without a seam: to the far edge of the next front, else to the next clear line; null if there
 * is neither.
 * @param {Rect} rect
 * @param {Side} side
 * @param {Rect[]} others
 * @param {Profile | null} profile of the lines parallel to that side
 * @returns {Rect | null}
 */
export function without(rect, side, others, profile) {
  const way = side === "right" || side === "bottom" ? 1 : -1;
  const facing = /** @type {Side} */ ({ left: "right", right: "left", top: "bottom", bottom: "top" }[side]);
  const beyond = others.find((other) => Math.abs(other[facing] - rect[side]) < NEAR_M && beside(rect, other, side));
  const at = beyond ? beyond[side] : profile && nextLine(rect[side] + way * NEAR_M, way, profile);
  return at === null ? null : withEdge(rect, side, at);
}

/** Whether another front is in the same row or column. @param {Rect} rect @param {Rect} other @param {Side} side */
function beside(rect, other, side) {
  const { x, y } = middleOf(other);
  return side === "left" || side === "right" ? y > rect.top && y < rect.bottom : x > rect.left && x < rect.right;
}

/** Fronts that lie in a rectangle. @template {{ rect: Rect }} T @param {T[]} fronts @param {Rect} rect @returns {T[]} */
export function swallowed(fronts, rect) {
  return fronts.filter((front) => {
    const { x, y } = middleOf(front.rect);
    return overlap(front.rect, rect) && x > rect.left && x < rect.right && y > rect.top && y < rect.bottom;
  });
}
