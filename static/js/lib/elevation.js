/** Fronts on a plane of the scan: rectangles in metres from its top left corner, x to the right and y down; no DOM. */

/** @typedef {import("../api-types").Elevation} Elevation */
/** @typedef {import("../api-types").ElevationLines} ElevationLines */
/** @typedef {import("../api-types").PromptsFileFrontOutput} Drawn */
/** @typedef {{ left: number, top: number, right: number, bottom: number }} Rect */
/** @typedef {"left" | "right" | "top" | "bottom"} Side */
/** @typedef {{ positions: Float32Array, cell: number }} Profile clarity of a line at each position, 0 to 1 */
/** @typedef {{ left_m: number, bottom_m: number, right_m: number, top_m: number }} Box from a front's centre, z up */

/** @type {Side[]} */
export const SIDES = ["left", "top", "right", "bottom"];
export const SMALLEST_M = 0.02;
const OFF_PLANE_M = 0.03; // up to which a front is on the plane
const CLEAR = 0.2; // minimum clarity of a line to snap to
const HAND = 0.4; // of the reach: standard deviation of the release position about the intended line
const DOOR_M = 0.4; // height from which a front is a door rather than a drawer
const HANDLE_M = { long: 0.16, thick: 0.02 };
const SAME_M = 1e-4; // finer than any scan: smaller differences count as equal

/** @param {number[]} a @param {number[]} b */
const dot = (a, b) => a.reduce((sum, value, k) => sum + value * (b[k] ?? 0), 0);
/** @param {number[]} a @param {number[]} b */
const minus = (a, b) => a.map((value, k) => value - (b[k] ?? 0));

/** @param {Elevation} elevation */
export const sizeOf = ({ columns, rows, cell_m }) => ({ width: columns * cell_m, height: rows * cell_m });
/** @param {Rect} rect */
export const widthOf = ({ left, right }) => right - left;
/** @param {Rect} rect */
export const heightOf = ({ top, bottom }) => bottom - top;
/** @param {Rect} rect */
export const middleOf = (rect) => ({ x: (rect.left + rect.right) / 2, y: (rect.top + rect.bottom) / 2 });

/**
 * Rectangle of a front on a plane; null when it is on another plane.
 * @param {Elevation} elevation
 * @param {number[][]} corners as in prompts.json
 * @returns {Rect | null}
 */
export function rectOf(elevation, corners) {
  const { origin_m, right, down } = elevation;
  const at = corners.map((corner) => minus(corner, origin_m));
  const x = at.map((point) => dot(point, right));
  const y = at.map((point) => dot(point, down));
  const off = at.map((point, k) => Math.sqrt(Math.max(dot(point, point) - (x[k] ?? 0) ** 2 - (y[k] ?? 0) ** 2, 0)));
  const size = sizeOf(elevation);
  const rect = { left: Math.min(...x), right: Math.max(...x), top: Math.min(...y), bottom: Math.max(...y) };
  const { x: u, y: v } = middleOf(rect);
  const facing = (x[1] ?? 0) > (x[0] ?? 0) && (y[3] ?? 0) > (y[0] ?? 0); // the back of an island is another plane
  const inside = u > 0 && v > 0 && u < size.width && v < size.height;
  return facing && inside && Math.max(...off) < OFF_PLANE_M ? rect : null;
}

/**
 * @param {Elevation} elevation
 * @param {Rect} rect
 * @returns {number[][]} as in prompts.json
 */
export function cornersOf({ origin_m, right, down }, rect) {
  const at = (/** @type {number} */ x, /** @type {number} */ y) =>
    origin_m.map((value, k) => round(value + x * (right[k] ?? 0) + y * (down[k] ?? 0)));
  return [at(rect.left, rect.top), at(rect.right, rect.top), at(rect.right, rect.bottom), at(rect.left, rect.bottom)];
}

/** Round to 0.01 mm: 0.1 mm is finer than any scan, but 0.01 mm keeps rectangles square. @param {number} metres */
const round = (metres) => Math.round(metres * 1e5) / 1e5;

/**
 * Clarity of lines at each position, averaged over a range of the other direction.
 * @param {{ block: number, blocks: number, positions: number, bytes: Uint8Array }} lines
 * @param {number} cell metres a cell
 * @param {number} from metres
 * @param {number} to
 * @returns {Profile}
 */
