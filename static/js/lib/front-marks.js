/** Geometry of the marks drawn on a front. Rectangles and points are in pixels of the screen; x to the right, y down. */

/** @typedef {import("./elevation.js").Rect} Rect */
/** @typedef {import("./elevation.js").Side} Side */
/** @typedef {[number, number]} Point */

const HEAD_PX = 12; // the longest arrow head

/** The ends of an edge. @param {Rect} rect @param {Side} side @returns {[Point, Point]} */
export function edgeOf({ left, top, right, bottom }, side) {
  const x = side === "right" ? right : left;
  const y = side === "bottom" ? bottom : top;
  return side === "left" || side === "right"
    ? [
        [x, top],
        [x, bottom],
      ]
    : [
        [left, y],
        [right, y],
      ];
}

/**
 * Upper left corner of a label within a front: in the first corner, from the upper left clockwise, where it covers no handle.
 * @param {Rect} rect
 * @param {{ width: number, height: number }} size
 * @param {Rect | null} handle
 * @returns {{ x: number, y: number }}
 */
export function labelCorner(rect, { width, height }, handle) {
  const [x, right, y, bottom] = [rect.left, rect.right - width, rect.top, rect.bottom - height];
  const corners = [
    { x, y },
    { x: right, y },
    { x: right, y: bottom },
    { x, y: bottom },
  ];
  const covers = (/** @type {{ x: number, y: number }} */ at) =>
    handle !== null &&
    at.x < handle.right &&
    at.x + width > handle.left &&
    at.y < handle.bottom &&
    at.y + height > handle.top;
  return corners.find((at) => !covers(at)) ?? { x, y };
}

/** The middle of an edge. @param {Rect} rect @param {Side} side @returns {Point} */
export function edgeMiddle(rect, side) {
  const [[x1, y1], [x2, y2]] = edgeOf(rect, side);
  return [(x1 + x2) / 2, (y1 + y2) / 2];
}

/**
 * The opening triangle of technical drawings: its tip is at the hinge.
 * @param {Rect} rect
 * @param {Side} side of the hinge
 * @returns {Point[]}
 */
export function hingeLine(rect, side) {
  const opposite = /** @type {const} */ ({ left: "right", right: "left", top: "bottom", bottom: "top" })[side];
  const [from, to] = edgeOf(rect, opposite);
  return [from, edgeMiddle(rect, side), to];
}

/**
 * An arrow in the direction a front slides: its shaft and the two lines of its head.
 * @param {Rect} rect
 * @param {Side} side it slides to
 * @returns {[Point, Point][]}
 */
export function slideArrow({ left, top, right, bottom }, side) {
  const y = (top + bottom) / 2;
  const quarter = (right - left) / 4;
  const [from, to] = side === "left" ? [right - quarter, left + quarter] : [left + quarter, right - quarter];
  const head = Math.sign(from - to) * Math.min(HEAD_PX, quarter);
  const tip = /** @type {Point} */ ([to, y]);
  return [
    [[from, y], tip],
    [tip, [to + head, y - Math.abs(head) / 2]],
    [tip, [to + head, y + Math.abs(head) / 2]],
  ];
}
