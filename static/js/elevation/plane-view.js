/** Open plane: the fronts on it, cut panels without a front, and the lines that edges snap to. */

import * as plane from "../lib/elevation.js";

/** @typedef {import("../api-types").Elevation} Elevation */
/** @typedef {import("./fronts.js").Front} Front */
/** @typedef {import("../lib/elevation.js").Rect} Rect */
/** @typedef {import("../lib/elevation.js").Side} Side */
/** @typedef {Front & { rect: Rect }} Placed */

export class PlaneView {
  /** @type {Elevation | null} */
  elevation = null;
  /** @type {{ upright: ReturnType<typeof plane.decoded>, level: ReturnType<typeof plane.decoded> } | null} */
  #lines = null;
  #fronts;

  /** @param {import("./fronts.js").Fronts} fronts */
  constructor(fronts) {
    this.#fronts = fronts;
  }

  /** @param {Elevation} elevation */
  open(elevation) {
    this.elevation = elevation;
    this.#lines = { upright: plane.decoded(elevation.upright), level: plane.decoded(elevation.level) };
  }

  /** Fronts on the open plane. @returns {Placed[]} */
  get here() {
    const elevation = this.elevation;
    if (!elevation) return [];
    return this.#fronts.all.flatMap((front) => {
      const rect = plane.rectOf(elevation, front.corners);
      return rect ? [{ ...front, rect }] : [];
    });
  }

  /** Cut panels without a front. @param {Placed[]} here @returns {Rect[]} */
  cut(here) {
    const { cells = [], cell_m = 1 } = this.elevation ?? {};
    const rects = cells.map(([left = 0, top = 0, right = 0, bottom = 0]) => ({
      left: left * cell_m,
      top: top * cell_m,
      right: right * cell_m,
      bottom: bottom * cell_m,
    }));
    return rects.filter((rect) => !here.some((front) => plane.overlap(front.rect, rect)));
  }

  /** @param {Placed[]} here */
  leading(here = this.here) {
    return here.find(({ key }) => key === this.#fronts.leading?.key) ?? null;
  }

  /** Strength of the lines parallel to a side, over the extent of a front. @param {Side} side @param {Rect} rect */
  profile(side, rect) {
    const upright = side === "left" || side === "right";
    const [from, to] = upright ? [rect.top, rect.bottom] : [rect.left, rect.right];
    const lines = upright ? this.#lines?.upright : this.#lines?.level;
    return lines ? plane.profileOf(lines, this.elevation?.cell_m ?? 1, from, to) : null;
  }

  /**
   * @param {Side} side
   * @param {number} at
   * @param {Rect} rect
   * @param {string | null} key of the front, whose own edges are ignored
   * @param {number} reach
   */
  snap(side, at, rect, key, reach) {
    const upright = side === "left" || side === "right";
    const others = this.here.filter((front) => front.key !== key);
    const edges = others.flatMap((front) =>
      upright ? [front.rect.left, front.rect.right] : [front.rect.top, front.rect.bottom],
    );
    return plane.snapped(at, reach, edges, this.profile(side, rect));
  }

  /** Front at a position, the leading one first. @param {{ x: number, y: number } | undefined} at @returns {Placed | null} */
  at(at) {
    if (!at) return null;
    const there = this.here.filter(({ rect }) => plane.holds(rect, at));
    return there.find(({ key }) => key === this.#fronts.leading?.key) ?? there[0] ?? null;
  }
}