export function profileOf({ block, blocks, positions, bytes }, cell, from, to) {
  const first = Math.min(Math.max(Math.floor(from / cell / block), 0), blocks - 1);
  const last = Math.max(Math.min(Math.ceil(to / cell / block), blocks), first + 1);
  const found = new Float32Array(positions);
  for (let k = first; k < last; k++)
    for (let i = 0; i < positions; i++) found[i] = (found[i] ?? 0) + (bytes[k * positions + i] ?? 0);
  return { positions: found.map((sum) => sum / (255 * (last - first))), cell };
}

/** @param {ElevationLines} lines */
export function decoded(lines) {
  const text = atob(lines.clarity);
  return { ...lines, bytes: Uint8Array.from(text, (letter) => letter.charCodeAt(0)) };
}

/**
 * Snapped position of an edge released near `at`: another front's edge, else the most likely line within reach, which is clear
 * and near. Where lines are at maximum clarity everywhere, as beside a worktop, the edge stays put.
 * @param {number} at metres
 * @param {number} reach metres
 * @param {number[]} edges of other fronts
 * @param {Profile | null} profile
 */
export function snapped(at, reach, edges, profile) {
  const line = profile ? likeliestLine(at, reach, profile) : null;
  const edge = edges.reduce(
    (best, one) => (Math.abs(one - at) < Math.abs(best - at) ? one : best),
    Number.POSITIVE_INFINITY,
  );
  if (Math.abs(edge - at) <= reach && (line === null || Math.abs(edge - at) <= Math.abs(line - at) + reach / 4))
    return edge;
  return line ?? at;
}

/**
 * @param {number} at
 * @param {number} reach
 * @param {Profile} profile
 */
function likeliestLine(at, reach, { positions, cell }) {
  const line = { at: 0, likely: 0 };
  const low = Math.max(Math.floor((at - reach) / cell), 1);
  const high = Math.min(Math.ceil((at + reach) / cell), positions.length - 2);
  for (let i = low; i <= high; i++) {
    const here = positions[i] ?? 0;
    const peak = here >= (positions[i - 1] ?? 0) && here >= (positions[i + 1] ?? 0);
    const middle = (i + 0.5) * cell;
    const likely = here * Math.exp(-0.5 * ((middle - at) / (HAND * reach)) ** 2);
    if (here >= CLEAR && peak && likely > line.likely) Object.assign(line, { at: middle, likely });
  }
  return line.likely ? line.at : null;
}

/**
 * First line beyond a position that is clearer than those beside it and at least half as clear as the clearest; null if none.
 * @param {number} at metres
 * @param {1 | -1} way
 * @param {Profile} profile
 */
export function nextLine(at, way, { positions, cell }) {
  const clear = Math.max(CLEAR, Math.max(...positions) / 2);
  for (let i = Math.floor(at / cell) + way; i > 0 && i < positions.length - 1; i += way) {
    const here = positions[i] ?? 0;
    if (here >= clear && here >= (positions[i - 1] ?? 0) && here >= (positions[i + 1] ?? 0)) return (i + 0.5) * cell;
  }
  return null;
}

/**
 * @param {Rect} rect
 * @param {Side} side
 * @param {number} at
 * @returns {Rect} no smaller than a front can be
 */
export function withEdge(rect, side, at) {
  const least = side === "left" || side === "top";
  const other = { left: rect.right, right: rect.left, top: rect.bottom, bottom: rect.top }[side];
  return { ...rect, [side]: least ? Math.min(at, other - SMALLEST_M) : Math.max(at, other + SMALLEST_M) };
}

/**
 * Rectangle of a typed width or height. The chosen edge moves; else the less certain one; of equal ones, one without a neighbour,
 * else the right or the lower one.
 * @param {Rect} rect
 * @param {"width" | "height"} size
 * @param {number} metres
 * @param {{ chosen: Side | null, sure: number[], others: Rect[] }} about `sure`: of left, right, top and bottom; empty: unknown
 * @returns {Rect}
 */
export function resized(rect, size, metres, { chosen, sure, others }) {
  const [low, high] = size === "width" ? SIDES_ACROSS : SIDES_DOWN;
  const held = (/** @type {Side} */ side) => sure[SURE.indexOf(side)] ?? Number(isBeside(rect, side, others));
  const moves = chosen === low || chosen === high ? chosen : held(low) < held(high) ? low : high;
  return withEdge(rect, moves, moves === low ? rect[high] - metres : rect[low] + metres);
}

const SIDES_ACROSS = /** @type {const} */ (["left", "right"]);
const SIDES_DOWN = /** @type {const} */ (["top", "bottom"]);
/** @type {Side[]} */
const SURE = [...SIDES_ACROSS, ...SIDES_DOWN];

