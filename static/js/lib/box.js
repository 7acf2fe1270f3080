/** Conversion of a drawn box to clicks, the one prompt that every segmenter understands. */

/** @typedef {{ x: number, y: number }} At */

const OUTSIDE = 0.08; // distance of negative clicks from the box, as a share of its side
const LEAST_PX = 8;

/**
 * Clicks for the content of a box: a positive one in its middle, negative ones beside its sides, where they lie in the frame.
 * Null for a box too small to be intended.
 * @param {At} from
 * @param {At} to
 * @param {{ width: number, height: number, index: number }} frame
 * @returns {{ frame: number, x: number, y: number, label: 0 | 1 }[] | null}
 */
export function clicksOfBox(from, to, frame) {
  const [left, right] = [Math.min(from.x, to.x), Math.max(from.x, to.x)];
  const [top, bottom] = [Math.min(from.y, to.y), Math.max(from.y, to.y)];
  if (right - left < LEAST_PX || bottom - top < LEAST_PX) return null;
  const [x, y] = [(left + right) / 2, (top + bottom) / 2];
  const dx = OUTSIDE * (right - left) + 2;
  const dy = OUTSIDE * (bottom - top) + 2;
  /** @type {At[]} */
  const beside = [
    { x: left - dx, y },
    { x: right + dx, y },
    { x, y: top - dy },
    { x, y: bottom + dy },
  ];
  const seen = beside.filter((at) => at.x >= 0 && at.y >= 0 && at.x < frame.width && at.y < frame.height);
  return [
    { frame: frame.index, x, y, label: /** @type {1} */ (1) },
    ...seen.map((at) => ({ frame: frame.index, ...at, label: /** @type {0} */ (0) })),
  ];
}
