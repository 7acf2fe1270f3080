/** Hit testing and dragging of fronts on a plane, in metres from the plane's top left corner; no DOM. */

import { between, heightOf, holds, moved, nearestEdge, SMALLEST_M, widthOf, withEdge } from "./elevation.js";

/** @typedef {import("./elevation.js").Rect} Rect */
/** @typedef {import("./elevation.js").Side} Side */
/** @typedef {{ x: number, y: number }} Spot */
/** @typedef {{ key: string, side: Side | null }} Held `side`: an edge; null: the whole front */
/** @typedef {(side: Side, at: number, rect: Rect) => number} Snap snapped position of an edge of the rectangle */

/**
 * Target of a press: an edge within reach, of a chosen front first; else a chosen front.
 * @param {{ key: string, rect: Rect, chosen: boolean }[]} fronts
 * @param {Spot} spot
 * @param {number} reach
 * @returns {Held | null}
 */
export function heldAt(fronts, spot, reach) {
  const near = fronts
    .map(({ key, rect, chosen }) => ({ key, chosen, ...nearestEdge(rect, spot) }))
    .filter(({ off }) => off <= reach)
    .toSorted((a, b) => Number(b.chosen) - Number(a.chosen) || a.off - b.off)[0];
  if (near) return { key: near.key, side: near.side };
  const inside = fronts.find(({ rect, chosen }) => chosen && holds(rect, spot));
  return inside ? { key: inside.key, side: null } : null;
}

/**
 * The smallest front at a spot.
 * @template {{ rect: Rect }} T
 * @param {T[]} fronts
 * @param {Spot} spot
 */
export function smallestAt(fronts, spot) {
  const there = fronts.filter(({ rect }) => holds(rect, spot));
  return there.toSorted((a, b) => widthOf(a.rect) * heightOf(a.rect) - widthOf(b.rect) * heightOf(b.rect))[0] ?? null;
}

/**
 * A front, or an edge of it, dragged from one spot to another.
 * @param {Rect} rect
 * @param {Side | null} side
 * @param {Spot} from
 * @param {Spot} to
 * @param {Snap | null} snap null: no snapping
 */
export function carried(rect, side, from, to, snap) {
  if (side === null) return settled(moved(rect, to.x - from.x, to.y - from.y), snap);
  const put = side === "left" || side === "right" ? to.x : to.y;
  return withEdge(rect, side, snap ? snap(side, put, rect) : put);
}

/**
 * Move a rectangle as a whole so that, in each direction, the edge closest to a snap position snaps.
 * @param {Rect} rect
 * @param {Snap | null} snap
 */
export function settled(rect, snap) {
  if (!snap) return rect;
  const way = (/** @type {Side[]} */ sides) =>
    sides
      .map((side) => snap(side, rect[side], rect) - rect[side])
      .reduce((best, one) => (one !== 0 && (best === 0 || Math.abs(one) < Math.abs(best)) ? one : best), 0);
  return moved(rect, way(["left", "right"]), way(["top", "bottom"]));
}

/**
 * A new rectangle between two spots, snapped unless that makes it too small.
 * @param {Spot} from
 * @param {Spot} to
 * @param {Snap | null} snap
 */
export function drawn(from, to, snap) {
  const rect = between(from, to);
  if (!snap) return rect;
  const put = (/** @type {Side} */ side) => snap(side, rect[side], rect);
  const snapped = { left: put("left"), right: put("right"), top: put("top"), bottom: put("bottom") };
  return isLarge(snapped) ? snapped : rect;
}

/** Whether a rectangle is at least the smallest size of a front. @param {Rect} rect */
export function isLarge(rect) {
  return widthOf(rect) >= SMALLEST_M && heightOf(rect) >= SMALLEST_M;
}