/** Whether another rectangle ends at a side. @param {Rect} rect @param {Side} side @param {Rect[]} others */
function isBeside(rect, side, others) {
  const opposite = /** @type {const} */ ({ left: "right", right: "left", top: "bottom", bottom: "top" })[side];
  const reaching = withEdge(rect, side, rect[side] + (side === "left" || side === "top" ? -1 : 1));
  return others.some((other) => Math.abs(other[opposite] - rect[side]) < SMALLEST_M && overlap(other, reaching));
}

/**
 * @param {Rect} rect
 * @param {number} dx
 * @param {number} dy
 * @returns {Rect}
 */
export function moved(rect, dx, dy) {
  return { left: rect.left + dx, right: rect.right + dx, top: rect.top + dy, bottom: rect.bottom + dy };
}

/**
 * Split a rectangle in two at a seam; null where a part would be too small.
 * @param {Rect} rect
 * @param {"upright" | "level"} way
 * @param {number} at
 * @returns {[Rect, Rect] | null}
 */
export function split(rect, way, at) {
  const [low, high] = way === "upright" ? [rect.left, rect.right] : [rect.top, rect.bottom];
  if (at < low + SMALLEST_M || at > high - SMALLEST_M) return null;
  return way === "upright"
    ? [
        { ...rect, right: at },
        { ...rect, left: at },
      ]
    : [
        { ...rect, bottom: at },
        { ...rect, top: at },
      ];
}

/** @param {Rect[]} rects @returns {Rect} around all of them */
export function around(rects) {
  return {
    left: Math.min(...rects.map((one) => one.left)),
    right: Math.max(...rects.map((one) => one.right)),
    top: Math.min(...rects.map((one) => one.top)),
    bottom: Math.max(...rects.map((one) => one.bottom)),
  };
}

/** @param {{ x: number, y: number }} a @param {{ x: number, y: number }} b @returns {Rect} */
export function between(a, b) {
  return { left: Math.min(a.x, b.x), right: Math.max(a.x, b.x), top: Math.min(a.y, b.y), bottom: Math.max(a.y, b.y) };
}

/** @param {Rect} rect @param {{ x: number, y: number }} at */
export function holds(rect, { x, y }) {
  return x >= rect.left && x <= rect.right && y >= rect.top && y <= rect.bottom;
}

/** Whether two rectangles overlap by more than a seam. @param {Rect} a @param {Rect} b */
export function overlap(a, b) {
  const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
  const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
  return across > SMALLEST_M && down > SMALLEST_M;
}

/**
 * Nearest edge to a position, and its distance.
 * @param {Rect} rect
 * @param {{ x: number, y: number }} at
 * @returns {{ side: Side, off: number }}
 */
export function nearestEdge(rect, { x, y }) {
  const beside = Math.max(rect.left - x, x - rect.right, 0);
  const above = Math.max(rect.top - y, y - rect.bottom, 0);
  const off = {
    left: Math.hypot(x - rect.left, above),
    right: Math.hypot(x - rect.right, above),
    top: Math.hypot(y - rect.top, beside),
    bottom: Math.hypot(y - rect.bottom, beside),
  };
  const side = SIDES.reduce((best, one) => (off[one] < off[best] ? one : best), "left");
  return { side, off: off[side] };
}

/**
 * Bar handle at a position of a front: horizontal on drawers and near the upper or lower edge, else vertical.
 * @param {Rect} rect
 * @param {{ x: number, y: number }} at
 * @returns {Box}
 */
export function handleAt(rect, at) {
  const { x, y } = middleOf(rect);
  const upright = heightOf(rect) > DOOR_M && ["left", "right"].includes(nearestEdge(rect, at).side);
  const [wide, high] = upright ? [HANDLE_M.thick, HANDLE_M.long] : [HANDLE_M.long, HANDLE_M.thick];
  const [halfWidth, halfHeight] = [Math.min(wide, widthOf(rect)) / 2, Math.min(high, heightOf(rect)) / 2];
  const right = Math.min(Math.max(at.x - x, halfWidth - widthOf(rect) / 2), widthOf(rect) / 2 - halfWidth);
  const up = Math.min(Math.max(y - at.y, halfHeight - heightOf(rect) / 2), heightOf(rect) / 2 - halfHeight);
  return {
    left_m: round(right - halfWidth),
    right_m: round(right + halfWidth),
    bottom_m: round(up - halfHeight),
    top_m: round(up + halfHeight),
  };
}

/**
 * Drawn handle after its front changed: it stays in place when an edge is moved, and moves along with the whole front; null,
 * to be detected again, where it is no longer on the front.
 * @template {Box | "none" | null} T
 * @param {T} handle
 * @param {Rect} before
 * @param {Rect} after
 * @returns {T | Box | null}
 */
export function handleAfter(handle, before, after) {
  if (handle === null || handle === "none") return handle;
  const box = /** @type {Box} */ (handle);
  if (!sameSize(before, after)) return seenAfter(box, before, after);
  return isOn(after, box) ? box : null;
}

/**
 * Detected handle after its front changed: it stays where the photo shows it; null where it is no longer on the front.
 * @param {Box} box
 * @param {Rect} before
 * @param {Rect} after
 */
export function seenAfter(box, before, after) {
  const stays = shifted(box, middleOf(before), middleOf(after));
  return isOn(after, stays) ? stays : null;
}

/**
 * Handle of one front copied to another: at the same distance from an edge it is near, else at the same offset from the centre.
 * @param {Box} box
 * @param {Rect} from
 * @param {Rect} to
 * @returns {Box}
 */
export function handleLike(box, from, to) {
  const [left_m, right_m] = alongSide(box.left_m, box.right_m, widthOf(from), widthOf(to));
  const [bottom_m, top_m] = alongSide(box.bottom_m, box.top_m, heightOf(from), heightOf(to));
  return { left_m, right_m, bottom_m, top_m };
}

/**
 * Extent along a side, relative to the side's middle.
 * @param {number} low
 * @param {number} high
 * @param {number} before length of the side
 * @param {number} after
 * @returns {[number, number]}
 */
function alongSide(low, high, before, after) {
  const middle = (low + high) / 2;
  const half = Math.min(high - low, after) / 2;
  const atAnEdge = Math.abs(middle) > before / 6;
  const wanted = middle + (atAnEdge ? (Math.sign(middle) * (after - before)) / 2 : 0);
  const at = Math.min(Math.max(wanted, half - after / 2), after / 2 - half);
  return [round(at - half), round(at + half)];
}

/**
 * Box relative to another centre.
 * @param {Box} box
 * @param {{ x: number, y: number }} from centre before
 * @param {{ x: number, y: number }} to centre after
 * @returns {Box}
 */
function shifted(box, from, to) {
  const [right, up] = [from.x - to.x, to.y - from.y];
  return {
    left_m: round(box.left_m + right),
    right_m: round(box.right_m + right),
    bottom_m: round(box.bottom_m + up),
    top_m: round(box.top_m + up),
  };
}

/** Whether all of a handle lies on a front. @param {Rect} rect @param {Box} box */
function isOn(rect, { left_m, right_m, bottom_m, top_m }) {
  const [across, up] = [widthOf(rect) / 2 + SAME_M, heightOf(rect) / 2 + SAME_M];
  return left_m >= -across && right_m <= across && bottom_m >= -up && top_m <= up;
}

/** @param {Rect} a @param {Rect} b */
function sameSize(a, b) {
  return isNear(widthOf(a), widthOf(b)) && isNear(heightOf(a), heightOf(b));
}

/** @param {number} a @param {number} b metres */
const isNear = (a, b) => Math.abs(a - b) < SAME_M;

/** Whether two drawn fronts are equal within the tolerance. @param {Drawn} a @param {Drawn} b */
export function sameFront(a, b) {
  const corners = b.corners_m.flat();
  const placed = a.corners_m.flat().every((value, k) => isNear(value, corners[k] ?? Number.NaN));
  return placed && sameHandle(a.handle ?? null, b.handle ?? null) && (a.hinge ?? null) === (b.hinge ?? null);
}

/** @param {Box | "none" | null} a @param {Box | "none" | null} b */
function sameHandle(a, b) {
  if (a === null || b === null || a === "none" || b === "none") return a === b;
  return /** @type {(keyof Box)[]} */ (["left_m", "right_m", "bottom_m", "top_m"]).every((side) =>
    isNear(a[side], b[side]),
  );
}

/**
 * Most likely category of a front of that shape and height.
 * @param {Rect} rect
 * @param {number} top height of the plane's upper end above the floor, metres
 */
export function likelyCategory(rect, top) {
  if (top - rect.bottom > 1.2) return "wall_cabinet";
  return heightOf(rect) < DOOR_M && widthOf(rect) >= heightOf(rect) ? "drawer" : "cabinet";
}
